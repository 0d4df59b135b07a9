"""What columns and comments of a table state of its touches, where it contradicts the job."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence

from pretravel.files.column_names import LENGTH_UNITS, unit_of, unit_of_title
from pretravel.files.file_format import ReadingOptions
from pretravel.files.logs.refused_formats import names_a_centre
from pretravel.files.roles_of_columns import ColumnRoles
from pretravel.files.row_statements import changes_rows, refuse_compensated
from pretravel.files.source_file import SourceFile, shortened
from pretravel.files.text_table import TextTable

_CONTACT = {
    "contact", "triggered", "trigger", "trig", "tripped", "trip", "touched", "success", "kontakt",
    "ausgelöst", "hit", "probed", "detected", "latched", "signal", "5070", "ac_mea", "angetastet",
    "getastet", "contatto", "contacto", "détecté", "touché",
}  # fmt: skip
"""Titles, or words of titles, of columns of yes and no."""
_MISSED = {"miss", "missed"}
_GOOD = {"valid", "used", "use", "include", "included", "keep", "gültig", "gueltig"}
_BAD = {
    "invalid", "outlier", "ausreißer", "ausreisser", "exclude", "excluded", "ignore", "ignored",
    "skip", "skipped", "error", "alarm", "fault", "ungültig",
}  # fmt: skip
"""Titles of columns of yes and no that say which rows count, and cells of a status. Words of a
verdict about the part (ok, bad, reject) are not among them."""
_STATUS = {
    *_CONTACT, "status", "state", "result", "probestatus", "probe status", "ergebnis", "état",
    "etat", "statut", "estado", "stato",
}  # fmt: skip
_YES = {"1", "true", "yes", "y", "ja", "oui", "si", "sí", "x"}
_NO = {"0", "false", "no", "n", "nein", "non", "-1", ""}
_CODES = {"error", "err", "alarm", "fault", "errorcode", "fehler", "fehlercode", "code"}
_WHOLE = re.compile(r"^(-?\d)\.0*$")
_CODE = re.compile(r"-?[0-9]{1,4}")
"""Titles of columns in which 0 says that all went well, and their cells."""
_OF_PROBE = {"probe", "probing", "touch", "trigger", "sensor", "taster", "antastung"}
"""With one of these in its title, a status is that of the touch and no verdict about the part."""
_FAILED = {"failed", "fail", "failure", "error", "timeout", "nok", "fehler"}
_MISSES = re.compile(
    r"\b(?:no|not|non|nicht|keine?|without|ohne|sans|sin|nessun|didn.?t)\s(?:\w+\s)?(?:contact|hit|"
    r"touch(?:ed)?|trigger(?:ed)?|trip(?:ped)?|signal|found|probed|measured|kontakt|angetastet|"
    r"ausgelöst|ausgeloest|contacto|contatto)\b|\bmiss(?:ed)?\b|\bin (?:the )?air\b|"
    r"\b(?:end of (?:travel|move)|time ?out|over-?travel|verfehlt|manqué|fallido|mancato)\b|"
    r"^(?:air|luft|raté|rate|limit)$",
    re.IGNORECASE,
)
"""Words of a status or a note that say that there was no contact."""
_NOTES = {
    "comment", "comments", "remark", "remarks", "note", "notes", "bemerkung", "bemerkungen",
    "kommentar", "anmerkung", "commentaire", "remarque", "comentario", "nota", "info",
}  # fmt: skip
"""Titles of columns in which people write what happened."""
_UNIT = {
    "unit", "units", "einheit", "unit of length", "maßeinheit", "unité", "unite", "unidad",
    "unidades", "unità", "unita",
}  # fmt: skip
_ON = {
    *_YES, "on", "ein", "an", "active", "aktiv", "enabled", "links", "rechts", "left", "right",
    "g41", "g42", "compensated", "corrected", "kompensiert", "korrigiert",
}  # fmt: skip
_COMPENSATED = re.compile(
    r"(?:\w*radius|\w*tip|\w*ball|probe|cutter)?\W?(?:comp(?:\.|ensated|ensation)?|"
    r"corr(?:\.|ected|ection))|(?:radius|tasterradius|kugel)?(?:kompensation|korrektur|kompensiert|"
    r"korrigiert)|g4[012]|(?:correction|compensation) (?:de |du )?rayon|"
    r"compens(?:é|ado|ato)|corrig(?:é|ido)|corretto"
)
_OFF = {*_NO, "off", "none", "g40", "aus", "inactive", "inaktiv", "disabled"}
_TIP_CENTRES = re.compile(
    r"\b(?:tip|ball|probe|stylus|sphere|tastkugel|kugel)\W?(?:cent(?:er|re)s?|mittelpunkte?)\b|"
    r"\btip [xyz]\b|\b(?:not|un)\W?(?:radius\W?|tip\W?)?(?:compensated|corrected)\b|"
    r"\b(?:un|nicht )(?:kompensiert|korrigiert)|\bcomp(?:ensation|ensated)?\W+(?:is\W+)?"
    r"(?:off|no|none|false|0)\b|\bradiuskorrektur\W+(?:aus|nein|0)\b",
    re.IGNORECASE,
)
"""What says that a radius has still to be subtracted."""
_OF_TIP = r"(?:tip|stylus|(?:tip|probe|stylus)\W?ball|probe|tastkugel|taster(?:kugel)?)"
_OF_EITHER = r"(?:ball|kugel)"
"""The tip, or the sphere that it touches."""
_OF_REFERENCE = (
    r"(?:(?:reference|calibration|gauge|master|ref|cal|referenz|kalibrier|prüf|eich)\W?"
    r"(?:ball|kugel)|lehrring|einstellring|prüfring|calibrated|certified|"
    r"(?:(?:reference|calibration|gauge|master|ref|cal)\W?)?"
    r"(?:sphere|(?:ring|pin)(?:\W?(?:gauge|gage))?|reference|referenz\w*))"
)
_SIZE = r"\W{0,3}(?P<size>dia(?:meter)?|durchmesser|Ø|⌀|radius|d(?=\s?[=:]?\s?\d))"
_WITHOUT_SIZE = (
    r"(?:\s?[:=]\s?|\s)(?P<value>\d++(?:[.,]\d++)?)(?P<unit>\s?(?:mm|inch|\")|(?<=[.,]\d{3})|"
    r"(?<=[.,]\d{4}))(?!\w|\s?(?:deep|high|above|below|from|long|away|off|x|by)\b)"
)
"""A size in mm, or with the decimals of a certificate: tip 4 mm, sphere: 24.9987."""
_VALUE = r"\W{0,3}(?P<value>\d+(?:[.,]\d+)?)\s*(?P<unit>mm|in(?:ch)?\b|\")?"
_RESULT_OF_FIT = r"\b(?:fit\w*|best|results?|ausgleich\w*|measured|gemessen\w*)\b"
"""The diameter of a sphere through tip centres is none of the reference."""
_SMALLEST_SIZE = 0.5
"""Below this a number can be a deviation. [mm]"""
_LARGEST_DIFFERENCE = 0.18
"""Of two diameters of one tip or reference: of an effective and a nominal one, twice the largest
pretravel, 80 µm, and their tolerances. [mm]"""


def refuse_contradictions(
    text: TextTable, roles: ColumnRoles, options: ReadingOptions, unit: str
) -> None:
    """Refuse a table that states another thing of its touches than the user.

    Parameters
    ----------
    text : TextTable
    roles : ColumnRoles
    options : ReadingOptions
    unit : str
        Unit of length in which the table is read.

    Raises
    ------
    InputError
        Rows without contact, in another unit or of positions that were compensated; another
        diameter of the tip or of the reference. With the line.
    """
    _refuse_misses(text, roles)
    refuse_other_units(text, roles.used, unit)
    if options.of_surface:
        _refuse_tip_centres(text, roles)
    else:
        _refuse_compensated(text, roles)
        for line, words in (*text.around, *text.among):
            refuse_compensated(text.file, words, line)
    if options.tip_radius is not None:
        for line, where, diameter in _diameters(text, _OF_TIP, unit, options.tip):
            refuse_other_tip(text.file, diameter, 2.0 * options.tip_radius, where, line)
    given = options.reference_diameter
    if given is not None:
        for line, where, diameter in _diameters(text, _OF_REFERENCE, unit, options.tip):
            _refuse_other(text.file, "reference", diameter, given, where, line, ("diameter",))
    if options.tip_radius is not None:
        tip = 2.0 * options.tip_radius
        for line, where, diameter in _diameters(text, _OF_EITHER, unit, options.tip):
            if given is None or abs(diameter - given) > _LARGEST_DIFFERENCE:
                _refuse_other_ball(text.file, diameter, tip, given, where, line)


def tip_not_used(text: TextTable, unit: str) -> tuple[str, ...]:
    """A sentence about a diameter of the tip that a table states, and the user does not.

    Parameters
    ----------
    text : TextTable
    unit : str
        Unit of length in which the table is read.
    """
    found = next(_diameters(text, _OF_TIP, unit, None), None)
    if found is None:
        return ()
    line, where, diameter = found
    said = f"{where} gives the tip a diameter of {diameter:.6g} mm (line {line}), which is not used"
    return (f"{said}: give it, if these are tip centres",)


def size_of_features(
    text: TextTable, used: Collection[int], unit: str, tip_radius: float | None
) -> tuple[str, ...]:
    """A sentence about a column of radii or diameters that are not those of the tip.

    Parameters
    ----------
    text : TextTable
    used : collection of int
        Columns that have another meaning.
    unit : str
        Unit of length in which the table is read.
    tip_radius : float or None
        [mm]
    """
    round_ones = all(names_a_centre(row[0]) for row in text.rows)
    for i, title in _other_columns(text, used):
        times = {"radius": 1.0}.get(title)
        times = {"r": 1.0, "d": 2.0}.get(title, times) if round_ones else times
        sizes = [_number(cell) for cell in text.column(i)]
        known = [LENGTH_UNITS.get(unit, 1.0) * size for size in sizes if size is not None]
        if tip_radius is None or times is None or len(known) < len(sizes):
            continue
        low, high, own = min(known), max(known), times * tip_radius
        if low >= _SMALLEST_SIZE and not low - _LARGEST_DIFFERENCE <= own <= high:
            what = "radius" if times == 1.0 else "diameter"
            span = f"{low:.6g}" if high == low else f"{low:.6g} to {high:.6g}"
            said = f"{text.title(i)} is {span} mm, and the tip's {what} is {own:.6g} mm"
            return (f"{said}: are the rows circles or other features? They are not touches",)
    return ()


def refuse_other_tip(
    file: SourceFile, stated: float, used: float, where: str = "the file", line: int | None = None
) -> None:
    """Refuse a file that gives the tip another diameter than the one that is used. [mm]"""
    _refuse_other(file, "tip", stated, used, where, line, ("map_file", "tip_diameter"))


_IN_NAME = re.compile(
    r"(?:(?:tip|ball|ruby|rubin|kugel|taster|stylus|probe)[\s_-]*+)?[dØ⌀]?\s*+(?P<mm>\d++(?:[.,]\d++)?)"
    r"\s?mm(?:[\s_-]*+(?:tip|ball|ruby|rubin|kugel|taster|stylus|probe))?|"
    r"[a-z_]*+(?P<by>\d++(?:[.,]\d++)?)BY\d.*",
    re.IGNORECASE,
)
"""A name that gives the diameter of a tip: 4 mm, TIP_1MM, 2BY50MM."""


def refuse_tips_by_name(file: SourceFile, names: Sequence[str], diameter: float) -> None:
    """Refuse a tip whose name gives it another diameter than the one that is used. [mm]"""
    for name in dict.fromkeys(names):
        found = _IN_NAME.fullmatch(name.strip())
        if found is not None:
            stated = float((found["mm"] or found["by"]).replace(",", "."))
            refuse_other_tip(file, stated, diameter, f"its name, {name},")


def _refuse_other(
    file: SourceFile,
    what: str,
    stated: float,
    used: float,
    where: str,
    line: int | None,
    inputs: tuple[str, ...],
) -> None:
    if abs(stated - used) > _LARGEST_DIFFERENCE:
        raise file.error(
            f"{where} gives the {what} a diameter of {stated:.6g} mm, and {used:.6g} mm is used: "
            "one of them is wrong",
            line,
            inputs=inputs,
        )


def _refuse_other_ball(
    file: SourceFile, stated: float, tip: float, reference: float | None, where: str, line: int
) -> None:
    """Refuse a ball that is neither the tip nor the sphere that it touches. [mm]"""
    if abs(stated - tip) > _LARGEST_DIFFERENCE:
        sphere = "" if reference is None else f" nor the reference of {reference:.6g} mm"
        raise file.error(
            f"{where} gives a ball a diameter of {stated:.6g} mm: it is "
            f"{'neither' if sphere else 'not'} the tip of {tip:.6g} mm{sphere}. Correct the one "
            "that is wrong, or name in the file what the ball is (tip diameter, sphere diameter)",
            line,
            inputs=("diameter", "tip_diameter", "map_file"),
        )


def _diameters(
    text: TextTable, words: str, unit: str, tip: str | None
) -> Iterator[tuple[int, str, float]]:
    """Line, place and value of each diameter that a column or a comment gives. [mm]"""
    factor = LENGTH_UNITS.get(unit, 1.0)
    for i, title in enumerate(text.names or ()):
        named = re.match(rf"{words}{_SIZE}", title.replace("_", " "), re.IGNORECASE)
        if named is None:
            continue
        cells = [*dict.fromkeys(text.column(i))]
        if len(cells) > 1 and words != _OF_REFERENCE:  # of several tips one is chosen by its name
            cells = [cell for cell in cells if cell == tip]
        own = LENGTH_UNITS.get(unit_of_title(title) or "", factor)
        for cell in cells:
            number = _number(cell)
            if number is not None:
                line = text.lines[text.column(i).index(cell)]
                yield line, title, own * number * _diameters_in(named)
    for line, comment in text.around:
        if line > text.lines[0] or re.search(_RESULT_OF_FIT, comment, re.IGNORECASE):
            continue
        sized = re.search(rf"\b{words}{_SIZE}{_VALUE}", comment, re.IGNORECASE)
        found = sized or re.search(rf"\b{words}{_WITHOUT_SIZE}", comment, re.IGNORECASE)
        if found is not None:
            own = LENGTH_UNITS.get(unit_of(found["unit"] or "") or "", factor)
            value = float(found["value"].replace(",", "."))
            yield line, "this line", own * value * (_diameters_in(sized) if sized else 1.0)


def _diameters_in(named: re.Match[str]) -> float:
    return 2.0 if named["size"].lower() == "radius" else 1.0


def _number(cell: str) -> float | None:
    try:
        return None if "_" in cell else float(cell.replace(",", "."))
    except ValueError:
        return None


def _refuse_compensated(text: TextTable, roles: ColumnRoles) -> None:
    """Refuse rows that state in a column of their own that they are compensated."""
    for i, name in _other_columns(text, roles.used):
        cells = text.column(i)
        rows = [row for row, cell in enumerate(cells) if cell.strip().lower() in _ON]
        if rows and _COMPENSATED.fullmatch(name.replace("_", " ")):
            raise text.file.error(
                f"{text.title(i)} is '{cells[rows[0]]}' in this row: a position that the control "
                "or the CMM compensated. The centre of the tip at the trigger is needed",
                text.lines[rows[0]],
            )


def _refuse_tip_centres(text: TextTable, roles: ColumnRoles) -> None:
    """Refuse points of the surface of which the file says that they are tip centres."""
    stated = [*text.around, (text.header_line or text.lines[0], " ".join(text.names or ()))]
    found = [(line, words) for line, words in stated if _TIP_CENTRES.search(words)]
    for i, name in _other_columns(text, roles.used):
        off = [row for row, cell in enumerate(text.column(i)) if cell.strip().lower() in _OFF]
        if off and _COMPENSATED.fullmatch(name.replace("_", " ")):
            found.append((text.lines[off[0]], f"{text.title(i)} {text.column(i)[off[0]]}"))
    for line, words in found:
        raise text.file.error(
            f"'{shortened(words)}': these are tip centres, not points of the surface. Give the "
            "tip's diameter",
            line,
            inputs=("tip_diameter",),
        )


def marked_rows(text: TextTable, used: Collection[int]) -> Iterator[tuple[int, list[int]]]:
    """Columns that mark rows as misses or as left out, and these rows.

    Parameters
    ----------
    text : TextTable
    used : collection of int
        Columns that have another meaning.

    Raises
    ------
    InputError
        A note in a row may change the meaning of the rows after it.
    """
    for i, name in _other_columns(text, used):
        cells = [_WHOLE.sub(r"\1", cell.strip().lower()) for cell in text.column(i)]
        words = {*re.findall(r"\w+", name), *name.split("_"), name}
        if words & _NOTES:
            _refuse_changing_notes(text, i)
        no = _words_of_misses(words, name, {*cells})
        if missed := [row for row, cell in enumerate(cells) if cell in no]:
            yield i, missed


def _refuse_misses(text: TextTable, roles: ColumnRoles) -> None:
    """Refuse rows that state in a column of their own that they are not contacts."""
    for i, missed in marked_rows(text, roles.used):
        cell = text.column(i)[missed[0]]
        words = {*re.findall(r"\w+", text.title(i).lower())}
        rows = "this row" if len(missed) == 1 else f"this row, and in {len(missed) - 1} more"
        marked = words & {*_GOOD, *_BAD, *_CODES} or cell.strip().lower() in _BAD
        why = "the file itself marks it" if marked else "a touch without contact is not a point"
        raise text.file.error(
            f"{text.title(i)} is '{cell}' in {rows}: {why}; exclude the line",
            text.lines[missed[0]],
            inputs=("exclude",),
        )


def _words_of_misses(words: set[str], name: str, cells: set[str]) -> set[str]:
    """Which of a column's cells say that there was no contact, by the words of its title."""
    of_touch = bool(words & _OF_PROBE and words & {*_STATUS, "ok"})
    no = set[str]()
    if words & (_STATUS | _NOTES):
        no = {cell for cell in cells if cell in _BAD or _MISSES.search(cell)}
    if of_touch:
        no |= _FAILED
    if words & _CODES and all(map(_CODE.fullmatch, cells)) and "0" in cells:
        no |= cells - {"0"}
    if cells <= _YES | _NO and cells != {""}:
        no |= _NO if of_touch or words & _CONTACT or name in _GOOD else set()
        no |= _YES if words & _MISSED or name in _BAD else set()
    return no


def _refuse_changing_notes(text: TextTable, column: int) -> None:
    """Refuse a note in a row that may change the meaning of the rows after it."""
    cells = text.column(column)
    for cell, line in zip(cells[1:], text.lines[1:], strict=True):
        if not _MISSES.search(cell) and changes_rows(cell) and len({*cells}) > 1:
            raise text.file.error(
                f"{text.title(column)} is '{shortened(cell)}' in this row, which may change the "
                "meaning of the rows after it: split the table there, or leave the note out",
                line,
            )


def unit_of_rows(text: TextTable, used: Collection[int]) -> str | None:
    """Unit of length that a column states for the first row; None where there is no such column.

    Columns that are `used` have another meaning.
    """
    found = [unit_of(text.column(i)[0]) for i, name in _other_columns(text, used) if name in _UNIT]
    return next((unit for unit in found if unit in LENGTH_UNITS), None)


def refuse_other_units(text: TextTable, used: Collection[int], unit: str) -> None:
    """Refuse rows that state another unit of length than the one in which the table is read.

    Parameters
    ----------
    text : TextTable
    used : collection of int
        Columns that have another meaning.
    unit : str

    Raises
    ------
    InputError
    """
    for i, name in _other_columns(text, used):
        units = [unit_of(cell) for cell in text.column(i)] if name in _UNIT else []
        for row, stated in enumerate(units):
            if stated in LENGTH_UNITS and unit in LENGTH_UNITS and stated != unit:
                raise text.file.error(
                    f"{text.title(i)} is '{text.column(i)[row]}' in this row, and the table is "
                    f"read in {unit}",
                    text.lines[row],
                    inputs=("units",),
                )


def _other_columns(text: TextTable, used: Collection[int]) -> Iterator[tuple[int, str]]:
    """Index and lower-case name of each column that has no role."""
    for i, title in enumerate(text.names or ()):
        if i not in used:
            yield i, title.strip().lower()
