"""What `qualify` says when reality departs from its models. Run from the root of the project:

python benchmarks/departures/run.py --sets 40 --rows baseline,hysteresis_0.5 --kind auto --workers 2
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import groupby
from pathlib import Path

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.departures.evaluation import SEED, Job, Outcome, evaluated, evaluated_together
from benchmarks.departures.rows import ROWS
from benchmarks.departures.table import (
    SHOWN,
    header,
    line,
    routine_sentences,
    sentences,
    summary,
    write_csv,
)


def _one_thread() -> None:
    """Processes do the sets side by side; threads of the linear algebra would slow them."""
    from threadpoolctl import threadpool_limits

    global _LIMITS
    _LIMITS = threadpool_limits(1)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--rows", default="all", help="names with commas, or all")
    parser.add_argument("--sets", type=int, default=40, help="simulated sets of each row")
    parser.add_argument("--kind", default="auto", help="kind of map")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--first", type=int, default=0, help="number of the first set")
    parser.add_argument("--csv", type=Path, help="write the table here too")
    parser.add_argument("--sets-csv", type=Path, help="write each set here")
    parser.add_argument("--said", action="store_true", help="print warnings and refusals, counted")
    parser.add_argument("--list", action="store_true", help="print the names of the rows")
    return parser.parse_args()


def _names(given: str) -> list[str]:
    names = list(ROWS) if given == "all" else given.split(",")
    unknown = [name for name in names if name not in ROWS]
    if unknown:
        sys.exit(f"no row {', '.join(unknown)}; there are {', '.join(ROWS)}")
    return names


def main() -> None:
    given = _arguments()
    if given.list:
        for name, departure in ROWS.items():
            print(f"{name:22} {departure.title}")
        return
    names = _names(given.rows)
    numbers = range(given.first, given.first + given.sets)
    cells: list[dict[str, str]] = []
    kept: list[Outcome] = []
    with ProcessPoolExecutor(given.workers, initializer=_one_thread) as pool:
        usual = [Job("baseline", number, given.kind, given.seed) for number in numbers]
        # Without the row itself ten sets are enough to know what is always said.
        baseline = list(pool.map(evaluated, usual if "baseline" in names else usual[:10]))
        routine = routine_sentences(baseline)
        print(header(), flush=True)
        for name, outcomes in _by_row(names, baseline, pool, given):
            kept += outcomes
            cells.append(summary(outcomes, routine))
            print(line([cells[-1][name] for name in SHOWN]), flush=True)
            for sentence in sentences(outcomes) if given.said else ():
                print(sentence, flush=True)
    if given.csv is not None:
        write_csv(given.csv, cells)
    if given.sets_csv is not None:
        _write_sets(given.sets_csv, kept)


def _by_row(
    names: list[str],
    baseline: list[Outcome],
    pool: ProcessPoolExecutor,
    given: argparse.Namespace,
) -> Iterator[tuple[str, list[Outcome]]]:
    """The sets of each row. Rows with a check are done together: they share the map before it."""
    for checked, group in groupby(names, lambda name: ROWS[name].check is not None):
        for rows in [list(group)] if checked else [[name] for name in group]:
            if rows == ["baseline"]:
                yield "baseline", baseline
                continue
            jobs = [
                tuple(Job(name, given.first + i, given.kind, given.seed) for name in rows)
                for i in range(given.sets)
            ]
            found = list(pool.map(evaluated_together, jobs))
            yield from ((name, [sets[i] for sets in found]) for i, name in enumerate(rows))


def _write_sets(path: Path, outcomes: list[Outcome]) -> None:
    import csv
    from dataclasses import asdict

    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(asdict(outcomes[0])))
        writer.writeheader()
        for outcome in outcomes:
            writer.writerow({**asdict(outcome), "warnings": " | ".join(outcome.warnings)})


if __name__ == "__main__":
    main()
