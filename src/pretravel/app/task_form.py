"""Which settings of a task a screen shows, and how a project stores them; nothing here is a page.

Labels, units, limits, defaults and help are those of the description of the task.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from pretravel.task import Length, Setting, Task, by_name, settings_of, unused

T = TypeVar("T", bound=Task)
NO_FILES: Mapping[str, Any] = {}


def stored_default(setting: Setting) -> Any:
    """The default of a setting as a project stores it: a number, a text, yes or no, or nothing.

    >>> from pretravel.tasks.qualify import Qualify
    >>> stored_default(by_name(Qualify)["axis"]), stored_default(by_name(Qualify)["diameter"])
    ('0,0,1', None)
    """
    default = setting.default
    if default is MISSING or default is None:
        return None
    if setting.several:
        return " ".join(map(setting.text, default))
    if isinstance(default, Length):
        return default.micrometres
    return default if isinstance(default, str | int | float) else str(default)


@dataclass(frozen=True)
class TaskForm:
    """The settings of a task that a screen shows: its own, except those that name files.

    A new setting of a task is in its forms, in the commands and the Python lines that they show,
    and in what their results depend on, without another line.

    Attributes
    ----------
    task : type of Task
    shared : tuple of str
        Settings that it shares with other tasks, which the form has too.
    without : tuple of str
        Its own settings that the form does not have.
    prefix : str
        Begins the stored names where another task of the screen has the same names.
    start : mapping of str to value
        Where the form starts with settings that have no default.

    >>> from pretravel.drawing.tasks.measure import Measure
    >>> form = TaskForm(Measure, start={"feature": "plane"}, prefix="measure_")
    >>> form.names[:3], form.stored[:2]
    (('feature', 'association', 'select'), ('measure_feature', 'measure_association'))
    >>> form.given({"measure_select": "bore1* bore2*", "measure_u_machine_um": None})
    {'feature': 'plane', 'select': ('bore1*', 'bore2*')}
    """

    task: type[Task]
    shared: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    prefix: str = ""
    start: Mapping[str, Any] = field(default_factory=dict)

    @property
    def settings(self) -> tuple[Setting, ...]:
        """The settings of the form."""
        own = vars(self.task).get("__annotations__", {})
        return tuple(
            setting
            for name, setting in by_name(self.task).items()
            if name in self.shared or (name in own and name not in self.without)
            # A project states no paths, and no addresses.
            if not (setting.field.reads or setting.field.writes or setting.field.connects)
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Their names in the task."""
        return tuple(setting.name for setting in self.settings)

    @property
    def stored(self) -> tuple[str, ...]:
        """Their names in the project, which a result depends on."""
        return tuple(map(self.stored_name, self.names))

    @property
    def defaults(self) -> dict[str, Any]:
        """What applies where nothing is stored, by the names in the project."""
        return {self.stored_name(name): self.default(name) for name in self.names}

    def stored_name(self, name: str) -> str:
        """The name of a setting in the project."""
        return self.prefix + name

    def default(self, name: str) -> Any:
        """What applies where nothing is stored."""
        return self.start.get(name, stored_default(by_name(self.task)[name]))

    def value(self, stored: Mapping[str, Any], name: str) -> Any:
        """A setting as it is stored, or its default."""
        return stored.get(self.stored_name(name), self.default(name))

    def used(
        self, stored: Mapping[str, Any], files: Mapping[str, Any] = NO_FILES
    ) -> tuple[str, ...]:
        """The settings that the task uses together with the others, by their names in the task.

        Parameters
        ----------
        stored : mapping of str to value
            Settings of the screen.
        files : mapping of str to value
            Those that name files, by their names in the task.

        >>> from pretravel.tasks.qualify import Qualify
        >>> form = TaskForm(Qualify)
        >>> ["axial_pretravel_um" in form.used(stored) for stored in ({}, {"kind": "mean"})]
        [True, False]
        """
        values = {**files, **{name: self.value(stored, name) for name in self.names}}
        return tuple(name for name in self.names if not unused(self.task, name, values)[0])

    def given(
        self, stored: Mapping[str, Any], files: Mapping[str, Any] = NO_FILES
    ) -> dict[str, Any]:
        """What was stated, by the names in the task; of what must be stated and was not, None.

        What the task does not use together with the others has no field, and is not given.

        Parameters
        ----------
        stored, files
            As for `used`.
        """
        found: dict[str, Any] = {}
        used = self.used(stored, files)
        for setting in self.settings:
            if setting.name not in used:
                continue
            value = stored.get(self.stored_name(setting.name), self.start.get(setting.name))
            if value is None or value == "":
                if setting.default is MISSING:
                    found[setting.name] = None
            elif setting.several and isinstance(value, str):
                found[setting.name] = tuple(value.split())
            else:
                found[setting.name] = value
        return found


def with_file_names(task: T, **stated: Any) -> T:
    """A task as the user can do it: with the names of its files, without the server's folders.

    Parameters
    ----------
    task : Task
    stated : values
        Other settings, such as the output.

    >>> from pretravel.tasks.qualify import Qualify
    >>> task = Qualify(touches="folder/a.csv", diameter=25)
    >>> with_file_names(task, output="map.json").command_line()
    'pretravel qualify a.csv --diameter 25 -o map.json'
    """
    names: dict[str, Any] = {}
    for setting in settings_of(type(task)):
        value = getattr(task, setting.name)
        if setting.field.reads and value is not None:
            values = value if setting.several else (value,)
            files = tuple(Path(each).name for each in values)
            names[setting.name] = files if setting.several else files[0]
    copy: T = replace(task, **(names | stated))
    return copy
