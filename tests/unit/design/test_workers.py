"""Studies on several processes: the same file, whatever dies."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from pretravel.base.errors import PretravelError
from pretravel.design.studies.journal import journal_path
from pretravel.design.studies.run import Workers, run_study
from tests.unit.design.test_run import ALONE, study

distributed = pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.filterwarnings("ignore"),  # of dask, when its processes are killed
]


@contextmanager
def cluster(workers: int = 2) -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, dashboard_address=None
    ) as started:
        yield started


@pytest.mark.slow
def test_two_workers_give_the_same_file(tmp_path: Path) -> None:
    run_study(study(20), tmp_path / "one.nc", ALONE)
    run_study(study(20), tmp_path / "two.nc", Workers(count=2))
    assert (tmp_path / "one.nc").read_bytes() == (tmp_path / "two.nc").read_bytes()


@pytest.mark.slow
def test_a_killed_worker_loses_nothing(tmp_path: Path) -> None:
    run_study(study(1000), tmp_path / "whole.nc", ALONE)
    with cluster() as running:
        output = tmp_path / "study.nc"

        def kill_when_it_has_begun() -> None:
            while not journal_path(output).exists() or journal_path(output).stat().st_size < 2e5:
                time.sleep(0.01)
            os.kill(next(iter(running.workers.values())).pid, signal.SIGKILL)

        killer = threading.Thread(target=kill_when_it_has_begun)
        killer.start()
        run_study(study(1000), output, Workers(scheduler=running.scheduler_address))
        killer.join()
    assert output.read_bytes() == (tmp_path / "whole.nc").read_bytes()


@pytest.mark.slow
def test_a_lost_scheduler_is_said_and_another_one_finishes(tmp_path: Path) -> None:
    output = tmp_path / "study.nc"
    run_study(study(1000), tmp_path / "whole.nc", ALONE)
    with cluster() as running:

        def end_the_cluster() -> None:
            while not journal_path(output).exists() or journal_path(output).stat().st_size < 2e5:
                time.sleep(0.01)
            running.close()

        ender = threading.Thread(target=end_the_cluster)
        ender.start()
        with pytest.raises(PretravelError, match="run the command again"):
            run_study(study(1000), output, Workers(scheduler=running.scheduler_address))
        ender.join()
    assert not output.exists()
    with cluster(1) as other:
        run_study(study(1000), output, Workers(scheduler=other.scheduler_address))
    assert output.read_bytes() == (tmp_path / "whole.nc").read_bytes()


@contextmanager
def _processes(folder: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A scheduler and a worker in processes of their own: the address, and the scheduler."""
    stated = folder / "scheduler.json"
    place = ("--scheduler-file", str(stated))
    begin = (sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1")
    work = (
        sys.executable,
        "-m",
        "distributed.cli.dask_worker",
        "--no-dashboard",
        "--nthreads",
        "1",
    )
    scheduler = subprocess.Popen((*begin, "--port", "0", "--no-dashboard", *place))
    try:
        while not stated.exists() or not stated.read_text():
            assert scheduler.poll() is None
            time.sleep(0.05)
        worker = subprocess.Popen((*work, *place))
        try:
            address = json.loads(stated.read_text())["address"]
            with distributed.Client(address) as client:
                client.wait_for_workers(1, timeout=60)
            yield address, scheduler
        finally:
            worker.kill()
            worker.wait()
    finally:
        scheduler.kill()
        scheduler.wait()


@pytest.mark.slow
def test_a_killed_scheduler_is_said_and_another_one_finishes(tmp_path: Path) -> None:
    """SIGKILL: it says goodbye to nobody."""
    output = tmp_path / "study.nc"
    run_study(study(1000), tmp_path / "whole.nc", ALONE)
    with _processes(tmp_path) as (address, scheduler):

        def kill_when_it_has_begun() -> None:
            while not journal_path(output).exists() or journal_path(output).stat().st_size < 2e5:
                time.sleep(0.01)
            scheduler.kill()

        killer = threading.Thread(target=kill_when_it_has_begun)
        killer.start()
        with pytest.raises(PretravelError, match="run the command again"):
            run_study(study(1000), output, Workers(scheduler=address))
        killer.join()
    assert not output.exists()
    run_study(study(1000), output, ALONE)
    assert output.read_bytes() == (tmp_path / "whole.nc").read_bytes()


def test_a_scheduler_without_workers_is_refused(tmp_path: Path) -> None:
    with cluster(0) as empty, pytest.raises(PretravelError, match="has no workers"):
        run_study(study(), tmp_path / "study.nc", Workers(scheduler=empty.scheduler_address))
