"""What the screen Metrologist computes: the same as the command line, for each standard."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from pretravel.app.project import Inputs, SettingValue
from pretravel.base.errors import PretravelError
from pretravel.laboratory.tasks.check.screen_work import (
    EXAMPLE_SETTINGS,
    check_by_standard,
    example_touches,
)
from pretravel.task.standards import STANDARDS
from tests.support.commands import rows, run


def _inputs(folder: Path, standard: str, **settings: SettingValue) -> Inputs:
    name, content = example_touches(standard)
    path = folder / name
    path.write_bytes(content)
    return Inputs({**EXAMPLE_SETTINGS, "standard": standard, **settings}, {"touches": (path,)})


@pytest.mark.parametrize("standard", STANDARDS)
def test_the_command_that_is_shown_finds_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, standard: str
) -> None:
    """Settings of the other standards are there, and do not count."""
    limits = {"size_limit_um": 20.0, "repeat_limit_um": 5.0}
    if standard == "iso230-10-tip-offset":  # each direction of its example is touched once
        del limits["repeat_limit_um"]
    result = check_by_standard(_inputs(tmp_path, standard, **limits))
    monkeypatch.chdir(tmp_path)
    words = shlex.split(result.same.command_line())
    exceeds = any("exceeds" in figure.verdict for figure in result.made.result.figures)
    run(*words[1:-1], "check.csv", code=3 if exceeds else 0)
    found = {row["figure"]: float(row["value_um"]) for row in rows(tmp_path / "check.csv")}
    mine = {figure.name: 1e3 * figure.value for figure in result.made.result.figures}
    assert found == pytest.approx(mine)


def test_the_example_has_the_offset_that_it_was_made_with(tmp_path: Path) -> None:
    """4 and -3 µm; a part of the pretravel counts as an offset only where it shifts a circle: an
    even tripod's has harmonics 3, 6, …, which 36 directions keep apart from the first."""
    result = check_by_standard(_inputs(tmp_path, "iso230-10-tip-offset"))
    x, y = result.made.result.figures[:2]
    for figure, wanted in ((x, 0.004), (y, -0.003)):
        assert figure.u_test is not None
        assert abs(figure.value - wanted) < 3.0 * figure.u_test
        # The noise of 72 touches is 0.05 µm; without repeats the lobes count as scatter too.
        assert figure.u_test < 0.001


def test_a_map_is_refused_before_the_touches_are_read(tmp_path: Path) -> None:
    nothing = tmp_path / "nothing.csv"
    nothing.write_text("no touches")
    files = {"touches": (nothing,), "map": (nothing,)}
    with pytest.raises(PretravelError, match="map is only for"):
        check_by_standard(Inputs({"standard": "iso230-10-tip-offset", "diameter": 25.0}, files))
