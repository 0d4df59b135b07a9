"""Studies: one worker against two, what scheduling takes, and designs with finite elements."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import h5netcdf
import numpy as np

from benchmarks.commands import PRETRAVEL, Spent, spent
from benchmarks.results import Figures, Growth, Row, memory_text, seconds_text
from benchmarks.sizes import Sizes
from pretravel.design.studies.definition import load_study
from pretravel.design.studies.plan import Plan
from pretravel.design.studies.run import blocks_of
from pretravel.design.studies.workers import Block, compute_block, dask_workers, in_this_process

DIRECTIONS = 324
_FACTORS = {
    "spring.preload_N": (4.0, 8.0),
    "seats.support_angle_deg": (25.0, 35.0),
    "stylus.2.length_mm": (38.0, 88.0),
    "stylus.2.diameter_mm": (3.5, 5.0),
}
_GEOMETRY = ("stylus.2.length_mm", "stylus.2.diameter_mm")
"""Each design with another of these needs a mesh of its own."""
_WHAT = f"designs × {DIRECTIONS} directions, analytic"
_SCHEDULED = 250
"""Designs of a block: some tenths of a second."""


def write_study(
    path: Path, designs: int, *, model: str = "analytic", keep_directions: bool = True,
    factors: tuple[str, ...] = tuple(_FACTORS),
) -> Path:  # fmt: skip
    """A Latin hypercube over 36 x 9 directions."""
    lines = [
        "[study]", 'name = "benchmark"', 'probe = "omp40-2"', 'plan = "latin-hypercube"',
        f"samples = {designs}", f"keep_directions = {str(keep_directions).lower()}",
        "[directions]", 'azimuth_deg = "0:350:10"', 'polar_deg = "10:90:10"',
        "[prediction]", f'model = "{model}"',
    ]  # fmt: skip
    for key in factors:
        low, high = _FACTORS[key]
        lines += ["[[factor]]", f'key = "{key}"', f"range = [{low}, {high}]"]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _run(study: Path, output: Path, workers: int, cache: Path) -> Spent:
    command = [*PRETRAVEL, "study", str(study), "-o", str(output), "--workers", str(workers)]
    return spent(command, {"PRETRAVEL_CACHE": str(cache)})


def compare_results(one: Path, other: Path) -> None:
    """Whether two studies have the same numbers, to the last bit, and no failures."""
    with h5netcdf.File(one, "r") as a, h5netcdf.File(other, "r") as b:
        assert set(a.variables) == set(b.variables)
        for name in a.variables:
            same = np.asarray(a.variables[name][...]), np.asarray(b.variables[name][...])
            if name == "reason":
                assert not any(same[0]), f"a design failed: {same[0]}"
            assert np.array_equal(*same), name


@dataclass(frozen=True)
class Scheduled:
    """What workers did with the designs of a study.

    Attributes
    ----------
    seconds : float
        From the first block to the last, after the workers had loaded their modules; the shortest
        of the runs. [s]
    ready : float
        Until they had. [s]
    idle : float
        1 - (sum of the computing times of the blocks) / (workers x seconds) of one more run, from
        Dask's record of tasks, which takes time itself. It contains the sending of designs and
        results, the waiting for the scheduler, and the end, when only the last block runs.
    outcomes : list of Block
    """

    seconds: float
    ready: float
    idle: float
    outcomes: list[Block]


def scheduled(
    plan: Plan, blocks: Sequence[Sequence[int]], workers: int, repeats: int = 1
) -> Scheduled:
    """Let workers compute blocks of designs."""
    import distributed

    def run() -> float:
        start = time.perf_counter()
        outcomes[:] = compute(plan, blocks)
        return time.perf_counter() - start

    start, outcomes = time.perf_counter(), list[Block]()
    with dask_workers(None, workers) as compute:
        client = distributed.default_client()
        client.run(compute_block, plan, [0])
        ready = time.perf_counter() - start
        seconds = min(run() for _ in range(repeats))
        with distributed.get_task_stream(client) as tasks:
            recorded = run()
    computing = [
        part["stop"] - part["start"]
        for task in tasks.data
        for part in task["startstops"]
        if part["action"] == "compute"
    ]
    assert len(computing) >= len(blocks), "Dask's record of tasks is not whole"
    return Scheduled(seconds, ready, 1.0 - sum(computing) / (workers * recorded), outcomes)


def compare_blocks(one: Iterable[Block], other: Iterable[Block]) -> None:
    """Whether two computations give the same numbers, to the last bit."""
    first, second = (
        {number: content for block in blocks for number, content in block}
        for blocks in (one, other)
    )
    assert first == second


def _block(designs: int, workers: int) -> int:
    return max(1, min(_SCHEDULED, designs // (2 * workers)))


def _computing_row(study: Path, count: int, repeats: int) -> Row:
    """The designs alone, without start and report: the shortest times of some runs.

    A computer that others share is a fifth quicker or slower from minute to minute.
    """
    plan = Plan(load_study(str(study)))
    blocks = list(blocks_of(plan, range(count), _block(count, 2)))
    times, alone = [], list[Block]()
    for _ in range(repeats):
        start = time.perf_counter()
        alone[:] = in_this_process(plan, blocks)
        times.append(time.perf_counter() - start)
    one, found = min(times), scheduled(plan, blocks, 2, repeats)
    compare_blocks(found.outcomes, alone)
    return Row(
        f"{_WHAT}, two workers that have started", f"{count:,}", found.seconds,
        "one process", one,
        f"workers compute nothing in {100.0 * found.idle:.1f} % of this time (scheduling, sending, "
        f"the last block); their start takes {seconds_text(found.ready)}",
    )  # fmt: skip


def studies(sizes: Sizes) -> Figures:
    count = sizes.designs
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study = write_study(folder / "study.toml", count)
        one, two = folder / "one.nc", folder / "two.nc"
        alone = _run(study, one, 1, folder)
        both = _run(study, two, 2, folder)
        compare_results(one, two)
        computing = _computing_row(study, count, min(sizes.repeats, 3))
    row = Row(
        f"{_WHAT}, two workers, command and all", f"{count:,}",
        both.seconds, "one worker", alone.seconds,
        f"at most {memory_text(both.largest)} in one process, {memory_text(both.together)} in all; "
        f"one worker {memory_text(alone.together)}",
    )  # fmt: skip
    growth = Growth(
        f"study of {count:,} designs × {DIRECTIONS} directions", "workers", (1.0, 2.0),
        (alone.seconds, both.seconds), note="by the clock",
    )  # fmt: skip
    return Figures((row, computing), (growth,))


def element_studies(sizes: Sizes) -> Figures:
    """Designs that all need a mesh of their own, against as many cold commands `predict`."""
    count = sizes.element_designs
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study = write_study(folder / "study.toml", count, model="fem", factors=_GEOMETRY)
        ours = _run(study, folder / "study.nc", 2, folder / "cache")
        compare_results(folder / "study.nc", folder / "study.nc")
        command = [*PRETRAVEL, "predict", "omp40-2", "--model", "fem", "--azimuth", "0:350:10"]
        cold = spent(
            [*command, "--polar", "10:90:10"], {"PRETRAVEL_CACHE": str(folder / "another")}
        )
    return Figures(
        (
            Row(
                "designs with meshes of their own, fem, two workers", f"{count:,}", ours.seconds,
                f"{count} commands predict, one after the other", count * cold.seconds,
                f"{seconds_text(ours.seconds / count)} for each design; at most "
                f"{memory_text(ours.largest)} in one process, {memory_text(ours.together)} in all",
            ),
        )
    )  # fmt: skip
