"""DMIS output files."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import ReadingOptions
from pretravel.files.logs.dmis import read_dmis
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
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

    def test_definitions_of_sensors_do_not_choose_a_tip(self) -> None:
        sensors = "".join(
            f"S({name})=SNSDEF/PROBE,INDEX,POL,0,0,0,0,1,100,{diameter}\n"
            for name, diameter in (("T1", 6), ("T2", 3))
        )
        point = "SNSLCT/S({0})\nFA({0})=FEAT/POINT,CART,0,0,1,0,0,1\n"
        one = SourceFile("a.dmo", f"UNITS/MM\n{point.format('T1')}{sensors}".encode())
        found = read_readings(one, ReadingOptions(radius_taken_off=3.0))
        assert found.touches.words["tip"] == ("T1",)
        assert any("not read: line 5 'S(T2)=SNSDEF" in said for said in found.warnings)
        two = SourceFile(
            "a.dmo", f"UNITS/MM\n{sensors}{point.format('T1')}{point.format('T2')}".encode()
        )
        assert len(read_readings(two, ReadingOptions(radius_taken_off=1.5, tip="T2")).touches) == 1
        with pytest.raises(InputError, match="line 3: this line gives the tip T2 a diameter of 3"):
            read_readings(two, ReadingOptions(radius_taken_off=3.0, tip="T2"))

    @pytest.mark.parametrize(
        ("stated", "given", "height"),
        [
            ("PRCOMP/OFF\n", None, 1.0),
            ("PRCOMP/OFF\n", 1.5, "line 2: PRCOMP/OFF"),
            ("PRCOMP/ON\n", 1.5, 2.5),
            ("PRCOMP/ON\n", 0.0, "line 2: PRCOMP/ON"),
            ("PRCOMP/ON\n", None, "give this radius"),
            ("PRCOMP/ON\nS(T)=SNSDEF/PROBE,FIXED,CART,0,0,9,0,0,1,4\nSNSLCT/S(T)\n", None, 3.0),
        ],
    )
    def test_what_the_file_says_of_the_radius(
        self, stated: str, given: float | None, height: float | str
    ) -> None:
        text = f"UNITS/MM,ANGDEC\n{stated}FA(P)=FEAT/POINT,CART,0,0,1,0,0,1\n"
        file = SourceFile("a.dmo", text.encode())
        if isinstance(height, str):
            with pytest.raises(InputError, match=height):
                read_dmis(file, given)
        else:
            assert read_dmis(file, given).touches.positions[0, 2] == height

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
            (DMIS_OUTPUT + DMIS_OUTPUT.replace("P1", "P3"), 0.0, "the part or the series"),
            ("PNT1 =FEAT/POINT,CARTESIAN\n", 0.0, "PC-DMIS"),
        ],
    )
    def test_refused(self, tmp_path: Path, text: str, taken_off: float | None, words: str) -> None:
        with pytest.raises(InputError, match=words):
            read_dmis(written(tmp_path, text), taken_off)
