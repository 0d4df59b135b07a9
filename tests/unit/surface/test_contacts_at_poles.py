"""Contacts across the pole of a revolved quarter of a circle, which is half a ball."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.surface import contact as contact_module
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.contact import Contact, Lines, ball_center
from pretravel.surface.curves import SplineCurve
from pretravel.surface.local_geometry import Surface
from pretravel.surface.search import (
    ContactProblem,
    ContactSearch,
    _retry_around_poles,
)
from pretravel.surface.shapes import Sphere
from pretravel.surface.swept import Revolution

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


def _dome(low: float = 0.0) -> Face:
    return Face(
        1, "", "revolution", Revolution(_quarter(low), np.zeros(3), np.eye(3)[2]), None, False
    )


@dataclass(frozen=True, eq=False)
class _Counted(ContactProblem):
    """A problem that notes the rows of each solution."""

    asked: list[list[int]] = field(default_factory=list)

    def solve(self, surface: Surface, rows: IntArray, start: FloatArray) -> Contact:
        assert len(rows) == len(start)
        self.asked.append(rows.tolist())
        return super().solve(surface, rows, start)


def _down(aside: FloatArray) -> Lines:
    """Down lines at places beside the axis, from 20 mm above the centre."""
    anchor = np.column_stack([aside, np.full(len(aside), 20.0)])
    return Lines(anchor, np.tile([0.0, 0.0, -1.0], (len(aside), 1)))


def _lengths(aside: FloatArray) -> FloatArray:
    """Until the centre of the ball is a radius of both from the centre of the dome."""
    return np.asarray(20.0 - np.sqrt((RADIUS + BALL) ** 2 - np.sum(aside**2, axis=1)))


def _unsolved(contact: Contact, which: IntArray) -> None:
    """Make rows of a contact what is left by a search that failed."""
    contact.length[which], contact.residual[which] = np.nan, 0.7


ASIDE = np.array([[0.3, 0.2], [-4.0, 1.0], [0.0, -0.5], [40.0, 0.0], [-2.0, -7.0], [1.0, 1.0]])


def test_contacts_are_searched_again_from_points_around() -> None:
    """Of the lines 5, 1, 2, 3 and 4, number 3 misses the dome. Number 1 is solved already and
    stays; each other one is left alone as soon as it is solved."""
    face = _dome()
    lines = _down(ASIDE)
    problem = _Counted(lines, lambda rows: ball_center(BALL))
    rows = np.array([5, 1, 2, 3, 4])
    contact = problem.solve(face, rows, face.nearest(lines.anchor[rows]))
    assert contact.solved[[1, 3]].tolist() == [True, False]
    _unsolved(contact, np.array([0, 2, 4]))
    before = contact.take(np.arange(5))
    problem.asked.clear()
    _retry_around_poles(face, contact, rows, problem)
    assert problem.asked[0] == [5, 2, 3, 4]
    assert all(asked == [3] for asked in problem.asked[4:])
    assert all(3 in asked and 1 not in asked for asked in problem.asked)
    assert 8 < len(problem.asked) < 30
    assert contact.solved.tolist() == [True, True, True, False, True]
    at = contact.solved
    places = ASIDE[rows[at]]
    assert contact.length[at] == pytest.approx(_lengths(places), abs=1e-9)
    normal = np.column_stack([places, 20.0 - _lengths(places)]) / (RADIUS + BALL)
    assert contact.local.normal[at] == pytest.approx(normal, abs=1e-9)
    assert contact.local.point[at] == pytest.approx(RADIUS * normal, abs=1e-8)
    assert np.array_equal(contact.uv[1], before.uv[1])
    assert contact.iterations[1] == before.iterations[1]
    assert np.all(contact.iterations[[0, 2, 4]] > before.iterations[[0, 2, 4]])
    assert contact.residual[3] == before.residual[3]


def test_one_contact_alone_is_searched_again_until_it_is_found() -> None:
    face, lines = _dome(), _down(ASIDE[:1])
    problem = _Counted(lines, lambda rows: ball_center(BALL))
    contact = problem.solve(face, np.array([0]), face.nearest(lines.anchor))
    _unsolved(contact, np.array([0]))
    problem.asked.clear()
    _retry_around_poles(face, contact, np.array([0]), problem)
    assert contact.solved.all()
    assert len(problem.asked) == 1
    _retry_around_poles(face, contact, np.array([0]), problem)  # nothing to do
    assert len(problem.asked) == 1


def test_a_face_without_poles_is_searched_once() -> None:
    """A ball in closed form finds its contacts itself, and a cap without its pole has none."""
    whole = Face(1, "", "sphere", Sphere([0.0, 0.0, 0.0], RADIUS), None, False)
    cut = Revolution(_quarter(), np.zeros(3), np.eye(3)[0])  # about x: the pole is at (10, 0, 0)
    assert _dome().has_poles
    assert _dome(0.3).has_poles
    assert Face(1, "", "revolution", cut, None, False).has_poles
    beside = Revolution(_quarter(), np.array([-1.0, 0.0, 0.0]), np.eye(3)[2])
    for face in (whole, Face(1, "", "revolution", beside, None, False)):
        assert not face.has_poles
        lines = _down(ASIDE[3:4])
        problem = _Counted(lines, lambda rows: ball_center(BALL))
        contact = problem.solve(face, np.array([0]), face.nearest(lines.anchor))
        assert not contact.solved.any()
        problem.asked.clear()
        _retry_around_poles(face, contact, np.array([0]), problem)
        assert not problem.asked


@pytest.mark.parametrize("as_part", [True, False])
def test_a_search_from_the_other_side_of_the_pole_leads_across_it(as_part: bool) -> None:
    """Starts on the opposite side, near the pole; also of a ball that is the part's only face."""
    face = _dome()
    rng = np.random.default_rng(5)
    angle, off = rng.uniform(0.0, 2.0 * math.pi, 40), 10.0 ** rng.uniform(-8, 0, 40)
    aside = off[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    search = ContactSearch(Part("dome", (face,), (0,)) if as_part else face, 40)
    near = np.column_stack([-aside, np.full(40, RADIUS)])
    down = np.tile([0.0, 0.0, -1.0], (40, 1))
    problem = ContactProblem(_down(aside), lambda rows: ball_center(BALL), against=down)
    search.solve(near, problem)
    found = search.contacts()
    assert found.solved.all()
    assert found.length == pytest.approx(_lengths(aside), abs=1e-9)
    assert np.all(found.face == 0)
    assert np.all(found.iterations > 0)
    assert found.residual.max() < 1e-9
    assert found.local.curvature == pytest.approx(
        (np.eye(3) - found.local.normal[:, :, None] * found.local.normal[:, None, :]) / RADIUS,
        abs=4e-4,  # near the pole it is that of a place 0.002 of 90° away, turned by 3 mrad
    )
