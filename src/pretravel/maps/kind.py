"""What every kind of map can do with touches on a reference: fit, refit, warn."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from pretravel.base import (
    MICROMETRE,
    BoolArray,
    FloatArray,
    fibonacci_cap,
    from_angles,
    polar_angle,
)
from pretravel.maps.basis import MapBasis
from pretravel.maps.observation import Observation, Scatter, sphere_columns
from pretravel.maps.provenance import AXIAL_PRETRAVEL
from pretravel.uncertainty import Covariance

FEWEST_OF_SIX_SEATS = 8
"""The fewest directions that can contradict the seven numbers of six seats."""
LEAST_SQUARES_CENTRE = "the reference's least-squares centre"


@dataclass(frozen=True, eq=False)
class MapFit:
    """A map fitted to an observation, with the shift that the centre needs.

    Attributes
    ----------
    observation : Observation
        The touches about the centre that the fit used.
    basis : MapBasis
    coefficients : (k,) float
        [mm]
    covariance : Covariance
        Of the coefficients. [mm²]
    mean, u_mean : float
        Mean pretravel of the least-squares sphere or ring, and its standard uncertainty. [mm]
    shift : (axes,) float
        Of the observation's centre, to be subtracted from it. [mm]
    shift_covariance : (axes, axes) float
        [mm²]
    residuals : (n,) float
        Observed pretravel less the map's. [mm]
    dof : float
        Touches less effective parameters.
    noise : float
        Standard deviation of the residuals. [mm]
    gauge : str
        What pretravel is relative to, in words.
    tip_radius : float or None
        Where the fit itself determines one. [mm]
    noise_is_repeatability : bool
        Whether the residuals contain scatter alone, so that `noise` is the repeatability, with
        `dof` degrees of freedom.
    fixed_scatter : float
        Standard deviation between touches in different directions that repeats do not reduce:
        hysteresis, the step of a scale, the form of the reference. [mm]
    contains_hidden : bool
        Whether the covariances contain pretravel of usual shape that the directions hide.
    """

    observation: Observation
    basis: MapBasis
    coefficients: FloatArray
    covariance: Covariance
    mean: float
    u_mean: float
    shift: FloatArray
    shift_covariance: FloatArray
    residuals: FloatArray
    dof: float
    noise: float
    gauge: str = LEAST_SQUARES_CENTRE
    tip_radius: float | None = None
    noise_is_repeatability: bool = False
    fixed_scatter: float = 0.0
    contains_hidden: bool = False


@dataclass(frozen=True, eq=False)
class CenteredFit:
    """A fit in the convention that separates its map from the centre, probe frame.

    Attributes
    ----------
    center : (3,) float
        [mm]
    center_covariance : (axes, axes) float
        [mm²]
    coefficients : (k,) float
        [mm]
    covariance : Covariance
        Of the coefficients. [mm²]
    gauge : str
        The convention, in words.
    """

    center: FloatArray
    center_covariance: FloatArray
    coefficients: FloatArray
    covariance: Covariance
    gauge: str


@dataclass(frozen=True, eq=False)
class ReferenceDrift:
    """A movement of the reference against the machine, from the first touch to the last.

    Attributes
    ----------
    value : (axes,) float
        Change of pretravel in the direction of each axis: the reference moves by the negative. [mm]
    covariance : (axes, axes) float
        [mm²]
    slows : bool
        As of a machine that warms up, with a time constant of a third of the run: slower ones look
        steady, quicker ones end soon. Else the movement is steady.
    """

    value: FloatArray
    covariance: FloatArray
    slows: bool = False

    @staticmethod
    def course(times: FloatArray, *, slows: bool) -> FloatArray:
        """Share of the movement at times from -1/2 to 1/2, about its mean over them.

        >>> ends = np.array([-0.5, 0.5])
        >>> [float(np.diff(ReferenceDrift.course(ends, slows=s))[0]) for s in (False, True)]
        [1.0, 1.0]
        """
        if not slows:
            return times
        return np.asarray(1.0 / 3.0 - np.exp(-3.0 * (times + 0.5)) / (1.0 - math.exp(-3.0)))


class KindOfMap(ABC):
    """A kind of map: how it is fitted to touches on a reference.

    A kind is immutable; its settings are its fields.
    """

    name: ClassVar[str]
    """The word of the command line; that of its basis."""

    title: ClassVar[str]
    """The kind in words, for pictures and tables."""

    summary: ClassVar[str] = ""
    """A few words behind the name, in help and forms."""

    bases: ClassVar[tuple[type[MapBasis], ...]] = ()
    """Bases of its maps: one of them restores a map from a file."""

    needs_all_directions: ClassVar[bool] = False
    """Whether the kind cannot be fitted with directions left out of its pattern."""

    prior_weight: ClassVar[float] = 0.2
    """How many left-out directions speak for this kind in advance, in an average of kinds."""

    takes_axial_pretravel: ClassVar[bool] = False
    """Whether `centered` gives the map a pretravel at the pole that is assumed."""

    takes_means: ClassVar[bool] = False
    """Whether the kind follows means at two opposite orientations of the spindle."""

    fits_harmonics: ClassVar[bool] = False
    """Whether the fit is a harmonic regression, which finds outliers and noise itself."""

    @abstractmethod
    def fit(self, observation: Observation, repeats: Scatter) -> MapFit:
        """Fit the map.

        Parameters
        ----------
        observation : Observation
            About the least-squares centre.
        repeats : Scatter
            Of repeated touches.

        Returns
        -------
        MapFit
            About the centre that the kind needs.

        Raises
        ------
        PretravelError
            Touches that do not determine this kind of map.
        """

    def fit_near(self, fit: MapFit, observation: Observation, repeats: Scatter) -> MapFit:
        """As `fit`, to touches that are similar to those of an earlier fit.

        Kinds that search for their numbers begin at those of the earlier fit.
        """
        del fit
        return self.fit(observation, repeats)

    def refit(self, fit: MapFit, observation: Observation) -> MapFit | None:
        """The same fit to slightly different touches, with every choice kept.

        None where the change of such a map is taken as one constant.
        """
        del fit, observation
        return None

    def fits_of_parts(
        self,
        fit: MapFit,
        observation: Observation,
        kept: Sequence[BoolArray],
        parts: Sequence[Observation],
    ) -> list[MapFit]:
        """Fits to parts of the touches, each with all touches of some directions.

        Parameters
        ----------
        fit : MapFit
            Of all touches.
        observation : Observation
            All touches.
        kept : sequence of (n,) bool
            Which touches each part has.
        parts : sequence of Observation
            About the same centre.

        Returns
        -------
        list of MapFit
            By `refit`, and by `fit_near` where that is None.
        """
        del observation, kept
        return [self.refit(fit, part) or self.fit_near(fit, part, part.repeats) for part in parts]

    def centered(self, fit: MapFit, axial_pretravel: float | None) -> CenteredFit:
        """Map and centre in the convention of this kind.

        Parameters
        ----------
        fit : MapFit
        axial_pretravel : float or None
            Pretravel that the map is given at the pole, for kinds that have such a convention.
            [mm]

        Returns
        -------
        CenteredFit
        """
        del axial_pretravel
        return shifted_center(fit)

    def warnings(self, fit: MapFit, repeatability: float) -> list[str]:
        """What to know before using a map of this kind, as sentences.

        Parameters
        ----------
        fit : MapFit
        repeatability : float
            Of a single touch. [mm]
        """
        del fit, repeatability
        return []

    def drift_of_reference(self, fit: MapFit, times: FloatArray) -> ReferenceDrift | None:
        """A drift that explains what the fit leaves better than another kind of probe does.

        None where it does not, and for kinds that cannot tell.

        Parameters
        ----------
        fit : MapFit
        times : (n,) float
            Of its touches, from -1/2 to 1/2.
        """
        del fit, times
        return None

    def weight_in_advance(self, fit: MapFit) -> float:
        """Left-out directions that speak for this kind in an average, after its own fit.

        `prior_weight`, unless the fit shows that these touches are not of this kind.
        """
        del fit
        return self.prior_weight

    def settings(self) -> Mapping[str, Any]:
        """Fields of this kind that a file keeps, so that the map can be made again."""
        return {}


def shifted_center(fit: MapFit) -> CenteredFit:
    """The fit with its own centre.

    A centre moved by s adds n·s to the observed pretravel, on a sphere as in a ring.
    """
    observation = fit.observation
    center = observation.center.copy()
    center[: observation.axes] -= fit.shift
    return CenteredFit(
        center=center,
        center_covariance=fit.shift_covariance,
        coefficients=fit.coefficients,
        covariance=fit.covariance,
        gauge=fit.gauge,
    )


_LEAST_SHOWN = 1e-6
"""Mean square that touches at least leave of the usual shapes: 1 µm of 1 mm across the axis."""
_AROUND = 200
"""Directions over which what few touches hide is averaged."""
_USUAL_ACROSS = 10.0 * MICROMETRE
_MOST_ACROSS = 30.0 * MICROMETRE
"""Pretravel across the axis less that along it: usual (where the tip's diameter is not known and
so nothing is measured), and the most that follows from touches near the pole alone."""
_LOBES = 0.35
"""Lobes of three rods, over pretravel across the axis: the mean is 1.2 to 1.5 times the least."""
_FIRST_HARMONIC = 0.05
"""First harmonic across the axis, over pretravel across the axis: rods 2° out and a spring 2 % of
the radius of the seats off the axis make 0.04."""


def usual_shift_covariance(observation: Observation, left: float = 1.0) -> FloatArray:
    """Covariance of the least-squares centre about the true one, by pretravel of usual shape.

    Parameters
    ----------
    observation : Observation
    left : float
        Share of the usual shape that the map does not represent: one for a map without shape.

    Returns
    -------
    (axes, axes) float
        [mm²]

    Notes
    -----
    Pretravel is usually A sin²θ + L sin³θ cos 3(φ - φ0) and a small first harmonic across the axis,
    and a constant. The least-squares sphere takes a part of each for a shift. A follows from
    the level of that sphere and from pretravel along the axis, which is small.

    >>> from pretravel.base.directions import fibonacci_cap
    >>> n = fibonacci_cap(60, np.pi / 2)
    >>> x, y = n[:, 0], n[:, 1]
    >>> pretravel = 1e-3 * (1.0 + 9.0 * (x**2 + y**2) + 3.0 * (x**3 - 3.0 * x * y**2))
    >>> touches = n * (12.5 + 3.0 - pretravel)[:, None]
    >>> seen = Observation(touches, np.arange(60), np.zeros(3), 12.5, 3.0, ring=False)
    >>> u = np.sqrt(np.diag(usual_shift_covariance(seen))) / MICROMETRE
    >>> bool(np.all(np.abs(u - [0.5, 0.5, 9.0]) < [0.2, 0.2, 1.0]))
    True
    """
    shapes = _usual_shapes(observation.directions)
    amplitude = _usual_amplitude(observation, shapes)
    columns = [
        left * amplitude * (observation.to_sphere[1:] @ shapes),
        amplitude * _FIRST_HARMONIC * np.eye(observation.axes)[:, :2],
    ]
    found = np.hstack(columns)
    return np.asarray(found @ found.T)


def hidden_variance(observation: Observation) -> float:
    """Mean square of what few directions do not show of pretravel of usual shape. [mm²]

    That is what the least-squares sphere leaves of it over all directions between the touched ones,
    less what it leaves at these: four touches 90° apart take three lobes for a shift of the centre.

    >>> from pretravel.base.directions import five_point_pattern, fibonacci_cap
    >>> def seen(n):
    ...     across = n[:, 0] ** 2 + n[:, 1] ** 2
    ...     noise = 3e-4 * np.cos(2.0 * np.arctan2(n[:, 1], n[:, 0])) * across
    ...     touches = n * (12.5 + 3.0 - 1e-3 - 9e-3 * across - noise)[:, None]
    ...     return Observation(touches, np.arange(len(n)), np.zeros(3), 12.5, 3.0, ring=False)
    >>> few, many = (hidden_variance(seen(n)) for n in (five_point_pattern(), fibonacci_cap(60)))
    >>> round(1e3 * math.sqrt(few), 1), round(1e3 * math.sqrt(many), 1)
    (2.9, 0.0)
    """
    shapes, taken, shown = _seen_shapes(observation)
    left = _left_of_shapes(observation, _between(observation), taken)
    hidden = float(np.sum(np.mean(left**2, axis=0) - np.mean(shown**2, axis=0)))
    return _usual_amplitude(observation, shapes) ** 2 * max(hidden, 0.0)


@dataclass(frozen=True, eq=False)
class HiddenLobes:
    """Lobes of a usual size that the touched directions show as a shift of the centre.

    Attributes
    ----------
    between : (n, 3) float
        Directions. Probe frame.
    pretravel : (n, 2) float
        What is not seen of lobes of either azimuth there. [mm]
    shift : (axes, 2) float
        Of the centre, for which they are taken. [mm]
    """

    between: FloatArray
    pretravel: FloatArray
    shift: FloatArray


def hidden_lobes(observation: Observation) -> HiddenLobes | None:
    """The lobes that touches hide, however many there are; None where they show them.

    Four azimuths 90° apart show cos 3φ as cos φ.
    """
    shapes, taken, shown = _seen_shapes(observation)
    if np.all(np.sum(shown**2, axis=0)[1:] > _SHOWN * np.sum(shapes**2, axis=0)[1:]):
        return None
    between = _between(observation)
    left = _left_of_shapes(observation, between, taken)
    size = _usual_amplitude(observation, shapes)
    return HiddenLobes(between, size * left[:, 1:], size * taken[1:, 1:])


def _seen_shapes(observation: Observation) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Usual shapes at the touches, (n, 3), what a sphere takes of them, and what it leaves."""
    shapes = _usual_shapes(observation.directions)
    taken = observation.to_sphere @ shapes
    return shapes, taken, shapes - observation.free_design @ taken


def _left_of_shapes(
    observation: Observation, directions: FloatArray, taken: FloatArray
) -> FloatArray:
    """What the sphere leaves of usual shapes in other directions, (n, 3)."""
    return np.asarray(
        _usual_shapes(directions) - sphere_columns(directions, observation.axes) @ taken
    )


def _between(observation: Observation) -> FloatArray:
    """Directions between the touched ones."""
    if not observation.ring:
        return fibonacci_cap(_AROUND, float(polar_angle(observation.directions).max()))
    around = np.linspace(0.0, 2.0 * math.pi, _AROUND, endpoint=False)
    return from_angles(0.5 * math.pi, around)


_SHOWN = 0.2
"""Share of lobes that a shift leaves: of spread directions 0.6 to 1, of four azimuths below 0.1."""


def _usual_shapes(directions: FloatArray) -> FloatArray:
    """Pretravel of usual shape for one across the axis: sin²θ, lobes of any azimuth, (n, 3)."""
    x, y = directions[:, 0], directions[:, 1]
    lobes = np.stack([x**3 - 3.0 * x * y**2, 3.0 * x**2 * y - y**3], axis=1)
    return np.column_stack([x**2 + y**2, _LOBES / np.sqrt(2.0) * lobes])


def _usual_amplitude(observation: Observation, shapes: FloatArray) -> float:
    """Pretravel across the axis less that along it. [mm]"""
    return min(_by_level(observation, shapes[:, 0]), _by_residuals(observation, shapes))


def _by_level(observation: Observation, across: FloatArray) -> float:
    """The same from the level of the sphere. [mm]"""
    if not observation.tip_known:
        return _USUAL_ACROSS
    # Of the least-squares sphere: values are about any centre.
    to_mean = observation.to_sphere[0]
    beyond = abs(float(to_mean @ observation.values) - AXIAL_PRETRAVEL)
    return min(beyond / max(abs(float(to_mean @ across)), 1e-3), _MOST_ACROSS)


_USUAL_NOISE = 0.3 * MICROMETRE
_USUAL_NOISE_DOF = 2.0
"""How many residuals the usual noise of a touch stands for, together with few of its own."""


def with_usual_noise(variance: float, dof: float, observation: Observation) -> float:
    """A variance of few residuals, which can be small by chance, and what a touch usually has.

    Parameters
    ----------
    variance : float
        Mean square of the residuals. [mm²]
    dof : float
        Of them.
    observation : Observation

    Returns
    -------
    float
        At least that of the step of the positions. [mm²]

    >>> seen = Observation(np.eye(3), np.arange(3), np.zeros(3), 1.0, 2.0, ring=False)
    >>> [round(1e3 * math.sqrt(with_usual_noise(0.0, dof, seen)), 2) for dof in (1, 100)]
    [0.24, 0.0]
    """
    usual = _USUAL_NOISE**2 + observation.step_scatter**2
    if dof < FEWEST_OF_SIX_SEATS:
        variance = max(
            variance, (dof * variance + _USUAL_NOISE_DOF * usual) / (dof + _USUAL_NOISE_DOF)
        )
    return max(variance, observation.step_scatter**2)


def _by_residuals(observation: Observation, shapes: FloatArray) -> float:
    """The same from what the least-squares sphere leaves: a shape cannot hide from it. [mm]"""
    columns = np.column_stack([shapes, observation.values])
    left = columns - observation.free_design @ (observation.to_sphere @ columns)
    mean_square = np.mean(left**2, axis=0)
    shown = max(float(mean_square[:-1].sum()), _LEAST_SHOWN)
    seen = math.sqrt(float(mean_square[-1])) + _hiding(observation)
    return seen / math.sqrt(shown)


def _hiding(observation: Observation) -> float:
    """By how much noise and step can make the residuals of a shape smaller than it is. [mm]

    One residual is near zero by chance; many are not.
    """
    count = observation.direction_count
    left = count - observation.axes - 1
    usual = _USUAL_NOISE if left < FEWEST_OF_SIX_SEATS else 0.0
    size = math.hypot(usual, observation.step_scatter)
    return 2.0 * size * math.sqrt(min(left, FEWEST_OF_SIX_SEATS) / count)
