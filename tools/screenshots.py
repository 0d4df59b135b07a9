"""Pictures of screens and pages, light and dark, on phone, tablet and desktop.

``screenshots.py FOLDER [NAME …]``: the screens of the workbench, empty, with an example and with an
error; the screens of all tasks, with the settings of a run, and with an error; the pages of the
commands. Names choose some of them (``engineer``, ``task/verify``, ``page/rig``).
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from pretravel.app.project import Project, StoredFile
from pretravel.app.task_run import file_settings, form_of, tasks_on_screens
from pretravel.task import Task, by_name
from tests.browser.screens import seen_at, settled
from tests.browser.workbench_server import (
    SIZES,
    THEMES,
    new_context,
    open_project,
    opened,
    running_browser,
    running_workbench,
)
from tests.laws import test_stated_settings_are_used as runs
from tests.support.commands import follow
from tests.support.touches_of_days import day_of

ROOT = Path(__file__).resolve().parents[1]
SCREENS = (
    "engineer", "daily", "metrologist", "laboratory", "designer", "part", "home", "project",
    "help", "tasks",
)  # fmt: skip
"""Home after the screens, with what they have left in the project."""
EXAMPLES = ("Example with two bores to measure", "Try it with example data")
"""Buttons that fill a screen, the one that shows more first."""
NO_FILE = StoredFile("notes.txt", b"These are no touches.\nThey are words.\n")
DATA = ROOT / "examples" / "data"
SPHERE, PART = DATA / "sphere_touches.csv", DATA / "part_touches.csv"
PAGES = {
    "qualify": ("qualify", SPHERE, "--diameter", "24.9987", "--tip-diameter", "6"),
    "compensate": ("compensate", PART, "--map", "map.json", "--nominal", DATA / "part.step"),
    "measure": ("measure", "points.csv", "--feature", "bore", "--select", "bore*", "--group"),
    "compare": ("compare", "map.json", "--part", PART),
    "predict": ("predict", "omp40-2"),
    "designs": ("compare", "omp40-2", "omp40-2-100mm"),
    "rig": ("rig", DATA / "rig"),
    "separate": ("separate", DATA / "redundancy_24x24.csv"),
    "faces": ("faces", DATA / "part.step"),
}
"""The commands whose pages are shown."""
LONG_RUNS = (
    "fem omp40-2 --polar 60",
    "study stylus-diameter -o study.nc",
    "design stylus-50mm -o best.toml",
    "report qualify.report.json predict.report.json -o both.html",
)
"""Runs of tasks that the law of all tasks does not run."""
_REPORTS = (
    "qualify sphere_touches.csv --diameter 24.9987 --tip-diameter 6 -o qualify.report.json",
    "predict omp40-2 --azimuth 0:350:30 --polar 60 -o predict.report.json",
)
_MADE = ".error-view:visible, .document:visible, .file-text:visible"
_LONGEST = 900_000
"""Time for the longest run, a design. [ms]"""
_FIRST = (
    (*PAGES["qualify"], "-o", "map.json"),
    ("compensate", DATA / "bore_touches.csv", "--map", "map.json", "-o", "points.csv"),
)


def main(folder: Path, names: list[str]) -> None:
    """Take the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    tasks = {
        f"task/{name.replace(' ', '-')}": name
        for found in tasks_on_screens().values()
        for name in found
    }
    with tempfile.TemporaryDirectory() as place, running_browser() as browser:
        if chosen := [name for name in SCREENS if not names or name in names]:
            _screens(browser, chosen, Path(place), folder)
        if wanted := [name for name in tasks if not names or name in names]:
            _tasks(browser, {name: tasks[name] for name in wanted}, Path(place), folder)
        if pages := [name for name in PAGES if not names or f"page/{name}" in names]:
            _pages(browser, pages, Path(place), folder)


@contextlib.contextmanager
def _tab(browser: Any) -> Iterator[Any]:
    context = new_context(browser)
    yield context.new_page()
    context.close()


def _taken(
    page: Any, path: Path, themes: Iterable[str] = THEMES, sizes: Iterable[str] = tuple(SIZES)
) -> None:
    """Pictures of a page that is open."""
    for theme in themes:
        page.emulate_media(color_scheme=theme)
        for size in sizes:
            seen_at(page, SIZES[size])
            page.evaluate("scrollTo(0, 0)")
            page.wait_for_timeout(1000)  # those in space are drawn again
            page.screenshot(path=f"{path}-{size}-{theme}.png", full_page=True)


def _screens(browser: Any, names: list[str], place: Path, folder: Path) -> None:
    with running_workbench(place) as workbench, _tab(browser) as page:
        for name in names:
            address = workbench.address + ("" if name == "home" else name)
            opened(page, address)
            if name in ("home", "project", "help", "tasks"):
                _taken(page, folder / name)
                continue
            _taken(page, folder / f"{name}-empty")
            _fill(page, name)
            _taken(page, folder / name)
            _tabs(page, folder / name)
        for name in names:
            if name in ("home", "project", "help", "tasks", "designer"):
                continue
            project = Project("With an error")
            purpose = {"laboratory": "traces"}.get(name, "touches")
            project.screen(name).files[purpose] = (NO_FILE,)
            project.screen(name).settings.update({"diameter": 25.0, "probe": "omp40-2"})
            if name == "daily":
                project.screen(name).files["map"] = (StoredFile("map.json", b"{}"),)
            open_project(workbench.address, project)
            opened(page, workbench.address + name)
            page.wait_for_selector("main :is(.error-view, .question)")
            _taken(page, folder / f"{name}-error")


def _tabs(page: Any, path: Path) -> None:
    """The other tabs of a screen, light, at two sizes."""
    page.emulate_media(color_scheme="light")
    for tab in page.get_by_role("tab").all()[1:]:
        tab.click()
        for size in ("desktop", "phone"):
            seen_at(page, SIZES[size])
            page.evaluate("scrollTo(0, 0)")
            page.wait_for_timeout(1000)
            word = tab.inner_text().strip().replace(" ", "-")
            page.screenshot(path=f"{path}-tab-{word}-{size}.png", full_page=True)


def _fill(page: Any, name: str) -> None:
    """Fill an empty screen, and wait for its result and its pictures."""
    buttons = [page.get_by_role("button", name=words) for words in EXAMPLES]
    button = next((each for each in buttons if each.count()), None)
    if button is not None:
        button.first.click()
        page.wait_for_selector(".main-svg")
        settled(page)
    measure = page.get_by_role("button", name="Measure", exact=True)
    if measure.count():
        measure.click()
        page.wait_for_selector(".feature-rows tbody tr")
    if name == "daily":  # once a probe is qualified
        page.wait_for_selector(".file-name:has-text('map.json')")
        with tempfile.TemporaryDirectory() as days:
            for day in range(1, 6):
                today = page.locator('.file-drop-input[data-url$="/daily/touches"]')
                today.set_input_files(str(day_of(Path(days), day)))
                page.wait_for_selector(f".document:has-text('from {day} check')")
        page.wait_for_selector(".verdict")


def _tasks(browser: Any, names: dict[str, str], place: Path, folder: Path) -> None:
    """Each task without its file, and with the runs of the law of all tasks."""
    with running_workbench(place) as workbench, _tab(browser) as page:
        with _run_folder(place):
            filled = {name: [*map(_project, _lines_of(name))] for name in names.values()}
        for screen, name in names.items():
            path = folder / screen.replace("/", "-")
            for count, project in enumerate([Project("Empty"), *filled[name]]):
                open_project(workbench.address, project)
                opened(page, workbench.address + screen)
                page.get_by_role("button", name="Run", exact=True).click()
                page.wait_for_selector(_MADE, timeout=_LONGEST)
                settled(page)
                shot = path.with_name(f"{path.name}-{count}")
                if count == 1:
                    _taken(page, shot)
                    _tabs(page, shot)
                else:
                    _taken(page, shot, ("light",), ("phone", "desktop"))


@contextlib.contextmanager
def _run_folder(place: Path) -> Iterator[None]:
    made = runs.folder.__wrapped__  # type: ignore[attr-defined]  # the fixture, as a function
    factory = type("Folder", (), {"mktemp": lambda _, name: _made(place / name)})()
    generator = made(factory)
    with contextlib.chdir(next(generator)):
        for line in _REPORTS:
            follow(f"pretravel {line}")
        yield
    generator.close()


def _made(path: Path) -> Path:
    path.mkdir()
    return path


def _lines_of(name: str) -> list[str]:
    return [line for line in (*LONG_RUNS, *runs.RUNS) if f"{line} ".startswith(f"{name} ")]


def _project(line: str) -> Project:
    """One with the settings and the files of a command on the screen of its task."""
    project = Project(line[:40])
    task: Task = runs.made(line)
    state = project.screen(f"task-{task.name.replace(' ', '-')}")
    for setting in file_settings(type(task)):
        value = getattr(task, setting.name)
        values = [] if value is None else list(value) if setting.several else [value]
        files = [Path(str(each).partition("#")[0]) for each in values]
        folders = [inner for each in files if each.is_dir() for inner in sorted(each.iterdir())]
        there = [each for each in (*files, *folders) if each.is_file()]
        if there:
            state.files[setting.name] = tuple(
                StoredFile(each.name, each.read_bytes()) for each in there
            )
        faces = [sign + face for _, sign, face in (str(each).partition("#") for each in values)]
        words = " ".join(filter(None, faces) if there else map(str, values))
        if words:
            state.settings[setting.name] = words
    known = by_name(type(task))
    for name in form_of(type(task)).names:
        setting, value = known[name], getattr(task, name)
        if value is None or value == setting.default:
            continue
        if setting.several:
            state.settings[name] = " ".join(map(setting.text, value))
        elif isinstance(value, (bool, int, float, str)):
            state.settings[name] = value
        else:
            state.settings[name] = setting.text(value)
    return project


def _pages(browser: Any, names: list[str], place: Path, folder: Path) -> None:
    for words in _FIRST:
        _run(place, words)
    with _tab(browser) as page:
        for name in names:
            _run(place, (*PAGES[name], "-o", f"{name}.html"))
            page.goto((place / f"{name}.html").as_uri())
            _taken(page, folder / f"page-{name}")


def _run(place: Path, words: tuple[object, ...]) -> None:
    command = [sys.executable, "-m", "pretravel", *map(str, words)]
    subprocess.run(command, cwd=place, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
