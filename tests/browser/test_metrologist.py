"""The screen Metrologist: from touches to figures, equal to the command line's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pretravel.laboratory.tasks.check.screen_work import example_touches
from tests.browser.screens import downloaded, drop, run_shown_lines, settled, tab
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems
from tests.support.commands import run
from tests.support.laboratory import filled_file
from tests.support.pdf_text import pdf_pages
from tests.support.results import data_of


@pytest.fixture
def touches(tmp_path: Path) -> Path:
    name, content = example_touches("iso10360-5")
    path = tmp_path / name
    path.write_bytes(content)
    return path


def test_the_figures_are_those_of_the_command_line(
    page: Any, workbench: RunningWorkbench, touches: Path, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}metrologist")
    drop(page, "metrologist", "touches", touches)
    page.get_by_label("Diameter of the reference [mm]").fill("25")
    page.get_by_label("Diameter of the tip [mm]").fill("6")
    page.get_by_label("Form error [µm]").fill("2")
    page.get_by_label("Form error of the sphere [µm]").fill("0.13")
    page.wait_for_selector("text=P_Size")
    page.wait_for_selector("text=exceeds the limit")
    page.wait_for_selector("text=0.065")  # µm: half the form error of the sphere
    settled(page)
    assert serious_problems(page) == []
    tab(page, "Files")
    mine = data_of(downloaded(page, "check.json", tmp_path))
    by_command = tmp_path / "by_command.json"
    run("check", "iso10360-5", touches, "--diameter", 25, "--tip-diameter", 6, "--form-limit", 2,
        "--sphere-form", 0.13, "-o", by_command, code=3)  # fmt: skip
    assert mine == data_of(by_command)
    folder = tmp_path / "lines"
    folder.mkdir()
    run_shown_lines(page, folder, [touches], code=3)


def test_another_standard_has_other_limits_and_a_certificate_states_the_laboratory(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}metrologist")
    page.get_by_label("Standard", exact=True).click()
    page.get_by_role("option", name="ISO 230-10: 36 touches").click()
    page.get_by_label("Range of repeats [µm]").wait_for()
    page.get_by_role("button", name="Try it with example data").click()
    page.wait_for_selector(".verdict >> text=ISO 230-10")
    page.get_by_text("Laboratory, instrument, environment").first.click()
    page.get_by_label("Name and address of the laboratory").fill("<b>North</b> laboratory")
    tab(page, "Files")
    text = downloaded(page, "Certificate (page)", tmp_path).read_text()
    assert "&lt;b&gt;North&lt;/b&gt; laboratory" in text
    assert "<b>North" not in text
    assert example_touches("iso230-10")[0] in text


def test_the_laboratory_is_filled_in_once_and_prints_a_certificate(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    """A dropped file fills in the fields; another screen has them, and its certificate too."""
    opened(page, f"{workbench.address}metrologist")
    page.get_by_role("button", name="Try it with example data").click()
    page.wait_for_selector(".verdict >> text=ISO 10360-5")
    page.get_by_text("Laboratory, instrument, environment").first.click()
    drop(page, "metrologist", "laboratory_file", filled_file(tmp_path))
    tab(page, "Files")
    compared = "text=declares that it compared what is used here of ISO 10360-5"
    page.wait_for_selector(compared, state="attached")  # in a detail of the report, too
    settled(page)
    kept = tmp_path / "kept"
    kept.mkdir()
    mine = downloaded(page, "laboratory.toml", kept)
    assert mine.read_text() == filled_file(tmp_path).read_text()
    pages = pdf_pages(downloaded(page, "Certificate (PDF)", tmp_path))
    assert len(pages) == 2
    opened(page, f"{workbench.address}laboratory")
    page.get_by_role("button", name="Try it with example data").click()
    page.wait_for_selector(".verdict")
    page.get_by_text("Laboratory, instrument, environment").first.click()
    tab(page, "Files")
    assert page.get_by_label("Operator").input_value() == "operator <of> measurement"
    settled(page)
    pages += pdf_pages(downloaded(page, "Certificate (PDF)", tmp_path))
    for first in (pages[0], pages[2]):
        assert "name<of>laboratory" in first
        assert "Number:number<of>certificate" in first
