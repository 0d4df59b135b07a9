"""The choice among the kinds of map."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pretravel.base.directions import grid, sphere_pattern_25
from pretravel.base.frames import probe_rotation
from pretravel.files.touches_csv import read_touches
from pretravel.maps.kinds import kinds
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import distances_from_reference
from pretravel.qualification.kind_weights import _disagreement
from pretravel.qualification.qualify import qualify
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.examples import SPHERE


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
    assert "sector" in sectors.problem


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8)])
def test_distances_in_a_ring_are_those_from_its_axis(axis: tuple[float, float, float]) -> None:
    """Touches in planes 4 mm apart, without noise: only the displacement given to them, away from
    the axis of the ring, is left."""
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


def _result(values: list[float], tip_radius: float = 3.0) -> SimpleNamespace:
    """A table along the axis and four ways of the equator, of 0.1 um."""
    nodes = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=float)
    support = DirectionSupport(nodes)
    made = PretravelMap(
        TabulatedBasis(support), np.array(values), Covariance.independent([1e-8] * 5), support,
        tip_radius=tip_radius,
    )  # fmt: skip
    return SimpleNamespace(pretravel_map=made, center=np.zeros(3))


def _said(first: list[float], second: list[float], weight: float = 0.4) -> list[str]:
    parts = [SimpleNamespace(kind="a", weight=0.6), SimpleNamespace(kind="b", weight=weight)]
    return _disagreement([_result(first), _result(second)], parts)  # type: ignore[arg-type, list-item]


def test_kinds_that_disagree_are_named_where_they_do_most() -> None:
    same = [0.01, 0.01, 0.01, 0.01, 0.01]
    other = [0.01, 0.01, 0.013, 0.01, 0.01]
    (sentence,) = _said(same, other)
    assert "the kinds a and b disagree by 3.0 µm at polar 90" in sentence
    assert "azimuth 90" in sentence
    assert _said(same, same) == []
    assert _said(same, other, weight=0.2) == []  # the second kind is not believed
    assert _said(same, [0.01, 0.01, 0.0104, 0.01, 0.01]) == []  # below half a micrometre
