"""Which rows of a table are touches, by words: kinds of moves, verdicts, directions of travel."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace

from pretravel.files.source_file import first_few
from pretravel.files.text_table import TextTable

_MOST_KINDS = 8
_TOUCHES = {
    "touch", "touched", "probe", "probing", "probed", "trigger", "triggered", "contact", "hit",
    "measure", "measured", "measurement", "meas", "touch point", "point", "ptmeas", "g31", "g38.2",
    "g38.3", "antasten", "antastung", "antastpunkt", "messen", "messpunkt", "messung", "gemessen",
    "palpage", "toque", "actual", "real",
    "fast", "slow", "search", "seek", "fine", "coarse",
}  # fmt: skip
_MOVES = {
    "approach", "retract", "retreat", "retraction", "move", "moving", "travel", "rapid", "goto",
    "position", "positioning", "start", "start point", "startpoint", "begin", "end", "end point",
    "endpoint", "stop", "stopped", "clearance", "clear", "safe", "safety", "home", "park",
    "pre-touch", "pretouch", "prehit", "pre-hit", "pre-point", "backoff", "back-off", "back off",
    "depart", "departure", "overtravel", "g0", "g00", "g1", "g01", "linear", "anfahren",
    "anfahrpunkt", "startpunkt", "endpunkt", "ruckzug", "rückzug", "freifahren", "verfahren",
    "eilgang", "release", "untouch", "untrigger", "un-trip",
    "nominal", "target", "planned", "plan", "theoretical", "simulated", "simulation", "predicted",
    "interpolated", "calculated", "computed", "constructed", "estimated", "virtual", "scan",
    "scanning", "scanned", "soll", "simuliert", "berechnet",
}  # fmt: skip
"""Rows of which one of these words is the kind are no touches, where others are."""
_VERDICT = re.compile(
    r"(?:status|state|[ée]tat|statut|estado|stato|result|ergebnis|ok|verdict|outcome|"
    r"check|test|pass(?:ed)?[ /_]?fail(?:ed)?|"
    r"in ?tol(?:erance)?|eval\w*|bewertung|urteil|i\.?o\.?|quality|"
    r"accept(?:ed)?|judg\w*|conform\w*)\W*",
    re.IGNORECASE,
)
_TEMPERATURE = re.compile(
    r"temp[ée]rat|(?<![^\W_])(?:temps?|t_?(?:part|room|air))(?![^\W_])|°\s?[CF]\b", re.IGNORECASE
)
_FAHRENHEIT = re.compile(r"°\s?F\b|[_ ([]f[\])]?$|fahrenheit", re.IGNORECASE)
_NUMBER = re.compile(r"[-+]?\d{1,4}(?:\.\d{0,6})?")
_NEARLY_20 = 0.5
"""A difference of temperatures that is usual in a measuring room. [K]"""
_FLAGS = re.compile(r"flags?|warnings?|warnungen?", re.IGNORECASE)
_DIGITS = 9
_MOST_CODES = 4
_CODE = re.compile(r"[A-Za-z]{0,2}\d{1,3}|[A-Za-z]")
_WITH_DECIMALS = re.compile(r"[-+−]?\d*[.,](?!0*$)\d+")
_GOOD = re.compile(
    r"ok(?:ay)?|pass(?:ed)?|good|gut|i\.?o\.?|in ?tol(?:erance)?|intol|true|yes|y|ja|valid|accept"
    r"(?:ed)?|conform|done|complete[d]?|bon|c|0\.?0*",
    re.IGNORECASE,
)
_NOT_GOOD = re.compile(
    r"ng|nok|n\.?i\.?o\.?|not ok|fail(?:ed|ure)?|bad|reject(?:ed)?|out(?: ?of)? ?tol(?:erance)?|"
    r"outtol|false|no|n|nein|error|err|warn(?:ing)?|alarm|schlecht|ausschuss|x|nc|oot",
    re.IGNORECASE,
)
_WAY = re.compile(r"[XYZ][+-]|[+-][XYZ]", re.IGNORECASE)
_OF_TRAVEL = re.compile(
    r"(?:(?:probe?(?:ing)?|approach|touch|travel|measuring|search|move)[ _]?)?"
    r"(?:dir(?:ection)?|axis|way)|approach|antastrichtung|messrichtung|richtung|achse|sens|direccion",
    re.IGNORECASE,
)


def rows_of_touches(text: TextTable, stated: Collection[int]) -> tuple[TextTable, tuple[str, ...]]:
    """The rows that are touches, and sentences about those that are not.

    Rows are left out where the words of a column say that some are touches, others moves or
    nominal: approach, touch, retract.

    Parameters
    ----------
    text : TextTable
    stated : collection of int
        Columns whose meaning is given.
    """
    for i, title in enumerate(text.names or ()):
        if i in stated or not (moves := _moves_among(text.column(i))):
            continue
        kept = [k for k, cell in enumerate(text.column(i)) if cell.strip().lower() not in moves]
        left = Counter(cell for cell in text.column(i) if cell.strip().lower() in moves)
        shown = ", ".join(f"{word} ({count})" for word, count in left.items())
        told = f"rows whose {title} is {shown} are no touches, and are left out"
        rows, lines = [text.rows[k] for k in kept], [text.lines[k] for k in kept]
        return replace(text, rows=tuple(rows), lines=tuple(lines)), (told,)
    return text, ()


def _moves_among(cells: Sequence[str]) -> set[str]:
    """The words of moves in a column that has a few kinds of moves and touches, and no others."""
    kinds = set[str]()
    for cell in cells:
        word = cell.strip().lower()
        if word not in _TOUCHES and word not in _MOVES:
            return set()
        kinds.add(word)
    few = len(kinds) < min(len(cells), _MOST_KINDS)
    return kinds & _MOVES if few and kinds & _TOUCHES else set()


def with_travel(text: TextTable) -> TextTable:
    """The table with the directions of travel as vectors, where a column gives them as -Z or X+."""
    names = text.names or ()
    if {"ax", "ay", "az"} & {*names}:
        return text
    for i, title in enumerate(names):
        if not _OF_TRAVEL.fullmatch(title.strip()):
            continue
        cells = [cell.strip().upper() for cell in text.column(i)]
        if not all(map(_WAY.fullmatch, cells)):
            continue
        rows = []
        for row, cell in zip(text.rows, cells, strict=True):
            one = "-1" if "-" in cell else "1"
            way = tuple(one if axis in cell else "0" for axis in "XYZ")
            rows.append((*row[:i], "", *row[i + 1 :], *way))
        shown = tuple(f"column {i + 1}" if k == i else name for k, name in enumerate(names))
        units = (*text.units, "", "", "") if text.units else ()
        return replace(text, names=(*shown, "ax", "ay", "az"), rows=tuple(rows), units=units)
    return text


def is_verdict(title: str) -> bool:
    """Whether a title is that of a column of verdicts: Status, OK, Pass/Fail.

    >>> is_verdict("Result"), is_verdict("Operator")
    (True, False)
    """
    return _VERDICT.fullmatch(title.strip()) is not None


def verdicts(text: TextTable, unread: Sequence[int]) -> tuple[str, ...]:
    """Sentences about rows that a column sets apart, and about columns of temperatures.

    Parameters
    ----------
    text : TextTable
    unread : sequence of int
        Columns that have no other meaning.
    """
    told: list[str] = []
    for i in unread:
        cells = [cell.strip() for cell in text.column(i)]
        if _TEMPERATURE.search(text.title(i)):
            told += filter(None, [_warm(text.title(i), cells)])
        elif bad := _not_good(text.title(i), cells) or _odd_ones(cells):
            lines = first_few(text.lines[k] for k in bad)
            told.append(
                f"{text.title(i)} is '{cells[bad[0]]}' in line {lines}: of the part, or of "
                "the touch? The rows are used; leave out what is no touch"
            )
        elif (row := _change(cells)) is not None:
            told.append(
                f"{text.title(i)} is not read, and changes from '{cells[row - 1]}' to "
                f"'{cells[row]}' in line {text.lines[row]}: if it is the tip or the part, give the "
                "meaning of the column"
            )
    return tuple(told)


def _warm(title: str, cells: Sequence[str]) -> str:
    """What temperatures other than 20 °C mean for lengths, where they are numbers.

    >>> _warm("T_part", ["20.1", "20.2"]), _warm("T_part", ["", "27,5"])[:22]
    ('', 'T_part is 27.5 °C, and')
    """
    known = [cell.replace(",", ".") for cell in cells if cell]
    if not known or not all(map(_NUMBER.fullmatch, known)):
        return ""
    degrees = [float(cell) for cell in known]
    if _FAHRENHEIT.search(title):
        degrees = [(degree - 32.0) / 1.8 for degree in degrees]
    from pretravel.base import STEEL_EXPANSION

    low, high = min(degrees), max(degrees)
    if max(20.0 - low, high - 20.0) <= _NEARLY_20:
        return ""
    span = f"{low:.3g}" if high - low < _NEARLY_20 else f"{low:.3g} to {high:.3g}"
    return (
        f"{title} is {span} °C, and is not used: for each kelvin above 20 °C, a reference or part "
        f"of steel is larger by {STEEL_EXPANSION * 1e6:g} µm per metre, which U does not contain"
    )


def _change(cells: Sequence[str]) -> int | None:
    """The first row with another code, where each code has rows of its own in turn.

    >>> _change(["1", "1", "2", "2"]), _change(["1", "2", "1", "2"]), _change(["5.1", "5.1", "6"])
    (2, None, None)
    """
    changes = [k for k in range(1, len(cells)) if cells[k] != cells[k - 1]]
    codes = {*cells}
    in_turn = len(changes) == len(codes) - 1 and 2 * len(codes) <= len(cells)
    few = 1 < len(codes) <= _MOST_CODES and all(map(_CODE.fullmatch, codes))
    return changes[0] if in_turn and few else None


def _not_good(title: str, cells: Sequence[str]) -> list[int]:
    """Rows that a column of verdicts or of flags calls bad, where it calls all others good."""
    if _FLAGS.fullmatch(title.strip()) and all(map(str.isdecimal, cells)):
        bad = [k for k, cell in enumerate(cells) if int(cell[:_DIGITS]) != 0]
        return bad if len(bad) < len(cells) else []
    if not is_verdict(title):
        return []
    bad = [k for k, cell in enumerate(cells) if _NOT_GOOD.fullmatch(cell)]
    good = sum(1 for cell in cells if not cell or _GOOD.fullmatch(cell))
    return bad if bad and good and len(bad) + good >= len(cells) else []


def _odd_ones(cells: Sequence[str]) -> list[int]:
    """Rows with another word or code than most rows; none of a column of measured values.

    >>> _odd_ones(["1", "1", "-1", "1"]), _odd_ones(["20.1", "20.1", "20.2"]), _odd_ones("abc")
    ([2], [], [])
    """
    counts = Counter(cells)
    usual, most = counts.most_common(1)[0]
    measured = any(_WITH_DECIMALS.fullmatch(cell) for cell in counts)
    if measured or 2 * most <= len(cells) or len(counts) > _MOST_KINDS:
        return []
    return [k for k, cell in enumerate(cells) if cell != usual]
