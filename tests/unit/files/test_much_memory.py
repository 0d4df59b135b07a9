"""Files whose values would take far more memory than the files are refused before that."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import ReadingOptions
from pretravel.files.map_file import read_map
from pretravel.files.points_reading import read_points
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from pretravel.show.result_file import read_result

_QIF = b'<QIFDocument xmlns="http://qifstandards.org/xsd/qif3">'


@pytest.mark.parametrize("read", [read_map, read_points, read_result])
@pytest.mark.parametrize("value", [b"[],", b"{},", b'"",', b"1e1,"])
def test_json(tmp_path: Path, read: Callable[[Path], object], value: bytes) -> None:
    """A list of three signs takes 64 bytes, and 8 where it is named."""
    path = tmp_path / "a.json"
    path.write_bytes(b"[" + value * 9_500_000 + value[:-1] + b"]")
    with pytest.raises(InputError, match=r"a\.json: .* more than 300 MB of memory"):
        read(path)


@pytest.mark.parametrize("end", [b"\n", b"\r"])
@pytest.mark.parametrize("name", ["a.csv", "a.log"])
def test_lines(name: str, end: bytes) -> None:
    """An empty line took 100 bytes."""
    file = SourceFile(name, b"x_mm,y_mm,z_mm" + end * 5_000_002)
    with pytest.raises(InputError, match="more than 5,000,000 lines"):
        read_readings(file, ReadingOptions())


def test_tags() -> None:
    """An element of four signs took 220 bytes."""
    file = SourceFile("a.qif", _QIF + b"<a/>" * 5_000_000 + b"</QIFDocument>")
    with pytest.raises(InputError, match="more than 5,000,000 tags"):
        read_readings(file, ReadingOptions())
