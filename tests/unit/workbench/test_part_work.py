"""The part of a project is geometry: nothing of a file that was sent is executed."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.errors import PretravelError
from pretravel.workbench.screens.part_work import compensate_part
from pretravel.workbench.tasks import Inputs
from tests.support.examples import EXAMPLES


@pytest.mark.parametrize("name", ["evil.py", "evil.py#a.step"])
def test_a_python_file_as_part_is_not_executed(tmp_path: Path, name: str) -> None:
    """A project that somebody sent can contain any file: its endings were not checked at a drop."""
    executed = tmp_path / "executed"
    for place in (name, "evil.py"):
        (tmp_path / place).write_text(f"open({str(executed)!r}, 'w')\nsurface = 1\n")
    files = {"touches": (EXAMPLES / "part_touches.csv",), "part": (tmp_path / name,)}
    with pytest.raises(PretravelError):
        compensate_part(Inputs({"probe": "omp40-2"}, files))
    assert not executed.exists()
