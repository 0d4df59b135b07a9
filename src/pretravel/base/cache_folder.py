"""The folder in which pretravel keeps files for itself, private to the user."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

FOLDER_VARIABLE = "PRETRAVEL_CACHE"
"""Environment variable that names the folder."""


def cache_folder() -> Path:
    """The folder of the cache: $PRETRAVEL_CACHE, or the user's cache folder."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    if chosen:
        return Path(chosen)
    from platformdirs import user_cache_path

    return user_cache_path("pretravel")


def mistrust(path: Path) -> str:
    """Why a file or folder of the cache is not used; empty where only this user can write to it.

    Parameters
    ----------
    path : Path
        It exists.

    Returns
    -------
    str
        Empty too on Windows, where the folders of a user are not open to others.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> mistrust(folder)
    ''
    >>> folder.chmod(0o777)
    >>> mistrust(folder).endswith("can be written to by other users")
    True
    """
    if sys.platform == "win32":
        return ""
    mine = (os.geteuid(), 0)
    place = path.resolve()
    found = place.stat()
    if found.st_uid not in mine:
        return f"{place} belongs to another user"
    if found.st_mode & 0o022:
        return f"{place} can be written to by other users"
    for folder in place.parents:
        found = folder.stat()
        # In a folder with the sticky bit, such as /tmp, nobody replaces the files of others.
        open_to_all = found.st_mode & 0o002 and not found.st_mode & stat.S_ISVTX
        if found.st_uid not in mine or open_to_all:
            return f"{folder}, which contains {place}, can be written to by other users"
    return ""


def make_private(folder: Path) -> None:
    """Make the folder, private to the user; the default folder of earlier versions becomes so.

    Parameters
    ----------
    folder : Path

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp()) / "kept"
    >>> make_private(folder)
    >>> mistrust(folder)
    ''
    """
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    if not os.environ.get(FOLDER_VARIABLE) and sys.platform != "win32":
        found = folder.stat()
        if found.st_uid == os.geteuid() and found.st_mode & 0o022:
            folder.chmod(found.st_mode & 0o7755)
