"""pretravel simulate: round trip, noise, delay, errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from pretravel.base import FloatArray
from pretravel.cli import main
from tests.support.commands import positions, rows, run
from tests.support.examples import EXAMPLES


class TestSimulate:
    def test_targets_that_do_not_fit_are_warned_of(self, tmp_path: Path) -> None:
        targets = tmp_path / "t.csv"
        targets.write_text("x_mm,y_mm,z_mm,nx,ny,nz,tip,spindle_deg,A\n0,0,0,0,0,1,left,90,30\n")
        arguments = ["simulate", "omp40-2", "--surface", "plane:polar=40", "--targets", targets]
        result = CliRunner().invoke(
            main.app, [*(str(a) for a in arguments), "-o", str(tmp_path / "o.csv")]
        )
        assert "differ from the surface's by up to 40.0°" in result.stderr
        assert "state tip left, spindle_deg 90, A 30, which is not used" in result.stderr

    def _targets(self, path: Path) -> Path:
        path.write_text("nx,ny,nz,label\n0,0,1,top\n1,0,0,side\n0,0.6,0.8,slope\n")
        return path

    @pytest.mark.long
    def test_sphere_and_back(self, tmp_path: Path) -> None:
        """Touched and compensated with the map of the same probe, the sphere is reproduced, to the
        error of linear interpolation over 1°."""
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
            tmp_path / "m.json",
        )
        points = tmp_path / "points.csv"
        run("compensate", touches, "--map", tmp_path / "m.json", "--nominal", ball, "-o", points)
        table = rows(points)
        assert [r["label"] for r in table] == ["top", "side", "slope"]
        assert all(abs(float(r["deviation_um"])) < 0.02 for r in table)

    def test_plane_by_hand(self, tmp_path: Path) -> None:
        """P = T + (r - pretravel) n, with the pretravel of predict for this normal."""
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
            ("cube:a=3", [], "is not a known shape"),
            ("sphere:", [], "radius= is missing"),
            ("sphere:radius=-3", [], "must be positive"),
            ("sphere:radius=12.5,q=3", [], "is not a parameter"),
            ("sphere:radius=12.5,radius=12", [], "given twice"),
            ("plane", [], "polar= is missing"),
            ("plane:polar=400", [], "between 0 and 180"),
            ("sphere:radius=twelve", [], "not a number"),
            ("plane:polar=90", [], "cannot be touched"),
            ("sphere:radius=12.5", ["--friction", "-0.1"], "--friction -0.1"),
            ("sphere:radius=12.5", ["--approach", "file"], "ax, ay, az"),
            ("sphere:radius=12.5", ["--approach", "sideways"], "not one of 'normal', 'file'"),
            ("sphere:radius=12.5", ["--delay", "5"], "give the feed too (--feed)"),
            ("sphere:radius=12.5", ["--noise", "-1"], "--noise -1"),
            # The default of the workpiece, typed with a model that has none.
            ("sphere:radius=12.5", ["--model", "shen", "--workpiece", "steel"], "is not used with"),
        ],
    )
    def test_errors_teach(self, surface: str, extra: list[str], words: str, tmp_path: Path) -> None:
        out = tmp_path / "touches.csv"
        targets = tmp_path / "t.csv"
        targets.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,12.5,0,0,1\n12.5,0,0,-1,0,0\n")
        arguments = ["--surface", surface, "--targets", targets, "-o", out, *extra]
        assert words in run("simulate", "omp40-2", *arguments, code=2)
        assert not out.exists()


def test_oblique_approaches_of_a_file_are_chosen_or_refused(tmp_path: Path) -> None:
    """They were passed over; those along the normal need no word."""
    targets, out = tmp_path / "t.csv", tmp_path / "touches.csv"
    common = ("omp40-2", "--surface", "sphere:radius=12.5", "--targets", targets, "-o", out)
    for row, words, ax in (
        ("0.6,0,-0.8", (), None),
        ("0.6,0,-0.8", ("--approach", "file"), 0.6),
        ("0.6,0,-0.8", ("--approach", "normal"), 0.0),
        ("0,0,-1", (), 0.0),
    ):
        targets.write_text(f"nx,ny,nz,ax,ay,az\n0,0,1,{row}\n")
        said = run("simulate", *common, *words, code=2 if ax is None else 0)
        if ax is None:
            assert "line 2: the approach (columns ax, ay, az) is 36.9° off the normal" in said
        else:
            assert float(rows(out)[0]["ax"]) == ax


def test_the_friction_of_the_tip_is_that_of_the_touch(tmp_path: Path) -> None:
    """mu of [tip], Wozniak's, and --friction are one quantity; two values are refused."""
    described = (EXAMPLES / "wozniak_tp2_probe.toml").read_text()
    smooth, rough = tmp_path / "smooth.toml", tmp_path / "rough.toml"
    smooth.write_text(described)
    rough.write_text(described.replace("[tip]\n", "[tip]\nfriction = 0.2\n"))
    assert rough.read_text() != described
    targets = tmp_path / "targets.csv"
    targets.write_text("nx,ny,nz\n0.8,0,0.6\n0,0.6,0.8\n1,0,0\n")
    common = ("--surface", "sphere:radius=12.5", "--targets", targets, "--model", "wozniak")

    def touched(name: str, probe: Path, *words: object) -> FloatArray:
        run("simulate", probe, *common, *words, "-o", tmp_path / name)
        names = ("x_mm", "y_mm", "z_mm")
        return np.array([[float(row[n]) for n in names] for row in rows(tmp_path / name)])

    stated = touched("stated.csv", smooth, "--friction", 0.2)
    assert touched("described.csv", rough) == pytest.approx(stated, abs=1e-12)
    assert touched("both.csv", rough, "--friction", 0.2) == pytest.approx(stated, abs=1e-12)
    # On the slope it changes the touch by hundredths of a micrometre; across, it does not.
    change = np.linalg.norm(stated - touched("smooth.csv", smooth), axis=1)
    assert change[0] > 1e-5
    assert change[2] < 1e-6
    for other in (0.1, 0):
        out = tmp_path / "no.csv"
        said = run("simulate", rough, *common, "--friction", other, "-o", out, code=2)
        assert "has 0.2 in [tip]" in said
