"""Residuals of simpler corrections than a map: none, one radius, axis radii, sectors, Woźniak."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    FloatArray,
    PretravelError,
    azimuth_angle,
    checked_unit,
    fibonacci_cap,
    from_angles,
)
from pretravel.maps import (
    MapLike,
    PretravelMap,
    SectorBasis,
    SectorTable,
    WozniakBasis,
    as_map,
    equator,
    resampled_sectors,
    touched_sectors,
)

UNCORRECTED = "uncorrected"
"""The method that subtracts no pretravel, only the radius of the tip."""
_COUNT = 4000  # directions over the sphere
_AXIS = np.array([[0.0, 0.0, 1.0]])
FULL_MAP = "full map"
Correction = Callable[[FloatArray], FloatArray]
"""Pretravel that is subtracted, (n,), of outward normals (n, 3) in the machine frame. [mm]"""


@dataclass(frozen=True)
class CorrectionResidual:
    """Residual of a correction over some directions. [mm]

    Attributes
    ----------
    method : str
    where : str
        equator, all or part.
    count : int
        Directions in which there is a correction.
    largest, rms : float
        Of correction minus map.
    """

    method: str
    where: str
    count: int
    largest: float
    rms: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Corrections compared with a map.

    Attributes
    ----------
    rows : tuple of CorrectionResidual
        Method by method, the finest last.
    azimuth_deg : (a,) float
    curves : mapping of str to (a,) float
        Correction minus map on the equator, by method. [mm]
    u : mapping of str to (n,) float
        Standard uncertainty of the map in the directions of each place, "equator", "all" (those of
        `over_support`, as in a qualification), "part"; zero where the map states none. [mm]
    """

    rows: tuple[CorrectionResidual, ...]
    azimuth_deg: FloatArray
    curves: dict[str, FloatArray]
    u: dict[str, FloatArray]

    @property
    def u_map(self) -> float:
        """Root mean square of the standard uncertainty of the map over all directions. [mm]"""
        return float(np.sqrt(np.mean(self.u["all"] ** 2)))

    def largest_u(self, where: str) -> float:
        """Largest standard uncertainty of the map in a place; all contain the equator."""
        both = ("all", "equator") if where == "all" else (where,)
        return float(max(self.u[each].max() for each in both))


def compare_corrections(
    pretravel_map: MapLike,
    part_normals: npt.ArrayLike | None = None,
    others: Mapping[str, Correction] | None = None,
) -> Comparison:
    """Compare the corrections of today's controls, and Woźniak's, with a map.

    Parameters
    ----------
    pretravel_map : PretravelMap, Qualification, str or Path
        Represents the probe. The corrections are made from it, without errors of touching.
    part_normals : (n, 3) float, optional
        Outward unit normals of the touches of a part.
    others : mapping of str to callable, optional
        Further corrections by name, for example that of a control; nan where they have none.

    Returns
    -------
    Comparison

    Raises
    ------
    ExtrapolationError
        The map does not hold all around the equator, or not along the normals of the part.

    Notes
    -----
    The radii of controls hold in the plane of the table. The length of the tool is set along the
    axis, which shifts every point along it. Between axis and plane the correction is interpolated
    by the component of the normal along the axis (where the map holds on the axis).
    Woźniak's constant and lobe azimuth are fitted to the map over all directions.

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> flat = PretravelMap(MeanBasis(), np.array([0.016]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(sphere_pattern_25()), tip_radius=3.0)
    >>> round(compare_corrections(flat).rows[2].largest, 12)
    0.0
    """
    pretravel_map = as_map(pretravel_map)
    azimuth = np.arange(0.0, 360.0, 1.0)
    spread, _, u_of_spread = pretravel_map.over_support()
    spread = spread @ pretravel_map.rotation.T
    # A map has cusps between lobes: the extremes are also sought where a qualification seeks them.
    more = {"all": spread, "equator": from_angles(0.5 * np.pi, azimuth_angle(spread))}
    around = from_angles(0.5 * np.pi, azimuth * DEGREE)
    places = {"equator": around, "all": _supported(pretravel_map)}
    if part_normals is not None:
        places["part"] = checked_unit(part_normals, "normals of the part")
    truth = {where: pretravel_map.pretravel(n) for where, n in places.items()}
    rows, curves = [], {}
    tables = {
        "eight sectors": touched_sectors(pretravel_map),
        "eight sectors, resampled": resampled_sectors(pretravel_map),
    }
    corrections = _corrections(pretravel_map, tables, places["all"]) | dict(others or {})
    corrections[FULL_MAP] = corrections.pop(FULL_MAP)
    for method, correction in corrections.items():
        off = {where: correction(n) - truth[where] for where, n in places.items()}
        extreme = {where: correction(n) - pretravel_map.pretravel(n) for where, n in more.items()}
        curves[method] = off["equator"]
        rows += [
            CorrectionResidual(
                method,
                where,
                len(_finite(values)),
                # As the file of the table says it: on a boundary of sectors a control uses either.
                tables[method].largest
                if where == "equator" and method in tables
                # All directions contain the equator, which the spread ones miss by some degrees.
                else _largest(
                    values,
                    *([extreme[where]] if where in extreme else []),
                    *([off["equator"], extreme["equator"]] if where == "all" else []),
                ),
                tables[method].rms
                if where == "equator" and method in tables
                else float(np.sqrt(np.sum(_finite(values) ** 2) / max(len(_finite(values)), 1))),
            )
            for where, values in off.items()
        ]
    u = {where: pretravel_map.standard_uncertainty(n) for where, n in places.items()}
    u["all"] = u_of_spread
    return Comparison(tuple(rows), azimuth, curves, u)


def _largest(*errors: FloatArray) -> float:
    return float(np.max(np.abs(_finite(np.concatenate(errors))), initial=0.0))


def _finite(errors: FloatArray) -> FloatArray:
    return np.asarray(errors[np.isfinite(errors)])


def _supported(pretravel_map: PretravelMap) -> FloatArray:
    """Directions spread over all that the map supports, machine frame.

    They are some 2° apart, so that several lie within the margin of any node.
    """
    sphere = fibonacci_cap(_COUNT, np.pi)
    held = sphere[pretravel_map.support.supports(sphere)]
    return np.asarray(held @ pretravel_map.rotation.T)


def _corrections(
    pretravel_map: PretravelMap, tables: Mapping[str, SectorTable], everywhere: FloatArray
) -> dict[str, Correction]:
    """Pretravel that each method subtracts, as functions of the normal, machine frame."""
    ring = equator(pretravel_map, np.arange(0.0, 360.0, 1.0))
    four = equator(pretravel_map, np.array([0.0, 90.0, 180.0, 270.0]))
    axes = np.array([0.5 * (four[0] + four[2]), 0.5 * (four[1] + four[3])])
    axial = pretravel_map.pretravel(_AXIS)[0] if pretravel_map.supports(_AXIS)[0] else None

    def nearest(n: FloatArray, values: FloatArray) -> FloatArray:
        quarter = np.floor(azimuth_angle(n) / (90.0 * DEGREE) + 0.5).astype(np.int64)
        return np.asarray(values[quarter % len(values)])

    def in_plane(across: Correction) -> Correction:
        def correction(n: FloatArray) -> FloatArray:
            value = across(n)
            if axial is None:
                return value
            return np.asarray(value + np.maximum(n[:, 2], 0.0) * (axial - value))

        return correction

    def sectors(table: SectorTable) -> Correction:
        return lambda n: np.asarray(SectorBasis().design(n) @ table.pretravel)

    return {
        UNCORRECTED: lambda n: np.zeros(len(n)),
        "mean radius": in_plane(lambda n: np.full(len(n), float(np.mean(ring)))),
        "two axis radii": in_plane(lambda n: nearest(n, axes)),
        "four directions": in_plane(lambda n: nearest(n, four)),
        **{name: in_plane(sectors(table)) for name, table in tables.items()},
        "Woźniak": _wozniak(pretravel_map, everywhere),
        FULL_MAP: pretravel_map.pretravel,
    }


def _wozniak(pretravel_map: PretravelMap, everywhere: FloatArray) -> Correction:
    """One constant and the azimuth of a lobe, least squares over all directions."""
    truth = pretravel_map.pretravel(everywhere)
    directions = pretravel_map.probe_directions(everywhere)
    best: tuple[float, float, float] | None = None
    for lobe in np.arange(0.0, 120.0, 1.0) * DEGREE:
        shape = WozniakBasis(float(lobe)).design(directions)[:, 0]
        power = float(shape @ shape)
        if power <= 0.0:
            raise PretravelError(
                "the map holds along the probe axis only, so corrections cannot be compared: "
                "touch the reference on its sides, too"
            )
        constant = float(shape @ truth) / power
        left = float(np.sum((truth - constant * shape) ** 2))
        if best is None or left < best[0]:
            best = (left, constant, float(lobe))
    assert best is not None
    _, constant, lobe = best
    basis = WozniakBasis(lobe)
    return lambda n: np.asarray(constant * basis.design(pretravel_map.probe_directions(n))[:, 0])
