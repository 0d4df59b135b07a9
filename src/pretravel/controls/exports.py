"""The controls that a map can be exported to, each with the files that it needs.

To add a control, write a function `(PretravelMap, ExportSettings) -> ExportedFiles` in a file of
its own and its `Control` here, with its label and steps, and list that in `CONTROLS`; another
package lists its own in the group of entry points ``pretravel.controls``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    FloatArray,
    Plugins,
    PretravelError,
    delay_travel,
    polar_angle,
)
from pretravel.controls.axis_radii import axis_radii, axis_radii_text
from pretravel.controls.control_table import SLACK_DEG, TableSettings
from pretravel.controls.haas import HAAS, haas_macro
from pretravel.controls.heidenhain import heidenhain_table
from pretravel.controls.linuxcnc_subroutines import LAST_FREE, linuxcnc_subroutines
from pretravel.controls.lookup import Lookup, describe_form
from pretravel.controls.lookup_formula import LookupSeats, LookupSeries, exact_lookup
from pretravel.controls.lookup_table import LookupTable, lookup_table, lookup_table_within
from pretravel.controls.macro_b import (
    FANUC,
    MacroDialect,
    fanuc_macro,
    macro_formula,
    renishaw_variables,
)
from pretravel.controls.siemens import MOST_SIEMENS_VALUES, siemens_cycle, siemens_formula
from pretravel.controls.steps import OF_OTHERS, Steps, macro_b_steps, same_steps, siemens_steps
from pretravel.files import USUAL_STYLUS_LENGTH
from pretravel.maps import PretravelMap, over_support

# Probe Basic keeps its settings in 3000 to 3058 and 3973 to 4024, its results in 1001 to 1012.
_FIRST_LINUXCNC, _MOST_LINUXCNC = 1050, 1900
_MOST_MACRO_B = 399
_TABLE_FILE = "pretravel_table.ngc"
_ROOM_FOR_A_TABLE = 500
"""Fewest parameters that must remain for a table of LinuxCNC."""
USUAL_TOLERANCE = 0.02 * MICROMETRE
"""Deviation of an interpolated table from the map that no measurement sees. [mm]"""
_REMARK_LINES = 12
"""Remarks are among the first lines of a table's text."""


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
    """

    files: Callable[[PretravelMap, ExportSettings], ExportedFiles]
    label: str
    steps: Steps = OF_OTHERS
    folder: bool = False
    uses_feed: bool = False
    options: frozenset[str] = frozenset()
    ending: str = ""


def correction_on_control(
    pretravel_map: PretravelMap, to: str, settings: ExportSettings
) -> tuple[str, Callable[[FloatArray], FloatArray]]:
    """The pretravel that a control will subtract, by its own formula or interpolation.

    Parameters
    ----------
    pretravel_map : PretravelMap
    to : str
        Name of the control.
    settings : ExportSettings
        Those of the export.

    Returns
    -------
    name : str
        The control and its form, in words.
    correction : callable
        Pretravel (n,) of outward normals (n, 3), machine frame; nan where there is an alarm. [mm]

    Raises
    ------
    PretravelError
        A control that takes radii off; an unknown one.
    """
    if to not in CONTROLS:
        known = ", ".join(CONTROLS)
        raise PretravelError(f"control '{to}' is not known; there are {known}", inputs=("for",))
    form = CONTROLS[to].files(pretravel_map, settings).form
    if form is None:
        raise PretravelError(
            f"the files for {to} contain radii, not a map. The errors that the radii leave are in "
            "the rows 'two axis radii' and 'eight radii'",
            inputs=("for",),
        )

    def correction(normals: FloatArray) -> FloatArray:
        directions = pretravel_map.probe_directions(normals)
        polar, slack = polar_angle(directions), SLACK_DEG * DEGREE
        held = (polar >= form.band.lowest - slack) & (polar <= form.band.highest + slack)
        return np.where(held, form.value(directions), np.nan)

    table = isinstance(form, LookupTable)
    return f"{to}, {form.description.partition(',')[0] if table else 'formula'}", correction


def table_travel(pretravel_map: PretravelMap, feed: float | None) -> float:
    """Delay travel that a table for one feed contains.

    Parameters
    ----------
    pretravel_map : PretravelMap
    feed : float or None
        Measuring feed; necessary where the map contains the signal delay. [mm/min]

    Returns
    -------
    float
        [mm]

    Raises
    ------
    PretravelError
        The map contains the signal delay and no feed is given, or the other way round.
    """
    if pretravel_map.delay is None:
        if feed is not None:
            raise PretravelError(
                "a feed is only necessary for a map that contains the signal delay; this map "
                "contains none",
                inputs=("feed",),
            )
        return 0.0
    if feed is None:
        raise PretravelError(
            "this map is that of a resting probe, and gives the signal delay separately: "
            f"{1e3 * pretravel_map.delay:.3f} ms; a table holds for one feed: give the measuring "
            "feed",
            inputs=("feed",),
        )
    return delay_travel(feed, pretravel_map.delay)


def _linuxcnc(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    base = _FIRST_LINUXCNC if settings.base is None else settings.base
    if not 31 <= base < LAST_FREE - _ROOM_FOR_A_TABLE:
        raise PretravelError(
            f"first variable {base}: the parameters for users are 31 to {LAST_FREE}",
            inputs=("base",),
        )
    subroutines = partial(
        linuxcnc_subroutines,
        base=base,
        tool=settings.tool,
        stylus_length=USUAL_STYLUS_LENGTH
        if settings.stylus_length is None
        else settings.stylus_length,
        written=settings.written,
    )
    exact = None if settings.form == "table" else exact_lookup(pretravel_map)
    if exact is not None:
        texts = subroutines(pretravel_map, exact)
        return ExportedFiles(texts, (_TABLE_FILE,), (describe_form(exact),), form=exact)
    if settings.form == "formula":
        _own_formula(pretravel_map)
    table = lookup_table(
        pretravel_map,
        tolerance=settings.largest_deviation,
        most_values=min(_MOST_LINUXCNC, LAST_FREE - base),
    )
    return ExportedFiles(
        subroutines(pretravel_map, table),
        remarks=(describe_form(table),),
        warnings=_coarse_table_warnings(table, settings.largest_deviation),
        form=table,
    )


def _own_formula(pretravel_map: PretravelMap) -> LookupSeries | LookupSeats:
    """The formula of a map, where it has one."""
    form = exact_lookup(pretravel_map)
    if form is None:
        raise PretravelError(
            f"a map of kind {pretravel_map.kind} has no formula for a control; export it "
            "as a table",
            inputs=("form",),
        )
    return form


def _renishaw(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    text = renishaw_variables(
        pretravel_map, settings.table, criterion=settings.criterion, angles=settings.angles
    )
    return _single_file(text)


def _fanuc(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    return _macro_files(pretravel_map, settings, FANUC, fanuc_macro)


def _haas(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    return _macro_files(pretravel_map, settings, HAAS, haas_macro)


def _macro_files(
    pretravel_map: PretravelMap,
    settings: ExportSettings,
    dialect: MacroDialect,
    programs: Callable[[PretravelMap, LookupTable, TableSettings], dict[str, str]],
) -> ExportedFiles:
    base = dialect.base if settings.base is None else settings.base
    # One variable contains the number of the table.
    most_values = min(dialect.room(base) - 1, _MOST_MACRO_B)
    form = _table_or_formula(pretravel_map, settings, most_values)
    if isinstance(form, LookupTable):
        return _form_files(programs(pretravel_map, form, settings.table), form, settings)
    return _form_files(macro_formula(pretravel_map, form, settings.table, dialect), form, settings)


def _siemens(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    form = _table_or_formula(pretravel_map, settings, MOST_SIEMENS_VALUES)
    if isinstance(form, LookupTable):
        return _form_files(siemens_cycle(pretravel_map, form, settings.table), form, settings)
    texts = siemens_formula(pretravel_map, form, settings.table)
    return _form_files(texts, form, settings, obsolete=("PRETRAVEL_TABLE.SPF",))


def _table_or_formula(
    pretravel_map: PretravelMap, settings: ExportSettings, most_values: int
) -> LookupTable | LookupSeries | LookupSeats:
    """What the settings ask for; auto: a table, where it is as fine as they or the map's u ask."""
    if settings.form == "formula":
        return _own_formula(pretravel_map)
    allowed = tolerance = settings.largest_deviation
    formula = None if settings.form == "table" else exact_lookup(pretravel_map)
    if formula is None:
        return lookup_table(pretravel_map, tolerance=tolerance, most_values=most_values)
    if settings.tolerance is None:
        u = over_support(pretravel_map)[2]
        allowed = max(allowed, 0.5 * math.sqrt(float(np.mean(u**2))))
    table = lookup_table_within(
        pretravel_map, tolerance=tolerance, most_values=most_values, allowed=allowed
    )
    return table or formula


def _form_files(
    texts: Mapping[str, str],
    form: LookupTable | LookupSeries | LookupSeats,
    settings: ExportSettings,
    obsolete: tuple[str, ...] = (),
) -> ExportedFiles:
    remarks = _remarks(list(texts.values())[-1])
    warnings: tuple[str, ...] = ()
    if isinstance(form, LookupTable):
        warnings = _coarse_table_warnings(form, settings.largest_deviation)
    return ExportedFiles(texts, obsolete, remarks, warnings, form)


def _heidenhain(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    text = heidenhain_table(
        pretravel_map, settings.template, azimuth=settings.azimuth, travel=settings.travel
    )
    return _single_file(
        text, ("the columns are not verified: compare them with those of your control",)
    )


def _radii(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    sentences = axis_radii(pretravel_map, settings.travel)["what_to_type"]
    return ExportedFiles(
        {"": axis_radii_text(pretravel_map, settings.travel)},
        remarks=tuple(f"{screen}: {sentence}" for screen, sentence in sentences.items()),
    )


def _single_file(text: str, warnings: tuple[str, ...] = ()) -> ExportedFiles:
    return ExportedFiles({"": text}, remarks=_remarks(text), warnings=warnings)


def _remarks(text: str) -> tuple[str, ...]:
    first = text.splitlines()[:_REMARK_LINES]
    return tuple(line for line in first if line.startswith(("(", ";")))


def _coarse_table_warnings(table: LookupTable, tolerance: float) -> tuple[str, ...]:
    if table.largest_error <= tolerance:
        return ()
    warning = (
        f"the table deviates from the map by up to {table.largest_error / MICROMETRE:.3f} µm, more "
        f"than the tolerance of {tolerance / MICROMETRE:g} µm: there are too few variables for a "
        "finer table. The form 'formula' needs no table, where the map has one"
    )
    return (warning,)


_OF_TABLES = frozenset({"units", "tolerance"})

TO_LINUXCNC = Control(
    _linuxcnc,
    "LinuxCNC (subroutines)",
    same_steps(
        "Copy all .ngc files to a folder of SUBROUTINE_PATH (see [RS274NGC] in the INI file).",
        "pretravel_point makes a whole touch and its surface point; pretravel_bore, pretravel_boss "
        "and others measure a feature from MDI. The first lines of each file give its arguments.",
    ),
    folder=True,
    uses_feed=True,
    options=frozenset({"base", "form", "tolerance", "tool", "stylus_length"}),
)
TO_RENISHAW = Control(
    _renishaw,
    "Renishaw cycles (vector radii)",
    same_steps(
        "No control has run this file yet. Write down the ten variables first, so that you can "
        "restore them.",
        "Compare the eight radii with those of a vector calibration by the control: the pattern of "
        "large and small ones must be the same. If it is turned by 180°, choose directions of "
        "travel above.",
        "Copy the program to the control. In MDI: call it once with G65 P and its number.",
    ),
    options=frozenset({"base", "program", "units", "angles", "criterion"}),
    ending=".nc",
)
_OF_MACROS = _OF_TABLES | {"base", "program", "form"}
TO_FANUC = Control(
    _fanuc, "Fanuc (macro programs)", macro_b_steps("Fanuc"), folder=True, options=_OF_MACROS
)
TO_HAAS = Control(
    _haas, "Haas (macro programs)", macro_b_steps("Haas"), folder=True, options=_OF_MACROS
)
TO_SIEMENS = Control(
    _siemens, "Siemens 840D (cycle)", siemens_steps, folder=True, options=_OF_TABLES | {"form"}
)
TO_HEIDENHAIN = Control(
    _heidenhain,
    "Heidenhain (table, not verified)",
    same_steps(
        "This table has not been compared with one of a control: its columns are a template.",
        "Compare it with a table that your control wrote before you use it.",
    ),
    options=frozenset({"template", "azimuth"}),
    ending=".3DTC",
)
TO_RADII = Control(
    _radii,
    "Probing screens (radii to type)",
    same_steps("Type the radii into the fields of your probing screen."),
    ending=".json",
)

CONTROLS: Plugins[Control] = Plugins(
    "pretravel.controls",
    own={
        name: f"pretravel.controls.exports:TO_{name.upper()}"
        for name in ("linuxcnc", "renishaw", "fanuc", "haas", "siemens", "heidenhain", "radii")
    },
)
"""Controls by name."""
