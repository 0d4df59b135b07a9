"""Pictures: results in, matplotlib figures out. Nothing else imports matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.compensation.compensation import Points
from pretravel.directions import azimuth_angle, polar_angle
from pretravel.probe.description import Probe
from pretravel.probe.seat_frame import SEAT_NAMES
from pretravel.report.style import COLOURS as COLOURS
from pretravel.report.style import legend_below, new_figure, polar_axes
from pretravel.report.style import save as save
from pretravel.touches import Touches
from pretravel.trigger.elastic_field import TriggerField
from pretravel.trigger.friction import FrictionCycle
from pretravel.trigger.predict import Trigger
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot_probe(probe: Probe) -> Figure:
    """A described probe to scale: from the side, and its seats from the spindle.

    Parameters
    ----------
    probe : Probe

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.patches import Circle, Rectangle

    figure = new_figure(10.0, 6.0)
    figure.suptitle(probe.name)
    side, top = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2)
    rod, ball = probe.tripod.rod_radius, probe.seats.ball_radius
    radius = probe.tripod.radius
    side.add_patch(Rectangle((-radius, -rod), 2 * radius, 2 * rod, fc="#c9d6df", ec="k", lw=0.6))
    side.plot([0, 0], [-rod, -probe.hub_offset], color="k", lw=1.0, ls=":")
    side.annotate("hub (rigid)", (0.0, -0.5 * probe.hub_offset), xytext=(6, 0), fontsize=8,
                  textcoords="offset points")  # fmt: skip
    height = -probe.hub_offset
    for colour, segment in zip(COLOURS * 4, probe.stylus, strict=False):
        side.add_patch(
            Rectangle((-0.5 * segment.diameter, height - segment.length), segment.diameter,
                      segment.length, fc=colour, ec="k", lw=0.6, alpha=0.6)
        )  # fmt: skip
        side.annotate(
            f"{segment.length:g} mm, Ø {segment.diameter:g}, {segment.material.name}",
            (0.5 * segment.diameter, height - 0.5 * segment.length),
            xytext=(8, 0), textcoords="offset points", va="center", fontsize=8,
        )  # fmt: skip
        height -= segment.length
    side.add_patch(Circle((0.0, -probe.lever), probe.tip.radius, fc="#9b2226", ec="k", lw=0.6))
    side.annotate(f"tip Ø {2 * probe.tip.radius:g}, {probe.tip.material.name}",
                  (probe.tip.radius, -probe.lever), xytext=(8, 0), va="center", fontsize=8,
                  textcoords="offset points")  # fmt: skip
    side.set_ylim(-probe.lever - 3.0 * probe.tip.radius, 4.0 * rod)
    side.set_xlim(-1.3 * radius, max(1.3 * radius, 0.7 * probe.lever))
    side.set_title(f"side, lever {probe.lever:g} mm, preload {probe.preload:g} N", fontsize=10)

    angle = probe.seats.support_angle
    apart = (rod + ball) * np.cos(angle)
    for name, azimuth in zip("ABC", probe.tripod.rod_azimuths, strict=True):
        outward = np.array([np.cos(azimuth), np.sin(azimuth)])
        across = np.array([-outward[1], outward[0]])
        end = (radius + 2.0 * ball) * outward
        top.plot([0, end[0]], [0, end[1]], color="#7d8f9b", lw=5, solid_capstyle="round", zorder=1)
        for sign in (1.0, -1.0):
            center = radius * outward + sign * apart * across
            top.add_patch(Circle((center[0], center[1]), ball, fc="#ca6702", ec="k", lw=0.6))
        top.annotate(name, tuple(1.22 * end), ha="center", va="center", fontsize=10)
    reach = 1.5 * (radius + 2.0 * ball)
    top.set_xlim(-reach, reach)
    top.set_ylim(-reach, reach)
    top.set_title("rods and seats, from the spindle", fontsize=10)
    for axes in (side, top):
        axes.set_aspect("equal")
        axes.set_xlabel("x / mm")
    side.set_ylabel("z / mm")
    top.set_ylabel("y / mm")
    return figure


def plot_prediction(trigger: Trigger, title: str = "") -> Figure:
    """Trigger force and pretravel over azimuth, one line per polar angle; shares beside.

    Parameters
    ----------
    trigger : Trigger
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(13.0, 4.8)
    figure.suptitle(title or f"Prediction, model {trigger.model}")
    polar = np.round(polar_angle(trigger.directions) / DEGREE, 6)
    azimuth = azimuth_angle(trigger.directions)
    levels = np.unique(polar)[::-1]
    around = levels[levels > 0.0]  # at the pole there is no azimuth to draw over
    shown = around[np.unique(np.linspace(0, len(around) - 1, min(len(around), 6)).astype(int))]
    titles = ["trigger force / N", "pretravel / µm"]
    at_pole = np.flatnonzero(polar == 0.0)[:1]
    for i, values in enumerate((trigger.force, trigger.pretravel / MICROMETRE)):
        titles[i] += "".join(f" (at the pole {values[row]:.2f})" for row in at_pole)
    force = polar_axes(figure, 1, 3, 1, titles[0])
    travel = polar_axes(figure, 1, 3, 2, titles[1])
    for colour, level in zip(COLOURS, shown, strict=False):
        rows = np.flatnonzero(polar == level)
        rows = rows[np.argsort(azimuth[rows])]
        if len(rows) > 2 and np.ptp(azimuth[rows]) > 300.0 * DEGREE:
            rows = np.append(rows, rows[0])
        marker = "." if len(rows) < 20 else ""
        style: dict[str, Any] = {"color": colour, "lw": 1.6, "marker": marker}
        force.plot(azimuth[rows], trigger.force[rows], label=f"polar {level:g}°", **style)
        travel.plot(azimuth[rows], trigger.pretravel[rows] / MICROMETRE, **style)
    for axes in (force, travel):
        axes.set_ylim(bottom=0.0, top=None if len(shown) else 1.0)
    if len(shown):
        legend_below(force, 3)
    shares = figure.add_subplot(1, 3, 3)
    mean = {
        name: np.array([share[polar == level].mean() for level in levels]) / MICROMETRE
        for name, share in trigger.shares.items()
    }
    shares.stackplot(
        levels,
        *mean.values(),
        labels=[name.replace("_", " ") for name in mean],
        colors=COLOURS,
    ) if len(levels) > 1 else shares.bar(
        [name.replace("_", "\n") for name in mean],
        [values[0] for values in mean.values()],
        color=COLOURS[: len(mean)],
    )
    shares.set_ylabel("mean pretravel / µm")
    shares.set_title("what gives", fontsize=11)
    if len(levels) > 1:
        shares.set_xlabel("polar angle / °")
        shares.legend(fontsize=8, loc="upper left")
    return figure


def plot_points(points: Points, title: str = "") -> Figure:
    """Where the points are, coloured by deviation (or pretravel), and their uncertainty.

    Parameters
    ----------
    points : Points
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(12.0, 4.6)
    figure.suptitle(title or "Compensated points")
    first, second = _widest_axes(points.positions)
    panels: list[tuple[str, FloatArray, str]] = [
        ("pretravel / µm", points.pretravel / MICROMETRE, "viridis"),
        ("standard uncertainty u / µm", points.standard_uncertainty / MICROMETRE, "magma"),
    ]
    if points.deviation is not None:
        panels.insert(0, ("deviation from nominal / µm", points.deviation / MICROMETRE, "RdBu_r"))
    for index, (name, values, colours) in enumerate(panels, start=1):
        axes = figure.add_subplot(1, len(panels), index)
        limit = float(np.max(np.abs(values))) if colours == "RdBu_r" else None
        _scatter(axes, points.positions, first, second, values, colours, limit, name)
    return figure


def plot_touches(touches: Touches, travel: FloatArray, title: str = "") -> Figure:
    """Simulated touches: where they are, and pretravel over their azimuth.

    Parameters
    ----------
    touches : Touches
    travel : (n,) float
        From first contact to the latched point. [mm]
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 4.6)
    figure.suptitle(title or "Simulated touches")
    first, second = _widest_axes(touches.positions)
    place = figure.add_subplot(1, 2, 1)
    _scatter(
        place,
        touches.positions,
        first,
        second,
        travel / MICROMETRE,
        "viridis",
        None,
        "travel since first contact / µm",
    )
    diagram = polar_axes(figure, 1, 2, 2, "travel / µm over azimuth of n")
    points = diagram.scatter(
        azimuth_angle(touches.normals),
        travel / MICROMETRE,
        c=polar_angle(touches.normals) / DEGREE,
        s=12,
        cmap="plasma",
    )
    diagram.set_ylim(bottom=0.0 if travel.min() >= 0.0 else None)
    figure.colorbar(points, ax=diagram, shrink=0.75, pad=0.12, label="polar angle of n / °")
    return figure


def plot_ring_kinds(
    azimuth: FloatArray, observed: FloatArray, kinds: Mapping[str, FloatArray], title: str
) -> Figure:
    """Pretravel on a ring and what several kinds of map make of it.

    Parameters
    ----------
    azimuth : (n,) float
        [rad]
    observed : (n,) float
        [mm]
    kinds : mapping of str to (n,) float
        Map values. [mm]
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 4.8)
    figure.suptitle(title)
    diagram = polar_axes(figure, 1, 2, 1, "pretravel / µm")
    order = np.append(np.argsort(azimuth), np.argsort(azimuth)[0])
    diagram.plot(azimuth, observed / MICROMETRE, "k.", ms=4, label="measured")
    left = figure.add_subplot(1, 2, 2)
    for colour, (name, values) in zip(COLOURS, kinds.items(), strict=False):
        diagram.plot(azimuth[order], values[order] / MICROMETRE, color=colour, lw=1.4, label=name)
        residual = (observed - values) / MICROMETRE
        left.plot(
            azimuth[order[:-1]] / DEGREE,
            residual[order[:-1]],
            color=colour,
            lw=1.2,
            label=f"{name}: {residual.std():.1f} µm",
        )
    diagram.set_ylim(bottom=0.0)
    legend_below(diagram, 4)
    left.axhline(0.0, color="k", lw=0.6)
    left.set_xlabel("azimuth / °")
    left.set_ylabel("left over / µm")
    left.set_title("what is left (standard deviation)", fontsize=11)
    left.legend(fontsize=8)
    return figure


def _widest_axes(positions: FloatArray) -> tuple[int, int]:
    order = np.argsort(np.ptp(positions, axis=0), kind="stable")[::-1][:2]
    first, second = sorted(order.tolist())
    return int(first), int(second)


def _scatter(
    axes: Axes,
    positions: FloatArray,
    first: int,
    second: int,
    values: FloatArray,
    colours: str,
    limit: float | None,
    name: str,
) -> None:
    drawn = axes.scatter(
        positions[:, first],
        positions[:, second],
        c=values,
        cmap=colours,
        vmin=None if limit is None else -limit,
        vmax=limit,
        s=28,
        edgecolors="0.3",
        linewidths=0.3,
    )
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel(f"{'xyz'[first]} / mm")
    axes.set_ylabel(f"{'xyz'[second]} / mm")
    axes.set_title(name, fontsize=10)
    figure = axes.get_figure()
    assert figure is not None
    figure.colorbar(drawn, ax=axes, location="bottom", shrink=0.9, aspect=30)


_REGION_COLOURS = (
    "#8d99ae", "#52796f", "#bc6c25", "#e9c46a", "#a8dadc", "#d62828", "#6d597a", "#457b9d",
    "#f4a261", "#84a98c", "#e5989b", "#023047",
)  # fmt: skip


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
    mesh, trigger = field.elastic.mesh, field.trigger
    figure = new_figure(13.0, 7.5)
    left, middle, right = figure.subplots(1, 3, width_ratios=[1.0, 1.15, 1.2])
    # Seen from the side that shows the bending, a little from above.
    push = trigger.directions[0, :2]
    azimuth = np.arctan2(push[1], push[0]) if np.hypot(*push) > 1e-9 else 0.0
    region = np.full(len(mesh.points), -1)
    for index in range(len(mesh.region_names)):
        region[mesh.elements[mesh.regions == index]] = index
    corners = mesh.boundary[:, :3]
    colours = [_REGION_COLOURS[i % len(_REGION_COLOURS)] for i in region[corners].max(axis=1)]
    _draw_surface(left, mesh.points, corners, azimuth, faces=colours)
    for index, name in enumerate(mesh.region_names):
        left.plot([], [], "s", color=_REGION_COLOURS[index % len(_REGION_COLOURS)], label=name)
    legend_below(left, 3)
    left.set_title(f"{len(mesh.elements)} elements, {mesh.unknowns} unknowns", fontsize=10)
    total, count = np.zeros(len(mesh.points)), np.zeros(len(mesh.points))
    np.add.at(total, mesh.elements, np.repeat(field.stress[:, None], 10, axis=1))
    np.add.at(count, mesh.elements, 1.0)
    stress = (total / count)[corners].mean(axis=1)
    largest = float(np.linalg.norm(field.displacement, axis=1).max())
    extent = float(np.ptp(mesh.points[:, 2]))
    scale = 10.0 ** np.floor(np.log10(0.15 * extent / largest))
    drawn = _draw_surface(
        middle, mesh.points + scale * field.displacement, corners, azimuth, values=stress
    )
    figure.colorbar(drawn, ax=middle, label="von Mises / MPa", shrink=0.6)
    middle.set_title(f"at the trigger, displacement x {scale:.0f}", fontsize=10)
    rows = np.arange(6)
    right.barh(rows + 0.2, field.rest_reactions, 0.38, color=COLOURS[5], label="at rest")
    right.barh(rows - 0.2, trigger.reactions[0], 0.38, color=COLOURS[1], label="at the trigger")
    for row, value in zip(rows, trigger.reactions[0], strict=True):
        right.annotate(
            f"{value:.3f}",
            (max(value, 0.0), row - 0.2),
            xytext=(4, -3),
            textcoords="offset points",
            fontsize=8,
        )
    right.set_yticks(rows, SEAT_NAMES)
    right.invert_yaxis()
    right.margins(x=0.12)
    right.set_xlabel("seat force / N")
    right.set_title(
        f"trigger at {trigger.force[0]:.3f} N, {' and '.join(field.opened)} opens\n"
        f"sensing distance {trigger.sensing_distance[0] / MICROMETRE:.2f} µm",
        fontsize=10,
    )
    right.legend(fontsize=8)
    figure.suptitle(title)
    return figure


def plot_friction(cycle: FrictionCycle, title: str = "") -> Figure:
    """Force over deflection, and what it costs in each direction.

    Parameters
    ----------
    cycle : FrictionCycle
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(12.0, 5.2)
    loops, bars = figure.subplots(1, 2, width_ratios=[1.2, 1.0])
    azimuth = np.mod(azimuth_angle(cycle.directions) / DEGREE, 360.0)
    polar = polar_angle(cycle.directions) / DEGREE
    # Directions that symmetry makes alike are drawn once; of the others at most four.
    _, different = np.unique(np.round(cycle.trigger_force[:, -1], 4), return_index=True)
    shown = different[np.unique(np.linspace(0, len(different) - 1, 4).astype(int))]
    for place, row in enumerate(shown):
        loops.plot(
            cycle.deflection[row] / MICROMETRE,
            cycle.force[row],
            lw=1.2,
            color=COLOURS[place],
            label=f"polar {polar[row]:.0f}°, azimuth {azimuth[row]:.0f}°",
        )
        loops.plot(
            cycle.trigger_deflection[row] / MICROMETRE,
            cycle.trigger_force[row],
            "o",
            ms=4,
            color=COLOURS[place],
        )
    loops.set_xlabel("deflection along the normal / µm")
    loops.set_ylabel("force on the tip / N")
    loops.set_title("touch and return; dots: a seat opens", fontsize=10)
    loops.legend(fontsize=8)
    rows, last = np.arange(len(azimuth)), cycle.trigger_force.shape[1] - 1
    bars.bar(
        rows - 0.27,
        cycle.hysteresis[:, last] / MICROMETRE,
        0.27,
        color=COLOURS[0],
        label=f"trigger hysteresis, touch {last + 1}",
    )
    bars.bar(
        rows,
        cycle.zero_drift[:, 0] / MICROMETRE,
        0.27,
        color=COLOURS[1],
        label="zero drift after touch 1",
    )
    bars.bar(
        rows + 0.27,
        cycle.zero_drift[:, last] / MICROMETRE,
        0.27,
        color=COLOURS[2],
        label=f"zero drift after touch {last + 1}",
    )
    bars.set_xticks(
        rows,
        [f"{p:.0f}/{a:.0f}" for p, a in zip(polar, azimuth, strict=True)],
        rotation=90,
        fontsize=7,
    )
    bars.set_xlabel("polar / azimuth in degrees")
    bars.set_ylabel("µm")
    bars.axhline(0.0, color="k", lw=0.6)
    bars.margins(y=0.25)
    bars.legend(fontsize=8)
    figure.suptitle(title)
    return figure


def _draw_surface(
    axes: Axes,
    points: FloatArray,
    corners: Any,
    azimuth: float,
    *,
    faces: Sequence[str] | None = None,
    values: FloatArray | None = None,
) -> Any:
    """Outer triangles, far ones first, seen square to the azimuth from 20° above."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import LogNorm, to_rgb

    towards = azimuth - 0.5 * np.pi
    across = np.array([-np.sin(towards), np.cos(towards), 0.0])
    eye = np.array([np.cos(towards) * np.cos(0.35), np.sin(towards) * np.cos(0.35), np.sin(0.35)])
    up = np.cross(eye, across)
    triangles = points[corners]
    flat = np.stack([triangles @ across, triangles @ up], axis=-1)
    order = np.argsort(triangles.mean(axis=1) @ eye)
    if values is not None:
        floor = max(float(np.percentile(values, 5)), 1e-6)
        drawn = PolyCollection(
            list(flat[order]),
            array=np.maximum(values, floor)[order],
            cmap="viridis",
            norm=LogNorm(floor, float(values.max())),
            edgecolors="face",
            linewidths=0.2,
        )
    else:
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        light = np.abs(normal @ eye) / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)
        shaded = np.array([to_rgb(c) for c in faces or ()]) * (0.45 + 0.55 * light[:, None])
        drawn = PolyCollection(
            list(flat[order]), facecolors=shaded[order], edgecolors="#00000055", linewidths=0.15
        )
    axes.add_collection(drawn)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_axis_off()
    return drawn
