"""Surfaces from specifications: ``plane:polar=40``, ``part.step#3``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np

from pretravel.base import (
    DEGREE,
    NUMBER,
    FloatArray,
    InputError,
    PretravelError,
    checked,
    from_angles,
    refuse_named_file,
)
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.part_file import CAD_ENDINGS, read_part
from pretravel.surface.local_geometry import Surface
from pretravel.surface.parametric import Convex
from pretravel.surface.placed_shape import axes_about
from pretravel.surface.shapes import Ellipsoid, Plane, Reversed, Sphere
from pretravel.surface.shapes_of_revolution import Cone, Cylinder, Torus

_REQUIRED = math.nan
_PLACE = {"x": 0.0, "y": 0.0, "z": 0.0}
_AXIS = {"polar": 0.0, "azimuth": 0.0, **_PLACE}

ShapeParameters: TypeAlias = Mapping[str, float]
"""Of a shape, by name. [mm, degree]"""


def _origin(v: ShapeParameters) -> FloatArray:
    return np.array([v["x"], v["y"], v["z"]])


def _axes(v: ShapeParameters) -> FloatArray:
    return axes_about(from_angles(v["polar"] * DEGREE, v["azimuth"] * DEGREE)[0])


def _sided(shape: Surface, v: ShapeParameters) -> Surface:
    return Reversed(shape) if v["inside"] else shape


_SHAPES: Mapping[str, tuple[Callable[[ShapeParameters], Surface], Mapping[str, float]]] = {
    # shape: (made by, parameters with their defaults)
    "plane": (
        lambda v: Plane(_origin(v), from_angles(v["polar"] * DEGREE, v["azimuth"] * DEGREE)[0]),
        {"polar": _REQUIRED, "azimuth": 0.0, **_PLACE},
    ),
    "sphere": (
        lambda v: _sided(Sphere(_origin(v), v["radius"]), v),
        {"radius": _REQUIRED, **_PLACE, "inside": 0.0},
    ),
    "cylinder": (
        lambda v: _sided(Cylinder(_origin(v), v["radius"], _axes(v)), v),
        {"radius": _REQUIRED, **_AXIS, "inside": 0.0},
    ),
    "cone": (
        lambda v: _sided(Cone(_origin(v), v["radius"], v["half_angle"] * DEGREE, _axes(v)), v),
        {"radius": _REQUIRED, "half_angle": _REQUIRED, **_AXIS, "inside": 0.0},
    ),
    "torus": (
        lambda v: _sided(Torus(_origin(v), v["radius"], v["tube"], _axes(v)), v),
        {"radius": _REQUIRED, "tube": _REQUIRED, **_AXIS, "inside": 0.0},
    ),
    "ellipsoid": (
        lambda v: _sided(Ellipsoid(_origin(v), [v["a"], v["b"] or v["a"], v["c"] or v["a"]]), v),
        {"a": _REQUIRED, "b": 0.0, "c": 0.0, **_PLACE, "inside": 0.0},
    ),
    "convex": (
        lambda v: Convex(v["a"], v["b"], v["turn"] * DEGREE),
        {"a": 20.0, "b": 10.0, "turn": 45.0},
    ),
}

_MEMBERS = ("local", "nearest", "moved", "inside")


def parse_surface(text: str) -> Surface | Part:
    """Make a surface from its specification.

    Parameters
    ----------
    text : str
        A shape with its parameters, in mm and degrees: ``plane:polar=40,azimuth=0``
        (the angles of its normal), ``sphere:radius=12.5``, ``cylinder:radius=10``,
        ``cone:radius=10,half_angle=-30``, ``torus:radius=20,tube=5`` (``polar, azimuth`` of
        their axis), ``ellipsoid:a=10,b=10,c=6``, ``convex`` (that of the thesis;
        ``turn=70`` for the angle printed there); a position as ``x=,y=,z=``; ``inside=1`` for
        holes. Or a STEP or IGES file, ``part.step`` or ``part.step#face``, a face by number or
        name. Or an object of a Python file, ``mine.py#name``.

    Returns
    -------
    Surface or Part

    Raises
    ------
    PretravelError
        An unknown shape, parameter, file or face; a value that is not a number.

    >>> parse_surface("sphere:radius=12.5").radius
    12.5
    """
    file, _, word = text.partition("#")
    ending = Path(file).suffix.lower()
    if ending in CAD_ENDINGS:
        return _part(Path(file), word)
    if ending == ".py":
        return _python(Path(file), word or "surface")
    shape, _, rest = text.partition(":")
    if shape not in _SHAPES:
        raise PretravelError(
            f"surface '{text}': '{shape}' is not a known shape; there are "
            + ", ".join(f"{name}:{','.join(p + '=' for p in _SHAPES[name][1])}" for name in _SHAPES)
            + ", and STEP or IGES files, part.step#face"
        )
    make, defaults = _SHAPES[shape]
    try:
        return make(_parameters(shape, rest, defaults))
    except PretravelError as error:
        raise PretravelError(f"surface '{text}': {error}") from None


def _parameters(shape: str, text: str, defaults: ShapeParameters) -> ShapeParameters:
    """The parameters of a shape, from ``radius=12.5,x=3``."""
    values = dict(defaults)
    given: set[str] = set()
    for item in filter(None, (piece.strip() for piece in text.split(","))):
        key, equals, number = (part.strip() for part in item.partition("="))
        if not equals or key not in defaults:
            raise PretravelError(
                f"'{item}' is not a parameter; {shape} has "
                + ", ".join(f"{name}=" for name in defaults)
                + ("; the decimal sign is a point, as in 12.5" if item.isdecimal() else "")
            )
        if key in given:
            raise PretravelError(f"{key}= is given twice")
        given.add(key)
        try:
            values[key] = float(number)
        except ValueError:
            values[key] = math.nan
        if not math.isfinite(values[key]):
            raise PretravelError(f"{key}={number} is not a number") from None
        checked(values[key], f"{key}=", NUMBER)
    missing = [key for key, value in values.items() if math.isnan(value)]
    if missing:
        raise PretravelError(f"{missing[0]}= is missing")
    if not 0.0 <= values.get("polar", 0.0) <= 180.0:
        raise PretravelError("a polar angle lies between 0 and 180 degrees")
    return values


def surface_of(surface: Surface | Part | str) -> Surface | Part:
    """A surface, or the one of a specification.

    Raises
    ------
    PretravelError
        An object of another type.

    >>> surface_of("sphere:radius=5").radius
    5.0
    """
    if isinstance(surface, (str, Path)):
        return parse_surface(str(surface))
    if isinstance(surface, Part) or all(hasattr(surface, name) for name in _MEMBERS):
        return surface
    raise PretravelError(
        f"a surface is needed, not a {type(surface).__name__}: parse_surface('part.step#1'), a "
        "shape of pretravel.surface.shapes, or a FunctionSurface"
    )


def face_of(surface: Surface | Part | str) -> Surface:
    """A single surface: the one chosen face of a part.

    Raises
    ------
    PretravelError
        A part with more than one face to touch.
    """
    found = surface_of(surface)
    if not isinstance(found, Part):
        return found
    if len(found.chosen) != 1:
        raise PretravelError(
            f"parameters u, v are those of one face, and {found.name} has {len(found.chosen)}; "
            f"name one, {found.name}#1 (pretravel faces {found.name} lists them)"
        )
    return found.faces[found.chosen[0]]


def source_file(text: str) -> list[str]:
    """The file that a specification reads, if there is one.

    >>> source_file("part.step#3"), source_file("sphere:radius=5")
    (['part.step'], [])
    """
    file = text.partition("#")[0]
    return [file] if Path(file).suffix.lower() in (*CAD_ENDINGS, ".py") else []


def is_shape(text: str) -> bool:
    """Whether a specification is that of a shape: it reads no file.

    >>> is_shape("plane:polar=40"), is_shape("part.step"), is_shape("plane:x=mine.py")
    (True, False, False)
    """
    is_path = bool(source_file(text)) or not set(text).isdisjoint("/\\")
    return text.partition(":")[0] in _SHAPES and not is_path


def _part(path: Path, word: str) -> Part:
    part = read_part(path)
    if word:
        return part.select(word)
    if part.unreadable:
        number, reason = next(iter(part.unreadable.items()))
        raise InputError(
            f"{len(part.unreadable)} of its {len(part.unreadable) + len(part.faces)} faces cannot "
            f"be used, so the whole part cannot; face {number}: {reason}. Choose one face, "
            f"{path.name}#face (pretravel faces {path.name} lists them)",
            path=path,
        )
    return part


def _python(path: Path, name: str) -> Surface:
    import runpy

    refuse_named_file("a surface that is executed", path.name)
    if not path.is_file():
        raise InputError("cannot be opened: no such file", path=path)
    try:
        names = runpy.run_path(str(path))
    except Exception as error:  # a user's file can raise anything
        raise InputError(f"stopped with {type(error).__name__}: {error}", path=path) from error
    if name not in names:
        raise InputError(
            f"does not define '{name}'; name a surface with #name, for example "
            "surface = pretravel.FunctionSurface(…)",
            path=path,
        )
    surface = names[name]
    if not all(hasattr(surface, member) for member in _MEMBERS):
        raise InputError(f"'{name}' is a {type(surface).__name__}, not a surface", path=path)
    return surface  # type: ignore[no-any-return]
