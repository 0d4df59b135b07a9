"""Time and memory of a command with all its processes."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

_EVERY = 0.1
"""Between two looks at the memory. [s]"""
PRETRAVEL = (sys.executable, "-m", "pretravel")


@dataclass(frozen=True)
class Spent:
    """What a command took.

    Attributes
    ----------
    seconds : float
        By the clock.
    processor : float
        Time of the processor, of the command and of the processes that it waited for. [s]
    largest, together : float
        Memory of its largest process, and of all at one time. Pages that processes share, as those
        of libraries, count for each of them. [bytes]
    """

    seconds: float
    processor: float
    largest: float
    together: float


def spent(command: Sequence[str], environment: Mapping[str, str] | None = None) -> Spent:
    """Run a command to its end.

    Raises
    ------
    RuntimeError
        It failed; with what it said.
    """
    ended = threading.Event()
    peaks = [0.0, 0.0]
    with tempfile.TemporaryFile("w+") as said:
        start = time.perf_counter()
        running = subprocess.Popen(
            command, stdout=said, stderr=said, env={**os.environ, **(environment or {})}
        )
        watch = threading.Thread(target=_watch, args=(running.pid, ended, peaks))
        watch.start()
        _, status, usage = os.wait4(running.pid, 0)
        failed = running.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.perf_counter() - start
        ended.set()
        watch.join()
        if failed:
            said.seek(0)
            raise RuntimeError(f"{' '.join(command)}: {said.read()[-2000:]}")
    return Spent(seconds, usage.ru_utime + usage.ru_stime, peaks[0], peaks[1])


def _watch(process: int, ended: threading.Event, peaks: list[float]) -> None:
    while True:
        sizes = _sizes(process)
        peaks[0] = max([peaks[0], *sizes])
        peaks[1] = max(peaks[1], sum(sizes))
        if ended.wait(_EVERY):
            return


def _sizes(process: int) -> list[float]:
    sizes = []
    try:
        first = psutil.Process(process)
        for one in (first, *first.children(recursive=True)):
            try:
                sizes.append(float(one.memory_info().rss))
            except psutil.Error:
                continue
    except psutil.Error:
        pass
    return sizes


def python_file(folder: Path, name: str, text: str) -> list[str]:
    """The command that runs a program, which is written to a file."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return [sys.executable, str(path)]
