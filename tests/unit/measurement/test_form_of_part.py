"""The form of a part as an error in common: shapes that are found, hidden, or taken by prior."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import chdtri, ndtr

from pretravel.base.arrays import FloatArray
from pretravel.drawing.features.feature_uncertainty import (
    FORM_OF_PART,
    dof_of_mixture,
    noise_of_features,
)
from pretravel.drawing.features.form_families import families_of, families_of_faces
from pretravel.drawing.features.form_of_part import UNSEEN, form_of_part
from pretravel.drawing.features.measured_feature import MeasuredFeature, measure_feature
from pretravel.drawing.steps_around import steps_around
from pretravel.measurement.association import associate
from pretravel.uncertainty import EXPANDED_COVERAGE, coverage_factor
from tests.support.feature_points import OWN, around, feature_points

Z = np.array([0.0, 0.0, 1.0])
UM = 1e-3


def _bore(azimuth: FloatArray, off: FloatArray) -> MeasuredFeature:
    outward = np.column_stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth])
    points = feature_points((10.0 + off)[:, None] * outward, -outward, shared={})
    return measure_feature(points, "bore", axis=Z)


def test_displaced_faces_do_not_average_out() -> None:
    """Ten faces, ten touches each, off by 5 µm: the variance of a height is 5²/10, not 5²/100."""
    rng, face = np.random.default_rng(50), np.repeat(np.arange(10), 10)
    places = rng.uniform(-1.0, 1.0, (100, 2))
    families = families_of_faces(face, (), places)
    mean, found = np.full((1, 100), 0.01), []
    for _ in range(40):
        off = (5.0 * UM * rng.standard_normal(10))[face] + 0.3 * UM * rng.standard_normal(100)
        form = form_of_part(off - off.mean(), np.ones((100, 1)), 99.0 * (0.3 * UM) ** 2, families)
        found.append(float(form.covariance(mean)[0, 0]))
    # A variance from ten faces scatters by 47 %, the mean of 40 by 7 %; three of that.
    assert np.mean(found) == pytest.approx((5.0 * UM) ** 2 / 10.0, rel=0.22)


@pytest.mark.long
def test_waves_of_any_length_over_the_faces_are_contained() -> None:
    """Waves of 0.7 to 2.8 faces: a shift and two turns of eight faces are covered by u."""
    rng, face = np.random.default_rng(55), np.repeat(np.arange(8), 25)
    count, noise, squares = len(face), 0.3 * UM, []
    for _ in range(40):
        places, off = rng.uniform(-1.0, 1.0, (count, 2)), noise * rng.standard_normal(count)
        for name in range(8):
            toward = rng.standard_normal(3)
            toward *= 2.0 * np.pi / (np.linalg.norm(toward) * rng.uniform(1.4, 5.6))
            phase, mine = rng.uniform(0.0, 2.0 * np.pi), face == name
            off[mine] += 1.5 * UM * np.cos(places[mine] @ toward[:2] + phase)
        jacobian = np.column_stack([np.ones(count), rng.standard_normal((8, 2))[face]])
        response = np.linalg.pinv(jacobian)
        moved = response @ off
        families = families_of_faces(face, (), places)
        expected = (count - 3) * noise**2
        form = form_of_part(off - jacobian @ moved, jacobian, expected, families)
        variance = np.diag(form.covariance(response) + noise**2 * response @ response.T)
        squares.append(moved**2 / variance)
    # The mean of 120 squares scatters by 0.13 to 0.2; shapes of the orders 1 to 3 had 2.6 to 3.6.
    assert np.mean(squares) < 1.5


def test_of_many_faces_each_may_be_taken_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """The placement takes 3 of 100 numbers of displaced faces: 3 percent of their variance."""
    rng, face = np.random.default_rng(52), np.repeat(np.arange(100), 5)
    places = rng.uniform(-1.0, 1.0, (500, 2))
    off = (5.0 * UM * rng.standard_normal(100))[face] + 0.3 * UM * rng.standard_normal(500)
    jacobian = np.column_stack([np.ones(500), rng.standard_normal((500, 2))])
    left = off - jacobian @ np.linalg.lstsq(jacobian, off, rcond=None)[0]
    mean = jacobian.T / 500.0
    found = []
    for of_form, of_families in ((10_000, 10_000), (50, 10_000), (50, 50)):
        monkeypatch.setattr("pretravel.drawing.features.form_of_part.MANY_SHAPES", of_form)
        monkeypatch.setattr("pretravel.drawing.features.form_families.MANY_SHAPES", of_families)
        families = families_of_faces(face, (3,), places)
        form = form_of_part(left, jacobian, 497.0 * (0.3 * UM) ** 2, families)
        found.append([*np.diag(form.covariance(mean)), form.excess, *form.variances(mean[0])[0]])
    assert found[1][:3] == pytest.approx(found[0][:3], rel=0.05)
    # The same numbers without their zeros: the order of the sums alone differs.
    assert found[2] == pytest.approx(found[1], rel=1e-9)
    assert not isinstance(families[0].columns, np.ndarray)


def test_roughness_averages_out() -> None:
    rng, face = np.random.default_rng(51), np.repeat(np.arange(10), 10)
    families = families_of_faces(face, (), rng.uniform(-1.0, 1.0, (100, 2)))
    off = 5.0 * UM * rng.standard_normal(100)
    form = form_of_part(off - off.mean(), np.ones((100, 1)), 99.0 * (0.3 * UM) ** 2, families)
    variance = float(form.covariance(np.full((1, 100), 0.01))[0, 0])
    assert variance == pytest.approx((5.0 * UM) ** 2 / 100.0, rel=0.5)  # 1/sqrt(50), three of that


@pytest.mark.parametrize("count", [4, 5, 6])
def test_few_touches_of_a_large_oval_are_no_roughness_of_that_size(count: int) -> None:
    """An oval of 20 µm leaves the residuals that roughness of 20 µm would leave, which turned
    surfaces do not have: U of the diameter was 54 to 380 µm. One wrong touch that leaves them
    moves the diameter by 40, 20 or 16 µm (one of four, five or six; 80, 50 or 49 µm off)."""
    u = []
    for seed in range(6):
        rng = np.random.default_rng([57, seed])
        azimuth = 2.0 * np.pi * np.arange(count) / count
        off = 20.0 * UM * np.cos(2.0 * azimuth + rng.uniform(-0.5, 0.5))
        found = _bore(azimuth, off + OWN * rng.standard_normal(count)).quantity("diameter")
        assert abs(found.value - 20.0) < found.expanded_u
        u.append(found.expanded_u)
    assert np.mean(u) < 1.25 * {4: 40.0, 5: 20.0, 6: 16.0}[count] * UM


@pytest.mark.parametrize("left", [2, 3, 5])
def test_any_roughness_is_covered(left: int) -> None:
    """U is that of 95 % on average over surfaces; of those rough by twice to five times the errors
    small residuals may be taken for perfect, and U covers least: at least 93 %."""
    count, shares = left + 3, (np.arange(60) + 0.5) / 60.0
    azimuth = 2.0 * np.pi * np.arange(count) / count
    jacobian = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.ones(count)])
    row = np.linalg.pinv(jacobian)[0]
    one = np.linalg.qr(jacobian, mode="complete")[0][:, -1]
    for rough in (0.0, 1.0, 2.0, 3.0, 5.0):
        true, covered = OWN * math.hypot(1.0, rough), []
        for observed in true**2 * chdtri(left, 1.0 - shares):
            form = form_of_part(math.sqrt(observed) * one, jacobian, left * OWN**2)
            u = math.sqrt((OWN**2 + form.rough**2) * float(row @ row))
            variances, likely = form.variances(row)
            deviations = np.sqrt(variances + OWN**2 * float(row @ row))
            limit = u * coverage_factor(dof_of_mixture(deviations, likely, u), whole_dof=False)
            deviation = true * math.sqrt(float(row @ row))
            covered.append(1.0 - 2.0 * ndtr(-limit / deviation))
        assert np.mean(covered) > 0.93


def test_roughness_that_looks_like_lobes_by_chance_is_covered() -> None:
    """Seven touches of bores that are rough by 1 µm: four residuals may look like two or three
    lobes, which leave the place. U covers 95.45 % of roughness alone, too, unless the residuals
    exclude it; by the probabilities of all forms it covered 84 to 95 % in these bores."""
    azimuth, covered = 2.0 * np.pi * np.arange(7) / 7.0, []
    for seed in range(20):
        rng = np.random.default_rng([50, seed])
        errors = _bore(azimuth, UM * rng.standard_normal(7) + OWN * rng.standard_normal(7)).errors
        if not errors.form.may_be_rough:
            continue
        row = np.eye(len(errors.association.response))[0]
        u = float(np.sqrt(sum(each[0, 0] for each in errors.parts(row[None]).values())))
        weights = row @ errors.association.response
        variances, likely = errors.form.variances(weights, rough=True)
        without = u**2 - errors.form.covariance(weights[None])[0, 0]
        limit = coverage_factor(errors.dof(row, u), whole_dof=False) * u
        covered.append(float(likely @ (1.0 - 2.0 * ndtr(-limit / np.sqrt(without + variances)))))
    assert len(covered) > 10
    assert min(covered) > EXPANDED_COVERAGE - 1e-3  # of the search for k


def test_touches_that_tell_lobes_from_roughness_are_asked_for() -> None:
    """An oval of 5 µm, 5 touches: U is that of roughness, 11 µm; seven touches show the oval."""
    u, said = [], []
    for count in (5, 7):
        azimuth = 2.0 * np.pi * np.arange(count) / count
        found = _bore(azimuth, 5.0 * UM * np.cos(2.0 * azimuth + 0.4))
        u.append(found.quantity("diameter").expanded_u)
        said.append(" ".join(found.warnings))
    assert u[0] > 5.0 * u[1]
    assert "come from lobes, roughness or one wrong touch" in said[0]
    assert "Touch 7 or more places" in said[0]
    assert "roughness" not in said[1]
    small = 2.0 * np.pi * np.arange(5) / 5
    assert "roughness" not in " ".join(_bore(small, OWN * np.cos(2.0 * small)).warnings)


def test_drawn_errors_of_a_datum_have_the_probabilities_of_its_sizes() -> None:
    """A ring of eight, rough by 2 µm: drawn with one size alone, 95 % of its shifts were within
    2 u, where U is k u. Run-out to such a datum was within its interval in 88 %."""
    azimuth, rng = 2.0 * np.pi * np.arange(8) / 8, np.random.default_rng(61)
    found = _bore(azimuth, 2.0 * UM * rng.standard_normal(8))
    (moved,) = noise_of_features([found.errors], 20_000, rng)
    x, row = found.quantity("x"), found.association.point_rows[0]
    assert x.expanded_u / x.u > 2.2
    reached = np.quantile(np.abs(moved @ found.association.response.T @ row), EXPANDED_COVERAGE)
    # The quantile of so many draws scatters by 2 %.
    assert reached == pytest.approx(x.expanded_u, rel=0.08)


@pytest.mark.parametrize("count", [4, 5, 6])
def test_small_residuals_of_few_touches_are_roughness(count: int) -> None:
    """Rough by 1 µm: U covers the size of most bores, as many as before large ovals were known."""
    outside = 0
    for seed in range(30):
        rng = np.random.default_rng([58, seed])
        azimuth = 2.0 * np.pi * np.arange(count) / count
        off = 1.0 * UM * rng.standard_normal(count) + OWN * rng.standard_normal(count)
        found = _bore(azimuth, off).quantity("diameter")
        outside += abs(found.value - 20.0) > found.expanded_u
    assert outside <= 5  # of 30: with a probability of 5 % in each, more in 1 %


@pytest.mark.parametrize(("count", "hidden"), [(8, ("7", "8", "9")), (9, ("8", "9", "10"))])
def test_lobes_that_equal_steps_hide_are_named(count: int, hidden: tuple[str, ...]) -> None:
    """As many lobes as touches are a diameter, one more or less a place; no residual shows them."""
    azimuth = 2.0 * np.pi * np.arange(count) / count
    (text,) = _bore(azimuth, 0.0 * azimuth).warnings
    assert f"form deviation: {hidden[0]}, {hidden[1]} or {hidden[2]} lobes" in text
    twelve = _bore(2.0 * np.pi * np.arange(12) / 12, np.zeros(12))
    assert "11 or 12 lobes" in twelve.hidden_form  # rare: no warning
    assert not twelve.warnings
    unequal = steps_around(count)
    assert not _bore(unequal, 0.0 * unequal).warnings
    many = 2.0 * np.pi * np.arange(14) / 14
    assert not [t for t in _bore(many, 0.0 * many).warnings if "12 lobes" in t]


def test_an_oval_leaves_the_diameter() -> None:
    """Two lobes of 5 µm on eight equal steps do not move it; independent errors would by 2.5 µm."""
    azimuth = 2.0 * np.pi * np.arange(8) / 8
    rng = np.random.default_rng(52)
    found = _bore(azimuth, 5.0 * UM * np.cos(2.0 * azimuth) + OWN * rng.standard_normal(8))
    assert found.quantity("diameter").parts[FORM_OF_PART] < 0.5 * UM
    assert found.errors.excess == pytest.approx(5.0 * UM / np.sqrt(2.0), rel=0.15)


def test_a_plane_through_three_touches_has_a_usual_form() -> None:
    places = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.0, 30.0, 0.0]])
    plane = measure_feature(feature_points(places, np.tile(Z, (3, 1)), shared={}), "plane")
    assert plane.errors.form.by_prior
    assert "a usual form of 1 µm" in " ".join(plane.warnings)
    # Their mean: between one touch and three independent ones of this form, at corners more.
    assert UNSEEN / np.sqrt(3.0) < plane.quantity("z").parts[FORM_OF_PART] < 2.5 * UNSEEN


@pytest.mark.parametrize("kind", ["circle", "plane", "cylinder", "line", "slot"])
def test_shapes_leave_the_whole_surface_where_it_is(kind: str) -> None:
    """Densely touched, the feature of least squares moves by no shape, whose mean square is 1."""
    n = 60
    turn, height = np.meshgrid(2.0 * np.pi * np.arange(n) / n, np.linspace(-1.0, 1.0, n))
    grid = np.column_stack([20.0 * (turn.ravel() / np.pi - 1.0), 30.0 * height.ravel()])
    points = {
        "circle": 10.0 * around(n)[0],
        "plane": np.column_stack([grid, 0.0 * grid[:, 0]]),
        "slot": np.vstack([np.insert(grid, 1, side, axis=1) for side in (-4.0, 4.0)]),
        "line": np.column_stack([np.linspace(-1.0, 1.0, n), np.zeros(n), np.zeros(n)]),
        "cylinder": np.column_stack(
            [
                10.0 * np.cos(turn).ravel(),
                10.0 * np.sin(turn).ravel(),
                20.0 * height.ravel(),
            ]
        ),
    }[kind]
    axis = np.array([0.0, 1.0, 0.0]) if kind in ("line", "slot") else Z
    found = associate(kind, points, axis=axis)
    for family in families_of(kind, found):
        moved = found.residual_change(family.columns.T) - family.columns.T
        # The ends of a grid count half of a step too much.
        assert np.abs(moved).max() < 0.2, family.name
        assert np.mean(np.sum(family.columns**2, axis=1)) == pytest.approx(1.0, rel=0.2)


def test_a_twist_that_touches_along_two_edges_hide_is_named() -> None:
    """x y is a plane on the edges x = -1 and y = -1: 42 % of simulated planes were in U."""
    edge = np.linspace(-1.0, 1.0, 4)
    two_edges = np.vstack(
        [np.column_stack([edge, -np.ones(4)]), np.column_stack([-np.ones(4), edge])]
    )
    grid = np.array([[x, y] for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)])
    for places, named in ((two_edges, True), (grid, False)):
        at = np.column_stack(
            [40.0 * places[:, 0], 25.0 * places[:, 1], 5.0 * UM * places.prod(axis=1)]
        )
        plane = measure_feature(feature_points(at, np.tile(Z, (len(at), 1)), shared={}), "plane")
        assert (np.ptp(plane.association.residuals) < 1e-6) == named
        assert ("form deviation: bow or twist" in " ".join(plane.warnings)) == named


def test_bows_of_both_sides_of_a_slot_are_in_u() -> None:
    """c P2(x) leaves a whole side where it is, and moves it by c / 2 at three steps: U was 5 µm."""
    x, z = (each.ravel() for each in np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]))
    bow = 6.0 * UM * 0.5 * (3.0 * x**2 - 1.0)
    sides = [
        np.column_stack([20.0 * x, y + off, 10.0 * z]) for y, off in ((4.0, bow), (-4.0, -bow))
    ]
    inward = np.repeat([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]], 9, axis=0)
    width = measure_feature(feature_points(np.vstack(sides), inward), "slot").quantity("width")
    assert width.value - 8.0 == pytest.approx(6.0 * UM, abs=0.01 * UM)
    assert width.expanded_u > 6.0 * UM


@pytest.mark.parametrize("count", [4, 5, 12])
def test_touches_at_the_same_places_show_no_more_of_the_form(count: int) -> None:
    """Nearly without noise each touch again is a copy; U was eight times too small with three."""
    angle = np.arange(count) * 2.0 * np.pi / count
    outward = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    rough = np.random.default_rng(5).normal(0.0, 4.0 * UM, count)

    def bore(times: int) -> tuple[float, float]:
        facing = np.tile(outward, (times, 1))
        at = (10.0 + np.tile(rough, times))[:, None] * facing
        points = feature_points(at, -facing, shared={}, own=1e-3 * UM)
        found = measure_feature(points, "bore", axis=[0.0, 0.0, 1.0]).quantity("diameter")
        return found.u, found.expanded_u

    assert bore(3) == pytest.approx(bore(1), rel=0.01)


@pytest.mark.parametrize("count", [4, 5])
def test_a_chip_among_few_touches_is_in_u(count: int) -> None:
    """50 µm at one touch change the diameter by 2 · 50 µm / n: lobes alone would not move it."""
    azimuth = np.arange(count) * 2.0 * np.pi / count + 0.3
    off = np.random.default_rng(3).normal(0.0, OWN, count) - 50.0 * UM * (np.arange(count) == 1)
    found = _bore(azimuth, off).quantity("diameter")
    assert found.value == pytest.approx(20.0 - 0.1 / count, abs=2.0 * UM)
    assert found.expanded_u > 0.1 / count
