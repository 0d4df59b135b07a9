"""A project cannot use files of this computer, and nothing of it is executed: laws of all tasks.

What a stranger's project states is typed text and dropped files. Every text is tried as a path,
every file of the screens in every place that takes one.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import MISSING
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from pretravel.app.project import Inputs
from pretravel.app.task_run import file_settings, form_of, run_task, tasks_on_screens
from pretravel.base.errors import PretravelError
from pretravel.design.studies.wish import WISHES
from pretravel.prediction.catalogue import description_text
from pretravel.task.example_data import example_folder
from pretravel.task.listed import PLACES, task_named
from pretravel.task.task import settings_of
from tests.support.commands import run
from tests.support.touches_of_days import day_of

ON_SCREENS = [name for tasks in tasks_on_screens().values() for name in tasks]
every_screen = pytest.mark.parametrize("name", ON_SCREENS)
DATA = example_folder()
SPHERE = {"diameter": 24.9987, "tip_diameter": 6.0}
TYPED: dict[str, dict[str, Any]] = {
    "qualify": {**SPHERE, "kind": "mean"},
    "verify": SPHERE,
    "history": SPHERE,
    "check-budget": {**SPHERE, "kind": "mean", "sets": 20},
    "repeat": {"axis": "z"},
    "plan": {"spacing": 12.0},
    "export": {"to": "linuxcnc"},
    "program sphere": {"diameter": 25.0},
    "program axis": {
        "axis": "C",
        "angles": "0,90,180",
        "diameter": 25.0,
        "center": "30,0,0",
        "about": "0,0,0",
    },
    "predict": {"polar": "90", "azimuth": "0:300:60"},
    "slide": {"at": "0.5,0.5", "surface": "convex", "steps": 3},
    "hysteresis": {"steps": 5},
    "identify": {"free": "rotation"},
    "orientation": {"axis": "1,0,1"},
    "separation-plan": {"u_systematic_um": 0.2},
    "check": {"standard": "iso10360-5", "diameter": 24.9987, "tip_diameter": 6.0},
    "pattern": {"standard": "iso10360-5", "diameter": 25.0},
    "simulate": {"surface": "sphere:radius=12.5"},
    "measure": {"feature": "by-label"},
    "align": {"tip_diameter": 6.0},
    "plan-touches": {"count": 5},
    "axis": {"axis": "C"},
}
"""What is typed on the screens of tasks, so that they run."""
RIGHT: dict[str, str] = {
    "touches": "touches.csv", "log": "touches.csv", "map_file": "map.json", "prior": "map.json",
    "places": "touches.csv", "part": "part.step", "step": "part.step", "nominal": "part.step",
    "surface": "part.step", "probe": "probe.toml", "points": "points.csv", "targets": "targets.csv",
    "machine": "machine.toml", "study": "study.toml", "wish": "wish.toml",
    "readings": "readings.csv", "traces": "trace.csv", "results": "result.report.json",
}  # fmt: skip
"""The kind of file that belongs into a place."""
OTHERS: dict[str, dict[str, str]] = {
    "probes": {"probe": "probe.toml"},
    "program part": {"targets": "plan.csv"},
    "check-budget": {"touches": "few.csv"},
    "repeat": {"log": "log.csv"},
    "align": {"touches": "bracket_touches.csv", "part": "bracket.step"},
    "plan-touches": {"map_file": "map.json"},
    "verify": {"touches": "day1.csv"},
    "axis": {"touches": "axis_touches.csv"},
    "identify": {"map_file": "map.json"},
    "reversal": {"touches": "reversal_touches.csv"},
    "compare": {"other": "probe.toml", "map_file": "probe.toml"},
}
"""Further files, and others than the usual ones."""
KINDS = ("touches.csv", "map.json", "probe.toml", "part.step", "results.nc", "script.py")
"""One file of each kind, which is dropped where it does not belong."""
LONG = ("align", "axis", "check-budget", "design", "hysteresis", "program part")
"""Tasks whose computations with all files take half of the time of this law."""
every_quick_screen = pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in ON_SCREENS],
)
SLOW = {("fem", "probe.toml"): "a mesh; tests of finite elements have it"}
STUDY = """[study]
name = "few"
probe = "omp40-2"
plan = "full-factorial"
[directions]
azimuth_deg = "0:240:120"
polar_deg = 90.0
[[factor]]
key = "spring.preload_N"
values = [5.0, 6.0]
"""


def _wish() -> str:
    """A shipped wish with few directions and one free quantity."""
    head, _, _ = WISHES.text("stylus-50mm").partition("[directions]")
    return f"""{head}[directions]
azimuth_deg = "0:240:120"
polar_deg = 90.0
[[free]]
key = "spring.preload_N"
range = [5.0, 6.0]
"""


@pytest.fixture(scope="module")
def dropped(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A file of each kind by its name; the script makes the file `executed` beside it."""
    folder = tmp_path_factory.mktemp("dropped")
    sphere = DATA / "sphere_touches.csv"
    state = ("--diameter", 24.9987, "--tip-diameter", 6)
    run("qualify", sphere, *state, "--kind", "harmonic", "-o", folder / "map.json")
    run("qualify", sphere, *state, "--kind", "mean", "-o", folder / "result.report.json")
    bores = DATA / "bore_touches.csv"
    run("compensate", bores, "--map", folder / "map.json", "-o", folder / "points.csv")
    shutil.copy(sphere, folder / "touches.csv")
    day_of(folder, 1)
    for name in (
        "part.step",
        "bracket.step",
        "bracket_touches.csv",
        "reversal_touches.csv",
        "axis_touches.csv",
    ):
        shutil.copy(DATA / name, folder)
    shutil.copy(DATA / "targets.csv", folder)
    run("plan", f"{DATA / 'part.step'}", "--spacing", 12, "-o", folder / "plan.csv")
    shutil.copy(DATA / "redundancy_24x24.csv", folder / "readings.csv")
    shutil.copy(min((DATA / "rig").glob("*.csv")), folder / "trace.csv")
    texts = {
        "probe.toml": description_text("omp40-2"),
        "machine.toml": run("machine"),
        "study.toml": STUDY,
        "wish.toml": _wish(),
        "script.py": f"open({str(folder / 'executed')!r}, 'w')\nsurface = 1\n",
        "results.nc": "no results",
        "few.csv": "".join(sphere.read_text("utf-8").splitlines(keepends=True)[:20]),
        "log.csv": "x_mm,y_mm,z_mm\n" + "".join(f"1,2,{3 + i % 3 / 1000}\n" for i in range(12)),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return {path.name: path for path in folder.iterdir()}


def _given(name: str, dropped: dict[str, Path]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Settings and files with which the task of a screen runs."""
    settings = {"task": name, **TYPED.get(name, {})}
    needed = {
        setting.name: RIGHT[setting.name]
        for setting in file_settings(task_named(name))
        if setting.default is MISSING and setting.name not in settings
    }
    files = {p: (dropped[file],) for p, file in {**needed, **OTHERS.get(name, {})}.items()}
    return settings, files


@cache
def _opened() -> list[str]:
    """Names of files that were opened since the last `clear`; an audit hook stays for ever."""
    names: list[str] = []

    def note(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(arguments[0], str | bytes | Path):
            names.append(str(arguments[0]))

    sys.addaudithook(note)
    return names


@contextmanager
def _not_opened(*paths: Path) -> Iterator[None]:
    _opened().clear()
    yield
    assert not {str(path) for path in paths} & set(_opened())


def test_every_file_is_described_as_one() -> None:
    """A path that is a plain text of a form would be read from a project."""
    for name in PLACES:
        for setting in settings_of(task_named(name)):
            if setting.kind is Path and (name, setting.name) != ("demo", "data"):
                assert setting.field.reads or setting.field.writes, f"{name} {setting.name}"
            if setting.field.reads and setting.kind is not Path:
                assert setting.field.word is not None, f"{name} {setting.name}"


@pytest.mark.long
@every_screen
def test_a_path_in_a_project_is_refused(name: str, dropped: dict[str, Path]) -> None:
    """In each setting that reads, also those that no field shows."""
    folder = dropped["script.py"].parent
    for setting in file_settings(task_named(name)):
        for path in (*dropped.values(), folder, folder / "*.csv"):
            texts = [str(path), f"{path}#surface", f"plane:polar=0,x={path}", f"{path}#a.step"]
            for typed in texts if setting.field.word is not None else texts[:1]:
                with _not_opened(path), pytest.raises(PretravelError) as refused:
                    run_task(Inputs({"task": name, setting.name: typed}, {}))
                assert "cannot use files of this computer" in str(refused.value)
                assert refused.value.inputs == (setting.name,)
    assert not (folder / "executed").exists()


@every_quick_screen
def test_no_other_text_of_a_project_is_a_path(name: str, dropped: dict[str, Path]) -> None:
    secret = dropped["result.report.json"]
    settings, files = _given(name, dropped)
    secret_files = {purpose: paths for purpose, paths in files.items() if secret not in paths}
    for setting in form_of(task_named(name)).settings:
        if setting.kind is str and not setting.choices:
            with _not_opened(secret, dropped["script.py"]):
                _run(Inputs({**settings, setting.name: str(secret)}, secret_files))


@every_screen
def test_a_setting_of_another_type_is_refused_in_words(name: str) -> None:
    """What JSON can hold, where a text or a number belongs: a text setting holds a text after."""
    kind, form = task_named(name), form_of(task_named(name))
    needed = {s.name: "x" for s in settings_of(kind) if s.default is MISSING}
    for setting in form.settings:
        for value in ([1], ["a"], [None], {"a": 1}, {}, True, 5, -1e308):
            with suppress(PretravelError):
                made = kind(**{**needed, **form.given({setting.name: value})})
                if setting.kind is str and not setting.several and setting.parse is None:
                    assert isinstance(getattr(made, setting.name) or "", str)


def _run(inputs: Inputs) -> str:
    """Why a task refused its inputs; nothing where it ran. Another exception is a fault."""
    try:
        run_task(inputs)
    except PretravelError as error:
        return str(error)
    return ""


@pytest.mark.long
@every_quick_screen
def test_every_task_takes_or_refuses_every_file(name: str, dropped: dict[str, Path]) -> None:
    """It runs with the files that belong there; a script is never executed."""
    settings, files = _given(name, dropped)
    if not any((name, file.name) in SLOW for (file,) in files.values()):
        assert _run(Inputs(settings, files)) == ""
    for setting in file_settings(task_named(name)):
        for file in map(dropped.__getitem__, KINDS):
            if (name, file.name) not in SLOW and files.get(setting.name) != (file,):
                _run(Inputs(settings, {**files, setting.name: (file,)}))
    assert not (dropped["script.py"].parent / "executed").exists()


TOUCH = '[touch]\nsurface = "{0}"\ntargets = "targets.csv"\n'
GEOMETRY = '[geometry]\nstep = "{0}"\ntripod = "a"\nstylus = "b"\ntip = "c"\n'


@pytest.mark.parametrize(
    ("name", "setting", "text"),
    [
        ("study", "study", STUDY + TOUCH),
        ("study", "study", STUDY.replace("omp40-2", "{0}")),
        ("study", "study", STUDY + '[[factor]]\nkey = "touch.surface"\nvalues = ["{0}", "x"]\n'),
        ("design", "wish", _wish() + TOUCH),
        ("predict", "probe", description_text("omp40-2") + GEOMETRY),
        ("compensate", "map_file", description_text("omp40-2") + GEOMETRY),
        ("rig", "probe", description_text("omp40-2") + GEOMETRY),
        ("orientation", "probe", description_text("omp40-2") + GEOMETRY),
    ],
)
def test_a_dropped_file_names_no_other(
    name: str, setting: str, text: str, dropped: dict[str, Path], tmp_path: Path
) -> None:
    script = dropped["script.py"]
    file = tmp_path / "sent.toml"
    file.write_text(text.replace("{0}", str(script)), encoding="utf-8")
    settings, files = _given(name, dropped)
    with _not_opened(script):
        assert f"names the file {script.name}" in _run(
            Inputs(settings, {**files, setting: (file,)})
        ).replace(f"{script.parent}/", "")
    assert not (script.parent / "executed").exists()


def test_a_script_beside_a_dropped_part_is_not_executed(
    dropped: dict[str, Path], tmp_path: Path
) -> None:
    """What follows the # in a name is a face: the name of a dropped file is never taken apart."""
    shutil.copy(dropped["script.py"], tmp_path)
    part = tmp_path / "script.py#part.step"
    shutil.copy(dropped["part.step"], part)
    settings, files = _given("plan", dropped)
    refused = _run(Inputs(settings, {**files, "surface": (part, tmp_path / "script.py")}))
    assert "cannot be used here: its name does not fit" in refused
    assert not (dropped["script.py"].parent / "executed").exists()
