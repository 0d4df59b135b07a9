"""Touches that scatter more on the part than those of the map did on the reference."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pretravel.base import MICROMETRE, BoolArray, FloatArray, IntArray, connected, near_pairs
from pretravel.uncertainty import outlier_factor

_SAME_PLACE = 0.010
"""Distance along the surface within which a machine repeats a touch. [mm]"""
_NEAR = 0.030
"""Distance of repeats with their scatter: farther apart one of them is a gross error. [mm]"""
_SAME_NORMAL = 1e-3
"""Of unit vectors."""
_SAME_PLANE = 0.050
"""Gap between the heights of two parallel faces. [mm]"""
_FEWEST_OF_A_FACE = 5
_TO_SEE_A_BOW = 12
"""Touches of a face from which a bow and a twist are fitted too."""
_CHANCE = 1e-3
"""That a scatter like that of the map is called larger."""
_LARGER_ON_A_FACE = 1.5
"""Times the scatter of the map: faces are a little rough."""
_MOST_COMPARED, _MOST_PAIRS = 20_000, 2_000_000
_MEDIAN_OF_PAIRS = 0.455
"""Median of χ² with one degree of freedom."""


@dataclass(frozen=True)
class ScatterSums:
    """Squares of touches about their mean or face, and their value expected from the map.

    Attributes
    ----------
    squares, expected : float
        Their sum, and its mean for touches that scatter as those of the map. [mm²]
    dof : float

    >>> ScatterSums(4e-6, 4e-7, 4.0).joined(ScatterSums(2e-6, 2e-7, 2.0)).deviation
    0.001
    """

    squares: float = 0.0
    expected: float = 0.0
    dof: float = 0.0

    def joined(self, other: ScatterSums) -> ScatterSums:
        """Of both sets of touches."""
        return ScatterSums(
            self.squares + other.squares, self.expected + other.expected, self.dof + other.dof
        )

    @property
    def deviation(self) -> float:
        """Standard deviation of a touch. [mm]"""
        return math.sqrt(self.squares / self.dof)

    @property
    def of_map(self) -> float:
        """Standard deviation of a touch, expected from the map. [mm]"""
        return math.sqrt(self.expected / self.dof)

    def exceeds(self, dof_of_map: float, least: float = 1.0) -> bool:
        """Whether this is more than chance, and `least` times as much as expected."""
        if not (self.dof > 0.0 and self.expected > 0.0):
            return False
        ratio = self.squares / self.expected
        if ratio <= least**2:  # without SciPy, which takes longer to load than a short command
            return False
        from scipy.special import fdtri

        limit = fdtri(self.dof, dof_of_map if dof_of_map > 0.0 else 1e6, 1.0 - _CHANCE)
        return bool(ratio > float(limit))


@dataclass(frozen=True)
class ScatterOnPart:
    """What the touches of a part show of their scatter.

    Attributes
    ----------
    repeats : ScatterSums
        Of touches at the same place with the same normal.
    faces : ScatterSums
        Of touches with the same normal about the plane through them, or about a bowed one.
    dof_of_map : float
        Degrees of freedom of the map's repeatability; 0 where they are not known.
    """

    repeats: ScatterSums = field(default_factory=ScatterSums)
    faces: ScatterSums = field(default_factory=ScatterSums)
    dof_of_map: float = 0.0

    @cached_property
    def larger(self) -> ScatterSums | None:
        """Of the repeats, where they scatter more than the touches of the map.

        Where the map knows its scatter from fewer touches, both together, if that is more: what is
        no more than chance then is so because the map knows it poorly.
        """
        seen, known = self.repeats, self.dof_of_map
        if seen.exceeds(known):
            return seen
        if not (0.0 < known < seen.dof and seen.squares > seen.expected > 0.0):
            return None
        of_map = known * seen.of_map**2
        return seen.joined(ScatterSums(of_map, of_map, known))

    def with_faces(
        self, positions: FloatArray, normals: FloatArray, expected: FloatArray
    ) -> ScatterOnPart:
        """With the scatter on plane faces, compared with what the repeats show.

        Parameters are those of `scatter_of_repeats`.
        """
        if not _comparable(expected):
            return self
        if self.larger is not None:
            expected = expected * (self.larger.squares / self.larger.expected)
        return replace(self, faces=_of_faces(positions, normals, expected))

    def joined(self, other: ScatterOnPart) -> ScatterOnPart:
        """Of both sets of touches."""
        return replace(
            self, repeats=self.repeats.joined(other.repeats), faces=self.faces.joined(other.faces)
        )

    def sentences(self) -> list[str]:
        """What to know before the points are used, as warnings."""
        said = []
        if self.repeats.exceeds(self.dof_of_map):
            said.append(
                f"touches at the same place scatter by {_um(self.repeats.deviation)} µm, those of "
                f"the map by {_um(self.repeats.of_map)} µm: u of the points contains the larger "
                "scatter"
            )
        if self.faces.exceeds(self.dof_of_map, _LARGER_ON_A_FACE):
            said.append(
                f"the touches scatter by {_um(self.faces.deviation)} µm about the plane faces, and "
                f"by {_um(self.faces.of_map)} µm on the reference. Form of the faces, or a larger "
                "scatter of the touches, causes this: u of the points contains neither. Touch some "
                "places twice to separate the two"
            )
        return said


def _um(length: float) -> str:
    return f"{length / MICROMETRE:.2g}"


def scatter_of_repeats(
    positions: FloatArray, normals: FloatArray, expected: FloatArray, dof_of_map: float
) -> ScatterOnPart:
    """The scatter of compensated points at repeated places.

    Parameters
    ----------
    positions, normals : (n, 3) float
        [mm]
    expected : (n,) float
        Variance along the normals of a touch that scatters as those of the map. [mm²]
    dof_of_map : float
        Degrees of freedom of the map's repeatability; 0 where they are not known.

    Returns
    -------
    ScatterOnPart
        Empty for very many points, and for a map that states no scatter.

    >>> rng, up = np.random.default_rng(1), np.tile([0.0, 0.0, 1.0], (16, 1))
    >>> places = np.repeat(rng.uniform(0.0, 40.0, (8, 3)) * [1, 1, 0], 2, axis=0)
    >>> places[:, 2] = rng.normal(0.0, 1.5e-3, 16)
    >>> found = scatter_of_repeats(places, up, np.full(16, 9e-8), 50.0)
    >>> found.repeats.dof, [said[:45] for said in found.sentences()]
    (8.0, ['touches at the same place scatter by 1.6 µm, '])
    """
    if not _comparable(expected):
        return ScatterOnPart(dof_of_map=dof_of_map)
    return ScatterOnPart(_of_repeats(positions, normals, expected), dof_of_map=dof_of_map)


def _comparable(expected: FloatArray) -> bool:
    """Whether there are neither too few nor very many points, and the map states a scatter."""
    return 1 < len(expected) <= _MOST_COMPARED and bool(np.all(expected > 0.0))


def places_of(positions: FloatArray, normals: FloatArray) -> IntArray:
    """Number of the place of each touch: those at one place were made again, (n,).

    Parameters
    ----------
    positions, normals : (n, 3) float
        [mm]

    Returns
    -------
    (n,) int
        From 0. Touches in a dense row, each as near to the next as repeats are, have a place each.

    >>> at = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 0.002, 0.001]])
    >>> places_of(at, np.tile([0.0, 0.0, 1.0], (3, 1))).tolist()
    [0, 1, 0]
    """
    count = len(positions)
    alone = np.arange(count)
    if count**2 > _MOST_PAIRS and _pairs_within(positions, _NEAR) > _MOST_PAIRS:
        return alone
    one, other = near_pairs(positions, _NEAR).T
    apart = positions[one] - positions[other]
    along = np.sum(apart * normals[one], axis=1)
    across = np.linalg.norm(apart - along[:, None] * normals[one], axis=1)
    turned = np.linalg.norm(normals[one] - normals[other], axis=1)
    same = (across < _SAME_PLACE) & (turned < _SAME_NORMAL)
    if not same.any():
        return alone
    first = connected(count, np.column_stack([one[same], other[same]]))
    moved = positions - positions[first]
    moved -= np.sum(moved * normals, axis=1)[:, None] * normals
    far = np.linalg.norm(moved, axis=1) > 2.0 * _SAME_PLACE
    in_a_row = np.bincount(first, far, count)[first] > 0
    return np.unique(np.where(in_a_row, alone, first), return_inverse=True)[1]


def _of_repeats(positions: FloatArray, normals: FloatArray, expected: FloatArray) -> ScatterSums:
    group = places_of(positions, normals)
    size = np.bincount(group)
    if len(size) == len(group):
        return ScatterSums()
    first = np.unique(group, return_index=True)[1]
    height = np.sum((positions - positions[first[group]]) * normals, axis=1)
    mean = np.bincount(group, height) / size
    squares = np.asarray(np.bincount(group, (height - mean[group]) ** 2), dtype=np.float64)
    dof = np.asarray(size - 1.0, dtype=np.float64)
    known = np.bincount(group, expected) / size * dof
    kept = dof > 0.0
    kept[kept] = _without_gross(squares[kept], known[kept], dof[kept])
    return ScatterSums(float(squares[kept].sum()), float(known[kept].sum()), float(dof[kept].sum()))


def _pairs_within(positions: FloatArray, distance: float) -> int:
    from scipy.spatial import cKDTree

    tree = cKDTree(positions)
    return int(tree.count_neighbors(tree, distance))


def _without_gross(squares: FloatArray, known: FloatArray, dof: FloatArray) -> BoolArray:
    """Places without a touch that is wrong alone: it is not scatter of the others, (k,) of bool."""
    ratio = squares / known
    usual = max(float(np.median(ratio)) / _MEDIAN_OF_PAIRS, 1.0)
    few = len(ratio) < 3  # of two places none is the odd one
    limit = outlier_factor(int(dof.sum())) ** 2 * usual
    return np.full(len(ratio), True) if few else np.asarray(ratio <= limit)


def _of_faces(positions: FloatArray, normals: FloatArray, expected: FloatArray) -> ScatterSums:
    found = ScatterSums()
    group = np.unique(np.round(normals / _SAME_NORMAL).astype(int), axis=0, return_inverse=True)[1]
    order = np.argsort(group.ravel(), kind="stable")
    for rows in np.split(order, np.cumsum(np.bincount(group.ravel()))[:-1]):
        if len(rows) < _FEWEST_OF_A_FACE:
            continue
        height = positions[rows] @ normals[rows[0]]
        by_height = np.argsort(height)
        faces = np.split(
            rows[by_height], np.flatnonzero(np.diff(height[by_height]) > _SAME_PLANE) + 1
        )
        for face in faces:
            if len(face) >= _FEWEST_OF_A_FACE:
                found = found.joined(_about_face(positions[face], normals[face[0]], expected[face]))
    return found


def _about_face(places: FloatArray, normal: FloatArray, expected: FloatArray) -> ScatterSums:
    """Of the touches of one plane face."""
    offset = places - places.mean(axis=0)
    _, _, axes = np.linalg.svd(np.eye(3) - np.outer(normal, normal))
    u, v = (offset @ axes[:2].T / max(float(np.abs(offset).max()), 1e-9)).T
    terms = [np.ones(len(places)), u, v]
    if len(places) >= _TO_SEE_A_BOW:
        terms += [u**2, u * v, v**2]
    design, height = np.column_stack(terms), offset @ normal
    solved, _, rank, _ = np.linalg.lstsq(design, height, rcond=1e-6)
    left = height - design @ solved
    dof = float(len(places) - int(rank))
    return ScatterSums(float(left @ left), float(expected.mean()) * dof, dof)
