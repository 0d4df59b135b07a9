"""Files that the browser sends: each goes to a slot that a screen has opened."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass, field

from pretravel.app.project import (
    LARGEST_PROJECT,
    ScreenState,
    SettingValue,
    StoredFile,
    check_file_name,
)
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
        Whether several files may come together.
    limit : int
        Most bytes of a file.
    adds : bool
        Whether files of later are added to those of before; else they replace them.
    settings : mapping of str to value
        Of the screen, set with the files.
    """

    state: ScreenState
    purpose: str
    endings: tuple[str, ...]
    several: bool
    limit: int
    adds: bool = True
    settings: Mapping[str, SettingValue] = field(default_factory=dict)

    def check_name(self, name: str) -> None:
        """Refuse a name that cannot be stored or has another ending."""
        check_file_name(name)
        if self.endings and not name.lower().endswith(tuple(e.lower() for e in self.endings)):
            raise PretravelError(f"{name}: the ending must be {', '.join(self.endings)}")

    def store(self, files: Sequence[StoredFile], project_size: int = 0) -> None:
        """Keep files that came together; one of the same name is replaced.

        Raises
        ------
        PretravelError
            One is empty, or the project would have too many files or too many bytes.
        """
        new = tuple({file.name: file for file in files}.values())[: None if self.several else 1]
        for file in new:
            if not file.content:
                raise PretravelError(f"{file.name} is empty")
        names = {file.name for file in new}
        adds = self.several and self.adds
        others = tuple(f for f in self.state.files[self.purpose] if adds and f.name not in names)
        if len(others) + len(new) > _MOST_FILES:
            raise PretravelError(
                f"with {new[-1].name} there are {len(others) + len(new)} files, more than "
                f"{_MOST_FILES}"
            )
        if project_size + sum(len(file.content) for file in new) > LARGEST_PROJECT:
            raise PretravelError(
                f"with {new[-1].name} the files of the project have more than "
                f"{LARGEST_PROJECT // 10**6} MB: remove some, or begin another project"
            )
        self.state.settings.update(self.settings)
        self.state.files[self.purpose] = (*others, *new)


class Uploads:
    """The slots that the screens have opened."""

    def __init__(self) -> None:
        self._slots: dict[tuple[str, str, str], Slot] = {}

    def add(self, project: str, slot: Slot) -> None:
        """Open a slot of a project, by its identity."""
        self._slots[project, slot.state.name, slot.purpose] = slot

    def open(self, project: str, slot: Slot) -> None:
        """As `add`, where the screen has not opened it itself."""
        self._slots.setdefault((project, slot.state.name, slot.purpose), slot)

    def forget(self, project: str) -> None:
        """Close the slots of a project, which would keep its files in memory."""
        self._slots = {key: slot for key, slot in self._slots.items() if key[0] != project}

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
                f"{name} is larger than {limit / 1e6:g} MB, the largest size that is accepted here"
            )
    return bytes(content)


def parted(content: bytes, head: int) -> tuple[StoredFile, ...]:
    """The files of a request that has several.

    Parameters
    ----------
    content : bytes
        A list of names and sizes (JSON), and after it the contents.
    head : int
        Bytes of the list.

    Raises
    ------
    PretravelError
        The list is damaged.

    >>> [file.name for file in parted(b'[["a.csv", 2], ["b.csv", 1]]xyz', 28)]
    ['a.csv', 'b.csv']
    """
    try:
        listed = [(str(name), int(size)) for name, size in json.loads(content[:head])]
    except (ValueError, TypeError, RecursionError) as error:
        raise PretravelError("the list of the files is damaged: send them again") from error
    begin, found = head, []
    for name, size in listed:
        if size < 0 or begin + size > len(content):
            raise PretravelError("the files arrived incomplete: send them again")
        found.append(StoredFile(name, content[begin : begin + size]))
        begin += size
    return tuple(found)
