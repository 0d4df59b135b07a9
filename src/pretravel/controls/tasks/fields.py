"""Settings that tasks of controls share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

from pretravel.base import PretravelError
from pretravel.task import Field

ToolOfSubroutines: TypeAlias = Annotated[
    int | None,
    Field(
        help="Number of the probe in the tool table of LinuxCNC. Cycles stop if another tool is in "
        "the spindle or another length is active; without a number they stop if any tool length "
        "is active.",
        range=(1, 99_999),
        metavar="NUMBER",
        label="Tool number of the probe",
        hint="Empty: no tool length",
    ),
]
StylusOfSubroutines: TypeAlias = Annotated[
    float,
    Field(
        help="Length of the stylus from the tip's centre to the probe's body, in mm; the default "
        "is 50. Cycles stop if a move could push the tip deeper than a fifth of this length.",
        range=(1.0, 1000.0),
        unit="mm",
        label="Length of the stylus",
        hint="Empty: 50 mm",
    ),
]


def refuse_no_folder(path: Path) -> None:
    """Refuse an output that cannot be a folder, where there are several files.

    Raises
    ------
    PretravelError
        It has an ending, is a file, or its own folder does not exist.
    """
    if path.suffix or path.is_file():
        raise PretravelError(f"{path}: a folder is needed, for several files", inputs=("output",))
    if not path.parent.is_dir():
        raise PretravelError(f"cannot make {path}: the folder {path.parent} does not exist")
