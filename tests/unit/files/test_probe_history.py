"""The history of a probe is a file that any program can write to: what is read is checked."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from pretravel.base.errors import InputError
from pretravel.files.probe_history import add_verification, read_history
from pretravel.qualification.verification import Verification
from pretravel.tasks.history.picture import history_view
from pretravel.tasks.history.report import history_document
from tests.unit.files.test_files_of_version_1 import FOLDER
from tests.unit.qualification.test_verification import check, old_map, touches

KEPT = FOLDER / "history.jsonl"


def _changed(folder: Path, **values: Any) -> Path:
    """A history whose second entry has other values; a value that is ... is left out."""
    first, second = KEPT.read_text().splitlines()
    entry = {name: v for name, v in (json.loads(second) | values).items() if v is not ...}
    path = folder / "history.jsonl"
    path.write_text(f"{first}\n{json.dumps(entry)}\n")
    return path


@pytest.fixture(scope="module")
def result() -> Verification:
    return check(touches(1))


def _add(path: Path, result: Verification, touches_name: str = "t.csv") -> int:
    return add_verification(
        path, result, pretravel_map=old_map(), map_name="m.json", touches_name=touches_name,
        decision="kept",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("size_um", "much"), ("size_um", float("inf")), ("size_um", float("nan")),
        ("size_um", 1e300), ("size_um", True), ("size_um", [1.0]), ("tip_diameter_mm", None),
        ("changed", None), ("changed", 1), ("time", "noon"), ("time", "0001-01-01T00:00+23:00"),
        ("false_alarm_rate", "a"), ("false_alarm_rate", 0), ("u_size_um", -1), ("map", 5),
        ("decision", "\ud800"), ("map", "m" * 1001), ("p_form", ...), ("more", 1.0),
    ],
)  # fmt: skip
def test_values_that_no_verification_has(tmp_path: Path, column: str, value: object) -> None:
    with pytest.raises(InputError, match=rf"line 2: the entry is damaged: .*{column}"):
        read_history(_changed(tmp_path, **{column: value}))


@pytest.mark.parametrize(
    "line", ["[" * 100_000, "9" * 5000, '{"schema": {}}', "{", "\0" * 100, '"' + "a" * 10**6 + '"']
)
def test_lines_that_are_no_entry(tmp_path: Path, line: str) -> None:
    path = _changed(tmp_path)
    path.write_text(f"{path.read_text()}{line}\n")
    with pytest.raises(InputError, match="line 3: this is not the history of a probe"):
        read_history(path)


def test_a_line_twice_is_no_second_verification(tmp_path: Path) -> None:
    path = _changed(tmp_path)
    path.write_text(path.read_text() + path.read_text().splitlines()[0] + "\n")
    with pytest.raises(InputError, match="line 3: this line is line 1 once more"):
        read_history(path)


def test_a_later_version_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="format has version 2; this pretravel reads 1"):
        read_history(_changed(tmp_path, version=2))


def test_a_history_in_which_no_size_is_known(tmp_path: Path) -> None:
    path = tmp_path / "history.jsonl"
    entries = [json.loads(line) | {"size_um": None, "u_size_um": None}
               for line in KEPT.read_text().splitlines()]  # fmt: skip
    path.write_text("".join(f"{json.dumps(entry)}\n" for entry in entries))
    found = read_history(path)
    assert history_document(found).verdict.startswith("History of a probe: 2 verifications")
    assert history_view(found).charts[0].title.startswith("no verification has determined")


def test_nothing_beside_a_history_is_looked_at(tmp_path: Path, result: Verification) -> None:
    """A database would carry out what a file beside it says: journals delete other files."""
    path = _changed(tmp_path)
    for ending in ("-journal", "-wal", ".lock", ".journal"):
        (tmp_path / f"history.jsonl{ending}").write_bytes(b"letters.txt")
    beside = {each: each.read_bytes() for each in tmp_path.iterdir() if each != path}
    assert _add(path, result) == 3
    assert len(read_history(path)) == 3
    assert {each: each.read_bytes() for each in tmp_path.iterdir() if each != path} == beside


@pytest.mark.parametrize("length", [1, 12, 200])
def test_an_entry_that_a_crash_cut_off_is_none(
    tmp_path: Path, result: Verification, length: int
) -> None:
    path = _changed(tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole + whole.splitlines()[1][:length])
    assert len(read_history(path)) == 2
    assert _add(path, result) == 3
    assert path.read_bytes().startswith(whole)
    assert [entry.number for entry in read_history(path)] == [1, 2, 3]


def test_an_editor_may_leave_the_last_line_without_its_end(
    tmp_path: Path, result: Verification
) -> None:
    path = _changed(tmp_path)
    path.write_bytes(path.read_bytes().rstrip())
    assert len(read_history(path)) == 2
    assert _add(path, result) == 3
    assert len(read_history(path)) == 3


@pytest.mark.parametrize("there", [True, False])
def test_a_full_disk_leaves_the_history_as_it_was(
    tmp_path: Path, result: Verification, monkeypatch: pytest.MonkeyPatch, there: bool
) -> None:
    path = _changed(tmp_path) if there else tmp_path / "new.jsonl"
    before = path.read_bytes() if there else b""
    write, calls = os.write, iter([True, False])

    def half(descriptor: int, content: bytes) -> int:
        if next(calls):
            return write(descriptor, content[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "write", half)
    with pytest.raises(InputError, match="cannot be written: No space left"):
        _add(path, result)
    assert path.exists() == there
    assert not there or path.read_bytes() == before


def test_no_file_is_made_where_a_link_points_to(tmp_path: Path, result: Verification) -> None:
    """Who sends a folder could have a file of the user's begin with a text of theirs."""
    link = tmp_path / "history.jsonl"
    link.symlink_to(tmp_path / "profile")
    with pytest.raises(InputError, match="cannot be opened or made"):
        _add(link, result)
    assert not (tmp_path / "profile").exists()
    link.unlink()
    path = _changed(tmp_path).rename(tmp_path / "probe.jsonl")
    link.symlink_to(path)
    assert _add(link, result) == 3
    assert link.is_symlink()


def test_a_pipe_is_no_history(tmp_path: Path, result: Verification) -> None:
    path = tmp_path / "history.jsonl"
    os.mkfifo(path)
    with pytest.raises(InputError, match="a device or a pipe"):
        _add(path, result)
    with pytest.raises(InputError, match="no such history"):
        read_history(path)


def test_names_of_files_that_are_not_unicode(tmp_path: Path, result: Verification) -> None:
    path = tmp_path / "history.jsonl"
    _add(path, result, os.fsdecode(b"Ma\xdf.csv"))
    assert read_history(path)[0]["touches_file"] == "Ma?.csv"


def test_a_history_in_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    path = _changed(tmp_path)
    path.chmod(0o400)
    tmp_path.chmod(0o500)
    try:
        assert len(read_history(path)) == 2
    finally:
        tmp_path.chmod(0o700)
