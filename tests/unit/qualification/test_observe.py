"""Touches on a reference as they are observed; refusals from both sides of each limit."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles, ring_pattern, sphere_pattern_25
from pretravel.base.errors import ConvergenceError, PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification import observe as observing
from pretravel.qualification.observe import _numbered_cells, observe
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches
from tests.support.reference_touches import sphere_touches
from tests.support.simulated_probe import simulated_pretravel

SETUP = QualificationSetup(25.0, tip_diameter=6.0)
N = fibonacci_cap(25, np.radians(90.0))


def _touches(n: np.ndarray = N, pretravel: float = 0.01, radius: float = 15.5) -> Touches:
    """On a sphere about (10, 20, 30)."""
    return Touches(n * (radius - pretravel) + [10.0, 20.0, 30.0], n)


def _ring(pretravel: float = 0.01, count: int = 12, radius: float = 9.5) -> Touches:
    outward = from_angles(0.5 * np.pi, np.arange(count) * (2.0 * np.pi / count))
    return Touches(outward * (radius + pretravel), -outward)


def _told(touches: Touches, setup: QualificationSetup = SETUP) -> str:
    """The refusal, or nothing."""
    try:
        observe(touches, setup, np.eye(3))
    except PretravelError as error:
        return str(error)
    return ""


class TestStrays:
    FAR = "from the others, on a reference of 25 mm: its position is wrong"

    def _moved(self, rows: list[int], way: float) -> Touches:
        touches = _touches()
        positions = touches.positions.copy()
        middle = np.median(positions, axis=0)
        positions[rows] = middle
        positions[rows, 1] -= way
        return replace(touches, positions=positions)

    @pytest.mark.parametrize(("way", "far"), [(49.9, False), (50.1, True)])
    def test_a_stray_is_two_diameters_away(self, way: float, far: bool) -> None:
        told = _told(self._moved([20], way))
        assert (self.FAR in told) == far
        assert "are like that" not in told or not far
        if far:
            # The median moves with the stray, by less than the distance of two neighbours.
            said = re.match(r"touch 21 lies (\S+) mm", told)
            assert said is not None
            assert float(said[1]) == pytest.approx(way, abs=2.0)

    @pytest.mark.parametrize(("count", "few"), [(2, True), (5, True), (6, False)])
    def test_more_than_a_fifth_are_no_strays(self, count: int, few: bool) -> None:
        rows = [3, 6, 9, 12, 15, 18][:count]
        told = _told(self._moved(rows, 1000.0))
        assert told
        assert (self.FAR in told) == few
        assert told.startswith("touch 4 lies") == few
        assert (f"({count} touches are like that)" in told) == few


class TestFalseTrips:
    def _off(self, rows: list[int], way: float) -> Touches:
        touches = _touches(fibonacci_cap(40, np.radians(90.0)))
        positions = touches.positions.copy()
        for k, row in enumerate(rows):
            positions[row] += touches.normals[row] * way * (1.0 + 0.1 * k)
        return replace(touches, positions=positions)

    @pytest.mark.parametrize(("way", "side"), [(0.5, "outside"), (-0.5, "inside")])
    @pytest.mark.parametrize(("count", "few"), [(1, True), (3, True), (4, True), (5, False)])
    def test_a_tenth_at_most_are_false_trips(
        self, way: float, side: str, count: int, few: bool
    ) -> None:
        """The worst is named: the last, which is farthest off; the sphere follows it a little."""
        rows = [2, 11, 21, 30, 38][:count]
        told = _told(self._off(rows, way))
        assert ("a false trip" in told) == few
        if few:
            said = re.match(rf"touch {rows[-1] + 1} lies about (\S+) mm {side} the sphere", told)
            assert said is not None
            assert float(said[1]) == pytest.approx(abs(way) * (0.9 + 0.1 * count), rel=0.35)
            assert (f"({count} touches are like that)" in told) == (count > 1)

    @pytest.mark.parametrize("ring", [False, True])
    def test_no_pretravel_is_as_long_as_150_micrometres(self, ring: bool) -> None:
        """One of many: the fit follows it by three or four of as many parts."""
        count = 400
        n = fibonacci_cap(count, np.radians(100.0))
        for way, refused in ((0.145, False), (0.158, True)):
            touches = _ring(count=count) if ring else _touches(n)
            outward = -touches.normals if ring else touches.normals
            positions = touches.positions.copy()
            positions[7] += way * outward[7]
            told = _told(
                replace(touches, positions=positions), replace(SETUP, ring=ring, diameter=25.0)
            )
            assert ("a false trip" in told) == refused


@pytest.mark.parametrize("distance", [0.6, -0.6, 3.0])
@pytest.mark.parametrize("count", [4, 12, 48])
def test_one_false_trip_of_few_touches_is_named_with_its_distance(
    count: int, distance: float
) -> None:
    """Of a three-lobed probe. With 15 touches the last one pulled the sphere to itself: "check the
    diameter"."""
    n = ring_pattern(np.radians([0.0, 45.0, 90.0]), count)
    noise = np.random.default_rng(1).normal(0.0, 2e-4, len(n))
    for row in {0, len(n) // 2, len(n) - 1}:
        reach = 15.5 - simulated_pretravel(n) + noise
        reach[row] += distance
        side = "outside" if distance > 0.0 else "inside"
        words = (
            rf"touch {row + 1} lies about {abs(distance):.2f} mm {side} the sphere of the others"
        )
        assert words in _told(Touches(reach[:, None] * n, n))


@pytest.mark.parametrize(
    ("ring", "count", "words"),
    [
        (False, 4, "4 touches in 4 directions are too few"), (False, 5, ""),
        (True, 3, "a ring needs touches in at least 4 directions"), (True, 4, ""),
    ],
)  # fmt: skip
def test_the_fewest_directions(ring: bool, count: int, words: str) -> None:
    touches = _ring(count=count) if ring else _touches(fibonacci_cap(count, 1.3))
    told = _told(touches, replace(SETUP, ring=ring))
    assert words in told
    assert bool(told) == bool(words)


@pytest.mark.parametrize(("ratio", "plane"), [(0.0195, True), (0.0205, False)])
def test_the_spread_across_a_plane_is_a_fiftieth(ratio: float, plane: bool) -> None:
    """On two parallels at the heights ± h the spreads are sin h and √½ cos h."""
    height = np.arctan(ratio / np.sqrt(2.0)) * np.where(np.arange(24) % 2, 1.0, -1.0)
    n = from_angles(0.5 * np.pi - height, np.arange(24) * (np.pi / 12.0))
    assert ("in one plane (perpendicular to Z)" in _told(_touches(n))) == plane
    assert ("in one plane (perpendicular to X)" in _told(_touches(n[:, [2, 0, 1]]))) == plane


def test_two_narrow_fans_are_a_plane() -> None:
    """Their spread across is a fortieth of that in the fans, but a hundredth of the largest."""
    across = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0]) * 0.012
    fan = np.array([-0.5, -0.5, 0.0, 0.0, 0.5, 0.5])
    one = np.column_stack([np.ones(6), fan, across])
    n = np.concatenate([one, one * [-1.0, 1.0, 1.0]])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    size = np.linalg.svd(n - n.mean(axis=0))[1]
    assert size[2] < 0.02 * size[0]
    assert size[2] > 0.02 * size[1]
    assert "in one plane (perpendicular to Z)" in _told(_touches(n))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_plane_has_the_name_of_an_axis_within_two_degrees_and_a_half(sign: float) -> None:
    """cos 2.56° = 0.999; else its components are stated."""
    around = from_angles(np.full(24, 0.5 * np.pi), np.arange(24) * (np.pi / 12.0))
    for tilt, name in ((2.4, "perpendicular to Y)"), (2.7, "perpendicular to (")):
        c, s = np.cos(np.radians(tilt)), sign * np.sin(np.radians(tilt))
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        assert name in _told(_touches(around[:, [1, 2, 0]] @ turn))


@pytest.mark.parametrize("how", ["tips", "places", "X as diameter"])
def test_touches_of_two_things_are_not_on_one_sphere(how: str) -> None:
    touches = _touches(np.tile(N, (2, 1)))
    positions, second = touches.positions.copy(), slice(len(N), None)
    if how == "tips":
        positions[second] -= touches.normals[second]
    elif how == "places":
        positions[second] += [20.0, 0.0, 0.0]
    else:
        positions[:, 0] *= 2.0
    assert "do not lie on one sphere" in _told(replace(touches, positions=positions))


class TestRadius:
    @pytest.mark.parametrize(
        ("pretravel", "refused"), [(-0.021, True), (-0.019, False), (0.149, False), (0.151, True)]
    )
    @pytest.mark.parametrize("ring", [False, True])
    def test_mean_pretravel(self, pretravel: float, refused: bool, ring: bool) -> None:
        touches = _ring(pretravel) if ring else _touches(pretravel=pretravel)
        told = _told(touches, replace(SETUP, ring=ring))
        assert (f"a mean pretravel of {1e3 * pretravel:.1f} µm" in told) == refused
        assert bool(told) == refused

    def test_the_travel_of_a_delay_is_allowed_beside_it(self) -> None:
        """30 ms at 600 mm/min: 0.3 mm."""
        for pretravel, refused in ((0.449, False), (0.451, True)):
            feeds = np.where(np.arange(25) == 7, 600.0, 60.0)  # the fastest counts
            touches = replace(_touches(pretravel=pretravel), feeds=feeds)
            assert bool(_told(touches)) == refused

    @pytest.mark.parametrize(
        ("tip_radius", "refused"), [(0.049, True), (0.051, False), (7.49, False), (7.51, True)]
    )
    @pytest.mark.parametrize("ring", [False, True])
    def test_a_tip_that_is_not_given(self, tip_radius: float, refused: bool, ring: bool) -> None:
        """A tip has 0.05 mm of radius, and at most 0.6 of the reference's."""
        setup = QualificationSetup(25.0, ring=ring)
        radius = 12.5 - tip_radius if ring else 12.5 + tip_radius
        touches = _ring(0.0, radius=radius) if ring else _touches(pretravel=0.0, radius=radius)
        told = _told(touches, setup)
        assert bool(told) == refused
        if refused:
            assert f"would mean a tip of {2.0 * tip_radius:.4f} mm diameter" in told
            return
        assert observe(touches, setup, np.eye(3)).tip_radius == pytest.approx(tip_radius, abs=1e-6)


@pytest.mark.parametrize("off", [-0.11, -0.09, 0.09, 0.11])
@pytest.mark.parametrize(
    ("ring", "radius", "words"),
    [
        (False, 12.5, "already compensated"), (True, 12.5, "already compensated"),
        (False, 12.5 + 6.0, "tip's radius given"), (True, 12.5 - 6.0, "tip's radius given"),
        (False, 25.0 + 3.0, "sphere's radius given"), (True, 25.0 - 3.0, "ring's radius given"),
        (True, 12.5 + 3.0, "around a pin of this diameter"),
        (False, 12.5 - 3.0, "subtracted twice"), (False, 12.5 + 9.0, "added twice"),
        (False, 12.5 + 1.5, "twice the tip's diameter"),
        (False, 6.25 + 3.0, "twice the diameter of the sphere"),
    ],
)  # fmt: skip
def test_a_likely_mistake_is_named_to_a_tenth_of_a_millimetre(
    off: float, ring: bool, radius: float, words: str
) -> None:
    """Of a reference of 25 mm and a tip of 6 mm."""
    radius += off
    touches = _ring(0.0, radius=radius) if ring else _touches(pretravel=0.0, radius=radius)
    told = _told(touches, replace(SETUP, ring=ring))
    if abs(off) < 0.1:
        assert words in told
        return
    assert "Check the diameter" in told
    name, size = ("ring", radius + 3.0) if ring else ("sphere", radius - 3.0)
    assert f"the {name} would measure {2.0 * size:.4f} mm" in told


class TestInches:
    @pytest.mark.parametrize("factor", [25.4, 1.0 / 25.4])
    @pytest.mark.parametrize("ring", [False, True])
    @pytest.mark.parametrize("tip", [6.0, None])
    def test_another_unit(self, factor: float, ring: bool, tip: float | None) -> None:
        touches = _ring() if ring else _touches()
        other = replace(touches, positions=touches.positions * factor)
        told = _told(other, QualificationSetup(25.0, tip, ring=ring))
        words = "taken as inches" if factor > 1.0 else "the coordinates look like inches"
        assert words in told
        if tip is not None:
            assert f"25.4 times {'as much' if factor < 1.0 else 'less'}" in told

    @pytest.mark.parametrize(("factor", "unit"), [(1e3, "µm"), (1e-3, "metres")])
    def test_micrometres_and_metres(self, factor: float, unit: str) -> None:
        touches = _touches()
        told = _told(replace(touches, positions=touches.positions * factor))
        assert f"1000 times {'as much' if factor < 1.0 else 'less'}: the coordinates" in told or (
            "from the others" in told
        )
        centred = replace(touches, positions=(touches.positions - [10.0, 20.0, 30.0]) * factor)
        assert f"look like {unit}" in _told(centred)

    @pytest.mark.parametrize(("off", "inches"), [(0.019, True), (0.021, False)])
    @pytest.mark.parametrize("sign", [1.0, -1.0])
    @pytest.mark.parametrize("factor", [25.4, 1.0 / 25.4])
    def test_a_fiftieth_is_the_tolerance(
        self, off: float, inches: bool, sign: float, factor: float
    ) -> None:
        """Of the radius that the sphere and the tip have together."""
        told = _told(_touches(pretravel=0.0, radius=15.5 * (1.0 + sign * off) * factor))
        assert ("25.4 times" in told) == inches
        assert told

    @pytest.mark.parametrize("ring", [False, True])
    @pytest.mark.parametrize("factor", [25.4, 1.0 / 25.4])
    @pytest.mark.parametrize(
        ("tip_radius", "exists"), [(0.045, False), (0.055, True), (7.4, True), (7.6, False)]
    )
    def test_a_unit_with_which_the_tip_exists(
        self, ring: bool, factor: float, tip_radius: float, exists: bool
    ) -> None:
        """A tip has 0.05 mm of radius, and at most 0.6 of that of the reference."""
        radius = factor * (12.5 - tip_radius if ring else 12.5 + tip_radius)
        touches = _ring(0.0, radius=radius) if ring else _touches(pretravel=0.0, radius=radius)
        told = _told(touches, QualificationSetup(25.0, ring=ring))
        words = "were taken as inches; give the unit mm" if factor > 1.0 else "give the unit inch"
        assert (words in told) == exists
        assert told


@pytest.mark.parametrize(("angle", "refused"), [(9.9, False), (10.1, True)])
def test_a_normal_is_within_ten_degrees(angle: float, refused: bool) -> None:
    touches = _touches()
    normals = touches.normals.copy()
    for row in (7, 12):
        beside = np.cross(N[row], [0.6, -0.3, 0.2])
        beside /= np.linalg.norm(beside)
        normals[row] = np.cos(np.radians(angle)) * N[row] + np.sin(np.radians(angle)) * beside
    told = _told(Touches(touches.positions, normals))
    assert bool(told) == refused
    if refused:
        assert told.startswith("touch 8: its position or its normal is wrong")
        assert "is 10° away from" in told
        assert "2 of 25 touches are more than 10° off" in told


@pytest.mark.parametrize("ring", [False, True])
def test_normals_of_the_other_sign(ring: bool) -> None:
    touches = _ring() if ring else _touches()
    told = _told(Touches(touches.positions, -touches.normals), replace(SETUP, ring=ring))
    assert "point the wrong way" in told
    assert ("out of the ring's material" in told) == ring
    assert ("or is this a ring gauge" in told) != ring


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"diameter": 25.0 / 25.4, "tip_diameter": 6.0 / 25.4}, "diameters look like"),
        ({"axis": (0.0, 0.0, 2.0)}, "length 2"),
    ],
)
def test_impossible_settings_are_refused(options: dict[str, Any], words: str) -> None:
    arguments = {"diameter": 25.0, "tip_diameter": 6.0, **options}
    with pytest.raises(PretravelError, match=words):
        qualify(_touches(), **arguments)


def test_sectors_without_a_touch() -> None:
    n = sphere_pattern_25()
    keep = ~((np.abs(n[:, 2]) < 0.5) & (n[:, 0] > 0.5))
    with pytest.raises(PretravelError, match=r"sector X?.*30°"):
        qualify(
            sphere_touches(np.full(25, 0.01)).take(keep), 25.0, tip_diameter=6.0, kind="sectors"
        )


def test_refusals_begin_with_the_name_of_the_file() -> None:
    n = fibonacci_cap(3, 1.2)
    for source, begin in (("bolt.csv", "bolt.csv: 3 touches"), ("", "3 touches")):
        with pytest.raises(PretravelError) as refused:
            observe(Touches(15.5 * n, n, source=source), SETUP, np.eye(3))
        assert str(refused.value).startswith(begin)


def test_a_tilted_probe_sees_directions_in_its_own_frame() -> None:
    turn = probe_rotation((0.6, 0.0, 0.8), rotation=0.4)
    assert not np.allclose(turn, turn.T)
    machine = N @ turn.T
    found = observe(_touches(machine), SETUP, turn)
    assert found.directions == pytest.approx(N, abs=1e-9)
    assert found.center @ turn.T == pytest.approx([10.0, 20.0, 30.0], abs=1e-9)
    assert found.values == pytest.approx(0.01, abs=1e-9)


@pytest.mark.parametrize("ring", [False, True])
def test_touches_on_no_circle_may_be_on_a_sphere(
    ring: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a fit that does not converge in a ring it is asked whether it is one."""

    def diverges(_: object) -> None:
        raise ConvergenceError("no circle found")

    monkeypatch.setattr(observing, "fit_sphere", diverges)
    told = _told(_ring() if ring else _touches(), replace(SETUP, ring=ring))
    assert told.startswith("no circle found")
    assert ("is this a ring, touched inside at one height?" in told) == ring


def test_a_false_trip_is_named_as_it_is_excluded() -> None:
    """By its label, if it is the only one of this name; else by its line; else by neither."""
    count = 40
    touches = _touches(fibonacci_cap(count, np.radians(90.0)))
    positions = touches.positions.copy()
    positions[7] += 0.5 * touches.normals[7]
    touches = replace(touches, positions=positions)
    alone = ("twin",) * 7 + ("single",) + ("twin",) * (count - 8)
    lines = tuple(range(101, 101 + count))
    assert "exclude it by its label, single" in _told(replace(touches, labels=alone, lines=lines))
    twins = ("twin",) * count
    assert "exclude it by its line, 108" in _told(replace(touches, labels=twins, lines=lines))
    assert "exclude it by its line, 108" in _told(replace(touches, lines=lines))
    assert _told(touches).endswith("exclude it")


def test_cells_of_normals_are_those_of_three_whole_numbers() -> None:
    """Two normals have one number if all three cells along the axes are equal."""
    rng = np.random.default_rng(2)
    n = rng.standard_normal((300, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    # Mirror images, permutations, and close neighbours.
    n = np.concatenate([n, n * [-1, 1, 1], n * [1, -1, 1], n * [1, 1, -1], n[:, ::-1], n + 1e-5])
    # The farthest cells, and those whose numbers are next to theirs.
    ends = np.array([-1.0, -0.97, -0.92, -0.87, 0.87, 0.92, 0.97, 1.0])
    n = np.concatenate([n, np.stack(np.meshgrid(ends, ends, ends), axis=-1).reshape(-1, 3)])
    number = _numbered_cells(n, 0.05)
    cells = np.floor((n + 1.0) / 0.05).astype(int)
    expected = np.unique(cells, axis=0, return_inverse=True)[1].ravel()
    assert len(np.unique(number)) == len(np.unique(expected)) == number.max() + 1
    assert len(set(zip(number.tolist(), expected.tolist(), strict=True))) == number.max() + 1


def test_directions_with_few_and_with_many_repeats_are_numbered_alike() -> None:
    """One to 40 touches within 4e-4 of six directions in any order: each is one direction."""
    rng = np.random.default_rng(5)
    order = rng.permutation(np.repeat(np.arange(8), [1, 2, 15, 16, 17, 18, 40, 90]))
    n = fibonacci_cap(8, 1.5)[order] + 1e-4 * rng.uniform(-1.0, 1.0, (len(order), 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    _, first, number = np.unique(order, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    assert observe(_touches(n), SETUP, np.eye(3)).groups.tolist() == rank[number].tolist()


@pytest.mark.parametrize("repeats", [1, 40])
@pytest.mark.parametrize(("apart", "one"), [(0.98e-3, True), (1.02e-3, False)])
def test_a_thousandth_apart_is_one_direction(apart: float, one: bool, repeats: int) -> None:
    """Also of many touches, of which one stands for others beside it."""
    beside = np.cross(N[3], [0.6, -0.3, 0.2])
    beside /= np.linalg.norm(beside)
    angle = 2.0 * np.arcsin(0.5 * apart)
    other = np.cos(angle) * N[3] + np.sin(angle) * beside
    n = np.vstack([N, np.tile(other, (repeats, 1)), np.tile(N[3], (repeats, 1))])
    found = observe(_touches(n), SETUP, np.eye(3))
    assert found.groups.tolist() == [*range(25), *[3 if one else 25] * repeats, *[3] * repeats]


def test_what_is_observed_has_the_references_sizes() -> None:
    setup = replace(SETUP, u_diameter=4e-4)
    found = observe(_touches(), setup, np.eye(3))
    assert (found.reference_radius, found.tip_radius) == (12.5, 3.0)
    # 100 mm/min for 2 ms are 3.33 µm, where no feed is stated; 30 mm/min 1 µm.
    own = 0.5 * setup.u_reference_diameter
    for feeds, travel in ((None, 1e-3 / 0.3), (np.full(25, 30.0), 1e-3)):
        found = observe(replace(_touches(), feeds=feeds), setup, np.eye(3))
        assert math.isclose(found.u_constant, math.hypot(own, travel))
    assert found.tip_known
    assert not found.ring
    assert not observe(_touches(), QualificationSetup(25.0), np.eye(3)).tip_known
    moved = _ring().positions + np.array([1.0, 2.0, 3.0])
    ring = observe(replace(_ring(), positions=moved), replace(SETUP, ring=True), np.eye(3))
    assert ring.ring
    assert ring.center == pytest.approx([1.0, 2.0, 3.0], abs=1e-9)
