"""Upright rings, bores, pins and bosses, of known size or not, touched at one height or several.

A pin that is touched outside says the same as a ring that is touched inside: a touch with contact
normal n at P on a pin of radius R is one at ``P - n (R + R')`` in a ring of radius R', because
``R + r - pretravel`` and ``R' - r + pretravel`` add up to ``R + R'``. A shift of the centre is the
same in both. Maps of rings serve both so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.maps import MachinePriors, QualificationSetup, SetupOptions
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualified, with_machine
from pretravel.qualification.reference_fit import ReferenceFit, fit_references
from pretravel.qualification.references import Reference, touches_on
from pretravel.touches import Touches
from pretravel.uncertainty import algebraic_sphere

U_UNKNOWN_SIZE = 0.05
"""Standard uncertainty of a diameter that is taken from the touches, as if the mean pretravel were
zero: half of it is more than the mean pretravel of usual probes. [mm]"""
_FLAT = 1.0
"""Touches whose heights differ by less show no tilt of an axis. [mm]"""
_STEEPEST = 0.2
"""Larger component of a normal along the axis: no touch on an upright wall."""


def unknown_diameter(touches: Touches, tip_diameter: float, *, ring: bool) -> float:
    """Diameter of a reference that fits its touches, as if the mean pretravel were zero. [mm]

    Parameters
    ----------
    touches : Touches
    tip_diameter : float
        [mm]
    ring : bool
        A ring or a bore; else a sphere.

    Raises
    ------
    PretravelError
        The touches have no circle or sphere, or it is not larger than the tip.

    >>> n = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    >>> round(unknown_diameter(Touches(-n * 9.5, n), 6.0, ring=True), 6)
    25.0
    """
    _, radius = _circle(touches.positions[:, : 2 if ring else 3])
    diameter = 2.0 * radius + (tip_diameter if ring else -tip_diameter)
    if not diameter > 0.0:
        raise PretravelError(
            f"the touches lie on a circle of {2.0 * radius:.4g} mm: not on a reference that a tip "
            f"of {tip_diameter:g} mm touches",
            inputs=("tip_diameter",),
        )
    return diameter


def as_ring_touches(touches: Touches, diameter: float) -> Touches:
    """Touches outside a pin, as touches in a ring of the same diameter.

    Parameters
    ----------
    touches : Touches
        On an upright pin or boss.
    diameter : float
        [mm]

    Raises
    ------
    PretravelError
        A normal that is not across the axis, or points into the pin.

    >>> n = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    >>> ring = as_ring_touches(Touches(n * (12.5 + 3.0 - 0.01), n), 25.0)
    >>> ring.positions.round(6).tolist()[0]
    [-9.51, 0.0, 0.0]
    """
    center, _ = _circle(touches.positions[:, :2])
    outward = touches.positions[:, :2] - center
    outward = outward / np.linalg.norm(outward, axis=1)[:, None]
    steep = np.abs(touches.normals[:, 2]) > _STEEPEST
    inward = np.sum(outward * touches.normals[:, :2], axis=1) < 0.5
    for wrong, what in ((steep, "is not a touch on an upright wall"),
                        (inward, "has a normal that does not point out of the pin")):  # fmt: skip
        if wrong.any():
            raise PretravelError(
                f"{touches.where(int(np.argmax(wrong)))} {what}", inputs=("pin", "ring")
            )
    moved = touches.positions.copy()
    moved[:, :2] -= diameter * outward
    return replace(touches, positions=moved)


def without_tilt(touches: Touches, *, ring: bool) -> Touches:
    """Touches at several heights, as if the axis of the ring or pin were upright.

    Parameters
    ----------
    touches : Touches
    ring : bool
        Touched inside.

    Returns
    -------
    Touches
        As they are where they have one height, or are too few to show a tilt.

    >>> n = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]] * 4)
    >>> z = np.repeat([0.0, 10.0, 0.0, 10.0], 4)[:, None]
    >>> tilted = np.hstack([-n[:, :2] * 9.5 + 1e-3 * z * [1.0, 0.0], z])
    >>> without_tilt(Touches(tilted, n), ring=True).positions[:8, 0].round(4).tolist()
    [-9.495, 9.505, 0.005, 0.005, -9.495, 9.505, 0.005, 0.005]
    """
    height = touches.positions[:, 2] - np.mean(touches.positions[:, 2])
    if np.ptp(height) < _FLAT:
        return touches
    shape = "ring" if ring else "pin"
    reference = Reference(shape, shape)
    given = Touches(touches.positions, touches.normals, touches.approaches)
    exact = MachinePriors(0.0, 0.0, 0.0)
    try:
        fit = fit_references(given, [reference], tip_diameter=1e-3, priors=exact)
    except PretravelError:  # too few touches to show a tilt
        return touches
    tilt = np.array([fit.tilts.get(f"tilt of {shape} along {axis}", 0.0) for axis in "xy"])
    moved = touches.positions.copy()
    moved[:, :2] -= height[:, None] * tilt
    return replace(touches, positions=moved)


def qualified_beside_others(
    touches: Touches,
    references: Sequence[Reference],
    fit: ReferenceFit,
    setup: SetupOptions,
) -> tuple[Reference, Qualification] | None:
    """A map from the touches on the round one of several references, without the machine's terms.

    Of several round references of known size it is a sphere, else the one with most touches.

    Parameters
    ----------
    touches : Touches
        On all references, as the machine reported them.
    references : sequence of Reference
    fit : ReferenceFit
        Of these touches.
    setup : SetupOptions
        What does not belong to the reference: the tip, conventions.

    Returns
    -------
    Reference, Qualification
        None where no reference is round and of known size.

    Raises
    ------
    PretravelError
        As `pretravel.qualification.qualifying.qualify`.
    """
    found = [
        (one.shape == "sphere", len(rows), number, rows)
        for number, one in enumerate(references)
        if one.shape != "block" and one.sizes
        and len(rows := touches_on(touches, references, one.name))
    ]  # fmt: skip
    if not found:
        return None
    *_, number, rows = max(found, key=lambda each: each[:2])
    reference, machine, own = references[number], fit.machine, touches.take(rows)
    true = own if machine is None else machine.taken_off(own)
    if reference.shape != "sphere":
        true = as_upright_ring(true, reference.sizes[0], pin=reference.shape == "pin")
    options: SetupOptions = {
        **setup,
        "ring": reference.shape != "sphere",
        "u_diameter": reference.u_size,
        "u_temperature": reference.u_temperature,
    }
    known = QualificationSetup(reference.sizes[0], **options)  # type: ignore[arg-type]  # axis
    made = qualified(replace(true, references=None), known)
    return reference, with_machine(made, own, machine, outside=reference.shape != "ring")


def as_upright_ring(touches: Touches, diameter: float, *, pin: bool) -> Touches:
    """Touches on a ring or a pin at any heights, as those in an upright ring. [mm]"""
    upright = without_tilt(touches, ring=not pin)
    return as_ring_touches(upright, diameter) if pin else upright


def _circle(points: FloatArray) -> tuple[FloatArray, float]:
    """Centre and radius of the least-squares circle or sphere."""
    middle = points.mean(axis=0)
    about = points - middle
    axes = points.shape[1]
    if np.linalg.matrix_rank(about, tol=1e-10 * float(np.linalg.norm(about))) < axes:
        raise PretravelError(
            f"the touches do not determine a {'circle' if axes == 2 else 'sphere'}: "
            f"at least {axes + 1} directions are needed"
        )
    *center, radius = algebraic_sphere(about)[0].tolist()
    return middle + np.array(center), radius
