"""Files that are written completely or not at all."""

from __future__ import annotations

import json
import os
import re
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from pretravel.base.caches import mistrust
from pretravel.base.errors import PretravelError

_MARK = ".pretravel-unfinished-"
"""Begin of the names of temporary files and folders."""


def is_unfinished(path: Path) -> bool:
    """Whether a file or folder is a temporary one, which is being written or was left.

    >>> is_unfinished(Path(".pretravel-unfinished-x1.csv")), is_unfinished(Path("map.csv"))
    (True, False)
    """
    return path.name.startswith(_MARK)


_BINARY = getattr(os, "O_BINARY", 0)
"""On Windows."""
_being_written: set[Path] = set()
"""Temporary files of this process."""


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """A temporary path next to `path` that replaces `path` at the end, when no error occurred.

    An interrupted run or a full disk leaves the old file, or no file. Of a link, the file that it
    points to is replaced. A device or a pipe is never replaced: the content is written to it at
    the end. Temporary files of runs that were killed are removed from the folder.

    Parameters
    ----------
    path : str or Path
        ``/dev/stdout``, ``/dev/stderr`` and ``/dev/fd/3`` mean the open files of this process.

    Yields
    ------
    Path
        The temporary path, with the same ending.

    Raises
    ------
    PretravelError
        The folder does not exist, or cannot be written to.
    BrokenPipeError
        The reader of the standard output has closed it.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> with whole_file(folder / "a.txt") as temporary:
    ...     _ = temporary.write_text("whole")
    >>> (folder / "a.txt").read_text()
    'whole'
    """
    target = Path(path)
    if target in _being_written:  # a file of ours within a file of ours
        yield target
        return
    try:
        if is_stream(target):
            with temporary_folder() as folder:
                temporary = folder / f"content{target.suffix}"
                yield temporary
                _write_through(temporary, target)
            return
        target = Path(os.path.realpath(target))
        if not target.parent.is_dir():
            raise PretravelError(f"cannot write {path}: the folder {target.parent} does not exist")
        if target.is_dir():
            raise PretravelError(f"cannot write {path}: it is a folder")
        if target.exists() and not os.access(target, os.W_OK):
            raise PretravelError(f"cannot write {path}: the file is write-protected")
        if mistrust(target.parent):
            # Others could put a link into the place of a file there while it is written by name.
            with temporary_folder() as folder:
                content = folder / f"content{target.suffix}"
                yield content
                with _locked_file(target.parent, target.suffix) as temporary:
                    _finish(temporary, target, content)
            return
        with _locked_file(target.parent, target.suffix) as temporary:
            yield temporary
            _finish(temporary, target)
    except OSError as error:
        if isinstance(error, BrokenPipeError) and _descriptor(target) == 1:
            raise  # as print does: the reader of the standard output has enough
        raise PretravelError(f"cannot write {path}: {error.strerror or error}") from error


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder of temporary files; those of runs that were killed are removed.

    >>> with temporary_folder() as folder:
    ...     folder.is_dir()
    True
    >>> folder.exists()
    False
    """
    parent = Path(tempfile.gettempdir())
    _remove_left(parent)
    folder, lock = _locked(lambda: tempfile.mkdtemp(prefix=_MARK, dir=parent))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def is_stream(path: str | Path) -> bool:
    """Whether a path is a device, a pipe or an open file of this process, not a file to replace.

    >>> is_stream("/dev/null"), is_stream("map.json")
    (True, False)
    """
    path = Path(path)
    return _descriptor(path) is not None or (
        path.exists() and not path.is_file() and not path.is_dir()
    )


def _descriptor(path: Path) -> int | None:
    """The number of an open file that a path means."""
    found = re.fullmatch(r"/dev/(?:(stdin)|(stdout)|(stderr)|fd/(\d{1,4}))", path.as_posix())
    found = found or re.fullmatch(r"()()()/proc/self/fd/(\d{1,4})", path.as_posix())
    if found is None:
        return None
    number = found.group(4)
    return int(number) if number else [bool(found.group(i)) for i in (1, 2, 3)].index(True)


def _write_through(temporary: Path, target: Path) -> None:
    """Write the content of a file to a device, a pipe or an open file."""
    descriptor = _descriptor(target)
    sys.stdout.flush()
    with (
        temporary.open("rb") as content,
        target.open("wb") if descriptor is None else os.fdopen(os.dup(descriptor), "wb") as stream,
    ):
        shutil.copyfileobj(content, stream)


@contextmanager
def _locked_file(folder: Path, suffix: str) -> Iterator[Path]:
    """A new file, locked while it is written: one without a lock is of a run that was killed."""
    _remove_left(folder)

    def made() -> str:
        handle, name = tempfile.mkstemp(prefix=_MARK, suffix=suffix, dir=folder)
        os.close(handle)
        return name

    temporary, lock = _locked(made)
    _being_written.add(temporary)
    try:
        yield temporary
    finally:
        _being_written.discard(temporary)
        temporary.unlink(missing_ok=True)
        if lock is not None:
            os.close(lock)


def _finish(temporary: Path, target: Path, content: Path | None = None) -> None:
    """Let a complete temporary file replace the target, with its owner and permissions.

    All is done to the file that is opened here, and that is ours: where others can write to the
    folder, its name could be a link to a file elsewhere by now.
    """
    former = target.stat() if target.exists() else None
    handle = os.open(temporary, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | _BINARY)
    with os.fdopen(handle, "rb+") as file:
        _refuse_changed(os.fstat(handle), temporary)
        if content is not None:
            with content.open("rb") as source:
                shutil.copyfileobj(source, file)
            file.flush()
        if former is not None:
            _give_to_owner(handle, former)
        mode = _usual_permissions() if former is None else stat.S_IMODE(former.st_mode)
        if sys.platform == "win32":
            temporary.chmod(mode)
        else:
            os.fchmod(handle, mode)
        os.fsync(handle)  # a full disk of another computer is noticed here
    temporary.replace(target)


def _refuse_changed(found: os.stat_result, path: Path) -> None:
    """Refuse a file that is not the one that was made: another user put it there."""
    if sys.platform == "win32":
        return
    if not stat.S_ISREG(found.st_mode) or found.st_nlink != 1 or found.st_uid != os.geteuid():
        raise PretravelError(f"cannot write {path}: another user changed the file meanwhile")


def _give_to_owner(handle: int, former: os.stat_result) -> None:
    """Give a new file the group of the former one, and as administrator its owner."""
    if sys.platform == "win32":
        return
    found = os.fstat(handle)
    if found.st_gid != former.st_gid:
        with suppress(OSError):  # a group of others
            os.fchown(handle, -1, former.st_gid)
    if found.st_uid != former.st_uid:
        with suppress(OSError):  # not the administrator
            os.fchown(handle, former.st_uid, -1)


def _locked(make: Callable[[], str]) -> tuple[Path, int | None]:
    """A new file or folder with its lock; again when another run took it for a left one."""
    while True:
        path = Path(make())
        lock = _lock(path)
        if path.exists():
            return path, lock
        if lock is not None:
            os.close(lock)


def _lock(path: Path) -> int | None:
    """Lock a file or folder; the lock ends with this process. None where there are no locks.

    It is opened for reading only: in folders of other computers (NFS) this gives no lock, and a
    lock there would end too early, when the content is closed.
    """
    if sys.platform == "win32":
        return None
    import fcntl

    with suppress(OSError):
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
        except OSError:
            os.close(handle)
            raise
        return handle
    return None


def _remove_left(folder: Path) -> None:
    """Remove the temporary files and folders of killed runs: no process locks them."""
    if sys.platform == "win32":
        return
    import fcntl

    with suppress(OSError), os.scandir(folder) as entries:
        left = [Path(entry.path) for entry in entries if entry.name.startswith(_MARK)]
        for path in left:
            with suppress(OSError):
                if path.lstat().st_uid != os.geteuid():
                    continue
                handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
                try:
                    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    if path.is_dir():
                        shutil.rmtree(path, ignore_errors=True)
                    else:
                        path.unlink()
                finally:
                    os.close(handle)


@contextmanager
def one_process_at_a_time(path: str | Path) -> Iterator[bool]:
    """Let one process make a file, while others that want to make it wait.

    Parameters
    ----------
    path : str or Path
        Of the file; its folder need not exist. The file ``path.lock`` stays next to it.

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
        # Nothing is written to it, and no link of others is followed.
        lock = os.open(f"{path}.lock", os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            waited = True
            fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        yield waited
    finally:
        if lock is not None:
            os.close(lock)


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


def write_texts(folder: str | Path, texts: Mapping[str, str], encoding: str = "utf-8") -> None:
    """Write text files into a folder, all of them or none; the folder is made where it is missing.

    Parameters
    ----------
    folder : str or Path
        The folder above it exists.
    texts : mapping of str to str
        By the names of the files.
    encoding : str

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp()) / "programs"
    >>> write_texts(folder, {"a.txt": "first", "b.txt": "second"})
    >>> sorted(file.name for file in folder.iterdir())
    ['a.txt', 'b.txt']
    """
    folder = Path(folder)
    new = not folder.exists()
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise PretravelError(f"cannot make {folder}: {error.strerror}") from error
    try:
        with ExitStack() as stack:
            for name, text in texts.items():
                temporary = stack.enter_context(whole_file(folder / name))
                temporary.write_text(text, encoding=encoding)
    except BaseException:
        if new:
            with suppress(OSError):
                folder.rmdir()
        raise


def write_json(path: str | Path, values: object) -> None:
    """Write values as JSON, completely or not at all."""
    write_text(path, json.dumps(values, indent=1))


def _usual_permissions() -> int:
    """The permissions that open() gives a new file; those of mkstemp are private."""
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
