"""Words of lines, X1.5 or X = 1.5, in the forms in which controls and CMMs print positions."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from datetime import date

from pretravel.files.column_names import unit_of

NUMERAL = r"[-+−]?(?:\d+(?:[.,'’]\d+)*\.?|[.,]\d+)(?:[eE][-+]?\d+)?"
APART = rf"(?:[-+−]\s+)?{NUMERAL}"
"""A number, also with blanks between its sign and its digits."""
_WORD = re.compile(rf"(?:([A-Za-z]{{1,3}})\s*+[:=]\s*+({APART})|([A-Za-z])\s*+({APART}))[\s,;]*+")
_X_BEGINS = re.compile(r"(?<![A-Za-z0-9])X\s*+[:=]?+\s*+[-+−.\d]", re.IGNORECASE)
_NAME = re.compile(r"(?:[A-Za-z]\w{0,30}|#)?[\s_.-]*+\d{0,9}+\s*+[:,;)]?+\s*+")
"""What stands before the words of a touch: its name, its number or both."""
_VECTORS = ({*"IJK"}, {"NX", "NY", "NZ"})
_OTHER_STEM = re.compile(
    r"(?<![\w$#])(?P<before>[$A-Z_]\w{0,20}?[_.\[]?)X(?P<after>\]?)\s*+[:=]?+\s*+(?=[-+.\d])",
    re.IGNORECASE,
)
"""The beginning of VSAPX 1.5 or $AA_MW[X]=1.5; Y and Z follow with the same stem."""
_NOT_TOUCHED = re.compile(r"nom|soll|targ|theo|cmd|stop|end|start|ref", re.IGNORECASE)
_SKIP_SIGNAL = re.compile(r"#506([123])\s*(=\s*|\s(?=[XYZ]))|\bQ11([567])\s*=\s*")
"""Variables of the position at the probe's signal: Fanuc #5061 …, Heidenhain Q115 …."""
_INDEXED = re.compile(rf"X(\d{{1,6}})\s*+=\s*+{APART}[\s,;]*+Y\1\s*+=\s*+{APART}[\s,;]*+Z\1\s*+=")
"""The words of a touch with its number after each letter: X1 = 1.5, Y1 = 2, Z1 = 3."""
_INDEX = re.compile(r"([XYZ])\d{1,6}\s*+=")
_ONE_AXIS = re.compile(rf"([XYZ])\s*+[:=]?+\s*+{APART}[,;*]?", re.IGNORECASE)
_OF_A_POINT = re.compile(
    r"\[?(point|punkt|pt|hit|touch|messpunkt|p|nr|no)\s*+[:#.=]?\s*+(\d{1,6})\.?\]?:?",
    re.IGNORECASE,
)
"""A line above the coordinates of a touch, each in a line of its own."""
_FEWEST_JOINED = 2
_TITLES = 3
_UNIT_IN_TEXT = re.compile(
    r"\b(?:units?|einheit(?:en)?|unites?|unités?|unidad(?:es)?|unità)\b\W*(\w+|\"|\[\w+\])|"
    r"\b(?:data|values|coordinates|positions|points|dimensions|measured|all|werte|koordinaten|"
    r"maße|angaben|messwerte|cotes|valores)\b(?:\W+are)?\W+(?:in|en)\W+(\w+)|\b(G2[01])\b",
    re.IGNORECASE,
)


def together(line: str) -> str:
    """A row of words with vectors, each letter together with its number.

    >>> together("X 1.5 Y- 2 Z 3 I 0 J 0 K 1"), together("X 1.5 Y- 2 Z 3")
    ('X1.5 Y-2 Z3 I0 J0 K1', 'X 1.5 Y- 2 Z 3')
    >>> together("HIT 1 X=1.5 Y=2 Z=3 NX=0 NY=0 NZ=1")
    'HIT_1 X1.5 Y2 Z3 NX=0 NY=0 NZ=1'
    """
    if not (line[:1].isalpha() or line[:1] == "#"):
        return line
    rest, label = line, ""
    if _WORD.sub("", line).strip():  # a name stands before the words, perhaps
        begins = _X_BEGINS.search(line)
        named = None if begins is None else _NAME.fullmatch(line[: begins.start()])
        if begins is None or named is None:
            return line
        rest, label = line[begins.start() :], "_".join(named[0].strip(" #:,;)").split())
    words = [
        ((first or letter).upper(), "".join((number or other).split()))
        for first, number, letter, other in _WORD.findall(rest)
    ]
    names = [name for name, _ in words]
    if _WORD.sub("", rest).strip() or not {*"XYZ"} <= {*names} or len({*names}) < len(names):
        return line
    if not any(vector <= {*names} for vector in _VECTORS):
        return line
    found = [name + ("=" if len(name) > 1 else "") + number for name, number in words]
    return " ".join([label, *found] if label else found)


def plain_axes(line: str) -> str:
    """A line of a position whose axes have longer names, with X, Y and Z as their names.

    >>> plain_axes("$AA_MW[X]=1.5 $AA_MW[Y]=2 $AA_MW[Z]=3"), plain_axes("VSAPX 1 VSAPY 2 VSAPZ 3")
    ('X=1.5 Y=2 Z=3', 'X=1 Y=2 Z=3')
    >>> plain_axes("#5061=1.5 #5062=2 #5063=3"), plain_axes("NOM_X=1 NOM_Y=2 NOM_Z=3")
    ('X=1.5 Y=2 Z=3', 'NOM_X=1 NOM_Y=2 NOM_Z=3')
    """
    if found := _INDEXED.match(line):
        return f"N{found[1]} " + _INDEX.sub(r"\1=", line)
    if "#506" in line or "Q11" in line:
        line = _SKIP_SIGNAL.sub(_axis_of_variable, line)
    stem = _stem_of_axes(line)
    return line if stem is None else stem[1].sub(r"\1=", line)


def stem_of_axes(line: str) -> str:
    """What stands before the letters of the axes of a line, in capitals; empty where nothing does.

    >>> stem_of_axes("$AA_MW[X]=1.5 $AA_MW[Y]=2 $AA_MW[Z]=3"), stem_of_axes("X1 Y2 Z3")
    ('$AA_MW[', '')
    """
    found = _stem_of_axes(line)
    return "" if found is None else found[0].upper()


def _stem_of_axes(line: str) -> tuple[str, re.Pattern[str]] | None:
    """The one stem of three axes of a line, and the pattern of its words."""
    whole = []
    for before, after in {
        (found["before"], found["after"]) for found in _OTHER_STEM.finditer(line)
    }:
        pattern = re.compile(
            rf"(?<![\w$#]){re.escape(before)}([XYZ]){re.escape(after)}\s*+[:=]?+\s*+(?=[-+.\d])",
            re.IGNORECASE,
        )
        if len({axis.upper() for axis in pattern.findall(line)}) == len("XYZ"):
            whole.append((before, pattern))
    return None if len(whole) != 1 or _NOT_TOUCHED.search(whole[0][0]) else whole[0]


def _axis_of_variable(found: re.Match[str]) -> str:
    if found[1] and not found[2].strip():  # the letter follows
        return ""
    return f"{dict(zip('123567', 'XYZXYZ', strict=True))[found[1] or found[3]]}="


def joined_axes(lines: Iterable[tuple[int, str]]) -> list[tuple[int, str]]:
    """Lines in which X, Y and Z stand below each other, each touch in one line.

    Only where all lines are such, but for blank ones, comments and a title: in the report of a
    feature other lines stand between them.

    >>> joined_axes([(1, "X 1.5"), (2, "Y 2"), (3, "Z 3"), (4, "X 2.5"), (5, "Y 2"), (6, "Z 3")])
    [(1, 'X 1.5 Y 2 Z 3'), (4, 'X 2.5 Y 2 Z 3')]
    >>> lines = ["[Point 1]", "X=1", "Y=2", "Z=3", "[Point 2]", "X=2", "Y=2", "Z=3"]
    >>> joined_axes(enumerate(lines, start=1))
    [(2, 'Point_1 X=1 Y=2 Z=3'), (6, 'Point_2 X=2 Y=2 Z=3')]
    """
    every = list(lines)
    stated = [(n, line.strip()) for n, line in every if line.strip(" \t\r\n%")]
    begin = next((i for i, (_, line) in enumerate(stated) if _ONE_AXIS.fullmatch(line)), _TITLES)
    if begin and begin < len(stated) and _OF_A_POINT.fullmatch(stated[begin - 1][1]):
        begin -= 1
    rows, told, names = list[tuple[int, str]](), list[tuple[int, str]](), dict[int, str]()
    for i, (n, line) in enumerate(stated):
        named = _OF_A_POINT.fullmatch(line)
        if i < begin or line.startswith(("(", ";")):
            told.append((n, line))
        elif named is None:
            rows.append((n, line))
        else:
            names[len(rows)] = "_".join(named.groups())  # of the touch that follows
    axes = "".join(found[1].upper() for _, line in rows if (found := _ONE_AXIS.fullmatch(line)))
    if begin >= _TITLES or len(axes) < max(len(rows), 3 * _FEWEST_JOINED):
        return every
    if not ("XYZ" * len(rows)).startswith(axes):
        return every
    joined = [
        (
            rows[i][0],
            " ".join([*filter(None, [names.get(i)]), *(line for _, line in rows[i : i + 3])]),
        )
        for i in range(0, len(rows), 3)
    ]
    return sorted([*told, *joined])


def units_in_text(notes: Sequence[str]) -> set[str]:
    """Units of length that comments and lines before the rows state.

    >>> units_in_text(["; Units: Inches"]), units_in_text(["(values in mm)"]), units_in_text(["x"])
    ({'inch'}, {'mm'}, set())
    """
    found = set()
    for note in notes:
        for word, of_values, code in _UNIT_IN_TEXT.findall(note):
            unit = {"G20": "inch", "G21": "mm"}.get(code.upper()) or unit_of(word or of_values)
            if unit not in (None, "1"):
                found.add(str(unit))
    return found


_DAY = re.compile(r"\b((?:19|20)\d\d)-(\d\d)-(\d\d)\b|\b(\d\d?)\.(\d\d?)\.((?:19|20)\d\d)\b")


def days_in_text(text: str) -> list[date]:
    """The dates in a text that can be read in one way.

    >>> days_in_text("calibrated 2026-03-14, valid until 14.03.2027, not 3/4/2026")
    [datetime.date(2026, 3, 14), datetime.date(2027, 3, 14)]
    """
    found = []
    for year, month, day, day_first, month_next, year_last in _DAY.findall(text):
        parts = (year, month, day) if year else (year_last, month_next, day_first)
        try:
            found.append(date(*map(int, parts)))
        except ValueError:
            continue
    return found
