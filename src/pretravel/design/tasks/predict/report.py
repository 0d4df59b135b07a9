"""Report and pictures of a prediction: trigger force and pretravel of a described probe."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, azimuth_angle, polar_angle
from pretravel.design.tasks.predict.view import prediction_view, values_of
from pretravel.design.tasks.probes.report import probe_picture
from pretravel.prediction import Probe, Trigger, seat_doubts, slender_doubts
from pretravel.show import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Span,
    Table,
    decimals,
    number_text,
    value_text,
)
from pretravel.task import QuantityWord


def prediction_document(
    trigger: Trigger, probe: Probe, quantity: QuantityWord = "pretravel"
) -> Document:
    """The report of a prediction.

    Parameters
    ----------
    trigger : Trigger
    probe : Probe
        That the prediction is of.
    quantity : str
        Of the verdict and the pictures; see `prediction_view`.
    """
    title = f"{probe.name}, model {trigger.model}"
    if probe.seats.friction > 0.0:
        title += f", friction {probe.seats.friction:g} at the seats"
    if probe.tip.friction > 0.0:
        title += f", {probe.tip.friction:g} at the tip"
    lowest, highest = int(np.argmin(trigger.pretravel)), int(np.argmax(trigger.pretravel))
    where = (
        f"smallest at {_direction(trigger, lowest)}; largest at {_direction(trigger, highest)}; "
        "in the frame of the probe"
    )
    return Document(
        title=title,
        verdict=f"{title}: {_of_quantity(trigger, quantity)}trigger "
        f"force {_range(trigger.force, 'N', 3)} in {len(trigger.force)} directions",
        figures=(
            KeyFigure("trigger force", Span.of(trigger.force), "N", decimals(3)),
            KeyFigure("sensing distance", Span.of(trigger.sensing_distance / MICROMETRE), "µm",
                      remark="deflection across the axis"),
            KeyFigure("pretravel", Span.of(trigger.pretravel / MICROMETRE), "µm", remark=where),
        ),
        tables=(shares_table(trigger),),
        pictures=(
            Picture(_PICTURES[quantity], lambda: prediction_view(trigger, title, quantity)),
            probe_picture(probe),
        ),
        warnings=(
            *seat_doubts(probe),
            *slender_doubts(probe, trigger.directions, trigger.force),
        ),
    )  # fmt: skip


_PICTURES: Mapping[QuantityWord, str] = {
    "pretravel": "Force and pretravel over directions, and the contributions to the pretravel",
    "sensing_distance": "Force and sensing distance over directions",
    "trigger_force": "Trigger force over directions",
}


def _of_quantity(trigger: Trigger, quantity: QuantityWord) -> str:
    """The range of the quantity in addition to the force, for the verdict."""
    if quantity == "trigger_force":
        return ""
    words, unit, values = values_of(trigger, quantity)
    return f"{words} {_range(values, unit, 2)}, "


def shares_table(trigger: Trigger) -> Table:
    """The mean contribution of each elastic part to the pretravel, the largest first."""
    total = trigger.pretravel.mean()
    mean = {name.replace("_", " "): share.mean() for name, share in trigger.shares.items()}
    names = sorted(mean, key=lambda name: -float(mean[name]))
    one = len(trigger.force) == 1
    return Table(
        (
            Column.of("part", names),
            Column.of(
                "pretravel" if one else "mean pretravel",
                [float(mean[name]) / MICROMETRE for name in names],
                "µm",
                decimals(3),
            ),
            Column.of(
                "share", [100.0 * float(mean[name] / total) for name in names], "%", decimals(0)
            ),
        ),
        title="Contributions to the pretravel",
        detail=True,
    )


def _range(values: FloatArray, unit: str, digits: int) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{number_text(low, decimals(digits))} to {value_text(high, unit, decimals(digits))}"


def _direction(trigger: Trigger, row: int) -> str:
    polar = float(polar_angle(trigger.directions)[row]) / DEGREE
    azimuth = float(azimuth_angle(trigger.directions)[row]) / DEGREE
    return (
        f"polar {value_text(polar, '°', decimals(0))}, "
        f"azimuth {value_text(azimuth, '°', decimals(0))}"
    )
