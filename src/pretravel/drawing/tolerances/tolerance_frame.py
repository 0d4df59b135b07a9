"""A tolerance frame of a drawing, its feature, and the frame of its datums (ISO 1101, ISO 5459)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import (
    COORDINATE,
    DISTANCE,
    FloatArray,
    IntArray,
    Placement,
    PretravelError,
    checked,
)
from pretravel.drawing.features.conformity import Conformity, ConformityVerdict
from pretravel.drawing.features.form_of_part import NO_FORM
from pretravel.drawing.features.measured_feature import BARE_SURFACE, MeasuredFeature, Quantity
from pretravel.drawing.tolerances.datum_system import (
    DatumFeature,
    DatumSystem,
    datum_system,
)
from pretravel.measurement import OUT_OF_PLANE
from pretravel.surface import Part, face_triangles, feet_on_faces

POSITION, PROFILE = "position", "profile"
COAXIALITY, CONCENTRICITY, SYMMETRY = "coaxiality", "concentricity", "symmetry"
PARALLELISM, PERPENDICULARITY, ANGULARITY = "parallelism", "perpendicularity", "angularity"
RUN_OUT, TOTAL_RUN_OUT = "run-out", "total run-out"
ROUNDNESS, FLATNESS, CYLINDRICITY = "roundness", "flatness", "cylindricity"
FORM_KINDS = (ROUNDNESS, FLATNESS, CYLINDRICITY)
TOLERANCE_KINDS = (
    POSITION, PROFILE, COAXIALITY, CONCENTRICITY, SYMMETRY, PARALLELISM, PERPENDICULARITY,
    ANGULARITY, RUN_OUT, TOTAL_RUN_OUT, *FORM_KINDS,
)  # fmt: skip
"""The tolerances to datums, by name, and those of form, which have none; the roundness of a
cylinder or cone is that of its sections."""
ORIENTATION = (PARALLELISM, PERPENDICULARITY, ANGULARITY)
TO_AXIS = (COAXIALITY, CONCENTRICITY, SYMMETRY, RUN_OUT, TOTAL_RUN_OUT)
MAXIMUM, LEAST = "M", "L"
"""Material conditions of ISO 2692."""
_WITH_FORM = {
    ROUNDNESS: ("cylinder", "cone", "bore", "boss", "circle"),
    CYLINDRICITY: ("cylinder",),
    FLATNESS: ("plane",),
}
ROUNDS = 6
NO_MOTION = 1e-4
"""Of distances by a unit motion: less is rounding, or the error of a measured direction, by which
a shift of metres would take up any distance."""
_FLAT = ("plane", "slot", "line")
_OTHER_DIRECTION = 0.5  # rad: a feature that is turned by more is another one
_NO_DIRECTION = 1e-9  # size below which what is left of a unit vector is rounding
_SMALL_TURN = 1e-7  # rad: a fit that turns the frame by more is repeated from there


@dataclass(frozen=True)
class GeometricTolerance:
    """A tolerance frame of a drawing.

    Attributes
    ----------
    kind : str
        Of `TOLERANCE_KINDS`.
    zone : float
        Width or diameter of the zone. [mm]
    datums : tuple of str
        In the order of the frame; "A-B" is a common datum, "B(M)" one at maximum material.
    material : str
        "M" or "L" where the tolerance grows with the departure of the feature from its maximum or
        least material size (ISO 2692).
    offset : float
        Of the middle of a profile's zone out of the material: UZ of ISO 1101. [mm]
    between : pair of float or None
        Of a projected zone: its ends on the axis from the nominal point. [mm]
    instead_of : str
        Requirement of the drawing in words, if this tolerance is stricter. A feature that fails the
        stricter tolerance may still conform, so that nothing is decided.
    remark : str
        Conditions of the measurement on the drawing, such as the free state; reports repeat them.
    tangent : bool
        The tolerance applies to the tangent plane outside the material (T of ISO 1101 and ASME
        Y14.5): the form of the surface does not count.
    """

    kind: str
    zone: float
    datums: tuple[str, ...] = ()
    material: str = ""
    offset: float = 0.0
    between: tuple[float, float] | None = None
    instead_of: str = ""
    remark: str = ""
    tangent: bool = False

    def __post_init__(self) -> None:
        if self.kind not in TOLERANCE_KINDS:
            raise PretravelError(
                f"'{self.kind}' is not a tolerance here: {', '.join(TOLERANCE_KINDS)}"
            )
        words: object = self.datums
        if isinstance(words, str):
            raise PretravelError(f"datums are a tuple of their labels, not '{self.datums}'")
        checked(self.zone, "the tolerance", DISTANCE)
        if self.material not in ("", MAXIMUM, LEAST):
            raise PretravelError(f"the material condition is M or L, not '{self.material}'")
        if self.material and self.kind not in (
            POSITION, COAXIALITY, SYMMETRY, PARALLELISM, PERPENDICULARITY, ANGULARITY
        ):  # fmt: skip
            raise PretravelError(f"a {self.kind} has no material condition")
        if self.zone == 0.0 and not self.material:
            raise PretravelError(
                f"the tolerance of a {self.kind} is 0 mm, which only a tolerance at maximum or "
                "least material (M, L) can be"
            )
        if not self.datums and self.kind not in (POSITION, PROFILE, *FORM_KINDS):
            raise PretravelError(f"a {self.kind} needs a datum")
        if self.datums and self.kind in FORM_KINDS:
            raise PretravelError(f"a {self.kind} has no datum")
        if self.tangent and self.kind not in ORIENTATION:
            raise PretravelError(
                f"a tangent plane has a parallelism, perpendicularity or angularity, no {self.kind}"
            )
        checked(self.offset, "the offset of the zone", COORDINATE)
        if self.offset and self.kind != PROFILE:
            raise PretravelError(
                f"the zone of a {self.kind} has no offset; only the zone of a profile has one"
            )
        if self.between is not None and (
            self.kind not in (POSITION, *ORIENTATION) or self.between[0] == self.between[1]
        ):
            raise PretravelError(
                "only a position or an orientation has a projected zone, between two places on "
                f"the axis; this one is a {self.kind} between {self.between[0]:g} and "
                f"{self.between[1]:g} mm"
            )

    @property
    def name(self) -> str:
        """As in a report: ``position to A|B|C (M)``."""
        to = f" to {'|'.join(self.datums)}" if self.datums else ""
        signs = f" ({self.material})" if self.material else ""
        signs += " (T)" if self.tangent else ""
        signs += f" (UZ {self.offset:+.4g})" if self.offset else ""
        signs += f" (P {abs(self.between[1] - self.between[0]):.4g})" if self.between else ""
        stricter = f", for {self.instead_of}" if self.instead_of else ""
        return f"{self.kind}{signs}{to}{stricter}"


@dataclass(frozen=True, eq=False)
class PlacedFeature:
    """A measured feature with its nominal place, as the drawing has it.

    Attributes
    ----------
    feature : MeasuredFeature
    point : (3,) float or None
        Nominal. [mm]
    direction : (3,) float or None
        Nominal axis, or outward normal.
    size : float or None
        Nominal diameter. [mm]
    limits : pair of float or None
        Of the size. [mm]
    part : Part or None
        Whose faces are the nominal surface of a profile.
    """

    feature: MeasuredFeature
    point: FloatArray | None = None
    direction: FloatArray | None = None
    size: float | None = None
    limits: tuple[float, float] | None = None
    part: Part | None = None

    @property
    def label(self) -> str:
        return self.feature.label or self.feature.kind

    def needed(self, what: str) -> FloatArray:
        """Its nominal point or direction.

        Raises
        ------
        PretravelError
            It has none.
        """
        value = self.point if what == "point" else self.direction
        if value is None:
            key = "at_mm" if what == "point" else "axis"
            raise PretravelError(
                f"{self.label}: the tolerance needs its nominal {what}: give {key}, or the part "
                "on whose faces the points lie"
            )
        return value


@dataclass(frozen=True, eq=False)
class GeometricResult:
    """A feature, or a pattern of features, compared with a tolerance to datums.

    Attributes
    ----------
    labels : tuple of str
    tolerance : GeometricTolerance
    quantity : Quantity
    conformity : Conformity
    bonus : float
        By which the material condition enlarges the tolerance. [mm]
    free : int
        Number of motions that the datums left, and that were fitted.
    remarks : tuple of str
    """

    labels: tuple[str, ...]
    tolerance: GeometricTolerance
    quantity: Quantity
    conformity: Conformity
    bonus: float = 0.0
    free: int = 0
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class DatumWord:
    """Features of one datum, and whether it is at maximum material."""

    features: tuple[PlacedFeature, ...]
    at_maximum: bool


@dataclass(frozen=True, eq=False)
class Frame:
    """The frame of a tolerance, with the nominal place of the toleranced feature in it."""

    system: DatumSystem
    point: FloatArray  # in the frame of the points
    direction: FloatArray | None

    def moved(self, rows: FloatArray, change: FloatArray) -> tuple[Frame, bool]:
        """After the free motion that explains a change of distances, and whether it matters.

        `rows` are the changes of the distances by the six motions of the frame.
        """
        free = self.system.free
        u, size, v = np.linalg.svd(rows @ free, full_matrices=False)
        moves = size > NO_MOTION
        if not moves.any():
            return self, False
        motion = free @ (v[moves].T @ ((u[:, moves].T @ change) / size[moves]))
        # As a screw, whose axis stays: what a datum holds stays there after a finite turn, too.
        shift, turn = motion[:3], motion[3:]
        square = max(float(turn @ turn), 1e-300)
        along = np.append(turn * float(turn @ shift) / square, turn)
        screw = (along, np.cross(turn, shift) / square) if turn.any() else (motion,)
        after = replace(self.system, placement=self.system.placement.moved(*screw))
        step = Placement().moved(*screw)
        turned = None if self.direction is None else step.vectors(self.direction[None])[0]
        there = Frame(after, step.points(self.point[None])[0], turned)
        return there, float(np.linalg.norm(motion[3:])) > _SMALL_TURN


def frame_of(
    placed: PlacedFeature, tolerance: GeometricTolerance, groups: Sequence[DatumWord]
) -> Frame:
    """The frame of the datums of a tolerance, with the nominal place of a feature in it.

    Raises
    ------
    PretravelError
        A nominal place that is missing, or datums that do not suit the tolerance.
    """
    if tolerance.kind in TO_AXIS:
        return _frame_of_axis(placed, tolerance, groups)
    if tolerance.kind in FORM_KINDS:
        return _frame_of_form(placed, tolerance)
    if tolerance.kind in ORIENTATION and len(groups) == 1 and len(groups[0].features) == 1:
        (datum,) = groups[0].features
        if datum.feature.kind != BARE_SURFACE:
            return _frame_of_direction(placed, tolerance, datum)
    system = datum_system([[_nominal(one) for one in group.features] for group in groups])
    place = system.placement
    kind = tolerance.kind
    needs_point = kind == POSITION or (kind == PROFILE and placed.part is None)
    point = placed.needed("point") if needs_point else np.zeros(3)
    direction = placed.direction
    measured = placed.feature.association
    needs = kind in ORIENTATION or measured.direction_rows is not None
    if direction is None and needs and not (kind == PROFILE and placed.part is not None):
        direction = placed.needed("direction")
    if direction is None:
        direction = measured.direction
        turned = direction
    else:
        turned = place.vectors(direction[None])[0]
    return Frame(system, place.points(point[None])[0], turned)


def own_faces(placed: PlacedFeature) -> IntArray | None:
    """The faces of the points, as indices of the part's, where the points state them."""
    numbers, part = placed.feature.points.face, placed.part
    if numbers is None or part is None:
        return None
    index = {face.number: i for i, face in enumerate(part.faces)}
    if any(int(number) not in index for number in numbers):
        return None
    return np.array([index[int(number)] for number in numbers])


def _touched_places(placed: PlacedFeature) -> DatumFeature:
    """A surface as a datum: each touch is a parameter, which moves along the normal beneath it."""
    feature, points = placed.feature, placed.feature.points
    if placed.part is not None:
        local = feet_on_faces(placed.part, points.positions, own_faces(placed)).local
        nominal, normals = local.point, local.normal
    elif points.deviation is not None:
        normals = points.normals
        nominal = points.positions - points.deviation[:, None] * normals
    else:
        raise PretravelError(
            f"datum {placed.label} consists of touched places: give the part with its faces, or "
            "points that align has written"
        )
    count = len(points)
    found = replace(feature.association, jacobian=-np.eye(count), point_rows=np.zeros((3, count)))
    errors = replace(feature.errors, association=found)
    if points.state_uncertainty:  # the touched places are the datum: their form is no error of it
        errors = replace(errors, form=NO_FORM)
    return DatumFeature(replace(feature, association=found, errors=errors), nominal, normals)


def _nominal(placed: PlacedFeature) -> DatumFeature:
    if placed.feature.kind == BARE_SURFACE:
        return _touched_places(placed)
    found = placed.feature.association
    direction = placed.direction
    if direction is None and found.direction_rows is not None:
        direction = placed.needed("direction")
    return DatumFeature(placed.feature, placed.needed("point"), direction, _middle(placed))


def _middle(placed: PlacedFeature) -> FloatArray | None:
    """The middle of the area of a plane's faces, where the part and the faces are known. [mm]"""
    own = own_faces(placed)
    if placed.feature.kind != "plane" or placed.part is None or own is None:
        return None
    shown = [face_triangles(placed.part.faces[index]) for index in np.unique(own)]
    corners = np.concatenate([each.points[each.corners] for each in shown])
    sides = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return np.asarray(area @ corners.mean(axis=1) / area.sum())


def _frame_of_axis(
    placed: PlacedFeature, tolerance: GeometricTolerance, groups: Sequence[DatumWord]
) -> Frame:
    """The datum is the place itself: an axis, a centre or a median plane, wherever it is."""
    if not groups or len(groups) > 2:
        raise PretravelError(f"a {tolerance.kind} has one datum, or an axis and a plane")
    first = [one.feature for one in groups[0].features]
    own = [DatumFeature.as_measured(each) for each in first]
    point, direction = first[0].association.point, first[0].association.direction
    nominal = groups[0].features[0].direction
    if direction is not None and first[0].association.direction_rows is None:
        direction = direction if nominal is None else nominal  # touches do not show it
    if tolerance.kind != SYMMETRY and _is_flat(first[0]):
        point = _axis_across(first[0], tolerance, groups[1:])
    if len(first) > 1:  # a common axis
        places = np.array([each.association.point for each in first])
        middle = places.mean(axis=0)
        extent = np.linalg.svd(places - middle)[2][0]
        direction = extent if direction is None or extent @ direction > 0.0 else -extent
        point = middle
        own = [
            DatumFeature(each, middle + ((place - middle) @ extent) * extent, direction)
            for each, place in zip(first, places, strict=True)
        ]
    more = [[DatumFeature.as_measured(one.feature) for one in group.features]
            for group in groups[1:]]  # fmt: skip
    _refuse_other_direction(placed, tolerance, first[0], direction)
    if len(first) == 1:
        _refuse_no_direction(placed, tolerance, groups[0].features[0])
    system = datum_system([own, *more])
    place = system.placement
    turned = None if direction is None else place.vectors(direction[None])[0]
    return Frame(system, place.points(point[None])[0], turned)


def _is_flat(feature: MeasuredFeature) -> bool:
    return feature.kind in _FLAT


def _axis_across(
    plane: MeasuredFeature, tolerance: GeometricTolerance, more: Sequence[DatumWord]
) -> FloatArray:
    """Where the second datum has its middle: the axis is there, across the plane before it."""
    axis = next((one.feature for group in more for one in group.features), plane)
    if _is_flat(axis) or axis.kind == BARE_SURFACE:
        raise PretravelError(
            f"a {tolerance.kind} needs a datum with an axis or a centre, and {plane.label} is a "
            f"{plane.kind}"
        )
    found = axis.association
    if found.direction is None:
        return found.point
    along = float((found.points.mean(axis=0) - found.point) @ found.direction)
    return np.asarray(found.point + along * found.direction)


def _refuse_other_direction(
    placed: PlacedFeature,
    tolerance: GeometricTolerance,
    datum: MeasuredFeature,
    direction: FloatArray | None,
) -> None:
    """Refuse a feature whose direction cannot be that of its datum."""
    own = placed.feature.association.direction
    if direction is None or own is None:
        return
    along = tolerance.kind != SYMMETRY or _is_flat(placed.feature) == _is_flat(datum)
    turned = math.acos(min(abs(float(own @ direction)), 1.0))
    if (turned if along else 0.5 * math.pi - turned) > _OTHER_DIRECTION:
        raise PretravelError(
            f"{placed.label} is {math.degrees(turned):.0f}° from datum {datum.label}: a tolerance "
            f"of {tolerance.kind} does not fit this angle"
        )


def _refuse_no_direction(
    placed: PlacedFeature, tolerance: GeometricTolerance, datum: PlacedFeature
) -> None:
    """Refuse an axis that the datum does not show, where the tolerance lies away from it."""
    found, own = datum.feature.association, placed.feature.association
    if found.direction_rows is not None:
        return
    runs = tolerance.kind in (RUN_OUT, TOTAL_RUN_OUT)
    if found.direction is None:
        if runs or own.direction_rows is not None:
            raise PretravelError(
                f"a {tolerance.kind} of {placed.label} needs a datum with an axis, and "
                f"{datum.label} is a {datum.feature.kind}"
            )
        return
    if datum.direction is not None or tolerance.kind == SYMMETRY:
        return
    away = float(np.abs((own.points - found.point) @ found.direction).max())
    if away > OUT_OF_PLANE * 0.5 * (found.diameter or 0.0) or _is_flat(placed.feature):
        raise PretravelError(
            f"{datum.label} is a {datum.feature.kind}: its points do not show the direction of its "
            f"axis, on which the {tolerance.kind} of {placed.label} depends. Measure it as a "
            "cylinder, or give its axis"
        )


def _frame_of_form(placed: PlacedFeature, tolerance: GeometricTolerance) -> Frame:
    """The feature itself: the zone of a form lies as it fits best."""
    own = placed.feature.association
    if placed.feature.kind not in _WITH_FORM[tolerance.kind] or own.direction is None:
        raise PretravelError(
            f"{placed.label}: a {tolerance.kind} applies to a "
            f"{' or '.join(_WITH_FORM[tolerance.kind])}, not to a {placed.feature.kind}"
        )
    return Frame(datum_system(()), own.point, own.direction)


def _frame_of_direction(
    placed: PlacedFeature, tolerance: GeometricTolerance, datum: PlacedFeature
) -> Frame:
    """A direction parallel to a single datum, across it, or at the nominal angle to it."""
    found, own = datum.feature.association, placed.feature.association
    if found.direction is None or found.direction_rows is None:
        raise PretravelError(f"datum {datum.label} has no direction that its points determine")
    if own.direction is None:
        raise PretravelError(f"a {placed.feature.kind} has no direction")
    if tolerance.kind == ANGULARITY:
        nominal = DatumFeature(datum.feature, found.point, datum.needed("direction"))
        system = datum_system([[nominal]])
        turned = system.placement.vectors(placed.needed("direction")[None])[0]
        return Frame(system, own.point, turned)
    system = datum_system([[DatumFeature.as_measured(datum.feature)]])
    normal = [_is_flat(each) for each in (placed.feature, datum.feature)]
    along = (tolerance.kind == PARALLELISM) == (normal[0] == normal[1])
    cosine = float(own.direction @ found.direction)
    if along:
        direction = math.copysign(1.0, cosine) * found.direction
    else:
        flat = own.direction - cosine * found.direction
        size = float(np.linalg.norm(flat))
        # Along the datum's direction only rounding is left, which has no direction.
        direction = flat / size if size > _NO_DIRECTION else np.zeros(3)
    if abs(float(direction @ own.direction)) < math.cos(_OTHER_DIRECTION):
        raise PretravelError(
            f"{placed.label} is {math.degrees(math.acos(min(abs(cosine), 1.0))):.0f}° from "
            f"datum {datum.label}: a tolerance of {tolerance.kind} does not fit this angle"
        )
    return Frame(system, own.point, direction)


def stricter_verdict(conformity: Conformity, tolerance: GeometricTolerance) -> Conformity:
    """The decision about what the drawing asks, where it was made by a stricter tolerance.

    What conforms to the stricter one conforms; what does not may still conform.

    Parameters
    ----------
    conformity : Conformity
        Of the stricter tolerance.
    tolerance : GeometricTolerance
    """
    fails = conformity.verdict is ConformityVerdict.DOES_NOT_CONFORM
    if not tolerance.instead_of or not fails:
        return conformity
    return replace(conformity, verdict=ConformityVerdict.UNDECIDED, probability=math.nan)


def independent_columns(columns: FloatArray) -> FloatArray:
    """The same space in independent columns; none where nothing moves."""
    found = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(found[0][:, found[1] > NO_MOTION], dtype=np.float64)
