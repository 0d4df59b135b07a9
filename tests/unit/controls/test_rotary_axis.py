"""Rotary axis from touches of a sphere at several angles: exact cases, coverage, refusals."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, ring_pattern
from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE
from pretravel.controls.rotary_axes import AXIS_LETTERS, RotaryAxis, rotary_axis
from pretravel.controls.tasks.axis import FindAxis
from pretravel.files.map_file import read_map, write_map
from pretravel.uncertainty.covariance import Covariance
from tests.support.commands import both_outputs, rows, run
from tests.support.example_maps import mean_map
from tests.support.examples import EXAMPLES

PLACE = np.array([100.0, 50.0, -30.0])
NORMALS = ring_pattern(np.array([0.0, 45.0, 90.0]) * DEGREE, 8)
TURNS = np.arange(0.0, 360.0, 60.0) * DEGREE
SLOPES = (2e-4, -3e-4)


def direction_of(letter: str) -> FloatArray:
    axis = AXIS_LETTERS[letter]
    direction = np.zeros(3)
    direction[[i for i in range(3) if i != axis]] = SLOPES
    direction[axis] = 1.0
    return direction / np.linalg.norm(direction)


def touched(
    letter: str,
    turns: FloatArray,
    random: np.random.Generator | None = None,
    *,
    sense: int = -1,
    noise: float = 0.0,
    wander: float = 0.0,
    pretravel: FloatArray | float = 0.0,
) -> list[FloatArray]:
    """Touches of a sphere of 25 mm on a table, from above, at each angle."""
    start = np.roll([40.0, 70.0, 10.0], AXIS_LETTERS[letter])
    sets = []
    for turn in turns:
        center = PLACE + Rotation.from_rotvec(sense * turn * direction_of(letter)).apply(start)
        scatter = np.zeros(len(NORMALS))
        if random is not None:
            center = center + random.normal(0.0, wander, 3)
            scatter = random.normal(0.0, noise, len(NORMALS))
        sets.append(center + (12.5 - pretravel + scatter)[:, None] * NORMALS)
    return sets


def truth(found: RotaryAxis) -> FloatArray:
    """The values of the true axis, at the height of the found point."""
    axis = AXIS_LETTERS[found.letter]
    direction = direction_of(found.letter)
    point = PLACE + direction * (found.point[axis] - PLACE[axis]) / direction[axis]
    across = list(found.across)
    return np.concatenate([point[across], direction[across] / direction[axis]])


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("letter", AXIS_LETTERS)
def test_an_exact_axis_is_found(letter: str, sense: int) -> None:
    for turns in (TURNS, np.array([-20.0, 10.0, 55.0, 110.0]) * DEGREE):
        found = rotary_axis(touched(letter, turns, sense=sense), turns.tolist(), letter)
        assert found.sense == sense
        # Positions of 200 mm in double precision, and slopes from a circle of 70 mm.
        assert found.values == pytest.approx(truth(found), abs=1e-8)
        assert np.max(np.abs(found.residuals)) < 1e-9


def test_another_axis_is_refused_with_its_inclination(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(globals(), "SLOPES", (np.tan(20.0 * DEGREE), 0.0))
    with pytest.raises(PretravelError, match="inclined by 20 degrees to z"):
        rotary_axis(touched("C", TURNS), TURNS.tolist(), "C")


@pytest.mark.long
@pytest.mark.parametrize(
    ("sets", "noise", "wander"),
    [(20, 5e-4, 1e-3), pytest.param(200, 5e-4, 5e-4, marks=pytest.mark.slow)],
)
def test_the_interval_contains_the_axis(sets: int, noise: float, wander: float) -> None:
    """Of 200 sets with four values each the share of 95 % is known to 0.8 %, of 20 to 2.4 %."""
    random = np.random.default_rng(1)
    inside = []
    for _ in range(sets):
        points = touched("C", TURNS, random, noise=noise, wander=wander)
        found = rotary_axis(points, TURNS.tolist(), "C")
        inside.append(np.abs(found.values - truth(found)) < found.expanded)
    low, high = (0.93, 0.97) if sets == 200 else (0.88, 1.0)
    assert low <= np.mean(inside) <= high


def test_what_a_map_leaves_moves_the_place_and_is_in_its_u() -> None:
    """A common error of the pretravel along x moves all centres, and no residual shows it."""
    error = 2e-3 * NORMALS[:, 0]
    sets = touched("C", TURNS, pretravel=error)
    every = np.tile(error, len(TURNS))
    plain = rotary_axis(sets, TURNS.tolist(), "C")
    assert plain.values[0] == pytest.approx(truth(plain)[0] - 2e-3, abs=1e-8)
    known = rotary_axis(sets, TURNS.tolist(), "C", [Covariance.full(np.outer(every, every))])
    # One standard uncertainty of the common error moves the place by 2 µm.
    assert np.sqrt(known.covariance[0, 0]) == pytest.approx(2e-3, rel=1e-6)


def moved(files: list[Path], outward: float, along_x: float) -> list[str]:
    """The touches of `files` with the sphere moved on the table and the axis along x, as checks."""
    found = []
    for path in files:
        head, *lines = path.read_text().splitlines()
        turn = -float(path.stem[1:]) * DEGREE  # the table of the example turns clockwise
        x, y = outward * np.cos(turn) + along_x, outward * np.sin(turn)
        cells = [line.split(",") for line in lines]
        text = [",".join([c[0], f"{float(c[1]) + x:.6f}", f"{float(c[2]) + y:.6f}", *c[3:]])
                for c in cells]  # fmt: skip
        found.append(path.with_name(f"moved_{outward}_{path.name}"))
        found[-1].write_text("\n".join([head, *text]) + "\n")
    return [str(word) for path in found for word in ("--check", path)]


TRUE = {
    "place_x_mm": 150.012, "place_y_mm": -80.007, "slope_x_mm_per_m": 0.2, "slope_y_mm_per_m": -0.3,
}  # fmt: skip


class TestCommand:
    LOG = EXAMPLES / "axis_touches.csv"

    @pytest.mark.long
    def test_one_log_with_angles_in_its_labels(self, tmp_path: Path) -> None:
        """The axis of the example, 60 mm above the height at which its place is stated."""
        run("qualify", EXAMPLES / "sphere_touches.csv", "--diameter", 24.9987, "--tip-diameter", 6,
            "--kind", "harmonic", "-o", tmp_path / "map.json")  # fmt: skip
        options = ("--axis", "C", "--map", tmp_path / "map.json")
        out = run("axis", self.LOG, *options, "-o", tmp_path / "axis.csv")
        assert "against the angle" in out
        for row in rows(tmp_path / "axis.csv"):
            true = TRUE[row["quantity"]]
            if row["quantity"].startswith("place"):
                true += 0.06 * TRUE[row["quantity"].replace("place", "slope")[:7] + "_mm_per_m"]
            # One set: the four errors of 95 % intervals; twice U holds for practically all.
            assert abs(float(row["value"]) - true) < 2.0 * float(row["expanded_uncertainty"])
        run("axis", self.LOG, *options, "--work", "1,2,3", "-o", tmp_path / "axis.hal")
        assert "setp xyzac-trt-kins.x-rot-point 151.0" in (tmp_path / "axis.hal").read_text()

    @pytest.mark.long
    def test_files_and_a_second_radius(self, tmp_path: Path) -> None:
        head, *lines = self.LOG.read_text().splitlines()
        files = []
        for angle in (0, 60, 120, 180):
            files.append(tmp_path / f"c{angle}.csv")
            own = [line for line in lines if line.startswith(f"at{angle}_")]
            files[-1].write_text("\n".join([head, *own]) + "\n")
        stated = ("--angles", "0,60,120,180", "--axis", "C")
        same = [word for path in files for word in ("--check", path)]
        assert "has the same touches" in run("axis", *files, *stated, *same, code=2)
        check = moved(files, 10.0, 0.0)
        left_out = ("--exclude", f"{files[1].name}:3")  # a line of one of the files
        out = run("axis", *files, *stated, *check, *left_out)
        warnings = FindAxis(touches=(self.LOG,), axis="C").run().document().warnings
        assert any("no map of the probe is given" in warning for warning in warnings)
        assert "check at another radius" in out
        assert "one angle is needed for each file" in run("axis", *files[1:], *stated, code=2)
        turned = files[1].with_name("turned.csv")
        for angle, code in ((60, 0), (-60, 2)):
            text = files[1].read_text().splitlines()
            text = [text[0] + ",c_deg", *(f"{line},{angle}" for line in text[1:])]
            turned.write_text("\n".join(text))
            told = run("axis", files[0], turned, *files[2:], *stated, code=code)
            assert ("gives c_deg -60, and the angle 60" in told) == (code == 2)
        assert "the file gives the label at60_s1" in run("axis", *files, "--axis", "C", "--angles",
                                                         "0,90,120,180", code=2)  # fmt: skip
        told = "".join(both_outputs("axis", *files, *stated, *moved(files, 0.0, 0.02), code=3))
        assert "contradicted" in told
        assert "at the same distance" in told


def test_the_sphere_is_beside_its_planned_place(tmp_path: Path) -> None:
    """Touches along planned normals meet the sphere beside them.

    A tip of 6 mm and a pretravel of 10 µm, the same in all directions; the sphere is off by up to
    1 mm, differently at each angle, as by a place of the axis that is known to 0.5 mm.
    """
    write_map(tmp_path / "map.json", replace(mean_map(0.010), tip_radius=3.0))
    reach = 12.5 + 3.0 - 0.010
    true = np.array([100.0, 50.0])
    lines = ["label,x_mm,y_mm,z_mm,nx,ny,nz"]
    for degrees in range(0, 360, 60):
        turn = -degrees * DEGREE
        center = np.array([*(true + 60 * np.array([np.cos(turn), np.sin(turn)])), -30.0])
        off = 0.5 * np.array([np.cos(turn) - 1.0, np.sin(turn), 0.0])
        for i, normal in enumerate(NORMALS):
            # Along the planned normal, to where the tip meets the true sphere.
            across = off - (off @ normal) * normal
            place = center + across + np.sqrt(reach**2 - across @ across) * normal
            cells = ",".join(f"{value:.9f}" for value in (*place, *normal))
            lines.append(f"at{degrees}_s{i},{cells}")
    (tmp_path / "t.csv").write_text("\n".join(lines) + "\n")
    run("axis", tmp_path / "t.csv", "--axis", "C", "--map", tmp_path / "map.json",
        "-o", tmp_path / "axis.csv")  # fmt: skip
    found = {row["quantity"]: float(row["value"]) for row in rows(tmp_path / "axis.csv")}
    # Stated normals would be wrong by 1.5 µm; the digits of the file are 1e-6 µm.
    assert found["place_x_mm"] == pytest.approx(true[0], abs=2e-6)
    assert found["place_y_mm"] == pytest.approx(true[1], abs=2e-6)
    assert found["slope_x_mm_per_m"] == pytest.approx(0.0, abs=2e-4)
    assert found["slope_y_mm_per_m"] == pytest.approx(0.0, abs=2e-4)


class TestCentreOfTheMap:
    """A shift of a centre and a pretravel with one lobe are the same on a sphere."""

    AXIAL = 1.7e-3
    """True pretravel along the probe axis: the map assumes 1 µm with u = 0.7 µm. [mm]"""

    def _map(self, path: Path, kind: str = "harmonic") -> None:
        """Qualified without noise: the tip of 6 mm, 10 µm across and 1.7 µm along the axis."""
        normals = np.vstack([fibonacci_cap(60, 90.0 * DEGREE), NORMALS])
        touches = (12.5 + 3.0 - self._pretravel(normals))[:, None] * normals
        cells = np.hstack([touches, normals])
        head = "x_mm,y_mm,z_mm,nx,ny,nz"
        np.savetxt(path.with_suffix(".csv"), cells, "%.9f", ",", header=head, comments="")
        run("qualify", path.with_suffix(".csv"), "--diameter", 25, "--tip-diameter", 6,
            "--kind", kind, "-o", path)  # fmt: skip

    def _pretravel(self, normals: FloatArray) -> FloatArray:
        return 0.010 - (0.010 - self.AXIAL) * normals[:, 2] ** 2

    def _axis(self, path: Path, tmp_path: Path) -> dict[str, dict[str, str]]:
        """An A axis that tilts the sphere: z of its place has what the map assumes."""
        lines = ["label,x_mm,y_mm,z_mm,nx,ny,nz"]
        reach = 12.5 + 3.0 - self._pretravel(NORMALS)
        for degrees in range(-60, 61, 20):
            turned = Rotation.from_rotvec([degrees * DEGREE, 0.0, 0.0]).apply([0.0, 40.0, 70.0])
            places = PLACE + turned + reach[:, None] * NORMALS
            for i, row in enumerate(np.hstack([places, NORMALS])):
                lines.append(f"at{degrees}_s{i}," + ",".join(f"{value:.9f}" for value in row))
        (tmp_path / "t.csv").write_text("\n".join(lines) + "\n")
        run("axis", tmp_path / "t.csv", "--axis", "A", "--map", path, "-o", tmp_path / "a.csv")
        return {row["quantity"]: row for row in rows(tmp_path / "a.csv")}

    @pytest.mark.long
    def test_an_assumed_pretravel_along_the_axis_is_in_u_of_the_place(self, tmp_path: Path) -> None:
        """0.7 µm of pretravel more than assumed move every centre by that, and no residual says it.

        u along z is at least that of the assumption, 0.7 µm (`U_AXIAL_PRETRAVEL`), and of the
        travel during an unknown delay, 3.33 µm at the usual 100 mm/min.
        """
        self._map(tmp_path / "map.json")
        found = self._axis(tmp_path / "map.json", tmp_path)
        z = found["place_z_mm"]
        off = float(z["value"]) - PLACE[2]
        assert abs(off) == pytest.approx(self.AXIAL - 1e-3, abs=1e-4)
        assert math.hypot(0.7e-3, 1e-3 / 0.3) <= float(z["u"]) < 3.5e-3
        assert abs(off) < float(z["expanded_uncertainty"])
        y = found["place_y_mm"]
        assert abs(float(y["value"]) - PLACE[1]) < float(y["expanded_uncertainty"]) < 0.7e-3

    def test_a_map_without_shape_has_a_larger_one(self, tmp_path: Path) -> None:
        self._map(tmp_path / "map.json", "mean")
        z = self._axis(tmp_path / "map.json", tmp_path)["place_z_mm"]
        assert abs(float(z["value"]) - PLACE[2]) < float(z["expanded_uncertainty"])

    @pytest.mark.long
    def test_a_map_that_does_not_state_it_is_named(self, tmp_path: Path) -> None:
        self._map(tmp_path / "map.json")
        made = read_map(tmp_path / "map.json")
        write_map(
            tmp_path / "old.json",
            replace(made, provenance=replace(made.provenance, center_covariance=None)),
        )
        for name, told in (("map.json", False), ("old.json", True)):
            found = FindAxis(
                touches=(EXAMPLES / "axis_touches.csv",), axis="C", map_file=tmp_path / name
            ).run()
            warnings = found.document().warnings
            assert any("uncertainty of its centre" in warning for warning in warnings) is told

    def test_what_touches_and_map_state_is_compared(self, tmp_path: Path) -> None:
        """Feed, spindle and diameter; a reader's gross error; a map that is only predicted."""
        made = replace(mean_map(0.010), tip_radius=3.0, feed=50.0)
        made = replace(made, provenance=replace(made.provenance, spindle_deg=0.0))
        write_map(tmp_path / "map.json", made)
        head, *lines = (EXAMPLES / "axis_touches.csv").read_text().splitlines()
        lines = [line.rsplit(",", 1)[0] + ",100,0" for line in lines]
        cells = lines[7].split(",")
        lines[7] = ",".join([cells[0], str(float(cells[1]) + 0.3), *cells[2:]])
        path = tmp_path / "t.csv"
        path.write_text("\n".join([head + ",spindle_deg", *lines]) + "\n")
        task = FindAxis(touches=(path,), axis="C", map_file=tmp_path / "map.json")
        told = " ".join(task.run().document().warnings)
        assert "made at 50 mm/min, these touches at 100" in told
        assert "is far from the sphere" in told
        assert "scatter by" in told
        with pytest.raises(PretravelError, match=r"diameter of 20 mm, and the touches lie on one"):
            replace(task, diameter=20.0, exclude=("at0_s8",)).run()
        path.write_text(path.read_text().replace(",100,0", ",100,90"))
        with pytest.raises(PretravelError, match=r"spindle turned to 90°"):
            task.run()
        text = path.read_text().splitlines()
        path.write_text("\n".join([*text[:-1], text[-1].replace(",100,90", ",100,0")]) + "\n")
        with pytest.raises(PretravelError, match=r"was made at spindle 0°"):
            replace(task, map_file=None).run()


class TestRefusals:
    @pytest.mark.parametrize(
        ("degrees", "words"),
        [
            ((0, 60), "3, and 6 all around"),
            ((0, 0, 360), "1 different angles"),
            ((0, 180, 0), "2 different"),
        ],
    )
    def test_angles(self, degrees: tuple[float, ...], words: str) -> None:
        turns = np.array(degrees) * DEGREE
        with pytest.raises(PretravelError, match=words):
            rotary_axis(touched("C", turns), turns.tolist(), "C")

    def test_angles_of_other_touches(self) -> None:
        wrong = TURNS[[0, 2, 1, 3, 4, 5]]
        with pytest.raises(PretravelError, match=r"off a circle"):
            rotary_axis(touched("C", TURNS), wrong.tolist(), "C")

    def test_another_letter(self) -> None:
        with pytest.raises(PretravelError, match=r"inclined by|in which sense"):
            rotary_axis(touched("C", TURNS), TURNS.tolist(), "A")
