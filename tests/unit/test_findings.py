"""The scripts of `findings` and the page about them say the same; each pins what it runs."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted(path for path in (ROOT / "findings").glob("*.sh") if path.name != "setup.sh")
PAGE = (ROOT / "docs/explanation/others.md").read_text(encoding="utf-8")


def test_each_script_has_its_row() -> None:
    named = re.findall(r"\| `(\w+)` \|$", PAGE, re.MULTILINE)
    assert sorted(named) == [path.stem for path in SCRIPTS]


def test_scripts_pin_what_they_run_and_leave_pretravel_out() -> None:
    for path in SCRIPTS:
        text = path.read_text(encoding="utf-8")
        comments, code = (
            "\n".join(line for line in text.splitlines() if line.startswith("#") == of_comments)
            for of_comments in (True, False)
        )
        assert "Expected:" in comments, path.name
        packages = re.findall(r"^(?:packages|modules) (.*)$", code, re.MULTILINE)
        pinned = [re.search(r".(==|@)\d", word) for line in packages for word in line.split()]
        assert all(pinned), path.name
        assert pinned or "dpkg-query" in code, path.name
        assert "pretravel" not in code, path.name
