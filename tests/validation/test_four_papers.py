"""The rows of docs/validation.md on four papers: nothing numbered is left out, each test exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
FILES = {
    "statics": "validation/test_rodrigues_2021.py",
    "elements": "validation/test_rodrigues_2021_finite_elements.py",
    "sliding": "validation/test_rodrigues_2021_sliding.py",
    "errata": "validation/test_rodrigues_2021_errata.py",
    "equations": "validation/test_rodrigues_2021_equations.py",
    "ren": "validation/test_ren_2020.py",
    "wozniak": "validation/test_wozniak.py",
    "nafi": "validation/test_nafi_mayer_2011.py",
    "probes": "validation/test_published_probes.py",
    "gallery": "validation/test_gallery.py",
    "events": "unit/laboratory/test_rig_events.py",
    "calibration": "unit/laboratory/test_rig_calibration.py",
    "map": "unit/laboratory/test_rig_map.py",
    "scale": "unit/laboratory/test_rig_scale.py",
    "touches": "unit/laboratory/test_multi_step_touches.py",
    "designer": "unit/app/test_designer_slide.py",
    "trials": "unit/cli/test_slide.py",
    "scatter": "unit/measurement/test_touch_scatter.py",
}


def _numbered(**counts: int) -> list[str]:
    """Numbers such as 3.1 to 3.36, by chapter."""
    return [f"{name[1:]}.{k}" for name, count in counts.items() for k in range(1, count + 1)]


def _counted(count: int) -> list[str]:
    return [str(k) for k in range(1, count + 1)]


PAPERS = {
    "Rodrigues 2021": {
        "Equation": _numbered(c2=1, c3=36, c4=26),
        "Table": _numbered(c2=3, c3=2, c4=13),
        "Figure": _numbered(c1=5, c2=19, c3=15, c4=36),
    },
    "Ren 2020": {"Equation": _counted(17), "Table": _counted(2), "Figure": _counted(9)},
    "Woźniak": {"Equation": _counted(9), "Figure": _counted(5)},
    "Nafi and Mayer 2011": {"Equation": _counted(10), "Figure": _counted(6)},
}
VERDICTS = ("agrees", "differs", "not software")


def _rows(paper: str) -> list[list[str]]:
    section = PAGE.split(f"### {paper}, rows")[1].split("\n#")[0]
    rows = [line for line in section.splitlines() if line.startswith("| ")][2:]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in rows]


def _meant(item: str) -> tuple[str, list[str]]:
    """Kind and numbers of "Equations 3.5 to 3.7", "Tables 3.1, 3.2"."""
    kind, _, numbers = item.partition(" ")
    found = []
    for part in numbers.split(", "):
        first, _, last = part.partition(" to ")
        chapter, _, low = first.rpartition(".")
        high = (last or first).rpartition(".")[2]
        dot = "." if chapter else ""
        found += [f"{chapter}{dot}{k}" for k in range(int(low), int(high) + 1)]
    return kind.removesuffix("s"), found


@pytest.mark.parametrize("paper", PAPERS)
def test_every_equation_table_and_figure_has_a_row(paper: str) -> None:
    covered: dict[str, list[str]] = {kind: [] for kind in PAPERS[paper]}
    for row in _rows(paper):
        assert len(row) == 6, row
        if not row[0].startswith("Section"):
            kind, numbers = _meant(row[0])
            covered[kind] += numbers
    assert covered == {
        kind: sorted(n, key=covered[kind].index) for kind, n in PAPERS[paper].items()
    }


@pytest.mark.parametrize("paper", PAPERS)
def test_each_row_has_a_verdict_and_tests_that_exist(paper: str) -> None:
    for item, _, _, _, how, verdict in _rows(paper):
        assert verdict.startswith(VERDICTS), (item, verdict)
        named = re.findall(r"(?:(\w+): )?`(test_\w+)`", how)
        file = ""
        for word, test in named:
            file = word or file
            text = (ROOT / "tests" / FILES[file]).read_text(encoding="utf-8")
            assert f"def {test}(" in text, (item, file, test)
        command = "`pretravel " in how
        assert named or command or verdict.startswith("not software"), item
