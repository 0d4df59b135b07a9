"""TOML files into value types, with the line and the key in every error.

`read_toml` reads a file, `TomlStructure` states which key fills which field and makes the values.
A key that ends in a unit (``radius_mm``, ``rod_azimuths_deg``) is converted to the unit inside.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_origin

from pretravel.base.errors import InputError, PretravelError
from pretravel.base.quantities import decimal_point_advice
from pretravel.base.units import DEGREE, GIGAPASCAL, LARGEST_NUMBER, MICROMETRE

if TYPE_CHECKING:
    from cattrs import Converter

Value = TypeVar("Value")
KeyPath = tuple[str | int, ...]
"""Keys and indices from the top of a document down to a value."""

_UNITS: Mapping[str, float] = {
    "_um": MICROMETRE,
    "_deg": DEGREE,
    "_g": 1e-3,
    "_GPa": GIGAPASCAL,
    "_g_cm3": 1e-6,
}
"""Endings of keys whose unit is not the one inside: factor to mm, rad, kg, MPa, kg/mm³."""
_MOST_SIGNS, _LONGEST_LINE = 200_000, 5_000
_MOST_BYTES = 4
"""Of a sign in UTF-8."""
_LONGEST_STATEMENT = 300
"""Lines of one statement, after which the lines of keys are no longer sought."""
_QUOTED = 60
"""Most characters of a value that a message quotes."""


@dataclass(frozen=True)
class TomlDocument:
    r"""The tables of a TOML text, and the line of each key.

    Parameters
    ----------
    tables : mapping
        As `tomllib` reads them.
    text : str
    path : str
        The name of the text in messages: the path of a file.

    >>> document = parse_toml("[probe]\ntool = 7\n", "mill.toml")
    >>> document.line("probe", "tool")
    2
    >>> print(document.error("tool must be positive", "probe", "tool"))
    mill.toml, line 2: tool must be positive
    """

    tables: Mapping[str, Any]
    text: str
    path: str

    @cached_property
    def _lines(self) -> Mapping[KeyPath, int]:
        return _lines_of_keys(self.text)

    def line(self, *place: str | int) -> int | None:
        """The line of a table or key, or of the nearest table above it that the text contains."""
        while place and place not in self._lines:
            place = place[:-1]
        return self._lines.get(place)

    def error(self, message: str, *place: str | int) -> InputError:
        """The error to raise for a table or key."""
        return InputError(message, path=self.path, line=self.line(*place))

    @contextmanager
    def located(self, *place: str | int) -> Iterator[None]:
        """Adds the file and the line of a table or key to errors of the values made from it."""
        try:
            yield
        except InputError:
            raise
        except PretravelError as error:
            raise self._with_place(error, str(error), place) from None

    def _with_place(self, error: PretravelError, message: str, place: KeyPath) -> PretravelError:
        return type(error)(str(self.error(message, *place)), inputs=error.inputs)


def parse_toml(text: str, path: str | Path = "") -> TomlDocument:
    """A document from TOML text.

    Raises
    ------
    InputError
        Text that is not TOML, with the line.

    >>> parse_toml("[probe", "mill.toml")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.InputError: mill.toml, line 1: not valid TOML: ...
    """
    _refuse_size(text, path)
    _refuse_long_lines(text, path)
    try:
        return TomlDocument(tomllib.loads(text), text, str(path))
    except RecursionError:
        raise InputError("its values are nested too deeply", path=path) from None
    except tomllib.TOMLDecodeError as error:
        stated = re.search(r"at line (\d+)", str(error))
        line = int(stated[1]) if stated else len(text.splitlines())
        number = re.match(r"[^=#]*=([^#]*)", (text.split("\n")[line - 1 : line] or [""])[0])
        advice = decimal_point_advice(number[1]) if number else ""
        message = advice or f"not valid TOML: {error}"
        raise InputError(message, path=path, line=line) from None
    except ValueError:  # Python reads no integer of more than 4300 digits
        digits = re.compile(r"[0-9_]{1000,}")
        place = next((n for n, row in enumerate(text.split("\n"), 1) if digits.search(row)), None)
        raise InputError(
            "a number has thousands of digits; write it with fewer",
            path=path,
            line=place,
        ) from None


def _refuse_size(content: str | bytes, path: str | Path) -> None:
    most = _MOST_SIGNS * (_MOST_BYTES if isinstance(content, bytes) else 1)
    if len(content) > most:
        raise InputError(f"files of this kind have at most {_MOST_SIGNS} characters", path=path)


def _refuse_long_lines(text: str, path: str | Path) -> None:
    """Refuse lines whose parts would take time that grows with the square of the line."""
    for number, row in enumerate(text.split("\n"), start=1):
        if len(row) > _LONGEST_LINE:
            raise InputError(
                f"the line has {len(row)} characters; lines of this kind of file have at most "
                f"{_LONGEST_LINE}",
                path=path,
                line=number,
            )


def read_toml(path: str | Path, kind: str, hint: str = "") -> TomlDocument:
    """A document from a file.

    Parameters
    ----------
    path : str or Path
    kind : str
        The name of this kind of file in messages: ``machine file``.
    hint : str
        What to do when there is no such file.

    Raises
    ------
    InputError
        No such file, or a file that is not TOML.

    >>> read_toml("none.toml", "machine file")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.InputError: none.toml: there is no such machine file
    """
    try:
        with Path(path).open("rb") as stream:
            content = stream.read(_MOST_BYTES * _MOST_SIGNS + 1)
        _refuse_size(content, path)
        text = content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except FileNotFoundError:
        advice = f"; {hint}" if hint else ""
        raise InputError(f"there is no such {kind}{advice}", path=path) from None
    except UnicodeDecodeError:
        raise InputError(f"not a text file, so not a {kind}", path=path) from None
    except OSError as error:
        raise InputError(f"the {kind} cannot be read: {error.strerror}", path=path) from None
    return parse_toml(text, path)


class TomlStructure:
    r"""The keys of one kind of TOML file, and the value types that they fill.

    Every table is a dataclass. A field has the key of its name, unless `table` names another one.
    A field without a default is needed. Numbers are finite; an integer is accepted as a float.

    Parameters
    ----------
    hint : str
        Added when tables or keys are missing: where to find a whole file.

    >>> @dataclass(frozen=True)
    ... class Feeds:
    ...     measuring: float
    ...     start: float = 4.0
    >>> structure = TomlStructure()
    >>> structure.table(Feeds, measuring="measuring_mm_min", start="start_um")
    >>> document = parse_toml("[feeds]\nmeasuring_mm_min = 50\nstart_um = 250.0\n", "mill.toml")
    >>> structure.make(document, Feeds, "feeds")
    Feeds(measuring=50.0, start=0.25)
    >>> wrong = parse_toml("[feeds]\nmeasuring_mm = 50\n", "mill.toml")
    >>> structure.make(wrong, Feeds, "feeds")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.InputError: mill.toml, line 2: [feeds] has no measuring_mm; it has
    measuring_mm_min, start_um. Did you mean measuring_mm_min?
    """

    def __init__(self, *, hint: str = "") -> None:
        self._hint = hint
        self._keys: dict[type, dict[str, str]] = {}

    @cached_property
    def _converter(self) -> Converter:
        from cattrs import Converter  # with the first document: many commands read none

        made = Converter(forbid_extra_keys=True)
        made.register_structure_hook_factory(is_dataclass, self._dataclass_hook)
        made.register_structure_hook_factory(_is_sequence, self._sequence_hook)
        made.register_structure_hook_factory(_is_mapping, self._mapping_hook)
        made.register_structure_hook(float, lambda value, _: _number(value))
        made.register_structure_hook(int, lambda value, _: _integer(value))
        made.register_structure_hook(bool, lambda value, _: _yes_or_no(value))
        made.register_structure_hook(str, lambda value, _: _text(value))
        return made

    def table(self, kind: type, **keys: str) -> None:
        """State the keys of a table where they differ from the names of the fields.

        Parameters
        ----------
        kind : type
            The dataclass that the table becomes.
        **keys : str
            Key of each field.
        """
        self._keys[kind] = keys

    def value(self, kind: type[Value], make: Callable[[Any], Value]) -> None:
        """State how a value type is made from the value in the file.

        Parameters
        ----------
        kind : type
        make : callable
            Raises a `ValueError` that completes the sentence "KEY …": "must be a number".
        """
        self._converter.register_structure_hook(kind, lambda value, _: make(value))

    def make(self, document: TomlDocument, kind: type[Value], *place: str | int) -> Value:
        """The value of a document, or of the table at `place`.

        Raises
        ------
        InputError
            Tables or keys that are unknown or missing, values of the wrong type: with the line.
        PretravelError
            What the value types refuse: the same error with the table and its line.
        """
        from cattrs import BaseValidationError

        tables: Any = document.tables
        for key in place:
            tables = tables[key]
        try:
            return self._converter.structure(tables, kind)
        except (BaseValidationError, ValueError) as error:
            fault = min(self._faults(error, place, tables), key=_Fault.urgency)
            raise fault.error(document) from None

    def keys(self, kind: type) -> dict[str, str]:
        """Key by field of a table."""
        own = self._keys.get(kind, {})
        return {f.name: own.get(f.name, f.name) for f in fields(kind) if f.init}

    def _dataclass_hook(self, kind: type) -> Callable[[Any, Any], Any]:
        from cattrs import override
        from cattrs.gen import make_dict_structure_fn

        overrides = {
            field: override(rename=key, struct_hook=self._unit_hook(key))
            for field, key in self.keys(kind).items()
        }
        make = make_dict_structure_fn(kind, self._converter, **overrides)  # type: ignore[arg-type,var-annotated]

        def hook(value: Any, _: Any) -> Any:
            if not isinstance(value, Mapping):
                raise ValueError(f"must be a table, got {quoted(value)}")
            return make(value, kind)

        return hook

    def _unit_hook(self, key: str) -> Callable[[Any, Any], Any] | None:
        endings = [ending for ending in _UNITS if key.endswith(ending)]
        if not endings:
            return None
        unit = _UNITS[max(endings, key=len)]

        def hook(value: Any, kind: Any) -> Any:
            made = self._converter.structure(value, kind)
            if isinstance(made, tuple):
                return tuple(part * unit for part in made)
            return None if made is None else made * unit

        return hook

    def _sequence_hook(self, kind: Any) -> Callable[[Any, Any], Any]:
        """Of a tuple: of any length, or of the length that the type states."""
        parts = get_args(kind)
        count = None if parts[-1] is Ellipsis else len(parts)
        make = self._converter.get_structure_hook(list[parts[0]])  # type: ignore[valid-type]

        def hook(value: Any, _: Any) -> Any:
            if is_dataclass(parts[0]) and not isinstance(value, list):
                raise _NoListOfTablesError
            if not isinstance(value, list) or (count is not None and len(value) != count):
                raise ValueError(f"must be {_list_words(parts[0], count)}, got {quoted(value)}")
            return tuple(make(value, list[parts[0]]))  # type: ignore[valid-type]

        return hook

    def _mapping_hook(self, kind: Any) -> Callable[[Any, Any], Any]:
        part = get_args(kind)[1]
        make = self._converter.get_structure_hook(dict[str, part])  # type: ignore[valid-type]

        def hook(value: Any, _: Any) -> Any:
            if not isinstance(value, Mapping):
                raise ValueError(f"must be a table, got {quoted(value)}")
            return make(value, dict[str, part])  # type: ignore[valid-type]

        return hook

    def _faults(self, error: Exception, place: KeyPath, tables: Any) -> Iterator[_Fault]:
        """What was wrong, each with its place, from the nested errors of cattrs."""
        from cattrs import (
            ClassValidationError,
            ForbiddenExtraKeysError,
            IterableValidationError,
        )

        if isinstance(error, ClassValidationError):
            attributes, others = error.group_exceptions()
            keys = self.keys(error.cl)
            missing: list[str] = []
            for inner, note in attributes:
                key = keys[note.name]
                if key not in tables:
                    missing.append(key)
                else:
                    yield from self._faults(inner, (*place, key), tables[key])
            if missing:
                yield self._missing(error.cl, place, missing)
            for inner in others:
                yield from self._faults(inner, place, tables)
        elif isinstance(error, IterableValidationError):
            for inner, step in error.group_exceptions()[0]:
                yield from self._faults(inner, (*place, step.index), tables[step.index])
        elif isinstance(error, ForbiddenExtraKeysError):
            for key in sorted(error.extra_fields):
                yield self._unknown(error.cl, place, key)
        elif isinstance(error, _NoListOfTablesError):
            yield _Fault(2, place, f"must be a list of tables: write [[{place[-1]}]] above each")
        elif isinstance(error, ValueError):
            yield _Fault(2, place, str(error), error)
        else:
            raise error

    def _unknown(self, kind: type, place: KeyPath, key: str) -> _Fault:
        known = self.keys(kind).values()
        close = get_close_matches(key, known, n=1)
        if place:
            message = f"{_words(place)} has no {key}; it has {', '.join(known)}"
            message += f". Did you mean {close[0]}?" if close else ""
        else:
            message = f"there is no [{key}] in this kind of file; there are {', '.join(known)}"
            message += f". Did you mean [{close[0]}]?" if close else ""
        return _Fault(0, (*place, key), message)

    def _missing(self, kind: type, place: KeyPath, missing: Sequence[str]) -> _Fault:
        advice = f"; {self._hint}" if self._hint else ""
        if place:
            known = ", ".join(self.keys(kind).values())
            message = f"{_words(place)} needs {', '.join(missing)}; it has {known}{advice}"
        else:
            names = ", ".join(f"[{key}]" for key in missing)
            one = len(missing) == 1
            message = f"the table{'' if one else 's'} {names} {'is' if one else 'are'} missing"
            message += advice
        return _Fault(1, place, message)


class _NoListOfTablesError(ValueError):
    """A single table where a list of tables is needed."""


@dataclass(frozen=True)
class _Fault:
    """One thing that is wrong in a document; an unknown key first, as it explains a missing one."""

    rank: int
    place: KeyPath
    message: str
    cause: Exception | None = None

    def urgency(self) -> tuple[int, int]:
        return (self.rank, len(self.place))

    def error(self, document: TomlDocument) -> PretravelError:
        """The error to raise: of the value's own type where the value itself refused."""
        if isinstance(self.cause, PretravelError):
            message = f"{_words(self.place)}: {self.message}" if self.place else self.message
            return document._with_place(self.cause, message, self.place)
        if self.rank < 2:
            return document.error(self.message, *self.place)
        top = document.tables.get(str(self.place[0]))
        words = _words(self.place) if isinstance(top, dict | list) else str(self.place[0])
        return document.error(f"{words} {self.message}", *self.place)


def _words(place: KeyPath) -> str:
    """A place as a reader finds it in the file: [tripod] radius_mm, [[stylus]] number 2."""
    words: list[str] = []
    for number, step in enumerate(place, start=1):
        after = place[number] if number < len(place) else None
        if isinstance(step, int):
            words.append(f"number {step + 1}")
        elif isinstance(after, int):
            words.append(f"[[{step}]]")
        elif after is not None or not words:
            words.append(f"[{step}]")
        else:
            words.append(step)
    return " ".join(words)


def _is_sequence(kind: Any) -> bool:
    return get_origin(kind) is tuple


def _is_mapping(kind: Any) -> bool:
    return get_origin(kind) is Mapping


def _list_words(part: Any, count: int | None) -> str:
    noun = {float: "numbers", int: "integers", str: "texts"}.get(part, "values")
    numerals = {2: "two", 3: "three"}
    return f"a list of {noun}" if count is None else f"{numerals.get(count, count)} {noun}"


def quoted(value: Any) -> str:
    """A value of a file as a message quotes it.

    >>> quoted(7), quoted("a"), len(quoted([1] * 1000)), quoted(16**4000)
    ('7', "'a'", 60, 'an integer of 16001 bits')
    """
    if isinstance(value, int) and value.bit_length() > 200:
        return f"an integer of {value.bit_length()} bits"
    try:
        shown = repr(value)
    except (ValueError, RecursionError):  # such an integer within it, or nested deeply
        return f"a {type(value).__name__}"
    return shown if len(shown) <= _QUOTED else f"{shown[: _QUOTED - 1]}…"


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        advice = decimal_point_advice(value) if isinstance(value, str) else ""
        raise ValueError(f"must be a number, got {quoted(value)}" + (advice and f"; {advice}"))
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"must be a finite number, got {value}")
    if abs(value) > LARGEST_NUMBER:
        raise ValueError(f"is larger than any value of this kind: {quoted(value)}")
    return float(value)


def _integer(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"must be an integer, got {quoted(value)}")
    if abs(value) > LARGEST_NUMBER:
        raise ValueError(f"is larger than any value of this kind: {quoted(value)}")
    return value


def _yes_or_no(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"must be true or false, got {quoted(value)}")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"must be text in quotes, got {quoted(value)}")
    return value


def _lines_of_keys(text: str) -> dict[KeyPath, int]:
    """The line of each table and key; of a value over several lines, the first.

    A statement of TOML is complete as soon as it is valid TOML.
    """
    lines: dict[KeyPath, int] = {}
    lists: dict[KeyPath, int] = {}
    table: KeyPath = ()
    statement, first = "", 1
    for number, line in enumerate(text.split("\n"), start=1):
        first = first if statement else number
        statement += line + "\n"
        if number - first >= _LONGEST_STATEMENT:
            break
        try:
            content = tomllib.loads(statement)
        except tomllib.TOMLDecodeError:
            continue
        if statement.lstrip().startswith("["):
            table = _place_of_head(content, lists)
            for length in range(1, len(table)):
                lines.setdefault(table[:length], first)
            lines[table] = first
        else:
            for place in _places(content):
                lines.setdefault((*table, *place), first)
        statement = ""
    return lines


def _place_of_head(head: Mapping[str, Any], lists: dict[KeyPath, int]) -> KeyPath:
    """The place that the head of a table states; `lists` holds the last index of each list."""
    place: KeyPath = ()
    inside: Any = head
    while inside:
        key, inside = next(iter(inside.items()))
        place = (*place, key)
        if isinstance(inside, list):
            lists[place] = lists.get(place, -1) + 1
            inside = inside[0]
        if place in lists:
            place = (*place, lists[place])
    return place


def _places(content: Any) -> Iterator[KeyPath]:
    """The places of all keys in a value."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            yield (key,)
            yield from ((key, *below) for below in _places(value))
