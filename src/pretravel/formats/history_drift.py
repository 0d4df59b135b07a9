"""How much a probe usually drifts, from the file of its verifications."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.formats.probe_history import Entry
from pretravel.qualification.probe_drift import ProbeDrift, drift_of_changes
from pretravel.units import DEGREE, MICROMETRE


def drift_of_history(entries: Sequence[Entry]) -> ProbeDrift:
    """The drift that the verifications of a probe show.

    Parameters
    ----------
    entries : sequence of Entry
        Those that found a change are left out: a changed probe is qualified anew.

    Returns
    -------
    ProbeDrift

    >>> entry = Entry(1, {"changed": 0, "size_um": 0.4, "u_size_um": 0.1,
    ...                   "turn_deg": None, "u_turn_deg": None})
    >>> drift_of_history([entry]).source
    'level and turn from 1 verification, the rest assumed'
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
