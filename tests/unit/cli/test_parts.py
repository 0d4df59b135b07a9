"""Simulate and compensate on parts, as a user types them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from pretravel.cli import main
from pretravel.files.map_file import read_map
from tests.support.commands import positions, rows, run
from tests.support.examples import EXAMPLES

PART = EXAMPLES / "part.step"


class TestThereAndBack:
    """simulate, then compensate with the nominal part, reproduces the surface to 1e-6 mm."""

    def _touches(self, folder: Path, *extra: object) -> Path:
        run("plan", PART, "--spacing", 8, "-o", folder / "plan.csv")
        run("simulate", "omp40-2", "--surface", PART, "--targets", folder / "plan.csv",
            "-o", folder / "touches.csv", *extra)  # fmt: skip
        return folder / "touches.csv"

    def _deviation(self, folder: Path, touches: Path, *extra: object) -> np.ndarray:
        run("compensate", touches, "--nominal", PART, "-o", folder / "points.csv", *extra)
        return np.array([float(row["deviation_um"]) for row in rows(folder / "points.csv")])

    def test_with_a_predicted_map_whatever_its_grid(self, tmp_path: Path) -> None:
        touches = self._touches(tmp_path)
        for step in (10, 45):
            run("predict", "omp40-2", "--polar", f"0:90:{step}", "--azimuth", "0:350:10",
                "-o", tmp_path / "map.json")  # fmt: skip
            off = self._deviation(tmp_path, touches, "--map", tmp_path / "map.json")
            assert np.abs(off).max() < 1e-3  # µm

    def test_with_the_probe_itself(self, tmp_path: Path) -> None:
        touches = self._touches(tmp_path, "--model", "shen")
        off = self._deviation(tmp_path, touches, "--map", "omp40-2", "--model", "shen")
        assert np.abs(off).max() < 1e-3
        # Another model is another probe.
        assert np.abs(self._deviation(tmp_path, touches, "--map", "omp40-2")).max() > 0.5

    @pytest.mark.long
    def test_in_the_machines_frame(self, tmp_path: Path) -> None:
        place = ("--place", "100,-50,20,5,-8,30", "--frame", "machine")
        touches = self._touches(tmp_path, *place)
        at = positions(touches)
        assert at[:, 0].mean() > 60.0  # the touch is in the machine's frame, not in the part's
        off = self._deviation(tmp_path, touches, "--map", "omp40-2", *place)
        assert np.abs(off).max() < 1e-3
        points = positions(tmp_path / "points.csv")
        assert np.linalg.norm(points - at, axis=1).max() < 3.1
        message = run("compensate", touches, "--map", "omp40-2", "--nominal", PART, "-o",
                      tmp_path / "x.csv", code=2)  # fmt: skip
        assert "Is the nominal where the part is" in message

    @pytest.mark.long
    def test_a_measured_map_as_probe(self, tmp_path: Path) -> None:
        sphere = EXAMPLES / "sphere_touches.csv"
        # Physical maps contain the compression of a curved part; a simulation from a map does not.
        run("qualify", sphere, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "harmonic",
            "-o", tmp_path / "q.json")  # fmt: skip
        run("plan", PART, "--spacing", 8, "-o", tmp_path / "plan.csv")
        run("simulate", tmp_path / "q.json", "--surface", PART, "--targets", tmp_path / "plan.csv",
            "-o", tmp_path / "t.csv")  # fmt: skip
        off = self._deviation(tmp_path, tmp_path / "t.csv", "--map", tmp_path / "q.json")
        assert np.abs(off).max() < 1e-3
        message = run("simulate", tmp_path / "q.json", "--surface", PART, "--targets",
                      tmp_path / "plan.csv", "-o", tmp_path / "t.csv", "--friction", 0.1,
                      code=2)  # fmt: skip
        assert "friction is not used with a map" in message

    def test_targets_that_fail_are_named_or_left_out(self, tmp_path: Path) -> None:
        targets, out = tmp_path / "t.csv", tmp_path / "touches.csv"
        targets.write_text(
            "label,x_mm,y_mm,z_mm,nx,ny,nz\nin,30,20,11,0,0,1\nbeside,70,20,11,0,0,1\n"
        )
        arguments = ("simulate", "omp40-2", "--surface", PART, "--targets", targets, "-o", out)
        message = run(*arguments, code=2)
        assert "1 of 2 targets cannot be touched: 1 missed" in message
        assert "target 2 (beside)" in message
        assert not out.exists()
        run(*arguments, "--leave-out")
        assert [row["label"] for row in rows(out)] == ["in"]


def test_faces_that_cannot_be_read_are_not_in_the_way_and_that_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from netgen.occ import Cylinder, Pnt, Z

    from pretravel.base.errors import PretravelError
    from pretravel.surface.cad import brep_geometry

    def broken(*_: object) -> None:
        raise PretravelError("a cylinder like no other")

    rod = tmp_path / "rod.step"
    Cylinder(Pnt(0, 0, 0), Z, 20, 10).WriteStep(str(rod))
    kinds = brep_geometry._ELEMENTARY
    monkeypatch.setattr(brep_geometry, "_ELEMENTARY", {**kinds, 2: ("cylinder", broken, 1)})
    targets = tmp_path / "t.csv"
    targets.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,10,0,0,1\n")
    monkeypatch.setattr(
        sys, "argv",
        ["pretravel", "simulate", "omp40-2", "--surface", f"{rod}#2", "--targets", str(targets),
         "-o", str(tmp_path / "o.csv")],
    )  # fmt: skip
    with pytest.raises(SystemExit) as stop:
        main.run()
    assert stop.value.code in (0, None)
    said = capsys.readouterr().err
    assert "face 1 cannot be used (cylinder: a cylinder like no other)" in said
    assert "neglected as an obstacle" in said


def test_a_predicted_map_is_exact_and_a_table_is_none(tmp_path: Path) -> None:
    import xarray as xr

    for ending, kind in ((".json", "physical"), (".csv", "tabulated")):
        path = tmp_path / f"m{ending}"
        run("predict", "omp40-2", "--polar", "0:90:30", "-o", path)
        assert read_map(path).kind == kind
    run("predict", "omp40-2", "--polar", "0:90:30", "-o", tmp_path / "m.nc")
    with xr.open_dataset(tmp_path / "m.nc", engine="h5netcdf") as grid:
        assert grid["predicted_trigger_force_N"].shape == (4 * 72,)
    told = run("compensate", PART, "--map", tmp_path / "m.nc", "-o", tmp_path / "p.csv", code=2)
    assert "qualify or predict again with -o map.json" in " ".join(told.split())


@pytest.mark.long
def test_the_example_part_measured(tmp_path: Path) -> None:
    """Touches with noise, from another simulation. With the part as nominal the deviations are
    those along the normals of the nominal points, except for the slide: hundredths of a
    micrometre."""
    run("qualify", EXAMPLES / "sphere_touches.csv", "--diameter", 24.9987, "--tip-diameter", 6,
        "--kind", "harmonic", "-o", tmp_path / "q.json")  # fmt: skip
    touches = EXAMPLES / "part_touches.csv"
    run("compensate", touches, "--map", tmp_path / "q.json", "-o", tmp_path / "a.csv")
    run("compensate", touches, "--map", tmp_path / "q.json", "--nominal", PART,
        "-o", tmp_path / "b.csv")  # fmt: skip
    plain, on_part = (
        np.array([float(row["deviation_um"]) for row in rows(tmp_path / name)])
        for name in ("a.csv", "b.csv")
    )
    assert len(plain) == len(on_part) == 140
    assert np.abs(on_part - plain).max() < 0.3
    assert np.std(on_part) == pytest.approx(np.std(plain), rel=0.02)


def test_help_everywhere() -> None:
    for command in ("slide", "faces", "plan"):
        assert "Example:" in run(command, "--help")
