"""DMIS output files."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.logs.dmis import read_dmis
from tests.support.control_logs import (
    DMIS_OUTPUT,
    written,
)


class TestDmis:
    def test_points_nominals_and_what_is_missing(self, tmp_path: Path) -> None:
        found = read_dmis(written(tmp_path, DMIS_OUTPUT), 3.0)
        assert found.touches.positions.tolist() == [[0.0, 0.0, 3.01]]
        assert found.touches.nominal_points is not None
        assert found.missed == ("P2",)
        inch = read_dmis(written(tmp_path, DMIS_OUTPUT.replace("UNITS/MM", "UNITS/INCH"), "i"), 3.0)
        assert inch.touches.positions[0, 2] == pytest.approx(0.01 * 25.4 + 3.0)
        assert read_dmis(tmp_path / "file.txt", 0.0).touches.positions[0, 2] == 0.01

    def test_features_are_named(self, tmp_path: Path) -> None:
        found = read_dmis(written(tmp_path, DMIS_OUTPUT), 3.0)
        assert found.warnings == ("features are left out, because they are not touches: C1 CIRCLE",)
        circles = "FA(C1)=FEAT/CIRCLE,INNER,CART,50,50,40,0,0,1,50\n"
        with pytest.raises(InputError, match=r"contains features \(C1 CIRCLE\), but no measured"):
            read_dmis(written(tmp_path, circles))
        with pytest.raises(InputError, match="is this a program"):
            read_dmis(written(tmp_path, "F(P1)=FEAT/POINT,CART,0,0,0,0,0,1\nMEAS/POINT,F(P1),1\n"))

    @pytest.mark.parametrize(
        ("text", "taken_off", "words"),
        [
            (DMIS_OUTPUT, None, "give the subtracted radius"),
            (DMIS_OUTPUT, -1.0, "a radius in mm, or 0"),
            (DMIS_OUTPUT.replace("UNITS/MM, ANGDEC\n", ""), 0.0, "no UNITS"),
            (DMIS_OUTPUT.replace("UNITS/MM", "UNITS/FEET"), 0.0, "MM and INCH are read"),
            (DMIS_OUTPUT.replace("0.01, 0,0,1", "0.01, 0,0,0"), 0.0, "zeros, or angles"),
            (DMIS_OUTPUT.replace("0.01, 0,0,1", "0.01, 90,90,0"), 0.0, "zeros, or angles"),
            (DMIS_OUTPUT.replace("Feat/Point, CART", "FEAT/POINT,POL"), 0.0, "CART is read"),
            (DMIS_OUTPUT + "FA(P1)=FEAT/POINT,CART,0,0,0,0,0,1\n", 0.0, "occurs twice"),
            ("PNT1 =FEAT/POINT,CARTESIAN\n", 0.0, "PC-DMIS"),
        ],
    )
    def test_refused(self, tmp_path: Path, text: str, taken_off: float | None, words: str) -> None:
        with pytest.raises(InputError, match=words):
            read_dmis(written(tmp_path, text), taken_off)
