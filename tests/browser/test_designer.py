"""Design a probe in the browser."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from pretravel.cli.main import app
from pretravel.design.screen.designer import _PICTURES
from pretravel.prediction.catalogue import load_probe
from tests.browser.screens import downloaded, settled, tab
from tests.browser.test_clicks import Person
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems

LENGTH = "Stylus length to the tip centre [mm]"


def opened_designer(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}designer")
    page.get_by_role("button", name="Back to the start").click()
    page.wait_for_selector("text=B is still equal to the start: move a slider")


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
    tab(page, "Force and parts")
    start = when(lambda now: now.keys() >= set(_PICTURES.values()))
    page.get_by_label(LENGTH).fill("100")
    when(lambda now: all(now[name] != start[name] for name in _PICTURES.values()))
    page.get_by_role("button", name="Back to the start").click()
    when(lambda now: now == start)
    page.get_by_label(LENGTH).focus()
    page.keyboard.press("Tab")  # to the slider, which the keyboard moves by its step
    page.keyboard.press("ArrowRight")
    tab(page, "Comparison")
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
    tab(page, "Files")
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
    page.locator(".stale .plot .main-svg").first.wait_for()
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
    for each in (page, other):
        each.wait_for_selector("td:has-text('38.5 mm, Ø 4.5 mm')")
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


def finite_element_cells(page: Any) -> dict[str, list[str]]:
    """The rows of the table of both designs by both models."""
    table = page.get_by_role("region", name="Both designs, by both models")
    rows = [row.locator("td").all_inner_texts() for row in table.locator("tbody tr").all()]
    return {name: cells for name, *cells in rows}


def test_two_designs_with_finite_elements_take_three_clicks_at_most(
    page: Any, workbench: RunningWorkbench
) -> None:
    """From an empty project; typing is no click."""
    opened(page, workbench.address)
    person = Person(page)
    person.begin("Design a probe")
    page.get_by_label(LENGTH).fill("60")
    page.wait_for_selector("td:has-text('48 mm, Ø 4.5 mm')")
    person.click(page.get_by_role("tab", name="Finite elements"))
    page.get_by_text("The empty columns of this table").wait_for()
    mean = "pretravel on walls, mean / µm"
    before = finite_element_cells(page)[mean]
    assert [cell != "" for cell in before] == [True, False, True, False, True, False]
    person.click(person.button("Compute with finite elements"))
    page.get_by_text("Unknowns of the meshes").wait_for()
    assert person.clicks <= 3
    settled(page)

    after = finite_element_cells(page)
    assert all(after[mean])
    assert after[mean][::2] == before[::2]  # the model analytic, and what B changes by it
    stress = after["highest stress at the trigger on walls / MPa"]
    assert [cell != "" for cell in stress] == [False, True, False, True, False, True]
    assert page.get_by_text("The empty columns of this table").count() == 0
    assert serious_problems(page) == []
    # The stress is that of B until A is chosen: 0.750 N 64.4 mm = 0.649 N 74.4 mm, a moment opens.
    page.wait_for_selector(".key-figures:has-text('0.649 N')")
    page.get_by_label("Design", exact=True).click()
    page.get_by_role("option", name="A", exact=True).click()
    page.wait_for_selector(".key-figures:has-text('0.750 N')")  # that of the docstring of Predict
    tab(page, "Force and parts")
    for name in ("Pretravel around, both designs", "Trigger force around, both designs"):
        page.wait_for_function(
            "name => document.querySelector(`[aria-label='${name}'] .plot-area`)?.data?.length",
            arg=name,
        )
        assert "A by finite elements" in pictures(page)[name]
        assert "B by finite elements" in pictures(page)[name]


def test_no_line_names_a_file_before_it_is_saved(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    opened_designer(page, workbench)
    tab(page, "Files")
    shown = page.get_by_text("The same on the command line and in Python", exact=True)
    shown.wait_for()
    shown.click()
    page.get_by_text("pretravel compare omp40-2 omp40-2 -o design.html").wait_for()
    page.get_by_label(LENGTH).fill("100")
    page.get_by_text("Save it first").first.wait_for()
    assert "design.toml" not in page.locator("main").inner_text()
    assert shown.count() == 0
    assert b"design.toml" not in downloaded(page, "Page (.html)", tmp_path).read_bytes()
    downloaded(page, "Description (.toml)", tmp_path)
    shown.first.wait_for()
    assert "design.toml" in page.locator(".code-block pre").first.text_content()
    page.get_by_label(LENGTH).fill("90")  # is not the file's any more
    shown.first.wait_for(state="detached")
    page.get_by_text("Save it first").first.wait_for()


@pytest.mark.slow
def test_finite_elements_are_cancelled(page: Any, workbench: RunningWorkbench) -> None:
    opened_designer(page, workbench)
    page.get_by_label(LENGTH).fill("77")  # of no probe in the cache
    page.wait_for_selector("td:has-text('65 mm, Ø 4.5 mm')")
    tab(page, "Finite elements")
    page.get_by_role("button", name="Compute with finite elements").click()
    page.wait_for_selector(".running-clock")
    page.get_by_role("button", name="Cancel").click()
    page.wait_for_selector("text=Cancelled after")


def test_a_touch_steps_until_the_trigger(
    page: Any, workbench: RunningWorkbench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Buttons and slider step; the numbers are those of the steps that the command writes."""
    opened_designer(page, workbench)
    tab(page, "Step by step")
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
    tab(page, "Files")
    downloaded(page, "Description (.toml)", tmp_path)
    tab(page, "Step by step")
    page.get_by_text("The same on the command line and in Python").last.click()
    command = page.locator(".code-block pre").first.inner_text()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slide.csv").unlink()
    result = CliRunner().invoke(app, shlex.split(command)[1:])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "slide.csv").read_bytes() == steps
