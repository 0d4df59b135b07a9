"""The projects that a server shows, each in its tabs, and their autosaved files.

Which one a tab shows stands in its address (``?project=``), so that two tabs, two browsers or two
people do two jobs, and a reload shows the same one. Tabs of one project share it.
"""

from __future__ import annotations

import asyncio
import gc
import hashlib
import sys
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

from pretravel.app.jobs import WORKS
from pretravel.app.project import Listener, Project
from pretravel.app.project_file import (
    PROJECT_ENDING,
    read_project,
    read_project_names,
    write_project,
)
from pretravel.app.project_lock import ProjectLock
from pretravel.app.uploads import UPLOADS
from pretravel.base import PretravelError, is_unfinished

_PAUSE = 0.5
"""Time from a change to its saving. [s]"""
_PAUSE_AFTER_FAULT = 5.0
"""Time to the next try, for example on a full disk. [s]"""
NO_PROJECT = (
    "There is no project at this address: its file was removed or is damaged, or it is open in "
    "another workbench. The list of projects is at /project"
)
_MOST_OPEN = 8
"""Projects; of more, those that no tab shows are closed, the oldest first."""


def projects_folder() -> Path:
    """Where projects are kept that were not given a place of their own; made at first."""
    from platformdirs import user_data_path

    folder = user_data_path("pretravel", appauthor=False) / "projects"
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    return folder


@dataclass(frozen=True)
class RecentProject:
    """A project in the folder of projects.

    Attributes
    ----------
    path : Path
    name : str
    used : float
        Time when it was last changed or opened, since 1970. [s]
    contents : tuple of str
        Names of its files.
    """

    path: Path
    name: str
    used: float
    contents: tuple[str, ...] = ()


def recent_projects(most: int = 30) -> list[RecentProject]:
    """The projects in the folder of projects, the newest first; what cannot be read is left out."""
    found = []
    for path in _newest_files()[:most]:
        with suppress(PretravelError):
            name, contents = read_project_names(path)
            found.append(RecentProject(path, name, _used(path), contents))
    return found


def _newest_files() -> list[Path]:
    found = projects_folder().glob(f"*{PROJECT_ENDING}")
    return sorted((p for p in found if not is_unfinished(p)), key=_used, reverse=True)


def _used(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


@dataclass(frozen=True)
class _OnDisk:
    """What is known of a file: as long as it is so, nobody else has changed it.

    A computer that shares the folder, or one with another cache, knows nothing of our lock.
    """

    time: int
    size: int
    digest: str

    @classmethod
    def of(cls, path: Path) -> _OnDisk | None:
        """Of a file as it is now; None where there is none."""
        try:
            found = path.stat()
            with path.open("rb") as content:
                digest = hashlib.file_digest(content, "blake2b").hexdigest()
        except OSError:
            return None
        return cls(found.st_mtime_ns, found.st_size, digest)

    @staticmethod
    def same(path: Path, known: _OnDisk | None) -> bool:
        """Whether a file is as it was, or gone."""
        try:
            found = path.stat()
        except OSError:
            return True
        if known is None:
            return False
        now = (found.st_mtime_ns, found.st_size)
        if now == (known.time, known.size):
            return True
        again = _OnDisk.of(path)  # copied back by a program that keeps folders alike
        return again is None or again.digest == known.digest


class _ChangedElsewhereError(Exception):
    """The file of a project is not as this workbench read or wrote it."""


class Session:
    """A project that is open, saved after each change.

    Parameters
    ----------
    project : Project
    path : Path
        Where it is saved.
    address : str
        Of this server, for others that want the same project.
    read : _OnDisk or None
        The file as it was when it was read; None where there was none.

    Attributes
    ----------
    problem : str
        Why it is not saved; empty when it is.
    notice : str
        What the user should know of where it is saved.
    unsaved : bool

    Raises
    ------
    PretravelError
        The project is open in another workbench.
    """

    def __init__(
        self, project: Project, path: Path, address: str = "", read: _OnDisk | None = None
    ) -> None:
        self._lock = ProjectLock(path, address)
        self._address = address
        self._known = read
        self._writing = threading.Lock()
        self._asked, self._written, self._ended = 0, 0, False
        self.project = project
        self.path = path
        self.problem = ""
        self.notice = ""
        self.unsaved = False
        self._listeners: list[Listener] = []
        self._saving: asyncio.Task[None] | None = None
        if path.exists() and path.parent == projects_folder():
            path.touch()  # the next start opens the one that was used last
        self._end = project.listen(self.changed)

    def close(self) -> None:
        """Save it, end its work, and let another workbench open it."""
        self.save_now()
        self._end()
        self._ended = True
        WORKS.forget(self.project.screens)
        UPLOADS.forget(self.project.identity)
        self._lock.release()

    def listen(self, listener: Listener) -> Listener:
        """Call a function when the project is saved or cannot be; the result ends it."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def changed(self) -> None:
        """Save the project soon."""
        self.unsaved = True
        if self._saving is None:
            self._saving = asyncio.get_running_loop().create_task(self._save_soon())
        self._tell()

    async def _save_soon(self) -> None:
        pause = _PAUSE
        while self.unsaved:
            await asyncio.sleep(pause)
            if self._ended:
                return
            snapshot, self.unsaved = self._snapshot(), False
            try:
                self.problem = await asyncio.to_thread(self._saved, *snapshot)
            except _ChangedElsewhereError:
                self._go_on_in_a_copy()
            if self.problem:  # a full disk may have room later
                self.unsaved, pause = True, _PAUSE_AFTER_FAULT
            self._tell()
        self._saving = None

    def save_now(self) -> None:
        """Save what is not saved; when it is closed, and at the end."""
        if self.unsaved or self._saving is not None:
            self.unsaved = False
            try:
                self.problem = self._saved(*self._snapshot())
            except _ChangedElsewhereError:
                self._go_on_in_a_copy()
                self.problem = self._saved(*self._snapshot())
            self.unsaved = bool(self.problem)

    def save_elsewhere(self) -> str:
        """Keep a project that cannot be saved in its place; what to say of it."""
        for folder in (projects_folder(), Path.home(), Path(tempfile.gettempdir())):
            path = folder / f"unsaved-{self.project.identity}{PROJECT_ENDING}"
            with suppress(PretravelError, OSError, MemoryError):
                write_project(path, self.project)
                return f"{self.problem}. The project '{self.project.name}' is kept in {path}"
        return f"{self.problem}. The project '{self.project.name}' is lost"

    def _snapshot(self) -> tuple[Project, int]:
        self._asked += 1
        return self.project.snapshot(), self._asked

    def _saved(self, project: Project, number: int) -> str:
        """Save a snapshot, unless a later one is saved; why it could not be, or nothing.

        Raises
        ------
        _ChangedElsewhereError
            Another workbench wrote the file; it stays as it is.
        """
        with self._writing:
            if number < self._written:
                return ""
            if not _OnDisk.same(self.path, self._known):
                raise _ChangedElsewhereError
            try:
                write_project(self.path, project)
            except (PretravelError, OSError, MemoryError) as error:
                return f"{error}"
            self._known, self._written = _OnDisk.of(self.path), number
        return ""

    def _go_on_in_a_copy(self) -> None:
        """Both are kept: what another computer wrote, and what is here."""
        changed, number = self.path, 2
        while self.path.exists():
            self.path = changed.with_name(f"{changed.stem}-{number}{changed.suffix}")
            number += 1
        self._lock.release()
        self._lock = ProjectLock(self.path, self._address)
        self._known = None
        self.notice = (
            f"{changed.name} was changed by another workbench, on this computer or another one. "
            f"It stays as it is; what you see here is saved in {self.path}"
        )
        self.unsaved = True
        self._tell()

    def _tell(self) -> None:
        for listener in tuple(self._listeners):
            listener()


class Sessions:
    """The projects that are open. Within a page, `current` is the one that the page shows."""

    def __init__(self) -> None:
        self._open: dict[str, Session] = {}  # the one that was opened last is last
        self._shown: WeakKeyDictionary[Any, Session] = WeakKeyDictionary()
        self._address = ""

    def start(
        self, path: Path | None, address: str, say: Callable[[str], None] = lambda _: None
    ) -> None:
        """Open a file, or the last project, or a new one.

        Parameters
        ----------
        path : Path or None
            A file that does not exist is made at the first change.
        address : str
            Of this server, for others that want the same project.
        say : callable
            Takes a warning: the last project cannot be read, and a new one is started.

        Raises
        ------
        PretravelError
            The file is no project, or open in another workbench.
        """
        self._address = address
        if path is not None:
            if path.exists():
                self._use(*_read(path))
            else:
                if not path.parent.is_dir():
                    raise PretravelError(f"{path}: the folder {path.parent} does not exist")
                self._use(Project(path.stem), path)
            return
        newest = _newest_files()[:1]
        try:
            last = [_read(file) for file in newest]
        except PretravelError as error:
            say(f"Warning: {error}. A new project is started; the file stays as it is")
            last = []
        if last:
            self._use(*last[0])
        else:
            self.new()

    @property
    def current(self) -> Session:
        """Of the page in whose context this is called; else the one that was opened last."""
        last = next(reversed(self._open.values()))
        client = _client_here()
        if client is None:
            return last
        if client not in self._shown:
            asked = client.request.query_params.get("project", "")
            found = self.of(asked) if asked else last
            if found is None:  # never another one than the one that was asked for
                raise PretravelError(NO_PROJECT)
            self._shown[client] = found
        return self._shown[client]

    @property
    def project(self) -> Project:
        """Of `current`."""
        return self.current.project

    def of(self, identity: str) -> Session | None:
        """The project of an identity, where it is open or lies in the folder of projects."""
        if identity in self._open:
            return self._open[identity]
        found = [path for path in _newest_files() if path.stem == identity]
        with suppress(PretravelError):
            return self.open(found[0]) if found else None
        return None

    def new(self) -> Session:
        """Begin an empty project."""
        project = Project()
        return self._use(project, projects_folder() / f"{project.identity}{PROJECT_ENDING}")

    def open(self, path: Path) -> Session:
        """Open a project of the folder of projects."""
        same = [one for one in self._open.values() if one.path == path]
        return same[0] if same else self._use(*_read(path))

    def take(self, project: Project) -> Session:
        """Open a project that was sent; it does not replace one of the folder."""
        folder = projects_folder()
        path = folder / f"{project.identity}{PROJECT_ENDING}"
        if path.exists() or project.identity in self._open:
            project.identity = Project().identity
            path = folder / f"{project.identity}{PROJECT_ENDING}"
        session = self._use(project, path)
        session.changed()
        return session

    def _use(self, project: Project, path: Path, read: _OnDisk | None = None) -> Session:
        if project.identity in self._open:  # a copy of an open one, at another place
            project.identity = Project().identity
        session = Session(project, path, self._address, read)
        self._open[project.identity] = session
        if len(self._open) > _MOST_OPEN:
            self._close_oldest()
            gc.collect()  # screens and projects refer to each other, with all their files
        return session

    def _close_oldest(self) -> None:
        shown = {id(one) for one in self._shown.values()}
        for identity, old in list(self._open.items())[:-1]:
            if len(self._open) > _MOST_OPEN and id(old) not in shown:
                old.save_now()
                if not old.problem:  # one that cannot be saved stays open
                    self._open.pop(identity).close()

    def save_now(self) -> None:
        """Save all that is not saved."""
        for session in self._open.values():
            session.save_now()

    def end(self) -> list[str]:
        """Save and close all; what to say of those that could not be saved in their place."""
        self.save_now()
        said = [one.save_elsewhere() for one in self._open.values() if one.problem]
        said += [one.notice for one in self._open.values() if one.notice]
        for session in self._open.values():
            session.close()
        self._open.clear()
        return said


def _read(path: Path) -> tuple[Project, Path, _OnDisk | None]:
    """A project with its file as it was before it was read."""
    known = _OnDisk.of(path)
    return read_project(path), path, known


def _client_here() -> Any:
    """The page in whose context this is called; None outside of any."""
    if "nicegui" not in sys.modules:  # nothing was served yet
        return None
    from nicegui import ui

    try:
        client = ui.context.client
        return client if client.request else None
    except RuntimeError:  # no page, or none that a browser asked for
        return None


SESSION = Sessions()
"""Of this server."""


def address_in(path: str, project: Project | None = None) -> str:
    """The address of a page of a project; that of the page in whose context this is called.

    >>> address_in("/part", Project("Probe 7", "0123456789abcdef"))
    '/part?project=0123456789abcdef'
    """
    return f"{path}?project={(project or SESSION.project).identity}"
