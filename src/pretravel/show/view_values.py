"""What pictures show as plain values for JSON, and back."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, get_args, get_origin

import numpy as np

from pretravel.base import LARGEST_NUMBER
from pretravel.show.chart import Chart, TopView, View
from pretravel.show.chart_marks import (
    Area,
    Dots,
    FrozenArrays,
    LineMark,
    Mark,
    Rule,
    SpaceMark,
    SpaceMesh,
)

if TYPE_CHECKING:
    from cattrs import Converter

_KIND = "kind"
_UNIONS = (Mark, LineMark | Dots | Area | Rule, SpaceMark, Chart)
"""Of marks in a plane, around and in space, and of charts, which contain them."""
_TAGGED = (*get_args(Mark), *get_args(SpaceMark), *get_args(Chart))
_IN_SPACE = frozenset({"positions", "starts", "ends", "vertices", "triangles"})
_MOST_CHARTS = 40


def view_values(view: View) -> dict[str, Any]:
    """What a picture shows as values that `json` can write; a number that is not finite is null.

    Returns
    -------
    dict
        Without what has its default value; ``kind`` names the type of a chart or mark.

    >>> from pretravel.show.chart import Axis, PlaneChart
    >>> chart = PlaneChart("", Axis("time", "s"), Axis("force", "N"), (Rule(2.0),))
    >>> view_values(View("Force", (chart,)))["charts"][0]["marks"]
    [{'kind': 'Rule', 'value': 2.0}]
    """
    values: dict[str, Any] = _plain(view)
    return values


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        if value.dtype.kind in "iu" or np.all(np.isfinite(value)):
            return value.tolist()
        return _plain(tuple(value.tolist()))
    if isinstance(value, tuple | list):
        return [_plain(part) for part in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if not is_dataclass(value):
        return value
    kind = {_KIND: type(value).__name__} if isinstance(value, _TAGGED) else {}
    stated = {field.name: (getattr(value, field.name), field.default) for field in fields(value)}
    return kind | {
        name: _plain(each)
        for name, (each, default) in stated.items()
        if isinstance(each, np.ndarray) or each != default
    }


def register_views(converter: Converter) -> None:
    """Let a converter make views from values of `view_values`.

    Arrays and their shapes are checked: a drawing program trusts them.

    Parameters
    ----------
    converter : Converter
        With the hooks for plain types.
    """
    from cattrs.strategies import configure_tagged_union

    converter.register_structure_hook_func(_is_array, _array)
    for union in _UNIONS:
        for kind in get_args(union):
            converter.register_structure_hook(kind, _checked(converter.get_structure_hook(kind)))
        configure_tagged_union(union, converter, tag_name=_KIND)
    whole = converter.get_structure_hook(View)

    def view(values: Any, kind: Any) -> View:
        found: View = whole(values, kind)
        if not 1 <= len(found.charts) <= _MOST_CHARTS or found.columns < 1:
            raise ValueError("no charts, or too many")
        if not all(abs(number) <= LARGEST_NUMBER for number in _numbers(found)):
            raise ValueError("a number is not finite, or too large")
        return found

    converter.register_structure_hook(View, view)


def _numbers(part: Any) -> Iterator[float]:
    """The numbers of a view, without those of its arrays."""
    if isinstance(part, float):
        yield part
    elif isinstance(part, tuple):
        for each in part:
            yield from _numbers(each)
    elif is_dataclass(part):
        for field in fields(part):
            yield from _numbers(getattr(part, field.name))


def _is_array(kind: Any) -> bool:
    origin: Any = get_origin(kind)
    return origin is np.ndarray


def _checked(made: Any) -> Any:
    def structure(values: Any, kind: Any) -> Any:
        found = made(values, kind)
        _check_shapes(found)
        return found

    return structure


def _array(values: Any, kind: Any) -> Any:
    array = np.array(values, dtype=np.float64)
    if np.any(np.abs(array) > LARGEST_NUMBER):
        raise ValueError("a number is too large")
    if np.integer in get_args(get_args(kind)[1]):
        return array.astype(np.int64)
    return array


def _check_shapes(found: Any) -> None:
    """Refuse arrays whose shapes do not fit their meaning."""
    if not isinstance(found, FrozenArrays):
        return
    arrays: Mapping[str, Any] = {
        field.name: value
        for field in fields(found)  # type: ignore[arg-type]
        if isinstance(value := getattr(found, field.name), np.ndarray)
    }
    for name, array in arrays.items():
        shape: tuple[int, ...] = (len(array),) if array.ndim else ()
        if name in _IN_SPACE:
            shape = (len(array), 3)
        elif name in ("start", "vector"):
            shape = (3,)
        elif isinstance(found, TopView) and name == "values":
            shape = (len(found.polar_deg), len(found.azimuth_deg))
        if array.ndim == 0 or array.shape != shape:
            raise ValueError(f"{name} has the shape {array.shape}")
    if isinstance(found, SpaceMesh) and np.any(
        (found.triangles < 0) | (found.triangles >= len(found.vertices))
    ):
        raise ValueError("a triangle has a corner that is not there")
