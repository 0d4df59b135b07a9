"""Pages of every command: what was done with what, and the PDF."""

from __future__ import annotations

import hashlib
import html
import re
import shutil
from pathlib import Path

import pytest

import pretravel
from pretravel.show.page_pdf import BROWSERS
from pretravel.task.fields import Reported
from pretravel.task.listed import PLACES, task_named
from pretravel.task.task import PAGES, settings_of
from tests.support.commands import run
from tests.support.examples import SPHERE


def test_every_task_that_shows_a_report_writes_it_as_a_page() -> None:
    described = [task_named(name) for name in PLACES]
    shows = {task for task in described if issubclass(task, Reported)}
    pages = {
        task
        for task in described
        if any(set(PAGES) <= set(setting.field.writes) for setting in settings_of(task))
    }
    assert len(shows) > 15
    assert shows <= pages


def test_a_page_says_what_was_done_with_what(tmp_path: Path) -> None:
    page = tmp_path / "a page.html"
    run("convert", SPHERE, "--tip-diameter", 6, "-o", page)
    text = html.unescape(page.read_text(encoding="utf-8"))
    assert f"pretravel convert {SPHERE} --tip-diameter 6 -o '{page}'" in text
    assert hashlib.sha256(Path(SPHERE).read_bytes()).hexdigest() in text
    assert f"pretravel {pretravel.__version__}, Python 3" in text
    assert re.search(r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d[+-]\d\d:\d\d", text)
    cells = re.findall(r"<td>(.*?)</td>", text)
    assert cells[cells.index("--tip-diameter") + 1 :][:2] == ["6", "given"]
    assert cells[cells.index("--units") + 1 :][:2] == ["none", "default"]


def test_a_catalogue_name_is_no_input_file(tmp_path: Path) -> None:
    run("probes", "omp40-2", "-o", tmp_path / "p.html")
    text = (tmp_path / "p.html").read_text(encoding="utf-8")
    assert "SHA-256" not in text
    assert "pretravel probes omp40-2" in text


class TestPdf:
    def test_without_a_browser_the_message_says_what_to_do(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.setattr("pretravel.show.page_pdf._installed_browser", lambda: None)
        message = run("probes", "-o", tmp_path / "p.pdf", code=2)
        assert "none of them was found" in message
        assert ".html" in message
        assert not (tmp_path / "p.pdf").exists()

    def test_a_browser_is_found_where_windows_installs_it(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """It is not in PATH there; this one says with which file it was called, and fails."""
        edge = tmp_path / "Microsoft" / "Edge" / "Application" / "msedge.exe"
        edge.parent.mkdir(parents=True)
        edge.write_text(f"#!/bin/sh\necho \"$@\" > '{tmp_path / 'called'}'\nexit 1\n")
        edge.chmod(0o755)
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.setenv("ProgramFiles(x86)", str(tmp_path))
        assert "msedge.exe ended with code 1" in run("probes", "-o", tmp_path / "p.pdf", code=2)
        assert "--print-to-pdf=" in (tmp_path / "called").read_text()

    def test_a_browser_of_the_current_folder_is_not_run(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        browser = tmp_path / "chromium"
        browser.write_text(f"#!/bin/sh\ntouch '{tmp_path / 'ran'}'\n")
        browser.chmod(0o755)
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv("PATH", str(tmp_path))
        run("probes", "-o", tmp_path / "p.pdf", code=2)
        assert not (tmp_path / "ran").exists()

    @pytest.mark.long
    def test_a_browser_prints_it(self, tmp_path: Path) -> None:
        if not any(map(shutil.which, (*BROWSERS, "weasyprint"))):
            pytest.skip("no browser and no weasyprint on this machine")
        run("probes", "omp40-2", "-o", tmp_path / "p.pdf")
        assert (tmp_path / "p.pdf").read_bytes()[:5] == b"%PDF-"


@pytest.mark.long
def test_every_report_can_be_bound_from_its_values(tmp_path: Path) -> None:
    """Of qualify .json is the map, of probes it is nothing; .report.json is the report of both."""
    made = tmp_path / "q.report.json"
    command = ["qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "mean"]
    text = run(*command, "-o", made)
    assert "write the map to a file" in text
    run("probes", "omp40-2", "-o", tmp_path / "p.report.json")
    run("report", made, tmp_path / "p.report.json", "-o", tmp_path / "all.html")
    page = html.unescape((tmp_path / "all.html").read_text(encoding="utf-8"))
    assert "<title>q, p</title>" in page
    assert hashlib.sha256(Path(SPHERE).read_bytes()).hexdigest() in page
    assert f"--kind mean -o {made}" in page
    run(*command, "-o", tmp_path / "direct.html")
    direct = (tmp_path / "direct.html").read_text(encoding="utf-8")
    assert set(re.findall(r'src="(data:image/.*?)"', direct)) < set(
        re.findall(r'src="(data:image/.*?)"', page)
    )
    run("probes", "omp40-2", "-o", tmp_path / "p.json", code=2)
    assert "not a result of pretravel" in run(
        "report", _map_of(command, tmp_path), "-o", tmp_path / "no.html", code=2
    )


def _map_of(command: list[object], folder: Path) -> Path:
    run(*command, "-o", folder / "map.json")
    return folder / "map.json"
