"""The probe of examples/linuxcnc/probe.hal as an exact map: no touches, no errors."""

from __future__ import annotations

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, ring_pattern
from pretravel.base.units import DEGREE
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance

# The parameters of pretravel_probe.comp; axial is set in probe.hal.
AXIAL, ACROSS, LOBE, SECOND, OVAL = 0.0013, 0.008, 0.003, 0.0005, 0.0008
LOBE_AZIMUTH, OVAL_AZIMUTH = 20.0 * DEGREE, 55.0 * DEGREE


def simulated_pretravel(normals: FloatArray) -> FloatArray:
    """The formula of pretravel_probe.comp. [mm]"""
    sine2 = normals[:, 0] ** 2 + normals[:, 1] ** 2
    azimuth = np.arctan2(normals[:, 1], normals[:, 0])
    return np.asarray(
        AXIAL
        + ACROSS * sine2
        + LOBE * sine2**1.5 * np.cos(3.0 * (azimuth - LOBE_AZIMUTH))
        + SECOND * sine2**3 * np.cos(6.0 * (azimuth - LOBE_AZIMUTH))
        + OVAL * sine2 * np.cos(2.0 * (azimuth - OVAL_AZIMUTH))
    )


def simulated_map(delay: float | None = None, feed: float | None = None) -> PretravelMap:
    """The formula is a sum of eight spherical harmonics."""
    terms = [[0, 0], [2, 0], [3, 3], [3, -3], [6, 6], [6, -6], [2, 2], [2, -2]]
    basis = HarmonicBasis(np.array(terms))
    directions = fibonacci_cap(400, 100.0 * DEGREE)
    design = basis.design(directions)
    coefficients = np.linalg.lstsq(design, simulated_pretravel(directions), rcond=None)[0]
    assert np.max(np.abs(design @ coefficients - simulated_pretravel(directions))) < 1e-12
    return PretravelMap(
        basis, coefficients, Covariance.none(len(terms)),
        DirectionSupport(ring_pattern(np.array([0.0, 30, 60, 90]) * DEGREE, 24)),
        tip_radius=3.0, delay=delay, feed=feed,
    )  # fmt: skip
