"""pretravel demo: the whole chain on the example data."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path

from pretravel.report.demonstration_report import DEMONSTRATION_FILES
from tests.support.commands import run
from tests.support.examples import EXAMPLES


def test_demo(tmp_path: Path) -> None:
    text = run("demo", "--data", EXAMPLES, "-o", tmp_path / "out")
    assert "harmonic map" in text
    made = {path.name for path in (tmp_path / "out").iterdir()}
    pictures = {"qualification.png", "points.png", "compare.png", "kp3_ring.png"}
    assert made == {"index.html", "map.nc", "points.csv", *pictures} == set(DEMONSTRATION_FILES)
    page = (tmp_path / "out" / "index.html").read_text()
    assert all(name in page for name in pictures)
    for name in pictures:  # the page contains the very pictures that are beside it
        assert b64encode((tmp_path / "out" / name).read_bytes()).decode() in page


def test_demo_keeps_files_that_are_there(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("mine")
    assert "points.csv" in run("demo", "--data", EXAMPLES, "-o", tmp_path, code=2)
    assert (tmp_path / "points.csv").read_text() == "mine"


def test_demo_elsewhere() -> None:
    assert "no such folder" in run("demo", "--data", "nowhere", code=2)
