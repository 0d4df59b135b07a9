"""Listings of a CMM's software: features with their results and their points; reading.

A feature begins with a line such as ``CIRCLE CR4 CART MCS MM ANGDEC``. Its results follow, one a
line (X, Y, Z, I, J, K, D; forms such as Cirlty and Flat), then its points with their deviations,
and a line ``Max error = … at Point …``. Columns are apart by blanks or commas.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

import numpy as np

from pretravel.base import INCH, FloatArray
from pretravel.files.file_format import (
    FeatureResult,
    FileFormat,
    FileReadings,
    ReadingOptions,
    refuse_contradicted_unit,
)
from pretravel.files.logs.dmis import checked_radius_taken_off, with_unit_normals
from pretravel.files.source_file import Source, SourceFile, opened, shortened
from pretravel.touches import Touches

_POINTS_HEAD = ["PtNo", "X", "Y", "Z", "DX", "DY", "DZ", "DEV"]
_UNITS = {"MM": 1.0, "IN": 25.4, "INCH": 25.4, "INCHES": 25.4}
_ROUND = ("CIRCLE", "CYLINDER", "SPHERE")
"""Kinds that can be touched from inside or from outside; the listing does not state which."""
_WITH_NORMALS = (*_ROUND, "PLANE")
_LENGTHS = ("X", "Y", "Z", "D", "R", "L", "W", "H")
_DIRECTIONS = ("I", "J", "K")
_RULE = re.compile(r"[_\-=*]{5,}")
_BAR = re.compile(r"[-+*#<>]{3,}")
"""The bar that shows a deviation in its tolerance."""
_MOST_DIGITS = 9
_ROUNDINGS = 6.0
"""Roundings, half of the last digit each, by which a point and its deviation differ at most: √3 of
the point, √3 of the centre, 1/2 of the diameter and 1 of the deviation are 5."""


@dataclass(eq=False)
class ListedFeature:
    """One feature of a listing, as the CMM's software states it. Lengths are in mm.

    Attributes
    ----------
    kind, name : str
        Such as CIRCLE and CR4.
    system : str
        Coordinates: MCS are those of the machine.
    line : int
    results : list of FeatureResult
        Of the CMM's software: its diameter, centre and form.
    numbers : list of int
        Of the points.
    points : list of 3 floats
        On the surface, or tip centres: the listing does not state which. [mm]
    deviations : list of float
        Along the normal, as stated. [mm]
    lines : list of int
        Of the points.
    decimals : int
        The most that its numbers have.
    """

    kind: str
    name: str
    system: str
    line: int
    scale: float = 1.0
    results: list[FeatureResult] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    points: list[list[float]] = field(default_factory=list)
    deviations: list[float] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    decimals: int = 0

    def actual(self, *quantities: str) -> FloatArray:
        """The stated values of quantities; not a number where one is not stated."""
        found = {result.quantity: result.actual for result in self.results}
        return np.array([found.get(name, np.nan) for name in quantities])


def read_cmm_listing(source: Source) -> list[ListedFeature]:
    r"""Read the features of a listing: the results that it states, and the points of each.

    Parameters
    ----------
    source : str, Path or SourceFile

    Raises
    ------
    InputError
        A line that is none of a listing, is cut off or contradicts another: a deviation that is
        not the actual value minus the nominal one, a point that is not where its deviation puts it.
        The message contains the line.

    >>> text = (
    ...     b"PLANE PL1 CART MCS MM ANGDEC\nX 0 0 0\nY 0 0 0\nZ 5 5 0\nI 0 0 0\nJ 0 0 0\nK 1 1 0\n"
    ...     b"PtNo X Y Z DX DY DZ DEV\n1 3 4 5.001 0 0 0.001 0.001\nMax error = 0.001 at Point 1\n")
    >>> plane = read_cmm_listing(SourceFile("a.txt", text))[0]
    >>> plane.name, plane.points, plane.deviations, plane.results[2].actual
    ('PL1', [[3.0, 4.0, 5.001]], [0.001], 5.0)
    """
    file = opened(source)
    listing = _Listing(file)
    for number, text in enumerate(file.lines("a listing of a CMM"), start=1):
        cells = _cells_of(text)
        if cells:
            listing.take(cells, number)
    listing.close()
    if not listing.features:
        raise file.error(
            "the file contains no feature of a listing (a line such as CIRCLE CR4 CART MCS MM)"
        )
    for feature in listing.features:
        _check_points(file, feature)
    return listing.features


def _cells_of(text: str) -> list[str]:
    """Words of a line, without commas, quotes and blanks between them."""
    return [cell for cell in re.split(r"[\s,;\"]+", text.replace("\ufeff", "")) if cell]


def _is_head(cells: Sequence[str]) -> bool:
    """Whether cells begin a feature: CIRCLE CR4 CART MCS MM."""
    return (
        len(cells) >= 5
        and cells[0].isalpha()
        and cells[0].isupper()
        and cells[2].isalpha()
        and cells[2][:3] in ("CAR", "POL", "CYL", "SPH")
        and cells[4] in _UNITS
    )


class _Listing:
    """What the lines of a listing have stated so far."""

    def __init__(self, file: SourceFile) -> None:
        self.file = file
        self.features: list[ListedFeature] = []
        self.in_points = False
        self.ended = True

    def take(self, cells: list[str], number: int) -> None:
        """Add one line."""
        if _is_head(cells):
            self.close()
            self._begin(cells, number)
        elif not self.features:
            raise self.file.error(
                f"'{shortened(' '.join(cells))}' comes before the first feature (such as CIRCLE "
                "CR4 CART MCS MM); leave this line out of the file",
                number,
            )
        elif len(cells) == 1 and _RULE.fullmatch(cells[0]):
            self.close()
        elif cells == _POINTS_HEAD and not self.ended:
            self.in_points = True
        elif cells[:3] == ["Max", "error", "="]:
            self._end(cells, number)
        elif self.ended:
            raise self._unknown(cells, number)
        elif self.in_points:
            self._take_point(cells, number)
        else:
            self._take_result(cells, number)

    def close(self) -> None:
        """The feature whose lines have ended has its points."""
        if self.ended:
            return
        feature = self.features[-1]
        raise self.file.error(
            f"the feature {feature.name} is cut off: after its points, a line 'Max error = … at "
            "Point …' is needed",
            feature.line,
        )

    def _begin(self, cells: list[str], number: int) -> None:
        kind, name, coordinates, system, unit = cells[:5]
        if coordinates != "CART":
            raise self.file.error(
                f"the feature {name} has coordinates {coordinates}; CART is read", number
            )
        if any(feature.name == name for feature in self.features):
            raise self.file.error(f"the feature {name} occurs twice", number)
        if self.features and self.features[0].system != system:
            raise self.file.error(
                f"the coordinates are of {system} here, and of {self.features[0].system} before: "
                "split the file, so that each has one system",
                number,
            )
        self.features.append(ListedFeature(kind, name, system, number, _UNITS[unit]))
        self.in_points, self.ended = False, False

    def _numbers(self, cells: list[str], number: int) -> list[float]:
        feature = self.features[-1]
        decimals = [len(c.partition(".")[2]) for c in cells if re.fullmatch(r"[-+]?\d*\.\d+", c)]
        feature.decimals = max([feature.decimals, *decimals])
        return self.file.numbers(cells, number)

    def _take_result(self, cells: list[str], number: int) -> None:
        """``X nominal actual deviation tolerances bar``; ``Flat actual deviation tolerance``."""
        quantity = cells[0]
        shown = cells[1:-1] if _BAR.fullmatch(cells[-1]) else cells[1:]
        if not quantity.isalpha() or len(shown) < 3:
            raise self._unknown(cells, number)
        first, second, third, *_ = self._numbers(shown, number)
        nominal, actual, deviation = first, second, third
        if len(quantity) > 1:  # a form has no nominal value: actual and deviation are one
            nominal, actual, deviation = 0.0, first, second
        last_digit = 2.0 * 10.0 ** -self.features[-1].decimals
        if abs(actual - nominal - deviation) > last_digit:
            raise self.file.error(
                f"the deviation {deviation:g} of {quantity} is not its actual value {actual:g} "
                f"minus the nominal {nominal:g}",
                number,
            )
        if any(result.quantity == quantity for result in self.features[-1].results):
            raise self.file.error(f"the result {quantity} occurs twice", number)
        scale = self._scale_of(quantity, number)
        self.features[-1].results.append(
            FeatureResult(
                0,
                self.features[-1].name,
                quantity,
                scale * nominal,
                scale * actual,
                scale * deviation,
                None,
                number,
            )
        )

    def _scale_of(self, quantity: str, number: int) -> float:
        scale = self.features[-1].scale
        if quantity in _DIRECTIONS or scale == 1.0:
            return 1.0
        if quantity in _LENGTHS or len(quantity) > 1:
            return scale
        raise self.file.error(
            f"'{quantity}' is not known as a length or a direction, so that its unit is not known",
            number,
        )

    def _take_point(self, cells: list[str], number: int) -> None:
        if len(cells) != len(_POINTS_HEAD) or not cells[0].isdecimal():
            raise self.file.error(
                f"a point has a number and {', '.join(_POINTS_HEAD[1:])}; '"
                f"{shortened(' '.join(cells))}' has {len(cells)} values",
                number,
            )
        values = self._numbers(cells[1:], number)
        feature = self.features[-1]
        if len(cells[0]) > _MOST_DIGITS or int(cells[0]) in feature.numbers:
            raise self.file.error(f"the point {shortened(cells[0])} occurs twice", number)
        feature.numbers.append(int(cells[0]))
        feature.points.append([feature.scale * value for value in values[:3]])
        feature.deviations.append(feature.scale * values[6])
        feature.lines.append(number)

    def _end(self, cells: list[str], number: int) -> None:
        feature = self.features[-1]
        if self.ended or not feature.points:
            raise self.file.error("this line ends a feature that has no points", number)
        known = len(cells) == 7 and cells[4:6] == ["at", "Point"] and cells[6].isdecimal()
        if not known or len(cells[6]) > _MOST_DIGITS:
            raise self._unknown(cells, number)
        largest = feature.scale * self.file.numbers(cells[3:4], number)[0]
        if int(cells[6]) not in feature.numbers:
            raise self.file.error(f"the feature {feature.name} has no point {cells[6]}", number)
        stated = feature.deviations[feature.numbers.index(int(cells[6]))]
        if abs(stated - largest) > 2.0 * feature.scale * 10.0**-feature.decimals:
            raise self.file.error(
                f"the largest error {largest:g} mm is not the deviation {stated:g} mm of point "
                f"{cells[6]}",
                number,
            )
        self.ended = True

    def _unknown(self, cells: list[str], number: int) -> Exception:
        return self.file.error(
            f"'{shortened(' '.join(cells))}' is not a line of a listing of features", number
        )


def _check_points(file: SourceFile, feature: ListedFeature) -> None:
    """Refuse points that are not where the stated feature and their deviations put them."""
    distance = _distances(file, feature)
    if distance is None:
        return
    rounding = 0.5 * feature.scale * 10.0**-feature.decimals
    seen = np.array(feature.points) - feature.actual("X", "Y", "Z")
    lever = np.zeros(len(seen))
    if feature.kind != "SPHERE":
        # I, J, K are printed with one rounding each. It turns a plane, and the axis of a cylinder.
        axis = feature.actual(*_DIRECTIONS)
        along = np.abs(seen @ axis)
        lever = np.linalg.norm(seen, axis=1) if feature.kind == "PLANE" else along
    allowed = _ROUNDINGS * rounding + lever * 10.0**-feature.decimals
    off = np.abs(np.abs(distance) - np.abs(feature.deviations))
    if np.any(off > allowed):
        row = int(np.argmax(off - allowed))
        raise file.error(
            f"point {feature.numbers[row]} is {distance[row]:.5f} mm from {feature.name} as the "
            f"listing gives it, but its deviation is {feature.deviations[row]:.5f} mm: are values "
            "missing in this line, or is the feature not of these points?",
            feature.lines[row],
        )


def _distances(file: SourceFile, feature: ListedFeature) -> FloatArray | None:
    """Distances of the points from the stated feature, outward. [mm]; None: kind not known."""
    if feature.kind not in _WITH_NORMALS:
        return None
    normals = _normals(file, feature)
    seen = np.array(feature.points) - feature.actual("X", "Y", "Z")
    radius = 0.5 * feature.actual("D")[0] if feature.kind in _ROUND else 0.0
    return np.asarray(np.sum(seen * normals, axis=1) - radius)


def _normals(file: SourceFile, feature: ListedFeature) -> FloatArray:
    """Normals at the points of a feature, away from its axis or centre, (n, 3)."""
    needed = ["X", "Y", "Z"]
    needed += [] if feature.kind == "SPHERE" else _DIRECTIONS
    needed += ["D"] if feature.kind in _ROUND else []
    if np.isnan(feature.actual(*needed)).any():
        there = ", ".join(result.quantity for result in feature.results)
        raise file.error(
            f"the {feature.kind} {feature.name} needs the results {', '.join(needed)}; it has "
            f"{there or 'none'}",
            feature.line,
        )
    seen = np.array(feature.points) - feature.actual("X", "Y", "Z")
    if feature.kind != "SPHERE":
        vectors = feature.actual(*_DIRECTIONS)[None]
        axis = with_unit_normals(file, vectors, (feature.name,), (feature.line,))[0]
        if feature.kind == "PLANE":
            return np.tile(axis, (len(seen), 1))
        seen = seen - (seen @ axis)[:, None] * axis
    length = np.linalg.norm(seen, axis=1)
    if np.min(length) == 0.0:
        row = int(np.argmin(length))
        raise file.error(
            f"point {feature.numbers[row]} lies on the axis of {feature.name}: it has no normal",
            feature.lines[row],
        )
    return np.asarray(seen / length[:, None])


def listing_touches(file: SourceFile, options: ReadingOptions) -> FileReadings:
    """Touches of a listing: each point of its planes, circles, cylinders and spheres.

    Parameters
    ----------
    file : SourceFile
    options : ReadingOptions
        `radius_taken_off`; `bores` where there are circles, cylinders or spheres.

    Returns
    -------
    FileReadings
        Tip centres; labels are the feature's name and the number of the point, ``CR4-1``.

    Raises
    ------
    InputError
        As `read_cmm_listing`; the radius or the bores are not stated; a name of a bore is none of
        a round feature; no feature has normals.
    """
    features = _listed(file, options)
    used = [feature for feature in features if feature.kind in _WITH_NORMALS and feature.points]
    if not used:
        kinds = ", ".join(f"{feature.kind} {feature.name}" for feature in features[:8])
        raise file.error(
            f"the points of these features ({kinds}) have no normals; points of planes, circles, "
            "cylinders and spheres have. The results can be written as features",
            inputs=("features",),
        )
    radius = checked_radius_taken_off(file, "a listing of a CMM", options.radius_taken_off)
    inside = _inside(file, [f.name for f in used if f.kind in _ROUND], options.bores)
    normals = np.vstack([(-1.0 if f.name in inside else 1.0) * _normals(file, f) for f in used])
    points = np.vstack([np.array(feature.points) for feature in used])
    lines = tuple(line for feature in used for line in feature.lines)
    with file.named_in_errors(lines):
        touches = Touches(
            positions=points + radius * normals,
            normals=normals,
            labels=tuple(f"{f.name}-{number}" for f in used for number in f.numbers),
            source=file.name,
            lines=lines,
        )
    return FileReadings(touches, warnings=_notes_of(features, used))


def _inside(file: SourceFile, names: list[str], bores: tuple[str, ...] | None) -> set[str]:
    """Names of the features that were touched from inside."""
    if not names:
        return set()
    if bores is None:
        raise file.error(
            f"the listing does not say on which side {', '.join(names[:8])} "
            f"{'were' if len(names) > 1 else 'was'} touched, from inside or outside, and the "
            "normals depend on this: give the names of those that were touched from inside, or "
            "none",
            inputs=("bores",),
        )
    for pattern in bores:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise file.error(
                f"'{pattern}' is none of the round features {', '.join(names[:8])}",
                inputs=("bores",),
            )
    return {name for name in names if any(fnmatchcase(name, pattern) for pattern in bores)}


def _notes_of(features: list[ListedFeature], used: list[ListedFeature]) -> tuple[str, ...]:
    notes = []
    others = [f"{f.kind} {f.name}" for f in features if f not in used]
    if others:
        notes.append(f"without points or without normals, and left out: {', '.join(others[:8])}")
    if any(feature.kind == "PLANE" for feature in used):
        notes.append("normals of planes are I, J, K as the listing gives them, taken as outward")
    if features[0].system != "MCS":
        notes.append(
            f"the coordinates are of {features[0].system}, taken as parallel to the machine's axes"
        )
    return tuple(notes)


def _listed_results(file: SourceFile, options: ReadingOptions) -> list[FeatureResult]:
    return [result for feature in _listed(file, options) for result in feature.results]


def _listed(file: SourceFile, options: ReadingOptions) -> list[ListedFeature]:
    """Features whose unit is not contradicted by the options."""
    features = read_cmm_listing(file)
    for feature in features:
        own = "inch" if feature.scale == INCH else "mm"
        refuse_contradicted_unit(file, own, options.units, feature.line)
    return features


def _is_listing(lines: list[str]) -> bool:
    words = [_cells_of(line) for line in lines]
    return any(map(_is_head, words)) and _POINTS_HEAD in words


CMM_LISTING = FileFormat(
    name="cmm-listing",
    what="listing of a CMM: CIRCLE CR4 CART MCS MM …, results, PtNo X Y Z DX DY DZ DEV",
    reads="touches; results of features",
    needs="subtracted radius; bores",
    takes=("radius_taken_off", "bores"),
    verified="one public listing of planes and circles: the deviations of its points follow from "
    "the given features within their last digit",
    recognises=_is_listing,
    parse=listing_touches,
    parse_features=_listed_results,
    other_lines="refused",
)
