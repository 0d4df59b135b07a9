"""Links between the texts of the repository, as its web pages show them: files and headings."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXTS = [
    *sorted(ROOT.glob("*.md")),
    *sorted(p for p in (ROOT / "docs").rglob("*.md") if "_build" not in p.parts),
]


def _prose(text: str) -> str:
    """Without blocks of code, whose lines can begin with #."""
    return re.sub(r"^ *```.*?^ *```$", "", text, flags=re.S | re.M)


def _anchors(path: Path) -> set[str]:
    """The names that headings have on the web: lower case, blanks as hyphens, no other signs."""
    found: list[str] = []
    for heading in re.findall(r"^#+ (.*)$", _prose(path.read_text("utf-8")), re.M):
        plain = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        found.append(plain if plain not in found else f"{plain}-{found.count(plain)}")
    return set(found)


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links(path: Path) -> None:
    text = re.sub(r"`[^`\n]*`", "", _prose(path.read_text("utf-8")))
    broken = []
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", link):
            continue
        place, _, anchor = link.partition("#")
        target = path.parent / place if place else path
        # Headings that are made when the site is built are not in the text.
        made = target.exists() and "<!-- generated" in target.read_text("utf-8", "replace")
        if not target.exists() or (anchor and not made and anchor not in _anchors(target)):
            broken.append(link)
    assert broken == []
