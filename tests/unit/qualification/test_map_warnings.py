"""What is said of a map: each limit from both sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import (
    describe,
    fibonacci_cap,
    from_angles,
    polar_angle,
    ring_pattern,
    sphere_pattern_25,
)
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.map_warnings import (
    copy_warnings,
    height_warnings,
    inclined_ring_warnings,
    map_warnings,
    repeat_warnings,
)
from pretravel.touches.copied_rows import copied_readings
from pretravel.uncertainty.covariance import Covariance

NODES = fibonacci_cap(40, 90.0 * DEGREE)
UM = 1e-3  # mm


def _map(
    mean: float = 0.01, lobe: float = 0.0, u: float = 1e-4, u_lobe: float = 0.0, **changes: object
) -> PretravelMap:
    """mean + lobe · z, with the harmonics' own factors; independent coefficients."""
    basis = HarmonicBasis(np.array([[0, 0], [1, 0]]))
    made = PretravelMap(
        basis, np.array([mean, lobe]), Covariance.independent([u**2, u_lobe**2]),
        DirectionSupport(NODES), tip_radius=3.0, repeatability=1e-4,
    )  # fmt: skip
    return replace(made, **changes)  # type: ignore[arg-type]


def _seen(
    normals: FloatArray = NODES, *, ring: bool = False, tip_known: bool = True
) -> Observation:
    return Observation(
        15.5 * normals, np.arange(len(normals)), np.zeros(3), 12.5, 3.0, ring, tip_known
    )


@pytest.mark.parametrize(
    ("polar", "words"),
    [(59.9, "60°: a cap hardly"), (60.1, "60°: the map does not hold for walls"),
     (79.9, "80°: the map does not hold for walls"), (80.1, "")],
)  # fmt: skip
def test_a_cap_ends_above_sixty_degrees_and_walls_below_eighty(polar: float, words: str) -> None:
    cap = fibonacci_cap(40, polar * DEGREE)
    largest = float(polar_angle(cap).max()) / DEGREE
    cap = fibonacci_cap(40, polar * DEGREE * polar / largest)
    said = map_warnings(_map(support=DirectionSupport(cap)), _seen(cap))
    assert said == [w for w in said if f"reach only to polar {words}" in w]
    assert len(said) == bool(words)
    assert map_warnings(_map(), _seen(cap, ring=True)) == []


@pytest.mark.parametrize(("gap", "told"), [(95.0, False), (125.0, True)])
def test_a_side_that_was_not_touched_is_named(gap: float, told: bool) -> None:
    azimuths = np.radians(np.linspace(200.0, 200.0 + 360.0 - gap, 9))
    rings = np.vstack([from_angles(np.full(9, polar * DEGREE), azimuths) for polar in (45, 90)])
    made = _map(support=DirectionSupport(np.vstack([NODES[:1], rings])))
    said = [w for w in map_warnings(made, _seen(rings)) if "no touch is between the azim" in w]
    assert len(said) == told
    assert all(f"azimuths {200.0 - gap:.0f}° and 200°" in w for w in said)


def test_a_good_map_needs_no_word() -> None:
    assert map_warnings(_map(), _seen()) == []
    (said,) = map_warnings(_map(), _seen(tip_known=False))
    assert said.startswith("the tip's diameter was not given")


@pytest.mark.parametrize("u", [1e-6, 4e-4])
def test_pretravel_below_zero_by_a_micrometre_and_three_u(u: float) -> None:
    at = float(_map(u=u).standard_uncertainty(NODES[:1])[0])
    for off, low in ((-1e-6, True), (1e-6, False)):
        mean = -1.0 * UM - 3.0 * at + off
        value = _map(mean, u=u).pretravel(NODES[:1])[0]
        scale = mean / float(value)
        said = map_warnings(_map(mean * scale, u=u), _seen())
        assert [f"pretravel falls to {mean / UM:.1f} µm at" in w for w in said] == [True] * low
        # Without the tip's diameter the map is relative to its mean.
        other = map_warnings(_map(mean * scale, u=u), _seen(tip_known=False))
        assert len(other) == 1


@pytest.mark.parametrize(("value", "high"), [(0.0999, False), (0.1001, True)])
def test_pretravel_above_a_tenth_of_a_millimetre(value: float, high: bool) -> None:
    said = map_warnings(_map(value / float(_map(1.0).pretravel(NODES[:1])[0])), _seen())
    assert [f"pretravel rises to {value / UM:.1f} µm at" in w for w in said] == [True] * high


def test_the_places_of_extremes_are_said() -> None:
    """The largest next to the pole; the smallest at the lowest polar angle."""
    slope = 1.0 / float(_map(0.0, 1.0).pretravel([[0.0, 0.0, 1.0]])[0])
    level = 1.0 / float(_map(1.0).pretravel([[0.0, 0.0, 1.0]])[0])
    said = map_warnings(_map(-0.01 * level, 0.13 * slope), _seen())
    places = _map().over_support()[0]
    highest, lowest = (places[pick(places[:, 2])] for pick in (np.argmax, np.argmin))
    assert f"at {describe(lowest)}, but no probe" in said[0]
    assert f"at {describe(highest)}; probes deflect" in said[1]


@pytest.mark.parametrize(("ratio", "grows"), [(4.9, False), (5.1, True)])
def test_u_grows_between_the_touches(ratio: float, grows: bool) -> None:
    """u goes with z: the touches reach up to where it is a fifth of that at the pole."""
    low = NODES[NODES[:, 2] < 0.5]
    u = 20.0 * UM
    known = _map(0.01, 0.0, 0.0, u)
    largest = float(known.over_support()[2].max())
    at = float(known.standard_uncertainty(low).max())
    for single in (0.0, 1.0):
        # The limit is five times the larger one of u at the touches and one touch.
        if single:
            scatter = largest / ratio
            made = replace(known, repeatability=0.6 * scatter, fixed_scatter=0.8 * scatter)
            touched = NODES[NODES[:, 2] < 0.1]
        else:
            touched = NODES[NODES[:, 2] < (0.19 if grows else 0.25)]
            made = replace(known, repeatability=1e-9)
            at = float(made.standard_uncertainty(touched).max())
            assert (largest > 5.0 * at) == grows
        said = map_warnings(made, _seen(touched))
        found = [w for w in said if "between the touches" in w]
        assert len(found) == grows
        if grows:
            assert f"grows to {largest / UM:.1f} µm, at polar" in found[0]


def test_a_turned_map_is_looked_at_in_its_own_frame() -> None:
    """Directions, values and u are those of the same map on an upright probe."""
    upright = _map(0.01, 0.005, 1e-4, 2e-4)
    turned = replace(upright, rotation=probe_rotation((0.6, 0.0, 0.8), rotation=0.7))
    for one, other in zip(upright.over_support(), turned.over_support(), strict=True):
        assert one == pytest.approx(other, abs=1e-12)
    directions, value, u = upright.over_support()
    assert value == pytest.approx(upright.pretravel(directions), abs=1e-15)
    assert u == pytest.approx(upright.standard_uncertainty(directions), abs=1e-15)
    assert directions[:40] == pytest.approx(NODES)
    assert upright.support.supports(directions).all()
    # All around at the lowest polar angle: one degree apart where the support goes as low.
    lowest = polar_angle(NODES).max()
    edge = directions[np.abs(polar_angle(directions) - lowest) < 1e-9]
    gaps = np.degrees(np.diff(np.sort(np.arctan2(edge[:, 1], edge[:, 0]))))
    assert np.median(gaps) == pytest.approx(360.0 / 359.0, rel=1e-6)


@pytest.mark.parametrize(
    ("dof", "repeated", "said"), [(2.9, False, 1), (3.0, False, 0), (1.0, True, 0)]
)
def test_a_usual_repeatability_is_no_measured_one(dof: float, repeated: bool, said: int) -> None:
    found = repeat_warnings(Scatter(0.4 * UM, dof), repeated=repeated)
    assert len(found) == said
    assert all("0.40 µm is a usual value" in warning for warning in found)


@pytest.mark.parametrize(
    ("polar", "ring", "said"), [(19.9, False, 0), (20.1, False, 1), (90.0, True, 0)]
)
def test_heights_without_a_touch_near_the_pole(polar: float, ring: bool, said: int) -> None:
    """With rings at 30°, 60° and 90° faces touched from above were 0.5 µm too low at u = 0.5 µm,
    in 16 simulated sets of probes that give by 0.1 to 2.4 µm along the axis."""
    found = height_warnings(0.53 * UM, _seen(ring_pattern([polar * DEGREE, 1.5], 8), ring=ring))
    assert len(found) == said
    assert all("centre (u = 0.5 µm)" in warning for warning in found)


@pytest.mark.parametrize(
    ("digits", "noise", "rows", "copies"),
    [
        (7, 0.0, 3, 50),
        (7, 1e-7, 3, 0),
        (4, 0.0, 3, 50),
        (3, 0.0, 3, 50),
        (3, 0.0, 2, 0),
        (2, 0.0, 3, 0),
        (7, 0.0, 1, 0),
    ],
)
def test_copies_of_readings_are_no_repeats(
    digits: int, noise: float, rows: int, copies: int
) -> None:
    """Each row of a log three times. With a noise of 0.1 µm 50 repeats in steps of 1 µm are alike
    by chance in 0.4 % of logs, 25 in 6 %, 50 in steps of 10 µm in 57 %."""
    rng = np.random.default_rng(3)
    once = np.round(sphere_pattern_25() * 15.49 + rng.normal(0.0, 3e-4, (25, 3)), digits)
    groups = np.repeat(np.arange(25), rows)
    positions = once[groups] + noise * rng.standard_normal((len(groups), 3))
    step = 0.0 if digits > 4 else 10.0**-digits
    assert copied_readings(positions, groups, step) == copies
    told = copy_warnings(copies, len(groups))
    assert not copies or "copies of 25 readings" in told[0]


def test_copies_among_repeats_are_found() -> None:
    """Each of three repeats stands there twice; in steps of 2.54 µm repeats are alike by chance."""
    rng = np.random.default_rng(3)
    normals = np.repeat(sphere_pattern_25(), 3, axis=0)
    touched = normals * (15.49 + rng.normal(0.0, 3e-4, (75, 1)))
    twice, groups = np.repeat(np.arange(75), 2), np.repeat(np.arange(25), 6)
    assert copied_readings(np.round(touched, 6)[twice], groups) == 75
    assert copied_readings(np.round(touched, 5), np.repeat(np.arange(25), 3)) == 0
    inches = 0.00254 * np.round(touched / 0.00254)
    assert copied_readings(inches[twice], groups, 0.00254) == 0


def test_a_ring_that_is_inclined_is_named() -> None:
    """0.02 rad: an oval of 50 mm and 50 cos(0.02) = 49.990 mm; the mean is wrong by 5.0 µm."""
    azimuth = np.arange(24) * 15.0 * DEGREE
    across = 22.0 * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    ring = QualificationSetup(50.0, tip_diameter=6.0, ring=True)

    def said(height: FloatArray, setup: QualificationSetup = ring) -> str:
        return " ".join(inclined_ring_warnings(np.column_stack([across, height]), setup))

    assert "by 1.15°: if the ring lies so" in said(0.02 * across[:, 0])
    assert "by about 5.0 µm" in said(0.02 * across[:, 0])
    assert said(0.002 * across[:, 0]) == ""
    assert said(np.where(azimuth < np.pi, 0.0, 5.0)) == ""
    assert said(0.02 * across[:, 0], replace(ring, ring=False)) == ""
