"""Outcomes of a row as one line of the table."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .evaluation import Outcome, pattern_of

COLUMNS = {
    "row": "row",
    "sets": "sets",
    "error": "error µm",
    "error_here": "from centre µm",
    "u": "u µm",
    "chi": "χ²",
    "chi_moved": "χ² moved",
    "covered": "within 2 u %",
    "rods": "χ² at rods",
    "between": "χ² between",
    "center_off": "centre off µm",
    "refused": "refused %",
    "warned": "warned %",
    "warned_wrong": "warned where χ²>1.4 %",
    "own_wrong": "by a warning of its own %",
    "false": "false outliers %",
    "found": "gross found %",
    "alarms": "verify: false alarms % at 5",
    "seconds": "s/set",
}

SHOWN = tuple(name for name in COLUMNS if name not in ("rods", "between", "center_off"))
"""Columns of the printed table; the file has all."""


def routine_sentences(baseline: Sequence[Outcome]) -> frozenset[str]:
    """Warnings that half of the usual sets contain: they say nothing of a departure."""
    counts: Counter[str] = Counter()
    for outcome in baseline:
        counts.update({pattern_of(warning) for warning in outcome.warnings})
    return frozenset(text for text, count in counts.items() if 2 * count >= len(baseline))


def summary(outcomes: Sequence[Outcome], routine: frozenset[str] = frozenset()) -> dict[str, str]:
    """The cells of a row. Errors and u are root mean squares over the sets that were evaluated.

    A warning of the row's own is one that is not in `routine`.
    """
    passed = [outcome for outcome in outcomes if not outcome.refused]
    wrong = [outcome for outcome in passed if outcome.chi_squared > 1.4]
    gross = sum(outcome.gross for outcome in passed)

    alarms = [outcome.alarm for outcome in passed if outcome.alarm is not None]

    def percent(count: int, of: int) -> str:
        return f"{100.0 * count / of:.0f}" if of else "–"

    def mean(name: str, power: int = 1) -> str:
        values = [getattr(outcome, name) ** power for outcome in passed]
        return f"{np.mean(values) ** (1.0 / power):.2f}" if values else "–"

    said = sum(bool(outcome.warnings) for outcome in wrong)
    own = sum(bool({pattern_of(text) for text in outcome.warnings} - routine) for outcome in wrong)
    return {
        "row": outcomes[0].row,
        "sets": str(len(outcomes)),
        "error": mean("error", 2),
        "error_here": mean("error_here", 2),
        "u": mean("u", 2),
        "chi": mean("chi_squared"),
        "chi_moved": mean("chi_squared_moved"),
        "covered": f"{100.0 * np.mean([each.covered for each in passed]):.1f}" if passed else "–",
        "rods": mean("chi_squared_at_rods"),
        "between": mean("chi_squared_between"),
        "center_off": mean("center_off", 2),
        "refused": percent(len(outcomes) - len(passed), len(outcomes)),
        "warned": percent(sum(bool(outcome.warnings) for outcome in passed), len(passed)),
        "warned_wrong": f"{percent(said, len(wrong))} of {len(wrong)}" if wrong else "–",
        "own_wrong": percent(own, len(wrong)),
        "false": percent(sum(outcome.false > 0 for outcome in passed), len(passed)),
        "found": percent(sum(outcome.found for outcome in passed), gross),
        "alarms": percent(sum(alarms), len(alarms)),
        "seconds": f"{np.median([outcome.seconds for outcome in outcomes]):.2f}",
    }


def line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def header() -> str:
    return f"{line([COLUMNS[name] for name in SHOWN])}\n{line(['---'] * len(SHOWN))}"


def sentences(outcomes: Sequence[Outcome]) -> list[str]:
    """Warnings and refusals with the number of sets that contain them, the most frequent first."""
    counts: Counter[str] = Counter()
    for outcome in outcomes:
        counts.update({pattern_of(warning) for warning in outcome.warnings})
        if outcome.refused:
            counts["refused: " + pattern_of(outcome.refused)] += 1
    return [f"    {count:4d} × {text}" for text, count in counts.most_common()]


def write_csv(path: Path, rows: Sequence[dict[str, str]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(COLUMNS))
        writer.writeheader()
        writer.writerows(rows)
