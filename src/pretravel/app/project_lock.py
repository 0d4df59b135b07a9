"""A project is open in one workbench at a time: two would replace each other's changes."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from pathlib import Path

from pretravel.base.errors import PretravelError

if sys.platform != "win32":
    import fcntl


class ProjectLock:
    """Held from its making until `release`, or until this process ends.

    Parameters
    ----------
    path : Path
        Of the project.
    address : str
        Of this workbench, for the message of another one.

    Raises
    ------
    PretravelError
        Another workbench has opened the project; the text has its address.
    """

    def __init__(self, path: Path, address: str) -> None:
        self._descriptor: int | None = None
        if sys.platform == "win32":
            return  # no such lock: the last change wins
        name = hashlib.sha256(os.fsencode(path.resolve())).hexdigest()[:24]
        owner = getattr(os, "getuid", lambda: 0)()
        place = Path(tempfile.gettempdir()) / f"pretravel-project-{owner}-{name}.lock"
        descriptor = os.open(place, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            other = os.read(descriptor, 200).decode(errors="replace")
            os.close(descriptor)
            raise PretravelError(
                f"the project {path} is open in another workbench{f', at {other}' if other else ''}"
                ": use that one, or end it first"
            ) from None
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, address.encode(), 0)
        self._descriptor = descriptor

    def release(self) -> None:
        """Let another workbench open it."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
