"""Which project the workbench opens, and which ones it lists."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pretravel.app.project import Project
from pretravel.app.project_file import write_project
from pretravel.app.session import Sessions, projects_folder, recent_projects


def test_a_file_that_is_being_written_is_no_project(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A workbench that was killed while it saved leaves one, newer than all projects."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    folder = projects_folder()
    project = Project("Probe 7")
    path = folder / f"{project.identity}.pretravel"
    write_project(path, project)
    left = folder / ".pretravel-unfinished-abc.pretravel"
    left.write_bytes(path.read_bytes())
    newer = path.stat().st_mtime + 10.0
    os.utime(left, (newer, newer))
    assert [recent.path for recent in recent_projects()] == [path]
    sessions = Sessions()
    sessions.start(None, "http://127.0.0.1:1/")
    assert sessions.current.path == path
    assert sessions.project.name == "Probe 7"
