"""PretravelMap: pretravel over directions, predicted or measured. The other shared type.

A map is linear: pretravel(n) = sum of basis functions of n times coefficients.
So its covariance is carried exactly, and every kind (mean radius, sector table,
harmonics, table of predicted directions) is used in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from pretravel.arrays import BoolArray, FloatArray, frozen
from pretravel.directions import checked_unit, describe
from pretravel.errors import ExtrapolationError, PretravelError
from pretravel.frames import Placement
from pretravel.maps.bases import KnowsDisplacement, KnowsValue, MapBasis
from pretravel.maps.support import MARGIN, DirectionSupport
from pretravel.units import DEGREE

_CHUNK_VALUES = 4_000_000  # 32 MB of basis functions at a time

AXIAL_RATIO = 0.05
"""Compliance along the probe axis over that across it, where a map does not tell: stems of
50 to 100 mm have 0.02 to 0.1. It moves the contact along the surface, and so comes into a point
only by the surface's curvature: by less than 0.05 µm on radii above 5 mm."""


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
        Feed rate of the touches behind the map, whose delay travel is in it; zero where
        the signal delay was told apart. [mm/min]
    delay : float, optional
        Signal delay, where it was told apart: feed times this comes on top. [s]
    u_delay : float
        Its standard uncertainty. [s]
    delay_effect : (k,) float, optional
        Change of the coefficients were the delay one standard uncertainty longer: map and delay
        come from the same touches, and their errors cancel at the feeds of these. In
        the uncertainties beside `covariance`. [mm]
    provenance : mapping of str to str
        Where the map comes from, in words.

    Raises
    ------
    PretravelError
        Sizes that do not fit, a covariance with negative variances.

    >>> from pretravel.directions import sphere_pattern_25
    >>> from pretravel.maps.bases import MeanBasis
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
    delay: float | None = None
    u_delay: float = 0.0
    delay_effect: FloatArray | None = None
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
        if self.delay_effect is not None:
            object.__setattr__(self, "delay_effect", frozen(self.delay_effect))
        object.__setattr__(self, "provenance", dict(self.provenance))

    @property
    def kind(self) -> str:
        """mean, sectors, wozniak, harmonic, physical or tabulated."""
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
        extra = np.zeros(len(directions))
        with_uncertainty = with_uncertainty and self.states_uncertainty
        rows = max(_CHUNK_VALUES // self.basis.size, 1)
        for start in range(0, len(directions), rows):
            part = slice(start, start + rows)
            if isinstance(self.basis, KnowsValue) and not with_uncertainty:
                value[part] = self.basis.value(directions[part], self.coefficients)
                continue
            design = self.basis.design(directions[part])
            value[part] = design @ self.coefficients
            if with_uncertainty and self.delay_effect is not None:
                extra[part] = (design @ self.delay_effect) ** 2
            if with_uncertainty and self.covariance.ndim == 1:
                variance[part] = (design @ np.sqrt(self.covariance)) ** 2
            elif with_uncertainty:
                variance[part] = np.sum((design @ self.covariance) * design, axis=1)
        return value, np.sqrt(np.maximum(variance, 0.0) + extra)

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
            found = np.outer(deviation, deviation)
        else:
            found = design @ self.covariance @ design.T
        by_delay = self.change_by_delay(normals)
        return np.asarray(found + np.outer(by_delay, by_delay))

    def change_by_delay(self, normals: npt.ArrayLike) -> FloatArray:
        """Change of the map were the signal delay one standard uncertainty longer, (n,). [mm]"""
        directions = self.probe_directions(normals)
        if self.delay_effect is None:
            return np.zeros(len(directions))
        return np.asarray(self.basis.design(directions) @ self.delay_effect)

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
