"""Export a map: tables and programs for a control."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal, TypeAlias

from pretravel.base.errors import PretravelError
from pretravel.base.units import MICROMETRE
from pretravel.base.whole_file import write_text, write_texts
from pretravel.controls.exports import CONTROLS, ExportedFiles, ExportSettings, table_travel
from pretravel.files.csv_table import csv_table_text
from pretravel.maps.grid import effective_radius_table
from pretravel.maps.pretravel_map import PretravelMap

RADII_TABLE = "csv"
"""A table of effective radii, which no control reads directly."""
TABLE_TOLERANCE = 0.02 * MICROMETRE
"""Of interpolated tables. [mm]"""
Form: TypeAlias = Literal["auto", "formula", "table"]


@dataclass(frozen=True)
class ExportWish:
    """What is asked of an export; None is the control's default.

    Attributes
    ----------
    base, program : int or None
        First variable, and number of the first program.
    units : str or None
        Unit of a table: mm or inch.
    angles, criterion, form : str or None
        See `ExportSettings`.
    template : str or None
        For Heidenhain: the text of a template.
    azimuth : float or None
        For Heidenhain: azimuth of all touches. [rad]
    tolerance : float or None
        Largest deviation of an interpolated table from the map. [mm]
    feed : float or None
        Measuring feed, for tables of a map that contains the signal delay. [mm/min]
    """

    base: int | None = None
    program: int | None = None
    units: str | None = None
    angles: str | None = None
    template: str | None = None
    azimuth: float | None = None
    form: Form | None = None
    criterion: str | None = None
    tolerance: float | None = None
    feed: float | None = None

    def stated(self) -> tuple[str, ...]:
        """Names of the settings that are stated, without the feed, which depends on the map.

        >>> ExportWish(units="inch", feed=100.0).stated()
        ('units',)
        """
        names = [field.name for field in fields(self) if field.name != "feed"]
        return tuple(name for name in names if getattr(self, name) is not None)


def control_names() -> list[str]:
    """What a map can be exported to."""
    return [*CONTROLS, RADII_TABLE]


def makes_folder(to: str) -> bool:
    """Whether an export makes several files, in a folder."""
    return to in CONTROLS and CONTROLS[to].folder


def settings_of(to: str) -> frozenset[str]:
    """Names of the settings that an export uses, as in `Control.options`.

    >>> sorted(settings_of("siemens")), settings_of("csv")
    (['tolerance', 'units'], frozenset())
    """
    return CONTROLS[to].options if to in CONTROLS else frozenset()


def takes_feed(to: str) -> bool:
    """Whether the files hold for one measuring feed, where the map contains the signal delay."""
    return to not in CONTROLS or not CONTROLS[to].uses_feed


def users_of(setting: str) -> str:
    """The controls that use a setting, for messages."""
    return ", ".join(name for name, control in CONTROLS.items() if setting in control.options)


def misapplied(to: str, wish: ExportWish) -> str:
    """The first stated setting that an export does not use, as a sentence; empty where none is.

    >>> misapplied("siemens", ExportWish(base=500))
    'base does not apply to siemens; it is for linuxcnc, renishaw, fanuc, haas'
    """
    used = settings_of(to)
    wrong = next((name for name in wish.stated() if name not in used), None)
    return "" if wrong is None else f"{wrong} does not apply to {to}; it is for {users_of(wrong)}"


def export_map(
    pretravel_map: PretravelMap, to: str, wish: ExportWish = ExportWish(), *, written: str = ""
) -> ExportedFiles:
    """The files of a map for a control.

    Parameters
    ----------
    pretravel_map : PretravelMap
    to : str
        One of `control_names`.
    wish : ExportWish
    written : str
        The day, for the heads of files.

    Returns
    -------
    ExportedFiles

    Raises
    ------
    PretravelError
        A setting that the control does not use; a map that it cannot hold.
    """
    if wrong := misapplied(to, wish):
        raise PretravelError(wrong)
    control = CONTROLS.get(to)
    if control is None:
        table = effective_radius_table(pretravel_map, table_travel(pretravel_map, wish.feed))
        return ExportedFiles(
            {"": csv_table_text(table)}, remarks=("effective radii over the supported directions",)
        )
    if control.uses_feed and wish.feed is not None:
        raise PretravelError(
            f"the files for {to} use the feed of each touch: leave the feed out", inputs=("feed",)
        )
    settings = ExportSettings(
        base=wish.base,
        tolerance=TABLE_TOLERANCE if wish.tolerance is None else wish.tolerance,
        form=wish.form or "auto",
        criterion=wish.criterion or "max",
        template=wish.template,
        azimuth=wish.azimuth,
        written=written,
        travel=0.0 if control.uses_feed else table_travel(pretravel_map, wish.feed),
        feed=wish.feed,
        units=wish.units or "mm",
        angles=wish.angles or "normals",
        program=wish.program,
    )
    return control.files(pretravel_map, settings)


def write_export(output: Path, files: ExportedFiles) -> None:
    """Write the one text to a file, or each text to a folder; files that they replace are removed.

    Parameters
    ----------
    output : Path
        The file, or the folder.
    files : ExportedFiles
    """
    if "" in files.texts:
        write_text(output, files.texts[""])
        return
    write_texts(output, files.texts, "ascii")
    for name in files.obsolete:
        (output / name).unlink(missing_ok=True)
