"""Rows, exponents and the page of the benchmarks."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.results import (
    Growth,
    Row,
    exponent,
    growth_line,
    growth_table,
    memory_text,
    page,
    ratio_table,
    row_line,
    seconds_text,
    updated,
)

ROW = Row("points read", "1,000", 0.5, "a plain loop", 25.0, "at most 12 MB")
GROWTH = Growth("`read`", "points", (10, 100, 1000), (1.0, 2.0, 20.0), (5e6, 2e7, 2e9))


@pytest.mark.parametrize("power", [-1.0, 0.0, 0.5, 1.0, 2.0])
def test_the_exponent_of_exact_powers(power: float) -> None:
    sizes = (30.0, 400.0, 1700.0)
    assert exponent(sizes, [7.0 * size**power for size in sizes]) == pytest.approx(power, abs=1e-12)


def test_the_exponent_is_that_of_the_two_largest_sizes_in_any_order() -> None:
    assert exponent((1000, 1, 10), (500.0, 77.0, 5.0)) == pytest.approx(1.0)


def test_no_exponent_leads_from_nothing() -> None:
    with pytest.raises(ValueError, match=r"from 0\.0 at 1"):
        exponent((1, 2), (0.0, 1.0))


def test_little_memory_has_no_exponent() -> None:
    little = Growth("a", "b", (1, 10, 100), (1.0, 1.0, 1.0), (1.0, 1.0, 9e8))
    assert little.memory_exponent is None
    assert GROWTH.memory_exponent == pytest.approx(2.0)


def test_ratios_say_how_many_times_as_long_the_alternative_takes() -> None:
    assert ROW.ratio == pytest.approx(50.0)
    assert Row("a", "1", None, "b", 2.0).ratio is None
    assert Row("a", "1", 2.0).ratio is None


def test_page_and_tables_show_every_figure() -> None:
    missing = Row("map", "9", None, "another solver", None, "not measured: it is not installed")
    lines = page("A computer with 3 cores.").splitlines()
    assert lines[0] == "# Benchmarks"
    assert any("make benchmark" in line and "A computer with 3 cores." in line for line in lines)
    assert "<!-- generated: results benchmarks -->" in lines
    assert "<!-- generated: results growth -->" in lines
    assert ratio_table((ROW, missing))[1:] == [
        ["1,000 points read", "0.5 s", "a plain loop", "25 s", "50", "at most 12 MB"],
        ["9 map", "–", "another solver", "–", "–", "not measured: it is not installed"],
    ]
    sizes = "10: 1 s, 5 MB; 100: 2 s, 20 MB; 1,000: 20 s, 2 GB"
    assert growth_table((GROWTH,))[1:] == [["`read`", "points", sizes, "1.00", "2.00"]]


def test_an_update_keeps_the_rows_that_were_not_measured() -> None:
    """A job with two alternatives has two rows; measured ones stay in their place."""
    other, slower = replace(ROW, alternative="a quick loop"), replace(ROW, ours=1.0)
    new = replace(ROW, what="points written")
    before, now = ratio_table((ROW, other)), ratio_table((new, slower))
    assert updated(before, now) == ratio_table((slower, other, new))


def test_figures_are_printed_while_they_are_measured() -> None:
    words = "1,000 points read 0.5 s 25 s 50 a plain loop at most 12 MB"
    assert row_line(ROW).split() == words.split()
    assert growth_line(GROWTH).endswith("1,000: 20 s, 2 GB; time^1.00, memory^2.00")


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(None, "–"), (0.00123, "1.23 ms"), (1.26, "1.3 s"), (99.6, "100 s"), (7200.0, "2.0 h")],
)
def test_times_have_a_fitting_unit(seconds: float | None, text: str) -> None:
    assert seconds_text(seconds) == text


def test_memory_has_a_fitting_unit() -> None:
    assert [memory_text(size) for size in (5e5, 2.5e7, 1.26e9)] == ["below 1 MB", "25 MB", "1.3 GB"]
    assert not math.isnan(GROWTH.time_exponent)


RESULTS = sorted((Path(__file__).parents[2] / "docs" / "results").glob("*.csv"))


@pytest.mark.parametrize("path", RESULTS, ids=lambda path: path.stem)
def test_no_result_of_the_page_stands_twice(path: Path) -> None:
    with path.open(encoding="utf-8", newline="") as file:
        rows = [tuple(row) for row in csv.reader(file)]
    assert len(rows) > 1
    assert [row for row in dict.fromkeys(rows) if rows.count(row) > 1] == []
