"""Report and picture of a finite-element model of a probe and of its state at the trigger."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.directions import azimuth_angle, polar_angle
from pretravel.model.fem.condensation import ReducedModel
from pretravel.probe.seat_frame import SEAT_NAMES
from pretravel.report.document import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Section,
    Table,
)
from pretravel.report.formatting import decimals, number_text, significant, value_text
from pretravel.report.prediction_report import shares_table
from pretravel.report.style import COLOURS, legend_below, new_figure
from pretravel.trigger.elastic_field import StressByDirection, TriggerField
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_REGION_COLOURS = (
    "#8d99ae", "#52796f", "#bc6c25", "#e9c46a", "#a8dadc", "#d62828", "#6d597a", "#457b9d",
    "#f4a261", "#84a98c", "#e5989b", "#023047",
)  # fmt: skip


def finite_elements_document(
    reduced: ReducedModel, field: TriggerField, stresses: StressByDirection, *, probe_name: str
) -> Document:
    """The report of a finite-element model and of its state at the trigger.

    Parameters
    ----------
    reduced : ReducedModel
    field : TriggerField
        Of one direction.
    stresses : StressByDirection
        Of that direction first, then of others at its polar angle.
    probe_name : str

    Returns
    -------
    Document
    """
    trigger = field.trigger
    polar = value_text(float(polar_angle(trigger.directions)[0]) / DEGREE, "°", significant(6))
    azimuth = value_text(float(azimuth_angle(trigger.directions)[0]) / DEGREE, "°", significant(6))
    return Document(
        title=f"{probe_name}, finite elements",
        verdict=f"{probe_name}, finite elements, touched at polar {polar}, azimuth {azimuth}",
        figures=(
            KeyFigure("trigger force", float(trigger.force[0]), "N", decimals(4)),
            KeyFigure(
                "sensing distance", trigger.sensing_distance[0] / MICROMETRE, "µm", decimals(3)
            ),
            KeyFigure("pretravel", trigger.pretravel[0] / MICROMETRE, "µm", decimals(3)),
            KeyFigure("opened seat", " and ".join(field.opened)),
            _highest_stress(field),
        ),
        tables=(shares_table(trigger), *_stress_tables(stresses), _seat_table(field)),
        sections=(_mesh_section(reduced),),
        pictures=(
            Picture(
                "Mesh, stress at the trigger and forces of the seats",
                lambda: plot_trigger_field(field, probe_name),
            ),
        ),
    )


def _highest_stress(field: TriggerField) -> KeyFigure:
    mesh, highest = field.elastic.mesh, int(np.argmax(field.stress))
    center = tuple(mesh.points[mesh.elements[highest]].mean(axis=0).tolist())
    return KeyFigure(
        "highest stress",
        float(field.stress[highest]),
        "MPa",
        decimals(1),
        remark=f"von Mises, in {mesh.region_names[mesh.regions[highest]]} at "
        f"{value_text(center, 'mm')}",
    )


def _stress_tables(stresses: StressByDirection) -> tuple[Table, ...]:
    """The highest stress of each part: in the direction of the touch, and over the azimuths."""
    here, around = stresses.highest[0], stresses.highest[1:]
    azimuths = azimuth_angle(stresses.directions[1:]) / DEGREE % 360.0
    columns = [
        Column.of("part", stresses.parts),
        Column.of("at rest", stresses.rest, "MPa"),
        Column.of("at trigger", here, "MPa"),
        *(Column.of(f"{axis}", stresses.places[0, :, i], "mm") for i, axis in enumerate("xyz")),
    ]
    if len(around):
        worst = around.argmax(axis=0)
        columns.append(Column.of("largest", around.max(axis=0), "MPa"))
        columns.append(Column.of("at azimuth", azimuths[worst], "°", decimals(0)))
    by_part = Table(
        tuple(columns),
        title="Highest stress of each part",
        explanation="Von Mises, preload included, and where it is at the trigger of this touch; "
        "then the largest at the trigger over the azimuths, every 30° at the same polar angle. It "
        "is the mean over an element: at edges and seats it depends on the mesh.",
    )
    if not len(around):
        return (by_part,)
    by_azimuth = Table(
        (
            Column.of("azimuth", azimuths, "°", decimals(0)),
            *(Column.of(name, around[:, i], "MPa") for i, name in enumerate(stresses.parts)),
        ),
        title="Highest stress of each part at the trigger, over the azimuth",
        detail=True,
    )
    return by_part, by_azimuth


def _seat_table(field: TriggerField) -> Table:
    digits = decimals(4)
    return Table(
        (
            Column.of("seat", SEAT_NAMES),
            Column.of("at rest", field.rest_reactions, "N", digits),
            Column.of("at trigger", field.trigger.reactions[0], "N", digits),
        ),
        title="Forces of the seats",
        detail=True,
    )


def _mesh_section(reduced: ReducedModel) -> Section:
    return Section(
        "Mesh",
        figures=(
            KeyFigure("unknowns", f"{reduced.summary['unknowns']}, {reduced.summary['elements']}"),
            KeyFigure("quality", reduced.summary["quality"]),
            *(
                KeyFigure("" if row else "sizes", size)
                for row, size in enumerate(reduced.summary["refined"].split("; "))
            ),
        ),
        detail=True,
    )


def plot_trigger_field(field: TriggerField, title: str = "") -> Figure:
    """The mesh, the probe bent at the trigger with its stress, and the seats' forces.

    Parameters
    ----------
    field : TriggerField
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(13.0, 7.5, title)
    left, middle, right = figure.subplots(1, 3, width_ratios=[1.0, 1.15, 1.2])
    # Seen from the side that shows the bending, a little from above.
    push = field.trigger.directions[0, :2]
    azimuth = np.arctan2(push[1], push[0]) if np.hypot(*push) > 1e-9 else 0.0
    _draw_mesh(left, field, azimuth)
    _draw_bent(middle, field, azimuth)
    _draw_seat_forces(right, field)
    return figure


def _draw_mesh(axes: Axes, field: TriggerField, azimuth: float) -> None:
    """The mesh in the colours of its solids."""
    mesh = field.elastic.mesh
    region = np.full(len(mesh.points), -1)
    for index in range(len(mesh.region_names)):
        region[mesh.elements[mesh.regions == index]] = index
    corners = mesh.boundary[:, :3]
    colours = [_REGION_COLOURS[i % len(_REGION_COLOURS)] for i in region[corners].max(axis=1)]
    _draw_surface(axes, mesh.points[corners], azimuth, faces=colours)
    for index, name in enumerate(mesh.region_names):
        axes.plot([], [], "s", color=_REGION_COLOURS[index % len(_REGION_COLOURS)], label=name)
    legend_below(axes, 3)
    axes.set_title(f"{len(mesh.elements)} elements, {mesh.unknowns} unknowns", fontsize=10)


def _draw_bent(axes: Axes, field: TriggerField, azimuth: float) -> None:
    """The displaced mesh, magnified, in the colours of the stress at its nodes."""
    mesh = field.elastic.mesh
    total, count = np.zeros(len(mesh.points)), np.zeros(len(mesh.points))
    np.add.at(total, mesh.elements, np.repeat(field.stress[:, None], 10, axis=1))
    np.add.at(count, mesh.elements, 1.0)
    corners = mesh.boundary[:, :3]
    stress = (total / count)[corners].mean(axis=1)
    largest = float(np.linalg.norm(field.displacement, axis=1).max())
    extent = float(np.ptp(mesh.points[:, 2]))
    scale = 10.0 ** np.floor(np.log10(0.15 * extent / largest))
    bent = mesh.points + scale * field.displacement
    drawn = _draw_surface(axes, bent[corners], azimuth, values=stress)
    figure = axes.get_figure()
    assert figure is not None
    figure.colorbar(drawn, ax=axes, label="von Mises / MPa", shrink=0.6)
    axes.set_title(f"at the trigger, displacement x {scale:.0f}", fontsize=10)


def _draw_seat_forces(axes: Axes, field: TriggerField) -> None:
    """The forces of the seats at rest and at the trigger."""
    trigger, rows = field.trigger, np.arange(6)
    axes.barh(rows + 0.2, field.rest_reactions, 0.38, color=COLOURS[5], label="at rest")
    axes.barh(rows - 0.2, trigger.reactions[0], 0.38, color=COLOURS[1], label="at the trigger")
    for row, value in zip(rows, trigger.reactions[0].tolist(), strict=True):
        axes.annotate(number_text(value, decimals(3)), (max(value, 0.0), row - 0.2), xytext=(4, -3),
                      textcoords="offset points", fontsize=8)  # fmt: skip
    axes.set_yticks(rows, SEAT_NAMES)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.set_xlabel("seat force / N")
    force = value_text(float(trigger.force[0]), "N", decimals(3))
    distance = value_text(trigger.sensing_distance[0] / MICROMETRE, "µm")
    axes.set_title(
        f"trigger at {force}, {' and '.join(field.opened)} opens\nsensing distance {distance}",
        fontsize=10,
    )
    axes.legend(fontsize=8)


def _draw_surface(
    axes: Axes,
    triangles: FloatArray,
    azimuth: float,
    *,
    faces: Sequence[str] = (),
    values: FloatArray | None = None,
) -> Any:
    """Outer triangles, far ones first, seen square to the azimuth from 20° above.

    They have the colours of `faces`, shaded, or those of `values` on a logarithmic scale.
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import LogNorm, to_rgb

    towards = azimuth - 0.5 * np.pi
    across = np.array([-np.sin(towards), np.cos(towards), 0.0])
    eye = np.array([np.cos(towards) * np.cos(0.35), np.sin(towards) * np.cos(0.35), np.sin(0.35)])
    up = np.cross(eye, across)
    order = np.argsort(triangles.mean(axis=1) @ eye)
    flat = list(np.stack([triangles @ across, triangles @ up], axis=-1)[order])
    if values is not None:
        floor = max(float(np.percentile(values, 5)), 1e-6)
        drawn = PolyCollection(flat, array=np.maximum(values, floor)[order], cmap="viridis",
                               norm=LogNorm(floor, float(values.max())), edgecolors="face",
                               linewidths=0.2)  # fmt: skip
    else:
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        light = np.abs(normal @ eye) / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)
        shaded = np.array([to_rgb(c) for c in faces]) * (0.45 + 0.55 * light[:, None])
        drawn = PolyCollection(flat, facecolors=shaded[order], edgecolors="#00000055",
                               linewidths=0.15)  # fmt: skip
    axes.add_collection(drawn)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_axis_off()
    return drawn
