"""What a screen took of another one, and when it is old."""

from __future__ import annotations

import pytest

from pretravel.app.links import (
    OF_REFERENCE,
    link_of_file,
    link_of_reference,
    link_of_result,
    newer_inputs,
)
from pretravel.app.project import Link, Project, StoredFile
from pretravel.app.project_file import project_bytes, project_of
from pretravel.base import InputError
from pretravel.controls.screen.work import FIT

TOUCHES, MAP = StoredFile("a.csv", b"1"), StoredFile("map.json", b"{}")


def _linked() -> Project:
    """A part with the map, the reference and the file of the engineer's screen."""
    project = Project()
    engineer, part = project.screen("engineer"), project.screen("part")
    engineer.files["touches"] = part.files["touches"] = (TOUCHES,)
    part.files["map"] = (MAP,)
    engineer.settings["diameter"] = part.settings["diameter"] = 25.0
    part.link("touches", link_of_file(engineer, "touches", TOUCHES.digest))
    part.link("map", link_of_result(engineer, FIT, MAP.digest))
    part.link(OF_REFERENCE, link_of_reference(engineer))
    return project


def test_nothing_is_old_at_first_and_after_a_new_start() -> None:
    project = _linked()
    assert newer_inputs(project.screen("part")) == {}
    again = project_of(project_bytes(project)).screen("part")
    assert again.links == project.screen("part").links
    assert newer_inputs(again) == {}


def test_each_change_of_the_source_makes_old_what_depends_on_it() -> None:
    project = _linked()
    engineer, part = project.screen("engineer"), project.screen("part")
    engineer.settings["tip_diameter"] = 6.0  # of the reference, and an input of the map
    assert set(newer_inputs(part)) == {"map", OF_REFERENCE}
    del engineer.settings["tip_diameter"]
    assert newer_inputs(part) == {}  # what was before is before again
    engineer.settings["left_out"] = {"file": "x", "left_out": ["a.csv:2"]}
    assert set(newer_inputs(part)) == {"map"}
    engineer.files["touches"] = (StoredFile("b.csv", b"2"),)
    assert set(newer_inputs(part)) == {"map", "touches"}
    # What is gone has no newer one.
    engineer.files["touches"] = ()
    assert newer_inputs(part) == {}


def test_what_the_user_replaced_himself_is_his_own() -> None:
    project = _linked()
    engineer, part = project.screen("engineer"), project.screen("part")
    part.files["map"] = (StoredFile("mine.json", b"[]"),)
    part.settings["diameter"] = 30.0
    engineer.settings["diameter"] = 25.0007
    engineer.files["touches"] = (StoredFile("b.csv", b"2"),)
    assert set(newer_inputs(part)) == {"touches"}


def test_a_link_of_a_stranger_is_checked() -> None:
    project = _linked()
    project.screen("part").links["map"] = Link("../x", "file", "touches", "1", "2")
    with pytest.raises(InputError, match="cannot be used"):
        project_of(project_bytes(project))
    project.screen("part").links["map"] = Link("engineer", "file", "x" * 300, "1", "2")
    with pytest.raises(InputError, match="a link in it is not text"):
        project_of(project_bytes(project))


def test_an_example_gives_back_what_the_user_had() -> None:
    project = Project()
    state = project.screen("engineer")
    state.files["touches"], state.settings["diameter"] = (TOUCHES,), 24.0
    example = {"touches": (StoredFile("example.csv", b"3"),), "map": (MAP,)}
    state.fill({"diameter": 25.0, "tip_diameter": 6.0}, example)
    state.fill({"diameter": 26.0}, example)  # another example does not take the place of his own
    state.take_back()
    assert state.settings.plain() == {"diameter": 24.0}
    assert dict(state.files) == {"touches": (TOUCHES,)}
    assert not state.can_take_back
    assert project.name == "Example"  # until the first file of the user's own
    project.named_after("probe 7.csv")
    assert project.name == "probe 7"
