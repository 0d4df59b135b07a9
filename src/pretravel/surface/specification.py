"""Surfaces from the words of the command line: ``plane:polar=40,azimuth=0``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from pretravel.directions import from_angles
from pretravel.errors import PretravelError
from pretravel.surface.shapes import Plane, Sphere, Surface
from pretravel.units import DEGREE


def _plane(v: Mapping[str, float]) -> Surface:
    normal = from_angles(v["polar"] * DEGREE, v["azimuth"] * DEGREE)[0]
    return Plane([v["x"], v["y"], v["z"]], normal)


def _sphere(v: Mapping[str, float]) -> Surface:
    return Sphere([v["x"], v["y"], v["z"]], v["radius"])


_SHAPES: Mapping[str, tuple[Callable[[Mapping[str, float]], Surface], Mapping[str, float]]] = {
    # shape: (made by, parameters with their defaults)
    "plane": (_plane, {"polar": math.nan, "azimuth": 0.0, "x": 0.0, "y": 0.0, "z": 0.0}),
    "sphere": (_sphere, {"radius": math.nan, "x": 0.0, "y": 0.0, "z": 0.0}),
}


def parse_surface(text: str) -> Surface:
    """A surface from its specification.

    Parameters
    ----------
    text : str
        ``plane:polar=40,azimuth=0`` (degrees, the angles of the normal; a point
        as ``x=,y=,z=``, else the origin) or ``sphere:radius=12.5,x=0,y=0,z=0``
        (mm).

    Returns
    -------
    Surface

    Raises
    ------
    PretravelError
        A shape or parameter that is not known, a value that is not a number.

    >>> parse_surface("sphere:radius=12.5").radius
    12.5
    """
    shape, _, rest = text.partition(":")
    if shape not in _SHAPES:
        raise PretravelError(
            f"surface '{text}': '{shape}' is not a shape that can be read; there are "
            + " and ".join(
                f"{name}:{','.join(p + '=' for p in _SHAPES[name][1])}" for name in _SHAPES
            )
        )
    make, defaults = _SHAPES[shape]
    values = dict(defaults)
    given: set[str] = set()
    for part in filter(None, (piece.strip() for piece in rest.split(","))):
        key, equals, number = part.partition("=")
        if not equals or key not in defaults:
            raise PretravelError(
                f"surface '{text}': '{part}' is not understood; {shape} has "
                + ", ".join(f"{name}=" for name in defaults)
            )
        if key in given:
            raise PretravelError(f"surface '{text}': {key}= is there twice")
        given.add(key)
        try:
            values[key] = float(number)
        except ValueError:
            values[key] = math.nan
        if not math.isfinite(values[key]):
            raise PretravelError(f"surface '{text}': {key}={number} is not a number") from None
    missing = [key for key, value in values.items() if math.isnan(value)]
    if missing:
        raise PretravelError(f"surface '{text}' needs {missing[0]}=")
    if not 0.0 <= values.get("polar", 0.0) <= 180.0:
        raise PretravelError(f"surface '{text}': a polar angle lies between 0 and 180 degrees")
    return make(values)
