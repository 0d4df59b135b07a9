"""A document as plain values for JSON, and back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from pretravel.base import PretravelError
from pretravel.show.chart import View
from pretravel.show.document import (
    Digits,
    Document,
    FigureValue,
    Picture,
    Span,
    Table,
)
from pretravel.show.view_values import register_views, view_values
from pretravel.show.work_record import WorkRecord

if TYPE_CHECKING:
    from cattrs import Converter

_INFINITE = {"infinite": 1}, {"infinite": -1}
_MOST_DIGITS = 30
_LARGEST_WHOLE = 10**15


def document_values(document: Document) -> dict[str, Any]:
    """A document as values that `json` can write; what is not known is null.

    Parameters
    ----------
    document : Document
        Its pictures are computed.

    Returns
    -------
    dict
        Without what has its default value.

    >>> from pretravel.show.document import KeyFigure
    >>> document_values(Document("Probe", figures=(KeyFigure("force", math.nan, "N"),)))["figures"]
    [{'name': 'force', 'value': None, 'unit': 'N'}]
    """
    values: dict[str, Any] = _plain(document)
    return values


def document_from_values(values: Mapping[str, Any]) -> Document:
    """The document of values that `document_values` made.

    Parameters
    ----------
    values : mapping

    Raises
    ------
    PretravelError
        Values of another form.

    >>> document_from_values({"title": "Probe", "verdict": "good"})
    Document('Probe'; 'good'; 0 key figures; 0 tables; 0 pictures; 0 warnings)
    >>> document_from_values({"title": 3})
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: the values are not those of a report
    """
    document: Document = _structured(values, Document)
    return document


def record_values(record: WorkRecord) -> dict[str, Any]:
    """A record of what was done as values that `json` can write.

    >>> record_values(WorkRecord("pretravel formats", (), (), "2026-01-02", ()))["date"]
    '2026-01-02'
    """
    values: dict[str, Any] = _plain(record)
    return values


def record_from_values(values: Mapping[str, Any]) -> WorkRecord:
    """The record of values that `record_values` made.

    Raises
    ------
    PretravelError
        Values of another form.
    """
    record: WorkRecord = _structured(values, WorkRecord)
    return record


def _structured(values: Mapping[str, Any], kind: type[Any]) -> Any:
    from cattrs import BaseValidationError

    try:
        return _converter().structure(values, kind)
    except (
        BaseValidationError,
        ArithmeticError,
        RecursionError,
        TypeError,
        ValueError,
        AttributeError,
        KeyError,
    ) as error:
        raise PretravelError("the values are not those of a report") from error


@cache
def _converter() -> Converter:
    """It reads; writing needs no checks, and a page is not to wait for it."""
    from cattrs import Converter, override
    from cattrs.gen import make_dict_structure_fn

    converter = Converter(forbid_extra_keys=True)
    converter.register_structure_hook(str, _text)
    converter.register_structure_hook(bool, lambda value, _: _of_type(value, bool))
    converter.register_structure_hook(int, _whole)
    converter.register_structure_hook(float, _number)
    converter.register_structure_hook(FigureValue, _figure_value)
    converter.register_structure_hook(float | str, _figure_value)
    converter.register_structure_hook(
        float | tuple[float, ...] | None, lambda value, _: _tuple_or_number(value)
    )
    register_views(converter)
    read_view = converter.get_structure_hook(View)

    def picture(value: Any, _: Any) -> Picture:
        if set(value) != {"caption", "view"}:
            raise ValueError("no picture")
        return Picture.of(_text(value["caption"], str), read_view(value["view"], View))

    converter.register_structure_hook(Picture, picture)
    read_digits = make_dict_structure_fn(Digits, converter)

    def digits(value: Any, kind: Any) -> Digits:
        found: Digits = read_digits(value, kind)
        if not 0 <= found.count <= _MOST_DIGITS:
            raise ValueError("no number of digits")
        return found

    read_table = make_dict_structure_fn(Table, converter)

    def table(value: Any, kind: Any) -> Table:
        found: Table = read_table(value, kind)
        if len({len(column.values) for column in found.columns}) != 1:
            raise ValueError("columns of different lengths, or none")
        if any(len(each.digits_of_rows) not in (0, len(each.values)) for each in found.columns):
            raise ValueError("digits of other rows")
        return found

    converter.register_structure_hook(Digits, digits)
    converter.register_structure_hook(Table, table)
    converter.register_structure_hook(
        Span, make_dict_structure_fn(Span, converter, low=override(), high=override())
    )
    return converter


def _plain(value: Any) -> Any:
    if isinstance(value, Picture):
        return {"caption": value.caption, "view": view_values(value.view)}
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    if isinstance(value, float) and math.isnan(value):
        return None
    if isinstance(value, float) and math.isinf(value):
        return _INFINITE[value < 0.0]
    if not is_dataclass(value):
        return value
    stated = {field.name: (getattr(value, field.name), field.default) for field in fields(value)}
    return {name: _plain(each) for name, (each, default) in stated.items() if each != default}


def _of_type(value: Any, kind: type[Any]) -> Any:
    if type(value) is not kind:
        raise ValueError(f"not a {kind.__name__}")
    return value


def _text(value: Any, _: Any) -> str:
    text: str = _of_type(value, str)
    text.encode()  # halves of characters, which no file can contain, are refused
    return text


def _whole(value: Any, _: Any) -> int:
    number: int = _of_type(value, int)
    if abs(number) > _LARGEST_WHOLE:
        raise ValueError("no size of a file and no number of digits")
    return number


def _number(value: Any, _: Any = None) -> float:
    if value is None:
        return math.nan
    if value in _INFINITE:
        return math.inf if value == _INFINITE[0] else -math.inf
    if type(value) not in (int, float):
        raise ValueError("not a number")
    return float(value)


def _tuple_or_number(value: Any) -> float | tuple[float, ...]:
    return tuple(map(_number, value)) if isinstance(value, list) else _number(value)


def _figure_value(value: Any, _: Any) -> FigureValue:
    if isinstance(value, str):
        return _text(value, str)
    if isinstance(value, dict) and "low" in value:
        return Span(_number(value["low"]), _number(value["high"]))
    return _tuple_or_number(value)
