"""The commands of README and of the tour run in order; no command loses the file of another."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from tests.support.commands import follow, run

ROOT = Path(__file__).parents[2]
WRITTEN = ("-o", "--points", "--plot", "--vtu", "--history", ">")
KNOWN = (".csv", ".json", ".toml", ".step", ".jsonl", ".ngc")
"""Endings of files that one command writes and another reads."""


def _commands(page: str = "docs/tour.md", heading: str = "") -> list[list[str]]:
    """The commands of the first block of a page, or of that below a heading."""
    text = (ROOT / page).read_text("utf-8")
    block = re.findall(r"^```\n(pretravel .*?)^```", text[text.index(heading) :], re.S | re.M)[0]
    return [shlex.split(line, comments=True) for line in block.splitlines()]


FIRST_PATH = _commands("README.md", "## First steps")


def _outputs(words: list[str]) -> Iterator[str]:
    for option, value in pairwise(words):
        if option in WRITTEN:
            yield value


def _is_there(name: str) -> bool:
    return any(ROOT.glob(name))


def test_no_command_replaces_the_file_of_another() -> None:
    names = [name for words in _commands() for name in _outputs(words)]
    assert len(names) > 20
    assert sorted(set(names)) == sorted(names)


@pytest.mark.long
def test_the_first_path_runs_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four commands; the last ones show what the page promises."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    assert len(FIRST_PATH) == 4
    printed = [run(*words[1:]) for words in FIRST_PATH]
    assert all(len(text.splitlines()) <= 12 for text in printed)
    assert "2 of 2 within the tolerance" in printed[2]
    assert "sector table" in printed[3]
    assert {path.name for path in tmp_path.glob("*.png")} == {"map.png", "bores.png", "compare.png"}


def test_what_a_command_reads_was_made_before_or_is_in_the_repository() -> None:
    made: set[str] = set()
    for words in _commands():
        own = set(_outputs(words))
        read = {word for word in words if word.endswith(KNOWN)} - own
        assert {name for name in read if name not in made and not _is_there(name)} == set()
        made |= own


@pytest.mark.slow
def test_all_of_them_run_and_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Finite elements make it slow."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        for words in _commands():
            follow(shlex.join(words))
