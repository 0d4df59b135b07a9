"""Maps made from the example touches, and maps of a known shape."""

from __future__ import annotations

from functools import cache

import numpy as np

from pretravel.controls.lookup_formula import sectoral_factor
from pretravel.directions import ring_pattern
from pretravel.formats.touches_csv import read_touches
from pretravel.identification.kind_registry import qualify
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from pretravel.units import DEGREE
from tests.support.examples import EXAMPLES


@cache
def example_map(kind: str = "harmonic") -> PretravelMap:
    touches = read_touches(EXAMPLES / "sphere_touches.csv")
    return qualify(touches, 24.9987, tip_diameter=6.0, kind=kind).pretravel_map


def lobes(order: int, phase: float = 0.0, rotation: np.ndarray | None = None) -> PretravelMap:
    """Pretravel sin^order(polar) cos(order azimuth - phase) of 1 mm at the most, on 10 mm."""
    terms = np.array([[0, 0], [order, order], [order, -order]])
    amplitude = 1.0 / sectoral_factor(order)
    coefficients = [10.0, amplitude * np.cos(phase), amplitude * np.sin(phase)]
    return PretravelMap(
        HarmonicBasis(terms), np.array(coefficients), Covariance.none(3),
        DirectionSupport(ring_pattern(np.array([0, 30, 60, 90]) * DEGREE, 24)), tip_radius=30.0,
        rotation=np.eye(3) if rotation is None else rotation,
    )  # fmt: skip
