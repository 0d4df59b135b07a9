"""Tables that state a tip, a reference or a compensation that contradicts the job."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base import InputError
from pretravel.files.file_format import ReadingOptions
from pretravel.files.readings import read_readings, write_readings
from pretravel.files.source_file import SourceFile

JOB = ReadingOptions(tip_radius=3.0, reference_diameter=25.0)


def read(header: str = "", cell: str = "", comment: str = "", options: ReadingOptions = JOB) -> int:
    """Read two touches with one more column and a first line; their number."""
    rows = "".join(f"{x},0,3,0,0,1{cell and ','}{cell}\n" for x in (0, 1))
    text = f"{comment}\nx_mm,y_mm,z_mm,nx,ny,nz{header and ','}{header}\n{rows}"
    return len(read_readings(SourceFile("a.csv", text.lstrip().encode()), options).touches)


@pytest.mark.parametrize(
    ("header", "cell", "comment", "words"),
    [
        ("tip_diameter_mm", "5", "", "tip_diameter_mm gives the tip a diameter of 5 mm, and 6 mm"),
        ("Stylus radius", "2.5", "", "Stylus radius gives the tip a diameter of 5 mm"),
        ("tip dia [inch]", "0.125", "", "diameter of 3.175 mm"),
        ("", "", "# tip diameter: 5 mm", "line 1: this line gives the tip a diameter of 5 mm"),
        ("", "", "# Tastkugel Ø 4,0", "diameter of 4 mm"),
        ("", "", "Probe ball radius = 2", "diameter of 4 mm"),
        ("sphere_diameter_mm", "30", "", "gives the reference a diameter of 30 mm, and 25 mm"),
        ("", "", "# reference sphere diameter 30", "reference a diameter of 30 mm"),
        ("", "", "# Kalibrierkugel Durchmesser 30", "reference a diameter of 30 mm"),
        ("", "", "# ring gauge diameter 30", "reference a diameter of 30 mm"),
        ("", "", "# Lehrring D=30.0003", "reference a diameter of 30.0003 mm"),
        ("", "", "# sphere: 30.0003, U = 0.3 µm", "reference a diameter of 30.0003 mm"),
        ("", "", "# calibrated diameter 30", "reference a diameter of 30 mm"),
        ("", "", "# tip 4 mm", "tip a diameter of 4 mm"),
        ("cal_ball_dia_mm", "6", "", "gives the reference a diameter of 6 mm, and 25 mm"),
        ("", "", "# probe radius compensation: on", "the control or the CMM compensated"),
        ("", "", "# Compensated points", "the control or the CMM compensated"),
        ("", "", "# Surface points", "the control or the CMM compensated"),
        ("", "", "# tip radius 3.0 subtracted", "the control or the CMM compensated"),
        ("", "", "# Punkte tasterradiuskorrigiert", "the control or the CMM compensated"),
        ("", "", "# pretravel compensated: yes", "the control or the CMM compensated"),
        ("tip", "TIP_4mm", "", "its name, TIP_4mm, gives the tip a diameter of 4 mm, and 6 mm"),
        ("tip", "2BY50MM", "", "diameter of 2 mm"),
        ("compensated", "yes", "", "the control or the CMM compensated"),
        ("Radius comp.", "ON", "", "the control or the CMM compensated"),
        ("Radiuskorrektur", "ein", "", "the control or the CMM compensated"),
        ("Correction de rayon", "1", "", "the control or the CMM compensated"),
        ("G41", "G41", "", "the control or the CMM compensated"),
    ],
)
def test_what_contradicts_the_job_is_refused_by_name(
    header: str, cell: str, comment: str, words: str
) -> None:
    with pytest.raises(InputError, match=r"one of them is wrong|The centre of the tip") as raised:
        read(header, cell, comment)
    assert words in str(raised.value)


@pytest.mark.parametrize(
    ("header", "cell", "comment"),
    [
        ("tip_diameter_mm", "5.967", ""),  # the effective diameter: less twice the pretravel
        ("tip_diameter_mm", "6", "# reference sphere diameter 24.9987 mm"),
        ("tip dia [inch]", "0.23622", ""),
        ("tip", "6 mm ball", ""),
        ("tip", "T4", ""),
        ("tip", "M4 x 50 mm", ""),
        ("compensated", "no", ""),
        ("", "", "# probe radius subtracted: none"),
        ("", "", "# tip radius not subtracted"),
        ("", "", "# tip 4, sphere 2"),  # numbers of them
        ("", "", "# ring 22 mm deep"),
        ("", "", "# 25 points of a freeform surface"),
        ("", "", "# radius compensation: off"),
        ("", "", "# uncompensated points"),
    ],
)
def test_what_agrees_with_the_job_is_read(header: str, cell: str, comment: str) -> None:
    assert read(header, cell, comment) == 2


@pytest.mark.parametrize("ball", ["25", "24.9987", "6", "5.95"])
def test_a_ball_can_be_the_tip_or_the_sphere_that_it_touches(ball: str) -> None:
    assert read("ball_diameter_mm", ball) == read(comment=f"# Kugel Ø {ball} mm") == 2
    with pytest.raises(InputError) as raised:
        read(comment="# ball diameter 20 mm")
    assert "20 mm: it is neither the tip of 6 mm nor the reference of 25 mm" in str(raised.value)
    with pytest.raises(InputError, match="it is not the tip of 6 mm"):
        read(comment="# ball diameter 25", options=replace(JOB, reference_diameter=None))


def test_a_tip_of_several_is_compared_when_it_is_chosen() -> None:
    text = b"x_mm,y_mm,z_mm,nx,ny,nz,tip_diameter_mm\n0,0,3,0,0,1,6\n1,0,2,0,0,1,4\n"
    file = SourceFile("a.csv", text)
    assert len(read_readings(file, replace(JOB, tip="6")).touches) == 1
    with pytest.raises(InputError, match=r"line 3: .* diameter of 4 mm, and 6 mm"):
        read_readings(file, replace(JOB, tip="4"))


def test_a_file_with_a_radius_of_the_tip_is_compared_too(tmp_path: Path) -> None:
    touches = read_readings(SourceFile("a.csv", b"x,y,z,i,j,k\n0,0,3,0,0,1\n"), JOB).touches
    path = tmp_path / "touches.qif"
    write_readings(path, touches, 2.5)
    assert np.isclose(read_readings(path).tip_radius or 0.0, 2.5)
    with pytest.raises(InputError, match="the file gives the tip a diameter of 5 mm, and 6 mm"):
        read_readings(path, JOB)


def test_columns_that_are_not_read_are_named() -> None:
    text = b"x_mm,y_mm,z_mm,nx,ny,nz,temperature\n0,0,3,0,0,1,21.5\n"
    assert "not read: temperature" in read_readings(SourceFile("a.csv", text)).touches.reading
    for line in (b"# tip diameter 4 mm\n", b""):
        said = " ".join(read_readings(SourceFile("a.csv", line + text)).warnings)
        assert ("gives the tip a diameter of 4 mm (line 1), which is not used" in said) == bool(
            line
        )


@pytest.mark.parametrize("first", ["x_mm,y_mm,z_mm", "x_in,y_in,z_in"])
def test_a_unit_before_the_header_must_be_that_of_the_header(first: str) -> None:
    unit, other = ("mm", "inch") if "mm" in first else ("inch", "mm")
    text = f"# units: {{}}\n{first},nx,ny,nz\n0,0,3,0,0,1\n"
    job = replace(JOB, tip_radius=None, reference_diameter=None)
    read_readings(SourceFile("a.csv", text.format(unit).encode()), job)
    with pytest.raises(InputError, match=f"the header gives {unit} and a line before it {other}"):
        read_readings(SourceFile("a.csv", text.format(other).encode()), job)


@pytest.mark.parametrize(
    "words",
    ["feed: 500", "probe axis 0,1,0", "shank IJK=0,1,0", "sphere form 1.2 µm", "delay 3 ms",
     "backlash 5 µm", "tip T2A90B0", "stylus: RUBY2", "orientation: down"],
)  # fmt: skip
def test_conditions_before_the_rows_that_nothing_reads_are_named(words: str) -> None:
    text = f"# part 7, 12 points\n# {words}\nx_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n"
    found = read_readings(SourceFile("a.csv", text.encode())).warnings
    assert len(found) == 1
    assert f"not read: line 2 '# {words}'." in found[0]


@pytest.mark.parametrize(
    "words",
    ["feed 500 mm/min", "A90 B45", "scale 0.001", "probe requalified", "mirror X", "offset x +10",
     "probing direction reversed", "coordinate system 2", "machine B", "B axis 90", "polar",
     "Spindel M19 R90", "spindle at 90°", "M6"],
)  # fmt: skip
def test_a_comment_among_rows_that_changes_them_is_refused(words: str) -> None:
    text = "x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n# {}\n1,0,3,0,0,1\n"
    with pytest.raises(InputError, match=r"line 3: .*may change the meaning of the rows after it"):
        read_readings(SourceFile("a.csv", text.format(words).encode()))
    for harmless in (
        "second half, by hand",
        "spindle 5000 rpm",
        "M19",
        "spindle warm after 20 min",
    ):
        read_readings(SourceFile("a.csv", text.format(harmless).encode()))
    semicolons = text.format("").replace(",", ";").replace("# \n", "; Pause\n")
    assert "'; Pause'" in read_readings(SourceFile("a.csv", semicolons.encode())).warnings[0]


def test_rows_of_two_machines_are_two_series() -> None:
    text = b"x_mm,y_mm,z_mm,nx,ny,nz,machine\n0,0,3,0,0,1,M1\n1,0,3,0,0,1,M2\n"
    assert read_readings(SourceFile("a.csv", text)).touches.words["part"] == ("M1", "M2")


@pytest.mark.parametrize(
    ("title", "cells", "told"),
    [
        ("time", ("10:00:05", "10:00:09", "10:00:01"), True),
        ("time", ("23:59:50", "00:00:02", "00:00:09"), False),
        ("timestamp", ("2026-03-14T10:00", "2026-03-13T10:00", "2026-03-14T11:00"), True),
        ("time_s", ("1", "2", "3"), False),
        ("time", ("0.41", "0.39", "0.40"), False),  # how long each touch took
        ("date", ("14.03.2026", "", "x"), False),
        ("Datum", ("14.03.2026 10:00", "14.03.2026 09:00", "14.03.2026 11:00"), True),
    ],
)
def test_rows_that_are_not_in_the_order_of_their_times(
    title: str, cells: tuple[str, ...], *, told: bool
) -> None:
    rows = "".join(f"{x},0,3,0,0,1,{cell}\n" for x, cell in enumerate(cells))
    text = f"x_mm,y_mm,z_mm,nx,ny,nz,{title}\n{rows}"
    found = read_readings(SourceFile("a.csv", text.encode())).warnings
    assert any("earlier than" in each for each in found) == told


def test_a_row_of_units_must_be_that_of_the_names() -> None:
    text = "x_mm,y_mm,z_mm,nx,ny,nz\n{0},{0},{0},1,1,1\n0,0,3,0,0,1\n"
    assert len(read_readings(SourceFile("a.csv", text.format("mm").encode())).touches) == 1
    with pytest.raises(InputError, match="x_mm has the unit mm in its name and inch in the row"):
        read_readings(SourceFile("a.csv", text.format("in").encode()))


@pytest.mark.parametrize(
    ("title", "cells", "refused"),
    [
        ("valid", "10", True),
        ("use", ("yes", "no"), True),
        ("Outlier", "01", True),
        ("status", ("OK", "ERROR"), True),
        ("alarm", "01", True),
        ("valid", "11", False),
        ("ok", "10", False),  # a verdict about the part
        ("result", ("pass", "reject"), False),
        ("error", ("0.3", "0"), False),
        ("sphere_diameter_mm", ("25", "30"), True),
        ("sphere_diameter_mm", ("25", "24.9987"), False),
    ],
)
def test_rows_that_the_file_itself_marks(
    title: str, cells: tuple[str, ...], *, refused: bool
) -> None:
    rows = "".join(f"{x},0,3,0,0,1,{cell}\n" for x, cell in enumerate(cells))
    file = SourceFile("a.csv", f"x_mm,y_mm,z_mm,nx,ny,nz,{title}\n{rows}".encode())
    if not refused:
        assert len(read_readings(file, JOB).touches) == 2
        return
    with pytest.raises(InputError, match=r"the file itself marks it|reference a diameter of 30"):
        read_readings(file, JOB)
