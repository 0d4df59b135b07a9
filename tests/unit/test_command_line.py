"""The command line as a contract: names, options, columns, exit codes, messages."""

from __future__ import annotations

import contextlib
import csv
import io
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from pretravel.cli import main
from tests.conftest import EXAMPLES

SPHERE, PART = EXAMPLES / "sphere_touches.csv", EXAMPLES / "part_touches.csv"


def run(*arguments: object, code: int = 0) -> str:
    """Run in this process; gives stdout, or stderr where an error is expected."""
    out, err = io.StringIO(), io.StringIO()
    stopped = 0
    with (
        pytest.MonkeyPatch.context() as patch,
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        patch.setattr(sys, "argv", ["pretravel", *map(str, arguments)])
        try:
            main.run()
        except SystemExit as stop:
            stopped = int(stop.code or 0)
    assert stopped == code, out.getvalue() + err.getvalue()
    assert "Traceback" not in err.getvalue()
    return out.getvalue() if code == 0 else err.getvalue()


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def positions(path: Path) -> np.ndarray:
    return np.array([[float(row[k]) for k in ("x_mm", "y_mm", "z_mm")] for row in rows(path)])


class TestPredict:
    COLUMNS = (
        "polar_deg",
        "azimuth_deg",
        "trigger_force_N",
        "sensing_distance_um",
        "pretravel_um",
        "seat",
    )

    @pytest.mark.parametrize("model", ["shen", "analytic"])
    def test_columns_and_order(self, tmp_path: Path, model: str) -> None:
        out = tmp_path / "map.csv"
        options = ["--azimuth", "0:60:10", "--polar", "10:90:10", "-o", out]
        lever = ["--lever", 50]
        run("predict", "omp40-2", "--model", model, *lever, *options)
        table = rows(out)
        assert list(table[0])[:6] == list(self.COLUMNS)
        shares = [name for name in table[0] if name.startswith("share_")]
        assert shares
        assert all(name.endswith("_um") for name in shares)
        angles = [(float(r["polar_deg"]), float(r["azimuth_deg"])) for r in table]
        assert angles == [(p, a) for p in range(10, 91, 10) for a in range(0, 61, 10)]
        for row in table:
            total = sum(float(row[name]) for name in shares)
            assert total == pytest.approx(float(row["pretravel_um"]), rel=1e-9, abs=1e-12)

    def test_force_at_90_degrees(self, tmp_path: Path) -> None:
        """0.9657 N: azimuth 0 of the first line of the reference notes, lever 50 mm."""
        out = tmp_path / "map.csv"
        run("predict", "omp40-2", "--model", "shen", "--lever", 50, "--azimuth", 0, "--polar", 90,
            "-o", out)  # fmt: skip
        assert float(rows(out)[0]["trigger_force_N"]) == pytest.approx(0.9657, abs=5e-5)

    def test_own_description(self, tmp_path: Path) -> None:
        text = run("probes", "omp40-2")
        mine = tmp_path / "mine.toml"
        mine.write_text(text.replace("preload_N = 5.91", "preload_N = 4.0"))
        out = tmp_path / "map.json"
        assert "0.507" in run("predict", mine, "--azimuth", 0, "--polar", 90, "-o", out)

    def test_a_predicted_map_compensates(self, tmp_path: Path) -> None:
        for ending in (".nc", ".csv"):
            out = tmp_path / f"map{ending}"
            run("predict", "omp40-2-100mm", "-o", out)
            run("compensate", PART, "--map", out, "-o", tmp_path / "points.csv")
            assert len(rows(tmp_path / "points.csv")) == 140

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["omp41"], "neither a probe of the catalogue"),
            (["omp40-2", "--model", "magic"], "there are analytic, fem, ren, shen, wozniak"),
            (["omp40-2", "--azimuth", "0:10"], "--azimuth 0:10"),
            (["omp40-2", "--azimuth", "0:10:0"], "step above 0"),
            (["omp40-2", "--polar", "178"], "never triggers"),
            (["omp40-2", "--polar", "200"], "between 0 and 180"),
            (["omp40-2", "--polar", "nan"], "--polar nan"),
            (["omp40-2", "--workpiece", "cheese"], "there are aluminium"),
            (["omp40-2", "--lever", "10"], "shorter than the stylus"),
            (["omp40-2", "--lever", "-10", "--model", "shen"], "positive"),
            (["omp40-2", "-o", "map.xyz"], "the ending must be"),
            (["omp40-2", "-o", "no/such/folder/map.csv"], "does not exist"),
            (["omp40-2", "--plot", "map.bmp"], "the ending must be"),
            (["omp40-2", "--gravity", "down"], "three numbers"),
        ],
    )
    def test_errors_teach(
        self, arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        assert words in run("predict", *arguments, code=2)
        assert not list(tmp_path.iterdir())


class TestMainJob:
    def test_qualify_then_compensate(self, tmp_path: Path) -> None:
        saved, points = tmp_path / "map.nc", tmp_path / "points.csv"
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "-o", saved,
                   "--plot", tmp_path / "q.png")  # fmt: skip
        assert "repeatability      0.32 µm (50 degrees of freedom)" in text
        assert "OUTLIER" not in text
        run("compensate", PART, "--map", saved, "-o", points, "--plot", tmp_path / "p.png")
        table = rows(points)
        assert list(table[0]) == [
            "label", "x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "pretravel_um", "u_um",
            "deviation_um",
        ]  # fmt: skip
        assert len(table) == 140
        part = rows(PART)
        for given, found in zip(part, table, strict=True):
            normal = np.array([float(given[k]) for k in ("nx", "ny", "nz")])
            reading = np.array([float(given[k]) for k in ("x_mm", "y_mm", "z_mm")])
            point = np.array([float(found[k]) for k in ("x_mm", "y_mm", "z_mm")])
            # Equation 3.36, by hand; 1e-7: normals are given with seven decimals.
            expected = reading - (3.0 - float(found["pretravel_um"]) * 1e-3) * normal
            assert np.allclose(point, expected, atol=1e-6)
        for picture in ("q.png", "p.png"):
            assert (tmp_path / picture).read_bytes()[:4] == b"\x89PNG"

    @pytest.mark.parametrize("kind", ["mean", "sectors"])
    def test_other_kinds(self, kind: str, tmp_path: Path) -> None:
        saved = tmp_path / "map.nc"
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", kind, "-o",
            saved)  # fmt: skip
        run("compensate", PART, "--map", saved, "-o", tmp_path / "points.nc")

    def test_without_a_tip_diameter_points_are_the_same_but_for_the_height(
        self, tmp_path: Path
    ) -> None:
        """The mean pretravel is unknown then, and so is the axial gauge."""
        found = []
        for extra in (["--tip-diameter", 6, "--axial-pretravel", "none"], []):
            run("qualify", SPHERE, "--diameter", 24.9987, *extra, "-o", tmp_path / "map.nc")
            run("compensate", PART, "--map", tmp_path / "map.nc", "-o", tmp_path / "points.csv")
            found.append(
                [
                    [float(r[k]) for k in ("x_mm", "y_mm", "z_mm")]
                    for r in rows(tmp_path / "points.csv")
                ]
            )
        assert np.allclose(found[0], found[1], atol=1e-6)

    def test_refuses_directions_outside(self, tmp_path: Path) -> None:
        lines = SPHERE.read_text().splitlines()
        upper = [lines[0], *(line for line in lines[1:] if float(line.split(",")[5]) > 0.5)]
        (tmp_path / "upper.csv").write_text("\n".join(upper))
        saved = tmp_path / "map.nc"
        run("qualify", tmp_path / "upper.csv", "--diameter", 24.9987, "-o", saved)
        message = run("compensate", SPHERE, "--map", saved, "-o", tmp_path / "p.csv", code=2)
        assert "lie outside the map" in message
        assert not (tmp_path / "p.csv").exists()
        run("compensate", SPHERE, "--map", saved, "-o", tmp_path / "p.csv", "--extrapolate")

    def test_warns_of_another_feed(self, tmp_path: Path) -> None:
        for name, feed in (("slow.csv", 50), ("fast.csv", 500)):
            lines = SPHERE.read_text().splitlines()
            text = "\n".join([f"{lines[0]},feed_mm_min", *(f"{v},{feed}" for v in lines[1:])])
            (tmp_path / name).write_text(text)
        saved, points = tmp_path / "map.nc", tmp_path / "points.csv"
        run("qualify", tmp_path / "slow.csv", "--diameter", 24.9987, "-o", saved)
        result = CliRunner().invoke(
            main.app,
            ["compensate", str(tmp_path / "fast.csv"), "--map", str(saved), "-o", str(points)],
        )
        assert result.exit_code == 0
        assert "50 mm/min" in result.stderr


def test_pages(tmp_path: Path) -> None:
    """One file with the numbers and a picture in it."""
    saved = tmp_path / "map.nc"
    options = ["--diameter", 24.9987, "--tip-diameter", 6]
    run("qualify", SPHERE, *options, "-o", saved)
    pages = {
        "q.html": (["qualify", SPHERE, *options], "repeatability"),
        "c.html": (["compensate", PART, "--map", saved], "140 points"),
        "p.html": (["predict", "omp40-2"], "trigger force"),
    }
    for name, (arguments, words) in pages.items():
        run(*arguments, "-o", tmp_path / name)
        page = (tmp_path / name).read_text()
        assert words in page
        assert "data:image/png;base64," in page


class TestFilesAreSafe:
    def test_inputs_are_not_overwritten(self, tmp_path: Path) -> None:
        own = tmp_path / "own.csv"
        own.write_bytes(SPHERE.read_bytes())
        saved = tmp_path / "map.nc"
        run("qualify", own, "--diameter", 24.9987, "-o", saved)
        for arguments in (
            ["qualify", own, "--diameter", 24.9987, "-o", own],
            ["compensate", own, "--map", saved, "-o", own],
            ["compensate", own, "--map", saved, "-o", saved],
        ):
            assert "would be overwritten" in run(*arguments, code=2)
        assert own.read_bytes() == SPHERE.read_bytes()

    def test_a_bad_picture_stops_before_the_map_is_written(self, tmp_path: Path) -> None:
        saved = tmp_path / "map.nc"
        arguments = ["--diameter", 24.9987, "-o", saved, "--plot", tmp_path / "picture.bmp"]
        assert "picture.bmp" in run("qualify", SPHERE, *arguments, code=2)
        assert not saved.exists()

    @pytest.mark.parametrize(
        "extra",
        [
            ["--u-diameter", "nan"],
            ["--u-diameter", "-1"],
            ["--axial-pretravel", "1e9"],
            ["--axial-pretravel", "nan"],
            ["--axis", "nan,0,1"],
            ["--axis", "0,0"],
            ["--kind", "magic"],
        ],
    )
    def test_nonsense_options(self, extra: list[str]) -> None:
        message = run("qualify", SPHERE, "--diameter", 24.9987, *extra, code=2)
        assert extra[1] in message

    def test_inches_in_compensate_are_warned_of(self, tmp_path: Path) -> None:
        head, *lines = PART.read_text().splitlines()
        inches = [head]
        for line in lines:
            values = [float(cell) for cell in line.split(",")]
            inches.append(
                ",".join(str(v if 3 <= i < 6 else v / 25.4) for i, v in enumerate(values))
            )
        (tmp_path / "inches.csv").write_text("\n".join(inches))
        saved, points = tmp_path / "map.nc", tmp_path / "points.csv"
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "-o", saved)
        arguments = ["compensate", tmp_path / "inches.csv", "--map", saved, "-o", points]
        result = CliRunner().invoke(main.app, [str(a) for a in arguments])
        assert "of the size of the tip radius" in result.stderr


class TestSimulate:
    def test_targets_that_do_not_fit_are_warned_of(self, tmp_path: Path) -> None:
        targets = tmp_path / "t.csv"
        targets.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,0,0,0,1\n")
        arguments = ["simulate", "omp40-2", "--surface", "plane:polar=40", "--targets", targets]
        result = CliRunner().invoke(
            main.app, [*(str(a) for a in arguments), "-o", str(tmp_path / "o.csv")]
        )
        assert "up to 40.0° away" in result.stderr

    def _targets(self, path: Path) -> Path:
        path.write_text("nx,ny,nz,label\n0,0,1,top\n1,0,0,side\n0,0.6,0.8,slope\n")
        return path

    def test_sphere_and_back(self, tmp_path: Path) -> None:
        """Touched and compensated with the same probe's map, the sphere comes back: to what
        linear interpolation over 1° leaves."""
        targets, touches = self._targets(tmp_path / "t.csv"), tmp_path / "touches.csv"
        ball = "sphere:radius=12.5,x=5"
        run("simulate", "omp40-2", "--surface", ball, "--targets", targets, "-o", touches,
            "--plot", tmp_path / "s.png")  # fmt: skip
        run(
            "predict",
            "omp40-2",
            "--azimuth",
            "0:359:1",
            "--polar",
            "0:90:1",
            "-o",
            tmp_path / "m.nc",
        )
        points = tmp_path / "points.csv"
        run("compensate", touches, "--map", tmp_path / "m.nc", "--nominal", ball, "-o", points)
        table = rows(points)
        assert [r["label"] for r in table] == ["top", "side", "slope"]
        assert all(abs(float(r["deviation_um"])) < 0.02 for r in table)

    def test_plane_by_hand(self, tmp_path: Path) -> None:
        """P = T + (r - pretravel) n, with the pretravel that predict gives for that normal."""
        targets, touches = tmp_path / "t.csv", tmp_path / "touches.csv"
        normal = (np.sin(np.radians(40)), 0.0, np.cos(np.radians(40)))
        targets.write_text(
            "x_mm,y_mm,z_mm,nx,ny,nz\n0,0,0," + ",".join(f"{v:.15g}" for v in normal) + "\n"
        )
        run("simulate", "omp40-2", "--surface", "plane:polar=40,azimuth=0", "--targets", targets,
            "-o", touches)  # fmt: skip
        run("predict", "omp40-2", "--polar", 40, "--azimuth", 0, "-o", tmp_path / "m.csv")
        pretravel = float(rows(tmp_path / "m.csv")[0]["pretravel_um"]) * 1e-3
        row = rows(touches)[0]
        position = [float(row[k]) for k in ("x_mm", "y_mm", "z_mm")]
        assert np.allclose(position, (3.0 - pretravel) * np.array(normal), atol=1e-11)

    def test_noise_repeats_with_its_seed(self, tmp_path: Path) -> None:
        targets = self._targets(tmp_path / "t.csv")
        texts = []
        for name, seed in (("a", 1), ("b", 1), ("c", 2)):
            out = tmp_path / f"{name}.csv"
            run("simulate", "omp40-2", "--surface", "sphere:radius=12.5", "--targets", targets,
                "--noise", 0.3, "--seed", seed, "-o", out)  # fmt: skip
            texts.append(out.read_text())
        assert texts[0] == texts[1] != texts[2]

    def test_delay_travels_along_the_approach(self, tmp_path: Path) -> None:
        targets = self._targets(tmp_path / "t.csv")
        position = []
        for name, extra in (("a", []), ("b", ["--feed", 50, "--delay", 14.5])):
            out = tmp_path / f"{name}.csv"
            run("simulate", "omp40-2", "--surface", "sphere:radius=12.5", "--targets", targets,
                "-o", out, *extra)  # fmt: skip
            position.append(positions(out))
        travel = position[0] - position[1]
        normals = [[0, 0, 1], [1, 0, 0], [0, 0.6, 0.8]]
        assert np.allclose(travel, 50 / 60 * 0.0145 * np.array(normals), atol=1e-9)

    @pytest.mark.parametrize(
        ("surface", "extra", "words"),
        [
            ("cube:a=3", [], "not a shape"),
            ("sphere:", [], "needs radius="),
            ("sphere:radius=-3", [], "must be positive"),
            ("sphere:radius=12.5,q=3", [], "not understood"),
            ("sphere:radius=12.5,radius=12", [], "there twice"),
            ("plane", [], "needs polar="),
            ("plane:polar=400", [], "between 0 and 180"),
            ("sphere:radius=twelve", [], "not a number"),
            ("plane:polar=90", [], "cannot be touched"),
            ("sphere:radius=12.5", ["--friction", "-0.1"], "cannot be negative"),
            ("sphere:radius=12.5", ["--approach", "file"], "ax, ay, az"),
            ("sphere:radius=12.5", ["--approach", "sideways"], "not one of 'normal', 'file'"),
            ("sphere:radius=12.5", ["--delay", "5"], "give the feed"),
            ("sphere:radius=12.5", ["--noise", "-1"], "cannot be negative"),
        ],
    )
    def test_errors_teach(self, surface: str, extra: list[str], words: str, tmp_path: Path) -> None:
        out = tmp_path / "touches.csv"
        targets = tmp_path / "t.csv"
        targets.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,12.5,0,0,1\n12.5,0,0,-1,0,0\n")
        arguments = ["--surface", surface, "--targets", targets, "-o", out, *extra]
        assert words in run("simulate", "omp40-2", *arguments, code=2)
        assert not out.exists()


def test_help_everywhere() -> None:
    for command in ((), ("predict",), ("simulate",), ("qualify",), ("compensate",), ("probes",)):
        text = run(*command, "--help")
        assert "Example:" in text


def test_probes_lists_and_prints() -> None:
    assert "omp40-2-100mm" in run("probes")
    assert run("probes", "omp40-2").startswith("name = ")
    assert "neither a probe of the catalogue" in run("probes", "tp20", code=2)


def test_probes_draws_and_checks(tmp_path: Path) -> None:
    mine, picture = tmp_path / "mine.toml", tmp_path / "probe.png"
    mine.write_text(run("probes", "omp40-2"))
    assert "a valid description" in run("probes", mine, "--plot", picture)
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert "draws one probe" in run("probes", "--plot", picture, code=2)


def test_a_missing_option_is_named() -> None:
    assert "--diameter" in run("qualify", SPHERE, code=2)


def test_demo(tmp_path: Path) -> None:
    text = run("demo", "--data", EXAMPLES, "-o", tmp_path / "out")
    assert "harmonic map" in text
    made = {path.name for path in (tmp_path / "out").iterdir()}
    pictures = {"qualification.png", "points.png", "compare.png", "kp3_ring.png"}
    assert made == {"index.html", "map.nc", "points.csv", *pictures}
    page = (tmp_path / "out" / "index.html").read_text()
    assert all(name in page for name in pictures)


def test_demo_elsewhere() -> None:
    assert "no such folder" in run("demo", "--data", "nowhere", code=2)
