"""The guides of drift, whose data are a simulated month, and of studies."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pretravel.base.toml_file import parse_toml
from pretravel.design.studies.definition import study_in
from pretravel.design.studies.plan import Plan
from tests.support.commands import follow
from tests.support.pictures import coloured_share
from tests.unit.cli.test_history import month

DOCS = Path(__file__).parents[2] / "docs"


def blocks(guide: str, language: str) -> list[str]:
    text = (DOCS / guide).read_text(encoding="utf-8")
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text, re.S | re.M)
    return [block for stated, block in found if stated == language]


def test_drift(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command that the guide begins with tells what the guide shows."""
    month(tmp_path / "logs", 12, slope=1e-4)
    monkeypatch.chdir(tmp_path)
    lines = [line for block in blocks("how-to/drift.md", "sh") for line in block.splitlines()]
    told = [follow(line) for line in lines]
    assert told[0].splitlines()[0] == blocks("how-to/drift.md", "")[0].strip()
    assert len(lines) == 5
    for name in ("drift.png", "drift.csv", "drift.html", "map.json"):
        assert (tmp_path / name).stat().st_size > 500


def test_studies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (commands,) = blocks("studies.md", "")
    for line in commands.splitlines():
        follow(line)
    assert len(Plan(study_in(parse_toml(Path("mine.toml").read_text())))) == 128 * 8
    assert coloured_share("study.png") > 0.001
    (script,) = blocks("studies.md", "python")
    exec(script, {})
    (text,) = blocks("studies.md", "toml")
    assert len(Plan(study_in(parse_toml(text)))) == 9
