"""Public names, parameters, commands and options stay: docs/stability.md."""

from __future__ import annotations

import re
from dataclasses import dataclass
from types import ModuleType

import pytest

import pretravel
from tests.api.public_names import FILE, breaks, current_lines, recorded_lines


def test_nothing_that_is_public_has_vanished() -> None:
    """A name that goes is first deprecated, then its line is deleted: docs/stability.md."""
    recorded = recorded_lines(FILE.read_text("utf-8"))
    assert len(recorded) > 300
    assert breaks(recorded, current_lines()) == []


EXTENSION = {"pretravel.maps.kinds.mean import averaged"}
"""Of another package's kinds, as docs/stability.md says."""


def test_pages_import_what_is_public() -> None:
    found = set()
    for page in FILE.parents[2].glob("docs/**/*.md"):
        found |= set(re.findall(r">>> from (pretravel\S* import .+)", page.read_text("utf-8")))
    assert len(found) > 2
    parts = [line.partition(" import ") for line in found - EXTENSION]
    assert {module for module, *_ in parts} == {"pretravel"}
    names = {name for *_, names in parts for name in names.split(", ")}
    assert names <= set(pretravel.__all__)


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("f(a)", "f(a, b=)", []),
        ("f(a)", "f(a, *, b=)", []),
        ("f(*, a=)", "f(*, b=, a=)", []),
        ("f(*, a=)", "f(a=)", []),
        ("f(a)", "f(a=)", []),
        ("f(a)", "f(a, b)", ["f: b must now be given"]),
        ("f(a=)", "f(a)", ["f: a must now be given"]),
        ("f(a, b)", "f(b, a)", ["f: the order of its parameters has changed"]),
        ("f(a, b=)", "f(a, *, b=)", ["f: the order of its parameters has changed"]),
        ("f(a, b=)", "f(a, c=)", ["f: the parameter b is gone"]),
        ("f(a)", "g(a)", ["f is gone"]),
        ("f(a)", "f", ["f can no longer be used as it was"]),
        ("T.p", "T.p()", ["T.p can no longer be used as it was"]),
        ("pretravel qualify --ring", "pretravel qualify", ["pretravel qualify --ring is gone"]),
    ],
)
def test_what_breaks_a_program(before: str, after: str, expected: list[str]) -> None:
    assert breaks([before], [after]) == expected


def test_lines_of_a_small_package() -> None:
    class Base:
        @property
        def size(self) -> int:
            return 0

        def grow(self, by: int, *, slowly: bool = False) -> None: ...

        def _hidden(self) -> None: ...

    @dataclass
    class Result:
        """A result.

        Attributes
        ----------
        height : float
        """

        height: float

    Base.__module__ = "pretravel.made_up"
    package = ModuleType("small")
    public = {"Base": Base, "NUMBER": 3, "Result": Result}
    package.__dict__.update(__all__=[*public], **public)
    found = [line for line in current_lines(package) if not line.startswith("pretravel")]
    assert found == [
        "Base()",
        "Base.grow(by, *, slowly=)",
        "Base.size",
        "NUMBER",
        "Result",
        "Result.height",
    ]
