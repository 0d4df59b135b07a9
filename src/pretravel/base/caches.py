"""The folder in which pretravel keeps files for itself, private to the user."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

FOLDER_VARIABLE = "PRETRAVEL_CACHE"
"""Environment variable that names the folder."""
_OF_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def cache_folder() -> Path:
    """The folder of the cache: $PRETRAVEL_CACHE, or the user's cache folder.

    Links on the way are followed once and for all: a link could be changed after the folder was
    looked at.
    """
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen:
        return Path(chosen).resolve()
    from platformdirs import user_cache_path

    return user_cache_path("pretravel").resolve()


def private(folder: Path) -> str:
    """Make a folder that only the user can change; why it is not used, or an empty text.

    Parameters
    ----------
    folder : Path
        Without links; see `cache_folder`. The missing folders above it are made private too.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp()).resolve() / "a" / "b"
    >>> private(folder), folder.is_dir()
    ('', True)
    """
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        for place in reversed(missing):
            place.mkdir(mode=0o700, exist_ok=True)
        if not folder.is_dir():
            return f"{folder} is not a folder"
    except OSError as error:
        return f"{folder} cannot be made: {error.strerror}"
    return mistrust(folder)


def mistrust(path: Path) -> str:
    """Why a file or folder of the cache is not used; empty where only this user can change it.

    Whoever can write to a folder on the way can put another one into its place.

    Parameters
    ----------
    path : Path
        It exists, and has no links on its way.

    Returns
    -------
    str
        Empty too on Windows, where the folders of a user are not open to others.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp()).resolve()
    >>> mistrust(folder)
    ''
    >>> folder.chmod(0o770)
    >>> mistrust(folder).endswith("can be written to by other users")
    True
    """
    if sys.platform == "win32":
        return ""
    for place in (path, *path.parents):
        found = place.lstat()
        which = f"{place}" if place == path else f"{place}, which contains {path},"
        if stat.S_ISLNK(found.st_mode):
            return f"{which} is a link"
        if found.st_uid not in (os.geteuid(), 0):
            return f"{which} belongs to another user"
        # In a folder of root with the sticky bit, such as /tmp, nobody replaces files of others.
        kept = place != path and found.st_uid == 0 and found.st_mode & stat.S_ISVTX
        if found.st_mode & _OF_OTHERS and not kept:
            return f"{which} can be written to by other users"
    return ""
