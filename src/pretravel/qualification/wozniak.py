"""Woźniak's simple method: one constant from the five touches of an everyday qualification."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.directions import five_point_pattern
from pretravel.errors import PretravelError
from pretravel.maps.bases import TRANSDUCERS, WozniakBasis
from pretravel.qualification.map_fit import MapFit
from pretravel.qualification.observation import Observation
from pretravel.units import DEGREE

FEWEST_TO_FIND_LOBES = 8
"""Directions below which the lobes' azimuth must be told."""


def wozniak_constant(
    calibrated_radius: float,
    tip_diameter: float,
    *,
    lobe_azimuth: float = 0.0,
    transducer: str = "contact",
    directions: npt.ArrayLike | None = None,
) -> float:
    """A from the radius that a five-point calibration gave.

    The calibrated radius is the tip's less the mean pretravel of the points; the model
    gives that mean as a multiple of A.

    Parameters
    ----------
    calibrated_radius : float
        Mean of the points' distances from the known centre, less the sphere's radius. [mm]
    tip_diameter : float
        [mm]
    lobe_azimuth, transducer
        See `pretravel.maps.bases.WozniakBasis`.
    directions : (n, 3) float, optional
        Of the points; `five_point_pattern` when not given.

    Returns
    -------
    float
        [mm]

    Raises
    ------
    PretravelError
        An unknown transducer; a calibrated radius above the tip's.

    References
    ----------
    Woźniak, equations 5 to 9. They take the sphere's centre as known; `qualify` with kind
    wozniak fits it together with A.

    >>> round(wozniak_constant(1.990, 4.0, transducer="piezo"), 6)
    0.0125
    """
    shape = _basis(lobe_azimuth, transducer).design(
        five_point_pattern() if directions is None else np.asarray(directions, dtype=np.float64)
    )[:, 0]
    mean = 0.5 * tip_diameter - calibrated_radius
    if mean < 0.0:
        raise PretravelError(
            f"the calibrated radius {calibrated_radius:g} mm is larger than that of the tip, "
            f"{0.5 * tip_diameter:g} mm: pretravel would be negative"
        )
    return float(mean / shape.mean())


def _basis(lobe_azimuth: float, transducer: str) -> WozniakBasis:
    if transducer not in TRANSDUCERS:
        raise PretravelError(
            f"transducer '{transducer}' is not known; there are {', '.join(TRANSDUCERS)}"
        )
    return WozniakBasis(lobe_azimuth, transducer)


def fit_wozniak(
    observation: Observation, *, lobe_azimuth: float | None = None, transducer: str = "contact"
) -> MapFit:
    """A, and with enough directions the lobes' azimuth, together with the reference's centre.

    Parameters
    ----------
    observation : Observation
        Of a sphere or ring, with the tip's diameter told.
    lobe_azimuth : float, optional
        Probe frame; searched when not given. [rad]
    transducer : str
        contact or piezo.

    Returns
    -------
    MapFit

    Raises
    ------
    PretravelError
        No tip diameter; too few directions to find the lobes.

    References
    ----------
    Woźniak, equations 4 and 9.
    """
    if not observation.tip_known:
        raise PretravelError(
            "kind wozniak takes its constant from the tip's true diameter less what the touches "
            "say of it: give --tip-diameter"
        )
    directions, values = observation.directions, observation.values
    shifts = directions[:, : observation.axes]
    count = int(observation.groups.max()) + 1
    searched = lobe_azimuth is None and transducer == "contact"

    def solved(azimuth: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        design = np.column_stack([_basis(azimuth, transducer).design(directions)[:, 0], shifts])
        solution = np.linalg.lstsq(design, values, rcond=None)[0]
        return design, np.asarray(solution, dtype=np.float64), values - design @ solution

    def cost(azimuth: float) -> float:
        return float(np.sum(solved(azimuth)[2] ** 2))

    azimuth = lobe_azimuth or 0.0
    if searched:
        from scipy.optimize import minimize_scalar

        if count < FEWEST_TO_FIND_LOBES:
            raise PretravelError(
                f"{count} directions do not tell where the probe's lobes are: give "
                "--lobe-azimuth (the azimuth of largest pretravel, opposite a rod), "
                f"touch at least {FEWEST_TO_FIND_LOBES} directions, or say --transducer piezo"
            )
        trial = np.arange(0.0, 120.0, 2.0) * DEGREE
        best = float(trial[np.argmin([cost(float(a)) for a in trial])])
        step = 2.0 * DEGREE
        found = minimize_scalar(cost, bounds=(best - step, best + step), method="bounded")
        azimuth = float(np.mod(found.x, 120.0 * DEGREE))
    design, solution, residuals = solved(azimuth)
    dof = max(len(values) - design.shape[1] - int(searched), 1)
    variance = float(np.sum(residuals**2)) / dof
    cofactor = np.linalg.inv(design.T @ design)
    constant = float(solution[0])
    u_azimuth = 0.0
    if searched:
        slope = constant * _basis(azimuth, transducer).design(directions)[:, 1]
        left = slope - design @ np.linalg.lstsq(design, slope, rcond=None)[0]
        u_azimuth = math.sqrt(variance / max(float(left @ left), 1e-30))
    basis = _basis(azimuth, transducer)
    return MapFit(
        basis=basis,
        coefficients=np.array([constant, 0.0, 0.0]),
        # One shape for all probes misses much of each: what it leaves is its uncertainty.
        covariance=np.diag([variance * cofactor[0, 0], (constant * u_azimuth) ** 2, variance]),
        mean=float(observation.to_sphere[0] @ values),
        u_mean=math.sqrt(variance) * float(np.linalg.norm(observation.to_sphere[0])),
        shift=solution[1:],
        shift_covariance=variance * cofactor[1:, 1:],
        residuals=residuals,
        dof=float(dof),
        noise=math.sqrt(variance),
        gauge="Woźniak's model, which has no pretravel along the axis"
        + ("" if not searched else f"; lobes found at azimuth {azimuth / DEGREE:.1f}°"),
    )
