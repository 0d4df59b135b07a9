"""A project is open in one workbench; another user can neither prevent that nor say where."""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
from pathlib import Path

import pytest

from pretravel.app.project_lock import ProjectLock
from pretravel.base.errors import PretravelError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="locks of another kind")


@pytest.fixture(autouse=True)
def _folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(0o1777)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "shared"))
    monkeypatch.setenv("PRETRAVEL_CACHE", str(tmp_path / "cache"))


def test_the_lock_is_where_only_the_user_can_make_it(tmp_path: Path) -> None:
    import fcntl

    project = tmp_path / "p.pretravel"
    name = hashlib.sha256(os.fsencode(project.resolve())).hexdigest()[:24]
    place = tmp_path / "shared" / f"pretravel-project-{os.getuid()}-{name}.lock"  # the former one
    with place.open("w") as theirs:
        theirs.write("http://evil.example/")
        fcntl.flock(theirs, fcntl.LOCK_EX)
        lock = ProjectLock(project, "http://127.0.0.1:1/")
        (made,) = (tmp_path / "cache").iterdir()
        assert stat.S_IMODE((tmp_path / "cache").stat().st_mode) == 0o700
        with pytest.raises(PretravelError, match=r"another workbench, at http://127.*:1/: use"):
            ProjectLock(project, "http://127.0.0.1:2/")
        lock.release()
        assert not made.exists()
        ProjectLock(project, "http://127.0.0.1:2/").release()


def test_without_a_private_folder_there_is_no_lock_and_it_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "shared").chmod(0o777)
    monkeypatch.setenv("PRETRAVEL_CACHE", str(tmp_path / "shared" / "cache"))
    with pytest.warns(UserWarning, match=r"is not noticed \(.*/shared, which contains"):
        ProjectLock(tmp_path / "p.pretravel", "http://127.0.0.1:1/").release()


def test_locks_of_killed_workbenches_do_not_pile_up(tmp_path: Path) -> None:
    held = ProjectLock(tmp_path / "a.pretravel", "http://127.0.0.1:1/")
    (kept,) = (tmp_path / "cache").iterdir()
    left = tmp_path / "cache" / "project-0123456789abcdef01234567.lock"
    left.write_text("http://127.0.0.1:9/")
    other = ProjectLock(tmp_path / "b.pretravel", "http://127.0.0.1:1/")
    assert not left.exists()
    assert kept.exists()
    for lock in (held, other):
        lock.release()
    assert list((tmp_path / "cache").iterdir()) == []
