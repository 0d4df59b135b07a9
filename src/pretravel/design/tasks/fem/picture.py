"""Pictures of a finite-element model: its stress at the trigger, its solids, forces of seats."""

from __future__ import annotations

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, IntArray
from pretravel.design.fem.elastic_field import TriggerField
from pretravel.show import (
    Axis,
    Bars,
    PlaneChart,
    Scale,
    SpaceArrow,
    SpaceChart,
    SpaceMark,
    SpaceMesh,
    SpaceNotes,
    SpacePoints,
    View,
    decimals,
    magnification,
    number_text,
    series,
    value_text,
)
from pretravel.six_seats import SEAT_NAMES

_TIP = 6
"""Row of the tip in `TriggerField.points`, after the six seats."""
_DECADES = 3.0
"""Lower stress than this many powers of ten below the highest has the lowest colour."""


def trigger_field_view(field: TriggerField, title: str = "") -> View:
    """The probe bent at the trigger with its stress, its solids and seats, the seats' forces."""
    return View(title, (_bent(field), _solids(field), _seat_forces(field)))


def _bent(field: TriggerField) -> SpaceChart:
    """The displaced mesh, magnified, in the colours of the stress, with its maximum."""
    mesh = field.elastic.mesh
    factor = magnification(mesh.points, np.linalg.norm(field.displacement, axis=1))
    moved = mesh.points + factor * field.displacement
    rows, triangles = _surface(mesh.boundary[:, :3])
    highest = int(np.argmax(field.stress))
    place = mesh.points[mesh.elements[highest]].mean(axis=0)
    value = value_text(float(field.stress[highest]), "MPa", decimals(1))
    where = (
        f"{mesh.region_names[mesh.regions[highest]]} at {value_text(tuple(place.tolist()), 'mm')}"
    )
    top = float(field.stress[highest])
    scale = Scale("von Mises stress", "MPa", top / 10.0**_DECADES, top, logarithmic=True)
    marks: tuple[SpaceMark, ...] = (
        SpaceMesh(moved[rows], triangles, values=_stress_at_nodes(field)[rows]),
        SpacePoints(moved[mesh.elements[highest]].mean(axis=0)[None], f"highest: {value}", "limit",
                    None, "diamond", 7.0, (f"{value} in {where}",)),
        _force_arrow(field, moved),
    )  # fmt: skip
    return SpaceChart(
        f"stress, displacement magnified {factor:g} times",
        marks,
        "probe",
        scale=scale,
        elevation=15.0,
        azimuth=_view_azimuth(field),
        note=f"highest stress of the bodies {value} in {where}",
    )


def _stress_at_nodes(field: TriggerField) -> FloatArray:
    """Mean of the elements around each node. [MPa]"""
    mesh = field.elastic.mesh
    total, count = np.zeros(len(mesh.points)), np.zeros(len(mesh.points))
    np.add.at(total, mesh.elements, np.repeat(field.stress[:, None], mesh.elements.shape[1], 1))
    np.add.at(count, mesh.elements, 1.0)
    return np.asarray(total / np.maximum(count, 1.0))


def _solids(field: TriggerField) -> SpaceChart:
    """The mesh in the colours of its solids, with the seats."""
    mesh = field.elastic.mesh
    region = np.full(len(mesh.points), -1)
    for index in range(len(mesh.region_names)):
        region[mesh.elements[mesh.regions == index]] = index
    corners = mesh.boundary[:, :3]
    owner = region[corners].max(axis=1)
    marks: list[SpaceMark] = []
    for index, name in enumerate(mesh.region_names):
        rows, triangles = _surface(corners[owner == index])
        if len(triangles):
            marks.append(SpaceMesh(mesh.points[rows], triangles, name, series(index), opacity=0.8))
    labels = tuple(
        f"seat {name}: {value_text(float(rest), 'N', decimals(3))} at rest, "
        f"{value_text(float(now), 'N', decimals(3))} at the trigger"
        for name, rest, now in zip(
            SEAT_NAMES, field.rest_reactions, field.trigger.reactions[0], strict=True
        )
    )
    seats = field.points[:_TIP]
    middle, pairs = seats.mean(axis=0), 0.5 * (seats[::2] + seats[1::2])
    marks += [
        SpacePoints(seats, "seats", "ink", None, "dot", 4.0, labels),
        SpaceNotes(middle + 1.3 * (pairs - middle), tuple(name[0] for name in SEAT_NAMES[::2])),
        _force_arrow(field, mesh.points),
    ]
    force = float(np.linalg.norm(field.forces[_TIP]))
    title = (
        f"force on the tip {value_text(force, 'N', decimals(3))}; {len(mesh.elements)} elements, "
        f"{mesh.unknowns} unknowns"
    )
    return SpaceChart(title, tuple(marks), "probe", elevation=15.0, azimuth=_view_azimuth(field))


def _force_arrow(field: TriggerField, points: FloatArray) -> SpaceArrow:
    """The force on the tip, up to the ball."""
    force = field.forces[_TIP]
    size = float(np.linalg.norm(force))
    along = force / max(size, 1e-12)
    mesh = field.elastic.mesh
    rest = field.points[_TIP]
    nearest = int(np.argmin(np.linalg.norm(mesh.points - rest, axis=1)))
    tip = rest + points[nearest] - mesh.points[nearest]
    length = 0.2 * float(np.ptp(mesh.points, axis=0).max())
    return SpaceArrow(tip - 1.25 * length * along, length * along, "force")


def _view_azimuth(field: TriggerField) -> float:
    """Square to the direction of the touch, so that the bending is seen. [deg]"""
    push = field.trigger.directions[0, :2]
    azimuth = np.arctan2(push[1], push[0]) if np.hypot(*push) > 1e-9 else 0.0
    return float(np.degrees(azimuth)) - 75.0


def _surface(corners: IntArray) -> tuple[IntArray, IntArray]:
    """The nodes that triangles use, and the triangles as rows of these."""
    rows, triangles = np.unique(corners, return_inverse=True)
    return rows, np.asarray(triangles).reshape(corners.shape)


def _seat_forces(field: TriggerField) -> PlaneChart:
    """The forces of the seats at rest and at the trigger."""
    trigger, rows = field.trigger, np.arange(6.0)
    texts = tuple(number_text(value, decimals(3)) for value in trigger.reactions[0].tolist())
    distance = value_text(trigger.sensing_distance[0] / MICROMETRE, "µm")
    high = 1.2 * float(max(field.rest_reactions.max(), trigger.reactions[0].max()))
    low = min(0.0, 1.2 * float(trigger.reactions[0].min()))
    return PlaneChart(
        f"forces of the seats, open: {' and '.join(field.opened) or 'none'}",
        Axis("force", "N", low, high),
        Axis("seat", categories=SEAT_NAMES),
        (
            Bars(rows - 0.2, field.rest_reactions, "at rest", "reference", 0.38, horizontal=True),
            Bars(rows + 0.2, trigger.reactions[0], "at the trigger", "series2", 0.38,
                 horizontal=True, texts=texts),
        ),
        note=f"sensing distance {distance}",
    )  # fmt: skip
