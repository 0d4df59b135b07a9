"""The folders of the tutorials are those of their pages, and one command runs each."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from docs.example_folders import FOLDERS, content, tutorials

NAMES = [page.stem for page in tutorials()]
WRITTEN = {
    "certificate": {"certificate.html", "rig.csv"},
    "drawing-in-the-model": {"drawing.toml", "points.csv", "tolerances.html"},
    "first-qualification": {"map.json", "map.png", "points.csv"},
    "part-and-drawing": {"deviations.html", "tolerances.html"},
    "step-to-points": {"faces.png", "points.csv", "points.png"},
    "stylus": {"designs.csv", "designs.png", "study.toml"},
}
"""Some of the files that the pages promise."""


@pytest.mark.parametrize("page", tutorials(), ids=lambda page: str(page.stem))
def test_a_folder_is_that_of_its_page(page: Path) -> None:
    """`python -m docs.example_folders` renews them."""
    folder = FOLDERS / page.stem
    there = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file()}
    assert {name: path.read_bytes() for name, path in there.items()} == content(page)


def test_every_folder_has_its_page() -> None:
    assert sorted(path.name for path in FOLDERS.iterdir()) == NAMES == sorted(WRITTEN)
    index = FOLDERS.parents[1] / "docs" / "tutorials" / "index.md"
    assert "`examples/tutorials`" in index.read_text("utf-8")


@pytest.mark.parametrize(
    "name",
    [
        "first-qualification",
        *(pytest.param(n, marks=pytest.mark.slow) for n in NAMES if n != "first-qualification"),
    ],
)
def test_one_command_runs_a_copy(name: str, tmp_path: Path) -> None:
    copy = shutil.copytree(FOLDERS / name, tmp_path / "copy")
    programs = tmp_path / "bin"
    programs.mkdir()
    program = programs / "pretravel"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m pretravel "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    path = os.pathsep.join((str(programs), os.environ["PATH"]))
    done = subprocess.run(
        ["sh", "run.sh"], cwd=copy, env={**os.environ, "PATH": path}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert {p.name for p in copy.iterdir()} >= WRITTEN[name]
