"""Parts that were read, and points on their faces, kept in the user's cache folder.

The name of an entry is a digest of all that it depends on. An entry contains numbers and words
alone, and becomes objects of the classes listed here; one that cannot be read is ignored. As in the
cache of finite elements, a folder or file that another user can write to is not used.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import warnings
import zipfile
import zlib
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    FloatArray,
    PretravelError,
    cache_folder,
    installed_version,
    mistrust,
    private,
    whole_file,
)
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.trim import Trim
from pretravel.surface.curves import Conic, Line, OffsetCurve, SplineCurve, TrimmedCurve
from pretravel.surface.shapes import Plane, Sphere
from pretravel.surface.shapes_of_revolution import Cone, Cylinder, Torus
from pretravel.surface.spline import SplineSurface
from pretravel.surface.swept import Extrusion, Offset, Placed, Revolution

_logger = logging.getLogger("pretravel")

_FORMAT = 1
"""Increased whenever the content of entries changes."""
_MOST_ENTRIES = 40
_MOST_BYTES = 1_000_000_000
_CLASSES = {
    one.__name__: one
    for one in (
        *(Face, Trim, Plane, Sphere, Cylinder, Cone, Torus),
        *(SplineSurface, Extrusion, Revolution, Offset, Placed),
        *(Line, Conic, SplineCurve, TrimmedCurve, OffsetCurve),
    )
}
_UNREADABLE = (
    ArithmeticError,
    LookupError,
    TypeError,
    ValueError,
    OSError,
    EOFError,
    MemoryError,
    RecursionError,
    NotImplementedError,
    PretravelError,
    zipfile.BadZipFile,
    zlib.error,
)


def part_key(path: Path) -> str:
    """Digest of a CAD file's name and content, of this version and of the kernel's.

    Returns
    -------
    str
        Empty where the file cannot be read.
    """
    from importlib.metadata import PackageNotFoundError, version

    try:
        content = hashlib.sha256(path.read_bytes()).hexdigest()
        kernel = version("netgen-mesher")
    except (OSError, PackageNotFoundError):
        return ""
    # The name is in the warnings that are kept.
    words = [_FORMAT, installed_version(), _reader(), kernel, path.name, content]
    return hashlib.sha256(json.dumps(words).encode()).hexdigest()[:32]


@cache
def _reader() -> str:
    """Digest of the programs that read parts, which change within a version while they are made."""
    programs = sorted(Path(__file__).parents[1].rglob("*.py"))
    return hashlib.sha256(b"".join(each.read_bytes() for each in programs)).hexdigest()


def kept_faces(key: str) -> tuple[tuple[Face, ...], dict[int, str]] | None:
    """The faces of a part that was read before, and the reasons of those that cannot be used.

    The warnings of reading it are given again. None where the part is not kept.
    """
    found = _read(f"part-{key}")
    if found is None:
        return None
    try:
        content = json.loads(bytes(found["content"]))
        found["numbers"].flags.writeable = False
        numbers = np.split(found["numbers"], content["ends"])
        faces = tuple(_object(each, numbers) for each in content["faces"])
        unreadable = {int(number): str(why) for number, why in content["unreadable"]}
        said = [str(each) for each in content["warnings"]]
        if not faces or not all(isinstance(face, Face) for face in faces):
            return None
    except _UNREADABLE:
        return None
    for each in said:
        warnings.warn(each, stacklevel=4)
    return faces, unreadable


def keep_faces(
    key: str, faces: tuple[Face, ...], unreadable: dict[int, str], said: list[str]
) -> None:
    """Keep the faces of a part, with the warnings of reading it."""
    numbers: list[FloatArray] = []
    try:
        content = {
            "faces": [_described(face, numbers) for face in faces],
            "unreadable": list(unreadable.items()),
            "ends": np.cumsum([each.size for each in numbers], dtype=np.int64).tolist(),
            "warnings": said,
        }
    except TypeError as error:  # a face of a kind that is not kept
        _logger.debug("the part is not kept: %s", error)
        return
    text = np.frombuffer(json.dumps(content).encode(), dtype=np.uint8)
    _write(f"part-{key}", content=text, numbers=np.concatenate([np.zeros(0), *numbers]))


def kept_points(key: str, spacing: float) -> dict[str, npt.NDArray[Any]] | None:
    """Points on the faces of a part with a spacing, as `keep_points` kept them."""
    found = _read(f"part-{key}-{spacing:.6g}")
    count = -1 if found is None or "points" not in found else len(found["points"])
    shapes = {"points": (count, 3), "uv": (count, 2), "face": (count,)}
    if found is None or any(
        name not in found or found[name].shape != shape for name, shape in shapes.items()
    ):
        return None
    return found if "gaps" in found and "bends" in found else None


def keep_points(key: str, spacing: float, **arrays: npt.NDArray[Any]) -> None:
    """Keep points on the faces of a part."""
    _write(f"part-{key}-{spacing:.6g}", **arrays)


def kept_numbers(
    key: str, shapes: dict[str, tuple[int, ...]], count: int
) -> dict[str, npt.NDArray[Any]] | None:
    """Numbers of each of so many faces by their names, as `keep_numbers` kept them."""
    found = _read(f"part-{key}-numbers")
    if found is None or {name: each.shape for name, each in found.items()} != {
        name: (count, *shape) for name, shape in shapes.items()
    }:
        return None
    return found


def keep_numbers(key: str, **arrays: npt.NDArray[Any]) -> None:
    """Keep numbers of each face of a part."""
    _write(f"part-{key}-numbers", **arrays)


def _described(value: Any, numbers: list[FloatArray]) -> Any:
    """An object in words of JSON; its arrays are added to the numbers."""
    if isinstance(value, np.ndarray):
        if value.dtype != np.float64:
            raise TypeError(f"an array of {value.dtype}")
        numbers.append(value.ravel())
        return {"array": [len(numbers) - 1, *value.shape]}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, tuple | list):
        return {type(value).__name__: [_described(each, numbers) for each in value]}
    if is_dataclass(value):
        if _CLASSES.get(type(value).__name__) is not type(value):
            raise TypeError(f"a {type(value).__name__}")
        given = [one.name for one in fields(value) if one.init]
        own = {name: _described(getattr(value, name), numbers) for name in given}
        return {"class": type(value).__name__, **own}
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise TypeError(f"a {type(value).__name__}")


def _object(described: Any, numbers: list[FloatArray]) -> Any:
    """The object that `_described` described."""
    if not isinstance(described, dict):
        return described
    if "array" in described:
        index, *shape = described["array"]
        return numbers[index].reshape(shape)
    for kind in (tuple, list):
        if kind.__name__ in described:
            return kind(_object(each, numbers) for each in described[kind.__name__])
    given = {name: _object(each, numbers) for name, each in described.items() if name != "class"}
    return _CLASSES[described["class"]](**given)


def _read(name: str) -> dict[str, npt.NDArray[Any]] | None:
    """The arrays of an entry; None where there is none that can be used."""
    path = cache_folder() / f"{name}.npz"
    try:
        if not path.is_file() or mistrust(path):
            return None
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as kept:
            found = dict(kept)  # the file's own sums (CRC) are compared
        os.utime(path)  # the entries that were not used for longest are removed first
    except _UNREADABLE:
        return None
    return found


def _write(name: str, **arrays: npt.NDArray[Any]) -> None:
    """Write an entry, if the folder can be written to, and remove old ones."""
    folder = cache_folder()
    if private(folder):
        return
    path = folder / f"{name}.npz"
    with suppress(OSError, PretravelError):
        with whole_file(path) as temporary, temporary.open("wb") as stream:
            np.savez(stream, **arrays)  # type: ignore[arg-type]
        path.chmod(0o600)
        left = _MOST_BYTES
        entries = sorted(folder.glob("part-*.npz"), key=lambda one: -one.stat().st_mtime)
        for number, entry in enumerate(entries):
            left -= entry.stat().st_size
            if entry != path and (number >= _MOST_ENTRIES or left < 0):
                entry.unlink()
