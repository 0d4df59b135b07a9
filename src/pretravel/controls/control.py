"""What a control is for an export: its files, settings, label and steps.

To add a control, write a file with a function `(PretravelMap, ExportSettings) -> ExportedFiles` and
its `Control`, and list that in `pretravel.controls.exports.CONTROLS`; another package lists its own
in the group of entry points ``pretravel.controls``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from pretravel.base import MICROMETRE, PretravelError
from pretravel.controls.control_table import TableSettings
from pretravel.controls.lookup import Lookup
from pretravel.controls.lookup_formula import LookupSeats, LookupSeries, exact_lookup
from pretravel.controls.lookup_table import LookupTable, lookup_table, lookup_table_within
from pretravel.controls.steps import OF_OTHERS, Steps
from pretravel.maps import PretravelMap

USUAL_TOLERANCE = 0.02 * MICROMETRE
"""Deviation of an interpolated table from the map that no measurement sees. [mm]"""
_REMARK_LINES = 13
"""Remarks are among the first lines of a table's text."""
OF_TABLES = frozenset({"units", "tolerance"})
"""Settings of the controls that interpolate a table."""


@dataclass(frozen=True)
class ExportSettings:
    """Settings of an export; each control uses those that it needs.

    Attributes
    ----------
    base : int, optional
        First variable of the control; a default for each control.
    tolerance : float, optional
        Largest deviation of an interpolated table from the map; `USUAL_TOLERANCE` when not given,
        which half of the map's uncertainty may exceed. [mm]
    form : str
        Formula, table, or auto: on LinuxCNC the formula where the map has one, else a table; on the
        others a table, or the formula where the table would be coarser than the tolerance.
    criterion : str
        For vector radii; see `pretravel.maps.sector_tables.resampled_sectors`.
    template : str, optional
        For Heidenhain: the text of a template.
    azimuth : float, optional
        For Heidenhain: azimuth of all touches. [rad]
    written : str
        The day, for the heads of the files for LinuxCNC.
    travel : float
        Travel of the machine during the signal delay, which is added to a map of the probe at
        rest. [mm]
    feed : float, optional
        Measuring feed of that travel. [mm/min]
    units : str
        Unit of the numbers in a table: mm or inch.
    angles : str
        For vector radii: whether their angles are those of outward ``normals`` or of the directions
        of ``travel``.
    program : int, optional
        Number of the first program; a default for each control.
    tool : int, optional
        For LinuxCNC: number of the probe in the tool table.
    stylus_length : float, optional
        For LinuxCNC: length of the stylus, which limits the overtravel of cycles. [mm]
    """

    base: int | None = None
    tolerance: float | None = None
    form: str = "auto"
    criterion: str = "max"
    template: str | None = None
    azimuth: float | None = None
    written: str = ""
    travel: float = 0.0
    feed: float | None = None
    units: str = "mm"
    angles: str = "normals"
    program: int | None = None
    tool: int | None = None
    stylus_length: float | None = None

    @property
    def largest_deviation(self) -> float:
        """That a table is made for. [mm]"""
        return USUAL_TOLERANCE if self.tolerance is None else self.tolerance

    @property
    def table(self) -> TableSettings:
        """The settings that all tables have in common."""
        return TableSettings(self.base, self.program, self.travel, self.feed, self.units)


@dataclass(frozen=True)
class ExportedFiles:
    """Texts for a control.

    Attributes
    ----------
    texts : mapping of str to str
        By file name; of a single file the name is empty.
    obsolete : tuple of str
        Files of an earlier export that these texts replace.
    remarks : tuple of str
        Statements about the texts, for the user.
    warnings : tuple of str
    form : Lookup, optional
        What the control evaluates, where it subtracts more than a table of radii.
    """

    texts: Mapping[str, str]
    obsolete: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    form: Lookup | None = None


@dataclass(frozen=True)
class Control:
    """A control that a map can be exported to.

    Attributes
    ----------
    files : callable
        Makes the files from a map and settings.
    folder : bool
        Whether the control needs several files, in a folder.
    uses_feed : bool
        Whether the control subtracts the delay travel itself, from the feed of each touch.
    options : frozenset of str
        Those of the settings base, tolerance, form, program, units, angles, criterion, template and
        azimuth that the control uses.
    label : str
        In the help and in a form.
    steps : callable
        What to do at the control, from the texts of the files that were made.
    ending : str
        Of the usual name of its file; empty for a folder.
    usual : mapping of str to str
        What the settings base and program are where they are not given, in words.
    """

    files: Callable[[PretravelMap, ExportSettings], ExportedFiles]
    label: str
    steps: Steps = OF_OTHERS
    folder: bool = False
    uses_feed: bool = False
    options: frozenset[str] = frozenset()
    ending: str = ""
    usual: Mapping[str, str] = field(default_factory=dict)


def own_formula(pretravel_map: PretravelMap) -> LookupSeries | LookupSeats:
    """The formula of a map, where it has one."""
    form = exact_lookup(pretravel_map)
    if form is None:
        raise PretravelError(
            f"a map of kind {pretravel_map.kind} has no formula for a control; export it "
            "as a table",
            inputs=("form",),
        )
    return form


def table_or_formula(
    pretravel_map: PretravelMap, settings: ExportSettings, most_values: int
) -> LookupTable | LookupSeries | LookupSeats:
    """What the settings ask for; auto: a table, where it is as fine as they or the map's u ask."""
    if settings.form == "formula":
        return own_formula(pretravel_map)
    tolerance = settings.largest_deviation
    formula = None if settings.form == "table" else exact_lookup(pretravel_map)
    if formula is None:
        return lookup_table(pretravel_map, tolerance=tolerance, most_values=most_values)
    allowed = _allowed_deviation(pretravel_map, settings)
    table = lookup_table_within(
        pretravel_map, tolerance=tolerance, most_values=most_values, allowed=allowed
    )
    return table or formula


def _allowed_deviation(pretravel_map: PretravelMap, settings: ExportSettings) -> float:
    """Of a table from its map: the tolerance, or half of the map's u where none is given. [mm]"""
    if settings.form != "auto" or settings.tolerance is not None:
        return settings.largest_deviation
    u = pretravel_map.over_support()[2]
    return max(settings.largest_deviation, 0.5 * math.sqrt(float(np.mean(u**2))))


def without_a_table(**stated: object) -> tuple[str, ...]:
    """Warnings of settings of a table that are stated, where the files contain a formula.

    >>> without_a_table(first_variable=None)
    ()
    """
    names = [name.replace("_", " ") for name, value in stated.items() if value is not None]
    return tuple(
        f"the {name} that you gave is not used: the files contain the formula of the map, which "
        "needs no table"
        for name in names
    )


def files_of_form(
    pretravel_map: PretravelMap,
    texts: Mapping[str, str],
    form: LookupTable | LookupSeries | LookupSeats,
    settings: ExportSettings,
    obsolete: tuple[str, ...] = (),
) -> ExportedFiles:
    """Texts with the remarks of the last of them, and a warning where their table is coarse."""
    remarks = _remarks(list(texts.values())[-1])
    warnings: tuple[str, ...] = ()
    if isinstance(form, LookupTable):
        warnings = coarse_table_warnings(pretravel_map, form, settings)
    else:
        warnings = without_a_table(first_variable=settings.base)
    return ExportedFiles(texts, obsolete, remarks, warnings, form)


def single_file(text: str, warnings: tuple[str, ...] = ()) -> ExportedFiles:
    """One text with the remarks at its beginning."""
    return ExportedFiles({"": text}, remarks=_remarks(text), warnings=warnings)


def _remarks(text: str) -> tuple[str, ...]:
    first = text.splitlines()[:_REMARK_LINES]
    return tuple(line for line in first if line.startswith(("(", ";")))


def coarse_table_warnings(
    pretravel_map: PretravelMap, table: LookupTable, settings: ExportSettings
) -> tuple[str, ...]:
    """A warning where a table deviates from its map by more than the settings allow."""
    allowed = _allowed_deviation(pretravel_map, settings)
    if table.largest_error <= allowed:
        return ()
    asked = settings.form == "auto" or settings.tolerance is not None
    more = f", more than the {allowed / MICROMETRE:.2g} µm that are allowed" if asked else ""
    warning = (
        f"the table deviates from the map by up to {table.largest_error / MICROMETRE:.3f} µm{more}"
        ": there are too few variables for a finer table"
    )
    if exact_lookup(pretravel_map) is not None:
        warning += ". The form 'formula' is exact and needs no table"
    return (warning,)
