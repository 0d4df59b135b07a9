"""PretravelMap: pretravel over directions, predicted or measured. The second shared type.

A map is linear: pretravel(n) is a sum of basis functions of n times coefficients. Its covariance
is therefore propagated exactly, and every kind (mean radius, sector table, harmonics, table of
predicted directions) is used in the same way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    DELAY,
    FEED_OR_NONE,
    MEASURED_DELAY,
    MICROMETRE,
    TIP_RADIUS,
    UNCERTAINTY,
    BoolArray,
    ExtrapolationError,
    FloatArray,
    Placement,
    PretravelError,
    ShownInNotebooks,
    WithDataset,
    WithPlot,
    check_numbers,
    checked_rotation,
    checked_unit,
    describe,
    from_file,
    frozen,
)
from pretravel.maps.basis import BLOCK, MapBasis
from pretravel.maps.machine_terms import MachineTerms
from pretravel.maps.observation import TouchedMeans
from pretravel.maps.provenance import Provenance
from pretravel.maps.support import MARGIN, DirectionSupport
from pretravel.touches import Touches
from pretravel.uncertainty import Covariance

_CHUNK_VALUES = 4_000_000  # 32 MB of basis functions at a time

AXIAL_RATIO = 0.05
"""Compliance along the probe axis over that across it, where a map does not contain it: stems of
50 to 100 mm have 0.02 to 0.1. It moves the contact along the surface, and so it affects a point
only through the curvature of the surface: by less than 0.05 µm on radii above 5 mm."""

_FEW = 4
"""So few directions outside can all lie there by chance, opposite to directions of the map."""


@dataclass(frozen=True, eq=False)
class PretravelMap(ShownInNotebooks, WithPlot, WithDataset):
    """Pretravel in every supported direction, with its covariance.

    Parameters
    ----------
    basis : MapBasis
    coefficients : (k,) float
        [mm]
    covariance : Covariance
        Of the coefficients. In a table neighbouring coefficients share their errors (fully
        shared), so that uncertainties, not variances, are interpolated between them. [mm²]
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
        Its degrees of freedom; infinite where it was given.
    fixed_scatter : float
        Standard deviation of a touch that repeats in its direction do not reduce: hysteresis, the
        step of a scale, what the map misses from one direction to the next. [mm]
    rotation : (3, 3) float
        Probe to machine frame; see `pretravel.base.frames`.
    feed : float, optional
        Feed rate of the touches that the map was made from; the map contains the delay travel at
        this feed. Zero where the signal delay was separated. [mm/min]
    delay : float, optional
        Signal delay, where it was separated: feed times delay adds to the map's pretravel. [s]
    u_delay : float
        Its standard uncertainty. [s]
    delay_effect : (k,) float, optional
        Change of the coefficients for a delay longer by one standard uncertainty: map and delay
        come from the same touches, and their errors cancel at the feeds of these touches. It adds
        to the uncertainties in addition to `covariance`. [mm]
    provenance : Provenance
        How the map was made.
    touched : TouchedMeans, optional
        What was observed in the nodes of `support`, where the map was fitted to touches there.
    machine : MachineTerms, optional
        Scale, squareness and backlash that were subtracted from the touches of the map, and that
        compensation subtracts from others. Their errors add to `covariance`.

    Raises
    ------
    PretravelError
        Sizes that do not fit, values that are not finite.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> pretravel_map = PretravelMap(
    ...     MeanBasis(), np.array([0.016]), Covariance.independent([1e-8]),
    ...     DirectionSupport(sphere_pattern_25()), tip_radius=3.0)
    >>> pretravel_map.pretravel([[0.0, 0.0, 1.0]]).tolist()
    [0.016]
    >>> pretravel_map.pretravel([[0.0, 0.0, -1.0]])
    Traceback (most recent call last):
    ...
    pretravel.base.errors.ExtrapolationError: 1 of 1 directions lie outside the map, \
the first at polar 180.0°, azimuth 0.0° (90.0° away from the nearest supported one). \
Touch the reference there too, or allow extrapolation.
    """

    basis: MapBasis
    coefficients: FloatArray
    covariance: Covariance
    support: DirectionSupport
    tip_radius: float
    u_tip_radius: float = 0.0
    repeatability: float = 0.0
    repeatability_dof: float = math.inf
    fixed_scatter: float = 0.0
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    feed: float | None = None
    delay: float | None = None
    u_delay: float = 0.0
    delay_effect: FloatArray | None = None
    provenance: Provenance = field(default_factory=Provenance)
    touched: TouchedMeans | None = None
    machine: MachineTerms | None = None

    def __post_init__(self) -> None:
        size = self.basis.size
        coefficients = frozen(self.coefficients)
        if coefficients.shape != (size,):
            raise PretravelError(
                f"a {self.basis.kind} map needs {size} coefficients, got {coefficients.shape}"
            )
        if len(self.covariance) != size:
            raise PretravelError(
                f"the covariance is of {len(self.covariance)} coefficients; the map has {size}"
            )
        if not np.all(np.isfinite(coefficients)):
            raise PretravelError("the coefficients of a map must be finite")
        self._check_numbers()
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "rotation", checked_rotation(self.rotation))
        if self.delay_effect is not None:
            effect = frozen(self.delay_effect)
            if effect.shape != (size,) or not np.all(np.isfinite(effect)):
                raise PretravelError(
                    f"the effect of the delay must be {size} finite numbers, got {effect.shape}"
                )
            object.__setattr__(self, "delay_effect", effect)
        if self.touched is not None and len(self.touched.pretravel) != len(self.support.nodes):
            raise PretravelError(
                f"{len(self.touched.pretravel)} directions were observed; the map has "
                f"{len(self.support.nodes)}"
            )

    def _check_numbers(self) -> None:
        check_numbers(
            self,
            tip_radius=TIP_RADIUS,
            u_tip_radius=UNCERTAINTY,
            repeatability=UNCERTAINTY,
            fixed_scatter=UNCERTAINTY,
            feed=FEED_OR_NONE,
            delay=MEASURED_DELAY,
            u_delay=DELAY,
        )
        if not self.repeatability_dof >= 0.0:
            raise PretravelError(
                f"the degrees of freedom of the repeatability are {self.repeatability_dof:g}; "
                "they must be positive"
            )

    def __repr__(self) -> str:
        source = f"; {self.provenance.source}" if self.provenance.source else ""
        return (
            f"PretravelMap({self.kind}; {len(self.support.nodes):,} directions; "
            f"tip radius {self.tip_radius:.4f} mm; "
            f"repeatability {self.repeatability / MICROMETRE:.2f} µm{source})"
        )

    @property
    def single_touch(self) -> float:
        """Standard deviation of one touch about the map: repeatability and fixed scatter. [mm]"""
        return math.hypot(self.repeatability, self.fixed_scatter)

    @property
    def kind(self) -> str:
        """mean, sectors, wozniak, harmonic, physical or tabulated."""
        return self.basis.kind

    def seen_from(self, part: Placement) -> PretravelMap:
        """The same map in the frame of a part that is turned in the machine."""
        machine = None if self.machine is None else self.machine.seen_from(part)
        return replace(self, rotation=part.rotation.T @ self.rotation, machine=machine)

    def without_machine(self, touches: Touches) -> Touches:
        """Touches without what the map says of control and machine.

        Raises
        ------
        PretravelError
            The map contains a signal delay, and the touches no feeds.
        """
        if self.delay is not None:
            touches = touches.at_rest(self.delay)
        return touches if self.machine is None else self.machine.taken_off(touches)

    def probe_directions(self, normals: npt.ArrayLike) -> FloatArray:
        """Machine-frame normals, (n, 3), as directions in the probe frame."""
        return np.asarray(checked_unit(normals, "normals") @ self.rotation)

    def supports(self, normals: npt.ArrayLike, margin: float = MARGIN) -> BoolArray:
        """Whether the map holds for each normal, (n, 3) in the machine frame: (n,) bool."""
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
        directions = self.probe_directions(normals)
        if not extrapolate:
            self._refuse_outside(directions)
        return self._evaluate(directions, with_uncertainty=False)[0]

    def tip_displacement(
        self,
        normals: npt.ArrayLike,
        curvatures: FloatArray | None = None,
        *,
        extrapolate: bool = False,
    ) -> FloatArray:
        """Displacement of the tip between first contact and trigger, relative to the spindle.

        Its component along n is the pretravel. Its component along the surface, by which the
        contact slides, is that of a stem with `AXIAL_RATIO`, unless the map contains it.

        Parameters
        ----------
        normals : (n, 3) float
            Outward unit normals of the part, machine frame.
        curvatures : (n, 2) float, optional
            Principal curvatures of the part, for maps that depend on them. [1/mm]
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
        if not extrapolate:
            self._refuse_outside(directions)
        moved = self.basis.displacement(directions, curvatures)
        if moved is None:
            pretravel = self._evaluate(directions, with_uncertainty=False)[0]
            # Compliances 1, 1, ratio: the displacement C n, scaled so that n C n is the pretravel.
            along_axes = directions * np.array([1.0, 1.0, AXIAL_RATIO])
            along = np.sum(along_axes * directions, axis=1)
            moved = (pretravel / along)[:, None] * along_axes
        elif self.basis.size > 1:
            # Of the condensed probe alone: on a flat part the component along n is the map.
            flat = self.basis.displacement(directions, None)
            value = self._evaluate(directions, with_uncertainty=False)[0]
            missing = value - np.sum(np.asarray(flat) * directions, axis=1)
            moved = moved + missing[:, None] * directions
        return np.asarray(moved @ self.rotation.T)

    def standard_uncertainty(self, normals: npt.ArrayLike) -> FloatArray:
        """Standard uncertainty of the map's value: coefficients only.

        Compensation adds the repeatability of a touch and the uncertainty of the tip radius.

        Parameters
        ----------
        normals : (n, 3) float
            Outward unit normals of the part, machine frame.

        Returns
        -------
        (n,) float
            [mm]
        """
        return self._evaluate(self.probe_directions(normals), with_uncertainty=True)[1]

    def pretravel_and_uncertainty(
        self, normals: npt.ArrayLike, *, extrapolate: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """Pretravel and its standard uncertainty, at the cost of one of them.

        Parameters, errors: see `pretravel`.

        Returns
        -------
        pretravel, standard_uncertainty : (n,) float each
            [mm]
        """
        directions = self.probe_directions(normals)
        if not extrapolate:
            self._refuse_outside(directions)
        return self._evaluate(directions, with_uncertainty=True)

    def _evaluate(
        self, directions: FloatArray, *, with_uncertainty: bool
    ) -> tuple[FloatArray, FloatArray]:
        """Value and standard uncertainty in directions of the probe frame, in chunks."""
        if not (with_uncertainty and self.states_uncertainty):
            value = self.basis.values_in_blocks(directions, self.coefficients)
            return value, np.zeros(len(directions))
        value, variance = np.empty(len(directions)), np.empty(len(directions))
        rows = min(max(_CHUNK_VALUES // self.basis.size, 1), BLOCK)
        for start in range(0, len(directions), rows):
            part = slice(start, start + rows)
            design = self.basis.design(directions[part])
            value[part] = design @ self.coefficients
            variance[part] = np.maximum(self.covariance.variance_of(design), 0.0)
            if self.delay_effect is not None:
                variance[part] += (design @ self.delay_effect) ** 2
        if self.machine is not None:
            variance += np.sum(self.change_by_machine(directions @ self.rotation.T) ** 2, axis=1)
        return value, np.sqrt(variance)

    @property
    def states_uncertainty(self) -> bool:
        """Whether the map states an uncertainty of its own; predicted maps do not."""
        return self.covariance.states_uncertainty

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
        found = self.covariance.carried(self.basis.design(self.probe_directions(normals)))
        by_delay = self.change_by_delay(normals)
        by_machine = self.change_by_machine(normals)
        return np.asarray(found + np.outer(by_delay, by_delay) + by_machine @ by_machine.T)

    def change_by_delay(self, normals: npt.ArrayLike) -> FloatArray:
        """Change of the map for a signal delay longer by one standard uncertainty, (n,). [mm]"""
        directions = self.probe_directions(normals)
        if self.delay_effect is None:
            return np.zeros(len(directions))
        return np.asarray(self.basis.design(directions) @ self.delay_effect)

    def change_by_machine(self, normals: npt.ArrayLike) -> FloatArray:
        """Change of the map for each error of the terms of the machine, (n, t). [mm]"""
        directions = checked_unit(normals, "normals")
        if self.machine is None:
            return np.zeros((len(directions), 0))
        return self.machine.effect(directions)

    def _refuse_outside(self, directions: FloatArray) -> None:
        distance = self.support.distance(directions)
        outside = distance > MARGIN
        if np.any(outside):
            first = int(np.flatnonzero(outside)[0])
            turned = np.mean(self.support.supports(-directions[outside])) > 0.9
            if turned and outside.sum() > max(0.9 * len(outside), _FEW):
                raise ExtrapolationError(
                    f"{int(outside.sum())} of {len(directions)} directions lie outside the map, "
                    "but their opposites lie inside: these are directions of travel, or normals "
                    "that point into the part. Outward normals are needed; turn the signs "
                    "(nx=-I,ny=-J,nz=-K for a table with I, J, K)",
                    inputs=("columns",),
                )
            raise ExtrapolationError(
                f"{int(outside.sum())} of {len(directions)} directions lie outside the map, "
                f"the first at {describe(directions[first])} "
                f"({distance[first] / DEGREE:.1f}° away from the nearest supported one). "
                "Touch the reference there too, or allow extrapolation.",
                inputs=("extrapolate",),
            )

    def over_support(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The map in directions spread over all that it supports.

        Returns
        -------
        directions : (n, 3) float
            Probe frame; the map's own nodes come first, of very many some thousands.
        pretravel, standard_uncertainty : (n,) float each
            [mm]
        """
        return self._over_support

    @cached_property
    def _over_support(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Asked for by every report, several times."""
        directions = self.support.spread
        value, u = self._evaluate(directions, with_uncertainty=True)
        return directions, frozen(value), frozen(u)


class HasMap(Protocol):
    """A result with one map, such as a qualification."""

    @property
    def pretravel_map(self) -> PretravelMap:
        """The map."""


MapLike: TypeAlias = PretravelMap | HasMap | str | Path
"""What functions take in the place of a map, see `as_map`."""


def as_map(given: MapLike) -> PretravelMap:
    """The map that is meant: a map, that of a qualification, or a file of one.

    Parameters
    ----------
    given : PretravelMap, Qualification, str or Path

    Raises
    ------
    PretravelError
        Something else; as `pretravel.files.map_file.read_map`.

    >>> as_map(3.0)
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: expected a map, not a float: qualify and predicted_map \
make maps, read_map reads one
    """
    if isinstance(given, PretravelMap):
        return given
    if isinstance(given, str | Path):
        given = from_file("map", given)
    found = getattr(given, "pretravel_map", given)
    if not isinstance(found, PretravelMap):
        raise PretravelError(
            f"expected a map, not a {type(given).__name__}: qualify and predicted_map make maps, "
            "read_map reads one"
        )
    return found
