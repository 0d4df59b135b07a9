"""Projects are read back as they were written, and files of strangers within limits."""

from __future__ import annotations

import io
import json
import struct
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any

import pytest

from pretravel.app import project_file
from pretravel.app.project import Project, StoredFile
from pretravel.app.project_file import project_bytes, project_of, read_project, write_project
from pretravel.base.errors import InputError, PretravelError

IDENTITY = "0123456789abcdef"


def example() -> Project:
    project = Project("Probe 7, Ø 6 mm", IDENTITY)
    engineer = project.screen("engineer")
    engineer.settings["diameter"] = 25.0
    engineer.settings["excluded"] = [1, 5]
    engineer.settings["note"] = '<b>"quoted"</b>'
    engineer.files["touches"] = (StoredFile("a.csv", b"x_mm\n1\n"), StoredFile("ü b.csv", b"\0"))
    project.screen("part").files["part"] = (StoredFile("a.csv", b"another"),)
    return project


def content(project: Project) -> dict[str, Any]:
    return {
        state.name: (state.settings.plain(), dict(state.files.items())) for state in project.screens
    }


def archive(stated: object, entries: dict[str, bytes] | None = None) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("project.json", stated if isinstance(stated, str) else json.dumps(stated))
        for name, data in (entries or {}).items():
            made.writestr(name, data)
    return target.getvalue()


def stated(**changes: Any) -> dict[str, Any]:
    return {
        "format": "pretravel project",
        "version": 1,
        "name": "x",
        "identity": IDENTITY,
        "screens": {},
    } | changes


def with_file(name: str, size: int) -> dict[str, Any]:
    return stated(
        screens={"part": {"settings": {}, "files": {"part": [{"name": name, "size": size}]}}}
    )


def test_a_project_is_read_as_it_was_written(tmp_path: Path) -> None:
    project = example()
    write_project(tmp_path / "p.pretravel", project)
    found = read_project(tmp_path / "p.pretravel")
    assert (found.name, found.identity) == (project.name, project.identity)
    assert content(found) == content(project)


def test_a_snapshot_does_not_change_with_its_project() -> None:
    project = example()
    before = content(project)
    snapshot = project.snapshot()
    project.screen("engineer").settings["diameter"] = 30.0
    del project.screen("part").files["part"]
    assert content(snapshot) == before


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (b"", "this is not a project of pretravel"),
        (b"x_mm,y_mm\n1,2\n", "this is not a project of pretravel"),
        (project_bytes(example())[:300], "damaged"),
        (archive("{"), "not JSON"),
        (archive("[" * 100_000), "too deep"),
        (archive(stated(format="other")), "not a project"),
        (archive(stated(version=2)), "version 2.*use a newer pretravel"),
        (archive(stated(identity="../../x")), "hexadecimal"),
        (archive(stated(screens={"../x": {"settings": {}, "files": {}}})), "cannot be used"),
        (archive(stated(screens={"part": {"settings": {}}})), "not as pretravel writes it"),
        (archive(with_file("../../evil", 1)), "without folders"),
        (archive(with_file("a.step", 1)), "damaged"),
        (archive(with_file("a.step", 3), {"files/part/part/a.step": b"four"}), "larger"),
    ],
)
def test_what_is_no_project_is_refused(given: bytes, message: str) -> None:
    with pytest.raises(InputError, match=f"(?s)p.pretravel: .*{message}"):
        project_of(given, "p.pretravel")


def test_a_bomb_is_refused_in_little_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """50 MB that are 0.05 MB in the file, where a project may have 1 MB."""
    monkeypatch.setattr(project_file, "LARGEST_PROJECT", 1_000_000)
    entry = b"\0" * 50_000_000
    bomb = archive(with_file("a.step", len(entry)), {"files/part/part/a.step": entry})
    del entry
    tracemalloc.start()
    with pytest.raises(InputError, match="larger"):
        project_of(bomb, "p.pretravel")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 10e6


@pytest.mark.parametrize("size", [-2, -1000, 1.5, True, "3", None, float("nan"), 1e30])
def test_a_size_is_a_number_of_bytes(size: Any) -> None:
    """zipfile reads the whole entry where it is asked for a negative number of bytes."""
    entry = b"\0" * 50_000_000
    bomb = archive(with_file("a.step", size), {"files/part/part/a.step": entry})
    del entry
    tracemalloc.start()
    with pytest.raises(InputError, match="is not a number of bytes"):
        project_of(bomb, "p.pretravel")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 10e6


@pytest.mark.parametrize("form", ["plain", "with a comment", "of zip64"])
def test_millions_of_entries_are_refused_before_zipfile_reads_them(
    monkeypatch: pytest.MonkeyPatch, form: str
) -> None:
    """It makes an object of each, 15 times as large. The size of the first one's directory has the
    bytes by which a search would find another end of the archive."""
    before, size, comment = b"", int.from_bytes(b"PK\5\6", "little"), b""
    if form == "with a comment":
        size, comment = 500_000_000, b"a"
    elif form == "of zip64":
        size, before = 400, b"PK\6\7" + bytes(16)
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 9, 9, size, 0, len(comment)) + comment
    monkeypatch.setattr(zipfile, "ZipFile", None)
    with pytest.raises(InputError, match="more than 2000 entries"):
        project_of(b"PK" + bytes(100) + before + end)


def test_very_many_entries_are_refused() -> None:
    many = archive(stated(), {f"files/{n}": b"" for n in range(2001)})
    with pytest.raises(InputError, match="2002 entries"):
        project_of(many, "p.pretravel")


@pytest.mark.parametrize(
    "name",
    [
        "",
        ".",
        "..",
        "a/b",
        "a\\b",
        "C:a",
        "a\nb",
        "\x00",
        "x" * 151,
        "nul",
        "a\u202eb",
        "--output=x.csv",
    ],
)
def test_names_that_could_mean_something_else_are_refused(name: str) -> None:
    with pytest.raises(PretravelError, match="cannot be used"):
        StoredFile(name, b"")


def nested(levels: int) -> Any:
    value: Any = 1.0
    for _ in range(levels):
        value = [value]
    return value


@pytest.mark.parametrize(
    "value",
    [
        float("nan"), float("inf"), object(), {1, 2}, "x" * 1_000_001,
        "\ud800", {"\ud800": 1}, nested(21), nested(700),
    ],
)  # fmt: skip
def test_settings_that_json_cannot_hold_are_refused(value: object) -> None:
    project = Project()
    with pytest.raises(PretravelError, match="the setting 'diameter'"):
        project.screen("engineer").settings["diameter"] = value
    assert dict(project.screen("engineer").settings) == {}


def test_a_project_that_is_taken_can_always_be_saved() -> None:
    """What cannot be copied or written would end the saving of all that follows."""
    for settings in ({"a": nested(700)}, {"a": "\ud800"}, {"\ud800": 1}):
        part = {"settings": settings, "files": {}}
        with pytest.raises(InputError, match="cannot be stored"):
            project_of(archive(stated(screens={"part": part})))
    named = project_of(
        archive(
            stated(name="a\ud800", screens={"part": {"settings": {"a": nested(20)}, "files": {}}})
        )
    )
    again = project_of(project_bytes(named.snapshot()))
    assert again.screen("part").settings["a"] == nested(20)
    assert again.name == "a?"


NORTH = {"laboratory.name": "North"}


class TestWhatAllScreensHaveInCommon:
    def test_it_is_stored_once_and_told_to_every_screen(self) -> None:
        project, told = Project("x", IDENTITY), []
        project.screen("laboratory").listen(lambda: told.append("laboratory"))
        project.screen("metrologist").settings["statements"] = NORTH
        assert told == ["laboratory"]
        assert dict(project.screen("laboratory").settings) == {"statements": NORTH}
        packed = zipfile.ZipFile(io.BytesIO(project_bytes(project)))
        assert packed.read("project.json").count(b"North") == 1
        again = project_of(project_bytes(project))
        assert again.screen("task-measure").settings["statements"] == NORTH
        assert project.snapshot().screen("x").settings["statements"] == NORTH
        del again.screen("laboratory").settings["statements"]
        assert "statements" not in again.screen("metrologist").settings

    def test_of_earlier_versions_the_screens_are_put_together(self) -> None:
        """Where two differ, the one that comes first in the file holds."""
        screens = {
            "laboratory": {"settings": {"statements": NORTH}, "files": {}},
            "metrologist": {
                "settings": {"statements": {"laboratory.name": "South", "customer.name": "C"}},
                "files": {},
            },
        }
        project = project_of(archive(stated(screens=screens)))
        together = {"laboratory.name": "North", "customer.name": "C"}
        assert project.screen("laboratory").settings["statements"] == together

    @pytest.mark.parametrize("wrong", ["statements", ["statements"], 3])
    def test_what_is_no_mapping_is_refused(self, wrong: object) -> None:
        with pytest.raises(InputError, match="not as pretravel writes it"):
            project_of(archive(stated(shared=wrong)))
