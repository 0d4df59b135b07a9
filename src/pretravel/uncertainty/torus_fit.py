"""The torus of least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, frozen, unit
from pretravel.uncertainty.feature_fit import (
    FLAT,
    Fit,
    ScaledPoints,
    about_axis,
    across,
    checked_points,
    fitted_from_axes,
    least_squares_parameters,
)
from pretravel.uncertainty.sphere_fit import algebraic_sphere

_STEP = 1e-6  # of a difference, in sizes of the points


@dataclass(frozen=True, eq=False, kw_only=True)
class TorusFit(Fit):
    """The torus of the least sum of squared distances.

    Attributes
    ----------
    center : (3,) float
        [mm]
    axis : (3,) float
        Unit vector.
    ring_radius : float
        Of the circle in the middle of the tube. [mm]
    tube_radius : float
        [mm]
    """

    center: FloatArray
    axis: FloatArray
    ring_radius: float
    tube_radius: float


@dataclass(frozen=True, eq=False)
class TorusParameters:
    """A torus: centre, axis, radius of the ring, radius of the tube.

    The parameters of a displacement are two shifts across the axis, one along it, two tilts along
    `across(axis)`, and the changes of the radii.
    """

    center: FloatArray
    axis: FloatArray
    ring: float
    tube: float

    def displaced(self, x: FloatArray) -> TorusParameters:
        """The torus after a displacement (7,)."""
        sideways = across(self.axis)
        return TorusParameters(
            self.center + x[:2] @ sideways + x[2] * self.axis,
            unit(self.axis + x[3:5] @ sideways),
            self.ring + float(x[5]),
            self.tube + float(x[6]),
        )

    def _meridian(
        self, q: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Height, distance from the axis, direction away from it, from the ring: length, normal."""
        height, distance, radial = about_axis(q, self.center, self.axis)
        from_ring = (distance - self.ring)[:, None] * radial + height[:, None] * self.axis
        length = np.linalg.norm(from_ring, axis=1)
        return height, distance, radial, length, from_ring / np.maximum(length, 1e-300)[:, None]

    def normals(self, q: FloatArray) -> FloatArray:
        """Unit vectors away from the middle of the tube, (n, 3)."""
        return self._meridian(q)[4]

    def distances(self, q: FloatArray) -> FloatArray:
        """Of points from the torus, positive outside the tube."""
        return np.asarray(self._meridian(q)[3] - self.tube)

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Derivatives of the distances by a displacement at zero, (n, 7)."""
        sideways = across(self.axis)
        height, distance, radial, _, normal = self._meridian(q)
        outward, upward = np.sum(normal * radial, axis=1), normal @ self.axis
        tilt = (radial @ sideways.T) * (distance * upward - height * outward)[:, None]
        return np.hstack(
            [-normal @ sideways.T, -upward[:, None], tilt, -outward[:, None], -np.ones((len(q), 1))]
        )


def fit_torus(points: npt.ArrayLike, axis: npt.ArrayLike | None = None) -> TorusFit:
    """Fit a torus with the smallest sum of squared distances.

    Without a given axis the start is searched over the half-sphere, as for a cylinder.

    Parameters
    ----------
    points : (n, 3) float
        [mm]
    axis : (3,) float, optional
        Approximate direction of the axis. The search starts from it.

    Raises
    ------
    PretravelError
        Fewer than seven points; points that do not determine the torus.
    ConvergenceError
        Points that do not look like a torus.

    >>> u, v = np.meshgrid(np.arange(6.0), np.arange(5.0))
    >>> rho = 10.0 + 3.0 * np.cos(v.ravel())
    >>> points = np.stack([rho * np.cos(u.ravel()), rho * np.sin(u.ravel()),
    ...                    3.0 * np.sin(v.ravel())], axis=1)
    >>> fit = fit_torus(points)
    >>> round(fit.ring_radius, 9), round(fit.tube_radius, 9)
    (10.0, 3.0)
    """
    p = checked_points(points, "torus", 7)
    scaled = ScaledPoints.of(p, "torus")
    q, scale = scaled.q, scaled.scale
    best = fitted_from_axes(q, "torus", axis, lambda start: _rough(q, start)[1], _fitted)
    singular = np.linalg.svd(best.jacobian(q), compute_uv=False)
    if singular[-1] <= FLAT * singular[0]:
        raise PretravelError(
            "these points do not determine a torus; touch it around the tube and around the axis"
        )
    return TorusFit(
        center=frozen(scaled.middle + scale * best.center),
        axis=frozen(best.axis),
        ring_radius=best.ring * scale,
        tube_radius=best.tube * scale,
        residuals=frozen(best.distances(q) * scale),
        dof=len(p) - 7,
    )


def _rough(q: FloatArray, axis: FloatArray) -> tuple[TorusParameters, float]:
    """A torus about a direction: a circle seen along it, then one in the meridian plane."""
    sideways = across(axis)
    flat, height = q @ sideways.T, q @ axis
    middle = algebraic_sphere(flat)[0][:2]
    distance = np.linalg.norm(flat - middle, axis=1)
    ring, level, tube = algebraic_sphere(np.column_stack([distance, height]))[0].tolist()
    found = TorusParameters(middle @ sideways + level * axis, axis, ring, tube)
    return found, float(np.sum(found.distances(q) ** 2))


def _fitted(q: FloatArray, axis: FloatArray) -> TorusParameters | None:
    """The torus of least squares near an axis; None where the search does not converge."""
    start = _rough(q, axis)[0]

    def jacobian(x: FloatArray) -> FloatArray:
        steps = _STEP * np.eye(7)
        ahead = [start.displaced(x + step).distances(q) for step in steps]
        behind = [start.displaced(x - step).distances(q) for step in steps]
        return np.column_stack(
            [(a - b) / (2.0 * _STEP) for a, b in zip(ahead, behind, strict=True)]
        )

    found = least_squares_parameters(
        lambda x: start.displaced(x).distances(q), jacobian, np.zeros(7)
    )
    if found is None:
        return None
    torus = start.displaced(found)
    return torus if torus.tube > 0.0 and torus.ring > 0.0 else None
