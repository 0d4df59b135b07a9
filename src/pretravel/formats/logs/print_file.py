"""Print-outs of probing cycles (Renishaw style): sizes and positions of features; reading.

These are results of cycles that have taken their own radii off: features, not touches. They can be
looked at and compared, not compensated.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from pretravel.errors import InputError
from pretravel.formats.logs.joining import file_lines, scale_of

_HEAD = re.compile(r"COMPONENT\s+NO\s+(\d+)\s+FEATURE\s+NO\s+(\d+)", re.I)
_NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+))"
_ROW = re.compile(
    rf"^(SIZE|POSN|ANG)\s+([A-Z]?)\s*{_NUMBER}\s+ACTUAL\s+{_NUMBER}"
    rf"(?:\s+TOL\s+(?:TP\s+)?{_NUMBER})?\s+DEV\s+{_NUMBER}$",
    re.I,
)
_LAST_DIGIT = 2e-4
"""DEV may differ from ACTUAL less nominal by the rounding of four decimals."""


@dataclass(frozen=True)
class FeatureResult:
    """One line: what was measured of which feature. Lengths in mm, angles in degrees."""

    component: int
    feature: int
    quantity: str
    nominal: float
    actual: float
    deviation: float
    tolerance: float | None
    line: int


def read_print_file(path: str | Path, units: str | None = None) -> list[FeatureResult]:
    r"""Feature results from a print-out.

    Parameters
    ----------
    path : str or Path
    units : str
        mm or inch; the file does not tell.

    Returns
    -------
    list of FeatureResult

    Raises
    ------
    InputError
        Units not told; lines of results that cannot be read, or whose deviation is not actual less
        nominal: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "print.txt"
    >>> _ = file.write_text("SIZE D71.0000  ACTUAL 71.9072  TOL 0.1000  DEV 0.9072\n")
    >>> read_print_file(file, "mm")[0].quantity
    'SIZE D'
    """
    scale = scale_of(units, path, "a print-out does not tell its units")
    component, feature = 0, 0
    results = []
    for number, text in enumerate(file_lines(path, "a print-out"), start=1):
        line = text.replace("*", " ").strip()
        if head := _HEAD.search(line):
            component, feature = int(head[1]), int(head[2])
        if not re.match(r"(SIZE|POSN|ANG)\b", line, re.I):
            continue
        if re.search(r"\bNaN\b", line, re.I):  # an axis that the cycle does not measure
            continue
        found = _ROW.match(line)
        if found is None:
            raise InputError(
                f"'{line[:50]}' cannot be read; SIZE D… ACTUAL … DEV … is needed",
                path=path,
                line=number,
            )
        own = 1.0 if found[1].upper() == "ANG" else scale
        nominal, actual, deviation = float(found[3]), float(found[4]), float(found[6])
        if abs(actual - nominal - deviation) > _LAST_DIGIT:
            raise InputError(
                f"DEV {deviation:g} is not ACTUAL {actual:g} less the nominal {nominal:g}",
                path=path,
                line=number,
            )
        results.append(
            FeatureResult(
                component,
                feature,
                f"{found[1].upper()} {found[2].upper()}".strip(),
                own * nominal,
                own * actual,
                own * deviation,
                None if found[5] is None else own * float(found[5]),
                number,
            )
        )
    if not results:
        raise InputError("no result (SIZE…, POSN…, ANG…) in it", path=path)
    return results
