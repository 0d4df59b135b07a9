"""Touches on references as equations: residuals and their derivatives at unknowns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pretravel.base import (
    DEGREE,
    BoolArray,
    FloatArray,
    IntArray,
    PretravelError,
    azimuth_angle,
    polar_angle,
    turned_about_axes,
    unit,
)
from pretravel.maps import (
    TERMS,
    MachinePriors,
    displacements,
    last_moves,
)
from pretravel.qualification.references import Reference, names_of_references, turn_of
from pretravel.touches import Touches
from pretravel.uncertainty import algebraic_sphere

_PAIRS_OF_AXES = {"x and y": (0, 1), "x and z": (0, 2), "y and z": (1, 2)}
SAME_DIRECTION = 1.0 * DEGREE
"""Contact normals that are closer share their pretravel: a lobe of three changes by 3 % of itself
over one degree."""
_SAME_APPROACH = 8.0 * DEGREE
"""Approaches that are closer share it, too: the tip slides as far."""
_PRETRAVEL = 0.1
"""Pretravel that says nothing in advance, standard deviation. [mm]"""
PLACE, _TILT = 10.0, 0.1
"""The same of a place or an unknown size [mm], and of a tilt [rad]."""
_UPRIGHT = 0.005
"""Standard deviation in advance of the tilt of a block that stands on a plate or a table. [rad]"""
_ALIKE = 0.5
"""Lengths of a block that differ by less are one length. [mm]"""
_UNSQUARE = 0.01
"""Standard deviation in advance of the angle of two faces of a block. [rad]"""
_DRIFT = 0.02
"""Standard deviation in advance of each power of a drift over the touches. [mm]"""
_POWERS = 3
PRETRAVEL_OF = "pretravel of "
_TALL = 1.0
"""Heights of touches in a ring that differ by more show the tilt of its axis. [mm]"""


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


class ReferenceModel:
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
            self.unknowns.add("radius of the tip", 1.0, PLACE)
        time = np.linspace(-1.0, 1.0, len(touches))
        self.time = np.stack([time**p for p in range(1, _POWERS + 1)], axis=1)
        for axis in "xyz":
            for power in range(1, _POWERS + 1):
                self.unknowns.add(f"drift {axis}{power}", 0.0, _DRIFT)
        self._place_touches(references)
        self._group_directions()

    def _place_touches(self, references: Sequence[Reference]) -> None:
        """The place and the face of every touch, and the unknowns of the places."""
        names, known = (
            names_of_references(self.touches, references),
            {one.name: one for one in references},
        )
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
                f"{self.touches.where(row)}: its normal is not a face of a block that is turned by "
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
            add(f"{letter} of {key}", float(value), PLACE)
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
        add(f"diameter of {reference.name}", start, reference.u_of(start) if known else PLACE)

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
            return float(seen[axis]), PLACE
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
        return float(seen[axis]), PLACE

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
            self.unknowns.add(f"{PRETRAVEL_OF}{words_of(direction)}{oblique} #{g}", 0.0, _PRETRAVEL)

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
                "without the tip. Is it another one, or is the size in inches? Sizes are in mm",
                inputs=("block", "reference"),
            )
