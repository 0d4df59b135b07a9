"""Files that the browser sends: each goes to a slot that a screen has opened."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass

from pretravel.app.project import LARGEST_PROJECT, ScreenState, StoredFile, check_file_name
from pretravel.base import PretravelError

_MOST_FILES = 200
"""Of one purpose."""


@dataclass(frozen=True)
class Slot:
    """Where files of a purpose may come to.

    Attributes
    ----------
    state : ScreenState
    purpose : str
    endings : tuple of str
        Empty: any.
    several : bool
        Whether more files are added; else a new one replaces the old one.
    limit : int
        Most bytes of a file.
    """

    state: ScreenState
    purpose: str
    endings: tuple[str, ...]
    several: bool
    limit: int

    def check_name(self, name: str) -> None:
        """Refuse a name that cannot be stored or has another ending."""
        check_file_name(name)
        if self.endings and not name.lower().endswith(tuple(e.lower() for e in self.endings)):
            raise PretravelError(f"{name}: the ending must be {', '.join(self.endings)}")

    def store(self, name: str, content: bytes, project_size: int = 0) -> None:
        """Keep a file; one of the same name is replaced.

        Raises
        ------
        PretravelError
            It is empty, or the project would have too many files or too many bytes.
        """
        if not content:
            raise PretravelError(f"{name} is empty")
        new = StoredFile(name, content)
        others = tuple(f for f in self.state.files[self.purpose] if f.name != name)
        if self.several and len(others) >= _MOST_FILES:
            raise PretravelError(f"there are {len(others)} files already, and no more are taken")
        if project_size + len(content) > LARGEST_PROJECT:
            raise PretravelError(
                f"with {name} the files of the project have more than {LARGEST_PROJECT // 10**6} "
                "MB: remove some, or begin another project"
            )
        self.state.files[self.purpose] = (*others, new) if self.several else (new,)


class Uploads:
    """The slots that the screens have opened."""

    def __init__(self) -> None:
        self._slots: dict[tuple[str, str, str], Slot] = {}

    def add(self, project: str, slot: Slot) -> None:
        """Open a slot of a project, by its identity."""
        self._slots[project, slot.state.name, slot.purpose] = slot

    def slot(self, project: str, screen: str, purpose: str) -> Slot:
        """The slot of a purpose of a screen.

        Raises
        ------
        PretravelError
            No screen has opened it.
        """
        try:
            return self._slots[project, screen, purpose]
        except KeyError:
            raise PretravelError("load this page again: the workbench was started again") from None


UPLOADS = Uploads()
"""Of this server."""


async def limited_content(chunks: AsyncIterator[bytes], limit: int, name: str) -> bytes:
    """All chunks together.

    Raises
    ------
    PretravelError
        They are more than the limit; the rest is not read.
    """
    content = bytearray()
    async for chunk in chunks:
        content += chunk
        if len(content) > limit:
            raise PretravelError(
                f"{name} is larger than {limit / 1e6:g} MB, the most that is taken here"
            )
    return bytes(content)
