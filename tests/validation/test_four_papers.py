"""The rows of docs/validation.md on four papers: nothing numbered is left out, each has a verdict.

The rows are made from the markers `published` of the tests, and from
docs/results/published-without-test.csv.
"""

from __future__ import annotations

import pytest

from docs.generated_reference import published_rows


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
    for row in published_rows(paper):
        if not row.item.startswith("Section"):
            kind, numbers = _meant(row.item)
            covered[kind] += numbers
    assert covered == {
        kind: sorted(n, key=covered[kind].index) for kind, n in PAPERS[paper].items()
    }


@pytest.mark.parametrize("paper", PAPERS)
def test_each_row_has_a_verdict_and_a_test(paper: str) -> None:
    for row in published_rows(paper):
        assert row.what, row
        assert row.ours, row
        assert row.theirs, row
        assert row.verdict.startswith(VERDICTS), row
        assert row.tests or row.command or row.verdict.startswith("not software"), row
