"""What a real machine adds to touches.

A module for each effect: steps of the latch, drift, hysteresis, uneven scatter and heavy tails. The
functions take arrays and return values.
"""

from __future__ import annotations

from pretravel.qualification.heavy_tails import tail_kurtosis
from pretravel.qualification.noise_by_direction import repeatability_by_direction
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
    "repeatability_by_direction",
    "tail_kurtosis",
    "touch_times",
]
