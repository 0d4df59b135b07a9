"""Kind wozniak: one constant, lobes of known shape; enough for an everyday qualification."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    ANGLE,
    DEGREE,
    MICROMETRE,
    FloatArray,
    PretravelError,
    azimuth_angle,
    check_numbers,
    five_point_pattern,
)
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.kind import KindOfMap, MapFit, shifted_center, usual_shift_covariance
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.provenance import AXIAL_PRETRAVEL, U_AXIAL_PRETRAVEL
from pretravel.uncertainty import Covariance

FEWEST_TO_FIND_LOBES = 8
"""Directions below which the azimuth of the lobes must be given."""
TRANSDUCERS = ("contact", "piezo")
"""What triggers: electric contacts at three arms (lobes), or a piezo element (no lobes)."""

_LOBE = 2.0 * math.pi / 3.0
_FINER = 6
"""Grids of azimuths, each ten times as fine: to 0.00002°."""
_DETERMINED = 1e-9
_LEFT = 0.4
"""Share of the shape of a probe's pretravel that differs from this one."""


@dataclass(frozen=True)
class WozniakBasis(MapBasis):
    r"""Woźniak's simple map: one constant, lobes of known shape.

    Pretravel is A cos²γ / cos((β mod 120°) - 60°): γ is the elevation above the
    equator, β the azimuth from a lobe. It is A between lobes, 2 A on them and
    nothing along the axis. With a piezo transducer the lobes are absent.

    Parameters
    ----------
    lobe_azimuth : float
        Azimuth of a lobe, where pretravel is largest: opposite a rod. [rad]
    transducer : str
        contact or piezo.

    Notes
    -----
    Three functions: the shape, its slope with the lobe's azimuth, and a constant. Maps
    have the coefficients (A, 0, 0); the other two carry the variances of the azimuth and of the
    residuals of this shape.

    References
    ----------
    Woźniak, equation 4, its angle folded about the middle of a lobe (as printed it has a
    pole).

    >>> basis = WozniakBasis(0.0)
    >>> n = np.array([[1.0, 0.0, 0.0], [0.5, math.sqrt(0.75), 0.0], [0.0, 0.0, 1.0]])
    >>> basis.design(n)[:, 0].round(9).tolist()
    [2.0, 1.0, 0.0]
    """

    lobe_azimuth: float
    transducer: str = "contact"
    kind: ClassVar[str] = "wozniak"
    follows_probe: ClassVar[bool] = False

    @property
    def size(self) -> int:
        return 3

    @property
    def constant(self) -> FloatArray:
        return np.array([0.0, 0.0, 1.0])

    def design(self, directions: FloatArray) -> FloatArray:
        across = directions[:, 0] ** 2 + directions[:, 1] ** 2
        shape, slope = np.ones(len(across)), np.zeros(len(across))
        if self.transducer == "contact":
            shape, slope = _lobes(azimuth_angle(directions), self.lobe_azimuth)
        return np.stack([across * shape, across * slope, np.ones(len(across))], axis=1)

    def attributes(self) -> Mapping[str, str | float]:
        return {"lobe_azimuth_rad": self.lobe_azimuth, "transducer": self.transducer}

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        return cls(
            float(stored.attributes["lobe_azimuth_rad"]), str(stored.attributes["transducer"])
        )


def _lobes(azimuths: FloatArray, lobe: float | FloatArray) -> tuple[FloatArray, FloatArray]:
    """The lobes of unit height between them at some azimuths, and their slope with that of one."""
    folded = np.mod(azimuths - lobe, _LOBE) - 0.5 * _LOBE
    shape = 1.0 / np.cos(folded)
    return shape, -shape * np.tan(folded)


def wozniak_constant(
    calibrated_radius: float,
    tip_diameter: float,
    *,
    lobe_azimuth: float = 0.0,
    transducer: str = "contact",
    directions: npt.ArrayLike | None = None,
) -> float:
    """The constant A from the radius that a five-point calibration gave.

    The calibrated radius is the radius of the tip less the mean pretravel of the points; the model
    states that mean as a multiple of A.

    Parameters
    ----------
    calibrated_radius : float
        Mean of the points' distances from the known centre, less the sphere's radius. [mm]
    tip_diameter : float
        [mm]
    lobe_azimuth, transducer
        See `WozniakBasis`.
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
    Woźniak, equations 5 to 9. They use a known centre of the sphere; `qualify` with kind
    wozniak fits the centre together with A.

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


def _check_transducer(transducer: str) -> None:
    if transducer not in TRANSDUCERS:
        raise PretravelError(
            f"transducer '{transducer}' is not known; there are {', '.join(TRANSDUCERS)}",
            inputs=("transducer",),
        )


def _basis(lobe_azimuth: float, transducer: str) -> WozniakBasis:
    _check_transducer(transducer)
    return WozniakBasis(lobe_azimuth, transducer)


@dataclass(frozen=True)
class WozniakKind(KindOfMap):
    """A, and with enough directions the azimuth of the lobes, together with the centre.

    Parameters
    ----------
    lobe_azimuth : float, optional
        Azimuth of largest pretravel, opposite a rod, in the probe frame. It is determined from the
        touches when not given. [rad]
    transducer : str
        contact or piezo.

    References
    ----------
    Woźniak, equations 4 and 9.
    """

    lobe_azimuth: float | None = None
    transducer: str = "contact"
    name: ClassVar[str] = "wozniak"
    title: ClassVar[str] = "Woźniak's constant"
    summary: ClassVar[str] = "one constant"
    bases: ClassVar[tuple[type[MapBasis], ...]] = (WozniakBasis,)

    def __post_init__(self) -> None:
        check_numbers(self, lobe_azimuth=ANGLE)
        _check_transducer(self.transducer)

    def fit(self, observation: Observation, repeats: Scatter) -> MapFit:
        """See `KindOfMap.fit`; the tip's diameter must be known."""
        del repeats
        first = self._fit_once(observation)
        # Its centre lies micrometres from the least-squares one: fit once more about it.
        return self._fit_once(replace(observation, center=shifted_center(first).center))

    def refit(self, fit: MapFit, observation: Observation) -> MapFit:
        assert isinstance(fit.basis, WozniakBasis)
        return _fit_at(observation, fit.basis, lobes_found=False)

    def warnings(self, fit: MapFit, repeatability: float) -> list[str]:
        if fit.noise <= 3.0 * repeatability:
            return []
        return [
            (
                f"the residuals of Woźniak's model are {fit.noise / MICROMETRE:.1f} µm, but "
                "touches "
                f"repeat to {repeatability / MICROMETRE:.2f} µm: check the azimuth of the lobes, "
                "or let the kinds of map be compared (auto)"
            )
        ]

    def settings(self) -> Mapping[str, Any]:
        return {"lobe_azimuth": self.lobe_azimuth, "transducer": self.transducer}

    def _fit_once(self, observation: Observation) -> MapFit:
        if not observation.tip_known:
            raise PretravelError(
                "kind wozniak determines its constant from the true diameter of the tip and the "
                "effective one: give the tip's diameter",
                inputs=("tip_diameter",),
            )
        if self.lobe_azimuth is None and self.transducer == "contact":
            found = _basis(_azimuth_of_lobes(observation), self.transducer)
            return _fit_at(observation, found, lobes_found=True)
        basis = _basis(self.lobe_azimuth or 0.0, self.transducer)
        return _fit_at(observation, basis, lobes_found=False)


def _design(observation: Observation, basis: WozniakBasis) -> FloatArray:
    """Columns of A and of a shift of the centre, (n, 1 + axes)."""
    directions = observation.directions
    return np.column_stack([basis.design(directions)[:, 0], directions[:, : observation.axes]])


def _azimuth_of_lobes(observation: Observation) -> float:
    """The azimuth of a lobe with the smallest residuals. [rad]"""
    if observation.direction_count < FEWEST_TO_FIND_LOBES:
        raise PretravelError(
            f"{observation.direction_count} directions do not determine where the lobes of the "
            "probe are: give the azimuth of largest pretravel (opposite a rod), touch at least "
            f"{FEWEST_TO_FIND_LOBES} directions, or choose the transducer piezo",
            inputs=("lobe_azimuth", "transducer"),
        )

    places = observation.places
    directions, count = places.directions, np.bincount(places.of_touches)
    root = np.sqrt(count)
    values = np.bincount(places.of_touches, observation.values) / root
    across = root * (directions[:, 0] ** 2 + directions[:, 1] ** 2)
    span, size, _ = np.linalg.svd(
        root[:, None] * directions[:, : observation.axes], full_matrices=False
    )
    span = span[:, size > _DETERMINED * size[0]]
    # Every azimuth has a kink where a touch lies between two lobes: a grid, and finer ones.
    step = 2.0 * DEGREE
    trial = np.arange(0.0, 120.0, 2.0) * DEGREE
    for _ in range(_FINER):
        shapes = across * _lobes(azimuth_angle(directions), trial[:, None])[0]
        shapes -= (shapes @ span) @ span.T  # what a shift of the centre does not explain
        explained = (shapes @ values) ** 2 / np.einsum("ag,ag->a", shapes, shapes)
        step, middle = 0.1 * step, trial[explained.argmax()]
        trial = middle + step * np.arange(-10, 11)
    return float(np.mod(middle, _LOBE))


def _fit_at(observation: Observation, basis: WozniakBasis, *, lobes_found: bool) -> MapFit:
    """Least squares with the azimuth of the lobes kept; its uncertainty where it was found."""
    values, design = observation.values, _design(observation, basis)
    solution = np.linalg.lstsq(design, values, rcond=None)[0]
    residuals = values - design @ solution
    dof = max(len(values) - design.shape[1] - int(lobes_found), 1)
    variance = float(np.sum(residuals**2)) / dof
    cofactor = np.linalg.inv(design.T @ design)
    constant = float(solution[0])
    u_azimuth = 0.0
    if lobes_found:
        slope = constant * basis.design(observation.directions)[:, 1]
        left = slope - design @ np.linalg.lstsq(design, slope, rcond=None)[0]
        u_azimuth = math.sqrt(variance / max(float(left @ left), 1e-30))
    return MapFit(
        observation=observation,
        basis=basis,
        coefficients=np.array([constant, 0.0, 0.0]),
        # One shape for all probes: the standard deviation of the residuals is its uncertainty.
        covariance=Covariance.full(
            np.diag([variance * cofactor[0, 0], (constant * u_azimuth) ** 2, variance])
        ),
        mean=float(observation.to_sphere[0] @ values),
        u_mean=math.sqrt(variance) * float(np.linalg.norm(observation.to_sphere[0])),
        shift=np.asarray(solution[1:], dtype=np.float64),
        shift_covariance=variance * cofactor[1:, 1:] + _shift_by_shape(observation),
        residuals=residuals,
        dof=float(dof),
        noise=math.sqrt(variance),
        gauge="Woźniak's model, which has no pretravel along the axis"
        + (f"; lobes found at azimuth {basis.lobe_azimuth / DEGREE:.1f}°" if lobes_found else ""),
    )


def _shift_by_shape(observation: Observation) -> FloatArray:
    """Covariance of the centre by what this one shape leaves of a probe's. [mm²]"""
    found = usual_shift_covariance(observation, _LEFT)
    if not observation.ring:  # no pretravel along the axis, where probes have a little
        found[2, 2] += AXIAL_PRETRAVEL**2 + U_AXIAL_PRETRAVEL**2 + observation.u_constant**2
    return found
