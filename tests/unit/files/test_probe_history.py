"""The history of a probe is a file that any program can write to: what is read is checked."""

from __future__ import annotations

import shutil
import sqlite3
import struct
import threading
from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files import probe_history
from pretravel.files.probe_history import check_history, read_history
from pretravel.tasks.reports.history_report import history_document, history_view
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


def _hot_journal(history: Path, victim: Path) -> Path:
    """A journal without pages that names a journal of several databases, which SQLite deletes after
    it has rolled back (sqlite.org/fileformat.html, 3: the rollback journal)."""
    content = history.read_bytes()
    page = int.from_bytes(content[16:18], "big")
    magic = bytes.fromhex("d9d505f920a163d7")
    header = magic + struct.pack(">IIIII", 0, 0, len(content) // page, 512, page)
    name = str(victim).encode()
    named = struct.pack(">I", 2**30 // page + 1) + name
    named += struct.pack(">II", len(name), sum(name)) + magic
    journal = history.with_name(history.name + "-journal")
    journal.write_bytes(header.ljust(512, b"\0") + named)
    return journal


@pytest.fixture
def victim(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(probe_history, "_WAIT_FOR_JOURNAL", 0.05, raising=False)
    path = tmp_path / "letters.txt"
    path.write_text("dear reader")
    return path


def test_the_made_journal_deletes_a_file_where_sqlite_carries_it_out(
    tmp_path: Path, victim: Path
) -> None:
    history = _changed(tmp_path)
    _hot_journal(history, victim)
    sqlite3.connect(history).execute("SELECT count(*) FROM verification").fetchone()
    assert not victim.exists()


def test_no_file_is_deleted_by_reading_a_history(tmp_path: Path, victim: Path) -> None:
    """Also through a link, beside whose target SQLite looks for the journal."""
    history = _changed(tmp_path)
    journal, link = _hot_journal(history, victim), tmp_path / "other.sqlite"
    link.symlink_to(history)
    for path in (history, link):
        with pytest.raises(InputError, match=r"beside the history is history.sqlite-journal: .*"):
            read_history(path)
    assert victim.read_text() == "dear reader"
    assert journal.exists()


@pytest.mark.parametrize("ending", ["-journal", "-wal"])
def test_a_history_with_an_unfinished_writing_is_not_added_to(
    tmp_path: Path, victim: Path, ending: str
) -> None:
    history = _changed(tmp_path)
    _hot_journal(history, victim).rename(tmp_path / f"history.sqlite{ending}")
    with pytest.raises(InputError, match=rf"remove history.sqlite{ending}"):
        check_history(history, None)  # type: ignore[arg-type]  # no map is looked at before
    with (
        pytest.raises(InputError, match=f"history.sqlite{ending}"),
        probe_history._history(history, create=True),
    ):
        pass
    assert victim.exists()


def test_a_reader_waits_for_a_writer(tmp_path: Path) -> None:
    """Its journal is there for a moment."""
    history = _changed(tmp_path)
    journal = tmp_path / "history.sqlite-journal"
    journal.write_bytes(b"")
    threading.Timer(0.3, journal.unlink).start()
    assert len(read_history(history)) == 2


@pytest.mark.parametrize("name", ["50% of it?mode=rwc#1.sqlite", "Länge.sqlite"])
def test_names_are_not_settings_of_sqlite(tmp_path: Path, name: str) -> None:
    path = _changed(tmp_path).rename(tmp_path / name)
    before = path.read_bytes()
    assert len(read_history(path)) == 2
    assert path.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == [name]


def test_a_history_in_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    path = _changed(tmp_path)
    path.chmod(0o400)
    tmp_path.chmod(0o500)
    try:
        assert len(read_history(path)) == 2
    finally:
        tmp_path.chmod(0o700)
