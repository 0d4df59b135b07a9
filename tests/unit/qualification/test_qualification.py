"""Maps, uncertainties and warnings of a qualification as a whole; budgets by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles, sphere_pattern_25
from pretravel.base.frames import probe_rotation
from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.maps.kind import usual_shift_covariance
from pretravel.maps.kinds.harmonic import HarmonicBasis, HarmonicKind, HarmonicMapFit
from pretravel.maps.kinds.mean import MeanKind
from pretravel.maps.provenance import U_AXIAL_PRETRAVEL, Origin, QualificationSetup
from pretravel.measurement.compensation import apply
from pretravel.qualification.own_touches import touch_digests
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import _mapped, prepare, qualified
from pretravel.qualification.qualifying import qualify as qualify_with_all_kinds
from pretravel.tasks.qualify import Qualify
from pretravel.touches import Touches
from tests.support.examples import EXAMPLES
from tests.support.plain_qualification import qualify_plainly as qualify
from tests.support.reference_touches import sphere_touches

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
    upright = qualified(_touches(np.eye(3), fed), SETUP, kind)
    tilted = qualified(_touches(TILT, fed), replace(SETUP, axis=AXIS), kind)
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
    found = qualified(given, setup, HarmonicKind())
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


def test_what_all_touches_have_in_common_moves_the_centre() -> None:
    """Any way: 2 µm beside what the touches say of it."""
    ready = prepare(_touches(TILT), replace(SETUP, axis=AXIS))
    alone, shared = (
        _mapped(replace(ready, effects=replace(ready.effects, in_common=size)), MeanKind())
        for size in (0.0, 2.0 * UM)
    )
    added = shared.center_covariance - alone.center_covariance
    assert added == pytest.approx((2.0 * UM) ** 2 * np.eye(3), abs=1e-15)


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
    found = qualified(given, replace(SETUP, axial_pretravel=None), MeanKind())
    assert (~found.used).sum() == 1
    (first, small), (second, large) = _sphere(given.positions[found.used]), _sphere(given.positions)
    moved = np.abs((large - small) + N @ (second - first)).max()
    assert moved > 0.5 * UM
    assert found.effect_of_outliers == pytest.approx(moved, rel=0.01)
    assert found.effective_radius == pytest.approx(small - 12.5, abs=1e-6)
    assert qualified(_touches(np.eye(3)), SETUP, MeanKind()).effect_of_outliers == 0.0


def test_without_a_tip_diameter_the_map_is_relative_to_its_mean() -> None:
    """The tip is the effective one, observed pretravel and map are less by the mean."""
    given = _touches(np.eye(3))
    known = qualified(given, replace(SETUP, axial_pretravel=None), MeanKind())
    found = qualified(given, replace(SETUP, axial_pretravel=None, tip_diameter=None), MeanKind())
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
    found = qualified(_touches(np.eye(3), fed=True), SETUP, HarmonicKind())
    made = found.pretravel_map
    assert found.delay is not None
    assert (made.feed, made.delay, made.u_delay) == (0.0, found.delay.delay, found.delay.u_delay)
    assert found.delay.delay == pytest.approx(5e-3, abs=4.0 * found.delay.u_delay)
    reference = [
        ("diameter of the reference", "B", 0.5 * UM, 0.5, math.inf),
        ("temperature of the reference", "B", 11.5e-6 * 25.0 * 0.2, 0.5, math.inf),
    ]
    radius = found.radius_budget()
    # All errors by the delay at the mean feed of 120 mm/min are alike: 2 mm/s.
    delay = 2.0 * found.delay.u_delay
    dof = found.repeatability_dof
    _compare(radius, [
        ("touches", "A", found.fit.u_mean, 1.0, dof), *reference,
        ("signal delay", "B", delay, 1.0, math.inf),
    ])  # fmt: skip
    assert radius.result == "effective radius"
    assert radius.combined == pytest.approx(found.u_effective_radius)
    u_map = math.sqrt(float(np.mean(made.over_support()[2] ** 2)))
    point = found.part_point_budget()
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
    found = qualified(
        replace(_touches(np.eye(3)), feeds=None), replace(SETUP, u_diameter=None), MeanKind()
    )
    names = [one.name for one in found.radius_budget().components]
    assert names == [
        "touches", "diameter of the reference (assumed)", "temperature of the reference"
    ]  # fmt: skip
    assert found.radius_budget().components[1].standard_uncertainty == pytest.approx(0.2 * UM)
    certain = replace(SETUP, u_diameter=0.0, u_temperature=0.0)
    exact = replace(found, setup=certain, repeatability_dof=0.0)
    (touches,) = exact.radius_budget().components
    assert (touches.name, touches.dof) == ("touches", math.inf)


class TestQualification:
    def _pretravel(self, n: np.ndarray) -> np.ndarray:
        azimuth = np.arctan2(n[:, 1], n[:, 0])
        sine = np.hypot(n[:, 0], n[:, 1])
        return 0.002 + 0.010 * sine**2 + 0.003 * sine**3 * np.cos(3.0 * azimuth - 0.7)

    def _touches(self, seed: int = 0, noise: float = 3e-4, repeats: int = 3) -> Touches:
        n = np.repeat(sphere_pattern_25(), repeats, axis=0)
        rng = np.random.default_rng(seed)
        return sphere_touches(self._pretravel(n) + rng.normal(0.0, noise, len(n)), n)

    @pytest.mark.long
    def test_two_wrong_directions_are_named_once_each(self) -> None:
        """With the others' prediction, which contains neither: both errors come out as made."""
        n = np.concatenate([sphere_pattern_25(), fibonacci_cap(35, np.radians(85.0))])
        pretravel = self._pretravel(n) + np.random.default_rng(4).normal(0.0, 3e-4, 60)
        pretravel[[10, 40]] += [0.03, -0.04]
        found = qualify(sphere_touches(pretravel, n), 25.0, tip_diameter=6.0).outliers
        assert sorted(outlier.rows for outlier in found) == [(10,), (40,)]
        for outlier in found:
            made = {10: 0.03, 40: -0.04}[outlier.rows[0]]
            assert outlier.distance == pytest.approx(made, abs=outlier.limit)

    def test_without_repeats_noise_is_not_lobing(self) -> None:
        """Kind mean, each direction once: lobes of 3 µm around it, but the probe repeats to
        0.3 µm; the degrees of freedom are those of the harmonic fit."""
        n = fibonacci_cap(150, np.radians(90.0))
        rng = np.random.default_rng(1)
        pretravel = self._pretravel(n) + rng.normal(0.0, 3e-4, 150)
        result = qualify(sphere_touches(pretravel, n), 25.0, tip_diameter=6.0, kind="mean")
        assert np.std(result.residuals) > 1.5e-3
        assert result.repeatability == pytest.approx(3e-4, rel=0.25)
        assert result.repeatability_dof < 150

    @pytest.mark.slow
    @pytest.mark.parametrize("told", [1e-3, None])
    def test_harmonic_centre_radius_and_map_in_either_gauge(self, told: float | None) -> None:
        """Many noises on one probe. Scatter of a standard deviation from 60 draws is 9 % (one
        sigma); a prior makes the map scatter less than stated, never more: factors of 0.5 to 1.3.
        In the gauge of the pole the value there is given, so it has no uncertainty."""
        centers, radii, values, stated = [], [], [], []
        check = fibonacci_cap(40, np.radians(85.0))
        for seed in range(60):
            result = qualify(
                self._touches(seed), 25.0, tip_diameter=6.0, axial_pretravel=told,
                search_outliers=False,
            )  # fmt: skip
            centers.append(result.center)
            radii.append(result.effective_radius)
            values.append(result.pretravel_map.pretravel(check))
            assert isinstance(result.fit, HarmonicMapFit)
            # The conventions are uncertain too, which no noise shows.
            convention = result.fit.posterior.amplitudes.first_harmonic_variance * np.ones(3)
            usual = usual_shift_covariance(result.fit.observation)[2, 2]
            at_pole = U_AXIAL_PRETRAVEL**2 + result.fit.observation.u_constant**2
            convention[2] = usual if told is None else at_pole
            stated.append(
                [
                    *np.sqrt(np.diag(result.center_covariance) - convention),
                    result.u_effective_radius,
                    *result.pretravel_map.standard_uncertainty(check),
                ]
            )
        scatter = np.concatenate([np.std(centers, axis=0), [np.std(radii)], np.std(values, axis=0)])
        u = np.mean(stated, axis=0)
        ratio = scatter[:4] / u[:4]
        assert np.all((ratio > 0.5) & (ratio < 1.3)), ratio
        assert np.all(scatter[4:] < 1.3 * u[4:])

    def test_in_its_gauge_the_map_has_no_first_harmonic(self) -> None:
        """Across the axis its coefficients are zero, along it a least-squares sphere has no shift
        over the touched directions. They are uncertain, by errors of the centre that was found."""
        touches = self._touches()
        result = qualify(touches, 25.0, tip_diameter=6.0, axial_pretravel=None)
        made = result.pretravel_map
        assert isinstance(made.basis, HarmonicBasis)
        across = (made.basis.terms[:, 0] == 1) & (made.basis.terms[:, 1] != 0)
        assert np.abs(made.coefficients[across]).max() < 1e-15
        assert made.covariance.matrix[across, across].min() > (0.02e-3) ** 2
        n = result.contact_normals
        shift = np.linalg.pinv(np.hstack([np.ones((75, 1)), n]))[3]
        assert abs(shift @ made.pretravel(n)) < 1e-9
        usual = usual_shift_covariance(result.fit.observation)[2, 2]
        of_shift = result.center_covariance[2, 2] - usual
        assert shift @ made.value_covariance(n) @ shift == pytest.approx(of_shift, rel=1e-6)

    def test_sectors_without_a_tip_diameter_give_the_same_points(self) -> None:
        touches = self._touches()
        found = []
        for tip_diameter in (6.0, None):
            made = qualify(touches, 25.0, tip_diameter=tip_diameter, kind="sectors").pretravel_map
            found.append(apply(touches, made).positions)
        assert np.allclose(found[0], found[1], atol=1e-9)


class TestWhatAQualificationWarnsOf:
    """Mistakes that still lead to a map must cause a warning."""

    def _example(self) -> Touches:
        return read_touches(EXAMPLES / "sphere_touches.csv")

    def test_the_example_itself_is_clean(self) -> None:
        result = qualify(self._example(), 24.9987, tip_diameter=6.0)
        assert result.outliers == ()
        assert result.warnings == ()

    @pytest.mark.parametrize(
        ("keep", "options", "words"),
        [
            (slice(None), {"diameter": 24.93}, "no probe triggers before contact"),
            (slice(None), {"tip_diameter": 6.2}, "probes deflect by 1 to 80"),
            (slice(None), {"tip_diameter": None, "kind": "harmonic"}, "diameter was not given"),
            (slice(0, 15), {}, "a cap hardly"),
        ],
    )
    def test_warnings(
        self, keep: slice, options: dict[str, float | str | None], words: str
    ) -> None:
        touches = self._example().take(np.arange(75)[keep])
        arguments = {"diameter": 24.9987, "tip_diameter": 6.0, **options}
        result = qualify(touches, **arguments)  # type: ignore[arg-type]
        assert any(words in warning for warning in result.warnings), result.warnings
        assert (result.grade is None) == ("before contact" in words)


@pytest.mark.parametrize(("repeats", "words"), [(1, "is not known"), (3, "The probe is good")])
def test_without_repeats_a_probe_is_not_called_good(
    tmp_path: Path, repeats: int, words: str
) -> None:

    path = tmp_path / "sphere.csv"
    write_touches(path, _touches(np.eye(3)).take(np.arange(25 * repeats)))
    made = Qualify(touches=path, diameter=25.0, tip_diameter=6.0, kind="harmonic").run()
    assert words in made.document().verdict


def test_five_exact_touches_of_which_the_pole_is_left_out() -> None:
    """Without the pole, four touches on the equator do not show the height of the centre; touches
    without noise left a column of exact zeros there. Lobes of 1 µm, positions to nine decimals."""
    n = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1]])
    lobes = 1e-3 * np.array([1.0, 0.0, -1.0, 0.0, 1.0])
    positions = np.round(n * (15.495 - lobes)[:, None], 9)
    found = qualify_with_all_kinds(Touches(positions, n), 25.0, tip_diameter=6.0)
    assert np.abs(found.center[:2]).max() < 2e-3
    value, u = found.pretravel_map.pretravel_and_uncertainty(n)
    assert np.isfinite(value).all()
    assert np.all(u < 0.1)


@pytest.mark.parametrize("polar", [85.0, 90.0])
@pytest.mark.parametrize("step", [4, pytest.param(1, marks=pytest.mark.slow)])
def test_kinds_are_not_compared_where_the_others_do_not_determine_a_sphere(
    polar: float, step: int
) -> None:
    """Four of five directions at one polar angle: the mean radius of four touches fits them
    exactly, and says nothing of the fifth. Twelve azimuths of the lobes: the matrices are singular
    to the last digit in some."""
    n = np.array([[0.0, 0.0, 1.0], *from_angles(np.radians(polar), np.arange(4) * math.pi / 2.0)])
    across = n[:, 0] ** 2 + n[:, 1] ** 2
    azimuth = np.arctan2(n[:, 1], n[:, 0])
    for row in range(0, 12, step):
        lobes = np.cos(3.0 * (azimuth - math.radians(10.0 * row)))
        noise = 3e-4 * np.random.default_rng(row).standard_normal(5)
        value = 1e-3 * (1.0 + 4.0 * across + lobes * across) + noise
        found = qualify_with_all_kinds(
            Touches(n * (15.5 - value)[:, None], n), 25.0, tip_diameter=6.0
        )
        assert found.pretravel_map.kind == "harmonic"
        assert np.isfinite(found.pretravel_map.standard_uncertainty(n)).all()
