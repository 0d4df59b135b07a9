"""Directions of a rig, also beside those across the probe's axis, its map, and forces from it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from pretravel.base.errors import PretravelError
from pretravel.files.map_file import read_map
from pretravel.laboratory.rig.budget import REN_BUDGET, LengthComponent
from pretravel.laboratory.rig.calibration import RigCalibration, angles_of, calibrate_rig
from pretravel.laboratory.rig.map import rig_map
from pretravel.laboratory.rig.rig_csv import rig_traces
from pretravel.laboratory.rig.trace import RigTouch
from pretravel.prediction.catalogue import load_probe
from tests.support.commands import both_outputs, rows, run
from tests.support.examples import EXAMPLES
from tests.support.results import data_of
from tests.support.statics_by_hand import direction

TRACES = sorted((EXAMPLES / "rig").glob("*.csv"))
RING = [f"probe_{azimuth:03d}" for azimuth in range(0, 360, 30)]
CONE = [f"probe_{azimuth:03d}p45" for azimuth in range(0, 360, 45)]


def _touch(name: str, pretravel: float, hysteresis: float = 1e-4) -> RigTouch:
    return RigTouch(name, 0.1, 0.1 + pretravel, 0.11, 0.1 + hysteresis, 1e-5, 1e-5, 1e-5,
                    pretravel, 0.0, 3.0, ())  # fmt: skip


def _pretravel(azimuth_deg: float, polar_deg: float) -> float:
    """Three lobes across the axis, little along it. [mm]"""
    across = math.sin(math.radians(polar_deg))
    return 1e-3 * (1.0 + across**2 * (4.0 - math.cos(3.0 * math.radians(azimuth_deg))))


def _all_around() -> list[RigTouch]:
    rng = np.random.default_rng(5)
    touches = []
    for name in (*RING, *CONE, "probe_+Z"):
        for repeat in (1, 2, 3):
            trace = f"{name}_{repeat}"
            angles = [math.degrees(angle) for angle in angles_of(trace)]
            touches.append(_touch(trace, _pretravel(*angles) + rng.normal(0.0, 3e-5)))
    return touches


@pytest.mark.parametrize(
    ("trace", "azimuth", "polar"),
    [
        ("rig_030_2", 30.0, 90.0),
        ("rig_-15.5_2", -15.5, 90.0),
        ("rig_030p45_12", 30.0, 45.0),
        ("rig_120.5p22.5_1", 120.5, 22.5),
        ("rig_Z_1", 0.0, 0.0),
        ("rig_+Z_1", 0.0, 0.0),
        ("rig_-Z_1", 0.0, 180.0),
        ("rig_x_3", 0.0, 90.0),
        ("rig_-X_3", 180.0, 90.0),
        ("rig_+Y_3", 90.0, 90.0),
        ("rig_-y_3", 270.0, 90.0),
    ],
)
def test_names_carry_two_angles(trace: str, azimuth: float, polar: float) -> None:
    assert np.degrees(angles_of(trace)) == pytest.approx([azimuth, polar])


def test_names_without_angles() -> None:
    for trace in ("rig_top_1", "rigZ_1", "trace", "rig_030p_1", "rig_Z"):
        assert np.isnan(angles_of(trace)).all()


class TestEveryField:
    """Of touches whose results follow by hand."""

    @staticmethod
    def _calibration(made: dict[str, list[float]]) -> RigCalibration:
        touches = [
            replace(_touch(f"{name}_{k + 1}", 1e-3 * value), feed=3.0 + k)
            for name, values in made.items()
            for k, value in enumerate(values)
        ]
        return calibrate_rig(touches, search_outliers=False)

    def test_of_a_map(self) -> None:
        """A quarter more µm² of the touches in each direction, with k = 2.8693 of four degrees of
        freedom (Student's t for 95.45 %) over 2, and what is common to all."""
        components = (LengthComponent("a", "B", 5e-5), LengthComponent("b", "B", 0.0, 1e-2))
        made = {"p_090": [4.0, 4.0, 4.3, 4.5], "p_000": [3.0, 3.2], "p_200": [5.0]}
        found = rig_map(self._calibration(made), components, 1.5)
        # In order of the azimuth; the mean of the directions is 4.1 µm.
        assert found.coefficients == pytest.approx(1e-3 * np.array([3.1, 4.2, 5.0]), rel=1e-9)
        common = 5e-5**2 + (1e-5 * (3.1 + 4.2 + 5.0) / 3.0) ** 2
        s = 1e-3 * math.sqrt((0.18 + 0.02) / 4.0)
        factor = stats.t.ppf(0.5 + 0.5 * math.erf(math.sqrt(2.0)), 4.0) / 2.0
        own = (factor * s) ** 2 / np.array([2.0, 4.0, 1.0])
        assert found.covariance.matrix == pytest.approx(np.diag(own) + common, rel=1e-9)
        azimuth = np.radians([0.0, 90.0, 200.0])
        directions = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(3)])
        assert found.support.nodes == pytest.approx(directions, abs=1e-12)
        assert found.tip_radius == 1.5
        assert (found.repeatability, found.repeatability_dof) == (pytest.approx(s), 4.0)
        assert found.feed == pytest.approx((3 + 4 + 5 + 6 + 3 + 4 + 3) / 7.0)
        assert found.provenance.touches == "7 in 3 directions"

    def test_of_single_touches_of_a_false_start(self) -> None:
        """A negative pretravel; nothing shows the repeatability but that of the budget, Ren's 0.055
        and 0.060 µm: the map had none."""
        single = self._calibration({"p_000": [-1.0], "p_090": [-1.2]})
        found = rig_map(single, (LengthComponent("a", "B", 5e-5),), 1.5)
        assert found.coefficients == pytest.approx([-1e-3, -1.2e-3])
        assert found.covariance.matrix == pytest.approx(np.full((2, 2), 25e-10), rel=1e-9)
        assert (found.repeatability, found.repeatability_dof) == (0.0, math.inf)
        of_ren = rig_map(single, REN_BUDGET, 1.5)
        assert of_ren.repeatability == pytest.approx(1e-3 * math.hypot(0.055, 0.060))
        own = of_ren.covariance.matrix[0, 0] - of_ren.covariance.matrix[0, 1]
        assert own == pytest.approx(of_ren.repeatability**2)

    def test_needs_every_azimuth(self) -> None:
        with pytest.raises(PretravelError, match="must end in _AZIMUTH_REPEAT"):
            rig_map(self._calibration({"p_000": [3.0], "left": [4.0]}), REN_BUDGET, 1.5)


def test_a_map_of_all_directions() -> None:
    """At its directions it has their means; between two neighbours of the ring it lies between
    them; the axis is supported, with the uncertainty of its own touches. What a straight line
    between two neighbours misses of the lobes, a quarter of a micrometre rms, is in u."""
    touches = _all_around()
    calibration = calibrate_rig(touches)
    assert [d.name for d in calibration.directions][:12] == RING
    assert sum(not d.across for d in calibration.directions) == 9
    found = rig_map(calibration, REN_BUDGET, 3.0)
    for name in ("probe_030", "probe_045p45", "probe_+Z"):
        own = [t.pretravel for t in touches if t.trace.startswith(f"{name}_")]
        polar, azimuth = np.degrees(angles_of(f"{name}_1"))[::-1]
        value, u = found.pretravel_and_uncertainty(direction(polar, azimuth)[None])
        assert value[0] == pytest.approx(np.mean(own), abs=1e-12)
        assert 3e-5 / math.sqrt(3.0) < u[0] < 2e-4
    between = float(found.pretravel(direction(90.0, 15.0)[None])[0])
    means = {d.name: d.pretravel for d in calibration.directions}
    assert between == pytest.approx(0.5 * (means["probe_000"] + means["probe_030"]), rel=0.02)
    assert not found.supports(-direction(0.0, 0.0)[None])[0]
    around = np.arange(0.0, 360.0, 2.0)
    value, u = found.pretravel_and_uncertainty(np.array([direction(90.0, a) for a in around]))
    squares = (value - [_pretravel(a, 90.0) for a in around]) ** 2
    assert 0.1 < np.mean(squares / (u**2 + found.fixed_scatter**2)) < 1.4 < np.mean(squares / u**2)


def test_lobes_are_searched_across_the_axis_alone() -> None:
    """A touch along the axis, three times smaller, is no outlier of the lobes; and single touches
    have the repeatability of the ring, not of the step to the cone."""
    rng = np.random.default_rng(7)
    touches = [
        _touch(f"{name}_1", _pretravel(*np.degrees(angles_of(f"{name}_1"))) + rng.normal(0.0, 3e-5))
        for name in (*RING, *CONE, "probe_Z")
    ]
    calibration = calibrate_rig(touches)
    assert calibration.outliers == ()
    assert calibration.repeatability.of_lobes
    assert calibration.repeatability.value < 1e-4
    alone = calibrate_rig(touches[:12])
    assert calibration.repeatability.value == alone.repeatability.value


def _folder(tmp_path: Path) -> Path:
    """The example's traces, one under the name of an axis and one under a word."""
    folder = tmp_path / "rig"
    folder.mkdir()
    for path in TRACES:
        (folder / path.name).write_bytes(path.read_bytes())
    (folder / "rig_Z_1.csv").write_bytes(TRACES[0].read_bytes())
    (folder / "rig_budget.csv").write_bytes((EXAMPLES / "rig_budget.csv").read_bytes())
    return folder


def test_a_folder_drops_no_trace(tmp_path: Path) -> None:
    """Names along an axis were left out without a word; so were names without an angle."""
    folder = _folder(tmp_path)
    (folder / "rig_top_1.csv").write_bytes(TRACES[0].read_bytes())
    named = [path.name for path in rig_traces([folder])]
    assert len(named) == len(TRACES) + 2
    assert {"rig_Z_1.csv", "rig_top_1.csv"} < set(named)
    assert "rig_budget.csv" not in named


def test_rig_with_an_axis_writes_a_map(tmp_path: Path) -> None:
    out, map_file = tmp_path / "rig.csv", tmp_path / "map.json"
    told = both_outputs("rig", _folder(tmp_path), "-o", out, "--map", map_file, "--tip-diameter", 6)
    assert "directions of the map across the probe's axis: 3." in " ".join(told[1].split())
    assert "takes the stated diameter of the tip as exact" in " ".join(told[0].split())
    table = {row["trace"]: row for row in rows(out)}
    assert (table["rig_Z_1"]["azimuth_deg"], table["rig_Z_1"]["polar_deg"]) == ("0", "0")
    assert table[TRACES[0].stem]["polar_deg"] == "90"
    found = read_map(map_file)
    along = 1e3 * found.pretravel(np.array([[0.0, 0.0, 1.0]]))[0]
    assert along == pytest.approx(float(table["rig_Z_1"]["pretravel_um"]), abs=1e-6)
    page = tmp_path / "rig.json"
    run("rig", tmp_path / "rig", "-o", page)
    polar = [d["polar_deg"] for d in data_of(page)["Directions"]]
    assert polar == pytest.approx([90.0, 90.0, 90.0, 0.0])


@pytest.mark.published("Ren 2020", "Figure 8")
def test_force_of_each_touch_from_a_description(tmp_path: Path) -> None:
    """Equation 12 of the description in numpy: a rod's travel is L_c + L_p + L_k; the force that
    the column states gives the pretravel back. Along the axis it has no such equation."""
    out = tmp_path / "rig.csv"
    run("rig", _folder(tmp_path), "-o", out, "--probe", "omp40-2")
    probe = load_probe("omp40-2")

    def modulus(first: object, second: object) -> float:
        parts = [(1.0 - m.poissons_ratio**2) / m.youngs_modulus for m in (first, second)]  # type: ignore[attr-defined]
        return 1.0 / sum(parts)

    from pretravel.prediction.materials import material
    from pretravel.prediction.seats import seat_coefficient

    stem = probe.stem
    bending = (
        probe.stylus_length**3
        * 64.0
        / (3.0 * stem.material.youngs_modulus * math.pi * stem.diameter**4)
    )
    rigid = probe.lever / (1.5 * probe.tripod.radius) * seat_coefficient(probe)
    tip = modulus(probe.tip.material, material("steel"))
    compression = (9.0 / 16.0 / tip**2 / probe.tip.radius) ** (1.0 / 3.0)
    for row in rows(out):
        if row["trace"] == "rig_Z_1":
            assert row["force_N"] == ""
            continue
        force = float(row["force_N"])
        back = bending * force + (rigid + compression) * force ** (2.0 / 3.0)
        assert 1e3 * back == pytest.approx(float(row["pretravel_um"]), rel=1e-6)
    page = tmp_path / "rig.json"
    run("rig", *TRACES, "-o", page, "--probe", "omp40-2")
    data = data_of(page)
    first = [t["force_N"] for t in data["Touches"] if t["azimuth_deg"] == 0.0]
    assert data["Directions"][0]["force_N"] == pytest.approx(np.mean(first), rel=1e-9)
