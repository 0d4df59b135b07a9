"""Design a probe in the browser."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from pretravel.app.screens.designer import _PICTURES
from pretravel.cli.main import app
from pretravel.prediction.catalogue import load_probe
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems

LENGTH = "Stylus length to the tip centre [mm]"


def downloaded(page: Any, label: str, folder: Path) -> Path:
    with page.expect_download() as download:
        page.get_by_role("button", name=label).click()
    path = folder / str(download.value.suggested_filename)
    download.value.save_as(path)
    return path


def opened_designer(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}designer")
    page.get_by_role("button", name="Back to the start").click()
    page.wait_for_selector("text=B is still the start: move a slider")


def without_versions(path: Path) -> str:
    return re.sub(r"\d{4}-\d\d-\d\dT[\d:+-]+", "", path.read_text(encoding="utf-8"))


def pictures(page: Any) -> dict[str, Any]:
    """What is drawn, by the description of the picture; those that stay empty are left out."""
    found: dict[str, Any] = page.evaluate(
        """Object.fromEntries([...document.querySelectorAll(".plot:has(.main-svg)")]
             .filter((plot) => plot.querySelector(".plot-area").data?.length)
             .map((plot) => [plot.getAttribute("aria-label"),
                             JSON.stringify(plot.querySelector(".plot-area").data)]))"""
    )
    return found


def test_all_pictures_follow_the_design(page: Any, workbench: RunningWorkbench) -> None:
    def when(state: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        for _ in range(1000):
            if state(now := pictures(page)):
                return now
            page.wait_for_timeout(100)
        raise AssertionError(f"the pictures stay: {now}")

    opened_designer(page, workbench)
    start = when(lambda now: now.keys() >= set(_PICTURES.values()))
    page.get_by_label(LENGTH).fill("100")
    when(lambda now: all(now[name] != start[name] for name in _PICTURES.values()))
    page.get_by_role("button", name="Back to the start").click()
    when(lambda now: now == start)
    page.get_by_label(LENGTH).focus()
    page.keyboard.press("Tab")  # to the slider, which the keyboard moves by its step
    page.keyboard.press("ArrowRight")
    page.wait_for_selector("td:has-text('38.5 mm, Ø 4.5 mm')")
    assert page.get_by_label(LENGTH).input_value() == "50.5"


def test_a_longer_and_stiffer_stylus_is_compared_and_downloaded(
    page: Any, workbench: RunningWorkbench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened_designer(page, workbench)
    page.get_by_label(LENGTH).fill("100")
    page.get_by_label("Stem diameter [mm]").fill("5.5")
    page.wait_for_selector("td:has-text('88 mm, Ø 5.5 mm')")
    assert serious_problems(page) == []
    probe = load_probe(downloaded(page, "Description (.toml)", tmp_path))
    assert probe.stylus_length == 100.0
    assert probe.stem.diameter == 5.5

    mapped = downloaded(page, "Map (.csv)", tmp_path).read_bytes()
    report = without_versions(downloaded(page, "Page (.html)", tmp_path))
    page.get_by_text("The same on the command line and in Python").click()
    commands, python = (block.inner_text() for block in page.locator(".code-block pre").all())
    monkeypatch.chdir(tmp_path)
    (tmp_path / "design-map.csv").unlink()
    (tmp_path / "design.html").unlink()
    for command in commands.splitlines():
        result = CliRunner().invoke(app, shlex.split(command)[1:])
        assert result.exit_code == 0, result.output
    assert (tmp_path / "design-map.csv").read_bytes() == mapped
    verdict = re.search(r"pretravel of B is [^<]*", report)
    assert verdict is not None
    assert verdict.group() in (tmp_path / "design.html").read_text(encoding="utf-8")
    (tmp_path / "design-map.csv").unlink()
    exec(compile(python, "shown", "exec"), {"__name__": "shown"})
    assert (tmp_path / "design-map.csv").read_bytes() == mapped


def test_an_impossible_design_is_said_at_its_field_and_the_last_picture_stays(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened_designer(page, workbench)
    ball = page.get_by_label("Tip ball diameter [mm]")
    ball.fill("3")
    said = page.locator(".field-problem")
    said.first.wait_for()
    assert "a tip of 3 mm diameter is smaller than the stem of 4.5 mm diameter" in said.inner_text()
    assert said.count() == 1
    assert page.locator(".stale .plot .main-svg").count() > 0
    ball.fill("6")
    page.wait_for_selector(".field-problem", state="detached")
    page.wait_for_selector(".stale", state="detached")


@pytest.mark.slow
def test_two_tabs_and_a_reload_show_the_same_design(page: Any, workbench: RunningWorkbench) -> None:
    opened_designer(page, workbench)
    other = page.context.new_page()
    opened(other, f"{workbench.address}designer")
    page.get_by_label(LENGTH).focus()
    page.keyboard.press("Tab")  # to the slider, which the keyboard moves by its step
    page.keyboard.press("ArrowRight")
    for tab in (page, other):
        tab.wait_for_selector("td:has-text('38.5 mm, Ø 4.5 mm')")
    other.reload()
    other.wait_for_selector("td:has-text('38.5 mm, Ø 4.5 mm')")
    assert other.get_by_label(LENGTH).input_value() == "50.5"


def test_a_dropped_description_is_the_start_and_a_wrong_one_says_why(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened_designer(page, workbench)
    text = Path("src/pretravel/prediction/data/probes/omp40-2-100mm.toml").read_text(
        encoding="utf-8"
    )
    for name, content in (("wrong.toml", text.replace("[spring]", "[sprung]")), ("own.toml", text)):
        page.set_input_files(
            ".file-drop-input",
            {"name": name, "mimeType": "application/toml", "buffer": content.encode()},
        )
        page.wait_for_selector(f"text={name}")
        if name == "wrong.toml":
            page.wait_for_selector("text=there is no [sprung] in this kind of file")
    page.wait_for_function(f"document.querySelector('[aria-label=\"{LENGTH}\"]')?.value === '100'")
    page.get_by_role("button", name="Remove own.toml").click()
    page.wait_for_function(f"document.querySelector('[aria-label=\"{LENGTH}\"]')?.value === '50'")


@pytest.mark.slow
def test_finite_elements_are_cancelled(page: Any, workbench: RunningWorkbench) -> None:
    opened_designer(page, workbench)
    page.get_by_label(LENGTH).fill("77")  # of no probe in the cache
    page.wait_for_selector("td:has-text('65 mm, Ø 4.5 mm')")
    page.get_by_role("button", name="Compute with finite elements").click()
    page.wait_for_selector(".running-clock")
    page.get_by_role("button", name="Cancel").click()
    page.wait_for_selector("text=Cancelled after")


def test_a_touch_steps_until_the_trigger(
    page: Any, workbench: RunningWorkbench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Buttons and slider step; the numbers are those of the steps that the command writes."""
    opened_designer(page, workbench)
    page.get_by_text("How the tip slides until the trigger").click()
    page.get_by_text("1 of 20", exact=True).wait_for()
    slid = {"The contact on the surface, at this step", "Deflection over the feed"}
    for _ in range(1000):
        first = pictures(page)
        if first.keys() >= slid:
            break
        page.wait_for_timeout(100)
    assert page.get_by_text("before the trigger").count() == 1
    page.get_by_role("button", name="Next").click()
    page.get_by_text("2 of 20", exact=True).wait_for()
    for _ in range(1000):
        if all(pictures(page)[name] != first[name] for name in slid):
            break
        page.wait_for_timeout(100)
    else:
        raise AssertionError("the pictures stay")
    page.get_by_label("Step", exact=True).first.fill("20")
    page.get_by_text("20 of 20", exact=True).wait_for()
    page.get_by_text("a seat is open").wait_for()
    page.get_by_role("button", name="Previous").click()
    page.get_by_text("19 of 20", exact=True).wait_for()
    assert serious_problems(page) == []

    steps = downloaded(page, "Steps (.csv)", tmp_path).read_bytes()
    downloaded(page, "Description (.toml)", tmp_path)
    page.get_by_text("The same on the command line and in Python").last.click()
    command = page.locator(".code-block pre").nth(2).inner_text()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slide.csv").unlink()
    result = CliRunner().invoke(app, shlex.split(command)[1:])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "slide.csv").read_bytes() == steps
