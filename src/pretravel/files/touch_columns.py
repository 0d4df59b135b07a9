"""Columns of touches in a table of any form, and a sentence that states what was understood."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from pretravel.base import INCH, SLOWEST_USUAL_FEED, InputError
from pretravel.files.column_names import (
    ANGLE_UNITS,
    FEED_UNITS,
    FRAME_ROLE,
    LENGTH_ROLES,
    LENGTH_UNITS,
    NUMBER_ROLES,
    OWN_NAMES,
    POSITION_ROLES,
    ROLES,
    ROTARY_ROLES,
    TEXT_ROLES,
    counts_rows,
)
from pretravel.files.csv_table import CsvTable
from pretravel.files.file_format import ReadingOptions
from pretravel.files.lines_of_tables import SEPARATORS
from pretravel.files.roles_of_columns import (
    ColumnRoles,
    column_roles,
)
from pretravel.files.row_statements import conditions_not_read, nothing_measured, unknown_lines
from pretravel.files.rows_of_touches import rows_of_touches, verdicts, with_travel
from pretravel.files.source_file import SourceFile
from pretravel.files.stated_conditions import (
    refuse_contradictions,
    size_of_features,
    tip_not_used,
    unit_of_rows,
)
from pretravel.files.tables import read_parquet_table
from pretravel.files.text_table import TextTable, read_text_table
from pretravel.files.times_of_rows import row_times, times_said
from pretravel.touches import WORD_COLUMNS

NO_UNIT = "unit"
"""Name of the unit of a table that is looked at and states none."""
_MOVED = 1e-3
"""Angles of rotary axes that differ by less are equal. [deg]"""
_DEVIATION = re.compile(
    r"\W*(?:dev(?:iation)?s?|abw(?:eichung)?|[ée]cart|error|d[xyz]|delta ?[xyz]?|scost\w*|"
    r"desv\w*)\b",
    re.IGNORECASE,
)
_GROUPED = re.compile(r"[-+−]?[1-9]\d{0,2}(?:,\d{3})")
"""A comma that can group thousands as well as begin decimals."""


@dataclass(frozen=True)
class TouchColumns:
    """The columns of a table that touches are made of.

    Attributes
    ----------
    table : CsvTable
        With the names that this package writes; other columns are left out.
    titles : mapping of str to str
        The file's own name of the column of each role.
    understood : str
        What was understood of the file, in one line, without the number of rows.
    own_form : bool
        The table has the form that this package writes: nothing was guessed.
    unit_known : bool
        False only for a table that is looked at.
    places : mapping of str to int
        The place of each column of `table` in the file, from 0.
    separator : str
        A key of `SEPARATORS`; empty for Parquet.
    whole : bool
        Rows are of several tips or parts, perhaps: the table is read as a whole.
    notes : tuple of str
        Comments between the rows, as a sentence.
    frame : str
        Coordinate system and angles of rotary axes that columns give, the same in all rows.
    """

    table: CsvTable
    titles: Mapping[str, str]
    understood: str
    own_form: bool
    unit_known: bool = True
    places: Mapping[str, int] = field(default_factory=dict)
    separator: str = ""
    whole: bool = False
    notes: tuple[str, ...] = ()
    frame: str = ""

    def title(self, *roles: str) -> str:
        """The file's names of columns, for messages."""
        return ", ".join(self.titles[role] for role in roles)


@dataclass(frozen=True)
class _Unit:
    """Unit of the lengths of a table, and how it is known."""

    name: str
    why: str


def read_touch_columns(file: SourceFile, options: ReadingOptions | None = None) -> TouchColumns:
    r"""Read the columns of touches or targets from a table of any form, CSV or Parquet.

    Parameters
    ----------
    file : SourceFile
    options : ReadingOptions, optional
        What the user states: columns, unit, decimal sign, rows to leave out.

    Raises
    ------
    InputError
        As `read_text_table`; a column that is stated does not exist; two columns have one meaning;
        the unit or the decimal sign is not known. The message contains the line.

    >>> file = SourceFile("a.txt", b"X [in];Y [in];Z [in]\n0,5;1,5;2\n")
    >>> found = read_touch_columns(file)
    >>> found.table.numbers("x_mm").tolist(), found.understood.split(",")[:3]
    ([[12.7]], ["separator ';'", ' decimal comma', ' inch (given in the file)'])
    """
    options = options or ReadingOptions()
    text, roles, left_out = _kept_rows(file, options)
    unit = _unit(text, roles, options)
    decimal = _decimal(text, roles, options)
    whole = bool({*roles.index} & {*WORD_COLUMNS, *ROTARY_ROLES, FRAME_ROLE})
    frame = _frame(text, roles)
    roles = _without_counts(text, _of_one_frame(text, roles))
    text, roles = _without_rotary(text, roles)
    unit_name = NO_UNIT if unit is None else unit.name
    refuse_contradictions(text, roles, options, unit_name)
    columns = {_own_name(role): roles.words(text, role) for role in roles.index}
    table = CsvTable(
        file.path,
        columns,
        text.lines,
        text.header_line,
        decimal=decimal or ".",
        scales={_own_name(role): _scale(role, roles, unit) for role in roles.index},
        titles={_own_name(role): text.title(i) for role, i in roles.index.items()},
        unread=tuple(text.title(i) for i in _other_columns(text, roles)),
        of_touches=True,
    )
    refuse_control_characters(table)
    if not options.look_only:
        _refuse_slow_feeds(file, table, roles)
    own_form = (
        text.separator == ","
        and text.encoding == "UTF-8"
        and decimal != ","
        and not (text.preamble or text.units or text.disabled or roles.stated or table.unread)
        and all(text.title(i) == _own_name(role) for role, i in roles.index.items())
    )
    titles = {role: text.title(i) for role, i in roles.index.items()}
    sentence = _sentence(text, roles, unit, decimal)
    known = unit is None or unit.name != NO_UNIT
    return TouchColumns(
        table,
        titles,
        sentence,
        own_form,
        known,
        places={_own_name(role): i for role, i in roles.index.items()},
        separator="" if file.ending == ".parquet" else text.separator,
        whole=whole,
        frame=frame,
        notes=(
            *conditions_not_read(text.around),
            *times_said(text, roles),
            *unknown_lines(text.among),
            *_deviations_alone(text, roles),
            *left_out,
            *verdicts(text, _other_columns(text, roles)),
            *nothing_measured((*text.around, *text.among)),
            *(tip_not_used(text, unit_name) if options.tip_radius is None else ()),
            *size_of_features(text, roles.used, unit_name, options.tip_radius),
        ),
    )


def _deviations_alone(text: TextTable, roles: ColumnRoles) -> tuple[str, ...]:
    """A sentence about deviations in a table whose coordinates can be measured or nominal."""
    titles = [text.title(i) for i in _other_columns(text, roles)]
    found = [title for title in titles if _DEVIATION.match(title)]
    if not found or "nominal_x" in roles.index:
        return ()
    there = f"the table has deviations ({', '.join(found)}), which are not read, and no nominal"
    taken = "x, y and z were taken as measured. If they are nominal, write the measured points"
    return (f"{there} points: {taken}",)


def _frame(text: TextTable, roles: ColumnRoles) -> str:
    """Coordinate system and rotary axes of the first row, in words."""
    there = [role for role in (FRAME_ROLE, *ROTARY_ROLES) if role in roles.index]
    cells = {role: text.column(roles.index[role])[0] for role in there}
    angles = {role: _angle(cell) for role, cell in cells.items() if role in ROTARY_ROLES}
    words = {
        role: cells[role] if angles.get(role) is None else f"{angles[role]:g}" for role in there
    }
    return ", ".join(f"{text.title(roles.index[role])} {words[role]}" for role in there)


def _of_one_frame(text: TextTable, roles: ColumnRoles) -> ColumnRoles:
    """The roles without a column of coordinate systems, which is the same in all rows.

    Raises
    ------
    InputError
        It changes: X, Y and Z of its rows are in different coordinates.
    """
    if FRAME_ROLE not in roles.index:
        return roles
    title, cells = text.title(roles.index[FRAME_ROLE]), text.column(roles.index[FRAME_ROLE])
    moved = [row for row, cell in enumerate(cells) if cell != cells[0]]
    if moved:
        raise text.file.error(
            f"{title} changes (from '{cells[0]}' to '{cells[moved[0]]}'): x, y and z of these rows "
            f"are in different coordinates. Split the table by {title}, or say that it is "
            f"not a system of coordinates ({FRAME_ROLE}=none)",
            text.lines[moved[0]],
            inputs=("columns",),
        )
    return replace(roles, index={r: i for r, i in roles.index.items() if r != FRAME_ROLE})


def _without_counts(text: TextTable, roles: ColumnRoles) -> ColumnRoles:
    """The roles without a count of rows that looks like a series, and without another T, H or D.

    T is the tool, H its length and D its cutting edge where all cells are whole numbers of three
    digits at most (T5, 5), of which one comes twice; otherwise it is a time, a temperature, a
    height or a diameter.
    """
    index, also = dict(roles.index), dict(roles.also)
    for role in {"tip", "part"} & set(index) - roles.stated:
        places = (index.pop(role), *also.pop(role, ()))
        if kept := [i for i in places if not _counts(text.title(i), text.column(i))]:
            index[role], also[role] = kept[0], tuple(kept[1:])
    return replace(roles, index=index, also=also)


def _counts(title: str, cells: Sequence[str]) -> bool:
    unique = len(cells) > 1 and len(set(cells)) == len(cells)
    if title.strip().lower() not in ("t", "h", "d"):
        return unique and counts_rows(title)
    return unique or not all(_TOOL.fullmatch(cell) for cell in cells)


_TOOL = re.compile(r"[0-9]{1,3}|.*[A-Za-z].*")


def _without_rotary(text: TextTable, roles: ColumnRoles) -> tuple[TextTable, ColumnRoles]:
    """The roles without rotary axes, which stand still.

    Raises
    ------
    InputError
        A rotary axis moves: X, Y and Z of its rows are in different coordinates.
    """
    there = tuple(role for role in ROTARY_ROLES if role in roles.index)
    for role in there:
        title, cells = text.title(roles.index[role]), text.column(roles.index[role])
        values = [_angle(cell) for cell in cells]
        moved = [row for row, value in enumerate(values) if _differs(value, values[0])]
        if moved:
            row = moved[0]
            raise text.file.error(
                f"the rotary axis {title} moves (from {cells[0]} to {cells[row]}): x, y and z of "
                "these rows are in different coordinates. Split the table by its angles, or say "
                f"that {title} is not a rotary axis ({role}=none), or is the orientation of the "
                f"spindle (spindle={title})",
                text.lines[row],
                inputs=("columns",),
            )
    kept = {role: i for role, i in roles.index.items() if role not in there}
    return text, replace(roles, index=kept)


def _angle(cell: str) -> float | None:
    """An angle; None of a cell that is empty or no number."""
    try:
        return None if "_" in cell else float(cell.replace(",", ".").replace("−", "-"))
    except ValueError:
        return None


def _differs(value: float | None, first: float | None) -> bool:
    if value is None or first is None:
        return (value is None) != (first is None)
    return not abs(value - first) <= _MOVED


def _own_name(role: str) -> str:
    return OWN_NAMES.get(role, role)


def _kept_rows(
    file: SourceFile, options: ReadingOptions
) -> tuple[TextTable, ColumnRoles, tuple[str, ...]]:
    """The table without the rows that are excluded, by their labels or their lines.

    Rows that are moves are left out, too, which the sentences say.
    """
    named = set(options.exclude) & set(_labels_of_all_rows(file, options))
    lines = own_lines(options.exclude, file) - named  # a label comes first
    text = _text_table(file, lines)
    roles = column_roles(text, options)
    labels = text.column(roles.index["label"]) if "label" in roles.index else ()
    named |= {name for name in options.exclude if name in labels and name not in lines}
    for name in options.exclude:
        if name not in named and name.rpartition(":")[2] not in lines:
            raise file.error(
                f"there is no touch with the label or on the line '{name}'", inputs=("exclude",)
            )
    kept = [i for i in range(len(text.rows)) if not labels or labels[i] not in named]
    if not kept:
        raise file.error("all touches are excluded", inputs=("exclude",))
    rows, numbers = [text.rows[i] for i in kept], [text.lines[i] for i in kept]
    text = replace(text, rows=tuple(rows), lines=tuple(numbers))
    stated = {roles.index[role] for role in roles.stated if role in roles.index}
    text, told = rows_of_touches(text, stated)
    return text, column_roles(text, options) if told else roles, told


def _labels_of_all_rows(file: SourceFile, options: ReadingOptions) -> tuple[str, ...]:
    """The labels before anything is left out; none where a bad line must be left out first."""
    if not options.exclude:
        return ()
    try:
        text = _text_table(file, ())
        roles = column_roles(text, options)
    except InputError:
        return ()
    labels = text.column(roles.index["label"]) if "label" in roles.index else ()
    _refuse_header(text, own_lines(options.exclude, file) - set(labels))
    return labels


def _refuse_header(text: TextTable, excluded: Collection[str]) -> None:
    """The columns would lose their names and units, and be guessed."""
    first = text.lines[0]
    for line in range(text.header_line or first, first):
        if str(line) in excluded:
            names = line == text.header_line
            what = "the header, which names the columns" if names else "a line below the header"
            raise text.file.error(
                f"the line cannot be excluded: it is {what}. "
                f"The first touch is on line {first}; a touch is excluded by its label or its line",
                line,
                inputs=("exclude",),
            )


def _text_table(file: SourceFile, left_out: Collection[str]) -> TextTable:
    if file.ending != ".parquet":
        return with_travel(read_text_table(file, left_out))
    table = read_parquet_table(file)
    kept = [i for i, line in enumerate(table.lines) if str(line) not in left_out]
    if not kept:
        raise file.error("all touches are excluded", inputs=("exclude",))
    columns = [[cells[i] for i in kept] for cells in table.columns.values()]
    text = TextTable(
        file,
        tuple(table.columns),
        tuple(zip(*columns, strict=True)),
        tuple(table.lines[i] for i in kept),
    )
    return with_travel(text)


def own_lines(exclude: Sequence[str], file: SourceFile) -> set[str]:
    """Return the lines of a file that are excluded: "17", or "name.csv:17".

    >>> sorted(own_lines(["17", "b.csv:3", "a.csv:4", "pole"], SourceFile("a.csv", b"")))
    ['17', '4']
    """
    found = set()
    for name in exclude:
        place, _, line = name.rpartition(":")
        if line.isdecimal() and place in ("", file.name, file.path):
            found.add(line)
    return found


def _unit(text: TextTable, roles: ColumnRoles, options: ReadingOptions) -> _Unit | None:
    """Unit of the lengths: of the columns, the comments, the user; None for normals alone."""
    if not set(LENGTH_ROLES) & set(roles.index):
        return None
    own = {unit for role, unit in roles.units.items() if role in LENGTH_ROLES}
    if len(own) > 1:
        raise text.file.error(
            f"the columns have different units ({', '.join(sorted(own))}); one unit is read",
            text.header_line,
        )
    if text.unit is not None:
        if own and text.unit in LENGTH_UNITS and text.unit not in own:
            raise text.file.error(
                f"the header gives {own.pop()} and a line before it {text.unit}: correct the one "
                "that is wrong",
                text.header_line or None,
            )
        own = own or {text.unit}
    if not own and (of_rows := unit_of_rows(text, roles.used)):
        own = {of_rows}
    stated = options.units
    if own:
        unit = own.pop()
        if stated not in (None, unit):
            raise text.file.error(
                f"the file is in {unit}, but {stated} was given", text.header_line or None,
                inputs=("units",),
            )  # fmt: skip
        return _Unit(unit, "given in the file")
    if stated is not None:
        return _Unit(stated, "given")
    if options.reference_diameter is not None:
        _refuse_inches(text, options.reference_diameter, options.tip_radius)
        return _Unit("mm", "not given; the diameters are compared")
    if options.look_only:
        return _Unit(NO_UNIT, "not stated")
    text.file.scale(None, _NO_UNIT)
    raise AssertionError  # scale refuses


_LARGEST_IN_INCHES = 2.0, 0.3
"""Diameter of a reference and radius of a tip, below which the numbers may be inches."""


def _refuse_inches(text: TextTable, reference_diameter: float, tip_radius: float | None) -> None:
    """Refuse numbers without a unit whose diameters agree, as those of inches would.

    The scatter would be taken for one of mm, 25 times smaller than it is.
    """
    reference, tip = _LARGEST_IN_INCHES
    if reference_diameter >= reference or (tip_radius is not None and tip_radius >= tip):
        return
    text.file.scale(
        None,
        f"the table does not give its unit of length, and a reference of {reference_diameter:g} mm "
        f"may be one of {INCH * reference_diameter:.4g} mm in inches. Diameters are given in mm",
    )


_NO_UNIT = (
    "the table does not give its unit of length (as x_mm or X [in] does), and only qualify can "
    "check it, by the diameters (pretravel convert lists all that is missing)"
)


def _scale(role: str, roles: ColumnRoles, unit: _Unit | None) -> float:
    scale = roles.sign.get(role, 1.0)
    if role in LENGTH_ROLES and unit is not None:
        return scale * LENGTH_UNITS.get(unit.name, 1.0)
    if role == "feed":
        return scale * FEED_UNITS[_feed_unit(roles, unit)]
    if role == "spindle":
        return scale * ANGLE_UNITS[roles.units.get(role, "deg")]
    return scale


def _refuse_slow_feeds(file: SourceFile, table: CsvTable, roles: ColumnRoles) -> None:
    """Refuse feeds without a unit that are too slow for mm/min: of mm/s or m/min, perhaps."""
    if "feed" not in roles.index or "feed" in roles.units:
        return
    fastest = float(table.numbers("feed_mm_min").max())
    if fastest < SLOWEST_USUAL_FEED:
        name = table.titles["feed_mm_min"]
        raise file.error(
            f"the feeds in {name} are at most {fastest:g}, and probes touch at "
            f"{SLOWEST_USUAL_FEED:g} to 2000 mm/min: in which unit are they? Name it in the title "
            f"of the column: {name} [mm/s], {name} [m/min] or {name} [mm/min]",
            inputs=("columns",),
        )


def _feed_unit(roles: ColumnRoles, unit: _Unit | None) -> str:
    own = roles.units.get("feed")
    return own or ("inch/min" if unit is not None and unit.name == "inch" else "mm/min")


_WITH_SIGN = re.compile(r"\d[,.']|[,.']\d")
"""A digit next to a decimal sign or one of thousands."""


def _decimal(text: TextTable, roles: ColumnRoles, options: ReadingOptions) -> str | None:
    """The decimal sign of the numbers that are read; None where no number has one."""
    cells = [
        (row[i], line)
        for role, i in roles.index.items()
        if role in NUMBER_ROLES
        for row, line in zip(text.rows, text.lines, strict=True)
        if _WITH_SIGN.search(row[i])
    ]
    commas = [(cell, line) for cell, line in cells if "," in cell]
    points = [(cell, line) for cell, line in cells if "." in cell]
    _refuse_thousands(text, cells)
    if options.decimal is not None:
        sign = {"comma": ",", "point": "."}.get(options.decimal)
        if sign is None:
            raise text.file.error(f"the decimal sign '{options.decimal}' is not comma or point")
        return sign
    if commas and points:
        raise text.file.error(
            f"'{commas[0][0]}' has a comma and '{points[0][0]}' (line {points[0][1]}) a point: "
            "which is the decimal sign? Give it, or remove the separators of thousands",
            commas[0][1],
            inputs=("decimal",),
        )
    if commas and all(_GROUPED.fullmatch(cell) for cell, _ in commas) and not _has_decimals(text):
        raise text.file.error(
            f"'{commas[0][0]}' can be a number with three decimals or with thousands; give the "
            "decimal sign",
            commas[0][1],
            inputs=("decimal",),
        )
    return "," if commas else "." if points else None


def _has_decimals(text: TextTable) -> bool:
    """Whether a comma in any column groups no thousands: 0,005 or 1,25."""
    cells = (cell for row in text.rows for cell in row if "," in cell)
    return any(_DECIMALS.fullmatch(cell) and not _GROUPED.fullmatch(cell) for cell in cells)


_DECIMALS = re.compile(r"[-+−]?\d+,\d+")
_ONE_SIGN = re.compile(r"[-+0-9]*[.,]?[0-9]*")
"""Most numbers: without separators of thousands."""


def _refuse_thousands(text: TextTable, cells: Sequence[tuple[str, int]]) -> None:
    for cell, line in cells:
        if _ONE_SIGN.fullmatch(cell):
            continue
        signs = re.sub(r"[^.,'’\s]", "", cell)
        if len(signs) > 1 and re.fullmatch(r"[-+−\d.,'’\s]+", cell):
            raise text.file.error(
                f"'{cell}' has separators of thousands; save the table without them", line
            )


def refuse_control_characters(table: CsvTable) -> None:
    """A label goes to pages, programs and logs: one line of visible characters."""
    for role in TEXT_ROLES:
        for word, line in zip(table.columns.get(role, ()), table.lines, strict=False):
            if word.isprintable():
                continue
            raise InputError(
                f"the {role} {word!r} contains a control character or a line break; remove it",
                path=table.path,
                line=line,
            )


def _sentence(text: TextTable, roles: ColumnRoles, unit: _Unit | None, decimal: str | None) -> str:
    """What was understood, in one line."""
    parts = []
    if text.file.ending != ".parquet":
        name = SEPARATORS.get(text.separator, f"'{text.separator}'")
        parts.append(f"separator {name}")
    if decimal is not None:
        parts.append("decimal comma" if decimal == "," else "decimal point")
    if text.encoding != "UTF-8":
        parts.append(text.encoding)
    if text.names is None:
        parts.append("no header")
    if unit is not None:
        known = unit.name != NO_UNIT
        parts.append(f"{unit.name} ({unit.why})" if known else "unit of length not given")
    shown = [role for role in ROLES if role in roles.index and role != "label"]
    parts.append(" ".join(f"{role}={_shown(text, roles, role)}" for role in shown))
    if "feed" in roles.index and "feed" not in roles.units:
        parts.append(f"feed in {_feed_unit(roles, unit)} (not given)")
    if "label" in roles.index:
        parts.append(f"label={_shown(text, roles, 'label')}")
    elif set(POSITION_ROLES) <= set(roles.index):
        parts.append("no labels: numbered")
    times = row_times(text, roles.used)
    if times.first is not None:
        parts.append(str(times))
    rest = [text.title(i) for i in _other_columns(text, roles) if i not in times.columns]
    if rest:
        parts.append(f"not read: {', '.join(rest[:8])}{' …' if len(rest) > 8 else ''}")
    if text.preamble:
        parts.append(f"not read: {_line_names([n for n, _ in text.preamble])} before the table")
    if text.disabled:
        parts.append(f"comments, though they look like rows: {_line_names(text.disabled)}")
    return ", ".join(parts)


def _other_columns(text: TextTable, roles: ColumnRoles) -> list[int]:
    """Columns that are not read, and not empty."""
    others = [i for i in range(text.width) if i not in roles.used]
    return [i for i in others if any(text.column(i)) or text.title(i) != f"column {i + 1}"]


def _line_names(lines: Sequence[int]) -> str:
    if len(lines) > 1 and lines[-1] - lines[0] == len(lines) - 1:
        return f"lines {lines[0]}–{lines[-1]}"
    shown = ", ".join(map(str, lines[:8]))
    return f"line{'s' if len(lines) > 1 else ''} {shown}{' …' if len(lines) > 8 else ''}"


def _shown(text: TextTable, roles: ColumnRoles, role: str) -> str:
    index = roles.index[role]
    sign = "-" if math.copysign(1.0, roles.sign.get(role, 1.0)) < 0.0 else ""
    places = (index, *roles.also.get(role, ()))
    return sign + "+".join(str(i + 1) if text.names is None else text.title(i) for i in places)
