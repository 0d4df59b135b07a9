"""A bundle: touches, map and machine of somebody in one file, without names, dates and numbers.

Every part is read and rewritten, so that only what pretravel understands is in it: comments,
names of files and times of other programs stay behind.
"""

from __future__ import annotations

import io
import json
import platform
import re
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from pretravel.base import installed_version, temporary_folder, whole_file
from pretravel.files.map_file import read_map, write_map
from pretravel.files.touches_csv import write_touches
from pretravel.touches import Touches, word_fields

_PERSONAL = re.compile(
    r"name|serial|owner|laborator|operator|customer|address|street|city|person|mail|phone|date|"
    r"time|note|comment|certificate|order|inventory|title|text|file|path|folder|host",
    re.IGNORECASE,
)
"""Keys whose words can tell who measured, where and when."""
REMOVED = "removed"
"""Stands for a text that was left out."""
_LIBRARIES = ("numpy", "scipy", "matplotlib", "typer", "nicegui", "xarray")
_FIRST = (1980, 1, 1, 0, 0, 0)
"""The date of every entry, the first that the format has: equal contents are equal files."""


def without_names(values: Any) -> Any:
    """Values of a description, without texts that can tell who, where and when.

    >>> without_names({"probe": {"serial_number": "X1", "overtravel_mm": 3.5}, "axes": ["x", "y"]})
    {'probe': {'serial_number': 'removed', 'overtravel_mm': 3.5}, 'axes': ['x', 'y']}
    """
    if isinstance(values, Mapping):
        return {
            key: REMOVED if _PERSONAL.search(key) and isinstance(each, str) else without_names(each)
            for key, each in values.items()
        }
    if isinstance(values, list):
        return [without_names(each) for each in values]
    return values


def anonymous_touches(touches: Touches, *, labels: bool) -> tuple[str, str]:
    """Touches as a table, and what was left out.

    Parameters
    ----------
    touches : Touches
    labels : bool
        Labels and names of references, tips, parts … stay as they are; else they become numbers.

    Returns
    -------
    table, left_out : str
    """
    if not labels:
        touches = replace(
            touches,
            labels=_numbered(touches.labels),
            **word_fields({name: _numbers(each) for name, each in touches.words.items()}),
        )
    with temporary_folder() as folder:
        path = folder / "touches.csv"
        write_touches(path, replace(touches, source=None, lines=None, reading=""))
        table = path.read_text("utf-8")
    return table, "name of the file, comments" + ("" if labels else "; labels became numbers")


def _numbered(words: tuple[str, ...] | None) -> tuple[str, ...] | None:
    return None if words is None else _numbers(words)


def _numbers(words: tuple[str, ...]) -> tuple[str, ...]:
    number = {word: str(place) for place, word in enumerate(dict.fromkeys(words), start=1)}
    return tuple(number[word] for word in words)


def anonymous_map(path: Path) -> str:
    """A map as text, without the names of its files and the digests of its touches."""
    found = read_map(path)
    made = replace(
        found.provenance, source="", touches_file="", probe="", reading="", touch_digests=""
    )
    with temporary_folder() as folder:
        copy = folder / "map.json"
        write_map(copy, replace(found, provenance=made))
        return copy.read_text("utf-8")


def anonymous_description(path: Path) -> str:
    """A description (TOML) without comments and personal texts."""
    import tomlkit

    from pretravel.base import read_toml

    return tomlkit.dumps(without_names(dict(read_toml(path, "description").tables)))


def versions() -> str:
    """Of pretravel, Python, the system and libraries, as JSON. No name of a computer."""
    found = {}
    for name in _LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    values = {
        "pretravel": installed_version(),
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "libraries": found,
    }
    return json.dumps(values, indent=1) + "\n"


def write_bundle(path: str | Path, texts: Mapping[str, str | bytes]) -> None:
    """Write texts as entries of one zip file: equal texts give equal files.

    Parameters
    ----------
    path : str or Path
    texts : mapping of str to str or bytes
        By the names of the entries.
    """
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in texts.items():
            whole = text if isinstance(text, bytes) else text.encode()
            archive.writestr(zipfile.ZipInfo(name, _FIRST), whole, zipfile.ZIP_DEFLATED)
    with whole_file(path) as target:
        target.write_bytes(content.getvalue())
