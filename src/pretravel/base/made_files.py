"""Which command made a file: a list of the digests of all files that commands wrote.

A table of touches does not state whether a machine or a command wrote it, and nobody should lose
the first by repeating the second. Each file that a command writes is therefore entered in a list,
before it is in its place: the digest of its content, and the command. A file that was changed
since has another digest, so that it counts as one that no command made.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from pretravel.base.cache_folder import cache_folder, make_private

_LIST = "made-files.txt"
_LARGEST = 2_000_000
"""Of the list; then the older half of it is forgotten, some 20,000 files. [bytes]"""
_command: ContextVar[str] = ContextVar("command", default="")


@contextmanager
def made_by(command: str) -> Iterator[None]:
    """Within it, all files that are written whole are entered as made by a command.

    Parameters
    ----------
    command : str
        As it is typed, such as ``program sphere``.
    """
    token = _command.set(command)
    try:
        yield
    finally:
        _command.reset(token)


def current_command() -> str:
    """The command that is at work; empty where the library is used without one."""
    return _command.get()


def enter_in_list(path: Path) -> None:
    """Enter a file in the list, as it is, where a command is at work.

    Nothing is entered where the list cannot be kept: then the next run asks before it replaces
    the file.

    Parameters
    ----------
    path : Path
        It exists.
    """
    command = current_command()
    if not command:
        return
    with suppress(OSError):
        folder = cache_folder()
        make_private(folder)
        entries = folder / _LIST
        if entries.exists() and not _is_private(entries):
            return
        _shorten(entries)
        handle = os.open(entries, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
        with os.fdopen(handle, "a", encoding="utf-8") as stream:
            # an entry that a killed run did not complete ends at the first line break
            stream.write(f"\n{_digest(path)} {command}\n")


def makers(path: Path) -> frozenset[str]:
    """The commands that wrote this content; empty where none is known.

    Parameters
    ----------
    path : Path
        A file that exists.

    Returns
    -------
    frozenset of str
    """
    entries = cache_folder() / _LIST
    try:
        if not entries.is_file() or not _is_private(entries):
            return frozenset()
        text = entries.read_text(encoding="utf-8", errors="replace")
        return frozenset(re.findall(rf"^{_digest(path)} (.+)$", text, re.MULTILINE))
    except OSError:
        return frozenset()


def _is_private(entries: Path) -> bool:
    """Whether the list is of this user, and no other can write to it.

    Folders above it may be open to a group, as they often are; the list alone decides.
    """
    if sys.platform == "win32":
        return True
    found = entries.lstat()
    return found.st_uid == os.geteuid() and not found.st_mode & 0o022


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _shorten(entries: Path) -> None:
    """Forget the older half of a list that is too large."""
    if entries.exists() and entries.stat().st_size > _LARGEST:
        content = entries.read_bytes()
        entries.write_bytes(content[len(content) // 2 :])
