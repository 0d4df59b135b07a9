"""What a real machine adds to touches: a step of the latch, drift, hysteresis, uneven scatter.

The functions are in modules of their own, one for each effect; they are arrays in, values out.
"""

from __future__ import annotations

from pretravel.qualification.quantisation import quantisation_step, repeat_step
from pretravel.qualification.reference_drift import (
    drift_columns,
    drift_is_separable,
    estimated_drift,
    touch_times,
)

__all__ = [
    "drift_columns",
    "drift_is_separable",
    "estimated_drift",
    "quantisation_step",
    "repeat_step",
    "touch_times",
]
