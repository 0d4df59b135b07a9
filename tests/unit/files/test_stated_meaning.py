"""What files state about their rows is carried or refused: small files of forms that people have.

Each stands for a kind of file in which a statement was passed over. Values are invented; what is
right follows from the file by hand, or as the test says.
"""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.files.file_format import FilePositions, ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.map_json import json_of_map
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from pretravel.laboratory.repeat_log import (
    LoggedSeries,
    _in_a_rhythm,
    read_repeats,
)
from pretravel.laboratory.repeat_series import step_of_repeats
from pretravel.maps.provenance import QualificationSetup
from pretravel.measurement.compensation import apply
from pretravel.qualification.drifts import DailyQuantity, drift_over_time
from pretravel.tasks.history.drift_report import drift_verdict
from tests.support.commands import both_outputs, positions, run
from tests.support.control_logs import written
from tests.support.example_maps import mean_map

ROUTINE = (
    "PART NAME  : COVER\nSTARTUP    =ALIGNMENT/START,RECALL:USE_PART_SETUP,LIST=YES\n"
    "ALIGNMENT/END\nMODE/DCC\nLOADPROBE/STAR_3\nTIP/T1A0B0, SHANKIJK=0, 0, 1, ANGLE=0\n"
    "PLN1 =FEAT/PLANE,CARTESIAN,TRIANGLE\nTHEO/<4,4,0>,<0,0,1>\nACTL/<4,4,0.002>,<0,0,1>\n"
    "MEAS/PLANE,2\nHIT/BASIC,NORMAL,<0,0,0>,<0,0,1>,<0,0,0.001>,USE THEO=YES\n"
    "HIT/BASIC,NORMAL,<8,0,0>,<0,0,1>,<8,0,0.002>,USE THEO=YES\nENDMEAS/\n"
    "TIP/T2A90B0, SHANKIJK=0, 1, 0, ANGLE=0\n"
    "P2 =FEAT/POINT,CARTESIAN\nTHEO/<0,20,-5>,<0,1,0>\nACTL/<0,20.004,-5>,<0,1,0>\n"
)
DMIS = (
    "FILNAM/'COVER',05.2\nUNITS/MM,ANGDEC\nSA(BALL_4)\nF(A)=FEAT/POINT,CART,1,1,0,0,0,1\n"
    "FA(A)=FEAT/POINT,CART,1.0,1.0,0.004,0,0,1\nSNSLCT/SA(BALL_2)\n"
    "F(B)=FEAT/POINT,CART,9,1,0,0,0,1\nFA(B)=FEAT/POINT,CART,9.0,1.0,0.002,0,0,1\nENDFIL\n"
)
TWO_SETS = (
    "START\nRESULTSFILE Lid1\nTOOLPATHID 3\nG800 N1 X1. Y2. Z0. I0. J0. K1.\n"
    "G801 N1 X1. Y2. Z2.004 R2.\nEND\nSTART\nRESULTSFILE Lid2\nTOOLPATHID 7\n"
    "G800 N1 X1. Y2. Z0. I0. J0. K1.\nG801 N1 X1. Y2. Z2.031 R2.\nEND\n"
)
RING_LOG = "Calibrating Probe With Bore\n" + "".join(
    f"[PRB:{x:.3f},{y:.3f},-50.112:1]\n"
    for x, y in [
        (-205.102, -120.004),
        (-225.122, -120.004),
        (-215.11, -109.99),
        (-215.11, -130.016),
    ]
    * 3
)
HEIGHTS = [0.012, 0.013, 0.011, 0.014, -2.5, 0.012, 0.010, 0.013, 0.015]
GRID = "X Y Z\n" + "".join(f"{10 * (i % 3)} {10 * (i // 3)} {z}\n" for i, z in enumerate(HEIGHTS))
UP = ReadingOptions(units="mm", normal=(0.0, 0.0, 1.0))


def _file(text: str, name: str = "a.txt") -> SourceFile:
    return SourceFile(name, text.encode())


class TestTips:
    def test_a_routine_with_a_change_of_tip(self) -> None:
        options = ReadingOptions(radius_taken_off=0.0, units="mm")
        touches = read_readings(_file(ROUTINE), options).touches
        assert touches.tips == ("T1A0B0", "T1A0B0", "T2A90B0")
        with pytest.raises(PretravelError, match=r"2 tips, T1A0B0 .* T2A90B0") as caught:
            apply(touches, mean_map(0.005))
        assert caught.value.inputs == ("tip",)

    def test_one_radius_is_not_that_of_two_tips(self) -> None:
        for text in (ROUTINE, DMIS):
            options = ReadingOptions(radius_taken_off=2.0, units="mm")
            with pytest.raises(PretravelError, match="2 tips"):
                read_readings(_file(text), options)

    def test_the_touches_of_one_tip_are_chosen(self) -> None:
        options = ReadingOptions(radius_taken_off=1.0, tip="BALL_2")
        touches = read_readings(_file(DMIS), options).touches
        assert touches.labels == ("B",)
        assert touches.positions[0, 2] == pytest.approx(1.002)
        touches.refuse_several()
        with pytest.raises(PretravelError, match="no touch is of the tip 'X'; there are BALL_4"):
            read_readings(_file(DMIS), ReadingOptions(radius_taken_off=1.0, tip="X"))

    @pytest.mark.parametrize("title", ["Tip", "Stylus No", "Sensor", "Probe", "Taster", "Tool"])
    def test_columns_that_state_a_tip(self, title: str) -> None:
        rows = f"{title};X;Y;Z;I;J;K\nA;0;0;3;0;0;1\nA;9;0;3;0;0;1\nB;0;9;2;0;0;1\n"
        touches = read_readings(_file(rows), ReadingOptions(units="mm")).touches
        assert touches.tips == ("A", "A", "B")

    def test_a_running_number_is_no_tip(self) -> None:
        rows = "Probe;X;Y;Z;I;J;K\n1;0;0;3;0;0;1\n2;9;0;3;0;0;1\n3;0;9;3;0;0;1\n"
        assert read_readings(_file(rows), ReadingOptions(units="mm")).touches.tips is None

    def test_the_command_names_the_option(self, tmp_path: Path) -> None:
        table, pretravel_map = tmp_path / "t.csv", tmp_path / "map.json"
        pretravel_map.write_bytes(json_of_map(mean_map(0.005)))
        table.write_text(
            "tip,x_mm,y_mm,z_mm,nx,ny,nz\na,0,0,3,0,0,1\na,5,0,3,0,0,1\nb,9,0,3,0,0,1\n"
        )
        told = run("compensate", table, "--map", pretravel_map, "-o", tmp_path / "p.csv", code=2)
        assert "--tip" in told
        run("compensate", table, "--map", pretravel_map, "--tip", "a", "-o", tmp_path / "p.csv")
        assert len(positions(tmp_path / "p.csv")) == 2


class TestFramesAndParts:
    def test_rotary_axes_that_move(self) -> None:
        rows = "X,Y,Z,A\n0,0,1,0\n5,0,1,0\n0,0,1,90\n"
        with pytest.raises(PretravelError, match="line 4: the rotary axis A moves"):
            read_readings(_file(rows), UP)
        still = read_readings(_file(rows.replace("90", "0")), UP)
        assert len(still.touches) == 3
        stated = ReadingOptions(units="mm", normal=(0, 0, 1), columns={"a": "none"})
        assert len(read_readings(_file(rows), stated).touches) == 3

    def test_sets_of_two_parts(self) -> None:
        touches = read_readings(_file(TWO_SETS), ReadingOptions(units="mm")).touches
        assert touches.parts == ("Lid1", "Lid2")
        with pytest.raises(PretravelError, match="2 parts or series") as caught:
            touches.refuse_several()
        assert caught.value.inputs == ("series",)
        one = ReadingOptions(units="mm", series=("Lid2",))
        assert read_readings(_file(TWO_SETS), one).touches.positions[0, 2] == 2.031
        every = ReadingOptions(units="mm", series=("all",))
        read_readings(_file(TWO_SETS), every).touches.refuse_several()

    @pytest.mark.parametrize(
        "title", ["planid,partnb", "Part,Serial", "Serial No,Part", "Teilenummer,Seriennummer"]
    )
    def test_two_parts_in_a_table(self, title: str) -> None:
        rows = f"{title},X,Y,Z,I,J,K\nc,1,0,0,3,0,0,1\nc,1,5,0,3,0,0,1\nc,2,0,0,3,0,0,1\n"
        touches = read_readings(_file(rows), ReadingOptions(units="mm")).touches
        assert touches.words["part"] is not None
        assert len(set(touches.words["part"])) == 2

    def test_measure_asks_which_part(self, tmp_path: Path) -> None:
        rows = "".join(f"{part},{x},{y},{z}\n" for part, z in ((7, 0.0), (8, 0.1))
                       for x in (0, 10) for y in (0, 10))  # fmt: skip
        path = written(tmp_path, "serial,x_mm,y_mm,z_mm\n" + rows, "a.csv")
        assert "--series" in run("measure", path, "--feature", "plane", code=2)
        assert "4 points" in run("measure", path, "--feature", "plane", "--series", 8)

    def test_labels_that_come_twice(self, tmp_path: Path) -> None:
        """A second part whose points lie elsewhere; a part that was touched again is no second."""
        for shift, parts in ((0.08, 2), (0.002, 1)):
            rows = "".join(f"p{i},{10 * (i % 2)},{10 * (i // 2)},{shift * run:.4f}\n"
                           for run in range(2) for i in range(4))  # fmt: skip
            path = written(tmp_path, "label,x_mm,y_mm,z_mm\n" + rows, "a.csv")
            call = ["measure", path, "--feature", "plane"]
            if parts == 1:
                assert "8 points" in run(*call)
                continue
            assert "--series" in run(*call, code=2)
            assert "4 points" in run(*call, "--series", 2)
            assert "8 points" in run(*call, "--series", "all")


class TestPasses:
    def test_fast_and_slow_touches_of_one_point(self) -> None:
        """Slow ones 40 µm above the fast ones, as 150 less 40 mm/min for 22 ms."""
        slow, fast = [9, 12, 12, 7, 11, 9, 12, 9, 11, 13], [50, 51, 51, 50, 51, 49, 50, 50, 53, 54]
        lines = ["$13=0"]
        for s, f in zip(slow, fast, strict=True):
            lines += ["> G38.2 Z-25 F150", f"[PRB:5.000,5.000,-20.0{f}:1]", "ok", "> G0 Z2"]
            lines += ["> G38.2 Z-5 F40", f"[PRB:5.000,5.000,-20.0{s:02d}:1]", "ok"]
        found = read_repeats(_file("\n".join(lines), "a.log"))
        values = {one.name: 1e3 * one.values for one in found.series}
        assert set(values) == {"fast", "slow"}
        assert np.std(values["slow"], ddof=1) == pytest.approx(1.9, abs=0.05)
        assert np.std(values["fast"], ddof=1) == pytest.approx(1.5, abs=0.05)
        assert "+40 µm" in found.warnings[-1]

    def test_pairs_without_feeds_are_told_apart(self) -> None:
        """Each second touch lies 30 µm higher: at one place, and on a grid."""
        noise = 1e-3 * np.random.default_rng(4).standard_normal(16)
        for x in (np.zeros(16), np.repeat(np.arange(8) * 10.0, 2)):
            z = noise + 0.030 * (np.arange(16) % 2)
            rows = "x_mm,y_mm,z_mm\n" + "".join(
                f"{a},0,{b:.4f}\n" for a, b in zip(x, z, strict=True)
            )
            touches = read_readings(_file(rows, "a.csv"), UP).touches
            assert touches.passes == ("first", "second") * 8
            with pytest.raises(PretravelError, match="2 passes") as caught:
                apply(touches, mean_map(0.005))
            assert "double_touches" in caught.value.inputs
            kept = ReadingOptions(normal=(0.0, 0.0, 1.0), double_touches="last")
            read_readings(_file(rows, "a.csv"), kept).touches.refuse_several()

    def test_repeats_with_noise_and_drift_have_no_passes(self) -> None:
        rng = np.random.default_rng(5)
        for _ in range(200):
            z = 2e-3 * rng.standard_normal(12) + 8e-3 * np.arange(12)
            found = FilePositions("a", np.column_stack([np.zeros((12, 2)), z]), tuple(range(12)))
            from pretravel.files.logs.double_touches import with_passes

            assert not with_passes(found).words

    def test_samples_whose_first_is_faster(self) -> None:
        """Four places, three touches each: the first 50 µm higher; without it they are repeats."""
        noise = 1e-3 * np.random.default_rng(6).standard_normal(12)
        for step, passes in ((0.05, ("first", "second", "second") * 4), (0.0, None)):
            lines = "".join(
                f"// probe at {20 * (i // 3)}.000,5.000 is z={1.2 + step * (i % 3 == 0) + e:.6f}\n"
                for i, e in enumerate(noise)
            )
            assert read_readings(_file(lines, "klippy.log")).touches.passes == passes


class TestPlaces:
    @pytest.mark.parametrize("order", [(1, 1, 1, 1, 1, -1, -1, -1, -1, -1), (1, -1) * 5])
    def test_the_two_directions_of_an_axis(self, order: tuple[int, ...]) -> None:
        """Touches towards -x lie 16 µm further; the noise is 2 µm: no jump, and no feed × delay."""
        noise = 2e-3 * np.random.default_rng(9).standard_normal(10)
        rows = "".join(f"{10 - 0.008 * a + e:.4f},20,5,{a},0,0\n"
                       for a, e in zip(order, noise, strict=True))  # fmt: skip
        found = read_repeats(_file("x_mm,y_mm,z_mm,ax,ay,az\n" + rows, "a.csv"))
        assert [one.name for one in found.series] == ["towards +x", "towards -x"]
        assert all(np.std(one.values) < 4e-3 for one in found.series)
        assert not found.warnings

    def test_heights_at_two_places(self) -> None:
        """3 µm at each place; x and y are equal to the last digit within it."""
        rng = np.random.default_rng(7)
        rows = "".join(f"{x:.3f},20.000,{z:.4f}\n" for x in (10, 50)
                       for z in 1.2 + 3e-3 * rng.standard_normal(10))  # fmt: skip
        found = read_repeats(_file("x_mm,y_mm,z_mm\n" + rows, "a.csv"))
        assert found.along == "the axis z"
        assert [len(one.values) for one in found.series] == [10, 10]
        assert all(np.std(one.values) < 6e-3 for one in found.series)

    def test_opposite_walls_of_a_ring(self) -> None:
        rng = np.random.default_rng(8)
        lines = "".join(f"[PRB:{x + 1e-3 * e:.4f},0.000,-5.000:1]\n" for e in rng.standard_normal(6)
                        for x in (-10.0, 10.0))  # fmt: skip
        found = read_repeats(_file("$13=0\n" + lines, "a.log"))
        assert found.along == "the axis x"
        assert all(np.std(one.values) < 4e-3 for one in found.series)
        assert len(found.series) == 2

    def test_a_table_of_trials(self) -> None:
        """The step is 2 mm / 3004 = 0.6658 µm: heights are rounded to nanometres."""
        steps = [0, 3, 1, 1, 0, 3, 3, 0, 0, 1, 2]
        z = [27.303561 + 2.0 / 3004.0 * k for k in steps]
        rows = "".join(f"{i}\t{v:.6f}\t{v - z[0]:.6f}\n" for i, v in enumerate(z, 1))
        found = read_repeats(_file("Trial\tZ-axis mm\tDelta mm\n" + rows))
        (series,) = found.series
        assert len(series.values) == 11
        assert 1e3 * step_of_repeats([series.values]) == pytest.approx(0.6658, abs=1e-3)


def test_a_fast_touch_before_slow_ones_at_one_place_is_named() -> None:
    """The first of every three touches is 21 µm early; noise of 1.9 µm has no rhythm."""
    rng = np.random.default_rng(3)
    heights = -2.0 + 0.0019 * rng.standard_normal(30)
    for early, named in ((0.0, False), (0.021, True)):
        read = heights.copy()
        read[::3] += early
        found = read_repeats(_file("Z [mm]\n" + "".join(f"{one:.5f}\n" for one in read)))
        told = [each for each in found.warnings if "of every 3 touches number 1 lies" in each]
        assert bool(told) == named
    chances = [
        bool(_in_a_rhythm([LoggedSeries("", rng.normal(0.0, 0.002, 20), np.arange(20))])[1])
        for _ in range(300)
    ]
    assert sum(chances) <= 1  # at a probability of 1e-4 each


class TestRows:
    def test_signs_and_letters_apart_from_the_digits(self) -> None:
        """Fanuc and Haas print blanks for leading zeros, and the sign after the letter."""
        text = (
            "X   128.474 Y-   91.200 Z-   12.005\nX   130.474 Y-   91.207 Z-   12.003\n"
            "X   132.474 Y    91.211 Z-   12.001\nX-  134.474 Y-   91.215 Z    12.000\n"
        )
        found = read_readings(_file(text), UP).touches.positions
        assert found.tolist() == [
            [128.474, -91.2, -12.005], [130.474, -91.207, -12.003],
            [132.474, 91.211, -12.001], [-134.474, -91.215, 12.0],
        ]  # fmt: skip

    @pytest.mark.parametrize(
        "row", ["X 1.5 Y 2.5 Z -3.5", "X: 1.5 Y: 2.5 Z: -3.5", "X= 1.5, Y= 2.5, Z=- 3.5",
                "X1.5Y2.5Z-3.5", "#03: X 1.5 Y 2.5 Z -3.5", "#03: 1.5 2.5 -3.5"],
    )  # fmt: skip
    def test_no_row_is_a_header(self, row: str) -> None:
        found = read_readings(_file(f"{row}\n{row.replace('1.5', '4.5')}\n"), UP)
        assert found.touches.positions.tolist() == [[1.5, 2.5, -3.5], [4.5, 2.5, -3.5]]

    def test_a_title_above_positions_is_no_row(self) -> None:
        """Words without a number, above the first position alone; a unit in them is not skipped."""
        rows = "X 1.5 Y 2.5 Z -3.5\nX 4.5 Y 2.5 Z -3.5\n"
        assert len(read_readings(_file(f"PROBE DATA\n{rows}"), UP).touches.positions) == 2
        for text in (f"ALL IN INCHES\n{rows}", f"{rows}OTHER PART\n{rows}"):
            with pytest.raises(PretravelError, match="is not a position"):
                read_readings(_file(text), UP)

    def test_results_of_features_are_no_touches(self) -> None:
        circles = "Name,Type,Center X,Center Y,Center Z,I,J,K,Diameter\nC1,CIRCLE,4,5,-6,0,0,1,10\n"
        objects = "Object Name,Control,Nom,Meas,Dev,Test\nbore,Diameter,10,10.01,0.01,Pass\n"
        elements = "Element;Property;Nominal;Actual;Dev\nKreis 1;Durchmesser;10;10,01;0,01\n"
        kinds = "Name;Type;X;Y;Z\nA;CIRCLE;1;2;3\nB;PLANE;1;2;3\n"
        for text in (circles, objects, elements, kinds):
            with pytest.raises(PretravelError, match="list of features"):
                read_readings(_file(text, "a.csv"), ReadingOptions(units="mm"))
        saved = "planid;partnb;id;type;x;y;z\np;1;E1;circle;1;2;3\n"
        assert format_of(_file(saved, "fet.csv")).name == "calypso"

    def test_a_table_with_actual_and_deviation(self) -> None:
        rows = "Name,Nom X,Nom Y,Nom Z,I,J,K,Actual X,Actual Y,Actual Z,Dev\n"
        rows += "p1,4,5,0,0,0,1,4,5,-0.011,-0.011\np2,7,5,0,0,0,1,7,5,0.006,+0.006\n"
        touches = read_readings(_file(rows, "a.csv"), ReadingOptions(units="mm")).touches
        assert touches.positions[:, 2].tolist() == [-0.011, 0.006]
        assert touches.nominal_points is not None

    @pytest.mark.parametrize("title", ["MEASURING LOG OF A BALL", "Messprotokoll Kugel"])
    def test_a_title_above_a_table(self, title: str) -> None:
        text = f"{title}\nDATE: 12.03.2024\nUNIT: MM\nX;Y;Z;I;J;K\n0.0;0.0;15.498;0;0;1\n"
        touches = read_readings(_file(text)).touches
        assert touches.positions.tolist() == [[0.0, 0.0, 15.498]]

    def test_stated_normals_do_not_remove_the_nominals(self) -> None:
        rows = "X,Y,Z,Nom X,Nom Y,Nom Z\n0,0,0.01,0,0,0\n5,0,0.02,5,0,0\n"
        touches = read_readings(_file(rows, "a.csv"), UP).touches
        assert touches.nominal_points is not None
        assert touches.nominal_points[1].tolist() == [5.0, 0.0, 0.0]

    def test_an_empty_last_column(self) -> None:
        rows = "Nr,X,Y,Z,I,J,K,Note\n1,0,0,3,0,0,1,\n2,1,0,3,0,0,1,\n"
        assert len(read_readings(_file(rows, "a.csv"), ReadingOptions(units="mm")).touches) == 2

    @pytest.mark.parametrize(
        "row", ["N   1 X-   12.500 Y    3.250 Z- 4.001", "P1 X-  12.500,Y 3.250,Z-  4.001",
                "PROBE X: -  12.500 Y: 3.250 Z: -   4.001"],
    )  # fmt: skip
    def test_a_name_before_the_coordinates(self, row: str) -> None:
        found = read_readings(_file(f"{row}\n{row.replace('1 X', '2 X')}\n"), UP).touches
        assert found.positions.tolist() == [[-12.5, 3.25, -4.001]] * 2
        assert found.labels in (("1", "2"), ("P1", "P2"), None)

    def test_a_sign_that_would_be_lost_is_refused(self) -> None:
        """Columns 1, 3, 5 would be x, y, z without the signs of y and z."""
        rows = "12.5 -   3.25 -   4.0\n13.5 -   4.25 -   4.0\n"
        with pytest.raises(PretravelError, match=r"line 1: the sign '-' is separated from 3.25"):
            read_readings(
                _file(rows), ReadingOptions(units="mm", columns={"x": "1", "y": "3", "z": "5"})
            )

    @pytest.mark.parametrize(
        ("nominal", "measured"),
        [("Théo X", "Mes X"), ("X nom", "X mis"), ("X teórico", "X real"), ("Ref X", "Meas X")],
    )
    def test_nominals_in_other_words(self, nominal: str, measured: str) -> None:
        names = [word.replace("X", axis) for word in (nominal, measured) for axis in "XYZ"]
        rows = ";".join([*names, "I", "J", "K"]) + "\n4;5;0;4;5;0.006;0;0;1\n"
        touches = read_readings(_file(rows, "a.csv"), ReadingOptions(units="mm")).touches
        assert touches.positions.tolist() == [[4, 5, 0.006]]
        assert touches.nominal_points is not None

    def test_features_in_other_words(self) -> None:
        """A radius that differs between rows is a feature's; one for all is the tip's."""
        spanish = "Elemento;Centro X;Centro Y;Centro Z;Diámetro\nC1;1;2;3;8.01\nC2;4;2;3;8.02\n"
        table = "Name;X;Y;Z;I;J;K;Radius\nK1;1;2;3;0;0;1;4.0\nK2;4;2;3;0;0;1;{}\n"
        for text in (spanish, table.format("4.5")):
            with pytest.raises(PretravelError, match="list of features"):
                read_readings(_file(text, "a.csv"), ReadingOptions(units="mm"))
        of_tip = _file(table.format("4.0"), "a.csv")
        assert len(read_readings(of_tip, ReadingOptions(units="mm")).touches) == 2


class TestComments:
    @pytest.mark.parametrize(
        "words", ["wiped the tip", "coolant off, part is dry", "tool room 20.1 C", "probe is ok",
                  "part temperature 20.4", "unit of plant 3", "set coolant off", "part cleaned"],
    )  # fmt: skip
    def test_what_only_speaks_of_a_tip_or_a_part_is_named(self, words: str) -> None:
        rows = f"X,Y,Z,I,J,K\n0,0,3,0,0,1\n# {words}\n5,0,3,0,0,1\n"
        found = read_readings(_file(rows, "a.csv"), ReadingOptions(units="mm"))
        assert words in found.notes()[0]

    @pytest.mark.parametrize(
        "words", ["tip 2", "changed tip to T2", "new part", "part turned over", "Taster B",
                  "tool change T5", "T2", "Tip: long", "stylus 4 mm", "Teil gewechselt",
                  "serial no. 12", "part reclamped", "unit: inch", "neuer Taster"],
    )  # fmt: skip
    def test_what_changes_the_rows_is_refused(self, words: str) -> None:
        rows = f"X,Y,Z,I,J,K\n0,0,3,0,0,1\n# {words}\n5,0,3,0,0,1\n"
        with pytest.raises(PretravelError, match=r"line 3: .* is between the rows"):
            read_readings(_file(rows, "a.csv"), ReadingOptions(units="mm"))

    def test_a_time_before_a_line_hides_no_tool(self) -> None:
        text = "$13=0\n12:01:04.003 [PRB:1.0,2.0,-3.0:1]\n12:01:05.120 T2 M6\n"
        text += "12:01:09.003 [PRB:1.0,2.0,-3.4:1]\n"
        options = ReadingOptions(normal=(0.0, 0.0, 1.0), offset=(0.0, 0.0, 0.0))
        touches = read_readings(_file(text, "a.log"), options).touches
        assert touches.tips is not None
        assert touches.tips[1] == "2"


class TestMisses:
    def test_a_row_of_zeros_in_a_grid_through_the_origin(self, tmp_path: Path) -> None:
        """Place 0, 0 was touched already, and each of the others once."""
        rows = "".join(f"{10 * (i % 3)},{10 * (i // 3)},{0.02 + 0.001 * i:.4f}\n" for i in range(9))
        grid = "x_mm,y_mm,z_mm\n" + rows.replace("10,10,0.0240", "0,0,0")
        assert read_readings(_file(grid, "a.csv"), UP).missed == ("5",)
        path = written(tmp_path, grid, "a.csv")
        out, _ = both_outputs("convert", path, "--normal", "0,0,1")
        assert "8 touches" in out
        assert "missing" not in out

    def test_a_miss_is_named_in_the_preview(self, tmp_path: Path) -> None:
        text = "$13=0\n[PRB:1.000,2.000,-3.001:1]\n[PRB:3.000,2.000,-8.000:0]\n"
        out, err = both_outputs("convert", written(tmp_path, text, "a.log"))
        assert "1 positions without normals, and 1 without contact" in out
        assert "-8.0000" not in out.partition("first rows")[2]
        assert "missed: 2" in err

    @pytest.mark.parametrize("miss", ["7,8,-9999", "-9999,-9999,-9999", "0,0,0"])
    def test_what_stands_for_a_miss(self, miss: str) -> None:
        rows = f"x_mm,y_mm,z_mm\n5,6,7.001\n{miss}\n5,7,7.002\n6,7,7.002\n"
        found = read_readings(_file(rows, "a.csv"), UP)
        assert len(found.touches) == 3
        assert found.missed == ("2",)

    def test_a_height_far_from_its_neighbours(self, tmp_path: Path) -> None:
        """Eight heights range over 5 µm; the ninth is at the end of its move."""
        path = written(tmp_path, GRID, "a.csv")
        out, err = both_outputs("measure", path, "--units", "mm", "--feature", "plane")
        assert "plane, 8 points" in out
        assert "left out: 5 (-2.512 mm)" in err
        assert "line 6" in both_outputs("convert", path, "--units", "mm")[1]
        assert "line 6" in " ".join(read_readings(_file(GRID), UP).notes())

    def test_a_miss_among_compensated_points_is_named_and_kept(self, tmp_path: Path) -> None:
        """A row of the compensated table is not left out of a decision, and not passed over."""
        touches, mapped = written(tmp_path, GRID, "a.csv"), tmp_path / "map.json"
        mapped.write_bytes(json_of_map(mean_map(0.005)))
        points = tmp_path / "points.csv"
        run(
            "compensate",
            touches,
            "--units",
            "mm",
            "--normal",
            "0,0,1",
            "--map",
            mapped,
            "-o",
            points,
        )
        out, err = both_outputs("measure", points, "--feature", "plane")
        assert "plane, 9 points" in out
        assert "far from the plane of the others: 5 (-2.512 mm)" in err

    def test_a_value_that_is_no_place_in_a_log(self) -> None:
        log = "".join(f"Bed X: {10 * i}.0 Y: {i * i}.0 Z: 0.1{i}\n" for i in range(4))
        found = read_readings(_file(log + "Bed X: 50.0 Y: 5.0 Z: -9999.000\n"))
        assert (len(found.touches), found.missed) == (4, ("bed/5",))

    def test_misses_of_a_grid_and_of_a_map(self) -> None:
        grid = "0 20 3\n0 0.1 1\n-1 1 50\n0 0 0.1\n10 0 -1.0\n20 0 0.2\n"
        found = read_readings(_file(grid, "a.probe"), ReadingOptions(units="mm"))
        assert (len(found.touches), found.missed) == (2, ("line 5",))
        stopped = "0 10 2\n0 5 2\n-1 1 50\n0 0 0.1\n10 0 0.2\n0 5 0\n10 5 0\n"
        found = read_readings(_file(stopped, "a.probe"), ReadingOptions(units="mm"))
        assert (len(found.touches), found.missed) == (2, ("line 6", "line 7"))
        candle = "0;0;10;5\r\n2;2;-1;1\r\n0;1;1\r\n0.1;-1\r\n0.3;0.4\r\n"
        found = read_readings(_file(candle, "a.map"), ReadingOptions(units="mm"))
        assert found.touches.positions.tolist() == [[0, 0, 0.1], [0, 5, 0.3], [10, 5, 0.4]]
        assert found.missed == ("column 2 of line 4",)

    def test_another_face_is_no_miss_where_the_labels_do_not_separate_it(self) -> None:
        """Two bores and a top face 16 mm above, in one table whose labels are numbers."""
        azimuth = np.radians(30.0 * np.arange(24))
        walls = np.column_stack([-np.cos(azimuth), -np.sin(azimuth), 0.0 * azimuth])
        middle = np.where(np.arange(24) < 12, 0.0, 40.0)
        x, y = middle - 7.0 * walls[:, 0], -7.0 * walls[:, 1]
        rows = [f"{a},{b},-8,{n[0]},{n[1]},0" for a, b, n in zip(x, y, walls, strict=True)]
        rows += [f"{10 * k},{20 + k % 2},8,0,0,1" for k in range(5)]
        text = "x_mm,y_mm,z_mm,nx,ny,nz\n" + "\n".join(rows) + "\n"
        assert not read_readings(SourceFile("a.csv", text.encode())).warnings
        missed = text.replace(rows[3], rows[3].replace(",-8,", ",8,"))
        (told,) = read_readings(SourceFile("a.csv", missed.encode())).warnings
        assert "that of line 5 (+16.000 mm)" in told


class TestReferences:
    def test_a_ring_in_machine_coordinates(self) -> None:
        """Walls 20.020 mm apart along x, 20.026 along y; normals point to the centre."""
        options = ReadingOptions(units="mm", reference_diameter=22.0, ring=True, tip_radius=1.0)
        touches = read_readings(_file(RING_LOG, "a.log"), options).touches
        assert np.round(touches.normals[:4], 3).tolist() == [
            [-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]
        ]  # fmt: skip
        x, y = touches.positions[:, 0], touches.positions[:, 1]
        assert 22.0 - np.ptp(x) == pytest.approx(1.980, abs=1e-6)
        assert 22.0 - np.ptp(y) == pytest.approx(1.974, abs=1e-6)

    def test_tip_centres_of_a_bore(self, tmp_path: Path) -> None:
        """Centres on 34 mm, tip 6 mm: a bore of 40 mm."""
        angles = np.arange(8) * np.pi / 4
        rows = "".join(f"{17 * np.cos(a):.9f},{17 * np.sin(a):.9f},-5.0\n" for a in angles)
        path = written(tmp_path, "X,Y,Z\n" + rows, "a.csv")
        call = ["measure", path, "--units", "mm", "--feature", "bore"]
        out, err = both_outputs(*call, "--tip-diameter", 6)
        assert "diameter 40.000" in out
        out, err = both_outputs(*call)
        assert "34.000" in out
        assert "taken as points of the surface" in err
        assert "compensated" not in out
        assert "--tip-diameter" in run(*call, "--nominal", 40, "--tolerance", "±0.01", code=2)


class TestWhatTheUserStates:
    def test_an_option_given_twice_is_refused(self, tmp_path: Path) -> None:
        path = written(tmp_path, "x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n", "a.csv")
        first, second = tmp_path / "b.csv", tmp_path / "c.csv"
        assert "-o is given 2 times" in run("convert", path, "-o", first, "-o", second, code=2)
        assert not first.exists()
        assert not second.exists()

    def test_a_tip_larger_than_the_sphere_is_asked_back(self) -> None:
        with pytest.raises(PretravelError, match="are the diameters exchanged") as caught:
            QualificationSetup(6.0, 25.0)
        assert caught.value.inputs == ("diameter", "tip_diameter")
        assert QualificationSetup(3.0, 6.0, ring=True).tip_diameter == 6.0  # a pin

    def test_verifications_within_minutes_say_nothing_of_days(self) -> None:
        moments = [datetime(2026, 3, 1, 10, 0, 20 * i) for i in range(3)]
        quantity = DailyQuantity("level", "µm", np.array([0.0, 1.0, 2.0]), np.full(3, 0.1), 1e-3)
        found = drift_over_time(moments, [quantity], 1e-3)
        assert not found.last
        assert "a drift shows only over several days" in drift_verdict(found)

    def test_the_format_that_is_stated_is_taken(self, tmp_path: Path) -> None:
        table = "Actual X,Actual Y,Actual Z,nx,ny,nz\n0,0,3,0,0,1\n"
        path, out = written(tmp_path, table, "a.txt"), tmp_path / "map.json"
        call = ["qualify", path, "--diameter", 25, "--units", "mm", "-o", out]
        assert "print-out" in run(*call, "--from", "print", code=2)
