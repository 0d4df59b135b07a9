"""Design a probe in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pretravel.probe.catalogue import load_probe
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems


def downloaded(page: Any, label: str, path: Path) -> Path:
    with page.expect_download() as download:
        page.get_by_role("button", name=label).click()
    download.value.save_as(path)
    return path


def test_a_longer_and_stiffer_stylus_is_compared_and_downloaded(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}designer")
    page.wait_for_selector("text=B is still the start")
    page.get_by_label("Stylus length to the tip centre [mm]").fill("100")
    page.get_by_label("Stem diameter [mm]").fill("6")
    page.wait_for_selector("td:text-is('100.0')")
    assert serious_problems(page) == []
    probe = load_probe(downloaded(page, "Description (.toml)", tmp_path / "design.toml"))
    assert probe.stylus_length == 100.0
    assert probe.stem.diameter == 6.0
