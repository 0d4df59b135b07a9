"""A project is open in one workbench at a time: two would replace each other's changes."""

from __future__ import annotations

import hashlib
import os
import warnings
from contextlib import ExitStack
from pathlib import Path

from pretravel.base import PretravelError, add, cache_folder, locked_file, private


class ProjectLock:
    """Held from its making until `release`, or until this process ends.

    The lock is a file in the user's cache: in a folder that is shared, another user could make it
    before, and choose the address that is shown.

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

    Warns
    -----
    UserWarning
        There is no private folder for locks: two workbenches can open the project.
    """

    def __init__(self, path: Path, address: str) -> None:
        self._held = ExitStack()
        folder = cache_folder()
        if doubt := private(folder):
            warnings.warn(
                f"another workbench that opens {path.name} is not noticed ({doubt})", stacklevel=2
            )
            return
        name = hashlib.sha256(os.fsencode(path.resolve())).hexdigest()[:24]
        place = folder / f"project-{name}.lock"
        try:
            descriptor = self._held.enter_context(locked_file(place, 0.0))
        except BlockingIOError:
            other = place.read_text("utf-8", "replace")[:200]
            raise PretravelError(
                f"the project {path} is open in another workbench{f', at {other}' if other else ''}"
                ": use that one, or end it first"
            ) from None
        self._held.callback(place.unlink, missing_ok=True)
        os.ftruncate(descriptor, 0)
        add(descriptor, address.encode())

    def release(self) -> None:
        """Let another workbench open it."""
        self._held.close()
