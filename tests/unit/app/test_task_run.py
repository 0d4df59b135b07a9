"""Every task of the command line runs from a form, and gives the files that the command writes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pretravel.app.project import Inputs
from pretravel.app.task_form import stored_default
from pretravel.app.task_run import (
    NOT_HERE,
    file_settings,
    form_of,
    run_task,
    tasks_on_screens,
    typed_too,
)
from pretravel.base.errors import PretravelError
from pretravel.files.map_file import read_map
from pretravel.task.example_data import example_folder
from pretravel.task.listed import PLACES, task_named
from pretravel.task.task import by_name
from tests.support.commands import run

DATA = example_folder()
ON_SCREENS = [name for tasks in tasks_on_screens().values() for name in tasks]


def test_every_task_has_a_screen_or_a_reason() -> None:
    assert {*ON_SCREENS, *NOT_HERE} == set(PLACES)
    assert all(NOT_HERE.values())


@pytest.mark.parametrize("name", ON_SCREENS)
def test_every_setting_has_a_place(name: str) -> None:
    """A field, a place for a file, an output or an address; a field shows its default."""
    kind = task_named(name)
    fields = set(form_of(kind).names)
    files = {setting.name for setting in file_settings(kind)}
    outputs = {n for n, setting in by_name(kind).items() if setting.field.writes}
    addresses = {n for n, setting in by_name(kind).items() if setting.field.connects}
    assert fields | files | outputs | addresses == set(by_name(kind))
    assert not fields & (files | addresses)
    for setting in form_of(kind).settings:
        json.dumps(stored_default(setting))


def test_a_table_of_touches_is_judged_as_by_the_command() -> None:
    log = DATA / "sphere_touches.csv"
    settings = {"task": "qualify", "diameter": 24.9987, "tip_diameter": 6.0, "kind": "mean"}
    found = run_task(Inputs(settings, {"touches": (log,)}))
    assert found.command == (
        "pretravel qualify sphere_touches.csv --diameter 24.9987 --tip-diameter 6 --kind mean"
    )
    assert found.report is not None
    shown = run("qualify", log, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "mean")
    assert found.report.verdict in shown.replace("\n  ", " ")
    assert list(found.files) == ["qualify.json"]


def test_its_files_are_those_of_the_command(tmp_path: Path) -> None:
    settings = {"task": "predict", "probe": "omp40-2", "polar": "90", "azimuth": "0:350:10"}
    found = run_task(Inputs(settings, {}))
    (tmp_path / "mine.json").write_bytes(found.files["predict.json"])
    run("predict", "omp40-2", "--polar", 90, "--azimuth", "0:350:10", "-o", tmp_path / "its.json")
    mine, theirs = (read_map(tmp_path / f"{name}.json") for name in ("mine", "its"))
    assert mine.coefficients.tolist() == theirs.coefficients.tolist()


def test_an_output_that_must_be_there_and_a_text() -> None:
    found = run_task(Inputs({"task": "pattern", "standard": "iso10360-5", "diameter": 25.0}, {}))
    assert found.files["pattern.csv"].count(b"\n") > 25
    found = run_task(Inputs({"task": "probes", "probe": "omp40-2"}, {}))
    assert "[moving]" in found.text
    assert found.report is None


def test_what_is_missing_is_said_by_its_label() -> None:
    with pytest.raises(PretravelError, match="is missing: drop the file"):
        run_task(Inputs({"task": "repeat"}, {}))


def test_a_probe_is_a_word_or_a_file() -> None:
    (setting,) = (s for s in file_settings(task_named("predict")) if s.name == "probe")
    assert typed_too(setting)


def test_a_report_has_what_the_laboratory_states_in_the_project() -> None:
    """All screens of a project share it; the command that is shown takes the file of it."""
    settings = {"task": "qualify", "diameter": 24.9987, "kind": "mean",
                "statements": {"laboratory.name": "North"}}  # fmt: skip
    found = run_task(Inputs(settings, {"touches": (DATA / "sphere_touches.csv",)}))
    assert found.command.endswith("--kind mean --lab laboratory.toml")
    assert found.page is not None
    stated = {figure.statement: figure.value for figure in found.page.sections[0].figures}
    assert stated["laboratory.name"] == "North"
    assert not [warning for warning in found.page.warnings if "laboratory.toml" in warning]


def test_words_that_are_printed_name_the_file_of_the_user(tmp_path: Path) -> None:
    log = tmp_path / "touches" / "mine.csv"
    log.parent.mkdir()
    log.write_bytes((DATA / "bore_touches.csv").read_bytes())
    text = run_task(Inputs({"task": "convert"}, {"touches": (log,)})).text
    assert text.startswith("mine.csv: ")
    assert str(tmp_path) not in text


def test_a_task_whose_output_is_a_page_gives_it(tmp_path: Path) -> None:
    values = tmp_path / "plan.report.json"
    run("separation-plan", "--u-systematic", 0.2, "-o", values)
    found = run_task(Inputs({"task": "report"}, {"results": (values,)}))
    assert found.text == "report.html: 1 result\n"
    assert b"<html" in found.files["report.html"][:200]


def test_touches_on_a_block_give_its_terms_instead_of_a_map() -> None:
    settings = {"task": "qualify", "tip_diameter": 6.0, "block": "25.4,50.8,76.2"}
    found = run_task(Inputs(settings, {"touches": (DATA / "block_touches.csv",)}))
    assert list(found.files) == ["qualify.csv"]


@pytest.mark.parametrize("typed", ["#3", "bracket.step#3"])
def test_a_face_of_the_file_is_typed_beside_it(typed: str) -> None:
    settings = {"task": "plan", "surface": typed, "grid": "3x3"}
    found = run_task(Inputs(settings, {"surface": (DATA / "bracket.step",)}))
    assert found.command == "pretravel plan 'bracket.step#3' --grid 3x3 -o plan.csv"


def test_what_is_converted_can_be_taken_once_nothing_lacks() -> None:
    log = DATA / "bore_touches.csv"
    found = run_task(Inputs({"task": "convert"}, {"touches": (log,)}))
    assert "format csv" in found.text
    assert found.files["convert.csv"].count(b"\n") > 40
    positions = {"task": "convert", "columns": "nx=none,ny=none,nz=none"}
    assert run_task(Inputs(positions, {"touches": (log,)})).files == {}
