"""Files of controls, CMMs and CAM: read right, or refused with the line; written without loss."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.compensation.compensation import apply
from pretravel.controls.linuxcnc import LOG_COLUMNS
from pretravel.controls.machine import Machine, work_placement
from pretravel.errors import InputError
from pretravel.formats.logs.detection import FORMATS, format_of, read_readings, read_touches_of
from pretravel.formats.logs.dmis import read_dmis
from pretravel.formats.logs.fusion import read_fusion, write_fusion
from pretravel.formats.logs.grbl import read_grbl_log
from pretravel.formats.logs.joining import FileReadings, Rows, join
from pretravel.formats.logs.linuxcnc import read_log_positions, read_own_log, read_probeopen
from pretravel.formats.logs.print_file import read_print_file
from pretravel.formats.logs.qif import NAMESPACE, read_point_sets, read_qif, write_qif
from pretravel.formats.machine_file import machine_text
from pretravel.formats.touches_csv import read_touches, write_touches
from pretravel.probing.targets import Targets
from pretravel.touches import Touches
from tests.conftest import EXAMPLES
from tests.unit.test_command_line import positions, rows, run

HEAD = (
    "pretravel-log,1,plan,2,end\nwork,G54,30.0000000,end\ncolumns," + ",".join(LOG_COLUMNS)
    + ",end\n"
)  # fmt: skip
TOUCH = "touch,{label},0.0,0.0,2990.0,0,0,1,0,0,-1,50,0,0,0,{touched},end\n"
PLAN = Targets(
    np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 0, 0], [20.0, 0, -5]]),
    np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0]]),
    labels=("a", "b.1", "b.2", "wall"),
)


def example_touches() -> Touches:
    touches = read_touches(EXAMPLES / "part_touches.csv")
    return replace(touches, labels=tuple(f"p{i + 1}" for i in range(len(touches))))


def written(tmp_path: Path, text: str | bytes, name: str = "file.txt") -> Path:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


class TestOwnLog:
    WHOLE = (
        HEAD + TOUCH.format(label="a", touched="1.0000000")
        + TOUCH.format(label="b", touched="0.0000000") + "done,2,end\n"
    )  # fmt: skip

    @pytest.mark.parametrize(
        "change",
        [
            lambda text: text,
            lambda text: text.replace("\n", "\r\n"),
            lambda text: "\ufeff" + text,
            lambda text: text.replace("\n", "\n\n"),
        ],
    )
    def test_touches_misses_and_turn(self, tmp_path: Path, change: object) -> None:
        found = read_own_log(written(tmp_path, change(self.WHOLE)))  # type: ignore[operator]
        assert found.touches.labels == ("a",)
        assert found.missed == ("b",)
        assert np.degrees(found.rotation) == pytest.approx(30.0)
        assert found.touches.feeds is not None
        assert found.touches.feeds.tolist() == [50.0]
        assert found.notes() == ["1 touch missed: b"]

    def test_lost_lines_are_noticed(self, tmp_path: Path) -> None:
        lost = self.WHOLE.replace(TOUCH.format(label="b", touched="0.0000000"), "")
        assert "1 of its 2 touches" in read_own_log(written(tmp_path, lost)).notes()[0]
        for line in ("work", "columns"):
            kept = [text for text in self.WHOLE.splitlines() if not text.startswith(line)]
            with pytest.raises(InputError, match="before the first touch"):
                read_own_log(written(tmp_path, "\n".join(kept)))

    def test_that_ended_early_says_so(self, tmp_path: Path) -> None:
        early = self.WHOLE.replace("done,2,end\n", "").replace(
            TOUCH.format(label="b", touched="0.0000000"), ""
        )
        notes = read_own_log(written(tmp_path, early)).notes()
        assert notes == ["the program did not run to its end: 1 of its 2 touches are in the log"]

    @pytest.mark.parametrize(
        ("text", "line", "words"),
        [
            (HEAD + TOUCH.format(label="a", touched="1")[:-9], 4, "cut off"),
            (HEAD + TOUCH.format(label="a", touched="1") * 2, 5, "there twice"),
            (HEAD + TOUCH.format(label="a", touched="1") + HEAD, 5, "a second run begins"),
            (HEAD + "touch,a,0,0,nan,0,0,1,0,0,-1,50,0,0,0,1,end\n", 4, "'nan' is not a finite"),
            (HEAD + "touch,a,0,0,end\n", 4, "3 values, 15 are needed"),
            (HEAD + "work,G54,0.0,end\n", 4, "one line 'work'"),
            (HEAD.replace("log,1,", "log,2,"), 1, "another version"),
            ("pretravel-log,end\n", 1, "another version"),
            (HEAD + "speech,a,end\n", 4, "'speech' is not a line"),
            (HEAD.replace("nominal_x_mm", "nominal_x_in"), 3, "not those that this version knows"),
            (TOUCH.format(label="a", touched="1"), 1, "must begin with pretravel-log"),
            (HEAD + TOUCH.format(label="a", touched="0"), None, "no touch in it; 1 were missed"),
        ],
    )
    def test_refused_with_its_line(
        self, tmp_path: Path, text: str, line: int | None, words: str
    ) -> None:
        with pytest.raises(InputError, match=words) as caught:
            read_own_log(written(tmp_path, text))
        assert (f"line {line}:" in str(caught.value)) == (line is not None)

    def test_turned_work_coordinates_reach_every_command(self, tmp_path: Path) -> None:
        log = written(tmp_path, self.WHOLE, "turned.log")
        message = run("convert", log, "-o", tmp_path / "t.csv", code=2)
        assert "turned by 30°" in message
        assert not (tmp_path / "t.csv").exists()
        run("convert", log, "-o", tmp_path / "m.csv", "--frame", "machine")
        run("convert", log, "-o", tmp_path / "w.csv", "--frame", "work")
        side = self.WHOLE.replace(",0,0,1,0,0,-1,", ",1,0,0,-1,0,0,")
        found = read_touches_of(written(tmp_path, side, "side.log"), machine_axes=True)
        # Counter-clockwise: the work's x axis points 30° towards the machine's y.
        assert found.touches.normals[0] == pytest.approx([np.cos(np.pi / 6), 0.5, 0.0])


class TestProbeOpen:
    ROW = "{x:.6f} 0.000000 2.990000 " + "0.000000 " * 5 + "0.000000\n"

    def test_units_must_be_told(self, tmp_path: Path) -> None:
        path = written(tmp_path, self.ROW.format(x=0.0))
        with pytest.raises(InputError, match="give --units mm or --units inch"):
            read_probeopen(path)
        assert read_probeopen(path, "inch").positions[0, 2] == pytest.approx(2.99 * 25.4)

    @pytest.mark.parametrize(
        ("text", "line", "words"),
        [
            (ROW.format(x=0.0) + "1.0 2.0 3.", 2, "3 values where PROBEOPEN writes 9; the last"),
            (ROW.format(x=0.0) + ROW.format(x=1.0)[:-4], 2, "'0.000' is cut off|cut off"),
            (ROW.format(x=0.0) + "(PROBEOPEN b.txt)\n" + ROW.format(x=0.0), 2, "2 values"),
            (ROW.format(x=0.0) + "nan" + ROW.format(x=0.0)[8:], 2, "'nan' is not a finite"),
            (ROW.format(x=0.0) + "0 0 2.99 90 0 0 0 0 0\n", 2, "a rotary axis"),
        ],
    )
    def test_refused_with_its_line(self, tmp_path: Path, text: str, line: int, words: str) -> None:
        with pytest.raises(InputError, match=words) as caught:
            read_probeopen(written(tmp_path, text), "mm")
        assert f"line {line}:" in str(caught.value)


class TestJoin:
    def test_by_the_lines_whatever_the_order(self) -> None:
        seen = np.array([[23.01, 0, -5], [10, 0, 2.98], [0, 0, 2.99], [10, 0, 1.01]])
        found = join(Rows("log", seen, (1, 2, 3, 4)), PLAN, 3.0, overtravel=2.0)
        # Ten micrometres before the end of its move: where a control stops that met nothing.
        assert found.missed == ("b.2",)
        seen, end = seen[:3], seen[3:] + np.array([0, 0, 0.03])
        assert join(Rows("log", end, (1,)), PLAN, 3.0, overtravel=2.0).missed == ()
        found = join(Rows("log", seen, (1, 2, 3)), PLAN, 3.0, overtravel=2.0)
        assert found.touches.labels == ("wall", "b.1", "a")
        assert found.touches.normals[0].tolist() == [1.0, 0.0, 0.0]
        assert found.touches.lines == (1, 2, 3)
        # LinuxCNC leaves out a repeat that equals the one before: named, not invented.
        assert "b.2" in found.notes()[0]

    @pytest.mark.parametrize(
        ("seen", "words"),
        [
            ([[0.0, 0, 2.99], [0, 0.2, 2.99]], "line of no target; the nearest is a, 0.200 mm"),
            ([[0.0, 0, 2.99], [0, 0, 2.98]], "more readings than the plan"),
            ([[0.0, 0, 2.99 * 25.4]], "line of no target"),
        ],
    )
    def test_refused_with_its_line(self, seen: list[list[float]], words: str) -> None:
        lines = tuple(range(1, len(seen) + 1))
        with pytest.raises(InputError, match=words) as caught:
            join(Rows("log", np.array(seen), lines), PLAN, 3.0)
        assert f"line {len(seen)}:" in str(caught.value)

    def test_crossing_lines_are_told_apart_or_refused(self) -> None:
        cross = Targets([[0.0, 0, 0], [-3.0, 0, 3.0]], [[0.0, 0, 1], [-1.0, 0, 0]])
        # Both lines pass (0, 0, 3): the first target's contact is there, the second's 6 mm away.
        found = join(Rows("log", np.array([[0.0, 0, 2.99]]), (1,)), cross, 3.0)
        assert found.touches.labels == ("1",)
        twins = Targets([[0.0, 0, 0], [-1.0, 0, 3.0]], [[0.0, 0, 1], [-1.0, 0, 0]])
        with pytest.raises(InputError, match="could be of several targets"):
            join(Rows("log", np.array([[-2.0, 0, 3.0], [0.0, 0, 3.0]]), (1, 2)), twins, 1.5)


class TestGrbl:
    LOG = (
        "Grbl 1.1f ['$' for help]\n$13=0 (report in inches)\n"
        "<Idle|MPos:0.000,0.000,0.000|WCO:-100.000,50.000,-20.000>\n"
        "[22:44:43] [ G38.3 Z-5 F100 ] [PRB:-100.000,50.000,-17.010:1]\nok\n"
        "<<< [PRB:-90.000,50.000,-17.020:1]\n"
        "[G54:-100.000,50.000,-20.000]\n[TLO:0.000]\n[PRB:-90.000,50.000,-17.020:1]\n"
        "ALARM:5\n[PRB:-75.000,50.000,-25.000:0]\n"
    )

    def test_work_coordinates_repeats_and_misses(self, tmp_path: Path) -> None:
        rows_ = read_grbl_log(written(tmp_path, self.LOG))
        # The report among the parameters of $# repeats the one before: it is none.
        assert rows_.lines == (4, 6, 11)
        assert rows_.contact == (True, True, False)
        assert rows_.positions == pytest.approx(
            np.array([[0, 0, 2.99], [10, 0, 2.98], [25, 0, -5]]), abs=1e-9
        )
        found = join(rows_, PLAN, 3.0)
        assert found.touches.labels == ("a", "b.1")
        assert found.missed == ("wall",)

    @pytest.mark.parametrize("before", ["[22:44:43] ", "< ", ""])
    def test_repeats_of_parameters_however_the_sender_puts_them(
        self, tmp_path: Path, before: str
    ) -> None:
        block = "".join(
            f"{before}{line}\n"
            for line in ("[TLO:0.000]", "<Idle|MPos:0,0,0>", "[PRB:-90.000,50.000,-17.020:1]", "ok")
        )
        assert read_grbl_log(written(tmp_path, self.LOG + block)).lines == (4, 6, 11)

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            (LOG.replace("$13=0", ""), "does not show whether reports are in inches"),
            (LOG.replace("WCO", "MPX").replace("[G54", "[X"), "give --offset"),
            ("[G54:-100.0,50,-20]\n" + LOG.replace("WCO", "MPX"), "not which is active"),
            (LOG + "<Idle|WCO:0.000,0.000,0.000>\n", "split the log there"),
            (
                LOG.replace("<Idle", "[PRB:1,2,3:1]\n<Idle", 1).replace("[G54", "[X"),
                "before the first",
            ),
            (LOG + "[GC:G0 G55 G21]\n", "became active among"),
            (LOG + "[PRB:1.0,2.0,3.0,90.0:1]\n", "a fourth axis has moved"),
            (LOG.replace("WCO:-100.000,50.000,-20.000", "WCO:1.0,2.0"), "WCO has 2 values"),
            (LOG + "[PRB:1.0,2.0\n", "cut off"),
            (LOG + "[PRB:1.0,2.0:1]\n", "a report of 2 axes"),
            (LOG + "$13=1\n", "before it was mm"),
        ],
    )
    def test_refused(self, tmp_path: Path, text: str, words: str) -> None:
        with pytest.raises(InputError, match=words):
            read_grbl_log(written(tmp_path, text))

    def test_offset_of_the_active_coordinates(self, tmp_path: Path) -> None:
        text = (
            "$13=1\n[GC:G0 G55 G17 G21]\n[G55:1.0000,2.0000,3.0000]\n[G92:0.0000,0.0000,1.0000]\n"
            "[TLO:0.5000]\nok\n[PRB:2.0000,2.0000,5.5000:1]\n"
        )
        found = read_grbl_log(written(tmp_path, text))
        assert found.positions[0] == pytest.approx(np.array([1.0, 0.0, 1.0]) * 25.4)


class TestFusion:
    # The forms are those of posts; the numbers of the first are worked out by hand.
    HAAS = (
        "RESULTSFILE a\nSTART\nTOOLPATHID 12\nG330 N1 A0. B0. C0. X0 Y0 Z0 I0 R0\n"
        "G800 N1 X-0.4394 Y0.5291 Z-0.0753 I0.63893 J-0.76927 K0. O0. U0.005 L0.005\n"
        "G801 N1 X-.4187 Y.5040 Z-.0753 R.0345\n"
        "G800 N2 X1. Y0 Z0 I1 J0 K0 O0U0.01L-0.01\nEND\n"
    )

    def test_inches_run_together_words_and_a_miss(self, tmp_path: Path) -> None:
        found = read_fusion(written(tmp_path, self.HAAS), "inch")
        assert found.touches.labels == ("12-1",)
        assert found.missed == ("12-2",)
        assert found.tip_radius == pytest.approx(0.0345 * 25.4)
        radius, normal = float(found.tip_radius or 0), found.touches.normals[0]
        surface = (found.touches.positions[0] - radius * normal) / 25.4
        assert surface == pytest.approx([-0.440743, 0.530540, -0.0753], abs=1e-6)
        assert found.touches.nominal_points is not None
        nominal = found.touches.nominal_points[0] / 25.4
        assert float((surface - nominal) @ normal) == pytest.approx(-0.001966, abs=1e-6)

    def test_turned_work_plane(self, tmp_path: Path) -> None:
        """A published pair: points in a turned plane, and the same turned back (4 decimals)."""
        turned = (
            "START\nG330 N0 A-45.0 B-72.766 C0.0 X0.0 Y0.0 Z0.0 I0 R0\n"
            "G800 N1 X164.31 Y-42.453 Z97.652 I0.1707 J0.9091 K0.38 O0U0.01L-0.01\n"
            "G801 N1 X164.7686Y-40.006Z98.7278R2.9471\n"
            "G330 N42 A160.0 B-87.234 C180.0 X0.0 Y0.0 Z0.0 I0 R0\n"
            "G800 N43 X188.278 Y23.094 Z48.113 I-0.0318 J-0.9842 K0.1744 O0U0.01L-0.01\n"
            "G801 N43 X188.1761Y19.9397Z48.7242R2.9471\nEND\n"
        )
        found = read_fusion(written(tmp_path, turned), "mm").touches
        assert found.positions[0] == pytest.approx([-44.8784, 41.5226, 186.4354], abs=1e-4)
        assert found.positions[1] == pytest.approx([-48.0014, 35.4018, 186.0765], abs=1e-4)
        assert found.normals[0] == pytest.approx([0.4079, 0.9115, 0.0522], abs=1e-4)
        assert found.nominal_points is not None
        assert found.nominal_points[1] == pytest.approx([-46.3551, 38.1569, 186.258], abs=1e-4)

    @pytest.mark.parametrize(
        ("text", "line", "words"),
        [
            (HAAS.replace("Y-0.76927", "").replace("J-0.76927", ""), 5, "G800 has no J"),
            (HAAS.replace("G801 N1", "G801 N3"), 6, "G801 is of point 3"),
            (HAAS.replace("Y.5040", "Y.5040 Y0.0"), 6, "the letter Y is there twice"),
            (HAAS.replace("X-.4187", "X-.41?87"), 6, "is neither a letter nor a number"),
            ("START\nG801 N1 X0 Y0 Z0 R1\nEND\n", 2, "without a G800"),
            (HAAS.replace("I0.63893", "I0.1"), 5, "must be a unit vector"),
            (HAAS + HAAS[HAAS.index("START") :], 13, "there twice"),
            ("START\nEND\n", None, "no measured point"),
            (HAAS + "G800 N3 X0 Y0 Z0 I0 J0 K1\n", 9, "a point after END"),
            (HAAS.replace("X1.", "X1.2E-3"), 7, "neither a letter nor a number"),
        ],
    )
    def test_refused_with_its_line(
        self, tmp_path: Path, text: str, line: int | None, words: str
    ) -> None:
        with pytest.raises(InputError, match=words) as caught:
            read_fusion(written(tmp_path, text), "inch")
        assert line is None or f"line {line}:" in str(caught.value)

    def test_out_and_in_again_to_the_last_digit(self, tmp_path: Path) -> None:
        touches = example_touches()
        labels = touches.labels or ()
        write_fusion(tmp_path / "x.msr", touches.positions, touches.normals,
                     touches.nominal_points, labels, 3.0)  # fmt: skip
        again = read_fusion(tmp_path / "x.msr", "mm")
        assert again.touches.labels == touches.labels
        assert np.array_equal(again.touches.positions, touches.positions)
        assert np.array_equal(again.touches.nominal_points, touches.nominal_points)  # type: ignore[arg-type]
        # Normals are scaled to length one again: the last digit of a double.
        assert again.touches.normals == pytest.approx(touches.normals, abs=4e-16)
        assert again.tip_radius == 3.0


QIF = (
    f'<?xml version="1.0"?><QIFDocument xmlns="{NAMESPACE}" versionQIF="3.0.0" idMax="9">'
    '<QPId>fd43400a-29bf-4ec6-b96c-e2f846eb6ff6</QPId>UNITS<Results><MeasurementResultsSet n="1">'
    '<MeasurementResults id="8"><MeasuredPointSets n="1"><MeasuredPointSet count="2" id="7">'
    "<Points>0 0 3 10 0 3</Points><Normals>0 0 1 0 0 1</Normals><Compensated>false</Compensated>"
    "<ProbeRadius>2.5</ProbeRadius></MeasuredPointSet></MeasuredPointSets><InspectionStatus>"
    "<InspectionStatusEnum>PASS</InspectionStatusEnum></InspectionStatus></MeasurementResults>"
    "</MeasurementResultsSet></Results></QIFDocument>"
)
MM = (
    "<FileUnits><PrimaryUnits><LinearUnit><UnitName>mm</UnitName><UnitConversion><Factor>0.001"
    "</Factor></UnitConversion></LinearUnit></PrimaryUnits></FileUnits>"
)


class TestQif:
    def test_uncompensated_points(self, tmp_path: Path) -> None:
        found = read_qif(written(tmp_path, QIF.replace("UNITS", MM), "a.qif"))
        assert isinstance(found, FileReadings)
        assert found.touches.positions.tolist() == [[0, 0, 3], [10, 0, 3]]
        assert found.touches.labels == ("7-1", "7-2")
        assert found.tip_radius == 2.5

    def test_no_units_are_metres(self, tmp_path: Path) -> None:
        (found,) = read_point_sets(written(tmp_path, QIF.replace("UNITS", ""), "a.qif"))
        assert found.points[0].tolist() == [0, 0, 3000]
        assert found.radii is not None
        assert found.radii[0] == 2500.0

    def test_tip_centres_as_a_public_file_has_them(self, tmp_path: Path) -> None:
        """Figures of DMSC's sample: its own reported deviation comes out of centre and radius."""
        text = QIF.replace("UNITS", MM).replace('count="2"', 'count="1"')
        text = text.replace("0 0 3 10 0 3", "-51.726518705386 54.198959479609 -1.276811288879")
        text = text.replace("<Normals>0 0 1 0 0 1</Normals>", "").replace("2.5<", "2.49978271104<")
        (found,) = read_point_sets(written(tmp_path, text, "a.qif"))
        nominal = np.array([-50.175094015692, 54.198959479609, -3.125725044257])
        normal = np.array([-0.642788056925063, 0.0, 0.766044067841075])
        assert found.radii is not None
        deviation = float((found.points[0] - nominal) @ normal) - found.radii[0]
        assert deviation == pytest.approx(-0.086196035032941, abs=1e-9)
        rows_ = read_qif(tmp_path / "a.qif")
        assert isinstance(rows_, Rows)

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("/qif3", "/qif2", "QIF 3 is read"),
            ('count="2"', 'count="3"', "its count asks for 9"),
            ("0 0 3 10", "0 0 NaN 10", "'NaN' is not a finite"),
            ("<Compensated>false", "<Compensated>true", "taken off already"),
            ("<Compensated>false</Compensated>", "", "does not say whether"),
            ("<Normals>0 0 1", "<Normals>0 0 2", "normal 1 has length 2"),
            ("<Points>0 0 3 10 0 3</Points>", "<BinaryPoints/>", "binary forms are not"),
            ("<Points>", "<CoordinateSystemId>3</CoordinateSystemId><Points>", "of its own"),
            ("</Results>", "", "not well-formed XML"),
            ('<?xml version="1.0"?>', "<!DOCTYPE a []>", "entities"),
        ],
    )
    def test_refused(self, tmp_path: Path, old: str, new: str, words: str) -> None:
        text = QIF.replace("UNITS", MM).replace(old, new)
        with pytest.raises(InputError, match=words):
            read_qif(written(tmp_path, text, "a.qif"))

    def test_out_and_in_again_to_the_last_digit(self, tmp_path: Path) -> None:
        touches = example_touches()
        write_qif(tmp_path / "a.qif", touches.positions, touches.normals, touches.labels or (),
                  compensated=False, tip_radius=3.0)  # fmt: skip
        again = read_qif(tmp_path / "a.qif")
        assert isinstance(again, FileReadings)
        assert np.array_equal(again.touches.positions, touches.positions)
        assert again.touches.normals == pytest.approx(touches.normals, abs=4e-16)
        assert again.touches.labels == touches.labels

    def test_elements_stand_in_the_order_of_the_schema(self, tmp_path: Path) -> None:
        """Order and obligation as in QIF 3.0's schema, transcribed for the path to the set."""
        touches = example_touches()
        write_qif(tmp_path / "a.qif", touches.positions, touches.normals, touches.labels or (),
                  compensated=True, tip_radius=3.0, deviations=np.zeros(len(touches)))  # fmt: skip
        schema = {
            "QIFDocument": (["QPId"], ["QPId", "Header", "FileUnits", "Features", "Results"]),
            "FileUnits": (["PrimaryUnits"], ["PrimaryUnits", "OtherUnits"]),
            "PrimaryUnits": ([], ["AreaUnit", "AngularUnit", "ForceUnit", "LinearUnit"]),
            "LinearUnit": (["UnitName"], ["SIUnitName", "UnitName", "UnitConversion"]),
            "UnitConversion": (["Factor"], ["Factor", "Offset"]),
            "Results": (["MeasurementResultsSet"], ["Version", "MeasurementResultsSet"]),
            "MeasurementResultsSet": (["MeasurementResults"], ["MeasurementResults"]),
            "MeasurementResults": (
                ["InspectionStatus"],
                ["Attributes", "MeasuredFeatures", "MeasuredPointSets", "InspectionStatus"],
            ),
            "MeasuredPointSets": (["MeasuredPointSet"], ["MeasuredPointSet"]),
            "MeasuredPointSet": (
                ["Points", "Compensated"],
                ["Attributes", "Units", "CoordinateSystemId", "Points", "Normals", "Compensated",
                 "ProbeRadii", "MeasurementDeviceId", "Deviations"],
            ),
            "InspectionStatus": (["InspectionStatusEnum"], ["InspectionStatusEnum"]),
        }  # fmt: skip
        root = ET.parse(tmp_path / "a.qif").getroot()
        ids = [element.get("id") for element in root.iter() if element.get("id")]
        assert len(set(ids)) == len(ids)
        assert int(root.get("idMax", "0")) >= max(int(str(name)) for name in ids)
        for element in root.iter():
            name = element.tag.rpartition("}")[2]
            children = [child.tag.rpartition("}")[2] for child in element]
            needed, order = schema.get(name, ([], []))
            assert set(needed) <= set(children), name
            assert children == sorted(children, key=order.index), name
        for tag in ("n", "count"):
            assert all(int(str(e.get(tag))) > 0 for e in root.iter() if e.get(tag) is not None)


class TestDmis:
    OUT = (
        "$$ a comment\nFILNAM/'OUT'\nUNITS/MM, ANGDEC\n"
        "F(P1)=FEAT/POINT,CART,0,0,0,0,0,1\nFA(P1) = Feat/Point, CART, 0.0, $\n 0.0, 0.01, 0,0,1\n"
        "FA(C1)=FEAT/CIRCLE,INNER,CART,50,50,40,0,0,1,50\n"
        "F(P2)=FEAT/POINT,CART,5,0,0,0,0,1\nENDFIL\n"
    )

    def test_points_nominals_and_what_is_missing(self, tmp_path: Path) -> None:
        found = read_dmis(written(tmp_path, self.OUT), 3.0)
        assert found.touches.positions.tolist() == [[0.0, 0.0, 3.01]]
        assert found.touches.nominal_points is not None
        assert found.missed == ("P2",)
        inch = read_dmis(written(tmp_path, self.OUT.replace("UNITS/MM", "UNITS/INCH"), "i"), 3.0)
        assert inch.touches.positions[0, 2] == pytest.approx(0.01 * 25.4 + 3.0)
        assert read_dmis(tmp_path / "file.txt", 0.0).touches.positions[0, 2] == 0.01

    @pytest.mark.parametrize(
        ("text", "taken_off", "words"),
        [
            (OUT, None, "--radius-taken-off"),
            (OUT, -1.0, "a radius in mm, or 0"),
            (OUT.replace("UNITS/MM, ANGDEC\n", ""), 0.0, "no UNITS"),
            (OUT.replace("UNITS/MM", "UNITS/FEET"), 0.0, "MM and INCH are read"),
            (OUT.replace("0.01, 0,0,1", "0.01, 0,0,0"), 0.0, "zeros, or angles"),
            (OUT.replace("0.01, 0,0,1", "0.01, 90,90,0"), 0.0, "zeros, or angles"),
            (OUT.replace("Feat/Point, CART", "FEAT/POINT,POL"), 0.0, "CART is read"),
            (OUT + "FA(P1)=FEAT/POINT,CART,0,0,0,0,0,1\n", 0.0, "there twice"),
            ("PNT1 =FEAT/POINT,CARTESIAN\n", 0.0, "PC-DMIS"),
        ],
    )
    def test_refused(self, tmp_path: Path, text: str, taken_off: float | None, words: str) -> None:
        with pytest.raises(InputError, match=words):
            read_dmis(written(tmp_path, text), taken_off)


class TestPrintFile:
    OUT = (
        "-----------\n   COMPONENT NO 1      FEATURE NO 2\n-----------\n"
        "SIZE D71.0000   ACTUAL 71.9072   TOL 0.1000   DEV 0.9072\n"
        "          +++++OUT OF TOL+++++ ERROR  0.8072\n"
        "POSN X 10.0000   ACTUAL 10.0100   DEV .0100\nPOSN Z0   ACTUAL NaN   DEV NaN\n"
    )

    def test_features(self, tmp_path: Path) -> None:
        found = read_print_file(written(tmp_path, self.OUT), "mm")
        assert [(f.component, f.feature, f.quantity) for f in found] == [
            (1, 2, "SIZE D"), (1, 2, "POSN X")]  # fmt: skip
        assert found[0].tolerance == 0.1
        assert found[1].deviation == 0.01

    def test_deviation_that_is_not_the_difference(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match=r"line 4: DEV 0\.5 is not ACTUAL"):
            read_print_file(written(tmp_path, self.OUT.replace("DEV 0.9072", "DEV 0.5")), "mm")

    def test_it_is_a_table_not_touches(self, tmp_path: Path) -> None:
        path = written(tmp_path, self.OUT)
        assert "no touches" in run("convert", path, "--units", "mm", "-o", tmp_path / "f.csv")
        assert rows(tmp_path / "f.csv")[0]["quantity"] == "SIZE D"
        assert "features" in run("qualify", path, "--diameter", 25, code=2)


class TestCatalogue:
    @pytest.mark.parametrize(
        ("text", "name"),
        [
            (TestOwnLog.WHOLE, "linuxcnc"),
            ("1 2 3 0 0 0 0 0 0\n", "probeopen"),
            ("G1 X1.0 Y2.0 Z3.0\n", "positions"),
            (TestGrbl.LOG, "grbl"),
            (TestFusion.HAAS, "fusion"),
            (QIF, "qif"),
            (TestDmis.OUT, "dmis"),
            (TestPrintFile.OUT, "print"),
            ("x_mm,y_mm,z_mm,nx,ny,nz\n", "csv"),
        ],
    )
    def test_formats_are_recognised(self, tmp_path: Path, text: str, name: str) -> None:
        assert format_of(written(tmp_path, text)) == name
        assert name in {entry.name for entry in FORMATS}

    def test_every_format_is_in_the_documents(self) -> None:
        table = Path(__file__).parent.parent.parent / "docs" / "formats.md"
        text = table.read_text(encoding="utf-8")
        for entry in FORMATS:
            row = f"| `{entry.name}` | {entry.what} | {entry.reads} | {entry.writes} | "
            assert row + f"{entry.needs} | {entry.verified} |" in text

    def test_labels_like_coordinates_are_no_positions(self, tmp_path: Path) -> None:
        text = "label,x_mm,y_mm,z_mm,nx,ny,nz\nX1,0,0,3,0,0,1\nx2,1,0,3,0,0,1\n"
        assert format_of(written(tmp_path, text)) == "csv"

    def test_files_that_need_more_are_sent_to_convert(self, tmp_path: Path) -> None:
        path = written(tmp_path, TestFusion.HAAS)
        told = run("qualify", path, "--diameter", 25, code=2)
        assert "format fusion" in told
        assert "pretravel convert" in told

    def test_positions_want_the_plan_that_was_run(self, tmp_path: Path) -> None:
        path = written(tmp_path, "G21\nG1 X0 Y0 Z2.99\n")
        with pytest.raises(InputError, match="give the plan that was run"):
            read_readings(path)
        with pytest.raises(InputError, match="--tip-diameter"):
            read_readings(path, plan=PLAN)
        assert read_readings(path, plan=PLAN, tip_radius=3.0).touches.labels == ("a",)

    def test_turn_of_positions_comes_from_the_machine_file(self, tmp_path: Path) -> None:
        log = written(tmp_path, "G21\nG1 X0 Y0 Z2.99\n")
        (tmp_path / "plan.csv").write_text("label,x_mm,y_mm,z_mm,nx,ny,nz\na,0,0,0,0,0,1\n")
        mill = tmp_path / "mill.toml"
        mill.write_text(machine_text(Machine(work=work_placement(1, 2, 3, 0.5))))
        given = ["--plan", tmp_path / "plan.csv", "--machine", mill, "-o", tmp_path / "t.csv"]
        assert "turned by 28.6479°" in run("convert", log, *given, code=2)
        run("convert", log, *given, "--frame", "machine")
        found = read_readings(log, plan=PLAN, tip_radius=3.0, overtravel=2.0)
        assert "taken as not turned" in found.notes()[-1]

    def test_decimal_commas(self, tmp_path: Path) -> None:
        path = written(tmp_path, TestProbeOpen.ROW.format(x=0.0).replace(".", ","))
        with pytest.raises(InputError, match="use a point as decimal sign"):
            read_readings(path, units="mm", plan=PLAN, tip_radius=3.0)

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("G1 X0 Y0 Z2.99\n", "does not say its units"),
            ("G20\nG1 X0 Y0\n", "has no Z"),
            ("G21\nG1 X0 Y0 Z1\nhello\n", "line 3: 'hello' is no position"),
            ("G21\nG1 X0 Y0 Z2,990\n", "line 2: .*use points as decimal signs"),
            ("G21\nG1 X1.2.3 Y0 Z1\n", "line 2: .* is no position"),
            ("G21 G91\nG1 X0 Y0 Z1\n", "line 1: G91"),
        ],
    )
    def test_log_lines_refused(self, tmp_path: Path, text: str, words: str) -> None:
        with pytest.raises(InputError, match=words):
            read_log_positions(written(tmp_path, text))


class TestParquet:
    def test_touches_out_and_in_again(self, tmp_path: Path) -> None:
        touches = example_touches()
        write_touches(tmp_path / "t.parquet", touches)
        again = read_touches(tmp_path / "t.parquet")
        assert np.array_equal(again.positions, touches.positions)
        assert again.labels == touches.labels

    def test_read_by_another_program(self, tmp_path: Path) -> None:
        import pyarrow.parquet as pq

        run("convert", EXAMPLES / "part_touches.csv", "-o", tmp_path / "t.parquet")
        table = pq.read_table(str(tmp_path / "t.parquet"))
        assert str(table.schema.field("x_mm").type) == "double"
        assert table.num_rows == len(rows(EXAMPLES / "part_touches.csv"))

    def test_not_a_parquet_file(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="not a Parquet file"):
            read_touches(written(tmp_path, "hello", "t.parquet"))


@pytest.fixture(scope="module")
def map_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("map") / "map.nc"
    run("qualify", EXAMPLES / "sphere_touches.csv", "--diameter", 24.9987, "--tip-diameter", 6,
        "-o", path)  # fmt: skip
    return path


class TestCompensatedPoints:
    @pytest.mark.parametrize("ending", ["parquet", "qif", "msr"])
    def test_same_points_in_every_format(self, tmp_path: Path, map_file: Path, ending: str) -> None:
        from pretravel.formats.map_file import read_map

        source = EXAMPLES / "part_touches.csv"
        out = tmp_path / f"points.{ending}"
        run("compensate", source, "--map", map_file, "-o", out)
        expected = apply(read_touches(source), read_map(map_file))
        if ending == "parquet":
            import pyarrow.parquet as pq

            table = pq.read_table(str(out))
            found = np.array([table[f"{a}_mm"].to_pylist() for a in "xyz"]).T
        elif ending == "qif":
            (points,) = read_point_sets(out)
            assert all(points.compensated)
            found = points.points
        else:
            readings = read_fusion(out, "mm")
            # What Fusion does with the file: the radius taken off along the nominal's normal.
            found = readings.touches.positions - 3.0 * readings.touches.normals
        assert found == pytest.approx(expected.positions, abs=1e-12)

    def test_from_a_log_to_points(self, tmp_path: Path, map_file: Path) -> None:
        log = written(tmp_path, TestOwnLog.WHOLE, "a.log")
        run("compensate", log, "--map", map_file, "-o", tmp_path / "p.csv")
        assert positions(tmp_path / "p.csv").shape == (1, 3)
