"""The certificate on paper, as Chromium prints it: its pages, and what stands on which."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from pretravel.show.page_pdf import BROWSERS
from tests.browser.workbench_server import new_context
from tests.support.commands import run
from tests.support.examples import EXAMPLES, SPHERE
from tests.support.laboratory import filled_file
from tests.support.pdf_text import pdf_pages

RIG = EXAMPLES / "rig"
pytestmark = pytest.mark.skipif(
    not any(map(shutil.which, BROWSERS)), reason="no browser that prints on this machine"
)
FIRST_PAGE = (
    "name<of>laboratory", "Number:number<of>certificate", "name<of>customer",
    "serial_number<of>item", "machine_serial_number<of>instrument", "certificate<of>reference",
    "statement<of>traceability", "Page1of",
)  # fmt: skip
"""Without blanks."""


def sixty_traces(folder: Path) -> Path:
    """Those of the example under other names: 12 directions five times."""
    traces = folder / "traces"
    traces.mkdir()
    for place in range(12):
        for repeat in range(1, 6):
            source = RIG / f"rig_{(0, 60, 90)[place % 3]:03d}_{1 + repeat % 2}.csv"
            shutil.copyfile(source, traces / f"rig_{30 * place:03d}_{repeat}.csv")
    return traces


def _checked_pages(path: Path, most: int) -> str:
    """What every certificate has; its whole text."""
    pages = pdf_pages(path)
    assert 1 < len(pages) <= most
    for words in FIRST_PAGE:
        assert words in pages[0]
    for number, page in enumerate(pages, start=1):
        assert f"Page{number}of{len(pages)}" in page
        assert "ertificatenumber<of>certificate" in page  # below each page
    assert "Signature:authorised_by<of>certificate" in pages[-1]
    assert pages[-1].endswith("Endofcertificatenumber<of>certificate.")
    text = "".join(pages)
    assert text.count("Signature") == 1
    assert "pretravelrig" not in text.replace("Evaluatedwithpretravel", "")
    assert "--" not in text
    return text


def test_sixty_traces_fill_four_pages_at_most(tmp_path: Path) -> None:
    path = tmp_path / "certificate.pdf"
    run("rig", sixty_traces(tmp_path), "--budget", EXAMPLES / "rig_budget.csv", "--lab",
        filled_file(tmp_path), "-o", path)  # fmt: skip
    text = _checked_pages(path, most=4)
    assert "Resultsbydirection" in pdf_pages(path)[0]
    for words in ("gratingscaledisplacement", "expanded,95.45%", "r1-r0", "rig_330_5.csv"):
        assert words in text


@pytest.mark.parametrize(
    "command",
    [
        ("check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6,
         "--u-diameter", 0.2, "--sphere-form", 0.13),
        ("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6),
    ],
    ids=lambda command: command[0],
)  # fmt: skip
def test_a_sphere_fills_two_pages(command: tuple[object, ...], tmp_path: Path) -> None:
    path = tmp_path / "certificate.pdf"
    run(*command, "--lab", filled_file(tmp_path), "-o", path)
    text = _checked_pages(path, most=2)
    for words in ("Results", "expanded,95.45%", "Method", "sphere_touches.csv"):
        assert words in text


def test_a_page_prints_the_same_certificate_by_a_click(browser: Any, tmp_path: Path) -> None:
    """For those who have a browser that the command does not find."""
    command = ("check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--lab", filled_file(tmp_path))
    for ending in ("pdf", "html"):
        run(*command, "-o", tmp_path / f"certificate.{ending}")
    context = new_context(browser)
    tab = context.new_page()
    tab.add_init_script("window.print = () => { document.documentElement.id = 'asked'; };")
    tab.goto((tmp_path / "certificate.html").as_uri())
    tab.get_by_role("button", name="Print the certificate").click()
    tab.wait_for_selector("#asked", state="attached")
    tab.pdf(path=tmp_path / "clicked.pdf", prefer_css_page_size=True)
    tab.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert tab.locator(".certificate").count() == 0
    context.close()
    assert pdf_pages(tmp_path / "clicked.pdf") == pdf_pages(tmp_path / "certificate.pdf")
