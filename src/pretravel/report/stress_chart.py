"""The stress of a probe at the trigger, in space, on the probe as it bends."""

from __future__ import annotations

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.report.chart import Scale, SpaceArrow, SpaceChart, SpaceMark, SpaceMesh, SpacePoints
from pretravel.report.direction_charts import direction_words
from pretravel.report.formatting import decimals, number_text, value_text
from pretravel.trigger.elastic_field import TriggerField

_LOWEST = 0.05
"""Part of the nodes below the end of the scale of colours."""


def stress_chart(field: TriggerField) -> SpaceChart:
    """The bent surface of a probe at the trigger, in the colours of its stress.

    Parameters
    ----------
    field : TriggerField

    Returns
    -------
    SpaceChart
        The mesh with its displacement magnified, the highest stress as a point, and the forces on
        seats and tip as arrows.
    """
    mesh = field.elastic.mesh
    factor = magnification(field)
    bent = mesh.points + factor * field.displacement
    nodes, triangles = np.unique(mesh.boundary[:, :3], return_inverse=True)
    stress = nodal_stress(field)[nodes]
    highest = int(np.argmax(field.stress))
    place = bent[mesh.elements[highest]].mean(axis=0)
    most = value_text(float(field.stress[highest]), "MPa", decimals(1))
    part = mesh.region_names[mesh.regions[highest]]
    low = float(np.quantile(stress, _LOWEST))
    scale = Scale("von Mises stress", "MPa", low, float(stress.max()), logarithmic=True)
    marks: list[SpaceMark] = [
        SpaceMesh(bent[nodes], triangles.reshape(-1, 3), values=np.maximum(stress, low)),
        SpacePoints(place[None], f"highest: {most}, {part}", "limit", symbol="diamond", size=7.0),
        *_forces(field, factor),
    ]
    where = direction_words(field.trigger.directions)[0]
    note = (
        f"Displacements {number_text(factor, decimals(0))} times as large as they are. Arrows: "
        "forces on the tip and on the seats; they have a common scale."
    )
    push = field.trigger.directions[0]
    turn = float(np.degrees(np.arctan2(push[1], push[0]))) if np.hypot(*push[:2]) > 1e-9 else 0.0
    # Seen square to the push, where the bending shows.
    return SpaceChart(
        f"stress at the trigger, {where}", tuple(marks), "probe", scale=scale, note=note,
        elevation=15.0, azimuth=turn - 90.0,
    )  # fmt: skip


def magnification(field: TriggerField) -> float:
    """The power of ten by which displacements are drawn larger, so that they are seen."""
    largest = float(np.linalg.norm(field.displacement, axis=1).max())
    extent = float(np.ptp(field.elastic.mesh.points[:, 2]))
    return float(10.0 ** np.floor(np.log10(0.15 * extent / largest)))


def nodal_stress(field: TriggerField) -> FloatArray:
    """Von Mises stress at the nodes: the mean over the elements around each, (n,). [MPa]

    Parameters
    ----------
    field : TriggerField
    """
    mesh = field.elastic.mesh
    rows, each = mesh.elements.ravel(), mesh.elements.shape[1]
    count = len(mesh.points)
    total = np.bincount(rows, np.repeat(field.stress, each), count)
    return np.asarray(total / np.maximum(np.bincount(rows, minlength=count), 1))


def _forces(field: TriggerField, factor: float) -> list[SpaceMark]:
    """Arrows that end where the forces act; forces that are almost zero have none."""
    size = np.linalg.norm(field.forces, axis=1)
    length = 0.25 * float(np.ptp(field.elastic.mesh.points[:, 2])) / float(size[:7].max())
    marks: list[SpaceMark] = []
    for index in range(7):
        if size[index] < 1e-3 * size.max():
            continue
        vector = length * field.forces[index]
        name = f"tip {value_text(float(size[index]), 'N')}" if index == 6 else ""
        start = field.points[index] - vector
        if index == 6:
            start = start + factor * field.trigger.deflection[0]
        marks.append(SpaceArrow(start, vector, name, "series2" if index == 6 else "series1"))
    return marks
