"""The commands of README run from top to bottom, and no command loses the file of another."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from tests.support.commands import run

ROOT = Path(__file__).parents[2]
WRITTEN = ("-o", "--plot", "--vtu", "--history", ">")
KNOWN = (".csv", ".nc", ".toml", ".step", ".sqlite", ".ngc")
"""Endings of files that one command writes and another reads."""


def _commands() -> list[list[str]]:
    (block,) = re.findall(
        r"^## On the command line\n\n```\n(.*?)^```",
        (ROOT / "README.md").read_text("utf-8"),
        re.S | re.M,
    )
    return [shlex.split(line, comments=True) for line in block.splitlines()]


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
            if ">" in words:
                printed = run(*words[1:-2])
                Path(words[-1]).write_text(printed)
            else:
                run(*words[1:])
