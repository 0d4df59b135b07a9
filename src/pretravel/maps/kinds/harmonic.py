"""Kind harmonic: real spherical harmonics about the probe axis, by a regression with priors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, IntArray
from pretravel.maps.basis import MapBasis, SeriesForm, StoredArray, StoredBasis
from pretravel.maps.kind import (
    FEWEST_OF_SIX_SEATS,
    CenteredFit,
    KindOfMap,
    MapFit,
    shifted_center,
    usual_shift_covariance,
)
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.provenance import U_AXIAL_PRETRAVEL
from pretravel.maps.spherical_harmonics import (
    Smoothing,
    checked_terms,
    real_spherical_harmonics,
    ring_terms,
    sphere_terms,
)
from pretravel.maps.support import MARGIN
from pretravel.uncertainty import Covariance

if TYPE_CHECKING:
    from pretravel.maps.harmonic_regression import Amplitudes, HarmonicFit

_POLE = np.array([[0.0, 0.0, 1.0]])
_ALONG = np.array([0.0, 0.0, 1.0])
_FOR_MULTIPLES = 96
"""Directions from which the terms of a sphere have the highest orders."""


@dataclass(frozen=True, eq=False)
class HarmonicBasis(MapBasis):
    """Real spherical harmonics about the probe axis.

    Parameters
    ----------
    terms : (k, 2) int
        Degree and order of each function.

    >>> HarmonicBasis(np.array([[0, 0], [3, 3]])).size
    2
    """

    terms: IntArray
    kind: ClassVar[str] = "harmonic"

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", checked_terms(self.terms))

    @property
    def size(self) -> int:
        return len(self.terms)

    def design(self, directions: FloatArray) -> FloatArray:
        return real_spherical_harmonics(directions, self.terms)

    @property
    def constant(self) -> FloatArray:
        return np.asarray(np.all(self.terms == 0, axis=1), dtype=np.float64)

    def form_on_control(self, coefficients: FloatArray) -> SeriesForm:
        return SeriesForm(self.terms, coefficients)

    def arrays(self) -> Mapping[str, StoredArray]:
        return {
            "degree": StoredArray(("coefficient",), self.terms[:, 0]),
            "order": StoredArray(("coefficient",), self.terms[:, 1]),
        }

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        terms = [np.asarray(stored.arrays[name].values) for name in ("degree", "order")]
        return cls(np.stack(terms, axis=1))


@dataclass(frozen=True, eq=False, kw_only=True)
class HarmonicMapFit(MapFit):
    """A harmonic fit, with the posterior of the regression before the centre was separated.

    Attributes
    ----------
    basis : HarmonicBasis
    posterior : HarmonicFit
        About the centre of the observation.
    shift_of : (axes, k) float
        The shift of the centre that the coefficients of the regression contain.
    """

    basis: HarmonicBasis
    posterior: HarmonicFit
    shift_of: FloatArray

    @property
    def first_harmonic(self) -> FloatArray:
        """Variance of the map's first harmonic across the axis, taken for a shift, (3, 3). [mm²]

        Means at two orientations of the spindle have none.
        """
        variance = self.posterior.amplitudes.first_harmonic_variance
        return np.diag([1.0, 1.0, 0.0]) * (0.0 if self.observation.of_means else variance)

    @property
    def smoothing(self) -> Smoothing:
        """Fitted values per observed value."""
        return self.posterior.smoothing


@dataclass(frozen=True)
class HarmonicKind(KindOfMap):
    """Spherical harmonics, with priors of a three-rod probe.

    Across the axis the centre is where the map has no first harmonic. Along the axis the map is
    given a pretravel at the pole: pole and equator differ by 5 to 15 um, which a least-squares
    sphere takes for a shift.
    """

    name: ClassVar[str] = "harmonic"
    title: ClassVar[str] = "harmonic map"
    summary: ClassVar[str] = "a smooth series"
    bases: ClassVar[tuple[type[MapBasis], ...]] = (HarmonicBasis,)
    prior_weight: ClassVar[float] = 0.35
    takes_axial_pretravel: ClassVar[bool] = True
    takes_means: ClassVar[bool] = True
    fits_harmonics: ClassVar[bool] = True

    def weight_in_advance(self, fit: MapFit) -> float:
        """`prior_weight`; twice that where so few directions hardly contradict six seats."""
        few = fit.observation.direction_count < FEWEST_OF_SIX_SEATS
        return 2.0 * self.prior_weight if few else self.prior_weight

    def fit(self, observation: Observation, repeats: Scatter) -> HarmonicMapFit:
        del repeats
        return fit_harmonic(observation)

    def fit_near(self, fit: MapFit, observation: Observation, repeats: Scatter) -> HarmonicMapFit:
        del repeats
        assert isinstance(fit, HarmonicMapFit)
        return fit_harmonic(observation, near=fit.posterior.amplitudes)

    def refit(self, fit: MapFit, observation: Observation) -> HarmonicMapFit:
        assert isinstance(fit, HarmonicMapFit)
        return fit_harmonic(observation, fit.posterior.amplitudes)

    def centered(self, fit: MapFit, axial_pretravel: float | None) -> CenteredFit:
        assert isinstance(fit, HarmonicMapFit)
        observation, found = fit.observation, shifted_center(fit)
        if observation.ring:
            return found
        if axial_pretravel is not None and observation.tip_known:
            return _with_pretravel_at_pole(fit, found.center, axial_pretravel)
        # The least-squares height, on request or because the level of the map is not known.
        usual = usual_shift_covariance(observation)[2, 2] * np.outer(_ALONG, _ALONG)
        return replace(found, center_covariance=found.center_covariance + usual)


def _with_pretravel_at_pole(
    fit: HarmonicMapFit, center: FloatArray, axial_pretravel: float
) -> CenteredFit:
    at_pole = fit.basis.design(_POLE)[0]
    axial = float(at_pole @ fit.coefficients) - axial_pretravel
    first_zonal = (fit.basis.terms == (1, 0)).all(axis=1)
    coefficients = fit.coefficients.copy()
    coefficients[first_zonal] -= axial / math.sqrt(3.0)
    # With the shift along the axis, the least-squares one and this, the regression has the
    # assumed value at the pole.
    covariance, shift_of = fit.covariance.matrix, fit.shift_of.copy()
    shift_of[2] = at_pole
    of_pole = at_pole - fit.shift_of[2]
    touched = bool(fit.observation.support.supports(_POLE)[0])
    u_pole = math.sqrt(float(of_pole @ covariance @ of_pole))
    return CenteredFit(
        center=center - axial * _ALONG,
        center_covariance=shift_of @ covariance @ shift_of.T
        + fit.first_harmonic
        + (U_AXIAL_PRETRAVEL**2 + fit.observation.u_constant**2) * np.outer(_ALONG, _ALONG),
        coefficients=coefficients,
        covariance=fit.covariance,
        gauge=_gauge(fit, axial_pretravel, u_pole, touched=touched),
    )


def _gauge(fit: HarmonicMapFit, axial_pretravel: float, u_pole: float, *, touched: bool) -> str:
    gauge = (
        f"a centre for which pretravel along the axis is {axial_pretravel / MICROMETRE:g} µm "
        f"(assumed, because touches on a sphere do not determine this value; its u of "
        f"{U_AXIAL_PRETRAVEL / MICROMETRE:g} µm is in u of the centre) and which has no first "
        "harmonic across the axis"
    )
    if not touched:
        return gauge + (
            "; no touch is near the pole, so that the pretravel there is extrapolated (u = "
            f"{u_pole / MICROMETRE:.1f} µm, in u of the centre)"
        )
    if fit.observation.directions[:, 2].max() < math.cos(MARGIN):
        return gauge + (
            "; the pole was not touched, its value is interpolated "
            f"(u = {u_pole / MICROMETRE:.1f} µm)"
        )
    return gauge


def _terms(observation: Observation) -> IntArray:
    """Degrees and orders beyond mean and shift; of means at two orientations the even orders."""
    count = observation.direction_count
    if not observation.of_means:
        return ring_terms() if observation.ring else sphere_terms(count)
    # Six lobes and their multiples: nine azimuths show eighteen as another mean.
    terms = ring_terms() if observation.ring else sphere_terms(max(count, _FOR_MULTIPLES))
    return np.asarray(terms[terms[:, 1] % 2 == 0])


def fit_harmonic(
    observation: Observation, amplitudes: Amplitudes | None = None, near: Amplitudes | None = None
) -> HarmonicMapFit:
    """Fit a harmonic map.

    Parameters
    ----------
    observation : Observation
    amplitudes : Amplitudes, optional
        Of an earlier fit, which are kept; else they are estimated.
    near : Amplitudes, optional
        Of an earlier fit to similar touches, at which their search begins.
    """
    from pretravel.maps.harmonic_regression import fit_harmonics

    fit = fit_harmonics(
        observation.places,
        observation.values,
        observation.groups,
        observation.free_terms,
        _terms(observation),
        amplitudes,
        near,
    )
    basis = HarmonicBasis(fit.terms)
    mean_of, shift_of = np.split(fit.smoothing.means.weighted(observation.to_sphere), [1])
    # Across the axis the centre is where the map has no first harmonic. The least-squares sphere
    # lies next to it: rings of four and eight touches see three lobes as a shift of up to 1 um.
    shift_of[:2] = 0.0
    for axis, order in ((0, 1), (1, -1)):
        shift_of[axis, (fit.terms == (1, order)).all(axis=1)] = math.sqrt(3.0)
    # What the centre takes up is taken from the map.
    move = np.eye(len(fit.terms))
    move[1 : observation.axes + 1] -= shift_of / math.sqrt(3.0)
    found = HarmonicMapFit(
        observation=observation,
        basis=basis,
        coefficients=move @ fit.coefficients,
        # About a centre that was found, errors of this centre are errors of the map: eight
        # directions on the equator take nine lobes for one, which moves the centre, not a bore.
        covariance=Covariance.full(fit.covariance),
        mean=(mean_of @ fit.coefficients).item(),
        u_mean=math.sqrt((mean_of @ fit.covariance @ mean_of.T).item()),
        shift=shift_of @ fit.coefficients,
        shift_covariance=shift_of @ fit.covariance @ shift_of.T,
        residuals=observation.values - fit.smoothing.means.values(fit.coefficients),
        dof=float(len(observation.values) - fit.smoothing.leverage.sum()),
        noise=fit.noise,
        fixed_scatter=fit.fixed_scatter,
        posterior=fit,
        shift_of=shift_of,
        gauge="a centre about which the map has no first harmonic across the axis, and which is "
        "least-squares along it",
    )
    axes = observation.axes
    covariance = found.shift_covariance + found.first_harmonic[:axes, :axes]
    return replace(found, shift_covariance=covariance)
