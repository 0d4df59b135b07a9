"""An output replaces the earlier file, except inputs and files of another kind."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from pretravel.base.errors import PretravelError
from pretravel.cli.files import check_files
from pretravel.files.map_file import write_map
from tests.support.commands import run
from tests.support.examples import SPHERE
from tests.unit.qualification.test_verification import old_map

PATTERN = ("pattern", "iso10360-5", "--diameter", 25)
PLAN = ("plan", "sphere:radius=12", "--grid", "3x3")
BINARY = b"\x7fELF\x02\x01\x01\x00\x00\x00"
NETCDF = b"\x89HDF\r\n\x1a\n\x00"
PROGRAM = b"G21 (of the mill)\n"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("again", [PATTERN, (*PATTERN, "--turn", 10), PLAN])
def test_an_output_is_replaced(again: tuple[object, ...]) -> None:
    run(*again, "-o", "new.csv")
    run(*PATTERN, "-o", "targets.csv")
    run(*again, "-o", "targets.csv")
    assert Path("targets.csv").read_bytes() == Path("new.csv").read_bytes()


def test_an_input_stays() -> None:
    shutil.copy(SPHERE, "touches.csv")
    told = run("convert", "touches.csv", "-o", "./touches.csv", code=2)
    assert "this file is also read and would be overwritten" in told
    assert Path("touches.csv").read_bytes() == SPHERE.read_bytes()


@pytest.mark.parametrize(
    ("name", "content", "kind"),
    [
        ("a.csv", BINARY, "text"),
        ("a.toml", BINARY, "text"),
        ("a.json", b"x_mm,y_mm\n1,2\n", "JSON"),
        ("a.json", BINARY, "text"),
        ("a.html", b"x_mm,y_mm\n1,2\n", "HTML"),
        ("a.svg", b"<html></html>", "SVG"),
        ("a.png", b"x_mm,y_mm\n1,2\n", "a .png file"),
        ("a.pdf", BINARY, "a .pdf file"),
        ("a.parquet", b"x_mm,y_mm\n1,2\n", "a .parquet file"),
        ("a.nc", PROGRAM, "a .nc file"),
    ],
)
def test_a_file_of_another_kind_stays(name: str, content: bytes, kind: str) -> None:
    path = Path(name)
    path.write_bytes(content)
    with pytest.raises(PretravelError, match=rf"cannot write {name}: .* is not {kind}, as its end"):
        check_files([(path, (path.suffix,))])
    path.write_bytes(b"")
    check_files([(path, (path.suffix,))])


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.csv", b"x_mm;y_mm\n1,0;2,0\n"),
        ("a.json", b'\xef\xbb\xbf{"a": 1}'),
        ("a.html", b"<!doctype html>\n<HTML lang='en'>"),
        ("a.svg", b"<?xml version='1.0'?>\n<svg>"),
        ("a.png", b"\x89PNG\r\n\x1a\n\x00"),
        ("a.pdf", b"%PDF-1.4"),
        ("a.nc", NETCDF),
        ("a.nc", b"CDF\x01\x00"),
        ("a.parquet", b"PAR1\x00"),
        ("a.toml", b"lever = 60\n"),
    ],
)
def test_a_file_of_the_kind_is_replaced(name: str, content: bytes) -> None:
    path = Path(name)
    path.write_bytes(content)
    check_files([(path, (path.suffix,))])


@pytest.mark.parametrize("name", ["part.STEP", "part.igs", "surface.py", "probe.jsonl"])
def test_a_table_for_a_control_replaces_no_part(name: str) -> None:
    """The ending of such a table is free, and these files are text too."""
    write_map(Path("map.json"), old_map())
    Path(name).write_text("ISO-10303-21;\n")
    told = run("export", "map.json", "--to", "renishaw", "-o", name, code=2)
    assert "is not an ending of a file for a control" in " ".join(told.split())
    assert Path(name).read_text() == "ISO-10303-21;\n"


def test_programs_and_maps_have_one_ending() -> None:
    """G-code and netCDF are both named .nc; neither replaces the other."""
    endings = (".ngc", ".nc")
    Path("a.nc").write_bytes(PROGRAM)
    check_files([(Path("a.nc"), endings)], programs=True)
    Path("a.nc").write_bytes(NETCDF)
    with pytest.raises(PretravelError, match="is not text"):
        check_files([(Path("a.nc"), endings)], programs=True)


def test_nothing_is_done_before_the_refusal() -> None:
    Path("a.png").write_bytes(PROGRAM)
    told = run(*PLAN, "-o", "targets.csv", "--plot", "a.png", code=2)
    assert "cannot write a.png: the file exists and is not a .png file" in told
    assert not Path("targets.csv").exists()
    assert Path("a.png").read_bytes() == PROGRAM


@pytest.mark.long
@pytest.mark.parametrize("plot", ["a.png", "a.svg"])
def test_pictures_and_pages_are_replaced(plot: str) -> None:
    predict = ("predict", "omp40-2", "--azimuth", "0:330:30", "--polar", 90)
    run(*predict, "-o", "a.html", "--plot", plot)
    for name in ("a.html", plot):
        os.utime(name, (0, 0))
    run(*predict, "-o", "a.html", "--plot", plot)
    assert all(Path(name).stat().st_mtime > 0 for name in ("a.html", plot))


def test_a_folder_of_an_output_name_stays() -> None:
    Path("targets.csv").mkdir()
    assert "it is a folder" in run(*PATTERN, "-o", "targets.csv", code=2)


def test_an_empty_file_and_a_device_have_nothing_to_lose() -> None:
    Path("targets.csv").touch()
    run(*PATTERN, "-o", "targets.csv")
    run(*PATTERN, "-o", "/dev/null")


def test_subroutines_of_a_folder_are_replaced() -> None:
    write_map("map.json", old_map())
    run("program", "mdi", "-o", "subroutines")
    run("export", "map.json", "--to", "linuxcnc", "-o", "subroutines")
    compensate = Path("subroutines/pretravel_compensate.ngc")
    text = compensate.read_text()
    compensate.write_text("(mine)")
    run("export", "map.json", "--to", "linuxcnc", "-o", "subroutines")
    assert compensate.read_text() == text
