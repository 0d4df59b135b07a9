"""The project of a workbench: what the user typed and dropped, screen by screen."""

from __future__ import annotations

import copy
import hashlib
import json
import math
import secrets
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

from pretravel.base import PretravelError

SettingValue: TypeAlias = Any
"""What JSON can hold: a number, a text, yes or no, None, a list, a dict with texts as keys."""
Listener: TypeAlias = Callable[[], None]
UNTITLED = "Untitled"
"""Of a project that nobody named, and that has no file."""
OF_AN_EXAMPLE = "Example"
"""Of a project that nobody named, and that has an example alone."""
LARGEST_PROJECT = 500_000_000
"""Most bytes of all files of a project."""
OF_ALL_SCREENS = ("statements",)
"""Settings that all screens of a project have in common: what the laboratory states."""
_MOST_SIGNS = 1_000_000
"""Of one setting as JSON."""
_DEEPEST = 20
"""Most lists and dicts within each other in a setting; deeper ones cannot be copied."""


@dataclass(frozen=True)
class StoredFile:
    """A file of a project: its name and its content.

    Attributes
    ----------
    name : str
        Without a folder.
    content : bytes
    """

    name: str
    content: bytes = field(repr=False)

    def __post_init__(self) -> None:
        check_file_name(self.name)

    @cached_property
    def digest(self) -> str:
        """Of name and content."""
        return hashlib.blake2b(self.name.encode() + b"\0" + self.content).hexdigest()[:32]


@dataclass(frozen=True)
class Link:
    """Where an input of a screen comes from: another screen of the project.

    Attributes
    ----------
    screen : str
        The other screen.
    kind : str
        "file": a file of it; "result": what a job of it made; "reference": its reference and tip.
    place : str
        The purpose of the file; or the name of the job, and of a file that it gives, after a colon.
    of_source : str
        Digest of the file, of the inputs of the job, or of the values, when it was taken.
    taken : str
        Digest of what was taken: where this screen has something else now, the link is over.
    """

    screen: str
    kind: str
    place: str
    of_source: str
    taken: str


def check_file_name(name: str) -> None:
    """Refuse a name that could mean a file somewhere else, or that a system cannot store.

    Raises
    ------
    PretravelError
        The name has a folder, control characters, or more than 150 bytes; or it begins with a
        hyphen, as the options of the commands that a screen shows.

    >>> check_file_name("touches.csv")
    >>> check_file_name("../touches.csv")
    Traceback (most recent call last):
        ...
    pretravel.base.errors.PretravelError: the file name '../touches.csv' cannot be used: ...
    """
    parts = set(name) & set('/\\:*?"<>|')
    reserved = name.strip(". ") in ("", *(f"{n}" for n in ("con", "nul", "aux", "prn")))
    refused = parts or reserved or name.startswith("-") or not name.isprintable()
    if refused or len(name.encode(errors="replace")) > 150:
        raise PretravelError(
            f"the file name {name!r} cannot be used: give the file a name of at most 150 bytes "
            'without folders, without any of / \\ : * ? " < > | and without a hyphen before it'
        )


class Settings(MutableMapping[str, SettingValue]):
    """The settings of a screen; a change is saved and told to every tab.

    Values are copied in and out: to change a list, assign the new list.

    >>> changes = []
    >>> settings = Settings(lambda: changes.append("changed"))
    >>> settings["diameter"] = 25.0
    >>> settings["diameter"] = 25.0  # no change
    >>> settings["diameter"], settings.get("tip", 6.0), changes
    (25.0, 6.0, ['changed'])
    """

    def __init__(
        self,
        changed: Listener,
        values: Mapping[str, SettingValue] | None = None,
        shared: Settings | None = None,
    ) -> None:
        self._changed = changed
        self._shared = shared
        self._values: dict[str, SettingValue] = {}
        for name, value in (values or {}).items():
            self._values[name] = _plain(name, value)

    def __getitem__(self, name: str) -> SettingValue:
        if self._shared is not None and name in OF_ALL_SCREENS:
            return self._shared[name]
        return copy.deepcopy(self._values[name])

    def __setitem__(self, name: str, value: SettingValue) -> None:
        if self._shared is not None and name in OF_ALL_SCREENS:
            self._shared[name] = value
            return
        plain = _plain(name, value)
        if name not in self._values or not _same(self._values[name], plain):
            self._values[name] = plain
            self._changed()

    def __delitem__(self, name: str) -> None:
        if self._shared is not None and name in OF_ALL_SCREENS:
            del self._shared[name]
            return
        del self._values[name]
        self._changed()

    def __iter__(self) -> Iterator[str]:
        return iter((*self._values, *(self._shared or ())))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def plain(self) -> dict[str, SettingValue]:
        """A copy of all values, without those that screens have in common."""
        return copy.deepcopy(self._values)


def _same(a: SettingValue, b: SettingValue) -> bool:
    return type(a) is type(b) and bool(a == b)


def _plain(name: str, value: SettingValue) -> SettingValue:
    """The value as JSON gives it back."""
    try:
        text = json.dumps({name: value}, allow_nan=False, ensure_ascii=False)
        text.encode()  # half of a pair of surrogates cannot be written
    except (TypeError, ValueError, RecursionError) as error:
        given = "not finite" if isinstance(value, float) and not math.isfinite(value) else error
        raise PretravelError(f"the setting {name[:60]!r} cannot be stored: {given}") from error
    if len(text) > _MOST_SIGNS:
        raise PretravelError(
            f"the setting {name[:60]!r} has {len(text)} characters, more than {_MOST_SIGNS}: "
            "give large data as a file"
        )
    plain = json.loads(text)[name]
    if _is_deeper(plain, _DEEPEST):
        raise PretravelError(
            f"the setting {name[:60]!r} cannot be stored: it has more than {_DEEPEST} levels of "
            "nested lists"
        )
    return plain


def _is_deeper(value: SettingValue, most: int) -> bool:
    """Whether lists and dicts are nested deeper than that."""
    if not isinstance(value, list | dict):
        return False
    parts = value.values() if isinstance(value, dict) else value
    return most == 0 or any(_is_deeper(part, most - 1) for part in parts)


class ProjectFiles(MutableMapping[str, tuple[StoredFile, ...]]):
    """The files of a screen by their purpose; a purpose without files has an empty tuple.

    >>> files = ProjectFiles(lambda: None)
    >>> files["touches"] = (StoredFile("sphere.csv", b"x_mm,y_mm,z_mm"),)
    >>> [file.name for file in files["touches"]], files["map"]
    (['sphere.csv'], ())
    """

    def __init__(
        self, changed: Listener, values: Mapping[str, tuple[StoredFile, ...]] | None = None
    ) -> None:
        self._changed = changed
        self._values = dict(values or {})
        self._before: dict[str, tuple[StoredFile, ...]] = {}

    def __getitem__(self, purpose: str) -> tuple[StoredFile, ...]:
        return self._values.get(purpose, ())

    def __setitem__(self, purpose: str, files: tuple[StoredFile, ...]) -> None:
        old = self[purpose]
        if old != tuple(files):
            self._values[purpose] = tuple(files)
            self._before[purpose] = () if set(old) <= set(files) else old
            self._changed()

    def __delitem__(self, purpose: str) -> None:
        self[purpose] = ()

    def keep(self, made: Mapping[str, tuple[StoredFile, ...]]) -> None:
        """Store files that the screen made itself: they replace nothing of the user's."""
        changed = {purpose: files for purpose, files in made.items() if files != self[purpose]}
        if changed:
            self._values.update(changed)
            self._changed()

    def before(self, purpose: str) -> tuple[StoredFile, ...]:
        """The files that the last change replaced or took away; not saved.

        >>> files = ProjectFiles(lambda: None)
        >>> files["touches"] = (StoredFile("mine.csv", b"1"),)
        >>> files["touches"] = (StoredFile("example.csv", b"2"),)
        >>> [file.name for file in files.before("touches")]
        ['mine.csv']
        """
        return self._before.get(purpose, ())

    def __iter__(self) -> Iterator[str]:
        return iter(tuple(name for name, files in self._values.items() if files))

    def __len__(self) -> int:
        return sum(1 for _ in self)


class ScreenState:
    """What a project keeps for one screen.

    Attributes
    ----------
    name : str
        Of the screen.
    settings : Settings
    files : ProjectFiles
    links : dict of str to Link
        Where files come from, by their purpose, and the reference, as "reference"; `link` adds one.
    project : Project or None
    unfinished : dict of str to str
        Settings whose fields hold nothing valid now, with the labels of the fields. Not saved.
    """

    def __init__(
        self,
        name: str,
        changed: Listener | None = None,
        shared: Settings | None = None,
        project: Project | None = None,
    ) -> None:
        self.name = name
        self.project = project
        self.links: dict[str, Link] = {}
        self._mine: tuple[dict[str, SettingValue], dict[str, tuple[StoredFile, ...]]] | None = None
        self.unfinished: dict[str, str] = {}
        self._listeners: list[Listener] = []
        self._tell_project = changed
        self.settings = Settings(self._changed, shared=shared)
        self.files = ProjectFiles(self._changed)

    def listen(self, listener: Listener) -> Listener:
        """Call a function after each change.

        Returns
        -------
        callable
            Ends it.
        """
        self._listeners.append(listener)

        def end() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return end

    def mark(self, name: str, unfinished: str) -> None:
        """State that the field of a setting holds nothing valid, by its label; empty: it does."""
        if self.unfinished.get(name, "") == unfinished:
            return
        if unfinished:
            self.unfinished[name] = unfinished
        else:
            del self.unfinished[name]
        self.tell()

    def link(self, name: str, link: Link | None) -> None:
        """State where an input comes from; None: from nowhere else."""
        if self.links.get(name) == link:
            return
        if link is None:
            del self.links[name]
        else:
            self.links[name] = link
        self._changed()

    def fill(
        self,
        settings: Mapping[str, SettingValue],
        files: Mapping[str, tuple[StoredFile, ...]],
    ) -> None:
        """Take an example; what the user had comes back with `take_back`."""
        if self.files and not self.can_take_back:
            self._mine = self.settings.plain(), dict(self.files)
        if self.project is not None:
            self.project.named_after(OF_AN_EXAMPLE)
        self.files.update(files)
        self.settings.update(settings)

    @property
    def can_take_back(self) -> bool:
        """Whether an example stands where the user had files."""
        return self._mine is not None

    def take_back(self) -> None:
        """Settings and files of before the example."""
        if self._mine is None:
            return
        (settings, files), self._mine = self._mine, None
        for name in [name for name in self.settings.plain() if name not in settings]:
            del self.settings[name]
        self.settings.update(settings)
        self.files.update({**dict.fromkeys(self.files, ()), **files})
        self.tell()

    def _changed(self) -> None:
        if self._tell_project is not None:
            self._tell_project()
        self.tell()

    def tell(self) -> None:
        """Call the listeners."""
        for listener in tuple(self._listeners):
            listener()


class Project:
    """Settings and files of all screens.

    Attributes
    ----------
    name : str
    identity : str
        Random; its autosaved file has this name.
    shared : Settings
        What all screens have in common; see `OF_ALL_SCREENS`.

    >>> project = Project("Probe 7")
    >>> project.screen("engineer").settings["diameter"] = 25.0
    >>> project.screen("engineer").settings["diameter"]
    25.0
    >>> project.screen("metrologist").settings["statements"] = {"laboratory.name": "North"}
    >>> project.screen("laboratory").settings["statements"]
    {'laboratory.name': 'North'}
    """

    def __init__(self, name: str = UNTITLED, identity: str | None = None) -> None:
        self._name = name
        self.identity = identity or secrets.token_hex(8)
        self._screens: dict[str, ScreenState] = {}
        self._listeners: list[Listener] = []
        self.shared = Settings(self._shared_changed)

    @property
    def name(self) -> str:
        """What the user calls it."""
        return self._name

    @name.setter
    def name(self, name: str) -> None:
        name = " ".join(name.split())[:100]
        if name and name != self._name:
            self._name = name
            self._changed()

    def screen(self, name: str) -> ScreenState:
        """The state of a screen; empty at first."""
        if name not in self._screens:
            self._screens[name] = ScreenState(name, self._changed, self.shared, self)
        return self._screens[name]

    @property
    def screens(self) -> tuple[ScreenState, ...]:
        """All screens that were used."""
        return tuple(self._screens.values())

    def snapshot(self) -> Project:
        """A copy that does not change any more, to be saved by a thread."""
        made = Project(self.name, self.identity)
        made.shared.update(self.shared)
        for state in self.screens:
            screen = made.screen(state.name)
            screen.settings.update(state.settings.plain())
            for purpose, files in state.files.items():
                screen.files[purpose] = files
            screen.links.update(state.links)
        return made

    @property
    def stored(self) -> tuple[StoredFile, ...]:
        """All files, screen by screen."""
        every = (files for state in self.screens for files in state.files.values())
        return tuple(file for files in every for file in files)

    @property
    def file_names(self) -> tuple[str, ...]:
        """Names of all files, each once."""
        return tuple(dict.fromkeys(file.name for file in self.stored))

    @property
    def size(self) -> int:
        """Bytes of all files."""
        return sum(len(file.content) for file in self.stored)

    def named_after(self, file_name: str) -> None:
        """Take the name of a file, where nobody gave one.

        >>> project = Project()
        >>> project.named_after("sphere 7.csv")
        >>> project.named_after("part.step")
        >>> project.name
        'sphere 7'
        """
        if self.name in (UNTITLED, OF_AN_EXAMPLE):
            self.name = Path(file_name).stem

    def listen(self, listener: Listener) -> Listener:
        """Call a function after each change of any screen; the result ends it."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def _shared_changed(self) -> None:
        self._changed()
        for state in self.screens:
            state.tell()

    def _changed(self) -> None:
        for listener in tuple(self._listeners):
            listener()


@dataclass(frozen=True)
class Inputs:
    """What a job computes from.

    Attributes
    ----------
    settings : mapping of str to value
        Those that were set; give the default with ``settings.get(name, default)``.
    files : mapping of str to tuple of Path
        Copies in a temporary folder, by purpose, with the names that the user gave them.
    results : mapping of str to value
        Of the jobs that this one comes after, by their names.
    """

    settings: Mapping[str, SettingValue]
    files: Mapping[str, tuple[Path, ...]]
    results: Mapping[str, Any] = field(default_factory=dict)

    def file(self, purpose: str) -> Path:
        """The only file of a purpose; `Job.needs` makes sure that it is there."""
        return self.files[purpose][0]

    def optional_file(self, purpose: str) -> Path | None:
        """The only file of a purpose, or None."""
        found = self.files.get(purpose, ())
        return found[0] if found else None
