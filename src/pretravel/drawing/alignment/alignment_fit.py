"""Where a part lies in the machine, from touches on its faces.

The pretravel depends on the normal at a touch, the normal on where the part lies: both are solved
together. The alignment is an association like that of a feature (`association.py`), with up to six
parameters, so that its uncertainty follows from the same errors of the points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import (
    MICROMETRE,
    BoolArray,
    ConvergenceError,
    FloatArray,
    IntArray,
    Placement,
    PretravelError,
    frozen,
)
from pretravel.drawing.alignment.alignment import MOTIONS, Alignment, Datum
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.drawing.features.extreme_association import GAUSSIAN, TANGENT
from pretravel.drawing.features.feature_uncertainty import errors_of_extreme, feature_errors
from pretravel.drawing.features.form_families import families_of_faces
from pretravel.drawing.features.form_of_part import Family
from pretravel.maps import PretravelMap
from pretravel.measurement import Association, apply
from pretravel.qualification import FEWEST_LEFT
from pretravel.surface import ContactSearch, Feet, Part, feet_on_faces, lattice
from pretravel.touches import travel_of_delay
from pretravel.uncertainty import outlier_factor

_DETERMINED = 1e-3
"""Mean change of the distances per movement of the touched points, from which a motion counts as
determined: below it, a touch error of 1 µm is 1 mm of the part."""
_CLOSED = 1e-9  # movement of the touched points at which the iteration ends [mm]
_ROUNDING = 1e-6
"""Movement that rounding leaves where few touches hardly determine the placement. [mm]"""
_MOST_ITERATIONS = 60
_ROUGH = 30  # steps in which touches that are far off have little weight
_NEARLY = 5e-3  # movement of the touched points at which these end [mm]
_TURN = 0.3  # largest turn in one step [rad]
_ROUNDS = 6  # of naming gross touches
_MANY_OF_FACE = 50  # touches of a face, among which one does not change the median
_FEWEST_FREE = 3  # degrees of freedom from which gross touches are looked for
_MANY_FREE = 20  # from which several are named at a time
_SEEN = 0.05  # least share of a touch's error in its residual: below, it determines a motion alone
_FORM = 10.0 * MICROMETRE  # that a face may have: a touch nearer to it is not gross
_SMALLEST = 0.1 * MICROMETRE  # scatter that touches have at least


def placement_onto(nominal: FloatArray, measured: FloatArray) -> Placement:
    """The placement that brings points of a part nearest to points of the machine.

    Parameters
    ----------
    nominal, measured : (n, 3) float
        [mm]

    References
    ----------
    Kabsch 1976, with the sign of the determinant.

    >>> corner = np.vstack([np.zeros(3), np.eye(3)])
    >>> placement_onto(corner, corner + [1.0, 2.0, 3.0]).shift.round(9).tolist()
    [1.0, 2.0, 3.0]
    """
    middle, there = nominal.mean(axis=0), measured.mean(axis=0)
    left, _, right = np.linalg.svd((measured - there).T @ (nominal - middle))
    sign = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(left @ right)))])
    turn = left @ sign @ right
    return Placement(frozen(turn), frozen(there - turn @ middle))


def align(
    tips: TipCentres,
    part: Part,
    pretravel_map: PretravelMap,
    start: Placement,
    *,
    datums: Sequence[Datum] = (),
    free: Sequence[str] = MOTIONS,
    extrapolate: bool = False,
) -> Alignment:
    """Determine where a part lies from touches on its faces, beginning near the answer.

    All touches have the same weight: the form of a part, which no uncertainty of a point contains,
    is mostly larger than what distinguishes these. Touches that do not fit are named and left out.
    Motions that the touches do not determine stay as in `start`.

    Parameters
    ----------
    tips : TipCentres
    part : Part
    pretravel_map : PretravelMap
        In the axes of the machine.
    start : Placement
        Near the answer: nearer than the distance between faces.
    datums : sequence of Datum, optional
        In the order of the drawing: each takes the motions that those before it left, by least
        squares. Other faces have no influence. The sizes of bores, bosses and balls are free.
    free : sequence of str
        The motions that are determined, of `MOTIONS`, along the machine's axes about the middle of
        the touches.
    extrapolate : bool
        Also for normals outside the directions of the map.

    Returns
    -------
    Alignment

    Raises
    ------
    PretravelError
        A datum that was not touched, or is given twice; a map with a signal delay, and touches
        without feeds.
    ConvergenceError

    Notes
    -----
    With a small shift s and turn w of the part about c, the distance of a point from its face
    changes by -n · s - ((q - c) × n) · w, where q is the nearest point of the face and n the
    normal there. Its nearest point and normal are found again in each step.
    """
    unknown = sorted(set(free) - set(MOTIONS))
    if unknown or not free:
        raise PretravelError(
            f"the motions are {', '.join(MOTIONS)}; given: {', '.join(free) or 'none'}",
            inputs=("free",),
        )
    names = [datum.name for datum in datums]
    double = [name for name in names if names.count(name) > 1]
    if double:
        raise PretravelError(
            f"datum {double[0]} is given twice: give all its faces together", inputs=("datum",)
        )
    moving = np.isin(MOTIONS, list(free))
    fit = _Fit(tips, part, pretravel_map, tuple(datums), moving)
    face = tips.faces
    taken, gross = np.ones(len(tips), dtype=bool), np.zeros(len(tips), dtype=bool)
    state = fit.solved(start, face, taken)
    for _ in range(_ROUNDS):
        wrong = fit.gross(state, taken & ~gross)
        if not wrong.any() or np.mean(gross | wrong) > 1.0 - FEWEST_LEFT:
            break
        gross = gross | wrong
        state = fit.solved(state.placement, state.feet.face, taken & ~gross)
    if gross.any():  # they have moved the others too, some from near an edge onto another face
        nearest = fit.nearest_faces(state.placement) if face is None else state.feet.face
        state = fit.solved(state.placement, nearest, taken & ~gross)
        gross = gross & (np.abs(state.distance) > _FORM)
        state = fit.solved(state.placement, nearest, taken & ~gross)
    idle = state.idle
    acting = tuple(datum for datum in datums if datum.name not in idle)
    if idle and acting:  # the touches of the others move nothing, and do not count as used
        fit = replace(fit, datums=acting)
        state = fit.solved(state.placement, state.feet.face, taken & ~gross)
    if any(datum.outside for datum in fit.datums):
        state = fit.outside(state)
    found = fit.alignment(state, gross, extrapolate=extrapolate)
    return replace(found, idle_datums=idle if acting else ())


@dataclass(frozen=True, eq=False)
class _State:
    """The touches at one placement."""

    placement: Placement
    feet: Feet
    normals: FloatArray  # machine frame
    distance: FloatArray
    about: FloatArray
    slopes: FloatArray  # (n, 6) change of the distances by motions
    used: BoolArray
    motions: FloatArray  # (6, m) that are determined
    left: FloatArray  # (6, 6 - m) that are not
    response: FloatArray  # (6, n) of the motions, by the distances
    idle: tuple[str, ...]  # datums that fix no motion


@dataclass(frozen=True, eq=False)
class _Fit:
    tips: TipCentres
    part: Part
    pretravel_map: PretravelMap
    datums: tuple[Datum, ...]
    moving: BoolArray

    def at(
        self, placement: Placement, face: IntArray, taken: BoolArray, *, edges: bool = True
    ) -> _State:
        """Distances from the faces, and what they say of the motions.

        With `edges` touches beyond those of their face are not used.
        """
        feet = feet_on_faces(self.part, placement.inverse.points(self.tips.positions), face)
        normals = placement.vectors(feet.local.normal)
        late = np.nan_to_num(self.pretravel_map.pretravel(normals, extrapolate=True))
        if self.pretravel_map.delay is not None:
            travel = travel_of_delay(self.tips.feeds, self.pretravel_map.delay)
            approaches = -normals if self.tips.approaches is None else self.tips.approaches
            late = late - travel * np.sum(approaches * normals, axis=1)
        distance = feet.distance - self.pretravel_map.tip_radius + late
        used = taken & self._on_datums(feet.face)
        if edges and np.any(used & feet.inside):  # one beyond the edges says nothing of the face
            used &= feet.inside
        foot = placement.points(feet.local.point)
        about = foot[used].mean(axis=0)
        slopes = -np.column_stack([normals, np.cross(foot - about, normals)])
        by_motion = self._response(slopes, foot[used] - about, feet.face, used)
        return _State(placement, feet, normals, distance, about, slopes, used, *by_motion)

    def _on_datums(self, face: IntArray) -> BoolArray:
        if not self.datums:
            return np.ones(len(face), dtype=bool)
        for datum in self.datums:
            if not np.isin(face, datum.faces).any():
                raise PretravelError(
                    f"no touch lies on the faces of datum {datum.name}", inputs=("datum",)
                )
        return np.isin(face, [index for datum in self.datums for index in datum.faces])

    def _response(
        self, slopes: FloatArray, arms: FloatArray, face: IntArray, used: BoolArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, tuple[str, ...]]:
        """Motions that are determined, (6, m), and not, and their change by distances, (6, n).

        Last the names of the datums that determine none of the motions that are left to them.
        """
        lever = max(math.sqrt(float(np.mean(np.sum(arms**2, axis=1)))), 1e-3)
        scale = np.array([1.0, 1.0, 1.0, *(3 * [1.0 / lever])])
        left = np.eye(6)[:, self.moving]
        response, found, idle = np.zeros((6, len(face))), [], []
        stages = self.datums or (Datum("", tuple(range(len(self.part.faces)))),)
        for datum in stages:
            mine = used & np.isin(face, datum.faces)
            if not mine.any():
                continue
            if left.shape[1] == 0:
                idle.append(datum.name)
                continue
            mean = slopes[mine] * scale
            sizes = _size_columns(self.part, face[mine]) if datum.name else mean[:, :0]
            columns = _without(sizes, mean @ left)
            u, size, v = np.linalg.svd(columns, full_matrices=len(columns) < left.shape[1])
            rank = int(np.sum(size > _DETERMINED * math.sqrt(len(columns))))
            if rank == 0:
                idle.append(datum.name)
                continue
            taken = left @ v[:rank].T
            inverse = -(taken / size[:rank]) @ _without(sizes, u[:, :rank]).T
            # What the datums before it did has moved these faces too.
            change = (inverse @ mean) @ response
            change[:, mine] += inverse
            response += change
            found.append(taken)
            left = left @ v[rank:].T
        motions = np.hstack(found) if found else np.zeros((6, 0))
        motions, left, response = (part * scale[:, None] for part in (motions, left, response))
        return motions, left, response, tuple(idle)

    def solved(self, start: Placement, face: IntArray | None, taken: BoolArray) -> _State:
        """The placement at which the used distances are least."""
        placement, own = start, face
        if own is None:
            placement = self._roughly(start, taken)
            own = self.nearest_faces(placement)
        for _ in range(_ROUNDS):
            state = self.at(placement, own, taken)
            # The touches that are used do not change within a round, or it could go to and fro.
            used = state.used
            for _ in range(_MOST_ITERATIONS):
                motion = state.response @ state.distance
                state, moved = self._advanced(state, motion, own, used, edges=False)
                if moved < _CLOSED:
                    break
            placement = state.placement
            nearest = own if face is not None else self.nearest_faces(placement)
            if np.all(nearest == own):
                break
            own = nearest
        if moved >= _ROUNDING:
            raise ConvergenceError(
                f"the alignment did not converge: it still moves by {moved / MICROMETRE:.3g} µm "
                f"after {_MOST_ITERATIONS} steps. Give a start that is nearer",
                inputs=("start",),
            )
        return state

    def _roughly(self, start: Placement, taken: BoolArray) -> Placement:
        """A placement nearer than the start, by steps in which touches far off have little weight.

        The touches are on the faces of the nearest samples, which the steps can change.
        """
        state = self.at(start, self._faces_of_samples(start), taken)
        for _ in range(_ROUGH):
            state, moved = self._advanced(state, _robust(state), None, taken)
            if moved < _NEARLY:
                break
        return state.placement

    def _advanced(
        self,
        state: _State,
        motion: FloatArray,
        face: IntArray | None,
        taken: BoolArray,
        *,
        edges: bool = True,
    ) -> tuple[_State, float]:
        """The state after a motion, and how far the touched points moved against the part. [mm]"""
        turn = float(np.linalg.norm(motion[3:]))
        motion = motion * min(1.0, _TURN / max(turn, 1e-300))
        moved = float(np.max(np.abs(state.slopes @ motion), initial=0.0))
        placement = state.placement.moved(motion, state.about)
        face = self._faces_of_samples(placement) if face is None else face
        return self.at(placement, face, taken, edges=edges), moved

    def _faces_of_samples(self, placement: Placement) -> IntArray:
        """The face of the nearest sample of the part: quick, and wrong near some edges."""
        cloud = self.part.cloud_of_chosen
        points = placement.inverse.points(self.tips.positions)
        return np.asarray(cloud.face[cloud.tree.query(points, workers=-1)[1]])

    def nearest_faces(self, placement: Placement) -> IntArray:
        points = placement.inverse.points(self.tips.positions)
        return ContactSearch(self.part, len(points)).nearest_faces(points)[0]

    def gross(self, state: _State, taken: BoolArray) -> BoolArray:
        """Used touches far from their faces, compared with the others.

        Among few touches one gross error moves all: the largest is compared with what is left
        without it (externally studentized residuals). Among many, several are compared with the
        median. Each is compared with the others of its face, too, and with a form of 10 µm: what
        the form of faces does to the placement is in its uncertainty.
        """
        mine = np.flatnonzero(state.used & taken)
        free = len(mine) - state.motions.shape[1]
        wrong = np.zeros(len(taken), dtype=bool)
        if free < _FEWEST_FREE:
            return wrong
        change = np.sum(state.slopes[mine] * state.response[:, mine].T, axis=1)
        left = 1.0 + change  # share of a touch's error that is in its own residual
        size = np.where(left > _SEEN, np.abs(state.distance[mine]), 0.0)
        size = size / np.sqrt(np.maximum(left, _SEEN))
        worst = int(np.argmax(size))
        others = max(float(np.sum(state.distance[mine] ** 2)) - float(size[worst]) ** 2, 0.0)
        # The largest has dragged the others along: what they are without it.
        dragged = state.slopes[mine] @ state.response[:, mine[worst]]
        dragged *= state.distance[mine[worst]] / max(float(left[worst]), _SEEN)
        freed = np.where(size > 0.0, np.abs(state.distance[mine] - dragged), 0.0)
        freed = freed / np.sqrt(np.maximum(left, _SEEN))
        freed[worst] = size[worst]
        # A face that is bowed, displaced or larger as a whole is no error of its touches.
        form = np.maximum(1.4826 * _of_the_others(freed, state.feet.face[mine]), _SMALLEST)
        scale = max(math.sqrt(others / (free - 1)), float(form[worst]))
        if size[worst] > max(outlier_factor(len(mine), free - 1) * scale, _FORM):
            wrong[mine[worst]] = True
        if free >= _MANY_FREE:
            among = np.maximum(form, 1.4826 * float(np.median(freed)))
            limit = np.maximum(outlier_factor(len(mine), free) * among, _FORM)
            # Smaller ones may only have been moved by the larger.
            wrong[mine[(freed > limit) & (freed > 0.5 * size[worst])]] = True
        return wrong

    def outside(self, state: _State) -> _State:
        """The datums from outside the material, from those of least squares."""
        for _ in range(_MOST_ITERATIONS):
            motion, motions, response = self._touching(state)
            used, face = state.used, state.feet.face
            state, moved = self._advanced(state, motion, face, used, edges=False)
            if moved < _CLOSED:
                return replace(state, motions=motions, response=response)
        raise ConvergenceError(
            "the fit of the datums from outside the material did not converge: touch more places "
            "of each datum, or use least squares",
            inputs=("datum_association",),
        )

    def _touching(self, state: _State) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Motion by linear programs, datum after datum; motions, and their change by distances."""
        face, used = state.feet.face, state.used
        arms = state.placement.points(state.feet.local.point)[used] - state.about
        lever = max(math.sqrt(float(np.mean(np.sum(arms**2, axis=1)))), 1e-3)
        scale = np.array([1.0, 1.0, 1.0, *(3 * [1.0 / lever])])
        left = np.eye(6)[:, self.moving]
        motion, response, found = np.zeros(6), np.zeros((6, len(face))), []
        for datum in self.datums:
            mine = np.flatnonzero(used & np.isin(face, datum.faces))
            slopes = state.slopes[mine] * scale
            sizes = _size_columns(self.part, face[mine])
            columns = _without(sizes, slopes @ left)
            _, size, v = np.linalg.svd(columns, full_matrices=True)
            rank = int(np.sum(size > _DETERMINED * math.sqrt(len(columns))))
            taken = left @ v[:rank].T
            left = left @ v[rank:].T
            if rank == 0:
                continue
            distance = state.distance[mine] + slopes @ motion
            if datum.outside:
                free = sizes.shape[1] > 0
                amounts, inverse = touching(distance, slopes @ taken, face[mine], free)
            else:
                inverse = -np.linalg.pinv(columns @ v[:rank].T)
                amounts = inverse @ _without(sizes, distance[:, None])[:, 0]
            motion = motion + taken @ amounts
            change = (taken @ inverse @ slopes) @ response
            change[:, mine] += taken @ inverse
            response += change
            found.append(taken)
        motions = np.hstack(found) if found else np.zeros((6, 0))
        return scale * motion, motions * scale[:, None], response * scale[:, None]

    def _families(self, feet: Feet, rows: IntArray) -> tuple[Family, ...]:
        """What the form of the faces may be: each displaced, of another size, or smooth."""
        face, places, curved = feet.face[rows], np.zeros((len(rows), 2)), []
        for index in np.unique(face):
            mine, own = face == index, self.part.faces[int(index)]
            local, here = own.local(lattice(*own.box, np.array([9, 9]))), feet.local
            flat = own.kind == "plane"
            whole = local.point if flat else local.normal
            touched = (here.point if flat else here.normal)[rows[mine]]
            whole = whole[np.isfinite(whole).all(axis=1)]
            middle = 0.5 * (whole.min(axis=0) + whole.max(axis=0))
            axes = np.linalg.svd(whole - middle, full_matrices=False)[2][:2]
            reach = np.maximum(np.abs((whole - middle) @ axes.T).max(axis=0), 1e-12)
            places[mine] = (touched - middle) @ axes.T / reach
            curved += [int(index)] if own.kind in ("cylinder", "sphere") else []
        return families_of_faces(face, curved, np.clip(places, -1.0, 1.0))

    def alignment(self, state: _State, gross: BoolArray, *, extrapolate: bool) -> Alignment:
        outside = any(datum.outside for datum in self.datums)
        placement = state.placement
        foot = placement.points(state.feet.local.point)
        touches = self.tips.touches(state.normals, foot)
        rows = np.flatnonzero(state.used)
        # A touch that is not used may be next to any face: its normal is no reason to refuse.
        apply(touches.take(rows), self.pretravel_map, extrapolate=extrapolate)
        points = apply(touches, self.pretravel_map, extrapolate=True)
        assert points.deviation is not None
        on_part = points[rows]
        jacobian = state.slopes[rows] @ state.motions
        amounts = np.linalg.pinv(state.motions) @ state.response[:, rows]
        residuals = points.deviation[rows]
        if self.datums:
            sizes = _size_columns(self.part, state.feet.face[rows])
            inverse = -np.linalg.pinv(sizes)
            amounts = np.vstack([amounts, inverse + (inverse @ jacobian) @ amounts])
            residuals = residuals + sizes @ (inverse @ residuals)
            jacobian = np.hstack([jacobian, sizes])
        association = Association(
            points=on_part.positions,
            outward=on_part.normals,
            residuals=residuals,
            jacobian=jacobian,
            point=state.about,
            point_rows=state.motions[:3],
            located_along=np.eye(3),
            stated_response=amounts,
            criterion=TANGENT if outside else GAUSSIAN,
        )
        families = self._families(state.feet, rows)
        if outside:
            of_touch = np.unique(state.feet.face[rows], return_inverse=True)[1]
            means = (np.bincount(of_touch, residuals) / np.bincount(of_touch))[of_touch]
            about = replace(association, residuals=residuals - means)
            errors = feature_errors(on_part, about, families=families)
            errors = errors_of_extreme(errors, association, -means, stated=True)
        else:
            errors = feature_errors(on_part, association, families=families)
        return Alignment(
            placement=placement,
            part=self.part,
            points=points,
            feet=state.feet,
            used=state.used,
            gross=gross,
            about=frozen(state.about),
            motions=state.motions,
            undetermined=_in_part(state.left, placement, state.about),
            association=association,
            errors=errors,
        )


def touching(
    distance: FloatArray, slopes: FloatArray, face: IntArray, sizes_are_free: bool
) -> tuple[FloatArray, FloatArray]:
    """Motions that bring faces to touch the material from outside: a linear program (HiGHS).

    Parameters
    ----------
    distance : (n,) float
        Of the points from their faces, positive outside of the part. [mm]
    slopes : (n, k) float
        Their change by the motions.
    face : (n,) int
    sizes_are_free : bool
        Bores, bosses or balls: the largest distance is made least. Planes: the largest distance
        from a plane beyond which there is no point.

    Returns
    -------
    (k,) float
        Amounts of the motions.
    (k, n) float
        Their change by the distances of the points: of those on which the faces rest.

    >>> x = np.array([-1.0, 0.0, 1.0])
    >>> slopes = np.c_[-np.ones(3), x]
    >>> amounts, rests = touching(np.array([0.1, 0.0, 0.1]), slopes, np.zeros(3), False)
    >>> (amounts.round(9) + 0.0).tolist(), (rests[0].round(9) + 0.0).tolist()
    ([0.1, 0.0], [0.5, 0.0, 0.5])
    """
    from scipy.optimize import linprog

    count, k = slopes.shape
    of_face = (face[:, None] == np.unique(face)).astype(float)
    if sizes_are_free:
        heights = -np.ones((count, 1))
        rows, off = np.hstack([slopes, heights]), distance
        goal = np.append(np.zeros(k), 1.0)
    else:
        # A face whose place the motions cannot change keeps its distance.
        fixed = [
            float(np.linalg.norm(one - slopes @ np.linalg.lstsq(slopes, one, rcond=None)[0])) > 1e-6
            for one in of_face.T
        ]
        kept = of_face[:, np.array(fixed)]
        rows = np.vstack([np.hstack([slopes, -kept, np.zeros((count, 1))]),
                          np.hstack([-slopes, kept, -np.ones((count, 1))])])  # fmt: skip
        off = np.concatenate([distance, -distance])
        goal = np.append(np.zeros(k + kept.shape[1]), 1.0)
    scale = max(float(np.ptp(distance)), 1e-9)
    found = linprog(
        goal, A_ub=rows, b_ub=-off / scale, bounds=[(None, None)] * len(goal), method="highs"
    )
    if not found.success:
        raise ConvergenceError(
            f"a datum from outside the material was not found ({found.message}). Touch a bore or "
            "a boss all around, or associate the datum by least squares",
            inputs=("datum_association",),
        )
    active = np.flatnonzero(np.abs(np.asarray(found.slack)) < 1e-7)
    held = np.linalg.pinv(rows[active], rcond=1e-9)[:k]
    sign = np.where(active < count, 1.0, -1.0)
    inverse = np.zeros((k, count))
    np.add.at(inverse.T, active % count, -(held * sign).T)
    return scale * np.asarray(found.x)[:k], inverse


def _of_the_others(size: FloatArray, face: IntArray) -> FloatArray:
    """Of each touch, the median of the others on its face; zero of one that is alone, (n,)."""
    found = np.zeros(len(size))
    for name in np.unique(face):
        mine = np.flatnonzero(face == name)
        if len(mine) > _MANY_OF_FACE:
            found[mine] = np.median(size[mine])
        elif len(mine) > 1:
            found[mine] = [np.median(np.delete(size[mine], i)) for i in range(len(mine))]
    return found


def _robust(state: _State) -> FloatArray:
    """A step in which touches that are far off have little weight, (6,)."""
    rows = np.flatnonzero(state.used)
    distance = state.distance[rows]
    scale = max(2.0 * float(np.median(np.abs(distance))), MICROMETRE)
    root = 1.0 / np.sqrt(1.0 + (distance / scale) ** 2)
    jacobian = (state.slopes[rows] @ state.motions) * root[:, None]
    amounts = np.linalg.lstsq(jacobian, -distance * root, rcond=None)[0]
    return np.asarray(state.motions @ amounts)


def _without(sizes: FloatArray, columns: FloatArray) -> FloatArray:
    """What of columns the free sizes cannot explain."""
    if sizes.shape[1] == 0:
        return columns
    return np.asarray(columns - sizes @ (np.linalg.pinv(sizes) @ columns))


def _size_columns(part: Part, face: IntArray) -> FloatArray:
    """One column for each face whose size is free: its distances change alike."""
    curved = [
        index for index in np.unique(face) if part.faces[index].kind in ("cylinder", "sphere")
    ]
    return np.array([(face == index).astype(float) for index in curved]).reshape(-1, len(face)).T


def _in_part(motions: FloatArray, placement: Placement, about: FloatArray) -> FloatArray:
    """Motions about a point of the machine as motions about the part's origin, in its axes."""
    turn = placement.rotation.T @ motions[3:]
    arm = placement.shift - about
    shift = placement.rotation.T @ (motions[:3] + np.cross(motions[3:].T, arm).T)
    return np.vstack([shift, turn])
