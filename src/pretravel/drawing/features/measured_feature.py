"""A feature of a part from compensated points: size, position, direction and form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    COORDINATE,
    DEGREE,
    MICROMETRE,
    UNCERTAINTY,
    FloatArray,
    PretravelError,
    WithPlot,
    checked,
    checked_values,
    from_file,
    frozen,
)
from pretravel.drawing.features.extreme_association import (
    GAUSSIAN,
    KINDS_BY_CRITERION,
    MINIMUM_ZONE,
    TANGENT,
    associate_by,
)
from pretravel.drawing.features.feature_form import FormResult, form_result
from pretravel.drawing.features.feature_uncertainty import (
    MACHINE,
    MAP,
    FeatureErrors,
    errors_of_extreme,
    feature_errors,
)
from pretravel.drawing.features.form_families import families_of
from pretravel.drawing.features.largest_distance import LargestDistance, largest_distance
from pretravel.drawing.features.odd_point import odd_point
from pretravel.measurement import Association, Points, PretravelLeft, associate
from pretravel.uncertainty import coverage_factor

SIZE_NAMES = {"slot": "width", "torus": "tube diameter"}
"""The names of `Association.diameter`; diameter of the others."""
FORM_NAMES = {"plane": "flatness", "line": "straightness", "cylinder": "cylindricity",
              "circle": "roundness", "bore": "roundness", "boss": "roundness"}  # fmt: skip
"""The name of the form of a feature; `form` of the others."""
BARE_SURFACE = "surface"
"""Points of any faces of a part, which form no feature: only a profile compares them with it."""
MEASURED_RANGE = "measured range"
"""Largest less smallest residual: the form of the surface and the noise of the points.

With a comma and the association: from an extreme feature; without, from that of least squares.
"""
_MOVES = 1e-9  # smallest change of a parameter by a point, in mm or rad for 1 mm
_TANGENTIAL = 0.1  # smallest cosine of a point's normal, or of an axis, with what it determines


@dataclass(frozen=True)
class Quantity:
    """One quantity of a feature, before and after the compensation.

    Attributes
    ----------
    name : str
    value : float
        From the compensated points. [mm or rad]
    u : float
        Standard uncertainty; not a number for what was read off, as a range is. [mm or rad]
    parts : mapping of str to float
        Contributions to `u` by source, whose squares add up to its square.
    uncompensated : float or None
        From the uncompensated points, where these are known. [mm or rad]
    angle : bool
        Whether it is an angle, in rad, not a length in mm.
    dof : float
        Degrees of freedom of `u`: few where few residuals show the form of the part.
    ends : pair of float or None
        Where the value lies with 95 %, if that is not the value plus and minus U. [mm or rad]
    """

    name: str
    value: float
    u: float
    parts: Mapping[str, float]
    uncompensated: float | None = None
    angle: bool = False
    dof: float = math.inf
    ends: tuple[float, float] | None = None

    @property
    def expanded_u(self) -> float:
        """U: 2 u, or more with few degrees of freedom (95 %). [mm or rad]"""
        return coverage_factor(self.dof, whole_dof=False) * self.u

    @property
    def interval(self) -> tuple[float, float]:
        """Where the value lies with 95 %. [mm or rad]"""
        return self.ends or (self.value - self.expanded_u, self.value + self.expanded_u)


@dataclass(frozen=True, eq=False)
class MeasuredFeature(WithPlot):
    """A feature through compensated points: of least squares, or an extreme one.

    Attributes
    ----------
    kind : str
    label : str
    points : Points
        That were used.
    association : Association
        Through the compensated points.
    uncompensated : Association or None
        Through the same points without compensation.
    uncompensated_is_rebuilt : bool
        The uncompensated points were not in the file: compensated points moved back by their
        pretravel stand for them.
    side : str
        "inside" (a bore), "outside" (a boss) or "", which the normals of the points state.
    errors : FeatureErrors
    quantities : tuple of Quantity
        diameter (width of a slot, both diameters of a torus), half angle, x, y, z of the position.
    located : (m,) float or None
        Distance from the nominal position in the directions `association.located_along`, where a
        nominal position was given. [mm]
    located_covariance : (m, m) float
        Of the position in these directions. [mm²]
    form : FormResult
        The width of the minimum zone, or from the residuals of least squares.
    form_by : str
        Which of the two: minimum-zone or gaussian.
    range_about_least_squares : float
        Largest less smallest residual of the feature of least squares. [mm]
    nominal : (3,) float or None
        The nominal position that was given. [mm]
    """

    kind: str
    label: str
    points: Points
    association: Association
    uncompensated: Association | None
    uncompensated_is_rebuilt: bool
    side: str
    errors: FeatureErrors
    quantities: tuple[Quantity, ...]
    located: FloatArray | None
    located_covariance: FloatArray
    form: FormResult
    nominal: FloatArray | None = None
    form_by: str = GAUSSIAN
    range_about_least_squares: float = math.nan

    def __repr__(self) -> str:
        told = [" ".join(filter(None, (self.kind, self.label))), f"{len(self.points):,} points"]
        told += [self.association.criterion] if self.is_extreme else []
        told += [
            f"{q.name} {q.value:.5f} mm, u = {q.u / MICROMETRE:.2f} µm"
            for q in self.quantities
            if q.name == self.size_name
        ]
        low, high = (end / MICROMETRE for end in self.form.interval)
        told.append(f"{self.form_name} {low:.2f} to {high:.2f} µm at the touched points")
        return f"MeasuredFeature({'; '.join(told)})"

    @property
    def position(self) -> tuple[float, float]:
        """Twice the distance from the nominal position, and its standard uncertainty. [mm]

        As of `largest_distance`: without what errors add to a distance near zero.

        Raises
        ------
        PretravelError
            No nominal position was given.
        """
        if self.located is None:
            raise PretravelError("the position needs a nominal position", inputs=("at",))
        return self._distance.value, self._distance.u

    @cached_property
    def _distance(self) -> LargestDistance:
        assert self.located is not None
        return largest_distance(self.located[None], self.located_covariance, self.position_dof)

    @property
    def position_dof(self) -> float:
        """Degrees of freedom of the position: the fewest of the coordinates."""
        return min((q.dof for q in self.quantities if q.name in "xyz"), default=math.inf)

    @property
    def uncompensated_position(self) -> float | None:
        """Twice the distance of the uncompensated feature from the nominal position. [mm]"""
        if self.uncompensated is None or self.nominal is None:
            return None
        along = self.uncompensated.located_along
        away = along @ (self.uncompensated.point - self.nominal)
        return float(2.0 * np.linalg.norm(away))

    @property
    def stated(self) -> tuple[Quantity, ...]:
        """All that is stated: `quantities`, the position, the form and the measured ranges."""
        found = list(self.quantities)
        if self.located is not None:
            (value, u), away = self.position, self._distance
            plain = self.uncompensated_position
            found.append(Quantity("position", value, u, {}, plain, dof=away.dof, ends=away.ends))
        if self.association.dof > 0 and self.kind != BARE_SURFACE:
            form, before = self.form, self.uncompensated
            # Else noise, or what a prediction misses of the probe, may be all of it.
            if self.points.state_uncertainty and self.errors.map_is_stated:
                found.append(Quantity(self.form_name, form.value, form.u, {}, ends=form.interval))
            plain = None if before is None else before.form
            whole = self.range_about_least_squares
            if self.is_extreme:
                found.append(Quantity(MEASURED_RANGE, whole, math.nan, {}))
                name = f"{MEASURED_RANGE}, {self.association.criterion}"
                found.append(Quantity(name, self.association.form, math.nan, {}, plain))
            else:
                found.append(Quantity(MEASURED_RANGE, whole, math.nan, {}, plain))
            if MINIMUM_ZONE == self.form_by != self.association.criterion:
                name = f"{MEASURED_RANGE}, {MINIMUM_ZONE}"
                found.append(Quantity(name, form.measured, math.nan, {}))
        return tuple(found)

    def with_form_by(self, criterion: str) -> MeasuredFeature:
        """The same feature, with the form of this association.

        Parameters
        ----------
        criterion : str
            minimum-zone (as ISO 1101 defines form; a slot has none, and keeps that of least
            squares) or gaussian.
        """
        if criterion == self.form_by or self.kind not in KINDS_BY_CRITERION[criterion]:
            return self
        axis = None if self.association.direction is None else self.association.direction
        gaussian = associate(self.kind, self.points.positions, axis=axis)
        errors = feature_errors(self.points, gaussian, u_machine=self.errors.machine)
        zone = None
        if criterion == MINIMUM_ZONE:
            zone = associate_by(criterion, self.kind, self.points.positions, axis=axis)
        return replace(self, form=form_result(errors, zone), form_by=criterion)

    @property
    def is_extreme(self) -> bool:
        """Whether it rests on its extreme points alone, not on all as that of least squares."""
        return self.association.criterion != GAUSSIAN

    @property
    def warnings(self) -> tuple[str, ...]:
        """A point apart from the others; what the places of the touches hide, and U does not
        contain or has by prior alone.
        """
        return (*filter(None, [self._apart]), *self.errors.form.sentences(len(self.points)))

    @property
    def _apart(self) -> str:
        """Which point lies apart from the feature of the others; empty if there is none."""
        if self.is_extreme or self.kind == BARE_SURFACE:
            return ""
        found = odd_point(self.association.residuals, self.association.jacobian, self.errors.own)
        if found is None:
            return ""
        row, off, scatter = found
        return (
            f"point {self.points.labels[row]} lies {off / MICROMETRE:+.1f} µm off the feature "
            f"through the others, which scatter by {scatter / MICROMETRE:.2g} µm: dirt, a chip or "
            "a false trigger? It is in the result: touch there again, or leave it out"
        )

    @property
    def pretravel_left(self) -> PretravelLeft:
        """How far its residuals follow the pretravel that was subtracted."""
        own = self.association
        along = np.sum(own.outward * self.points.normals, axis=1) * self.points.pretravel
        return PretravelLeft.of(own.residuals, along, own.jacobian, self.errors.shared.get(MAP))

    @property
    def hidden_form(self) -> str:
        """Which form of the part no touch at these places reveals; empty if there is none."""
        return self.errors.form.hidden_form(len(self.points))

    @property
    def carrying(self) -> tuple[str, ...]:
        """Labels of the points that move the feature: of an extreme one, those it rests on."""
        if self.kind == BARE_SURFACE:
            return self.points.labels
        moves = np.any(np.abs(self.association.response) > _MOVES, axis=0)
        return tuple(label for label, is_in in zip(self.points.labels, moves, strict=True) if is_in)

    @property
    def form_name(self) -> str:
        """Roundness, flatness, straightness, cylindricity, or form."""
        return FORM_NAMES.get(self.kind, "form")

    @property
    def size_name(self) -> str:
        """The name of its size: diameter, width, tube diameter."""
        return SIZE_NAMES.get(self.kind, "diameter")

    @property
    def u_direction(self) -> float | None:
        """Standard uncertainty of the direction where it is largest. [rad]"""
        rows = self.association.direction_rows
        if rows is None:
            return None
        covariance = sum(self.errors.parts(rows).values())
        return float(np.sqrt(max(float(np.linalg.eigvalsh(covariance)[-1]), 0.0)))

    def __getitem__(self, name: str) -> Quantity:
        """A quantity by its name: ``feature["diameter"]``, ``feature["roundness"]``."""
        found = next((each for each in self.stated if each.name == name), None)
        return self.quantity(name) if found is None else found

    def quantity(self, name: str) -> Quantity:
        """One of `quantities`, by name.

        Raises
        ------
        PretravelError
            The feature has no such quantity.
        """
        for quantity in self.quantities:
            if quantity.name == name:
                return quantity
        known = ", ".join(q.name for q in self.quantities)
        raise PretravelError(f"a {self.kind} has no {name}; it has {known}, {self.form_name}")


def _as_points(given: object) -> Points:
    found = from_file("points", given) if isinstance(given, str | Path) else given
    if not isinstance(found, Points):
        raise PretravelError(
            f"expected points, not a {type(given).__name__}: apply makes them of touches and a "
            "map, read_points reads them"
        )
    return found


def measure_feature(
    points: Points | str | Path,
    kind: str,
    *,
    axis: npt.ArrayLike | None = None,
    at: npt.ArrayLike | None = None,
    u_machine: float = 0.0,
    label: str = "",
    association: str = GAUSSIAN,
) -> MeasuredFeature:
    """Fit a feature to compensated points, with the uncertainties that follow from the points'.

    Errors that points have in common (tip radius, map, signal delay) do not average out: the
    diameter of a bore contains twice the error of the tip radius, however many points it has.

    Parameters
    ----------
    points : Points, str or Path
        From `apply` or `read_points`; or their file. Points without normals have those of the
        feature. Where they do not state which errors are common (`Points.shared` is None),
        uncertainties are the largest that any correlation allows.
    kind : str
        circle, bore, boss, sphere, plane, line, cylinder, cone, torus or slot; surface: points of
        any faces, whose profile alone is measured.
    axis : (3,) float, optional
        Circle: normal of its plane, by default that of the plane through the points. Cylinder,
        cone, torus: approximate axis. Slot: across its planes; the normals of the points say it.
    at : (3,) float, optional
        Nominal position. An axis, a plane or a line is evaluated at its point nearest to this
        one, and so is the diameter of a cone. [mm]
    u_machine : float
        Standard uncertainty of a length by other causes than the probe (geometry of the machine,
        temperature, clamping); it is added to all lengths. [mm]
    label : str
    association : str
        gaussian, minimum-zone, inscribed, circumscribed or tangent, as of `associate_by`. The
        uncertainty of an extreme feature is that of the points on which it rests, and of the noise
        that makes it larger or smaller on average, which is not subtracted; it contains no form of
        the part, where the points state their uncertainty. The form of a minimum zone is its
        width, with its own interval; of all others it is that of least squares.

    Returns
    -------
    MeasuredFeature

    Raises
    ------
    PretravelError
        Points that do not determine the feature, or normals that contradict it; an association
        that the feature does not have.

    References
    ----------
    JCGM 102, equation 3, for several outputs. Degrees of freedom: JCGM 100, G.4.

    >>> angle = np.arange(8) * np.pi / 4
    >>> outward = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> one = 1e-6 * outward[:, :, None] * outward[:, None, :]     # u = 1 µm
    >>> tip = {"tip radius": np.full(8, 0.8e-3)}                   # 0.8 µm of it in common
    >>> points = Points(10.0 * outward, -outward, np.zeros(8), one, None, tuple("12345678"), tip)
    >>> bore = measure_feature(points, "bore").quantity("diameter")
    >>> round(bore.value, 6), round(bore.u * 1e3, 4)      # 2 sqrt(0.6²/8 + 0.8²)
    (20.0, 1.6553)
    """
    points = _as_points(points)
    if len(points) == 0:
        raise PretravelError(f"there are no points for the {kind}")
    what = "the standard uncertainty by the machine"
    checked(u_machine, what, UNCERTAINTY, inputs=("u_machine",))
    if at is not None:
        nominal = checked_values(at, "the nominal position", COORDINATE)
        if nominal.shape != (3,):
            raise PretravelError(
                f"the nominal position needs x, y, z; its shape is {nominal.shape}", inputs=("at",)
            )
    plain = not np.isfinite(points.normals).any()
    if not plain and (axis is None or (association == TANGENT and kind in ("line", "plane"))):
        axis = _axis_of_normals(points.normals, kind)
    if kind == BARE_SURFACE:
        if plain:
            raise PretravelError("the points of a surface need their normals: align writes them")
        found = _surface(points, association)
    else:
        found = associate(kind, points.positions, axis=axis, at=at)
    if plain:
        inward = -1.0 if kind == "bore" else 1.0
        points = replace(points, normals=frozen(inward * found.outward))
    stated = kind in ("bore", "boss") or not plain
    side = _side(points, found, kind) if stated else ""
    families = families_of(kind, found)
    errors = feature_errors(points, found, u_machine=u_machine, families=families)
    of_least_squares, whole, form_by, zone = errors, found.form, GAUSSIAN, None
    if association != GAUSSIAN and kind != BARE_SURFACE:
        found = associate_by(association, kind, points.positions, axis=axis, at=at, side=side)
        moved = float(np.mean(errors.association.residuals - found.residuals))
        errors = errors_of_extreme(errors, found, moved, stated=points.state_uncertainty)
        if association == MINIMUM_ZONE:
            form_by, zone = MINIMUM_ZONE, found
    form = form_result(of_least_squares, zone)
    before, rebuilt = _uncompensated(points, found, (kind, side), axis, at)
    parts = errors.parts(found.located_along @ found.point_rows)
    covariance = sum(parts.values()) + u_machine**2 * np.eye(len(found.located_along))
    located = None
    if at is not None:
        located = frozen(found.located_along @ (found.point - np.asarray(at, float)))
    return MeasuredFeature(
        kind=kind,
        label=label,
        points=points,
        association=found,
        uncompensated=before,
        uncompensated_is_rebuilt=rebuilt,
        side=side,
        errors=errors,
        quantities=_quantities(kind, found, before, errors),
        located=located,
        located_covariance=frozen(covariance),
        form=form,
        nominal=None if at is None else frozen(np.asarray(at, dtype=np.float64)),
        form_by=form_by,
        range_about_least_squares=whole,
    )


def _surface(points: Points, criterion: str) -> Association:
    """Points as they are: no parameter is fitted, and nothing is left of them."""
    count = len(points)
    return Association(
        points=points.positions,
        outward=points.normals,
        residuals=np.zeros(count),
        jacobian=np.zeros((count, 0)),
        point=points.positions.mean(axis=0),
        point_rows=np.zeros((3, 0)),
        located_along=np.zeros((0, 3)),
        criterion=criterion,
    )


def position_and_uncertainty(located: FloatArray, covariance: FloatArray) -> tuple[float, float]:
    """Twice a distance from the nominal position, and its standard uncertainty along itself.

    Parameters
    ----------
    located : (m,) float
        Distance by direction. [mm]
    covariance : (m, m) float
        [mm²]

    Returns
    -------
    position, u : float
        [mm]

    >>> value, u = position_and_uncertainty(np.array([0.03, 0.04]), 1e-6 * np.eye(2))
    >>> round(value, 9), round(u, 9)
    (0.1, 0.002)
    """
    distance = float(np.linalg.norm(located))
    along = located / distance if distance > 0.0 else np.linalg.eigh(covariance)[1][:, -1]
    return 2.0 * distance, 2.0 * float(np.sqrt(max(float(along @ covariance @ along), 0.0)))


def _unless_zero(vector: FloatArray) -> FloatArray | None:
    return vector if np.linalg.norm(vector) > _TANGENTIAL else None


def _axis_of_normals(normals: FloatArray, kind: str) -> FloatArray | None:
    """What the normals say of the direction of a feature; None where they do not show it.

    A few touches lie on several cylinders: six at two heights, turned by 60°, on two more.
    """
    normals = normals[np.isfinite(normals).all(axis=1)]
    if kind in ("line", "plane"):
        return _unless_zero(np.asarray(normals.mean(axis=0)))
    if kind not in ("slot", "cylinder", "cone"):
        return None
    left = normals - normals.mean(axis=0) if kind == "cone" else normals
    _, size, axes = np.linalg.svd(left, full_matrices=False)
    if kind == "slot":
        return np.asarray(axes[0])
    if len(size) < 3 or size[1] < _TANGENTIAL * size[0]:
        return None
    return np.asarray(axes[2] * np.sign(axes[2][np.argmax(np.abs(axes[2]))]))


NORMALS_OFF = 1.0 * DEGREE
"""Stated normals that are further off, root mean square, are said: a tip of 6 mm touches 0.5 µm
next to the point along the normal, and pretravel is that of another direction. [rad]"""


_WITH_NORMALS = ("bore", "boss", "circle", "sphere", "cylinder", "plane")


def normals_off(feature: MeasuredFeature) -> float:
    """Root mean square angle between the normals of the points and those of the feature. [rad]

    A form of the feature turns its normals by much less than a degree. Zero for a kind whose points
    may have other normals than the fit shows (a line, a slot).
    """
    if feature.kind not in _WITH_NORMALS:
        return 0.0
    across = np.cross(feature.points.normals, feature.association.outward)
    return float(np.sqrt(np.mean(np.sum(across**2, axis=1))))


def _side(points: Points, association: Association, kind: str) -> str:
    """On which side of the feature the part is; refuses normals that contradict the feature."""
    along = np.sum(association.outward * points.normals, axis=1)
    wrong = np.flatnonzero(np.abs(along) < _TANGENTIAL)
    if len(wrong):
        raise PretravelError(
            f"point {points.labels[wrong[0]]}: its normal lies along the surface of the {kind} "
            "that fits the points. Is this the right feature, with the right axis and points?",
            inputs=("feature", "axis", "select"),
        )
    inside = along < 0.0
    if np.any(inside) and not np.all(inside):
        first = int(np.flatnonzero(inside != inside[0])[0])
        raise PretravelError(
            f"the normal of point {points.labels[first]} points to the other side of the {kind} "
            f"than that of point {points.labels[0]}: these are points of two "
            "features, or a normal has the wrong sign"
        )
    if kind in ("plane", "line", BARE_SURFACE):
        return ""
    side = "inside" if inside[0] else "outside"
    wanted = {"bore": "inside", "boss": "outside"}.get(kind, side)
    if side != wanted:
        raise PretravelError(
            f"the normals of the points point {'to' if inside[0] else 'away from'} the centre: "
            f"this is a {'bore' if inside[0] else 'boss'}, not a {kind} (normals point "
            "out of the part)",
            inputs=("feature",),
        )
    return side


def _uncompensated(
    points: Points,
    association: Association,
    of: tuple[str, str],
    axis: npt.ArrayLike | None,
    at: npt.ArrayLike | None,
) -> tuple[Association | None, bool]:
    """The same feature through the points without compensation, and whether these are rebuilt.

    `of` is its kind and side.
    """
    kind, side = of
    plain, rebuilt = points.uncompensated, False
    if plain is None:
        if not np.all(np.isfinite(points.pretravel)):
            return None, False
        plain, rebuilt = points.positions - points.pretravel[:, None] * points.normals, True
    if kind == BARE_SURFACE:
        return None, False
    if kind in ("circle", "bore", "boss"):
        axis = association.direction
    found = associate_by(association.criterion, kind, plain, axis=axis, at=at, side=side)
    return found, rebuilt


def _quantities(
    kind: str, association: Association, before: Association | None, errors: FeatureErrors
) -> tuple[Quantity, ...]:
    found = []

    def add(
        name: str, row: FloatArray | None, value: float | None, plain: float | None, angle: bool
    ) -> None:
        if row is None or value is None:
            return
        parts = {
            cause: float(np.sqrt(max(part[0, 0], 0.0)))
            for cause, part in errors.parts(row[None]).items()
        }
        if errors.machine > 0.0 and not angle:
            parts[MACHINE] = errors.machine
        u = float(np.sqrt(sum(part**2 for part in parts.values())))
        found.append(Quantity(name, value, u, parts, plain, angle, errors.dof(row, u)))

    now, plain = association, before
    size = SIZE_NAMES.get(kind, "diameter")
    add(size, now.diameter_row, now.diameter, plain.diameter if plain else None, False)
    ring = plain.ring_diameter if plain else None
    add("ring diameter", now.ring_diameter_row, now.ring_diameter, ring, False)
    add("half angle", now.half_angle_row, now.half_angle, plain.half_angle if plain else None, True)
    for index, name in enumerate("xyz"):
        row: FloatArray | None = now.point_rows[index]
        if np.linalg.norm(now.located_along[:, index]) < _TANGENTIAL:
            row = None  # the points do not determine this coordinate
        add(name, row, float(now.point[index]), float(plain.point[index]) if plain else None, False)
    return tuple(found)
