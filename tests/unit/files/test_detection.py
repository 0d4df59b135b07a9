"""Formats are recognised by their content; what a format needs is asked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.controls.logs.log_lines import read_log_positions
from pretravel.controls.machine_text import machine_text
from pretravel.files import format_registry, text_table
from pretravel.files.file_format import ReadingOptions
from pretravel.files.format_registry import FORMATS, format_of
from pretravel.files.machine import Machine, work_placement
from pretravel.files.readings import read_readings
from pretravel.files.row_statements import statement_rows
from pretravel.files.source_file import SourceFile
from tests.support.commands import run
from tests.support.control_logs import (
    DMIS_OUTPUT,
    FUSION_HAAS,
    GRBL_LOG,
    OWN_LOG,
    PLAN,
    PRINT_FILE,
    PROBEOPEN_ROW,
    QIF_FILE,
    written,
)


def test_a_large_file_counts_from_the_beginning(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The workbench shows what is logged: which format a file has takes as long as reading it."""
    for room in (format_registry, text_table):
        monkeypatch.setattr(room, "COUNTED", 100)
    caplog.set_level("INFO", "pretravel")
    row = "p,12.345,-23.456,34.567,0.6,0.0,0.8\n"  # of words too: of no known format
    file = SourceFile("long.csv", ("Nr,X_mm,Y_mm,Z_mm,I,J,K\n" + 250 * row).encode())
    read_readings(file)
    said = [record.getMessage() for record in caplog.records]
    formats = [words for words in said if words.startswith("long.csv: compared with format")]
    assert formats[0] == f"long.csv: compared with format 1 of {len(FORMATS)}"
    assert len(formats) > 10
    rows = [words for words in said[said.index(formats[-1]) :] if words.endswith("rows read")]
    assert rows == ["long.csv: 100 of 251 rows read", "long.csv: 200 of 251 rows read"]


class TestCatalogue:
    @pytest.mark.parametrize(
        ("text", "name"),
        [
            (OWN_LOG, "linuxcnc"),
            ("1 2 3 0 0 0 0 0 0\n", "probeopen"),
            ("G1 X1.0 Y2.0 Z3.0\n", "positions"),
            (GRBL_LOG, "grbl"),
            (FUSION_HAAS, "fusion"),
            (QIF_FILE, "qif"),
            (DMIS_OUTPUT, "dmis"),
            (PRINT_FILE, "print"),
            ("x_mm,y_mm,z_mm,nx,ny,nz\n", "csv"),
        ],
    )
    def test_formats_are_recognised(self, tmp_path: Path, text: str, name: str) -> None:
        assert format_of(written(tmp_path, text)).name == name
        assert name in FORMATS

    def test_every_format_states_what_it_is_for(self) -> None:
        """The tables of docs/formats.md are made from these fields."""
        for entry in FORMATS.values():
            assert entry.what
            assert entry.refusal or (entry.verified and (entry.reads or entry.writes)), entry.name
            stated = (*entry.columns, *entry.statements)
            for row in statement_rows(entry.name, stated, entry.other_lines):
                assert row.startswith(f"| `{entry.name}` | ")

    def test_labels_like_coordinates_are_no_positions(self, tmp_path: Path) -> None:
        text = "label,x_mm,y_mm,z_mm,nx,ny,nz\nX1,0,0,3,0,0,1\nx2,1,0,3,0,0,1\n"
        assert format_of(written(tmp_path, text)).name == "csv"

    def test_a_log_below_the_header_of_a_table_is_a_log(self) -> None:
        """The header alone does not decide: rows below it have its width."""
        head = b"x_mm,y_mm,z_mm,nx,ny,nz\n"
        assert format_of(SourceFile("a.csv", head + b"0,0,3,0,0,1\n")).name == "csv"
        assert format_of(SourceFile("a.csv", head + GRBL_LOG.encode())).name == "grbl"

    def test_a_file_that_needs_more_says_what(self, tmp_path: Path) -> None:
        path = written(tmp_path, FUSION_HAAS)
        told = run("qualify", path, "--diameter", 25, code=2)
        assert "does not give its units" in told
        assert "(--units)" in told

    def test_positions_want_the_plan_that_was_run(self, tmp_path: Path) -> None:
        path = written(tmp_path, "G21\nG1 X0 Y0 Z2.99\n")
        with pytest.raises(InputError, match="give the plan that was run"):
            read_readings(path, ReadingOptions())
        with pytest.raises(InputError, match="the tip's diameter is needed"):
            read_readings(path, ReadingOptions(plan=PLAN))
        found = read_readings(path, ReadingOptions(plan=PLAN, tip_radius=3.0))
        assert found.touches.labels == ("a",)

    def test_a_plan_that_is_not_used_is_named(self, tmp_path: Path) -> None:
        path = written(tmp_path, "x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n")
        found = read_readings(path, ReadingOptions(plan=PLAN, tip_radius=3.0))
        assert "the plan was not used" in found.notes()[-1]
        both = ReadingOptions(plan=PLAN, tip_radius=3.0, normal=(0.0, 0.0, 1.0))
        assert "the plan and the normal were not used" in read_readings(path, both).notes()[-1]
        assert "plan" not in " ".join(read_readings(path, ReadingOptions()).notes())

    def test_turn_of_positions_comes_from_the_machine_file(self, tmp_path: Path) -> None:
        log = written(tmp_path, "G21\nG1 X0 Y0 Z2.99\n")
        (tmp_path / "plan.csv").write_text("label,x_mm,y_mm,z_mm,nx,ny,nz\na,0,0,0,0,0,1\n")
        mill = tmp_path / "mill.toml"
        mill.write_text(machine_text(Machine(work=work_placement(1, 2, 3, 0.5))))
        given = ["--plan", tmp_path / "plan.csv", "--machine", mill, "-o", tmp_path / "t.csv"]
        assert "turned by 28.6479°" in run("convert", log, *given, code=2)
        run("convert", log, *given, "--frame", "machine")
        found = read_readings(log, ReadingOptions(plan=PLAN, tip_radius=3.0, overtravel=2.0))
        assert "no rotation is assumed" in found.notes()[-1]

    def test_decimal_commas(self, tmp_path: Path) -> None:
        path = written(tmp_path, PROBEOPEN_ROW.format(x=0.0).replace(".", ","))
        with pytest.raises(InputError, match="use a point as decimal sign"):
            read_readings(path, ReadingOptions(units="mm", plan=PLAN, tip_radius=3.0))

    def test_lines_of_dprnt_are_positions(self, tmp_path: Path) -> None:
        """As a Fanuc prints X#5061[44]Y#5062[44]Z#5063[44]: blanks may stand for zeros."""
        path = written(tmp_path, "%\nX  212.3787Y  -87.8937Z -124.7300\nX1.0000Y2.0000Z3.0000\n%\n")
        assert format_of(path).name == "positions"
        found = read_log_positions(path, "mm").positions
        assert found.tolist() == [[212.3787, -87.8937, -124.73], [1.0, 2.0, 3.0]]

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("G1 X0 Y0 Z2.99\n", "does not give its units"),
            ("G20\nG1 X0 Y0\n", "has no Z"),
            ("G21\nG1 X0 Y0 Z1\nhello\n", "line 3: 'hello' is not a position"),
            ("G21\nG1 X0 Y0 Z2,990\n", "line 2: .*use points as decimal signs"),
            ("G21\nG1 X1.2.3 Y0 Z1\n", "line 2: .* is not a position"),
            ("G21 G91\nG1 X0 Y0 Z1\n", "line 1: G91"),
            ("G21\nX0 Y0 Z1 A0\nX0 Y0 Z1 A90\n", "line 3: the rotary axis A has moved"),
        ],
    )
    def test_log_lines_refused(self, tmp_path: Path, text: str, words: str) -> None:
        with pytest.raises(InputError, match=words):
            read_log_positions(written(tmp_path, text))
