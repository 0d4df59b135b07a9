"""Files written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pretravel.errors import PretravelError


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """A temporary path beside `path` that takes its place once all went well.

    A killed run or a full disk leaves the old file, or none.

    Parameters
    ----------
    path : str or Path

    Yields
    ------
    Path
        To write to, with the same ending.

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


def _usual_permissions() -> int:
    """What open() would have given: mkstemp keeps its files private."""
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
