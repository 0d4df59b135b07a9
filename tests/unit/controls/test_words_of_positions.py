"""Lines of positions as controls print them: words beside X, Y and Z, units, tools, offsets."""

from __future__ import annotations

import pytest

from pretravel.base import InputError
from pretravel.controls.logs.log_lines import read_log_positions
from pretravel.files import (
    FORMATS,
    FilePositions,
    ReadingOptions,
    SourceFile,
    format_of,
    look_at,
    read_readings,
)


def _read(text: str, units: str | None = "mm") -> FilePositions:
    return read_log_positions(SourceFile("a.txt", text.encode()), units)


@pytest.mark.parametrize(
    ("form", "role", "words"),
    [
        ("N{0} X{0}.0 Y2.0 Z3.0 T{1}\n", "tip", ("12", "12", "13")),
        ("X{0}.0 Y2.0 Z3.0 T  {1}.\n", "tip", ("12", "12", "13")),
        ("TASTER{1} X{0}.0 Y2.0 Z3.0\n", "tip", ("TASTER12", "TASTER12", "TASTER13")),
        ("PART {1} X{0}.0 Y2.0 Z3.0\n", "part", ("PART 12", "PART 12", "PART 13")),
    ],
)
def test_a_tool_or_part_beside_the_position_is_kept(
    form: str, role: str, words: tuple[str, ...]
) -> None:
    lines = [form.format(i, name) for i, name in enumerate((12, 12, 13), start=1)]
    assert _read("; 2024-05-12 10:12:33\n" + "".join(lines)).words == {role: words}


@pytest.mark.parametrize(
    "form",
    ["X{}.0 Y2.0 Z3.0 G{}\n", "G90 G{1} X{0}.0 Y2.0 Z3.0\n", "X{}.0 Y2.0 Z3.0 G  {}.\n"],
)
def test_another_work_offset_beside_a_position_is_refused(form: str) -> None:
    assert len(_read(form.format(1, 54) + form.format(2, 54)).positions) == 2
    with pytest.raises(InputError, match="line 2: this line changes the coordinates"):
        _read(form.format(1, 54) + form.format(2, 55))
    assert format_of(SourceFile("a.txt", form.format(1, 54).encode())).name == "positions"


def test_numbers_that_are_not_read_are_named() -> None:
    said = "not read: the numbers after D, R in the lines of positions"
    assert said in _read("X1.0 Y2.0 Z3.0 D10.002 R0.1\n").warnings
    said = "1 line is not known, and not read: line 2 'G41 D1'"
    assert said in _read("X1.0 Y2.0 Z3.0\nG41 D1\nX2.0 Y2.0 Z3.0\n").warnings


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("(TIP DIAMETER 4.0)", "not read: line 1"),
        ("; spindle at 90", "not read: line 1"),
        ("DRY RUN", "line 1 'DRY RUN' says that the rows were not measured"),
    ],
)
def test_what_lines_above_positions_state_is_named(line: str, said: str) -> None:
    assert said in " ".join(_read(f"{line}\nX1.0 Y2.0 Z3.0\n").warnings)


@pytest.mark.parametrize("line", ["(RADIUS COMPENSATION ON)", "; surface points"])
def test_positions_that_are_called_compensated_are_refused(line: str) -> None:
    with pytest.raises(InputError, match=r"line 1: .* the control or the CMM compensated"):
        _read(f"{line}\nX1.0 Y2.0 Z3.0\n")
    with pytest.raises(InputError, match=r"line 2: .* the control or the CMM compensated"):
        read_readings(
            SourceFile("a.log", f"$13=0\n{line}\n[PRB:1.0,2.0,3.0:1]\n".encode()),
            ReadingOptions(offset=(0, 0, 0), normal=(0, 0, 1)),
        )


def test_a_rotary_axis_that_moves_between_positions_is_refused() -> None:
    with pytest.raises(InputError, match="line 3: the rotary axis A has moved"):
        _read("A0.\nX1.0 Y2.0 Z3.0\nA90.\nX1.0 Y2.0 Z3.0\n")
    with pytest.raises(InputError, match="line 2: this line changes the coordinates"):
        _read("X1.0 Y2.0 Z3.0\nB 90.\nX1.0 Y2.0 Z3.0\n")


def test_a_line_that_gives_the_unit_is_used() -> None:
    assert _read("UNITS: INCH\nX1 Y2 Z4\n", None).positions.tolist() == [[25.4, 50.8, 101.6]]
    with pytest.raises(InputError, match="line 1: the file's units are inch"):
        _read("INCH\nX1 Y2 Z3\n")


def test_coordinates_in_another_order() -> None:
    file = SourceFile("a.txt", b"Y-   91.2 X   128.4 Z-   12.0\nY-   91.3 X   130.4 Z-   12.0\n")
    assert format_of(file) is FORMATS["positions"]
    assert _read(file.content.decode()).positions[0].tolist() == [128.4, -91.2, -12.0]


def test_numbers_without_decimal_points_are_named() -> None:
    file = SourceFile("a.txt", b"X 128474 Y- 91200 Z- 12005\nX 130474 Y- 91207 Z- 12003\n")
    found, _ = look_at(file, ReadingOptions(units="mm"), format_of(file))
    assert "beyond any machine" in " ".join(found.warnings)


_FUSION = "".join(
    f"G800 N{i} X{i}0. Y10. Z0. I0. J0. K1.\nG801 N{i} X{i}0. Y10. Z3.00{i} R3.\n"
    for i in range(1, 5)
)


@pytest.mark.parametrize("unit", ["G20", "UNITS INCH", "(values in inches)", "G70"])
def test_a_unit_above_the_points_of_fusion_is_used(unit: str) -> None:
    file = SourceFile("a.txt", f"START\n{unit}\n{_FUSION}END\n".encode())
    assert read_readings(file, ReadingOptions()).touches.positions[0, 1] == 254.0
    with pytest.raises(InputError, match="line 2: the file is in inch"):
        read_readings(file, ReadingOptions(units="mm"))


def test_a_touch_elsewhere_on_its_normal_is_named() -> None:
    last = "G800 N5 X50. Y10. Z0. I0. J0. K1.\nG801 N5 X50. Y10. Z-4. R3.\n"
    file = SourceFile("a.txt", f"START\n{_FUSION}{last}END\n".encode())
    told = read_readings(file, ReadingOptions(units="mm")).warnings
    assert any("differs from that of the others: line 11 (-7.002 mm)" in said for said in told)


def test_tip_centres_behind_their_surface_are_named() -> None:
    file = SourceFile("a.txt", f"START\n{_FUSION}END\n".replace("K1.", "K-1.").encode())
    told = read_readings(file, ReadingOptions(units="mm")).warnings
    assert any("behind its nominal surface, by 3 mm" in said for said in told)


@pytest.mark.parametrize(
    "form",
    [
        "$AA_MW[X]={} $AA_MW[Y]=-2.0 $AA_MW[Z]=3.0\n",
        "VSAPX {} VSAPY -2.0 VSAPZ 3.0\n",
        "#5061={} #5062=-2.0 #5063=3.0\n",
        "#5061 X{} #5062 Y-2.0 #5063 Z3.0\n",
        "Q115 = {} Q116 = -2.0 Q117 = 3.0\n",
        "X {}\nY- 2.0\nZ 3.0\n",
        "[Point 1]\nX={}\nY=-2.0\nZ=3.0\n",
        "POINT   1.\nX  {}\nY- 2.0\nZ 3.0\n",
        "X1 = {}, Y1 = -2.0, Z1 = 3.0\n",
        "Probe hit at X: {} Y: -2.0 Z: 3.0\n",
    ],
)
def test_longer_names_of_axes_and_one_axis_in_a_line(form: str) -> None:
    file = SourceFile("a.txt", (form.format(1.5) + form.format(2.5)).encode())
    assert format_of(file) is FORMATS["positions"]
    assert _read(file.content.decode()).positions.tolist() == [[1.5, -2, 3], [2.5, -2, 3]]


@pytest.mark.parametrize(
    "lines",
    [
        "NOM_X=1.0 NOM_Y=2.0 NOM_Z=3.0\n",  # no touch
        "A_X=1.0 A_Y=2.0 A_Z=3.0 B_X=1.0 B_Y=2.0 B_Z=3.0\n",  # which of them?
        "X 1.0\nY 2.0\nZ 3.0\nD 4.0\n",  # a feature
        "Probe target X1.0 Y2.0 Z3.0\n",
    ],
)
def test_names_of_axes_that_say_no_touch(lines: str) -> None:
    with pytest.raises(InputError):
        _read(lines + lines)


@pytest.mark.parametrize(
    ("line", "touched", "missed"),
    [
        ("MW[X]=1.0 MW[Y]=2.0 MW[Z]={} $AC_MEA[1]={}\n", "1", "0"),
        ("X1.0 Y2.0 Z{} #5070={}\n", "1.0000", "0.0000"),
        ("x=1.0 y=2.0 z={} success={}\n", "1.0", "0.0"),
        ("[10:22:33] X1.0 Y2.0 Z{} {}\n", "HIT", "MISS"),
        ("INFO: probe {1} at X: 1.0 Y: 2.0 Z: {0}\n", "tripped", "not tripped"),
        ("2024-03-12 10:22:33 X: 1.0 Y: 2.0 Z: {} triggered={}\n", "true", "false"),
    ],
)
def test_the_signal_at_the_end_of_a_line_marks_a_miss(line: str, touched: str, missed: str) -> None:
    file = SourceFile("a.txt", (line.format(3.0, touched) + line.format(-9.0, missed)).encode())
    assert format_of(file) is FORMATS["positions"]
    found = _read(file.content.decode())
    assert found.contact == (True, False)
    assert found.positions[0].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("label", ["HIT 1 ", "POINT 1: ", "#1: "])
@pytest.mark.parametrize("title", ["", "MEASURING LOG\nDATUM: 12-03-2024 ZEIT: 14:22:11\n"])
def test_vectors_after_a_name_and_a_title_are_read(label: str, title: str) -> None:
    row = f"{label}X=1.0 Y=2.0 Z=3.0 NX: 0 NY: -1 NZ: 0\n"
    found = read_readings(
        SourceFile("a.txt", (title + row + row.replace("X=1.0", "X=4.0")).encode()),
        ReadingOptions(units="mm"),
    ).touches
    assert found.positions.tolist() == [[1, 2, 3], [4, 2, 3]]
    assert found.normals.tolist() == [[0, -1, 0]] * 2


@pytest.mark.parametrize("comment", ["; Units: Inches\n", "(all values in inches)\n"])
def test_a_comment_that_gives_the_unit_is_used(comment: str) -> None:
    assert _read(comment + "X1 Y2 Z4\n", None).positions.tolist() == [[25.4, 50.8, 101.6]]
    with pytest.raises(InputError, match="line 1: the file's units are inch"):
        _read(comment + "X1 Y2 Z4\n", "mm")


@pytest.mark.parametrize("comment", ["(tool 5)\n", "; next part\n"])
def test_a_comment_among_positions_that_changes_them_is_refused(comment: str) -> None:
    assert len(_read(comment + "X1 Y2 Z4\nX1 Y2 Z4\n").positions) == 2
    with pytest.raises(InputError, match="line 2: this line changes the meaning of the rows"):
        _read("X1 Y2 Z4\n" + comment + "X1 Y2 Z4\n")


def test_a_date_above_positions_is_named() -> None:
    found = _read("PROBE DATA\nDATE: 2024-03-12\nX1 Y2 Z4\n")
    assert found.warnings == ("not read: line 2 above the positions",)


def test_machine_and_work_coordinates_in_one_log_are_refused() -> None:
    rows = "".join(f"$AA_M{f}[X]=1.0 $AA_M{f}[Y]=2.0 $AA_M{f}[Z]=3.0\n" for f in "WWM")
    with pytest.raises(InputError, match="line 3: this line changes the coordinates"):
        read_log_positions(SourceFile("a.txt", rows.encode()), "mm")
