"""The project of a workbench: what the user typed and dropped, screen by screen."""

from __future__ import annotations

import copy
import json
import math
import secrets
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from pretravel.base import PretravelError

SettingValue: TypeAlias = Any
"""What JSON can hold: a number, a text, yes or no, None, a list, a dict with texts as keys."""
Listener: TypeAlias = Callable[[], None]
UNTITLED = "Untitled"
"""Of a project that nobody named, and that has no file."""
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
            f"the setting {name[:60]!r} cannot be stored: it has more than {_DEEPEST} lists within "
            "each other"
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

    def __getitem__(self, purpose: str) -> tuple[StoredFile, ...]:
        return self._values.get(purpose, ())

    def __setitem__(self, purpose: str, files: tuple[StoredFile, ...]) -> None:
        if self[purpose] != tuple(files):
            self._values[purpose] = tuple(files)
            self._changed()

    def __delitem__(self, purpose: str) -> None:
        if self._values.pop(purpose, ()):
            self._changed()

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
    unfinished : dict of str to str
        Settings whose fields hold nothing valid now, with the labels of the fields. Not saved.
    """

    def __init__(
        self, name: str, changed: Listener | None = None, shared: Settings | None = None
    ) -> None:
        self.name = name
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
            self._screens[name] = ScreenState(name, self._changed, self.shared)
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
        if self.name == UNTITLED:
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
