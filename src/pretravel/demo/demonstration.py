"""The main job on example data: qualify, compensate, and compare the kinds of map."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, InputError, from_angles
from pretravel.drawing import FeatureTolerances, InspectedFeature, inspect_feature, measure_feature
from pretravel.files import read_csv_table, read_touches
from pretravel.maps import KINDS
from pretravel.measurement import (
    Comparison,
    Points,
    apply,
    compare_corrections,
    distances_from_reference,
    points_of_features,
)
from pretravel.qualification import Qualification, qualify
from pretravel.touches import Touches

SPHERE_DIAMETER = 24.9987
TIP_DIAMETER = 6.0
RING_DIAMETER = 50.0
"""Of the KP-3's ring gauge: not published, and without influence on the map. [mm]"""
DATA_FILES = ("sphere_touches.csv", "bore_touches.csv", "part_touches.csv", "kp3_ring.csv")
LIMITS = (19.99, 20.02)
"""Of the diameters of the bores. [mm]"""
BEST = "physical"
"""The kind of map that the demonstration compensates the part with."""


@dataclass(frozen=True)
class KindErrors:
    """Root mean square errors of a kind of map. [mm]

    Attributes
    ----------
    kind : str
        Empty: without compensation.
    fitted : float
        Of the touches that the map was made from.
    left_out : float
        Of touches in directions that were left out; not a number where none can be.
    on_part : float
        Difference to the map of kind `BEST` on the part; not a number without a part.
    """

    kind: str
    fitted: float
    left_out: float
    on_part: float = math.nan


@dataclass(frozen=True)
class DemonstrationTouches:
    """The touches of the example data.

    Attributes
    ----------
    sphere : Touches
        On the reference sphere.
    bores : Touches
        In two bores.
    part : Touches
        On a curved part.
    ring : Touches
        Of a Centroid KP-3 in a ring gauge.
    """

    sphere: Touches
    bores: Touches
    part: Touches
    ring: Touches


@dataclass(frozen=True, eq=False)
class MainJob:
    """The results of the main job on the example data.

    Attributes
    ----------
    qualification : Qualification
        Of kind `BEST`, on the sphere.
    bores : tuple of InspectedFeature
        Before and after compensation, with the decisions about their diameters.
    points : Points
        Of the part.
    comparison : Comparison
        Of the corrections of controls.
    """

    qualification: Qualification
    bores: tuple[InspectedFeature, ...]
    points: Points
    comparison: Comparison


@dataclass(frozen=True, eq=False)
class KindsCompared:
    """Errors of each kind of map on the example data.

    Attributes
    ----------
    sphere_errors : tuple of KindErrors
    ring_errors : tuple of KindErrors
    ring_maps : mapping of kind to Qualification
        Of all touches in the ring.
    """

    sphere_errors: tuple[KindErrors, ...]
    ring_errors: tuple[KindErrors, ...]
    ring_maps: Mapping[str, Qualification]


def read_demonstration(data: Path) -> DemonstrationTouches:
    """Read the example data.

    Parameters
    ----------
    data : Path
        Folder with the files of `DATA_FILES`.

    Raises
    ------
    InputError
        Data that are missing or wrong.
    """
    if not data.is_dir():
        raise InputError("there is no such folder; it is examples/data of the sources", path=data)
    return DemonstrationTouches(
        sphere=read_touches(data / "sphere_touches.csv"),
        bores=read_touches(data / "bore_touches.csv"),
        part=read_touches(data / "part_touches.csv"),
        ring=_read_ring(data / "kp3_ring.csv"),
    )


def do_main_job(touches: DemonstrationTouches) -> MainJob:
    """Qualify on the sphere, measure the bores, compensate the part."""
    best = _qualified(touches.sphere, BEST, search_outliers=True)
    part = touches.part
    in_bores = apply(touches.bores, best.pretravel_map)
    chosen = points_of_features(in_bores, ("bore*",), by_prefix=True)
    tolerances = FeatureTolerances(LIMITS)
    return MainJob(
        qualification=best,
        bores=tuple(
            inspect_feature(measure_feature(mine, "bore", label=label), tolerances)
            for label, mine in chosen.items()
        ),
        points=apply(part, best.pretravel_map),
        comparison=compare_corrections(best.pretravel_map, part.normals),
    )


def compare_kinds_of_map(touches: DemonstrationTouches, best: Qualification) -> KindsCompared:
    """Compare the kinds of map on the sphere, on the part and in the ring.

    Parameters
    ----------
    touches : DemonstrationTouches
    best : Qualification
        Of kind `BEST`, on the sphere.
    """
    ring = touches.ring
    return KindsCompared(
        sphere_errors=_sphere_errors(touches.sphere, touches.part, best),
        ring_errors=_ring_errors(ring),
        ring_maps={kind: _qualified(ring, kind, ring=True) for kind in KINDS},
    )


def ring_touches(azimuth: FloatArray, pretravel: FloatArray) -> Touches:
    """Touches in a ring gauge from a table of pretravel over azimuth.

    Parameters
    ----------
    azimuth : (n,) float
        Of the side of the ring that is touched, seen from its centre. [rad]
    pretravel : (n,) float
        [mm]

    Returns
    -------
    Touches
        With a tip of `TIP_DIAMETER` in a ring of `RING_DIAMETER`.

    >>> ring_touches(np.array([0.0]), np.array([0.05])).positions.round(6).tolist()
    [[22.05, 0.0, 0.0]]
    """
    outward = from_angles(np.pi / 2.0, azimuth) * np.array([1.0, 1.0, 0.0])
    distance = 0.5 * (RING_DIAMETER - TIP_DIAMETER) + pretravel
    return Touches(positions=distance[:, None] * outward, normals=-outward)


def left_out_errors(made: Qualification, touches: Touches) -> FloatArray:
    """Errors of a map at touches that it was not made from.

    Parameters
    ----------
    made : Qualification
    touches : (n,) Touches
        On the reference sphere or ring; they are predicted about the centre that belongs to the
        map.

    Returns
    -------
    (n,) float
        Observed less predicted pretravel. [mm]
    """
    distance, _ = distances_from_reference(made, touches)
    return distance if made.setup.ring else -distance


def _qualified(
    touches: Touches, kind: str, *, ring: bool = False, search_outliers: bool = False
) -> Qualification:
    return qualify(
        touches,
        RING_DIAMETER if ring else SPHERE_DIAMETER,
        kind=kind,
        ring=ring,
        tip_diameter=TIP_DIAMETER,
        search_outliers=search_outliers,
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _without_shift(values: FloatArray, normals: FloatArray) -> FloatArray:
    """Errors along normals less the part of them that a rigid translation explains."""
    shift = np.linalg.lstsq(normals, values, rcond=None)[0]
    return np.asarray(values - normals @ shift)


def _sphere_errors(sphere: Touches, part: Touches, best: Qualification) -> tuple[KindErrors, ...]:
    """Errors on the sphere and on the part: without compensation, then kind by kind."""
    shown = [best.groups % 5 != fold for fold in range(5)]
    reference = best.pretravel_map.pretravel(part.normals)
    made = {kind: best if kind == BEST else _qualified(sphere, kind) for kind in KINDS}
    on_part = _rms(_without_shift(reference, part.normals))
    errors = [KindErrors("", _rms(made["mean"].observed), math.nan, on_part)]
    for kind, result in made.items():
        difference = result.pretravel_map.pretravel(part.normals) - reference
        # A table of sectors needs all its directions.
        left_out = (
            math.nan
            if KINDS[kind].needs_all_directions
            else _rms(
                np.concatenate(
                    [
                        left_out_errors(_qualified(sphere.take(mask), kind), sphere.take(~mask))
                        for mask in shown
                    ]
                )
            )
        )
        on_part = _rms(_without_shift(difference, part.normals))
        errors.append(KindErrors(kind, _rms(result.residuals), left_out, on_part))
    return tuple(errors)


def _ring_errors(ring: Touches) -> tuple[KindErrors, ...]:
    """Errors in the ring: every second direction is fitted, then the others."""
    even = np.arange(len(ring)) % 2 == 0
    errors = []
    for kind in KINDS:
        fitted, left_out = [], []
        for half in (even, ~even):
            made = _qualified(ring.take(half), kind, ring=True)
            fitted.append(made.residuals)
            left_out.append(left_out_errors(made, ring.take(~half)))
        errors.append(
            KindErrors(kind, _rms(np.concatenate(fitted)), _rms(np.concatenate(left_out)))
        )
    return tuple(errors)


def _read_ring(path: Path) -> Touches:
    rows = read_csv_table(path)
    rows.require("azimuth_deg", "pretravel_um", what="the ring table")
    values = rows.numbers("azimuth_deg", "pretravel_um")
    return ring_touches(values[:, 0] * DEGREE, values[:, 1] * MICROMETRE)
