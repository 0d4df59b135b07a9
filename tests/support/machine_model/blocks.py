"""Lines of G-code, read once: words, settings of parameters, comments, O-words."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache

from tests.support.machine_model.errors import StopError
from tests.support.machine_model.expressions import Reader, Value

LONGEST = 255
"""A line with as many characters, its end included, is too long."""
WORDS = "abcdefghijklpqrstuvwxyz$"
_KEYWORDS = ("endsub", "sub", "return", "call", "elseif", "else", "endif", "if", "endwhile",
             "while", "do", "endrepeat", "repeat", "break", "continue")  # fmt: skip
_WITH_A_VALUE = ("if", "elseif", "while", "repeat")


@dataclass(frozen=True)
class OWord:
    """An O-word: its label (or a value that makes it), keyword, and values."""

    label: str
    computed: Value | None
    keyword: str
    values: tuple[Value, ...] = ()


@dataclass(frozen=True)
class Setting:
    """A setting of a parameter, numbered or named."""

    name: str
    index: Value | None
    value: Value


@dataclass
class Block:
    """One line: what it contains, or why it cannot be read."""

    text: str
    o_word: OWord | None = None
    words: dict[str, Value] = field(default_factory=dict)
    g_codes: tuple[Value, ...] = ()
    m_codes: tuple[Value, ...] = ()
    settings: tuple[Setting, ...] = ()
    comment: str | None = None
    percent: bool = False
    error: str = ""


def _stripped(line: str) -> tuple[str, list[str]]:
    """The line in lower case without blanks and comments, and the comments."""
    kept, comments, at = [], [], 0
    while at < len(line):
        character = line[at]
        if character == ";":
            comments.append(line[at + 1 :])
            break
        if character == ")":
            raise StopError("Unmatched close comment")
        if character == "(":
            end = line.find(")", at)
            if end < 0:
                raise StopError("Unclosed comment found")
            if "(" in line[at + 1 : end]:
                raise StopError("Nested comment found")
            comments.append(line[at + 1 : end])
            # Nothing of a number or word is joined across a comment.
            kept.append("\0")
            at = end
        elif not character.isspace():
            kept.append(character.lower())
        at += 1
    return "".join(kept), comments


@lru_cache(maxsize=100_000)
def read_block(line: str) -> Block:
    """Read one line. What is wrong with it is kept: a skipped line may be wrong."""
    block = Block(line)
    try:
        _read(line, block)
    except StopError as stop:
        block.error = stop.text
    return block


def _read(line: str, block: Block) -> None:
    if not line.isascii():
        # Comments may hold any character; outside, none is known.
        pass
    text, comments = _stripped(line.rstrip("\r\n"))
    block.comment = comments[-1] if comments else None
    if text.strip("\0") == "%":
        block.percent = True
        return
    reader = Reader(text)
    reader.take("/")
    if re.match(r"\0*n\d", text[reader.at :]):
        while reader.take("\0"):
            pass
        reader.take("n")
        reader.at = re.compile(r"\d+(\.\d+)?").match(text, reader.at).end()  # type: ignore[union-attr]
    settings: list[Setting] = []
    codes: dict[str, list[Value]] = {"g": [], "m": []}
    while not reader.done():
        if reader.take("\0"):
            continue
        letter = reader.next()
        if letter == "o" and block.o_word is None:
            reader.take("o")
            block.o_word = _o_word(reader)
        elif letter == "#":
            settings.append(_setting(reader))
        elif letter in codes or letter in WORDS:
            reader.at += 1
            value = reader.value()
            if letter in codes:
                codes[letter].append(value)
            elif letter in block.words:
                raise StopError(f"Multiple {letter} words on one line")
            else:
                block.words[letter] = value
        else:
            raise StopError(f"Bad character '{letter}' used")
    block.settings = tuple(settings)
    block.g_codes, block.m_codes = tuple(codes["g"]), tuple(codes["m"])


def _setting(reader: Reader) -> Setting:
    reader.take("#")
    name, index = "", None
    if reader.next() == "<":
        name = reader.name()
    else:
        index = reader.value()
    if not reader.take("="):
        raise StopError("Equal sign missing in parameter setting")
    return Setting(name, index, reader.value())


def _o_word(reader: Reader) -> OWord:
    label, computed = "", None
    if reader.next() == "<":
        label = reader.name()
    elif (found := re.compile(r"\d+").match(reader.text, reader.at)) is not None:
        reader.at = found.end()
        label = str(int(found[0]))
    else:
        computed = reader.value()
    keyword = next((word for word in _KEYWORDS if reader.take(word)), "")
    if not keyword:
        raise StopError("Unknown control after o-word")
    values = []
    if keyword in _WITH_A_VALUE:
        if reader.next() != "[":
            raise StopError(f"Left bracket missing after '{keyword}'")
        values.append(reader.value())
    elif keyword in ("call", "return", "endsub"):
        while reader.next() == "[":
            values.append(reader.value())
            if keyword != "call":
                break
    return OWord(label, computed, keyword, tuple(values))
