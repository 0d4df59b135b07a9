"""Result files of Fusion: read with the line of an error, written without loss."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.logs.fusion import read_fusion, write_fusion
from pretravel.files.touches_csv import read_touches
from pretravel.touches import Touches
from tests.support.control_logs import (
    FUSION_HAAS,
    written,
)
from tests.support.examples import EXAMPLES


def example_touches() -> Touches:
    touches = read_touches(EXAMPLES / "part_touches.csv")
    return replace(touches, labels=tuple(f"p{i + 1}" for i in range(len(touches))))


class TestFusion:
    def test_inches_run_together_words_and_a_miss(self, tmp_path: Path) -> None:
        found = read_fusion(written(tmp_path, FUSION_HAAS), "inch")
        assert found.touches.labels == ("12-1",)
        assert found.missed == ("12-2",)
        assert found.tip_radius == pytest.approx(0.0345 * 25.4)
        radius, normal = float(found.tip_radius or 0), found.touches.normals[0]
        surface = (found.touches.positions[0] - radius * normal) / 25.4
        assert surface == pytest.approx([-0.440743, 0.530540, -0.0753], abs=1e-6)
        assert found.touches.nominal_points is not None
        nominal = found.touches.nominal_points[0] / 25.4
        assert float((surface - nominal) @ normal) == pytest.approx(-0.001966, abs=1e-6)

    def test_turned_work_plane(self, tmp_path: Path) -> None:
        """A published pair: points in a rotated plane, and the same points rotated back (4
        decimals).
        """
        turned = (
            "START\nG330 N0 A-45.0 B-72.766 C0.0 X0.0 Y0.0 Z0.0 I0 R0\n"
            "G800 N1 X164.31 Y-42.453 Z97.652 I0.1707 J0.9091 K0.38 O0U0.01L-0.01\n"
            "G801 N1 X164.7686Y-40.006Z98.7278R2.9471\n"
            "G330 N42 A160.0 B-87.234 C180.0 X0.0 Y0.0 Z0.0 I0 R0\n"
            "G800 N43 X188.278 Y23.094 Z48.113 I-0.0318 J-0.9842 K0.1744 O0U0.01L-0.01\n"
            "G801 N43 X188.1761Y19.9397Z48.7242R2.9471\nEND\n"
        )
        found = read_fusion(written(tmp_path, turned), "mm").touches
        assert found.positions[0] == pytest.approx([-44.8784, 41.5226, 186.4354], abs=1e-4)
        assert found.positions[1] == pytest.approx([-48.0014, 35.4018, 186.0765], abs=1e-4)
        assert found.normals[0] == pytest.approx([0.4079, 0.9115, 0.0522], abs=1e-4)
        assert found.nominal_points is not None
        assert found.nominal_points[1] == pytest.approx([-46.3551, 38.1569, 186.258], abs=1e-4)

    @pytest.mark.parametrize(
        ("text", "line", "words"),
        [
            (FUSION_HAAS.replace("Y-0.76927", "").replace("J-0.76927", ""), 5, "G800 has no J"),
            (FUSION_HAAS.replace("G801 N1", "G801 N3"), 6, "G801 is of point 3"),
            (FUSION_HAAS.replace("Y.5040", "Y.5040 Y0.0"), 6, "the letter Y occurs twice"),
            (FUSION_HAAS.replace("X-.4187", "X-.41?87"), 6, "is neither a letter nor a number"),
            ("START\nG801 N1 X0 Y0 Z0 R1\nEND\n", 2, "without a G800"),
            (FUSION_HAAS.replace("I0.63893", "I0.1"), 5, "must be a unit vector"),
            (
                FUSION_HAAS.replace(
                    "G800 N2",
                    FUSION_HAAS[FUSION_HAAS.index("G800") : FUSION_HAAS.index("G800 N2")]
                    + "G800 N2",
                ),
                8,
                "occurs twice",
            ),
            ("START\nEND\n", None, "no measured point"),
            (FUSION_HAAS + "G800 N3 X0 Y0 Z0 I0 J0 K1\n", 9, "a point after END"),
            (FUSION_HAAS.replace("X1.", "X1.2E-3"), 7, "neither a letter nor a number"),
        ],
    )
    def test_refused_with_its_line(
        self, tmp_path: Path, text: str, line: int | None, words: str
    ) -> None:
        with pytest.raises(InputError, match=words) as caught:
            read_fusion(written(tmp_path, text), "inch")
        assert line is None or f"line {line}:" in str(caught.value)

    def test_out_and_in_again_to_the_last_digit(self, tmp_path: Path) -> None:
        touches = example_touches()
        labels = touches.labels or ()
        write_fusion(tmp_path / "x.msr", touches.positions, touches.normals,
                     touches.nominal_points, labels, 3.0)  # fmt: skip
        again = read_fusion(tmp_path / "x.msr", "mm")
        assert again.touches.labels == touches.labels
        assert np.array_equal(again.touches.positions, touches.positions)
        assert np.array_equal(again.touches.nominal_points, touches.nominal_points)  # type: ignore[arg-type]
        # Normals are scaled to length one again: the last digit of a double.
        assert again.touches.normals == pytest.approx(touches.normals, abs=4e-16)
        assert again.tip_radius == 3.0
