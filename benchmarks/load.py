"""How time and memory grow with the touches. Run: python benchmarks/load.py [LARGEST].

Each job runs in a process of its own at three sizes, a factor of ten apart. Time is that of the
processor, memory what the process needs beside its imports and its data. The exponent compares the
two largest sizes: 1 is linear, 2 is a matrix of all pairs.
"""

from __future__ import annotations

import json
import math
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pretravel.compensation.compensation import apply
from pretravel.directions import fibonacci_cap
from pretravel.identification.kind_registry import KINDS, qualify
from pretravel.probe.catalogue import load_probe
from pretravel.touches import Touches
from pretravel.trigger.predict import predict, predicted_map

LARGEST = 1_000_000
REPEATS = 10


def touches_of(count: int) -> Touches:
    """A tenth as many directions as touches, in passes, each in another order; 0.3 µm of noise."""
    probe, rng = load_probe("omp40-2-100mm"), np.random.default_rng(0)
    directions = fibonacci_cap(count // REPEATS, math.radians(95.0))
    order = np.concatenate([rng.permutation(len(directions)) for _ in range(REPEATS)])
    pretravel = predict(probe, directions).pretravel
    distance = 15.5 - pretravel[order] + rng.normal(0.0, 3e-4, len(order))
    return Touches(directions[order] * distance[:, None], directions[order])


def job(name: str, count: int) -> Callable[[], object]:
    """A job on so many touches (or directions), with its data made."""
    if name == "predict":
        probe, directions = load_probe("omp40-2"), fibonacci_cap(count, math.radians(95.0))
        return lambda: predicted_map(probe, predict(probe, directions)).pretravel(directions)
    if name == "compensate":
        pretravel_map = qualify(touches_of(750), 25.0, tip_diameter=6.0, kind="harmonic")
        touches = touches_of(count)
        return lambda: apply(touches, pretravel_map.pretravel_map, extrapolate=True)
    touches = touches_of(count)
    return lambda: qualify(touches, 25.0, tip_diameter=6.0, kind=name.removeprefix("qualify "))


def _memory() -> int:
    """Largest memory of this process so far. [bytes]"""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def measured(name: str, count: int) -> dict[str, float]:
    """Time and memory of one job, in this process. [s], [bytes]"""
    job(name, 2000)()  # imports
    wanted = job(name, count)
    memory, start = _memory(), time.process_time()
    wanted()
    return {"seconds": time.process_time() - start, "memory": max(_memory() - memory, 1)}


def _apart(name: str, count: int) -> dict[str, float]:
    command = [sys.executable, str(Path(__file__)), "--one", name, str(count)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def _row(name: str, largest: int) -> None:
    sizes = [largest // 100, largest // 10, largest]
    results = [_apart(name, size) for size in sizes]
    cells = [f"{r['seconds']:8.1f} s {r['memory'] / 1e6:6.0f} MB" for r in results]
    growth = [math.log10(results[2][of] / results[1][of]) for of in ("seconds", "memory")]
    print(f"{name:20s} {'  '.join(cells)}   {growth[0]:5.2f} {growth[1]:6.2f}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(measured(sys.argv[2], int(sys.argv[3]))))
    else:
        most = int(sys.argv[1]) if len(sys.argv) > 1 else LARGEST
        heads = "".join(f"{f'{size:,}':>20s}" for size in (most // 100, most // 10, most))
        print(f"{'job':20s}{heads}   time^  memory^")
        for each in [f"qualify {kind}" for kind in (*KINDS, "auto")] + ["compensate", "predict"]:
            _row(each, most)
