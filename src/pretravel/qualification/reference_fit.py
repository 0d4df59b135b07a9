"""Several references in one fit: what touches on blocks, rings, pins and spheres say together.

Every touch is one equation: the spindle point lies on the surface of its reference, farther by the
tip's radius and nearer by the pretravel of its direction. Unknown are where the references are, the
pretravel of each direction (no form of a map is assumed), the terms of the machine
(`machine_terms`), sizes that are not known, squareness and parallelism of blocks, a drift. What is
known of them in advance has its uncertainty; all others are given one so wide that it says nothing.
A term is stated where the touches make its uncertainty smaller. Where they do not, the fit names
the quantities that they do not distinguish from it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    REFERENCE_DIAMETER,
    U_OF_DIAMETER,
    BoolArray,
    FloatArray,
    IntArray,
    PretravelError,
    azimuth_angle,
    checked,
    frozen,
    polar_angle,
    turned_about_axes,
    unit,
)
from pretravel.maps import (
    STEEL_EXPANSION,
    TERMS,
    WIDE,
    MachinePriors,
    MachineTerms,
    displacements,
    last_moves,
)
from pretravel.qualification.axis_errors import AxisErrors, hypotheses
from pretravel.touches import Touches
from pretravel.uncertainty import algebraic_sphere, coverage_factor

SHAPES = ("block", "ring", "pin", "sphere")
_PAIRS_OF_AXES = {"x and y": (0, 1), "x and z": (0, 2), "y and z": (1, 2)}
SAME_DIRECTION = 1.0 * DEGREE
"""Contact normals that are closer share their pretravel: a lobe of three changes by 3 % of itself
over one degree."""
_SAME_APPROACH = 8.0 * DEGREE
"""Approaches that are closer share it, too: the tip slides as far."""
_PRETRAVEL = 0.1
"""Pretravel that says nothing in advance, standard deviation. [mm]"""
_PLACE, _TILT = 10.0, 0.1
"""The same of a place or an unknown size [mm], and of a tilt [rad]."""
_UPRIGHT = 0.005
"""The same of the tilt of a block that stands on a plate or a table. [rad]"""
_ALIKE = 0.5
"""Lengths of a block that differ by less are one length. [mm]"""
_UNSQUARE = 0.01
"""The same of the angle of two faces of a block. [rad]"""
_DRIFT = 0.02
"""The same of each power of a drift over the touches. [mm]"""
_POWERS = 3
_WEAKER, _OPEN = 10.0, 1.1
"""Where what says nothing in advance says ten times less, the uncertainty of a quantity that the
touches determine stays as it is; one that grows by more than a tenth is not determined."""
_NAMED = 0.25
"""Share of the largest part of a combination that names a quantity."""
_OF = "pretravel of "
_FEWEST_FREE = 3.0
_ROUNDS = 8
_ROUNDS_OF_NOISE = 2
_NO_WEIGHT = 1e-4
_NO_DOUBT = 0.02
"""Probability that there are no errors of a screw, from which nothing is said of them."""
_OUTLYING = 4.0
"""Residuals that are larger, in the noise, are named."""
_TALL = 1.0
"""Heights of touches in a ring that differ by more show the tilt of its axis. [mm]"""
_OBLIQUE = 0.1
"""Component of a normal along an axis from which the arrival of this axis matters."""


@dataclass(frozen=True)
class Reference:
    """What is touched.

    Parameters
    ----------
    name : str
        As the touches call it; an ``@`` and the turn in degrees follow there for blocks.
    shape : str
        One of `SHAPES`: a ring is any bore, a pin any boss, upright.
    sizes : tuple of float
        Diameter; of a block the one length between opposite faces that is known, or those along
        its x, y and z at a turn of zero. Empty: not known. [mm]
    u_size : float
        Standard uncertainty of each, without the temperature's. [mm]
    u_temperature : float
        [K]
    form : float
        Deviation of opposite faces of a block from parallel ones, over the face. [mm]

    Raises
    ------
    PretravelError
        A shape or a number of sizes that there is not; a size outside its range.

    >>> round(Reference("block", "block", (50.8,)).u_of(50.8), 6)
    0.000232
    """

    name: str
    shape: str
    sizes: tuple[float, ...] = ()
    u_size: float = 0.2 * MICROMETRE
    u_temperature: float = 0.2
    form: float = 1.0 * MICROMETRE

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise PretravelError(
                f"a reference is a {', a '.join(SHAPES)}, not a {self.shape!r}",
                inputs=("reference",),
            )
        counts = (0, 1, 3) if self.shape == "block" else (0, 1)
        if len(self.sizes) not in counts:
            raise PretravelError(
                f"{self.name} has {len(self.sizes)} sizes; a {self.shape} has "
                + ("one, or three along x, y and z" if self.shape == "block" else "one diameter"),
                inputs=("block", "reference"),
            )
        for size in self.sizes:
            checked(size, f"the size of {self.name}", REFERENCE_DIAMETER, inputs=("block",))
        checked(self.u_size, f"the uncertainty of {self.name}", U_OF_DIAMETER)

    def u_of(self, size: float) -> float:
        """Standard uncertainty of one size, with the temperature's. [mm]"""
        return math.hypot(self.u_size, STEEL_EXPANSION * size * self.u_temperature)


@dataclass(frozen=True)
class Term:
    """A quantity and how far touches determine it.

    Attributes
    ----------
    name : str
    value, u : float
        [mm, rad or relative]
    factor : float
        k of U, by Student's distribution.
    determined : bool
    told_from : tuple of str
        What the touches do not distinguish it from, where it is not determined.
    """

    name: str
    value: float
    u: float
    factor: float = 2.0
    determined: bool = True
    told_from: tuple[str, ...] = ()

    @property
    def expanded(self) -> float:
        """U."""
        return self.factor * self.u


@dataclass(frozen=True, eq=False)
class ReferenceFit:
    """What touches on references determine.

    Attributes
    ----------
    terms : tuple of Term
        Of the machine.
    sizes : tuple of Term
        That were not known, and the squareness of blocks.
    pairs : tuple of Term
        Pretravel of opposite directions together, with backlash where it is not distinguished.
    directions : (g, 3) float
        Contact normals with a pretravel of their own.
    pretravel : tuple of Term
        Of these directions.
    residuals : (n,) float
        [mm]
    noise : float
        Standard deviation of a touch. [mm]
    dof : float
    drift : (n, 3) float
        [mm]
    covariance : (9, 9) float
        Of all `TERMS`.
    origin : (3,) float
        Point of the machine about which the terms hold. [mm]
    tilts : mapping of str to float
        Of the axes of rings and pins. [rad]
    warnings : tuple of str
    """

    terms: tuple[Term, ...]
    sizes: tuple[Term, ...]
    pairs: tuple[Term, ...]
    directions: FloatArray
    pretravel: tuple[Term, ...]
    residuals: FloatArray
    noise: float
    dof: float
    drift: FloatArray
    covariance: FloatArray
    origin: FloatArray
    tilts: Mapping[str, float]
    warnings: tuple[str, ...] = ()

    def term(self, name: str) -> Term:
        """A term, a size or a pair by its name."""
        return next(one for one in (*self.terms, *self.sizes, *self.pairs) if one.name == name)

    @property
    def machine(self) -> MachineTerms | None:
        """The terms of the machine that are determined, for other touches; None without any."""
        known = {term.name: term for term in self.terms if term.determined}
        if not known:
            return None
        rows = [TERMS.index(name) for name in known]
        values = np.zeros(len(TERMS))
        values[rows] = [term.value for term in known.values()]
        root = np.zeros((len(TERMS), len(rows)))
        root[rows] = np.linalg.cholesky(self.covariance[np.ix_(rows, rows)])
        return MachineTerms(values, root, self.origin, reach=0.0)


def fit_references(
    touches: Touches,
    references: Sequence[Reference],
    *,
    tip_diameter: float | None = None,
    priors: MachinePriors = MachinePriors(),
) -> ReferenceFit:
    """Determine machine, sizes and pretravel from touches on references.

    Parameters
    ----------
    touches : Touches
        In their order. `Touches.references` name the reference of each, ``block@90`` a block that
        was turned by 90°, ``plate@90`` the plate under it; without them all are on the only
        reference, and a block's turns follow from the normals. The probe's axis is the z axis.
    references : sequence of Reference
    tip_diameter : float, optional
        Not given: pretravel is less the tip's radius, up to one constant. [mm]
    priors : MachinePriors

    Returns
    -------
    ReferenceFit

    Raises
    ------
    PretravelError
        A touch on no reference, or on no face of its block; fewer touches than unknowns.

    >>> block = Reference("block", "block", (50.0,))
    >>> n = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]] * 6)
    >>> at = n * (25.0 + 3.0 - 0.010) + np.repeat([[0.0] * 3, [5.0] * 3], 12, axis=0) * (1 - abs(n))
    >>> found = fit_references(Touches(at, n), [block], tip_diameter=6.0)
    >>> found.term("scale of x").determined, found.term("squareness of x and y").determined
    (False, False)
    """
    model = _Model(touches, references, tip_diameter, priors)
    unknowns = _solved(model)
    return _judged(model, unknowns)


# The touches and the references


def turn_of(word: str) -> tuple[str, float | None]:
    """Name and turn of a reference as touches call it. [rad]

    >>> turn_of("block@90")[0], round(turn_of("block@90")[1], 4), turn_of("ring")
    ('block', 1.5708, ('ring', None))
    """
    name, mark, angle = word.partition("@")
    if not mark:
        return word, None
    if not re.fullmatch(r"[-+]?\d{1,4}(\.\d+)?", angle):
        raise PretravelError(
            f"the reference {word!r} of a touch has {angle!r} after the @; a turn in degrees is "
            "needed, such as block@90"
        )
    return name, float(angle) * DEGREE


def words_of(direction: FloatArray) -> str:
    """A direction in words: +x, azimuth 30°, or both angles.

    >>> words_of(np.array([-1.0, 0.0, 0.0])), words_of(np.array([0.0, 0.6, 0.8]))
    ('-x', 'polar 37° azimuth 90°')
    """
    axis = int(np.argmax(np.abs(direction)))
    if abs(direction[axis]) > math.cos(SAME_DIRECTION):
        return f"{'-' if direction[axis] < 0.0 else '+'}{'xyz'[axis]}"
    azimuth = float(azimuth_angle(direction)) / DEGREE
    polar = float(polar_angle(direction)) / DEGREE
    flat = abs(polar - 90.0) < 1.0
    return f"azimuth {azimuth:.0f}°" if flat else f"polar {polar:.0f}° azimuth {azimuth:.0f}°"


def _shown(name: str) -> str:
    """The name of an unknown for people."""
    return re.sub(r"^(drift) (.)\d$", r"\1 of \2", name.partition(" #")[0])


def _names(touches: Touches, references: Sequence[Reference]) -> list[str]:
    """What each touch was made on: by its column, its label, or the only reference."""
    if touches.references is not None:
        return list(touches.references)
    known = {one.name for one in references} | {"plate"}
    if touches.labels is not None:
        starts = [label.partition("/")[0] for label in touches.labels]
        if all(start.partition("@")[0] in known for start in starts):
            return starts
    if len(references) == 1:
        return [references[0].name] * len(touches)
    raise PretravelError(
        "several references, but the touches do not say on which of them each was made: a column "
        "reference is needed, or labels that begin with its name, such as ring/1"
    )


def touches_on(touches: Touches, references: Sequence[Reference], name: str) -> IntArray:
    """The rows of the touches on one of the references.

    >>> ring, block = Reference("ring", "ring", (50.0,)), Reference("block", "block", (50.8,))
    >>> touches = Touches(np.zeros((2, 3)), [[1.0, 0.0, 0.0]] * 2, labels=("block/1", "ring/1"))
    >>> touches_on(touches, [ring, block], "ring").tolist()
    [1]
    """
    names = [turn_of(word)[0] for word in _names(touches, references)]
    return np.flatnonzero([each == name for each in names])


@dataclass(frozen=True)
class _Place:
    """A reference at one place: a block at one of its turns."""

    reference: Reference
    turn: float = 0.0

    @property
    def rotation(self) -> FloatArray:
        """Columns are the axes of the block."""
        return turned_about_axes(0.0, 0.0, self.turn)


@dataclass(eq=False)
class _Unknowns:
    """Names, starting values and standard deviations in advance of the unknowns."""

    names: list[str] = field(default_factory=list)
    start: list[float] = field(default_factory=list)
    deviation: list[float] = field(default_factory=list)
    at: dict[str, int] = field(default_factory=dict)

    def add(self, name: str, start: float, deviation: float) -> int:
        """Add one and return its place; one that is there already stays."""
        if name not in self.at:
            self.at[name] = len(self.names)
            self.names.append(name)
            self.start.append(start)
            self.deviation.append(deviation)
        return self.at[name]


class _Model:
    """The equations of the touches: residuals and their derivatives at given unknowns."""

    def __init__(
        self,
        touches: Touches,
        references: Sequence[Reference],
        tip_diameter: float | None,
        priors: MachinePriors,
    ) -> None:
        self.touches = touches
        self.origin = np.mean(touches.positions, axis=0)
        self.positions = touches.positions - self.origin
        self.moves = last_moves(touches.approach_directions)
        self.machine = displacements(self.positions, self.moves)
        self.tip_radius = 0.5 * tip_diameter if tip_diameter is not None else 0.0
        self.unknowns = _Unknowns()
        for name, deviation in zip(TERMS, priors.deviations, strict=True):
            self.unknowns.add(name, 0.0, float(deviation))
        if tip_diameter is None:
            self.unknowns.add("radius of the tip", 1.0, _PLACE)
        time = np.linspace(-1.0, 1.0, len(touches))
        self.time = np.stack([time**p for p in range(1, _POWERS + 1)], axis=1)
        for axis in "xyz":
            for power in range(1, _POWERS + 1):
                self.unknowns.add(f"drift {axis}{power}", 0.0, _DRIFT)
        self._place_touches(references)
        self._group_directions()

    def _place_touches(self, references: Sequence[Reference]) -> None:
        """The place and the face of every touch, and the unknowns of the places."""
        names, known = _names(self.touches, references), {one.name: one for one in references}
        normals = self.touches.normals
        blocks = [one for one in references if one.shape == "block"]
        self.places: list[_Place] = []
        self.place_of = np.zeros(len(names), dtype=np.int64)
        self.face_of = np.zeros((len(names), 2))  # axis of the block's face, and its side
        self.plate = np.zeros(len(names), dtype=bool)
        index: dict[str, int] = {}
        for row, word in enumerate(names):
            name, turn = turn_of(word)
            self.plate[row] = name == "plate" and name not in known
            if self.plate[row] and blocks:
                name = blocks[0].name
            if name not in known:
                raise PretravelError(
                    f"{self.touches.where(row)} is on {word!r}, which is none of the references "
                    f"({', '.join(known)})"
                )
            reference = known[name]
            if reference.shape == "block" and turn is None:
                turn = self._turn_by_normal(normals[row], row)
            key = f"{name}@{(turn or 0.0) / DEGREE:.3g}" if turn is not None else name
            if key not in index:
                index[key] = len(self.places)
                self.places.append(_Place(reference, turn or 0.0))
            self.place_of[row] = index[key]
            if reference.shape == "block":
                self.face_of[row] = self._face(
                    normals[row], self.places[index[key]], row, bool(self.plate[row])
                )
        self._keys = list(index)
        for number, place in enumerate(self.places):
            self._unknowns_of(number, place)

    def _turn_by_normal(self, normal: FloatArray, row: int) -> float:
        """Turn of a block from the normal of a side face, within 45° of its zero."""
        if abs(normal[2]) > 0.5:  # a top face has the turn of the touch before
            return self.places[self.place_of[row - 1]].turn if row and self.places else 0.0
        angle = math.atan2(normal[1], normal[0])
        quarter = 0.5 * math.pi
        turn = angle - quarter * round(angle / quarter)
        near = [p.turn for p in self.places if abs(p.turn - turn) < 5.0 * DEGREE]
        return near[0] if near else turn

    def _face(self, normal: FloatArray, place: _Place, row: int, plate: bool) -> tuple[int, int]:
        own = normal @ place.rotation
        axis = int(np.argmax(np.abs(own)))
        if abs(own[axis]) < math.cos(10.0 * DEGREE):
            raise PretravelError(
                f"{self.touches.where(row)}: its normal is no face of a block that is turned by "
                f"{place.turn / DEGREE:.4g}°; the turn is given as "
                f"block@{place.turn / DEGREE:.4g}"
            )
        if plate and axis != 2:
            raise PretravelError(f"{self.touches.where(row)}: a plate is touched from above")
        return axis, -1 if plate else int(np.sign(own[axis]))

    def _unknowns_of(self, number: int, place: _Place) -> None:
        rows = self.place_of == number
        key, reference, add = self._keys[number], place.reference, self.unknowns.add
        center, radius = self._start_of(rows, place)
        seen = self._apparent_lengths(rows, place)
        if "radius of the tip" not in self.unknowns.at:
            block = reference.shape == "block"
            _refuse_other_sizes(reference, seen if block else np.array([2.0 * radius]))
        for letter, value in zip("xyz", center, strict=True):
            add(f"{letter} of {key}", float(value), _PLACE)
        if reference.shape == "block":
            for letter in "xyz":
                add(f"rotation of {key} about {letter}", 0.0, _TILT if letter == "z" else _UPRIGHT)
            name = reference.name
            for pair in _PAIRS_OF_AXES:
                add(f"squareness of {name}, {pair}", 0.0, _UNSQUARE)
            for axis in range(3):
                sides = {side for a, side in self.face_of[rows].tolist() if a == axis}
                if len(sides) < 2:
                    continue
                start, u = self._length(reference, axis, seen)
                add(f"length of {name} along {'xyz'[axis]}", start, u)
                for other in {0, 1, 2} - {axis}:
                    spread = max(start, 1.0)
                    add(f"wedge of {name}, {'xyz'[axis]} over {'xyz'[other]}", 0.0,
                        reference.form / spread)  # fmt: skip
            return
        tall = float(np.ptp(self.positions[rows, 2])) > _TALL and reference.shape != "sphere"
        if tall:
            for letter in "xy":
                add(f"tilt of {key} along {letter}", 0.0, _TILT)
        known = bool(reference.sizes)
        start = reference.sizes[0] if known else 2.0 * radius
        add(f"diameter of {reference.name}", start, reference.u_of(start) if known else _PLACE)

    def _apparent_lengths(self, rows: BoolArray, place: _Place) -> FloatArray:
        """Distances of opposite faces of a block as they are touched, less the known tip's."""
        found = np.full(3, np.nan)
        if place.reference.shape != "block":
            return found
        own = self.positions @ place.rotation
        for axis in range(3):
            ends = [rows & (self.face_of[:, 0] == axis) & (self.face_of[:, 1] == side)
                    for side in (1, -1)]  # fmt: skip
            if all(end.any() for end in ends):
                upper, lower = (float(np.median(own[end, axis])) for end in ends)
                tips = 0.0 if self.plate[ends[1]].any() else 2.0 * self.tip_radius
                found[axis] = upper - lower - tips
        return found

    def _length(self, reference: Reference, axis: int, seen: FloatArray) -> tuple[float, float]:
        """The length of a block along one of its axes, and its standard uncertainty.

        One length that is stated is that of the faces which are so far apart.
        """
        sizes = reference.sizes
        if len(sizes) == 3:
            return sizes[axis], reference.u_of(sizes[axis])
        if not sizes:
            return float(seen[axis]), _PLACE
        if "radius of the tip" in self.unknowns.at and float(np.ptp(seen[:2])) > _ALIKE:
            raise PretravelError(
                f"the faces of the block are {seen[0]:.2f} and {seen[1]:.2f} mm apart, with the "
                f"tip: which of them is {sizes[0]:g} mm? Give all lengths of the block, along x, "
                "y and z, or the tip's diameter",
                inputs=("block", "tip_diameter"),
            )
        free = "radius of the tip" in self.unknowns.at and axis < 2
        if free or abs(float(seen[axis]) - sizes[0]) < _ALIKE:
            return sizes[0], reference.u_of(sizes[0])
        return float(seen[axis]), _PLACE

    def _start_of(self, rows: BoolArray, place: _Place) -> tuple[FloatArray, float]:
        """Centre, about the origin, and rough radius of the touches of a place."""
        at = self.positions[rows]
        shape = place.reference.shape
        if shape == "block":
            return 0.5 * (at.max(axis=0) + at.min(axis=0)), 0.25 * float(
                np.sum(np.ptp(at, axis=0)[:2])
            )
        axes = 3 if shape == "sphere" else 2
        found, _ = algebraic_sphere(at[:, :axes])
        radius = float(found[-1])
        center = np.append(found[:axes], at[:, 2].mean())[:3]
        return center, radius + (self.tip_radius if shape == "ring" else -self.tip_radius)

    def _group_directions(self) -> None:
        """Directions with a pretravel of their own, by contact normal and approach."""
        normals = self._contact_normals()
        approaches = self.touches.approach_directions
        kept: list[int] = []
        groups = np.zeros(len(normals), dtype=np.int64)
        near, alike = math.cos(SAME_DIRECTION), math.cos(_SAME_APPROACH)
        for row in range(len(normals)):
            same = [
                g for g, first in enumerate(kept)
                if normals[row] @ normals[first] >= near
                and approaches[row] @ approaches[first] >= alike
            ]  # fmt: skip
            if not same:
                kept.append(row)
            groups[row] = same[0] if same else len(kept) - 1
        self.groups = groups
        self.directions = unit(
            np.array([normals[groups == g].mean(axis=0) for g in range(len(kept))])
        )
        along = -np.sum(self.directions * approaches[kept], axis=1) > alike
        self.along_normal = np.asarray(along)
        self.base = len(self.unknowns.names)
        for g, direction in enumerate(self.directions):
            oblique = "" if along[g] else f", approached along {words_of(approaches[kept[g]])}"
            self.unknowns.add(f"{_OF}{words_of(direction)}{oblique} #{g}", 0.0, _PRETRAVEL)

    def _contact_normals(self) -> FloatArray:
        normals = np.array(self.touches.normals)
        for number, place in enumerate(self.places):
            rows, shape = self.place_of == number, place.reference.shape
            if shape == "block":
                continue
            axes = 3 if shape == "sphere" else 2
            center = [
                self.unknowns.start[self.unknowns.at[f"{a} of {self._keys[number]}"]] for a in "xyz"
            ]
            outward = (self.positions[rows] - np.array(center))[:, :axes]
            found = np.zeros((int(rows.sum()), 3))
            found[:, :axes] = unit(outward) * (-1.0 if shape == "ring" else 1.0)
            normals[rows] = found
        return normals

    # The equations

    def drift(self, values: FloatArray) -> FloatArray:
        """Movement of the references at each touch, (n, 3). [mm]"""
        powers = range(1, _POWERS + 1)
        at = [[self.unknowns.at[f"drift {axis}{power}"] for power in powers] for axis in "xyz"]
        return np.asarray(self.time @ values[np.array(at)].T)

    def equations(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (n,) and derivatives (n, u) at the unknowns. [mm]"""
        at = self.unknowns.at
        count = len(self.touches)
        jacobian = np.zeros((count, len(values)))
        machine = values[: len(TERMS)]
        points = self.positions + self.machine @ machine - self.drift(values)
        residual, normals = np.zeros(count), np.zeros((count, 3))
        for number, place in enumerate(self.places):
            rows = np.flatnonzero(self.place_of == number)
            part = self._block if place.reference.shape == "block" else self._round
            residual[rows], normals[rows] = part(
                rows, number, place, points[rows], values, jacobian
            )
        jacobian[:, : len(TERMS)] = np.einsum("ni,nij->nj", normals, self.machine)
        for axis, letter in enumerate("xyz"):
            for power in range(_POWERS):
                jacobian[:, at[f"drift {letter}{power + 1}"]] = (
                    -normals[:, axis] * self.time[:, power]
                )
        own = self.base + self.groups
        radius = values[at["radius of the tip"]] if "radius of the tip" in at else self.tip_radius
        residual += values[own] - radius
        jacobian[np.arange(count), own] = 1.0
        if "radius of the tip" in at:
            jacobian[:, at["radius of the tip"]] = -1.0
        return residual, jacobian

    def _block(
        self, rows: IntArray, number: int, place: _Place, points: FloatArray,
        values: FloatArray, jacobian: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
        """Distances from the faces of a block, and the normals of the faces."""
        at, key, name = self.unknowns.at, self._keys[number], place.reference.name
        turned = place.rotation
        center = values[[at[f"{a} of {key}"] for a in "xyz"]]
        rotation = values[[at[f"rotation of {key} about {a}"] for a in "xyz"]]
        square = values[[at[f"squareness of {name}, {p}"] for p in _PAIRS_OF_AXES]]
        axes, sides = self.face_of[rows, 0].astype(int), self.face_of[rows, 1]
        plate = self.plate[rows]
        # Normals of the faces in the block: x is turned from square to y and z, y to z.
        faces = np.eye(3)
        faces[0, 1:] = square[:2]
        faces[1, 2] = square[2]
        own = faces[axes]
        offset = points - center
        local = offset @ turned  # in the axes of the block
        wedges, wedge_at = np.zeros((len(rows), 3)), np.full((len(rows), 3), -1)
        for row, axis in enumerate(axes):
            for other in range(3):
                place_of = at.get(f"wedge of {name}, {'xyz'[axis]} over {'xyz'[other]}")
                if place_of is not None and sides[row] < 0:
                    wedges[row, other], wedge_at[row, other] = values[place_of], place_of
        own = own + wedges
        bent = own + np.cross(rotation, own)
        length = np.linalg.norm(bent, axis=1)
        bent = bent / length[:, None]
        along = np.sum(bent * local, axis=1)
        half = np.zeros(len(rows))
        for axis, letter in enumerate("xyz"):
            place_of = at.get(f"length of {name} along {letter}")
            mine = axes == axis
            if place_of is not None:
                half[mine] = 0.5 * values[place_of]
                jacobian[rows[mine], place_of] = np.where(plate[mine], 0.5, -0.5)
        outward = np.where(plate, 1.0, sides)
        distance = outward * along - np.where(plate, -half, half)
        normals = (bent @ turned.T) * outward[:, None]
        for axis, letter in enumerate("xyz"):
            jacobian[rows, at[f"{letter} of {key}"]] = -normals[:, axis]
        # What a change of a face's normal does: of the local point, the part across the normal.
        across = (local - along[:, None] * bent) / length[:, None] * outward[:, None]
        lever = np.cross(own, across)
        across = across + np.cross(across, rotation)
        for axis, letter in enumerate("xyz"):
            jacobian[rows, at[f"rotation of {key} about {letter}"]] = lever[:, axis]
        for pair, (axis, other) in _PAIRS_OF_AXES.items():
            mine = axes == axis
            jacobian[rows[mine], at[f"squareness of {name}, {pair}"]] = across[mine, other]
        for other in range(3):
            mine = wedge_at[:, other] >= 0
            jacobian[rows[mine], wedge_at[mine, other]] = across[mine, other]
        return distance, normals

    def _round(
        self, rows: IntArray, number: int, place: _Place, points: FloatArray,
        values: FloatArray, jacobian: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
        """Distances from the surface of a ring, a pin or a sphere, out of the part."""
        at, key, reference = self.unknowns.at, self._keys[number], place.reference
        axes = 3 if reference.shape == "sphere" else 2
        offset = points - values[[at[f"{a} of {key}"] for a in "xyz"]]
        height = offset[:, 2]
        tilts = [at.get(f"tilt of {key} along {a}") for a in "xy"]
        for axis, place_of in enumerate(tilts):
            if place_of is not None:
                offset[:, axis] = offset[:, axis] - values[place_of] * height
        side = -1.0 if reference.shape == "ring" else 1.0
        normals = np.zeros((len(rows), 3))
        normals[:, :axes] = side * unit(offset[:, :axes])
        size = at[f"diameter of {reference.name}"]
        distance = side * (np.linalg.norm(offset[:, :axes], axis=1) - 0.5 * values[size])
        jacobian[rows, size] = -0.5 * side
        for axis, letter in enumerate("xyz"[:axes]):
            jacobian[rows, at[f"{letter} of {key}"]] = -normals[:, axis]
        for axis, place_of in enumerate(tilts):
            if place_of is not None:
                jacobian[rows, place_of] = -normals[:, axis] * height
        return distance, normals


def _refuse_other_sizes(reference: Reference, seen: FloatArray) -> None:
    """A stated size that the touches contradict: another reference, or inches.

    One length of a block is that of any pair of its faces; three are those along its axes.
    """
    apart = np.array([[abs(size - length) for length in seen] for size in reference.sizes])
    if len(reference.sizes) == 3:
        apart = np.diag(apart)[:, None]
    for size, row in zip(reference.sizes, apart, strict=True):
        if np.isfinite(row).any() and float(np.nanmin(row)) > _ALIKE:
            found = " and ".join(f"{length:.2f}" for length in seen if math.isfinite(length))
            raise PretravelError(
                f"{reference.name} is given as {size:g} mm, and its touches are {found} mm apart, "
                "less the tip. Is it another one, or in inches? Sizes are given in mm",
                inputs=("block", "reference"),
            )


# The fit


@dataclass(frozen=True, eq=False)
class _Solved:
    values: FloatArray
    covariance: FloatArray
    """For the noise that was found."""
    weaker: FloatArray
    """The same where what says nothing in advance says less."""
    residual: FloatArray
    noise: float
    dof: float
    repeating: float
    """Standard deviation of errors that repeat at the same place of an axis. [mm]"""
    without: float = 1.0
    """Probability that there are none."""

    def u_and_open(self, weights: FloatArray) -> tuple[float, bool]:
        """Standard uncertainty of a sum of unknowns, and whether it is not determined."""
        own, weaker = (math.sqrt(max(float(weights @ matrix @ weights), 0.0))
                       for matrix in (self.covariance, self.weaker))  # fmt: skip
        return own, weaker > _OPEN * own


def _solved(model: _Model) -> _Solved:
    """The average of fits over the errors that repeat at the same place of an axis."""
    values, noise = np.array(model.unknowns.start), 1.0 * MICROMETRE
    every = list(hypotheses(model.positions, model.touches.normals))
    for _ in range(_ROUNDS):
        fit = _step(model, model.equations(values), values, noise, every[0])
        values, noise = fit.values, fit.noise
    linear, fits = model.equations(values), [fit]
    for each in every[1:]:
        fit = _step(model, linear, values, noise, each)
        for _ in range(_ROUNDS_OF_NOISE):
            fit = _step(model, linear, values, fit.noise, each)
        fits.append(fit)
    logs = np.array([fit.log_evidence for fit in fits])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    mean = np.asarray(weights @ np.array([fit.values for fit in fits]))
    apart = np.array([fit.values for fit in fits]) - mean
    own, weaker = (np.zeros((len(mean), len(mean))) + (apart.T * weights) @ apart for _ in "ab")
    for fit, weight in zip(fits, weights, strict=True):
        if weight > _NO_WEIGHT:
            own += weight * fit.covariance(model, weaker=False)
            weaker += weight * fit.covariance(model, weaker=True)
    return _Solved(
        mean,
        own,
        weaker,
        model.equations(mean)[0],
        float(weights @ [fit.noise for fit in fits]),
        float(weights @ [fit.dof for fit in fits]),
        math.sqrt(float(weights @ [each.size**2 for each in every])),
        float(weights[0]),
    )


@dataclass(frozen=True, eq=False)
class _Fit:
    """A linear fit with given errors of the axes."""

    values: FloatArray
    noise: float
    dof: float
    log_evidence: float
    scaled: FloatArray
    """Derivatives in the noise, by unknowns in units of what was known in advance."""

    def covariance(self, model: _Model, *, weaker: bool) -> FloatArray:
        """Of the unknowns; weaker: where what says nothing in advance says less."""
        deviation = np.array(model.unknowns.deviation)
        free = deviation > 0.0
        known = 1.0 / np.where(weaker & _says_nothing(model)[free], _WEAKER, 1.0)
        r = np.linalg.qr(np.vstack([self.scaled, np.diag(known)]), mode="r")
        inverse = np.linalg.inv(r) * deviation[free, None]
        found = np.zeros((len(deviation), len(deviation)))
        found[np.ix_(free, free)] = inverse @ inverse.T
        return found


def _step(
    model: _Model,
    linear: tuple[FloatArray, FloatArray],
    values: FloatArray,
    noise: float,
    errors: AxisErrors,
) -> _Fit:
    """The linear fit at `values`."""
    residual, jacobian = linear
    deviation = np.array(model.unknowns.deviation)
    free = deviation > 0.0
    covariance = np.eye(len(residual)) + (errors.size / noise) ** 2 * errors.shared
    root = np.linalg.cholesky(covariance)
    # Unknowns in units of what was known in advance: matrices of one scale.
    whitened = np.linalg.solve(
        root, np.column_stack([jacobian[:, free] * deviation[free], residual])
    )
    scaled, white = whitened[:, :-1] / noise, whitened[:, -1]
    own = (np.array(model.unknowns.start) - values)[free] / deviation[free]
    q, r = np.linalg.qr(np.vstack([scaled, np.eye(len(own))]))
    step = np.linalg.solve(r, q.T @ np.append(-white / noise, own))
    dof = len(residual) - float(np.sum(q[: len(residual)] ** 2))
    if dof < _FEWEST_FREE:
        raise PretravelError(
            f"{len(residual)} touches on these references leave {max(dof, 0.0):.1f} degrees of "
            f"freedom; {_FEWEST_FREE:.0f} are needed to know the noise: repeat touches"
        )
    left, own = white / noise + scaled @ step, own - step
    found = values.copy()
    found[free] += step * deviation[free]
    log_evidence = errors.log_prior - 0.5 * (
        float(left @ left)
        + float(own @ own)
        + 2.0 * len(residual) * math.log(noise)
        + 2.0 * float(np.sum(np.log(np.diag(root))) + np.sum(np.log(np.abs(np.diag(r)))))
    )
    better = max(noise * math.sqrt(float(left @ left) / dof), 1e-8)
    return _Fit(found, better, dof, log_evidence, scaled)


def _says_nothing(model: _Model) -> BoolArray:
    """Unknowns whose standard deviations in advance are only wide, (u,)."""
    deviation, names = np.array(model.unknowns.deviation), model.unknowns.names
    wide = np.zeros(len(names), dtype=bool)
    for place, name in enumerate(names):
        if place < len(TERMS):
            wide[place] = deviation[place] >= WIDE[place // 3]
        elif name.startswith(("length of", "diameter of")):
            wide[place] = deviation[place] >= _PLACE
        else:
            upright = re.fullmatch(r"(rotation of .* about [xy]|z of .*)", name)  # it stands there
            wide[place] = not name.startswith(("wedge of", "drift")) and upright is None
    return wide


def _judged(model: _Model, found: _Solved) -> ReferenceFit:
    names = model.unknowns.names
    deviation = np.array(model.unknowns.deviation)
    factor = coverage_factor(found.dof)

    def term(place: int, name: str) -> Term:
        u, is_open = found.u_and_open(np.eye(len(names))[place])
        others = _told_from(model, found, place) if is_open else ()
        return Term(name, float(found.values[place]), u, factor, not is_open, others)

    terms = tuple(term(place, name) for place, name in enumerate(TERMS) if deviation[place] > 0.0)
    known = [
        place for place, name in enumerate(names)
        if place >= len(TERMS) and (
            name.startswith("squareness of ")
            or (name.startswith(("diameter of ", "length of ")) and deviation[place] >= _PLACE)
        )
    ]  # fmt: skip
    first = model.base
    of_directions = range(first, first + len(model.directions))
    return ReferenceFit(
        terms=terms,
        sizes=tuple(term(place, names[place]) for place in known),
        pairs=_pairs(model, found, factor),
        directions=frozen(model.directions),
        pretravel=tuple(
            term(place, _shown(names[place]).removeprefix(_OF)) for place in of_directions
        ),
        residuals=frozen(found.residual),
        noise=found.noise,
        dof=found.dof,
        drift=frozen(model.drift(found.values)),
        covariance=frozen(found.covariance[: len(TERMS), : len(TERMS)]),
        origin=frozen(model.origin),
        tilts={
            name: float(found.values[i]) for i, name in enumerate(names) if name.startswith("tilt")
        },
        warnings=(*_arrivals(model), *_outlying(model, found), *_repeating(found)),
    )


def _arrivals(model: _Model) -> list[str]:
    """A warning about touches whose arrival is not known where it matters."""
    resting = (model.moves == 0.0) & (np.abs(model.touches.normals) > _OBLIQUE)
    count = int(np.sum(resting.any(axis=1)))
    if not count:
        return []
    return [
        (
            f"{count} touches are on faces that are oblique to an axis which did not move in their "
            "approach: the side on which its backlash is taken up is not known. Let both axes move "
            "in the approach, as the plan of a block does"
        )
    ]


def _outlying(model: _Model, found: _Solved) -> list[str]:
    """A warning about the touch that fits least, where noise alone hardly makes it."""
    worst = int(np.argmax(np.abs(found.residual)))
    size = abs(float(found.residual[worst]))
    if size < _OUTLYING * math.hypot(found.noise, found.repeating):
        return []
    return [
        (
            f"{model.touches.where(worst)} is {size / MICROMETRE:.1f} µm off, "
            f"{size / found.noise:.1f} times the noise: look for dirt, or leave it out"
        )
    ]


def _repeating(found: _Solved) -> list[str]:
    """A warning about errors of the axes that repeats do not show."""
    if found.without > _NO_DOUBT:
        return []
    return [
        (
            f"the axes have errors that repeat at the same place, about "
            f"{found.repeating / MICROMETRE:.1f} µm, as those of a screw once for each turn "
            f"(probability {1.0 - found.without:.2f}). They are alike in all touches of a face, "
            "and u of the scales contains them: at each turn place the block a few millimetres "
            "elsewhere along each axis"
        )
    ]


def _told_from(model: _Model, found: _Solved, place: int) -> tuple[str, ...]:
    """Quantities that keep an unknown from being determined: those that go with it."""
    deviation, names = np.array(model.unknowns.deviation), model.unknowns.names
    u, weaker = (np.sqrt(np.maximum(np.diag(matrix), 0.0))
                 for matrix in (found.covariance, found.weaker))  # fmt: skip
    open_ones = weaker > _OPEN * u
    move = np.abs(found.weaker[:, place]) / math.sqrt(found.weaker[place, place])
    share = np.where(open_ones, move / np.maximum(deviation, 1e-12), 0.0)
    share[place] = 0.0
    order = np.argsort(-share)
    largest = float(share[order[0]])
    if largest < 0.05:
        return ()
    chosen = [_shown(names[i]) for i in order if share[i] > _NAMED * largest]
    directions = [name for name in chosen if name.startswith(_OF)]
    if len(directions) > 2:
        chosen = ["pretravel", *(name for name in chosen if name not in directions)]
    plain = [
        "how the reference lies: touch each face at two places"
        if name.startswith(("rotation of", "tilt of"))
        else "place of the reference" if re.match(r"[xyz] of ", name) else name
        for name in chosen
    ]  # fmt: skip
    return tuple(dict.fromkeys(plain))[:4]


def _pairs(model: _Model, found: _Solved, factor: float) -> tuple[Term, ...]:
    """Pretravel of opposite directions together, without the tip's radius where it is not known."""
    pairs = []
    names, at = model.unknowns.names, model.unknowns.at
    units = np.eye(len(names))
    open_axes = [found.u_and_open(units[6 + axis])[1] for axis in range(3)]
    open_scales = [found.u_and_open(units[axis])[1] for axis in range(3)]
    for g, direction in enumerate(model.directions):
        for h in range(g + 1, len(model.directions)):
            both = model.along_normal[g] and model.along_normal[h]
            if not both or direction @ model.directions[h] > -math.cos(SAME_DIRECTION):
                continue
            weights = np.zeros(len(names))
            weights[[model.base + g, model.base + h]] = 1.0
            if "radius of the tip" in at:
                weights[at["radius of the tip"]] = -2.0
            joined = [axis for axis in range(3) if open_axes[axis] and abs(direction[axis]) > 1e-3]
            for axis in joined:
                weights[6 + axis] = abs(direction[axis])
            u, is_open = found.u_and_open(weights)
            first, second = (_shown(names[model.base + k]).removeprefix(_OF) for k in (g, h))
            name = f"pretravel of {first} and {second} together"
            if "radius of the tip" in at:
                name += ", less the tip's diameter"
            for axis in joined:
                name += f", with the backlash of {'xyz'[axis]}"
            value = float(weights @ found.values)
            scales = [TERMS[axis] for axis in range(3)
                      if abs(direction[axis]) > _OBLIQUE and open_scales[axis]]  # fmt: skip
            others = tuple(scales or ["size of the reference"]) if is_open else ()
            pairs.append(Term(name, value, u, factor, not is_open, others))
    return tuple(pairs)
