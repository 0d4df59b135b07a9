"""The data of a calibration certificate: statements of the laboratory, and results of the rig."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pretravel.files import LaboratoryStatements
from pretravel.laboratory.rig.budget import (
    LengthComponent,
    calibration_budget,
    constant_and_slope,
    length_budget,
    rig_sources,
)
from pretravel.laboratory.rig.calibration import DirectionPerformance, RigCalibration
from pretravel.laboratory.rig.left_out import left_out_sentences
from pretravel.laboratory.rig.trace import REFERENCE_TEMPERATURE, notes_of_touches
from pretravel.uncertainty import Budget


@dataclass(frozen=True)
class CertifiedDirection:
    """The result of one direction.

    Attributes
    ----------
    performance : DirectionPerformance
    expanded : float
        Expanded uncertainty of the mean pretravel, for the number of its touches. [mm]
    coverage_factor : float
        k of the expanded uncertainty.
    expanded_hysteresis : float
        Expanded uncertainty of the mean hysteresis, of repeats and rig. [mm]
    """

    performance: DirectionPerformance
    expanded: float
    coverage_factor: float
    expanded_hysteresis: float = math.nan


@dataclass(frozen=True, eq=False)
class CalibrationCertificate:
    """The data of a calibration certificate.

    Attributes
    ----------
    statements : LaboratoryStatements
    calibration : RigCalibration
    directions : tuple of CertifiedDirection
    budget : Budget
        Of the mean pretravel of the direction with the fewest touches. [mm]
    budget_source : str
        The rig or the laboratory to which the budget belongs.
    constant_and_slope : tuple of float, or None
        Of u(L)² = constant² + (slope L)² in mm and mm/mm; None where the budget has not this form.
    feeds : tuple of float
        Smallest and largest feed of the rod, from the traces. [mm/min]
    temperature : float
        Of the ruler; lengths are those at 20 °C. [°C]
    notes : tuple of str
        Irregularities of single touches, and touches that were left out, as sentences.
    """

    statements: LaboratoryStatements
    calibration: RigCalibration
    directions: tuple[CertifiedDirection, ...]
    budget: Budget
    budget_source: str
    constant_and_slope: tuple[float, float] | None
    feeds: tuple[float, float]
    temperature: float
    notes: tuple[str, ...]


def calibration_certificate(
    calibration: RigCalibration,
    components: Sequence[LengthComponent],
    statements: LaboratoryStatements,
    *,
    budget_source: str = "",
    temperature: float = REFERENCE_TEMPERATURE,
) -> CalibrationCertificate:
    """The data of a certificate, from a calibration and the statements of the laboratory.

    Parameters
    ----------
    calibration : RigCalibration
    components : sequence of LengthComponent
        Budget of the rig; the repeatability of the calibration replaces the one that it states.
    statements : LaboratoryStatements
    budget_source : str
        The rig or the laboratory to which the budget belongs.
    temperature : float
        Of the ruler. [°C]
    """
    own = calibration_budget(calibration, components)
    feeds = [touch.feed for touch in calibration.touches if math.isfinite(touch.feed)]
    mixed = any(c.constant and c.per_length for c in own)
    return CalibrationCertificate(
        statements=statements,
        calibration=calibration,
        directions=tuple(
            _certified_direction(calibration, components, d) for d in calibration.directions
        ),
        budget=length_budget(own, abs(calibration.pretravel)),
        budget_source=budget_source,
        constant_and_slope=None if mixed else constant_and_slope(own),
        feeds=(min(feeds), max(feeds)),
        temperature=temperature,
        notes=(
            *notes_of_touches(calibration.touches),
            *left_out_sentences(calibration),
        ),
    )


def _certified_direction(
    calibration: RigCalibration,
    components: Sequence[LengthComponent],
    direction: DirectionPerformance,
) -> CertifiedDirection:
    """The mean pretravel of a direction with U and k, for its number of touches."""
    single = calibration_budget(calibration, components, direction=direction)
    budget = length_budget(single, abs(direction.pretravel))
    return CertifiedDirection(
        direction,
        budget.expanded(),
        budget.coverage_factor(),
        _expanded_hysteresis(components, direction),
    )


def _expanded_hysteresis(
    components: Sequence[LengthComponent], direction: DirectionPerformance
) -> float:
    """Of the repeats and of the rig, whose ruler reads both ends as those of a pretravel. [mm]"""
    if math.isnan(direction.hysteresis):
        return math.nan
    length, repeats = abs(direction.hysteresis), direction.expanded_hysteresis
    if math.isnan(repeats):  # nothing was repeated: the budget's repeatability counts
        return length_budget(components, length).expanded()
    return math.hypot(length_budget(rig_sources(components), length).expanded(), repeats)
