"""The reader of texts finds our private words where people read them, and passes code over."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

pytest.importorskip("proselint")
sys.path.insert(0, str(Path(__file__).parents[2] / "tools"))

import prose


@pytest.fixture(autouse=True)
def _no_checks_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prose.CheckRegistry, "_checks", [])


def test_a_private_word_is_found_at_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.md"
    page.write_text("# Title\n\nThe lobes are told apart.\n")
    assert prose.main([str(page)]) == 1
    assert f"{page}:3: vocabulary: 'told apart': distinguished" in capsys.readouterr().out


def test_a_colon_within_parentheses_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.md"
    page.write_text("A note (of a kind: this one).\n\nNo note (of a kind): `(of a kind: code)`.\n")
    assert prose.main([str(page)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[1] for line in lines] == ["1"]


def test_code_and_names_are_passed_over(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("```\ntold apart\n```\n\n`told apart`, --told-apart and [a](told apart)\n")
    assert prose.main([str(page)]) == 0


def test_docstrings_and_messages_are_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        '"""First line.\n\nMade anew.\n"""\nanew = 1\nprint(f"nobody checked {anew}")\n'
    )
    assert prose.main([str(module)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[1] for line in lines] == ["3", "6"]
