"""The one project that a server shows, shared by all tabs, and its autosaved file."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pretravel.app.project import Listener, Project
from pretravel.app.project_file import PROJECT_ENDING, read_project, write_project
from pretravel.app.project_lock import ProjectLock
from pretravel.base.errors import PretravelError
from pretravel.base.whole_file import is_unfinished

_PAUSE = 0.5
"""Time from a change to its saving. [s]"""
_PAUSE_AFTER_FAULT = 5.0
"""Time to the next try, for example on a full disk. [s]"""


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
    """

    path: Path
    name: str
    used: float


def recent_projects(most: int = 30) -> list[RecentProject]:
    """The projects in the folder of projects, the newest first; what cannot be read is left out."""
    found = []
    for path in _newest_files()[:most]:
        with suppress(PretravelError):
            found.append(RecentProject(path, read_project(path).name, _used(path)))
    return found


def _newest_files() -> list[Path]:
    found = projects_folder().glob(f"*{PROJECT_ENDING}")
    return sorted((p for p in found if not is_unfinished(p)), key=_used, reverse=True)


def _used(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


class Session:
    """The project that is open, saved after each change.

    Attributes
    ----------
    project : Project
    path : Path or None
        Where it is saved; None before `open`.
    problem : str
        Why it is not saved; empty when it is.
    """

    def __init__(self) -> None:
        self.project = Project()
        self.path: Path | None = None
        self.problem = ""
        self.unsaved = False
        self._address = ""
        self._lock: ProjectLock | None = None
        self._listeners: list[Listener] = []
        self._saving: asyncio.Task[None] | None = None
        self._end: Callable[[], None] = lambda: None

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
            Takes a warning: the last project cannot be read, and a new one is begun.

        Raises
        ------
        PretravelError
            The file is no project, or open in another workbench.
        """
        self._address = address
        if path is not None:
            if path.exists():
                self._use(read_project(path), path)
            else:
                if not path.parent.is_dir():
                    raise PretravelError(f"{path}: the folder {path.parent} does not exist")
                self._use(Project(path.stem), path)
            return
        newest = _newest_files()[:1]
        try:
            last = [(read_project(file), file) for file in newest]
        except PretravelError as error:
            say(f"Warning: {error}. A new project is begun; the file stays as it is")
            last = []
        if last:
            self._use(*last[0])
        else:
            self.new()

    def new(self) -> None:
        """Begin an empty project."""
        project = Project()
        self._use(project, projects_folder() / f"{project.identity}{PROJECT_ENDING}")

    def open(self, path: Path) -> None:
        """Open a project of the folder of projects."""
        if path != self.path:
            self._use(read_project(path), path)

    def take(self, project: Project) -> None:
        """Open a project that was sent; it does not replace one of the folder."""
        folder = projects_folder()
        path = folder / f"{project.identity}{PROJECT_ENDING}"
        if path.exists():
            fresh = Project()
            project.identity = fresh.identity
            path = folder / f"{project.identity}{PROJECT_ENDING}"
        self._use(project, path)
        self._changed()

    def _use(self, project: Project, path: Path) -> None:
        lock = ProjectLock(path, self._address)
        self.save_now()
        self._end()
        if self._lock is not None:
            self._lock.release()
        self._lock = lock
        if path.exists() and path.parent == projects_folder():
            path.touch()  # the next start opens the one that was used last
        self.project, self.path, self.problem, self.unsaved = project, path, "", False
        self._end = project.listen(self._changed)

    def listen(self, listener: Listener) -> Listener:
        """Call a function when the project is saved or cannot be; the result ends it."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def _changed(self) -> None:
        self.unsaved = True
        if self._saving is None:
            self._saving = asyncio.get_running_loop().create_task(self._save_soon())
        self._tell()

    async def _save_soon(self) -> None:
        pause = _PAUSE
        while self.unsaved:
            await asyncio.sleep(pause)
            snapshot, path, self.unsaved = self.project.snapshot(), self.path, False
            self.problem = await asyncio.to_thread(_saved, snapshot, path)
            if self.problem:  # a full disk may have room later
                self.unsaved, pause = True, _PAUSE_AFTER_FAULT
            self._tell()
        self._saving = None

    def save_now(self) -> None:
        """Save what is not saved; before another project, and at the end."""
        if self.unsaved or self._saving is not None:
            self.unsaved = False
            self.problem = _saved(self.project, self.path)

    def _tell(self) -> None:
        for listener in tuple(self._listeners):
            listener()


def _saved(project: Project, path: Path | None) -> str:
    """Save a project; why it could not be saved, or nothing."""
    try:
        if path is not None:
            write_project(path, project)
    except (PretravelError, OSError, MemoryError) as error:
        return f"{error}"
    return ""


SESSION = Session()
"""Of this server."""
