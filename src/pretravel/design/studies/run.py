"""Run a study: what is missing is computed, what is done is kept, the results become one file."""

from __future__ import annotations

import hashlib
import json
import logging
import math
import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pretravel.base import FloatArray, PretravelError, installed_version, needed
from pretravel.design.fem.mesh import MeshSettings
from pretravel.design.fem.reduction_cache import reduction_key
from pretravel.design.studies.conditions import case_of
from pretravel.design.studies.definition import Level, Study
from pretravel.design.studies.idle import refuse_idle
from pretravel.design.studies.journal import Journal, journal_path
from pretravel.design.studies.outputs import computed
from pretravel.design.studies.plan import Plan
from pretravel.design.studies.results import StudyResults, collected
from pretravel.design.studies.results_file import write_results
from pretravel.design.studies.workers import Block, compute_block, dask_workers, in_this_process

log = logging.getLogger(__name__)

_SHORT = 20.0
"""Work that one process does in this time needs no cluster. [s]"""
_BLOCK = 1.0
"""Work of a block: a scheduler needs some milliseconds for each. [s]"""
_REASONS = 3
"""Reasons that a message states."""
_TIMED = 2
"""Designs that are computed here first; the time of the last one is without what loads once."""
_LONGEST_BLOCK = 500
"""Designs of a block at most, so that what is lost with a worker is small."""


@dataclass(frozen=True)
class Workers:
    """Who computes.

    Attributes
    ----------
    count : int or None
        None: this process for short work, else one worker for each core.
    scheduler : str or None
        Address of a running one.
    """

    count: int | None = None
    scheduler: str | None = None


def digest_of(study: Study) -> str:
    """Digest of all that the numbers of a study depend on."""
    content = {
        "version": installed_version(),
        "base": study.base,
        "factors": [
            [f.key, list(f.values) if f.values is not None else None, f.range, f.levels]
            for f in study.factors
        ],
        "plan": [study.plan, study.samples, study.seed, study.keep_directions],
        "directions": [list(study.directions.azimuth), list(study.directions.polar)],
        "outputs": study.outputs,
        "conditions": [study.prediction, study.touch, study.calibration],
        "files": [hashlib.sha256(path.read_bytes()).hexdigest() for path in _files_of(study)],
    }
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _files_of(study: Study) -> Iterator[Path]:
    """Files whose content decides results: the solids of a description, targets, a part."""
    geometry = study.base.get("geometry")
    if isinstance(geometry, dict) and isinstance(geometry.get("step"), str):
        yield from _existing(study.folder / geometry["step"])
    touch = [study.touch.get("targets"), study.touch.get("surface")]
    touch += [value for f in study.factors if f.key in _OF_FILES for value in f.single_values]
    for name in touch:
        if name:
            yield from _existing(study.touch_folder / str(name).partition("#")[0])


_OF_FILES = ("touch.surface", "touch.targets")


def _existing(path: Path) -> Iterator[Path]:
    if path.is_file():
        yield path


def run_study(
    study: Study, output: Path, workers: Workers | None = None, *, restart: bool = False
) -> StudyResults:
    """Compute the designs of a study, and write its results.

    What an earlier run of the same study computed is not computed again.

    Parameters
    ----------
    study : Study
    output : Path
        NetCDF. The journal lies next to it until the study is complete.
    workers : Workers, optional
    restart : bool
        Whether what an earlier run left in the journal is removed.

    Raises
    ------
    PretravelError
        No design can be computed; another process runs a study with this output; another study's
        journal; a full disk; lost workers.
    """
    needed("h5netcdf", "scale")  # before hours of computation
    workers = workers or Workers()
    path, plan = journal_path(output), Plan(study)
    refuse_idle(study, _all_numbers, "the results are")
    with Journal(path, digest_of(study), anew=restart) as journal:
        done = journal.done()
        missing = [number for number in range(len(plan)) if number not in done]
        if done and missing:
            log.info("%d of %d designs are done already", len(done), len(plan))
        if missing:
            _compute(plan, missing, workers, journal)
        results = collected(study, plan, journal.outcomes())
        if results.succeeded.any():
            log.info("writing %s", output.name)
            write_results(output, results, study, journal.outcomes())
        journal.remove()
    if not results.succeeded.any():
        raise PretravelError(_why_none(results))
    return results


def _all_numbers(study: Study, levels: Mapping[str, Level]) -> FloatArray:
    """Everything that the results contain of a design."""
    found = computed(study, case_of(study, levels))
    kept = (found.force, found.sensing_distance, found.pretravel)
    return np.concatenate(
        [list(found.numbers.values()), *(each.ravel() for each in kept if each is not None)]
    )


def _why_none(results: StudyResults) -> str:
    """The commonest reasons why no design can be computed."""
    common = Counter(results.reasons).most_common(_REASONS)
    reasons = "; ".join(f"{reason} ({count})" for reason, count in common)
    more = "; …" if len(set(results.reasons)) > _REASONS else ""
    return (
        f"none of the {len(results)} designs of this study can be computed: {reasons}{more}. "
        "Correct the study; nothing was written"
    )


def _compute(plan: Plan, missing: list[int], workers: Workers, journal: Journal) -> None:
    progress = _Progress(len(plan), len(plan) - len(missing))
    each = 0.0
    for number in missing[:_TIMED]:
        began = time.perf_counter()
        journal.add(compute_block(plan, [number]))
        each = time.perf_counter() - began
        progress.add(1)
    rest = missing[_TIMED:]
    if not rest:
        return
    size = max(1, min(_LONGEST_BLOCK, math.ceil(_BLOCK / max(each, 1e-6))))
    blocks = list(blocks_of(plan, rest, size))
    for block in _computed(plan, blocks, workers, each * len(rest)):
        journal.add(block)
        progress.add(len(block))


def _computed(
    plan: Plan, blocks: Sequence[Sequence[int]], workers: Workers, seconds: float
) -> Iterator[Block]:
    """The blocks as they come, from this process or from others."""
    alone = workers.scheduler is None and (
        workers.count == 1 or (workers.count is None and (seconds < _SHORT or _cores() == 1))
    )
    if alone:
        yield from in_this_process(plan, blocks)
        return
    with dask_workers(workers.scheduler, workers.count) as compute:
        yield from compute(plan, blocks)


def _cores() -> int:
    return os.cpu_count() or 1


def blocks_of(plan: Plan, numbers: Sequence[int], size: int) -> Iterator[list[int]]:
    """Blocks of designs; those with the same finite-element model follow each other.

    Parameters
    ----------
    plan : Plan
    numbers : sequence of int
    size : int
        Designs of a block.

    Yields
    ------
    list of int
    """
    groups: dict[str, list[int]] = {}
    for number in numbers:
        groups.setdefault(_model_key(plan, number), []).append(number)
    whole: list[int] = []
    for key, group in groups.items():
        if key:  # two workers would make the same model twice
            yield from _parts(group, _LONGEST_BLOCK)
        else:
            whole += group
    yield from _parts(whole, size)


def _model_key(plan: Plan, number: int) -> str:
    """The finite-element model of a design; empty without one."""
    if not _may_use_models(plan.study):
        return ""
    try:
        case = case_of(plan.study, plan.levels(number))
        if case.prediction.model != "fem":
            return ""
        return reduction_key(case.probe, MeshSettings())
    except (PretravelError, OSError):
        return ""  # its reason is found when it is computed


def _may_use_models(study: Study) -> bool:
    keys = {factor.key for factor in study.factors}
    return study.prediction.get("model") == "fem" or "prediction.model" in keys


def _parts(numbers: Sequence[int], size: int) -> Iterator[list[int]]:
    for start in range(0, len(numbers), size):
        yield list(numbers[start : start + size])


class _Progress:
    """Tells how many designs are done, and how fast."""

    def __init__(self, total: int, done: int) -> None:
        self._total, self._done, self._new = total, done, 0
        self._began = time.monotonic()

    def add(self, count: int) -> None:
        self._done += count
        self._new += count
        seconds = max(time.monotonic() - self._began, 1e-9)
        log.info(
            "%d of %d designs, %.3g a second", self._done, self._total, self._new / seconds,
            extra={"done": self._done / self._total},
        )  # fmt: skip
