"""Commands of the calibration laboratory: contract, files, messages."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.probe.catalogue import load_probe
from tests.conftest import EXAMPLES
from tests.unit.test_command_line import rows, run

SPHERE, PART = EXAMPLES / "sphere_touches.csv", EXAMPLES / "part_touches.csv"
READINGS = EXAMPLES / "redundancy_24x24.csv"
TRACES = sorted((EXAMPLES / "rig").glob("*.csv"))


class TestQualify:
    def test_physical_then_compensate(self, tmp_path: Path) -> None:
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind",
                   "physical", "--verbose", "-o", tmp_path / "map.nc")  # fmt: skip
        assert "Six-seat probe" in text
        assert "first harmonic" in text
        run("compensate", PART, "--map", tmp_path / "map.nc", "-o", tmp_path / "points.csv")
        u = np.array([float(row["u_um"]) for row in rows(tmp_path / "points.csv")])
        assert len(u) == 140
        assert np.all((u > 0.3) & (u < 0.5))

    def test_wozniak(self, tmp_path: Path) -> None:
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind",
                   "wozniak", "-o", tmp_path / "map.csv", "--plot",
                   tmp_path / "map.png", "--verbose")  # fmt: skip
        assert "lobes found at azimuth" in text
        assert (tmp_path / "map.png").stat().st_size > 10_000

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--kind", "magic"], "there are mean, sectors, wozniak, harmonic, physical, auto"),
            (["--kind", "wozniak", "--transducer", "laser"], "not one of 'contact', 'piezo'"),
            (["--lobe-azimuth", "30"], "go with --kind wozniak"),
        ],
    )
    def test_errors_teach(self, options: list[str], words: str) -> None:
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, *options, code=2)
        assert words in text


class TestRig:
    COLUMNS = ("trace", "r0_mm", "r1_mm", "r2_mm", "r3_mm", "pretravel_um", "hysteresis_um")

    def test_csv(self, tmp_path: Path) -> None:
        text = run("rig", *TRACES, "-o", tmp_path / "rig.csv", "--plot", tmp_path / "rig.png")
        found = rows(tmp_path / "rig.csv")
        assert tuple(found[0])[:7] == self.COLUMNS
        assert [row["trace"] for row in found] == [path.stem for path in TRACES]
        for row in found:
            pretravel = (float(row["r1_mm"]) - float(row["r0_mm"])) * 1e3
            assert float(row["pretravel_um"]) == pytest.approx(pretravel, abs=1e-6)
        assert "anisotropy" in text
        assert "expanded, 95 %" in text

    def test_json(self, tmp_path: Path) -> None:
        run("rig", *TRACES, "-o", tmp_path / "rig.json")
        document = json.loads((tmp_path / "rig.json").read_text())
        assert [d["azimuth_deg"] for d in document["directions"]] == pytest.approx([0, 60, 90])
        assert len(document["touches"]) == len(TRACES)
        assert document["repeatability_um"]["low"] < document["repeatability_um"]["value"]

    def test_certificate_states_what_a_laboratory_must(self, tmp_path: Path) -> None:
        template = run("laboratory")
        lab = tmp_path / "lab.toml"
        filled = template.replace('number = ""', 'number = "C-17"', 1)
        lab.write_text(filled.replace('name = ""', 'name = "Lab <A>"', 1), encoding="utf-8")
        run("rig", *TRACES, "--lab", lab, "-o", tmp_path / "certificate.html")
        page = (tmp_path / "certificate.html").read_text(encoding="utf-8")
        for words in (
            "Calibration certificate C-17", "Lab &lt;A&gt;", "not stated", "traceable to the SI",
            "expanded, 95 %", "may not be reproduced", "@page", "Serial number", "Temperature",
        ):  # fmt: skip
            assert words in page
        assert page.count("data:image/png") == 2

    def test_map_to_compensate_with(self, tmp_path: Path) -> None:
        """At its directions the map has their mean pretravel; between them it is linear."""
        from pretravel.directions import from_angles
        from pretravel.formats.map_file import read_map

        run("rig", *TRACES, "-o", tmp_path / "rig.json", "--map", tmp_path / "map.nc",
            "--tip-diameter", 6)  # fmt: skip
        directions = json.loads((tmp_path / "rig.json").read_text())["directions"]
        made = read_map(tmp_path / "map.nc")
        n = from_angles(np.full(3, np.pi / 2), np.radians([d["azimuth_deg"] for d in directions]))
        assert made.pretravel(n) * 1e3 == pytest.approx([d["pretravel_um"] for d in directions])
        u = made.standard_uncertainty(n) * 1e3
        assert np.all(u > [d["u_pretravel_um"] for d in directions])
        assert "--tip-diameter" in run("rig", *TRACES, "--map", tmp_path / "m.nc", code=2)

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

    def test_one_trace(self, tmp_path: Path) -> None:
        text = run("rig", TRACES[0], "--plot", tmp_path / "one.png")
        assert "nothing was repeated" in text

    def test_bad_input(self, tmp_path: Path) -> None:
        bad = tmp_path / "bad.csv"
        lines = TRACES[0].read_text().splitlines()
        bad.write_text("\n".join([lines[0], *lines[1:50], lines[50][:-1] + "2", *lines[51:]]))
        assert "bad.csv, line 51: trigger is 2" in run("rig", bad, code=2)
        bad.write_text("time_s,ruler_mm\n0,0\n")
        assert "laser_mm" in run("rig", bad, code=2)
        assert "given twice" in run("rig", TRACES[0], TRACES[0], code=2)
        lab = tmp_path / "lab.toml"
        lab.write_text("[laboratory]\ncolour = 'red'\n")
        page = tmp_path / "page.html"
        assert "has no colour" in run("rig", TRACES[0], "--lab", lab, "-o", page, code=2)


class TestSeparate:
    def test_csv(self, tmp_path: Path) -> None:
        text = run("separate", READINGS, "--repeat-variance", 0.74, "--repeat-pair", "1,1",
                   "--repeat-count", 200, "--pair", "2,5", "-o", tmp_path / "s.csv")  # fmt: skip
        found = rows(tmp_path / "s.csv")
        assert list(found[0]) == [
            "kind", "index", "systematic_um", "u_systematic_um", "variance_um2", "u_variance_um2",
        ]  # fmt: skip
        assert [row["kind"] for row in found] == ["machine"] * 24 + ["probe"] * 24
        assert [int(row["index"]) for row in found] == [*range(1, 25)] * 2
        machine = np.array([float(row["systematic_um"]) for row in found[:24]])
        assert machine.sum() == pytest.approx(0.0, abs=1e-6)
        assert all(float(row["variance_um2"]) >= 0.0 for row in found)
        assert "rank 47 of 48" in text.replace("\n" + " " * 21, " ")
        assert "pair (2, 5): variance" in text

    def test_page_json_and_picture(self, tmp_path: Path) -> None:
        run("separate", READINGS, "-o", tmp_path / "s.html", "--plot", tmp_path / "s.png")
        assert "data:image/png" in (tmp_path / "s.html").read_text()
        run("separate", READINGS, "--method", "least-squares", "-o", tmp_path / "s.json")
        document = json.loads((tmp_path / "s.json").read_text())
        assert np.array(document["pair_variance_um2"]).shape == (24, 24)

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--repeat-variance", "0.8"], "together, or neither"),
            (["--repeat-variance", "0.8", "--repeat-pair", "25,1"], "no reading has machine"),
            (["--method", "magic"], "not one of 'reml', 'least-squares'"),
            (["--pair", "1.5,2"], "whole numbers"),
            (["--repeat-variance", "-1", "--repeat-pair", "1,1"], "positive"),
        ],
    )
    def test_errors_teach(self, options: list[str], words: str) -> None:
        assert words in run("separate", READINGS, *options, code=2)

    def test_plan_is_a_form_that_reads_back(self, tmp_path: Path) -> None:
        form = tmp_path / "form.csv"
        text = run("separation-plan", "--directions", 12, "--variance", 0.5, "--u-systematic", 0.3,
                   "-o", form)  # fmt: skip
        assert "turn the probe to" in text
        lines = form.read_text().splitlines()
        filled = [lines[0], *(f"{line}{0.1 * (i % 7):.2f}" for i, line in enumerate(lines[1:]))]
        form.write_text("\n".join(filled) + "\n")
        assert "12 machine and 12 probe" in run("separate", form).replace("\n" + " " * 21, " ")
        # A cell left empty is a reading that was not made.
        count = len(filled) - 1
        form.write_text("\n".join([*filled[:5], lines[5], *filled[6:]]) + "\n")
        assert f"{count - 1} readings" in run("separate", form)
        assert "say what is wanted" in run("separation-plan", code=2)


class TestStandards:
    def test_pattern_simulate_check(self, tmp_path: Path) -> None:
        targets, touches = tmp_path / "t.csv", tmp_path / "s.csv"
        run("pattern", "iso10360-5", "--diameter", 25, "--center", "1,2,3", "-o", targets)
        assert len(rows(targets)) == 25
        run("simulate", "omp40-2", "--surface", "sphere:radius=12.5,x=1,y=2,z=3", "--targets",
            targets, "-o", touches)  # fmt: skip
        text = run("check", "iso10360-5", touches, "--diameter", 25, "--tip-diameter", 6,
                   "--form-limit", 3, "--size-limit", 3, "-o", tmp_path / "c.html")  # fmt: skip
        assert "recalled" in text
        assert "conforms" in text
        assert "does not conform" in text  # not compensated: the size is a mean pretravel off

    def test_map_puts_form_and_size_right(self, tmp_path: Path) -> None:
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "physical",
            "-o", tmp_path / "map.nc")  # fmt: skip
        run("check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--map", tmp_path / "map.nc",
            "-o", tmp_path / "after.csv")  # fmt: skip
        run("check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6,
            "-o", tmp_path / "before.csv")  # fmt: skip
        before, after = (
            [abs(float(row["value_um"])) for row in rows(tmp_path / f"{name}.csv")]
            for name in ("before", "after")
        )
        # 25 touches of 0.3 um scatter over 4 sigma, 1.2 um, beside the size's 0.1 um.
        assert before[0] > 5.0 > 2.0 > after[0]
        assert before[1] > 20.0 > 0.6 > after[1]

    def test_iso230_10(self) -> None:
        text = run("check", "iso230-10", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6)
        assert all(figure in text for figure in ("P_FTU,2D", "P_FTU,3D", "R_SPT"))

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["iso9999", SPHERE, "--diameter", 25], "there are iso10360-5, iso230-10"),
            (["iso10360-5", PART, "--diameter", 25], "not the 25 points"),
            (["iso10360-5", SPHERE, "--diameter", 12.5, "--tip-diameter", 6], "check --diameter"),
            (
                ["iso10360-5", SPHERE, "--diameter", 25, "--u-diameter", -1],
                "greater than or equal to 0",
            ),
            (["iso10360-5", SPHERE, "--diameter", 25, "--size-limit", 1], "give --tip-diameter"),
            (["iso230-10", SPHERE, "--diameter", 25, "--size-limit", 1], "go with iso10360-5"),
        ],
    )
    def test_errors_teach(self, arguments: list[object], words: str) -> None:
        assert words in run("check", *arguments, code=2)


class TestIdentify:
    @pytest.mark.parametrize("ending", ["nc", "csv"])
    def test_description_from_a_map(self, tmp_path: Path, ending: str) -> None:
        """A map predicted from a changed description gives that description back."""
        from pretravel.probe.catalogue import description_text, rewritten

        changed = tmp_path / "changed.toml"
        text = rewritten(
            description_text("omp40-2-100mm"),
            {"spring.preload_N": (7.0, ""), "orientation.rotation_deg": (17.0, ""),
             "tripod.radius_mm": (15.0, "")},
        )  # fmt: skip
        changed.write_text(text, encoding="utf-8")
        run("predict", changed, "--azimuth", "0:350:10", "--polar", "0:90:10",
            "-o", tmp_path / f"map.{ending}")  # fmt: skip
        run("identify", tmp_path / f"map.{ending}", "--probe", "omp40-2-100mm", "--free",
            "preload,tripod_radius,rotation", "-o", tmp_path / "found.toml",
            "--plot", tmp_path / "left.png")  # fmt: skip
        found = load_probe(tmp_path / "found.toml")
        assert found.preload == pytest.approx(7.0, rel=1e-4)
        assert found.tripod.radius == pytest.approx(15.0, rel=1e-4)
        assert np.degrees(found.orientation.rotation) % 120.0 == pytest.approx(17.0, abs=0.01)
        written = (tmp_path / "found.toml").read_text(encoding="utf-8")
        assert "# axis to the points where the rods rest" in written
        assert f"identified from map.{ending}" in written

    def test_what_the_map_does_not_tell(self, tmp_path: Path) -> None:
        run("predict", "omp40-2", "--azimuth", "0:350:10", "--polar", "0:90:10",
            "-o", tmp_path / "map.nc")  # fmt: skip
        from pretravel.formats.map_file import read_map
        from pretravel.identification.probe import identify

        found = identify(
            read_map(tmp_path / "map.nc"), load_probe("omp40-2"), ["lever", "tripod_radius"]
        )
        assert any("undone by" in sentence for sentence in found.unknown)

    def test_a_probe_of_another_kind_widens_u(self) -> None:
        """Woźniak's lobes are no six-seat probe's: said, and u is of the size of what is missed."""
        from pretravel.formats.touches_csv import read_touches
        from pretravel.identification.kinds import qualify
        from pretravel.identification.probe import identify

        made = qualify(read_touches(SPHERE), 24.9987, tip_diameter=6.0, kind="wozniak")
        sharp = replace(made.pretravel_map, covariance=1e-4 * made.pretravel_map.covariance)
        found = identify(sharp, load_probe("omp40-2-100mm"), ["rotation", "stem_diameter"])
        assert any("another kind" in sentence for sentence in found.unknown)
        true = identify(
            qualify(read_touches(SPHERE), 24.9987, tip_diameter=6.0, kind="physical").pretravel_map,
            load_probe("omp40-2-100mm"),
            ["rotation", "stem_diameter"],
        )
        off = np.abs(found.values - true.values)
        assert np.all(off < 4.0 * found.standard_uncertainty + 4.0 * true.standard_uncertainty)

    @pytest.mark.parametrize(
        ("free", "words"), [("magic", "what can is preload"), ("", "nothing is free")]
    )
    def test_errors_teach(self, tmp_path: Path, free: str, words: str) -> None:
        run("predict", "omp40-2", "--azimuth", "0:350:30", "--polar", "0:90:30",
            "-o", tmp_path / "map.nc")  # fmt: skip
        text = run("identify", tmp_path / "map.nc", "--probe", "omp40-2", "--free", free, code=2)
        assert words in text


class TestPredict:
    @pytest.mark.parametrize("model", ["ren", "wozniak"])
    def test_models_of_the_other_papers(self, tmp_path: Path, model: str) -> None:
        run("predict", "omp40-2", "--model", model, "--azimuth", "0:350:10", "--polar", "90",
            "-o", tmp_path / "map.csv")  # fmt: skip
        found = rows(tmp_path / "map.csv")
        shares = [name for name in found[0] if name.startswith("share_")]
        for row in found:
            total = sum(float(row[name]) for name in shares)
            assert total == pytest.approx(float(row["pretravel_um"]), abs=1e-9)
        value = np.array([float(row["pretravel_um"]) for row in found])
        assert value.argmax() % 12 == 6  # opposite a rod
