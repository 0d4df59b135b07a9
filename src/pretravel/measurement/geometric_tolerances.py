"""Position, orientation, profile, run-out and coaxiality to datums: ISO 1101, with uncertainty.

Two kinds of zone. That of derived elements (centres, axes, median planes) contains a few located
places, whose errors follow from the parameters of the features. That of a surface contains its
touched points themselves. Motions that the datums leave free are those of the best fit of all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.errors import PretravelError
from pretravel.base.frames import Placement
from pretravel.base.quantities import DISTANCE, checked
from pretravel.measurement.association import associate
from pretravel.measurement.conformity import Conformity, form_conformity, zone_conformity
from pretravel.measurement.datum_system import (
    DatumFeature,
    DatumSystem,
    datum_system,
    moved_by_frame,
    moved_system,
)
from pretravel.measurement.feature_form import FormResult, bounded_form
from pretravel.measurement.feature_uncertainty import (
    MACHINE,
    FeatureErrors,
    covariance_by_source,
    covariance_by_weights,
    dof_of_features,
    noise_of_features,
)
from pretravel.measurement.measured_feature import MeasuredFeature, Quantity
from pretravel.surface.cad.part import Part
from pretravel.surface.search import feet_on_faces
from pretravel.uncertainty.fitting.feature import about_axis, across

POSITION, PROFILE = "position", "profile"
COAXIALITY, CONCENTRICITY, SYMMETRY = "coaxiality", "concentricity", "symmetry"
PARALLELISM, PERPENDICULARITY, ANGULARITY = "parallelism", "perpendicularity", "angularity"
RUN_OUT, TOTAL_RUN_OUT = "run-out", "total run-out"
TOLERANCE_KINDS = (
    POSITION, PROFILE, COAXIALITY, CONCENTRICITY, SYMMETRY, PARALLELISM, PERPENDICULARITY,
    ANGULARITY, RUN_OUT, TOTAL_RUN_OUT,
)  # fmt: skip
"""The tolerances to datums, by name; the form of a feature is a tolerance without datums."""
_ORIENTATION = (PARALLELISM, PERPENDICULARITY, ANGULARITY)
_TO_AXIS = (COAXIALITY, CONCENTRICITY, SYMMETRY, RUN_OUT, TOTAL_RUN_OUT)
MAXIMUM, LEAST = "M", "L"
"""Material conditions of ISO 2692."""
_TRIALS = 2000
_SEED = 1
_NOISE_DOF = 50  # as of a form
_SMALL_TURN = 1e-7  # rad: a fit that turns the frame by more is repeated from there
_ROUNDS = 6
_SAME_FACE = 1e-6  # of the part's size: a larger form of the nominal points is another shape
_NO_MOTION = 1e-7  # of distances by a unit motion: less is rounding
_MOST_WEIGHTS = 4000  # points of a surface whose common errors may be unknown
_FEWEST_IN_SECTION = 3
_SECTION = 0.02  # of the length of a cylinder: heights nearer than this are one section


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
    """

    kind: str
    zone: float
    datums: tuple[str, ...] = ()
    material: str = ""

    def __post_init__(self) -> None:
        if self.kind not in TOLERANCE_KINDS:
            raise PretravelError(
                f"'{self.kind}' is not a tolerance here: {', '.join(TOLERANCE_KINDS)}"
            )
        checked(self.zone, "the tolerance", DISTANCE)
        if self.material not in ("", MAXIMUM, LEAST):
            raise PretravelError(f"the material condition is M or L, not '{self.material}'")
        if self.material and self.kind not in (
            POSITION, COAXIALITY, SYMMETRY, PARALLELISM, PERPENDICULARITY, ANGULARITY
        ):  # fmt: skip
            raise PretravelError(f"a {self.kind} has no material condition")
        if not self.datums and self.kind not in (POSITION, PROFILE):
            raise PretravelError(f"a {self.kind} needs a datum")

    @property
    def name(self) -> str:
        """As in a report: ``position to A|B|C (M)``."""
        to = f" to {'|'.join(self.datums)}" if self.datums else ""
        return f"{self.kind}{f' ({self.material})' if self.material else ''}{to}"


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
                f"{self.label}: the tolerance needs its nominal {what}: state {key}, or the part "
                "with whose faces the points agree"
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


def nominal_of_part(placed: PlacedFeature, part: Part) -> PlacedFeature:
    """The nominal place that is not stated, from the faces of the part beneath the points.

    Parameters
    ----------
    placed : PlacedFeature
        In the frame of the part.
    part : Part

    Returns
    -------
    PlacedFeature
        What was stated stays. Where the faces beneath the points form no such feature, nothing is
        added.
    """
    found = placed.feature.association
    feet = feet_on_faces(part, found.points)
    kind = placed.feature.kind
    axis = feet.local.normal.mean(axis=0) if kind == "plane" else found.direction
    if kind == "slot":
        axis = found.direction
    try:
        nominal = associate(kind, feet.local.point, axis=axis, at=placed.point)
    except PretravelError:
        return placed
    if nominal.form > _SAME_FACE * max(found.diameter or 0.0, part.size):
        return placed
    return replace(
        placed,
        point=nominal.point if placed.point is None else placed.point,
        direction=nominal.direction if placed.direction is None else placed.direction,
        size=nominal.diameter if placed.size is None else placed.size,
    )


def inspect_geometry(
    features: Sequence[PlacedFeature],
    tolerance: GeometricTolerance,
    datums: Mapping[str, PlacedFeature],
    required: float,
) -> GeometricResult:
    """Compare a feature, or a pattern of features, with a tolerance to datums.

    Parameters
    ----------
    features : sequence of PlacedFeature
        One, or the features of a pattern (ISO 5458): they have one common freedom.
    tolerance : GeometricTolerance
    datums : mapping of str to PlacedFeature
        By their letters.
    required : float
        Probability at which conformity or nonconformity is proven.

    Returns
    -------
    GeometricResult

    Raises
    ------
    PretravelError
        A datum that was not measured; a nominal place that is missing; a feature that has no such
        tolerance.
    """
    groups = [_group(word, datums) for word in tolerance.datums]
    for placed in features:
        if any(one.feature is placed.feature for group in groups for one in group.features):
            raise PretravelError(f"{placed.label} cannot be a datum of itself")
    if len(features) == 1 and tolerance.kind == POSITION and not groups:
        raise PretravelError(
            f"{features[0].label}: a position without datums is that of a pattern; state datums, "
            "or position_tolerance_mm for one in the frame of the points"
        )
    if len(features) > 1 and tolerance.kind != POSITION:
        raise PretravelError(f"a pattern has a position, not a {tolerance.kind}")
    if _is_surface(features[0], tolerance):
        if len(features) > 1:
            raise PretravelError("a pattern consists of bores, bosses, slots or balls, not planes")
        return _of_surface(features[0], tolerance, groups, required)
    return _of_places(features, tolerance, groups, required)


@dataclass(frozen=True)
class _Word:
    """Features of one datum, and whether it is at maximum material."""

    features: tuple[PlacedFeature, ...]
    at_maximum: bool


def _group(word: str, datums: Mapping[str, PlacedFeature]) -> _Word:
    name, sign, _ = word.replace(" ", "").partition("(M)")
    letters = name.split("-") if name not in datums else [name]
    missing = [letter for letter in letters if letter not in datums]
    if missing:
        raise PretravelError(
            f"datum {missing[0]} is not among the measured features: {', '.join(datums)}"
        )
    return _Word(tuple(datums[letter] for letter in letters), bool(sign))


def _is_surface(placed: PlacedFeature, tolerance: GeometricTolerance) -> bool:
    """Whether the touched points themselves must lie in the zone."""
    if tolerance.kind in (PROFILE, RUN_OUT, TOTAL_RUN_OUT):
        return True
    return placed.feature.kind in ("plane", "line") or placed.feature.kind not in _DERIVED


_DERIVED = ("circle", "bore", "boss", "sphere", "cylinder", "cone", "torus", "slot")


# The frame of the datums


@dataclass(frozen=True, eq=False)
class _Frame:
    """The frame of a tolerance, with the nominal place of the toleranced feature in it."""

    system: DatumSystem
    point: FloatArray  # in the frame of the points
    direction: FloatArray | None

    def moved(self, rows: FloatArray, change: FloatArray) -> tuple[_Frame, bool]:
        """After the free motion that explains a change of distances, and whether it matters.

        `rows` are the changes of the distances by the six motions of the frame.
        """
        free = self.system.free
        by_motion = rows @ free
        free = free[:, np.linalg.norm(by_motion, axis=0) > _NO_MOTION]
        if free.shape[1] == 0:
            return self, False
        motion = free @ np.linalg.lstsq(rows @ free, change, rcond=1e-9)[0]
        after = moved_system(self.system, motion)
        step = moved_system(replace(self.system, placement=Placement()), motion).placement
        turned = None if self.direction is None else step.vectors(self.direction[None])[0]
        there = _Frame(after, step.points(self.point[None])[0], turned)
        return there, float(np.linalg.norm(motion[3:])) > _SMALL_TURN


def _frame(placed: PlacedFeature, tolerance: GeometricTolerance, groups: Sequence[_Word]) -> _Frame:
    if tolerance.kind in _TO_AXIS:
        return _frame_of_axis(placed, tolerance, groups)
    if tolerance.kind in _ORIENTATION and len(groups) == 1 and len(groups[0].features) == 1:
        return _frame_of_direction(placed, tolerance, groups[0].features[0])
    system = datum_system([[_nominal(one) for one in group.features] for group in groups])
    place = system.placement
    kind = tolerance.kind
    needs_point = kind == POSITION or (kind == PROFILE and placed.part is None)
    point = placed.needed("point") if needs_point else np.zeros(3)
    direction = placed.direction
    measured = placed.feature.association
    needs = kind in _ORIENTATION or measured.direction_rows is not None
    if placed.part is None and direction is None and needs:
        direction = placed.needed("direction")
    if direction is None:
        direction = measured.direction
        turned = direction
    else:
        turned = place.vectors(direction[None])[0]
    return _Frame(system, place.points(point[None])[0], turned)


def _nominal(placed: PlacedFeature) -> DatumFeature:
    found = placed.feature.association
    direction = placed.direction
    if direction is None and found.direction_rows is not None:
        direction = placed.needed("direction")
    return DatumFeature(placed.feature, placed.needed("point"), direction)


def _frame_of_axis(
    placed: PlacedFeature, tolerance: GeometricTolerance, groups: Sequence[_Word]
) -> _Frame:
    """The datum is the place itself: an axis, a centre or a median plane, wherever it is."""
    if not groups or len(groups) > 2:
        raise PretravelError(f"a {tolerance.kind} has one datum, or an axis and a plane")
    first = [one.feature for one in groups[0].features]
    own = [DatumFeature.as_measured(each) for each in first]
    point, direction = first[0].association.point, first[0].association.direction
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
    system = datum_system([own, *more])
    if tolerance.kind in (RUN_OUT, TOTAL_RUN_OUT) and direction is None:
        raise PretravelError(f"a {tolerance.kind} needs a datum with an axis")
    place = system.placement
    turned = None if direction is None else place.vectors(direction[None])[0]
    return _Frame(system, place.points(point[None])[0], turned)


def _frame_of_direction(
    placed: PlacedFeature, tolerance: GeometricTolerance, datum: PlacedFeature
) -> _Frame:
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
        return _Frame(system, own.point, turned)
    system = datum_system([[DatumFeature.as_measured(datum.feature)]])
    normal = [each.kind in ("plane", "slot", "line") for each in (placed.feature, datum.feature)]
    along = (tolerance.kind == PARALLELISM) == (normal[0] == normal[1])
    cosine = float(own.direction @ found.direction)
    if along:
        direction = math.copysign(1.0, cosine) * found.direction
    else:
        flat = own.direction - cosine * found.direction
        direction = flat / max(float(np.linalg.norm(flat)), 1e-300)
    if abs(float(direction @ own.direction)) < math.cos(0.5):
        raise PretravelError(
            f"{placed.label} is {math.degrees(math.acos(min(abs(cosine), 1.0))):.0f}° to datum "
            f"{datum.label}: this is no {tolerance.kind}"
        )
    return _Frame(system, own.point, direction)


# Zones of derived elements


@dataclass(frozen=True, eq=False)
class _Places:
    """Located places of derived elements, with the change of each row by its causes.

    Attributes
    ----------
    located : (g, m) float
        Distances from the nominal; places that have fewer than m directions are filled with zeros.
    own : list of (g m, k) float
        By the parameters of each toleranced feature.
    frame : (g m, 6) float
        By motions of the frame.
    free : (g m, f) float
        By motions that are fitted.
    """

    located: FloatArray
    own: list[FloatArray]
    frame: FloatArray
    free: FloatArray


def _of_places(
    features: Sequence[PlacedFeature],
    tolerance: GeometricTolerance,
    groups: Sequence[_Word],
    required: float,
) -> GeometricResult:
    frames = [_frame(placed, tolerance, groups) for placed in features]
    system = frames[0].system
    for _ in range(_ROUNDS):
        places = _places(features, frames, tolerance)
        # What the datums leave free, and the float of a datum at maximum material.
        float_columns, reach, remarks = _datum_float(groups, places.frame)
        amounts = _best_fit(places.located, places.free, float_columns, reach)
        columns = np.hstack([places.free, float_columns])
        located = places.located + (columns @ amounts).reshape(places.located.shape)
        if tolerance.kind in (*_ORIENTATION, *_TO_AXIS):
            break
        change = places.free @ amounts[: places.free.shape[1]]
        turned = [frame.moved(places.frame, change) for frame in frames]
        if not turned[0][1]:
            break
        frames = [frame for frame, _ in turned]
    terms = [
        (placed.feature.errors, rows) for placed, rows in zip(features, places.own, strict=True)
    ]
    terms += [
        (each.errors, places.frame @ rows)
        for each, rows in zip(system.features, system.by_parameters, strict=True)
    ]
    terms = _merged(terms)
    worst = int(np.argmax(np.linalg.norm(located, axis=1)))
    bonus, size_row, most_bonus = _bonus(features, tolerance)
    if size_row is not None:
        index = next(i for i, (errors, _) in enumerate(terms)
                     if errors is features[size_row[0]].feature.errors)  # fmt: skip
        terms = [
            (errors, np.vstack([rows, size_row[1] if i == index else np.zeros((1, rows.shape[1]))]))
            for i, (errors, rows) in enumerate(terms)
        ]
    parts = covariance_by_source(terms)
    machine = features[0].feature.errors.machine
    count = located.size
    if machine > 0.0:
        lengths = np.eye(count + (size_row is not None))
        parts[MACHINE] = machine**2 * lengths
    keep = _projection(places.free, count + (size_row is not None))
    conformity = zone_conformity(
        tolerance.name,
        located,
        np.asarray(sum(parts.values())),
        (tolerance.zone, bonus, most_bonus),
        required,
        dof=min(_dof(terms, parts, row) for row in range(count)),
        refit=keep,
    )
    along = np.zeros(count + (size_row is not None))
    length = float(np.linalg.norm(located[worst]))
    width = located.shape[1]
    whole = np.asarray(sum(parts.values()))[:count, :count]
    mine = slice(worst * width, (worst + 1) * width)
    along[mine] = (
        located[worst] / length if length > 0.0 else np.linalg.eigh(whole[mine, mine])[1][:, -1]
    )
    share = {
        cause: 2.0 * math.sqrt(max(float(along @ keep @ part @ keep.T @ along), 0.0))
        for cause, part in parts.items()
    }
    u = math.sqrt(sum(each**2 for each in share.values()))
    quantity = Quantity(tolerance.name, 2.0 * length, u, share, dof=conformity.dof)
    return GeometricResult(
        tuple(placed.label for placed in features),
        tolerance,
        quantity,
        conformity,
        bonus,
        places.free.shape[1],
        remarks,
    )


def _merged(
    terms: Sequence[tuple[FeatureErrors, FloatArray]],
) -> list[tuple[FeatureErrors, FloatArray]]:
    """One term for each feature: one may be toleranced and a datum of others."""
    found: list[tuple[FeatureErrors, FloatArray]] = []
    for errors, rows in terms:
        same = next((i for i, (known, _) in enumerate(found) if known is errors), None)
        if same is None:
            found.append((errors, rows))
        else:
            found[same] = (errors, found[same][1] + rows)
    return found


def _dof(
    terms: Sequence[tuple[FeatureErrors, FloatArray]], parts: Mapping[str, FloatArray], row: int
) -> float:
    """Degrees of freedom of one row; of the most important two features, as the form allows."""
    u = math.sqrt(max(sum(float(part[row, row]) for part in parts.values()), 0.0))
    if u == 0.0:
        return math.inf
    weight = [float(np.sum((rows[row : row + 1] @ errors.association.response) ** 2))
              * errors.excess**2 for errors, rows in terms]  # fmt: skip
    chosen = np.argsort(weight)[::-1][:2]
    return dof_of_features([(terms[i][0], terms[i][1][row : row + 1]) for i in chosen], u)


def _places(
    features: Sequence[PlacedFeature], frames: Sequence[_Frame], tolerance: GeometricTolerance
) -> _Places:
    located: list[FloatArray] = []
    own_rows: list[list[FloatArray]] = []
    frame_rows: list[FloatArray] = []
    shifts: list[FloatArray] = []
    for placed, frame in zip(features, frames, strict=True):
        for sides, away, rows, at in _located(placed, frame, tolerance):
            located.append(away)
            own_rows.append([rows if one is placed else np.zeros((len(sides), _size(one)))
                             for one in features])  # fmt: skip
            frame_rows.append(-moved_by_frame(np.tile(at, (len(sides), 1)), sides))
            shifts.append(-sides)
    width = max(len(each) for each in located)
    pad = [width - len(each) for each in located]

    def stacked(blocks: Sequence[FloatArray]) -> FloatArray:
        return np.vstack(
            [np.pad(block, ((0, more), (0, 0))) for block, more in zip(blocks, pad, strict=True)]
        )

    frame_all = stacked(frame_rows)
    free = frame_all @ frames[0].system.free
    if tolerance.kind in _ORIENTATION:  # the zone may lie anywhere
        free = np.hstack([free, stacked(shifts)])
    return _Places(
        np.array([np.pad(each, (0, more)) for each, more in zip(located, pad, strict=True)]),
        [stacked([block[i] for block in own_rows]) for i in range(len(features))],
        frame_all,
        _independent(free),
    )


def _size(placed: PlacedFeature) -> int:
    return int(placed.feature.association.jacobian.shape[1])


def _independent(columns: FloatArray) -> FloatArray:
    """The same space in independent columns; none where nothing moves."""
    length = np.linalg.norm(columns, axis=0)
    scaled = columns[:, length > _NO_MOTION] / length[length > _NO_MOTION]
    if scaled.shape[1] == 0:
        return scaled
    u, size, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(u[:, size > 1e-6])


_Located = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def _located(placed: PlacedFeature, frame: _Frame, tolerance: GeometricTolerance) -> list[_Located]:
    """Places of a derived element: directions (m, 3), distances (m,), rows (m, k), nominal point.

    A centre is one place; an axis two, at the ends of its touched length; a median plane one for
    each touched point.
    """
    found = placed.feature.association
    if tolerance.kind == SYMMETRY and frame.direction is not None and found.direction is not None:
        normal = found.direction  # of the median plane that lies in the datum
        aligned = abs(float(normal @ frame.direction)) > 0.5
        frame = replace(frame, direction=frame.direction if aligned else normal)
    if found.direction is None or found.direction_rows is None:
        if tolerance.kind in _ORIENTATION:
            raise PretravelError(f"{placed.label}: a {placed.feature.kind} has no orientation")
        sides, at = found.located_along, frame.point
        if frame.direction is not None and (len(sides) < 3 or tolerance.kind == COAXIALITY):
            # Across the nominal axis; along it, a centre has no place.
            sides = across(frame.direction)
            at = at + float((found.point - at) @ frame.direction) * frame.direction
        away = sides @ (found.point - at)
        return [(sides, away, sides @ found.point_rows, at)]
    direction = frame.direction
    assert direction is not None
    sign = 1.0 if direction @ found.direction >= 0.0 else -1.0
    if placed.feature.kind == "slot":
        heights = (found.points - found.point) @ across(found.direction).T
        on_plane = found.point + heights @ across(found.direction)
        return [_on_plane(placed, frame, sign, place) for place in on_plane]
    height = (found.points - found.point) @ found.direction
    sides = across(direction)
    rows = []
    for end in (float(height.min()), float(height.max())):
        place = found.point + end * found.direction
        at = frame.point + float((place - frame.point) @ direction) * direction
        own = sides @ (found.point_rows + end * found.direction_rows)
        rows.append((sides, np.asarray(sides @ (place - at)), own, np.asarray(at)))
    if placed.feature.kind == "torus" and tolerance.kind == POSITION:
        return [(found.located_along, found.located_along @ (found.point - frame.point),
                 found.located_along @ found.point_rows, frame.point)]  # fmt: skip
    return rows


def _on_plane(placed: PlacedFeature, frame: _Frame, sign: float, place: FloatArray) -> _Located:
    """A place of a median plane, along the nominal normal."""
    found, direction = placed.feature.association, frame.direction
    assert direction is not None
    assert found.direction is not None
    assert found.direction_rows is not None
    arm = place - found.point
    # The plane moves at a place with its point, and with its normal against the arm.
    rows = sign * (found.direction @ found.point_rows - arm @ found.direction_rows)
    at = place - float((place - frame.point) @ direction) * direction
    return (
        direction[None],
        np.array([float(direction @ (place - frame.point))]),
        rows[None],
        at,
    )


def _best_fit(
    located: FloatArray, free: FloatArray, floating: FloatArray, reach: float
) -> FloatArray:
    """Amounts of the free motions that make the largest distance least.

    The last two columns are a shift of at most `reach`.
    """
    columns = np.hstack([free, floating])
    count = columns.shape[1]
    if count == 0:
        return np.zeros(0)
    from scipy.optimize import minimize

    flat = located.ravel()
    scale = max(float(np.abs(flat).max()), 1e-9)
    start = np.zeros(count)
    if free.shape[1]:
        start[: free.shape[1]] = np.linalg.lstsq(free, -flat / scale, rcond=None)[0]

    def distances(x: FloatArray) -> FloatArray:
        left = (flat / scale + columns @ x[:count]).reshape(located.shape)
        return np.asarray(np.sum(left**2, axis=1))

    def slopes(x: FloatArray) -> FloatArray:
        left = (flat / scale + columns @ x[:count]).reshape(located.shape)
        by = columns.reshape(*located.shape, count)
        return np.asarray(2.0 * np.einsum("gm,gmk->gk", left, by))

    constraints = [
        {
            "type": "ineq",
            "fun": lambda x: x[count] - distances(x),
            "jac": lambda x: np.column_stack([-slopes(x), np.ones(len(located))]),
        }
    ]
    if floating.shape[1]:
        most = (reach / scale) ** 2
        constraints.append(
            {"type": "ineq", "fun": lambda x: np.array([most - np.sum(x[count - 2 : count] ** 2)])}
        )
    begun = np.append(start, float(distances(start).max()))
    found = minimize(
        lambda x: float(x[count]),
        begun,
        jac=lambda x: np.eye(count + 1)[count],
        constraints=constraints,
        method="SLSQP",
        options={"maxiter": 300, "ftol": 1e-14},
    )
    best = np.asarray(found.x[:count])
    if floating.shape[1]:
        size = float(np.linalg.norm(best[-2:]))
        best[-2:] *= min(1.0, reach / scale / max(size, 1e-300))
    if distances(best).max() > distances(start).max():
        best = start
    return np.asarray(scale * best)


def _projection(free: FloatArray, size: int) -> FloatArray:
    """What of errors is left after a fit of the free motions, (size, size)."""
    keep = np.eye(size)
    if free.shape[1]:
        count = len(free)
        keep[:count, :count] -= free @ np.linalg.pinv(free)
    return keep


def _bonus(
    features: Sequence[PlacedFeature], tolerance: GeometricTolerance
) -> tuple[float, tuple[int, FloatArray] | None, float]:
    """Growth of the tolerance by the size, the change of it by the parameters, its largest value.

    Of a pattern, that of the feature with the smallest growth, for all.
    """
    if not tolerance.material:
        return 0.0, None, 0.0
    found = [_departure(placed, tolerance.material) for placed in features]
    least = int(np.argmin([each[0] for each in found]))
    value, row, most = found[least]
    return value, (least, row), most


def _departure(placed: PlacedFeature, material: str) -> tuple[float, FloatArray, float]:
    """Departure from the maximum (or least) material size, its row, and the largest one. [mm]"""
    feature = placed.feature
    if feature.association.diameter is None or feature.association.diameter_row is None:
        raise PretravelError(
            f"{placed.label}: a {feature.kind} has no size, so no material condition"
        )
    limits = placed.limits
    if limits is None or not math.isfinite(limits[0] + limits[1]):
        raise PretravelError(
            f"{placed.label}: a material condition needs both limits of its size (tolerance)"
        )
    if not feature.side:
        raise PretravelError(f"{placed.label}: it is not known whether it is a bore or a boss")
    inside = feature.side == "inside"
    grows = 1.0 if inside == (material == MAXIMUM) else -1.0
    limit = limits[0] if grows > 0.0 else limits[1]
    value = grows * (feature.association.diameter - limit)
    most = limits[1] - limits[0]
    return min(max(value, 0.0), most), grows * feature.association.diameter_row[None], most


def _datum_float(
    groups: Sequence[_Word], frame: FloatArray
) -> tuple[FloatArray, float, tuple[str, ...]]:
    """Shifts of a datum at maximum material: columns, their largest amount, a remark."""
    floating = [group for group in groups if group.at_maximum]
    nothing = np.zeros((len(frame), 0))
    if not floating:
        return nothing, 0.0, ()
    if len(floating) > 1 or len(floating[0].features) > 1:
        raise PretravelError("one datum may be at maximum material here, and no common one")
    datum = floating[0].features[0]
    found = datum.feature.association
    if datum.feature.kind not in ("circle", "bore", "boss", "cylinder"):
        raise PretravelError(
            f"datum {datum.label}: a {datum.feature.kind} is no datum at maximum material here; "
            "bores, bosses and cylinders are"
        )
    assert found.direction is not None
    departure = _departure(datum, MAXIMUM)[0]
    sideways = across(found.direction)
    columns = frame[:, :3] @ sideways.T
    remark = (
        f"datum {datum.label} may shift by up to {0.5 * departure * 1e3:.1f} µm (its departure from "
        "the maximum material size, without tolerances of its own orientation or position)"
    )
    return columns, 0.5 * departure, (remark,)


# Zones of surfaces


def _of_surface(
    placed: PlacedFeature,
    tolerance: GeometricTolerance,
    groups: Sequence[_Word],
    required: float,
) -> GeometricResult:
    if tolerance.material or any(group.at_maximum for group in groups):
        raise PretravelError("a surface has no material condition; its axis or median plane has")
    frame = _frame(placed, tolerance, groups)
    system = frame.system
    points = placed.feature.association.points
    for _ in range(_ROUNDS):
        distance, normals, section = _distances(placed, frame, tolerance)
        frame_rows = -moved_by_frame(points, normals)
        columns = _free_of_surface(frame_rows, system, tolerance, section)
        fitted = _flattest(distance, columns)
        left = distance + columns @ fitted
        if section is not None or tolerance.kind in _ORIENTATION:
            break
        frame, turned = frame.moved(frame_rows, columns @ fitted)
        if not turned:
            break
    own = placed.feature.errors
    along = np.sum(normals * placed.feature.points.normals, axis=1)
    sign = np.sum(placed.feature.association.outward * placed.feature.points.normals, axis=1)
    # Errors move a point along the outward normal of its feature; the zone may be seen otherwise.
    factor = along / np.where(np.abs(sign) > 0.1, sign, 1.0)
    form = _form(placed, own, factor, left, columns, frame_rows, system)
    conformity = form_conformity(tolerance.name, form, tolerance.zone, required)
    quantity = Quantity(tolerance.name, form.value, form.u, {}, ends=form.interval)
    return GeometricResult(
        (placed.label,), tolerance, quantity, conformity, 0.0, columns.shape[1],
    )  # fmt: skip


def _free_of_surface(
    frame_rows: FloatArray,
    system: DatumSystem,
    tolerance: GeometricTolerance,
    section: IntArray | None,
) -> FloatArray:
    """What moves the distances freely: motions, the place of an orientation, each section."""
    if section is not None:
        return np.asarray((section[:, None] == np.unique(section)).astype(float))
    free = [frame_rows @ system.free]
    if tolerance.kind in _ORIENTATION:
        free.append(np.ones((len(frame_rows), 1)))
    return _independent(np.hstack(free))


def _distances(
    placed: PlacedFeature, frame: _Frame, tolerance: GeometricTolerance
) -> tuple[FloatArray, FloatArray, IntArray | None]:
    """Distances of the points from the nominal surface, its normals, and sections of a run-out."""
    feature, points = placed.feature, placed.feature.association.points
    kind, direction = feature.kind, frame.direction
    if tolerance.kind in (RUN_OUT, TOTAL_RUN_OUT):
        assert direction is not None
        height, radius, outward = about_axis(points, frame.point, direction)
        axial = kind in ("plane", "line")
        value = height if axial else radius
        normals = np.tile(direction, (len(points), 1)) if axial else outward
        whole = tolerance.kind == TOTAL_RUN_OUT
        of_section = np.zeros(len(points), dtype=int) if whole else _sections(
            placed, radius if axial else height
        )  # fmt: skip
        return value - value.mean(), normals, of_section
    if placed.part is not None and tolerance.kind == PROFILE:
        place = frame.system.placement
        feet = feet_on_faces(placed.part, place.inverse.points(points))
        return feet.distance, place.vectors(feet.local.normal), None
    if kind in ("plane", "line"):
        assert direction is not None
        normals = np.tile(direction, (len(points), 1))
        return (points - frame.point) @ direction, normals, None
    if placed.size is None:
        raise PretravelError(
            f"{placed.label}: a profile needs the nominal diameter, or the part: state nominal_mm"
        )
    radius = 0.5 * placed.size
    if kind == "sphere":
        away = points - frame.point
        distance = np.linalg.norm(away, axis=1)
        return distance - radius, away / distance[:, None], None
    if kind in ("circle", "bore", "boss", "cylinder"):
        assert direction is not None
        _, distance, outward = about_axis(points, frame.point, direction)
        return distance - radius, outward, None
    raise PretravelError(f"the profile of a {kind} needs the part, with whose faces it is compared")


def _sections(placed: PlacedFeature, place: FloatArray) -> IntArray:
    """Numbers of the sections that the points of a run-out form by their heights or radii."""
    order = np.argsort(place)
    steps = np.diff(place[order])
    near = max(_SECTION * float(np.ptp(place)), 1e-2)
    number = np.concatenate([[0], np.cumsum(steps > near)])
    found = np.empty(len(place), dtype=int)
    found[order] = number
    few = np.flatnonzero(np.bincount(number) < _FEWEST_IN_SECTION)
    if len(few):
        label = placed.feature.points.labels[int(np.flatnonzero(found == few[0])[0])]
        raise PretravelError(
            f"{placed.label}: a run-out is that of single sections, and the one of point {label} "
            f"has fewer than {_FEWEST_IN_SECTION} points. Touch several places of each section, or "
            "state the total run-out"
        )
    return found


def _flattest(distance: FloatArray, columns: FloatArray) -> FloatArray:
    """Amounts of the columns with the smallest largest distance: a linear program (HiGHS)."""
    if columns.shape[1] == 0:
        return np.zeros(0)
    from scipy.optimize import linprog

    scale = max(float(np.abs(distance).max()), 1e-9)
    one = -np.ones((len(distance), 1))
    found = linprog(
        np.eye(columns.shape[1] + 1)[-1],
        A_ub=np.vstack([np.hstack([columns, one]), np.hstack([-columns, one])]),
        b_ub=np.concatenate([-distance, distance]) / scale,
        bounds=[(None, None)] * (columns.shape[1] + 1),
        method="highs",
    )
    if not found.success:
        raise PretravelError(f"the zone was not found: {found.message}")
    return np.asarray(scale * found.x[:-1])


def _form(
    placed: PlacedFeature,
    own: FeatureErrors,
    factor: FloatArray,
    left: FloatArray,
    columns: FloatArray,
    frame_rows: FloatArray,
    system: DatumSystem,
) -> FormResult:
    """The extent of the zone with its bounds, as `feature_form.form_result` finds those of a form.

    The errors of the datums move the zone. The form of the surface itself is no error.
    """
    generator = np.random.default_rng(_SEED)
    surface = replace(own, excess=0.0)
    involved = [surface, *(each.errors for each in system.features)]
    drawn = noise_of_features(involved, _TRIALS, generator)
    moved = factor * drawn[0]
    for each, rows, noise in zip(system.features, system.by_parameters, drawn[1:], strict=True):
        moved = moved + (noise @ each.errors.association.response.T) @ (frame_rows @ rows).T
    fit = np.linalg.pinv(columns) if columns.shape[1] else np.zeros((0, len(left)))
    after = moved - (moved @ fit.T) @ columns.T
    u = after.std(axis=0)
    if not own.correlation_known:
        u = _largest_u(involved, factor, columns, fit, frame_rows, system)
    measured = 2.0 * float(np.abs(left).max())
    alone = 2.0 * np.abs(after).max(axis=1)
    scale = np.sqrt(_NOISE_DOF / generator.chisquare(_NOISE_DOF, _TRIALS))
    shape = left * math.sqrt(
        max(1.0 - float(np.mean(u**2)) / max(float(np.mean(left**2)), 1e-300), 0.0)
    )
    bias = float(np.mean(2.0 * np.abs(shape + after).max(axis=1))) - 2.0 * float(
        np.abs(shape).max()
    )
    return bounded_form(
        measured,
        scale * alone,
        lambda factors: 2.0 * np.max(np.abs(left) + factors[:, None] * u, axis=1),
        bias=bias,
        noise=alone,
        u_machine=placed.feature.errors.machine,
        generator=generator,
    )


def _largest_u(
    involved: Sequence[FeatureErrors],
    factor: FloatArray,
    columns: FloatArray,
    fit: FloatArray,
    frame_rows: FloatArray,
    system: DatumSystem,
) -> FloatArray:
    """Largest standard uncertainties of the distances that any correlation allows, (n,)."""
    count = len(factor)
    if count > _MOST_WEIGHTS:
        raise PretravelError(
            f"{count} points whose common errors are not stated are too many for this tolerance; "
            "compensate the touches with this version"
        )
    weights = [np.diag(factor)]
    for each, rows in zip(system.features, system.by_parameters, strict=True):
        weights.append(frame_rows @ rows @ each.errors.association.response)
    joint = np.hstack(weights)
    joint = joint - columns @ (fit @ joint)
    return np.array(
        [math.sqrt(sum(float(part[0, 0]) for part in
                       covariance_by_weights(involved, row[None]).values())) for row in joint]
    )  # fmt: skip
