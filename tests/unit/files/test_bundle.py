"""A bundle contains what was measured, and nothing that tells who, where and when."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from pretravel.files.map_file import read_map, write_map
from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.touches import Touches
from tests.support.commands import run
from tests.support.example_maps import example_map

SECRETS = ("Mueller", "SN-4711", "Werk 3", "secret")
MACHINE = """# Mueller's mill
[machine]
name = "Werk 3, hall 2"
serial_number = "SN-4711"
overtravel_mm = 3.5
axes = ["x", "y", "z"]
"""


def _written(folder: Path, *options: str) -> dict[str, str]:
    with zipfile.ZipFile(folder / "bundle.zip") as archive:
        return {name: archive.read(name).decode() for name in archive.namelist()}


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    n = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    labels = ("Mueller/1", "Mueller/2", "Mueller/1")
    write_touches("secret.csv", Touches(15.4987 * n, n, labels=labels, source="Mueller.csv"))
    text = Path("secret.csv").read_text("utf-8")
    Path("secret.csv").write_text("# Mueller, SN-4711, 2026-11-26\n" + text)
    write_map("map.json", example_map("harmonic"))
    Path("mill.toml").write_text(MACHINE)
    return tmp_path


def test_nothing_in_it_names_anybody(files: Path) -> None:
    shown = run("bundle", "secret.csv", "--map", "map.json", "--machine", "mill.toml", "--diameter",
                25, "-o", "bundle.zip")  # fmt: skip
    assert "touches.csv" in shown
    found = _written(files)
    assert set(found) == {"README.txt", "touches.csv", "map.json", "machine.toml",
                          "description.json", "versions.json"}  # fmt: skip
    whole = "\n".join(found.values())
    assert [word for word in SECRETS if word in whole] == []
    assert "2026-11" not in whole
    assert "overtravel_mm = 3.5" in found["machine.toml"]
    assert 'axes = ["x", "y", "z"]' in found["machine.toml"]
    assert json.loads(found["description.json"])["diameter_mm"] == 25.0


def test_what_was_measured_is_whole(files: Path) -> None:
    run("bundle", "secret.csv", "--map", "map.json", "-o", "bundle.zip")
    found = _written(files)
    for name in ("touches.csv", "map.json"):
        Path("copy_" + name).write_text(found[name])
    before, after = read_touches("secret.csv"), read_touches("copy_touches.csv")
    np.testing.assert_array_equal(before.positions, after.positions)
    assert after.labels == ("1", "2", "1")  # which touches repeat each other stays
    old, new = read_map("map.json"), read_map("copy_map.json")
    np.testing.assert_array_equal(old.coefficients, new.coefficients)
    np.testing.assert_array_equal(old.covariance.matrix, new.covariance.matrix)


def test_equal_contents_are_equal_files(files: Path) -> None:
    contents = []
    for _ in range(2):
        run("bundle", "secret.csv", "-o", "bundle.zip")
        contents.append((files / "bundle.zip").read_bytes())
    assert contents[0] == contents[1]


def test_raw_files_are_as_they_are_where_that_is_asked_for(files: Path) -> None:
    shown = run("bundle", "secret.csv", "--raw", "--keep-labels", "-o", "bundle.zip")
    found = _written(files)
    assert found["raw/1.csv"] == Path("secret.csv").read_text("utf-8")
    assert "Mueller/1" in found["touches.csv"]
    assert "nothing of the files under raw/" in shown.replace("\n  ", " ")


def test_another_ending_is_refused(files: Path) -> None:
    assert ".zip" in run("bundle", "secret.csv", "-o", "bundle.tar", code=2)
