"""What a person waits for: commands, pages, parts, tables, fits; each with its reference.

Times are those of the processor with one thread, of the whole process with the processes that it
starts: medians of runs that alternate with those of the reference. A note has the goal, and what
stands in the way where it is missed. Goals in seconds were set for a computer on which the imports
of `_LIBRARIES` take `_SET_FOR`: `Waiting.scaled` has them for the one that measures.
"""

from __future__ import annotations

import math
import statistics
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from unittest.mock import patch

import numpy as np
from scipy.sparse import csr_matrix

from benchmarks.commands import PRETRAVEL, Spent, python_file, spent
from benchmarks.long_tables import write_table
from benchmarks.results import Figures, Row, memory_text, seconds_text
from benchmarks.sizes import Sizes
from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.qualification.qualifying import qualify
from pretravel.task.example_data import example_folder
from pretravel.touches import Touches
from tests.support.touches_of_days import day_of

_ONE_THREAD = {
    **dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
    "PYTHONDONTWRITEBYTECODE": "",  # else each run would compile all modules
}
_SPHERE = ("--diameter", "24.9987", "--tip-diameter", "6")
_DATA = example_folder()
_LIBRARIES = "import numpy, scipy.special"
_SET_FOR = 0.31
"""Of the processor, for `_LIBRARIES` where goals in seconds were set. [s]"""
_OWN_MODULES = "its own modules take a third of the time, libraries a third"
_ARITHMETIC = "imports take a third of it, the fits half"


class Waiting:
    """A folder with the inputs of all jobs, and the time of commands in it."""

    def __init__(self, folder: Path, repeats: int) -> None:
        self.folder, self.repeats = folder, repeats
        self._libraries = python_file(folder, "libraries.py", _LIBRARIES)
        self._slowness = 1.0
        self.made = folder / "map.json"
        self.ours("qualify", _DATA / "sphere_touches.csv", *_SPHERE, "-o", self.made)

    def median(self, commands: Mapping[str, Sequence[str]]) -> dict[str, Spent]:
        """Of runs in turn with those of `_LIBRARIES`, after one that is not counted."""
        commands = {**commands, _LIBRARIES: self._libraries}
        for command in commands.values():
            spent(command, _ONE_THREAD)
        runs: dict[str, list[Spent]] = {name: [] for name in commands}
        for _ in range(self.repeats):
            for name, command in commands.items():
                runs[name].append(spent(command, _ONE_THREAD))
        middle = len(range(self.repeats)) // 2
        found = {
            name: sorted(each, key=lambda run: run.processor)[middle] for name, each in runs.items()
        }
        self._slowness = found[_LIBRARIES].processor / _SET_FOR
        return found

    def scaled(self, seconds: float) -> float:
        """A goal for this computer, as slow as `median` found it last. [s]"""
        return self._slowness * seconds

    def ours(self, *words: object) -> Spent:
        return spent([*PRETRAVEL, *map(str, words)], _ONE_THREAD)

    def program(self, name: str, text: str) -> Spent:
        return spent(python_file(self.folder, f"{name}.py", text), _ONE_THREAD)


def _goal(ours: float, goal: float, limit: str, note: str = "") -> str:
    """The goal of a job, and what stands in the way where it is missed."""
    said = "met" if ours <= goal else f"missed: {limit}"
    return f"goal {seconds_text(goal)}, {said}" + (f"; {note}" if note else "")


def _jobs(at: Waiting) -> dict[str, tuple[object, ...]]:
    """The words of each command."""
    sphere, part = _DATA / "sphere_touches.csv", _DATA / "bore_touches.csv"
    points = at.folder / "points.csv"
    at.ours("compensate", part, "--map", at.made, "-o", points)
    return {
        "compensate": (part, "--map", at.made, "-o", points),
        "measure": (points, "--feature", "bore", "--select", "bore1*"),
        "verify": (day_of(at.folder, 1), "--map", at.made, "--diameter", "24.9987"),
        "check": ("iso10360-5", sphere, "--diameter", "24.9987"),
        "export": (at.made, "--to", "fanuc", "-o", at.folder / "fanuc"),
        "plan-touches": ("--map", at.made, "--count", 9, "-o", at.folder / "nine.csv"),
        "qualify": (sphere, *_SPHERE, "-o", at.folder / "again.json"),
    }


def commands(sizes: Sizes) -> Figures:
    """Short commands against the libraries that the computation needs."""
    with tempfile.TemporaryDirectory() as name:
        at = Waiting(Path(name), sizes.repeats)
        jobs = _jobs(at)
        timed = {"python -c pass": python_file(at.folder, "pass.py", "pass")}
        timed |= {job: [*PRETRAVEL, job, *map(str, words)] for job, words in jobs.items()}
        timed |= {word: [*PRETRAVEL, word] for word in ("--version", "--help")}
        found = {each: one.processor for each, one in at.median(timed).items()}
        needed = found[_LIBRARIES]
        rows = []
        for job in jobs:
            goal, limit = (3.0, _ARITHMETIC) if job == "qualify" else (1.5, _OWN_MODULES)
            note = _goal(found[job], goal * needed, limit)
            rows.append(Row(f"pretravel {job}", "", found[job], _LIBRARIES, needed, note))
        rows += [
            Row(f"pretravel {word}", "", found[word], "python -c pass", found["python -c pass"])
            for word in ("--version", "--help")
        ]
        return Figures(tuple(rows))


def pages(sizes: Sizes) -> Figures:
    """The same command with a page and without."""
    with tempfile.TemporaryDirectory() as name:
        at = Waiting(Path(name), min(sizes.repeats, 3))
        jobs, page, history = _jobs(at), at.folder / "page.html", at.folder / "probe.jsonl"
        at.ours("verify", *jobs["verify"], "--history", history)
        rows = []
        for job, words in {
            "qualify": jobs["qualify"][:-2],
            "rig": (_DATA / "rig",),
            "measure": jobs["measure"],
            "history": (history,),
        }.items():
            bare = [*PRETRAVEL, job, *map(str, words)]
            found = at.median({"without": bare, "with": [*bare, "-o", str(page)]})
            without, with_page = found["without"].processor, found["with"].processor
            note = f"page of {memory_text(page.stat().st_size)}"
            note = _goal(
                with_page,
                without + at.scaled(0.4),
                "matplotlib is two thirds, 0.1 s and more a picture, templates a seventh",
                note,
            )
            rows.append(Row(f"{job} with -o page.html", "", with_page, "without", without, note))
    return Figures(tuple(rows))


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
        at = Waiting(Path(name), min(sizes.repeats, 3))
        step = at.folder / "plate.step"
        across, along = sizes.holes
        at.program("plate", _PLATE.format(path=str(step), across=across, along=along))
        faces = f"{6 + across * along}"
        text = f"from netgen.occ import OCCGeometry\nOCCGeometry({str(step)!r})"
        theirs = at.program("read", text).processor
        cache = {**_ONE_THREAD, "XDG_CACHE_HOME": str(at.folder / "cache")}
        command = [*PRETRAVEL, "faces", str(step)]
        spent([*PRETRAVEL, "faces", str(_DATA / "bracket.step")], cache)  # modules are compiled
        first, again = (spent(command, cache) for _ in range(2))
        at.median({})
        empty = spent([*PRETRAVEL, "--version"], cache).processor
        other = "netgen's own reading of the file"
        memory = f"whole command; at most {memory_text(first.largest)}"
        memory = _goal(
            first.processor,
            1.5 * theirs,
            "netgen's process is a half, outlines with 992 holes an eighth",
            memory,
        )
        start = f"whole command, of it {seconds_text(empty)} for its start"
        start = _goal(
            again.processor,
            at.scaled(0.3) + empty,
            "modules half, reading what is kept a third",
            start,
        )
        return Figures(
            (
                Row("faces of a part, first time", faces, first.processor, other, theirs, memory),
                Row(
                    "faces of a part, again", faces, again.processor, other, theirs, start,
                ),
            )
        )  # fmt: skip


def tables(sizes: Sizes) -> Figures:
    """Tables of 100,000 touches, which keep the errors of the map, and of 200,000."""
    counts = {min(sizes.long_touches, count) for count in (100_000, 200_000)}
    return sum((_table(count, min(sizes.repeats, 3)) for count in sorted(counts)), Figures())


_GOALS = {(100_000, ".csv"): 2.0, (200_000, ".csv"): 2.5, (200_000, ".parquet"): 1.5}
"""By touches and ending. [s]"""
_OF_TABLES = "the map with u, 3 µs a touch, takes a third, imports a quarter"


def _table(count: int, repeats: int) -> Figures:
    """A table of touches, CSV and Parquet."""
    with tempfile.TemporaryDirectory() as name:
        at = Waiting(Path(name), repeats)
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
            name: found.processor
            for name, found in at.median(
                {
                    name: python_file(at.folder, f"reference{number}.py", text)
                    for number, (name, text) in enumerate(references.items())
                }
            ).items()
        }
        rows = []
        for given, made, names in (
            (table, "points.csv", ("pandas", "pyarrow")),
            (parquet, "points.parquet", ("pyarrow, Parquet",)),
        ):
            words = (
                "compensate", given, "--map", at.made, "--extrapolate", "-o", at.folder / made
            )  # fmt: skip
            ours = at.median({"ours": [*PRETRAVEL, *map(str, words)]})["ours"]
            goal = _GOALS.get((count, given.suffix))
            memory = f"at most {memory_text(ours.largest)} in one process"
            note = (
                memory
                if goal is None
                else _goal(ours.processor, at.scaled(goal), _OF_TABLES, memory)
            )
            rows += [
                Row(
                    f"touches compensated, {given.suffix[1:]}, kind auto", f"{count:,}",
                    ours.processor, f"{other} reading and writing it", theirs[other],
                    note,
                )
                for other in names
            ]  # fmt: skip
        return Figures(tuple(rows))


def _processor(function: Callable[[], object], repeats: int) -> float:
    """The median time of the processor of some runs. [s]"""
    times = []
    function()
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return statistics.median(times)


def fits(sizes: Sizes) -> Figures:
    """The default fit, the evaluation of its map, and the trials of a budget."""
    with tempfile.TemporaryDirectory() as name:
        return _fits(Waiting(Path(name), sizes.repeats), sizes)


def _fits(at: Waiting, sizes: Sizes) -> Figures:
    at.median({})
    n = np.repeat(sphere_pattern_25(), 3, axis=0)
    truth = predict(load_probe("omp40-2-100mm"), n).pretravel
    distance = 15.5 - truth + np.random.default_rng(0).normal(0.0, 3e-4, len(n))
    touches = Touches(n * distance[:, None], n)
    fit = _processor(lambda: qualify(touches, 25.0, tip_diameter=6.0), sizes.repeats)
    limit = "120 batches of searches of physical take half, harmonics a quarter"
    rows = [Row("touches qualified, kind auto", "75", fit, note=_goal(fit, at.scaled(0.25), limit))]
    made = qualify(touches, 25.0, tip_diameter=6.0, kind="physical").pretravel_map
    many = fibonacci_cap(sizes.directions, math.radians(90.0))
    matrices = np.broadcast_to(np.eye(6), (len(many), 6, 6)) + 0.01
    evaluated = _processor(lambda: made.pretravel_and_uncertainty(many), sizes.repeats)
    rows.append(
        Row(
            "directions of a physical map with u", f"{len(many):,}",
            evaluated,
            "numpy.linalg.solve, 6 × 6",
            _processor(lambda: np.linalg.solve(matrices, matrices[:, :, :1]), sizes.repeats),
            _goal(
                evaluated, at.scaled(4e-6 * len(many)), "half is the product with the covariance"
            ),
        )
    )  # fmt: skip
    budget = at.ours("check-budget", _DATA / "sphere_touches.csv", *_SPHERE, "--sets", sizes.sets)
    clock = f"{seconds_text(budget.seconds)} by the clock"
    rows.append(
        Row("sets of check-budget", f"{sizes.sets}", budget.processor,
            "as many fits as above", sizes.sets * fit,
            _goal(budget.seconds, at.scaled(20.0), "the fit above", clock))
    )  # fmt: skip
    return Figures(tuple(rows))


def elements(_sizes: Sizes) -> Figures:
    """A design with finite elements against its factorisation alone."""
    from pretravel.design.fem.condensation import condense
    from pretravel.design.fem.elasticity import finite_element_model
    from pretravel.design.fem.linear_solvers import Solve, factorise
    from pretravel.design.fem.mesh import MeshSettings, mesh_probe

    probe = load_probe("omp40-2")
    factorised: list[float] = []

    def timed(matrix: csr_matrix, solver: str = "auto") -> Solve:
        start = time.process_time()
        found = factorise(matrix, solver)
        factorised.append(time.process_time() - start)
        return found

    def design() -> None:
        solids, mesh = mesh_probe(probe, MeshSettings())
        condense(finite_element_model(probe, solids, mesh))

    with patch("pretravel.design.fem.free_body.factorise", timed):
        whole = _processor(design, 1)
    alone = sum(factorised) / 2  # of two runs
    note = _goal(whole, 2.0 * alone, "PARDISO is a half, netgen's mesh a fifth, solids a twelfth")
    return Figures(
        (Row("a design with finite elements, mesh and all", "", whole, "its factorisations alone",
             alone, note),)
    )  # fmt: skip
