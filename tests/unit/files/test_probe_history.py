"""The history of a probe is a file that any program can write to: what is read is checked."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.base.errors import InputError
from pretravel.files.probe_history import check_history, read_history
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.tasks.reports.history_report import history_document, history_view
from pretravel.uncertainty.covariance import Covariance
from tests.unit.files.test_files_of_version_1 import FOLDER


def _changed(folder: Path, *statements: str) -> Path:
    path = folder / "history.sqlite"
    shutil.copy(FOLDER / "history.sqlite", path)
    connection = sqlite3.connect(path)
    for statement in statements:
        connection.execute(statement)
    connection.commit()
    connection.close()
    return path


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("size_um", "'much'"), ("size_um", "x'ff00'"), ("size_um", "9e999"), ("size_um", "1e300"),
        ("tip_diameter_mm", "NULL"), ("changed", "NULL"), ("changed", "7"), ("time", "'noon'"),
        ("false_alarm_rate", "'a'"), ("false_alarm_rate", "0"), ("u_size_um", "-1"),
        ("map", "x'ff'"), ("decision", "x'00'"),
    ],
)  # fmt: skip
def test_values_that_no_verification_has(tmp_path: Path, column: str, value: str) -> None:
    path = _changed(tmp_path, f"UPDATE verification SET {column} = {value} WHERE number = 2")
    with pytest.raises(InputError, match=rf"entry 2 of the history is damaged: {column} is"):
        read_history(path)


@pytest.mark.parametrize(
    "statement",
    [
        "CREATE TRIGGER t AFTER INSERT ON verification BEGIN DELETE FROM verification; END",
        "ALTER TABLE verification ADD COLUMN more AS (abs(size_um))",
    ],
)
def test_a_database_that_contains_programs(tmp_path: Path, statement: str) -> None:
    with pytest.raises(InputError, match="changed the form of its table"):
        read_history(_changed(tmp_path, statement))


def test_a_view_without_end(tmp_path: Path) -> None:
    """In place of the table: counting without end."""
    endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n) SELECT * FROM n"
    path = _changed(tmp_path, "DROP TABLE verification", f"CREATE VIEW verification AS {endless}")
    with pytest.raises(InputError, match="changed the form of its table"):
        read_history(path)


def test_a_history_in_which_no_size_is_known(tmp_path: Path) -> None:
    path = _changed(tmp_path, "UPDATE verification SET size_um = NULL, u_size_um = NULL")
    entries = read_history(path)
    assert history_document(entries).verdict.startswith("History of a probe: 2 verifications")
    assert history_view(entries).charts[0].title.startswith("no verification has determined")


def _with_crafted_journal(folder: Path) -> tuple[Path, Path]:
    """A history with a rollback journal beside it that names a file as its super-journal."""
    path, victim = _changed(folder), folder / "victim.txt"
    victim.write_text("a file of the user\n")
    content = path.read_bytes()
    page = int.from_bytes(content[16:18], "big")
    magic, name = bytes.fromhex("d9d505f920a163d7"), str(victim).encode()
    numbers = (0, 1, len(content) // page, 512, page)
    header = magic + b"".join(number.to_bytes(4, "big") for number in numbers)
    record = (2**30 // page + 1).to_bytes(4, "big") + name
    record += len(name).to_bytes(4, "big") + sum(name).to_bytes(4, "big") + magic
    path.with_name(path.name + "-journal").write_bytes(header.ljust(512, b"\0") + record)
    return path, victim


def test_a_journal_beside_the_history_deletes_no_file(tmp_path: Path) -> None:
    """SQLite rolls such a journal back, and deletes the file that it names."""
    path, victim = _with_crafted_journal(tmp_path)
    try:
        with pytest.raises(InputError, match="sqlite-journal is beside the history"):
            read_history(path)
    finally:
        assert victim.exists()
    old = PretravelMap(
        HarmonicBasis(np.array([[0, 0]])), np.array([0.01]), Covariance.independent([1e-8]),
        DirectionSupport(sphere_pattern_25()), tip_radius=3.0, repeatability=3e-4,
    )  # fmt: skip
    with pytest.raises(InputError, match="sqlite-journal is beside the history"):
        check_history(path, old)
    assert victim.exists()
