"""A calibration certificate: a calibration on the rig with the statements of a laboratory."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pretravel.base import DEGREE, MICROMETRE
from pretravel.laboratory.certificate import CalibrationCertificate
from pretravel.laboratory.rig.calibration import DirectionPerformance, RigCalibration
from pretravel.laboratory.rig.trace import RigTrace
from pretravel.laboratory.tasks.rig.report import (
    BUDGET_TITLE,
    direction_table,
    performance_figures,
    rig_pictures,
)
from pretravel.show import (
    Column,
    Digits,
    Document,
    KeyFigure,
    Section,
    Span,
    Table,
    budget_picture,
    by_uncertainty,
    decimals,
    number_text,
    significant,
    value_text,
)
from pretravel.task import budget_table, stated_figure

_METHOD = (
    "A push rod with a ruler moved the tip, a laser measured the displacement of the tip, and the "
    "signals of contact and trigger were recorded. r0, r1, r2 and r3 are the readings of the ruler "
    "at first contact, at the trigger, where the rod stopped, and where contact was lost on the "
    "way back. Pretravel is r1 - r0, hysteresis r3 - r0; lengths are those at 20 °C."
)
_AZIMUTH = (
    "Azimuth: direction of the push of the rod on the tip about the probe axis, from the names of "
    "the traces."
)
_REPEATS_ALONE = (
    "U and u of this section are from the repeats alone. The uncertainties of the calibration are "
    "those of the results above."
)


def certificate_document(
    certificate: CalibrationCertificate,
    traces: Sequence[RigTrace],
    *,
    warnings: Sequence[str] = (),
) -> Document:
    """A calibration certificate.

    Parameters
    ----------
    certificate : CalibrationCertificate
    traces : sequence of RigTrace
        Of the touches of the calibration, in their order.
    warnings : sequence of str
        What keeps it from being a certificate to hand out, and irregularities of the traces.
    """
    calibration = certificate.calibration
    stated = certificate.statements
    number = stated.certificate.number
    return Document(
        title="Calibration certificate" + (f" {number}" if number else ""),
        verdict="Touch-trigger probe, calibrated on a rig: " + _mean_pretravel(certificate),
        sections=(
            Section("Data", figures=tuple(map(stated_figure, stated.of_certificate()))),
            Section("Results by direction", tables=(_results_table(certificate),)),
            _method_section(certificate),
            Section(
                "Performance",
                figures=performance_figures(calibration),
                paragraphs=(_REPEATS_ALONE,),
            ),
            Section(tables=(direction_table(calibration),), detail=True),
            _uncertainty_section(certificate),
            Section("Touches", tables=(_touches_table(calibration),)),
        ),
        pictures=(
            *rig_pictures(calibration, traces),
            budget_picture(certificate.budget, "a direction's mean pretravel"),
        ),
        notes=certificate.notes,
        warnings=tuple(warnings),
        budgets=(certificate.budget,),
    )


def _mean_pretravel(certificate: CalibrationCertificate) -> str:
    """The range of the results, and the largest of their expanded uncertainties."""
    values = [r.performance.pretravel / MICROMETRE for r in certificate.directions]
    worst = max(result.expanded for result in certificate.directions) / MICROMETRE
    low, high, digits = min(values), max(values), _digits(certificate)
    return (
        f"pretravel {number_text(low, digits)} to {value_text(high, 'µm', digits)} in "
        f"{len(values)} directions, U up to {value_text(worst, 'µm', digits)} (coverage "
        "probability of about 95 %)"
    )


def _digits(certificate: CalibrationCertificate) -> Digits:
    """Of results and their U: two of the smallest U count (GUM, 7.2.6)."""
    return by_uncertainty(min(r.expanded for r in certificate.directions) / MICROMETRE)


def _method_section(certificate: CalibrationCertificate) -> Section:
    """What was done, and the conditions of the traces."""
    slowest, fastest = certificate.feeds
    return Section(
        "Method",
        (_METHOD, _AZIMUTH),
        figures=(
            KeyFigure(
                "Feed of the push rod, from the traces",
                slowest if round(slowest, 1) == round(fastest, 1) else Span(slowest, fastest),
                "mm/min",
                decimals(1),
            ),
            KeyFigure(
                "Temperature of the ruler, lengths brought to 20 °C",
                certificate.temperature,
                "°C",
                significant(6),
            ),
        ),
    )


def _results_table(certificate: CalibrationCertificate) -> Table:
    """Mean pretravel with its expanded uncertainty in each direction."""
    own = _digits(certificate)

    def column(name: str, values: Sequence[float], digits: Digits = own) -> Column:
        return Column.of(name, [value / MICROMETRE for value in values], "µm", digits)

    results = certificate.directions
    directions = [result.performance for result in results]
    return Table(
        (
            Column.of("direction", [_direction_name(d) for d in directions]),
            Column.of("touches", [float(d.count) for d in directions], digits=decimals(0)),
            column("pretravel", [d.pretravel for d in directions]),
            column("U", [result.expanded for result in results]),
            Column.of("k", [result.coverage_factor for result in results], digits=decimals(2)),
            column("standard deviation", [d.repeatability.value for d in directions], decimals(3)),
            column("hysteresis", [d.hysteresis for d in directions]),
            column("U of hysteresis", [result.expanded_hysteresis for result in results]),
        ),
        explanation="U: expanded uncertainty of the mean pretravel; k: its coverage factor. U of "
        "hysteresis: expanded uncertainty of the mean hysteresis. Both are for a coverage "
        "probability of 95.45 %. Standard deviation: of one touch.",
    )


def _direction_name(direction: DirectionPerformance) -> str:
    if math.isnan(direction.azimuth):
        return direction.name
    name = f"azimuth {value_text(direction.azimuth / DEGREE, '°', significant(6))}"
    if direction.across:
        return name
    return f"{name}, polar {value_text(direction.polar / DEGREE, '°', significant(6))}"


def _uncertainty_section(certificate: CalibrationCertificate) -> Section:
    """The budget at the mean pretravel, and the uncertainty as a function of the length."""
    budget = certificate.budget
    length = value_text(certificate.calibration.pretravel / MICROMETRE, "µm", decimals(3))
    fewest = min(result.performance.count for result in certificate.directions)
    touches = "1 touch" if fewest == 1 else f"{fewest} touches"
    case = f"{length}, the mean of all directions, and for {touches}, the fewest in a direction"
    formula = f"U depends on the length by source. The table is for L = {case}."
    if certificate.constant_and_slope is not None:
        constant, slope = certificate.constant_and_slope
        formula = (
            f"U(L) = {number_text(budget.coverage_factor())} · "
            f"√({number_text(constant / MICROMETRE, decimals(4))}² + "
            f"({number_text(slope * 1e6, decimals(3))} L)²) µm, where L is the pretravel in m. The "
            f"table is for L = {case}."
        )
    source = certificate.budget_source
    return Section(
        BUDGET_TITLE,
        paragraphs=(
            *((f"Budget: {source}",) if source else ()),
            formula,
            (
                "U is the expanded uncertainty: the standard uncertainty times the coverage "
                "factor k for a coverage probability of 95.45 %, from Student's distribution with "
                "the effective degrees of freedom (GUM, JCGM 100:2008)."
            ),
        ),
        tables=(budget_table(budget),),
    )


def _touches_table(calibration: RigCalibration) -> Table:
    touches = calibration.touches
    events = np.array([[t.r0, t.r1, t.r2, t.r3] for t in touches])
    return Table(
        (
            Column.of("trace", [touch.trace for touch in touches]),
            *(
                Column.of(name, column, "mm", decimals(6))
                for name, column in zip(("r0", "r1", "r2", "r3"), events.T, strict=True)
            ),
            Column.of("pretravel", [t.pretravel / MICROMETRE for t in touches], "µm", decimals(3)),
            Column.of(
                "hysteresis", [t.hysteresis / MICROMETRE for t in touches], "µm", decimals(3)
            ),
        )
    )
