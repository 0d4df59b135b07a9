"""The forms of the workbench have all settings of their tasks, and their commands do the same."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Annotated, Any

import pytest

from pretravel.app.jobs import Job
from pretravel.app.project import Inputs
from pretravel.app.task_form import TaskForm, with_file_names
from pretravel.base.errors import PretravelError
from pretravel.controls.screen.settings import CONTROL, QUALIFICATION
from pretravel.controls.screen.work import EXPORT, FIT
from pretravel.controls.tasks.export import Export
from pretravel.drawing.screen import part
from pretravel.drawing.screen.work import FEATURE_FORM, PART_FORM
from pretravel.laboratory.tasks.check import Check
from pretravel.laboratory.tasks.check import screen as metrologist
from pretravel.laboratory.tasks.check.screen_work import FORM
from pretravel.laboratory.tasks.rig import screen as laboratory
from pretravel.laboratory.tasks.rig.screen_work import (
    RIG_FORM,
    SEPARATION_FORM,
    calibrate_rig_traces,
    separate_readings,
)
from pretravel.show.as_json import document_values
from pretravel.task.example_data import example_folder
from pretravel.task.fields import TouchFiles
from pretravel.task.task import Field, Result, by_name
from tests.support.commands import run

FORMS: dict[str, tuple[TaskForm, Job | None]] = {
    "qualify": (QUALIFICATION, FIT),
    "export": (CONTROL, EXPORT),
    "check": (FORM, metrologist.CHECK),
    "rig": (RIG_FORM, laboratory.RIG),
    "separate": (SEPARATION_FORM, laboratory.SEPARATION),
    "compensate": (PART_FORM, part.COMPENSATION),
    "measure": (FEATURE_FORM, None),  # its job is made with the screen
}


@pytest.mark.parametrize("name", FORMS)
def test_a_form_has_the_settings_of_its_task_but_no_files_and_its_result_depends_on_them(
    name: str,
) -> None:
    form, job = FORMS[name]
    for setting in form.settings:
        assert not setting.field.reads
        assert not setting.field.writes
    own = vars(form.task)["__annotations__"]
    files = {n for n in own if by_name(form.task)[n].field.reads}
    files |= {n for n in own if by_name(form.task)[n].field.writes}
    assert {n for n in own if n not in form.names} == files | set(form.without)
    if job is not None:
        assert set(form.stored) <= set(job.settings)


class Dip(TouchFiles):
    """A task with options of several types."""

    name = "dip"

    depth: Annotated[float, Field(help="Depth, in mm.", unit="mm", range=(0.0, 9.0))]
    repeats: Annotated[int, Field(help="Touches.", range=(1, 9))] = 1
    names: Annotated[tuple[str, ...], Field(help="Names.")] = ()


def test_what_is_stored_becomes_the_task_its_command_and_its_lines() -> None:
    form = TaskForm(Dip, shared=("units",), prefix="dip_")
    stored = {"dip_depth": 2.5, "dip_repeats": 3.0, "dip_names": "a b", "dip_units": "", "depth": 9}
    task = Dip(touches="folder/t.csv", **form.given(stored))
    same = with_file_names(task)
    assert same.command_line() == "pretravel dip t.csv --depth 2.5 --repeats 3 --names a --names b"
    assert "Dip(touches='t.csv', depth=2.5, repeats=3, names=['a', 'b'])" in same.python_lines()


@pytest.mark.parametrize(
    ("stored", "words"),
    [
        ({}, "depth must be given"),
        ({"depth": 10.0}, "it must lie between 0 and 9"),
        ({"depth": 1.0, "repeats": 2.5}, "repeats is 2.5; it must be a whole number"),
        ({"depth": [1.0]}, "it must be a number"),
    ],
)
def test_what_cannot_be_used_is_said(stored: dict[str, Any], words: str) -> None:
    with pytest.raises(PretravelError, match=words):
        Dip(touches="t.csv", **TaskForm(Dip).given(stored))


def test_choices_of_forms_have_words_for_names_that_exist() -> None:
    for task, name in (
        (Export, "to"),
        (Export, "criterion"),
        (Export, "form"),
        (Check, "standard"),
    ):
        setting = by_name(task)[name]
        assert setting.shown_words
        assert set(setting.shown_words) - {""} <= set(setting.choices)


def _values(result: Result) -> dict[str, Any]:
    """Those of the report, as a file has them; its warnings are also of what is asked for."""
    document = result.page()
    assert document is not None
    return _without_warnings(json.loads(json.dumps(document_values(document))))


def _without_warnings(document: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in document.items() if name != "warnings"}


def _written(path: str) -> dict[str, Any]:
    return _without_warnings(json.loads(Path(path).read_text())["document"])


@pytest.mark.long
def test_the_command_of_the_rig_finds_the_same_with_moved_marks_and_traces_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    traces = sorted((example_folder() / "rig").glob("*.csv"))
    first, last = traces[0], traces[-1].stem
    before = calibrate_rig_traces(Inputs({}, {"traces": tuple(traces)}))
    place = before.trace(first.stem)[1].r0 - 2e-4
    settings: dict[str, Any] = {
        "temperature": 21.5,
        "exclude": [last, "gone"],
        "mark": [f"{first.stem}:r0={place:.9f}", "gone:r0=1"],
    }
    result = calibrate_rig_traces(Inputs(settings, {"traces": tuple(traces)}))
    assert _values(result.rig) != _values(before.rig)
    monkeypatch.chdir(tmp_path)
    for path in traces:
        (tmp_path / path.name).write_bytes(path.read_bytes())
    run(*shlex.split(result.same.command_line())[1:])
    assert _written("rig.json") == _values(result.rig)


def test_the_command_of_a_separation_finds_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = example_folder() / "redundancy_24x24.csv"
    settings = {"separate_method": "least-squares", "separate_exclude": "1,1 2,3"}
    result = separate_readings(Inputs(settings, {"readings": (path,)}))
    monkeypatch.chdir(tmp_path)
    (tmp_path / path.name).write_bytes(path.read_bytes())
    run(*shlex.split(result.same.command_line())[1:])
    assert _written("separation.json") == _values(result.made)
