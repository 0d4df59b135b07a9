"""Statements of the same kinds in other words: titles, cells, comments, names of features, misses.

Values are invented; what is right follows from the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.errors import InputError, PretravelError
from pretravel.files.file_format import ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.readings import read_readings, touches_meant
from pretravel.files.source_file import SourceFile
from pretravel.laboratory.repeat_log import read_repeats
from pretravel.measurement.missed_points import missed_points
from tests.support.commands import run
from tests.support.control_logs import written

UP = ReadingOptions(units="mm", normal=(0.0, 0.0, 1.0))
MM = ReadingOptions(units="mm")


def _file(text: str) -> SourceFile:
    return SourceFile("a.txt", text.encode())


def _grouped(title: str, first: str, second: str) -> SourceFile:
    rows = [f"{cell};{4 * row};0;3;0;0;1" for row, cell in enumerate([first] * 2 + [second] * 2)]
    return _file("\n".join([f"{title};X;Y;Z;I;J;K", *rows]))


@pytest.mark.parametrize(
    ("title", "first", "second", "column"),
    [
        ("Stylus system", "A", "B", "tip"), ("Active tip", "1", "2", "tip"),
        ("Tastsystem", "A", "B", "tip"), ("Probe config", "A", "B", "tip"), ("T", "A", "B", "tip"),
        ("N° pièce", "1", "2", "part"), ("Part S/N", "a", "b", "part"), ("Job", "J1", "J2", "part"),
        ("Measurement run", "1", "2", "part"), ("Aufspannung", "1", "2", "part"),
        ("Probing speed", "500", "50", "pass"), ("Touch", "fast", "slow", "pass"),
        ("Approach", "fast", "slow", "pass"), ("Cycle type", "search", "measure", "pass"),
        ("Index", "A0B0", "A90B0", "orientation"), ("Stylus orientation", "1", "2", "orientation"),
        ("Config", "T1A0B0", "T2A90B0", "tip"),
    ],
)  # fmt: skip
def test_titles_and_cells_that_group_rows(title: str, first: str, second: str, column: str) -> None:
    found = read_readings(_grouped(title, first, second), MM).touches
    assert found.words == {column: (first, first, second, second)}


@pytest.mark.parametrize("title", ["Zero point", "Table C", "Origin"])
def test_titles_and_cells_of_frames(title: str) -> None:
    with pytest.raises(InputError, match=f"line 4: {title} changes"):
        read_readings(_grouped(title, "G54", "G55"), MM)


@pytest.mark.parametrize(
    "title", ["Probe temperature", "Probe force [N]", "Sensor value", "Operator", "Part feature"]
)
def test_titles_of_quantities_group_nothing(title: str) -> None:
    found = read_readings(_grouped(title, "20.1", "20.2"), MM).touches
    assert not found.words
    assert f"not read: {title}" in found.reading


@pytest.mark.parametrize(
    "comment", ["turned the part", "now with the 2 mm ball", "fast pass", "slow", "moved part"]
)
def test_comments_among_rows_that_change_them(comment: str) -> None:
    rows = f"x_mm,y_mm,z_mm\n0,0,3\n# {comment}\n5,0,3\n"
    with pytest.raises(InputError, match=r"line 3: .* is between the rows"):
        read_readings(_file(rows), UP)


@pytest.mark.parametrize(
    "rows",
    [
        "Feature,X,Y,Z,R\nHole 1,1,2,3,5.0\nHole 2,9,2,3,5.0\n",
        "Sphere,X,Y,Z,SD\nS1,1,2,3,0.001\nS2,9,2,3,0.002\n",
        "Name,X,Y,Z,I,J,K,Major,Minor\nE1,1,2,3,0,0,1,5,4\nE2,1,9,3,0,0,1,5,4\n",
        "Kegel;X;Y;Z;Winkel\nK1;1;2;3;45.1\nK2;1;9;3;45.1\n",
        "Name;X;Y;Z;Width;Length\nSlot1;1;2;3;5;10\nSlot2;9;2;3;5;10\n",
        "No;Xc;Yc;Zc;D;Form\n1;100.001;50.002;-20.003;25.0012;0.0012\n",
        "Cycle,X centre,Y centre,Dia X,Dia Y\n1,0.0012,0.0003,50.0123,50.0111\n",
    ],
)
def test_features_by_the_names_of_rows(rows: str) -> None:
    assert format_of(_file(rows)).name == "feature-list"


def test_touches_with_angles_are_no_features() -> None:
    rows = "Point,X,Y,Z,Angle\np1,1,2,3,0\np2,9,2,3,90\n"
    assert format_of(_file(rows)).name == "csv"


class TestTitlesAndHeaders:
    @pytest.mark.parametrize(
        "title", ["Measuring log of part 12", "# Messprotokoll", "PolyWorks Inspector", "Calypso"]
    )
    def test_a_title_above_rows(self, title: str) -> None:
        rows = f"{title}\n1;0;0;3\n2;5;0;3\n3;9;0;3\n"
        assert len(read_readings(_file(rows), UP).touches) == 3

    @pytest.mark.parametrize("title", ["MEASURING LOG\n", "ZEISS CALYPSO\n"])
    def test_reports_below_a_title_are_refused(self, title: str) -> None:
        text = f"{title}MEASURED HOLE\nX : 50.0010\nY : 20.0020\nD : 10.0030\n"
        assert format_of(_file(text)).refusal

    def test_names_of_groups_above_the_names(self) -> None:
        rows = ";Nominal;;;Actual;;;Dev\nName;X;Y;Z;X;Y;Z;\np1;0;0;3;0.001;0;3.002;0.002\n"
        found = read_readings(_file(rows + rows.splitlines()[-1].replace("p1", "p2")), UP).touches
        assert found.positions[0].tolist() == [0.001, 0.0, 3.002]
        assert found.nominal_points is not None
        assert found.nominal_points[0].tolist() == [0.0, 0.0, 3.0]


class TestLettersApart:
    def test_a_word_and_a_number_before_the_coordinates(self) -> None:
        found = read_readings(_file("POINT 1 X 1.5 Y 2 Z- 3\nPOINT 2 X 9.5 Y 2 Z- 3\n"), UP).touches
        assert found.labels == ("POINT 1", "POINT 2")
        assert found.positions[:, 2].tolist() == [-3.0, -3.0]

    def test_vectors_are_read(self) -> None:
        """They were passed over, and one normal for all was taken."""
        rows = "X 1.5 Y 2 Z- 3 I 0 J 1 K 0\nX 9.5 Y 2 Z- 3 I 0 J 1 K 0\n"
        assert read_readings(_file(rows), MM).touches.normals.tolist() == [[0, 1, 0]] * 2


class TestMisses:
    @pytest.mark.parametrize(
        ("title", "cells"),
        [("Hit", "110"), ("Probed", ("True", "True", "False")),
         ("Probe status", ("OK", "OK", "FAILED")), ("Touch detected", ("yes", "yes", "no"))],
    )  # fmt: skip
    def test_columns_that_state_them(self, title: str, cells: tuple[str, ...]) -> None:
        rows = "".join(f"{5 * i},0,3,{cell}\n" for i, cell in enumerate(cells))
        with pytest.raises(InputError, match=f"line 4: {title} is '{cells[-1]}'"):
            read_readings(_file(f"X,Y,Z,{title}\n{rows}"), UP)

    def test_moves_that_ended_at_one_height(self, tmp_path: Path) -> None:
        """Two of nine are more than a fifth; equal to the last digit they are the end of a move."""
        heights = [0.012, 0.013, -5.0, 0.014, -5.0, 0.012, 0.010, 0.013, 0.015]
        rows = "".join(f"{10 * (i % 3)} {10 * (i // 3)} {z}\n" for i, z in enumerate(heights))
        notes = read_readings(_file("X Y Z\n" + rows), UP).notes()
        assert any("2 heights are far" in note for note in notes)
        path = written(tmp_path, "X Y Z\n" + rows, "a.csv")
        assert "7 points" in run("measure", path, "--feature", "plane", "--units", "mm")

    def test_a_column_of_a_grid_is_no_end(self) -> None:
        x, y = np.meshgrid([0.0, 10.0, 20.0], [0.0, 10.0, 20.0])
        noise = 1e-3 * np.random.default_rng(1).standard_normal(9)
        assert not missed_points("plane", np.column_stack([x.ravel(), y.ravel(), noise])).rows


def test_a_log_on_a_sphere_that_states_its_unit_needs_nothing(tmp_path: Path) -> None:
    """12.5 + 1 mm less 6 µm, in machine coordinates; 0.5 µm of noise are rounded to 1 µm."""
    rng = np.random.default_rng(2)
    rings = [(polar, azimuth) for polar in (30, 60, 90) for azimuth in range(0, 360, 45)]
    away = from_angles(*np.radians([(0, 0), *rings]).T)
    centres = [-200.0, -100.0, -50.0] + 13.494 * np.repeat(away, 3, axis=0)
    centres += rng.normal(0.0, 5e-4, centres.shape)
    lines = ["$13=0", *("[PRB:{:.3f},{:.3f},{:.3f}:1]".format(*place) for place in centres)]
    log = written(tmp_path, "\n".join(lines) + "\n", "sphere.log")
    said = run("qualify", log, "--diameter", 25, "--tip-diameter", 2, "--kind", "mean")
    assert "effective radius   0.99" in said


def test_the_first_of_every_three_touches_is_a_series_of_its_own() -> None:
    """20 µm early, with a noise of 0.5 µm: 9.8 µm were said of all."""
    rng = np.random.default_rng(1)
    heights = 2.0 + rng.normal(0.0, 5e-4, 18) + 0.02 * (np.arange(18) % 3 == 0)
    log = "".join(f"// probe at 100.000,100.000 is z={z:.6f}\n" for z in heights)
    found = read_repeats(_file(log))
    assert [(one.name.split()[-1], len(one.values)) for one in found.series] == [
        ("first", 6), ("second", 12),
    ]  # fmt: skip
    assert max(np.std(one.values, ddof=1) for one in found.series) < 1e-3
    assert "evaluated separately" in found.warnings[-1]


class TestFrames:
    FRAME = pd.DataFrame({"y_mm": [1.0, 2.0], "x_mm": [9.0, 8.0], "z_mm": [3.0, 3.0],
                          "nx": [0, 0], "ny": [0, 0], "nz": [1, 1]})  # fmt: skip

    def test_a_batch_of_arrow(self) -> None:
        found = touches_meant(pa.RecordBatch.from_pandas(self.FRAME))
        assert found.positions[0].tolist() == [9.0, 1.0, 3.0]

    @pytest.mark.parametrize("name", [None, "label"])
    def test_names_of_rows_are_labels(self, name: str | None) -> None:
        frame = self.FRAME.set_index(pd.Index(["a", "b"], name=name))
        assert touches_meant(frame).labels == ("a", "b")

    def test_absent_values_and_columns_that_come_twice(self) -> None:
        absent = self.FRAME.assign(z_mm=pd.array([3, None], dtype="Int64"))
        with pytest.raises(PretravelError, match="line 3: z_mm is empty"):
            touches_meant(absent)
        twice = self.FRAME.set_axis(["x_mm", "x_mm", "z_mm", "nx", "ny", "nz"], axis=1)
        with pytest.raises(PretravelError, match="have the same name: x_mm"):
            touches_meant(twice)


def test_two_outputs_in_short_form_are_refused(tmp_path: Path) -> None:
    table = written(tmp_path, "x_mm,y_mm,z_mm\n0,0,3\n5,0,3\n", "a.csv")
    two = (f"-o{tmp_path}/b.csv", f"-o{tmp_path}/c.csv")
    told = run("convert", table, "--normal", "0,0,1", *two, code=2)
    assert "-o is given 2 times" in told


def test_check_asks_about_a_tip_larger_than_the_sphere(tmp_path: Path) -> None:
    table = written(tmp_path, "x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n", "a.csv")
    told = run("check", "iso10360-5", table, "--diameter", 6, "--tip-diameter", 25, code=2)
    assert "are the diameters exchanged" in told
