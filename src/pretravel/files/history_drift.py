"""How a probe drifts, from the file of its verifications."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray
from pretravel.files.probe_history import Entry
from pretravel.qualification import (
    DailyQuantity,
    DriftOverTime,
    ProbeDrift,
    drift_of_changes,
    drift_over_time,
)


def drift_of_history(entries: Sequence[Entry]) -> ProbeDrift:
    """The drift that the verifications of a probe show.

    Parameters
    ----------
    entries : sequence of Entry
        Those that found a change are left out: a changed probe is qualified again.

    >>> entry = Entry(1, {"changed": 0, "size_um": 0.4, "u_size_um": 0.1,
    ...                   "turn_deg": None, "u_turn_deg": None})
    >>> drift_of_history([entry]).source
    'size and turn from 1 verification, the rest assumed'
    """
    kept = [entry for entry in entries if not entry["changed"]]

    def numbers(column: str, unit: float) -> FloatArray:
        values = [entry[column] for entry in kept]
        return unit * np.array([math.nan if v is None else float(v) for v in values])

    return drift_of_changes(
        numbers("size_um", MICROMETRE),
        numbers("u_size_um", MICROMETRE),
        numbers("turn_deg", DEGREE),
        numbers("u_turn_deg", DEGREE),
    )


def drift_of_entries(entries: Sequence[Entry], limit: float | None = None) -> DriftOverTime:
    """The drift over time that the verifications of a probe show: size, amplitude and turn.

    Parameters
    ----------
    entries : sequence of Entry
        Oldest first. An entry of another map than the one before begins a new series.
    limit : float, optional
        Allowed change of the map; else twice the median standard uncertainty of the size, below
        which a verification sees no change. [mm]

    Returns
    -------
    DriftOverTime
        Amplitude and turn have no due date: a history does not contain the map that they change.

    Notes
    -----
    The uncertainties of verifications contain that of the map, which they have in common; the
    scatter of the days is therefore determined from the entries alone.
    """

    def numbers(column: str) -> FloatArray:
        values = [entry[column] for entry in entries]
        return np.array([math.nan if value is None else float(value) for value in values])

    quantities = [
        DailyQuantity(name, unit, numbers(column), numbers(f"u_{column}"), share, known_u=False)
        for name, unit, column, share in (
            ("size", "µm", "size_um", MICROMETRE),
            ("amplitude", "%", "amplitude_percent", 0.0),
            ("turn", "°", "turn_deg", 0.0),
        )
        if np.any(np.isfinite(numbers(column)) & (numbers(f"u_{column}") > 0.0))
    ]
    u_size = numbers("u_size_um")
    if limit is None:
        known = u_size[np.isfinite(u_size) & (u_size > 0.0)]
        limit = 2.0 * MICROMETRE * float(np.median(known)) if len(known) else MICROMETRE
    maps = [entry["map_id"] for entry in entries]
    moments = [datetime.fromisoformat(str(entry["time"])) for entry in entries]
    moments = [moment.replace(tzinfo=moment.tzinfo or UTC).astimezone(UTC) for moment in moments]
    new = [row for row in range(1, len(maps)) if maps[row] != maps[row - 1]]
    return drift_over_time(moments, quantities, limit, new)
