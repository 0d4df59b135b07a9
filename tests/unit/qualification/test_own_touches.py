"""A map remembers the touches that made it, so that it is not tested on them unnoticed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.files.map_file import read_map, write_map
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Provenance
from pretravel.qualification.own_touches import own_touches_warnings
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.qualify import qualify
from pretravel.qualification.verification import verify
from pretravel.touches import Touches
from tests.support.examples import SPHERE

N = sphere_pattern_25()
NOISE = 0.3e-3
"""Repeatability of the example probe. [mm]"""


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
    touches = _touches(1)
    write_map(tmp_path / "map.json", _map(touches))
    stored = read_map(tmp_path / "map.json")
    (found,) = own_touches_warnings(touches, stored, "why.")
    assert found.startswith(
        "all 25 touches are touches that the map was made from, to the last digit"
    )
    assert own_touches_warnings(_touches(2), stored, "why.") == []


def test_order_and_normals_and_feeds_do_not_hide_them() -> None:
    touches = _touches(1)
    rows = np.random.default_rng(3).permutation(25)
    other = Touches(touches.positions[rows], touches.normals[rows], feeds=np.full(25, 60.0))
    assert own_touches_warnings(other, _map(touches), "why.")


def test_a_part_of_them_is_counted() -> None:
    made, new = _touches(1), _touches(2)
    mixed = Touches(np.vstack([new.positions[:15], made.positions[15:]]), N)
    (found,) = own_touches_warnings(mixed, _map(made), "why.")
    assert found.startswith("10 of 25 touches are touches that the map was made from")


@pytest.mark.parametrize("seed", range(2, 6))
def test_steps_of_a_micrometre_repeat_touches_by_chance(seed: int) -> None:
    """Two touches of a direction that scatter by 0.3 µm are alike in about every second case."""
    made = _touches(1, step=1e-3)
    again = _touches(seed, step=1e-3)
    alike = np.all(made.positions == again.positions, axis=1).sum()
    assert alike > 0  # else this test shows nothing
    assert own_touches_warnings(again, _map(made), "why.") == []
    assert own_touches_warnings(made, _map(made), "why.")


def test_a_large_map_keeps_a_short_digest_and_knows_a_part() -> None:
    """1000 digests are kept of 5000 touches; half of the new touches made the map."""
    made, new = _touches(1, repeats=200), _touches(2, repeats=200)
    large = _map(made)
    assert len(large.provenance.touch_digests) == 12_000
    mixed = Touches(np.vstack([made.positions[:2500], new.positions[2500:]]), made.normals)
    (found,) = own_touches_warnings(mixed, large, "why.")
    count, _, compared, *_ = found.split()
    # Of the half that was kept in part; five standard deviations of a binomial share.
    share = int(count) / int(compared)
    assert share == pytest.approx(0.5, abs=5.0 * 0.5 / np.sqrt(int(compared)))
    assert own_touches_warnings(new, large, "why.") == []


def test_maps_of_earlier_versions_know_the_name_of_the_file() -> None:
    touches = replace(_touches(1), source="sphere.csv")
    made = _map(touches)
    old = replace(made, provenance=replace(made.provenance, touch_digests=""))
    (found,) = own_touches_warnings(touches, old, "why.")
    assert "a file of this name, sphere.csv" in found
    assert own_touches_warnings(replace(touches, source="new.csv"), old, "why.") == []
    assert Provenance.from_dict({"origin": "qualified"}).touch_digests == ""


def test_a_file_of_the_same_name_with_new_touches_is_no_reason_to_warn() -> None:
    """`today.csv` is written anew every day."""
    made = _map(replace(_touches(1, repeats=2), source="today.csv"), "harmonic")
    again = replace(_touches(2, repeats=2), source="today.csv")
    assert not any("made the map" in words for words in verify(again, made, 25.0).warnings)
    assert own_touches_warnings(again, made, "why.") == []


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
    assert any("shows no change" in words for words in verify(copy, made, 25.0).warnings)
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
    assert found.startswith(f"{len(good) - 1} of {len(good)} touches are touches that")
