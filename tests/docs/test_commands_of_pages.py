"""The commands of the pages of the site, each page in a fresh folder, and what they print."""

from __future__ import annotations

import doctest
import hashlib
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from docs.example_folders import blocks
from tests.support.commands import follow
from tests.support.examples import EXAMPLES

DOCS = Path(__file__).parents[2] / "docs"
ELSEWHERE = {
    "how-to/drift.md": "tests/docs/test_guides_with_data.py",
    "how-to/measure-a-bore.md": "tests/unit/cli/test_measure.py",
    "how-to/controls.md": "tests/docs/test_control_guides.py",
    "how-to/fanuc-haas.md": "tests/docs/test_control_guides.py",
    "how-to/siemens.md": "tests/docs/test_control_guides.py",
    "how-to/renishaw.md": "tests/docs/test_control_guides.py",
    "how-to/linuxcnc.md": "tests/machine/test_linuxcnc.py",
    "how-to/linuxcnc-cycles.md": "tests/machine/test_linuxcnc.py",
    "how-to/linuxcnc-screens.md": "tests/machine/test_linuxcnc_screens.py",
}
"""Pages whose commands other tests run."""
FOLDERS = ("tutorials", "how-to", "explanation")
PAGES = sorted(
    path.relative_to(DOCS).as_posix()
    for folder in FOLDERS
    for path in (DOCS / folder).glob("*.md")
    if re.search(r"^ *```(sh|python)$", path.read_text("utf-8"), re.M)
)


@dataclass(frozen=True)
class _Done:
    """What a command made and printed."""

    files: dict[str, bytes]
    printed: str


_done: dict[tuple[str, str], _Done] = {}
"""Commands that were run in folders of the same content: many pages begin with the same ones."""


def _content() -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in Path().iterdir()}


def _followed(command: str) -> str:
    """What a command prints; its files are in the folder."""
    before = _content()
    digest = hashlib.sha256(repr(sorted(before.items())).encode()).hexdigest()
    done = _done.get((command, digest))
    if done is None:
        printed = follow(command)
        made = {n: c for n, c in _content().items() if before.get(n) != c}
        done = _done[command, digest] = _Done(made, printed)
    for name, content in done.files.items():
        Path(name).write_bytes(content)
    return done.printed


def _commands(block: str) -> Iterator[str]:
    """The commands of a block; a text between << and its end is written to its file."""
    lines = iter(block.splitlines())
    for line in lines:
        here = re.fullmatch(r"cat > (\S+) <<'(\w+)'", line)
        if here is None:
            yield line
            continue
        text = []
        while (part := next(lines)) != here[2]:
            text.append(part)
        Path(here[1]).write_text("\n".join(text) + "\n", encoding="utf-8")


def _plain(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.parametrize("page", [page for page in PAGES if page not in ELSEWHERE])
def test_page(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (DOCS / page).read_text("utf-8")
    printed = ""
    for language, block in blocks(text):
        if language == "sh":
            printed = "".join(_followed(command) for command in _commands(block))
        elif language == "text":
            missing = [x for x in block.splitlines() if _plain(x) not in _plain(printed)]
            assert not missing, printed
    _doctests(page, text)


def _doctests(page: str, text: str) -> None:
    if "\n>>> " not in text:
        return
    if not Path("touches.csv").exists():
        shutil.copy(EXAMPLES / "sphere_touches.csv", "touches.csv")
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    test = doctest.DocTestParser().get_doctest(text, {}, page, page, 0)
    result = doctest.DocTestRunner(optionflags=flags).run(test)
    assert result.attempted > 0
    assert result.failed == 0


def test_pages_that_other_tests_follow_are_there() -> None:
    assert set(ELSEWHERE) <= set(PAGES)
    for page, test in ELSEWHERE.items():
        assert Path(page).stem.partition("-")[0] in (DOCS.parent / test).read_text("utf-8")
