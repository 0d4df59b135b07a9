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
from pretravel.qualification.touch_order import (
    between_predecessors,
    estimated_hysteresis,
    hysteresis_columns,
    predecessors,
    previous_directions,
)

__all__ = [
    "between_predecessors",
    "drift_columns",
    "drift_is_separable",
    "estimated_drift",
    "estimated_hysteresis",
    "hysteresis_columns",
    "predecessors",
    "previous_directions",
    "quantisation_step",
    "repeat_step",
    "touch_times",
]
