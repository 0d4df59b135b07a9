"""The text of STEP files, corrected where the CAD kernel would crash."""

from __future__ import annotations

import re
from collections import deque

_SPACE = rb"(?:\s++|/\*[^*]*+\*++(?:[^/*][^*]*+\*++)*+/)*+"
"""White space and comments, which may stand between any two tokens (ISO 10303-21)."""

_TOPOLOGY = """
VERTEX VERTEX_POINT EDGE EDGE_CURVE ORIENTED_EDGE SUBEDGE PATH OPEN_PATH ORIENTED_PATH LOOP
EDGE_LOOP VERTEX_LOOP POLY_LOOP FACE FACE_BOUND FACE_OUTER_BOUND FACE_SURFACE ADVANCED_FACE
ORIENTED_FACE SUBFACE OPEN_SHELL CLOSED_SHELL ORIENTED_OPEN_SHELL ORIENTED_CLOSED_SHELL
CONNECTED_FACE_SET CONNECTED_FACE_SUB_SET CONNECTED_EDGE_SET VERTEX_SHELL WIRE_SHELL
MANIFOLD_SOLID_BREP BREP_WITH_VOIDS FACETED_BREP SHELL_BASED_SURFACE_MODEL
FACE_BASED_SURFACE_MODEL SHELL_BASED_WIREFRAME_MODEL EDGE_BASED_WIREFRAME_MODEL GEOMETRIC_SET
GEOMETRIC_CURVE_SET
"""
_GEOMETRY = """
CARTESIAN_POINT POINT_ON_CURVE POINT_ON_SURFACE DEGENERATE_PCURVE DIRECTION VECTOR PLACEMENT
AXIS1_PLACEMENT AXIS2_PLACEMENT_2D AXIS2_PLACEMENT_3D LINE CIRCLE ELLIPSE HYPERBOLA PARABOLA
POLYLINE B_SPLINE_CURVE B_SPLINE_CURVE_WITH_KNOTS BEZIER_CURVE UNIFORM_CURVE QUASI_UNIFORM_CURVE
TRIMMED_CURVE COMPOSITE_CURVE COMPOSITE_CURVE_ON_SURFACE BOUNDARY_CURVE OUTER_BOUNDARY_CURVE
OFFSET_CURVE_2D OFFSET_CURVE_3D PCURVE BOUNDED_PCURVE SURFACE_CURVE SEAM_CURVE INTERSECTION_CURVE
BOUNDED_SURFACE_CURVE CURVE_REPLICA PLANE CYLINDRICAL_SURFACE CONICAL_SURFACE SPHERICAL_SURFACE
TOROIDAL_SURFACE DEGENERATE_TOROIDAL_SURFACE SURFACE_OF_LINEAR_EXTRUSION SURFACE_OF_REVOLUTION
B_SPLINE_SURFACE B_SPLINE_SURFACE_WITH_KNOTS BEZIER_SURFACE UNIFORM_SURFACE QUASI_UNIFORM_SURFACE
RECTANGULAR_TRIMMED_SURFACE CURVE_BOUNDED_SURFACE RECTANGULAR_COMPOSITE_SURFACE OFFSET_SURFACE
SURFACE_REPLICA
"""
_OTHERS = """
MAPPED_ITEM STYLED_ITEM OVER_RIDING_STYLED_ITEM MEASURE_REPRESENTATION_ITEM TEXT_LITERAL
COMPOSITE_TEXT PLANAR_EXTENT PLANAR_BOX
"""
_ITEMS = "|".join(sorted(f"{_TOPOLOGY}{_GEOMETRY}{_OTHERS}".split())).encode("ascii")
"""Representation items of ISO 10303-42 and -43: their first attribute is a mandatory name."""

_NAMELESS = (
    rb"=" + _SPACE + rb"(?:" + _ITEMS + rb")" + _SPACE + rb"\(" + _SPACE + rb"\$"
    rb"|\bREPRESENTATION_ITEM" + _SPACE + rb"\(" + _SPACE + rb"\$"
)
_TOKENS = re.compile(
    rb"'[^']*(?:'|\Z)"  # a string; '' within it is read as the start of a second one
    rb"|/\*.*?(?:\*/|\Z)"
    rb"|(?P<nameless>" + _NAMELESS + rb")",
    re.DOTALL,
)
_FACES = re.compile(
    rb"'[^']*(?:'|\Z)|/\*.*?(?:\*/|\Z)"
    rb"|(?P<face>=" + _SPACE + rb"(?:ADVANCED_FACE|FACE_SURFACE)" + _SPACE + rb"\()",
    re.DOTALL,
)
_WORDS_OF_PMI = (b"DATUM", b"_TOLERANCE", b"DIMENSIONAL_SIZE", b"DIMENSIONAL_LOCATION",
                 b"ANGULAR_SIZE", b"ANGULAR_LOCATION")  # fmt: skip
_PMI = re.compile(
    rb"'[^']*(?:'|\Z)|/\*.*?(?:\*/|\Z)"
    rb"|(?P<pmi>\b[A-Z_]*(?:DATUM|_TOLERANCE|DIMENSIONAL_SIZE|DIMENSIONAL_LOCATION|ANGULAR_SIZE"
    rb"|ANGULAR_LOCATION)[A-Z_]*(?=" + _SPACE + rb"\())",
    re.DOTALL,
)
_ASIDE = re.compile(rb"'[^']*(?:'|\Z)|/\*.*?(?:\*/|\Z)", re.DOTALL)
"""Strings and comments."""


def with_names(text: bytes) -> tuple[bytes, int]:
    """The text of a STEP file in which every item of geometry has a name, if only an empty one.

    Returns
    -------
    text : bytes
        With ``''`` for each ``$`` that stands for the name of a representation item. Strings,
        comments and all other attributes are as they were.
    count : int
        Number of names that were absent.

    Notes
    -----
    ISO 10303-43 requires the name of a representation item. Some programs write ``$`` (no value)
    for it, and OpenCASCADE 7.8 then reads through a null pointer.

    >>> with_names(b"#1=PLANE($,#2); #3=SI_UNIT($,.METRE.); /* =PLANE($ */")
    (b"#1=PLANE('',#2); #3=SI_UNIT($,.METRE.); /* =PLANE($ */", 1)
    """
    count = 0
    end = _begin_of_open_comment(text)

    def mended(token: re.Match[bytes]) -> bytes:
        nonlocal count
        if token.group("nameless") is None:
            return token.group()
        count += 1
        return token.group()[:-1] + b"''"

    return _TOKENS.sub(mended, text[:end]) + text[end:], count


def without_pmi(text: bytes) -> bytes:
    """The text of a STEP file in which datums, dimensions and tolerances have unknown names.

    Returns
    -------
    bytes
        For the CAD kernel, which reads the geometry: its reader of PMI stops at what it does not
        expect, such as a datum target ``A1`` (it wants a number), and the whole file with it.

    >>> without_pmi(b"#1=DATUM_TARGET('DATUM(','',#4,.F.,'A1');")
    b"#1=UNREAD_DATUM_TARGET('DATUM(','',#4,.F.,'A1');"
    """
    if not any(word in text for word in _WORDS_OF_PMI):
        return text
    end = _begin_of_open_comment(text)

    def renamed(token: re.Match[bytes]) -> bytes:
        return token.group() if token.group("pmi") is None else b"UNREAD_" + token.group()

    return _PMI.sub(renamed, text[:end]) + text[end:]


def faces_in_text(text: bytes) -> int:
    """Number of faces that the text of a STEP file defines; an instance of a part is no new one.

    >>> faces_in_text(b"#1=ADVANCED_FACE('=FACE_SURFACE(',#2); #3 = FACE_SURFACE ($,#4);")
    2
    """
    found = _FACES.finditer(text[: _begin_of_open_comment(text)])
    return sum(token.group("face") is not None for token in found)


def _begin_of_open_comment(text: bytes) -> int:
    """Where a comment begins that does not end; else the length of the text.

    Looked for from every place before it, its end would take time with the square of the text.
    """
    if b"/*" not in text:
        return len(text)
    tokens = deque(_ASIDE.finditer(text), maxlen=1)
    if not tokens or not tokens[0].group().startswith(b"/*"):
        return len(text)
    last = tokens[0]
    return len(text) if last.group().endswith(b"*/", 2) else last.start()
