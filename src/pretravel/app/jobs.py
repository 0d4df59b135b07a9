"""Work of a screen: computed once for all tabs, off the event loop, with progress and cancel."""

from __future__ import annotations

import asyncio
import contextvars
import logging
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pretravel.app.links import OF_REFERENCE, REFERENCE, newer_inputs
from pretravel.app.project import Inputs, Link, Listener, ScreenState, SettingValue, StoredFile
from pretravel.app.task_process import NO_MEMORY, FlawError, TaskProcess
from pretravel.app.terminal_text import flaw_message
from pretravel.base import PretravelError, own_files_alone, temporary_folder

if TYPE_CHECKING:
    from pretravel.show import Document
    from pretravel.task import Task

LARGE = 2_000_000
"""Bytes of files above which work is done in a process of its own: it can be ended, and its memory
is free again."""
_PAUSE = 0.15
"""Time from the last change of a setting, which may go on, to the start of automatic work. [s]"""
_UNTIL_AHEAD = 0.3
"""Time from the request of a page, which is built first, to the start of `do_ahead`. [s]"""


Made = TypeVar("Made")


@dataclass(frozen=True, eq=False)
class ShownResult(Generic[Made]):
    """The result of a task with its report: a job makes both, for a page must not wait.

    Attributes
    ----------
    made : object
    document : Document
    same : Task or None
        As the user can do it; None where no task does it.
    """

    made: Made
    document: Document
    same: Task | None = None

    @property
    def command(self) -> str:
        """The command that does the same; empty where no task does it."""
        return "" if self.same is None else self.same.command_line()


def report_of(result: Any) -> Document | None:
    """The report of a result that has it, or makes it, as its `document`; None of another one."""
    found = getattr(result, "document", None)
    return found() if callable(found) else found


@dataclass(frozen=True)
class Job(Generic[Made]):
    """Work that a screen does with its settings and files; the type of its result.

    Attributes
    ----------
    name : str
        Unique within the screen.
    compute : callable
        Takes `Inputs` and returns any value; None is no result. It touches no page. With
        `own_process` it is a function of a module, and its result can be pickled.
    title : str
        What is shown while it runs.
    settings, files : tuple of str
        Names of settings, and purposes of files, that it uses: it is stale when one changes.
    needs : tuple of str
        Purposes of files without which it does not start.
    lacks : callable
        Takes the state of the screen and says what else it needs first; empty: nothing.
    after : tuple of Job
        Jobs of the screen whose results it uses: it waits for them, and is stale with them.
    automatic : bool
        Whether it starts automatically when its inputs change; else with a button.
    own_process : bool
        Whether it runs in a process that Cancel kills: for work above a second. With files above
        `LARGE` every job does.
    live : bool
        Whether it follows a slider: it starts without a pause, and changes while it runs are
        taken together after it. For work below 0.1 s.
    report : callable
        Takes a result and returns its `Document`, or None: its verdict stands on the start page.
    keeps : callable
        Takes a result and returns the files, by purpose, that the screen keeps of it, such as a
        history with today's line. They are inputs of the next run, and no change of this one.
    gives : callable
        Takes a result and returns files, by their names, that other screens can take: `links`.
    """

    name: str
    compute: Callable[[Inputs], Made | None]
    title: str = "Computing"
    settings: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    lacks: Callable[[ScreenState], str] = lambda _: ""
    after: tuple[Job[Any], ...] = ()
    automatic: bool = True
    own_process: bool = False
    live: bool = False
    report: Callable[[Made], Document | None] = report_of
    keeps: Callable[[Made], Mapping[str, tuple[StoredFile, ...]]] = lambda _: {}
    gives: Callable[[Made], Mapping[str, bytes]] = lambda _: {}


@dataclass(frozen=True)
class Finished(Generic[Made]):
    """A result with what it was computed from.

    Attributes
    ----------
    result : object
    settings : mapping of str to value
        Those that were set.
    files : mapping of str to tuple of StoredFile
        By purpose.
    """

    result: Made
    settings: Mapping[str, SettingValue]
    files: Mapping[str, tuple[StoredFile, ...]]


@dataclass
class Work(Generic[Made]):
    """The state of a job, shared by all tabs.

    Attributes
    ----------
    job : Job
    state : ScreenState
    running : bool
    result : object
        The newest one; None before the first.
    error : str
        Of the newest run; empty without one.
    error_inputs : tuple of str
        Names of the inputs that can correct the error; see `PretravelError`.
    stale : bool
        Whether the inputs have changed since the result.
    warnings : tuple of str
        What the library said while it computed the result.
    cancelled : str
        What to say after a cancelled run; empty without one.
    progress : str
        The stage of the run.
    """

    job: Job[Made]
    state: ScreenState
    running: bool = False
    result: Made | Any = None
    error: str = ""
    error_inputs: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    stale: bool = False
    progress: str = ""
    cancelled: str = ""
    started: float = 0.0
    _listeners: list[Listener] = field(default_factory=list)
    _done: Any = None
    _wanted: Any = None
    _seen: Any = None
    _good: Any = None
    _before: tuple[Work[Any], ...] = ()
    _version: int = 0
    _run: asyncio.Task[None] | None = None
    _timer: asyncio.TimerHandle | None = None
    _kill: Callable[[], None] | None = None
    _asked: bool = False

    def elapsed(self) -> float:
        """Time since the start of the run. [s]"""
        return time.monotonic() - self.started

    @property
    def held(self) -> tuple[str, ...]:
        """Labels of fields that hold nothing valid, on which the result depends."""
        unfinished = self.state.unfinished
        return tuple(unfinished[name] for name in self.job.settings if name in unfinished)

    @property
    def newer(self) -> dict[str, Link]:
        """Inputs that were taken from another screen, which has newer ones."""
        uses = {*self.job.files, *self.job.needs}
        if not uses.union(self.job.settings).isdisjoint(REFERENCE):
            uses.add(OF_REFERENCE)
        return {name: link for name, link in newer_inputs(self.state).items() if name in uses}

    @property
    def wrong(self) -> bool:
        """Whether no file of the result can be taken."""
        return bool(self.error or self.held or self.newer)

    @property
    def outdated(self) -> bool:
        """Whether the result is not that of the page as it is now: one rule for all places."""
        own = self.stale or self.running or self.wrong
        return own or any(work.outdated for work in self._before)

    def ready(self) -> bool:
        """Whether all files that it needs are there, and what comes before it can be had."""
        files = all(self.state.files[purpose] for purpose in self.job.needs)
        before = all(work.ready() and not work.error for work in self._before)
        return files and before and not self.job.lacks(self.state)

    @property
    def lacking(self) -> str:
        """What it needs in addition to its files, once these are there."""
        files = all(self.state.files[purpose] for purpose in self.job.needs)
        return self.job.lacks(self.state) if files else ""

    @property
    def _waits(self) -> bool:
        """Whether what comes before it is not there yet."""
        return any(work.outdated or work._done is None for work in self._before)

    async def finished(self) -> Finished[Made]:
        """The result of the inputs as they are now; waits for a run that was started or will be.

        Raises
        ------
        PretravelError
            The run failed or was cancelled, or there was none.
        """
        for work in self._before:
            with suppress(PretravelError):
                await work.finished()
        while self.running or self._timer is not None:
            changed = asyncio.Event()
            end = self.listen(changed.set)
            await changed.wait()
            end()
        if self.held:
            raise PretravelError(f"{self.held[0]} is not a valid value: correct it first")
        if self.newer:
            raise PretravelError(
                "The project has an input that is newer than this result: use this input first."
            )
        if self.error or self.result is None:
            raise PretravelError(
                self.error or self.cancelled or "There is no result yet: fill in what is missing."
            )
        if self.stale:
            raise PretravelError("The settings have changed since this result: compute it again.")
        settings, files, _ = self._done
        return Finished(self.result, settings, files)

    def listen(self, listener: Listener) -> Listener:
        """Call a function after each change of the work; the result ends it."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def inputs_changed(self) -> None:
        """Compare the inputs with those of the result; start automatic work."""
        wanted = self._snapshot()
        before = tuple((w.outdated, bool(w.error)) for w in self._before)
        seen = (self.held, tuple(self.newer), before)
        if (wanted, seen) == (self._wanted, self._seen):
            return
        begun = self.running or self._timer is not None or self._done is not None
        only_seen = wanted == self._wanted and begun
        typed = self._wanted is not None and wanted[0] != self._wanted[0]
        self._wanted, self._seen = wanted, seen
        self.stale = self._done is not None and wanted != self._done
        if not self.ready():
            self._stop()
            self.result, self.error, self.stale, self._done = None, "", False, None
            self.warnings, self._good, self._asked = (), None, False
        elif self._waits:
            self._stop()
            self.stale = self.result is not None
        elif self._asked:
            self.start()
            return
        elif wanted == self._done:
            self._stop()  # the inputs of the newest result are back
        elif only_seen:
            pass
        elif self.job.live:
            if self._run is None:
                self.start()
        elif self.job.automatic:
            if self._timer is not None:
                self._timer.cancel()
            pause = _PAUSE if typed else 0.0
            self._timer = asyncio.get_running_loop().call_later(pause, self.start)
        self._tell()

    def start(self) -> None:
        """Start, or start again with the inputs as they are now: after what comes before it."""
        self._asked = self.ready() and self._waits
        if self._asked or not self.ready():
            return
        self._stop()
        self._wanted = self._snapshot()
        self.running, self.progress, self.cancelled = True, "", ""
        if not self.job.live:  # the next result is there at once
            self.error = ""
        self.started = time.monotonic()
        self._run = asyncio.get_running_loop().create_task(self._compute(self._wanted))
        self._tell()

    def cancel(self) -> None:
        """End the run; of automatic work with a result, the files and settings of it are back."""
        if not self.running:
            return
        self._stop()
        self.cancelled = f"Cancelled after {self.elapsed():.0f} s. "
        if self.job.automatic and self._good is not None:
            self.cancelled += "Files and settings are as before."
            self._restore(*self._good)
        else:
            self.cancelled += "There is no new result."
        self._tell()

    def stop(self) -> None:
        """End the run, at the end of its project or of the server."""
        self._stop()

    def _restore(
        self,
        settings: Mapping[str, SettingValue],
        files: Mapping[str, tuple[StoredFile, ...]],
        *_: object,
    ) -> None:
        for name in self.job.settings:
            if name in settings:
                self.state.settings[name] = settings[name]
            else:
                self.state.settings.pop(name, None)
        self.state.files.update(files)

    def _snapshot(
        self,
    ) -> tuple[dict[str, SettingValue], dict[str, tuple[StoredFile, ...]], tuple[int, ...]]:
        settings, files = self.state.settings, self.state.files
        purposes = dict.fromkeys((*self.job.files, *self.job.needs))
        return (
            {name: settings[name] for name in self.job.settings if name in settings},
            {purpose: files[purpose] for purpose in purposes},
            tuple(work._version for work in self._before),
        )

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        if self._run is not None:
            self._run.cancel()
        if self._kill is not None:
            self._kill()
        self._run = self._timer = self._kill = None
        self.running = False

    def _tell(self) -> None:
        for listener in tuple(self._listeners):
            listener()

    async def _compute(self, inputs: Any) -> None:
        loop = asyncio.get_running_loop()
        this = asyncio.current_task()

        def report(stage: str) -> None:
            def set_progress() -> None:
                if self._run is this:
                    self.progress = stage
                    self._tell()

            loop.call_soon_threadsafe(set_progress)

        def started(kill: Callable[[], None]) -> None:
            """In the thread, when a process was started; the run may be over by then."""
            self._kill = kill
            if self._run is not this:
                kill()

        results = {work.job.name: work.result for work in self._before}
        said: list[str] = []
        told = _Told(report, said.append, lambda: self._run is this)
        result, error, error_inputs = await asyncio.to_thread(
            _run_job, self.job, (inputs[0], inputs[1], results), told, started
        )
        if self._run is not this:
            return
        self.running, self._run, self._done = False, None, inputs
        if not error:
            self.result, self.warnings = result, tuple(dict.fromkeys(said))
            self._good = inputs
            self._version += 1
        self.error, self.error_inputs = error, error_inputs
        changed = self._wanted != inputs and not self.job.live  # live work starts again
        self.stale = self.result is not None and (changed or bool(error))
        if not error:
            self._keep(self.job.keeps(result))
        self._tell()
        if self.job.live and self._wanted != inputs:
            self.start()

    def _keep(self, files: Mapping[str, tuple[StoredFile, ...]]) -> None:
        """Keep files of the result on the screen: as inputs they are those of this run."""
        if not files:
            return
        settings, before, versions = self._done
        self._done = self._good = settings, {**before, **files}, versions
        if self._wanted == (settings, before, versions):
            self._wanted = self._done
        self.state.files.keep(files)


@dataclass(frozen=True)
class _Told:
    """Where the stages and the warnings of a run go to, and whether it is still wanted."""

    stage: Callable[[str], None]
    warning: Callable[[str], None]
    wanted: Callable[[], bool]


_lane = threading.Lock()
"""Threads compute one after the other: what one catches of the library's warnings is of all."""
_told: contextvars.ContextVar[_Told | None] = contextvars.ContextVar("told", default=None)


class StageHandler(logging.Handler):
    """Passes the log messages of long work to the work that runs in this context."""

    def emit(self, record: logging.LogRecord) -> None:
        """Report the stage."""
        told = _told.get()
        if told is not None:
            told.stage(record.getMessage())


def listen_to_library() -> None:
    """Pass stages and warnings of the library to the work in whose context they come."""
    logger = logging.getLogger("pretravel")
    logger.addHandler(StageHandler(logging.INFO))
    logger.setLevel(logging.INFO)
    warnings.simplefilter("always", UserWarning)  # in the second run as in the first
    elsewhere = warnings.showwarning

    def show(message: Warning | str, *details: Any, **more: Any) -> None:
        told = _told.get()
        if told is None:
            elsewhere(message, *details, **more)
        else:
            told.warning(str(message))

    warnings.showwarning = show


_ahead: set[tuple[Job[Any], ...]] = set()
"""What was done ahead."""


def do_ahead(
    jobs: tuple[Job[Any], ...],
    settings: Mapping[str, SettingValue],
    files: Mapping[str, tuple[Path, ...]],
) -> None:
    """Do jobs once with an example, in the background.

    This loads what they need, so that the first file of the user is computed sooner.

    Parameters
    ----------
    jobs : tuple of Job
        In their order; each job gets the results of the jobs before it.
    settings : mapping of str to value
    files : mapping of str to tuple of Path
        By purpose.
    """
    if not jobs or jobs in _ahead:
        return
    _ahead.add(jobs)

    def work() -> None:
        _told.set(_Told(lambda _: None, lambda _: None, lambda: True))
        results: dict[str, Any] = {}
        with suppress(PretravelError):
            for job in jobs:
                with _lane:
                    results[job.name] = job.compute(Inputs(settings, files, results))

    timer = threading.Timer(_UNTIL_AHEAD, work)
    timer.daemon = True
    timer.start()


def _run_job(
    job: Job[Made],
    inputs: Any,
    told: _Told,
    started: Callable[[Callable[[], None]], None],
) -> tuple[Made | Any, str, tuple[str, ...]]:
    """Result, error and the error's inputs; in a thread. `started` gets what kills the job."""
    settings, files, results = inputs
    size = sum(len(file.content) for stored in files.values() for file in stored)
    with temporary_folder() as folder:
        try:
            paths = _on_disk(files, folder)
            if job.own_process or size > LARGE:
                process = TaskProcess(job.compute, settings, paths, results)
                started(process.kill)
                return process.result(told.stage, told.warning), "", ()
            _told.set(told)
            with _lane:
                if not told.wanted():
                    return None, "", ()
                with own_files_alone():
                    return job.compute(Inputs(settings, paths, results)), "", ()
        except PretravelError as error:
            return None, without_folder(str(error), folder), error.inputs
        except MemoryError:
            return None, NO_MEMORY, ()
        except FlawError as error:
            return None, flaw_message(str(error)), ()
        except Exception:
            return None, flaw_message(), ()


def _on_disk(
    files: Mapping[str, tuple[StoredFile, ...]], folder: Path
) -> dict[str, tuple[Path, ...]]:
    """Write files to a folder; each purpose has a folder of its own."""
    paths: dict[str, tuple[Path, ...]] = {}
    for purpose, stored in files.items():
        place = folder / purpose
        place.mkdir()
        for file in stored:
            (place / file.name).write_bytes(file.content)
        paths[purpose] = tuple(place / file.name for file in stored)
    return paths


def without_folder(message: str, folder: Path) -> str:
    """A message with the user's names of files, not those of the temporary folder."""
    for place in (*(p for p in folder.glob("*") if p.is_dir()), folder):
        message = message.replace(f"{place}/", "").replace(f"{place}\\", "")
    return message


class Works:
    """All work of a server, by screen and job."""

    def __init__(self) -> None:
        self._works: dict[tuple[int, str], Work[Any]] = {}

    def of(self, state: ScreenState, job: Job[Made]) -> Work[Made]:
        """The work of a job of a screen; made, and started where it is automatic, at first."""
        key = (id(state), job.name)
        if key not in self._works:
            before = tuple(self.of(state, earlier) for earlier in job.after)
            work = self._works[key] = Work(job, state, _before=before)
            state.listen(work.inputs_changed)
            if state.project is not None:  # what it took of other screens
                state.project.listen(work.inputs_changed)
            for earlier_work in before:
                earlier_work.listen(work.inputs_changed)
            work.inputs_changed()
        return self._works[key]

    def made(self, state: ScreenState) -> list[Work[Any]]:
        """The works of a screen that were started; none is started."""
        return [work for (screen, _), work in self._works.items() if screen == id(state)]

    def stop_all(self) -> None:
        """End all runs; files and settings stay as they are."""
        for work in self._works.values():
            work.stop()

    def forget(self, states: Iterable[ScreenState]) -> None:
        """End the runs of screens and drop their results: their project is closed."""
        gone = {id(state) for state in states}
        for key in [key for key in self._works if key[0] in gone]:
            self._works.pop(key).stop()


WORKS = Works()
"""Of this server."""
