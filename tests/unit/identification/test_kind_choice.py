"""The choice among the kinds of map."""

from __future__ import annotations

from pretravel.formats.touches_csv import read_touches
from pretravel.identification.kind_registry import KINDS, choose
from pretravel.maps.provenance import QualificationSetup
from tests.support.examples import SPHERE


def test_choice_among_kinds() -> None:
    """On a six-seat probe's touches the physical kind predicts omitted directions best. With
    a constant pretravel, one number is as good as any kind, and the choice states why."""
    touches = read_touches(SPHERE)
    chosen = choose(touches, QualificationSetup(24.9987, tip_diameter=6.0))
    assert chosen.kind == "physical"
    assert chosen.scores[0].kind == "physical"
    assert sum(score.weight for score in chosen.scores) == 1.0
    assert {score.kind for score in chosen.scores} == set(KINDS)
    sectors = next(score for score in chosen.scores if score.kind == "sectors")
    assert "sector" in sectors.problem
