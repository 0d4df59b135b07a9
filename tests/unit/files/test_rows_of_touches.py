"""Words of a table that say which rows are touches, and what of them was measured.

The rows are invented; what is right is what a reader of the table sees.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import FilePositions, FileReadings, ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.preview import look_at
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from pretravel.files.touches_csv import read_touches

UP = ReadingOptions(units="mm", normal=(0.0, 0.0, 1.0))


def _read(text: str, options: ReadingOptions = UP) -> FileReadings:
    return read_readings(SourceFile("a.csv", text.encode()), options)


@pytest.mark.parametrize(
    ("title", "before", "touch", "after"),
    [
        ("Type", "approach", "touch", "retract"), ("Event", "start", "trigger", "end"),
        ("Mode", "scan", "Touch", "scan"), ("Source", "nominal", "measured", "simulated"),
        ("G", "G0", "G38.2", "G0"), ("Art", "Anfahren", "Messen", "Freifahren"),
        ("Operation", "Approach", "Probe", "Retract"),
    ],
)  # fmt: skip
def test_moves_among_touches_are_left_out_and_named(
    title: str, before: str, touch: str, after: str
) -> None:
    place = f"{before},{{0}},0,9\n{touch},{{0}},0,3.00{{0}}\n{after},{{0}},0,8\n"
    found = _read(f"{title},X,Y,Z\n" + place.format(1) + place.format(2))
    assert found.touches.positions.tolist() == [[1, 0, 3.001], [2, 0, 3.002]]
    assert any(f"rows whose {title} is {before}" in said for said in found.warnings)


def test_fast_and_slow_touches_among_moves_stay_passes() -> None:
    rows = "".join(f"{kind},1,0,3\n" for kind in ("rapid", "fast", "slow", "rapid", "fast", "slow"))
    assert _read("Move,X,Y,Z\n" + rows).touches.words == {"pass": ("fast", "slow") * 2}


@pytest.mark.parametrize(
    ("title", "good", "bad"),
    [
        ("Result", "PASS", "FAIL"),
        ("OK", "Y", "N"),
        ("Status", "OK", "NG"),
        ("Check", "io", "nio"),
        ("Accepted", "yes", "no"),
        ("Flags", "0", "4"),
        ("Status", "1", "-1"),
        ("Skip input", "closed", "open"),
    ],
)
def test_rows_that_a_verdict_calls_bad_are_named(title: str, good: str, bad: str) -> None:
    rows = f"X,Y,Z,{title}\n1,0,3,{good}\n2,0,3,{bad}\n3,0,3,{good}\n"
    assert any(f"{title} is '{bad}' in line 3" in said for said in _read(rows).warnings)
    assert not any("of the touch" in said for said in _read(rows.replace(bad, good)).warnings)


@pytest.mark.parametrize("title", ["Error", "Error code", "Alarm"])
def test_rows_with_an_error_are_refused(title: str) -> None:
    with pytest.raises(InputError, match=f"line 3: {title} is '5'"):
        _read(f"X,Y,Z,{title}\n1,0,3,0\n2,0,3,5\n3,0,3,0\n")


@pytest.mark.parametrize(
    ("title", "first", "second"),
    [
        ("Z offset", "0", "0.5"), ("Scale", "1", "25.4"), ("Plane", "G17", "G18"), ("W", "0", "50"),
        ("Quill", "0", "50"), ("Remark", "", "new stylus"), ("Comment", "", "no contact"),
    ],
)  # fmt: skip
def test_what_changes_the_rows_is_refused(title: str, first: str, second: str) -> None:
    rows = f"X,Y,Z,{title}\n1,0,3,{first}\n2,0,3,{{}}\n3,0,3,{first}\n"
    with pytest.raises(InputError, match=f"line 3: {title}"):
        _read(rows.format(second))
    assert len(_read(rows.format(first)).touches) == 3


@pytest.mark.parametrize(
    ("rows", "first", "last"),
    [
        ("H,X,Y,Z\n20,1,2,3\n20,2,2,3\n21,3,2,3\n", "20", "21"),
        ("Werkzeug;Schneide;X;Y;Z\n7;1;1;2;3\n7;1;2;2;3\n7;2;3;2;3\n", "7 1", "7 2"),
        ("T;D;Punkt;X;Y;Z\n7;1;P1;1;2;3\n7;1;P2;2;2;3\n7;2;P3;3;2;3\n", "7 1", "7 2"),
        ("T=7 D=1 X=1 Y=2 Z=3\nT=7 D=1 X=2 Y=2 Z=3\nT=7 D=2 X=3 Y=2 Z=3\n", "7 1", "7 2"),
        ("D=1 X=1 Y=2 Z=3\nD=1 X=2 Y=2 Z=3\nD=2 X=3 Y=2 Z=3\n", "1", "2"),
        ("T7D1 X=1 Y=2 Z=3\nT7D1 X=2 Y=2 Z=3\nT7D2 X=3 Y=2 Z=3\n", "T7D1", "T7D2"),
        (
            "".join(f"1.2.26 10:0{i} D={max(i - 1, 1)} X={i} Y=2 Z=3\n" for i in (1, 2, 3)),
            "1", "2",
        ),
    ],
)  # fmt: skip
def test_tool_its_length_and_its_edge_are_the_tip(rows: str, first: str, last: str) -> None:
    found = _read(rows)
    assert found.touches.words["tip"] == (first, first, last)
    assert found.touches.positions[:, 0].tolist() == [1, 2, 3]


def test_a_d_that_is_no_edge_is_not_the_tip() -> None:
    found = _read("T,D,X,Y,Z\n7,8.5,1,2,3\n7,8.5,2,2,3\n")
    assert found.touches.words == {"tip": ("7", "7")}
    file = SourceFile("a.csv", b"Name,X,Y,Z,D\nHole 1,1,2,3,8\nHole 2,5,2,3,10\n")
    assert "list of features" in format_of(file).refusal
    axes = b"Name,X,Y,Z,I,J,K,D\nA,1,2,3,0,0,1,8\nB,5,2,3,0,0,1,10\n"
    assert "list of features" in format_of(SourceFile("a.csv", axes)).refusal


def test_a_code_that_changes_in_a_column_that_is_not_read_is_named() -> None:
    rows = "Kopf4;X;Y;Z\n" + "".join(f"{1 + (i > 3)};{i};2;3\n" for i in range(8))
    told = "Kopf4 is not read, and changes from '1' to '2' in line 6"
    assert any(told in said for said in _read(rows).warnings)


@pytest.mark.parametrize(
    ("title", "first", "last", "said"),
    [
        ("Temp", "27", "27", "Temp is 27 °C, and is not used"),
        ("Werkstücktemperatur", "20,1", "31,5", "is 20.1 to 31.5 °C, and is not used"),
        ("temperature_F", "68", "86", "temperature_F is 20 to 30 °C, and is not used"),
        ("Temp [°C]", "19.8", "20.3", ""),
        ("Tempo", "27", "27", ""),
    ],
)
def test_a_temperature_that_is_not_used_is_named(
    title: str, first: str, last: str, said: str
) -> None:
    rows = f"X;Y;Z;{title}\n1;2;3;{first}\n2;2;3;{first}\n3;2;3;{last}\n"
    found = [text for text in _read(rows).warnings if "°C, and is not used" in text]
    assert len(found) == (said != "")
    assert all(said in text for text in found)


def test_rows_in_comments_are_named_where_there_are_no_others() -> None:
    with pytest.raises(InputError, match="line 2: the file has no rows; comments that look like"):
        _read("; log\n;T=7 X=1 Y=2 Z=3\n;T=7 X=2 Y=2 Z=3\n")


def test_a_change_of_the_tip_among_words_is_refused() -> None:
    with pytest.raises(InputError, match="line 2: 'T7 D2' is between the rows, and may change"):
        _read("T=7 D=1 X=1 Y=2 Z=3\nT7 D2\nT=7 D=1 X=2 Y=2 Z=3\n")


def test_a_time_is_no_coordinate() -> None:
    with pytest.raises(InputError, match=r"its column 2 is a time.*such as x=5,y=6,z=7"):
        _read("30.11.26 10:00:07 T7 D1 1.5 2.5 3.5\n30.11.26 10:00:14 T7 D1 2.5 2.5 3.5\n")


@pytest.mark.parametrize(("unit", "x"), [("1/1000 mm", 1.0), ("thou", 25.4), ("mil", 25.4)])
def test_thousandths_in_titles(unit: str, x: float) -> None:
    rows = f"X [{unit}],Y [{unit}],Z [{unit}]\n1000,2000,3000\n2000,2000,3001\n"
    assert _read(rows, ReadingOptions(normal=(0, 0, 1))).touches.positions[0, 0] == x


@pytest.mark.parametrize("title", ["Direction", "Axis", "Antastrichtung", "probe dir"])
def test_directions_of_travel_in_words(title: str) -> None:
    found = _read(
        f"{title};X;Y;Z;I;J;K\n-Z;1;0;3;0;0;1\nX+;2;0;3;-1;0;0\n", ReadingOptions(units="mm")
    )
    assert found.touches.approach_directions.tolist() == [[0, 0, -1], [1, 0, 0]]


def test_the_unit_of_a_column_of_units() -> None:
    rows = "X,Y,Z,Unit\n1,0,3,inch\n2,0,3,inch\n"
    assert _read(rows, ReadingOptions(normal=(0, 0, 1))).touches.positions[0, 0] == 25.4
    with pytest.raises(InputError, match="the file is in inch"):
        _read(rows)


@pytest.mark.parametrize(
    "line", ["# DRY RUN - no probing performed", "# simulated", "Preview of the path"]
)
def test_rows_that_were_not_measured_are_named(line: str) -> None:
    told = _read(f"{line}\nX,Y,Z\n1,0,3\n2,0,3\n").warnings
    assert any(f"line 1 '{line}' says that the rows were not measured" in said for said in told)


@pytest.mark.parametrize(("z", "told"), [(3, True), (4, False)])
def test_positions_that_all_equal_their_nominal_points_are_named(z: int, told: bool) -> None:
    names = "X,Y,Z,Nom X,Nom Y,Nom Z,Nominal I,Nominal J,Nominal K\n"
    rows = f"1,0,{z},1,0,3,0,0,1\n2,0,3,2,0,3,0,0,1\n"
    found = _read(names + rows, ReadingOptions(units="mm"))
    assert found.touches.normals.tolist() == [[0, 0, 1]] * 2  # of the nominal surface
    assert any("was anything measured?" in said for said in found.warnings) == told


def test_u_v_w_are_normals_where_they_are_unit_vectors() -> None:
    rows = "Nr X Y Z U V W\n1 1 0 3 0 0 1\n2 2 0 3 0 {} 0.8\n"
    found = _read(rows.format("0.6"), ReadingOptions(units="mm"))
    assert found.touches.normals[1].tolist() == pytest.approx([0.0, 0.6, 0.8])
    with pytest.raises(InputError, match="W changes"):
        _read(rows.format("0.7"), ReadingOptions(units="mm"))


@pytest.mark.parametrize("end", ["END", "[EOF]", "2 points"])
def test_a_line_that_ends_a_table_is_named(end: str) -> None:
    found = _read(f"X,Y,Z\n1,0,3\n2,0,3\n{end}\n")
    assert len(found.touches) == 2
    assert f"line 4 '{end}'" in " ".join(found.warnings)
    with pytest.raises(InputError, match="line 4: 1 values"):
        _read("X,Y,Z\n1,0,3\n2,0,3\n3\n")


@pytest.mark.parametrize(
    ("second", "words"), [("X,Y,Z", "the header occurs again"), ("Y,X,Z", "another header")]
)
def test_a_header_among_the_rows_is_refused(second: str, words: str) -> None:
    with pytest.raises(InputError, match=f"line 3: {words}"):
        _read(f"X,Y,Z\n1,0,3\n{second}\n2,0,3\n")


def test_pages_whose_rows_are_counted_on_are_one_table() -> None:
    rows = "Nr X Y Z\n1 1 0 3\n2 2 0 3\nPAGE 2\nNr X Y Z\n{} 3 0 3\n{} 4 0 3\n"
    found = _read(rows.format(3, 4))
    assert len(found.touches) == 4
    assert "line 4 'PAGE 2', line 5 'Nr X Y Z'" in " ".join(found.warnings)
    with pytest.raises(InputError, match="line 5: the header occurs again"):
        _read(rows.format(1, 2))


@pytest.mark.parametrize("line", ["Taster: T2", "SENSOR: 2", "Part 7"])
def test_a_line_of_words_among_the_rows_that_changes_them_is_refused(line: str) -> None:
    with pytest.raises(InputError, match=f"line 3: '{line}' is between the rows"):
        _read(f"X Y Z\n1 0 3\n{line}\n2 0 3\n")


def test_a_tip_in_a_table_of_points_that_is_not_used_is_named() -> None:
    rows = "X,Y,Z,Probe radius\n1,0,3,3\n2,0,3,3\n"
    said = "gives the tip a diameter of 6 mm (line 2), which is not used"
    for options in (replace(UP, of_surface=True), UP):
        assert said in " ".join(_read(rows, options).warnings)
    assert "not used" not in " ".join(_read(rows, replace(UP, tip_radius=3.0)).warnings)


def test_a_log_of_a_simulation_is_named() -> None:
    log = "[SIM] G38.2 Z-9 F9\n[SIM] [PRB:1.0,2.0,3.0:1]\n"
    told = _read(log, ReadingOptions(units="mm", normal=(0, 0, 1), offset=(0, 0, 0))).warnings
    assert any("says that the rows were not measured" in said for said in told)


def test_a_comma_that_cannot_group_thousands_is_the_decimal_sign() -> None:
    found = _read("X;Y;Z;Abw.\n10,123;20,123;1,503;0,003\n20,123;20,123;1,502;0,002\n")
    assert found.touches.positions[0].tolist() == [10.123, 20.123, 1.503]


@pytest.mark.parametrize(("zero", "told"), [(4, True), (0, False)])
def test_a_height_of_exactly_0_apart_from_the_others_is_named(zero: int, told: bool) -> None:
    heights = [0.012, 0.011, 0.013, 0.012, 0.014, 0.011]
    heights[zero] = 0
    rows = "".join(f"{9 * (i % 3)},{9 * (i // 3)},{z}\n" for i, z in enumerate(heights))
    said = "the height of line 6 is exactly 0"
    assert any(said in each for each in _read("X,Y,Z\n" + rows).warnings) == told


@pytest.mark.parametrize(
    ("header", "role"),
    [
        ("序号,X坐标,Y坐标,Z坐标,法向X,法向Y,法向Z", "normals"),
        ("Punto,Quota X,Quota Y,Quota Z,Normale X,Normale Y,Normale Z", "normals"),
        ("点号,X实测,Y实测,Z实测,X标称,Y标称,Z标称", "nominal_points"),
        ("Nr,X zmierzone,Y zmierzone,Z zmierzone,X nominalne,Y nominalne,Z nominalne",
         "nominal_points"),
    ],
)  # fmt: skip
def test_titles_in_other_languages(header: str, role: str) -> None:
    options = UP if role == "nominal_points" else ReadingOptions(units="mm")
    found = _read(f"{header}\n1,1,2,3.1,0,0,1\n2,5,2,3.1,0,0,1\n", options).touches
    assert found.positions[1].tolist() == [5, 2, 3.1]
    assert getattr(found, role)[1].tolist() == [0, 0, 1]


def test_a_title_of_unknown_words_is_no_coordinate() -> None:
    with pytest.raises(InputError, match="names no coordinate"):
        _read("Xбаза,Yбаза,Zбаза\n1,2,3\n2,2,3\n")


def test_a_minus_between_two_numbers_is_asked_for() -> None:
    """Controls print blanks for leading zeros after the sign, next to the number before."""
    with pytest.raises(InputError, match=r"line 1: is the minus of '128.474- 91.200' that of the"):
        _read("   128.474-   91.200    12.005\n   130.474-   91.207    12.003\n")
    found = _read("128.474- 91.200 12.005-\n130.474 91.207 12.003-\n").touches
    assert found.positions.tolist() == [[-128.474, 91.2, -12.005], [130.474, 91.207, -12.003]]


def test_a_log_of_misses_alone_can_be_looked_at() -> None:
    file = SourceFile("a.log", b"[PRB:1.0,2.0,3.0:0]\n[PRB:2.0,2.0,3.0:0]\n")
    found, _ = look_at(file, ReadingOptions(units="mm"), format_of(file))
    assert isinstance(found, FilePositions)
    assert len(found.misses()) == 2


def test_coordinates_in_rows_are_refused() -> None:
    with pytest.raises(InputError, match="line 1: the table has its coordinates in rows"):
        _read("Point,1,2,3\nX,1.0,2.0,3.0\nY,2.0,2.0,2.0\nZ,3.1,3.2,3.3\n")


def test_a_column_of_heights_is_z() -> None:
    assert _read("X,Y,Height\n1,2,3\n2,2,3.5\n").touches.positions[1, 2] == 3.5


@pytest.mark.parametrize("title", ["Trig", "Skip", "MPos", "Machine", "Work"])
def test_further_names_of_measured_positions(title: str) -> None:
    found = _read(f"{title} X,{title} Y,{title} Z,Stop X,Stop Y,Stop Z\n1,0,3,1,0,2\n2,0,3,2,0,2\n")
    assert found.touches.positions[1].tolist() == [2, 0, 3]


@pytest.mark.parametrize(
    "innocent",
    [
        "Datum: 01.12.2026", "M6 Bohrung", "reference sphere 25 mm", "Kugel 25 mm Nr. 4711",
        "Best-fit sphere: d = 30.974 mm", "with reference to drawing 4711", "Order: Z-4711",
    ],
)  # fmt: skip
def test_remarks_that_change_nothing_stop_no_run(tmp_path: Path, innocent: str) -> None:
    """A day, a thread, the certificate's sphere, a result: among and below the rows."""
    path = tmp_path / "touches.csv"
    rows = [f"{x},{y},0,{-x / 10},{-y / 10},0" for x, y in ((10, 0), (0, 10), (-10, 0), (0, -10))]
    rows[2:2] = [f"# {innocent}"]
    path.write_text("\n".join(["x_mm,y_mm,z_mm,nx,ny,nz", *rows, f"# {innocent}"]))
    assert len(read_touches(path, ReadingOptions(reference_diameter=24.0, ring=True))) == 4
