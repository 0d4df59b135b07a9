"""Print files of controls: features, not touches."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.controls.logs.print_file import read_print_file
from pretravel.files import SourceFile
from tests.support.commands import rows, run
from tests.support.control_logs import (
    PRINT_FILE,
    written,
)


class TestPrintFile:
    def test_features(self, tmp_path: Path) -> None:
        found = read_print_file(written(tmp_path, PRINT_FILE), "mm")
        assert [(f.component, f.feature, f.quantity) for f in found] == [
            (1, 2, "SIZE D"), (1, 2, "POSN X")]  # fmt: skip
        assert found[0].tolerance == 0.1
        assert found[1].deviation == 0.01

    def test_numbers_of_part_and_feature_in_lines_of_their_own(self, tmp_path: Path) -> None:
        row = "SIZE D71.0000  ACTUAL 71.9072  TOL 0.1000  DEV 0.9072\n"
        text = f"COMPONENT NO 1\nFEATURE NO 1\n{row}FEATURE NO 2\n{row}COMPONENT NO: 2\n{row}"
        path = written(tmp_path, text)
        found = read_print_file(path, "mm")
        assert [(f.component, f.feature) for f in found] == [(1, 1), (1, 2), (2, 0)]
        run("convert", path, "--units", "mm", "-o", tmp_path / "f.csv")
        assert [row["tolerance"] for row in rows(tmp_path / "f.csv")] == ["0.1"] * 3

    def test_lengths_of_inches_are_mm_and_angles_stay(self, tmp_path: Path) -> None:
        """An inch is 25.4 mm, which a printed angle does not contain."""
        text = PRINT_FILE + "ANG X 45.0000   ACTUAL 45.0200   TOL 0.1000   DEV .0200\n"
        size, position, angle = read_print_file(written(tmp_path, text), "inch")
        assert size.nominal == pytest.approx(25.4 * 71.0, rel=1e-15)
        assert size.actual == pytest.approx(25.4 * 71.9072, rel=1e-15)
        assert size.deviation == pytest.approx(25.4 * 0.9072, rel=1e-15)
        assert size.tolerance == pytest.approx(2.54, rel=1e-15)
        assert position.nominal == pytest.approx(254.0, rel=1e-15)
        assert (angle.nominal, angle.actual, angle.deviation) == (45.0, 45.02, 0.02)
        assert angle.tolerance == 0.1

    def test_deviation_that_is_not_the_difference(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match=r"line 4: DEV 0\.5 is not ACTUAL"):
            read_print_file(written(tmp_path, PRINT_FILE.replace("DEV 0.9072", "DEV 0.5")), "mm")

    def test_it_is_a_table_not_touches(self, tmp_path: Path) -> None:
        path = written(tmp_path, PRINT_FILE)
        assert "no touches" in run("convert", path, "--units", "mm", "-o", tmp_path / "f.csv")
        assert rows(tmp_path / "f.csv")[0]["quantity"] == "SIZE D"
        assert "features" in run("qualify", path, "--diameter", 25, code=2)


def test_units_of_a_print_out() -> None:
    """Above the results they hold; among them they change what follows."""
    row = "SIZE D1.0000 ACTUAL 1.0010 DEV .0010\n"
    found = read_print_file(SourceFile("p.txt", f"UNITS INCH\n{row}".encode()))
    assert found[0].nominal == 25.4
    with pytest.raises(InputError, match="in inch, not in mm"):
        read_print_file(SourceFile("p.txt", f"UNITS INCH\n{row}".encode()), "mm")
    with pytest.raises(InputError, match="line 2: 'UNITS INCH' gives a unit among the results"):
        read_print_file(SourceFile("p.txt", f"{row}UNITS INCH\n{row}".encode()), "mm")
