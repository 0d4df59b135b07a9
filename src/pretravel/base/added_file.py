"""Files that grow: one process at a time adds to them, each addition whole or not at all."""

from __future__ import annotations

import os
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pretravel.base.errors import InputError

_PAUSE = 0.005
"""Between two trials to get the lock. [s]"""


@contextmanager
def locked_file(path: Path, seconds: float) -> Iterator[int]:
    """A file to which no other process adds, opened for reading and writing.

    It is made where it is missing, and removed again where nothing was added to it. The lock ends
    with the process in any case.

    Parameters
    ----------
    path : Path
    seconds : float
        How long to wait for another process.

    Yields
    ------
    int
        Its descriptor.

    Raises
    ------
    BlockingIOError
        Another process keeps the file.
    InputError
        It is not a file, or cannot be opened or made.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "journal"
    >>> with locked_file(path, 1.0) as descriptor:
    ...     add(descriptor, b"first")
    >>> path.read_bytes()
    b'first'
    """
    end = time.monotonic() + seconds
    while True:
        descriptor, made = _opened(path)
        try:
            if not _locked(descriptor):
                if time.monotonic() > end:
                    raise BlockingIOError(f"{path} is in use")
            elif _is_at(descriptor, path):  # else another process removed it before its lock ended
                try:
                    yield descriptor
                finally:
                    if made and _is_at(descriptor, path) and not os.fstat(descriptor).st_size:
                        path.unlink()
                return
        finally:
            os.close(descriptor)
        time.sleep(_PAUSE)


def add(descriptor: int, content: bytes) -> None:
    """Add to the end of a file; after an error, the file is as it was.

    Raises
    ------
    OSError
        The disk is full.
    """
    size = os.lseek(descriptor, 0, os.SEEK_END)
    left = memoryview(content)
    try:
        while left:
            left = left[os.write(descriptor, left) :]
        os.fsync(descriptor)
    except BaseException:
        os.ftruncate(descriptor, size)
        raise


def _opened(path: Path) -> tuple[int, bool]:
    """A descriptor, and whether the file is new."""
    flags = os.O_RDWR | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        try:
            descriptor, made = os.open(path, flags), False
        except FileNotFoundError:
            # No file is made where a link without a target points to.
            descriptor, made = os.open(path, flags | os.O_CREAT | os.O_EXCL, 0o666), True
    except OSError as error:
        raise InputError(f"cannot be opened or made: {error.strerror}", path=path) from None
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise InputError("this is a device or a pipe, not a file", path=path)
    return descriptor, made


def _is_at(descriptor: int, path: Path) -> bool:
    """Whether the open file is still that of the path."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _locked(descriptor: int) -> bool:
    """Lock a file unless another process has; True where there are no locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(descriptor, 2**31 - 2, os.SEEK_SET)  # beyond what is written
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:  # a file system without locks
        return True
    return True
