"""The column of each quantity of a touch in a table: stated, by its name, or by its place."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from pretravel.base import InputError
from pretravel.files.column_names import (
    ANGLE_UNITS,
    FEED_UNITS,
    GUESSED,
    LENGTH_ROLES,
    LENGTH_UNITS,
    NORMAL_ROLES,
    POSITION_ROLES,
    ROLES,
    ROTARY_ROLES,
    TEXT_ROLES,
    ColumnName,
    column_name,
    groups_rows,
    role_of_cells,
    unit_of,
)
from pretravel.files.file_format import ReadingOptions
from pretravel.files.text_table import TextTable, suggested_columns

_LEFT_OUT = "none"
"""Stated for a role that no column has."""
_MOST_DIGITS = 18
_FEWEST_TO_NUMBER = 2
_SHOWN = 12
"""Most columns that a message shows."""
_UNIT_VECTOR = 0.01
"""The square of a unit vector with two decimals differs from 1 by less."""
_COLOURS = ".xyzrgb"
"""Ending of what Open3D writes: X Y Z R G B, with a pure colour as 1 0 0."""
_UNITS_OF: Mapping[str, tuple[Mapping[str, float], str]] = {
    **dict.fromkeys(LENGTH_ROLES, (LENGTH_UNITS, "length")),
    "feed": (FEED_UNITS, "feed"),
    **dict.fromkeys(("spindle", *ROTARY_ROLES), (ANGLE_UNITS, "angle")),
}
"""Units that the column of a role can state, and what they are units of."""
_COUNT = re.compile(r"[0-9]{1,6}")
_WORDS = tuple(role for role in TEXT_ROLES if role != "label")
"""Roles that several columns can have together."""


@dataclass(frozen=True)
class ColumnRoles:
    """The column of each quantity.

    Attributes
    ----------
    index : dict of str to int
        From 0, by role.
    sign : dict of str to float
        -1 where the numbers change their sign.
    units : dict of str to str
        The unit that a column states.
    stated : frozenset of str
        Roles that the user stated.
    also : dict of str to tuple of int
        Further columns of a role that is words, such as the name and the serial number of a part.
    """

    index: dict[str, int]
    sign: dict[str, float] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    stated: frozenset[str] = frozenset()
    also: dict[str, tuple[int, ...]] = field(default_factory=dict)

    def words(self, text: TextTable, role: str) -> tuple[str, ...]:
        """Cells of a role; those of several columns with a blank between them."""
        places = (self.index[role], *self.also.get(role, ()))
        if len(places) == 1:
            return text.column(places[0])
        return tuple(" ".join(row[i] for i in places if row[i]) for row in text.rows)

    @property
    def used(self) -> set[int]:
        """All columns that are read."""
        return {*self.index.values(), *(i for places in self.also.values() for i in places)}


def column_roles(text: TextTable, options: ReadingOptions) -> ColumnRoles:
    """Return the column of each role: as stated, by its name, or by its place.

    Raises
    ------
    InputError
        A stated column does not exist; two columns have one meaning; a table without a header has
        columns that can mean several things.

    >>> from pretravel.files.source_file import SourceFile
    >>> text = TextTable(SourceFile("a.csv", b""), ("Y", "X", "Z"), (("1", "2", "3"),), (2,))
    >>> column_roles(text, ReadingOptions(columns={"z": "-Z"})).index
    {'z': 2, 'x': 1, 'y': 0}
    """
    stated = options.columns or {}
    unknown = [role for role in stated if role not in ROLES]
    if unknown:
        raise text.file.error(
            f"there is no quantity '{unknown[0]}' of a touch; there are {', '.join(ROLES)}",
            inputs=("columns",),
        )
    index: dict[str, int] = {}
    also: dict[str, tuple[int, ...]] = {}
    sign: dict[str, float] = {}
    for role, title in stated.items():
        if title.lower() != _LEFT_OUT:
            index[role], sign[role] = _stated_column(text, role, title)
    same = [role for role in POSITION_ROLES if role in index]
    if len({index[role] for role in same}) < len(same):
        raise text.file.error(
            f"two of {', '.join(f'{role}={stated[role]}' for role in same)} name the same column",
            text.header_line or None,
            inputs=("columns",),
        )
    names = None if text.names is None else _names_of_columns(text)
    taken = set(index.values())
    if names is not None:
        index |= _named(text, names, set(stated), taken, also)
        if not set(POSITION_ROLES) & set(index):  # letters, not rotary axes
            for role in {*ROTARY_ROLES} - set(stated):
                index.pop(role, None)
        if not set(index) - set(TEXT_ROLES) and not stated:
            raise _without_known_names(text)
        if not {"label"} & {*index, *stated} and 0 not in index.values() and not names[0].title:
            index["label"] = 0  # an index without a name, as spreadsheets and pandas write it
    elif not set(POSITION_ROLES) <= set(stated):
        for role, i in _placed(text, stated).items():
            index.setdefault(role, i)
    units = {} if names is None else _units_of_columns(text, names, index)
    return ColumnRoles(index, sign, units, frozenset(stated), also)


def _names_of_columns(text: TextTable) -> list[ColumnName]:
    """What each name means; where it does not say it, what the cells mean."""
    names = []
    for i, title in enumerate(text.names or ()):
        found = column_name(title)
        if found.role in (None, "label") or found.rank == GUESSED:
            if role := role_of_cells(text.column(i)):
                found = ColumnName(title, role, None, 1)
            elif found.role != "label" and found.role and not groups_rows(text.column(i)):
                found = ColumnName(title, None, None, 1)
        names.append(found)
    return _with_uvw(text, names)


def _with_uvw(text: TextTable, names: list[ColumnName]) -> list[ColumnName]:
    """The names, where U, V, W are normals: unit vectors in a table without other normals."""
    places = {name.title.strip().lower(): i for i, name in enumerate(names)}
    known = {name.role for name in names}
    if not {"u", "v", "w"} <= {*places} or known & {*NORMAL_ROLES} or not {"x", "y", "z"} <= known:
        return names
    columns = [places[letter] for letter in "uvw"]
    try:
        values = [[float(row[i].replace(",", ".")) for i in columns] for row in text.rows]
    except ValueError:
        return names
    if any(abs(sum(part * part for part in row) - 1.0) > _UNIT_VECTOR for row in values):
        return names
    for role, i in zip(NORMAL_ROLES, columns, strict=True):
        names[i] = ColumnName(names[i].title, role, None, 1)
    return names


def _stated_column(text: TextTable, role: str, title: str) -> tuple[int, float]:
    """Index and sign of a column that the user names, or numbers from 1."""
    names = list(text.names or ())
    plain = [name.lower() for name in names]
    for sign, word in ((1.0, title), (-1.0, title[1:] if title.startswith("-") else "")):
        if word in names:
            place = names.index(word)
            if _COUNT.fullmatch(word) and int(word) != place + 1 and 1 <= int(word) <= text.width:
                raise text.file.error(
                    f"'{word}', given as {role}, is the name of column {place + 1} and the number "
                    f"of another: give {place + 1} for it; if the line of the names is a title, "
                    f"leave it out (line {text.header_line})",
                    text.header_line or None,
                    inputs=("columns", "exclude"),
                )
            return place, sign
        if plain.count(word.lower()) == 1 and word:
            return plain.index(word.lower()), sign
        if _COUNT.fullmatch(word) and 1 <= int(word) <= text.width:
            return int(word) - 1, sign
    there = f"the columns {', '.join(names)}" if names else f"{text.width} columns without names"
    raise text.file.error(
        f"the column '{title}', given as {role}, is not there; the file has {there}",
        text.header_line or None,
        inputs=("columns",),
    )


def _named(
    text: TextTable,
    names: Sequence[ColumnName],
    stated: set[str],
    taken: set[int],
    also: dict[str, tuple[int, ...]],
) -> dict[str, int]:
    """Columns by their names; further columns of words are added to `also`."""
    found: dict[str, int] = {}
    counts = Counter(text.names or ())
    repeated = {name for name, count in counts.items() if name and count > 1}
    for role in ROLES:
        same = [i for i, n in enumerate(names) if n.role == role and i not in taken]
        if not same or role in stated:
            continue
        best = min(names[i].rank for i in same)
        same = [i for i in same if names[i].rank == best]
        if role in _WORDS:
            same = [i for i in same if best == 0 or not _are_numbers_of_rows(text.column(i))]
            if same:
                found[role], also[role] = same[0], tuple(same[1:])
            continue
        if len(same) > 1:
            titles = " and ".join(f"'{names[i].title}'" for i in same)
            problem = (
                f"the column {names[same[0]].title} occurs twice"
                if names[same[0]].title in repeated
                else f"the columns {titles} can both be {role}"
            )
            numbers = " or ".join(f"{role}={i + 1}" for i in same)
            raise text.file.error(
                f"{problem}; give its number: {numbers}", text.header_line, inputs=("columns",)
            )
        found[role] = same[0]
    return found


def _placed(text: TextTable, stated: Mapping[str, str]) -> dict[str, int]:
    """Columns of a table without a header: X Y Z, X Y Z I J K, with a label first or without."""
    width, start = text.width, 0
    if _is_matrix(text):
        raise text.file.error(
            "this is a matrix of heights: x in its first row, y in its first column. Write x, y "
            "and z of each point as a row",
            text.lines[0],
        )
    if {"x", "y", "z"} <= {row[0].strip().lower() for row in text.rows}:
        raise text.file.error(
            "the table has its coordinates in rows, x in one, y in another: write x, y and z of "
            "each touch in one row",
            text.lines[0],
        )
    if width in (4, 7):
        if not _are_labels(text.column(0)):
            raise _without_names(text, "its first column is not a label or a running number")
        start = 1
    elif width not in (3, 6):
        raise _without_names(text, "3 (X Y Z), 6 (X Y Z I J K) or a label and these are read")
    found = {role: start + i for i, role in enumerate(POSITION_ROLES)}
    if start:
        found["label"] = 0
    if wrong := [i for i in found.values() if i >= start and ":" in text.rows[0][i]]:
        raise _without_names(text, f"its column {wrong[0] + 1} is a time")
    normals = [start + 3 + i for i in range(3)]
    has_normals = width - start == 6 and text.file.ending != _COLOURS
    if has_normals and not all(_is_zero(row[i]) for row in text.rows for i in normals):
        found |= dict(zip(NORMAL_ROLES, normals, strict=True))
    return {role: i for role, i in found.items() if role not in stated}


def _is_matrix(text: TextTable) -> bool:
    """Whether the first row and the first column rise, and no number is where they meet."""
    corner, *first = text.rows[0]
    down = [row[0] for row in text.rows[1:]]
    if len(down) < _FEWEST_TO_NUMBER or re.fullmatch(r"[-+]?\d+([.,]\d+)?", corner):
        return False
    try:
        values = [[float(cell.replace(",", ".")) for cell in cells] for cells in (first, down)]
    except ValueError:
        return False
    return all(a < b for each in values for a, b in itertools.pairwise(each))


def _are_numbers_of_rows(cells: Sequence[str]) -> bool:
    """Whether cells number the rows, as "Probe 1, 2, 3 …" does: no two are the same tip."""
    return len(cells) > _FEWEST_TO_NUMBER and len(set(cells)) == len(cells)


def _without_names(text: TextTable, problem: str) -> InputError:
    if text.separator == "," and not any("." in cell for cell in text.rows[0]):
        problem += "; are there decimal commas? Then save the table with semicolons"
    shown = " ".join(f"{i + 1}='{cell}'" for i, cell in enumerate(text.rows[0][:_SHOWN]))
    more = " …" if text.width > _SHOWN else ""
    heights = ". Rows of heights alone have no positions: write x, y and z of each point"
    return text.file.error(
        f"the table has no header and {text.width} columns, which can mean several things "
        f"({problem}); give the columns by their numbers, such as {_example_of(text)}. This line: "
        f"{shown}{more}{heights if _are_alike(text) else ''}",
        text.lines[0],
        inputs=("columns",),
    )


_NUMBER_BEHIND = re.compile(r"[ _.-]?\d+$")
_COORDINATES = 2
_REPEATS = "If they repeat each touch, write each repeat in a row of its own. "


def _without_known_names(text: TextTable) -> InputError:
    """The error about a header that names nothing that is known: another language, or a title."""
    stems = Counter(_NUMBER_BEHIND.sub("", name) for name in text.names or () if name)
    repeats = "" if sum(count > 1 for count in stems.values()) < _COORDINATES else _REPEATS
    return text.file.error(
        f"this line seems to be the header, but names no coordinate: {_names_of(text)}. {repeats}"
        f"Give the columns by these names or by their numbers, such as {_example_of(text)}; if "
        f"the line is a title, leave it out (line {text.header_line})",
        text.header_line or None,
        inputs=("columns", "exclude"),
    )


def _names_of(text: TextTable) -> str:
    names = list(text.names or ())
    return ", ".join([*names[:_SHOWN], *(["…"] if len(names) > _SHOWN else [])])


def _example_of(text: TextTable) -> str:
    return suggested_columns(list(zip(text.lines, text.rows, strict=True)))


def _are_alike(text: TextTable) -> bool:
    """Whether all columns have numbers of one range, as rows of heights have."""
    try:
        values = [[float(cell) for cell in text.column(i)] for i in range(text.width)]
    except ValueError:
        return False
    return max(map(min, values)) <= min(map(max, values))


def _are_labels(cells: Sequence[str]) -> bool:
    if not all(cell.isdecimal() for cell in cells):
        return not any(re.fullmatch(r"[-+]?\d*[.,]\d+", cell) for cell in cells)
    # A number of many digits is a label, and Python reads none of more than 4300.
    numbers = [int(cell[:_MOST_DIGITS]) for cell in cells]
    if any(len(cell) > _MOST_DIGITS for cell in cells):
        return True
    return all(later > first for first, later in itertools.pairwise(numbers))


def _is_zero(cell: str) -> bool:
    return re.fullmatch(r"[-+]?(?:0+(?:[.,]0*)?|[.,]0+)(?:[eE][-+]?\d+)?", cell) is not None


def _units_of_columns(
    text: TextTable, names: Sequence[ColumnName], index: Mapping[str, int]
) -> dict[str, str]:
    """Unit of each role whose column states one: in its name, or in the row of units."""
    found = {}
    for role, i in index.items():
        unit = names[i].unit
        below = unit_of(text.units[i]) if text.units else None
        if unit is not None and below not in (None, "1", unit):
            raise text.file.error(
                f"the column {text.title(i)} has the unit {unit} in its name and {below} in the "
                "row below: correct the one that is wrong",
                text.header_line,
            )
        unit = below if unit is None else unit
        known, kind = _UNITS_OF.get(role, ({}, ""))
        if unit in known:
            found[role] = str(unit)
        elif unit not in (None, "1") and known:
            raise text.file.error(
                f"the column {text.title(i)} has the unit {unit}, which is not a unit of {kind}",
                text.header_line,
            )
    return found
