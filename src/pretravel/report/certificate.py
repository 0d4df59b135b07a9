"""A calibration certificate as a page to print, with the data that a laboratory must state."""

from __future__ import annotations

import html
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pretravel import __version__
from pretravel.errors import InputError
from pretravel.laboratory.rig_calibration import (
    DirectionPerformance,
    LengthComponent,
    RigCalibration,
    calibration_budget,
    constant_and_slope,
    length_budget,
)
from pretravel.report.laboratory_words import budget_table, rig_report
from pretravel.report.page import figure_block, write_html
from pretravel.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIELDS: Mapping[str, Mapping[str, str]] = {
    "laboratory": {
        "name": "Name and address of the laboratory",
        "place": "Place of calibration, if another",
        "accreditation": "Accreditation, with its number",
    },
    "certificate": {
        "number": "Unique number of this certificate",
        "date_of_issue": "Date of issue",
        "authorised_by": "Name and function of the person who authorises it",
    },
    "customer": {"name": "Name and address of the customer"},
    "item": {
        "description": "What was calibrated: probe, stylus, tip",
        "manufacturer": "Manufacturer and type",
        "serial_number": "Serial number",
        "condition": "Condition on receipt, adjustments",
        "received": "Date of receipt",
        "calibrated": "Date of calibration",
    },
    "method": {
        "procedure": "Procedure and its edition",
        "feed": "Feed and direction of touches, number of repeats",
        "deviations": "Deviations from the procedure",
    },
    "conditions": {
        "temperature": "Temperature in °C, with its uncertainty",
        "humidity": "Relative humidity",
    },
    "traceability": {"statement": "Standards used, and how they are traceable to the SI"},
    "decision": {"rule": "Conformity: specification and decision rule, if one was agreed"},
}
"""What ISO/IEC 17025:2017, 7.8.2 and 7.8.4 want on a certificate (recalled, not checked
against the text)."""

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


@dataclass(frozen=True)
class Laboratory:
    """What a laboratory says about itself, the item and the conditions.

    Attributes
    ----------
    entries : mapping of table to mapping of key to text
        As in `FIELDS`; what is missing is shown as open.
    """

    entries: Mapping[str, Mapping[str, str]]

    @property
    def missing(self) -> int:
        """How many of the fields are empty."""
        return sum(not self.stated(table, key) for table, keys in FIELDS.items() for key in keys)

    def stated(self, table: str, key: str) -> str:
        """The text, or nothing."""
        return self.entries.get(table, {}).get(key, "")


def laboratory_template() -> str:
    """A TOML file to fill in.

    >>> laboratory_template().splitlines()[0]
    '[laboratory]'
    """
    blocks = []
    for table, keys in FIELDS.items():
        lines = [f'{key} = ""'.ljust(28) + f"# {meaning}" for key, meaning in keys.items()]
        blocks.append("\n".join([f"[{table}]", *lines]))
    return "\n\n".join(blocks) + "\n"


def read_laboratory(path: str | Path) -> Laboratory:
    """A filled-in template.

    Raises
    ------
    InputError
        No such file, not TOML, tables or keys that a certificate does not have.
    """
    place = Path(path)
    if not place.is_file():
        raise InputError("there is no such file; pretravel laboratory prints one", path=path)
    try:
        tables: dict[str, Any] = tomllib.loads(place.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"not valid TOML: {error}", path=path) from None
    entries: dict[str, dict[str, str]] = {}
    for table, keys in tables.items():
        if table not in FIELDS or not isinstance(keys, dict):
            raise InputError(
                f"[{table}] is not part of a certificate; there are {', '.join(FIELDS)}", path=path
            )
        for key, value in keys.items():
            if key not in FIELDS[table]:
                known = ", ".join(FIELDS[table])
                raise InputError(f"[{table}] has no {key}; it has {known}", path=path)
            entries.setdefault(table, {})[key] = str(value)
    return Laboratory(entries)


def write_certificate(
    path: str | Path,
    calibration: RigCalibration,
    budget: Sequence[LengthComponent],
    laboratory: Laboratory,
    figures: Mapping[str, Figure],
    *,
    notes: Sequence[str] = (),
    budget_source: str = "",
    temperature: float = 20.0,
) -> None:
    """Write a certificate as HTML that prints on A4 (print it to PDF from any browser).

    Parameters
    ----------
    path : str or Path
    calibration : RigCalibration
    budget : sequence of LengthComponent
        Of the rig; this calibration's own repeatability takes the place of the told one.
    laboratory : Laboratory
    figures : mapping of caption to matplotlib.figure.Figure
    notes : strings
        What was odd in the traces.
    budget_source : str
        Whose budget it is.
    temperature : float
        Of the ruler, brought to 20 °C. [°C]
    """
    own = calibration_budget(calibration, budget)
    at_mean = length_budget(own, abs(calibration.pretravel))
    formula = "U depends on the length by source; below it is given for the mean pretravel"
    if not any(c.constant and c.per_length for c in own):
        constant, slope = constant_and_slope(own)
        formula = (
            f"U(L) = {at_mean.coverage_factor():.2f} · √({constant / MICROMETRE:.4f}² + "
            f"({slope * 1e6:.3f} L)²) µm, L in m"
        )

    def expanded(direction: DirectionPerformance) -> float:
        """U of one direction's mean, by how often it was touched."""
        single = calibration_budget(calibration, budget, direction.count)
        return length_budget(single, abs(direction.pretravel)).expanded()

    directions = [
        f"<tr><td>{_direction(d)}</td><td>{d.count}</td><td>{_um(d.pretravel)}</td>"
        f"<td>{_um(expanded(d), 2)}</td><td>{_um(d.repeatability.value)}</td>"
        f"<td>{_um(d.hysteresis)}</td></tr>"
        for d in calibration.directions
    ]
    feeds = [touch.feed for touch in calibration.touches if touch.feed == touch.feed]
    measured = {
        "Feed of the push rod, from the traces": f"{min(feeds):.1f} to {max(feeds):.1f} mm/min",
        "Temperature of the ruler, lengths brought to 20 °C": f"{temperature:g} °C",
        "Evaluated with": f"pretravel {__version__}",
    }
    blocks = [_data(laboratory, measured)]
    blocks.append(
        "<section><h2>Results by direction</h2><table class='data'><tr><td>direction</td>"
        "<td>touches</td><td>pretravel (µm)</td><td>U (µm)</td><td>standard deviation (µm)</td>"
        f"<td>hysteresis (µm)</td></tr>{''.join(directions)}</table></section>"
    )
    blocks.append(_text("Performance", rig_report(calibration)))
    blocks.append(
        _text(
            "Uncertainty of the mean pretravel of the direction touched least often",
            (f"Budget: {budget_source}\n" if budget_source else "")
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
    if notes:
        blocks.append(_text("Notes on single touches", "\n".join(notes)))
    blocks.append(
        "<section><h2>Statements</h2><p>The results relate only to the item calibrated, in the "
        "condition and at the place and time stated. This certificate may not be reproduced other "
        "than in full without the written approval of the laboratory.</p>"
        "<p>Azimuth: direction of the rod's push on the tip about the probe axis, from the traces' "
        "names.</p><p>Signature: ______________________________</p>"
        "<p>End of certificate.</p></section>"
    )
    number = laboratory.stated("certificate", "number")
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


def _data(laboratory: Laboratory, measured: Mapping[str, str]) -> str:
    rows = []
    for table, keys in FIELDS.items():
        for key, meaning in keys.items():
            text = laboratory.stated(table, key)
            cell = html.escape(text) if text else "<span class='open'>not stated</span>"
            rows.append(f"<tr><th>{html.escape(meaning)}</th><td>{cell}</td></tr>")
    rows += [
        f"<tr><th>{html.escape(what)}</th><td>{html.escape(text)}</td></tr>"
        for what, text in measured.items()
    ]
    return f"<section><h2>Data</h2><table class='data'>{''.join(rows)}</table></section>"


def _text(heading: str, text: str) -> str:
    return f"<section><h2>{html.escape(heading)}</h2><pre>{html.escape(text)}</pre></section>"
