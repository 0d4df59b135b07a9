"""Laws of all file formats: a new format is tested once an entry point lists it.

A text format that is read needs a file in `tests.support.control_logs.SAMPLES`.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.errors import InputError, PretravelError
from pretravel.files.csv_table import read_csv_table
from pretravel.files.file_format import FileFormat, FileReadings, ReadingOptions
from pretravel.files.format_registry import FORMATS, format_of
from pretravel.files.readings import read_readings, write_readings
from pretravel.files.source_file import SourceFile
from pretravel.tasks.convert import Convert
from pretravel.touches import WORD_COLUMNS, Touches, word_fields
from tests.support.control_logs import SAMPLES
from tests.support.inserted_statements import INSERTED, UNKNOWN, WITHOUT_LINES, inserted

WRITTEN = [
    (f, ending) for f in FORMATS.values() if f.write_touches is not None for ending in f.endings
]
READ_TEXT = [f for f in FORMATS.values() if (f.parse or f.parse_features) and not f.binary]
TWELVE_DIGITS = 1e-7
"""Of coordinates up to 10 m in CSV cells with twelve significant digits. [mm]"""


@st.composite
def _some_touches(draw: st.DrawFn) -> Touches:
    count = draw(st.integers(1, 4))
    coordinate = st.floats(-1e4, 1e4, allow_subnormal=False)
    point = st.tuples(coordinate, coordinate, coordinate)
    angles = st.tuples(st.floats(0.0, np.pi), st.floats(0.0, 2.0 * np.pi))

    def rows(strategy: st.SearchStrategy[object]) -> FloatArray:
        return np.array(draw(st.lists(strategy, min_size=count, max_size=count)), dtype=np.float64)

    polar, azimuth = rows(angles).T
    return Touches(
        rows(point),
        from_angles(polar, azimuth),
        labels=tuple(f"p{i + 1}" for i in range(count)),
        nominal_points=rows(point),
        feeds=rows(st.floats(1.0, 1e4)),
    )


def _name(value: object) -> str:
    return value.name if isinstance(value, FileFormat) else str(value)


@pytest.mark.parametrize(("known", "ending"), WRITTEN, ids=_name)
@given(touches=_some_touches())
@settings(max_examples=20, deadline=None)
def test_touches_that_are_written_are_read(
    known: FileFormat, ending: str, touches: Touches
) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"touches{ending}"
        write_readings(path, touches, 3.0)
        assert format_of(path) is known
        again = read_readings(path, ReadingOptions(units="mm")).touches
    assert again.positions == pytest.approx(touches.positions, abs=TWELVE_DIGITS)
    # Formats print normals, and readers scale them to length one: the last digits of a double.
    assert again.normals == pytest.approx(touches.normals, abs=1e-11)
    assert again.labels == touches.labels
    if again.nominal_points is not None:
        assert again.nominal_points == pytest.approx(touches.nominal_points, abs=TWELVE_DIGITS)
    if known.keeps_approaches_and_feeds:
        assert again.feeds == pytest.approx(touches.feeds, rel=1e-11)
        assert again.approach_directions == pytest.approx(touches.approach_directions, abs=1e-11)


@pytest.mark.parametrize(("known", "ending"), WRITTEN, ids=_name)
def test_columns_are_kept_or_named(known: FileFormat, ending: str, tmp_path: Path) -> None:
    words = dict.fromkeys(WORD_COLUMNS, ("a", "b")) | {"tip": ("t", "t")}
    points = np.array([[0.0, 0.0, 3.0], [9.0, 0.0, 3.0]])
    touches = Touches(
        points, [[0, 0, 1]] * 2, nominal_points=points - [0, 0, 3], **word_fields(words)
    )
    write_readings(tmp_path / "all.csv", touches)
    path = tmp_path / f"touches{ending}"
    written = Convert(touches=str(tmp_path / "all.csv"), tip_diameter=6.0, output=path).run()
    written.write("output", path)
    said = " ".join(written.cautions)
    again = read_readings(path, ReadingOptions(units="mm")).touches
    for column in WORD_COLUMNS:
        assert column in again.words or f"the column {column}" in said
    assert again.nominal_points is not None or "nominal points" in said
    assert read_readings(path, ReadingOptions(units="mm")).tip_radius or "diameter, 6 mm" in said
    if not known.keeps_approaches_and_feeds:  # it states one radius
        with pytest.raises(PretravelError, match="the touches are of 2 tips"):
            write_readings(path, replace(touches, tips=("t", "u")), 3.0)


def test_every_text_format_has_a_sample() -> None:
    assert {known.name for known in READ_TEXT} == set(SAMPLES)


@pytest.mark.parametrize("known", READ_TEXT, ids=_name)
@pytest.mark.parametrize(
    "change",
    [
        lambda text: text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\n\n"),
    ],
    ids=["as it is", "line ends of Windows", "byte-order mark", "empty lines"],
)
def test_a_sample_is_recognised_and_read(known: FileFormat, change: object) -> None:
    text, options = SAMPLES[known.name]
    file = SourceFile("sample", change(text).encode())  # type: ignore[operator]
    assert format_of(file) is known
    if known.parse_features is not None and known.name != "qif":  # its sample has points alone
        assert known.parse_features(file, options or ReadingOptions())
    if known.parse is None:
        with pytest.raises(InputError, match="no touches"):
            read_readings(file, options)
        return
    readings = read_readings(file, options)
    assert isinstance(readings, FileReadings)
    assert len(readings.touches) > 0
    assert readings.touches.source == "sample"


@pytest.mark.parametrize("known", READ_TEXT, ids=_name)
def test_a_file_says_what_it_needs(known: FileFormat) -> None:
    """Without the data that it lacks, a file is refused; the message names file and data."""
    text, options = SAMPLES[known.name]
    file = SourceFile("sample", text.encode())
    if "decimal" not in known.takes and known.parse is not None:
        with pytest.raises(InputError, match="decimal is not used for a file of format"):
            read_readings(file, replace(options or ReadingOptions(), decimal="comma"))
    if known.own_unit or known.name in ("qif", "cmm-listing", "trip-map"):
        given = options or ReadingOptions()
        assert len(read_readings(file, replace(given, units="mm")).touches) > 0
        with pytest.raises(InputError, match="leave the unit out"):
            read_readings(file, replace(given, units="inch"))
    if known.self_contained:
        assert len(read_readings(file).touches) > 0
        return
    with pytest.raises(InputError, match=r"^sample: .*pretravel convert"):
        read_readings(file)


@pytest.mark.parametrize("known", READ_TEXT, ids=_name)
def test_other_bytes_are_refused(known: FileFormat) -> None:
    parse = known.parse or known.parse_features
    assert parse is not None
    for content in (b"", b"\n\n", bytes(range(256)), b"hello\n"):
        with pytest.raises(InputError, match=r"^other"):
            parse(SourceFile("other", content), SAMPLES[known.name][1] or ReadingOptions())


def test_statements_are_inserted_into_every_text_format() -> None:
    formats = {known.name for known in READ_TEXT}
    assert {name for name, *_ in INSERTED} | WITHOUT_LINES == formats


@pytest.mark.parametrize(("name", "kind", "line"), INSERTED)
def test_a_statement_that_changes_rows_is_carried_or_refused(
    name: str, kind: str, line: str
) -> None:
    """Inserted between rows of the format's sample: a column tells them apart, or it is refused."""
    before, options = SAMPLES[name]
    text, number = inserted(name, before, line)
    plain = read_readings(SourceFile("sample", inserted(name, before, "")[0].encode()), options)
    try:
        found = read_readings(SourceFile("sample", text.encode()), options)
    except InputError as error:
        assert "sample" in str(error)  # noqa: PT017
        assert f"line {number}" in str(error) or "one radius" in str(error)  # noqa: PT017
        return
    assert len(found.touches) <= len(plain.touches)
    told_apart = {column: len(set(words)) for column, words in found.touches.words.items()}
    assert max(told_apart.values(), default=1) > 1, (kind, line)


@pytest.mark.parametrize("name", sorted(UNKNOWN))
def test_an_unknown_statement_among_the_rows_is_named(name: str) -> None:
    before, options = SAMPLES[name]
    text, number = inserted(name, before, UNKNOWN[name])
    try:
        notes = read_readings(SourceFile("sample", text.encode()), options).notes()
    except InputError as error:
        assert f"line {number}" in str(error)  # noqa: PT017
        return
    assert any(f"line {number}" in note for note in notes)


@pytest.mark.parametrize("known", [f for f in READ_TEXT if f.statements], ids=_name)
def test_declared_statements_do_what_they_declare(known: FileFormat) -> None:
    before, options = SAMPLES[known.name]
    rows = inserted(known.name, before, "")[0]
    plain = read_readings(SourceFile("sample", rows.encode()), options)
    for statement in known.statements:
        if not statement.example:
            continue
        text, number = inserted(known.name, before, statement.example)
        file = SourceFile("sample", text.encode())
        if statement.then == "refused":
            with pytest.raises(InputError, match=rf"line {number}\b"):
                read_readings(file, options)
            continue
        try:
            found = read_readings(file, options)
        except InputError as error:  # the radius of one tip was stated
            assert "one radius" in str(error)  # noqa: PT017
            assert statement.means == "tip"
            continue
        assert len(found.touches) == len(plain.touches), statement.words
        if statement.then in ("harmless", "named"):
            assert found.touches.words == plain.touches.words, statement.words
            named = any(f"line {number}" in note for note in found.notes())
            assert named == (statement.then == "named"), statement.words
        else:
            words = found.touches.words[statement.means]
            assert len(set(words)) > 1, statement.words


@pytest.mark.parametrize("known", READ_TEXT, ids=_name)
def test_a_number_of_python_is_no_number(known: FileFormat) -> None:
    """1_0 is ten in a program of Python: such a row is refused or named, its value never taken."""
    text, options = SAMPLES[known.name]
    if known.parse is None:
        return
    plain = read_readings(SourceFile("sample", text.encode()), options)
    places = [found.start() + 1 for found in re.finditer(r"\d(?=\d)", text)]
    for place in places[:: max(len(places) // 25, 1)]:
        file = SourceFile("sample", f"{text[:place]}_{text[place:]}".encode())
        try:
            found = read_readings(file, options)
        except InputError:
            continue
        if len(found.touches) < len(plain.touches):
            assert found.notes() != plain.notes(), text[place - 20 : place + 20]
        else:  # of what is not used, such as a time
            assert np.array_equal(found.touches.positions, plain.touches.positions)


@pytest.mark.parametrize("cell", ["1_0", "1_0.5", "-1_0"])
@pytest.mark.parametrize("text", ["x_mm,y_mm,z_mm,nx,ny,nz\n{0},0,0,1,0,0\n",
                                  "machine_index,probe_index,error_um\n1,1,{0}\n",
                                  "label,x_mm,y_mm,z_mm,u_um\na,{0},0,0,1\n"])  # fmt: skip
def test_a_number_of_python_is_no_number_of_a_table(cell: str, text: str) -> None:
    """Numpy read it as ten where all columns have their names."""
    table = read_csv_table(SourceFile("a.csv", text.replace("{0}", cell).encode()))
    name = "error_um" if "error_um" in table.columns else "x_mm"
    with pytest.raises(InputError, match=f"'{cell}', which is not a finite number"):
        table.numbers(name)
