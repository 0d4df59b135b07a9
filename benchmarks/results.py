"""Measured rows, and the page of the documentation that shows them."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import TypeAlias

Table: TypeAlias = Sequence[Sequence[str]]
COMMAND = "make benchmark"
LEAST_MEMORY = 1e6
"""Less is chance. [bytes]"""
_ABOUT_RATIOS = """\
Each job runs with its alternative: by the clock, or in processor time where the note has a goal.
Goals in seconds are scaled from a computer that imports NumPy and scipy.special in 0.31 s. The
ratio: how many times as long the alternative takes; where it takes points one by one, the time of
a part is scaled up."""
_ABOUT_GROWTH = """\
Two or three sizes, each in its own process; with memory, time is the processor's, in one thread,
and memory is without imports and data. Exponents compare the two largest sizes: 1 is linear, less
where a part does not grow, 2 is all pairs. Over workers −1 is ideal."""


@dataclass(frozen=True)
class Row:
    """A job and its alternative, measured in the same run.

    Attributes
    ----------
    what : str
    size : str
    ours : float or None
        Time of pretravel; None: the note says what was found instead, or why nothing was. [s]
    alternative : str
        Empty: none.
    theirs : float or None
        Its time. [s]
    note : str
    """

    what: str
    size: str
    ours: float | None
    alternative: str = ""
    theirs: float | None = None
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """How many times as long the alternative takes."""
        return None if self.ours is None or self.theirs is None else self.theirs / self.ours


@dataclass(frozen=True)
class Growth:
    """Time and memory of a job at rising sizes.

    Attributes
    ----------
    what, over : str
    sizes, seconds : tuple of float
    memory : tuple of float
        Beside imports and data; empty: not measured. [bytes]
    note : str
    """

    what: str
    over: str
    sizes: tuple[float, ...]
    seconds: tuple[float, ...]
    memory: tuple[float, ...] = ()
    note: str = ""

    @property
    def time_exponent(self) -> float:
        return exponent(self.sizes, self.seconds)

    @property
    def memory_exponent(self) -> float | None:
        """None: not measured, or so little that it is chance."""
        if not self.memory or sorted(self.memory)[-2] < LEAST_MEMORY:
            return None
        return exponent(self.sizes, self.memory)


@dataclass(frozen=True)
class Figures:
    """What a benchmark found."""

    rows: tuple[Row, ...] = ()
    growths: tuple[Growth, ...] = ()

    def __add__(self, other: Figures) -> Figures:
        return Figures(self.rows + other.rows, self.growths + other.growths)


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """The power with which values grow between the two largest sizes.

    Sizes may be given in any order.
    """
    (small, low), (large, high) = sorted(zip(sizes, values, strict=True))[-2:]
    if not (0.0 < small < large and low > 0.0 and high > 0.0):
        raise ValueError(f"no power leads from {low} at {small} to {high} at {large}")
    return math.log(high / low) / math.log(large / small)


def seconds_text(seconds: float | None) -> str:
    if seconds is None:
        return "–"
    if seconds >= 5400.0:
        return f"{seconds / 3600.0:.1f} h"
    if seconds < 0.1:
        return f"{1e3 * seconds:.3g} ms"
    return f"{seconds:.0f} s" if seconds >= 99.5 else f"{seconds:.2g} s"


def ratio_text(ratio: float | None) -> str:
    if ratio is None:
        return "–"
    return f"{ratio:,.0f}" if ratio >= 99.5 else f"{ratio:.2g}"


def memory_text(size: float) -> str:
    if size < LEAST_MEMORY:
        return "below 1 MB"
    return f"{size / 1e9:.2g} GB" if size >= 1e9 else f"{size / 1e6:.0f} MB"


def row_line(row: Row) -> str:
    """A row as it is printed while the benchmarks run."""
    what = f"{row.size} {row.what}"
    line = f"{what:66s} {seconds_text(row.ours):>8s} {seconds_text(row.theirs):>8s} "
    line += f"{ratio_text(row.ratio):>7s}  {row.alternative}"
    return line.rstrip() + (f"\n    {row.note}" if row.note else "")


def growth_line(growth: Growth) -> str:
    cells = ", ".join(_cell(growth, i) for i in range(len(growth.sizes)))
    memory = growth.memory_exponent
    line = f"{growth.what} over {growth.over}: {cells}; time^{growth.time_exponent:.2f}"
    return line + ("" if memory is None else f", memory^{memory:.2f}")


def _cell(growth: Growth, i: int) -> str:
    text = f"{growth.sizes[i]:,.0f}: {seconds_text(growth.seconds[i])}"
    return text + (f", {memory_text(growth.memory[i])}" if growth.memory else "")


def computer() -> str:
    """The computer in words."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else math.nan
    memory = ""
    if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
        whole = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        memory = f" and {whole / 1e9:.0f} GB of memory"
    busy = ""
    if load > 0.5:
        busy = f", with {load:.0f} other processes at work"
    return (
        f"A computer with {os.cpu_count()} cores{memory}, {platform.system()}, Python "
        f"{platform.python_version()}, on {date.today().isoformat()}{busy}."
    )


def page(where: str, *, has_growths: bool = True) -> str:
    """The page of the documentation, in Markdown; the site takes its tables from their files.

    Parameters
    ----------
    where : str
        The computer in words.
    has_growths : bool
    """
    lines = [
        "# Benchmarks",
        "",
        f"`{COMMAND}` measures and writes this page. {where}",
        "",
        f"{_ABOUT_RATIOS} ([CSV](results/benchmarks.csv))",
        "",
        "<!-- generated: results benchmarks -->",
    ]
    if has_growths:
        lines += ["", "## Growth", "", f"{_ABOUT_GROWTH} ([CSV](results/growth.csv))", ""]
        lines += ["<!-- generated: results growth -->"]
    return "\n".join(lines) + "\n"


def ratio_table(rows: Sequence[Row]) -> list[list[str]]:
    """Jobs with their times and alternatives; the first row has the names of the columns."""
    return [
        ["job", "pretravel", "alternative", "its time", "ratio", "note"],
        *(
            [
                f"{row.size} {row.what}".strip(),
                seconds_text(row.ours),
                row.alternative or "–",
                seconds_text(row.theirs),
                ratio_text(row.ratio),
                row.note,
            ]
            for row in rows
        ),
    ]


def growth_table(growths: Sequence[Growth]) -> list[list[str]]:
    """Jobs with their sizes and exponents; the first row has the names of the columns."""
    lines = [["job", "grows with", "size: time, memory", "exponent of time", "of memory"]]
    for growth in growths:
        sizes = "; ".join(_cell(growth, i) for i in range(len(growth.sizes)))
        memory = growth.memory_exponent
        lines.append(
            [
                growth.what + (f" ({growth.note})" if growth.note else ""),
                growth.over,
                sizes,
                _signed(growth.time_exponent),
                "–" if memory is None else _signed(memory),
            ]
        )
    return lines


def updated(before: Table, now: Table) -> list[list[str]]:
    """The rows of a table with those that were measured now; new ones come last.

    Parameters
    ----------
    before, now : sequence of sequence of str
        The first row has the names of the columns. Rows with the same job and the same alternative
        (or what grows) are the same.

    >>> updated([["job", "with"], ["a", "x", "1"], ["b", "x", "2"]],
    ...         [["job", "with"], ["b", "x", "3"], ["c", "x", "4"]])
    [['job', 'with'], ['a', 'x', '1'], ['b', 'x', '3'], ['c', 'x', '4']]
    """
    other = 2 if len(now[0]) > 2 and now[0][2] == "alternative" else 1
    rows = {(row[0], row[other]): list(row) for row in before[1:]}
    rows |= {(row[0], row[other]): list(row) for row in now[1:]}
    return [list(now[0]), *rows.values()]


def _signed(value: float) -> str:
    return f"{value:.2f}".replace("-", "−")
