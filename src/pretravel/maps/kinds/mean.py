"""Kind mean: one radius for all directions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.maps.basis import MapBasis, SeriesForm, StoredBasis
from pretravel.maps.kind import (
    FEWEST_OF_SIX_SEATS,
    KindOfMap,
    MapFit,
    hidden_lobes,
    hidden_variance,
    usual_shift_covariance,
    with_usual_noise,
)
from pretravel.maps.observation import Observation, Scatter
from pretravel.uncertainty import Covariance


@dataclass(frozen=True)
class MeanBasis(MapBasis):
    """One number for all directions: the mean effective radius of today's controls.

    >>> MeanBasis().design(np.array([[0.0, 0.0, 1.0]])).tolist()
    [[1.0]]
    """

    kind: ClassVar[str] = "mean"
    follows_probe: ClassVar[bool] = False

    @property
    def size(self) -> int:
        return 1

    @property
    def constant(self) -> FloatArray:
        return np.ones(1)

    def design(self, directions: FloatArray) -> FloatArray:
        return np.ones((len(directions), 1))

    def form_on_control(self, coefficients: FloatArray) -> SeriesForm:
        return SeriesForm(np.array([[0, 0]]), coefficients)

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        del stored
        return cls()


@dataclass(frozen=True)
class MeanKind(KindOfMap):
    """The mean over all touches, about the least-squares centre."""

    name: ClassVar[str] = "mean"
    title: ClassVar[str] = "one radius for all"
    summary: ClassVar[str] = "one radius"
    bases: ClassVar[tuple[type[MapBasis], ...]] = (MeanBasis,)
    takes_means: ClassVar[bool] = True

    def fit(self, observation: Observation, repeats: Scatter) -> MapFit:
        del repeats
        return averaged(observation, MeanBasis(), lambda _, mean: np.array([mean]))

    def refit(self, fit: MapFit, observation: Observation) -> MapFit:
        del fit
        return self.fit(observation, Scatter(0.0, 0.0))


def averaged(
    observation: Observation, basis: MapBasis, average: Callable[[FloatArray, float], FloatArray]
) -> MapFit:
    """A least-squares sphere or ring, then averages of pretravel about its centre.

    Parameters
    ----------
    observation : Observation
    basis : MapBasis
    average : callable
        Coefficients (k,) from the pretravel (n,) about the fitted centre, and its mean. [mm]

    Raises
    ------
    PretravelError
        Directions that determine no sphere, or one that passes through all of them: they do not
        show how much pretravel varies.

    Returns
    -------
    MapFit
        Averages stand for many directions. The standard deviation of the residuals, with what few
        directions do not show, is therefore the uncertainty in any one direction, and it is common
        to all of them.
    """
    free, to_sphere = observation.free_design, observation.to_sphere
    solution = to_sphere @ observation.values
    centred = observation.values - free[:, 1:] @ solution[1:]
    coefficients = average(centred, float(solution[0]))
    if not observation.shows_variation:
        raise PretravelError(
            f"{observation.direction_count} directions do not determine centre and radius of the "
            f"{'ring' if observation.ring else 'sphere'}, and how much pretravel varies: "
            "touch more directions, not all at one polar angle"
        )
    residuals = centred - basis.design(observation.directions) @ coefficients
    dof = float(max(len(centred) - observation.axes - basis.size, 1))
    # By directions: what pretravel varies is the same in all repeats of one.
    directions = observation.direction_count
    left = max(directions - observation.axes - basis.size, 1)
    variance = float(np.mean(residuals**2)) * directions / left
    variance = with_usual_noise(variance, left, observation)
    if directions < FEWEST_OF_SIX_SEATS or hidden_lobes(observation) is not None:
        variance += hidden_variance(observation)
    sphere_dof = max(len(centred) - free.shape[1], 1)
    sphere_variance = float(np.sum((centred - solution[0]) ** 2)) / sphere_dof
    sphere_variance = with_usual_noise(sphere_variance, sphere_dof, observation)
    sphere_covariance = to_sphere @ to_sphere.T * sphere_variance
    return MapFit(
        observation=observation,
        basis=basis,
        coefficients=coefficients,
        covariance=_of_one_direction(basis, variance),
        mean=float(solution[0]),
        u_mean=math.sqrt(float(sphere_covariance[0, 0])),
        shift=solution[1:],
        shift_covariance=sphere_covariance[1:, 1:] + usual_shift_covariance(observation),
        residuals=residuals,
        dof=dof,
        noise=math.sqrt(float(np.sum(residuals**2)) / dof),
        contains_hidden=True,
    )


def _of_one_direction(basis: MapBasis, variance: float) -> Covariance:
    """Covariance of the coefficients with which every direction has this variance."""
    level = np.ones(basis.size) if basis.constant is None else basis.constant
    if np.all(level >= 0.0):
        return Covariance.fully_shared(variance * level**2)
    return Covariance.full(variance * np.outer(level, level))
