"""slide, faces, plan, and simulate and compensate on parts, as a user types them."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

from pretravel.cli import main
from pretravel.formats.map_file import read_map
from pretravel.probing.targets import Targets
from pretravel.probing.touching import touch
from pretravel.surface.parametric import Convex
from tests.conftest import EXAMPLES
from tests.unit.test_command_line import positions, rows, run

PART = EXAMPLES / "part.step"


class TestSlide:
    COLUMNS = ("step", "feed_mm", "deflection_mm", "Cx", "Cy", "Cz", "Tx", "Ty", "Tz",
               "nx", "ny", "nz", "force_N", "triggered")  # fmt: skip

    def test_the_contract(self, tmp_path: Path) -> None:
        out, picture = tmp_path / "slide.csv", tmp_path / "slide.png"
        text = run("slide", "omp40-2", "--surface", "convex", "--at", "0.5,-0.5", "--step", 0.001,
                   "--steps", 20, "-o", out, "--plot", picture)  # fmt: skip
        table = rows(out)
        assert set(self.COLUMNS) <= set(table[0])
        assert len(table) == 20
        assert float(table[19]["deflection_mm"]) == pytest.approx(0.023993, rel=1e-3)
        triggered = [int(row["triggered"]) for row in table]
        assert triggered == sorted(triggered)
        assert triggered[0] == 0
        assert triggered[-1] == 1
        first = triggered.index(1)
        assert f"triggers in step {first + 1}" in text
        assert "at once, sideways only: 2.98" in text
        local = Convex().local(np.array([[0.5, -0.5]]))
        whole = touch("omp40-2", "convex", Targets(local.point, local.normal)).pretravel[0]
        assert f"at once, all that gives: {1e3 * whole:.3f} µm" in text
        # Force is known until the trigger; then a seat is open and the cell is empty.
        assert all(
            (row["force_N"] == "") == (t == 1) for row, t in zip(table, triggered, strict=True)
        )
        for row in table:
            c, t, n = (
                np.array([float(row[f"{letter}{axis}"]) for axis in "xyz"]) for letter in "CTn"
            )
            assert np.abs(c - t - 3.0 * n).max() < 1e-9
        assert picture.read_bytes()[:4] == b"\x89PNG"

    def test_the_ellipsoid_as_in_the_thesis(self, tmp_path: Path) -> None:
        out = tmp_path / "slide.csv"
        run("slide", "omp40-2", "--surface", "ellipsoid:a=10,b=10,c=6", "--at",
            f"0,{math.radians(40.0)}", "-o", out)  # fmt: skip
        assert float(rows(out)[19]["deflection_mm"]) == pytest.approx(0.044346, abs=1e-6)

    def test_a_face_of_a_part(self, tmp_path: Path) -> None:
        text = run("slide", "omp40-2", "--surface", f"{PART}#1", "--at", "10,10",
                   "--kinematics", "full", "--model", "shen")  # fmt: skip
        assert "triggers in step" in text

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--surface", "convex", "--at", "2,0"], "is not on the surface"),
            (["--surface", "convex", "--at", "middle"], "expected two numbers"),
            (["--surface", "convex", "--at", "0,0", "--step", "0"], "above zero"),
            (["--surface", "convex", "--at", "0,0", "--steps", "0"], "1 to 100000"),
            (["--surface", "convex", "--at", "0,0", "--process", "odd"], "not one of 'curved'"),
            (["--surface", "convex", "--at", "0,0", "--search", "golden"], "vertical and inclined"),
            (["--surface", "convex", "--at", "0.5,0.5", "--process", "vertical"], "for walls"),
            (
                [
                    "--surface",
                    "plane:polar=40",
                    "--at",
                    "0,0",
                    "--process",
                    "inclined",
                    "--kinematics",
                    "full",
                ],
                "is for curved",
            ),
            (["--surface", "plane:polar=40", "--at", "0,0", "--process", "sideways"], "vertical"),
            (["--surface", "plane:polar=0", "--at", "0,0"], "--kinematics full"),
            (["--surface", "sphere:radius=5", "--at", "0,0"], "across the probe axis"),
        ],
    )
    def test_errors_teach(self, arguments: list[str], words: str, tmp_path: Path) -> None:
        out = tmp_path / "slide.csv"
        assert words in run("slide", "omp40-2", *arguments, "-o", out, code=2)
        assert not out.exists()

    def test_golden_section(self) -> None:
        text = run("slide", "omp40-2", "--surface", "plane:polar=40", "--at", "0,0", "--process",
                   "inclined", "--search", "golden", "--steps", 80)  # fmt: skip
        assert "trials of a golden section" in text
        at_once = text.split("sideways only: ")[1].split(" ")[0]
        assert f"found: the trigger, after {at_once} µm" in text
        # From first contact to the trigger the contact slides down 40°: feed / tan(40°).
        slide = float(text.split("slides ")[1].split(" ")[0])
        assert slide == pytest.approx(float(at_once) / math.tan(math.radians(40.0)), rel=1e-3)


class TestFacesAndPlan:
    def test_faces(self, tmp_path: Path) -> None:
        out, picture = tmp_path / "faces.csv", tmp_path / "faces.png"
        text = run("faces", PART, "-o", out, "--plot", picture)
        assert "1 faces, 60.00 x 40.00" in text
        (row,) = rows(out)
        assert (row["face"], row["type"]) == ("1", "B-spline")
        assert float(row["nz"]) > 0.5
        assert picture.exists()

    def test_plan_is_read_by_simulate(self, tmp_path: Path) -> None:
        plan, touches = tmp_path / "plan.csv", tmp_path / "touches.csv"
        text = run("plan", f"{PART}#1", "--spacing", 6, "-o", plan,
                   "--plot", tmp_path / "p.png")  # fmt: skip
        count = len(rows(plan))
        assert f"{count} targets" in text
        run("simulate", "omp40-2", "--surface", PART, "--targets", plan, "-o", touches)
        assert [row["label"] for row in rows(touches)] == [row["label"] for row in rows(plan)]

    def test_by_curvature_and_grid(self, tmp_path: Path) -> None:
        for way in (["--curvature", 50], ["--grid", "6x4"]):
            run("plan", PART, *way, "-o", tmp_path / "plan.csv")
        assert len(rows(tmp_path / "plan.csv")) == 8  # its rim lies within the margin

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--grid", "6"], "the points along u and the points along v"),
            ([], "one way to choose"),
            (["--grid", "2x2", "--max-polar", "0"], "greater than or equal to 0.001"),
            (["--grid", "2x2", "--u", "5"], "expected two numbers"),
        ],
    )
    def test_errors_teach(self, arguments: list[str], words: str, tmp_path: Path) -> None:
        out = tmp_path / "plan.csv"
        assert words in run("plan", PART, *arguments, "-o", out, code=2)
        assert not out.exists()

    def test_surfaces_that_cannot_be(self, tmp_path: Path) -> None:
        out = tmp_path / "plan.csv"
        for surface, words in (
            (f"{PART}#2", "has no face 2; it has 1"),
            (f"{PART}#top", "no face named 'top'"),
            ("nowhere.step", "cannot be opened"),
            ("nowhere.py", "no such file"),
            ("cone:radius=5,half_angle=95", "between 0 and 90"),
        ):
            assert words in run("plan", surface, "--grid", "2x2", "-o", out, code=2)

    def test_a_surface_of_ones_own(self, tmp_path: Path) -> None:
        mine = tmp_path / "mine.py"
        mine.write_text(
            "import numpy as np\nfrom pretravel import FunctionSurface\n"
            "dome = FunctionSurface(lambda u, v: (u, v, 5 * np.cos(0.1 * u)), (-9, 9), (-9, 9))\n"
        )
        out = tmp_path / "plan.csv"
        run("plan", f"{mine}#dome", "--grid", "3x3", "-o", out)
        assert len(rows(out)) == 9
        assert "has no 'surface'" in run("plan", mine, "--grid", "3x3", "-o", out, code=2)
        mine.write_text("surface = 1 / 0")
        assert "ZeroDivisionError" in run("plan", mine, "--grid", "3x3", "-o", out, code=2)


class TestThereAndBack:
    """simulate on the part, compensate with the nominal part: the surface again, 1e-6 mm."""

    def _touches(self, folder: Path, *extra: object) -> Path:
        run("plan", PART, "--spacing", 8, "-o", folder / "plan.csv")
        run("simulate", "omp40-2", "--surface", PART, "--targets", folder / "plan.csv",
            "-o", folder / "touches.csv", *extra)  # fmt: skip
        return folder / "touches.csv"

    def _deviation(self, folder: Path, touches: Path, *extra: object) -> np.ndarray:
        run("compensate", touches, "--nominal", PART, "-o", folder / "points.csv", *extra)
        return np.array([float(row["deviation_um"]) for row in rows(folder / "points.csv")])

    def test_with_a_predicted_map_whatever_its_grid(self, tmp_path: Path) -> None:
        touches = self._touches(tmp_path)
        for step in (10, 45):
            run("predict", "omp40-2", "--polar", f"0:90:{step}", "--azimuth", "0:350:10",
                "-o", tmp_path / "map.nc")  # fmt: skip
            off = self._deviation(tmp_path, touches, "--map", tmp_path / "map.nc")
            assert np.abs(off).max() < 1e-3  # µm

    def test_with_the_probe_itself(self, tmp_path: Path) -> None:
        touches = self._touches(tmp_path, "--model", "shen")
        off = self._deviation(tmp_path, touches, "--map", "omp40-2", "--model", "shen")
        assert np.abs(off).max() < 1e-3
        # The other model is another probe.
        assert np.abs(self._deviation(tmp_path, touches, "--map", "omp40-2")).max() > 0.5

    def test_in_the_machines_frame(self, tmp_path: Path) -> None:
        place = ("--place", "100,-50,20,5,-8,30", "--frame", "machine")
        touches = self._touches(tmp_path, *place)
        at = positions(touches)
        assert at[:, 0].mean() > 60.0  # it is there, not where the part's frame is
        off = self._deviation(tmp_path, touches, "--map", "omp40-2", *place)
        assert np.abs(off).max() < 1e-3
        points = positions(tmp_path / "points.csv")
        assert np.linalg.norm(points - at, axis=1).max() < 3.1
        message = run("compensate", touches, "--map", "omp40-2", "--nominal", PART, "-o",
                      tmp_path / "x.csv", code=2)  # fmt: skip
        assert "Is the nominal where the part is" in message

    def test_a_measured_map_as_probe(self, tmp_path: Path) -> None:
        sphere = EXAMPLES / "sphere_touches.csv"
        run("qualify", sphere, "--diameter", 24.9987, "--tip-diameter", 6, "-o", tmp_path / "q.nc")
        run("plan", PART, "--spacing", 8, "-o", tmp_path / "plan.csv")
        run("simulate", tmp_path / "q.nc", "--surface", PART, "--targets", tmp_path / "plan.csv",
            "-o", tmp_path / "t.csv")  # fmt: skip
        off = self._deviation(tmp_path, tmp_path / "t.csv", "--map", tmp_path / "q.nc")
        assert np.abs(off).max() < 1e-3
        message = run("simulate", tmp_path / "q.nc", "--surface", PART, "--targets",
                      tmp_path / "plan.csv", "-o", tmp_path / "t.csv", "--friction", 0.1,
                      code=2)  # fmt: skip
        assert "is a map" in message

    def test_targets_that_fail_are_named_or_left_out(self, tmp_path: Path) -> None:
        targets, out = tmp_path / "t.csv", tmp_path / "touches.csv"
        targets.write_text(
            "label,x_mm,y_mm,z_mm,nx,ny,nz\nin,30,20,11,0,0,1\nbeside,70,20,11,0,0,1\n"
        )
        arguments = ("simulate", "omp40-2", "--surface", PART, "--targets", targets, "-o", out)
        message = run(*arguments, code=2)
        assert "1 of 2 targets cannot be touched: 1 missed" in message
        assert "target 2 (beside)" in message
        assert not out.exists()
        run(*arguments, "--leave-out")
        assert [row["label"] for row in rows(out)] == ["in"]


def test_faces_that_cannot_be_read_are_not_in_the_way_and_that_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from netgen.occ import Cylinder, Pnt, Z

    from pretravel.errors import PretravelError
    from pretravel.surface.cad import brep

    def broken(*_: object) -> None:
        raise PretravelError("a cylinder like no other")

    rod = tmp_path / "rod.step"
    Cylinder(Pnt(0, 0, 0), Z, 20, 10).WriteStep(str(rod))
    monkeypatch.setattr(brep, "_ELEMENTARY", {**brep._ELEMENTARY, 2: ("cylinder", broken, 1)})
    targets = tmp_path / "t.csv"
    targets.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,10,0,0,1\n")
    monkeypatch.setattr(
        sys, "argv",
        ["pretravel", "simulate", "omp40-2", "--surface", f"{rod}#2", "--targets", str(targets),
         "-o", str(tmp_path / "o.csv")],
    )  # fmt: skip
    with pytest.raises(SystemExit) as stop:
        main.run()
    assert stop.value.code in (0, None)
    said = capsys.readouterr().err
    assert "face 1 cannot be used (cylinder: a cylinder like no other)" in said
    assert "not in the way" in said


def test_predicted_tables_say_that_they_are_tables(tmp_path: Path) -> None:
    for ending, kind in ((".json", "tabulated"), (".nc", "physical")):
        run("predict", "omp40-2", "--polar", "0:90:30", "-o", tmp_path / f"m{ending}")
        if ending == ".json":
            assert json.loads((tmp_path / "m.json").read_text())["kind"] == kind
        else:
            assert read_map(tmp_path / "m.nc").kind == kind


def test_the_example_part_measured(tmp_path: Path) -> None:
    """Real noise, another's simulation: with the part as nominal the deviations are those along
    the nominal points' normals, but for the slide: hundredths of a micrometre."""
    run("qualify", EXAMPLES / "sphere_touches.csv", "--diameter", 24.9987, "--tip-diameter", 6,
        "-o", tmp_path / "q.nc")  # fmt: skip
    touches = EXAMPLES / "part_touches.csv"
    run("compensate", touches, "--map", tmp_path / "q.nc", "-o", tmp_path / "a.csv")
    run("compensate", touches, "--map", tmp_path / "q.nc", "--nominal", PART,
        "-o", tmp_path / "b.csv")  # fmt: skip
    plain, on_part = (
        np.array([float(row["deviation_um"]) for row in rows(tmp_path / name)])
        for name in ("a.csv", "b.csv")
    )
    assert len(plain) == len(on_part) == 140
    assert np.abs(on_part - plain).max() < 0.3
    assert np.std(on_part) == pytest.approx(np.std(plain), rel=0.02)


def test_help_everywhere() -> None:
    for command in ("slide", "faces", "plan"):
        assert "Example:" in run(command, "--help")
