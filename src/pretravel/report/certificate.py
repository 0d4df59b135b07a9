"""A calibration certificate as a page to print."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pretravel import __version__
from pretravel.laboratory.certificate import CalibrationCertificate, LaboratoryStatements
from pretravel.laboratory.rig_calibration import DirectionPerformance
from pretravel.report.laboratory_words import budget_table, rig_report
from pretravel.report.page import figure_block, write_html
from pretravel.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLE = """
@page { size: A4; margin: 18mm 16mm 20mm 16mm; }
body { font: 10.5pt/1.45 system-ui, sans-serif; color: #222; max-width: 178mm; margin: 0 auto;
  padding: 0 4mm; }
h1 { color: #1b4965; font-size: 19pt; margin: 6mm 0 2mm; }
h2 { color: #1b4965; font-size: 12.5pt; margin: 6mm 0 1.5mm; border-bottom: .3mm solid #bcd; }
table.data { border-collapse: collapse; width: 100%; }
table.data th { text-align: left; width: 42%; font-weight: 500; color: #444; }
table.data th, table.data td { padding: .8mm 2mm .8mm 0; vertical-align: top;
  border-bottom: .1mm solid #ddd; }
pre { font-size: 8.4pt; line-height: 1.35; background: #f6f6f4; padding: 2.5mm; overflow-x: auto; }
img { max-width: 100%; }
.open { color: #9b2226; }
section, figure { break-inside: avoid; }
@media print { pre { background: none; padding: 0; white-space: pre-wrap; } }
"""


def write_certificate(
    path: str | Path, certificate: CalibrationCertificate, figures: Mapping[str, Figure]
) -> None:
    """Write a certificate as HTML that prints on A4 (print it to PDF from any browser).

    Parameters
    ----------
    path : str or Path
    certificate : CalibrationCertificate
    figures : mapping of caption to matplotlib.figure.Figure
    """
    calibration, at_mean = certificate.calibration, certificate.budget
    formula = "U depends on the length by source; below it is given for the mean pretravel"
    if certificate.constant_and_slope is not None:
        constant, slope = certificate.constant_and_slope
        formula = (
            f"U(L) = {at_mean.coverage_factor():.2f} · √({constant / MICROMETRE:.4f}² + "
            f"({slope * 1e6:.3f} L)²) µm, L in m"
        )
    directions = [
        f"<tr><td>{_direction(d)}</td><td>{d.count}</td><td>{_um(d.pretravel)}</td>"
        f"<td>{_um(result.expanded, 2)}</td><td>{_um(d.repeatability.value)}</td>"
        f"<td>{_um(d.hysteresis)}</td></tr>"
        for result in certificate.directions
        for d in (result.performance,)
    ]
    slowest, fastest = certificate.feeds
    measured = {
        "Feed of the push rod, from the traces": f"{slowest:.1f} to {fastest:.1f} mm/min",
        "Temperature of the ruler, lengths brought to 20 °C": f"{certificate.temperature:g} °C",
        "Evaluated with": f"pretravel {__version__}",
    }
    blocks = [_data(certificate.statements, measured)]
    blocks.append(
        "<section><h2>Results by direction</h2><table class='data'><tr><td>direction</td>"
        "<td>touches</td><td>pretravel (µm)</td><td>U (µm)</td><td>standard deviation (µm)</td>"
        f"<td>hysteresis (µm)</td></tr>{''.join(directions)}</table></section>"
    )
    blocks.append(_text("Performance", rig_report(calibration)))
    blocks.append(
        _text(
            "Uncertainty of the mean pretravel of the direction touched least often",
            (f"Budget: {certificate.budget_source}\n" if certificate.budget_source else "")
            + f"{formula}\nat L = {calibration.pretravel / MICROMETRE:.3f} µm:\n\n"
            + budget_table(at_mean)
            + "\n\nU is the expanded uncertainty: standard uncertainty times the coverage factor k "
            "that gives\na coverage probability of about 95 % (GUM, JCGM 100:2008).",
        )
    )
    blocks += [figure_block(caption, figure) for caption, figure in figures.items()]
    lines = [
        "".join(f"<td>{cell}</td>" for cell in (html.escape(t.trace), f"{t.r0:.6f}", f"{t.r1:.6f}",
                f"{t.r2:.6f}", f"{t.r3:.6f}", _um(t.pretravel), _um(t.hysteresis)))
        for t in calibration.touches
    ]  # fmt: skip
    blocks.append(
        "<h2>Touches</h2><table class='data'><tr><td>trace</td><td>r0 (mm)</td><td>r1 (mm)</td>"
        "<td>r2 (mm)</td><td>r3 (mm)</td><td>pretravel (µm)</td><td>hysteresis (µm)</td></tr>"
        + "".join(f"<tr>{line}</tr>" for line in lines)
        + "</table>"
    )
    if certificate.notes:
        blocks.append(_text("Notes on single touches", "\n".join(certificate.notes)))
    blocks.append(
        "<section><h2>Statements</h2><p>The results relate only to the item calibrated, in the "
        "condition and at the place and time stated. This certificate may not be reproduced other "
        "than in full without the written approval of the laboratory.</p>"
        "<p>Azimuth: direction of the rod's push on the tip about the probe axis, from the traces' "
        "names.</p><p>Signature: ______________________________</p>"
        "<p>End of certificate.</p></section>"
    )
    number = certificate.statements.certificate.number
    title = "Calibration certificate" + (f" {number}" if number else "")
    heading = (
        f"<h1>{html.escape(title)}</h1>"
        "<p>Touch-trigger probe, calibrated on a rig after the Abbé principle</p>"
    )
    write_html(path, title, _STYLE, [heading, *blocks])


def _um(value: float, digits: int = 3) -> str:
    return "not told" if math.isnan(value) else f"{value / MICROMETRE:.{digits}f}"


def _direction(direction: DirectionPerformance) -> str:
    if math.isnan(direction.azimuth):
        return html.escape(direction.name)
    return f"azimuth {math.degrees(direction.azimuth):.6g}°"


def _data(statements: LaboratoryStatements, measured: Mapping[str, str]) -> str:
    rows = []
    for statement in statements.statements():
        text = statement.text
        cell = html.escape(text) if text else "<span class='open'>not stated</span>"
        rows.append(f"<tr><th>{html.escape(statement.meaning)}</th><td>{cell}</td></tr>")
    rows += [
        f"<tr><th>{html.escape(what)}</th><td>{html.escape(text)}</td></tr>"
        for what, text in measured.items()
    ]
    return f"<section><h2>Data</h2><table class='data'>{''.join(rows)}</table></section>"


def _text(heading: str, text: str) -> str:
    return f"<section><h2>{html.escape(heading)}</h2><pre>{html.escape(text)}</pre></section>"
