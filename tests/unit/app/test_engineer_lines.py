"""The command and Python lines of the screen of the engineer mean what was typed and chosen."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.app.project import Inputs
from pretravel.controls.screen.settings import EngineerSettings, export_name, file_mark, tasks_of
from pretravel.controls.screen.work import export, fit, look
from pretravel.files.map_file import read_map
from pretravel.task.example_data import example_folder
from tests.support.commands import run

SPHERE = example_folder() / "sphere_touches.csv"
DIAMETERS = {"diameter": 24.9987, "tip_diameter": 6.0}


def shop_table(folder: Path) -> Path:
    """The example touches as a shop writes them: in inches, with other names, decimal commas."""
    rows = np.loadtxt(SPHERE, delimiter=",", skiprows=1)
    rows[:, :3] /= 25.4
    lines = [";".join(f"{value:.9f}".replace(".", ",") for value in row) for row in rows]
    path = folder / "shop table.csv"
    path.write_text("\n".join(["east;north;up;I;J;K", *lines]) + "\n")
    return path


def exported(folder: Path, to: str) -> dict[str, bytes]:
    place = folder / export_name(to)
    files = place.iterdir() if place.is_dir() else [place]
    return {file.name: file.read_bytes() for file in files}


SETTINGS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "defaults": ({**DIAMETERS, "export_to": "fanuc"}, {}),
    "many": (
        {
            **DIAMETERS, "kind": "wozniak", "lobe_azimuth_deg": 31.0, "u_diameter_um": 0.15,
            "u_temperature": 0.5, "sphere_form_um": 0.08, "axial_pretravel_um": 1.2,
            "export_to": "renishaw", "export_units": "inch", "export_base": 520.0,
            "export_criterion": "rms", "export_form": "table",
        },
        {
            "units": "inch", "columns": {"x": "east", "y": "north", "z": "up"},
            "left_out": ["shop table.csv:7", "shop table.csv:9"],
        },
    ),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("name", SETTINGS)
def test_commands_and_python_lines_do_what_the_screen_does(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same map, number by number, and the same files for the control, byte by byte."""
    typed, about = SETTINGS[name]
    path = shop_table(tmp_path) if about else tmp_path / "sphere.csv"
    if not about:
        path.write_bytes(SPHERE.read_bytes())
    mark = file_mark(path.read_bytes())
    answers = {"file": mark, **{k: v for k, v in about.items() if k != "left_out"}}
    left_out = {"file": mark, "left_out": about.get("left_out", [])}
    stored = {**typed, "answers": answers, "left_out": left_out}
    of_path = {"touches": (path,)}
    made = fit(Inputs(stored, of_path, {"look": look(Inputs(stored, of_path))}))
    assert made is not None
    files = export(Inputs(stored, of_path, {"fit": made}))
    assert files is not None
    settings = EngineerSettings.of(stored, path.read_bytes())

    monkeypatch.chdir(tmp_path)
    texts = {
        name or export_name(files.to): text.encode() for name, text in files.files.texts.items()
    }
    tasks = tasks_of(path.name, settings)
    for task in tasks:
        run(*shlex.split(task.command_line())[1:])
    first = read_map("map.json")
    assert np.array_equal(first.coefficients, made.qualified.pretravel_map.coefficients)
    assert np.array_equal(first.covariance.matrix, made.qualified.pretravel_map.covariance.matrix)
    assert exported(tmp_path, files.to) == texts

    again = tmp_path / "again"
    again.mkdir()
    (again / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(again)
    exec("\n".join(task.python_lines() for task in tasks), {})
    second = read_map("map.json")
    assert np.array_equal(second.coefficients, first.coefficients)
    assert np.array_equal(second.covariance.matrix, first.covariance.matrix)
    assert exported(again, files.to) == texts


def test_what_was_stated_about_a_file_does_not_hold_for_another() -> None:
    stored = {
        "answers": {"file": file_mark(b"old"), "units": "inch"},
        "left_out": {"file": file_mark(b"old"), "left_out": ["a.csv:3"]},
    }
    old, new = EngineerSettings.of(stored, b"old"), EngineerSettings.of(stored, b"new")
    assert (old["units"], old.left_out) == ("inch", ("a.csv:3",))
    assert (new["units"], new.left_out) == (None, ())


@pytest.mark.parametrize(("kind", "kept"), [("wozniak", 31.0), ("harmonic", None), ("auto", 31.0)])
def test_a_setting_of_one_kind_is_left_out_for_another(kind: str, kept: float | None) -> None:
    """The form keeps what was typed for a kind; the task of another kind would refuse it."""
    typed = {**DIAMETERS, "kind": kind, "lobe_azimuth_deg": 31.0}
    task = EngineerSettings.of(typed).qualify(Path("sphere.csv"))
    assert task.lobe_azimuth_deg == kept
