"""Files that are recognised and refused: features, meshes of heights, programs, geometry.

A refusal states what the file is, and what the user can do instead.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable

from pretravel.files.column_names import column_name, names_known_columns
from pretravel.files.file_format import FileFormat
from pretravel.files.lines_of_tables import (
    FEWEST_ROWS,
    has_known_header,
    header_cells,
    is_table,
    rows_below_a_title,
)
from pretravel.files.logs.plain_labels import without_comments
from pretravel.files.words_of_lines import plain_axes

_CODE = re.compile(r"(?:G(?:38\.[2-5]|31|65|28|0?[23])|M(?:0?[3-6]|30))(?![\d.])|#", re.IGNORECASE)
"""Orders that no log of positions contains."""
_NUMBERED = re.compile(r"/?\s*N\d+\s*", re.IGNORECASE)
_VALUE = r"[-+]?(?:\.?\d|\[|#|<)"
_APART = re.compile(rf"(?<=[A-Z])\s(?={_VALUE})", re.IGNORECASE)
"""A blank between a letter and its number."""
_WORD = re.compile(rf"[A-Z]{_VALUE}[^,;]*", re.IGNORECASE)
_ASSIGNMENT = re.compile(r"#\s?[\d<][^:=]*=")
_POSITION = re.compile(
    r"(?:N\s*\d+\s*)?"
    + "".join(rf"{axis}[\s=:]*[-+]?[\s\d.,]+[,;*\s]*" for axis in "XYZ")
    + r"(?:\$.*)?",
    re.IGNORECASE,
)
"""A line that is a position, and at most a variable of Siemens."""
_HEIDENHAIN_PROGRAM = re.compile(r"(?:0\s+)?BEGIN PGM\b|\d+\s+TCH PROBE \d{3}\b", re.IGNORECASE)
_DPRNT = re.compile(r"(?:N\d+\s*)?(?:DPRNT\[|POPEN\b)", re.IGNORECASE)
_SUBROUTINE = re.compile(r"o\s?(?:<\w+>|\d+)\s*(?:sub|call|if|while|repeat)\b", re.IGNORECASE)


def _any(pattern: str, *, head: int | None = None) -> Callable[[list[str]], bool]:
    """Return a function: whether the pattern is found in a line (of the first ones)."""
    compiled = re.compile(pattern, re.IGNORECASE)
    return lambda lines: any(compiled.search(line) for line in lines[:head])


def _untitled(pattern: str, *, head: int) -> Callable[[list[str]], bool]:
    """Whether a pattern is found near the head, and is not the title of a table of touches."""
    found = _any(pattern, head=head)
    return lambda lines: (
        found(lines)
        and not (is_table(lines) and (has_known_header(lines) or rows_below_a_title(lines)))
        and sum(bool(_POSITION.fullmatch(plain_axes(line))) for line in lines) < FEWEST_ROWS
    )


def _is_program(lines: list[str]) -> bool:
    for line in lines:
        code = without_comments(line).partition(";")[0].strip()
        if "=" in code and _POSITION.fullmatch(plain_axes(code)):
            continue  # values of #5061, #5062, #5063
        if _HEIDENHAIN_PROGRAM.match(code) or _DPRNT.match(code) or _SUBROUTINE.match(code):
            return True
        if _CODE.search(code) and _is_block(code):
            return True
    return False


def _is_block(code: str) -> bool:
    """Whether a line has letters alone, each with its number or expression, or sets a variable."""
    numbered = _NUMBERED.match(code)
    rest = code[numbered.end() :] if numbered else code
    words = _APART.sub("", rest).split()
    return bool(_ASSIGNMENT.match(rest) or (words and all(map(_WORD.fullmatch, words))))


_IS_BED_MESH = _any(
    r"Mesh Leveling Probed Z positions|\[bed_mesh\b|mesh_matrix|probed_matrix|"
    r"Bilinear Leveling Grid|Bed Topography Report|Measured points:$|"
    r"^RepRapFirmware height map|^<heightmap\b|\bHeightMap MinX="
)

PC_DMIS_REPORT = FileFormat(
    name="pcdmis-report",
    what="report of dimensions of PC-DMIS: AX NOMINAL … MEAS DEV",
    recognises=_any(r"^AX\s+(?:NOMINAL|MEAS)\b.*\b(?:MEAS|DEV|NOMINAL)\b"),
    refusal="this is a report of PC-DMIS: dimensions of features, with the tip's radius "
    "subtracted. It has no vectors, so that no touches can be made of it. Save the measurement "
    "routine as text instead, with THEO/ and ACTL/ of its points and its hits (format pcdmis), "
    "or export x, y, z, i, j, k of the points as CSV",
)

_CALYPSO_COLUMNS = {"idsymbol", "type", "geotype", "characteristic", "uppertol", "featureid"}


def _is_calypso(line: str) -> bool:
    """Whether a line is the header of a table of Calypso, also as a spreadsheet saved it."""
    cells = {cell.strip(' "').lower() for cell in re.split(r"[\t;,]", line)}
    return {"planid", "partnb"} <= cells and bool(cells & _CALYPSO_COLUMNS)


_SIZES = re.compile(
    r"(?:nom(?:inal)?|act(?:ual)?|meas(?:ured)?|soll|ist)?(?:diam(?:eter)?|dia|durchm(?:esser)?|diametre|"
    r"diametro|form(?:error|dev|fehler)?|roundness|circularity|flatness|cylindricity|straightness|"
    r"rundheit|ebenheit|zylindrizitat|redondez|planitud|cilindricidad|circularite|planeite|"
    r"cylindricite|rotondita|planarita|sigma|stddev|(?:n|no|nr|num|number|anzahl)?(?:of)?(?:points|"
    r"pts|hits|punkte)|innerouter|"
    r"featuretype|geometrytype|elementtype|formabw|fitmethod|major|minor|majoraxis|"
    r"minoraxis)(?:nom|act|meas|dev)?"
)
_KINDS = re.compile(
    r"(?:circle|plane|cylinder|sphere|cone|line|slot|arc|ellipse|torus|kreis|ebene|zylinder|kugel|"
    r"kegel|gerade|bohrung|cercle|circulo|plan|cylindre|cir|pln|cyl|sph|hole|bore|trou|alesage|agujero|"
    r"taladro|foro|cerchio|cilindro|esfera|sfera|otwor)(?=\b|[_\d])",
    re.IGNORECASE,
)
_TYPES = {"type", "typ", "kind", "art", "element", "feature type", "elementtype"}
_POINTS = re.compile(r"(?:vector |surface |edge )?(?:point|punkt|punto|pt|vec)\b", re.IGNORECASE)
_CENTRES = re.compile(
    r"(?:circle|cylinder|sphere|cone|slot|arc|ellipse|torus|kreis|zylinder|kugel|kegel|bohrung|"
    r"cercle|cylindre|cir|cyl|con|sph|hole|bore|trou|alesage|agujero|taladro|foro|cerchio|cilindro|"
    r"esfera|sfera|otwor)\b",
    re.IGNORECASE,
)
"""Features whose place is a centre, on no surface."""
_OF_ONE_CENTRE = re.compile(rf"{_CENTRES.pattern.removesuffix(chr(92) + 'b')}[ _.-]?[0-9]+", re.I)
_SIZES_ELSEWHERE = re.compile(r"直径|半径|直徑|半徑|真円度|平面度|円筒度|диаметр", re.I)
_SMALLEST_SIZE = 0.5
"""Below this a number next to a position can be a deviation. [mm]"""
_RESULTS = (
    {"nominal", "nom", "soll", "sollwert", "nominale"},
    {"actual", "meas", "measured", "act", "ist", "istwert", "mesure", "gemessen"},
    {"dev", "deviation", "abweichung", "test", "check", "status", "out tol", "outtol", "ecart"},
)


_CENTRE = re.compile(
    r"[xyz](?:c|m|o|cen|cent(?:er|re)|mitte|mittelpunkt|centro)|"
    r"(?:c|cen|cent(?:er|re)|mitte|mittelpunkt|mp|centro)[xyz]"
)
"""Coordinates of a centre, without blanks."""
_AXES = [[f"{word}{letter}" for letter in "ijk"] for word in ("axis", "achse", "axe", "asse")]
"""Columns of the axis of a circle or cylinder."""
_BEGINS_SIZE = re.compile(r"d|r|size|radius|(?:dia|durchm|form|round).*")
_RADII = {
    "radius", "rad", "radio", "rayon", "raggio", "nomradius", "actradius", "measradius",
}  # fmt: skip
"""Columns of sizes of features; or of the tip, where all rows have one."""
_SIZE_LETTERS = {"r", "d", "size"}
_EDGE = re.compile(r"D?(?:[1-9]|1[0-2])", re.IGNORECASE)
"""Number of a cutting edge, of which a tool has at most twelve."""
_BESIDE_FEATURES = {
    "r", "d", "sd", "width", "length", "breite", "lange", "angle", "winkel", "coneangle", "size",
}  # fmt: skip
"""Columns of features, where rows have the names of features: a hole's D, a cone's angle."""


def _folded(text: str) -> str:
    """A text without its accents."""
    return "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))


def names_a_centre(name: str) -> bool:
    """Whether a name is that of a feature whose place is a centre.

    >>> names_a_centre("CIR1"), names_a_centre("BORE_2"), names_a_centre("P1")
    (True, True, False)
    """
    return _OF_ONE_CENTRE.fullmatch(_folded(name)) is not None


def _column(lines: list[str], column: int, width: int) -> list[str]:
    """The cells of a column of a table of a width."""
    every = ([line.split(separator) for separator in (";", "\t", "|", ",", None)] for line in lines)
    split = (next((cells for cells in ways if len(cells) == width), None) for ways in every)
    return [cells[column].strip(' "') for cells in split if cells is not None]


def _vary(lines: list[str], column: int, width: int) -> bool:
    """Whether the cells of a column of a table are not all one, as the tip's radius is."""
    return len({cell for cell in _column(lines, column, width) if cell[:1].isdigit()}) > 1


def _are_edges(lines: list[str], column: int, plain: list[str]) -> bool:
    """Whether D is the cutting edge of a tool, as in T7 D1.

    It is in a table with tools; and in one with normals if it has the first edge, because the
    vectors of holes are their axes, and holes of 1 mm are rare.
    """
    words = {column_name(word).role for word in plain if word != "d"}
    if plain[column] != "d" or not {"tip", "nx"} & words:
        return False
    cells = _column(lines, column, len(plain))[1:]
    known = "tip" in words or bool({"1", "D1"} & {*cells})
    return known and all(map(_EDGE.fullmatch, cells))


def _are_sizes(lines: list[str], column: int, width: int) -> bool:
    """Whether a column has several sizes of features, and no deviations."""
    cells = _column(lines, column, width)[1:]
    try:
        sizes = {float(cell.replace(",", ".")) for cell in cells if cell}
    except ValueError:
        return False
    return len(sizes) > 1 and min(sizes) >= _SMALLEST_SIZE


def _are_centres(lines: list[str], plain: list[str]) -> bool:
    """Whether rows have the names of round features, one each, and their axes as vectors."""
    width = len(plain)
    names = [cell for cell in _column(lines, 0, width)[1:] if cell]
    round_ones = [name for name in names if names_a_centre(name)]
    if len(names) < FEWEST_ROWS or len({*round_ones}) < len(names):
        return False
    vectors = [i for i, word in enumerate(plain) if word in ("i", "j", "k")]
    alike = all(len({*_column(lines, i, width)[1:]}) == 1 for i in vectors)
    return len(vectors) == len("ijk") and alike


def _name_features(lines: list[str], width: int) -> bool:
    """Whether most rows begin with the name of a feature that has a size."""
    names = [cell for cell in _column(lines, 0, width)[1:] if cell]
    return 2 * sum(bool(_KINDS.match(_folded(name))) for name in names) > max(len(names), 1)


def _have_several_rows(names: list[str]) -> bool:
    """Whether the names of features, plane1 and not plane, have rows each: their points."""
    numbered = all(_KINDS.match(_folded(name)) and name[-1:].isdigit() for name in names)
    return numbered and 1 < 2 * len({*names}) <= len(names)


def _some_are_points(types: list[str]) -> bool:
    """Whether some rows are points, and others are features whose centre is not a touch."""
    points = any(_POINTS.match(_folded(cell)) for cell in types)
    return points and any(_CENTRES.match(_folded(cell)) for cell in types)


def _is_feature_list(lines: list[str]) -> bool:
    """Whether a table has a row for each feature, or for each of its results."""
    cells = [cell.lower() for cell in header_cells(lines)]
    plain = [re.sub(r"[^a-z ]", "", _folded(cell.split("[")[0])).strip() for cell in cells]
    squeezed = [word.replace(" ", "") for word in plain]
    if not cells:
        return False
    if not names_known_columns(cells):
        centres = [word for word in squeezed if _CENTRE.fullmatch(word)]
        if len(centres) > 1 and any(map(_BEGINS_SIZE.fullmatch, squeezed)):
            return True
        return all(any(word in kind for word in plain) for kind in _RESULTS)
    if any(_SIZES.fullmatch(word) for word in squeezed if word) or "ø" in cells:
        return True
    if any({*axis} <= {*squeezed} for axis in _AXES):
        return True
    width = len(cells)
    if any(map(_SIZES_ELSEWHERE.search, cells)) or _are_centres(lines, plain):
        return True
    letters = [i for i, word in enumerate(squeezed) if word in _SIZE_LETTERS]
    if any(_are_sizes(lines, i, width) for i in letters if not _are_edges(lines, i, plain)):
        return True
    if any(_vary(lines, i, width) for i, word in enumerate(squeezed) if word in _RADII):
        return True
    if {*squeezed} & _BESIDE_FEATURES and (
        _KINDS.fullmatch(plain[0]) or _name_features(lines, width)
    ):
        return True
    columns = [i for i, word in enumerate(plain) if word in _TYPES]
    if not columns:
        return False
    if any(_some_are_points(_column(lines, i, len(cells))) for i in columns):
        return True
    if any(_have_several_rows(_column(lines, i, width)[1:]) for i in columns):
        return False
    rows = [line for line in lines[:60] if any(sign.isdigit() for sign in line)]
    kinds = [line for line in rows if re.search(rf"(?:^|[;,\t|\s\"]){_KINDS.pattern}", line, re.I)]
    return len(rows) > 0 and 2 * len(kinds) > len(rows)


FEATURE_LIST = FileFormat(
    name="feature-list",
    what="list of features or of their results: a diameter, a form, Nominal … Actual … Dev",
    recognises=_is_feature_list,
    refusal="this is a list of features (centres, diameters, forms) or of their results, as the "
    "software of CMMs writes them, with the tip's radius subtracted: a row is not a touch, and "
    "nothing is left to compensate. Let the software write the points that it measured, as tip "
    "centres with their normals, one row for each touch",
)

LISTING = FileFormat(
    name="listing",
    what="report of other software by its name: Quindos, Reflex, Metrolog, PolyWorks, Carvera …",
    recognises=_untitled(
        r"\b(?:quindos|reflex|metrolog|polyworks|gom inspect|zeiss inspect|verisurf|aberlink|"
        r"calypso|powerinspect|rationaldmis|cmm-manager|camio|xactmeasure|mcosmos|geopak|carvera|"
        r"modus inspection|pc-?dmis|"
        r"makera|calibrating probe|probing (?:bore|boss|(?:outside |inside )?corner|single axis|"
        r"square|2 points to find an angle)|final posit(?:i?on):? ?[xyz])\b|^corner found\b|"
        r"^cent(?:er|re) of bo(?:re|ss) or\b",
        head=40,
    ),
    refusal="this is a report of a CMM's or a machine's software (Quindos, Reflex, Metrolog, "
    "PolyWorks, GEOPAK, Carvera …), whose lines are results and texts, no touches in a form that "
    "is known. Let it write the points that it measured, as tip centres with their normals, as a "
    "table: x, y, z, nx, ny, nz; of a machine, give the log with the probe's reports ([PRB:…])",
)

CALYPSO = FileFormat(
    name="calypso",
    what="tables of Calypso: chr.txt, fet.txt, hdr.txt",
    recognises=lambda lines: _is_calypso(lines[0]),
    refusal="this is a table of Calypso: characteristics and features, with the tip's radius "
    "subtracted. It has no touches. Let Calypso write the points of the elements, as tip centres "
    "with their normals, and convert these from CSV",
)

_CYCLE = re.compile(r"\bCYCLE9\d\d\b", re.IGNORECASE)
"""A measuring cycle of Siemens: its name in a row of results."""
_titled_log = _untitled(
    r"\bMeasuring (?:log|results)\b|\bMeasurement log\b|\bMessprotokoll\b|^\W*VS7[5-9]\s*[=:]|"
    r"^\W*(?:Prob(?:ing|e) cycle|Touch probe cycle|Antastzyklus|Tastsystem-?Zyklus) +4\d\d\b",
    head=40,
)


def _is_cycle_log(lines: list[str]) -> bool:
    """Whether a text has the title of a log of cycles, or names a cycle in most of its rows."""
    rows = [line for line in lines[:60] if any(sign.isdigit() for sign in line)]
    named = sum(bool(_CYCLE.search(line)) for line in rows)
    return (named > 1 and 2 * named > len(rows)) or _titled_log(lines)


HEIDENHAIN_LOG = FileFormat(
    name="heidenhain-log",
    what="log of measuring cycles: Heidenhain TCHPR4xx.TXT, Siemens CYCLE9xx, Okuma VS75",
    recognises=_is_cycle_log,
    refusal="this is the log of a measuring cycle: sizes and positions of a feature, with the "
    "tip's radius subtracted. It has no touches. Probe the points one by one (TCH PROBE 3 or 444, "
    "MEAS, G31) and write each measured position as a row of a table (FN 16, WRITE, DPRNT)",
)

BED_MESH = FileFormat(
    name="bed-mesh",
    what="heights of a bed or a board: Klipper, Marlin, RepRapFirmware, autolevelling",
    recognises=_IS_BED_MESH,
    refusal="this is a mesh of heights, probed along z alone: every touch has the same pretravel, "
    "which is part of the probe's z offset, and no correction by direction changes the mesh. To "
    "measure its flatness, write x, y and z of each point as a row of a table, and give the normal "
    "0,0,1 for all touches when it is read",
)

_TAGGED = re.compile(
    r"(?<!\w)[E\d]\d{4}\s+(?:[#%]\s+)?(?:PtMeas|GoTo|X|StartSession|OnPtMeasReport)\s*\(",
    re.IGNORECASE,
)
"""The tag of an order or an answer, and a word of the protocol."""


def _is_tagged(line: str) -> bool:
    """Whether a line begins with a tag, after one word at most, such as a time."""
    found = _TAGGED.search(line)
    if found is None:
        return False
    before = re.sub(r"^\W+", "", line[: found.start()])
    return not before or (before[-1].isspace() and len(before.split()) == 1)


I_PLUS_PLUS = FileFormat(
    name="i++",
    what="log of an I++ DME server",
    recognises=lambda lines: any(map(_is_tagged, lines)),
    refusal="this is a log of an I++ DME server. It is not read, because the properties that give "
    "what its positions are (OnPtMeasReport, the tool's compensation) differ from session to "
    "session. Write X, Y, Z of the answers to PtMeas and IJK of the requests as CSV",
)

PROGRAM = FileFormat(
    name="program",
    what="program of a control: G-code, Macro B, Heidenhain .H",
    recognises=_is_program,
    refusal="this is a program of a control, or its lines as a sender logged them, without any "
    "report of the probe. Give what the control reported while it ran: the file that PROBEOPEN, "
    "LOG or DPRNT wrote, or the messages that the sender saved",
)

GEOMETRY = FileFormat(
    name="geometry",
    what="geometry of a part: STEP, IGES, STL, OBJ, PLY, 3MF",
    endings=(".stl", ".3mf", ".igs", ".iges", ".step", ".stp", ".obj", ".ply"),
    binary=True,
    recognises=lambda lines: (
        lines[0].startswith(("ISO-10303-21", "ply"))
        or (
            lines[0].lower().startswith("solid")
            and any("facet normal" in line for line in lines[:3])
        )
    ),
    refusal=(
        "this is the geometry of a part, without readings. STEP and IGES files can be "
        "the nominal surface of a part"
    ),
)

DOCUMENT = FileFormat(
    name="document",
    what="spreadsheets and documents: .xlsx, .xls, .ods, .pdf, .docx, .html",
    endings=(".xlsx", ".xls", ".xlsm", ".ods", ".pdf", ".docx", ".doc", ".html", ".htm"),
    binary=True,
    recognises=_any(r"^(?:<!DOCTYPE html|<html\b|%PDF-)", head=2),
    refusal="this is a spreadsheet or a document. Save the table with the readings as CSV (text, "
    "one row for each touch)",
)
