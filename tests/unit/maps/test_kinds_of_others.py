"""Kinds of map that other packages add, by entry points."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from pretravel import maps
from pretravel.base.errors import PretravelError
from pretravel.maps.kinds import ENTRY_POINTS, kind_named, kinds

ROOT = Path(__file__).parents[3]

BELT = """
from dataclasses import dataclass
from typing import ClassVar
from pretravel.maps.kinds.mean import MeanBasis, MeanKind

class BeltBasis(MeanBasis):
    kind: ClassVar[str] = "belt"

@dataclass(frozen=True)
class BeltKind(MeanKind):
    name: ClassVar[str] = "belt"
    bases: ClassVar = (BeltBasis,)
    width: float = 1.0
"""
PROGRAM = """
from pretravel.maps.basis import StoredBasis
from pretravel.maps.kinds import kind_named, kinds, restored_basis
import sys
assert list(kinds())[-1] == "belt", list(kinds())
assert "belt_maps" not in sys.modules
assert "pretravel.six_seats.physical" not in sys.modules
assert kinds()["mean"].title == "one radius for all"
assert kind_named("belt", width=2.0).width == 2.0
assert type(restored_basis("belt", StoredBasis(None, 3.0))).__name__ == "BeltBasis"
"""


def test_the_package_lists_its_own_kinds() -> None:
    """In code, the simple ones first; an installation is not asked for them."""
    assert list(kinds())[:5] == ["mean", "sectors", "wozniak", "harmonic", "physical"]
    assert all(kinds()[name].name == name and kinds()[name].title for name in kinds())
    assert (
        "entry-points" not in tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    )


def test_another_package_adds_a_kind(tmp_path: Path) -> None:
    """It is imported when it is asked for, and its maps are restored."""
    (tmp_path / "belt_maps.py").write_text(BELT)
    info = tmp_path / "belt_maps-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: belt-maps\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{ENTRY_POINTS}]\nbelt = belt_maps:BeltKind\n")
    folders = [str(tmp_path), str(Path(maps.__file__).parents[2])]
    program = f"import sys\nsys.path[:0] = {folders}\n{PROGRAM}"
    subprocess.run([sys.executable, "-c", program], check=True)


def test_unknown_kinds_and_settings_are_refused() -> None:
    with pytest.raises(PretravelError, match="map kind 'belt' is not known; there are mean, sec"):
        kind_named("belt")
    with pytest.raises(PretravelError, match="kind mean has no setting of this name"):
        kind_named("mean", width=2.0)
