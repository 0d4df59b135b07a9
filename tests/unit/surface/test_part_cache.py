"""A part that was read is kept: the same faces and points; a damaged entry is ignored."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base import PretravelError
from pretravel.surface import read_part
from pretravel.surface.cad import face_numbers, part_cache, step_part

pytest.importorskip("netgen")
BRACKET = Path(__file__).parents[3] / "examples" / "data" / "bracket.step"


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("PRETRAVEL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def _refuse(path: object) -> object:
    raise PretravelError(f"{path} is read again")


def test_a_part_is_read_once(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    first = read_part(BRACKET)
    points = first.cloud.points
    monkeypatch.setattr(step_part, "read_step_part", _refuse)
    monkeypatch.setattr(part_cache, "_write", _refuse)  # its points are not made again either
    again = read_part(BRACKET)
    assert again.chosen == first.chosen
    for one, other in zip(first.faces, again.faces, strict=True):
        assert (one.number, one.kind, one.flips) == (other.number, other.kind, other.flips)
        np.testing.assert_allclose(one.coarse.points, other.coarse.points, atol=1e-12)
    np.testing.assert_array_equal(again.cloud.points, points)
    assert len(list(folder.glob("part-*.npz"))) == 2


def test_numbers_of_faces_are_computed_once(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    first = read_part(BRACKET)
    numbers, box = first.numbers, first.box
    monkeypatch.setattr(face_numbers, "_each", _refuse)
    again = read_part(BRACKET)
    for one, other in zip(numbers, again.numbers, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(again.box, box)
    assert "coarse" not in again.faces[0].__dict__  # nothing was sampled for it
    np.testing.assert_array_equal(again.faces[0].middle, numbers.middle[0])
    (entry,) = folder.glob("part-*-numbers.npz")
    np.savez(entry, **{**numbers._asdict(), "bend": numbers.bend[:-1]})
    with pytest.raises(PretravelError, match="is read again"):
        _ = read_part(BRACKET).numbers


def test_another_content_is_another_part(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "part.step"
    text = BRACKET.read_bytes()
    path.write_bytes(text)
    read_part(path)
    path.write_bytes(text + b"\n")
    read_part(path)
    assert len(list(folder.glob("part-*.npz"))) == 2


@pytest.mark.parametrize("left", [0, 100, 5000])
def test_a_damaged_entry_is_ignored(folder: Path, left: int) -> None:
    count = len(read_part(BRACKET).faces)
    (entry,) = folder.glob("part-*.npz")
    whole = entry.read_bytes()
    entry.write_bytes(whole[:left])
    assert len(read_part(BRACKET).faces) == count
    assert len(entry.read_bytes()) == len(whole)


def test_an_entry_makes_objects_of_listed_classes_alone() -> None:
    with pytest.raises(KeyError):
        part_cache._object({"class": "Path", "args": "x"}, [])


@pytest.mark.skipif(not hasattr(__import__("os"), "geteuid"), reason="no permissions of this kind")
def test_an_entry_that_others_can_write_is_not_used(
    monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    read_part(BRACKET)
    folder.chmod(0o777)
    monkeypatch.setattr(step_part, "read_step_part", _refuse)
    with pytest.raises(PretravelError, match="read again"):
        read_part(BRACKET)


@pytest.mark.parametrize("limit", ["_MOST_ENTRIES", "_MOST_BYTES"])
def test_old_entries_are_removed(limit: str, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setattr(part_cache, limit, 1)
    part = read_part(BRACKET)
    assert len(part.cloud.points) > 0
    (entry,) = folder.glob("part-*.npz")
    assert entry.stem.count("-") == 2  # that of the points, the newest
