"""Features that rest on their extreme points: minimum zone, inscribed, circumscribed, tangent."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from pretravel.base import ConvergenceError, FloatArray, IntArray, PretravelError, frozen
from pretravel.measurement import Association, associate, moved_association

GAUSSIAN, MINIMUM_ZONE, TANGENT = "gaussian", "minimum-zone", "tangent"
INSCRIBED, CIRCUMSCRIBED = "inscribed", "circumscribed"
_FLAT = ("plane", "line")
_ROUND = ("circle", "bore", "boss", "sphere", "cylinder")
_OTHERS = ("cone", "torus", "slot")
KINDS_BY_CRITERION: dict[str, tuple[str, ...]] = {
    GAUSSIAN: (*_ROUND, *_OTHERS, *_FLAT),
    MINIMUM_ZONE: (
        *_ROUND,
        "cone",
        "torus",
        *_FLAT,
    ),  # that of a slot is not one: its planes differ
    INSCRIBED: (*_ROUND, *_OTHERS),
    CIRCUMSCRIBED: (*_ROUND, *_OTHERS),
    TANGENT: (*_FLAT, *_ROUND, "cone", "torus"),
}
"""The associations, by name, with the features that they have."""

_STEPS = 100
_FIRST_REACH = 2.0  # of a step, in ranges of the residuals
_LEAST_GAIN = 1e-7  # in ranges of the residuals: what the solver of linear programs resolves
_LEAST_RANGE = 1e-9  # of the residuals, in sizes of the feature: a smaller one is rounding
_ROUNDING = 1e-14  # of a distance, in sizes of the feature
_TOUCHES = 1e-6  # of a range of the residuals: what is as near as the contacts
_DEPENDENT = 1e-3  # of slopes: another contact holds nothing more
_CARRIES = 1e-6  # share of the load on a point below which the feature does not rest on it


def check_criterion(criterion: str, kind: str) -> None:
    """Refuse an association that is not known, or that a feature does not have.

    >>> check_criterion("inscribed", "bore")
    >>> check_criterion("inscribed", "plane")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: a plane has no association 'inscribed', which is for ...
    """
    if criterion not in KINDS_BY_CRITERION:
        raise PretravelError(
            f"'{criterion}' is not an association: {', '.join(KINDS_BY_CRITERION)}",
            inputs=("association",),
        )
    if (criterion, kind) == (TANGENT, "surface"):
        return  # touched places of a datum, which rest on the part (`datum_system`)
    if criterion != GAUSSIAN and kind not in KINDS_BY_CRITERION[criterion]:
        raise PretravelError(
            f"a {kind} has no association '{criterion}', which is for "
            f"{', '.join(KINDS_BY_CRITERION[criterion])}",
            inputs=("association", "feature"),
        )


@dataclass(frozen=True, eq=False)
class _Load:
    """The points on which a feature rests.

    Attributes
    ----------
    row : (m,) int
        Of the points.
    sign : (m,) float
        1 where the point bounds the feature from outside, -1 from inside.
    share : (m,) float
        Multipliers; their sum is 1.
    """

    row: IntArray
    sign: FloatArray
    share: FloatArray


def associate_by(
    criterion: str,
    kind: str,
    points: npt.ArrayLike,
    *,
    axis: npt.ArrayLike | None = None,
    at: npt.ArrayLike | None = None,
    side: str = "",
) -> Association:
    """Associate a feature with points by least squares or by its extreme points.

    Parameters
    ----------
    criterion : str
        gaussian: smallest sum of squared distances. minimum-zone: smallest range of the distances;
        the feature is in the middle of the zone. inscribed: largest feature that has no point
        inside, circumscribed: smallest feature that has no point outside (by its diameter; of a
        cone that at the middle of the points, of a torus that of the tube, of a slot its width).
        tangent: feature outside the material whose largest distance from a point is smallest,
        which is the free side of the minimum zone (all but the slot).
    kind, points, at
        As of `associate`.
    axis : (3,) float, optional
        As of `associate`. A tangent plane or line needs it: the direction out of the material.
    side : str
        "inside" or "outside": where the surface of a tangent round feature is, seen from its axis
        or centre; a bore is inside, a boss and a sphere are outside.

    Returns
    -------
    Association
        Its `response` is that of the points on which the feature rests; the other points do not
        move it.

    Raises
    ------
    PretravelError
        A criterion that the feature does not have; points that do not determine the feature, or do
        not surround an inscribed or circumscribed one.
    ConvergenceError
        The search does not end.

    Notes
    -----
    From the feature of least squares, linear programs (HiGHS) in the change of the parameters,
    each within a limited distance, with the exact distances after each step. The points on which
    the linear program rests give a second step with the curvature of the distances (Newton), which
    a feature needs that rests on few points, as a circumscribed circle on two opposite ones. The
    better step is taken.

    A circumscribed circle or sphere is the only one there is. All others are local optima, those
    near the feature of least squares: an inscribed feature, or a minimum zone of points whose form
    is not small against their extent, may have others.

    Where more points touch the feature than determine it, `response` is that of one set of them;
    where contacts leave a direction open (symmetric points without noise), that of least squares.

    References
    ----------
    SLP-EQP: R. Fletcher, E. Sainz de la Maza, Mathematical Programming 43 (1989) 235.

    >>> angle = np.arange(8) * np.pi / 4
    >>> wave = 10.0 + 0.001 * np.array([1, -1, 1, -1, 1, -1, 1, -1])
    >>> lobes = np.stack([wave * np.cos(angle), wave * np.sin(angle), 0 * angle], axis=1)
    >>> zone = associate_by("minimum-zone", "circle", lobes)
    >>> round(zone.form, 9), round(zone.diameter, 9)
    (0.002, 20.0)
    >>> round(associate_by("inscribed", "circle", lobes).diameter, 9)
    19.998
    """
    check_criterion(criterion, kind)
    gaussian = associate(kind, points, axis=axis, at=None if criterion != GAUSSIAN else at)
    if criterion == GAUSSIAN:
        return gaussian
    side = side or {"bore": "inside", "boss": "outside", "sphere": "outside"}.get(kind, "")
    if criterion == TANGENT and kind not in _FLAT and not side:
        raise PretravelError(
            f"a tangent {kind} lies outside the material, and the points have no normals that say "
            "on which side this is",
            inputs=("association",),
        )
    if criterion == TANGENT and kind in _FLAT and axis is None:
        raise PretravelError(
            f"a tangent {kind} lies outside the material, and the points have no normals that say "
            "on which side this is. Give the direction out of the material",
            inputs=("axis", "association"),
        )
    reference = gaussian.points.mean(axis=0) if at is None else np.asarray(at, dtype=np.float64)
    slant = 1.0 if gaussian.half_angle is None else float(np.cos(gaussian.half_angle))
    outer = -1.0 if side == "inside" and kind not in _FLAT else 1.0
    spread = float(np.ptp(gaussian.residuals))
    search = _Search(criterion, kind, _size(gaussian), spread, slant, outer)
    found, load = search.optimum(gaussian)
    response = search.response(found, load)
    nothing = np.zeros(gaussian.jacobian.shape[1])
    return replace(
        moved_association(kind, found, nothing, reference),
        stated_response=frozen(response),
        criterion=criterion,
    )


def _size(a: Association) -> float:
    return max(float(np.ptp(a.points, axis=0).max()), a.diameter or 0.0, a.ring_diameter or 0.0)


def _refuse_open(criterion: str, start: Association, found: Association, rounding: float) -> None:
    """Refuse points that do not surround an inscribed or circumscribed feature.

    The centre of an inscribed circle lies between the points that it touches, so that their
    smallest circle is not smaller; and the contrary for a circumscribed one.
    """
    if criterion not in (INSCRIBED, CIRCUMSCRIBED) or start.half_angle or start.ring_diameter:
        return
    assert start.diameter is not None
    assert found.diameter is not None
    change = 0.5 * (found.diameter - start.diameter)
    low, high = float(start.residuals.min()), float(start.residuals.max())
    too_large = criterion == INSCRIBED and change > high + rounding
    if too_large or (criterion == CIRCUMSCRIBED and change < low - rounding):
        raise PretravelError(
            f"the points do not surround the {criterion} feature: it would move away from them "
            f"without limit, or to the middle of an arc. Touch more than half of the circumference "
            "(of a sphere more than a half), or take the association of least squares",
            inputs=("association",),
        )


@dataclass(frozen=True, eq=False)
class _Search:
    """The search for one feature.

    `size` is that of the feature, `spread` the Gaussian range, `slant` the cosine of a cone's half
    angle, `outer` 1 where the free side of the surface is that of its outward normals, else -1.
    """

    criterion: str
    kind: str
    size: float
    spread: float
    slant: float = 1.0
    outer: float = 1.0

    @property
    def one_sided(self) -> float:
        """1 with all points inside, -1 with all outside, 0 for a zone."""
        return {CIRCUMSCRIBED: 1.0, INSCRIBED: -1.0}.get(self.criterion, 0.0)

    @property
    def signs(self) -> tuple[float, ...]:
        """Of the bounds: 1 outside, -1 inside."""
        return (self.one_sided,) if self.one_sided else (1.0, -1.0)

    @property
    def width(self) -> float:
        """The size of the zone that is searched, not zero. [mm]"""
        return max(self.spread, _LEAST_RANGE * self.size)

    @property
    def rounding(self) -> float:
        return _ROUNDING * self.size

    @property
    def offset(self) -> int:
        """The parameter that moves the surface along its normals everywhere."""
        return 0 if self.kind in _FLAT else 4 if self.kind == "cone" else -1

    def centred(self, a: Association) -> Association:
        """With the best offset: that which touches, or the middle of the zone."""
        low, high = float(a.residuals.min()), float(a.residuals.max())
        free = high if self.outer > 0.0 else low
        middle = {CIRCUMSCRIBED: high, INSCRIBED: low, TANGENT: free}
        change = np.zeros(a.jacobian.shape[1])
        change[self.offset] = middle.get(self.criterion, 0.5 * (low + high)) * self.unit(a)
        return moved_association(self.kind, a, change)

    def unit(self, a: Association) -> float:
        """Change of the parameter `offset` that moves the surface by 1 mm."""
        return float(1.0 / abs(a.jacobian[0, self.offset])) if self.kind == "cone" else 1.0

    def cost(self, a: Association) -> float:
        """What is smallest at the optimum: half the zone, or the radius with its sign. [mm]"""
        if self.one_sided:
            assert a.diameter is not None
            return self.one_sided * 0.5 * a.diameter * self.slant
        return 0.5 * float(np.ptp(a.residuals))

    def optimum(self, start: Association) -> tuple[Association, _Load]:
        """The feature near to a first one, and the points on which it rests."""
        here = self.centred(start)
        width, reach = self.width, _FIRST_REACH
        for _ in range(_STEPS):
            step, gain, load = self._linear_step(here, width, reach)
            if gain <= _LEAST_GAIN * width + self.rounding:
                break
            other = self._curved_step(here, load)
            steps = [step, other] if self._length(here, other) <= 2.0 * reach * width else [step]
            tried = [self.centred(moved_association(self.kind, here, each)) for each in steps]
            best = min(tried, key=self.cost)
            better = self.cost(here) - self.cost(best)
            if better > 0.0:
                here = best
                _refuse_open(self.criterion, start, here, self.rounding)
            reach *= 2.0 if better > 0.5 * gain else 0.25
            if reach * width < self.rounding:
                break
        else:
            raise ConvergenceError(
                f"the {self.criterion} {self.kind} was not found in {_STEPS} steps: the points do "
                "not determine it (an inscribed or circumscribed one needs points all around, a "
                "cylinder at both ends). Touch more places, or take the association of least "
                "squares",
                inputs=("association",),
            )
        last = self.centred(moved_association(self.kind, here, self._curved_step(here, load)))
        if self.cost(last) <= self.cost(here) + 10.0 * self.rounding:
            here = last
        return here, load

    def _scale(self, a: Association) -> FloatArray:
        """Change of each parameter that moves a point by 1 mm. [1 or rad/mm]"""
        return np.asarray(1.0 / np.maximum(np.abs(a.jacobian).max(axis=0), 1e-300))

    def _length(self, a: Association, step: FloatArray) -> float:
        return float(np.max(np.abs(step / self._scale(a))))

    def _middle_residuals(self, a: Association) -> FloatArray:
        """Distances from the middle of a zone, or from the feature. [mm]"""
        if self.one_sided:
            return a.residuals
        return np.asarray(a.residuals - 0.5 * (a.residuals.min() + a.residuals.max()))

    def _linear_step(
        self, a: Association, width: float, reach: float
    ) -> tuple[FloatArray, float, _Load]:
        """Change of the parameters by the linearised problem, what it gains, and its load."""
        from scipy.optimize import linprog

        count, k = a.jacobian.shape
        scale, signs = self._scale(a), self.signs
        residuals = self._middle_residuals(a) / width
        rows = np.vstack([np.column_stack([s * a.jacobian * scale, -np.ones(count)])
                          for s in signs])  # fmt: skip
        bounds = [(-reach, reach)] * k + [(None, None)]
        if self.one_sided:
            bounds[self.offset % k] = (0.0, 0.0)  # that is the height itself
        found = linprog(
            np.eye(k + 1)[k],
            A_ub=rows,
            b_ub=np.concatenate([-s * residuals for s in signs]),
            bounds=bounds,
            method="highs",
        )
        if not found.success:
            raise ConvergenceError(f"the {self.criterion} {self.kind}: {found.message}")
        share = -np.asarray(found.ineqlin.marginals)
        carries = np.flatnonzero(share > _CARRIES)
        load = _Load(
            carries % count, np.repeat(signs, count)[carries], share[carries] / share.sum()
        )
        before = float(np.max([np.max(s * residuals) for s in signs]))
        solution = np.asarray(found.x)
        return width * scale * solution[:k], width * (before - float(solution[k])), load

    def _system(
        self, a: Association, load: _Load, *, curved: bool = True
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Conditions of an optimum on its points: matrix, scale and numbers of the parameters.

        Unknown are the change of the parameters, the height of the bounds and the multipliers.
        """
        free = np.arange(a.jacobian.shape[1])
        if self.one_sided:
            free = np.delete(free, self.offset)
        scale = self._scale(a)[free]
        slopes = load.sign[:, None] * a.jacobian[np.ix_(load.row, free)] * scale
        k, m = len(free), len(load.row)
        matrix = np.zeros((k + 1 + m, k + 1 + m))
        if curved:  # in units of the size, the multipliers are as large as the lengths
            bend = self._curvature(a, load)[np.ix_(free, free)]
            matrix[:k, :k] = self.size * bend * np.outer(scale, scale)
        matrix[k + 1 :, :k] = slopes
        matrix[k + 1 :, k] = -1.0
        matrix[: k + 1, k + 1 :] = matrix[k + 1 :, : k + 1].T
        return matrix, scale, free

    def _curvature(self, a: Association, load: _Load) -> FloatArray:
        """Second derivatives of the distances by the parameters, weighted by the load, (k, k)."""
        k = a.jacobian.shape[1]
        total = np.zeros((k, k))
        if self.kind in _FLAT or self.kind in _OTHERS:  # these rest on enough points
            return total
        assert a.diameter is not None
        turn = np.zeros((3, k)) if a.direction_rows is None else a.direction_rows
        for row, weight in zip(load.row, load.sign * load.share, strict=True):
            outward = a.outward[row]
            height = 0.0 if a.direction is None else (a.points[row] - a.point) @ a.direction
            radius = 0.5 * a.diameter + a.residuals[row]
            along = (np.eye(3) - np.outer(outward, outward)) @ (a.point_rows + height * turn)
            tilt = outward @ turn
            total += weight * (along.T @ along / radius - radius * np.outer(tilt, tilt))
        return total

    def _curved_step(self, a: Association, load: _Load) -> FloatArray:
        """Change of the parameters to where these points carry the feature."""
        matrix, scale, free = self._system(a, load)
        heights = -load.sign * self._middle_residuals(a)[load.row]
        wanted = np.concatenate([np.zeros(len(free)), [-self.size], heights])
        found = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
        step = np.zeros(a.jacobian.shape[1])
        step[free] = scale * found[: len(free)]
        return step

    def _completed(self, a: Association, load: _Load) -> _Load:
        """With points that touch without a load, until the contacts determine the feature.

        Of symmetric points some contacts carry nothing, but hold the feature.
        """
        residuals, free = self._middle_residuals(a), self._system(a, load)[2]
        slopes = (a.jacobian * self._scale(a))[:, free]
        row, sign = (
            np.tile(np.arange(len(residuals)), len(self.signs)),
            np.repeat(self.signs, len(residuals)),
        )
        rows = np.column_stack([sign[:, None] * slopes[row], -np.ones(len(row))])
        near = np.max(sign * residuals[row]) - sign * residuals[row] <= _TOUCHES * self.width
        held = np.column_stack([load.sign[:, None] * slopes[load.row], -np.ones(len(load.row))])
        _, size, basis = np.linalg.svd(held, full_matrices=False)
        along = basis[size > _DEPENDENT * size[0]]
        more: list[int] = []
        # Each contact holds a direction that was open, of which there are as many as columns.
        for _ in range(rows.shape[1] - len(along)):
            left = rows - (rows @ along.T) @ along
            best = int(np.argmax(near * np.linalg.norm(left, axis=1)))
            length = float(np.linalg.norm(left[best]))
            if not near[best] or length < _DEPENDENT:
                break
            more.append(best)
            along = np.vstack([along, left[best] / length])
        return _Load(
            np.concatenate([load.row, row[more]]),
            np.concatenate([load.sign, sign[more]]),
            np.concatenate([load.share, np.zeros(len(more))]),
        )

    def response(self, a: Association, load: _Load) -> FloatArray:
        """Change of the parameters for a movement of each point along its normal, (k, n).

        A direction that the contacts leave open, as a zone that is equally wide when it turns
        about three points in a row, follows all points as least squares do. A circumscribed
        feature on few points is held by its curvature.
        """
        load = self._completed(a, load)
        matrix, scale, free = self._system(a, load, curved=self.criterion == CIRCUMSCRIBED)
        k = len(free)
        changed = -np.linalg.pinv(matrix)[:, k + 1 :] * load.sign
        found = np.zeros(a.jacobian.shape[::-1])
        rows = np.zeros((len(found), len(load.row)))
        rows[free] = scale[:, None] * changed[:k]
        if self.one_sided or self.criterion == TANGENT:
            rows[self.offset] += (self.one_sided or self.outer) * changed[k] * self.unit(a)
        np.add.at(found.T, load.row, rows.T)
        if self.criterion != CIRCUMSCRIBED:
            basis = np.linalg.svd(matrix[k + 1 :, : k + 1])
            left = basis[2][np.count_nonzero(basis[1] > _DEPENDENT * basis[1][0]) :, :k]
            way = np.zeros((len(found), len(left)))
            way[free] = scale[:, None] * left.T
            fit = np.linalg.pinv(a.jacobian @ way)
            found -= way @ (fit + (fit @ a.jacobian) @ found)
        return found
