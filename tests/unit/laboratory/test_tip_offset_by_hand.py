"""The stylus-tip offset against the same least squares in complex numbers, and its limits.

In the plane across the spindle's axis a point is a complex number, and a turn by the angle a is the
factor exp(i a). Circles are fitted by scipy.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.laboratory.iso230_10_tip_offset import _circles, _figures, check_tip_offset
from pretravel.laboratory.standard_check import CalibratedSphere, StandardCheck
from pretravel.laboratory.tip_offset import fit_tip_offset, turns_the_other_way
from pretravel.touches import Touches

UM = 1e-3
SPHERE = CalibratedSphere(25.0)
AZIMUTH = np.radians([3.0, 40.0, 75.0, 100.0, 160.0, 200.0, 260.0, 310.0, 340.0])
TURNS = np.radians([10.0, 95.0, 200.0])
PLACE = np.array([10.0, -20.0])


def _ring(azimuth: FloatArray = AZIMUTH, polar: float = 90.0) -> FloatArray:
    return from_angles(np.full(len(azimuth), math.radians(polar)), azimuth)


def _touched(places: FloatArray, turns: FloatArray = TURNS) -> Touches:
    """Touches at places (runs, orientations, directions, 2), in the order of a machine's log."""
    runs, count, directions, _ = places.shape
    positions = np.concatenate([places.reshape(-1, 2), np.full((places.size // 2, 1), 30.0)], 1)
    spindle = np.tile(np.repeat(turns, directions), runs)
    return Touches(positions, np.tile(_ring(), (runs * count, 1)), spindle=spindle)


def _made(runs: int, moving: float, wandering: float, noise: float) -> FloatArray:
    """Places with an offset that differs from run to run, and a spindle's axis that wanders."""
    rng = np.random.default_rng(7)
    offset = (4.0 - 3.0j) * UM + moving * UM * rng.standard_normal((runs, 2)) @ [1.0, 1.0j]
    wander = wandering * UM * rng.standard_normal((len(TURNS), 2)) @ [1.0, 1.0j]
    radius = 15.5 + noise * UM * rng.standard_normal((runs, len(TURNS), len(AZIMUTH)))
    found = radius * np.exp(1j * AZIMUTH) + wander[:, None]
    found -= (offset[:, None] * np.exp(1j * TURNS))[:, :, None]
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
    places = _made(runs, moving, wandering, noise)
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


def test_the_mean_offset_is_between_the_runs() -> None:
    """Without noise, tips at 4 and 6 µm: 5 µm, a range of 2 µm in x and of 4 µm in y."""
    circle = 15.5 * np.exp(1j * AZIMUTH)
    places = [
        [circle - offset * UM * np.exp(1j * a) for a in TURNS] for offset in (4.0 - 1.0j, 6.0 + 3j)
    ]
    check = check_tip_offset(_touched(np.stack([np.real(places), np.imag(places)], -1)), SPHERE)
    assert check.figures[0].value == pytest.approx(5.0 * UM, rel=1e-6)
    assert check.figures[4].value == pytest.approx(4.0 * UM, rel=1e-6)
    # Variances of the runs 2 and 8 µm², of the mean of two 1 and 4 µm²; a part of them is in the
    # scatter of the touches, and nothing is there that does not turn.
    total = sum((figure.u_test or 0.0) ** 2 for figure in check.figures[:2])
    assert total == pytest.approx(5.0 * UM**2, rel=1e-5)


def test_no_offset_is_not_along_anything() -> None:
    circle = np.stack([15.5 * np.cos(AZIMUTH), 15.5 * np.sin(AZIMUTH)], axis=-1)
    touches = _touched(np.tile(circle, (1, 3, 1, 1)))
    check = check_tip_offset(touches, SPHERE)
    assert [figure.value for figure in check.figures] == pytest.approx([0.0] * 4, abs=1e-12)
    none = fit_tip_offset(TURNS, np.zeros((3, 2)))
    for figure in _figures(_circles(touches, (0.0, 0.0, 1.0))[0], none, {}):
        assert figure.value == 0.0
        assert figure.u_test == pytest.approx(0.0, abs=1e-12)


class TestOrientations:
    @staticmethod
    def _angles(*degrees: float) -> FloatArray:
        """Orientations that are found in touches at these."""
        turns = np.radians(degrees)
        circle = 15.5 * np.exp(1j * AZIMUTH) - 5.0 * UM * np.exp(1j * turns)[:, None]
        places = np.stack([circle.real, circle.imag], axis=-1)[None]
        check = check_tip_offset(_touched(places, turns), SPHERE)
        assert check.tip_offset is not None
        return np.degrees(check.tip_offset.angles)

    def test_are_counted_in_a_turn(self) -> None:
        assert self._angles(-90.0, 450.25, 180.37) == pytest.approx([90.25, 180.37, 270.0])

    def test_of_a_hundredth_of_a_degree_are_two(self) -> None:
        found = self._angles(0.0, 90.01, 90.03, 180.0)
        assert found == pytest.approx([0.0, 90.01, 90.03, 180.0], abs=1e-9)

    def test_closer_ones_are_one(self) -> None:
        """Also where one is before a whole turn and the other beyond it."""
        found = self._angles(359.996, 0.004, 180.004, 179.996, 0.0, 180.0)
        assert found == pytest.approx([0.0, 180.0], abs=1e-9)


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
        with pytest.raises(PretravelError, match=r"^0 directions across the axis"):
            self._check(_ring(), _ring(AZIMUTH + math.radians(2.1)))

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
            assert "4 touches beside the equator are not used" in found.notes

    @pytest.mark.parametrize(("count", "told"), [(4, True), (7, True), (8, False), (9, False)])
    def test_four_are_needed_and_eight_are_enough(self, count: int, told: bool) -> None:
        found = self._check(_ring(AZIMUTH[:count]), _ring(AZIMUTH[:count]))
        assert any(note.startswith(f"with {count} directions") for note in found.notes) == told
        with pytest.raises(PretravelError, match=r"^3 directions .* each of the 2 orient"):
            self._check(_ring(AZIMUTH[:3]), _ring())

    def test_without_partners_are_told(self) -> None:
        """Nine at one orientation, seven of them at the other, and one direction twice there: two
        directions and a repeat have no partner."""
        twice = AZIMUTH[[0, 1, 2, 3, 4, 5, 6, 3]]
        found = self._check(_ring(), _ring(twice))
        assert any(note.startswith("3 touches have no partner") for note in found.notes)
        assert len(found.sets[0].places) == 7
        assert found.figures[0].value == pytest.approx(5.0 * UM, rel=1e-6)


def test_the_diameter_of_every_circle_is_checked() -> None:
    """A tip of 6 mm on a sphere of 25 mm: circles of 31 mm, 1 mm more or less is refused; in a
    ring of 19 mm. The second circle alone is off."""
    for ring in (False, True):
        for off, refused in ((0.9, False), (-0.9, False), (1.1, True), (-1.1, True)):
            radius = 0.5 * (np.array([[0.0], [off]]) + (19.0 if ring else 31.0))
            normals = np.tile(_ring(), (2, 1))
            positions = np.repeat(radius, len(AZIMUTH), axis=0) * normals
            touches = Touches(
                positions, -normals if ring else normals, spindle=np.repeat([0.0, 3.0], 9)
            )
            if not refused:
                assert len(check_tip_offset(touches, SPHERE, tip_diameter=6.0).sets) == 2
                continue
            with pytest.raises(PretravelError, match=rf"diameter of {25.0 + off:.4f} mm, not of"):
                check_tip_offset(touches, SPHERE, tip_diameter=6.0)
            assert check_tip_offset(touches, SPHERE).figures


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


@pytest.mark.parametrize(("beside", "told"), [(0.98, True), (1.02, False)])
def test_a_clockwise_offset_is_told_by_nine_times_the_squares(beside: float, told: bool) -> None:
    """At quarter turns exp(-i a) and exp(2 i a) are at right angles to all that turns rightly: the
    former leaves 4 s², the latter 4 t² with either sense. (s² + t²) / t² is 9 at t = s / √8."""
    angles = 0.5 * math.pi * np.arange(4)
    for size in (1e-3, 2.0):
        off = np.exp(-1j * angles) + beside / math.sqrt(8.0) * np.exp(2j * angles)
        centers = size * np.column_stack([off.real, off.imag])
        assert turns_the_other_way(fit_tip_offset(angles, centers)) is told


def test_two_orientations_cannot_tell_the_sense() -> None:
    """0° and 90°: any two centres fit, with either sense."""
    angles = np.array([0.0, 0.5 * math.pi])
    found = fit_tip_offset(angles, np.array([[0.0, 1.0], [3.0, 2.0]]))
    assert found.dof == 0
    assert not turns_the_other_way(found)
    assert np.abs(found.residuals).max() < 1e-12


def test_one_orientation_is_refused_in_the_singular() -> None:
    with pytest.raises(PretravelError, match="at 1 orientation of the spindle within 30°"):
        fit_tip_offset(np.array([0.3]), np.zeros((1, 2)))
    with pytest.raises(PretravelError, match="at 0 orientation of the spindle"):
        fit_tip_offset(np.zeros(0), np.zeros((0, 2)))
    with pytest.raises(PretravelError, match="at 3 orientations of the spindle"):
        fit_tip_offset(np.radians([350.0, 0.0, 15.0]), np.zeros((3, 2)))
