"""What every kind of map can do with touches on a reference: fit, refit, warn."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from pretravel.base.arrays import FloatArray
from pretravel.maps.basis import MapBasis
from pretravel.maps.observation import Observation, Scatter
from pretravel.uncertainty.covariance import Covariance

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


class KindOfMap(ABC):
    """A kind of map: how it is fitted to touches on a reference.

    A kind is a value; settings that it has of its own are its fields.
    """

    name: ClassVar[str]
    """The word of the command line; that of its basis."""

    title: ClassVar[str]
    """The kind in words, for pictures and tables."""

    bases: ClassVar[tuple[type[MapBasis], ...]] = ()
    """Bases of its maps: one of them restores a map from a file."""

    needs_all_directions: ClassVar[bool] = False
    """Whether the kind cannot be fitted with directions left out of its pattern."""

    prior_weight: ClassVar[float] = 0.2
    """How many left-out directions speak for this kind in advance, in an average of kinds."""

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
