"""Maps made from the example touches, and maps of a known shape."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from pretravel.base.directions import ring_pattern
from pretravel.base.units import DEGREE
from pretravel.controls.lookup_formula import sectoral_factor
from pretravel.files.touches_csv import read_touches
from pretravel.maps.basis import MapBasis
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualify
from pretravel.uncertainty.covariance import Covariance
from tests.support.examples import SPHERE

HALF = DirectionSupport(ring_pattern(np.array([0, 30, 60, 90]) * DEGREE, 24))


@cache
def example_qualification(kind: str = "harmonic") -> Qualification:
    """Of the example touches, made once in each worker: kind physical takes seconds."""
    return qualify(read_touches(SPHERE), 24.9987, tip_diameter=6.0, kind=kind)


def example_map(kind: str = "harmonic") -> PretravelMap:
    return example_qualification(kind).pretravel_map


def mean_map(pretravel: float, *, tip_radius: float = 3.0) -> PretravelMap:
    """The same pretravel [mm] in all directions of the upper half."""
    return PretravelMap(
        MeanBasis(), np.array([pretravel]), Covariance.none(1),
        HALF, tip_radius=tip_radius,
    )  # fmt: skip


def made_up_map(basis: MapBasis, **others: Any) -> PretravelMap:
    """Unlike coefficients of any basis, over the upper half."""
    given: dict[str, Any] = {
        "coefficients": 0.01 * (1.0 + 0.3 * np.sin(np.arange(basis.size))),
        "covariance": Covariance.none(basis.size), "support": HALF, "tip_radius": 3.0,
    }  # fmt: skip
    return PretravelMap(basis, **given | others)


def lobes(order: int, phase: float = 0.0, rotation: np.ndarray | None = None) -> PretravelMap:
    """Pretravel sin^order(polar) cos(order azimuth - phase) of 1 mm at the most, on 10 mm."""
    terms = np.array([[0, 0], [order, order], [order, -order]])
    amplitude = 1.0 / sectoral_factor(order)
    coefficients = [10.0, amplitude * np.cos(phase), amplitude * np.sin(phase)]
    return PretravelMap(
        HarmonicBasis(terms), np.array(coefficients), Covariance.none(3),
        HALF, tip_radius=30.0,
        rotation=np.eye(3) if rotation is None else rotation,
    )  # fmt: skip
