"""The instances of a STEP file as its text states them (ISO 10303-21)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from pretravel.base import InputError

_COMMENT = re.compile(r"'[^']*(?:'|\Z)|/\*.*?\*/", re.DOTALL)
_INSTANCE = re.compile(r"#(\d{1,18})\s*=\s*((?:[^;']++|'[^']*+')*+);")
_NAMES = re.compile(r"'[^']*'|(?<![.\w])([A-Z][A-Z0-9_]*)\s*\(")
_REFERENCES = re.compile(r"'[^']*'|#(\d+)")
_TOKEN = re.compile(
    r"\s*(?:(?P<text>'(?:[^']|'')*')|#(?P<reference>\d+)|\.(?P<word>[A-Z0-9_]+)\.|"
    r"(?P<number>[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)|(?P<name>[A-Z!][A-Z0-9_]*)|"
    r'(?P<sign>[(),$*])|(?P<binary>"[0-9A-F]*"))'
)
_WIDE = re.compile(r"\\X2\\((?:[0-9A-F]{4})+)\\X0\\|\\X\\([0-9A-F]{2})")
_DEEPEST = 50
"""Lists within lists; those of AP242 are three deep."""


class TextReference(NamedTuple):
    """Another instance: ``#12``."""

    number: int


class Word(NamedTuple):
    """A value of an enumeration: ``.METRE.``."""

    name: str


class TextRecord(NamedTuple):
    """A name with its values: an entity, or a value with its type."""

    name: str
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Instance:
    """One instance: of an entity, or of several at once (a complex one).

    Attributes
    ----------
    number : int
    text : str
        What stands right of the sign of equality, in one line.
    """

    number: int
    text: str

    @cached_property
    def records(self) -> tuple[TextRecord, ...]:
        """Its entities with their values.

        Raises
        ------
        InputError
            The text is no instance.
        """
        parser = _Values(self)
        if self.text.startswith("("):
            return tuple(each for each in parser.value() if isinstance(each, TextRecord))
        value = parser.value()
        return (value,) if isinstance(value, TextRecord) else ()

    @cached_property
    def names(self) -> frozenset[str]:
        """Of its entities, also where its values cannot be read."""
        if self.text.startswith("("):
            try:
                return frozenset(each.name for each in self.records)
            except InputError:
                return frozenset(each[1] for each in _NAMES.finditer(self.text) if each[1])
        return frozenset({self.text.partition("(")[0].strip()})

    def values(self, *names: str) -> tuple[Any, ...]:
        """The attributes of entities, one after the other.

        Parameters
        ----------
        names : str
            From the supertype to the subtype. Of an instance of one entity alone all values come:
            it states those of its supertypes first.

        >>> one = Instance(1, "DATUM('',$,#2,.F.,'A')")
        >>> one.values("SHAPE_ASPECT", "DATUM")[4]
        'A'
        >>> two = Instance(1, "(DATUM('A')SHAPE_ASPECT('',$,#2,.F.))")
        >>> two.values("SHAPE_ASPECT", "DATUM")[4]
        'A'
        """
        if not self.text.startswith("("):
            return self.records[0].values if self.records else ()
        own = {each.name: each.values for each in self.records}
        return tuple(value for name in names for value in own.get(name, ()))

    @property
    def references(self) -> list[int]:
        """Numbers of all instances that it refers to, also where its values cannot be read."""
        return [int(each[1]) for each in _REFERENCES.finditer(self.text) if each[1]]


class _Values:
    """Reads values of one instance from left to right."""

    def __init__(self, instance: Instance) -> None:
        self.instance = instance
        self.tokens = list(_tokens(instance))
        self.at = 0

    def value(self, depth: int = 0) -> Any:
        kind, token = self._next()
        if depth > _DEEPEST:
            raise self._error("lists are more than 50 deep")
        if kind == "name":
            if self.tokens[self.at : self.at + 1] != [("sign", "(")]:
                raise self._error(f"'{token}' has no values")
            self.at += 1
            return TextRecord(token, self._list(depth))
        if kind == "sign":
            if token == "(":
                return self._list(depth)
            if token in ")," or token not in "$*":
                raise self._error(f"'{token}' is where a value should be")
            return None
        if kind == "text":
            return _plain(token)
        if kind == "reference":
            return TextReference(int(token))
        if kind == "word":
            return Word(token)
        return float(token) if kind == "number" else token

    def _list(self, depth: int) -> tuple[Any, ...]:
        found: list[Any] = []
        while self.at < len(self.tokens):
            if self.tokens[self.at] == ("sign", ")"):
                self.at += 1
                return tuple(found)
            if self.tokens[self.at] == ("sign", ","):
                self.at += 1
            else:
                found.append(self.value(depth + 1))
        raise self._error("a parenthesis is not closed")

    def _next(self) -> tuple[str, str]:
        if self.at >= len(self.tokens):
            raise self._error("a value is missing")
        self.at += 1
        return self.tokens[self.at - 1]

    def _error(self, what: str) -> InputError:
        return InputError(f"#{self.instance.number}: {what}: {self.instance.text[:80]}")


def _tokens(instance: Instance) -> Iterator[tuple[str, str]]:
    text, at = instance.text.rstrip(), 0
    while at < len(text):
        found = _TOKEN.match(text, at)
        if found is None:
            raise InputError(f"#{instance.number}: '{text[at : at + 20].strip()}' is not a value")
        kind = found.lastgroup or ""
        yield kind, found[kind]
        at = found.end()


def _plain(text: str) -> str:
    """A string without its quotes, with its letters beyond ASCII."""

    def decoded(found: re.Match[str]) -> str:
        if found[2]:
            return chr(int(found[2], 16))
        return bytes.fromhex(found[1]).decode("utf-16-be", "replace")

    return _WIDE.sub(decoded, text[1:-1].replace("''", "'"))


@dataclass(frozen=True, eq=False)
class Part21:
    """The instances of a file by their numbers.

    Attributes
    ----------
    path : Path
    instances : mapping of int to Instance
    """

    path: Path
    instances: dict[int, Instance]

    def __getitem__(self, value: Any) -> Instance:
        """The instance that a reference or a number names.

        Raises
        ------
        InputError
            There is none.
        """
        number = value.number if isinstance(value, TextReference) else value
        if number not in self.instances:
            raise InputError(f"there is no #{number}, to which another line refers", path=self.path)
        return self.instances[number]

    @cached_property
    def _by_name(self) -> dict[str, list[Instance]]:
        found: dict[str, list[Instance]] = {}
        for instance in self.instances.values():
            for name in instance.names:
                found.setdefault(name, []).append(instance)
        return found

    def named(self, *names: str) -> list[Instance]:
        """Instances of entities, in the file's order."""
        found = {each.number: each for name in names for each in self._by_name.get(name, ())}
        return [found[number] for number in sorted(found)]

    @property
    def names(self) -> list[str]:
        """Of all entities."""
        return sorted(self._by_name)


def read_part21(path: str | Path) -> Part21:
    r"""Read the instances of a STEP file from its text.

    Raises
    ------
    InputError
        The file cannot be opened, or is no STEP file.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "part.step"
    >>> text = "ISO-10303-21;DATA;\n#1=PLANE('a;b',#2);\nENDSEC;END-ISO-10303-21;"
    >>> read_part21(path.write_text(text) and path)[1].records
    (TextRecord(name='PLANE', values=('a;b', TextReference(number=2))),)
    """
    path = Path(path)
    try:
        text = path.read_bytes().decode("utf-8", "replace")
    except OSError as error:
        raise InputError(f"cannot be opened: {error.strerror}", path=path) from None
    if "ISO-10303-21" not in text[:4096]:
        raise InputError(
            "is not a STEP file: it does not begin with ISO-10303-21; export the part as STEP "
            "(AP242, with semantic PMI)",
            path=path,
        )
    if "/*" in text:
        text = _COMMENT.sub(lambda found: "" if found[0].startswith("/*") else found[0], text)
    found = _INSTANCE.finditer(text)
    return Part21(
        path,
        {
            int(each[1]): Instance(int(each[1]), re.sub(r"\s*\n\s*", "", each[2]).strip())
            for each in found
        },
    )
