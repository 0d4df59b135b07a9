"""The flow of a program: files of lines, and where O-words lead."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from tests.support.machine_model.blocks import LONGEST, Block, read_block
from tests.support.machine_model.errors import StopError


@dataclass(frozen=True, eq=False)
class SourceFile:
    """A file of G-code.

    Attributes
    ----------
    name : str
    blocks : tuple of Block
    chains : dict
        For the row of each O-word of an if, while, repeat or do: the rows of all O-words of its
        structure, in order.
    subs : dict
        Row of `sub` by label.
    """

    name: str
    blocks: tuple[Block, ...]
    chains: dict[int, tuple[int, ...]]
    subs: dict[str, int]


_OPEN = ("if", "while", "repeat", "do")


@lru_cache(maxsize=2000)
def read_source(name: str, text: str) -> SourceFile:
    """Read all lines of a file, and find its structures."""
    blocks = tuple(
        read_block(line) if len(line) < LONGEST - 1 else Block(line, error="Command too long")
        for line in text.splitlines()
    )
    chains: dict[int, tuple[int, ...]] = {}
    subs: dict[str, int] = {}
    open_rows: dict[tuple[str, str], list[int]] = {}
    closed: set[tuple[str, str]] = set()
    scope = ""
    for row, block in enumerate(blocks):
        word = block.o_word
        if word is None or word.computed is not None:
            continue
        key = (scope, word.label)
        if word.keyword == "sub":
            subs[word.label] = row
            scope = word.label
        elif word.keyword == "endsub":
            scope = ""
        elif word.keyword in ("return", "call"):
            continue
        elif word.keyword in _OPEN and key not in open_rows:
            if key in closed:
                block = blocks[row]
                chains[row] = (-1,)
                continue
            open_rows[key] = [row]
        elif key in open_rows:
            open_rows[key].append(row)
            closes = word.keyword.startswith("end") or (
                word.keyword == "while" and blocks[open_rows[key][0]].o_word.keyword == "do"  # type: ignore[union-attr]
            )
            if closes:
                rows = tuple(open_rows.pop(key))
                chains.update(dict.fromkeys(rows, rows))
                closed.add(key)
    return SourceFile(name, blocks, chains, subs)


class Files:
    """The program and the folder of subroutines."""

    def __init__(self, text: str, subroutines: Mapping[str, str] | Path | None) -> None:
        self.main = read_source("program", text)
        self.subroutines = subroutines

    def find(self, label: str, current: SourceFile) -> tuple[SourceFile, int]:
        """The file and row of a subroutine."""
        for source in (current, self.main):
            if label in source.subs:
                return source, source.subs[label]
        text = self._text(label)
        if text is not None:
            source = read_source(f"{label}.ngc", text)
            if label in source.subs:
                return source, source.subs[label]
        raise StopError(f"EOF in file:{current.name} seeking o-word: o<{label}>")

    def has(self, label: str) -> bool:
        """Whether the folder has a file of this subroutine."""
        return self._text(label) is not None

    def _text(self, label: str) -> str | None:
        if isinstance(self.subroutines, Path):
            path = self.subroutines / f"{label}.ngc"
            return path.read_text(encoding="utf-8") if path.is_file() else None
        return (self.subroutines or {}).get(f"{label}.ngc")
