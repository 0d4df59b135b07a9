"""pretravel rig: tables, certificate, map, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pretravel.files.csv_table import read_csv_table
from pretravel.show.result_file import read_result
from tests.support.commands import both_outputs, rows, run
from tests.support.examples import EXAMPLES
from tests.support.results import data_of

TRACES = sorted((EXAMPLES / "rig").glob("*.csv"))


class TestRig:
    COLUMNS = ("trace", "r0_mm", "r1_mm", "r2_mm", "r3_mm", "pretravel_um", "hysteresis_um")

    def test_csv(self, tmp_path: Path) -> None:
        text = run(
            "rig", *TRACES, "-o", tmp_path / "rig.csv", "--plot", tmp_path / "rig.png", "--verbose"
        )
        found = rows(tmp_path / "rig.csv")
        assert tuple(found[0])[:7] == self.COLUMNS
        assert [row["trace"] for row in found] == [path.stem for path in TRACES]
        for row in found:
            pretravel = (float(row["r1_mm"]) - float(row["r0_mm"])) * 1e3
            assert float(row["pretravel_um"]) == pytest.approx(pretravel, abs=1e-6)
        assert "anisotropy" in text
        assert "expanded, 95.45 %" in text

    @pytest.mark.parametrize("place", ["", "rig_*_?.csv", "rig_0[06]*.csv"])
    def test_a_folder_and_wildcards(self, tmp_path: Path, place: str) -> None:
        """As they come from Windows and from quotes: the shell did not expand them."""
        folder = EXAMPLES / "rig"
        (tmp_path / "rig").mkdir()
        for path in (*TRACES, EXAMPLES / "rig_budget.csv"):
            (tmp_path / "rig" / path.name).write_bytes(path.read_bytes())
        copies = [tmp_path / "rig" / f"rig_000_{repeat}.csv" for repeat in range(5, 10)]
        for copy in copies:
            copy.write_bytes(TRACES[0].read_bytes())
        told = " ".join(both_outputs("rig", tmp_path / "rig" / place)[1].split())
        assert "rig_000_7 and 2 more: the readings are those of rig_000_1" in told
        for copy in copies:
            copy.unlink()
        run("rig", tmp_path / "rig" / place, "-o", tmp_path / "rig.csv")
        expected = [p.stem for p in TRACES if not place or folder.joinpath(p.name).match(place)]
        assert [row["trace"] for row in rows(tmp_path / "rig.csv")] == expected

    def test_nothing_that_matches_is_said_with_what_is_there(self, tmp_path: Path) -> None:
        told = run("rig", EXAMPLES / "rig" / "trace*.csv", code=2)
        assert "no file has a name like this" in told
        assert "rig_000_1.csv" in told
        (tmp_path / "touches.csv").touch()
        told = run("rig", tmp_path, code=2)
        assert "no file of traces (rig_AZIMUTH_REPEAT.csv)" in told
        assert "touches.csv" in told

    def test_json(self, tmp_path: Path) -> None:
        run("rig", *TRACES, "-o", tmp_path / "rig.json")
        found = data_of(tmp_path / "rig.json")
        assert [d["azimuth_deg"] for d in found["Directions"]] == pytest.approx([0, 60, 90])
        touches = found["Touches"]
        assert [touch["trace"] for touch in touches] == [path.stem for path in TRACES]
        assert touches[0]["pretravel_um"] == pytest.approx(
            1e3 * (touches[0]["r1_mm"] - touches[0]["r0_mm"]), abs=1e-9
        )
        (overall,) = found["Performance"]
        assert overall["repeatability_low_um"] < overall["repeatability_um"]
        (budget,) = found["Budgets"]
        assert budget["expanded_um"] == pytest.approx(
            budget["coverage_factor"] * budget["combined_um"]
        )

    def test_certificate_states_what_a_laboratory_must(self, tmp_path: Path) -> None:
        template = run("laboratory")
        lab = tmp_path / "lab.toml"
        filled = template.replace('number = ""', 'number = "C-17"', 1)
        lab.write_text(filled.replace('name = ""', 'name = "Lab <A>"', 1), encoding="utf-8")
        run("rig", *TRACES, "--lab", lab, "-o", tmp_path / "certificate.html")
        page = (tmp_path / "certificate.html").read_text(encoding="utf-8")
        for words in (
            "Calibration certificate C-17", "Lab &lt;A&gt;", "not stated", "traceable to the SI",
            "expanded, 95.45 %", "may not be reproduced", "@page", "Serial number", "Temperature",
        ):  # fmt: skip
            assert words in page
        assert page.count("data:image/") == 3  # directions, a touch, budget

    def test_a_certificate_warns_of_what_it_lacks_and_begins_with_results(
        self, tmp_path: Path
    ) -> None:
        run("rig", *TRACES, "-o", tmp_path / "certificate.json")
        content = read_result(tmp_path / "certificate.json")
        assert content.template == "certificate.html"
        shown = " ".join(content.document.warnings)
        assert "of another laboratory" in shown
        assert "fields of the certificate are empty" in shown
        (tmp_path / "lab.toml").write_text('[laboratory]\nname = "North Ltd"\n', "utf-8")
        run("rig", *TRACES, "--lab", tmp_path / "lab.toml", "-o", tmp_path / "named.json")
        named = " ".join(read_result(tmp_path / "named.json").document.warnings)
        assert "19 fields of lab.toml are empty" in named
        assert "µm in" in content.document.verdict
        assert "U up to" in content.document.verdict

    def test_the_file_of_the_laboratory_is_read_once(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Its feed is compared with that of the traces, 3 mm/min, from what was read."""
        import pretravel.files as files

        read, reads = files.read_laboratory, []
        monkeypatch.setattr(files, "read_laboratory", lambda path: reads.append(path) or read(path))
        lab = tmp_path / "lab.toml"
        lab.write_text('[method]\nfeed = "3 mm/min"\n', "utf-8")
        run("rig", *TRACES, "--lab", lab)
        assert reads == [lab]
        lab.write_text('[method]\nfeed = "30 mm/min"\n', "utf-8")
        assert "lab.toml contradicts the traces" in run("rig", *TRACES, "--lab", lab, code=2)

    def test_a_moved_mark_moves_the_result_and_widens_u(self, tmp_path: Path) -> None:
        before, after = tmp_path / "before.csv", tmp_path / "after.csv"
        run("rig", *TRACES, "-o", before)
        first = read_csv_table(before)
        r0 = float(first.numbers("r0_mm")[0, 0])
        run("rig", *TRACES, "-o", after, "--mark", f"{TRACES[0].stem}:r0={r0 + 0.001!r}")
        second = read_csv_table(after)
        moved = (second.numbers("pretravel_um") - first.numbers("pretravel_um"))[:, 0]
        # pretravel is r1 - r0 (Ren 2020, equation 2): 1 µm less, of this trace alone.
        assert moved[0] == pytest.approx(-1.0, abs=1e-6)
        assert moved[1:] == pytest.approx(0.0, abs=1e-12)
        # It may lie anywhere within 1 µm of where it was: a rectangle on both sides (GUM 4.3.7).
        u = [table.numbers("u_r0_um")[:, 0] for table in (first, second)]
        assert u[1][0] == pytest.approx(math.hypot(u[0][0], 1.0 / math.sqrt(3.0)), rel=1e-8)
        assert u[1][1:] == pytest.approx(u[0][1:], rel=1e-12)
        text = run("rig", *TRACES, "--mark", "rig_999_9:r0=1", code=2)
        assert "there is no trace rig_999_9 to mark" in text

    def test_map_to_compensate_with(self, tmp_path: Path) -> None:
        """In its directions the map has their mean pretravel; between them it is linear."""
        from pretravel.base.directions import from_angles
        from pretravel.files.map_file import read_map

        run("rig", *TRACES, "-o", tmp_path / "rig.json", "--map", tmp_path / "map.json",
            "--tip-diameter", 6)  # fmt: skip
        directions = data_of(tmp_path / "rig.json")["Directions"]
        made = read_map(tmp_path / "map.json")
        n = from_angles(np.full(3, np.pi / 2), np.radians([d["azimuth_deg"] for d in directions]))
        assert made.pretravel(n) * 1e3 == pytest.approx([d["pretravel_um"] for d in directions])
        u = made.standard_uncertainty(n) * 1e3
        assert np.all(u > [d["u_pretravel_um"] for d in directions])
        given = ("rig", *TRACES, "--map", tmp_path / "m.json")
        assert "--tip-diameter" in run(*given, code=2)
        told = run(*given, "--tip-diameter", 2, "--probe", "omp40-2", code=2)
        assert "has a diameter of 6 mm, and 2 is given" in told
        lab = tmp_path / "lab.toml"
        lab.write_text('[method]\nfeed = "600 mm/min"\n', encoding="utf-8")
        told = " ".join(run("rig", *TRACES, "--lab", lab, code=2).split())
        assert "gives '600 mm/min', and their rod has 3 mm/min" in told

    @pytest.mark.long
    def test_a_bad_trace_is_left_out(self, tmp_path: Path) -> None:
        """Its trigger comes 80 samples of 1 ms late, at 0.05 mm/s."""
        lines = [line.split(",") for line in TRACES[0].read_text().splitlines()]
        head, cells = lines[0], lines[1:]
        trigger = np.array([row[4] for row in cells])
        for row, level in zip(cells, np.concatenate([trigger[:80], trigger[:-80]]), strict=True):
            row[4] = str(level)
        bad = tmp_path / "rig_000_3.csv"
        bad.write_text("\n".join(",".join(line) for line in [head, *cells]))
        text = run("rig", *TRACES, bad, "-o", tmp_path / "rig.json").replace("\n  ", " ")
        assert "rig_000_3 lies" in text
        assert "instead of" in text
        run("rig", *TRACES, "-o", tmp_path / "good.json")
        found, good = (data_of(tmp_path / name) for name in ("rig.json", "good.json"))
        assert found["Directions"] == good["Directions"]
        assert [outlier["trace"] for outlier in found["Outliers"]] == ["rig_000_3"]
        without, contained = found["Performance"]
        assert (without["outliers"], contained["outliers"]) == ("left out", "contained")
        assert contained["repeatability_um"] > 10.0 * without["repeatability_um"]
        run("rig", *TRACES, bad, "--exclude", "rig_090_1", "-o", tmp_path / "rig.csv")
        reasons = {row["trace"]: row["left_out"] for row in rows(tmp_path / "rig.csv")}
        assert (reasons["rig_000_3"], reasons["rig_090_1"]) == ("outlier", "excluded")
        assert "--exclude" in run("rig", *TRACES, "--exclude", "rig_7_7", code=2)

    def test_implausible_traces(self, tmp_path: Path) -> None:
        """Micrometres in a file of millimetres; two probes at once."""
        lines = [line.split(",") for line in TRACES[0].read_text().splitlines()]
        wrong = [lines[0], *([a, str(float(b) * 1e3), str(float(c) * 1e3), d, e]
                             for a, b, c, d, e in lines[1:])]  # fmt: skip
        path = tmp_path / "um_000_1.csv"
        path.write_text("\n".join(",".join(line) for line in wrong))
        assert "are ruler_mm and laser_mm in mm" in run("rig", path, code=2).lower()
        path.write_text(TRACES[0].read_text())
        assert "two names" in run("rig", TRACES[0], path, code=2)

    def test_budget_with_a_word(self, tmp_path: Path) -> None:
        path = tmp_path / "b.csv"
        path.write_text("source,type,uncertainty_um,per_metre_um\nscale,B,abc,0\n")
        assert "line 2: uncertainty_um is 'abc'" in run("rig", *TRACES, "--budget", path, code=2)

    @pytest.mark.long
    def test_a_damaged_trace_is_left_out_as_advised(self, tmp_path: Path) -> None:
        """The advice was to exclude the line, which a trace does not take, and --exclude of the
        trace gave the same error."""
        bad = tmp_path / "rig_000_3.csv"
        lines = TRACES[0].read_text().splitlines()
        bad.write_text("\n".join([*lines[:49], lines[49].replace(",", ",abc", 1), *lines[50:]]))
        told = run("rig", *TRACES, bad, code=2)
        assert "Or leave this trace out (--exclude)" in told
        assert "exclude the line" not in told
        for name in ("rig_000_3", "rig_000_3.csv"):
            text = run("rig", *TRACES, bad, "--exclude", name)
            assert "left out as requested: rig_000_3" in text
            assert "1 trace is not in the results" in text
        assert "rig_000_3.csv, line 50" in run(
            "rig", *TRACES, bad, "--exclude", "rig_090_1", code=2
        )

    def test_one_trace(self, tmp_path: Path) -> None:
        text = run("rig", TRACES[0], "--plot", tmp_path / "one.png")
        assert text.startswith("1 trace, 1 direction\n")
        assert "nothing was repeated" in text

    def test_bad_input(self, tmp_path: Path) -> None:
        bad = tmp_path / "bad.csv"
        lines = TRACES[0].read_text().splitlines()
        bad.write_text("\n".join([lines[0], *lines[1:50], lines[50][:-1] + "2", *lines[51:]]))
        assert "bad.csv, line 51: trigger is 2" in run("rig", bad, code=2)
        bad.write_text("\n".join([f"{lines[0]},feed_mm_min", *(f"{row},60" for row in lines[1:])]))
        assert "a rig trace has no column 'feed_mm_min'" in run("rig", bad, code=2)
        bad.write_text("time_s,ruler_mm\n0,0\n")
        assert "laser_mm" in run("rig", bad, code=2)
        assert "given twice" in run("rig", TRACES[0], TRACES[0], code=2)
        lab = tmp_path / "lab.toml"
        lab.write_text("[laboratory]\ncolour = 'red'\n")
        page = tmp_path / "page.html"
        assert "has no colour" in run("rig", TRACES[0], "--lab", lab, "-o", page, code=2)
