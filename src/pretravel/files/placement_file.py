"""Where a part lies in the machine, as a file of `pretravel align`."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.base import (
    FloatArray,
    Placement,
    PlacementErrors,
    PretravelError,
    frozen,
    parse_placement,
    parsed_json,
    write_text,
)
from pretravel.files.source_file import Source, SourceFile, opened

_SCHEMA = "pretravel placement"
_VERSION = 1
_SIZES: dict[str, tuple[int | None, ...]] = {
    "rotation": (3, 3), "shift_mm": (3,), "about_mm": (3,), "covariance": (6, 6),
    "undetermined": (6, None),
}  # fmt: skip

_WORDS = ("schema", "version", "part", "touches", "place", "undetermined_in_words")
_SAME_SHIFT, _SAME_ROTATION = 1e-4, 1e-6
"""Beyond the digits in which a place is written. [mm, rad]"""


def write_placement(
    path: str | Path, placement: Placement, *, part: str = "", touches: str = "", note: str = ""
) -> None:
    """Write a placement as JSON, with its uncertainty where it was measured.

    Parameters
    ----------
    path : str or Path
    placement : Placement
    part, touches : str
        Names of the files that it comes from.
    note : str
        What is not determined, in words.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "place.json"
    >>> write_placement(path, Placement(shift=np.array([1.0, 2.0, 3.0])))
    >>> read_placement(path).shift.tolist()
    [1.0, 2.0, 3.0]
    """
    content: dict[str, Any] = {
        "schema": _SCHEMA,
        "version": _VERSION,
        "part": part,
        "touches": touches,
        "place": placement.typed(),
        "rotation": np.asarray(placement.rotation).tolist(),
        "shift_mm": np.asarray(placement.shift).tolist(),
    }
    errors = placement.errors
    if errors is not None:
        content |= {
            "about_mm": np.asarray(errors.about).tolist(),
            "covariance": np.asarray(errors.covariance).tolist(),
            "undetermined": np.asarray(errors.undetermined).tolist(),
            "undetermined_in_words": note,
        }
    text = json.dumps(content, indent=1)
    # A row of numbers stands in one line.
    write_text(path, re.sub(r"\[[^\[\]]*\]", lambda row: " ".join(row[0].split()), text) + "\n")


def read_placement(source: Source) -> Placement:
    """Read a placement that `write_placement` wrote.

    Parameters
    ----------
    source : str, Path or SourceFile

    Returns
    -------
    Placement

    Raises
    ------
    InputError
        It is not a placement, or one of another version; a value is missing or is not a number; two
        values contradict each other.
    """
    file = opened(source)
    content = _content(file)
    if content.get("version") != _VERSION:
        raise file.error(f"the version is {content.get('version')!r:.40}; {_VERSION} is read")
    unknown = [name for name in content if name not in (*_SIZES, *_WORDS)]
    if unknown:
        raise file.error(f"a placement has no key {unknown[0]!r:.40}: it would not be used")
    values = {name: _numbers(file, content, name) for name in _SIZES if name in content}
    for name in ("rotation", "shift_mm"):
        if name not in values:
            raise file.error(f"the key {name} is missing")
    with file.named_in_errors():
        errors = None
        if {"covariance", "about_mm", "undetermined"} & set(values):
            missing = [
                name for name in ("covariance", "about_mm", "undetermined") if name not in values
            ]
            if missing:
                raise PretravelError(f"the key {missing[0]} is missing")
            errors = PlacementErrors(
                values["covariance"], values["about_mm"], values["undetermined"]
            )
        found = Placement(values["rotation"], values["shift_mm"], errors)
        _refuse_contradiction(content.get("place"), found)
        return found


def part_of_placement(source: Source) -> str:
    """Read the name of the part of a placement; empty where the file has none."""
    return str(_content(opened(source)).get("part", ""))


def _content(file: SourceFile) -> dict[str, Any]:
    try:
        content = parsed_json(file.content)
    except ValueError as error:
        raise file.error(f"this is not a placement: {error!s:.120}") from None
    if not isinstance(content, dict) or content.get("schema") != _SCHEMA:
        raise file.error(
            f"this is not a placement (the key schema is not '{_SCHEMA}'); pretravel align writes "
            "them",
            inputs=("place",),
        )
    return content


def _refuse_contradiction(place: object, found: Placement) -> None:
    """Refuse a placement in words that is not that of the numbers: one of them was edited."""
    if place is None:
        return
    stated = parse_placement(str(place))
    off = np.abs(stated.shift - found.shift).max(), np.abs(stated.rotation - found.rotation).max()
    if off[0] > _SAME_SHIFT or off[1] > _SAME_ROTATION:
        raise PretravelError(
            f"place is {place!s:.80}, and rotation and shift_mm are {found.typed()}: one of them "
            "was changed. Give the placement itself instead of the file, or align again",
            inputs=("place", "start"),
        )


def _numbers(file: SourceFile, content: dict[str, Any], name: str) -> FloatArray:
    wanted = _SIZES[name]
    try:
        found = np.array(content[name], dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise file.error(f"the key {name} contains something that is not a number") from None
    if name == "undetermined" and found.size == 0:
        found = np.zeros((6, 0))
    fits = found.ndim == len(wanted) and all(
        want is None or want == size for want, size in zip(wanted, found.shape, strict=True)
    )
    if not fits or not np.all(np.isfinite(found)):
        raise file.error(
            f"the key {name} has the shape {found.shape}; it must have "
            f"{' x '.join('k' if size is None else str(size) for size in wanted)} finite numbers"
        )
    return frozen(found)
