"""The standards whose probing tests can be evaluated, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pretravel.arrays import FloatArray
from pretravel.directions import sphere_pattern_25
from pretravel.laboratory.iso230_10 import check_iso230_10, plane_pattern_36
from pretravel.laboratory.iso10360_5 import check_iso10360_5
from pretravel.laboratory.standard_check import StandardProcedure

CHECKS: Mapping[str, StandardProcedure] = {
    "iso10360-5": check_iso10360_5,
    "iso230-10": check_iso230_10,
}
"""Evaluations by the name of the standard."""

PATTERNS: Mapping[str, Callable[[], FloatArray]] = {
    "iso10360-5": sphere_pattern_25,
    "iso230-10": plane_pattern_36,
}
"""Directions of the touches by the name of the standard."""
