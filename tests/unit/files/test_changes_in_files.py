"""Files in which a line changes what the rows after it mean, as CMMs and controls write them."""

from __future__ import annotations

import pytest

from pretravel.base import InputError
from pretravel.files import (
    FilePositions,
    FileReadings,
    ReadingOptions,
    SourceFile,
    format_of,
    look_at,
    read_readings,
)

_DMIS = "FILNAM/'PLATE',05.2\nUNITS/MM,ANGDEC\n"
_CMM = ReadingOptions(radius_taken_off=0.0)
_PC_DMIS = ReadingOptions(radius_taken_off=0.0, units="mm")


def _dmis(between: str) -> SourceFile:
    """Two points, lines between them, and two more."""
    rows = [f"FA(P{i})=FEAT/POINT,CART,{i}0.0,10.0,0.00{i},0,0,1\n" for i in range(1, 5)]
    return SourceFile("a.dmo", (_DMIS + "".join(rows[:2]) + between + "".join(rows[2:])).encode())


def _pc_dmis(before: str, between: str) -> SourceFile:
    rows = [
        f"P{i} =FEAT/CONTACT/VECTOR POINT/DEFAULT,CARTESIAN\nTHEO/<{i},10,0>,<0,0,1>\n"
        f"ACTL/<{i},10,0.00{i}>,<0,0,1>\n"
        for i in range(1, 5)
    ]
    text = before + "".join(rows[:2]) + between + "".join(rows[2:])
    return SourceFile("a.txt", text.encode())


def _tips(found: FileReadings) -> list[str]:
    return list(dict.fromkeys(found.touches.tips or ()))


@pytest.mark.parametrize(
    "line",
    [
        "TEXT/OPER,'change stylus now'",
        "$$ PART 2 of 3",
        "$$ new tip from here",
        "SENS/TIP_2",
    ],
)
def test_a_text_or_an_unknown_line_that_speaks_of_a_change_is_refused(line: str) -> None:
    with pytest.raises(InputError, match="line 5: this line changes the meaning of the rows"):
        read_readings(_dmis(line + "\n"), _CMM)


def test_a_text_that_changes_nothing_is_passed_over() -> None:
    found = read_readings(_dmis("$$ top face\nTEXT/OPER,'top face, point 3'\n"), _CMM)
    assert len(found.touches) == 4


def test_another_probe_with_a_tip_of_the_same_name_is_another_tip() -> None:
    tip = "TIP/T1A0B0, SHANKIJK=0, 0, 1, ANGLE=0\n"
    file = _pc_dmis(f"LOADPROBE/STAR\n{tip}", f"LOADPROBE/LONG\n{tip}")
    assert _tips(read_readings(file, _PC_DMIS)) == ["STAR T1A0B0", "LONG T1A0B0"]


def test_a_tip_is_recognised_by_its_name_in_other_languages() -> None:
    file = _pc_dmis("SPITZE/T1A0B0, SCHAFTIJK=0,0,1\n", "SPITZE/T2A90B0, SCHAFTIJK=0,1,0\n")
    assert _tips(read_readings(file, _PC_DMIS)) == ["T1A0B0", "T2A90B0"]


def test_units_that_a_routine_states_are_used_and_no_others() -> None:
    file = _pc_dmis("PART NAME : A\nUNITS : INCH\n", "")
    found = read_readings(file, ReadingOptions(radius_taken_off=0.0))
    assert found.touches.positions[0, 0] == 25.4
    with pytest.raises(InputError, match="line 2: the file's units are inch, the given ones mm"):
        read_readings(file, _PC_DMIS)


def test_a_dimension_in_the_other_unit_is_named() -> None:
    file = _pc_dmis("", "DIM LOC1= LOCATION OF POINT P1  UNITS=IN ,$\nGRAPH=OFF\n")
    said = "line 7 gives a dimension in inch; the points were taken in mm"
    assert said in read_readings(file, _PC_DMIS).warnings


def test_zeros_of_a_probe_that_did_not_trigger_are_a_miss_in_every_format() -> None:
    found = read_readings(_dmis("FA(P9)=FEAT/POINT,CART,0,0,0,0,0,1\n"), _CMM)
    assert (len(found.touches), found.missed) == (4, ("P9",))


def _read(text: str, **options: str) -> FileReadings | FilePositions:
    file = SourceFile("a.csv", text.encode())
    return look_at(file, ReadingOptions(**options), format_of(file))[0]


def test_a_message_of_grbl_that_speaks_of_another_tool_is_refused() -> None:
    reports = "$13=0\n[PRB:1.0,2.0,-3.0:1]\n{}\n[PRB:2.0,2.0,-3.0:1]\n"
    assert len(_read(reports.format("[MSG:Check door]")).positions) == 2
    with pytest.raises(InputError, match=r"line 3: .*Tool change T2"):
        _read(reports.format("[MSG:Tool change T2]"))
    told = _read(reports.format("Grbl 1.1f ['$' for help]")).warnings
    assert any("started again among the touches (line 3)" in one for one in told)


def test_columns_of_tool_radii_and_of_relative_coordinates() -> None:
    found = _read("X;Y;Z;Tool radius\n10;20;3;3\n11;20;3;2\n12;20;3;2\n", units="mm")
    assert found.words["tip"] == ("3", "2", "2")
    with pytest.raises(InputError, match="line 3: Mode changes"):
        _read("X;Y;Z;Mode\n10;20;3;G90\n1;0;0;G91\n1;0;0;G91\n", units="mm")


def test_deviations_without_nominal_points_are_named() -> None:
    rows = "p1,10,20,0,0,0,1,0.011\np2,11,20,0,0,0,1,0.012\n"
    told = " ".join(_read("Name,X,Y,Z,I,J,K,Dev\n" + rows, units="mm").notes())
    assert "deviations (Dev), which are not read, and no nominal points" in told


_TABLE = "x_mm,y_mm,z_mm,nx,ny,nz\n1,1,3,0,0,1\n{between}2,1,3,0,0,1\n{below}"
_LINES = "G21\nX1.0 Y1.0 Z3.0\n{between}X2.0 Y1.0 Z3.0\n{below}"


def _notes(name: str, note: str, where: str) -> tuple[str, ...]:
    """What is said of a note between two touches of a format, or below them."""
    line = {"csv": "# {}\n", "positions": "({})\n", "dmis": "TEXT/OUTFIL,'{}'\n"}.get(
        name, "$$ NO,\n   {}\n"
    )
    between, below = (line.format(note), "") if where == "between" else ("", line.format(note))
    if name == "dmis":
        file = _dmis(between + below)
        return read_readings(file, _CMM).notes()
    if name == "pcdmis":
        return read_readings(_pc_dmis("", between + below), _PC_DMIS).notes()
    text = (_TABLE if name == "csv" else _LINES).format(between=between, below=below)
    return _read(text).warnings


@pytest.mark.parametrize("name", ["csv", "positions", "dmis", "pcdmis"])
@pytest.mark.parametrize("where", ["between", "below"])
@pytest.mark.parametrize(
    "note",
    [
        "part temperature 24.5 °C", "Werkstücktemperatur 25", "probe error", "ignore this point",
        "false trigger", "touch 3 repeated", "measured by hand", "temp 23", "normals reversed",
        "probe crashed", "back side", "average of 3 touches", "Antastkraft 0,2 N",
    ],
)  # fmt: skip
def test_a_note_between_or_below_the_rows_is_named(name: str, where: str, note: str) -> None:
    assert any(note in said for said in _notes(name, note, where))


@pytest.mark.parametrize("name", ["csv", "positions"])
@pytest.mark.parametrize("where", ["between", "below"])
def test_a_note_anywhere_that_the_rows_are_compensated_is_refused(name: str, where: str) -> None:
    with pytest.raises(InputError, match="positions that the control or the CMM compensated"):
        _notes(name, "tip radius compensated", where)
    assert _notes(name, "tip radius not compensated", where) is not None


def test_notes_of_a_cmm_that_speak_of_the_radius_are_named() -> None:
    """The radius that was subtracted is given: the user decides whether the note contradicts."""
    for note in ("points are tip centres", "tip radius compensated"):
        assert any(note in said for said in _notes("dmis", note, "between"))


@pytest.mark.parametrize(
    "note",
    [
        "palpeur 2", "! PRB=PRB(2)", "F500", "probing speed 3 mm/s", "A=45", "C90.", "pièce 2",
        "Tasterwechsel", "changement d'outil", "cambio de pieza", "neue Aufspannung", "2nd part",
        "Teil gedreht", "Vorschub geändert", "ruby replaced", "setup 2", "other sphere",
    ],
)  # fmt: skip
def test_notes_that_change_the_rows_after_them_are_refused(note: str) -> None:
    with pytest.raises(InputError, match=r"line 3: .*meaning of the rows"):
        _notes("csv", note, "between")


def test_the_text_of_a_comment_in_its_own_line_is_no_statement() -> None:
    """A line with / is one: the tip of the next touches."""
    tips = "$$ NO,\nTIP/T2A0B0, SHANKIJK=0, 0, 1, ANGLE=0\n"
    file = _pc_dmis("TIP/T1A0B0, SHANKIJK=0, 0, 1, ANGLE=0\n", tips)
    assert _tips(read_readings(file, _PC_DMIS)) == ["T1A0B0", "T2A0B0"]


def test_tools_before_the_words_of_touches_are_tips() -> None:
    rows = 'T="B3" X=1 Y=1 Z=3\nT="B3" X=2 Y=1 Z=3\nT="B5" X=3 Y=1 Z=3\n'
    assert _read(rows, units="mm").words["tip"] == ('T="B3"', 'T="B3"', 'T="B5"')
    touches = rows.replace('T="B', "P").replace('"', "")
    assert not _read(touches, units="mm").words


def test_a_speed_with_its_unit_is_a_feed() -> None:
    rows = "X;Y;Z;I;J;K;Speed [mm/s]\n1;1;3;0;0;1;3\n2;1;3;0;0;1;8\n"
    found = _read(rows, units="mm")
    assert isinstance(found, FileReadings)
    assert found.touches.feeds is not None
    assert found.touches.feeds.tolist() == [180.0, 480.0]


def test_holes_in_other_languages_are_features() -> None:
    rows = "Nombre;X;Y;Z;I;J;K\n" + "".join(f"Agujero {i};{i};1;-5;0;0;1\n" for i in (1, 2, 3))
    with pytest.raises(InputError, match="list of features"):
        _read(rows, units="mm")


def test_a_routine_that_compensates_has_no_tip_centres() -> None:
    file = _pc_dmis("PROBECOM/ON\n", "")
    with pytest.raises(InputError, match=r"line 1: the tip's radius was subtracted .* of 0 mm"):
        read_readings(file, _PC_DMIS)
    found = read_readings(file, ReadingOptions(radius_taken_off=3.0, units="mm"))
    assert found.touches.positions[0, 2] == pytest.approx(3.001, abs=1e-12)


def test_a_sensor_whose_diameter_is_used_is_not_named_as_unread() -> None:
    sensors = "".join(f"S(T{i})=SNSDEF/PROBE,INDEX,POL,0,0,0,0,1,100,{i}\n" for i in (6, 4))
    rows = "FA(A)=FEAT/POINT,CART,1,1,0.002,0,0,1\n"
    text = f"{_DMIS}{sensors}PRCOMP/ON\nSNSLCT/S(T6)\n{rows}ENDFIL\n"
    found = read_readings(SourceFile("a.dmo", text.encode()), ReadingOptions(radius_taken_off=3.0))
    assert found.touches.positions[0, 2] == pytest.approx(3.002, abs=1e-12)
    told = " ".join(found.notes())
    assert "line 4 'S(T4)" in told
    assert "S(T6)" not in told


def test_a_sign_apart_from_its_number() -> None:
    rows = "X;Y;Z;I;J;K\n- 10,5;10,0;3,002;0;0;1\n20,5;− 9,0;3,002;0;0;1\n"
    found = _read(rows, units="mm")
    assert isinstance(found, FileReadings)
    assert found.touches.positions.tolist() == [[-10.5, 10.0, 3.002], [20.5, -9.0, 3.002]]
