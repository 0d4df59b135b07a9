"""A map remembers the touches that made it, so that it is not tested on them unnoticed."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from pretravel.base.directions import sphere_pattern_25
from pretravel.files.map_file import read_map, write_map
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Provenance
from pretravel.qualification.own_touches import (
    _by_chance,
    own_touches_warnings,
    touch_digests,
    touches_that_made,
)
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.qualifying import qualify
from pretravel.qualification.verification import verify
from pretravel.touches import Touches
from tests.support.examples import SPHERE

N = sphere_pattern_25()
NOISE = 0.3e-3


def _touches(seed: int, step: float = 0.0, repeats: int = 1) -> Touches:
    """Touches on a sphere of 25 mm by a probe with one radius; latched in steps."""
    rng = np.random.default_rng(seed)
    n = np.tile(N, (repeats, 1))
    distance = 15.49 + NOISE * rng.standard_normal(len(n))
    positions = n * distance[:, None]
    return Touches(positions if step == 0.0 else step * np.round(positions / step), n)


def _map(touches: Touches, kind: str = "mean") -> PretravelMap:
    return qualify(touches, 25.0, kind=kind, tip_diameter=6.0).pretravel_map


def test_the_touches_of_a_map_are_known_after_it_was_stored(tmp_path: Path) -> None:
    touches = replace(_touches(1), source="a.csv")
    write_map(tmp_path / "map.json", _map(touches))
    stored = read_map(tmp_path / "map.json")
    (found,) = own_touches_warnings(touches, stored, "why.")
    assert found.startswith("all 25 touches are identical to touches that the map was made from")
    # New touches in a file of the same name are others: `today.csv` is rewritten every day.
    assert own_touches_warnings(replace(_touches(2), source="a.csv"), stored, "why.") == []


def test_maps_of_earlier_versions_know_the_name_of_the_file() -> None:
    touches = replace(_touches(1), source="sphere.csv")
    made = _map(touches)
    old = replace(made, provenance=replace(made.provenance, touch_digests=""))
    (found,) = own_touches_warnings(touches, old, "why.")
    assert "a file of this name, sphere.csv" in found
    assert own_touches_warnings(replace(touches, source="new.csv"), old, "why.") == []
    assert Provenance.from_dict({"origin": "qualified"}).touch_digests == ""


def test_an_update_knows_the_touches_of_both_series() -> None:
    first, second = _touches(1, repeats=2), _touches(2, repeats=2)
    updated = update_map(second, _map(first, "harmonic"), 25.0).pretravel_map
    for touches in (first, second):
        assert own_touches_warnings(touches, updated, "why.")
    assert own_touches_warnings(_touches(3), updated, "why.") == []


def test_verify_and_update_name_touches_of_a_renamed_file() -> None:
    touches = _touches(1, repeats=2)
    made = _map(touches, "harmonic")
    copy = replace(touches, source="copy.csv")
    assert any("agrees with its own" in words for words in verify(copy, made, 25.0).warnings)
    assert any("count twice" in words for words in update_map(copy, made, 25.0).warnings)


def test_touches_that_were_left_out_did_not_make_the_map() -> None:
    from pretravel.files.touches_csv import read_touches

    good = read_touches(SPHERE)
    positions = good.positions.copy()
    positions[7] += 0.02 * good.normals[7]
    made = qualify(
        replace(good, positions=positions), 24.9987, kind="mean", tip_diameter=6.0
    ).pretravel_map
    (found,) = own_touches_warnings(good, made, "why.")
    assert found.startswith(f"{len(good) - 1} of {len(good)} touches are identical to touches that")


# Digests.


def split_mix(state: int) -> int:
    """Steele, Lea and Flood 2014, with integers of Python."""
    z = (state + 0x9E3779B97F4A7C15) % 2**64
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
    return z ^ (z >> 31)


def test_digests_are_those_of_stored_maps() -> None:
    """A map of an earlier version keeps them: coordinates in 1e-9 mm, mixed one after the other,
    of which 48 bits are kept. The first value is that of published tests of SplitMix64."""
    assert split_mix(1234567) == 6457827717110365317
    positions = np.array([[1.25, -3.5, 1e-9], [0.0, 0.0, 3.1], [-7.0, 2.0, 0.4]])
    expected = []
    for place in positions:
        mixed = 0
        for step in np.rint(place * 1e9).astype(int).tolist():
            mixed = split_mix((mixed + step) % 2**64)
        expected.append(f"{mixed >> 16:012x}")
    assert touch_digests(positions) == "".join(sorted(expected))
    assert touch_digests(positions[:1], touch_digests(positions[1:])) == "".join(sorted(expected))
    assert touches_that_made(Touches(positions, N[:3]), "no digests at all") == (0, 3)


def test_of_a_thousand_digests_the_touches_below_the_last_are_compared() -> None:
    positions = np.random.default_rng(1).uniform(-9.0, 9.0, (1600, 3))
    normals = np.tile([0.0, 0.0, 1.0], (1600, 1))
    each = [touch_digests(row[None]) for row in positions]
    for count in (999, 1000, 1300):
        kept = sorted(each[:count])[:1000]
        digests = touch_digests(positions[:count])
        assert digests == "".join(kept)
        last = kept[-1] if count >= 1000 else "g"
        below = [row for row, own in enumerate(each) if own <= last]
        found = sum(row < count for row in below)
        assert touches_that_made(Touches(positions, normals), digests) == (found, len(below))


def _known(digests: str, repeatability: float = NOISE) -> PretravelMap:
    made = _map(_touches(1))
    return replace(made, repeatability=repeatability, provenance=Provenance(touch_digests=digests))


def rounded(count: int) -> np.ndarray:
    return np.asarray(np.round(np.random.default_rng(5).uniform(-9.0, 9.0, (count, 3)), 3))


@pytest.mark.parametrize(("sigma", "made"), [(3.0, 40), (5.0, 25), (5.0, 10), (500.0, 3000)])
def test_touches_alike_by_chance_are_a_binomial_number(sigma: float, made: int) -> None:
    """Two normal values fall into one cell of 1 µm with the sum of the squares of the cells'
    probabilities; each touch has as many chances as a direction was touched. Four standard
    deviations above; the number that a thousand kept digests are of is known to 3 %."""
    kept = touch_digests(rounded(made))
    known = _known(kept, 1e-3 * sigma)
    cells = np.diff(stats.norm(scale=sigma).cdf(np.arange(-8.0 * sigma - 0.5, 8.0 * sigma + 1.0)))
    chance = min(max(made / 25.0, 1.0) * float(np.sum(cells**2)), 1.0)
    expected = 50.0 * chance + 4.0 * math.sqrt(50.0 * chance * (1.0 - chance))
    near = 0.01 if made < 1000 else 0.05  # steps are not quite fine
    assert _by_chance(rounded(50), known, 50) == pytest.approx(min(expected, 45.0), rel=near)


def test_only_more_touches_than_by_chance_are_named() -> None:
    """Steps of 1 µm at 0.3 µm: any touch can be alike. Nine of ten are then still by chance; those
    of positions without a step are never."""
    kept = rounded(50)
    known = _known(touch_digests(kept))
    other = kept + 1.0
    for count, named in ((45, 0), (46, 1)):
        mixed = np.vstack([kept[:count], other[count:]])
        given = Touches(mixed, np.tile(N, (2, 1)))
        assert len(own_touches_warnings(given, known, "why.")) == named
    smooth = np.random.default_rng(2).uniform(-9.0, 9.0, (50, 3))
    known = _known(touch_digests(smooth[:1]))
    (found,) = own_touches_warnings(Touches(smooth, np.tile(N, (2, 1))), known, "why.")
    assert found == ("1 of 50 touches are identical to touches that the map was made from: why.")
