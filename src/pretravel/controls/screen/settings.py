"""What the engineer typed and chose, and the tasks that do the same."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pretravel.app import TaskForm
from pretravel.controls.exports import CONTROLS
from pretravel.controls.tasks.compare.task import Compare
from pretravel.controls.tasks.export.task import Export
from pretravel.task import StatedColumns, Task
from pretravel.tasks.qualify import Qualify, SettingsOfKinds

if TYPE_CHECKING:
    from pretravel.files import ReadingOptions

QUALIFICATION = TaskForm(Qualify, shared=("pin", *SettingsOfKinds.__annotations__))
CONTROL = TaskForm(Export, prefix="export_", without=("tip_diameter", "show_template"))
"""The map is not read from a file here, and no template is printed."""
OF_FILE: Mapping[str, Any] = {"units": None, "decimal": None, "columns": {}, "left_out": []}
"""What is stated about one file, and does not hold for the next one."""
_USUAL = {**QUALIFICATION.defaults, **CONTROL.defaults}
MAP_NAME = "map.json"


def file_mark(content: bytes) -> str:
    """What tells a file from others: the beginning of its checksum.

    >>> file_mark(b"")
    'e3b0c44298fc1c14'
    """
    return hashlib.sha256(content).hexdigest()[:16]


@dataclass(frozen=True)
class EngineerSettings:
    """Settings of the screen.

    Attributes
    ----------
    values : mapping of str to value
        All settings of `QUALIFICATION`, `CONTROL` and `OF_FILE`.
    """

    values: Mapping[str, Any] = field(default_factory=dict)

    @staticmethod
    def of(stored: Mapping[str, Any], content: bytes = b"") -> EngineerSettings:
        """Stored settings, and defaults for the others.

        Parameters
        ----------
        stored : mapping of str to value
        content : bytes
            Of the file of touches; what is stated about another file does not hold.
        """
        about = {name: stored.get(name, {}) for name in ("answers", "left_out")}
        mark = file_mark(content)
        stated = {
            key: value
            for one in about.values()
            if one.get("file") == mark
            for key, value in one.items()
        }
        return EngineerSettings(
            {name: stored.get(name, value) for name, value in _USUAL.items()}
            | {name: stated.get(name, value) for name, value in OF_FILE.items()}
        )

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the touches that were unticked."""
        return tuple(self["left_out"])

    def looking(self) -> ReadingOptions:
        """How the file is looked at."""
        from pretravel.files import ReadingOptions

        return ReadingOptions(
            units=self["units"], decimal=self["decimal"], columns=self["columns"] or None
        )

    def qualify(self, path: Path, exclude: Sequence[str] = ()) -> Qualify:
        """The task that the screen does.

        Parameters
        ----------
        path : Path
            Of the touches.
        exclude : sequence of str
            Names of touches that are left out.
        """
        return Qualify(
            touches=(path,),
            units=self["units"],
            decimal=self["decimal"],
            columns=StatedColumns(self["columns"]) if self["columns"] else None,
            exclude=tuple(exclude),
            output=Path(MAP_NAME),
            **QUALIFICATION.given(self.values),
        )

    @property
    def control(self) -> str | None:
        """The control that is chosen."""
        return self[CONTROL.stored_name("to")]  # type: ignore[no-any-return]

    def export(self) -> Export:
        """Settings of the control; those that it does not use are left out."""
        to = self.control or ""
        given = CONTROL.given(self.values)
        return Export(map_file=Path(MAP_NAME), output=Path(export_name(to)), **given)


def tasks_of(file: str, settings: EngineerSettings) -> tuple[Task, ...]:
    """The tasks that do the same as the screen, one after the other.

    Parameters
    ----------
    file : str
        Name of the file of touches.
    settings : EngineerSettings

    >>> for task in tasks_of("a b.csv", EngineerSettings.of({"diameter": 25.0, "ring": True})):
    ...     print(task.command_line())
    pretravel qualify 'a b.csv' --diameter 25 --ring -o map.json
    pretravel compare map.json
    """
    export = (settings.export(),) if settings.control else ()
    qualify = settings.qualify(Path(file), settings.left_out)
    return (qualify, Compare(map_file=MAP_NAME), *export)


def export_name(to: str) -> str:
    """Name of the file or folder of an export.

    >>> export_name("fanuc"), export_name("radii"), export_name("csv")
    ('fanuc', 'radii.json', 'effective_radii.csv')
    """
    return to + CONTROLS[to].ending if to in CONTROLS else "effective_radii.csv"
