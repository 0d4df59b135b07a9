"""The identity of a map on a control: a number that differs between maps."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE, FloatArray, PretravelError
from pretravel.maps import PretravelMap, refuse_turned_map, same_tip

_NUMBERS = 900_000_000
_FIRST = 100_000_000
"""Nine digits: controls keep such integers exactly."""
_SAME_FEED = 0.02
"""Part of a feed within which it is the same."""
_KNOWN_SIZE = 5.0 * MICROMETRE
"""Largest standard uncertainty of a tip's radius by a calibrated reference. [mm]"""


@dataclass(frozen=True)
class MapIdentity:
    """What a control compares before a program uses subroutines of a map.

    Attributes
    ----------
    number : int
        Differs between maps of different pretravel, tip, signal delay, feed or rotation.
    text : str
        The map in words, for comments.
    """

    number: int
    text: str


def map_identity(pretravel_map: PretravelMap) -> MapIdentity:
    """The identity of a map.

    >>> from dataclasses import replace
    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> one = PretravelMap(
    ...     MeanBasis(), np.array([0.016]), Covariance.independent([1e-8]),
    ...     DirectionSupport(sphere_pattern_25()), tip_radius=3.0)
    >>> map_identity(one) == map_identity(replace(one))
    True
    >>> map_identity(one).number == map_identity(replace(one, tip_radius=2.0)).number
    False
    >>> check_map_of_program(one, 1.0, np.array([50.0]))
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: the map belongs to a tip of 6.000 mm diameter, but the
    machine has one of 2.000 mm
    """
    basis = pretravel_map.basis
    contents: list[npt.ArrayLike] = [
        pretravel_map.kind,
        pretravel_map.coefficients,
        pretravel_map.rotation,
        pretravel_map.tip_radius,
        -1.0 if pretravel_map.delay is None else pretravel_map.delay,
        -1.0 if pretravel_map.feed is None else pretravel_map.feed,
        *(array.values for _, array in sorted(basis.arrays().items())),
        *(value for _, value in sorted(basis.attributes().items())),
    ]
    digest = hashlib.sha256()
    for content in contents:
        array = np.asarray(content)
        # Files give numbers back as other types of number.
        texts = array.dtype.kind in "US"
        digest.update(" ".join(array.ravel()).encode() if texts else array.astype("<f8").tobytes())
    number = int.from_bytes(digest.digest()[:8], "big") % _NUMBERS + _FIRST
    feed = "" if pretravel_map.feed is None else f", at {pretravel_map.feed:g} mm per min"
    return MapIdentity(
        number, f"number {number}, tip radius {pretravel_map.tip_radius:.4f} mm{feed}"
    )


def unknown_size(pretravel_map: PretravelMap) -> str:
    """A sentence about a map whose mean is hardly known, from a reference of unknown size; empty
    for others.
    """
    u = pretravel_map.u_tip_radius
    if u <= _KNOWN_SIZE:
        return ""
    return (
        f"the size of the reference of this map was hardly known: all its radii are wrong by one "
        f"number, u = {u / MICROMETRE:.2g} µm"
    )


def check_map_of_program(
    pretravel_map: PretravelMap,
    tip_radius: float,
    feeds: FloatArray,
    spindle_deg: float | None = None,
) -> None:
    """Refuse a map that does not hold for the tip, the feeds or the orientation of a program.

    Parameters
    ----------
    pretravel_map : PretravelMap
    tip_radius : float
        [mm]
    feeds : (n,) float
        [mm/min]
    spindle_deg : float, optional
        To which the program turns the spindle. [°]
    """
    if not same_tip(2.0 * pretravel_map.tip_radius, 2.0 * tip_radius):
        raise PretravelError(
            f"the map belongs to a tip of {2.0 * pretravel_map.tip_radius:.3f} mm diameter, but "
            f"the machine has one of {2.0 * tip_radius:.3f} mm",
            inputs=("compensated",),
        )
    own = pretravel_map.feed
    if pretravel_map.delay is None and own is not None:
        other = feeds[np.abs(feeds - own) > _SAME_FEED * own]
        if len(other):
            raise PretravelError(
                f"the map was made at {own:g} mm/min, but the program measures at {other[0]:g}: "
                "measure at the feed of the map, or qualify at several feeds, so that the signal "
                "delay is known",
                inputs=("compensated",),
            )
    refuse_turned_map(pretravel_map, spindle_deg)
