"""A look at a file says what is understood, and what there is to choose from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap
from pretravel.controls.screen.shown_file import columns_of_table, first_lines
from pretravel.files.file_format import ReadingOptions
from pretravel.task.look import look_at_touches
from pretravel.task.preview_report import preview_document
from tests.support.commands import run
from tests.support.control_logs import PRINT_FILE, REFUSED_FILES, written
from tests.support.examples import EXAMPLES


def test_what_a_table_lacks_is_no_fault(tmp_path: Path) -> None:
    path = tmp_path / "shop.csv"
    path.write_text("X;Y;Z\n1;2;3\n4;5;6,5\n")
    found = look_at_touches(path)
    assert (found.positions.tolist(), found.unit_known) == ([[1, 2, 3], [4, 5, 6.5]], False)
    assert "unit of length not given" in found.understood
    assert look_at_touches(path, ReadingOptions(units="inch")).positions[0, 0] == 25.4
    assert first_lines(path) == ("X;Y;Z", "1;2;3", "4;5;6,5")


def test_columns_that_a_name_does_not_tell_apart_are_numbered(tmp_path: Path) -> None:
    path = tmp_path / "twice.csv"
    path.write_text("X;a,b;Y;Z;temp;temp\n1;0;2;3;20;21\n4;0;5;6;20;21\n")
    columns = columns_of_table(path, ReadingOptions())
    assert columns is not None
    assert columns.titles == ("X", "2", "Y", "Z", "5", "6")
    assert columns.roles == {"x": "X", "y": "Y", "z": "Z"}
    stated = columns_of_table(path, ReadingOptions(columns={"z": "5"}))
    assert stated is not None
    assert stated.roles["z"] == "5"


def test_a_binary_file_has_no_lines_to_show(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    path.write_bytes(b"PAR1\0\0\1")
    assert first_lines(path) == ()


def _figures(tmp_path: Path, rows: FloatArray, head: str = "x_mm,y_mm,z_mm,nx,ny,nz") -> str:
    """Names and texts of the key figures of the preview of a table."""
    path = tmp_path / "t.csv"
    np.savetxt(path, rows, "%.6f", ",", header=head, comments="")
    return " ".join(f"{f.name}: {f.value}" for f in look_at_touches(path).document().figures)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("count", [9, 40])
def test_flat_data_are_on_no_sphere(tmp_path: Path, seed: int, count: int) -> None:
    """A flat face of 100 mm with 5 µm of noise: a sphere of 10 m to 1 km fits it, by chance."""
    rng = np.random.default_rng(seed)
    flat = np.zeros((count, 6))
    flat[:, :2] = rng.uniform(0.0, 100.0, (count, 2))
    flat[:, 2] = rng.normal(0.0, 0.005, count)
    flat[:, 5] = 1.0
    told = _figures(tmp_path, flat)
    assert "sphere" not in told
    assert "INTO" not in told


def test_a_bore_is_on_no_sphere_whose_normals_point_into_it(tmp_path: Path) -> None:
    """A sphere passes through two circles of a bore exactly; its normals are across its radii."""
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    ring = np.c_[np.cos(angle), np.sin(angle), np.zeros(12)]
    bore = np.vstack([np.c_[5.0 * ring + [0, 0, z], -ring] for z in (-1.0, 1.0)])
    assert "sphere" not in _figures(tmp_path, bore)
    assert "sphere" in _figures(tmp_path, bore[:, :3], "x_mm,y_mm,z_mm")


@pytest.mark.parametrize("cap_deg", [10.0, 30.0, 90.0])
def test_a_cap_of_a_reference_is_a_sphere(tmp_path: Path, cap_deg: float) -> None:
    """With 5 µm of noise on a ball of 25 mm: a cap of 10° is 0.24 mm high."""
    directions = fibonacci_cap(25, np.radians(cap_deg))
    radius = 15.5 + np.random.default_rng(1).normal(0.0, 0.005, 25)
    touches = np.c_[radius[:, None] * directions, directions]
    told = _figures(tmp_path, touches)
    assert "sphere: diameter" in told
    assert "they point out of the sphere" in told
    turned = _figures(tmp_path, touches * [1, 1, 1, -1, -1, -1])
    assert "INTO the sphere" in turned


@pytest.mark.parametrize("name", REFUSED_FILES)
def test_a_preview_gives_the_advice_of_the_conversion(tmp_path: Path, name: str) -> None:
    path = written(tmp_path, REFUSED_FILES[name][0][0], "a.txt")
    looked = run("convert", path, "--from", name, code=2)
    assert looked == run("convert", path, "--from", name, "-o", tmp_path / "t.csv", code=2)
    assert REFUSED_FILES[name][1].replace("..", "++") in looked.replace("\n", " ")


def test_a_print_out_is_previewed_as_what_it_contains(tmp_path: Path) -> None:
    path = written(tmp_path, PRINT_FILE)
    assert "--units" in run("convert", path, code=2)
    told = run("convert", path, "--units", "mm")
    assert "2 results of features" in told
    assert "71.9072" in told
    assert "-o features.csv" in told


def test_a_reference_is_seen_as_before() -> None:
    found = look_at_touches(EXAMPLES / "sphere_touches.csv")
    told = preview_document("a", found.found).figures
    assert any("diameter 30.9660 mm" in str(figure.value) for figure in told)


@pytest.mark.parametrize(("tip", "code"), [(6, 0), (5.97, 0), (4, 2)])
def test_the_tip_of_the_machine_must_be_the_one_that_is_given(
    tip: float, code: int, tmp_path: Path
) -> None:
    machine, log = tmp_path / "mill.toml", tmp_path / "a.csv"
    machine.write_text(run("machine"))
    log.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n")
    told = run("convert", log, "--machine", machine, "--tip-diameter", tip,
               "-o", tmp_path / "t.csv", code=code)  # fmt: skip
    assert ("gives a tip of 6 mm, and 4 mm is given" in told) == (code == 2)
