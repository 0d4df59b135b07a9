"""Positions from lines such as ``G1 X1.0 Y2.0 Z3.0``, written with LinuxCNC's LOG or DPRNT."""

from __future__ import annotations

import re

import numpy as np

from pretravel.controls.logs.logged_feeds import SPINDLE
from pretravel.files import (
    CHANGES,
    FileFormat,
    FilePositions,
    RowStatement,
    RowStatements,
    Source,
    SourceFile,
    StatedRows,
    column_name,
    joined_axes,
    opened,
    plain_axes,
    stem_of_axes,
    units_in_text,
    without_comments,
)
from pretravel.touches import WORD_COLUMNS

_WORD = re.compile(
    r"([A-Z])\s*+[:=]?+\s*+([-+]?+\s*+(?:\d++(?:\.\d*+)?+|\.\d++))(?![\d.eE]|,\d)[,;*]?",
    re.IGNORECASE,
)
"""A letter and its number; controls put blanks in the place of zeros, also after the sign.

Nothing of it is tried twice (`+` after a quantifier): long lines take linear time."""
_TABLE = (
    RowStatement("tool: `T` number", r"(?:M0?6\s*)?T(\d+)\b.*", "tip", "carried", "T2"),
    RowStatement(
        "work offset, turn, scale: `G54` … `G59`, `G10`, `G92`, `G43`, `G49`, `G52`, `G68`, `G51`",
        r"(?:N\d+\s*)?(?:G(?:0?[01]|17|2[01]|9[04])\s*)*"
        r"(G(?:5[0-24-9]|5\d\d|10|92|43|49|68|69)(?:\.\d)?(?!\d).*|D\d+\s*$)",
        "frame", "refused", "G55",
    ),
    SPINDLE,
    RowStatement("another run: `O` number", r"(O\d+)\b", "part", "carried", "O12", event=True),
    RowStatement("`G20`, `G21`", r"G2([01])\b", "unit", "refused", "G20"),
    RowStatement("comments, `%`, `G90`, `G94`, `M`, `F`, `S`",
              r"[#;(%]|\W*$|(?:[GMFSON]\s*\d+(?:\.\d*)?\s*)+$", example="G90"),
)  # fmt: skip
_STATEMENTS = RowStatements(_TABLE)
_NAME = r"(?![GMTSFXYZ]\s*[-+.\d])[A-Z]\w*(?:\s+\d+)?"
"""A word before the coordinates, with a number or without."""
_X_FIRST, _THEN_Y, _THEN_Z = (
    re.compile(rf"{words}\s*[:=]?\s*[-+.\d]", re.IGNORECASE)
    for words in (
        rf"(?:#\d+\s*:\s*)?(?:N\s*\d+\s*)?(?:{_NAME}[:,]?\s+)?(?:G\d+(?:\.\d)?\s*)*X",
        "Y",
        "Z",
    )
)
_IN_ANY_ORDER = re.compile(rf"(?:{_WORD.pattern}\s*+){{3}}", re.IGNORECASE)
_LABEL = re.compile(
    r"(?:N\s*(?P<number>\d+)\s*|(?P<name>(?!N\s|[GMTSFXYZ]\s*[-+.\d])[A-Z]\w*(?:\s+\d+)?)[:,]?\s+)"
    r"(?=X\s*[:=]?\s*[-+.\d])",
    re.IGNORECASE,
)
"""What DPRNT writes before the coordinates: the number of a block, or a name."""
_NUMBERED = re.compile(r"#\d+\s*:\s*")
"""The number of a point, as GEOPAK writes it."""
_TITLE = re.compile(r"[^\W\d_]{3,}[^\d=#\[\]/]*")
"""A line of words above the first position: it has no number."""
_HEAD_LINE = re.compile(
    r"(?:date|time|datum|zeit|uhrzeit|fecha|hora|heure|program(?:m?e?)?|prog|messprogramm|file|"
    r"datei|operator|bediener|order|auftrag|no\.? of \w+|number of \w+|anzahl)\b\W*\w",
    re.IGNORECASE,
)
"""A line above the first position that gives the date, the program or the operator."""
_SIGNAL = re.compile(
    r"(?<=[\s,;])(?:(?:\$AC_MEA\[\d\]|#5070|(?:probe[_ ]?)?success|contact|hit|trip(?:ped)?|"
    r"triggered|touched|result)\s*[:=]\s*(?P<flag>\d(?:\.0*)?|true|false|yes|no)|"
    r"(?P<word>hit|miss(?:ed)?|no contact|not triggered|triggered|tripped|contact))\s*$",
    re.IGNORECASE,
)
"""What says at the end of a line whether the probe's signal came."""
_MISSED = re.compile(r"0(?:\.0*)?|false|no.*|miss.*", re.IGNORECASE)
_TIME = re.compile(
    r"\W*(?:\d{2,4}[-./]\d\d[-./]\d{2,4}[T ,;]*)?\d{1,2}:\d\d(?::\d\d(?:[.,]\d+)?)?(?:\s?[AP]M)?"
    r"[\]\s,;:>-]+(?=\S)",
    re.IGNORECASE,
)
"""A time before a position."""
_WORDS_BEFORE = re.compile(
    r"(?P<words>[A-Z][A-Z :,_-]{2,60}?)[\s:]\s*+\(?(?=X\s*+[:=]?+\s*+[-+.\d])", re.IGNORECASE
)
"""Words of several letters before a position: Probe hit at X …."""
_OF_TOUCH = re.compile(r"probe|touch|trip|trig|hit|contact|meas|antast|palp", re.IGNORECASE)
_OF_MISS = re.compile(r"\b(?:no|not|miss(?:ed)?|fail(?:ed)?|without)\b", re.IGNORECASE)
_OF_NO_TOUCH = re.compile(
    r"nom|target|start|end|stop|move|goto|center|centre|result|expect|corner|average|mean|plan|"
    r"offset|approach|retract|simul|before|after",
    re.IGNORECASE,
)
_BRACKETED = re.compile(r"\(([^()]*)\)")
_UNIT_LINE = re.compile(
    r"\W*+(?:(?:units?|einheit(?:en)?)\W*+)?+\b(mm|inch|inches|metric|imperial|zoll)\b\W*+",
    re.IGNORECASE,
)
"""A line that gives the unit alone."""
_UNIT_WORD = re.compile(r"\b(?:mm|inch|inches|metric|imperial|zoll)\b", re.IGNORECASE)
_BESIDE = re.compile(r"(?<![^\d.\s])(?:G5[4-9](?:\.\d)?|T\d+)(?![\d.])", re.IGNORECASE)
"""Words anywhere in a line that change what positions mean."""
_OFFSET = re.compile(r"\s*0?5[4-9](?:\.\d*)?")
_STATED_WORDS = re.compile(r"(?:[TABCNG]\s*+[:=]?+\s*+[-+]?+[\d.]++\s*+)*+", re.IGNORECASE)
"""A line of words without a position that are taken one by one."""
_WHOLE = re.compile(r"0*(\d+)(?:\.0*)?")
_OTHER_COORDINATES = re.compile(r"\bG(?:91|16|0?7)(?![\d.])", re.IGNORECASE)
_OTHER = "relative, polar and diameter"
_ROTARY = "ABC"
_READ = {*"XYZFGMNT", *_ROTARY}
_MOVED = 1e-4
"""Rotary axes that differ by more than this have moved. [deg]"""
_SHOWN = 4
"""Most names that a sentence shows."""
_HEAD = 20
"""Lines among which the first position is expected, to recognise the format."""


def read_log_positions(source: Source, units: str | None = None) -> FilePositions:
    r"""Read positions from lines such as ``G1 X1.0 Y2.0 Z3.0``.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str, optional
        mm or inch, where the file contains neither G20 nor G21.

    Returns
    -------
    FilePositions
        With the feeds, where F words state that of each line.

    Raises
    ------
    InputError
        The units are missing or contradict the file; a line is not a position with X, Y and Z; a
        rotary axis has moved.
        The message contains the line.

    >>> file = SourceFile("a.txt", b"G21\nG1 X1.0 Y2.0 Z3.0\n")
    >>> read_log_positions(file).positions.tolist()
    [[1.0, 2.0, 3.0]]
    """
    file = opened(source)
    rows: list[list[float]] = []
    numbers, feeds, labels, stated = [], [], [], StatedRows(file, of_centres=True)
    feed: float | None = None
    rotary: dict[str, float] = {}
    unread: set[str] = set()
    heads, contact = list[int](), list[bool]()
    for number, text in joined_axes(enumerate(file.lines("a log of positions"), start=1)):
        units = _unit_of_comments(file, text, number, units, stated)
        missed = _says_miss(text)
        if not (line := _line_of_words(text)):
            continue
        if not rows and _TITLE.fullmatch(line) and not _UNIT_WORD.search(line):
            stated.note(line, number)
            continue
        if not rows and _HEAD_LINE.match(line):
            heads.append(number)
            continue
        named = _LABEL.match(line)
        line = line[named.end() :] if named else line
        units = _units(file, line, number, units)
        if other := _OTHER_COORDINATES.search(line):
            raise file.error(f"{other[0]}: {_OTHER} positions are not read", number)
        for _, value in (word for word in _WORD.findall(line) if word[0].upper() == "F"):
            feed = file.numbers([_squeezed(value)], number)[0] or None
        numbered = _state_words(stated, line, number)
        known = _STATEMENTS.of(_BESIDE.sub("", line).strip())
        if known is not None and known[0].means != "unit":  # the unit was read
            stated.take(known, line, number)
        if position := _position(file, line, number, rotary):
            unread |= {name.upper() for name, value in _WORD.findall(line) if _unknown(name, value)}
            stated.hold(f"{CHANGES['frame']} (the axes' names)", stem_of_axes(text), number)
            stated.row(number)
            rows.append(position)
            numbers.append(number)
            contact.append(not missed)
            feeds.append(feed)
            labels.append((named["number"] or named["name"]) if named else numbered)
        elif known is None and not _STATED_WORDS.fullmatch(line):
            stated.take(None, line, number)
    scale = file.scale(units, "the file does not give its units (G20 or G21)")
    if not rows:
        raise file.error("the file contains no position")
    groups = _groups_of(labels)
    known_feeds = [feed for feed in feeds if feed is not None]
    return FilePositions(
        file.path,
        scale * np.array(rows),
        tuple(numbers),
        None if all(contact) else tuple(contact),
        labels=tuple(labels) if all(labels) and len(set(labels)) > 1 and not groups else None,
        feeds=scale * np.array(known_feeds) if len(known_feeds) == len(rows) else None,
        words=stated.columns() | groups,
        warnings=(
            *stated.warnings(),
            *_not_read(unread),
            *_heads_not_read(heads),
            *_names_not_read(labels),
        ),
    )


def _line_of_words(text: str) -> str:
    """A line without comments, time, signal and the number of a point; its unit as G20 or G21."""
    if text.lstrip().startswith(";"):
        return ""
    line = _NUMBERED.sub("", _without_time_and_signal(without_comments(text)))
    if unit := _UNIT_LINE.fullmatch(line):
        return "G21" if unit[1].lower() in ("mm", "metric") else "G20"
    return "" if line.startswith(("%", "#")) else line


def _state_words(stated: StatedRows, line: str, number: int) -> str:
    """Take the tool and the work offset that words of a line state; its N word, or nothing."""
    numbered = ""
    words = _WORD.findall(line)
    alone = not {name.upper() for name, _ in words} & {*"XYZ"}
    for name, value in words:
        whole = _whole(value)
        if alone and name.upper() in _ROTARY:
            stated.hold(f"{CHANGES['frame']} (a rotary axis)", name + _squeezed(value), number)
        if name.upper() == "T" and whole:
            stated.state("tip", whole)
        elif name.upper() == "G" and _OFFSET.fullmatch(value):
            stated.hold(f"{CHANGES['frame']} (work offset)", value, number)
        elif name.upper() == "N":
            numbered = whole
    return numbered


def _whole(value: str) -> str:
    """A whole number without zeros and point, 20 of 020. and of 20.0; empty of another."""
    found = _WHOLE.fullmatch(_squeezed(value))
    return found[1] if found else ""


def _unknown(name: str, value: str) -> bool:
    """Whether a word of a position says nothing to the reader: its letter, or T of no tool."""
    return name.upper() not in _READ or (name.upper() == "T" and not _whole(value))


def _groups_of(labels: list[str]) -> dict[str, tuple[str, ...]]:
    """The column of words that names before the positions are, such as TIP1, TIP1, TIP2."""
    if not all(labels) or not 1 < len({*labels}) < len(labels):
        return {}
    words = {label.rstrip("0123456789 _").lower() for label in labels}
    role = column_name(words.pop()).role if len(words) == 1 else None
    return {role: tuple(labels)} if role in WORD_COLUMNS else {}


def _names_not_read(labels: list[str]) -> tuple[str, ...]:
    """A sentence about names that only some positions have."""
    found = [*dict.fromkeys(filter(None, labels))]
    if not found or all(labels):
        return ()
    return (f"not read: names that only some positions have ({', '.join(found[:_SHOWN])})",)


def _unit_of_comments(
    file: SourceFile, text: str, number: int, units: str | None, stated: StatedRows
) -> str | None:
    """The unit that holds after the comments of a line; what else they change is taken, too."""
    comments = _BRACKETED.findall(text)
    if text.lstrip().startswith((";", "#")) and plain_axes(text) == text:
        comments.append(text.strip(" ;#"))
    for comment in comments:
        stated.take(_STATEMENTS.of(";"), f"; {comment}", number)
        for own in units_in_text([comment]):
            code = {"mm": "G21", "inch": "G20"}.get(own)
            if code is None:
                raise file.error(f"the unit {own} is none of positions: mm and inch are", number)
            units = _units(file, code, number, units)
    return units


def _heads_not_read(lines: list[int]) -> tuple[str, ...]:
    """A sentence that names lines above the positions, such as a date."""
    return (f"not read: line {', '.join(map(str, lines))} above the positions",) if lines else ()


def _not_read(letters: set[str]) -> tuple[str, ...]:
    """A sentence that names letters of the lines that say nothing to the reader."""
    if not letters:
        return ()
    return (f"not read: the numbers after {', '.join(sorted(letters))} in the lines of positions",)


def _units(file: SourceFile, line: str, number: int, units: str | None) -> str | None:
    """Return the units that hold from this line on."""
    word = re.search(r"\bG2([01])\b", line, re.IGNORECASE)
    if word is None:
        return units
    own = "inch" if word[1] == "0" else "mm"
    if units not in (None, own):
        raise file.error(
            f"the file's units are {own} here, but the given ones, or those before, are {units}",
            number,
            inputs=("units",),
        )
    return own


def _position(
    file: SourceFile, line: str, number: int, rotary: dict[str, float]
) -> list[float] | None:
    """Read X, Y and Z of a line; None if the line has none. `rotary` keeps the other axes."""
    remainder = _WORD.sub("", line).strip()
    if remainder:
        raise file.error(
            f"'{line[:40]}' is not a position; G1 X… Y… Z… is needed"
            + (
                "; use points as decimal signs"
                if "," in remainder
                else ". Delete a line of text that neither reports a miss nor changes anything"
            ),
            number,
        )
    pairs = [(name.upper(), _squeezed(value)) for name, value in _WORD.findall(line)]
    pairs = [(name, value) for name, value in pairs if name in "XYZ" + _ROTARY]
    words = dict(pairs)
    if len(words) < len(pairs):
        raise file.error("a coordinate occurs twice", number)
    for axis in set(words) & set(_ROTARY):
        if abs(float(words[axis]) - rotary.setdefault(axis, float(words[axis]))) > _MOVED:
            raise file.error(
                f"the rotary axis {axis} has moved; positions at different rotary angles cannot be "
                "joined with one plan",
                number,
            )
    if not set(words) & set("XYZ"):
        return None
    if not set("XYZ") <= set(words):
        missing = " and no ".join(axis for axis in "XYZ" if axis not in words)
        raise file.error(f"'{line[:40]}' has no {missing}", number)
    return file.numbers([words[axis] for axis in "XYZ"], number)


def _says_miss(line: str) -> bool:
    """Whether a line of a position says that there was no contact, at its end or before it.

    >>> _says_miss("X1 Y2 Z3 MISS"), _says_miss("probe not tripped X1 Y2 Z3"), _says_miss("X1 Y2")
    (True, True, False)
    """
    signal, before = _SIGNAL.search(line), _words_before(line)
    missed = signal is not None and bool(_MISSED.fullmatch(signal["flag"] or signal["word"]))
    return missed or (before is not None and _OF_MISS.search(before["words"]) is not None)


def _words_before(line: str) -> re.Match[str] | None:
    """Words of a touch, or of one that missed, before a position."""
    time = _TIME.match(line)
    found = _WORDS_BEFORE.match(line, time.end() if time else 0)
    if found is None or _OF_NO_TOUCH.search(found["words"]):
        return None
    return found if _OF_TOUCH.search(found["words"]) else None


def _without_time_and_signal(line: str) -> str:
    """A line of a position without what stands before and after the words."""
    before = _words_before(line) or _TIME.match(line)
    rest = line[before.end() :] if before else line
    return plain_axes(_SIGNAL.sub("", rest).strip())


def _squeezed(value: str) -> str:
    """A number without the blanks between its sign and its digits."""
    return "".join(value.split())


def _is_positions(lines: list[str]) -> bool:
    # A label such as X1 in a CSV file looks like a coordinate.
    is_csv = "nx" in lines[0].split(",")
    joined = joined_axes(enumerate(lines))
    return not is_csv and any(_is_position(line) for _, line in joined[:_HEAD])


def _is_position(line: str) -> bool:
    """Whether X begins a line, and Y and Z follow in this order; or a line is three such words."""
    line = _without_time_and_signal(line)
    if _IN_ANY_ORDER.fullmatch(line) and {*"XYZ"} <= {w[0].upper() for w in _WORD.findall(line)}:
        return True
    place = _X_FIRST.match(line)
    for word in (_THEN_Y, _THEN_Z):
        place = place and word.search(line, place.end())
    return place is not None


POSITIONS = FileFormat(
    name="positions",
    what="lines X… Y… Z…, as DPRNT and LinuxCNC's LOG write them",
    reads="positions",
    needs="plan; units without G20, G21",
    verified="LinuxCNC 2.9 (Debian 12), running",
    recognises=_is_positions,
    by_shape=True,
    parse=lambda file, options: read_log_positions(file, options.units),
    statements=_TABLE,
    other_lines="refused",
)
