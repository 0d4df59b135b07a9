"""The standards whose probing tests can be evaluated, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import sphere_pattern_25
from pretravel.laboratory.iso230_10 import check_iso230_10, plane_pattern_36
from pretravel.laboratory.iso230_10_tip_offset import check_tip_offset
from pretravel.laboratory.iso10360_5 import check_iso10360_5
from pretravel.laboratory.standard_check import StandardProcedure

CHECKS: Mapping[str, StandardProcedure] = {
    "iso10360-5": check_iso10360_5,
    "iso230-10": check_iso230_10,
    "iso230-10-tip-offset": check_tip_offset,
}
"""Evaluations by the name of the standard."""

LIMITS_OF: Mapping[str, frozenset[str]] = {
    "iso10360-5": frozenset({"form", "size"}),
    "iso230-10": frozenset({"form2d", "form3d", "repeatability"}),
    "iso230-10-tip-offset": frozenset({"offset", "repeatability"}),
}
"""Names of the maximum permissible errors that each evaluation compares."""

USES: Mapping[str, frozenset[str]] = {
    "iso10360-5": frozenset({"u_diameter", "sphere_form", "map"}),
    "iso230-10": frozenset({"sphere_form", "map"}),
    "iso230-10-tip-offset": frozenset({"spindle", "ring"}),
}
"""What each evaluation uses that others do not."""

PATTERNS: Mapping[str, Callable[[], FloatArray]] = {
    "iso10360-5": sphere_pattern_25,
    "iso10360-5-cumulative": partial(sphere_pattern_25, cumulative=True),
    "iso230-10": plane_pattern_36,
}
"""Directions of the touches by the name of the standard, and the other reading of one."""
