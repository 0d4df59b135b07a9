"""Print-outs of probing cycles (Renishaw style): sizes and positions of features; reading.

The cycles have taken the tip's radius off: the results are features, not touches. They can be
viewed and compared, but not compensated.
"""

from __future__ import annotations

import re

from pretravel.files import (
    UNITS,
    FeatureResult,
    FileFormat,
    Source,
    SourceFile,
    opened,
    refuse_contradicted_unit,
    units_in_text,
)

# Of lines in which every run of blanks is one blank.
_HEADS = {
    word: re.compile(rf"\b{word} (?:NO|NUMBER|#)?[.:]? ?(\d+)", re.I)
    for word in ("COMPONENT", "FEATURE")
}
"""The numbers of the part and of the feature, in one line or in two."""
_NUMBER = r"([-+]?(?:\d+(?:\.\d*)?|\.\d+))"
_ROW = re.compile(
    rf"^(SIZE|POSN|ANG) ([A-Z]?) ?{_NUMBER} ACTUAL {_NUMBER}"
    rf"(?: TOL (?:TP )?{_NUMBER})? DEV {_NUMBER}$",
    re.I,
)
_ACTUAL, _DEVIATION = (
    re.compile(rf"\b{word}\s*(?:[-+.\d]|NaN\b)", re.I) for word in ("ACTUAL", "DEV")
)
"""With a number after it: a header of a table has none."""
_RESULT = re.compile(r"[\s*]*(?:SIZE|POSN|ANG)\b", re.I)
_MOST_DIGITS = 9
_LAST_DIGIT = 2e-4
"""DEV can differ from ACTUAL less nominal by the rounding of four decimals."""


def read_print_file(source: Source, units: str | None = None) -> list[FeatureResult]:
    r"""Read feature results from a print-out.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str, optional
        mm or inch, where the file does not state it.

    Raises
    ------
    InputError
        The units are missing, contradict the file or change in it; the line of a result cannot be
        read, or its deviation is not actual less nominal. The message contains the line.

    >>> file = SourceFile("p.txt", b"SIZE D71.0000  ACTUAL 71.9072  TOL 0.1000  DEV 0.9072\n")
    >>> read_print_file(file, "mm")[0].quantity
    'SIZE D'
    """
    file = opened(source)
    lines = file.lines("a print-out")
    rows = [i for i, text in enumerate(lines) if _RESULT.match(text)] or [0]
    stated = sorted(units_in_text([*lines[: rows[0]], *lines[rows[-1] + 1 :]]) & {*UNITS})
    if len(stated) > 1:
        raise file.error(f"gives two units, {stated[0]} and {stated[1]}: leave one out")
    for number, text in enumerate(lines[rows[0] : rows[-1]], start=rows[0] + 1):
        if units_in_text([text]) & {*UNITS} - {*stated, units}:
            raise file.error(
                f"'{text.strip()[:40]}' gives a unit among the results: split the file there",
                number,
            )
    if stated:
        refuse_contradicted_unit(file, stated[0], units)
    scale = file.scale(stated[0] if stated else units, "a print-out does not give its units")
    numbers = dict.fromkeys(_HEADS, 0)
    results = []
    for number, text in enumerate(lines, start=1):
        line = " ".join(text.replace("*", " ").split())
        for word, pattern in _HEADS.items():
            if head := pattern.search(line):
                if len(head[1]) > _MOST_DIGITS:
                    raise file.error("the numbers of component and feature cannot be read", number)
                numbers = {**numbers, "FEATURE": 0, word: int(head[1])}
        if not _RESULT.match(line):
            continue
        if re.search(r"\bNaN\b", line, re.I):  # an axis that the cycle does not measure
            continue
        results.append(
            _result(file, line, number, (numbers["COMPONENT"], numbers["FEATURE"]), scale)
        )
    if not results:
        raise file.error("the file contains no result (SIZE…, POSN…, ANG…)")
    return results


def _result(
    file: SourceFile, line: str, number: int, feature: tuple[int, int], scale: float
) -> FeatureResult:
    """Read one line of a result; `feature` is the numbers of the component and the feature."""
    found = _ROW.match(line)
    if found is None:
        raise file.error(f"'{line[:50]}' cannot be read; SIZE D… ACTUAL … DEV … is needed", number)
    kind, axis, tolerance = found[1].upper(), found[2].upper(), found[5]
    nominal, actual, deviation = file.numbers([found[3], found[4], found[6]], number)
    if abs(actual - nominal - deviation) > _LAST_DIGIT:
        raise file.error(
            f"DEV {deviation:g} is not ACTUAL {actual:g} minus the nominal {nominal:g}", number
        )
    own = 1.0 if kind == "ANG" else scale
    return FeatureResult(
        *feature,
        quantity=f"{kind} {axis}".strip(),
        nominal=own * nominal,
        actual=own * actual,
        deviation=own * deviation,
        tolerance=None if tolerance is None else own * file.numbers([tolerance], number)[0],
        line=number,
    )


def _is_print_file(lines: list[str]) -> bool:
    found = ((line, _ACTUAL.search(line)) for line in lines)
    return any(word and _DEVIATION.search(line, word.end()) for line, word in found)


PRINT_FILE = FileFormat(
    name="print",
    what="print-outs of cycles, Renishaw style: SIZE, POSN",
    reads="features (convert to .csv)",
    needs="units",
    verified="lines of manuals that are quoted in public; no file of a machine",
    recognises=_is_print_file,
    parse_features=lambda file, options: read_print_file(file, options.units),
)
