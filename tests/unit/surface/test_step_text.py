"""STEP files whose items have no name ($) are mended before the kernel reads them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.cad.step_reader import read_step_solids
from pretravel.surface.cad.step_text import with_names, without_pmi
from tests.support.examples import EXAMPLES


def test_only_names_of_items_are_mended() -> None:
    """ISO 10303-43: representation_item.name is mandatory; the $ of a unit's prefix, of an
    optional reference and of a description are not names."""
    text = (
        b"#1=PLANE($,#2);#2 = AXIS2_PLACEMENT_3D ( $ ,#3,$,$);\n"
        b"#3=CARTESIAN_POINT( /* the (PLANE($ */ $,(0.,0.,0.));\n"
        b"#4=(BOUNDED_CURVE()B_SPLINE_CURVE(3,(#3),.U.,.F.,.F.)REPRESENTATION_ITEM($));\n"
        b"#5=PRODUCT('it''s =PLANE($,','x',$,(#6));/* #7=PLANE($,#2); */\n"
        b"#8=SI_UNIT($,.RADIAN.);#9=MEASURE_REPRESENTATION_ITEM('',COUNT_MEASURE(1.),#8);\n"
        b"#10=SHAPE_ASPECT($,$,#1,.T.);\n"
    )
    mended, count = with_names(text)
    assert count == 4
    assert mended == (
        b"#1=PLANE('',#2);#2 = AXIS2_PLACEMENT_3D ( '' ,#3,$,$);\n"
        b"#3=CARTESIAN_POINT( /* the (PLANE($ */ '',(0.,0.,0.));\n"
        b"#4=(BOUNDED_CURVE()B_SPLINE_CURVE(3,(#3),.U.,.F.,.F.)REPRESENTATION_ITEM(''));\n"
        b"#5=PRODUCT('it''s =PLANE($,','x',$,(#6));/* #7=PLANE($,#2); */\n"
        b"#8=SI_UNIT($,.RADIAN.);#9=MEASURE_REPRESENTATION_ITEM('',COUNT_MEASURE(1.),#8);\n"
        b"#10=SHAPE_ASPECT($,$,#1,.T.);\n"
    )


@pytest.mark.parametrize(
    "text",
    [b"#1=PRODUCT('open #2=PLANE($,", b"/* open #2=PLANE($,#3);", b"'a'/*'*/'/*'#2=PLANE('',#3);"],
)
def test_nothing_in_a_string_or_comment_is_changed(text: bytes) -> None:
    assert with_names(text) == (text, 0)


def test_the_kernel_reads_no_pmi(tmp_path: Path) -> None:
    """Its reader of PMI wants a number of a datum target, and refuses the whole file for "A1"."""
    target = (
        "#3000=DATUM('',$,#4,.F.,'A');#3001=PLACED_DATUM_TARGET_FEATURE('','point',#4,.T.,'A1');"
        "#3002=SHAPE_ASPECT_RELATIONSHIP('','',#3001,#3000);"
        "#3003=(DATUM('B') SHAPE_ASPECT('DATUM(',$,#4,.F.)); /* DATUM( */\n"
    )
    head, end, tail = (EXAMPLES / "bracket.step").read_text().rpartition("ENDSEC;")
    file = tmp_path / "targets.step"
    file.write_text(head + target + end + tail)
    assert len(read_step_part(file).faces) == 16
    assert without_pmi(target.encode()).decode() == (
        target.replace("=DATUM(", "=UNREAD_DATUM(").replace("(DATUM('B", "(UNREAD_DATUM('B")
        .replace("=PLACED", "=UNREAD_PLACED")
    )  # fmt: skip
    for kept in (b"#1=DIMENSIONAL_EXPONENTS(1.,0.);", b"#2=TOLERANCED('_TOLERANCE(');"):
        assert without_pmi(kept) == kept


def test_a_file_without_names_is_read_as_with_empty_ones(tmp_path: Path) -> None:
    """The kernel crashes on such a file (signal 11); every item of geometry has no name here."""
    whole = (EXAMPLES / "part.step").read_text(encoding="ascii")
    items = (
        "ADVANCED_FACE AXIS2_PLACEMENT_3D B_SPLINE_CURVE_WITH_KNOTS B_SPLINE_SURFACE_WITH_KNOTS "
        "CARTESIAN_POINT DIRECTION EDGE_CURVE EDGE_LOOP FACE_BOUND LINE OPEN_SHELL ORIENTED_EDGE "
        "PCURVE SHELL_BASED_SURFACE_MODEL SURFACE_CURVE VECTOR VERTEX_POINT"
    )
    pattern = re.compile(rf"\b({items.replace(' ', '|')})\(''")
    nameless, count = pattern.subn(r"\1($", whole)
    assert count > 100
    file = tmp_path / "nameless.step"
    file.write_text(nameless, encoding="ascii")
    with pytest.warns(UserWarning, match=rf"nameless\.step: {count} items of geometry"):
        part = read_step_part(file)
    plain = read_step_part(EXAMPLES / "part.step")
    uv = np.array([[0.2, 0.3], [0.7, 0.6]])
    assert np.array_equal(part.faces[0].local(uv).point, plain.faces[0].local(uv).point)
    assert part.faces[0].flips == plain.faces[0].flips


def test_solids_of_a_probe_without_names_are_read(tmp_path: Path) -> None:
    from netgen.occ import Box

    file = tmp_path / "box.step"
    Box((0, 0, 0), (1, 2, 3)).WriteStep(str(file))
    text = file.read_text(encoding="ascii")
    file.write_text(text.replace("PLANE(''", "PLANE($"), encoding="ascii")
    with pytest.warns(UserWarning, match="6 items of geometry have no name"):
        (solid,) = read_step_solids(file)
    assert solid.mass == pytest.approx(6.0, rel=1e-12)
