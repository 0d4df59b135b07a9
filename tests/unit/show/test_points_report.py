"""Before and after of a compensation: touches of a known surface with a known pretravel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.measurement.compensation import apply, embed
from pretravel.show.document import Table
from pretravel.tasks.compensate.report import points_document
from tests.unit.qualification.test_verification import old_map

AZIMUTHS = np.radians(np.arange(0.0, 360.0, 15.0))
NORMALS = np.column_stack([np.cos(AZIMUTHS), np.sin(AZIMUTHS), np.zeros(len(AZIMUTHS))])
NOMINAL = 20.0 * NORMALS
FORM = 0.002 * np.cos(2.0 * AZIMUTHS)
"""Of the surface: an ellipse. [mm]"""


def _rows(table: Table) -> dict[str, list[float]]:
    """Numbers by correction."""
    names, *numbers = (column.values for column in table.columns)
    return {str(name): [float(c[row]) for c in numbers] for row, name in enumerate(names)}


def _summary(values: np.ndarray) -> list[float]:
    um = 1e3 * values
    return [um.min(), um.max(), um.mean(), um.std()]


def test_with_a_nominal_it_is_the_deviation() -> None:
    """Without compensation each point lies below the surface, by the pretravel of its direction."""
    known = old_map()
    touches = embed(NOMINAL + FORM[:, None] * NORMALS, NORMALS, known)
    document = points_document(apply(replace(touches, nominal_points=NOMINAL), known))
    (table,) = document.tables
    before = FORM - known.pretravel(NORMALS)
    assert "nominal" in table.title
    found = _rows(table)
    assert found["tip radius alone"] == pytest.approx(_summary(before), abs=1e-6)
    one = before + known.pretravel(NORMALS).mean()
    assert found["one radius, best for these points"] == pytest.approx(_summary(one), abs=1e-6)
    assert found["map"] == pytest.approx(_summary(FORM), abs=1e-6)
    assert (
        f"{1e3 * before.std():.2f} µm before, {1e3 * FORM.std():.2f} µm after" in document.verdict
    )


def test_without_a_nominal_nothing_is_said_about_the_error_of_the_points() -> None:
    known = old_map()
    touches = embed(NOMINAL + FORM[:, None] * NORMALS, NORMALS, known)
    document = points_document(apply(touches, known))
    (table,) = document.tables
    travel = known.pretravel(NORMALS)
    found = _rows(table)
    assert set(found) == {"tip radius alone", "one radius, best for these points"}
    assert found["tip radius alone"] == pytest.approx(_summary(-travel), abs=1e-6)
    assert found["one radius, best for these points"] == pytest.approx(
        _summary(travel.mean() - travel), abs=1e-6
    )
    assert "before" not in document.verdict


def test_points_of_a_file_that_states_no_more() -> None:
    known = old_map()
    points = replace(apply(embed(NOMINAL, NORMALS, known), known), uncompensated=None)
    document = points_document(points)
    assert document.tables == ()
    assert document.verdict.startswith("24 points; U of a point up to ")
