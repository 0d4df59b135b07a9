"""Where the designs of a study are computed: in this process, or by the workers of Dask.

Dask's scheduler gives the blocks to its workers, and a block of a worker that dies to another one.
"""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeAlias

from threadpoolctl import threadpool_limits

from pretravel.base import PretravelError, installed_version, needed
from pretravel.design.studies.outputs import outcome_of
from pretravel.design.studies.packed_outcome import packed
from pretravel.design.studies.plan import Plan

Block: TypeAlias = list[tuple[int, bytes]]
"""Numbers of designs, and what came of them: `packed`."""
_AHEAD = 3
"""Blocks that wait at each worker: few, so that the memory does not grow with the study."""

_SETTINGS = {
    "distributed.comm.timeouts.connect": "5s",
    # What Dask measures for its dashboard, which is off, takes some percent of each worker's time.
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    # Memory is given back by the block, not by the array: that costs page faults for each array.
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 64 * 2**20,
}


def compute_block(plan: Plan, numbers: Sequence[int]) -> Block:
    """Compute designs.

    One thread computes, so that the last digits do not depend on the number of cores.

    Parameters
    ----------
    plan : Plan
    numbers : sequence of int
        Of its designs.

    Returns
    -------
    list of number and bytes
        See `packed`.
    """
    with threadpool_limits(1):
        return [(number, packed(outcome_of(plan.study, plan.levels(number)))) for number in numbers]


def in_this_process(plan: Plan, blocks: Sequence[Sequence[int]]) -> Iterator[Block]:
    """Compute blocks one after the other."""
    for numbers in blocks:
        yield compute_block(plan, numbers)


@contextlib.contextmanager
def dask_workers(
    scheduler: str | None, count: int | None
) -> Iterator[Callable[[Plan, Sequence[Sequence[int]]], Iterator[Block]]]:
    """Workers of a running scheduler, or of one that is started here and ends with the block.

    Parameters
    ----------
    scheduler : str or None
        Address, as ``tcp://host:8786``. None: a cluster of this computer.
    count : int or None
        Workers of that cluster. None: one for each core.

    Yields
    ------
    callable
        From plan and blocks to the computed blocks, in the order in which they come.

    Raises
    ------
    PretravelError
        Dask is not installed; no scheduler at that address; workers with another version of
        pretravel.
    """
    needed("distributed", "scale", inputs=("workers", "scheduler"))
    import dask
    import distributed

    library: Any = distributed  # without types
    for name in ("distributed", "tornado", "asyncio"):
        logging.getLogger(name).setLevel(logging.ERROR)
    dask.config.set(_SETTINGS)
    with contextlib.ExitStack() as stack:
        if scheduler is None:
            cluster = stack.enter_context(
                library.LocalCluster(
                    n_workers=count or os.cpu_count() or 1,
                    threads_per_worker=1,
                    dashboard_address=None,
                )
            )
            # Results come from the workers, not through the scheduler as well.
            client = stack.enter_context(library.Client(cluster, direct_to_workers=True))
        else:
            try:
                client = stack.enter_context(library.Client(scheduler))
            except (OSError, ValueError, TimeoutError) as error:
                raise PretravelError(
                    f"no scheduler answers at {scheduler} ({error}); 'dask scheduler' starts one "
                    "and gives its address",
                    inputs=("scheduler",),
                ) from None
            _check_versions(client, scheduler)
        yield lambda plan, blocks: _as_they_come(client, library.as_completed, plan, blocks)


def _version() -> str:
    return installed_version()


def _check_versions(client: Any, scheduler: str) -> None:
    try:
        versions = client.run(_version)
    except Exception as error:  # whatever a worker without the package raises
        raise PretravelError(
            f"the workers of {scheduler} cannot load pretravel ({error}); install the same version "
            "there",
            inputs=("scheduler",),
        ) from None
    if not versions:
        raise PretravelError(
            f"the scheduler at {scheduler} has no workers; 'dask worker {scheduler}' starts one",
            inputs=("scheduler",),
        )
    others = {found for found in versions.values() if found != installed_version()}
    if others:
        raise PretravelError(
            f"workers of {scheduler} have pretravel {', '.join(sorted(others))}, this computer "
            f"{installed_version()}; results of two versions are not mixed",
            inputs=("scheduler",),
        )


def _as_they_come(
    client: Any, as_completed: Any, plan: Plan, blocks: Sequence[Sequence[int]]
) -> Iterator[Block]:
    # Without a name of its content: the workers may still give back that of an earlier computation.
    shared = client.scatter(plan, broadcast=True, hash=False)
    waiting = iter(blocks)

    def submit() -> Any:
        numbers = next(waiting, None)
        if numbers is None:
            return None
        return client.submit(compute_block, shared, numbers, pure=False, retries=2)

    ahead = _AHEAD * max(len(client.scheduler_info()["workers"]), 1)
    first = [task for task in (submit() for _ in range(ahead)) if task is not None]
    running = as_completed(first)
    for task in running:
        try:
            yield task.result()
        except Exception as error:
            raise PretravelError(
                f"a block of designs was lost ({type(error).__name__}: {error}); what was computed "
                "before is kept: run the command again"
            ) from error
        following = submit()
        if following is not None:
            running.add(following)
