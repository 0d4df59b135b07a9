"""Maps of each kind fitted to an observation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.directions import polar_angle
from pretravel.errors import PretravelError
from pretravel.maps.bases import SECTOR_NAMES, HarmonicBasis, MapBasis, MeanBasis, SectorBasis
from pretravel.qualification.harmonic_regression import (
    HarmonicFit,
    fit_harmonics,
    ring_terms,
    sphere_terms,
)
from pretravel.qualification.observation import Observation
from pretravel.units import DEGREE

Kind = Literal["mean", "sectors", "wozniak", "harmonic"]
KINDS: tuple[Kind, ...] = ("mean", "sectors", "wozniak", "harmonic")

EQUATORIAL = 60.0 * DEGREE
"""Sector tables are made from touches with at least this polar angle. [rad]"""


@dataclass(frozen=True, eq=False)
class MapFit:
    """A map fitted to an observation, with the shift that the centre needs."""

    basis: MapBasis
    coefficients: FloatArray
    covariance: FloatArray
    mean: float
    u_mean: float
    shift: FloatArray
    shift_covariance: FloatArray
    residuals: FloatArray
    dof: float
    noise: float
    gauge: str = "the reference's least-squares centre"
    """What pretravel is relative to, in words."""
    tip_radius: float | None = None
    """Where the fit itself found one. [mm]"""
    noise_is_repeatability: bool = False
    """Whether nothing but scatter is left, so that `noise` tells repeatability with `dof`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HarmonicMapFit(MapFit):
    """The same with the regression's posterior, before what a shift explains went away."""

    basis: HarmonicBasis
    posterior: HarmonicFit
    hat: FloatArray  # (n, n)
    shift_covariance_with_map: FloatArray  # (axes, k)

    @property
    def leverage(self) -> FloatArray:
        """Fitted value per observed value of the same touch, (n,)."""
        return np.asarray(np.diag(self.hat))


def fit_harmonic(observation: Observation, amplitudes: FloatArray | None = None) -> HarmonicMapFit:
    """Kind harmonic; amplitudes of an earlier fit are kept where given."""
    fit = fit_harmonics(
        observation.directions,
        observation.values,
        observation.groups,
        observation.free_terms,
        ring_terms() if observation.ring else sphere_terms(int(observation.groups.max()) + 1),
        amplitudes,
    )
    basis = HarmonicBasis(fit.terms)
    design = basis.design(observation.directions)
    mean_of, shift_of = np.split(observation.to_sphere @ design, [1])
    # Across the axis the centre is where the map has no first harmonic. The least-squares sphere
    # lies beside it: rings of four and eight touches see three lobes as a shift, of up to 1 um.
    shift_of[:2] = 0.0
    for axis, order in ((0, 1), (1, -1)):
        shift_of[axis, (fit.terms == (1, order)).all(axis=1)] = math.sqrt(3.0)
    # What goes to the centre goes from the map.
    move = np.eye(len(fit.terms))
    move[1 : observation.axes + 1] -= shift_of / math.sqrt(3.0)
    return HarmonicMapFit(
        basis=basis,
        coefficients=move @ fit.coefficients,
        covariance=move @ fit.covariance @ move.T,
        mean=(mean_of @ fit.coefficients).item(),
        u_mean=math.sqrt((mean_of @ fit.covariance @ mean_of.T).item()),
        shift=shift_of @ fit.coefficients,
        shift_covariance=shift_of @ fit.covariance @ shift_of.T,
        residuals=observation.values - design @ fit.coefficients,
        dof=float(len(observation.values) - np.trace(fit.hat)),
        noise=fit.noise,
        hat=fit.hat,
        posterior=fit,
        shift_covariance_with_map=shift_of @ fit.covariance @ move.T,
        gauge="a centre about which the map has no first harmonic across the axis, and which is "
        "least-squares along it",
    )


def fit_table(observation: Observation, kind: Kind) -> MapFit:
    """Kinds mean and sectors: a least-squares sphere, then averages about its centre."""
    free, to_sphere = observation.free_design, observation.to_sphere
    solution = to_sphere @ observation.values
    centred = observation.values - free[:, 1:] @ solution[1:]
    basis: MapBasis = MeanBasis() if kind == "mean" else SectorBasis()
    coefficients = solution[:1] if kind == "mean" else _sector_values(observation, centred)
    residuals = centred - basis.design(observation.directions) @ coefficients
    dof = float(max(len(centred) - observation.axes - basis.size, 1))
    # One number for many directions misses most of them: what the kind leaves is its
    # uncertainty in any one direction.
    variance = float(np.sum(residuals**2)) / dof
    sphere_dof = max(len(centred) - free.shape[1], 1)
    sphere_variance = float(np.sum((centred - solution[0]) ** 2)) / sphere_dof
    sphere_covariance = to_sphere @ to_sphere.T * sphere_variance
    return MapFit(
        basis=basis,
        coefficients=coefficients,
        covariance=np.full(basis.size, variance),
        mean=float(solution[0]),
        u_mean=math.sqrt(float(sphere_covariance[0, 0])),
        shift=solution[1:],
        shift_covariance=sphere_covariance[1:, 1:],
        residuals=residuals,
        dof=dof,
        noise=math.sqrt(variance),
    )


def _sector_values(observation: Observation, centred: FloatArray) -> FloatArray:
    """Each sector's mean over the touches near the equator that fall into it."""
    near = polar_angle(observation.directions) >= EQUATORIAL - 1e-6
    share = SectorBasis().design(observation.directions[near])
    weight = share.sum(axis=0)
    if np.any(weight == 0.0):
        empty = ", ".join(
            f"{name}{'°' if name.isdigit() else ''}"
            for name, w in zip(SECTOR_NAMES, weight, strict=True)
            if w == 0.0
        )
        raise PretravelError(
            f"no touch near the equator (polar 60° or more) falls into sector {empty}: a sector "
            "table needs touches at every 30° of azimuth; use kind mean or harmonic, which do not"
        )
    return np.asarray(share.T @ centred[near] / weight)
