"""Budgets of results as values: they add up to the uncertainties that the results state."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.drawing.features.feature_budget import feature_budgets
from pretravel.drawing.features.feature_uncertainty import MACHINE
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.files.touches_csv import read_touches
from pretravel.measurement.compensation import apply
from pretravel.measurement.point_errors import errors_of_points
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualify
from pretravel.show.as_json import document_from_values, document_values
from pretravel.show.document import Document
from pretravel.show.terminal import table_text
from pretravel.task.budget_report import budget_table
from pretravel.tasks.qualify.report import qualification_document
from pretravel.touches import Touches
from pretravel.uncertainty.gum import Budget, Component
from tests.support.example_maps import example_map
from tests.support.examples import PART, SPHERE
from tests.support.feature_points import around, feature_points


@pytest.fixture(scope="module")
def qualified() -> Qualification:
    return qualify(
        read_touches(SPHERE), 24.9987, kind="harmonic", tip_diameter=6.0, u_diameter=0.3e-3
    )


def _sources(budget: Budget) -> dict[str, float]:
    return {component.name: component.contribution for component in budget.components}


def test_every_point_of_a_part(qualified: Qualification) -> None:
    made = replace(qualified.pretravel_map, delay=5e-3, u_delay=0.2e-3, fixed_scatter=0.1e-3)
    touches = read_touches(PART)
    touches = Touches(touches.positions, touches.normals, feeds=np.full(len(touches), 60.0))
    points = apply(touches, made)
    errors = errors_of_points(touches, points.normals, made)
    variance = np.sum(list(errors.variances_along_normals.values()), axis=0)
    assert np.sqrt(variance) == pytest.approx(points.standard_uncertainty)
    one, mean = errors.budget(3), errors.budget()
    assert one.combined == pytest.approx(points.standard_uncertainty[3])
    assert mean.combined == pytest.approx(np.sqrt(np.mean(points.standard_uncertainty**2)))
    # 60 mm/min are 1 mm/s: the travel of 0.2 ms is 0.2 µm.
    assert _sources(one)["signal delay"] == pytest.approx(0.2e-3)
    assert set(_sources(one)) == {
        "repeatability", "fixed scatter", "map", "tip radius", "signal delay",
    }  # fmt: skip


def test_what_a_map_does_not_state_has_no_share() -> None:
    """A map by the description of a probe states no uncertainty of its own."""
    from pretravel.uncertainty.covariance import Covariance

    made = example_map()
    silent = replace(
        made, covariance=Covariance.independent(np.zeros(made.basis.size)), u_tip_radius=0.0
    )
    touches = Touches(15.5 * np.eye(3)[[2]], np.eye(3)[[2]])
    budget = errors_of_points(touches, touches.normals, silent).budget()
    assert set(_sources(budget)) <= {"repeatability", "fixed scatter"}


def test_qualification(qualified: Qualification) -> None:
    made = qualified.pretravel_map
    u_map = made.over_support()[2]
    budget = qualified.part_point_budget()
    total = np.mean(u_map**2) + made.single_touch**2 + made.u_tip_radius**2
    assert budget.combined == pytest.approx(np.sqrt(total))
    radius = qualified.radius_budget()
    assert radius.combined == pytest.approx(qualified.u_effective_radius)
    # The stated 0.3 µm of the diameter; 11.5e-6/K of 25 mm in 0.2 K. Half of them is in a radius.
    parts = _sources(radius)
    assert parts["diameter of the reference"] == pytest.approx(0.15e-3)
    assert parts["temperature of the reference"] == pytest.approx(0.5 * 11.5e-6 * 24.9987 * 0.2)
    assert "signal delay" not in parts


def test_an_assumed_uncertainty_is_named_so() -> None:
    made = qualify(read_touches(SPHERE), 24.9987, kind="mean", tip_diameter=6.0)
    assert "diameter of the reference (assumed)" in _sources(made.radius_budget())


@pytest.mark.parametrize("u_machine", [0.0, 1e-3])
def test_features(u_machine: float) -> None:
    outward, _ = around(12)
    bore = measure_feature(feature_points(10.0 * outward, -outward), "bore", u_machine=u_machine)
    budgets = {budget.result: budget for budget in feature_budgets(bore)}
    for quantity in bore.quantities:
        assert budgets[f"bore, {quantity.name}"].combined == pytest.approx(quantity.u)
    assert (MACHINE in _sources(budgets["bore, diameter"])) == (u_machine > 0.0)


def test_a_document_keeps_its_budgets_through_json(qualified: Qualification) -> None:
    document = qualification_document(qualified)
    assert [budget.result for budget in document.budgets][1] == "effective radius"
    again = document_from_values(json.loads(json.dumps(document_values(document))))
    assert again.budgets == document.budgets
    parts = (Component("scale", "B", 3e-4), Component("repeats", "A", 4e-4, 2.0, dof=9.0))
    plain = Document("x", budgets=(Budget(parts, "length"),))
    assert document_from_values(json.loads(json.dumps(document_values(plain)))) == plain


def test_very_many_degrees_of_freedom_are_many() -> None:
    """A budget stated "55217" effective ones. The limit is kept as a number."""
    for dof, shown in ((10_000.0, "10000"), (10_001.0, "many"), (math.inf, "∞")):
        budget = Budget((Component("repeats", "A", 4e-4, dof=dof),))
        lines = table_text(budget_table(budget)).splitlines()
        assert [line.split()[-1] for line in lines if line.startswith(("repeats", "combined"))] == [
            shown, shown,
        ]  # fmt: skip
