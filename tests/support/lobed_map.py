"""A probe of four harmonics: its map, and touches of a sphere with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pretravel.base.directions import sphere_pattern_25
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance

UM = 1e-3
N = sphere_pattern_25()
NORMALS = np.repeat(N, 3, axis=0)
SETUP = QualificationSetup(25.0, tip_diameter=6.0)
TERMS = np.array([[0, 0], [2, 0], [3, 3], [3, -3]])
COEFFICIENTS = np.array([10.0, -2.0, 1.5, 0.8]) * UM


def lobed_map(**changes: object) -> PretravelMap:
    """Known to 0.05 to 0.1 µm, from touches that repeat to 0.3 µm."""
    made = PretravelMap(
        HarmonicBasis(TERMS), COEFFICIENTS,
        Covariance.independent(np.array([0.05, 0.1, 0.08, 0.08]) ** 2 * UM**2),
        DirectionSupport(N), tip_radius=3.0, repeatability=0.3 * UM, repeatability_dof=50.0,
    )  # fmt: skip
    return replace(made, **changes)  # type: ignore[arg-type]


def value_of(n: np.ndarray) -> np.ndarray:
    return np.asarray(HarmonicBasis(TERMS).design(n) @ COEFFICIENTS)


def lobed_touches(seed: int = 1, normals: np.ndarray = NORMALS, noise: float = 0.3 * UM) -> Touches:
    """Of a sphere of 25 mm, with a tip of 6 mm."""
    rng = np.random.default_rng(seed)
    distance = 15.5 - value_of(normals) + noise * rng.standard_normal(len(normals))
    return Touches(normals * distance[:, None] + [5.0, -7.0, 9.0], normals)


def moved(given: Touches, rows: list[int], off: float) -> Touches:
    """Some touches farther outside. [mm]"""
    positions = given.positions.copy()
    positions[rows] += off * given.normals[rows]
    return replace(given, positions=positions)
