"""Rodrigues 2021, sections 3.4 and 4.5: the tip slides.

Tables 4.10 and 4.11 depend on tip radius and geometry alone. Fitted to Table 4.11 are the half-axes
of its ellipsoid, which the thesis does not print (10 and 6 mm, rounded).
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq, fsolve, least_squares

from pretravel.design.probing.simulation import simulate_some
from pretravel.design.probing.slides import SlideSettings, slide
from pretravel.design.probing.tip import LateralTip, PredictedTip, predicted_tip
from pretravel.design.probing.touching import touch
from pretravel.prediction.catalogue import load_probe
from pretravel.surface.parametric import Convex
from pretravel.surface.shapes import Ellipsoid, Plane
from pretravel.surface.specification import parse_surface
from pretravel.touches.targets import Targets
from tests.support.statics_by_hand import direction, first_contact_force

REFERENCE = Path(__file__).parent / "reference"


def _table(name: str) -> dict[str, np.ndarray]:
    with (REFERENCE / name).open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


@pytest.fixture(scope="module")
def tip() -> PredictedTip:
    return predicted_tip(load_probe("omp40-2"))


@pytest.mark.published(
    "Rodrigues 2021", "Equations 3.10 to 3.17",
    what="surface, ball and ray by parameters",
    ours="the same contact, as one system",
    theirs="six equations, lsqnonlin",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Equations 3.28 to 3.30",
    what="unit vectors; normals are parallel",
    ours="the same",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Equation 3.32",
    what="normal of the ball",
    ours="the same",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Table 4.10",
    what="slide on the convex surface",
    ours="0.02 to 0.08 % above",
    theirs="40 values",
    verdict="agrees; half of the misfit has no known reason, six are excluded",
)  # fmt: skip
@pytest.mark.parametrize("v", [0.5, -0.5])
def test_table_4_10(tip: PredictedTip, v: float) -> None:
    """All 40 values within 0.1 %. The thesis states no tolerance of its solver; what is known of
    the misfit is below."""
    printed = _table("rodrigues_convex_sliding.csv")[f"deflection_mm_u0.5_v{v:g}"]
    history = slide(tip, Convex(), (0.5, v), SlideSettings(step=0.001, steps=20))
    assert history.feed == pytest.approx(0.001 * np.arange(1, 21))
    assert history.deflection == pytest.approx(printed, rel=1e-3)


@pytest.mark.published(
    "Rodrigues 2021", "Equations 3.5 to 3.7",
    what="place of the spindle, foot P_k, deflection",
    ours="0.07 % above Table 4.10",
    theirs="Table 4.10",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Equations 4.8 to 4.11",
    what="3.32 and 3.30 for it",
    ours="the same",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Equations 4.12, 4.13",
    what="first and following places of the spindle",
    ours="the same",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published("Rodrigues 2021", "Table 4.10")
def test_misfit_of_table_4_10_is_partly_that_of_rounded_coefficients() -> None:
    """At v = 0.5 the printed slope is 0.07 to 0.08 % lower in all rows: 0.012° of the normal. The
    equations 4.4 to 4.11 with the coefficients as printed, solved here step by step, leave 0.04 %:
    the reason of the rest is not known. At v = -0.5 both are within the last digit."""
    printed = _table("rodrigues_convex_sliding.csv")["deflection_mm_u0.5_v0.5"]
    exact = (0.5 + math.sqrt(0.125), 0.5, 0.5 - math.sqrt(0.125), math.sqrt(0.5))
    off = _slid_on_convex(exact, _cross_product) / printed - 1.0
    assert 6.7e-4 < off.min() < off.max() < 7.7e-4
    rounded = _slid_on_convex((0.8535, 0.5, 0.1464, 0.7071), _equation_4_7) / printed - 1.0
    assert 3.6e-4 < rounded.min() < rounded.max() < 4.6e-4
    ours = slide(predicted_tip(load_probe("omp40-2")), Convex(), (0.5, 0.5)).deflection
    assert ours == pytest.approx(printed * (1.0 + off), rel=1e-6)
    sine = 1.0 / (ours[0] / 1e-3)
    turn = math.degrees(math.asin(1e-3 / printed[0]) - math.asin(sine))
    assert turn == pytest.approx(0.012, abs=0.004)  # printed to 0.5 nm of 3.6 µm


@pytest.mark.published("Rodrigues 2021", "Table 4.10")
@pytest.mark.parametrize(
    ("what", "bends", "leaves"),
    [("way of the step before", 0.0, 7.0), ("way of the first step", 0.0, 7.0),
     ("way of the step itself", 0.0, 7.0), ("ball of 2.5 mm", -0.5, 6.4),
     ("three digits", 0.0, -5.0), ("45° as 0.785 rad", 0.0, 5.8)],
)  # fmt: skip
def test_what_does_not_explain_the_rest_of_table_4_10(
    what: str, bends: float, leaves: float
) -> None:
    """In parts of 10⁴, over rows 5 to 20: the mean misfit, and how much more the last row has than
    the fifth. Neither the order of the steps nor the radius changes the misfit of the first rows;
    another radius bends it, which the table does not. Coefficients of three digits go to the other
    side, and an angle typed as 0.785 changes a fifth. A solver that stops early leaves the same
    distance in each row, as in Table 4.11, not the same share. A table of force against
    deflection is not in these numbers: the slide depends on the feed alone."""
    printed = _table("rodrigues_convex_sliding.csv")["deflection_mm_u0.5_v0.5"]
    c, s = math.cos(0.785), math.sin(0.785)
    exact = (0.5 + math.sqrt(0.125), 0.5, 0.5 - math.sqrt(0.125), math.sqrt(0.5))
    found = {
        "way of the step before": lambda: _slid_on_convex(exact, _cross_product),
        "way of the first step": lambda: _slid_on_convex(exact, _cross_product, way="first"),
        "way of the step itself": lambda: _slid_on_convex(exact, _cross_product, way="own"),
        "ball of 2.5 mm": lambda: _slid_on_convex(exact, _cross_product, radius=2.5),
        "three digits": lambda: _slid_on_convex((0.854, 0.5, 0.146, 0.707), _cross_product),
        "45° as 0.785 rad": lambda: _slid_on_turned(c, s),
    }[what]()
    misfit = 1e4 * (found / printed - 1.0)
    assert misfit[4:].mean() == pytest.approx(leaves, abs=0.3)
    assert misfit[19] - misfit[4] == pytest.approx(bends - 0.2, abs=0.3)


def _slid_on_turned(c: float, s: float) -> np.ndarray:
    """The convex surface turned about y, z and back about y by an angle with this cosine and sine:
    its parameters as four numbers only where both are equal."""
    turn = (
        np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    )

    def normal(u: float, v: float) -> np.ndarray:
        n = turn @ np.cross([20.0, 0.0, -20.0 * u], [0.0, 20.0, -20.0 * v])
        return np.asarray(n / np.linalg.norm(n))

    def center(u: float, v: float) -> np.ndarray:
        bowl = np.array([20.0 * u, 20.0 * v, -10.0 * (u * u + v * v)])
        return np.asarray(turn @ bowl + 3.0 * normal(u, v))

    return _steps(center, normal)


def _cross_product(u: float, v: float, k: tuple[float, ...]) -> np.ndarray:
    """Equation 3.25 of equation 4.3."""
    one, half, three, four = k
    by_bowl = 20.0 * np.array([-three, half, -one])
    du = 20.0 * np.array([one, half, three]) + u * by_bowl
    dv = 20.0 * np.array([-half, four, half]) + v * by_bowl
    return np.cross(du, dv)


def _equation_4_7(u: float, v: float, _: tuple[float, ...]) -> np.ndarray:
    one, two = 17.07 * u - 2.92, 17.07 * v - 10.0
    by_v, by_u = 10.0 * v + 14.142, 10.0 * u + 10.0
    return np.array(
        [
            one * by_v - two * by_u,
            one * (2.92 * v + 10.0) - two * (2.92 * u - 17.05),
            by_u * (2.92 * v + 10.0) - (2.92 * u - 17.05) * by_v,
        ]
    )


def _slid_on_convex(
    k: tuple[float, ...],
    normal: Callable[[float, float, tuple[float, ...]], np.ndarray],
    *,
    radius: float = 3.0,
    way: str = "before",
) -> np.ndarray:
    """Section 3.4 for 20 steps of 1 µm from (0.5, 0.5), ball of 3 mm; the deflections. [mm]"""
    one, half, three, four = k

    def unit(u: float, v: float) -> np.ndarray:
        n = normal(u, v, k)
        return np.asarray(n / np.linalg.norm(n))

    def center(u: float, v: float) -> np.ndarray:
        bowl = 10.0 * (u * u + v * v)
        point = [
            one * 20.0 * u - half * 20.0 * v - three * bowl,
            half * 20.0 * u + four * 20.0 * v + half * bowl,
            three * 20.0 * u + half * 20.0 * v - one * bowl,
        ]
        return np.asarray(point) + radius * unit(u, v)

    return _steps(center, unit, way)


def _steps(
    center: Callable[[float, float], np.ndarray],
    normal: Callable[[float, float], np.ndarray],
    way: str = "before",
) -> np.ndarray:
    """The ball's centre from 20 places of the spindle, along the normal of a step across z."""

    def across(u: float, v: float) -> np.ndarray:
        toward = normal(u, v) * [1.0, 1.0, 0.0]
        return np.asarray(toward / np.linalg.norm(toward))

    start, unknown, found = center(0.5, 0.5), np.array([0.5, 0.5, 0.0]), []
    for step in range(1, 21):
        place = start - step * 1e-3 * normal(0.5, 0.5)
        fixed = across(0.5, 0.5) if way == "first" else across(unknown[0], unknown[1])

        def off(x: np.ndarray, at: np.ndarray = place, to: np.ndarray = fixed) -> np.ndarray:
            to = across(x[0], x[1]) if way == "own" else to
            return np.asarray(center(x[0], x[1]) - at - x[2] * to)

        unknown = fsolve(off, unknown + np.array([0.0, 0.0, 1e-3]), xtol=1e-13)
        found.append(unknown[2])
    return np.array(found)


@pytest.mark.published(
    "Rodrigues 2021", "Equation 4.2",
    what="its rotation",
    ours="45°",
    theirs="70°",
    verdict="differs: the table is that of 45°",
)  # fmt: skip
def test_table_4_10_is_not_that_of_the_printed_angle(tip: PredictedTip) -> None:
    """With 70°, as equation 4.2 prints, every value is 8 % off: the table is that of 45°."""
    printed = _table("rodrigues_convex_sliding.csv")["deflection_mm_u0.5_v0.5"]
    turned = slide(tip, Convex(turn=math.radians(70.0)), (0.5, 0.5)).deflection
    assert np.all(np.abs(turned / printed - 1.0) > 0.07)


@pytest.mark.published(
    "Rodrigues 2021", "Equation 4.1",
    what="convex surface",
    ours="second row a v",
    theirs="second row b u",
    verdict="differs: misprint",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Equation 4.3",
    what="coefficients of the rotated surface",
    ours="0.1464 in the first row",
    theirs="0.464",
    verdict="differs: misprint",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Figures 4.17, 4.18, 4.20",
    what="surfaces",
    ours="`convex`, `ellipsoid`",
    theirs="drawings",
    verdict="agrees",
)  # fmt: skip
def test_equation_4_3_has_the_coefficients_of_45_degrees() -> None:
    """0.8535, 0.5, 0.1464 (printed once as 0.464), 0.7071."""
    surface = Convex(a=1.0, b=1.0)
    _, du, dv = surface.derivatives(np.zeros((1, 2)))
    assert du[0] == pytest.approx([0.8535, 0.5, 0.1464], abs=1e-4)
    assert dv[0] == pytest.approx([-0.5, 0.7071, 0.5], abs=1e-4)
    top = surface.local(np.array([[1.0, 0.0]])).point[0] - du[0]
    assert top == pytest.approx([-0.1464, 0.5, -0.8535], abs=1e-4)


@pytest.mark.published(
    "Rodrigues 2021", "Table 4.11",
    what="slides on ellipsoid and plane",
    ours="44.346 µm in row 20; rows 1 to 19 lower by 0.449 µm",
    theirs="44.346 µm; 0.449 µm more",
    verdict="differs: an artefact of their solver; half-axes are fitted",
)  # fmt: skip
def test_table_4_11_inclined(tip: PredictedTip) -> None:
    """1 / sin 40° per unit of feed, printed in whole micrometres."""
    printed = _table("rodrigues_ellipsoid_inclined_sliding.csv")["deflection_um_inclined"]
    history = slide(tip, parse_surface("plane:polar=40"), (0.0, 0.0))
    assert np.all(np.round(1e3 * history.deflection) == printed)
    assert history.deflection == pytest.approx(history.feed / math.sin(math.radians(40.0)))


@pytest.mark.published(
    "Rodrigues 2021", "Equation 4.19",
    what="normal of the ball",
    ours="the same",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Equations 4.23, 4.24",
    what="first and following places of the spindle",
    ours="the same",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published("Rodrigues 2021", "Table 4.11")
def test_table_4_11_ellipsoid(tip: PredictedTip) -> None:
    """Row 20 within 1 nm. Rows 1 to 19 within 8 nm after 0.449 µm is subtracted, which the
    thesis's solver added there and not in row 20 (rows 15 and 16 are rounded by hand)."""
    printed = _table("rodrigues_ellipsoid_inclined_sliding.csv")["deflection_um_ellipsoid"]
    history = slide(tip, parse_surface("ellipsoid:a=10,c=6"), (0.0, math.radians(40.0)))
    ours = 1e3 * history.deflection
    assert ours[19] == pytest.approx(printed[19], abs=1e-3)
    assert ours[:19] == pytest.approx(printed[:19] - 0.449, abs=8e-3)
    assert np.all(np.abs(ours[:19] - printed[:19]) > 0.4)
    # The slope is 1/sin of the true normal, 26.7° and not 40°, and decreases along the slide.
    slope = np.diff(ours, prepend=0.0)
    assert slope[0] == pytest.approx(2.2235, abs=1e-4)
    assert slope[19] == pytest.approx(2.212, abs=1e-3)


@pytest.mark.published("Rodrigues 2021", "Table 4.11")
def test_half_axes_of_table_4_11_are_fitted() -> None:
    """The thesis prints no half-axes. Fitted to rows 1 to 19, with their common 0.449 µm: a =
    10.01 (u 0.62), c = 6.01 mm (u 0.38), c/a = 0.6000; without the two rows that are rounded by
    hand 10.10 (u 0.11) and 6.06 mm (u 0.07). Row 20, which has no part in it, is then predicted
    within 2 nm of 44.346 µm."""
    printed = _table("rodrigues_ellipsoid_inclined_sliding.csv")["deflection_um_ellipsoid"]

    def misfit(p: np.ndarray, rows: np.ndarray) -> np.ndarray:
        return (_slid_on_ellipsoid(p[0], p[1]) + p[2] - printed)[rows]

    for rows, expected, u_expected in (
        (np.arange(19), [10.01, 6.01, 0.4497], [0.62, 0.38, 0.0014]),
        (np.r_[0:14, 16:19], [10.10, 6.06, 0.4494], [0.113, 0.068, 0.00026]),
    ):
        fit = least_squares(misfit, [9.0, 7.0, 0.4], args=(rows,), xtol=1e-15, ftol=1e-15)
        noise = np.sum(fit.fun**2) / (len(rows) - 3)
        u = np.sqrt(np.diag(noise * np.linalg.inv(fit.jac.T @ fit.jac)))
        # The valley is flat: where the search ends differs by some percent of u.
        for found, value, spread in zip(fit.x, expected, u_expected, strict=True):
            assert found == pytest.approx(value, abs=0.005 + 0.05 * spread)
        assert u == pytest.approx(u_expected, rel=0.1)
        assert fit.x[1] / fit.x[0] == pytest.approx(0.6000, abs=1e-4)
        assert _slid_on_ellipsoid(*fit.x[:2])[19] == pytest.approx(printed[19], abs=2e-3)
        assert np.all(np.abs(fit.x[:2] - [10.0, 6.0]) < u[:2])


def _slid_on_ellipsoid(a: float, c: float) -> np.ndarray:
    """Section 3.4 in the plane u = 0 from v = 40°: 20 steps of 1 µm, a ball of 3 mm. [µm]"""

    def center(v: float) -> np.ndarray:
        n = np.array([c * math.sin(v), a * math.cos(v)])
        return np.array([a * math.sin(v), c * math.cos(v)]) + 3.0 * n / np.linalg.norm(n)

    v = math.radians(40.0)
    n = np.array([c * math.sin(v), a * math.cos(v)])
    n, start, found = n / np.linalg.norm(n), center(v), []
    for step in range(1, 21):
        place = start - step * 1e-3 * n
        v = brentq(lambda x, at=place: center(x)[1] - at[1], v - 1e-3, v + 0.01, xtol=1e-15)
        found.append(1e3 * (center(v)[0] - place[0]))
    return np.array(found)


POINTS_OF_4_5_1 = ((0.5, 0.5), (0.5, -0.5))


@pytest.mark.published(
    "Rodrigues 2021", "Section 4.5.1",
    what="trigger feeds on the convex surface",
    ours="0.67 and 2.97 µm (50 mm), 3.60 and 14.75 µm (100 mm)",
    theirs="5 and 8 µm",
    verdict="differs: contradicts Tables 4.1 to 4.9",
)  # fmt: skip
def test_section_4_5_1_trigger_feeds_are_an_honest_miss() -> None:
    """Printed: 5 µm at v = 0.5, 8 µm at -0.5. Table 4.10 turns them into sensing distances of 18.0
    and 9.6 µm, at normals of polar 16.1° and 56.5°. In the thesis's own Tables 4.1 to 4.9 distances
    fall with the polar angle at every azimuth, so that no stylus gives such a pair. Forces by six
    seats in numpy, distances by the thesis's own micrometres per newton across the axis (4.58 of
    Table 4.1, 38.1 of Table 2.3), a plane at each point: 0.66 and 2.96 µm, 3.65 and 14.9 µm."""
    slid = _table("rodrigues_convex_sliding.csv")
    implied = [
        1e3 * slid["deflection_mm_u0.5_v0.5"][4],
        1e3 * slid["deflection_mm_u0.5_v-0.5"][7],
    ]
    assert implied == pytest.approx([18.0, 9.6], abs=0.02)
    exact = (0.5 + math.sqrt(0.125), 0.5, 0.5 - math.sqrt(0.125), math.sqrt(0.5))
    normals = [_cross_product(u, v, exact) for u, v in POINTS_OF_4_5_1]
    normals = [n / np.linalg.norm(n) for n in normals]
    polar = [math.degrees(math.acos(n[2])) for n in normals]
    assert polar == pytest.approx([16.1, 56.5], abs=0.05)
    tables = np.genfromtxt(REFERENCE / "rodrigues_trigger_50mm.csv", delimiter=",", names=True)
    for azimuth in range(0, 61, 10):
        rows = tables[tables["azimuth_deg"] == azimuth]
        rows = rows[np.argsort(rows["polar_deg"])]
        assert np.all(np.diff(rows["sensing_distance_fea_mm"]) >= -1e-9)
    for lever, per_newton, expected in (
        (64.4, 4.58, [0.66, 2.96]),
        (114.4, 38.1, [3.65, 14.9]),
    ):
        feeds = []
        for n in normals:
            sine = math.hypot(n[0], n[1])
            feeds.append(per_newton * first_contact_force(n, lever) * sine * sine)
        assert feeds == pytest.approx(expected, rel=0.01)


@pytest.mark.published("Rodrigues 2021", "Section 4.5.1")
@pytest.mark.parametrize(
    ("name", "model", "feeds"),
    [
        ("omp40-2-thesis", "analytic", [0.53, 2.38]),
        pytest.param("omp40-2-thesis", "fem", [0.67, 2.97], marks=pytest.mark.slow),
        ("omp40-2-thesis-100mm", "analytic", [3.27, 13.40]),
        pytest.param("omp40-2-thesis-100mm", "fem", [3.60, 14.75], marks=pytest.mark.slow),
    ],
)
def test_section_4_5_1_our_trigger_feeds(name: str, model: str, feeds: list[float]) -> None:
    """What the page states instead of 5 and 8 µm."""
    convex = Convex()
    local = convex.local(np.array(POINTS_OF_4_5_1))
    tip = LateralTip(predicted_tip(load_probe(name), model))
    found = 1e3 * touch(tip, convex, Targets(local.point, local.normal)).pretravel
    assert found == pytest.approx(feeds, abs=0.006)


@pytest.mark.published(
    "Rodrigues 2021", "Section 4.5.4",
    what="trigger feeds, plane and ellipsoid",
    ours="15.73 and 10.14 µm (100 mm, azimuth 180°)",
    theirs="18 and 13 µm",
    verdict="differs: stylus not stated; two directions; travel, not sensing distance",
)  # fmt: skip
@pytest.mark.slow
def test_section_4_5_4_with_100_mm_at_azimuth_180() -> None:
    """The thesis triggers at 18 and 13 µm. Ours across the axis, as the thesis counts: 15.73 µm on
    the plane at 40° and 10.14 µm on the ellipsoid; with all parts of the deflection 15.95 and
    10.43 µm. By hand: 38.0 µm per newton of Table 2.3, force of six seats, times sin²."""
    tip = predicted_tip(load_probe("omp40-2-thesis-100mm"), "fem")
    ellipsoid = Ellipsoid([0, 0, 0], [10, 10, 6])
    local = ellipsoid.local(np.array([[math.pi, math.radians(40.0)]]))
    normal = direction(40.0, 180.0)
    plane = Plane([0, 0, 0], normal)
    for one, expected in ((LateralTip(tip), [15.73, 10.14]), (tip, [15.95, 10.43])):
        on_plane = touch(one, plane, Targets(np.zeros((1, 3)), [normal])).pretravel[0]
        on_ellipsoid = touch(one, ellipsoid, Targets(local.point, local.normal)).pretravel[0]
        assert [1e3 * on_plane, 1e3 * on_ellipsoid] == pytest.approx(expected, abs=0.006)
    for polar, expected_lateral in ((40.0, 15.73), (26.7236, 10.14)):
        force = first_contact_force(direction(polar, 180.0), 114.4)
        by_hand = 38.0 * force * math.sin(math.radians(polar)) ** 2
        assert by_hand == pytest.approx(expected_lateral, rel=0.03)


def test_micrometres_per_newton_of_table_2_3() -> None:
    """16.11 and 28.456 µm over the forces of six seats with a lever of 114.4 mm: 38.2 at azimuth
    0° (38.3 where the force is least), 38.0 at 60°. With a lever of 64.4 mm Table 4.1 has 4.5 to
    4.6."""
    with (REFERENCE / "rodrigues_experiment.csv").open(encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["unit"] == "um"]
    printed = {row["extreme"]: float(row["finite_elements"]) for row in rows}
    force = [first_contact_force(direction(90.0, a), 114.4) for a in range(61)]
    found = [printed["min"] / force[0], printed["min"] / min(force), printed["max"] / force[60]]
    assert found == pytest.approx([38.17, 38.27, 38.01], abs=0.005)


@pytest.mark.published("Rodrigues 2021", "Section 4.5.4")
def test_section_4_5_4_compares_two_directions(tip: PredictedTip) -> None:
    """The thesis finds 27.7 % less travel on the ellipsoid, attributed to curvature. With its own
    parameters nearly all of it is due to the direction; with equal normals 0.03 % remain."""
    thesis = LateralTip(predicted_tip(load_probe("omp40-2-thesis")))
    ellipsoid = Ellipsoid([0, 0, 0], [10, 10, 6])
    local = ellipsoid.local(np.array([[0.0, math.radians(40.0)]]))
    curved = touch(thesis, ellipsoid, Targets(local.point, local.normal)).pretravel[0]

    def on_plane(normal: np.ndarray) -> float:
        plane = Plane([0, 0, 0], normal)
        return float(touch(thesis, plane, Targets(np.zeros((1, 3)), [normal])).pretravel[0])

    forty = np.array([math.sin(math.radians(40.0)), 0.0, math.cos(math.radians(40.0))])
    assert 1.0 - curved / on_plane(forty) > 0.25
    assert curved / on_plane(local.normal[0]) == pytest.approx(1.0, abs=1e-3)
    assert curved != pytest.approx(on_plane(local.normal[0]), rel=1e-6)


@pytest.mark.published("Rodrigues 2021", "Equations 3.10 to 3.17")
@pytest.mark.published(
    "Rodrigues 2021", "Equation 3.19",
    what="surface less ball is zero",
    ours="tangency below 1e-9 mm",
    theirs="0",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Equation 3.36",
    what="target point from the latched spindle",
    ours="to 1 nm",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Figures 3.1 to 3.15",
    what="drawings and flow charts of the three processes",
    ours="`pretravel slide` and `touch`; the curved one steps in the workbench (designer)",
    theirs="–",
    verdict="not software; the processes agree",
)  # fmt: skip
def test_equation_3_36(tip: PredictedTip) -> None:
    """T0 = S_t + (r - k d_f) N_in: back from the latched spindle by the feed at the trigger.

    S_t is what the simulated machine reports, k d_f the feed of the slide step by step: two
    solutions of the same touch. Steps of a tenth of the feed are its error, below a nanometre."""
    convex = Convex()
    local = convex.local(np.array([[0.5, -0.5]]))
    targets = Targets(local.point, local.normal)
    done = touch(LateralTip(tip), convex, targets)
    reported = simulate_some(LateralTip(tip), convex, targets).touches
    assert reported is not None
    history = slide(tip, convex, (0.5, -0.5), SlideSettings(step=done.pretravel[0] / 9.5, steps=10))
    found = reported.positions + (3.0 - history.trigger_feed) * -local.normal
    assert found == pytest.approx(local.point, abs=1e-6)
    assert history.trigger_feed == pytest.approx(done.pretravel[0], abs=1e-6)
    # The stylus is deflected across its axis only, and the ball touches where it has slid to.
    center = reported.positions + done.deflection
    assert done.deflection[0, 2] == pytest.approx(0.0, abs=1e-12)
    assert center - 3.0 * done.normal == pytest.approx(done.point, abs=1e-9)
    assert np.linalg.norm(done.point - local.point) > 1e-4


@pytest.mark.published("Rodrigues 2021", "Figures 3.1 to 3.15")
@pytest.mark.parametrize("polar_deg", [40.0, 70.0, 90.0])
@pytest.mark.parametrize("process", ["curved", "inclined"])
def test_force_along_a_slide_is_that_of_the_cantilever(polar_deg: float, process: str) -> None:
    """The existing method of the thesis: F sin(polar) = 3 E I d / L³, on a plane of any slope; the
    feed is d sin(polar). E, I and L are those of the description."""
    probe = load_probe("omp40-2").with_lever(50.0)
    sine = math.sin(math.radians(polar_deg))
    inertia = math.pi * 4.5**4 / 64.0
    step = 0.05 if process == "inclined" else 0.0002
    history = slide(
        predicted_tip(probe, "shen"),
        parse_surface(f"plane:polar={polar_deg:g},azimuth=25"),
        (0.0, 0.0),
        SlideSettings(step=step, steps=6, process=process),
    )
    below = ~history.triggered
    assert below.sum() >= 3
    stiffness = 3.0 * probe.stem.material.youngs_modulus * inertia / 50.0**3
    expected = stiffness * history.deflection[below] / sine
    assert history.force[below] == pytest.approx(expected, rel=1e-9)
    assert history.feed == pytest.approx(history.deflection * sine, rel=1e-9)


def test_force_along_a_slide_with_a_tilted_probe(tip: PredictedTip) -> None:
    """The force of a step, put on the tip, deflects it across the axis by the step's deflection:
    the cross product with the axis is the part across it."""
    axis = np.array([0.0, 0.6, 0.8])
    tilted = tip.turned(np.array([[1.0, 0, 0], [0, 0.8, 0.6], [0, -0.6, 0.8]]))
    assert tilted.rotation[:, 2] == pytest.approx(axis)
    surface = parse_surface("plane:polar=80,azimuth=60")
    history = slide(tilted, surface, (0.0, 0.0), SlideSettings(step=0.0005, steps=6))
    normal = surface.local(np.zeros((1, 2))).normal
    for force, deflection in zip(history.force, history.deflection, strict=True):
        moved = np.cross(axis, tilted.deflection(normal, force)[0])
        assert math.hypot(*moved) == pytest.approx(deflection, rel=1e-9)
