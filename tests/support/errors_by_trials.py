"""Maps, compensated points and spheres by trials, for comparisons with stated uncertainties."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.laboratory.measured_spheres import MeasuredSphere
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.point_errors import PointErrors, errors_of_points, total_covariance
from pretravel.measurement.points import Points
from pretravel.touches import Touches
from pretravel.uncertainty.sphere_fit import SphereFit
from tests.support.monte_carlo import MonteCarlo, Validation, monte_carlo, validate
from tests.support.propagation import Propagated

_CHUNK = 200


def errors_by_trials(
    errors: PointErrors, pretravel: FloatArray, trials: int, generator: np.random.Generator
) -> FloatArray:
    """Errors of the points, drawn: one map, one tip radius and one delay in each trial.

    Parameters
    ----------
    errors : PointErrors
    pretravel : (n,) float
        That compensation subtracted. [mm]
    trials : int
    generator : numpy.random.Generator

    Returns
    -------
    (trials, n, 3) float
        [mm]
    """
    values = map_by_trials(
        replace(errors.pretravel_map, delay_effect=None),
        errors.normals,
        trials=trials,
        seed=int(generator.integers(2**31)),
    )
    travel = (values - pretravel) / errors.closing
    travel += errors.pretravel_map.single_touch * generator.standard_normal(values.shape)
    if errors._delay_matters:
        travel += generator.standard_normal((trials, 1)) * errors.delay_along_approach
    radius = errors.pretravel_map.u_tip_radius * generator.standard_normal((trials, 1, 1))
    return np.asarray(-travel[..., None] * errors.approaches - radius * errors.normals)


def map_by_trials(
    pretravel_map: PretravelMap,
    normals: npt.ArrayLike,
    *,
    trials: int = 10_000,
    seed: int | None = 1,
) -> FloatArray:
    """Trials of a map's values, with the errors that directions have in common.

    Parameters
    ----------
    pretravel_map : PretravelMap
    normals : (n, 3) float
        Machine frame.
    trials : int
    seed : int or None

    Returns
    -------
    (trials, n) float
        Their standard deviation is `PretravelMap.standard_uncertainty`. [mm]

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> up = [[0.0, 0.0, 1.0]]
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(up), tip_radius=3.0)
    >>> bool(abs(map_by_trials(mean, up).std() / 1e-4 - 1.0) < 0.03)
    True
    """
    if trials < 2:
        raise PretravelError(f"{trials} trials do not make a distribution", inputs=("trials",))
    generator = np.random.default_rng(seed)
    design = pretravel_map.basis.design(pretravel_map.probe_directions(normals))
    moved = pretravel_map.covariance.errors(generator, trials, weights=design)
    by_delay = pretravel_map.change_by_delay(normals)
    moved = moved + generator.standard_normal((trials, 1)) * by_delay
    return np.asarray(design @ pretravel_map.coefficients + moved)


def points_by_trials(
    touches: Touches,
    points: Points,
    pretravel_map: PretravelMap,
    *,
    trials: int = 10_000,
    seed: int | None = 1,
) -> FloatArray:
    """Trials of compensated points: repeatability, map, tip radius and delay are drawn.

    For results of your own: evaluate each trial as you evaluate the points. Each trial has one
    map, one tip radius and one delay for all points.

    Parameters
    ----------
    touches : Touches
    points : Points
        The same touches, compensated with the map.
    pretravel_map : PretravelMap
    trials : int
    seed : int or None

    Returns
    -------
    (trials, n, 3) float
        [mm]

    References
    ----------
    JCGM 102, section 7: several outputs, drawn together.
    """
    errors = errors_of_points(touches, points.normals, pretravel_map)
    generator = np.random.default_rng(seed)
    return np.asarray(
        points.positions + errors_by_trials(errors, points.pretravel, trials, generator)
    )


def sphere_by_trials(
    measured: MeasuredSphere,
    *,
    probability: float = 0.95,
    digits: int = 1,
    most_trials: int = 100_000,
    seed: int | None = 1,
) -> tuple[MonteCarlo, Validation]:
    """The distribution of the diameter by trials, and whether it confirms the GUM's interval.

    Parameters
    ----------
    measured : MeasuredSphere
    probability, digits, most_trials, seed
        As for `monte_carlo`.

    Returns
    -------
    MonteCarlo
        Of the diameter. [mm]
    Validation
    """
    along_normals = total_covariance(measured.sources)

    def draw(generator: np.random.Generator, trials: int) -> FloatArray:
        return along_normals.errors(generator, trials)

    def diameters(moved: FloatArray) -> FloatArray:
        # The sphere of every trial is fitted, by Gauss-Newton for all trials at once.
        points = measured.points
        p = points.positions[None] + moved[:, :, None] * points.normals[None]
        return 2.0 * sphere_radii(p, measured.fit)

    trials = monte_carlo(
        diameters,
        draw,
        probability=probability,
        digits=digits,
        share=0.2,
        most_trials=most_trials,
        seed=seed,
    )
    value = np.array([measured.diameter])
    u = measured.budget.combined
    gum = Propagated(
        value=value,
        covariance=np.array([[u**2]]),
        jacobian=np.ones((1, 1)),
        effective_dof=np.array([np.inf]),
        budgets=(measured.budget,),
    )
    return trials, validate(gum, trials, digits)


def sphere_radii(p: FloatArray, start: SphereFit) -> FloatArray:
    """Radii of least-squares spheres through (t, n, 3) points near a fitted one, (t,)."""
    radii = np.empty(len(p))
    for first in range(0, len(p), _CHUNK * 10):
        part = p[first : first + _CHUNK * 10]
        center = np.repeat(start.center[None], len(part), axis=0)
        radius = np.full(len(part), start.radius)
        for _ in range(4):  # errors of micrometres: the third step moves below 1e-12 mm
            offset = part - center[:, None]
            distance = np.linalg.norm(offset, axis=2)
            jacobian = np.concatenate(
                [offset / distance[..., None], np.ones((*distance.shape, 1))], axis=2
            )
            normal = np.einsum("tni,tnj->tij", jacobian, jacobian)
            right = np.einsum("tni,tn->ti", jacobian, distance - radius[:, None])
            step = np.linalg.solve(normal, right[..., None])[..., 0]
            center, radius = center + step[:, :3], radius + step[:, 3]
        radii[first : first + len(part)] = radius
    return radii
