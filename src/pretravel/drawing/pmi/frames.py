"""What a tolerance of the PMI is decided as: the same tolerance, or one that is stricter."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from pretravel.drawing.pmi.items import DatumTarget, Size, Tolerance
from pretravel.drawing.pmi.model_faces import ModelFace, triple
from pretravel.drawing.pmi.nominal import lies_on
from pretravel.drawing.tolerances.tolerance_frame import (
    CYLINDRICITY,
    FLATNESS,
    ORIENTATION,
    POSITION,
    PROFILE,
    ROUNDNESS,
    TOLERANCE_KINDS,
)

ROUND_ZONES = (
    "cylindrical or circular", "cylindrical", "circular", "within a cylinder", "within a circle",
)  # fmt: skip
_PLANE_ZONES = ("", "between two parallel planes", "parallel planes", "unknown")
_WITHOUT_SECTIONS = {"plane": "flatness", "cylinder": "cylindricity"}
FORMS = {"flatness": "plane", "cylindricity": "cylinder"}
"""The kind whose form a tolerance of form is."""
_OF_LINES = ("line element", "each radial element", "each element", "any cross section")
_MATERIAL = ("M", "L")
_REMARKS = {"F": "in the free state (F)", "statistical tolerance": "statistical (ST)"}
_TOGETHER = ("CZ", "all around")


_WITHOUT_TOLERANCE = ("theoretical", "auxiliary")
_OTHER_SIZES = (
    "rank order", "circumference diameter", "area diameter", "volume diameter",
    "defined by a sphere", "section", "any part of the feature", "common tolerance",
)  # fmt: skip
"""Sizes of ISO 14405-1 that are not sizes of the whole feature."""


AREA, LINE = 4, 6
"""Numbers of a target: a place and a diameter, or both ends."""
_IN_A_ROW = 0.02  # of the extent of targets: less across it is a row
BY_HAND = "To decide with its whole face, write this feature and the tolerances to it by hand"
"""What can be done about a datum by targets that are not decided."""


class NotStatedError(Exception):
    """Why the file of features cannot state an item."""


@dataclass
class DecidedAs:
    """A tolerance as it is decided.

    Attributes
    ----------
    kind : str
        Of `TOLERANCE_KINDS`.
    datums : tuple of str
        In words of the file.
    material : str
    offset : float
        [mm]
    together : bool
        Whether several surfaces have one zone, or several features are one pattern.
    tangent : bool
        Whether it is of the tangent plane.
    instead_of : list of str
        What makes the decided tolerance the stricter one.
    remarks : list of str
    """

    kind: str
    datums: tuple[str, ...] = ()
    material: str = ""
    offset: float = 0.0
    together: bool = True
    tangent: bool = False
    instead_of: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def decided_as(tolerance: Tolerance, kinds: Collection[str], standard: str) -> DecidedAs:
    """How a tolerance is decided, by its kind and its signs; its datums are added by the caller.

    Parameters
    ----------
    tolerance : Tolerance
    kinds : collection of str
        Of its faces.
    standard : str
        ASME, ISO, or empty where the model does not state one.

    Raises
    ------
    NotStatedError
        A kind or a sign that is not decided, with the reason.
    """
    found = _kind(tolerance, kinds)
    if tolerance.composite:
        found.instead_of.append("the lower segment of a composite frame")
    if tolerance.displacement is not None:
        found.offset = _offset(tolerance, standard)
    left = [sign for sign in tolerance.modifiers if sign not in _TOGETHER]
    for sign in left:
        if sign in _MATERIAL and not found.material:
            found.material = sign
        elif sign == "T" and found.kind in ORIENTATION and set(kinds) == {"plane"}:
            found.tangent = True
        elif sign in _REMARKS:
            found.remarks.append(_REMARKS[sign])
        elif sign == "separate requirement":
            found.together = False
        elif sign in _OF_LINES:
            found.instead_of.append(sign)
        else:
            raise NotStatedError(f"'{sign}' is not decided here")
    if tolerance.place.between and found.kind != PROFILE:
        raise NotStatedError(f"a {tolerance.kind} 'between' is not decided here; a profile is")
    _add_notes(found, tolerance)
    return found


def _kind(tolerance: Tolerance, kinds: Collection[str]) -> DecidedAs:
    own = tolerance.kind
    if own == "line profile":
        return DecidedAs(PROFILE, instead_of=["the profile of each line"])
    if own == "straightness":
        form = {_WITHOUT_SECTIONS.get(kind, "") for kind in kinds}
        if len(form) != 1 or "" in form or tolerance.form in ROUND_ZONES or tolerance.modifiers:
            raise NotStatedError("a straightness of this kind is not decided here")
        return DecidedAs(form.pop(), instead_of=["the straightness of each line"])
    if own not in TOLERANCE_KINDS:
        raise NotStatedError(f"a {own} is not decided here")
    if own in FORMS and set(kinds) - {FORMS[own]}:
        raise NotStatedError(f"the {own} of a {', '.join(kinds)} is not decided here")
    return DecidedAs(own)


def _offset(tolerance: Tolerance, standard: str) -> float:
    """Of the middle of the zone out of the material, of an unequally disposed one. [mm]"""
    assert tolerance.displacement is not None
    assert tolerance.zone is not None
    if tolerance.kind not in ("profile", "line profile"):
        raise NotStatedError(f"an unequally disposed {tolerance.kind} is not decided here")
    if standard == "ISO":
        return tolerance.displacement
    by_asme = round(tolerance.displacement - 0.5 * tolerance.zone, 9)
    if standard == "ASME":
        return by_asme
    raise NotStatedError(
        "the model does not say by which standard it is unequally disposed: offset_mm is "
        f"{by_asme:.10g} by ASME Y14.5 (U, {tolerance.displacement:.10g} mm outside the material), "
        f"{tolerance.displacement:.10g} by ISO 1101 (UZ, middle of the zone)"
    )


def _add_notes(found: DecidedAs, tolerance: Tolerance) -> None:
    """Unit lengths and areas, and the largest value of a tolerance that grows."""
    for note in tolerance.notes:
        unit = note.startswith("on each") or " area" in note
        if unit and found.kind in (FLATNESS, CYLINDRICITY, ROUNDNESS, PROFILE, *ORIENTATION):
            found.instead_of.append(note)
        elif note.startswith("at most") and found.material:
            found.instead_of.append(f"({found.material}) {note}")
            found.material = ""
        else:
            raise NotStatedError(f"'{note}' is not decided here")


def check_zone(found: DecidedAs, tolerance: Tolerance, of_axis: bool) -> None:
    """The zone of an axis is decided as a cylinder, which lies within one between planes.

    Raises
    ------
    NotStatedError
        A zone of another form.
    """
    if not of_axis or found.kind not in (POSITION, *ORIENTATION) or tolerance.form in ROUND_ZONES:
        return
    if tolerance.form not in _PLANE_ZONES:
        raise NotStatedError(
            f"the zone of an axis is decided as a cylinder, not '{tolerance.form}'"
        )
    found.instead_of.append("a zone between planes")


def check_size(size: Size) -> None:
    """Whether the text states a tolerance of a size that is decided.

    Raises
    ------
    NotStatedError
        It does not.
    """
    if size.nominal is None and size.lower is None and size.upper is None:
        raise NotStatedError("the text has no value")
    stated = set(size.notes) & set(_WITHOUT_TOLERANCE)
    if stated:
        raise NotStatedError(f"it has no tolerance: it is {', '.join(sorted(stated))}")
    if size.unclear:
        raise NotStatedError(size.unclear)
    if size.fit and size.lower is None:
        raise NotStatedError(f"give the limits of {size.fit} by ISO 286 as tolerance")
    if size.lower is None and size.upper is None:
        raise NotStatedError("the text has no limits")
    for what, value in (("nominal value", size.nominal), ("upper limit", size.upper)):
        if value is not None and len(size.places) == 1 and not 0.0 < value < math.inf:
            raise NotStatedError(f"its {what} is {value:g} mm, which no size is")
    other = [note for note in size.notes if any(word in note for word in _OTHER_SIZES)]
    if other:
        raise NotStatedError(f"a size as '{other[0]}' is not decided here")


def target_place(letter: str, target: DatumTarget, faces: Sequence[ModelFace]) -> tuple[float, ...]:
    """Place of a datum target and diameter of its area, or both ends of its line. [mm]

    A rectangle has the diameter of the circle in it. A line begins at its placement, along its x
    or else its z axis, where both ends are on the plane then; else its placement is the middle.

    Raises
    ------
    NotStatedError
        A target of another form, or one without a place.
    """
    name = f"target {letter}{target.name.removeprefix(letter)}"
    if target.movable:
        raise NotStatedError(f"its {name} is movable. {BY_HAND}")
    if target.ends:
        return (*target.ends[0], *target.ends[1])
    if target.at is None:
        raise NotStatedError(f"the text gives no place of its {name}")
    sizes = [each.value for each in target.sizes]
    if target.form == "point":
        return (*target.at, 0.0)
    if target.form not in ("line", "circle", "rectangle", "square") or not sizes:
        raise NotStatedError(
            f"its {name} is a {target.form}; points, lines, circles, rectangles are decided. "
            f"{BY_HAND}"
        )
    if any(each.unit != "mm" for each in target.sizes):
        raise NotStatedError(f"the size of its {name} is not in mm")
    if target.form == "line":
        return _ends_of_line(target, sizes[0], faces)
    return (*target.at, min(sizes))


def _ends_of_line(
    target: DatumTarget, length: float, faces: Sequence[ModelFace]
) -> tuple[float, ...]:
    tried = []
    for start in (0.0, -0.5 * length):
        for axis in map(np.array, target.axes):
            first = np.array(target.at) + start * axis
            tried.append((first, first + length * axis))
    on = [pair for pair in tried
          if any(lies_on(pair[0], face) and lies_on(pair[1], face) for face in faces)]  # fmt: skip
    first, last = (on or tried)[0]
    return (*triple(first, 6), *triple(last, 6))


def determine_a_plane(places: Sequence[tuple[float, ...]]) -> bool:
    """Whether targets on a plane show its direction: an area, or three places not in a row."""
    if any(len(each) == AREA and each[3] for each in places):
        return True
    points = np.array([
        each[k : k + 3] for each in places for k in ((0, 3) if len(each) == LINE else (0,))
    ])  # fmt: skip
    if len(points) < 3:
        return False
    size = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(size[1] > _IN_A_ROW * size[0])
