"""The catalogue of probes as a table, and a probe as a drawing."""

from __future__ import annotations

from collections.abc import Mapping

from pretravel.base import DEGREE
from pretravel.design.tasks.probes.view import probe_view
from pretravel.prediction import Probe, seat_doubts
from pretravel.show import Column, Document, KeyFigure, Picture, Table, decimals, significant


def catalogue_document(probes: Mapping[str, Probe]) -> Document:
    """The probes of a catalogue."""
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
    """The description of a probe."""
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
        warnings=seat_doubts(probe),
    )  # fmt: skip


def probe_picture(probe: Probe) -> Picture:
    """The drawing of a probe."""
    return Picture(f"{probe.name}: the probe as described, to scale", lambda: probe_view(probe))
