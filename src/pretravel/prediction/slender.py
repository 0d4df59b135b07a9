"""Where linear bending of a stylus ends: large deflections, and an axial force that buckles it."""

from __future__ import annotations

import math

import numpy as np

from pretravel.base import DescriptionError, FloatArray, describe
from pretravel.prediction.beam import bending_compliance
from pretravel.prediction.description import Probe

_LARGEST_SHARE = 0.1
"""Deflection over length up to which linear bending is right to 1 %."""
_SAID_FROM = 0.02
"""Share of the buckling load by which bending is larger than without the axial force."""


def buckling_load(probe: Probe) -> float:
    """Axial force at which the stylus of a probe buckles, clamped at the hub and free at the tip.

    Returns
    -------
    float
        Euler's π² E I / (4 L²), from the bending compliance L³ / (3 E I). [N]

    >>> from dataclasses import replace
    >>> from pretravel.prediction.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> stem = replace(probe.stylus[-1], length=50.0, diameter=1.0)
    >>> euler = math.pi**2 * stem.material.youngs_modulus * math.pi / 64.0 / (4.0 * 50.0**2)
    >>> round(buckling_load(replace(probe, stylus=(stem,))) / euler, 9)
    1.0
    """
    return math.pi**2 * probe.stylus_length / (12.0 * bending_compliance(probe.stylus))


def refuse_slender(
    probe: Probe, directions: FloatArray, force: FloatArray, deflection: FloatArray
) -> None:
    """Refuse predictions that linear bending does not contain.

    Parameters
    ----------
    probe : Probe
    directions, deflection : (n, 3) float
        Outward normals in the probe frame; of the tip at the trigger [mm].
    force : (n,) float
        At the trigger. [N]

    Raises
    ------
    DescriptionError
        The tip moves by more than a tenth of the stylus, or the stylus buckles.
    """
    length = probe.stylus_length
    moved = np.hypot(deflection[:, 0], deflection[:, 1]) / length
    if np.any(moved > _LARGEST_SHARE):
        row = int(np.argmax(moved))
        raise DescriptionError(
            f"at {describe(directions[row])} the tip would move by {moved[row] * length:.3g} mm "
            f"before the probe triggers, with a stylus of {length:g} mm: so large a deflection is "
            "not predicted. Use a thicker or stiffer stylus, or a lower preload"
        )
    axial = force * directions[:, 2]
    row = int(np.argmax(axial))
    if axial[row] >= buckling_load(probe):
        raise DescriptionError(
            f"at {describe(directions[row])} the stylus buckles, at {buckling_load(probe):.3g} N "
            f"along its axis, before the probe triggers at {axial[row]:.3g} N. Use a thicker or "
            "stiffer stylus, or a lower preload"
        )


def slender_doubts(probe: Probe, directions: FloatArray, force: FloatArray) -> tuple[str, ...]:
    """What the axial force does to the bending of a thin stylus, as a sentence; else nothing.

    Parameters
    ----------
    probe, directions, force
        As of `refuse_slender`.
    """
    across = np.hypot(directions[:, 0], directions[:, 1]) > _SAID_FROM
    share = float(np.max(np.abs(force * directions[:, 2])[across], initial=0.0))
    share /= buckling_load(probe)
    if share < _SAID_FROM:
        return ()
    return (
        (
            f"the axial force is up to {100.0 * share:.0f} % of that at which this stylus buckles, "
            "and its bending is different by about this share, which is not predicted"
        ),
    )
