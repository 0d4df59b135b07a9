"""Directions of a rig beside those across the probe's axis, and forces from its pretravel."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.files.map_file import read_map
from pretravel.files.rig_csv import rig_traces
from pretravel.laboratory.rig import RigTouch
from pretravel.laboratory.rig_budget import REN_BUDGET
from pretravel.laboratory.rig_calibration import angles_of, calibrate_rig
from pretravel.laboratory.rig_map import rig_map
from pretravel.prediction.catalogue import load_probe
from pretravel.show.result_file import read_result
from pretravel.tasks.reports.rig_report import performance_figures
from tests.support.commands import rows, run
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


def test_a_map_of_all_directions() -> None:
    """At its directions it has their means; between two neighbours of the ring it lies between
    them; the axis is supported, with the uncertainty of its own touches."""
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


def test_lobes_are_searched_across_the_axis_alone() -> None:
    """A touch along the axis, three times smaller, is no outlier of the lobes; and single touches
    have the repeatability of the ring, not of the step to the cone."""
    rng = np.random.default_rng(7)
    touches = [
        _touch(f"{name}_1", _pretravel(*np.degrees(angles_of(f"{name}_1"))) + rng.normal(0.0, 3e-5))
        for name in (*RING, *RING[:0], *CONE, "probe_Z")
    ]
    calibration = calibrate_rig(touches)
    assert calibration.outliers == ()
    assert calibration.repeatability.of_lobes
    assert calibration.repeatability.value < 1e-4
    alone = calibrate_rig(touches[:12])
    assert calibration.repeatability.value == alone.repeatability.value


def test_a_repeatability_is_not_below_the_sampling() -> None:
    """Each edge lies between samples: a pretravel has u = √2 · 10 nm here. Three touches of 1 nm
    scatter fell between the same samples: a certificate stated s = 0.001 µm. The lower end of the
    interval stays that of the touches, since a probe may repeat better than the rig can show."""
    sampling = math.sqrt(2.0) * 1e-5
    touches = [_touch(f"a_000_{k}", 4e-3 + k * 1e-6) for k in (1, 2, 3)]
    found = calibrate_rig(touches, search_outliers=False)
    for spread in (found.repeatability, found.directions[0].repeatability):
        assert spread.measured == pytest.approx(1e-6, rel=1e-6)
        assert (spread.value, spread.high) == pytest.approx((sampling, sampling))
        assert spread.low == pytest.approx(1e-6 / math.sqrt(7.378 / 2.0), rel=1e-3)  # chi-square
        assert spread.of_sampling
    assert found.directions[0].u_pretravel == pytest.approx(sampling / math.sqrt(3.0))
    assert found.directions[0].expanded_pretravel == pytest.approx(2.0 * sampling / math.sqrt(3.0))
    touches = [_touch(f"a_000_{k}", 4e-3 + k * 5e-5) for k in (1, 2, 3)]
    assert not calibrate_rig(touches, search_outliers=False).repeatability.of_sampling


def test_an_anisotropy_of_equal_repeats_contains_the_sampling() -> None:
    """Tukey's quantile of two means with a known s is 1.96 √2."""
    touches = [_touch(f"a_{a:03d}_{k}", 4e-3 + a * 1e-6) for a in (0, 90) for k in (1, 2)]
    found = calibrate_rig(touches, search_outliers=False)
    half = 1.96 * math.sqrt(2.0) * math.sqrt(2.0) * 1e-5 / math.sqrt(2.0)
    assert found.anisotropy_interval == pytest.approx([9e-5 - half, 9e-5 + half], rel=1e-3)


def test_one_direction_shows_no_anisotropy() -> None:
    """The report said "1 traces, 1 directions" and "anisotropy 0.000 µm"."""
    one = calibrate_rig([_touch("a_000_1", 4e-3)])
    assert math.isnan(one.anisotropy)
    assert math.isnan(one.hysteresis_anisotropy)
    assert "anisotropy unknown; repeatability unknown" in repr(one)
    figures = {figure.name: figure.value for figure in performance_figures(one)}
    for name in ("anisotropy", "anisotropy of hysteresis", "anisotropy of repeatability"):
        assert str(figures[name]).startswith("unknown")


def test_one_direction_has_one_name() -> None:
    with pytest.raises(PretravelError, match="a_090 and a_Y are the same direction"):
        calibrate_rig([_touch("a_090_1", 4e-3), _touch("a_Y_1", 4e-3)])
    with pytest.raises(PretravelError, match="a_0p0 and a_Z are the same direction"):
        calibrate_rig([_touch("a_0p0_1", 4e-3), _touch("a_Z_1", 4e-3)])
    with pytest.raises(PretravelError, match="polar angle is 190°"):
        calibrate_rig([_touch("a_000p190_1", 4e-3)])


def test_anisotropies_of_hysteresis_and_repeatability() -> None:
    """Ren 2020, section 2.2, names them beside that of pretravel: largest less smallest."""
    touches = [
        _touch(f"a_{azimuth}_{repeat}", 4e-3 + scatter * step, 1e-4 * rank)
        for rank, (azimuth, scatter) in enumerate(((0, 2e-5), (90, 5e-5), (180, 3e-5)))
        for repeat, step in ((1, -1.0), (2, 0.0), (3, 1.0))
    ]
    found = calibrate_rig(touches, search_outliers=False)
    assert found.hysteresis_anisotropy == pytest.approx(2e-4)
    assert found.repeatability_anisotropy == pytest.approx(3e-5)
    once = calibrate_rig(touches[::3], search_outliers=False)
    assert math.isnan(once.repeatability_anisotropy)


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
    run("rig", _folder(tmp_path), "-o", out, "--map", map_file, "--tip-diameter", "6")
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


def test_lines_of_the_budget_that_are_stated_here(tmp_path: Path) -> None:
    """Abbé: 10 mm times 20 µrad is 0.2 µm. Equation 17: at 22 °C, 8e-6/K, u 0.5 K and 1e-6/K 4 and
    2 µm/m, which take the place of the paper's 0.058 and 0.010; over 4 µm they are picometres."""

    def sources(*options: str) -> dict[str, float]:
        run("rig", *TRACES, "-o", tmp_path / "rig.json", *options)
        (budget,) = read_result(tmp_path / "rig.json").document.budgets
        return {c.name: 1e3 * c.standard_uncertainty for c in budget.components}

    plain = sources()
    assert any(name.startswith("temperature measurement") for name in plain)
    found = sources("--abbe", "10,20", "--temperature", "22", "--u-temperature", "0.5",
                    "--u-expansion", "1")  # fmt: skip
    assert found["Abbé error (10 mm, 20 µrad)"] == pytest.approx(0.2, rel=1e-6)
    assert not any(name.startswith(("temperature measurement", "thermal expansion coeff"))
                   for name in found)  # fmt: skip
    warm = found["temperature of the scale (u 0.5 K)"]
    grown = found["thermal expansion of the scale (u 1e-6/K)"]
    assert warm == pytest.approx(2.0 * grown, rel=1e-6)
    told = run("rig", *TRACES, "-o", tmp_path / "rig.json", "--u-temperature", "0.5", code=2)
    assert "--u-expansion" in told
