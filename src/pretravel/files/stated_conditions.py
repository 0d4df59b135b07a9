"""What columns and comments of a table state of its touches, where it contradicts the job."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from pretravel.files.column_names import LENGTH_UNITS, unit_of, unit_of_title
from pretravel.files.file_format import ReadingOptions
from pretravel.files.roles_of_columns import ColumnRoles
from pretravel.files.row_statements import changes_rows
from pretravel.files.source_file import SourceFile, shortened
from pretravel.files.text_table import TextTable

_CONTACT = {
    "contact", "triggered", "touched", "success", "kontakt", "ausgelöst", "hit", "probed",
    "detected",
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
_YES = {"1", "true", "yes", "y", "ja"}
_NO = {"0", "false", "no", "n", "nein"}
_CODES = {"error", "err", "alarm", "fault", "errorcode", "fehler", "fehlercode", "code"}
_CODE = re.compile(r"[0-9]{1,4}")
"""Titles of columns in which 0 says that all went well, and their cells."""
_OF_PROBE = {"probe", "probing", "touch", "trigger", "sensor", "taster", "antastung"}
"""With one of these in its title, a status is that of the touch and no verdict about the part."""
_FAILED = {"failed", "fail", "failure", "error", "timeout", "nok", "fehler"}
_MISSES = {
    "miss", "missed", "no contact", "not triggered", "no trigger", "kein kontakt", "verfehlt",
    "nicht angetastet", "raté", "rate", "manqué", "sin contacto", "fallido", "mancato",
    "nessun contatto", "no touch", "not found", "not probed", "not measured",
}  # fmt: skip
_NOTES = {
    "comment", "comments", "remark", "remarks", "note", "notes", "bemerkung", "bemerkungen",
    "kommentar", "anmerkung", "commentaire", "remarque", "comentario", "nota", "info",
}  # fmt: skip
"""Titles of columns in which people write what happened."""
_UNIT = {
    "unit", "units", "einheit", "unit of length", "maßeinheit", "unité", "unite", "unidad",
    "unidades", "unità", "unita",
}  # fmt: skip
_ON = {*_YES, "on", "g41", "g42"}
_COMPENSATED = re.compile(
    r"(?:\w*radius|\w*tip|\w*ball|probe|cutter)?\W?(?:comp(?:\.|ensated|ensation)?|"
    r"corr(?:\.|ected|ection))|kompensiert|radiuskorrektur|korrigiert"
)
_COMPENSATED_BEFORE = re.compile(
    r"\b(?:radius|tip|ball|probe|cutter)\W?(?:radius\W?)?(?:comp(?:\.|ensat(?:ion|ed))?|correct(?:ion|"
    r"ed))\W*(?:is\b|was\b)?\W*(?:on|yes|true|1|active|ja|ein|G4[12])\b|"
    r"\b(?:radiuskorrektur|G4[12])\W*(?:on|ein|ja|1|aktiv)\b|"
    r"^\W*(?:(?:probe|tip|ball|radius)\W)?(?:compensated|kompensierte)\W(?:points?|positions?|"
    r"coordinates?|data|punkte)\b",
    re.IGNORECASE,
)
"""A line before the rows that says that the radius is subtracted already."""
_OFF = {*_NO, "off", "none", "g40", "aus"}
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
    r"(?:(?:reference|calibration|gauge|ref|cal|referenz|kalibrier|prüf|eich)\W?(?:ball|kugel)|"
    r"(?:(?:reference|calibration|gauge|ref|cal)\W?)?(?:sphere|ring|reference|referenz\w*))"
)
_SIZE = r"\W{0,3}(?P<size>dia(?:meter)?|durchmesser|Ø|⌀|radius)"
_VALUE = r"\W{0,3}(?P<value>\d+(?:[.,]\d+)?)\s*(?P<unit>mm|in(?:ch)?\b|\")?"
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
    _refuse_other_units(text, roles, unit)
    if options.of_surface:
        _refuse_tip_centres(text, roles)
    else:
        _refuse_compensated(text, roles)
        _refuse_compensated_before(text)
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
    """A sentence about a diameter of the tip that points of a surface state.

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
    for line, comment in text.before:
        found = re.search(rf"\b{words}{_SIZE}{_VALUE}", comment, re.IGNORECASE)
        if found is not None:
            own = LENGTH_UNITS.get(unit_of(found["unit"] or "") or "", factor)
            value = float(found["value"].replace(",", "."))
            yield line, "this line", own * value * _diameters_in(found)


def _diameters_in(named: re.Match[str]) -> float:
    return 2.0 if named["size"].lower() == "radius" else 1.0


def _number(cell: str) -> float | None:
    try:
        return None if "_" in cell else float(cell.replace(",", "."))
    except ValueError:
        return None


def _refuse_compensated(text: TextTable, roles: ColumnRoles) -> None:
    """Refuse rows that state in a column of their own that they are compensated."""
    for i, name in _other_columns(text, roles):
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
    stated = [*text.before, (text.header_line or text.lines[0], " ".join(text.names or ()))]
    found = [(line, words) for line, words in stated if _TIP_CENTRES.search(words)]
    for i, name in _other_columns(text, roles):
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


def _refuse_compensated_before(text: TextTable) -> None:
    """Refuse rows of which a line before them says that they are compensated."""
    for line, words in text.before:
        if _COMPENSATED_BEFORE.search(words):
            raise text.file.error(
                f"'{shortened(words)}': positions that the control or the CMM compensated. The "
                "centre of the tip at the trigger is needed. If they are tip centres, leave this "
                "line out",
                line,
            )


def _refuse_misses(text: TextTable, roles: ColumnRoles) -> None:
    """Refuse rows that state in a column of their own that they are not contacts."""
    for i, name in _other_columns(text, roles):
        cells = [cell.strip().lower() for cell in text.column(i)]
        words = {*re.findall(r"\w+", name), name}
        if words & _NOTES:
            _refuse_changing_notes(text, i)
        no = {*_MISSES, *_BAD} if words & (_STATUS | _NOTES) else set()
        if words & _STATUS and words & _OF_PROBE:
            no |= _FAILED
        if words & _CODES and all(map(_CODE.fullmatch, cells)) and "0" in cells:
            no |= {*cells} - {"0"}
        if set(cells) <= _YES | _NO:
            no |= _NO if words & _CONTACT or name in _GOOD else set()
            no |= _YES if words & _MISSED or name in _BAD else set()
        missed = [row for row, cell in enumerate(cells) if cell in no]
        if missed:
            rows = "this row" if len(missed) == 1 else f"this row, and in {len(missed) - 1} more"
            marked = words & {*_GOOD, *_BAD, *_CODES} or cells[missed[0]] in _BAD
            why = "the file itself marks it" if marked else "a touch without contact is not a point"
            raise text.file.error(
                f"{text.title(i)} is '{text.column(i)[missed[0]]}' in {rows}: {why}; exclude the "
                "line",
                text.lines[missed[0]],
                inputs=("exclude",),
            )


def _refuse_changing_notes(text: TextTable, column: int) -> None:
    """Refuse a note in a row that may change the meaning of the rows after it."""
    cells = text.column(column)
    for cell, line in zip(cells[1:], text.lines[1:], strict=True):
        if cell.strip().lower() not in _MISSES and changes_rows(cell) and len({*cells}) > 1:
            raise text.file.error(
                f"{text.title(column)} is '{shortened(cell)}' in this row, which may change the "
                "meaning of the rows after it: split the table there, or leave the note out",
                line,
            )


def unit_of_rows(text: TextTable, roles: ColumnRoles) -> str | None:
    """Unit of length that a column states for the first row; None where there is no such column."""
    found = [unit_of(text.column(i)[0]) for i, name in _other_columns(text, roles) if name in _UNIT]
    return next((unit for unit in found if unit in LENGTH_UNITS), None)


def _refuse_other_units(text: TextTable, roles: ColumnRoles, unit: str) -> None:
    """Refuse rows that state another unit of length than the one in which the table is read."""
    for i, name in _other_columns(text, roles):
        units = [unit_of(cell) for cell in text.column(i)] if name in _UNIT else []
        for row, stated in enumerate(units):
            if stated in LENGTH_UNITS and unit in LENGTH_UNITS and stated != unit:
                raise text.file.error(
                    f"{text.title(i)} is '{text.column(i)[row]}' in this row, and the table is "
                    f"read in {unit}",
                    text.lines[row],
                    inputs=("units",),
                )


def _other_columns(text: TextTable, roles: ColumnRoles) -> Iterator[tuple[int, str]]:
    """Index and lower-case name of each column that has no role."""
    for i, title in enumerate(text.names or ()):
        if i not in roles.used:
            yield i, title.strip().lower()
