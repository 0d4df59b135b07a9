"""The stylus-tip offset against the same least squares in complex numbers, and its limits.

The machine reports the axis of the spindle. In the plane across it a point is a complex number,
and a turn by the angle a is the factor exp(i a): with the tip at o exp(i a) beside the axis, a ball
of radius r that touches a circle of radius R around c along n is reported at c + (R + r) n -
o exp(i a). Circles are fitted by scipy.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.files.several_files import read_series
from pretravel.laboratory.standards.iso230_10_tip_offset import check_tip_offset
from pretravel.laboratory.standards.standard_check import CalibratedSphere, StandardCheck
from pretravel.laboratory.standards.tip_offset import fit_tip_offset, turns_the_other_way
from pretravel.laboratory.tasks.check.picture import check_view
from pretravel.laboratory.tasks.check.report import standards_document
from pretravel.show.chart import PlaneChart
from pretravel.show.chart_marks import Dots
from pretravel.touches import Touches

UM = 1e-3
SPHERE = CalibratedSphere(25.0)
AZIMUTH = np.radians([3.0, 40.0, 75.0, 100.0, 160.0, 200.0, 260.0, 310.0, 340.0])
TURNS = np.radians([10.0, 95.0, 200.0])
PLACE = np.array([10.0, -20.0])
OFFSET = (4.0 - 3.0j) * UM


def _ring(azimuth: FloatArray = AZIMUTH, polar: float = 90.0) -> FloatArray:
    return from_angles(np.full(len(azimuth), math.radians(polar)), azimuth)


def _touched(places: FloatArray, turns: FloatArray = TURNS) -> Touches:
    """Touches at places (runs, orientations, directions, 2), in the order of a machine's log."""
    runs, count, directions, _ = places.shape
    positions = np.concatenate([places.reshape(-1, 2), np.full((places.size // 2, 1), 30.0)], 1)
    spindle = np.tile(np.repeat(turns, directions), runs)
    return Touches(positions, np.tile(_ring(), (runs * count, 1)), spindle=spindle)


def _made(
    runs: int = 1, *, turns: FloatArray = TURNS, moving: float = 0.0, wandering: float = 0.0,
    noise: float = 0.0, seed: int = 7,
) -> FloatArray:  # fmt: skip
    """Places with an offset that differs from run to run, and a spindle's axis that wanders."""
    rng = np.random.default_rng(seed)
    offset = OFFSET + moving * UM * rng.standard_normal((runs, 2)) @ [1.0, 1.0j]
    wander = wandering * UM * rng.standard_normal((len(turns), 2)) @ [1.0, 1.0j]
    radius = 15.5 + noise * UM * rng.standard_normal((runs, len(turns), len(AZIMUTH)))
    found = radius * np.exp(1j * AZIMUTH) + wander[:, None]
    found -= (offset[:, None] * np.exp(1j * turns))[:, :, None]
    return np.stack([found.real, found.imag], axis=-1) + PLACE


def _circle(points: FloatArray) -> tuple[complex, float, FloatArray, FloatArray]:
    """Centre, radius, residuals, and covariance of the centre per unit variance."""
    middle = points.mean(axis=0)

    def off(p: FloatArray) -> FloatArray:
        return np.hypot(*(points - middle - p[:2]).T) - p[2]

    found = least_squares(off, [0.0, 0.0, 15.0], x_scale=[1.0, 1.0, 1.0], xtol=1e-15, ftol=1e-15)
    x, y = middle + found.x[:2]
    outward = (points - [x, y]) / np.hypot(*(points - [x, y]).T)[:, None]
    design = np.column_stack([outward, np.ones(len(points))])
    return complex(x, y), found.x[2], found.fun, np.linalg.inv(design.T @ design)[:2, :2]


def _offset(centers: np.ndarray) -> complex:
    """Least squares of centre = place - offset exp(i a)."""
    design = np.column_stack([np.ones(len(TURNS)), -np.exp(1j * TURNS)])
    return complex(np.linalg.lstsq(design, centers, rcond=None)[0][1])


def _carried(of_centers: list[FloatArray]) -> FloatArray:
    """Covariance of the offset: complex weights as matrices [[re, -im], [im, re]]."""
    design = np.column_stack([np.ones(len(TURNS)), -np.exp(1j * TURNS)])
    weights = np.linalg.inv(design.conj().T @ design) @ design.conj().T
    total = np.zeros((2, 2))
    for weight, covariance in zip(weights[1], of_centers, strict=True):
        turn = np.array([[weight.real, -weight.imag], [weight.imag, weight.real]])
        total += turn @ covariance @ turn.T
    return total


def _sources(places: FloatArray) -> dict[str, tuple[FloatArray, float]]:
    """Covariance and degrees of freedom of each source, from the definitions."""
    runs, count, directions, _ = places.shape
    means = places.mean(axis=0)
    circles = [_circle(points) for points in means]
    centers = np.array([center for center, *_ in circles])
    if runs > 1:
        parts = []
        for k, points in enumerate(means):
            outward = points - [centers[k].real, centers[k].imag]
            outward /= np.hypot(*outward.T)[:, None]
            parts.append(np.einsum("rdx,dx->rd", places[:, k] - points, outward))
        squares, dof = np.sum(np.square(parts)), (runs - 1) * count * directions
    else:
        squares = sum(np.sum(residuals**2) for _, _, residuals, _ in circles)
        dof = count * (directions - 3)
    of_centers = [squares / dof / runs * cofactor for *_, cofactor in circles]
    touches = _carried(of_centers)
    design = np.column_stack([np.ones(count), -np.exp(1j * TURNS)])
    left = np.linalg.lstsq(design, centers, rcond=None)[1][0]
    mean = np.mean([np.trace(single) for single in of_centers]) / 2.0
    beyond = max(left / (2 * count - 4) - mean, 0.0)
    sources = {
        "scatter of the touches": (touches, float(dof)),
        "what does not turn with the spindle": (
            _carried([beyond * np.eye(2)] * count),
            2.0 * count - 4.0,
        ),
    }
    if runs > 1:
        offsets = np.array([_offset(np.array([_circle(p)[0] for p in run])) for run in places])
        spread = 0.5 * (np.var(offsets.real, ddof=1) + np.var(offsets.imag, ddof=1)) / runs
        more = max(spread - 0.5 * np.trace(touches), 0.0)
        sources["differences between the runs"] = (more * np.eye(2), 2.0 * (runs - 1))
    return sources


def _check_components(check: StandardCheck, sources: dict[str, tuple[FloatArray, float]]) -> None:
    x, y, size, run_out = check.figures[:4]
    towards = np.array([x.value, y.value]) / math.hypot(x.value, y.value)
    for figure, along in ((x, [1, 0]), (y, [0, 1]), (size, towards), (run_out, 2.0 * towards)):
        assert [part.name for part in figure.components] == list(sources)
        for part, (covariance, dof) in zip(figure.components, sources.values(), strict=True):
            expected = math.sqrt(np.asarray(along) @ covariance @ along)
            assert part.standard_uncertainty == pytest.approx(expected, rel=1e-5, abs=1e-12)
            assert part.dof == dof
            assert part.evaluation == "A"
        squares = sum(part.standard_uncertainty**2 for part in figure.components)
        assert figure.u_test == pytest.approx(math.sqrt(squares), rel=1e-12)
        assert figure.u_source == "the touches"
        assert figure.status == "unchecked"


@pytest.mark.parametrize(
    ("runs", "moving", "wandering", "noise"),
    [(1, 0.0, 2.0, 0.3), (3, 1.0, 2.0, 0.3), (2, 0.0, 0.0, 0.5), (4, 0.8, 0.0, 0.2)],
)
def test_all_figures_are_those_of_complex_numbers(
    runs: int, moving: float, wandering: float, noise: float
) -> None:
    """Three orientations at unequal angles, nine directions at unequal azimuths."""
    places = _made(runs, moving=moving, wandering=wandering, noise=noise)
    check = check_tip_offset(
        _touched(places), SPHERE, tip_diameter=6.0, limits={"offset": 7 * UM, "repeatability": UM}
    )
    circles = [_circle(points) for points in places.mean(axis=0)]
    offset = _offset(np.array([center for center, *_ in circles]))
    values = [figure.value for figure in check.figures[:4]]
    expected = [offset.real, offset.imag, abs(offset), 2.0 * abs(offset)]
    assert values == pytest.approx(expected, rel=1e-7)
    assert [figure.limit for figure in check.figures[:4]] == [None, None, 7 * UM, None]
    _check_components(check, _sources(places))
    if runs > 1:
        offsets = np.array([_offset(np.array([_circle(p)[0] for p in run])) for run in places])
        last = check.figures[4]
        largest = max(np.ptp(offsets.real), np.ptp(offsets.imag))
        assert last.value == pytest.approx(largest, rel=1e-6)
        assert (last.u_test, last.limit, last.u_source) == (0.0, UM, "")
    assert len(check.figures) == 4 + (runs > 1)
    for some, circle, points, turn in zip(
        check.sets, circles, places.mean(axis=0), TURNS, strict=True
    ):
        assert some.name == f"spindle at {math.degrees(turn):g}°"
        assert some.places == pytest.approx(points, abs=1e-12)
        assert some.frame == "probe"
        assert some.fit.radius == pytest.approx(circle[1], rel=1e-9)
    assert check.notes == ()


@pytest.mark.parametrize("runs", [1, 3])
def test_the_uncertainty_covers_noise(runs: int) -> None:
    """Mean of (error/u)² over 40 machines with noise alone, half a turn apart."""
    squares, turns = [], np.array([0.0, math.pi])
    for seed in range(40):
        places = _made(runs, turns=turns, noise=0.5, seed=seed)
        x, y = check_tip_offset(_touched(places, turns), SPHERE).figures[:2]
        for figure, true in ((x, OFFSET.real), (y, OFFSET.imag)):
            assert figure.u_test is not None
            squares.append(((figure.value - true) / figure.u_test) ** 2)
    # 80 squares of a normal variable have a mean of 1 ± 0.16. What exceeds the noise by chance is
    # added, so that u is somewhat large; with 12 degrees of freedom squares have a mean of 1.2.
    assert 0.5 < np.mean(squares) < 1.7


def test_the_uncertainty_covers_lobes_at_unequal_steps() -> None:
    """Three lobes of 2.5 µm with any phase, at nine directions that are not equally spaced, half a
    turn apart, with repeats that agree within 0.1 µm: these alone gave u of 0.03 µm."""
    squares, turns = [], np.array([0.0, math.pi])
    for phase in np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False):
        lobes = 2.5 * UM * np.cos(3.0 * (AZIMUTH - turns[:, None]) + phase)
        places = _made(3, turns=turns, noise=0.1, seed=int(9 * phase))
        places += lobes[..., None] * np.column_stack([np.cos(AZIMUTH), np.sin(AZIMUTH)])
        x, y = check_tip_offset(_touched(places, turns), SPHERE).figures[:2]
        assert "lobes, at unequal steps" in [part.name for part in x.components]
        for figure, true in ((x, OFFSET.real), (y, OFFSET.imag)):
            squares.append(((figure.value - true) / (figure.u_test or 0.0)) ** 2)
    # Over all phases the mean of (error/u)² is 1, but for the residuals' share of the lobes.
    assert 0.5 < np.mean(squares) < 1.5


def test_lobes_that_twelve_directions_show_are_no_scatter() -> None:
    """Without repeats: three lobes of 2.5 µm and noise of 0.3 µm at equal steps, half a turn apart.
    u of each coordinate is 0.3 µm √(2 / 12) / √2; the lobes made it ten times as large."""
    rng, squares, turns = np.random.default_rng(5), [], np.array([0.0, math.pi])
    azimuth = 2.0 * np.pi * np.arange(12) / 12.0
    normals = _ring(azimuth)
    for _ in range(20):
        positions = []
        for turn in turns:
            off = 2.5 * np.cos(3.0 * (azimuth - turn)) + 0.3 * rng.standard_normal(12)
            shift = OFFSET * np.exp(1j * turn)
            positions.append(normals * (15.5 + UM * off)[:, None] - [shift.real, shift.imag, 0.0])
        touches = Touches(np.vstack(positions), np.tile(normals, (2, 1)), spindle=turns.repeat(12))
        x, y = check_tip_offset(touches, SPHERE).figures[:2]
        assert x.u_test == pytest.approx(0.3 * UM / math.sqrt(12.0), rel=0.6)
        for figure, true in ((x, OFFSET.real), (y, OFFSET.imag)):
            squares.append(((figure.value - true) / (figure.u_test or 0.0)) ** 2)
    # 40 squares with ten degrees of freedom: 1.25 ± 0.35.
    assert 0.5 < np.mean(squares) < 2.3


def test_no_offset_is_not_along_anything() -> None:
    """Touches on the axes: sums of ones and zeros, so that the offset is exactly zero."""
    normals = np.tile(np.vstack([np.eye(3)[:2], -np.eye(3)[:2]]), (2, 1))
    spindle = np.repeat([0.0, math.pi], 4)
    touches = Touches(16.0 * normals, normals, spindle=spindle)
    found = check_tip_offset(touches, SPHERE, tip_diameter=7.0)
    assert [figure.value for figure in found.figures] == [0.0] * 4
    assert [figure.u_test for figure in found.figures] == pytest.approx([0.0] * 4, abs=1e-12)


def test_a_horizontal_spindle() -> None:
    laid = probe_rotation((0.0, 1.0, 0.0)).T
    upright = _touched(_made())
    touches = Touches(upright.positions @ laid, upright.normals @ laid, spindle=upright.spindle)
    x, y = check_tip_offset(touches, SPHERE, axis=(0.0, 1.0, 0.0)).figures[:2]
    assert (x.value, y.value) == pytest.approx((4.0 * UM, -3.0 * UM))


def test_the_picture_has_the_tip_at_each_orientation() -> None:
    """The spindle's quarter turns take (4, -3) to (3, 4), (-4, 3), (-3, -4)."""
    quarters = 0.5 * math.pi * np.arange(4)
    check = check_tip_offset(_touched(_made(turns=quarters), quarters), SPHERE)
    place = check_view(check).charts[0]
    assert isinstance(place, PlaneChart)
    (dots,) = (mark for mark in place.marks if isinstance(mark, Dots))
    assert dots.x == pytest.approx([4.0, 3.0, -4.0, -3.0])
    assert dots.y == pytest.approx([-3.0, 4.0, 3.0, -4.0])
    assert "not a statement of conformity" in standards_document(check).verdict


class TestOrientations:
    @staticmethod
    def _check(*degrees: float) -> StandardCheck:
        turns = np.radians(degrees)
        return check_tip_offset(_touched(_made(turns=turns), turns), SPHERE)

    @pytest.mark.parametrize(
        ("degrees", "found"),
        [
            pytest.param((-90.0, 450.25, 180.37), [90.25, 180.37, 270.0], id="counted in a turn"),
            pytest.param((0.0, 90.01, 90.03, 180.0), [0.0, 90.01, 90.03, 180.0], id="a hundredth"),
            pytest.param(
                (359.996, 0.004, 180.004, 179.996, 0.0, 180.0), [0.0, 180.0], id="closer are one"
            ),
        ],
    )
    def test_are_those_of_the_spindle(self, degrees: tuple[float, ...], found: list[float]) -> None:
        check = self._check(*degrees)
        assert check.tip_offset is not None
        assert np.degrees(check.tip_offset.angles) == pytest.approx(found, abs=1e-9)

    @pytest.mark.parametrize(
        ("degrees", "alone"), [((0, 180), True), ((0, 120, 240), False), ((0, 90, 180), False)]
    )
    def test_what_they_cannot_tell_is_noted(self, degrees: tuple[float, ...], alone: bool) -> None:
        notes = self._check(*degrees).notes
        words = "two orientations do not check the offset"
        assert any(words in note for note in notes) == alone
        turns = np.radians(degrees)
        clockwise = _touched(_made(turns=turns), -turns)
        told = check_tip_offset(clockwise, SPHERE).notes
        assert any("other way" in note for note in told) != alone
        assert not any("other way" in note for note in notes)

    @pytest.mark.parametrize(("degrees", "enough"), [(29.9, False), (30.1, True), (330.1, False)])
    def test_are_30_degrees_apart_at_least(self, degrees: float, enough: bool) -> None:
        angles = np.radians([0.0, degrees])
        if enough:
            assert fit_tip_offset(angles, np.zeros((2, 2))).offset.tolist() == [0.0, 0.0]
            return
        with pytest.raises(PretravelError, match="at 2 orientations of the spindle within 30°"):
            fit_tip_offset(angles, np.zeros((2, 2)))

    def test_one_is_refused_in_the_singular(self) -> None:
        with pytest.raises(PretravelError, match="at 1 orientation of the spindle within 30°"):
            fit_tip_offset(np.array([0.3]), np.zeros((1, 2)))
        with pytest.raises(PretravelError, match="at 0 orientation of the spindle"):
            fit_tip_offset(np.zeros(0), np.zeros((0, 2)))
        with pytest.raises(PretravelError, match="column spindle_deg"):
            check_tip_offset(Touches(_ring() * 15.5, _ring()), SPHERE)


class TestDirections:
    TWO = np.array([0.0, math.pi])

    def _check(self, first: FloatArray, second: FloatArray) -> StandardCheck:
        """Of normals at two half turns, with an offset of 5 µm along x."""
        normals = np.vstack([first, second])
        spindle = np.repeat(self.TWO, [len(first), len(second)])
        positions = 15.5 * normals - 5.0 * UM * np.cos(spindle)[:, None] * [1.0, 0.0, 0.0]
        return check_tip_offset(Touches(positions, normals, spindle=spindle), SPHERE)

    def test_are_the_same_within_two_degrees(self) -> None:
        for apart in (1.9, -1.9):
            found = self._check(_ring(), _ring(AZIMUTH + math.radians(apart)))
            assert found.figures[0].value == pytest.approx(5.0 * UM, rel=1e-3)
            assert not any("no partner" in note for note in found.notes)
        steep = _ring(AZIMUTH, 30.0)
        for first, second in ((_ring(), _ring(AZIMUTH + math.radians(2.1))), (steep, steep)):
            with pytest.raises(PretravelError, match=r"^0 directions across the axis"):
                self._check(first, second)

    def test_a_touch_keeps_its_first_direction(self) -> None:
        """1.5° beyond the first touch and before the third, which is another direction: of the
        directions at 0° the first touch stays."""
        first = np.append(AZIMUTH, AZIMUTH[0] + math.radians(3.0))
        second = AZIMUTH + math.radians(1.5) * (np.arange(9) == 0)
        found = self._check(_ring(first), _ring(second))
        assert any(note.startswith("1 touches have no partner") for note in found.notes)
        expected = 15.5 * _ring()[:, :2] - [5.0 * UM, 0.0]
        assert found.sets[0].places == pytest.approx(expected, abs=1e-9)

    def test_within_five_degrees_of_the_equator_count(self) -> None:
        for polar in (85.1, 94.9):
            steep = _ring(np.radians([20.0]), polar)
            normals = np.vstack([_ring(), steep])
            assert len(self._check(normals, normals).sets[0].places) == 10
        for polar in (84.9, 95.1):
            steep = _ring(np.radians([20.0, 130.0]), polar)
            found = self._check(np.vstack([_ring(), steep]), np.vstack([_ring(), steep]))
            assert len(found.sets[0].places) == 9
            assert "4 touches off the equator are not used" in found.notes

    @pytest.mark.parametrize(("count", "told"), [(4, True), (7, True), (8, False), (9, False)])
    def test_four_are_needed_and_eight_are_enough(self, count: int, told: bool) -> None:
        found = self._check(_ring(AZIMUTH[:count]), _ring(AZIMUTH[:count]))
        assert any(note.startswith(f"with {count} directions") for note in found.notes) == told
        with pytest.raises(PretravelError, match=r"^3 directions .* each of the 2 orient.* 4 are"):
            self._check(_ring(AZIMUTH[:3]), _ring())

    def test_without_partners_are_told(self) -> None:
        """Nine at one orientation, seven of them at the other, and one direction twice there: two
        directions and a repeat have no partner."""
        twice = AZIMUTH[[0, 1, 2, 3, 4, 5, 6, 3]]
        found = self._check(_ring(), _ring(twice))
        assert any(note.startswith("3 touches have no partner") for note in found.notes)
        assert len(found.sets[0].places) == 7
        assert found.figures[0].value == pytest.approx(5.0 * UM, rel=1e-6)

    @pytest.mark.parametrize("ring", [False, True])
    @pytest.mark.parametrize("off", [0.9, -0.9, 1.1, -1.1])
    def test_the_diameter_of_every_circle_is_checked(self, ring: bool, off: float) -> None:
        """A tip of 6 mm on a sphere of 25 mm: circles of 31 mm, 1 mm more or less is refused; in a
        ring of 19 mm. The second circle alone is off."""
        radius = 0.5 * (np.array([[0.0], [off]]) + (19.0 if ring else 31.0))
        normals = np.tile(_ring(), (2, 1))
        positions = np.repeat(radius, len(AZIMUTH), axis=0) * normals
        touches = Touches(
            positions, -normals if ring else normals, spindle=np.repeat([0.0, 3.0], 9)
        )
        assert len(check_tip_offset(touches, SPHERE).sets) == 2
        if abs(off) < 1.0:
            assert check_tip_offset(touches, SPHERE, tip_diameter=6.0).figures
            return
        with pytest.raises(PretravelError, match=rf"diameter of {25.0 + off:.4f} mm, not of"):
            check_tip_offset(touches, SPHERE, tip_diameter=6.0)


def test_covariance_of_each_centre_is_carried() -> None:
    """The offset is linear in the centres: its change by a unit of each coordinate is a column."""
    rng = np.random.default_rng(3)
    centers = rng.standard_normal((3, 2))
    found = fit_tip_offset(TURNS, centers)
    steps = np.eye(6).reshape(6, 3, 2)
    columns = [fit_tip_offset(TURNS, centers + step).offset - found.offset for step in steps]
    change = np.array(columns).T.reshape(2, 3, 2)
    roots = rng.standard_normal((3, 2, 2))
    of_centers = [root @ root.T for root in roots]
    expected = sum(change[:, k] @ of_centers[k] @ change[:, k].T for k in range(3))
    assert found.covariance(of_centers) == pytest.approx(expected, rel=1e-9)
    assert found.dof == 2
    assert found.size == pytest.approx(float(np.linalg.norm(found.offset)), rel=1e-12)
    assert found.angles == pytest.approx(TURNS)
    assert found.centers == pytest.approx(centers)
    angles = np.exp(1j * TURNS)
    offset, place = found.offset @ [1.0, 1.0j], found.place @ [1.0, 1.0j]
    left = centers @ [1.0, 1.0j] - (place - offset * angles)
    assert found.residuals @ [1.0, 1.0j] == pytest.approx(left, abs=1e-12)
    assert abs(left.sum()) == pytest.approx(0.0, abs=1e-12)
    assert abs((left * angles.conj()).sum()) == pytest.approx(0.0, abs=1e-12)


class TestClockwise:
    @pytest.mark.parametrize("size", [1e-4, 3.0])
    @pytest.mark.parametrize(("apart", "told"), [(1.3, False), (1.6, True)])
    def test_is_told_at_a_tenth_of_the_size(self, size: float, apart: float, told: bool) -> None:
        """Orientations at ±e and 180° ± e, an offset s that turns clockwise. In the complex plane
        the centres are ∓s exp(-i a), the best offset counter-clockwise is s cos 2e, and the root of
        the sum of squares that it leaves 2 s sin 2e: a tenth of s at e = 1.43°."""
        angles = np.radians([-apart, apart, 180.0 - apart, 180.0 + apart])
        centers = -size * np.column_stack([np.cos(angles), -np.sin(angles)])
        found = fit_tip_offset(angles, centers)
        left = 2.0 * size * math.sin(2.0 * math.radians(apart))
        assert math.sqrt(float(np.sum(found.residuals**2))) == pytest.approx(left, rel=1e-9)
        assert turns_the_other_way(found) is told

    @pytest.mark.parametrize(("beside", "told"), [(0.98, True), (1.02, False)])
    def test_is_told_by_nine_times_the_squares(self, beside: float, told: bool) -> None:
        """At quarter turns exp(-i a) and exp(2 i a) are at right angles to all that turns rightly:
        the former leaves 4 s², the latter 4 t² with either sense. (s² + t²) / t² is 9 at
        t = s / √8."""
        angles = 0.5 * math.pi * np.arange(4)
        off = np.exp(-1j * angles) + beside / math.sqrt(8.0) * np.exp(2j * angles)
        centers = 1e-3 * np.column_stack([off.real, off.imag])
        assert turns_the_other_way(fit_tip_offset(angles, centers)) is told

    def test_two_orientations_cannot_tell_it(self) -> None:
        """0° and 90°: any two centres fit, with either sense."""
        angles = np.array([0.0, 0.5 * math.pi])
        found = fit_tip_offset(angles, np.array([[0.0, 1.0], [3.0, 2.0]]))
        assert found.dof == 0
        assert not turns_the_other_way(found)
        assert np.abs(found.residuals).max() < 1e-12


def test_orientations_in_another_order_than_the_names_are_refused(tmp_path: Path) -> None:
    """The offset would have the other sign."""
    paths = [tmp_path / "at_180.csv", tmp_path / "at_000.csv"]
    for path in paths:
        path.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n1,0,0,1,0,0\n0,1,0,0,1,0\n-1,0,0.1,-1,0,0\n")
    read_series(paths, spindle=[math.pi, 0.0])
    with pytest.raises(PretravelError, match=r"at_180\.csv is given the orientation 0°"):
        read_series(paths, spindle=[0.0, math.pi])
