"""PretravelMap: pretravel over directions, predicted or measured. The other shared type.

A map is linear: pretravel(n) = sum of basis functions of n times coefficients.
So its covariance is carried exactly, and every kind (mean radius, sector table,
harmonics, table of predicted directions) is used in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from pretravel.arrays import BoolArray, FloatArray, IntArray, frozen
from pretravel.direction_support import MARGIN, DirectionSupport
from pretravel.directions import azimuth_angle, checked_unit, describe
from pretravel.errors import ExtrapolationError, PretravelError
from pretravel.frames import Placement
from pretravel.spherical_harmonics import real_spherical_harmonics
from pretravel.units import DEGREE

_CHUNK_VALUES = 4_000_000  # 32 MB of basis functions at a time

AXIAL_RATIO = 0.05
"""Compliance along the probe axis over that across it, where a map does not tell: stems of
50 to 100 mm have 0.02 to 0.1. It moves the contact along the surface, and so comes into a point
only by the surface's curvature: by less than 0.05 µm on radii above 5 mm."""


class MapBasis(Protocol):
    """Functions of direction that a map is a sum of."""

    @property
    def kind(self) -> str:
        """The word of the command line: mean, sectors, harmonic, tabulated."""
        ...

    @property
    def size(self) -> int:
        """Number of functions."""
        ...

    def design(self, directions: FloatArray) -> FloatArray:
        """Values of the functions at (n, 3) directions in the probe frame: (n, size)."""
        ...


@runtime_checkable
class KnowsDisplacement(Protocol):
    """A basis that tells where the tip goes, not only how far along the normal."""

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None = None
    ) -> FloatArray:
        """Of the tip at the trigger, compression included, (n, 3), probe frame. [mm]

        With principal curvatures (n, 2) of the part, its compression is that of the curved part.
        """
        ...


@dataclass(frozen=True)
class MeanBasis:
    """One number for all directions: the mean effective radius of today's controls.

    >>> MeanBasis().design(np.array([[0.0, 0.0, 1.0]])).tolist()
    [[1.0]]
    """

    kind: str = "mean"
    size: int = 1

    def design(self, directions: FloatArray) -> FloatArray:
        return np.ones((len(directions), 1))


SECTOR_NAMES = ("X", "Y", "30", "60", "120", "150", "210", "240", "300", "330")
"""Radii of the vector table of a control: one for both X directions, one for both Y,
eight at the angles (in degrees) of their names."""

_SECTOR_OF_TWELFTH = np.array([0, 2, 3, 1, 4, 5, 0, 6, 7, 1, 8, 9])


@dataclass(frozen=True)
class SectorBasis:
    """The nearest of ten radii in the xy plane, as vector tables of controls have it.

    Radii at 30, 60, 120, 150, 210, 240, 300 and 330 degrees, one shared by +X and
    -X, one shared by +Y and -Y; the nearest in azimuth is taken, whatever the
    polar angle. Halfway between two sectors both count half. For comparison:
    it leaves up to 0.71 of a lobe's amplitude.

    >>> basis = SectorBasis()
    >>> SECTOR_NAMES[int(basis.design(np.array([[0.8, 0.6, 0.0]])).argmax())]
    '30'
    """

    kind: str = "sectors"
    size: int = len(SECTOR_NAMES)

    def design(self, directions: FloatArray) -> FloatArray:
        twelfths = azimuth_angle(directions) / (30.0 * DEGREE)
        lower = np.floor(twelfths)
        fraction = twelfths - lower
        # The 1e-6 keeps a touch meant for 45° a tie however its decimals fall.
        upper_share = np.where(np.abs(fraction - 0.5) < 1e-6, 0.5, (fraction > 0.5) * 1.0)
        rows = np.arange(len(directions))
        design = np.zeros((len(directions), self.size))
        first = lower.astype(np.int64) % 12
        np.add.at(design, (rows, _SECTOR_OF_TWELFTH[first]), 1.0 - upper_share)
        np.add.at(design, (rows, _SECTOR_OF_TWELFTH[(first + 1) % 12]), upper_share)
        # On the axis there is no azimuth: all ten alike.
        on_axis = np.hypot(directions[:, 0], directions[:, 1]) < 0.5 * DEGREE
        design[on_axis] = 1.0 / self.size
        return design


@dataclass(frozen=True, eq=False)
class HarmonicBasis:
    """Real spherical harmonics about the probe axis.

    Parameters
    ----------
    terms : (k, 2) int
        Degree and order of each function.

    >>> HarmonicBasis(np.array([[0, 0], [3, 3]])).size
    2
    """

    terms: IntArray
    kind: str = "harmonic"

    @property
    def size(self) -> int:
        return len(self.terms)

    def design(self, directions: FloatArray) -> FloatArray:
        return real_spherical_harmonics(directions, self.terms)


@dataclass(frozen=True, eq=False)
class TabulatedBasis:
    """Linear interpolation between nodes on the sphere, as predicted maps have it.

    Parameters
    ----------
    support : DirectionSupport
        The nodes; one coefficient each.
    """

    support: DirectionSupport
    kind: str = "tabulated"

    @property
    def size(self) -> int:
        return len(self.support.nodes)

    def design(self, directions: FloatArray) -> FloatArray:
        nodes, weights, _ = self.support.interpolation(directions)
        design = np.zeros((len(directions), self.size))
        np.add.at(design, (np.arange(len(directions))[:, None], nodes), weights)
        return design


@dataclass(frozen=True, eq=False)
class PretravelMap:
    """Pretravel in every supported direction, with its covariance.

    Parameters
    ----------
    basis : MapBasis
    coefficients : (k,) float
        [mm]
    covariance : (k, k) float, or (k,) variances
        Variances alone stand for errors that neighbouring coefficients share wholly, so
        that uncertainties, not variances, are interpolated between them. [mm²]
    support : DirectionSupport
        Directions (probe frame) that the map rests on.
    tip_radius : float
        Radius that goes with the map: readings are compensated by
        tip_radius - pretravel. [mm]
    u_tip_radius : float
        Its standard uncertainty, common to all directions. [mm]
    repeatability : float
        Standard deviation of a single touch along its approach. [mm]
    repeatability_dof : float
        Degrees of freedom of that, infinite where it was told.
    rotation : (3, 3) float
        Probe to machine frame; see `pretravel.frames`.
    feed : float, optional
        Feed rate of the touches behind the map. [mm/min]
    provenance : mapping of str to str
        Where the map comes from, in words.

    Raises
    ------
    PretravelError
        Sizes that do not fit, a covariance with negative variances.

    >>> from pretravel.directions import sphere_pattern_25
    >>> pretravel_map = PretravelMap(
    ...     MeanBasis(), np.array([0.016]), np.array([1e-8]),
    ...     DirectionSupport(sphere_pattern_25()), tip_radius=3.0)
    >>> pretravel_map.pretravel([[0.0, 0.0, 1.0]]).tolist()
    [0.016]
    >>> pretravel_map.pretravel([[0.0, 0.0, -1.0]])
    Traceback (most recent call last):
    ...
    pretravel.errors.ExtrapolationError: 1 of 1 directions lie outside the map, \
the first at polar 180.0°, azimuth 0.0° (90.0° away from the nearest supported one). \
Touch the reference there too, or allow extrapolation (--extrapolate).
    """

    basis: MapBasis
    coefficients: FloatArray
    covariance: FloatArray
    support: DirectionSupport
    tip_radius: float
    u_tip_radius: float = 0.0
    repeatability: float = 0.0
    repeatability_dof: float = math.inf
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    feed: float | None = None
    provenance: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        size = self.basis.size
        coefficients = frozen(self.coefficients)
        covariance = frozen(self.covariance)
        if coefficients.shape != (size,):
            raise PretravelError(
                f"a {self.basis.kind} map needs {size} coefficients, got {coefficients.shape}"
            )
        if covariance.shape not in ((size, size), (size,)):
            raise PretravelError(
                f"the covariance of {size} coefficients has shape ({size}, {size}) or "
                f"({size},), got {covariance.shape}"
            )
        variances = covariance if covariance.ndim == 1 else np.diagonal(covariance)
        if not (np.all(np.isfinite(coefficients)) and np.all(np.isfinite(covariance))):
            raise PretravelError("a map's coefficients and covariance must be finite")
        if np.any(variances < 0.0):
            raise PretravelError("a map's variances cannot be negative")
        if covariance.ndim == 2:
            lowest, highest = np.linalg.eigvalsh(covariance)[[0, -1]]
            if not np.allclose(covariance, covariance.T, atol=1e-12 * max(highest, 0.0)) or (
                lowest < -1e-9 * highest
            ):
                raise PretravelError("this is not a covariance: symmetric, no negative variance")
        if not self.tip_radius > 0.0:
            raise PretravelError(f"tip radius {self.tip_radius} mm: it must be positive")
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "covariance", covariance)
        object.__setattr__(self, "rotation", frozen(self.rotation))
        object.__setattr__(self, "provenance", dict(self.provenance))

    @property
    def kind(self) -> str:
        """mean, sectors, harmonic or tabulated."""
        return self.basis.kind

    def seen_from(self, part: Placement) -> PretravelMap:
        """The same map for a part that is turned in the machine, in that part's frame."""
        return replace(self, rotation=part.rotation.T @ self.rotation)

    def probe_directions(self, normals: npt.ArrayLike) -> FloatArray:
        """Machine-frame normals, (n, 3), as directions in the probe frame."""
        return np.asarray(checked_unit(normals, "normals") @ self.rotation)

    def supports(self, normals: npt.ArrayLike, margin: float = MARGIN) -> BoolArray:
        """Which normals, (n, 3) in the machine frame, the map may be asked for: (n,) bool."""
        return self.support.supports(self.probe_directions(normals), margin)

    def pretravel(self, normals: npt.ArrayLike, *, extrapolate: bool = False) -> FloatArray:
        """Pretravel for approach along -n.

        Parameters
        ----------
        normals : (n, 3) float
            Outward unit normals of the part, machine frame.
        extrapolate : bool
            Also outside the supported directions.

        Returns
        -------
        (n,) float
            [mm]

        Raises
        ------
        ExtrapolationError
            Directions outside the support, unless extrapolation is allowed.
        """
        return self._evaluate(normals, extrapolate=extrapolate, with_uncertainty=False)[0]

    def tip_displacement(
        self,
        normals: npt.ArrayLike,
        curvatures: FloatArray | None = None,
        *,
        extrapolate: bool = False,
    ) -> FloatArray:
        """Where the tip goes between first contact and trigger, seen from the spindle.

        Its part along n is the pretravel. Its part along the surface, by which the
        contact slides, is that of a stem with `AXIAL_RATIO`, unless the map knows it.

        Parameters
        ----------
        normals : (n, 3) float
            Outward unit normals of the part, machine frame.
        curvatures : (n, 2) float, optional
            The part's principal curvatures, for maps that know what they change. [1/mm]
        extrapolate : bool
            Also outside the supported directions.

        Returns
        -------
        (n, 3) float
            Machine frame. [mm]

        Raises
        ------
        ExtrapolationError
            As `pretravel`.
        """
        directions = self.probe_directions(normals)
        if isinstance(self.basis, KnowsDisplacement):
            if not extrapolate:
                self._refuse_outside(directions)
            moved = self.basis.displacement(directions, curvatures)
        else:
            pretravel = self.pretravel(normals, extrapolate=extrapolate)
            # Compliances 1, 1, ratio: the displacement C n, scaled so that n C n is the pretravel.
            given = directions * np.array([1.0, 1.0, AXIAL_RATIO])
            along = np.sum(given * directions, axis=1)
            moved = (pretravel / along)[:, None] * given
        return np.asarray(moved @ self.rotation.T)

    def standard_uncertainty(self, normals: npt.ArrayLike) -> FloatArray:
        """Standard uncertainty of the map's value: coefficients only.

        Repeatability of a touch and tip radius come on top in compensation.

        Parameters
        ----------
        normals : (n, 3) float
            Outward unit normals of the part, machine frame.

        Returns
        -------
        (n,) float
            [mm]
        """
        return self._evaluate(normals, extrapolate=True, with_uncertainty=True)[1]

    def pretravel_and_uncertainty(
        self, normals: npt.ArrayLike, *, extrapolate: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """Both at once, at the cost of one.

        Parameters, errors: see `pretravel`.

        Returns
        -------
        pretravel, standard_uncertainty : (n,) float each
            [mm]
        """
        return self._evaluate(normals, extrapolate=extrapolate, with_uncertainty=True)

    def _evaluate(
        self, normals: npt.ArrayLike, *, extrapolate: bool, with_uncertainty: bool
    ) -> tuple[FloatArray, FloatArray]:
        directions = self.probe_directions(normals)
        if not extrapolate:
            self._refuse_outside(directions)
        value, variance = np.empty(len(directions)), np.zeros(len(directions))
        with_uncertainty = with_uncertainty and self.states_uncertainty
        rows = max(_CHUNK_VALUES // self.basis.size, 1)
        for start in range(0, len(directions), rows):
            part = slice(start, start + rows)
            if isinstance(self.basis, TabulatedBasis) and not with_uncertainty:
                nodes, weights, _ = self.basis.support.interpolation(directions[part])
                value[part] = np.sum(self.coefficients[nodes] * weights, axis=1)
                continue
            design = self.basis.design(directions[part])
            value[part] = design @ self.coefficients
            if with_uncertainty and self.covariance.ndim == 1:
                variance[part] = (design @ np.sqrt(self.covariance)) ** 2
            elif with_uncertainty:
                variance[part] = np.sum((design @ self.covariance) * design, axis=1)
        return value, np.sqrt(np.maximum(variance, 0.0))

    @property
    def states_uncertainty(self) -> bool:
        """Whether the map knows anything of its own errors; predicted ones do not."""
        return bool(self.covariance.any())

    def value_covariance(self, normals: npt.ArrayLike) -> FloatArray:
        """Covariance between the map's values in different directions.

        Parameters
        ----------
        normals : (n, 3) float
            Outward unit normals of the part, machine frame.

        Returns
        -------
        (n, n) float
            [mm²]
        """
        design = self.basis.design(self.probe_directions(normals))
        if self.covariance.ndim == 1:
            deviation = design @ np.sqrt(self.covariance)
            return np.outer(deviation, deviation)
        return np.asarray(design @ self.covariance @ design.T)

    def _refuse_outside(self, directions: FloatArray) -> None:
        distance = self.support.interpolation(directions)[2]
        outside = distance > MARGIN
        if np.any(outside):
            first = int(np.flatnonzero(outside)[0])
            raise ExtrapolationError(
                f"{int(outside.sum())} of {len(directions)} directions lie outside the map, "
                f"the first at {describe(directions[first])} "
                f"({distance[first] / DEGREE:.1f}° away from the nearest supported one). "
                "Touch the reference there too, or allow extrapolation (--extrapolate)."
            )
