"""Files that are recognised and refused as what they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import ReadingOptions
from pretravel.files.format_registry import FORMATS, format_of
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from tests.support.commands import run
from tests.support.control_logs import REFUSED_FILES, SAMPLES, written

EACH = [(name, text) for name, (texts, _) in REFUSED_FILES.items() for text in texts]


def test_every_refused_format_has_samples_and_a_reason() -> None:
    refused = [known for known in FORMATS.values() if known.refusal]
    assert {known.name for known in refused} == set(REFUSED_FILES)
    assert all(not (known.parse or known.parse_features or known.reads) for known in refused)


@pytest.mark.parametrize(("name", "text"), EACH)
@pytest.mark.parametrize("change", ["{}", "\ufeff{}", "\r\n"])
def test_recognised_and_refused(name: str, text: str, change: str) -> None:
    content = text.replace("\n", change) if change == "\r\n" else change.format(text)
    file = SourceFile("a.txt", content.encode())
    assert format_of(file).name == name
    with pytest.raises(InputError, match=REFUSED_FILES[name][1]) as caught:
        read_readings(file)
    assert "csv files" not in str(caught.value)


def test_a_program_with_the_ending_of_netcdf() -> None:
    """Controls and CAM call their programs part.nc."""
    assert format_of(SourceFile("part.nc", b"%\nG21\nM3 S1000\n")).name == "program"
    assert format_of(SourceFile("log.NC", b"[PRB:1,2,3:1]\n")).name == "grbl"
    assert format_of(SourceFile("map.nc", b"\x89HDF\r\n")).name == "netcdf"


@pytest.mark.parametrize("ending", [".xlsx", ".PDF", ".stl", ".step"])
def test_binary_files_by_their_ending(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"part{ending}"
    path.write_bytes(b"PK\x03\x04\x00\x00")
    told = run("qualify", path, "--diameter", 25, code=2)
    assert "spreadsheet" in told or "geometry" in told


def test_the_command_tells_what_to_do_instead(tmp_path: Path) -> None:
    path = written(tmp_path, REFUSED_FILES["calypso"][0][0])
    told = run("convert", path, "-o", tmp_path / "t.csv", code=2)
    assert "write the points of the elements" in " ".join(told.split())
    assert not (tmp_path / "t.csv").exists()
    assert "refused: this is a table of Calypso" in run("formats")


@pytest.mark.parametrize("name", SAMPLES)
def test_files_that_are_read_are_not_refused(name: str) -> None:
    """Also among the lines of a program, which senders repeat in their logs."""
    lines = [line.strip() for line in SAMPLES[name][0].splitlines() if line.strip()]
    matching = [
        known.name for known in FORMATS.values() if known.recognises and known.recognises(lines)
    ]
    assert matching[:1] == [name] or name == "csv"
    assert not {known.name for known in FORMATS.values() if known.refusal} & set(matching)


def test_labels_like_orders_are_no_program() -> None:
    rows = "label,x_mm,y_mm,z_mm,nx,ny,nz\nM3,0,0,3,0,0,1\nG31,0,1,3,0,0,1\n"
    assert format_of(SourceFile("a.csv", rows.encode())).name == "csv"


def test_a_report_with_the_ending_of_geometry() -> None:
    """GEOPAK of Mitutoyo names its DMIS output .igs."""
    content = b"$$ Data from GEOPAK\nUNITS/MM,ANGDEC\nFA(P1) = FEAT/POINT, CART,$\n1,2,3, 0,0,1\n"
    file = SourceFile("report.igs", content)
    assert format_of(file).name == "dmis"
    found = read_readings(file, ReadingOptions(radius_taken_off=0.0)).touches
    assert found.positions.tolist() == [[1.0, 2.0, 3.0]]
    part = f"{'A part, written by CAD':72}S      1\n".encode()
    assert format_of(SourceFile("part.igs", part)).name == "geometry"


@pytest.mark.parametrize("row", ["N{0} X=1{0}.1 Y=2.2 Z=-3.3", "X 1{0}.1 Y 2.2 Z- 3.3"])
def test_positions_below_the_title_of_a_measuring_log(row: str) -> None:
    rows = "\n".join(row.format(i) for i in range(1, 4))
    file = SourceFile("log.txt", f"; MESSPROTOKOLL\n{rows}\n".encode())
    assert format_of(file).name == "positions"
    options = ReadingOptions(units="mm", normal=(0.0, 0.0, 1.0))
    found = read_readings(file, options).touches.positions
    assert found.tolist() == [[11.1, 2.2, -3.3], [12.1, 2.2, -3.3], [13.1, 2.2, -3.3]]


@pytest.mark.parametrize(
    "text", ['[{"x":0,"y":1,"z":2},\n{"x":3,"y":4,"z":5}]', '{"probes":[{"x":0,"y":1,"z":2}]}']
)
def test_json_is_named(text: str) -> None:
    with pytest.raises(InputError, match="this is JSON, from which no touches are read"):
        format_of(SourceFile("touches.json", text.encode()))
