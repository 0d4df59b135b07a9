"""The steps at a control are those of the files that were made, for every control."""

from __future__ import annotations

import pytest

from pretravel.controls.tasks.export import Export, control_names, steps_at_control
from tests.support.example_maps import example_map

WITH_TABLES = ["fanuc", "haas", "siemens"]


def _made(control: str, **stated: object) -> tuple[str, str]:
    """The steps, and the texts of the files."""
    task = Export(map_file="map.json", to=control, **stated)  # type: ignore[arg-type]
    files = task.exported(example_map()).files
    return " ".join(steps_at_control(control, files)), "\n".join(files.texts.values())


@pytest.mark.parametrize("control", [*control_names()])
def test_every_control_has_steps(control: str) -> None:
    steps, _ = _made(control)
    assert steps


@pytest.mark.parametrize("control", ["fanuc", "haas"])
def test_the_programs_that_are_called_are_those_of_the_files(control: str) -> None:
    steps, head = _made(control, program=8100, form="table")
    assert "Copy both programs" in steps
    assert "G65 P8100" in steps
    assert "G65 P8101" in steps
    assert "G65 P8101" in head  # the head of the file states the same call


@pytest.mark.parametrize("control", WITH_TABLES)
def test_a_formula_has_no_table_to_fill(control: str) -> None:
    """The page said: copy both programs, fill the table; the file said: NEEDS NO TABLE."""
    steps, head = _made(control, form="formula")
    assert "needs no table" in head.lower()
    assert not any(words in steps for words in ("both", "is filled", "PRETRAVEL_TABLE"))
    with_table, _ = _made(control, form="table")
    assert "once" in with_table
    assert "once" not in steps
