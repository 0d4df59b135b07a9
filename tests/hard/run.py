"""Try readers with mutated files: ``python -m tests.hard.run --inputs 100000 csv grbl``.

Each reader runs in a process of its own, with a limit of memory, and is watched: a process that
hangs or crashes is an entry in the list of faults and begins again after that file. A file is made
from its reader, the seed and its number alone, so that a fault can be repeated.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from tests.hard.binary_readers import BINARY_READERS
from tests.hard.text_readers import TEXT_READERS
from tests.support.mutated_files import LONGEST, PATIENCE, Reader, fault_of, mutated

READERS = {reader.name: reader for reader in (*TEXT_READERS, *BINARY_READERS)}
MEMORY = 2**30
"""Memory that a reader may take in addition. [bytes]"""
_GRACE = 10.0
"""A reader that does not even react to the alarm is ended after this. [s]"""
_KEPT = 3
"""Files that are kept of each fault."""


@dataclass
class Trial:
    """What a reader did with mutated files.

    Attributes
    ----------
    slowest : float
        [s]
    memory : float
        Peak beyond that at the start. [MB]
    faults : mapping of str to int
        Number of files with each fault.
    examples : mapping of str to list of int
        Numbers of some of these files.
    """

    reader: str
    inputs: int = 0
    refused_or_read: int = 0
    slowest: float = 0.0
    memory: float = 0.0
    seconds: float = 0.0
    faults: Counter[str] = field(default_factory=Counter)
    examples: dict[str, list[int]] = field(default_factory=dict)

    def add(self, fault: str, number: int) -> None:
        """Count a fault; its first line names it."""
        name = fault.partition("\n")[0]
        self.faults[name] += 1
        if self.faults[name] <= _KEPT:
            self.examples.setdefault(name, []).append(number)


def try_reader(reader: Reader, seed: str, inputs: int) -> Trial:
    """Try a reader with mutated files, in processes that are watched."""
    trial = Trial(reader.name)
    began = time.perf_counter()
    first = 0
    context = multiprocessing.get_context("fork")
    while first < inputs:
        ours, theirs = context.Pipe(duplex=False)
        process = context.Process(target=_work, args=(reader, seed, range(first, inputs), theirs))
        process.start()
        theirs.close()
        first = _watch(process, ours, trial, first)
    trial.inputs = inputs
    trial.refused_or_read = inputs - sum(trial.faults.values())
    trial.seconds = time.perf_counter() - began
    return trial


def _work(reader: Reader, seed: str, numbers: range, out: Connection) -> None:
    """In a process of its own: send the number of each file before it is read, and faults."""
    _limit_memory()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    slowest = 0.0
    for number in numbers:
        content = mutated(reader, f"{seed} {number}")
        out.send(("begins", number))
        began = time.perf_counter()
        fault = fault_of(reader, content)
        slowest = max(slowest, time.perf_counter() - began)
        if fault is not None:
            out.send(("fault", fault))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    out.send(("ends", (slowest, (peak - before) / 1024.0)))


def _limit_memory() -> None:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _watch(process: Any, messages: Connection, trial: Trial, first: int) -> int:
    """Follow a process to its end; return the number of the file to go on with."""
    number = first
    while True:
        try:
            heard = messages.poll(PATIENCE * LONGEST + _GRACE)
            kind, value = messages.recv() if heard else ("hangs", None)
        except EOFError:
            kind, value = "crashes", None
        if kind == "begins":
            number = value
        elif kind == "fault":
            trial.add(value, number)
        else:
            break
    if kind == "ends":
        trial.slowest = max(trial.slowest, value[0])
        trial.memory = max(trial.memory, value[1])
        number = 1 << 62
    else:
        process.kill()
        trial.add(f"the process {kind}", number)
    process.join()
    messages.close()
    return number + 1


def report(trials: Sequence[Trial], seed: str) -> str:
    """A table of the trials, and the faults."""
    lines = [
        "| reader | files | faults | slowest [s] | memory [MB] |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| {t.reader} | {t.inputs} | {sum(t.faults.values())} | {t.slowest:.2f} | {t.memory:.0f} |"
        for t in trials
    ]  # fmt: skip
    for trial in trials:
        for name, count in trial.faults.most_common():
            numbers = ", ".join(map(str, trial.examples[name]))
            lines.append(f"{trial.reader}: {count} times {name} (seed {seed}, files {numbers})")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="*", help=f"all, or some of {', '.join(READERS)}")
    parser.add_argument("--inputs", type=int, default=100_000, help="mutated files for each reader")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--show", type=int, help="write this one file to standard output instead")
    parser.add_argument("--json", type=Path, help="keep the results here too")
    stated = parser.parse_args()
    unknown = set(stated.readers) - set(READERS)
    if unknown:
        parser.error(f"there is no reader {', '.join(sorted(unknown))}")
    chosen = [READERS[name] for name in stated.readers or READERS]
    if stated.show is not None:
        content = mutated(chosen[0], f"{stated.seed} {stated.show}")
        print(fault_of(chosen[0], content), content, sep="\n")
        return 0
    trials = []
    with ThreadPoolExecutor(stated.processes) as pool:
        for trial in pool.map(lambda r: try_reader(r, stated.seed, stated.inputs), chosen):
            trials.append(trial)
            print(report([trial], stated.seed), flush=True)
    print(report(trials, stated.seed))
    if stated.json:
        stated.json.write_text(json.dumps([asdict(t) for t in trials], indent=1), encoding="utf-8")
    return int(any(t.faults for t in trials))


if __name__ == "__main__":
    raise SystemExit(main())
