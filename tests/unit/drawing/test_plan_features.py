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


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.dmi", "F(A)=FEAT/PLANE,CART,0,0,0,0,0,1\n", "no UNITS before its features"),
        ("a.dmi", "MEAS/POINT,F(P),1\n", "not a DMIS plan"),
        ("a.dmi", "UNITS/MM\nF(A)=FEAT/PLANE,CART,0,0,x,0,0,1\n", "line 2"),
        ("a.dmi", "UNITS/MM\nF(A)=FEAT/PLANE,CART,0,0\n", "2 numbers"),
        ("a.dmi", "UNITS/MM\nF(A)=FEAT/POINT,CART,0,0,0,0,0,1\n", "names no feature"),
        ("a.qif", "<QIFDocument/>", "QIF 3 and 2 are read"),
    ],
)
def test_refused(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        _read(tmp_path, name, text)
