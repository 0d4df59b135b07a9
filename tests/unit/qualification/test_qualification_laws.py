"""A qualification as a whole: tilted probes, what a map keeps of it, budgets by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.base.frames import probe_rotation
from pretravel.maps.kinds.harmonic import HarmonicBasis, HarmonicKind
from pretravel.maps.kinds.mean import MeanKind
from pretravel.maps.pretravel_map import over_support
from pretravel.maps.provenance import Origin, QualificationSetup
from pretravel.qualification.own_touches import touch_digests
from pretravel.qualification.qualification import Qualification, part_point_budget, radius_budget
from pretravel.qualification.qualify import qualified as qualify
from pretravel.touches import Touches

UM = 1e-3
N = sphere_pattern_25()
AXIS = (0.48, 0.6, 0.64)
TILT = probe_rotation(AXIS)
CENTER = np.array([120.0, -40.0, 7.0])
SETUP = QualificationSetup(25.0, tip_diameter=6.0, u_diameter=0.5 * UM)


def _touches(tilt: np.ndarray, fed: bool = False, wrong: float = 0.0) -> Touches:
    """A three-lobed probe, three times in each direction; at two feeds with a delay of 5 ms."""
    rng = np.random.default_rng(7)
    n = np.tile(N, (4 if fed else 3, 1))
    basis = HarmonicBasis(np.array([[0, 0], [2, 0], [3, 3]]))
    value = basis.design(n) @ (np.array([10.0, -3.0, 2.0]) * UM)
    value += 0.3 * UM * rng.standard_normal(len(n))
    value[31] -= wrong
    feeds = np.repeat([60.0, 180.0] * 2, 25) if fed else np.linspace(49.9, 50.3, 75)
    value += 5e-3 * feeds / 60.0 if fed else 0.0
    positions = (n * (15.5 - value)[:, None]) @ tilt.T + CENTER
    return Touches(positions, n @ tilt.T, feeds=feeds, source="sphere.csv")


@pytest.mark.parametrize("fed", [False, True])
def test_a_tilted_probe_is_an_upright_one_in_another_frame(fed: bool) -> None:
    kind = HarmonicKind()
    upright = qualify(_touches(np.eye(3), fed), SETUP, kind)
    tilted = qualify(_touches(TILT, fed), replace(SETUP, axis=AXIS), kind)
    off = TILT @ (upright.center - CENTER)
    assert tilted.center - CENTER == pytest.approx(off, abs=1e-6)
    assert np.abs(upright.center - CENTER).max() > 0.1 * UM
    expected = TILT @ upright.center_covariance @ TILT.T
    assert tilted.center_covariance == pytest.approx(expected, rel=1e-3, abs=1e-12)
    assert tilted.contact_normals == pytest.approx(upright.contact_normals @ TILT.T, abs=1e-6)
    for name in ("residuals", "observed", "effective_radius", "u_effective_radius",
                 "repeatability", "repeatability_dof"):  # fmt: skip
        assert getattr(tilted, name) == pytest.approx(getattr(upright, name), rel=1e-4, abs=1e-6)
    assert tilted.pretravel_map.rotation == pytest.approx(TILT)
    assert tilted.pretravel_map.coefficients == pytest.approx(
        upright.pretravel_map.coefficients, abs=1e-6
    )
    assert tilted.degrees_of_freedom == pytest.approx(upright.degrees_of_freedom, rel=1e-4)
    if fed:
        assert tilted.pretravel_map.delay_effect == pytest.approx(
            upright.pretravel_map.delay_effect, abs=1e-6
        )


def _compare_observed(found: Qualification, given: Touches) -> None:
    """By distances from the centre that was found."""
    away = given.positions - found.center
    distance = np.linalg.norm(away, axis=1)
    assert found.contact_normals == pytest.approx(away / distance[:, None], abs=1e-9)
    made = found.pretravel_map
    assert found.observed == pytest.approx(12.5 + made.tip_radius - distance, abs=1e-9)
    residuals = found.observed - made.pretravel(found.contact_normals, extrapolate=True)
    assert found.residuals == pytest.approx(residuals, abs=1e-9)


def test_a_qualification_states_what_it_saw() -> None:
    given = _touches(TILT, wrong=0.03)
    setup = replace(SETUP, axis=AXIS)
    found = qualify(given, setup, HarmonicKind())
    _compare_observed(found, given)
    assert (~found.used).nonzero()[0].tolist() == [31]
    assert [one.rows for one in found.outliers] == [(31,)]
    assert found.delay is None
    assert found.setup is setup
    groups = np.tile(np.arange(25), 3)
    assert (found.groups[:, None] == found.groups).tolist() == (groups[:, None] == groups).tolist()
    rest = found.used
    pooled = sum(
        float(np.sum((x - x.mean()) ** 2))
        for x in (found.observed[rest & (groups == g)] for g in range(25))
    )
    assert found.repeatability == pytest.approx(math.sqrt(pooled / 49.0), rel=1e-3)
    assert found.repeatability_dof == 49.0
    # 0.5 µm, and 11.5e-6 / K of 25 mm in 0.2 K; the half of them is in a radius.
    u_reference = 0.5 * math.hypot(0.5 * UM, 11.5e-6 * 25.0 * 0.2)
    assert found.u_effective_radius == pytest.approx(math.hypot(found.fit.u_mean, u_reference))
    assert found.effective_radius == pytest.approx(3.0 - found.fit.mean, abs=1e-12)
    made = found.pretravel_map
    assert made.u_tip_radius == pytest.approx(u_reference)
    assert (made.tip_radius, made.delay, made.u_delay, made.delay_effect) == (3.0, None, 0.0, None)
    assert made.feed == pytest.approx(50.1)
    assert made.repeatability == found.repeatability
    scatter = math.hypot(
        max(found.fit.fixed_scatter, found.effects.step_scatter), found.effects.fixed_scatter
    )
    assert made.fixed_scatter == pytest.approx(scatter)
    assert made.fixed_scatter >= 0.13 * UM / math.sqrt(12.0)
    assert repr(found) == (
        f"Qualification(harmonic; 75 touches, 1 left out; effective radius "
        f"{found.effective_radius:.4f} mm; repeatability {1e3 * found.repeatability:.2f} µm; "
        f"{len(found.warnings)} warnings)"
    )
    told = made.provenance
    assert told.origin is Origin.QUALIFIED
    assert told.source == "qualified on a sphere of 25 mm"
    assert told.touches == "74 touches in 25 directions, from sphere.csv"
    assert told.touches_file == "sphere.csv"
    assert told.touch_digests == touch_digests(given.positions[rest])
    assert told.gauge.startswith("pretravel is relative to ")
    assert told.level_known
    assert told.setup is setup


def _sphere(positions: np.ndarray) -> tuple[np.ndarray, float]:
    """Geometric least squares by Gauss and Newton."""
    center, radius = CENTER.copy(), 15.49
    for _ in range(20):
        away = positions - center
        distance = np.linalg.norm(away, axis=1)
        columns = np.column_stack([away / distance[:, None], np.ones(len(away))])
        step, *_ = np.linalg.lstsq(columns, distance - radius)
        center, radius = center + step[:3], radius + float(step[3])
    return center, radius


def test_the_effect_of_a_touch_that_was_left_out() -> None:
    """Spheres by least squares through all touches and through those that were used: in a
    direction the surface moves by the change of the radius and that of the centre along it."""
    given = _touches(np.eye(3), wrong=0.08)
    found = qualify(given, replace(SETUP, axial_pretravel=None), MeanKind())
    assert (~found.used).sum() == 1
    (first, small), (second, large) = _sphere(given.positions[found.used]), _sphere(given.positions)
    moved = np.abs((large - small) + N @ (second - first)).max()
    assert moved > 0.5 * UM
    assert found.effect_of_outliers == pytest.approx(moved, rel=0.01)
    assert found.effective_radius == pytest.approx(small - 12.5, abs=1e-6)
    assert qualify(_touches(np.eye(3)), SETUP, MeanKind()).effect_of_outliers == 0.0


def test_without_a_tip_diameter_the_map_is_relative_to_its_mean() -> None:
    """The tip is the effective one, observed pretravel and map are less by the mean."""
    given = _touches(np.eye(3))
    known = qualify(given, replace(SETUP, axial_pretravel=None), MeanKind())
    found = qualify(given, replace(SETUP, axial_pretravel=None, tip_diameter=None), MeanKind())
    made = found.pretravel_map
    assert found.effective_radius == pytest.approx(known.effective_radius, abs=1e-7)
    assert made.tip_radius == pytest.approx(known.effective_radius, abs=1e-7)
    assert made.pretravel(N) == pytest.approx(np.zeros(25), abs=1e-7)
    assert known.pretravel_map.pretravel(N) == pytest.approx(
        np.full(25, 3.0 - known.effective_radius), abs=1e-7
    )
    assert found.residuals == pytest.approx(known.residuals, abs=1e-7)
    _compare_observed(found, given)
    assert not made.provenance.level_known
    assert made.provenance.gauge.endswith("and to its mean, since no tip diameter was given")
    assert known.pretravel_map.provenance.level_known


def test_budgets_of_a_qualification_at_two_feeds() -> None:
    """Every source with its type, its u and its degrees of freedom."""
    found = qualify(_touches(np.eye(3), fed=True), SETUP, HarmonicKind())
    made = found.pretravel_map
    assert found.delay is not None
    assert (made.feed, made.delay, made.u_delay) == (0.0, found.delay.delay, found.delay.u_delay)
    assert found.delay.delay == pytest.approx(5e-3, abs=4.0 * found.delay.u_delay)
    reference = [
        ("diameter of the reference", "B", 0.5 * UM, 0.5, math.inf),
        ("temperature of the reference", "B", 11.5e-6 * 25.0 * 0.2, 0.5, math.inf),
    ]
    radius = radius_budget(found)
    # All errors by the delay at the mean feed of 120 mm/min are alike: 2 mm/s.
    delay = 2.0 * found.delay.u_delay
    dof = found.repeatability_dof
    _compare(radius, [
        ("touches", "A", found.fit.u_mean, 1.0, dof), *reference,
        ("signal delay", "B", delay, 1.0, math.inf),
    ])  # fmt: skip
    assert radius.result == "effective radius"
    assert radius.combined == pytest.approx(found.u_effective_radius)
    u_map = math.sqrt(float(np.mean(over_support(made)[2] ** 2)))
    point = part_point_budget(found)
    _compare(point, [
        ("repeatability", "A", found.repeatability, 1.0, dof),
        ("fixed scatter", "B", made.fixed_scatter, 1.0, math.inf),
        ("map", "B", u_map, 1.0, math.inf), *reference,
    ])  # fmt: skip
    assert point.result == "a point on a part, rms over the map"


def _compare(budget, expected) -> None:  # type: ignore[no-untyped-def]
    assert len(budget.components) == len(expected)
    for one, (name, evaluation, u, sensitivity, dof) in zip(
        budget.components, expected, strict=True
    ):
        assert (one.name, one.evaluation, one.dof) == (name, evaluation, dof)
        assert one.sensitivity == sensitivity
        assert one.standard_uncertainty == pytest.approx(u, rel=0.01)


def test_budgets_name_what_was_assumed_and_leave_out_what_is_zero() -> None:
    found = qualify(
        replace(_touches(np.eye(3)), feeds=None), replace(SETUP, u_diameter=None), MeanKind()
    )
    names = [one.name for one in radius_budget(found).components]
    assert names == [
        "touches", "diameter of the reference (assumed)", "temperature of the reference"
    ]  # fmt: skip
    assert radius_budget(found).components[1].standard_uncertainty == pytest.approx(0.2 * UM)
    certain = replace(SETUP, u_diameter=0.0, u_temperature=0.0)
    exact = replace(found, setup=certain, repeatability_dof=0.0)
    (touches,) = radius_budget(exact).components
    assert (touches.name, touches.dof) == ("touches", math.inf)
