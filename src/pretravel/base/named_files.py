"""Whether what is read may name other files, and whether Python files may be executed.

A description can name the STEP file of its solids, a study its probe and its targets, and a
surface can be a Python file. Who runs a command chose these files. Who opens a project that
somebody sent did not: within `own_files_alone` each of them is refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from pretravel.base.errors import PretravelError

_alone: ContextVar[bool] = ContextVar("alone", default=False)


@contextmanager
def own_files_alone() -> Iterator[None]:
    """Within this, what is read names no other file, and no Python file is executed.

    >>> with own_files_alone():
    ...     refuse_named_file("the table [geometry]", "solids.step")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: the table [geometry] names the file solids.step; ...
    """
    before = _alone.set(True)
    try:
        yield
    finally:
        _alone.reset(before)


def refuse_named_file(what: str, name: object) -> None:
    """Refuse a file that another file or a text names, where none may be named.

    Parameters
    ----------
    what : str
        What names it.
    name : object
        The file.

    Raises
    ------
    PretravelError
        Within `own_files_alone`.
    """
    if _alone.get():
        raise PretravelError(
            f"{what} names the file {name}; a project contains its files and cannot use others of "
            "this computer: use the command line for this"
        )
