"""All benchmarks, into a page of the documentation. Run: make benchmark.

python -m benchmarks.run                   # everything; writes docs/benchmarks.md
python -m benchmarks.run --only studies    # one of them; nothing is written
python -m benchmarks.run --only pages --update    # its rows in the page; other rows stay
python -m benchmarks.run --small --print   # small sizes: shows that everything works
"""

from __future__ import annotations

import argparse
import csv
import json
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from benchmarks import installed, load, long_tables, ratios, registration, studies, waiting
from benchmarks.commands import spent
from benchmarks.results import (
    Figures,
    Row,
    Table,
    computer,
    growth_line,
    growth_table,
    page,
    ratio_table,
    row_line,
    updated,
)
from benchmarks.sizes import FULL, SMALL, Sizes

_ROOT = Path(__file__).resolve().parents[1]
PAGE = _ROOT / "docs" / "benchmarks.md"
_APART = 0.02
"""Largest relative difference of deflections from those of CalculiX: docs/validation.md."""


def calculix(sizes: Sizes) -> Figures:
    """The time of the processor, with one thread, against CalculiX with the same bodies."""
    what, size, other = (
        "map, finite elements, empty cache (time of the processor)",
        "36 × 9",
        "CalculiX",
    )
    if not sizes.calculix or shutil.which("ccx") is None:
        why = "ccx is not installed here" if sizes.calculix else "the sizes are small"
        note = f"not measured: {why}"
        return Figures((Row(what, size, None, other, None, note),))
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder) / "found.json"
        program = str(_ROOT / "benchmarks" / "calculix" / "run.py")
        count = str(sizes.calculix)
        spent(
            [sys.executable, program, "--directions", count, "--keep", folder, "--json", str(kept)],
            {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )
        found = json.loads(kept.read_text())
    assert found["apart"] < _APART, f"deflections differ by {100.0 * found['apart']:.1f} %"
    note = (
        f"{count} of 324 directions solved; deflections differ by {100.0 * found['apart']:.2g} %; "
        f"with a golden-section search for the trigger {found['golden'] / found['ours']:,.0f} times"
    )
    other = "CalculiX, two contact solves for each direction"
    return Figures((Row(what, size, found["ours"], other, found["fair"], note),))


BENCHMARKS: Mapping[str, Callable[[Sizes], Figures]] = {
    "directions": ratios.directions,
    "touches": ratios.touches,
    "surface-touches": ratios.surface_touches,
    "trials": ratios.trials,
    "qualification": ratios.qualification,
    "long-tables": long_tables.long_tables,
    "studies": studies.studies,
    "finite-elements": ratios.finite_elements,
    "element-studies": studies.element_studies,
    "calculix": calculix,
    "commands": waiting.commands,
    "pages": waiting.pages,
    "parts": waiting.parts,
    "registration": registration.registration,
    "tables": waiting.tables,
    "fits": waiting.fits,
    "a-design": waiting.elements,
    "installed": installed.installed,
    "over-touches": load.over_touches,
    "over-directions": load.over_directions,
    "over-designs": load.over_designs,
    "over-unknowns": load.over_unknowns,
    "over-features": load.over_features,
    "over-days": load.over_days,
    "over-faces": load.over_faces,
}


def run(names: Sequence[str], sizes: Sizes) -> Figures:
    """Run benchmarks one after the other, and print what they find."""
    found = Figures()
    for name in names:
        one = BENCHMARKS[name](sizes)
        for row in one.rows:
            print(row_line(row), flush=True)
        for growth in one.growths:
            print(growth_line(growth), flush=True)
        found += one
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", choices=BENCHMARKS, action="append", help="run this one")
    parser.add_argument("--small", action="store_true", help="small sizes; nothing is written")
    parser.add_argument("--print", action="store_true", help="write no page")
    parser.add_argument("--update", action="store_true", help="write; rows not run stay")
    options = parser.parse_args(arguments)
    where = computer()
    print(where)
    print(f"{'':66s} {'pretravel':>8s} {'other':>8s} {'ratio':>6s}")
    found = run(options.only or list(BENCHMARKS), SMALL if options.small else FULL)
    if options.update or not (options.only or options.small or options.print):
        where += (
            f" Only {', '.join(options.only or [])}: other rows are older."
            if options.update
            else ""
        )
        ratios_found, growths_found = ratio_table(found.rows), growth_table(found.growths)
        if options.update:
            ratios_found = updated(_read_table("benchmarks"), ratios_found)
            growths_found = updated(_read_table("growth"), growths_found)
        has_growths = len(growths_found) > 1
        PAGE.write_text(page(where, has_growths=has_growths), encoding="utf-8")
        _write_table("benchmarks", ratios_found)
        if has_growths:
            _write_table("growth", growths_found)
        print(f"wrote {PAGE}")


def _table_file(name: str) -> Path:
    return PAGE.parent / "results" / f"{name}.csv"


def _read_table(name: str) -> list[list[str]]:
    path = _table_file(name)
    if not path.is_file():
        return [[]]
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def _write_table(name: str, rows: Table) -> None:
    path = _table_file(name)
    path.parent.mkdir(exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
