"""A shop's own table of touches is read as it is; what is not clear is refused, with what to do."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.base.errors import InputError, PretravelError
from pretravel.files.column_names import column_name
from pretravel.files.file_format import FilePositions, ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.map_file import read_map
from pretravel.files.preview import look_at
from pretravel.files.readings import read_readings
from pretravel.files.several_files import files_of, read_series
from pretravel.files.source_file import SourceFile
from pretravel.files.table_formats import CSV
from pretravel.files.tables import write_parquet_table
from pretravel.files.touches_csv import read_touches
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches
from tests.support.commands import rows, run
from tests.support.control_logs import written
from tests.support.examples import EXAMPLES
from tests.support.reference_touches import sphere_touches

INCH = 25.4
POSITIONS = np.array([[12.25, -1.5, 3.0625], [0.5, 1031.125, -0.03125], [-7.0, 0.0, 2.5]])
NORMALS = np.array([[0.0, 0.6, 0.8], [-1.0, 0.0, 0.0], [0.0, -0.28, 0.96]])
"""Numbers that few decimals state without rounding."""
HEADERS = {
    "own": "x_{unit},y_{unit},z_{unit},nx,ny,nz",
    "letters": "X,Y,Z,I,J,K",
    "german": "X-Ist [{unit}],Y-Ist [{unit}],Z-Ist [{unit}],Normale X,Normale Y,Normale Z",
    "spaced": "Pos X ({unit}),Pos Y ({unit}),Pos Z ({unit}),NX,NY,NZ",
    "none": "",
}
UNIT_STATED = {"own", "german", "spaced"}


def _rows(separator: str, decimal: str, quoted: bool) -> list[str]:
    cells = [
        [f"{value:.5f}".replace(".", decimal) for value in (*position, *normal)]
        for position, normal in zip(POSITIONS, NORMALS, strict=True)
    ]
    mark = '"' if quoted else ""
    return [separator.join(f"{mark}{cell}{mark}" for cell in row) for row in cells]


GRID = [
    (separator, decimal, header, unit, encoding)
    for (separator, decimal), header, unit, encoding in product(
        [(";", ","), (";", "."), ("\t", ","), ("\t", "."), (",", "."), (" ", ","), (" ", "."),
         ("|", ","), ('","', ",")],
        HEADERS,
        ["mm", "in"],
        ["utf-8", "utf-8-sig", "utf-16", "cp1252"],
    )
]  # fmt: skip


@pytest.mark.parametrize(("separator", "decimal", "header", "unit", "encoding"), GRID)
def test_every_form_gives_the_same_touches(
    separator: str, decimal: str, header: str, unit: str, encoding: str
) -> None:
    quoted, separator = separator == '","', "," if separator == '","' else separator
    names = HEADERS[header].format(unit=unit).split(",") if HEADERS[header] else []
    names = [f'"{n}"' if separator == " " and " " in n else n for n in names]
    lines = ["# Prüfkörper 25", *([separator.join(names)] if names else [])]
    text = "\r\n".join([*lines, *_rows(separator, decimal, quoted), "", ""])
    stated = None if header in UNIT_STATED else {"mm": "mm", "in": "inch"}[unit]
    touches = read_touches(SourceFile("a.csv", text.encode(encoding)), ReadingOptions(units=stated))
    scale = INCH if unit == "in" else 1.0
    assert touches.positions == pytest.approx(scale * POSITIONS, rel=1e-15)  # one rounding
    assert touches.normals == pytest.approx(NORMALS, rel=1e-15)
    if header != "own" or separator != "," or unit == "in":
        for word in ("comma" if decimal == "," else "point", "inch" if unit == "in" else "mm"):
            assert word in touches.reading


@pytest.mark.parametrize(
    ("text", "labels"),
    [
        ("Protokoll;;;;;;\nNr;X;Y;Z;I;J;K\n;mm;mm;mm;-;-;-\n1;0,5;0;3;0;0;1\n;;;;;;\n", ("1",)),
        ("#;X;Y;Z;I;J;K\n1;0,5;0;3;0;0;1\n", ("1",)),
        (";X;Y;Z;I;J;K\n7;0,5;0;3;0;0;1\n", ("7",)),
        ("N10 X0.5 Y0 Z3 I0 J0 K1\n", ("10",)),
        ("X0.5,Y0,Z3,I0,J0,K1\n", None),
        ("(a probe)\n0.5,0,3,0,0,1\n", None),
        ("; a probe\n0.5 0 3 0 0 1\n", None),
        ("sep=;\nName;X;Y;Z;I;J;K;\nPol;0,5;0;3;0;0;1;\n", ("Pol",)),
        ("// X Y Z Nx Ny Nz\n0.5 0 3 0 0 1\n", None),
        ("# unit: mm\n# x y z nx ny nz\n5e-1 0 3 0 0 1\n", None),
        ("P1, X=0.5, Y=0, Z=3, I=0, J=0, K=1\n", ("P1",)),
        ("P1 0.5 0 3 0 0 1\n", ("P1",)),
        ("|Nr|X|Y|Z|I|J|K|\n|---|---|---|\n| 7 | 0.5 | 0 | 3 | 0 | 0 | 1 |\n", ("7",)),
        ("\"X\n[mm]\";\"Y\n[mm]\";\"Z\n[mm]\";I;J;K\n0,5;0;3;0;0;1\n", None),
        ("  Point   X [mm]   Y [mm]   Z [mm]   I  J  K\n  A   0.5   0.0  3.0   0  0  1\n", ("A",)),
        ("Punkt;X-Soll;Y-Soll;Z-Soll;X-Ist;Y-Ist;Z-Ist;I;J;K\nA;0,5;0;0;0,5;0;3;0;0;1\n", ("A",)),
        ("N°;X (mm);Y (mm);Z (mm);Normale X;Normale Y;Normale Z\n1;0,5;0;3;0;0;1\n", ("1",)),
        ("X;Y;Z;I;J;K\n0,5;0;3;0;0;1\n", None),
        ("X;Y;Z;I;J;K\n0,5;\u22120;3;0;0;1\n", None),
    ],
)  # fmt: skip
def test_forms_of_other_programs(text: str, labels: tuple[str, ...] | None) -> None:
    found = read_readings(SourceFile("a.txt", text.encode()), ReadingOptions(units="mm"))
    assert found.touches.positions.tolist() == [[0.5, 0.0, 3.0]]
    assert found.touches.normals.tolist() == [[0.0, 0.0, 1.0]]
    assert found.touches.labels == labels


@pytest.mark.parametrize(
    ("name", "role", "unit"),
    [
        ("X", "x", None), ("x_in", "x", "inch"), ("Z [mm]", "z", "mm"), ("Y-Ist", "y", None),
        ("PosX", "x", None), ("Soll X [mm]", "nominal_x", "mm"),
        ("nominal_z_mm", "nominal_z", "mm"),
        ("K", "nz", None), ("NormalY", "ny", None), ("Nx", "nx", None), ("ax", "ax", None),
        ("F", "feed", None), ("Vorschub [mm/min]", "feed", "mm/min"),
        ("spindle_deg", "spindle", "deg"), ("Spindle angle [°]", "spindle", "deg"),
        ("spindle angle [rad]", "spindle", "rad"), ("C [rad]", "c", "rad"),
        ("Spindel [°]", "spindle", "deg"), ("Spindel", None, None),
        ("Spindle", None, None),
        ("feed_mm_min", "feed", "mm/min"),
        ("Avance (mm/min)", "feed", "mm/min"), ("Punkt-Nr.", "label", None), ("#", "label", None),
        ("Datum", None, None), ("dX", None, None), ("u_um", None, None), ("start_x_mm", None, None),
    ],
)  # fmt: skip
def test_names_of_columns(name: str, role: str | None, unit: str | None) -> None:
    assert (column_name(name).role, column_name(name).unit) == (role, unit)


HEAD = "X;Y;Z;I;J;K\n"


@pytest.mark.parametrize(
    ("text", "stated", "words"),
    [
        (HEAD + "1,5;2;3;0;0;1\n", {"units": None}, "does not give its unit of length"),
        (HEAD + "1,234;5,678;9,125;0;0;1\n", {}, "line 2: '1,234' can be a number with three"),
        (HEAD + "1.234,5;2;3;0;0;1\n", {}, "line 2: '1.234,5' has separators of thousands"),
        (HEAD + "1,5;2.5;3;0;0;1\n", {}, "line 2: '1,5' has a comma and '2.5'"),
        (HEAD + "1,5;2,5;3;0;0;1\n1,5;bad;3;0;0;1\n", {}, "line 3: Y is 'bad'"),
        (HEAD + "1,5;2,5;;0;0;1\n", {}, "line 2: Z is empty"),
        (HEAD + "1,5;2,5;3\n", {}, "line 2: 3 values, but the header names 6"),
        ("X,Y,Z,I,J,K\n1,5,2,5,3,5,0,0,0,0,1,0\n", {}, "save the table with semicolons"),
        ("X [mm];Y [in];Z [mm];I;J;K\n1;2;3;0;0;1\n", {}, "different units"),
        ("X [in];Y [in];Z;I;J;K\n1;2;3;0;0;1\n", {}, "the file is in inch, but mm was given"),
        ("# units: mm\n# units: inch\n" + HEAD + "1;2;3;0;0;1\n", {}, "several units"),
        ("X;X;Z;I;J;K\n1;2;3;0;0;1\n", {}, "X occurs twice; give its number: x=1 or x=2"),
        ("X;X-Ist;Y;Z;I;J;K\n1;1;2;3;0;0;1\n", {}, "'X' and 'X-Ist' can both be x"),
        ("1;2;3;0;0\n", {}, "no header and 5 columns"),
        ("1.5;2;3;4\n", {}, "not a label or a running number"),
        ("1 2 3 0 0 1\n4 bad 6 0 0 1\n", {}, "line 2: column 2 is 'bad'"),
        ("1 bad 3\n4 5 6\n", {}, "line 1: 'bad' is not a number"),
        (HEAD + "1;2;3;10;20;30\n" * 3, {}, "I, J, K are not unit vectors"),
        ("A;B;C\n1;2;3\n", {}, "names no coordinate: A, B, C. Give the columns"),
        ("P,X1,Y1,Z1,X2,Y2,Z2\n1,2,3,4,2,3,5\n2,5,3,4,5,3,4\n", {}, "each repeat in a row of its"),
        (HEAD + "1;2;3;0;0;1\n", {"columns": {"x": "W"}}, "the column 'W', given as x, is not"),
        (HEAD + "1;2;3;0;0;1\n", {"columns": {"q": "X"}}, "no quantity 'q'"),
        (HEAD + "1;2;3;0;0;1\n", {"exclude": ("9",)}, "no touch with the label or on the line '9'"),
        (HEAD + "1;2;3;0;0;1\n", {"exclude": ("2",)}, "rows"),
        ('X;Y;Z;I;J;K;Name\n1;2;3;0;0;1;"a\nM3 S9"\n', {}, "line 2: the label 'a\\nM3 S9'"),
        ("X;Y;Z;I;J;K;Name\n1;2;3;0;0;1;a\x0bb\n", {}, "control character"),
        ('X;Y;Z;I;J;K\n"1;2;3;0;0;1\n' + "1;2;3;0;0;1\n" * 8, {}, "line 2: a quoted cell"),
        ("x_mm,y_mm,z_mm,nx,ny,nz,pretravel_um\n1,2,3,0,0,1,5\n", {}, "not touches"),
        (HEAD + "1'234,5;2;3;0;0;1\n", {}, "separators of thousands"),
        (HEAD + "1\u00a0234,5;2;3;0;0;1\n", {}, "separators of thousands"),
        ("X Y Z I J K\n1,5, 2,5, 3,5, 0,0, 0,0, 1,0\n", {}, "are there decimal commas"),
        (HEAD + "1,5;2;3;0;0;1\n" + HEAD, {}, "line 3: the header occurs"),
        (HEAD + "1,5;2;3;0;0;1\nEnde;1\n", {}, "line 3: 2 values, but the header names 6"),
        ("hello\n", {}, "'hello' is neither a header"),
    ],
)  # fmt: skip
def test_what_is_not_clear_is_refused(text: str, stated: dict[str, object], words: str) -> None:
    options = replace(ReadingOptions(units="mm"), **stated)
    with pytest.raises(InputError) as error:
        read_touches(SourceFile("a.csv", text.encode()), options)
    assert words in str(error.value)
    assert str(error.value).startswith("a.csv")


def test_what_is_stated_is_taken() -> None:
    grouped = SourceFile("a.csv", (HEAD + "1,234;5,678;9,125;0;0;1\n").encode())
    read = read_touches(grouped, ReadingOptions(units="mm", decimal="comma"))
    assert read.positions.tolist() == [[1.234, 5.678, 9.125]]
    turned = SourceFile("a.csv", b"A;B;C;D;E;F;G\n1;2;3;0;0;-1;7\n")
    columns = {"x": "C", "y": "2", "z": "a", "nx": "D", "ny": "E", "nz": "-F", "label": "G"}
    read = read_touches(turned, ReadingOptions(units="mm", columns=columns))
    assert read.positions.tolist() == [[3.0, 2.0, 1.0]]
    assert read.normals.tolist() == [[0.0, 0.0, 1.0]]
    assert read.labels == ("7",)
    assert "nz=-F" in read.reading
    left_out = SourceFile("a.csv", (HEAD + "1;2;3;0;0;1\n1;x;3;0;0;1\nend\n").encode())
    read = read_touches(left_out, ReadingOptions(units="mm", exclude=("3", "a.csv:4")))
    assert len(read) == 1


def test_a_label_comes_before_a_line() -> None:
    text = "Nr;X;Y;Z;I;J;K\n3;1;0;0;0;0;1\n4;2;0;0;0;0;1\n5;3;0;0;0;0;1\n"
    read = read_touches(
        SourceFile("a.csv", text.encode()), ReadingOptions(units="mm", exclude=("3",))
    )
    assert read.labels == ("4", "5")


def test_feeds_in_the_unit_of_the_file() -> None:
    text = "X;Y;Z;I;J;K;F{}\n1;2;3;0;0;1;10\n"
    for unit, feed in (("", 254.0), (" [mm/min]", 10.0), (" [ipm]", 254.0), (" [mm/s]", 600.0)):
        file = SourceFile("a.csv", text.format(unit).encode())
        assert read_touches(file, ReadingOptions(units="inch")).feeds == pytest.approx([feed])
        words = SourceFile(
            "a.csv", file.content.replace(b"1;2;3;", b"X1;Y2;Z3;").replace(b";10\n", b";F10\n")
        )
        again = read_touches(words, ReadingOptions(units="inch"))
        assert again.feeds == pytest.approx([feed])
        assert again.positions[0] == pytest.approx([25.4, 50.8, 76.2])
    slow = SourceFile("a.csv", text.format("").replace(";10", ";9").encode())
    with pytest.raises(InputError, match=r"at most 9, .* in which unit .* F \[mm/s\]"):
        read_touches(slow, ReadingOptions(units="mm"))


def test_rounded_normals_are_unit_vectors() -> None:
    text = HEAD + "0;0;0;0,58;0,58;0,58\n"  # length 1.0046
    found = read_readings(SourceFile("a.csv", text.encode()), ReadingOptions(units="mm"))
    assert np.linalg.norm(found.touches.normals[0]) == pytest.approx(1.0, abs=1e-15)
    assert "2 decimals" in found.warnings[0]


def test_labels_of_parquet_are_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    names = ("x_mm", "y_mm", "z_mm", "nx", "ny", "nz")
    values = {name: [1.0 if name == "nz" else 0.0] for name in names}
    write_parquet_table(path, {**values, "label": ["a\nG801 N1"]})
    with pytest.raises(InputError, match=r"line 1: the label .* contains a control"):
        read_touches(path)


class TestOnASphere:
    def _text(self, touches: Touches, normals: float | None) -> bytes:
        cells = touches.positions
        if normals is not None:
            cells = np.hstack([cells, normals * touches.normals])
        return "".join(" ".join(f"{v:.7f}" for v in row) + "\n" for row in cells).encode()

    def _touches(self) -> Touches:
        return read_touches(EXAMPLES / "sphere_touches.csv")

    def test_travel_instead_of_normals(self) -> None:
        file = SourceFile("a.xyz", self._text(self._touches(), -1.0))
        options = ReadingOptions(reference_diameter=25.0)
        with pytest.raises(InputError, match=r"Turn them: nx=-4,ny=-5,nz=-6"):
            read_readings(file, options)
        turned = replace(options, columns={"nx": "-4", "ny": "-5", "nz": "-6"})
        found = read_readings(file, turned).touches
        assert found.normals == pytest.approx(self._touches().normals, abs=1e-6)

    def test_a_ring_that_is_read_as_a_sphere(self) -> None:
        """Its outward normals point to the middle, as directions of travel on a sphere do."""
        angle = np.radians(np.arange(0.0, 360.0, 30.0))
        n = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
        text = self._text(Touches(22.0 * n, -n), 1.0)
        with pytest.raises(InputError, match="is the reference a ring gauge"):
            read_readings(SourceFile("a.xyz", text), ReadingOptions(reference_diameter=50.0))
        sphere = self._text(self._touches(), -1.0)
        with pytest.raises(InputError) as refused:
            read_readings(SourceFile("a.xyz", sphere), ReadingOptions(reference_diameter=25.0))
        assert "ring" not in str(refused.value)

    def test_travel_at_nominal_points(self) -> None:
        part = read_touches(EXAMPLES / "part_touches.csv")
        assert part.nominal_points is not None
        cells = np.hstack([part.positions, -part.normals, part.nominal_points])
        names = "x_mm,y_mm,z_mm,nx,ny,nz,nominal_x_mm,nominal_y_mm,nominal_z_mm\n"
        text = names + "".join(",".join(map(str, row)) + "\n" for row in cells.tolist())
        with pytest.raises(InputError, match="directions of travel"):
            read_touches(SourceFile("a.csv", text.encode()))
        # The control subtracted the tip: points 15 µm behind their nominal ones.
        surface = part.nominal_points - 0.015 * part.normals
        cells = np.hstack([surface, part.normals, part.nominal_points])
        text = names + "".join(",".join(map(str, row)) + "\n" for row in cells.tolist())
        with pytest.raises(InputError, match="subtracted from them already"):
            read_touches(SourceFile("a.csv", text.encode()))

    def test_normals_of_the_fitted_sphere(self) -> None:
        touches = self._touches()
        file = SourceFile("a.xyz", self._text(touches, None))
        found = read_readings(file, ReadingOptions(reference_diameter=24.9987))
        turn = np.arccos(np.clip(np.sum(found.touches.normals * touches.normals, axis=1), -1, 1))
        # The file's directions were those about the nominal centre, a few µm from the fitted one.
        assert np.degrees(turn.max()) < 0.1
        assert "the normals of the sphere fitted" in found.warnings[0]
        maps = [
            qualify(t, diameter=24.9987, tip_diameter=6.0, kind="harmonic").pretravel_map
            for t in (touches, found.touches)
        ]
        known, fitted = (m.pretravel(touches.normals, extrapolate=True) for m in maps)
        u = maps[0].standard_uncertainty(touches.normals)
        assert np.abs(fitted - known).max() < u.max()

    def test_one_stray_touch_does_not_turn_the_normals(self) -> None:
        touches = self._touches()
        positions = touches.positions.copy()
        positions[7] += 1.0 * touches.normals[7]
        found = FilePositions("a.xyz", positions, tuple(range(1, len(positions) + 1)))
        text = self._text(replace(touches, positions=positions), None)
        read = read_readings(SourceFile("a.xyz", text), ReadingOptions(reference_diameter=25.0))
        turn = np.arccos(np.clip(np.sum(read.touches.normals * touches.normals, axis=1), -1, 1))
        assert len(read.touches) == len(found.positions)
        assert np.degrees(turn.max()) < 0.1

    def test_a_small_patch_gives_no_normals(self) -> None:
        n = sphere_pattern_25()
        n = n / np.array([8.0, 8.0, 1.0])
        n[:, 2] = np.sqrt(1.0 - n[:, 0] ** 2 - n[:, 1] ** 2)
        noise = 0.001 * np.random.default_rng(1).standard_normal(25)
        file = SourceFile("a.xyz", self._text(sphere_touches(noise, n), None))
        with pytest.raises(PretravelError, match="do not determine the centre"):
            read_readings(file, ReadingOptions(reference_diameter=25.0))

    def test_two_places_of_the_sphere_in_one_file(self) -> None:
        text = b"".join(
            self._text(replace(one, positions=one.positions + np.array([shift, 0.0, 0.0])), None)
            for one in [self._touches()]
            for shift in (0.0, 200.0)
        )
        with pytest.raises(PretravelError, match="further than on one sphere of 25 mm"):
            read_readings(SourceFile("a.xyz", text), ReadingOptions(reference_diameter=25.0))

    def test_positions_want_a_plan_elsewhere(self) -> None:
        file = SourceFile("a.xyz", self._text(self._touches(), None))
        with pytest.raises(InputError, match="give the plan that was run") as error:
            read_readings(file, ReadingOptions(units="mm"))
        assert error.value.inputs == ("feature", "plan", "nominal", "normal", "columns")


class TestSeveralFiles:
    def _write(self, folder: Path) -> list[Path]:
        paths = []
        for number in (9, 10):
            path = folder / f"run_{number}.csv"
            path.write_text(f"X;Y;Z;I;J;K\n{number},5;0;3;0;0;1\n{number},7;0;3;0;0;1\n")
            paths.append(path)
        return paths

    def test_folder_wildcard_and_list(self, tmp_path: Path) -> None:
        paths = self._write(tmp_path)
        (tmp_path / "map.json").write_bytes(b"")
        (tmp_path / ".run_1.csv").write_bytes(b"")
        assert files_of([tmp_path]) == paths
        assert files_of([tmp_path / "*.csv"]) == paths
        assert files_of([tmp_path / "run_*.csv"]) == paths
        found = read_series(paths, ReadingOptions(units="mm"))
        assert found.touches.positions[:, 0].tolist() == [9.5, 9.7, 10.5, 10.7]
        assert found.touches.labels == ("run_9.1", "run_9.2", "run_10.1", "run_10.2")
        assert "2 files in this order: run_9.csv, run_10.csv" in found.touches.reading
        options = ReadingOptions(units="mm", exclude=("run_9.csv:2", "run_10.2"))
        left = read_series(paths, options).touches
        assert left.positions[:, 0].tolist() == [9.7, 10.5]

    def test_refused(self, tmp_path: Path) -> None:
        paths = self._write(tmp_path)
        for places, words in (
            ([tmp_path / "no_*.csv"], "no file has a name like this"),
            ([*paths, paths[0]], "given twice"),
        ):
            with pytest.raises(InputError, match=words):
                files_of(places)
        with pytest.raises(PretravelError, match="a line is given with its file"):
            read_series(paths, ReadingOptions(units="mm", exclude=("2",)))
        (tmp_path / "run_11.csv").write_text("X;Y;Z;I;J;K;F\n1;0;3;0;0;1;50\n")
        with pytest.raises(InputError, match=r"run_9.csv: has no feeds, but run_11.csv does"):
            read_series(files_of([tmp_path]), ReadingOptions(units="mm"))


def test_text_is_not_a_table(tmp_path: Path) -> None:
    told = run("convert", written(tmp_path, "\nDear all,\nthe probe is new.\n"), code=2)
    assert "line 2: the text is not a table of touches: 'Dear all,'" in told
    assert "grbl" in told


def test_rows_of_other_lengths_are_not_probeopen(tmp_path: Path) -> None:
    """PROBEOPEN writes nine numbers; three or six are positions, with normals or without."""
    assert format_of(written(tmp_path, "1 2 3 0 0 1\n")).name == "csv"
    assert format_of(written(tmp_path, "1 2 3 0 0 0 0 0 0\n")).name == "probeopen"


class TestNewcomer:
    """X;Y;Z;I;J;K, decimal commas, inches, one bad touch: from file to points in two commands."""

    BAD = 40
    """A touch that stands 20 µm off the two others of its direction."""

    def _write(self, path: Path, touches: Touches) -> Path:
        cells = np.hstack([touches.positions / INCH, touches.normals])
        lines = [";".join(f"{v:.8f}".replace(".", ",") for v in row) for row in cells]
        path.write_text("\n".join(["X;Y;Z;I;J;K", *lines, ""]))
        return path

    def _sphere(self, folder: Path) -> Path:
        touches = read_touches(EXAMPLES / "sphere_touches.csv")
        positions = touches.positions.copy()
        positions[self.BAD] += 0.020 * touches.normals[self.BAD]
        return self._write(folder / "sphere.csv", replace(touches, positions=positions))

    @pytest.mark.long
    def test_two_commands(self, tmp_path: Path) -> None:
        sphere = self._sphere(tmp_path)
        part = self._write(tmp_path / "part.csv", read_touches(EXAMPLES / "part_touches.csv"))
        reference = ("--diameter", 24.9987, "--tip-diameter", 6, "--kind", "harmonic")
        probe, points = tmp_path / "map.json", tmp_path / "points.csv"
        told = run("qualify", sphere, "--units", "inch", *reference, "-o", probe)
        assert "read: 75 touches; separator ';', decimal comma, inch (given), x=X y=Y z=Z" in told
        assert "touch 41 (line 42)" in told
        assert "decimal comma, inch (given)" in read_map(probe).provenance.reading
        told = run("compensate", part, "--units", "inch", "--map", probe, "-o", points)
        assert "read: 140 touches; separator ';', decimal comma, inch (given)" in told
        run("compensate", EXAMPLES / "part_touches.csv", "--map", probe, "-o", tmp_path / "own.csv")
        for found, own in zip(rows(points), rows(tmp_path / "own.csv"), strict=True):
            for name in ("x_mm", "y_mm", "z_mm", "pretravel_um", "u_um"):
                # Eight decimals of an inch are 0.13 nm.
                assert float(found[name]) == pytest.approx(float(own[name]), abs=1e-6)

    def test_forgotten_inches(self, tmp_path: Path) -> None:
        sphere = self._sphere(tmp_path)
        for tip in (("--tip-diameter", 6), ()):
            told = run("qualify", sphere, "--diameter", 24.9987, *tip, code=2)
            assert "the coordinates look like inches" in told
            assert "give the unit inch (--units)" in told
            small = [each / INCH for each in (24.9987, *tip[1:])]
            inches = ("qualify", sphere, "--diameter", small[0], *tip[:1], *small[1:])
            told = run(*inches, code=2)
            assert "a reference of 0.984201 mm may be one of 25 mm in inches" in told
        told = run("compensate", sphere, "--map", "omp40-2", "-o", tmp_path / "p.csv", code=2)
        assert "does not give its unit of length" in told

    @pytest.mark.parametrize("standard", ["iso10360-5", "iso230-10"])
    def test_forgotten_inches_in_a_check(self, tmp_path: Path, standard: str) -> None:
        touches = sphere_touches(np.full(25, 0.005))
        sphere = self._write(tmp_path / "sphere.csv", touches)
        told = run("check", standard, sphere, "--diameter", 25, code=2)
        assert "give the unit inch (--units, --diameter)" in told
        metric = self._write(
            tmp_path / "b.csv", replace(touches, positions=INCH * touches.positions)
        )
        told = run("check", standard, metric, "--diameter", 25, "--units", "inch", code=2)
        assert "taken as inches; give the unit mm" in told

    def test_inches_that_are_millimetres(self) -> None:
        touches = read_touches(EXAMPLES / "sphere_touches.csv")
        wrong = replace(touches, positions=INCH * touches.positions)
        setup = QualificationSetup(24.9987, tip_diameter=6.0)
        with pytest.raises(PretravelError, match="coordinates in mm were taken as inches"):
            qualify(wrong, diameter=setup.diameter, tip_diameter=setup.tip_diameter)
        with pytest.raises(PretravelError, match="mm that were taken as inches"):
            qualify(wrong, diameter=setup.diameter)

    def test_positions_in_micrometres_without_normals(self) -> None:
        cells = 1e3 * read_touches(EXAMPLES / "sphere_touches.csv").positions
        text = "X;Y;Z\n" + "".join(";".join(f"{v:.1f}" for v in row) + "\n" for row in cells)
        options = ReadingOptions(reference_diameter=24.9987)
        with pytest.raises(PretravelError, match=r"24\.9987 mm: if they are in µm"):
            read_touches(SourceFile("a.csv", text.encode()), options)
        named = SourceFile("a.csv", text.replace("X;Y;Z", "X [µm];Y [µm];Z [µm]").encode())
        assert read_touches(named, options).positions * 1e3 == pytest.approx(cells, abs=0.06)

    def test_preview(self, tmp_path: Path) -> None:
        told = run("convert", self._sphere(tmp_path))
        for words in (
            "format csv",
            "decimal comma",
            "diameter 1.2192 (as inches: 30.96",
            "missing            the unit of length: give mm or inch",
            "add --units mm or --units inch",
        ):
            assert words in told
        found, unit_known = look_at(
            SourceFile("a.csv", b"X;Y;Z\n1;2;3\n"), ReadingOptions(units="inch"), CSV
        )
        assert isinstance(found, FilePositions)
        assert unit_known


@pytest.mark.parametrize(
    ("name", "left"),
    [("1", ("2", "117")), ("2", ("1", "117")), ("117", ("1", "2")), ("4", ("1", "2"))],
)
def test_an_excluded_label_may_be_any_number(name: str, left: tuple[str, ...]) -> None:
    """Also that of the header's line, which still names the columns; 4 is a line alone."""
    text = "Nr;Z;Y;X;I;J;K\n1;3;2;1;0;0;1\n2;3;2;1;0;0;1\n117;3;2;1;0;0;1\n"
    read = read_touches(
        SourceFile("a.csv", text.encode()), ReadingOptions(units="mm", exclude=(name,))
    )
    assert read.labels == left
    assert read.positions.tolist() == [[1.0, 2.0, 3.0]] * len(left)


@pytest.mark.parametrize("cell", ["#WERT!", "#REF!", "#NAME?", "#DIV/0!"])
def test_an_error_of_a_spreadsheet_is_no_comment(cell: str) -> None:
    text = f"x;y;z;i;j;k\n0;0;3;0;0;1\n{cell};0;3;0;0;1\n"
    with pytest.raises(InputError, match=r"line 3: .*error of the spreadsheet"):
        read_readings(SourceFile("a.csv", text.encode()), ReadingOptions(units="mm"))
