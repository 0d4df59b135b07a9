"""Features and tolerances of QIF and DMIS plans, in the form of public files of both."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.drawing.tolerances.features_file import DrawnFeature
from pretravel.drawing.tolerances.plan_features import read_plan_features
from pretravel.drawing.tolerances.tolerance_frame import GeometricTolerance
from pretravel.measurement.selection import _matches
from tests.support.plans import DMIS_PLAN, QIF_PLAN


def _read(folder: Path, name: str, text: str) -> tuple[dict[str, DrawnFeature], tuple[str, ...]]:
    (folder / name).write_text(text)
    drawing, notes = read_plan_features(folder / name)
    return {each.label: each for each in drawing.feature}, notes


def test_dmis(tmp_path: Path) -> None:
    found, notes = _read(tmp_path, "plan.dmi", DMIS_PLAN)
    assert {name: each.kind for name, each in found.items()} == {
        "TOP": "plane", "HOLE1": "cylinder", "RING": "boss"
    }  # fmt: skip
    hole, ring = found["HOLE1"], found["RING"]
    assert (hole.at, hole.axis, hole.tolerance) == ((12, 12, 10), (0, 0, 1), "11.99..12.02")
    assert hole.geometric == (GeometricTolerance("position", 0.1, ("TOP",), "M"),)
    assert ring.axis == (0, 0, 1)
    assert ring.geometric == (GeometricTolerance("position", 0.2, ("TOP", "HOLE1(M)")),)
    assert ring.position_tolerance == 0.3
    assert found["TOP"].form_tolerance == 0.02
    assert len(notes) == 2
    assert "F(SLIT), a CPARLN" in notes[0]
    assert "T(COR) of RING: CORTOL is not read" in notes[1]


def test_qif(tmp_path: Path) -> None:
    found, notes = _read(tmp_path, "plan.qif", QIF_PLAN)
    hole = found["HOLE"]
    assert hole.at == pytest.approx((76.2, 50.8, 0.0))
    assert hole.tolerance == "12.6746..12.7508"
    assert found["DATUM_B"].tolerance == hole.tolerance
    assert hole.geometric[0].zone == pytest.approx(0.254)
    assert hole.geometric[0].datums == ("TOP", "DATUM_B(M)")
    assert hole.geometric[0].material == "M"
    assert found["TOP"].form_tolerance == pytest.approx(0.0254)
    assert "datum B is taken to be DATUM_B, by its name" in notes[0]
    assert "left out: Thread of HOLE: Thread is not read" in notes[1]


def test_points_are_chosen_by_the_name_of_the_feature(tmp_path: Path) -> None:
    pattern = _read(tmp_path, "plan.dmi", DMIS_PLAN)[0]["HOLE1"].select
    labels = ["HOLE1-1", "HOLE1_12", "HOLE1.3", "HOLE11-1", "HOLE1", "XHOLE1-1"]
    assert [_matches(label, pattern) for label in labels] == [True, True, True, False, False, False]


def test_forms_of_a_cylinder_are_of_the_whole_its_sections_and_its_lines(tmp_path: Path) -> None:
    forms = "".join(
        f"T({name})=TOL/{name},{zone}\nOUTPUT/FA(HOLE1),TA({name})\n"
        for name, zone in (("CYLCTY", 0.05), ("CIRLTY", 0.02), ("STRGHT", 0.01))
    )
    hole = _read(tmp_path, "plan.dmi", DMIS_PLAN + forms)[0]["HOLE1"]
    assert (hole.form_tolerance, hole.nominal) == (0.05, 12.0)
    assert hole.geometric[1:] == (
        GeometricTolerance("roundness", 0.02),
        GeometricTolerance("cylindricity", 0.01, instead_of="straightness"),
    )


@pytest.mark.parametrize(
    ("more", "note"),
    [
        ("T(X)=TOL/FLAT,0.03\n", "T(X), with which no feature is put out"),
        ("T(X)=TOL/FLAT,0.03\nOUTPUT/FA(TOP),TA(X)\n", "a second flatness with another"),
        ("T(X)=TOL/DIAM,-0.1,0.1\nOUTPUT/FA(HOLE1),TA(X)\n", "a second size with another"),
        ("T(X)=TOL/CYLCTY,0.03\nOUTPUT/FA(TOP),TA(X)\n", "the cylindricity of a plane"),
        ("T(X)=TOL/PERP,0.1,PARPLN,DAT(A)\nOUTPUT/FA(HOLE1),TA(X)\n", "PARPLN is not read"),
        ("T(X)=TOL/PERP,0.1,0.2,DAT(A)\nOUTPUT/FA(HOLE1),TA(X)\n", "0.2 mm, is not read"),
        ("D(1)=TRANS/XORIG,5\n", "the coordinates change behind the first feature"),
    ],
)
def test_what_a_plan_states_besides_is_named(tmp_path: Path, more: str, note: str) -> None:
    assert any(note in each for each in _read(tmp_path, "plan.dmi", DMIS_PLAN + more)[1])


@pytest.mark.parametrize(
    ("inserted", "note"),
    [
        ("<ProjectedToleranceZoneValue>1</ProjectedToleranceZoneValue>", "ProjectedTol"),
        ("<ZoneShape><NonDiametricalZone/></ZoneShape>", "NonDiametricalZone is not read"),
        ("<OrientationOnly>true</OrientationOnly>", "OrientationOnly is not read"),
        ("<OrientationOnly>false</OrientationOnly>", ""),
        ("<SecondCompositeSegmentPositionDefinition/>", "the lower segment of its frame"),
    ],
)
def test_zones_of_qif_that_are_not_read(tmp_path: Path, inserted: str, note: str) -> None:
    end = "</PositionCharacteristicDefinition>"
    text = QIF_PLAN.replace(end, inserted + end)
    found, notes = _read(tmp_path, "plan.qif", text)
    assert len(found["HOLE"].geometric) == (1 if not note or "lower" in note else 0)
    assert any(note in each for each in notes) if note else len(notes) == 2


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.dmi", "F(A)=FEAT/PLANE,CART,0,0,0,0,0,1\n", "no UNITS before its features"),
        ("a.dmi", "MEAS/POINT,F(P),1\n", "not a DMIS plan"),
        ("a.dmi", "UNITS/MM\nF(A)=FEAT/PLANE,CART,0,0,x,0,0,1\n", "line 2"),
        ("a.dmi", "UNITS/MM\nF(A)=FEAT/PLANE,CART,0,0\n", "2 numbers"),
        ("a.dmi", "UNITS/MM\nF(A)=FEAT/POINT,CART,0,0,0,0,0,1\n", "names no feature"),
        ("a.qif", "<QIFDocument/>", "QIF 3 and 2 are read"),
        ("a.dmi", DMIS_PLAN + "UNITS/INCH\n", "the UNITS change"),
        ("a.dmi", DMIS_PLAN + "T(FL)=TOL/FLAT,0.03\n", r"T\(FL\) is defined twice"),
        ("a.dmi", DMIS_PLAN + "F(TOP)=FEAT/PLANE,CART,0,0,0,0,0,1\n", r"F\(TOP\) is defined twice"),
        ("a.dmi", DMIS_PLAN + "DATDEF/FA(RING),DAT(A)\n", r"DAT\(A\) is defined twice"),
        ("a.qif", QIF_PLAN.replace(">HOLE<", ">TOP<"), "two features are called 'TOP'"),
    ],
)
def test_refused(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        _read(tmp_path, name, text)
