"""The file of several tips: the map of each, and where it finds the sphere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.base import FloatArray, InputError, PretravelError, frozen, parsed_json, write_text
from pretravel.files.map_json import TIPS_SCHEMA, json_of_map, map_from_json
from pretravel.files.source_file import SourceFile, opened
from pretravel.measurement import StarStylus, StarTip

_VERSION = 1


def write_star(path: str | Path, star: StarStylus) -> None:
    """Write several tips: .json."""
    tips = [
        {
            "name": tip.name,
            "center_mm": tip.center.tolist(),
            "covariance_mm2": tip.covariance.tolist(),
            "covariance_alone_mm2": tip.alone.tolist(),
            "map": json.loads(json_of_map(tip.pretravel_map)),
        }
        for tip in star.tips
    ]
    content = {"schema": TIPS_SCHEMA, "version": _VERSION, "tips": tips}
    write_text(Path(path), json.dumps(content, indent=1, ensure_ascii=False) + "\n")


def is_star_file(path: str | Path) -> bool:
    """Whether a file is one of several tips, by its beginning.

    >>> is_star_file("absent.json")
    False
    """
    place = Path(path)
    if place.suffix.lower() != ".json" or not place.is_file():
        return False
    with place.open("rb") as stream:
        return TIPS_SCHEMA.encode() in stream.read(100)


def read_star(path: str | Path) -> StarStylus:
    """Read several tips.

    Raises
    ------
    InputError
        Not such a file; a map in it that was changed.
    """
    file = opened(path)
    try:
        content = parsed_json(file.content)
        if content["schema"] != TIPS_SCHEMA or content["version"] != _VERSION:
            raise file.error(f"not a file of several tips of version {_VERSION}")
        return StarStylus(tuple(_tip(file, one) for one in content["tips"]))
    except InputError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise file.error(
            f"this is not a file of several tips that can be read: {error!s:.200}"
        ) from error


def _tip(file: SourceFile, stated: Any) -> StarTip:
    name = str(stated["name"])
    if not name.isprintable():
        raise PretravelError("the name of a tip contains a control character")
    own = SourceFile(f"{file.path} (tip {name})", json.dumps(stated["map"]).encode())
    return StarTip(
        name,
        map_from_json(own),
        _numbers(stated["center_mm"], (3,)),
        _numbers(stated["covariance_mm2"], (3, 3)),
        _numbers(stated["covariance_alone_mm2"], (3, 3)),
    )


def _numbers(values: Any, shape: tuple[int, ...]) -> FloatArray:
    found = np.array(values, dtype=np.float64)
    if found.shape != shape or not np.isfinite(found).all():
        raise PretravelError(f"numbers of shape {shape} are needed")
    return frozen(found)
