"""Files that are written completely or not at all."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pretravel.errors import PretravelError


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """A temporary path beside `path` that replaces `path` at the end, when no error occurred.

    An interrupted run or a full disk leaves the old file, or no file.

    Parameters
    ----------
    path : str or Path

    Yields
    ------
    Path
        The temporary path, with the same ending.

    Raises
    ------
    PretravelError
        The folder does not exist, or cannot be written to.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> with whole_file(folder / "a.txt") as temporary:
    ...     _ = temporary.write_text("whole")
    >>> (folder / "a.txt").read_text()
    'whole'
    """
    target = Path(path)
    folder = target.parent
    if not folder.is_dir():
        raise PretravelError(f"cannot write {target}: the folder {folder} does not exist")
    if target.is_dir():
        raise PretravelError(f"cannot write {target}: it is a folder")
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=folder)
    except OSError as error:
        raise PretravelError(f"cannot write {target}: {error.strerror}") from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(_usual_permissions())
        temporary.replace(target)
    except OSError as error:
        raise PretravelError(f"cannot write {target}: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def one_process_at_a_time(path: str | Path) -> Iterator[bool]:
    """Let one process make a file, while others that want to make it wait.

    Parameters
    ----------
    path : str or Path
        Of the file; its folder need not exist. The file ``path.lock`` stays beside it.

    Yields
    ------
    bool
        Whether another process had to be waited for: it has probably made the file. False on
        Windows and where no file can be written: there nobody waits.

    >>> import tempfile
    >>> with one_process_at_a_time(Path(tempfile.mkdtemp()) / "model.npz") as waited:
    ...     waited
    False
    """
    waited = False
    if sys.platform == "win32":
        yield waited
        return
    import fcntl

    lock = None
    with suppress(OSError):  # a folder that cannot be written, a file system without locks
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        lock = Path(f"{path}.lock").open("w")  # noqa: SIM115
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            waited = True
            fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        yield waited
    finally:
        if lock is not None:
            lock.close()


def write_text(path: str | Path, text: str, encoding: str = "utf-8") -> None:
    """Write a text file completely or not at all.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "a.txt"
    >>> write_text(path, "whole")
    >>> path.read_text()
    'whole'
    """
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding=encoding)


def write_json(path: str | Path, values: object) -> None:
    """Write values as JSON, completely or not at all."""
    write_text(path, json.dumps(values, indent=1))


def _usual_permissions() -> int:
    """The permissions that open() gives a new file; those of mkstemp are private."""
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
