"""Names of the columns of tables of touches: what each means, in the words that shops use."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from pretravel.base import DEGREE

POSITION_ROLES = ("x", "y", "z")
NORMAL_ROLES = ("nx", "ny", "nz")
APPROACH_ROLES = ("ax", "ay", "az")
NOMINAL_ROLES = ("nominal_x", "nominal_y", "nominal_z")
LENGTH_ROLES = (*POSITION_ROLES, *NOMINAL_ROLES)
ROTARY_ROLES = ("a", "b", "c")
"""Angles of rotary axes: rows in which they differ have different coordinates."""
NUMBER_ROLES = (
    *POSITION_ROLES, *NORMAL_ROLES, *APPROACH_ROLES, *NOMINAL_ROLES, "feed", "spindle",
    *ROTARY_ROLES,
)  # fmt: skip
TEXT_ROLES = ("reference", "tip", "part", "pass", "orientation", "label")
"""Of columns that are words, not numbers."""
FRAME_ROLE = "frame"
"""Of a column of coordinate systems, which must be one."""
ROLES = (*NUMBER_ROLES, *TEXT_ROLES, FRAME_ROLE)
"""What a column of a table of touches can be."""

OWN_NAMES = {role: f"{role}_mm" for role in LENGTH_ROLES} | {
    "feed": "feed_mm_min",
    "spindle": "spindle_deg",
    **{role: f"{role}_deg" for role in ROTARY_ROLES},
}
"""Names of columns with a unit, in written tables. Other columns are called as their role."""

LENGTH_UNITS = {"mm": 1.0, "inch": 25.4, "µm": 1e-3, "cm": 10.0, "m": 1e3, "thou": 0.0254}
"""Millimetres in the units of length that a column can state."""
FEED_UNITS = {"mm/min": 1.0, "inch/min": 25.4, "mm/s": 60.0, "m/min": 1e3, "inch/s": 1524.0}
"""Millimetres per minute in the units that a column of feeds can state."""
ANGLE_UNITS = {"deg": DEGREE, "rad": 1.0}
"""Radians in the units that a column of angles can state."""

_UNIT_WORDS = {
    "mm": "mm millimeter millimeters millimetre millimetres milimetros",
    "inch": "in inch inches zoll \" '' pouce pouces pulgada pulgadas pollici",
    "µm": "um µm μm mikrometer micron microns micrometer micrometre 1/1000mm 0.001mm 0,001mm",
    "thou": "thou mil mils 0.001in 0.001inch",
    "cm": "cm",
    "m": "m meter metre",
    "mm/min": "mm/min mm_min mmpm mm/minute",
    "inch/min": "in/min inch/min in_min inch_min ipm",
    "inch/s": "in/s inch/s ips",
    "mm/s": "mm/s mm_s mm/sec",
    "m/min": "m/min m_min",
    "deg": "deg ° degree degrees",
    "rad": "rad radian radians",
    "1": "1 - –",
}
_UNITS = {word: unit for unit, words in _UNIT_WORDS.items() for word in words.split()}

_POSITION_WORDS = (
    "pos", "position", "coord", "coordinate", "koordinate", "coordonnee", "coordenada",
    "coordinata", "ist", "istwert", "istmass", "act", "actual", "meas", "measured", "mess",
    "messwert", "gemessen", "mesure", "mesuree", "mesura", "medido", "medida", "misurato",
    "mes", "mis", "misurata", "rilevato", "effettivo", "real", "reel", "effektiv",
    "observed", "probed", "centro", "mittelpunkt", "value", "wert", "center", "centre", "tip",
    "tipcenter", "tipcentre", "ballcenter", "ballcentre", "probecenter", "kugelmittelpunkt",
    "point", "punkt", "pt", "p", "abs", "axis", "achse", "axe", "trig", "trigger", "skip", "latch",
    "latched", "mpos", "wpos", "work", "mach", "machine", "mcs", "wcs", "dro", "quota", "cota",
    "cote", "gemeten", "zmierzone", "zmierzona", "namerene", "uppmatt", "malt",
)  # fmt: skip
_MEASURED_WORDS = ("act", "actual", "meas", "measured", "ist", "istwert", "mesure", "medido")
"""Of these, such that a vector can have; that of a tip or an axis is no normal."""
_OTHER_SCRIPTS = {
    "坐标": "pos", "座標": "pos", "测量": "meas", "測定": "meas", "实测": "act", "実測": "act",
    "实际": "act", "标称": "nom", "公称": "nom", "理论": "theo", "設計": "nom", "设计": "nom",
    "目标": "target", "法向": "normal", "法线": "normal", "法線": "normal", "法矢": "normal",
    "值": "", "値": "", "序号": "nr", "番号": "nr", "点号": "ptno", "名称": "name", "测头": "probe",
    "零件": "part", "координата": "pos", "факт": "act", "изм": "meas", "номинал": "nom",
    "ном": "nom", "нормаль": "normal", "точка": "point", "µ": "u", "μ": "u",
    "ø": "dia", "Ø": "dia", "⌀": "dia",
}  # fmt: skip
"""Words of titles in other scripts; longer ones come before those that begin them."""
_NOMINAL_WORDS = (
    "nominal", "nom", "soll", "sollwert", "sollmass", "theo", "theoretical", "theorique",
    "teorico", "teorica", "theor", "nominale", "nominell", "ref", "reference",
    "nominellt", "target", "design", "cad", "expected", "programmed", "basic", "set", "setpoint",
    "nominaal", "nominalne", "nominalna", "nominalni", "jmenovite",
)  # fmt: skip
_NORMAL_WORDS = (
    "n", "norm", "normal", "normale", "normals", "normalvector", "normalvektor", "vector",
    "vektor", "vecteur", "vec", "nvec",
)  # fmt: skip
_APPROACH_WORDS = ("a", "approach", "anfahrt", "antastrichtung", "approche")
_FEED_WORDS = (
    "feed", "feedrate", "f", "vorschub", "vorschubf", "antastvorschub", "messvorschub",
    "probefeed", "measuringfeed", "avance", "avanzamento", "feedspeed",
)  # fmt: skip
_SPINDLE_WORDS = (
    "spindleangle", "spindleorientation", "spindelwinkel", "spindelorientierung", "spindlec",
    "spindelc", "spindelstellung",
)  # fmt: skip
_REFERENCE_WORDS = ("reference", "referenz", "artefact", "artifact", "normalkorper", "etalon")
_TIP_WORDS = (
    "tip", "tipname", "tipid", "tipno", "tipnr", "tipnumber", "stylus", "stylusname", "stylusid",
    "stylusno", "stylusnr", "stylusnumber", "styli", "sensor", "sensorname", "sensorid", "sensorno",
    "sensornumber", "probe", "probename", "probeid", "probeno", "probenr", "probenumber",
    "probetip", "probestylus", "taster", "tastername", "tasternr", "tasternummer", "tasterkugel",
    "tastkugel", "tasterspitze", "taststift", "tastkopf",
    "messtaster", "palpeur", "palpador", "palpatore", "tastatore", "sensore", "sonda",
    "stylet", "punta", "stylusdia", "stylusdiameter", "stylusradius", "tipdia", "tipdiameter",
    "tipradius", "balldia", "balldiameter", "ballradius", "probedia", "probediameter",
    "proberadius", "tasterdurchmesser", "tasterradius", "kugeldurchmesser", "kugelradius",
    "tooldia", "tooldiameter", "toolradius", "werkzeugradius", "werkzeugdurchmesser",
    "tool", "toolname", "toolid", "toolno", "toolnr", "toolnumber", "werkzeug", "werkzeugnr",
    "werkzeugnummer", "herramienta", "outil", "utensile", "tno", "tnr", "tnum", "wkz", "wkznr",
    "wz", "wznr", "schneide", "schneidennr", "schneidennummer", "dno", "dnr", "dnum", "dnummer",
    "edge", "edgeno", "edgenumber", "cuttingedge", "cuttingedgeno", "tranchant", "filo",
    "tagliente", "spitze",
)  # fmt: skip
"""Of a control, its tool and the cutting edge of the tool: a stylus with two tips has two."""
_PART_WORDS = (
    "part", "partname", "partid", "partno", "partnr", "partnb", "partnum", "partnumber", "parts",
    "partserial", "partserialnumber", "planid", "serial", "serialno", "serialnr", "serialnumber",
    "sn", "ser", "sernumber", "teil", "teilnr", "teilenr", "teilnummer", "teilenummer", "teileid",
    "seriennr", "seriennummer", "werkstuck", "werkstucknr", "workpiece", "workpieceid",
    "workpieceno", "piece", "pieceno", "pieza", "pezzo", "numeropiece", "numerodeserie", "set",
    "setno", "setid", "series", "serie", "batch", "lot", "charge", "fixture", "spannung",
    "machine", "machineno", "machinename", "machineid", "maschine", "maschinennr",
    "setup", "setupno", "pallet", "palette", "nest", "cavity", "kavitat",
)  # fmt: skip
_PASS_WORDS = (
    "pass",
    "passno",
    "passnumber",
    "passage",
    "durchgang",
    "probingpass",
    "fastslow",
)
_COUNT_WORDS = (
    "run",
    "runno",
    "cycle",
    "cycleno",
    "lauf",
    "durchlauf",
    "zyklus",
    "op",
    "operation",
)
"""Series of rows, or a count of all rows."""
_FRAME_WORDS = (
    "wcs", "workoffset", "workcoordinatesystem", "csys", "coordsys", "coordinatesystem", "frame",
    "workpiececoordinatesystem", "nullpunkt", "zeropoint", "koordinatensystem", "offsetno",
    "gcodeoffset", "alignment", "alignmentname", "alignmentid", "tableangle", "rotarytable",
    "rotarytableangle", "tisch", "tischwinkel", "tischstellung", "drehtisch", "drehtischwinkel",
    "rundtisch", "w", "waxis", "waxe",
    "wachse", "uaxis", "vaxis", "quill", "pinole", "ram", "xoffset", "yoffset", "zoffset",
    "offsetx", "offsety", "offsetz", "scale", "scaling", "scalefactor", "masstab", "skalierung",
    "workplane", "ebenenwahl", "mirror", "spiegelung",
)  # fmt: skip
_ORIENTATION_WORDS = (
    "orientation",
    "headangle",
    "headangles",
    "heada",
    "headb",
    "probea",
    "probeb",
    "tipa",
    "tipb",
    "headposition",
    "probeorientation",
    "probeangle",
    "tipangle",
    "ausrichtung",
    "taststellung",
    "schwenkwinkel",
    "kopfstellung",
)
_THINGS = {
    "orientation": r"orientations?|(?:probe)?head|ausrichtung|schwenk\w*",
    "frame": r"wcs|g5[4-9]|zeropoint|nullpunkt\w*|csys|frame|alignment|(?:rotary)?table|"
    r"drehtisch\w*",
    "tip": r"tips?|styl(?:us|i|et)|sensor|probe|palp\w+|tastat\w+|sond[ae]|"
    r"(?:mess)?tast(?:er|kopf|kugel|system|stift)\w*|tool|werkzeug\w*|outil|utensile|herramienta",
    "pass": r"pass(?:es)?|durchgang|speed|velocity|geschwindigkeit|vitesse|velocidad|velocita",
    "part": r"parts?|serials?|serien\w*|teile?|teile?n\w*|werkstuck\w*|workpieces?|pieces?|"
    r"pieza|pezzo|batch|lot|charge|pallet|palette|fixture|setup|clamping|\w*spannung|cavity|nest|runs?|job|"
    r"toolpath",
}
"""Nouns in titles of several words, such as Stylus system, that say what a column groups."""
_QUANTITIES = re.compile(
    r"[xyzijkuf]|temp\w*|\w+temperatur\w*|force|\w*kraft|time|\w*zeit|date|feed|dev|deviation|err|error|counts?|counter|"
    r"volt\w*|signal|status|state|result|ok|hit|contact|trigger\w*|delay|wear|life|comment|note|tol|"
    r"tolerance|height|depth|dist|distance|offset|sigma|std|mean|min|max|range|travel|pretravel|"
    r"deflection|comp|compensation|point|punkt|path|feature|face|surface|element|merkmal|bore|hole|"
    r"value|wert|reading|output|input|level|raw|sequence|order",
)
"""Words of titles of something else, such as Probe temperature."""
_MOST_WORDS = 5
_MOST_GROUPS = 12
_OF_MULTI_STEP_PLAN = ("probe_index", "probe_azimuth_deg")
"""Of the form that `separation-plan` writes: directions of the probe, not its tips."""
GUESSED = 2
"""Rank of a name of which one word is known."""
_BY_CELLS = {
    "pass": re.compile(
        r"fast|slow|rapid|search|seek|fine|rough|coarse|measure|schnell|langsam|grob|fein|suchen|"
        r"messen|rapide|lent|lento",
        re.IGNORECASE,
    ),
    "frame": re.compile(r"G5[4-9](?:\.[1-9])?|G9[01]|G2[01]|G1[789]", re.IGNORECASE),
    "tip": re.compile(
        r"T\d+A-?\d+(?:\.\d+)?B-?\d+(?:\.\d+)?|T\d{1,8}[ _/.-]?D\d{1,2}", re.IGNORECASE
    ),
    "orientation": re.compile(r"A-?\d+(?:\.\d+)?[ _/]?B-?\d+(?:\.\d+)?", re.IGNORECASE),
}
"""Cells that say what their column groups, whatever it is called."""
_NUMBER_OF_ONE = re.compile(r"[\s_.:#-]*(?:\"[^\"]*\"|\d+)$")
"""What follows the noun of a cell: TOOL_3, T="BALL_3"."""
_NAMES_OF_TOUCHES = {"probe", "probing", "touch", "set", "run", "reference"}
"""Nouns that number touches, too."""
_ROTARY_WORDS = ("", "axis", "achse", "axe", "deg", "rot", "angle", "winkel")
_LABEL_WORDS = (
    "label", "name", "pointname", "punktname", "punktbezeichnung", "bezeichnung", "pointid",
    "punktid", "id", "point", "punkt", "messpunkt", "touch", "punto", "designation", "nom",
    "nombre", "nome", "feature", "featurename", "merkmal", "element", "pointno", "pointnr",
    "pointnumber", "punktnr", "punktnummer", "messpunktnr", "touchno", "numero", "nr", "no",
    "num", "number", "nummer", "lfdnr", "lfd", "index", "idx", "pt", "ptno", "ptid", "n", "#",
    "nr.",
)  # fmt: skip
"""The first of these is the label where a table has several."""
_LONGEST = 200
"""A longer text is neither the name of a column nor a unit."""
MOST_COLUMNS = 2000
"""A table of touches has fewer columns."""


@dataclass(frozen=True)
class ColumnName:
    """What the name of a column states.

    Attributes
    ----------
    title : str
        As in the file.
    role : str or None
        One of `ROLES`, where the name is known.
    unit : str or None
        One of `LENGTH_UNITS`, `FEED_UNITS` or `ANGLE_UNITS`, where the name states it.
    rank : int
        Where several columns have one role, the lowest is taken: 0 for the names that this
        package writes, then the order of `_LABEL_WORDS` for labels, and 1 for all others.
    """

    title: str
    role: str | None
    unit: str | None
    rank: int


def column_name(title: str) -> ColumnName:
    """Return what the name of a column means: its role, and its unit if it states one.

    >>> column_name("X [mm]").role, column_name("X [mm]").unit
    ('x', 'mm')
    >>> column_name("Y-Soll").role, column_name("y_in").unit, column_name("Datum").role
    ('nominal_y', 'inch', None)
    """
    if len(title) > _LONGEST or title in _OF_MULTI_STEP_PLAN:
        return ColumnName(title, None, None, 1)
    for role in ROLES:
        if title == OWN_NAMES.get(role, role):
            return ColumnName(title, role, _own_unit(role), 0)
    words, unit = _without_unit(title)
    if not words.isascii():
        words = _translated(words)
    plain = re.sub(r"[^a-z0-9#]", "", _plain(words))
    found = _known().get(plain) or _of_one_word(words)
    if plain in ("spindle", "spindel") and unit in ANGLE_UNITS:  # without it, perhaps a speed
        found = "spindle", 1
    if found == ("pass", GUESSED) and unit in FEED_UNITS:  # Speed [mm/s]
        found = "feed", GUESSED + 1  # below a column of feeds
    if found is None:
        return ColumnName(title, None, None, 1)
    role, rank = found
    if role in (*TEXT_ROLES, *NORMAL_ROLES, FRAME_ROLE):
        unit = None
    return ColumnName(title, role, unit, rank)


def _translated(words: str) -> str:
    """A name with words in other scripts in our words; an unknown word stays, and has no role.

    >>> _translated("X坐标"), _translated("法向X"), column_name("标称X").role
    ('Xpos', 'normalX', 'nominal_x')
    """
    for word, own in _OTHER_SCRIPTS.items():
        words = words.replace(word, own)
    unknown = any(c.isalpha() and not c.isascii() for c in _plain(words))
    return "?unknown" if unknown else words


def _of_one_word(title: str) -> tuple[str, int] | None:
    """Role and rank of a title of which one word says what the column groups.

    >>> _of_one_word("Stylus system"), _of_one_word("Probe temperature")
    (('tip', 2), None)
    """
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", title)
    words = re.findall(r"[a-z0-9]+", _plain(apart))
    if not words or len(words) > _MOST_WORDS or any(map(_QUANTITIES.fullmatch, words)):
        return None
    for role, nouns in _THINGS.items():
        if any(re.fullmatch(nouns, word) for word in words):
            return role, GUESSED
    return None


def role_of_cells(cells: Sequence[str]) -> str | None:
    """What a column groups by its cells alone; None where they do not say it.

    >>> role_of_cells(["fast", "slow", "fast", "slow"]), role_of_cells(["a", "b", "a"])
    ('pass', None)
    >>> role_of_cells(["TOOL_3", "TOOL_3", "TOOL_5"]), role_of_cells(["P1", "P1", "P2"])
    ('tip', None)
    """
    different = {*cells}
    if not 1 < len(different) < max(len(cells), 3) or len(different) > _MOST_GROUPS:
        return None
    for role, pattern in _BY_CELLS.items():
        if all(map(pattern.fullmatch, different)):
            return role
    if max(map(len, different)) > _LONGEST:
        return None
    stems = {_NUMBER_OF_ONE.sub("", cell).lower() for cell in different}
    stem = stems.pop() if len(stems) == 1 else ""
    named = None if len(stem) < 2 or stem in _NAMES_OF_TOUCHES else column_name(stem).role
    return named if named in {*TEXT_ROLES, FRAME_ROLE} - {"label"} else None


def groups_rows(cells: Sequence[str]) -> bool:
    """Whether cells are a few that come again: names of what several rows have in common.

    >>> groups_rows(["1", "1", "2"]), groups_rows(["1", "2", "3"]), groups_rows(["1", "1"])
    (True, False, False)
    """
    return 1 < len({*cells}) < len(cells) and len({*cells}) <= _MOST_GROUPS


def unit_of(text: str) -> str | None:
    """Return the unit that a word means, or None; brackets around it do not matter.

    >>> unit_of("[mm]"), unit_of("Zoll"), unit_of("-"), unit_of("X")
    ('mm', 'inch', '1', None)
    """
    if len(text) > _LONGEST:
        return None
    word = text.strip().strip("[](){}<>").strip().lower().replace(" ", "")
    return _UNITS.get(word)


def unit_of_title(title: str) -> str | None:
    """Return the unit in the name of a column, or None.

    >>> unit_of_title("tip_diameter_mm"), unit_of_title("Tip diameter")
    ('mm', None)
    """
    return _without_unit(title)[1]


def is_unit_row(cells: list[str]) -> bool:
    """Whether cells are units, such as those of the second line of a header.

    >>> is_unit_row(["", "[mm]", "[mm]", "-"]), is_unit_row(["", ""])
    (True, False)
    """
    stated = [cell for cell in cells if cell]
    units = [unit_of(cell) for cell in stated]
    return any(unit not in (None, "1") for unit in units) and None not in units


def names_known_columns(cells: list[str]) -> bool:
    """Whether cells are a header of a table of touches: three or more coordinates are named.

    >>> names_known_columns(["Nr", "X", "Y", "Z"]), names_known_columns(["1", "2", "3"])
    (True, False)
    """
    roles = {column_name(cell).role for cell in cells[:MOST_COLUMNS]}
    return len(roles & {*NUMBER_ROLES} - {"feed", "spindle", *ROTARY_ROLES}) >= 3


def counts_rows(title: str) -> bool:
    """Whether a column of this name can count the rows, where it has no value twice.

    >>> counts_rows("Run"), counts_rows("Part")
    (True, False)
    """
    return re.sub(r"[^a-z0-9#]", "", _plain(title)) in _COUNT_WORDS


def _own_unit(role: str) -> str | None:
    if role in ("spindle", *ROTARY_ROLES):
        return "deg"
    return "mm" if role in LENGTH_ROLES else {"feed": "mm/min"}.get(role)


def _without_unit(title: str) -> tuple[str, str | None]:
    """Split a name into its words and its unit: "X [mm]", "x_in", "X/mm", "F mm/min"."""
    text = title.strip()
    bracket = re.search(r"[\[({<]([^\])}>]*)[\])}>]", text)
    if bracket is not None:
        unit = unit_of(bracket[1])
        rest = text[: bracket.start()] + " " + text[bracket.end() :]
        return (rest, unit) if unit is not None else (f"{rest} {bracket[1]}", None)
    for separator in re.finditer(r"[\s_/,.:-]+", text):
        unit = unit_of(text[separator.end() :])
        if separator.start() > 0 and unit not in (None, "1"):
            return text[: separator.start()], unit
    return text, None


def _plain(text: str) -> str:
    """Lower case, without accents."""
    folded = text.lower().replace("ß", "ss")
    return "".join(c for c in unicodedata.normalize("NFKD", folded) if not unicodedata.combining(c))


@cache
def _known() -> dict[str, tuple[str, int]]:
    """Role and rank of each known name, written without blanks and punctuation."""
    known: dict[str, tuple[str, int]] = {}
    for axis, letter in zip("xyz", "ijk", strict=True):
        known[axis] = (axis, 1)
        known[letter] = (f"n{axis}", 1)
        for words, role in (
            (_POSITION_WORDS, axis),
            (_NOMINAL_WORDS, f"nominal_{axis}"),
            (_NORMAL_WORDS, f"n{axis}"),
            (_APPROACH_WORDS, f"a{axis}"),
        ):
            known |= {word + axis: (role, 1) for word in words}
            if len(words[0]) > 1:
                known |= {axis + word: (role, 1) for word in words}
        known |= {f"{axis}{word}": (f"n{axis}", 1) for word in _NORMAL_WORDS if len(word) > 1}
        for word in _NORMAL_WORDS:
            known |= {word + letter: (f"n{axis}", 1)}
            if len(word) > 1:
                known |= {letter + word: (f"n{axis}", 1)}
    for axis, letter in zip("xyz", "ijk", strict=True):  # vectors of nominal and measured points
        for rank, of_points in ((3, _NOMINAL_WORDS), (4, _MEASURED_WORDS)):
            for word in of_points:
                if len(word) > 1:
                    known.setdefault(word + letter, (f"n{axis}", rank))
                    known.setdefault(letter + word, (f"n{axis}", rank))
    known |= dict.fromkeys(_FEED_WORDS, ("feed", 1))
    known |= dict.fromkeys(_SPINDLE_WORDS, ("spindle", 1))
    known |= dict.fromkeys(_REFERENCE_WORDS, ("reference", 1))
    known |= dict.fromkeys(_TIP_WORDS, ("tip", 1))
    known |= dict.fromkeys(_PART_WORDS, ("part", 1))
    known |= dict.fromkeys(_COUNT_WORDS, ("part", 1))
    known |= dict.fromkeys("thd", ("tip", 1))
    known |= dict.fromkeys(("height", "hohe", "hauteur", "altura", "altezza", "hoogte"), ("z", 3))
    known |= dict.fromkeys(_FRAME_WORDS, ("frame", 1))
    known |= dict.fromkeys(_PASS_WORDS, ("pass", 1))
    known |= dict.fromkeys(_ORIENTATION_WORDS, ("orientation", 1))
    for axis in ROTARY_ROLES:
        known |= {axis + word: (axis, 1) for word in _ROTARY_WORDS}
        known |= {word + axis: (axis, 1) for word in _ROTARY_WORDS if word}
    known |= {word: ("label", 1 + rank) for rank, word in enumerate(_LABEL_WORDS)}
    return known
