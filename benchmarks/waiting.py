"""What a person waits for: commands, pages, parts, tables, fits; each with its reference.

Times are those of the processor with one thread, of the whole process with the processes that it
starts. The reference is measured in the same run.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.commands import PRETRAVEL, Spent, python_file, spent
from benchmarks.long_tables import write_table
from benchmarks.results import Figures, Row, memory_text
from benchmarks.sizes import Sizes
from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.qualification.qualifying import qualify
from pretravel.task.example_data import example_folder
from pretravel.touches import Touches
from tests.support.touches_of_days import day_of

_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
_SPHERE = ("--diameter", "24.9987", "--tip-diameter", "6")
_DATA = example_folder()


class Waiting:
    """A folder with the inputs of all jobs, and the best time of a command in it."""

    def __init__(self, folder: Path, repeats: int) -> None:
        self.folder, self.repeats = folder, repeats
        self.made = folder / "map.json"
        self.ours("qualify", _DATA / "sphere_touches.csv", *_SPHERE, "-o", self.made)

    def best(self, command: Sequence[str]) -> Spent:
        runs = [spent(command, _ONE_THREAD) for _ in range(self.repeats)]
        return min(runs, key=lambda run: run.processor)

    def ours(self, *words: object) -> Spent:
        return self.best([*PRETRAVEL, *map(str, words)])

    def program(self, name: str, text: str) -> Spent:
        return self.best(python_file(self.folder, f"{name}.py", text))


def commands(sizes: Sizes) -> Figures:
    """Short commands against the libraries that the computation needs."""
    with tempfile.TemporaryDirectory() as name:
        at = Waiting(Path(name), sizes.repeats)
        bare = at.program("bare", "pass").processor
        needed = at.program("needed", "import numpy, scipy.special").processor
        sphere, part = _DATA / "sphere_touches.csv", _DATA / "bore_touches.csv"
        nine = at.folder / "nine.csv"
        jobs: dict[str, tuple[object, ...]] = {
            "compensate": (part, "--map", at.made, "-o", at.folder / "points.csv"),
            "measure": (at.folder / "points.csv", "--feature", "bore", "--select", "bore1*"),
            "verify": (day_of(at.folder, 1), "--map", at.made, "--diameter", "24.9987"),
            "check": ("iso10360-5", sphere, "--diameter", "24.9987"),
            "export": (at.made, "--to", "fanuc", "-o", at.folder / "fanuc"),
            "plan-touches": ("--map", at.made, "--count", 9, "-o", nine),
            "qualify": (sphere, *_SPHERE, "-o", at.folder / "again.json"),
        }
        other = "import numpy, scipy.special"
        rows = [
            Row(f"pretravel {job}", "", at.ours(job, *words).processor, other, needed)
            for job, words in jobs.items()
        ]
        rows += [
            Row(f"pretravel {word}", "", at.ours(word).processor, "python -c pass", bare)
            for word in ("--version", "--help")
        ]
        placed = at.ours(
            "align", _DATA / "bracket_touches.csv", "--part", _DATA / "bracket.step",
            "--map", at.made, "-o", at.folder / "place.json",
        )  # fmt: skip
        rows.append(Row("pretravel align, bracket", "", placed.processor))
        return Figures((*rows, *_pages(at, jobs)))


def _pages(at: Waiting, jobs: dict[str, tuple[object, ...]]) -> list[Row]:
    """The same command with a page and without."""
    page = at.folder / "page.html"
    history = at.folder / "probe.jsonl"
    spent([*PRETRAVEL, "verify", *map(str, jobs["verify"]), "--history", str(history)])
    rows = []
    for job, words in {
        "qualify": jobs["qualify"][:-2],
        "rig": (_DATA / "rig",),
        "measure": jobs["measure"],
        "history": (history,),
    }.items():
        without, with_page = at.ours(job, *words), at.ours(job, *words, "-o", page)
        note = f"page of {memory_text(page.stat().st_size)}"
        rows.append(
            Row(
                f"{job} with -o page.html",
                "",
                with_page.processor,
                "without",
                without.processor,
                note,
            )
        )
    return rows


_PLATE = """
from netgen.occ import Box, Cylinder, Pnt, Z
plate = Box(Pnt(0, 0, 0), Pnt(10 * {across}, 10 * {along}, 10))
for i in range({across}):
    row = Cylinder(Pnt(5 + 10 * i, 5, -1), Z, r=2.5, h=12)
    for j in range(1, {along}):
        row += Cylinder(Pnt(5 + 10 * i, 5 + 10 * j, -1), Z, r=2.5, h=12)
    plate -= row
plate.WriteStep({path!r})
"""
"""A plate with holes: 31 × 32 make 998 faces."""


def parts(sizes: Sizes) -> Figures:
    """A part with many holes: read for the first time, and again."""
    with tempfile.TemporaryDirectory() as name:
        at = Waiting(Path(name), 1)
        step = at.folder / "plate.step"
        across, along = sizes.holes
        at.program("plate", _PLATE.format(path=str(step), across=across, along=along))
        faces = f"{6 + across * along}"
        text = f"from netgen.occ import OCCGeometry\nOCCGeometry({str(step)!r})"
        theirs = at.program("read", text).processor
        cache = {**_ONE_THREAD, "XDG_CACHE_HOME": str(at.folder / "cache")}
        command = [*PRETRAVEL, "faces", str(step)]
        first, again = (spent(command, cache) for _ in range(2))
        empty = spent([*PRETRAVEL, "--version"], cache).processor
        other = "netgen's own reading of the file"
        memory = f"whole command; at most {memory_text(first.largest)}"
        return Figures(
            (
                Row("faces of a part, first time", faces, first.processor, other, theirs, memory),
                Row(
                    "faces of a part, again", faces, again.processor, other, theirs,
                    f"whole command, of it {empty:.2g} s for its start",
                ),
            )
        )  # fmt: skip


def tables(sizes: Sizes) -> Figures:
    """Tables of 100,000 touches, which keep the errors of the map, and of 200,000."""
    counts = {min(sizes.long_touches, count) for count in (100_000, 200_000)}
    return sum(map(_table, sorted(counts)), Figures())


def _table(count: int) -> Figures:
    """A table of touches, CSV and Parquet."""
    with tempfile.TemporaryDirectory() as name:
        at = Waiting(Path(name), 1)
        table, parquet = at.folder / "touches.csv", at.folder / "touches.parquet"
        write_table(count, table)
        import pyarrow.csv
        import pyarrow.parquet

        pyarrow.parquet.write_table(pyarrow.csv.read_csv(table), parquet)
        copy = at.folder / "copy.csv"
        references = {
            "pandas": f"import pandas\npandas.read_csv({str(table)!r}).to_csv({str(copy)!r})",
            "pyarrow": "import pyarrow.csv as csv\n"
            f"csv.write_csv(csv.read_csv({str(table)!r}), {str(copy)!r})",
            "pyarrow, Parquet": "import pyarrow.parquet as parquet\n"
            f"parquet.write_table(parquet.read_table({str(parquet)!r}), {str(copy)!r})",
        }
        theirs = {
            name: at.program("reference", text).processor for name, text in references.items()
        }
        rows = []
        for given, made, names in (
            (table, "points.csv", ("pandas", "pyarrow")),
            (parquet, "points.parquet", ("pyarrow, Parquet",)),
        ):
            ours = at.ours(
                "compensate", given, "--map", at.made, "--extrapolate", "-o", at.folder / made
            )
            rows += [
                Row(
                    f"touches compensated, {given.suffix[1:]}, kind auto", f"{count:,}",
                    ours.processor, f"{other} reading and writing it", theirs[other],
                    f"at most {memory_text(ours.largest)} in one process",
                )
                for other in names
            ]  # fmt: skip
        return Figures(tuple(rows))


def _processor(function: Callable[[], object], repeats: int) -> float:
    """The shortest time of the processor of some runs. [s]"""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def fits(sizes: Sizes) -> Figures:
    """The default fit, the evaluation of its map, and the trials of a budget."""
    n = np.repeat(sphere_pattern_25(), 3, axis=0)
    truth = predict(load_probe("omp40-2-100mm"), n).pretravel
    distance = 15.5 - truth + np.random.default_rng(0).normal(0.0, 3e-4, len(n))
    touches = Touches(n * distance[:, None], n)
    fit = _processor(lambda: qualify(touches, 25.0, tip_diameter=6.0), sizes.repeats)
    rows = [Row("touches qualified, kind auto", "75", fit)]
    made = qualify(touches, 25.0, tip_diameter=6.0, kind="physical").pretravel_map
    many = fibonacci_cap(sizes.directions, math.radians(90.0))
    matrices = np.broadcast_to(np.eye(6), (len(many), 6, 6)) + 0.01
    rows.append(
        Row(
            "directions of a physical map with u", f"{len(many):,}",
            _processor(lambda: made.pretravel_and_uncertainty(many), sizes.repeats),
            "numpy.linalg.solve, 6 × 6",
            _processor(lambda: np.linalg.solve(matrices, matrices[:, :, :1]), sizes.repeats),
        )
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as name:
        at = Waiting(Path(name), 1)
        budget = at.ours(
            "check-budget", _DATA / "sphere_touches.csv", *_SPHERE, "--sets", sizes.sets
        )
    rows.append(
        Row("sets of check-budget", f"{sizes.sets}", budget.processor,
            "as many fits as above", sizes.sets * fit,
            f"{budget.seconds:.2g} s by the clock")
    )  # fmt: skip
    return Figures(tuple(rows))


def waiting(sizes: Sizes) -> Figures:
    """All of them."""
    return commands(sizes) + parts(sizes) + tables(sizes) + fits(sizes)
