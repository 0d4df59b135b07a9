"""Pictures of screens and pages, light and dark, on phone, tablet and desktop.

``screenshots.py FOLDER [NAME …]``: the screens of the workbench with example data, and the pages of
the commands; names choose some of them.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.browser.screens import settled
from tests.browser.workbench_server import (
    SIZES,
    THEMES,
    running_browser,
    running_workbench,
    screenshots,
)
from tests.support.touches_of_days import day_of

ROOT = Path(__file__).resolve().parents[1]
SCREENS = (
    "home", "project", "help", "tasks", "engineer", "daily", "metrologist", "laboratory",
    "designer", "part", "task/verify", "home-full",
)  # fmt: skip
"""Home again at the end, with what the others have left in the project."""
EXAMPLES = ("Example with two bores to measure", "Try it with example data")
"""Buttons that fill a screen, the one that shows more first."""
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
_FIRST = (
    (*PAGES["qualify"], "-o", "map.json"),
    ("compensate", DATA / "bore_touches.csv", "--map", "map.json", "-o", "points.csv"),
)


def main(folder: Path, names: list[str]) -> None:
    """Take the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place, running_browser() as browser:
        screens = [name for name in SCREENS if not names or name in names]
        if screens:
            _screens(browser, screens, Path(place), folder)
        pages = [name for name in PAGES if not names or name in names]
        if pages:
            _pages(browser, pages, Path(place), folder)


def _screens(browser: Any, names: list[str], place: Path, folder: Path) -> None:
    with running_workbench(place) as workbench:
        for name in names:
            address = workbench.address + ("" if name.startswith("home") else name)
            screenshots(browser, address, folder, name.replace("/", "-"), prepare=_with_example)


def _with_example(page: Any) -> None:
    """Fill an empty screen, and wait for its result and its pictures."""
    buttons = [page.get_by_role("button", name=name) for name in EXAMPLES]
    button = next((each for each in buttons if each.count()), None)
    if button is not None and not page.locator(".main-svg").count():
        button.first.click()
        page.wait_for_selector(".main-svg")
        settled(page)
        measure = page.get_by_role("button", name="Measure", exact=True)
        if measure.count():
            measure.click()
            page.wait_for_selector(".feature-rows tbody tr")
    today = page.locator('.file-drop-input[data-url$="/daily/touches"]')
    has_map = page.locator(".file-name:has-text('map.json')")  # once a probe is qualified
    if today.count() and has_map.count() and not page.locator(".verdict").count():
        with tempfile.TemporaryDirectory() as folder:
            for day in range(1, 6):
                today.set_input_files(str(day_of(Path(folder), day)))
                page.wait_for_selector(f".verdict-card ~ .key-figures:has-text('from {day} check')")
        page.wait_for_selector(".verdict")


def _pages(browser: Any, names: list[str], place: Path, folder: Path) -> None:
    for words in _FIRST:
        _run(place, words)
    for name in names:
        _run(place, (*PAGES[name], "-o", f"{name}.html"))
        for theme in THEMES:
            for size, (width, height) in SIZES.items():
                context = browser.new_context(
                    viewport={"width": width, "height": height}, color_scheme=theme
                )
                page = context.new_page()
                page.goto((place / f"{name}.html").as_uri())
                page.wait_for_timeout(2500)
                page.screenshot(path=folder / f"page-{name}-{size}-{theme}.png", full_page=True)
                context.close()


def _run(place: Path, words: tuple[object, ...]) -> None:
    command = [sys.executable, "-m", "pretravel", *map(str, words)]
    subprocess.run(command, cwd=place, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
