"""The catalogue of probes as a table, and a probe as a drawing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from pretravel.probe.description import Probe
from pretravel.report.document import Column, Document, KeyFigure, Picture, Table
from pretravel.report.formatting import decimals, significant
from pretravel.report.style import COLOURS, new_figure
from pretravel.units import DEGREE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def catalogue_document(probes: Mapping[str, Probe]) -> Document:
    """The probes of a catalogue.

    Parameters
    ----------
    probes : mapping of str to Probe

    Returns
    -------
    Document
    """
    described = list(probes.values())
    number = significant(6)
    return Document(
        title="The catalogue of probes",
        tables=(
            Table(
                (
                    Column.of("name", probes),
                    Column.of("preload", [probe.preload for probe in described], "N", number),
                    Column.of("lever", [probe.lever for probe in described], "mm", number),
                    Column.of("stylus", [probe.stylus_length for probe in described], "mm", number),
                    Column.of("tip", [2.0 * probe.tip.radius for probe in described], "mm", number),
                    Column.of("stem", [probe.stem.material.name for probe in described]),
                )
            ),
        ),
    )


def probe_document(probe: Probe) -> Document:
    """The description of a probe.

    Parameters
    ----------
    probe : Probe

    Returns
    -------
    Document
    """
    number = significant(6)
    return Document(
        title=probe.name,
        verdict=f"{probe.name}: a valid description",
        figures=(
            KeyFigure("preload", probe.preload, "N", number),
            KeyFigure("lever", probe.lever, "mm", number),
            KeyFigure("tripod radius", probe.tripod.radius, "mm", number),
            KeyFigure("support angle", probe.seats.support_angle / DEGREE, "°", number),
            KeyFigure("tip", 2.0 * probe.tip.radius, "mm", number, remark="diameter"),
        ),
        tables=(
            Table(
                (
                    Column.of("part of the stylus", range(1, len(probe.stylus) + 1),
                              digits=decimals(0)),
                    Column.of("length", [part.length for part in probe.stylus], "mm", number),
                    Column.of("diameter", [part.diameter for part in probe.stylus], "mm", number),
                    Column.of("material", [part.material.name for part in probe.stylus]),
                ),
                title="Stylus, from the hub to the tip",
            ),
        ),
        pictures=(probe_picture(probe),),
    )  # fmt: skip


def probe_picture(probe: Probe) -> Picture:
    """The drawing of a probe."""
    return Picture(probe.name, lambda: plot_probe(probe))


def plot_probe(probe: Probe) -> Figure:
    """A described probe to scale: from the side, and its seats from the spindle.

    Parameters
    ----------
    probe : Probe

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(10.0, 6.0, probe.name)
    side, top = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2)
    _draw_side(side, probe)
    _draw_seats(top, probe)
    for axes in (side, top):
        axes.set_aspect("equal")
        axes.set_xlabel("x / mm")
    side.set_ylabel("z / mm")
    top.set_ylabel("y / mm")
    return figure


def _draw_side(axes: Axes, probe: Probe) -> None:
    """Tripod, hub, stylus and tip from the side."""
    from matplotlib.patches import Circle, Rectangle

    def remark(text: str, x: float, z: float, away: float = 8.0) -> None:
        axes.annotate(text, (x, z), xytext=(away, 0), textcoords="offset points", va="center",
                      fontsize=8)  # fmt: skip

    rod, radius, tip = probe.tripod.rod_radius, probe.tripod.radius, probe.tip.radius
    axes.add_patch(Rectangle((-radius, -rod), 2 * radius, 2 * rod, fc="#c9d6df", ec="k", lw=0.6))
    axes.plot([0, 0], [-rod, -probe.hub_offset], color="k", lw=1.0, ls=":")
    remark("hub (rigid)", 0.0, -0.5 * probe.hub_offset, 6.0)
    height = -probe.hub_offset
    for colour, segment in zip(COLOURS * 4, probe.stylus, strict=False):
        corner = (-0.5 * segment.diameter, height - segment.length)
        axes.add_patch(
            Rectangle(
                corner, segment.diameter, segment.length, fc=colour, ec="k", lw=0.6, alpha=0.6
            )
        )
        remark(
            f"{segment.length:g} mm, Ø {segment.diameter:g}, {segment.material.name}",
            0.5 * segment.diameter, height - 0.5 * segment.length,
        )  # fmt: skip
        height -= segment.length
    axes.add_patch(Circle((0.0, -probe.lever), tip, fc="#9b2226", ec="k", lw=0.6))
    remark(f"tip Ø {2 * tip:g}, {probe.tip.material.name}", tip, -probe.lever)
    axes.set_ylim(-probe.lever - 3.0 * tip, 4.0 * rod)
    axes.set_xlim(-1.3 * radius, max(1.3 * radius, 0.7 * probe.lever))
    axes.set_title(f"side, lever {probe.lever:g} mm, preload {probe.preload:g} N", fontsize=10)


def _draw_seats(axes: Axes, probe: Probe) -> None:
    """Rods and seat balls as seen from the spindle."""
    from matplotlib.patches import Circle

    rod, ball, radius = probe.tripod.rod_radius, probe.seats.ball_radius, probe.tripod.radius
    apart = (rod + ball) * np.cos(probe.seats.support_angle)
    for name, azimuth in zip("ABC", probe.tripod.rod_azimuths, strict=True):
        outward = np.array([np.cos(azimuth), np.sin(azimuth)])
        across = np.array([-outward[1], outward[0]])
        end = (radius + 2.0 * ball) * outward
        axes.plot([0, end[0]], [0, end[1]], color="#7d8f9b", lw=5, solid_capstyle="round", zorder=1)
        for sign in (1.0, -1.0):
            center = radius * outward + sign * apart * across
            axes.add_patch(Circle((center[0], center[1]), ball, fc="#ca6702", ec="k", lw=0.6))
        axes.annotate(name, tuple(1.22 * end), ha="center", va="center", fontsize=10)
    reach = 1.5 * (radius + 2.0 * ball)
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_title("rods and seats, from the spindle", fontsize=10)
