"""Trip maps of Centroid's ProbeApp and tables like them: trip and un-trip around a ring; reading.

The probe goes from the middle of a ring to its wall at each angle: the trip is where the control
saw the signal, the un-trip where the signal went off on the way back. The trip is the touch; its
distance from the un-trip is a hysteresis, and says what no map corrects.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, frozen
from pretravel.files import (
    LENGTH_UNITS,
    FileFormat,
    FileReadings,
    ReadingOptions,
    Source,
    SourceFile,
    StatedRows,
    column_name,
    opened,
    refuse_contradicted_unit,
    unit_of,
)
from pretravel.touches import Touches
from pretravel.uncertainty import fit_sphere

_ANGLES = ("angle", "azimuth", "degree", "degrees", "deg", "theta", "direction")
_MOST_TITLES = 60
"""Lines before the table: name of the probe, notes, diameters."""
_LONGEST = 2.0
"""A larger trip is no pretravel: it is the distance from the middle of the ring. [mm]"""
_SEPARATORS = (";", "\t", ",")
_LOBES = 3


@dataclass(frozen=True, eq=False)
class TripMap:
    """Trip and un-trip around a ring.

    Attributes
    ----------
    azimuth : (n,) float
        Of the side of the ring that is touched, seen from its middle, counter-clockwise. [rad]
    trip, untrip : (n,) float
        Travel beyond the wall, or distance from the middle; or not a number. [mm]
    positions : (n, 2) float or None
        Of the trips, where the table has them. [mm]
    lines : tuple of int
    """

    azimuth: FloatArray
    trip: FloatArray
    untrip: FloatArray
    positions: FloatArray | None
    lines: tuple[int, ...]

    @property
    def hysteresis(self) -> FloatArray:
        """Trip less un-trip, (n,). [mm]"""
        return np.asarray(self.trip - self.untrip)

    def lobes(self, values: FloatArray) -> tuple[float, float]:
        """Amplitude of the three lobes of values [mm], and azimuth of one of them. [rad]

        >>> a = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
        >>> made = TripMap(a, 0.01 + 0.002 * np.cos(3 * a), 0.0 * a, None, ())
        >>> tuple(round(value, 6) for value in made.lobes(made.trip))
        (0.002, 0.0)
        """
        known = np.isfinite(values)
        angle = _LOBES * self.azimuth[known]
        columns = np.stack([np.ones(len(angle)), np.cos(angle), np.sin(angle)], axis=1)
        _, even, odd = np.linalg.lstsq(columns, values[known], rcond=None)[0].tolist()
        return math.hypot(even, odd), math.atan2(odd, even) / _LOBES

    @property
    def sentence(self) -> str:
        """What the way back says, in one line; empty without it."""
        found = self.hysteresis[np.isfinite(self.hysteresis)] / MICROMETRE
        if not len(found):
            return ""
        trip, own = (self.lobes(values) for values in (self.trip, self.hysteresis))
        apart = math.remainder(own[1] - trip[1], 2.0 * math.pi / _LOBES) / DEGREE
        return (
            f"trip minus un-trip (hysteresis) {found.min():.1f} to {found.max():.1f} µm, mean "
            f"{found.mean():.1f} µm; its three lobes of {own[0] / MICROMETRE:.1f} µm are "
            f"{abs(apart):.0f}° from those of the trip ({trip[0] / MICROMETRE:.1f} µm)"
        )


def read_trip_map(source: Source, units: str | None = None) -> TripMap:
    r"""Read a table of trips, and un-trips, over the angle in a ring.

    Parameters
    ----------
    source : str, Path or SourceFile
        A column of angles in degrees; trip and untrip, lengths or each with x and y.
    units : str, optional
        Of lengths whose columns state none: mm or inch.

    Raises
    ------
    InputError
        No such columns; a unit that is not stated; text in place of numbers, with the line.

    >>> text = b"KP-3\nangle_deg,trip_um,untrip_um\n0,46,30\n120,40,31\n240,44,29\n"
    >>> found = read_trip_map(SourceFile("trip.csv", text))
    >>> found.trip.round(6).tolist(), found.hysteresis.round(6).tolist()
    ([0.046, 0.04, 0.044], [0.016, 0.009, 0.015])
    """
    file = opened(source)
    lines = file.lines("a trip map")
    start, columns, names = _header_of(lines)
    if start < 0:
        raise file.error("no header with an angle and a trip was found")
    separator = _separator(lines[start])
    rows, numbers = [], []
    for number, line in enumerate(lines[start + 1 :], start=start + 2):
        cells = [cell.strip() for cell in line.split(separator)]
        if not any(cells):
            continue
        if len(cells) < len(names):
            raise file.error(f"{len(cells)} cells; the header has {len(names)} columns", number)
        picked = [cells[place] for place in columns.values()]
        if separator == ";":
            picked = [cell.replace(",", ".") for cell in picked]
        rows.append(file.numbers(picked, number))
        numbers.append(number)
    if not rows:
        raise file.error("the trip map has no rows", start + 1)
    values = dict(zip(columns, np.array(rows, dtype=np.float64).T, strict=True))
    for what, place in columns.items():
        if what != "angle":
            values[what] = values[what] * _scale(file, names[place], units, start + 1)
    nothing = np.full(len(rows), math.nan)
    return TripMap(
        azimuth=frozen(values["angle"] * DEGREE),
        trip=frozen(_along(values, "trip", nothing)),
        untrip=frozen(_along(values, "untrip", nothing)),
        positions=(
            frozen(np.stack([values["trip x"], values["trip y"]], axis=1))
            if "trip x" in values
            else None
        ),
        lines=tuple(numbers),
    )


def _along(values: dict[str, FloatArray], what: str, nothing: FloatArray) -> FloatArray:
    """A length, or the part of a position along its angle."""
    if what in values:
        return values[what]
    if f"{what} x" not in values or f"{what} y" not in values:
        return nothing
    angle = values["angle"] * DEGREE
    return np.asarray(values[f"{what} x"] * np.cos(angle) + values[f"{what} y"] * np.sin(angle))


def _separator(line: str) -> str:
    return next((sign for sign in _SEPARATORS if sign in line), ",")


def _header_of(lines: Sequence[str]) -> tuple[int, dict[str, int], list[str]]:
    """Number of the header's line from 0, its columns, all its names; -1 where there is none."""
    for number, line in enumerate(lines[:_MOST_TITLES]):
        names = [cell.strip().strip('"') for cell in line.split(_separator(line))]
        found: dict[str, int] = {}
        for place, name in enumerate(names):
            if what := _meaning(name):
                found.setdefault(what, place)
        if "angle" in found and ("trip" in found or {"trip x", "trip y"} <= set(found)):
            return number, found, names
    return -1, {}, []


def _meaning(name: str) -> str:
    """angle, trip, untrip, and x or y of these; empty for others."""
    if len(name) > 60:
        return ""
    plain = re.sub(r"[\[(].*", "", name.lower()).strip()
    words = re.sub(r"un[ -]trip", "untrip", plain.replace("_", " ")).split()
    if words and words[0] in _ANGLES:
        return "angle"
    kind = next((word for word in words if word in ("trip", "untrip")), "")
    axis = next((word for word in words if word in ("x", "y")), "")
    return f"{kind} {axis}".strip() if kind else ""


def _scale(file: SourceFile, name: str, units: str | None, line: int) -> float:
    own = column_name(f"x {name}").unit or unit_of(name.replace("]", "").rpartition("[")[2])
    own = own or unit_of(re.split(r"[ _(]", name.strip(" )"))[-1])
    if own in LENGTH_UNITS:
        refuse_contradicted_unit(file, own, units, line)
        return LENGTH_UNITS[own]
    if units is None:
        raise file.error(
            f"the column {name} does not give its unit of length, such as trip_um or trip [in]",
            line,
            inputs=("units",),
        )
    return LENGTH_UNITS[units]


def _is_trip_map(lines: list[str]) -> bool:
    return _header_of(lines)[0] >= 0


def _touches(file: SourceFile, options: ReadingOptions) -> FileReadings:
    """Touches in the ring: at the trips, with the pretravel beyond the wall."""
    found = read_trip_map(file, options.units)
    if not options.ring or options.reference_diameter is None or options.tip_radius is None:
        raise file.error(
            "a trip map is of a ring: qualify and verify make touches of it, with the diameters of "
            "ring and tip",
            inputs=("ring", "diameter", "tip_diameter"),
        )
    outward = np.stack([np.cos(found.azimuth), np.sin(found.azimuth)], axis=1)
    free = 0.5 * options.reference_diameter - options.tip_radius
    how = "trips as positions"
    if found.positions is not None:
        # The origin of the machine's axes need not be the middle of the ring.
        middle = fit_sphere(found.positions).center
        from_middle = np.sum((found.positions - middle) * outward, axis=1)
    else:
        inside = bool(np.nanmax(np.abs(found.trip)) < _LONGEST)
        from_middle = found.trip + (free if inside else 0.0)
        how = "trips beyond the wall" if inside else "trips as distances from the middle"
    if not np.all(np.abs(from_middle - free) < _LONGEST):
        row = int(np.argmax(np.abs(from_middle - free)))
        raise file.error(
            f"the trip is {from_middle[row]:.3f} mm from the middle of the ring; with these "
            f"diameters the wall is met at {free:.3f} mm: check unit and diameters",
            found.lines[row],
            inputs=("diameter", "tip_diameter", "units"),
        )
    at = outward * from_middle[:, None] if found.positions is None else found.positions
    flat = np.zeros((len(at), 1))
    with file.named_in_errors(found.lines):
        touches = Touches(
            positions=np.hstack([at, flat]),
            normals=np.hstack([-outward, flat]),
            labels=tuple(f"{angle / DEGREE:.6g}" for angle in found.azimuth),
            source=file.name,
            lines=found.lines,
            reading="; ".join(filter(None, [f"{len(at)} {how}", found.sentence])),
        )
    return FileReadings(touches, tip_radius=options.tip_radius, warnings=_not_read(file))


def _not_read(file: SourceFile) -> tuple[str, ...]:
    """Sentences about what lines above the table, and other columns, state."""
    lines = file.lines("a trip map")
    start, columns, names = _header_of(lines)
    stated = StatedRows(file)
    for number, line in enumerate(lines[:start], start=1):
        stated.note(line.strip(), number)
    others = [name for place, name in enumerate(names) if place not in columns.values() and name]
    named = (f"columns that are not read: {', '.join(others)}",) if others else ()
    return (*stated.warnings(), *named)


TRIP_MAP = FileFormat(
    name="trip-map",
    what="trip map of Centroid's ProbeApp: angle, trip and un-trip in a ring",
    reads="touches",
    needs="diameters of ring and tip; units",
    verified="the public description of what it contains, and a published picture; no file of a "
    "control: columns are found by their names",
    recognises=_is_trip_map,
    parse=_touches,
)
