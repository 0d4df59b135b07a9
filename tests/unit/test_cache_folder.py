"""A folder is private where nobody but the user and root can change it or a folder on its way."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from pretravel.base.caches import cache_folder, mistrust, private

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no permissions of this kind")
ME, OTHER = 1000, 1001
FOLDER, LINK = stat.S_IFDIR, stat.S_IFLNK


@pytest.mark.parametrize(
    ("owner", "mode", "reason"),
    [
        (0, FOLDER | 0o755, ""),
        (ME, FOLDER | 0o755, ""),
        (0, FOLDER | 0o1777, ""),  # /tmp
        (ME, FOLDER | 0o1777, "can be written to"),
        (OTHER, FOLDER | 0o1777, "belongs to another user"),
        (OTHER, FOLDER | 0o755, "belongs to another user"),
        (ME, FOLDER | 0o775, "can be written to"),  # a member of the group exchanges folders
        (0, FOLDER | 0o775, "can be written to"),
        (ME, FOLDER | 0o757, "can be written to"),
        (ME, LINK | 0o777, "is a link"),
    ],
)
def test_the_folder_above(
    monkeypatch: pytest.MonkeyPatch, owner: int, mode: int, reason: str
) -> None:
    places = {"/a/b/cache": (ME, FOLDER | 0o700), "/a/b": (owner, mode)}

    def lstat(place: Path) -> SimpleNamespace:
        uid, bits = places.get(str(place), (0, FOLDER | 0o755))
        return SimpleNamespace(st_uid=uid, st_mode=bits)

    monkeypatch.setattr(Path, "lstat", lstat)
    monkeypatch.setattr(os, "geteuid", lambda: ME)
    found = mistrust(Path("/a/b/cache"))
    assert reason in found
    assert bool(found) == bool(reason)


def test_missing_folders_are_made_private(tmp_path: Path) -> None:
    """Also with the mask of a group that works together."""
    mask = os.umask(0o002)
    try:
        assert private(tmp_path / "a" / "b") == ""
    finally:
        os.umask(mask)
    assert [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("a", "a/b")] == [0o700] * 2


def test_a_link_is_followed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who owns it could let it point elsewhere after the folder was looked at."""
    (tmp_path / "one").mkdir()
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "one")
    monkeypatch.setenv("PRETRAVEL_CACHE", str(link / "cache"))
    assert cache_folder() == (tmp_path / "one" / "cache").resolve()
