"""Tables that were refused for a reason that is none; the advice of a refusal leads to the goal."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from pretravel.touches.targets import Targets
from tests.support.commands import positions, rows, run
from tests.support.control_logs import HEIGHT_GRID_FILE, written

ROWS = [(0.5, 1.5, 4.0), (1.0, 3.0, 3.25), (1.5, 4.5, 4.5)]


def _table(head: str, separator: str, *, labels: bool = False, last: str = "") -> str:
    lines = [
        separator.join([*([f"P{i}"] if labels else []), *(f"{v:.3f}" for v in row)]) + last
        for i, row in enumerate(ROWS, start=1)
    ]
    return "\n".join([*([head] if head else []), *lines]) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        _table("Point    Meas X    Meas Y    Meas Z", "    ", labels=True),
        _table("Point    Meas X    Meas Y    Meas Z    Dev X", "    ", labels=True, last="   0.1"),
        _table("Meas X    Meas Y    Meas Z", " "),
        _table("Punkt  Mess X  Mess Y  Mess Z", "   ", labels=True),
        _table("Point  Meas X (mm)  Meas Y (mm)  Meas Z (mm)", "  ", labels=True),
        "Of 2021-05-01\n" + _table("Point  Meas X  Meas Y  Meas Z\n-----", " ", labels=True),
        "Part 5, rev 3\n" + _table("Nr;X;Y;Z", ";", labels=True),
        _table("Probe points of part 7", ","),
    ],
)  # fmt: skip
def test_names_with_blanks_and_titles(text: str) -> None:
    found = read_readings(
        SourceFile("a.txt", text.encode()),
        ReadingOptions(units=None if "(mm)" in text else "mm", normal=(0.0, 0.0, 1.0)),
    )
    assert [tuple(row) for row in found.touches.positions.tolist()] == ROWS
    assert found.touches.labels in (None, ("P1", "P2", "P3"))


@pytest.mark.parametrize(
    ("text", "asked", "stated"),
    [
        # A title that is taken for the header; the same with a number that is a name, too.
        (_table("Part,Rev,Op", ","), "line 1", ["--exclude", 1]),
        (_table("Report,Part 5,Rev,3", ",", labels=True), "x=2,y=3,z=4", ["--exclude", 1]),
        (_table("Report,Part 5,Rev,3", ",", labels=True), "x=2,y=3,z=4",
         ["--exclude", 1, "--columns", "x=2,y=3,z=4"]),
        # A header in words of another language.
        (_table("a,b,c,d", ",", labels=True), "x=2,y=3,z=4", ["--columns", "x=2,y=3,z=4"]),
        (_table("a,b,c,d", ",", labels=True), "a, b, c, d", ["--columns", "x=b,y=c,z=d"]),
        # A title with the names of three columns among other words.
        (_table("Measured X Y Z of part", " "), "line 1",
         ["--exclude", 1, "--columns", "x=1,y=2,z=3"]),
        # A header that lacks a name: not each row is at fault, but the header.
        (_table("X,Y,Z", ",", labels=True), "x=2,y=3,z=4",
         ["--exclude", 1, "--columns", "x=2,y=3,z=4"]),
        # Rows of a database without a header: the coordinates are those with decimals.
        ("".join(f"{i};{9 + i};{i} plain;1;{x};{y};{z};;0.0\n" for i, (x, y, z) in enumerate(ROWS)),
         "x=5,y=6,z=7", ["--columns", "x=5,y=6,z=7"]),
    ],
)  # fmt: skip
def test_the_advice_leads_to_the_touches(
    tmp_path: Path, text: str, asked: str, stated: list[object]
) -> None:
    path, out = written(tmp_path, text, "a.txt"), tmp_path / "t.csv"
    call = ["convert", path, "--units", "mm", "--normal", "0,0,1", "-o", out]
    told = " ".join(run(*call, code=2).split())
    assert asked in told
    for option in stated[::2]:
        assert str(option) in told
    run(*call, *stated)
    assert [tuple(row) for row in positions(out).tolist()] == ROWS


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("x_mm;y_mm;z_mm\n1;2;3\n2;3;4\n", "1", "it is the header"),
        ("X;Y;Z\nmm;mm;mm\n1;2;3\n2;3;4\n", "2", "a line below the header. The first touch is on"),
    ],
)
def test_a_header_is_not_excluded(text: str, line: str, words: str) -> None:
    """Without it the unit was lost, and the columns were guessed."""
    options = ReadingOptions(exclude=(line,), units="mm", normal=(0.0, 0.0, 1.0))
    with pytest.raises(InputError, match=words):
        read_readings(SourceFile("a.csv", text.encode()), options)


def test_a_cell_without_a_digit_is_no_question_of_the_decimal_sign() -> None:
    text = "X;Y;Z\n1,5;2,5;3,5\n2,5;--.----;3,5\n"
    options = ReadingOptions(units="mm", normal=(0.0, 0.0, 1.0))
    with pytest.raises(InputError, match=r"line 3: .*'--\.----'"):
        read_readings(SourceFile("a.csv", text.encode()), options)


def test_a_number_that_is_a_name_and_a_column_twice_are_refused() -> None:
    """Silently, y was the fourth column, whose name is 3, and two coordinates were one column."""
    file = SourceFile("a.csv", _table("Report,Part 5,Rev,3", ",", labels=True).encode())
    for columns, words in (
        ({"x": "2", "y": "3", "z": "4"}, "the name of column 4 and the number of another"),
        ({"x": "2", "y": "2", "z": "4"}, "name the same column"),
    ):
        with pytest.raises(InputError, match=words):
            read_readings(file, ReadingOptions(units="mm", columns=columns))


def test_rows_of_heights_alone_have_no_positions() -> None:
    text = "0.01,0.02,0.03,0.02,0.01\n0.02,0.01,0.02,0.03,0.02\n"
    with pytest.raises(InputError, match="Rows of heights alone have no positions"):
        read_readings(SourceFile("a.csv", text.encode()), ReadingOptions(units="mm"))
    with pytest.raises(InputError) as caught:
        read_readings(SourceFile("a.csv", b"1,2,30,4,500\n2,3,31,5,501\n"), ReadingOptions())
    assert "heights" not in str(caught.value)


def test_heights_are_touches_with_one_normal(tmp_path: Path) -> None:
    path, out = written(tmp_path, _table("X,Y,Z", ","), "heights.txt"), tmp_path / "t.csv"
    told = run("convert", path, "--units", "mm", "-o", out, code=2)
    assert "--normal" in told
    run("convert", path, "--units", "mm", "--normal", "0,0,2", "-o", out)
    assert [row["nz"] for row in rows(out)] == ["1"] * 3
    assert "--normal" in run("convert", path, "--units", "mm", "--normal", "0,0,0", code=2)


def test_a_grid_of_heights_is_read(tmp_path: Path) -> None:
    file = SourceFile("board.probe", HEIGHT_GRID_FILE.encode())
    assert format_of(file).name == "height-grid"
    touches = read_readings(file, ReadingOptions(units="inch")).touches
    assert touches.positions[1].tolist() == [254.0, 0.0, pytest.approx(5.08)]
    assert touches.normals.tolist() == [[0.0, 0.0, 1.0]] * 4
    assert touches.feeds is not None
    assert touches.feeds[0] == pytest.approx(50 * 25.4)
    one_more = HEIGHT_GRID_FILE + "0 0 1\n"
    with pytest.raises(InputError, match=r"5 heights, but its first two lines give 2 × 2"):
        read_readings(
            SourceFile("a", one_more.encode()),
            ReadingOptions(units="mm"),
            file_format="height-grid",
        )


def test_a_map_of_candle_with_the_decimal_sign_of_its_computer() -> None:
    """Its boxes show 0,25 in many countries; heights have points, and nan is no contact."""
    text = "-0,25;0,00;13,25;19,62\r\n2,00;2,00;-1,00;1,00\r\n0;10;10\r\n0.1;0.2\r\n0.15;nan\r\n"
    file = SourceFile("board.map", text.encode())
    assert format_of(file).name == "candle-map"
    found = read_readings(file, ReadingOptions(units="mm"))
    assert found.touches.positions.tolist() == [
        [-0.25, 0.0, 0.1], [13.0, 0.0, 0.2], [-0.25, 19.62, 0.15]
    ]  # fmt: skip
    assert found.missed == ("column 2 of line 5",)
    # The third line of old versions has two numbers; five rows are not the four that are stated.
    old = "0;0;9;9\n4;4;-1;1\n0;0.5\n" + "0;0;0;0\n" * 5
    with pytest.raises(InputError, match="5 rows of heights, but the grid has 4"):
        read_readings(SourceFile("old.map", old.encode()), ReadingOptions(units="mm"))


@pytest.mark.parametrize(
    "cycle",
    [
        "Probing Bore/Rectangular Pocket", "Probing Boss or Rectangular Block", "Probing Square",
        "Probing Outside Corner", "Probing Single Axis", "Probing 2 points to find an angle",
        "Calibrating Probe With Boss",
        "Corner found. X coordinate stored in #154 as MCS -20.1 , Y coordinate in #155 as MCS 3.2",
    ],
)  # fmt: skip
def test_results_of_carveras_cycles_are_no_touches(cycle: str) -> None:
    """Twice the same points, in the coordinates of the machine and of the part."""
    points = "".join(
        f"--- {frame} Coordinates ---\n"
        + "".join(f"Point {i}: X: {i}.000, Y: {i}.500, Z: {z}\n" for i in (1, 2, 3, 4))
        for frame, z in (("Machine", -40.012), ("Work", 0.012))
    )
    text = f"{cycle}\nProbing Z with a distance of -5.000\n{points}"
    assert format_of(SourceFile("a.txt", text.encode())).name == "listing"
    reports = "".join(f"[PRB:{x}.000,-50.000,-40.010:1]\n" for x in range(3))
    log = SourceFile("a.txt", (text + reports).encode())
    found = read_readings(log, ReadingOptions(units="mm", normal=(0, 0, 1), offset=(0, 0, 0)))
    assert len(found.touches) == 3
    assert not any("not known" in note for note in found.notes())


def test_one_normal_and_a_plan_contradict(tmp_path: Path) -> None:
    plan = written(tmp_path, "x_mm,y_mm,z_mm,nx,ny,nz\n0.5,1.5,4,0,0,1\n", "plan.csv")
    path = written(tmp_path, _table("X,Y,Z", ","), "heights.txt")
    told = run("convert", path, "--units", "mm", "--normal", "0,0,1", "--plan", plan,
               "--tip-diameter", 6, "-o", tmp_path / "t.csv", code=2)  # fmt: skip
    assert "not both" in " ".join(told.split())


@pytest.mark.parametrize("given", ["normal", "join"])
def test_a_position_that_is_none_is_named_with_its_line(given: str) -> None:
    """The message of the touches alone named neither the file nor its line."""
    text = "label,X,Y,Z\na,0,0,3\nb,3e9,0,3\n"
    plan = Targets([[0.0, 0, 0]] * 2, [[0.0, 0, 1]] * 2, labels=("a", "b"))
    options = (
        ReadingOptions(units="mm", normal=(0.0, 0.0, 1.0))
        if given == "normal"
        else ReadingOptions(units="mm", plan=plan, tip_radius=3.0, join="label")
    )
    with pytest.raises(InputError, match=r"a\.csv, line 3: .*farther than a kilometre"):
        read_readings(SourceFile("a.csv", text.encode()), options)


def test_misses_of_a_log_have_no_normal(tmp_path: Path) -> None:
    log = "$13=0\n<Idle|WCO:0,0,0>\n[PRB:1,2,3:1]\n[PRB:4,5,6:0]\n"
    found = read_readings(SourceFile("a.log", log.encode()), ReadingOptions(normal=(0.0, 0.0, 1.0)))
    assert found.touches.positions.tolist() == [[1.0, 2.0, 3.0]]
    assert found.missed == ("2",)


class TestWhatKlipperSaysOfItsTouches:
    """Its program writes these lines; the numbers are invented."""

    def test_two_versions_state_two_places(self) -> None:
        """The contact of the probe on the bed, and the toolhead: they differ by its offsets."""
        old = "// probe at 60.000,20.000 is z=2.410000\n"
        new = "// probe: at 85.000,24.000 bed will contact at z=0.012000\n"
        for text in (old * 3, new * 3):
            assert len(read_readings(SourceFile("k.log", text.encode())).touches) == 3
        with pytest.raises(InputError, match=r"k\.log, line 3: .*offsets of the probe"):
            read_readings(SourceFile("k.log", (old + old + new).encode()))

    def test_touches_that_it_discarded_or_rejected(self) -> None:
        text = (
            "// EXT_PROBE: probe at 60.000,20.000 is z=2.510000 [discarded]\n"
            "// probe at 60.000,20.000 is z=2.410000\n// probe at 60.000,20.000 is z=2.440000\n"
            "// Probe samples exceed tolerance. Retrying...\n"
            "// probe at 60.000,20.000 is z=2.411000\n// probe at 60.000,20.000 is z=2.412000\n"
        )
        found = read_readings(SourceFile("k.log", text.encode()))
        assert found.touches.positions[:, 2].tolist() == [2.41, 2.44, 2.411, 2.412]
        told = " ".join(found.notes())
        assert "discarded are left out (line 1" in told
        assert "rejected the touches before line 4" in told


def test_colours_of_a_point_cloud_are_no_normals() -> None:
    """Open3D writes X Y Z and a colour from 0 to 1: a cloud that is painted red is no wall."""
    lines = [" ".join(f"{value:.10f}" for value in (*row, 1.0, 0.0, 0.0)) for row in ROWS]
    content = ("\n".join(lines) + "\n").encode()
    options = ReadingOptions(units="mm", normal=(0.0, 0.0, 1.0))
    found = read_readings(SourceFile("a.xyzrgb", content), options)
    assert [tuple(row) for row in found.touches.positions.tolist()] == ROWS
    assert found.touches.normals.tolist() == [[0.0, 0.0, 1.0]] * len(ROWS)
    as_normals = read_readings(SourceFile("a.xyzn", content), ReadingOptions(units="mm"))
    assert as_normals.touches.normals.tolist() == [[1.0, 0.0, 0.0]] * len(ROWS)
