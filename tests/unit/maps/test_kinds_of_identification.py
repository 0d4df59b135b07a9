"""Kinds of map: by name, by choice, by the setup of an earlier map; distances from a reference."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import grid, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.files.map_file import read_map, write_map
from pretravel.files.touches_csv import read_touches
from pretravel.maps.kinds import kinds
from pretravel.maps.kinds.wozniak import WozniakBasis, WozniakKind
from pretravel.maps.provenance import Origin, Provenance
from pretravel.measurement.compensation import distances_from_reference
from pretravel.qualification.qualifying import qualify, qualify_like
from pretravel.touches import Touches
from tests.support.examples import SPHERE


def _touches(pretravel: np.ndarray | float, axis: int = 2) -> Touches:
    n = np.roll(sphere_pattern_25(), axis - 2, axis=1)
    return Touches(n * (12.5 + 3.0 - np.asarray(pretravel) * np.ones(25))[:, None], n)


def test_a_map_made_again_keeps_its_setup(tmp_path: Path) -> None:
    """Tip, uncertainty of the diameter, axis and axial pretravel; through a file too."""
    first = qualify(
        _touches(0.010, axis=0), 25.0, tip_diameter=6.0, u_diameter=5e-4, axial_pretravel=3e-3,
        axis=(1.0, 0.0, 0.0), kind="harmonic", u_temperature=0.0,
    ).pretravel_map  # fmt: skip
    write_map(tmp_path / "map.json", first)
    earlier = read_map(tmp_path / "map.json")
    assert earlier.provenance == first.provenance
    again = qualify_like(_touches(0.012, axis=0), earlier, 25.0)
    assert again.setup == first.provenance.setup
    assert again.pretravel_map.u_tip_radius == pytest.approx(2.5e-4)
    assert again.pretravel_map.kind == "harmonic"
    # At the pole, which is +x here, the map has the axial pretravel that the setup names.
    assert again.pretravel_map.pretravel([[1.0, 0.0, 0.0]])[0] == pytest.approx(3e-3, abs=1e-12)


def test_a_map_of_an_earlier_version_keeps_its_uncertainty() -> None:
    """Earlier files have no setup: u of the radius was half that of the diameter."""
    first = qualify(
        _touches(0.010), 25.0, tip_diameter=6.0, u_diameter=5e-4, u_temperature=0.0, kind="harmonic"
    ).pretravel_map
    words = Provenance(Origin.QUALIFIED, first.provenance.source)
    again = qualify_like(_touches(0.010), replace(first, provenance=words), 25.0)
    assert again.pretravel_map.u_tip_radius == pytest.approx(2.5e-4)
    assert again.setup.tip_diameter == pytest.approx(6.0)


def test_settings_of_a_kind_are_kept(tmp_path: Path) -> None:
    n = sphere_pattern_25()
    lobes = 0.004 * WozniakBasis(0.3).design(n)[:, 0]
    first = qualify(_touches(lobes), 25.0, tip_diameter=6.0, kind=WozniakKind(0.3)).pretravel_map
    write_map(tmp_path / "map.json", first)
    again = qualify_like(_touches(lobes), read_map(tmp_path / "map.json"), 25.0)
    assert again.kind == WozniakKind(0.3)


def test_touches_at_one_feed_do_not_replace_a_map_with_delay() -> None:
    first = qualify(_touches(0.010), 25.0, tip_diameter=6.0, kind="mean").pretravel_map
    moving = replace(first, delay=2e-3, feed=0.0)
    with pytest.raises(PretravelError, match="touch the reference at two feeds"):
        qualify_like(_touches(0.010), moving, 25.0)


def test_choice_among_kinds() -> None:
    """On a six-seat probe's touches the physical kind predicts omitted directions best. With
    a constant pretravel, one number is as good as any kind, and the choice states why."""
    touches = read_touches(SPHERE)
    chosen = qualify(touches, 24.9987, tip_diameter=6.0)
    assert chosen.pretravel_map.kind == "physical"
    assert chosen.scores[0].kind == "physical"
    assert sum(score.weight for score in chosen.scores) == 1.0
    assert {score.kind for score in chosen.scores} == set(kinds())
    sectors = next(score for score in chosen.scores if score.kind == "sectors")
    # It can be fitted to all touches, but not with a fifth of the directions left out.
    assert sectors.problem.startswith("in cross-validation, no touch near the equator")
    assert qualify(touches, 24.9987, tip_diameter=6.0, kind="sectors").scores == ()


def test_distances_in_a_ring_are_those_from_its_axis() -> None:
    """Touches in planes 4 mm apart, without noise: only the displacement given to them, away from
    the axis of the ring, is left."""
    axis = (0.6, 0.0, 0.8)
    turn = probe_rotation(axis)
    outward = grid(np.pi / 2.0, np.radians(np.arange(0.0, 360.0, 20.0)))
    height = 4.0 * (np.arange(len(outward)) % 3)
    off = 1e-3 * np.cos(np.arange(len(outward)))
    places = outward * (25.0 - 3.0 + 0.012) + height[:, None] * [0.0, 0.0, 1.0]
    center = np.array([100.0, -50.0, 20.0])
    touches = Touches(center + places @ turn.T, -outward @ turn.T)
    fitted = qualify(
        touches, 50.0, tip_diameter=6.0, ring=True, kind="mean", axis=axis, search_outliers=False
    )
    distance, _ = distances_from_reference(fitted, touches)
    assert distance == pytest.approx(0.0, abs=1e-9)
    displaced = replace(touches, positions=touches.positions + (off[:, None] * outward) @ turn.T)
    distance, u = distances_from_reference(fitted, displaced)
    assert distance == pytest.approx(off, abs=1e-9)
    assert np.all(u > 0.0)


def test_distances_from_a_sphere_are_away_from_its_centre() -> None:
    n = sphere_pattern_25()
    off = 1e-3 * np.cos(np.arange(25))
    exact = Touches(n * (12.5 + 3.0 - 0.012) + [3.0, 4.0, 5.0], n)
    fitted = qualify(exact, 25.0, tip_diameter=6.0, kind="mean", search_outliers=False)
    displaced = replace(exact, positions=exact.positions + off[:, None] * n)
    distance, _ = distances_from_reference(fitted, displaced)
    assert distance == pytest.approx(off, abs=1e-9)
