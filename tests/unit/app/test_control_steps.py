"""The steps at a control name the programs that were made, for every control of the screen."""

from __future__ import annotations

import pytest

from pretravel.tasks.export import Export, control_names
from pretravel.tasks.qualify.screen.control_steps import control_steps
from tests.support.example_maps import example_map


@pytest.mark.parametrize("control", control_names())
def test_every_control_has_steps(control: str) -> None:
    assert len(control_steps(control, [])) >= 1


@pytest.mark.parametrize("control", ["fanuc", "haas"])
def test_the_programs_that_are_called_are_those_of_the_files(control: str) -> None:
    task = Export(map_file="map.json", to=control, program=8100)
    files = task.exported(example_map()).files
    steps = " ".join(control_steps(control, files.texts))
    assert "G65 P8100" in steps
    assert "G65 P8101" in steps
    head = "\n".join(files.texts.values())
    assert "G65 P8101" in head  # the head of the file states the same call
