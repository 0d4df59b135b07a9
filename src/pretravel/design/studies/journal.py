"""The journal of a study: what is done stays done, however the study ends.

A file next to the output holds each design from the moment it is computed: a line with its number,
length and digest, and its content. What an interrupted run left incomplete at the end is cut off.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType

from pretravel.base import InputError, PretravelError, add, locked_file
from pretravel.design.studies.outputs import Outcome
from pretravel.design.studies.packed_outcome import unpacked

_NAME = b"pretravel study journal, version 1: "
_DESIGN = re.compile(rb"(\d{1,12}) (\d{1,12}) ([0-9a-f]{64})\n")
_LONGEST_LINE = 200
_SECONDS = 1.0
"""How long another process may keep the journal before this one is refused."""
_UNREADABLE = (ValueError, LookupError, TypeError, AttributeError, RecursionError)


def journal_path(output: Path) -> Path:
    """Where the journal of an output lies.

    >>> journal_path(Path("study.nc")).name
    'study.nc.journal'
    """
    return output.with_name(output.name + ".journal")


class Journal:
    """An open journal, which no other process can open.

    Parameters
    ----------
    path : Path
        Made where it does not exist.
    digest : str
        Of the study; see `pretravel.design.studies.run.digest_of`.
    anew : bool
        Whether its content is removed, also where it belongs to another study.

    Raises
    ------
    PretravelError
        Another process runs a study with this output; the journal belongs to another study, or
        is not a journal; the disk is full.
    """

    def __init__(self, path: Path, digest: str, *, anew: bool = False) -> None:
        self.path = path
        if anew and not _is_journal(path):
            path.unlink(missing_ok=True)
        with contextlib.ExitStack() as stack:
            try:
                self._descriptor = stack.enter_context(locked_file(path, _SECONDS))
            except BlockingIOError:
                raise PretravelError(
                    f"another process runs a study with this output ({path} is in use); wait for "
                    "its end, or write to another output"
                ) from None
            # The descriptor is closed with the lock; this one shares its position.
            self._file = stack.enter_context(os.fdopen(os.dup(self._descriptor), "rb"))
            if anew:
                os.ftruncate(self._descriptor, 0)
            self._places: dict[int, tuple[int, int]] = {}
            self._begin(_NAME + digest.encode() + b"\n")
            self._open = stack.pop_all()

    def _begin(self, header: bytes) -> None:
        """Write the header of a new journal, or find the designs of an old one."""
        self._file.seek(0)
        found = self._file.readline(_LONGEST_LINE)
        if found == header:
            end = self._find_designs(len(header))
            with self._faults():
                os.ftruncate(self._descriptor, end)
        elif header.startswith(found):  # empty, or interrupted at once
            os.ftruncate(self._descriptor, 0)
            with self._faults():
                add(self._descriptor, header)
        elif found.startswith(_NAME):
            raise PretravelError(
                f"{self.path} holds results of another study, or of another version of this one; "
                "write to another output, or start again",
                inputs=("restart",),
            )
        else:
            raise self._damaged()

    def _find_designs(self, end: int) -> int:
        """Where the designs are; returns the end of the last whole one."""
        size = os.fstat(self._descriptor).st_size
        while found := _DESIGN.fullmatch(self._file.readline(_LONGEST_LINE)):
            number, length, start = int(found[1]), int(found[2]), self._file.tell()
            if length > size or _line(number, self._file.read(length)) != found[0]:
                break
            self._places[number] = start, length
            end = start + length
        return end

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @contextlib.contextmanager
    def _faults(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise PretravelError(
                f"{self.path} cannot be written: {error.strerror}. What was computed before is "
                "kept; run the command again"
            ) from None

    def _damaged(self) -> InputError:
        return InputError(
            "this is not a journal of a study, or a damaged one; start again",
            path=self.path,
            inputs=("restart",),
        )

    def close(self) -> None:
        """Let another process open it."""
        self._open.close()

    def done(self) -> set[int]:
        """The numbers of the designs that are computed."""
        return set(self._places)

    def add(self, block: Sequence[tuple[int, bytes]]) -> None:
        """Keep a block of designs.

        Parameters
        ----------
        block : sequence of number and bytes
            See `packed`.

        Raises
        ------
        PretravelError
            It cannot be written; nothing of the block is kept then.
        """
        end = os.fstat(self._descriptor).st_size
        content, places = bytearray(), {}
        for number, design in block:
            content += _line(number, design)
            places[number] = end + len(content), len(design)
            content += design
        with self._faults():
            add(self._descriptor, bytes(content))
        self._places |= places

    def outcomes(self) -> Iterator[tuple[int, Outcome]]:
        """The computed designs by number, one after the other."""
        for number, (start, length) in sorted(self._places.items()):
            self._file.seek(start)
            try:
                yield number, unpacked(self._file.read(length))
            except _UNREADABLE:
                raise self._damaged() from None

    def remove(self) -> None:
        """Close and delete it."""
        self.path.unlink(missing_ok=True)
        self.close()


def _line(number: int, content: bytes) -> bytes:
    """What stands before a design."""
    digest = hashlib.sha256(b"%d " % number + content).hexdigest()
    return b"%d %d %s\n" % (number, len(content), digest.encode())


def _is_journal(path: Path) -> bool:
    """Whether a file begins as a journal does, as far as it goes; it may be in use."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        begin = file.read(len(_NAME))
    return _NAME.startswith(begin)
