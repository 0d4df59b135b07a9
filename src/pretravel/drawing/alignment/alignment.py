"""Where a part lies in the machine: what an alignment has, with its uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import (
    MICROMETRE,
    TIP_RADIUS,
    BoolArray,
    FloatArray,
    IntArray,
    Placement,
    PlacementErrors,
    checked,
    describe_axis,
    frozen,
)
from pretravel.drawing.features.feature_uncertainty import FORM_OF_PART, MAP, FeatureErrors
from pretravel.maps import DirectionSupport, MeanBasis, PretravelMap
from pretravel.measurement import FIXED_SCATTER, Association, Points, PretravelLeft
from pretravel.surface import Feet, Part
from pretravel.uncertainty import COVERAGE_FACTOR, Covariance, coverage_factor

MOTIONS = ("x", "y", "z", "about x", "about y", "about z")
"""The six motions of a part: shifts in mm, turns in rad."""
_CURVED = 1e-6  # mm; pretravel over a plane face is one
_SAME_MOTION = 1e-6  # of a motion's size: less is rounding
_SEEN = 0.05  # least share of a touch's error in its residual: below, it determines a motion alone


@dataclass(frozen=True)
class Datum:
    """Faces that together fix motions of a part, as a datum of a drawing does (ISO 5459).

    Attributes
    ----------
    name : str
        The letter of the drawing.
    faces : tuple of int
        Indices of the faces.
    outside : bool
        Associated from outside the material, as ISO 5459 does: planes with the smallest possible
        largest distance from the surface, the largest inscribed bores, the smallest circumscribed
        bosses and balls, each constrained by the datums before it. Such a datum rests on a few
        touches, whose errors move the part; the form of the part does not count as an error. False:
        by least squares.
    """

    name: str
    faces: tuple[int, ...]
    outside: bool = False


@dataclass(frozen=True, eq=False)
class Alignment:
    """Where a part lies in the machine.

    Attributes
    ----------
    placement : Placement
        Of the part's frame in the machine.
    part : Part
    points : Points
        Of all touches, compensated with the normals of the faces; machine frame. Their deviations
        are from the faces.
    feet : Feet
        The nominal points beneath them; frame of the part.
    used : (n,) bool
        The touches that determine the placement.
    gross : (n,) bool
        Touches that do not fit the others, which are left out.
    about : (3,) float
        Point about which the rotations act: the middle of the used points, in the machine. [mm]
    motions : (6, m) float
        Motions of the part that the touches determine, machine axes: shifts in mm, turns about
        `about` in rad.
    undetermined : (6, 6 - m) float
        The other motions, about the part's origin and along the part's axes.
    association : Association
        Of the used points; its m parameters are the amounts of `motions`.
    errors : FeatureErrors
    idle_datums : tuple of str
        Names of datums that have no motion left to fix; their touches are not used.
    """

    placement: Placement
    part: Part
    points: Points
    feet: Feet
    used: BoolArray
    gross: BoolArray
    about: FloatArray
    motions: FloatArray
    undetermined: FloatArray
    association: Association
    errors: FeatureErrors
    idle_datums: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return (
            f"Alignment({int(self.used.sum())} of {len(self.points)} touches; "
            f"{self.motions.shape[1]} of 6 motions determined; "
            f"residuals {self.scatter / MICROMETRE:.2f} µm)"
        )

    @property
    def residuals(self) -> FloatArray:
        """Distances of the points from their faces, positive outside, (n,). [mm]"""
        assert self.points.deviation is not None
        return self.points.deviation

    @property
    def scatter(self) -> float:
        """Root mean square of the residuals per degree of freedom; zero without any. [mm]"""
        dof = self.association.dof
        return math.sqrt(float(np.sum(self.association.residuals**2)) / dof) if dof > 0 else 0.0

    @property
    def pretravel_left(self) -> PretravelLeft:
        """How far the residuals of curved faces follow the pretravel that was subtracted.

        Each face can have a size of its own: residuals are compared within the faces.
        """
        rows, own = np.flatnonzero(self.used), self.association
        pretravel, face = self.points.pretravel[rows], self.feet.face[rows]
        faces = np.unique(face)
        curved = [each for each in faces if np.ptp(pretravel[face == each]) > _CURVED]
        some = np.isin(face, curved)
        sizes = (face[some, None] == curved).astype(np.float64)
        of_map = self.errors.shared.get(MAP)
        return PretravelLeft.of(
            own.residuals[some],
            pretravel[some],
            np.hstack([own.jacobian[some], sizes]),
            None if of_map is None else of_map[:, some],
        )

    @property
    def unchecked(self) -> IntArray:
        """Rows of used touches that no other touch checks: each determines a motion alone, (k,).

        Neither a gross error of such a touch nor a wrong face would be seen.
        """
        own = self.association
        left = 1.0 + np.sum(own.jacobian * own.response.T, axis=1)
        return np.asarray(np.flatnonzero(self.used)[left < _SEEN])

    @property
    def covariance(self) -> FloatArray:
        """Of the shift and of the turns about `about`, machine axes, (6, 6). [mm², mm rad, rad²]

        Motions that are not determined have no part in it.
        """
        return np.asarray(sum(self.errors.parts(self._rows).values()))

    @property
    def _rows(self) -> FloatArray:
        """The six motions by the parameters of the association."""
        rows = np.zeros((6, self.association.response.shape[0]))
        rows[:, : self.motions.shape[1]] = self.motions
        return rows

    @property
    def standard_uncertainty(self) -> FloatArray:
        """Of the six motions, (6,). [mm, rad]"""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U of the six motions: k u, with more than 2 u where few faces show their form, (6,)."""
        u = self.standard_uncertainty
        dof = [self.errors.dof(row, one) for row, one in zip(self._rows, u.tolist(), strict=True)]
        factor = np.array([coverage_factor(each, whole_dof=False) for each in dof])
        return np.asarray(u * factor)

    @property
    def measured_placement(self) -> Placement:
        """The placement with its uncertainty, of which u is U/2.

        Neither files nor points keep degrees of freedom: what is made of them takes 2 u for U.
        """
        u = self.standard_uncertainty
        wider = self.expanded_uncertainty / np.maximum(COVERAGE_FACTOR * u, 1e-300)
        covariance = wider[:, None] * self.covariance * wider
        errors = PlacementErrors(frozen(covariance), frozen(self.about), frozen(self.undetermined))
        return replace(self.placement, errors=errors)

    @property
    def in_part(self) -> Points:
        """The compensated points in the frame of the part, with the numbers of their faces."""
        return points_in_part(self)

    @property
    def undetermined_motions(self) -> tuple[str, ...]:
        """What the touches do not determine, in words, in the frame of the part."""
        return tuple(_words_of_motions(self.undetermined, self.part.size))


def points_in_part(alignment: Alignment) -> Points:
    """The points in the frame of the part; the alignment is an error that they have in common.

    Returns
    -------
    Points
        Shared errors "alignment 1", "alignment 2", … and those of the compensation.

    Notes
    -----
    The part follows the errors of its points: a tip radius that is wrong moves a plane and what is
    aligned on it alike. Of an error that points share, what is left after this movement is in the
    result. Errors of single touches stay errors of single points, and "alignment" has what the
    movement adds to them at the most. The form of the faces moves the part independently of the
    form of a feature on them.
    """
    found, into_part = alignment.points, alignment.placement.inverse
    errors = alignment.measured_placement.errors
    assert errors is not None
    # A part that lies further along a direction has its points further back in its own frame.
    moves = [-into_part.vectors(move) for move in errors.factors(found.positions)]
    part_points = found.placed(into_part)
    whole = part_points.covariance + sum(
        (move[:, :, None] * move[:, None, :] for move in moves), np.zeros((1, 3, 3))
    )
    normals, shared = part_points.normals, part_points.shared
    if shared is not None:
        along = np.einsum("ni,nij,nj->n", normals, part_points.covariance, normals)
        own = np.sqrt(np.maximum(along - sum(each**2 for each in shared.values()), 0.0))
        shared = _left_after_alignment(alignment, shared, own)
        # Across the normals the whole movement is left.
        squares = own**2 + sum(each**2 for each in shared.values())
        across = np.eye(3) - normals[:, :, None] * normals[:, None, :]
        whole = across @ whole @ across
        whole += squares[:, None, None] * normals[:, :, None] * normals[:, None, :]
    numbers = np.array([face.number for face in alignment.part.faces], dtype=np.int64)
    return replace(
        part_points,
        covariance=frozen(whole),
        shared=shared,
        face=numbers[alignment.feet.face],
    )


def _left_after_alignment(
    alignment: Alignment, shared: Mapping[str, FloatArray], own: FloatArray
) -> dict[str, FloatArray]:
    """Errors that points share after the part has moved by the errors of its touches. [mm]"""
    found, used = alignment.points, alignment.used
    normals = found.normals
    by_motion = np.column_stack([normals, np.cross(found.positions - alignment.about, normals)])
    moved = by_motion @ alignment.motions
    response = alignment.association.response[: alignment.motions.shape[1]]
    by_touch = np.zeros((len(found), len(response)))
    by_touch[used] = response.T
    left = {
        name: each if name == FIXED_SCATTER else frozen(each - moved @ (response @ each[used]))
        for name, each in shared.items()
    }
    # The form, and scatter that is fixed in a direction, with the k of few faces.
    parts = alignment.errors.parts(alignment._rows)
    measured = alignment.measured_placement.errors
    assert measured is not None
    followed = sum(
        (part for name, part in parts.items() if name not in (FORM_OF_PART, FIXED_SCATTER)),
        np.zeros((6, 6)),
    )
    basis, triangle = np.linalg.qr(by_motion)
    covariance = np.asarray(measured.covariance) - followed
    size, axes = np.linalg.eigh(triangle @ covariance @ triangle.T)
    kept = size > _SAME_MOTION * max(float(size[-1]), 1e-30)
    factors = [
        *(basis @ axes[:, kept] * np.sqrt(size[kept])).T,
        *_added_noise(moved, by_touch, own),
    ]
    return left | {f"alignment {k + 1}": frozen(each) for k, each in enumerate(factors)}


def _added_noise(moved: FloatArray, by_touch: FloatArray, own: FloatArray) -> list[FloatArray]:
    """Factors that add to independent errors of points what a movement by them adds. [mm]

    With errors e the points keep e - B e, B = moved by_touchᵀ. The covariance of that less that of
    e has no more positive directions than there are motions: these are the factors. With least
    squares on all points there are none.
    """
    scale = np.maximum(own, 1e-9 * max(float(own.max(initial=0.0)), 1e-12))[:, None]
    count = moved.shape[1]
    basis, both = np.linalg.qr(np.hstack([moved / scale, by_touch * scale]))
    p, q = both[:, :count], both[:, count:]
    size, axes = np.linalg.eigh(p @ (q.T @ q) @ p.T - p @ q.T - q @ p.T)
    kept = size > _SAME_MOTION
    return list((scale * (basis @ axes[:, kept]) * np.sqrt(size[kept])).T)


def radius_alone(tip_radius: float) -> PretravelMap:
    """A map without pretravel: the tip's radius is subtracted, and nothing is known of its errors.

    Parameters
    ----------
    tip_radius : float
        [mm]

    >>> radius_alone(3.0).pretravel([[0.0, 0.0, 1.0]]).tolist()
    [0.0]
    """
    checked(tip_radius, "the tip's radius", TIP_RADIUS, inputs=("tip_diameter",))
    return PretravelMap(
        MeanBasis(),
        np.zeros(1),
        Covariance.independent([0.0]),
        DirectionSupport(np.array([[0.0, 0.0, 1.0]])),
        tip_radius=tip_radius,
    )


def _words_of_motions(motions: FloatArray, lever: float) -> list[str]:
    """Motions in words: shifts, and turns about the axes that they leave in place.

    `lever` makes turns comparable with shifts. [mm]
    """
    if motions.shape[1] == 0:
        return []
    motions = motions / np.linalg.norm(motions * motion_scales(lever), axis=0)
    _, size, v = np.linalg.svd(lever * motions[3:], full_matrices=True)
    rank = int(np.sum(size > _SAME_MOTION))
    shifts, turning = (motions @ v[rank:].T)[:3], motions @ v[:rank].T
    words = [f"shift along {describe_axis(axis)}" for axis in _plain_axes(shifts)]
    point = _fixed_point(turning, shifts)
    for axis in _plain_axes(turning[3:]):
        # An axis has a place only across shifts that are not free.
        placed = np.linalg.matrix_rank(np.column_stack([shifts, axis]), tol=1e-6) < len(axis)
        through = ", ".join(f"{value:.4g}" for value in np.round(point, 3) + 0.0)
        words.append(
            f"turn about {describe_axis(axis)}" + (f" through ({through}) mm" if placed else "")
        )
    return words


def _plain_axes(vectors: FloatArray) -> list[FloatArray]:
    """Unit vectors that span the same space, along x, y, z as far as these lie in it."""
    if vectors.shape[1] == 0:
        return []
    u, size, _ = np.linalg.svd(vectors, full_matrices=False)
    space = u[:, size > 1e-9 * size.max()]
    found = [axis for axis in np.eye(3) if np.linalg.norm(space.T @ axis) > 1.0 - _SAME_MOTION]
    known = np.array(found).reshape(-1, 3)
    rest = space - known.T @ (known @ space)
    u, size, _ = np.linalg.svd(rest, full_matrices=False)
    return [*found, *(u[:, size > 0.5].T)]


def _fixed_point(turning: FloatArray, shifts: FloatArray) -> FloatArray:
    """Point that turns leave in place, as far as shifts that are free too cannot move it, (3,)."""
    if turning.shape[1] == 0:
        return np.zeros(3)
    _, size, v = np.linalg.svd(shifts.T, full_matrices=True)
    held = v[int(np.sum(size > 1e-9)) :]
    rows, right = [], []
    for shift, turn in turning.reshape(2, 3, -1).transpose(2, 0, 1):
        # shift + turn x point = 0 across the free shifts.
        cross = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]])
        rows.append(held @ cross)
        right.append(-held @ shift)
    return np.asarray(np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=1e-9)[0])


def motion_scales(lever: float) -> FloatArray:
    """How far a unit of each motion moves a point at a lever, (6, 1). [mm]"""
    return np.array([1.0, 1.0, 1.0, lever, lever, lever])[:, None]
