"""Contacts across the pole of a revolved quarter of a circle, which is half a ball."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.surface import contact as contact_module
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.contact import Lines, ball_center
from pretravel.surface.curves import SplineCurve
from pretravel.surface.local_geometry import Surface
from pretravel.surface.search import ContactProblem, ContactSearch
from pretravel.surface.shapes import Sphere
from pretravel.surface.swept import Placed, Revolution

RADIUS, BALL = 10.0, 2.0


@pytest.fixture(autouse=True)
def short_searches(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rigid ball needs neither other differences nor many iterations, which take long where
    there is no contact."""
    monkeypatch.setattr(contact_module, "_DIFFERENCES", contact_module._DIFFERENCES[:1])
    monkeypatch.setattr(contact_module, "_MOST_ITERATIONS", 15)


def _quarter(low: float = 0.0) -> SplineCurve:
    """From the equator, or from a latitude, to the pole: exact as a rational curve of degree 2."""
    half = 0.5 * (0.5 * math.pi - low)
    middle = low + half
    corner = np.array([math.cos(middle), 0.0, math.sin(middle)]) / math.cos(half)
    start = np.array([math.cos(low), 0.0, math.sin(low)])
    poles = RADIUS * np.array([start, corner, [0.0, 0.0, 1.0]])
    weights = np.array([1.0, math.cos(half), 1.0])
    return SplineCurve(np.array([0.0, 0, 0, 1, 1, 1]), poles, weights, 2)


@pytest.mark.parametrize(
    ("surface", "poles"),
    [
        (Revolution(_quarter(), np.zeros(3), np.eye(3)[2]), True),
        (Revolution(_quarter(0.3), np.zeros(3), np.eye(3)[2]), True),
        (Revolution(_quarter(), np.zeros(3), np.eye(3)[0]), True),  # about x: at (10, 0, 0)
        (Revolution(_quarter(), np.array([-1.0, 0.0, 0.0]), np.eye(3)[2]), False),
        (Sphere([0.0, 0.0, 0.0], RADIUS), False),  # finds its contacts in closed form
    ],
)
def test_faces_that_have_poles(surface: Surface, poles: bool) -> None:
    """Wherever they are placed."""
    placed = Placed(surface, np.eye(3), np.array([1.0, 2.0, 3.0]))
    for one in (surface, placed, Placed(placed, np.eye(3), np.ones(3))):
        assert Face(1, "", "other", one, None, False).has_poles == poles


@pytest.mark.parametrize("as_part", [True, False])
@pytest.mark.parametrize("count", [1, 40])
def test_a_search_from_the_other_side_of_the_pole_leads_across_it(
    as_part: bool, count: int
) -> None:
    """Starts on the opposite side, near the pole; also of a ball that is the part's only face, and
    of one contact alone. Lines beside the dome have none, and disturb no other.

    Until a contact, the centre of the ball is a radius of both from the centre of the dome.
    """
    face = Face(1, "", "revolution", Revolution(_quarter(), np.zeros(3), np.eye(3)[2]), None, False)
    rng = np.random.default_rng(5)
    angle, off = rng.uniform(0.0, 2.0 * math.pi, count), 10.0 ** rng.uniform(-8, 0, count)
    aside = off[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    hits = np.arange(count) % 8 != 5
    aside[~hits] += 40.0
    search = ContactSearch(Part("dome", (face,), (0,)) if as_part else face, count)
    near = np.column_stack([-aside, np.full(count, RADIUS)])
    down = np.tile([0.0, 0.0, -1.0], (count, 1))
    lines = Lines(np.column_stack([aside, np.full(count, 20.0)]), down)
    search.solve(near, ContactProblem(lines, lambda rows: ball_center(BALL), against=down))
    found = search.contacts()
    assert np.array_equal(found.solved, hits)
    height = np.sqrt((RADIUS + BALL) ** 2 - np.sum(aside[hits] ** 2, axis=1))
    assert found.length[hits] == pytest.approx(20.0 - height, abs=1e-9)
    normal = np.column_stack([aside[hits], height]) / (RADIUS + BALL)
    assert found.local.normal[hits] == pytest.approx(normal, abs=1e-9)
    assert found.local.point[hits] == pytest.approx(RADIUS * normal, abs=1e-8)
    assert np.all(found.face[hits] == 0)
    assert np.all(found.iterations > 0)
    assert found.residual[hits].max() < 1e-9
    across = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    # Near the pole it is that of a place 0.002 of 90° away, turned by 3 mrad.
    assert found.local.curvature[hits] == pytest.approx(across / RADIUS, abs=4e-4)
