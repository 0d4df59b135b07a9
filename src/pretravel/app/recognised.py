"""What a file is, by its first bytes, where it was dropped in a place of something else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

_TOUCHES = ("touches", "log")
"""Purposes of tables of touches and logs of a control."""
_MAPS = ("map", "map_file")
_BEGIN = 4000
"""Bytes that tell what a file is."""


@dataclass(frozen=True)
class Kind:
    """A kind of file, and the screen that takes it.

    Attributes
    ----------
    words : str
        What it is.
    marks : tuple of bytes
        All of them are in its first lines.
    screen, purpose : str
        Where it belongs; empty where the page of the project opens it.
    not_for : tuple of str
        Purposes of files that it cannot be.
    several : bool
        Whether the place takes several.
    settings : mapping of str to value
        Of the screen, so that the place is there.
    """

    words: str
    marks: tuple[bytes, ...]
    screen: str
    purpose: str
    not_for: tuple[str, ...]
    several: bool = False
    settings: Mapping[str, str] = field(default_factory=dict)


FILE_KINDS = (
    Kind(
        "the map of a probe", (b'"schema": "pretravel map"',), "part", "map",
        (*_TOUCHES, "traces", "readings", "history", "part"),
    ),
    Kind(
        "the history of a probe", (b'"schema": "pretravel verification"',), "daily", "history",
        (*_TOUCHES, "traces", "readings", "map", "map_file", "part"),
    ),
    Kind(
        "a trace of a calibration rig", (b"time_s", b"ruler_mm", b"laser_mm"),
        "laboratory", "traces", (*_TOUCHES, "readings", "map", "map_file", "history", "part"),
        several=True, settings={"work": "rig"},
    ),
    Kind(
        "a table of multi-step readings", (b"machine_index", b"probe_index"),
        "laboratory", "readings", (*_TOUCHES, "traces", "map", "map_file", "history", "part"),
        settings={"work": "separation"},
    ),
    Kind(
        "a part (STEP)", (b"ISO-10303-21",), "part", "part",
        (*_TOUCHES, "traces", "readings", "map", "map_file", "history"),
    ),
    Kind(
        "a project of the workbench", (b"PK\3\4", b"files/"), "", "",
        (*_TOUCHES, "traces", "readings", "map", "map_file", "history", "part"),
    ),
)  # fmt: skip


def kind_of(content: bytes) -> Kind | None:
    """The kind of a file; None of one that is not recognised.

    >>> kind_of(b'{"schema": "pretravel map"}').purpose
    'map'
    """
    begin = content[:_BEGIN]
    return next((kind for kind in FILE_KINDS if all(m in begin for m in kind.marks)), None)


def not_this(name: str, content: bytes, purpose: str) -> str:
    """Why a purpose cannot take a file, by its first bytes; empty where it may.

    >>> not_this("letter.txt", b"Dear Sir", "touches")[:48]
    'letter.txt, line 1: the text is not a table of t'
    >>> not_this("other.json", b"{}", "map")
    'other.json is not a map of a probe: “Qualify a probe” makes one'
    >>> not_this("sphere.csv", b"x_mm,y_mm,z_mm", "touches")
    ''
    """
    from pretravel.base import PretravelError
    from pretravel.files import READABLE_FORMATS, SourceFile, format_of

    begin = content[:_BEGIN]
    if purpose in _MAPS and name.endswith(".json") and kind_of(content) is not FILE_KINDS[0]:
        return f"{name} is not a map of a probe: “Qualify a probe” makes one"
    if purpose in _TOUCHES:
        try:
            format_of(SourceFile(name, begin))
        except PretravelError as error:
            return str(error).partition(READABLE_FORMATS)[0].strip()
    return ""


def kind_elsewhere(content: bytes, purpose: str) -> Kind | None:
    """The kind of a file that a purpose cannot take; None where it may be of this purpose.

    >>> kind_elsewhere(b"time_s,ruler_mm,laser_mm,contact,trigger", "touches").words
    'a trace of a calibration rig'
    >>> kind_elsewhere(b"x_mm,y_mm,z_mm", "touches")
    """
    kind = kind_of(content)
    return kind if kind is not None and purpose in kind.not_for else None
