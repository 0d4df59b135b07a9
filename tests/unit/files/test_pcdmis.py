"""Routines of PC-DMIS as text: which points are touches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.logs.pcdmis import read_pc_dmis
from tests.support.control_logs import PC_DMIS_ROUTINE, written


class TestPcDmis:
    def test_points_and_hits_are_touches_features_are_not(self, tmp_path: Path) -> None:
        found = read_pc_dmis(written(tmp_path, PC_DMIS_ROUTINE), 3.0, "mm")
        touches = found.touches
        assert touches.labels == ("PNT1", "CIR1-1", "CIR1-2", "F8")
        # Surface points plus the radius along the normal; that of a bore points inwards.
        assert touches.positions == pytest.approx(
            np.array([[0, 0, 8.012], [17.011, 0, -2], [2.991, 0, -2], [7.5, 2, 8.01]])
        )
        assert touches.nominal_points is not None
        assert touches.nominal_points[2].tolist() == [0, 0, -2]
        assert "2 features" in found.warnings[0]
        assert found.warnings[0].endswith("left out: CIR2, F7")

    def test_tip_centres_in_inches(self, tmp_path: Path) -> None:
        found = read_pc_dmis(written(tmp_path, PC_DMIS_ROUTINE), 0.0, "inch")
        assert found.touches.positions[0].tolist() == pytest.approx([0, 0, 5.012 * 25.4])

    @pytest.mark.parametrize(("tip", "told"), [("T2A0B0", True), ("T1A90B0", False)])
    def test_a_shank_that_the_tip_does_not_name_is_named(
        self, tmp_path: Path, tip: str, told: bool
    ) -> None:
        text = f"TIP/{tip}, SHANKIJK=0, 1, 0, ANGLE=0\n{PC_DMIS_ROUTINE}"
        said = " ".join(read_pc_dmis(written(tmp_path, text), 3.0, "mm").warnings)
        assert (f"the shank is not along z: {tip} along 0, 1, 0 (line 1)" in said) == told

    def test_points_without_compensation_are_tip_centres(self, tmp_path: Path) -> None:
        file = written(tmp_path, f"PROBECOM/OFF\n{PC_DMIS_ROUTINE}")
        centres = read_pc_dmis(written(tmp_path, PC_DMIS_ROUTINE, "b"), 0.0, "mm").touches
        assert np.array_equal(read_pc_dmis(file, None, "mm").touches.positions, centres.positions)
        with pytest.raises(InputError, match="line 1: the tip's radius was not subtracted"):
            read_pc_dmis(file, 3.0, "mm")

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("CIR2 ", "A2 =ALIGNMENT/START\nCIR2 ", "line 16: this line changes the coordinates"),
            (
                "SNAP=NO\nCIR1 ",
                "SNAP=NO\nturn the part\nCIR1 ",
                "line 8: this line changes the meaning",
            ),
            ("CIR2 ", "PART NAME : A\nCIR2 ", "line 16: this line changes the part"),
            ("ACTL/7.5,2,5.01,0,0,1", "", "F8 has no THEO or no ACTL"),
            ("FEAT/POINT,RECT\nTHEO/7.5,2,5", "FEAT/POINT,POLR\nTHEO/7.5,2,5", "polar"),
            ("<0,0,5>,<0,0,1>\n            ACTL", "<0,0,5>,<0,0,2>\n            ACTL", "length 2"),
            ("<20.011,0,-2>", "<20.011,0>", "line 12: the feature CIR1 has a hit with 8"),
            ("<20.011,0,-2>", "<20.011,0,-2.x>", "'-2.x' is not a finite number"),
            ("F8 ", "PNT1 ", "PNT1 occurs twice"),
            ("ACTL/<0,0,5.012>,<0,0,1>", "ACTL/<0,0,5.01", "line 5: this line is cut off"),
            ("ACTL/7.5,2,5.01,0,0,1", "ACTL/7.5,2,5.0", "F8 has 6 and 3 numbers"),
            ("F7 ", "F6 =FEAT/LINE\nHIT/BASIC,1,2,3,0,0,1,1,2,3.0\nF7 ", "hit is cut off"),
        ],
    )
    def test_refused(self, tmp_path: Path, old: str, new: str, words: str) -> None:
        assert old in PC_DMIS_ROUTINE
        with pytest.raises(InputError, match=words):
            read_pc_dmis(written(tmp_path, PC_DMIS_ROUTINE.replace(old, new)), 3.0, "mm")

    def test_a_routine_that_was_not_run(self, tmp_path: Path) -> None:
        """Offline, PC-DMIS copies THEO to ACTL."""
        text = "P1 =FEAT/POINT,CARTESIAN\nTHEO/<0,0,5>,<0,0,1>\nACTL/<0,0,5>,<0,0,1>\n"
        with pytest.raises(InputError, match="was not run"):
            read_pc_dmis(written(tmp_path, text), 3.0, "mm")

    def test_features_alone(self, tmp_path: Path) -> None:
        text = "C1 =FEAT/CIRCLE,CARTESIAN,IN\nTHEO/<0,0,5>,<0,0,1>,8\nACTL/<0,0,5>,<0,0,1>,8\n"
        with pytest.raises(InputError, match="contains no touches"):
            read_pc_dmis(written(tmp_path, text), 3.0, "mm")

    def test_what_the_text_does_not_state(self, tmp_path: Path) -> None:
        path = written(tmp_path, PC_DMIS_ROUTINE)
        with pytest.raises(InputError, match="give the subtracted radius"):
            read_pc_dmis(path, None, "mm")
        with pytest.raises(InputError, match="give the units"):
            read_pc_dmis(path, 3.0)
