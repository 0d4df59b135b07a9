"""What tables for controls have in common: settings, numbers, an identity, statements of a head."""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, INCH, MICROMETRE, FloatArray, PretravelError, ring_pattern
from pretravel.controls.gcode import plain_number
from pretravel.controls.lookup_table import LookupTable
from pretravel.controls.map_identity import map_identity
from pretravel.maps import PretravelMap, error_of_a_turn

TABLE_UNITS = {"mm": 1.0, "inch": 1.0 / INCH}
"""Units of a table, with the factor from mm."""
_SUM_TOLERANCE = {"mm": 1e-4, "inch": 1e-5}
"""Ten times the rounding of a sum of some hundred values of eight digits. [unit of the table]"""
_UPRIGHT_DEG = 1.0
"""Tilt of a probe that stands upright. [degrees]"""
SLACK_DEG = 1e-3
"""By so much a direction may lie outside the polar angles of a table. [degrees]"""


@dataclass(frozen=True)
class TableSettings:
    """Settings of a table for a control.

    Attributes
    ----------
    base : int, optional
        First variable of the table; a default for each control.
    program : int, optional
        Number of the first program; a default for each control.
    travel : float
        Travel of the machine during the signal delay, which is added to a map of the probe at
        rest. [mm]
    feed : float, optional
        Measuring feed of that travel; None for a map that contains the travel. [mm/min]
    units : str
        Unit of the table and of the programs that use it: mm or inch.
    """

    base: int | None = None
    program: int | None = None
    travel: float = 0.0
    feed: float | None = None
    units: str = "mm"

    def __post_init__(self) -> None:
        if self.units not in TABLE_UNITS:
            raise PretravelError(
                f"units '{self.units}': a table is in {' or '.join(TABLE_UNITS)}", inputs=("units",)
            )
        if not math.isfinite(self.travel):
            raise PretravelError(f"a delay travel of {self.travel} mm: it must be finite")

    def scaled(self, lengths: FloatArray | float) -> FloatArray:
        """Lengths in mm in the unit of the table."""
        return np.asarray(np.asarray(lengths) * TABLE_UNITS[self.units])


def table_identity(numbers: Iterable[str]) -> int:
    """A number of six digits that another table hardly has.

    >>> table_identity(["0.0081235"]) != table_identity(["0.0081236"])
    True
    """
    return zlib.crc32(" ".join(numbers).encode()) % 900_000 + 100_000


def check_radii(pretravel_map: PretravelMap, pretravel: FloatArray) -> None:
    """Refuse pretravel that is not smaller than the radius of the tip, and numbers not finite."""
    radius = pretravel_map.tip_radius
    if not (math.isfinite(radius) and np.all(np.isfinite(pretravel))):
        raise PretravelError("tip radius and pretravel must be finite for a table of a control")
    largest = float(np.max(np.abs(pretravel)))
    if not largest < radius:
        raise PretravelError(
            f"a pretravel of {largest:.4f} mm is not smaller than the tip radius of {radius:.4f} "
            "mm: this is not the map of a touch-trigger probe",
            inputs=("tip_diameter",),
        )


def check_across_z(pretravel_map: PretravelMap) -> None:
    """Refuse a map for radii across Z where it does not hold because its probe lies another way.

    Raises
    ------
    PretravelError
    """
    tilt = math.acos(min(abs(float(pretravel_map.rotation[2, 2])), 1.0)) / DEGREE
    around = ring_pattern(np.array([0.5 * np.pi]), 24)
    if tilt < _UPRIGHT_DEG or pretravel_map.supports(around).all():
        return
    raise PretravelError(
        f"the probe of this map lies {tilt:.0f}° to Z, and the map does not hold all around Z, "
        "where these radii are used: export the map as a formula or a table (fanuc, haas, "
        "siemens, linuxcnc), whose normals may have any direction"
    )


def map_statement(pretravel_map: PretravelMap) -> str:
    """The map of a table: its number, its kind, and what it was made from."""
    source = pretravel_map.provenance.source
    number = map_identity(pretravel_map).number
    return f"pretravel map {number} of kind {pretravel_map.kind}" + (
        f" - {source}" if source else ""
    )


def feed_statement(pretravel_map: PretravelMap, settings: TableSettings) -> str:
    """The measuring feed for which a table holds.

    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> pretravel_map = PretravelMap(
    ...     MeanBasis(), np.array([0.016]), Covariance.none(1),
    ...     DirectionSupport([[0.0, 0.0, 1.0]]), tip_radius=3.0, feed=60.0)
    >>> feed_statement(pretravel_map, TableSettings())
    'made at 60 mm/min - measure at that feed'
    """
    if pretravel_map.delay is not None:
        if settings.feed is None:
            return "contains the signal delay at one feed - measure at that feed"
        return f"contains the signal delay at {settings.feed:g} mm/min - measure at that feed"
    if pretravel_map.feed is not None:
        return f"made at {pretravel_map.feed:g} mm/min - measure at that feed"
    return "the map has no feed - measure at the feed at which the probe was qualified"


def conditions_statements(pretravel_map: PretravelMap, settings: TableSettings) -> list[str]:
    """The feed, tip and orientation of head and spindle for which a table holds."""
    made = pretravel_map.provenance
    found = [feed_statement(pretravel_map, settings)]
    if of := head_statement(pretravel_map):
        found.append(f"{of} - for no other")
    if made.spindle_deg is not None:
        found.append(f"made at spindle {made.spindle_deg:g} degrees - measure at that orientation")
    elif error_of_a_turn(pretravel_map) != 0.0:
        found.append(
            "the map does not state the spindle orientation - measure at that of the qualification"
        )
    return found


def head_statement(pretravel_map: PretravelMap) -> str:
    """The tip and the orientation of the head of a map; empty where it states none."""
    made = pretravel_map.provenance
    stated = (("tip", made.tip), ("orientation", made.orientation))
    of = [f"{what} {_plain_name(name)}" for what, name in stated if name]
    return f"of {' and '.join(of)}" if of else ""


def _plain_name(name: str) -> str:
    """A name of a tip as every control reads it in a comment.

    >>> _plain_name("T1 (A0;B0) ü")
    'T1 A0 B0'
    """
    return " ".join(re.findall(r"[A-Za-z0-9.-]+", name))[:_LONGEST_NAME]


_LONGEST_NAME = 40


@dataclass(frozen=True, eq=False)
class ControlTable:
    """A lookup table in the numbers of a control.

    Attributes
    ----------
    form : LookupTable
    values : tuple of str
        Row by row, in the unit of the table.
    axes : (3, 3) str
        The probe's axes in machine coordinates, one in each row.
    lowest_deg, polar_step_deg, azimuth_step_deg : str
        [degrees]
    within_deg : tuple of str
        Polar angles beyond which the control gives an alarm. [degrees]
    number : int
        The identity that the programs compare.
    checksum : str
        The sum of the values, which the programs compare at each lookup: another program may use
        variables of the table.
    checksum_tolerance : str
        A control adds up with rounding; a value that another program has written differs by more.
    """

    form: LookupTable
    values: tuple[str, ...]
    axes: tuple[tuple[str, ...], ...]
    lowest_deg: str
    polar_step_deg: str
    azimuth_step_deg: str
    within_deg: tuple[str, str]
    number: int
    checksum: str
    checksum_tolerance: str

    @property
    def rows(self) -> int:
        """Number of rows, with both borders."""
        return int(self.form.values.shape[0])

    @property
    def columns(self) -> int:
        """Number of columns."""
        return int(self.form.values.shape[1])


def control_table(
    pretravel_map: PretravelMap, form: LookupTable, settings: TableSettings
) -> ControlTable:
    """The numbers of a lookup table for a control.

    Parameters
    ----------
    pretravel_map : PretravelMap
    form : LookupTable
        The table of that map.
    settings : TableSettings

    Raises
    ------
    PretravelError
        Numbers that are not those of a touch-trigger probe.
    """
    pretravel = form.values + settings.travel
    check_radii(pretravel_map, pretravel)
    values = tuple(plain_number(value) for value in settings.scaled(pretravel).flat)
    axes = tuple(tuple(plain_number(c) for c in axis) for axis in pretravel_map.rotation.T)
    lowest, highest = form.band.lowest / DEGREE, form.band.highest / DEGREE
    scales = (
        plain_number(lowest),
        plain_number(form.polar_step / DEGREE),
        plain_number(form.azimuth_step / DEGREE),
    )
    within = (plain_number(lowest - SLACK_DEG), plain_number(highest + SLACK_DEG))
    texts = [*values, *(c for axis in axes for c in axis), *scales, *within, settings.units]
    checksum = plain_number(math.fsum(float(value) for value in values))
    return ControlTable(
        form, values, axes, *scales, within, table_identity(texts), checksum,
        plain_number(_SUM_TOLERANCE[settings.units]),
    )  # fmt: skip


def table_statements(
    pretravel_map: PretravelMap, table: ControlTable, settings: TableSettings
) -> list[str]:
    """The statements about a table that the head of each of its files contains."""
    band = table.form.band
    size = f"{table.form.rows} x {table.columns}"
    error = f"{table.form.largest_error / MICROMETRE:.3f} um"
    range_deg = f"{band.lowest / DEGREE:.2f} to {band.highest / DEGREE:.2f} degrees"
    radius = settings.scaled(pretravel_map.tip_radius)
    return [
        map_statement(pretravel_map),
        f"table of {size} - cubic between. Largest difference from the map {error}",
        f"holds from {range_deg} from the probe axis. Outside there is an alarm",
        f"units {settings.units}. Tip radius {plain_number(float(radius))}",
        *conditions_statements(pretravel_map, settings),
        "the normal is a unit vector out of the part - along the axes of the machine",
    ]
