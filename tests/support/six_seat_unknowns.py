"""What a six-seat fit seeks, from what a probe has: the angle by the logarithm of its tangent."""

from __future__ import annotations

import math

import numpy as np

from pretravel.six_seats.uneven_seats import PARAMETERS

ANGLE = [parameter.name for parameter in PARAMETERS].index("support_angle")
PRIORS = [
    math.log(math.tan(p.typical)) if p.name == "support_angle" else p.prior for p in PARAMETERS
]
"""Expected before the touches."""


def parameters_of(unknowns: np.ndarray) -> np.ndarray:
    """The 18 parameters, which are the last of the unknowns."""
    found = np.array(unknowns[-18:])
    found[ANGLE] = math.atan(math.exp(found[ANGLE]))
    return found


def rates_of(unknowns: np.ndarray) -> np.ndarray:
    """Derivative of each parameter by its unknown: of the angle, its sine times its cosine."""
    found = np.ones(18)
    angle = parameters_of(unknowns)[ANGLE]
    found[ANGLE] = math.sin(angle) * math.cos(angle)
    return found
