"""Damaged files: mutations of samples, and what a reader does with one.

A `Reader` is a function of the content of a file. It reads the file or refuses it with a
`PretravelError`; anything else is a fault: another exception, a numerical warning, a hang, memory.
"""

from __future__ import annotations

import random
import re
import signal
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from pretravel.base.errors import PretravelError

LONGEST = 5.0
"""A reader that takes longer for a mutated file hangs. [s]"""
PATIENCE = 10.0
"""Time on the clock for each time of the processor, before what only waits is stopped."""
MESSAGE = 3000
"""Length of the longest message."""
LARGEST = 200_000
"""Size up to which a mutation lets a file grow. [bytes]"""
CORPUS = Path(__file__).parent.parent / "hard" / "corpus"
"""A folder for each reader, with the files that once broke it."""

_MEMORY = "/dev/shm" if Path("/dev/shm").is_dir() else None
"""A folder in memory, where the system has one."""
_NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
NUMBERS = (
    b"0", b"-0", b"1", b"-1", b"1e999", b"-1e999", b"1e308", b"1e-308", b"nan", b"inf", b"-inf",
    b"9" * 19, b"9" * 400, b"9" * 5000, b"1_000", b"0x1p3", b".", b"-", b"1.2.3", b"1,5", b"1e",
    "²".encode(), "٣".encode(), "−1".encode(), b"2147483648", b"1e17", b"0.1", b"1e-9",
)  # fmt: skip
TEXTS = (
    b"", b" ", b"\t", b",", b";", b":", b"=", b"(", b")", b"[", b"]", b"{", b"}", b"<", b">", b'"',
    b"'", b"/", b"$", b"%", b"#", b"\\", b"\n", b"\r", b"\r\n", b"\x0c", b"\x85", b"\x1c", b"\0",
    b"\xff", b"\xfe", b"\xff\xfe", b"\xef\xbb\xbf", "\u2028".encode(), "µ".encode(), "ı".encode(),
    b"((", b"[[", b"{{", b"{title[a]}", b"true", b"NaN", b"none", b"-" * 20,
)  # fmt: skip


@dataclass(frozen=True)
class Reader:
    """A reader of files that is tried with mutated ones.

    Attributes
    ----------
    name : str
    read : function of the content of a file
    samples : tuple of bytes
        Files that it reads, or almost.
    words : tuple of bytes
        Words of the format, for mutations.
    binary : bool
        Bytes and bits are changed, not words and lines.
    """

    name: str
    read: Callable[[bytes], object]
    samples: tuple[bytes, ...]
    words: tuple[bytes, ...] = ()
    binary: bool = False

    def corpus(self) -> tuple[bytes, ...]:
        """The samples, and the files that once broke the reader."""
        kept = sorted((CORPUS / self.name).glob("*"))
        return (*self.samples, *(path.read_bytes() for path in kept))


def at_a_path(read: Callable[[Path], object], name: str) -> Callable[[bytes], object]:
    """A function of a path as a function of the content: it is written to a file of this name."""

    def read_content(content: bytes) -> object:
        with tempfile.TemporaryDirectory(dir=_MEMORY) as folder:
            path = Path(folder) / name
            path.write_bytes(content)
            return read(path)

    return read_content


def mutated(reader: Reader, seed: str) -> bytes:
    """A mutated file; the same for the same reader, corpus and seed."""
    chance = random.Random(f"{reader.name} {seed}")
    corpus = reader.corpus() if reader.name not in _CORPORA else _CORPORA[reader.name]
    _CORPORA[reader.name] = corpus
    content = chance.choice(corpus)
    mutations = _OF_BYTES if reader.binary else _OF_TEXT
    for _ in range(min(int(chance.expovariate(0.5)) + 1, 8)):
        content = chance.choice(mutations)(content, chance, (reader, corpus))
    return content[:LARGEST]


def fault_of(reader: Reader, content: bytes, longest: float | None = LONGEST) -> str | None:
    """What is wrong with the reading of a file; None where it is read or refused.

    The first line is the same for the same fault. Without `longest`, no time is measured.
    """
    try:
        with warnings.catch_warnings(), no_longer_than(longest):
            warnings.simplefilter("ignore")
            # An overflow is a number that goes on as infinity.
            warnings.simplefilter("error", RuntimeWarning)
            reader.read(content)
    except PretravelError as refusal:
        if len(str(refusal)) > MESSAGE or not str(refusal).replace("\n", "").isprintable():
            return f"a message that cannot be shown\n{str(refusal)[:300]!r}"
        return None
    except (Exception, HangError) as error:
        frames = [f for f in traceback.extract_tb(error.__traceback__) if "pretravel" in f.filename]
        place = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "?"
        return f"{type(error).__name__} in {place}\n{str(error)[:300]}"
    return None


class HangError(BaseException):
    """A reader took too long."""


@contextmanager
def no_longer_than(seconds: float | None) -> Iterator[None]:
    """Raise `HangError` in what takes longer, in the main thread of a process.

    The time is that of the processor, so that a busy computer makes no difference; what waits is
    stopped after `PATIENCE` times as long.
    """
    if seconds is None:
        yield
        return

    def stop(_: int, __: FrameType | None) -> None:
        raise HangError(f"longer than {seconds:g} s")

    timers = (
        (signal.ITIMER_PROF, signal.SIGPROF, 1.0),
        (signal.ITIMER_REAL, signal.SIGALRM, PATIENCE),
    )
    before = [signal.signal(number, stop) for _, number, _ in timers]
    for timer, _, factor in timers:
        signal.setitimer(timer, factor * seconds)
    try:
        yield
    finally:
        for (timer, number, _), handler in zip(timers, before, strict=True):
            signal.setitimer(timer, 0.0)
            signal.signal(number, handler)


_CORPORA: dict[str, tuple[bytes, ...]] = {}
Surroundings = tuple[Reader, Sequence[bytes]]


def _span(content: bytes, chance: random.Random) -> tuple[int, int]:
    """A part of a file: short ones are as frequent as long ones."""
    first = chance.randrange(len(content) + 1)
    length = int(2.0 ** chance.uniform(0.0, 10.0))
    return first, min(first + length, len(content))


def _changed_number(content: bytes, chance: random.Random, _: Surroundings) -> bytes:
    found = list(_NUMBER.finditer(content[:20_000]))
    if not found:
        return content
    place = chance.choice(found)
    return content[: place.start()] + chance.choice(NUMBERS) + content[place.end() :]


def _added_word(content: bytes, chance: random.Random, around: Surroundings) -> bytes:
    at = chance.randrange(len(content) + 1)
    word = chance.choice((*TEXTS, *NUMBERS, *around[0].words))
    return content[:at] + word + content[at + chance.choice((0, 0, len(word))) :]


def _repeated_part(content: bytes, chance: random.Random, _: Surroundings) -> bytes:
    first, last = _span(content, chance)
    part = content[first:last] or b" "
    times = int(2.0 ** chance.uniform(1.0, 4.0))
    if chance.random() < 0.005:  # long lines and long files: rarely, they take most of the time
        times = LARGEST // (2 * len(part)) + 1
    return content[:last] + part * times + content[last:]


def _lost_part(content: bytes, chance: random.Random, _: Surroundings) -> bytes:
    first, last = _span(content, chance)
    return content[:first] + content[last:]


def _cut_off(content: bytes, chance: random.Random, _: Surroundings) -> bytes:
    return content[: chance.randrange(len(content) + 1)]


def _changed_lines(content: bytes, chance: random.Random, _: Surroundings) -> bytes:
    lines = content.split(b"\n")
    one, other = chance.randrange(len(lines)), chance.randrange(len(lines))
    kind = chance.randrange(4)
    if kind == 0:
        lines[one], lines[other] = lines[other], lines[one]
    elif kind == 1:
        lines.insert(one, lines[other])
    elif kind == 2:
        del lines[one]
    else:
        lines[one] = lines[one] + lines[other]
    return b"\n".join(lines)


def _changed_cells(content: bytes, chance: random.Random, around: Surroundings) -> bytes:
    """A cell of a line, lost or replaced by another."""
    lines = content.split(b"\n")
    row = chance.randrange(len(lines))
    separator = chance.choice((b",", b";", b" ", b"=", b"\t"))
    cells = lines[row].split(separator)
    at = chance.randrange(len(cells))
    cells[at : at + 1] = chance.choice(
        ([], [cells[at]] * 2, [chance.choice((*NUMBERS, *TEXTS, *around[0].words))])
    )
    lines[row] = separator.join(cells)
    return b"\n".join(lines)


def _joined_with_another(content: bytes, chance: random.Random, around: Surroundings) -> bytes:
    other = chance.choice(around[1])
    return content[: chance.randrange(len(content) + 1)] + other[chance.randrange(len(other) + 1) :]


def _changed_byte(content: bytes, chance: random.Random, _: Surroundings) -> bytes:
    if not content:
        return bytes([chance.randrange(256)])
    at = chance.randrange(len(content))
    new = chance.choice((content[at] ^ (1 << chance.randrange(8)), chance.randrange(256), 0, 255))
    return content[:at] + bytes([new]) + content[at + 1 :]


def _changed_field(content: bytes, chance: random.Random, _: Surroundings) -> bytes:
    """Two to eight bytes, such as a length, an offset or a number."""
    size = chance.choice((2, 4, 8))
    if len(content) < size:
        return content
    at = chance.randrange(len(content) - size + 1)
    values = (
        0,
        1,
        255,
        2 ** (8 * size) - 1,
        2 ** (8 * size - 1),
        chance.randrange(2 ** (8 * size)),
    )
    new = chance.choice(values).to_bytes(size, chance.choice(("little", "big")))
    return content[:at] + new + content[at + size :]


def _another_encoding(content: bytes, chance: random.Random, _: Surroundings) -> bytes:
    text = content.decode("utf-8", "replace")
    return text.encode(chance.choice(("utf-16", "utf-16-le", "utf-16-be", "cp1252")), "replace")


def _other_line_ends(content: bytes, chance: random.Random, _: Surroundings) -> bytes:
    ends = (b"\r", b"\r\n", b"\n\n", b"\x0c", b"\x85", "\u2028".encode(), b" ")
    return content.replace(b"\n", chance.choice(ends))


Mutation = Callable[[bytes, random.Random, Surroundings], bytes]
_OF_TEXT: tuple[Mutation, ...] = (
    *(_changed_number,) * 3, *(_added_word,) * 3, *(_changed_cells,) * 2, _repeated_part,
    _lost_part, _cut_off, _changed_lines, _joined_with_another, _changed_byte, _changed_byte,
    _other_line_ends, _another_encoding,
)  # fmt: skip
_OF_BYTES: tuple[Mutation, ...] = (
    *(_changed_byte,) * 4, *(_changed_field,) * 3, _lost_part, _cut_off, _repeated_part,
    _joined_with_another, _added_word,
)  # fmt: skip
