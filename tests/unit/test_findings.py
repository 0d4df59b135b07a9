"""The scripts of `findings` and the page about them say the same; each pins what it runs."""

from __future__ import annotations

import csv
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted(path for path in (ROOT / "findings").glob("*.sh") if path.name != "setup.sh")
TABLE = ROOT / "docs/results/findings.csv"


def test_each_script_has_its_row() -> None:
    with TABLE.open(encoding="utf-8", newline="") as file:
        named = [row["script"].strip("`") for row in csv.DictReader(file)]
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
