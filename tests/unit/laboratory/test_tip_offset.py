"""The stylus-tip offset: a simulated machine whose tip is beside the spindle's axis by a known way.

The machine reports the axis of the spindle. With the tip at R(a) e beside it, a ball of radius r
that touches a circle of radius R around c along the normal n is reported at c + (R + r) n - R(a) e.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.laboratory.iso230_10 import check_iso230_10, plane_pattern_36
from pretravel.laboratory.iso230_10_tip_offset import check_tip_offset
from pretravel.laboratory.standard_check import CalibratedSphere, LimitOutcome, StandardCheck
from pretravel.laboratory.tip_offset import fit_tip_offset, turns_the_other_way
from pretravel.show.chart import PlaneChart
from pretravel.show.chart_marks import Dots
from pretravel.tasks.reports.standards_report import check_view, standards_document
from pretravel.touches import Touches

UM = 1e-3
SPHERE = CalibratedSphere(25.0)
OFFSET = np.array([4.0, -3.0]) * UM
ALL = (0.0, 90.0, 180.0, 270.0)
N = plane_pattern_36()


def turn(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def touched(
    degrees: npt.ArrayLike,
    *,
    offset: FloatArray = OFFSET,
    normals: FloatArray = N,
    ring: bool = False,
    noise: float = 0.0,
    runs: int = 1,
    seed: int = 1,
) -> Touches:
    """Touches of the circle at each orientation, `runs` times, around (10, 20, 30)."""
    rng = np.random.default_rng(seed)
    positions, outward, spindle = [], [], []
    for angle in np.tile(np.radians(degrees), runs):
        off = np.append(turn(angle) @ offset, 0.0)
        distance = (12.5 - 3.0 if ring else 12.5 + 3.0) + noise * rng.standard_normal(len(normals))
        positions.append(normals * distance[:, None] - off)
        outward.append(-normals if ring else normals)
        spindle.append(np.full(len(normals), angle))
    return Touches(
        np.vstack(positions) + np.array([10.0, 20.0, 30.0]),
        np.vstack(outward),
        spindle=np.concatenate(spindle),
    )


def values(check: StandardCheck) -> dict[str, float]:
    return {figure.name: figure.value / UM for figure in check.figures}


@pytest.mark.parametrize("degrees", [(0, 180), (180, 0), (0, 120, 240), ALL, (0, 90), (30, 210)])
@pytest.mark.parametrize("ring", [False, True])
def test_a_known_offset_comes_back(degrees: tuple[float, ...], ring: bool) -> None:
    """4, -3 µm: the distance is 5 and the run-out of a whole turn 10, wherever the circle is."""
    found = values(check_tip_offset(touched(degrees, ring=ring), SPHERE, tip_diameter=6.0))
    assert found == pytest.approx(
        {"tip offset, x": 4.0, "tip offset, y": -3.0, "tip offset": 5.0, "run-out of the tip": 10.0}
    )


def test_a_horizontal_spindle() -> None:
    upright, axis = touched((0, 180)), (0.0, 1.0, 0.0)
    laid = probe_rotation(axis).T
    touches = Touches(upright.positions @ laid, upright.normals @ laid, spindle=upright.spindle)
    found = values(check_tip_offset(touches, SPHERE, axis=axis))
    assert (found["tip offset, x"], found["tip offset, y"]) == pytest.approx((4.0, -3.0))


def test_the_form_of_the_reference_cancels() -> None:
    """A ring with 3 µm of a first and third harmonic stays where it is; the probe turns."""
    azimuth = np.arange(36) * math.radians(10.0)
    form = 3.0 * UM * (np.cos(azimuth) + np.cos(3.0 * azimuth))
    touches = touched((0, 180))
    moved = touches.positions + np.tile(form, 2)[:, None] * touches.normals
    found = values(
        check_tip_offset(Touches(moved, touches.normals, spindle=touches.spindle), SPHERE)
    )
    # The fit of a circle is not linear: form times offset over radius is 1e-6 µm.
    assert found["tip offset, x"] == pytest.approx(4.0, abs=1e-5)
    assert found["tip offset, y"] == pytest.approx(-3.0, abs=1e-5)


def test_a_part_that_does_not_turn_is_stated() -> None:
    """The spindle's axis moves by 1 µm along x at 90°; closed form of the least squares: with
    R(90°)ᵀ d / 4 the offset takes -(0, -1) / 4 µm, and the residuals have 1 - 1/4 - 1/4 of d²."""
    touches = touched(ALL)
    moved = touches.positions.copy()
    moved[36:72, 0] += 1.0 * UM
    check = check_tip_offset(Touches(moved, touches.normals, spindle=touches.spindle), SPHERE)
    assert check.tip_offset is not None
    assert check.tip_offset.offset / UM == pytest.approx([4.0, -3.0 + 0.25])
    assert np.sum(check.tip_offset.residuals**2) / UM**2 == pytest.approx(0.5)
    # Four degrees of freedom: s² = 0.5 / 4, and an offset has the variance of a mean of four.
    (u,) = {round((figure.u_test or 0.0) / UM, 6) for figure in check.figures[:3]}
    assert u == pytest.approx(math.sqrt(0.5 / 4 / 4), rel=1e-3)
    assert {part.name for part in check.figures[0].components} >= {
        "what does not turn with the spindle"
    }


@pytest.mark.parametrize(("runs", "degrees"), [(1, (0, 180)), (3, (0, 180)), (2, ALL)])
def test_the_uncertainty_covers_noise(runs: int, degrees: tuple[float, ...]) -> None:
    """Mean of (error/u)² over 60 machines with noise alone; circles of 36 touches have
    var(centre) = σ² 2/36, which the orientations and runs divide."""
    squares, stated = [], []
    for seed in range(60):
        touches = touched(degrees, noise=0.5 * UM, runs=runs, seed=seed)
        x, y = check_tip_offset(touches, SPHERE).figures[:2]
        for figure, true in zip((x, y), OFFSET, strict=True):
            assert figure.u_test is not None
            squares.append(((figure.value - true) / figure.u_test) ** 2)
            stated.append(figure.u_test)
    wanted = 0.5 * UM * math.sqrt(2.0 / 36 / len(degrees) / runs)
    # What exceeds the noise by chance is added, which makes u up to a fifth larger.
    assert 0.95 * wanted < np.mean(stated) < 1.3 * wanted
    # 120 squares of a normal variable have a mean of 1 ± 0.13; u is somewhat large.
    assert 0.5 < np.mean(squares) < 1.3


def test_repeatability_is_the_range_over_the_runs() -> None:
    """The tip moves by 2 µm in x between two runs, such as after a change of the stylus. The runs
    have the variances 2 and 0 µm² in x and y, 1 on average, and their mean has half of it."""
    first, second = touched((0, 180)), touched((0, 180), offset=OFFSET + np.array([2.0 * UM, 0.0]))
    assert first.spindle is not None
    assert second.spindle is not None
    touches = Touches(
        np.vstack([first.positions, second.positions]),
        np.vstack([first.normals, second.normals]),
        spindle=np.concatenate([first.spindle, second.spindle]),
    )
    check = check_tip_offset(touches, SPHERE, limits={"repeatability": 1.5 * UM})
    found = values(check)
    assert found["tip offset, x"] == pytest.approx(5.0)
    assert found["repeatability of the offset"] == pytest.approx(2.0)
    assert check.figures[-1].outcome is LimitOutcome.EXCEEDS
    assert [figure.u_test for figure in check.figures[:2]] == pytest.approx([0.5**0.5 * UM] * 2)


@pytest.mark.parametrize(
    ("limit", "outcome"), [(4.0, LimitOutcome.EXCEEDS), (6.0, LimitOutcome.WITHIN)]
)
def test_a_limit_is_of_the_distance(limit: float, outcome: LimitOutcome) -> None:
    check = check_tip_offset(touched(ALL, noise=0.1 * UM), SPHERE, limits={"offset": limit * UM})
    limited = [figure for figure in check.figures if figure.limit is not None]
    assert [(figure.name, figure.outcome) for figure in limited] == [("tip offset", outcome)]
    assert "not been checked" in "; ".join(check.why_no_conformity)


def test_few_degrees_of_freedom_widen_the_zone() -> None:
    """Four touches at two orientations: two degrees of freedom, k = 4.53 (GUM, Table G.2)."""
    touches = touched((0, 180), normals=N[::9], noise=0.3 * UM)
    check = check_tip_offset(touches, SPHERE)
    assert check.figures[2].coverage == pytest.approx(4.53, abs=0.005)
    assert any("lobes" in note for note in check.notes)


def test_lobes_of_three_are_an_offset_of_four_touches_and_not_of_twelve() -> None:
    """cos 3φ is cos φ at 0, 90, 180, 270°: all of the lobes' 2 µm goes to the offset. Pretravel p
    is reported along -n, and the probe's lobes turn with it."""
    for count, wanted in ((4, 2.0), (12, 0.0)):
        normals = N[:: 36 // count]
        touches = touched((0, 180), normals=normals, offset=np.zeros(2))
        azimuth = np.arctan2(normals[:, 1], normals[:, 0])
        lobes = np.concatenate([2.0 * UM * np.cos(3.0 * (azimuth - a)) for a in (0.0, math.pi)])
        moved = touches.positions - lobes[:, None] * touches.normals
        check = check_tip_offset(Touches(moved, touches.normals, spindle=touches.spindle), SPHERE)
        # The shift of a reported centre by -2 µm is an offset of +2 µm.
        assert values(check)["tip offset, x"] == pytest.approx(wanted, abs=1e-3)


def test_angles_that_are_counted_clockwise_are_told() -> None:
    turned = touched(ALL)
    assert turned.spindle is not None
    wrong = Touches(turned.positions, turned.normals, spindle=-turned.spindle)
    assert any("other way" in note for note in check_tip_offset(wrong, SPHERE).notes)
    assert not any("other way" in note for note in check_tip_offset(turned, SPHERE).notes)


@pytest.mark.parametrize("size", [1e-4, 0.01, 3.0])
@pytest.mark.parametrize(("apart", "told"), [(1.3, False), (1.6, True)])
def test_a_clockwise_offset_is_told_at_a_tenth_of_its_size(
    size: float, apart: float, told: bool
) -> None:
    """Orientations at ±e and 180° ± e, an offset s that turns clockwise. In the complex plane the
    centres are ∓s exp(-i a), the best offset counter-clockwise is s cos 2e, and the root of the
    sum of squares that it leaves 2 s sin 2e. It is a tenth of s at e = 1.43°, whatever s is."""
    angles = np.radians([-apart, apart, 180.0 - apart, 180.0 + apart])
    centers = -size * np.column_stack([np.cos(angles), -np.sin(angles)])
    found = fit_tip_offset(angles, centers)
    left = 2.0 * size * math.sin(2.0 * math.radians(apart))
    assert math.sqrt(float(np.sum(found.residuals**2))) == pytest.approx(left, rel=1e-9)
    assert turns_the_other_way(found) is told


def test_what_cannot_be_compared_is_left_out_and_told() -> None:
    """A touch on top, and one that is lacking at the other orientation."""
    touches = touched((0, 180))
    kept = touches.take(np.arange(72) != 40)
    top = Touches(
        np.vstack([kept.positions, [10.0, 20.0, 45.5]]),
        np.vstack([kept.normals, [0.0, 0.0, 1.0]]),
        spindle=np.append(np.asarray(kept.spindle), 0.0),
    )
    check = check_tip_offset(top, SPHERE)
    assert values(check)["tip offset"] == pytest.approx(5.0)
    assert any(note.startswith("1 touches beside the equator") for note in check.notes)
    assert any(note.startswith("1 touches have no partner") for note in check.notes)


@pytest.mark.parametrize(
    ("touches", "words"),
    [
        (Touches(N * 15.5, N), "column spindle_deg"),
        (touched((0,)), "two that are apart"),
        (touched((0, 20)), "two that are apart"),
        (touched((0, 180), normals=N[::12]), "4 are needed"),
    ],
)
def test_errors_teach(touches: Touches, words: str) -> None:
    with pytest.raises(PretravelError, match=words):
        check_tip_offset(touches, SPHERE)


def test_a_wrong_tip_is_refused_in_a_ring() -> None:
    with pytest.raises(PretravelError, match=r"diameter of 29\.0000 mm, not of 25 mm"):
        check_tip_offset(touched((0, 180), ring=True), SPHERE, tip_diameter=10.0)


def test_other_tests_refuse_a_turned_spindle() -> None:
    with pytest.raises(PretravelError, match=r"2 orientations of the spindle \(0°, 180°\)"):
        check_iso230_10(touched((0, 180)), SPHERE)
    assert check_iso230_10(touched((90,)), SPHERE).figures


def test_the_picture_has_the_tip_at_each_orientation() -> None:
    check = check_tip_offset(touched(ALL), SPHERE)
    place = check_view(check).charts[0]
    assert isinstance(place, PlaneChart)
    (dots,) = (mark for mark in place.marks if isinstance(mark, Dots))
    # The spindle's quarter turns take (4, -3) to (3, 4), (-4, 3), (-3, -4).
    assert dots.x == pytest.approx([4.0, 3.0, -4.0, -3.0])
    assert dots.y == pytest.approx([-3.0, 4.0, 3.0, -4.0])
    assert "no statement of conformity" in standards_document(check).verdict


@pytest.mark.parametrize(("degrees", "enough"), [(29.9, False), (30.1, True), (330.1, False)])
def test_orientations_are_30_degrees_apart_at_least(degrees: float, enough: bool) -> None:
    angles = np.radians([0.0, degrees])
    if enough:
        assert fit_tip_offset(angles, np.zeros((2, 2))).offset.tolist() == [0.0, 0.0]
        return
    with pytest.raises(PretravelError, match="within 30°"):
        fit_tip_offset(angles, np.zeros((2, 2)))


def test_half_a_turn_apart_it_is_half_the_difference() -> None:
    found = fit_tip_offset(np.array([0.5, 0.5 + math.pi]), np.array([[1.0, 2.0], [3.0, 2.0]]))
    assert turn(0.5) @ found.offset == pytest.approx([1.0, 0.0])
    assert found.place == pytest.approx([2.0, 2.0])


def test_the_covariance_is_that_of_the_offset() -> None:
    """A quarter of a turn apart, with centres that are uncertain in x alone: the offset is
    (R - 1)⁻¹ (c(0°) - c(90°)) = -(x(0°) - x(90°)) (1, 1) / 2."""
    found = fit_tip_offset(np.array([0.0, 0.5 * math.pi]), np.zeros((2, 2)))
    assert found.covariance([np.diag([1.0, 0.0])] * 2) == pytest.approx(np.full((2, 2), 0.5))


@pytest.mark.parametrize(
    ("degrees", "noted"), [((0, 180), True), ((0, 120, 240), False), (ALL, False)]
)
def test_two_orientations_alone_are_noted(degrees: tuple[float, ...], noted: bool) -> None:
    notes = check_tip_offset(touched(degrees), CalibratedSphere(25.0), tip_diameter=6.0).notes
    assert any("two orientations leave nothing to compare" in note for note in notes) == noted


def test_touches_beside_the_equator_alone_are_refused() -> None:
    steep = touched((0, 180), normals=from_angles(0.5, np.radians(np.arange(0.0, 360.0, 10.0))))
    with pytest.raises(PretravelError, match=r"^0 directions across the axis were touched at each"):
        check_tip_offset(steep, CalibratedSphere(25.0), tip_diameter=6.0)


@pytest.mark.parametrize("offset", [(0.0, 5.0), (3.0, -4.0)])
def test_u_of_the_offset_is_that_along_it(offset: tuple[float, float]) -> None:
    """Directions about the x axis alone, at 0° and at half a turn: the centres are more
    certain along x than along y. The offset is half the difference of two circles: along a unit
    vector t its variance is s² tᵀ C t / 2, with s² from the repeats and C of a fitted circle."""
    normals = from_angles(0.5 * np.pi, np.radians([-60.0, -20.0, 10.0, 50.0, 130.0, 170.0]))
    made = touched((0, 180), offset=np.array(offset) * UM, normals=normals, noise=2e-5, runs=4)
    x, y, size, run_out, _ = check_tip_offset(made, CalibratedSphere(25.0)).figures
    places = np.round((made.positions - [10.0, 20.0, 30.0])[:, :2], 12).reshape(4, 2, 6, 2)
    outward = normals[:, :2]
    along = np.sum((places - places.mean(axis=0)) * outward, axis=-1)
    design = np.hstack([outward, np.ones((6, 1))])
    cofactor = np.linalg.inv(design.T @ design)[:2, :2]
    covariance = 0.5 * np.sum(along**2) / (3 * 2 * 6) / 4.0 * cofactor
    assert covariance[1, 1] != pytest.approx(covariance[0, 0], rel=0.1)
    towards = np.array([x.value, y.value]) / size.value
    shown = ((x, np.eye(2)[0], 1.0), (y, np.eye(2)[1], 1.0), (size, towards, 1.0))
    for figure, t, factor in (*shown, (run_out, towards, 2.0)):
        part = figure.components[0]
        expected = factor * math.sqrt(t @ covariance @ t)
        # Directions are those of the touches about the fitted circle, which noise moves.
        assert part.standard_uncertainty == pytest.approx(expected, rel=1e-3)
        assert part.dof == 36.0
    assert run_out.value == pytest.approx(2.0 * size.value, rel=1e-12)
    assert size.value == pytest.approx(math.hypot(x.value, y.value), rel=1e-12)
