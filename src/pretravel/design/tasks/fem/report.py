"""Report and picture of a finite-element model of a probe and of its state at the trigger."""

from __future__ import annotations

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, azimuth_angle, polar_angle
from pretravel.design.contact_stress import ContactStress
from pretravel.design.fem.condensation import ReducedModel
from pretravel.design.fem.elastic_field import StressByDirection, TriggerField
from pretravel.design.tasks.fem.picture import trigger_field_view
from pretravel.design.tasks.predict.report import shares_table
from pretravel.show import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Section,
    Table,
    decimals,
    significant,
    value_text,
)
from pretravel.six_seats import SEAT_NAMES


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
    """
    trigger = field.trigger
    polar = value_text(float(polar_angle(trigger.directions)[0]) / DEGREE, "°", significant(6))
    azimuth = value_text(float(azimuth_angle(trigger.directions)[0]) / DEGREE, "°", significant(6))
    return Document(
        title=f"{probe_name}, finite elements",
        verdict=f"{probe_name}, finite elements: touched at polar {polar}, azimuth {azimuth} it "
        f"triggers after {value_text(float(trigger.pretravel[0]) / MICROMETRE, 'µm', decimals(3))} "
        f"at {value_text(float(trigger.force[0]), 'N', decimals(3))}",
        figures=(
            KeyFigure("trigger force", float(trigger.force[0]), "N", decimals(4)),
            KeyFigure(
                "sensing distance", trigger.sensing_distance[0] / MICROMETRE, "µm", decimals(3)
            ),
            KeyFigure("pretravel", trigger.pretravel[0] / MICROMETRE, "µm", decimals(3)),
            KeyFigure("opened seat", " and ".join(field.opened) or "none"),
            _highest_stress(field),
            *contact_figures(field),
        ),
        tables=(shares_table(trigger), *_stress_tables(stresses), _contact_table(field)),
        sections=(_mesh_section(reduced),),
        pictures=(
            Picture(
                "Stress at the trigger, solids and seats, forces of the seats",
                lambda: trigger_field_view(field, probe_name),
            ),
        ),
    )


def _highest_stress(field: TriggerField) -> KeyFigure:
    mesh, highest = field.elastic.mesh, int(np.argmax(field.stress))
    center = tuple(mesh.points[mesh.elements[highest]].mean(axis=0).tolist())
    return KeyFigure(
        "highest stress of the bodies",
        float(field.stress[highest]),
        "MPa",
        decimals(1),
        remark=f"von Mises, in {mesh.region_names[mesh.regions[highest]]} at "
        f"{value_text(center, 'mm')}",
    )


def contact_figures(field: TriggerField) -> tuple[KeyFigure, KeyFigure]:
    """The pressure of the seat that carries most, and of tip and part, with their limits."""
    seat = int(np.argmax(field.seats.pressure))
    rest = value_text(float(field.seats_at_rest.pressure.max()), "MPa", decimals(0))
    return (
        KeyFigure("highest pressure of a seat", float(field.seats.pressure[seat]), "MPa",
                  decimals(0), remark=f"{SEAT_NAMES[seat]}, at rest {rest}; "
                  f"{_shear_words(field.seats, seat)}"),
        KeyFigure("pressure of tip and part", float(field.tip.pressure[0]), "MPa", decimals(0),
                  remark=_shear_words(field.tip, 0)),
    )  # fmt: skip


def _shear_words(contact: ContactStress, place: int) -> str:
    """The highest shear below a contact, its depth, and how much of its limit that is."""
    shear = value_text(float(contact.shear[place]), "MPa", decimals(0))
    depth = value_text(float(contact.depth[place]) / MICROMETRE, "µm", decimals(1))
    words = f"highest shear {shear}, {depth} below the surface"
    if contact.weaker is None:
        return f"{words}; no hardness of these materials is known"
    share = value_text(100.0 * float(contact.share_of_limit[place]), "%", decimals(0))
    return f"{words}, {share} of the limit of {contact.weaker.name}"


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
        explanation="Von Mises, preload included, with its place, at the trigger of this touch; "
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


def _contact_table(field: TriggerField) -> Table:
    digits, rest, seats, tip = decimals(4), field.seats_at_rest, field.seats, field.tip
    both = {
        name: np.concatenate([getattr(seats, name), getattr(tip, name)])
        for name in ("force", "pressure", "shear", "depth", "share_of_limit")
    }
    return Table(
        (
            Column.of("contact", (*SEAT_NAMES, "tip and part")),
            Column.of("force at rest", [*rest.force, 0.0], "N", digits),
            Column.of("at trigger", both["force"], "N", digits),
            Column.of("pressure at rest", [*rest.pressure, 0.0], "MPa", decimals(0)),
            Column.of("pressure at trigger", both["pressure"], "MPa", decimals(0)),
            Column.of("highest shear", both["shear"], "MPa", decimals(0)),
            Column.of("its depth", both["depth"] / MICROMETRE, "µm", decimals(1)),
            Column.of("of its limit", 100.0 * both["share_of_limit"], "%", decimals(0)),
        ),
        title="Forces and pressures of the contacts",
        explanation="By Hertz, in the middle of each contact: rods on balls, and the tip on a flat "
        "part of steel. The stress of the bodies does not contain it. The limit is the shear at "
        "which the softer material yields, its hardness over 5.6.",
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
