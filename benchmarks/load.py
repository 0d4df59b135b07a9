"""How time and memory grow with touches, directions, designs, unknowns, features, days and faces.

Each job runs in a process of its own at three or four sizes. Time is that of the processor, memory
what the process needs beside its imports and its data. The exponent compares the two largest
sizes: 1 is linear, 2 is a matrix of all pairs.
"""

from __future__ import annotations

import ctypes
import gc
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from benchmarks.results import Figures, Growth
from benchmarks.sizes import Sizes
from benchmarks.studies import write_study
from pretravel.base.directions import fibonacci_cap
from pretravel.design.studies.definition import load_study
from pretravel.design.studies.run import Workers, run_study
from pretravel.drawing.tasks.faces.task import Faces
from pretravel.drawing.tasks.measure.task import Measure
from pretravel.files import write_map
from pretravel.maps.kinds import kinds
from pretravel.measurement.compensation import apply
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict, predicted_map
from pretravel.qualification.qualifying import qualify
from pretravel.tasks.history.task import History
from pretravel.touches import Touches
from tests.support.large_parts import plate_with_holes
from tests.support.touches_of_days import SPHERE, day_of

REPEATS = 10
_ROOT = Path(__file__).resolve().parents[1]


def touches_of(count: int) -> Touches:
    """A tenth as many directions as touches, in passes, each in another order; 0.3 µm of noise."""
    probe, rng = load_probe("omp40-2-100mm"), np.random.default_rng(0)
    directions = fibonacci_cap(count // REPEATS, math.radians(95.0))
    order = np.concatenate([rng.permutation(len(directions)) for _ in range(REPEATS)])
    pretravel = predict(probe, directions).pretravel
    distance = 15.5 - pretravel[order] + rng.normal(0.0, 3e-4, len(order))
    return Touches(directions[order] * distance[:, None], directions[order])


def job(name: str, size: float, folder: Path) -> tuple[float, Callable[[], object]]:
    """The exact size of a job, and the job with its data made."""
    if name == "condense":
        return _condensing(size)
    count = int(size)
    if name in _TASKS:
        return count, _TASKS[name](count, folder)
    if name == "study":
        study = load_study(
            str(write_study(folder / f"study{count}.toml", count, keep_directions=False))
        )
        return count, lambda: run_study(study, folder / f"study{count}.nc", Workers(1))
    if name == "predict":
        probe, directions = load_probe("omp40-2"), fibonacci_cap(count, math.radians(95.0))
        return count, lambda: predicted_map(probe, predict(probe, directions)).pretravel(directions)
    touches = touches_of(count)
    if name == "compensate":
        pretravel_map = qualify(touches_of(750), 25.0, tip_diameter=6.0, kind="harmonic")
        return count, lambda: apply(touches, pretravel_map.pretravel_map, extrapolate=True)
    kind = name.removeprefix("qualify ")
    return count, lambda: qualify(touches, 25.0, tip_diameter=6.0, kind=kind)


def _condensing(refinement: float) -> tuple[float, Callable[[], object]]:
    from pretravel.design.fem.condensation import condense
    from pretravel.design.fem.elasticity import finite_element_model
    from pretravel.design.fem.mesh import MeshSettings, mesh_probe

    probe = load_probe("omp40-2")
    solids, mesh = mesh_probe(probe, MeshSettings(refinement=refinement))
    model = finite_element_model(probe, solids, mesh)
    return mesh.unknowns, lambda: condense(model)


def _bores(count: int, folder: Path) -> Callable[[], object]:
    """Bores of 12 touches in a row, with 0.3 µm of noise, measured as groups."""
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    outward = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(12)])
    rng, rows = np.random.default_rng(0), ["label,x_mm,y_mm,z_mm,nx,ny,nz,u_um"]
    for bore in range(count):
        points = 10.0 * outward + [30.0 * bore, 0.0, 0.0] + rng.normal(0.0, 3e-4, (12, 3))
        rows += [
            f"bore{bore}-{i + 1},{','.join(f'{value:.9f}' for value in (*point, *-normal))},0.4"
            for i, (point, normal) in enumerate(zip(points, outward, strict=True))
        ]
    table = folder / f"bores{count}.csv"
    table.write_text("\n".join(rows), encoding="utf-8")
    return lambda: Measure(points=table, feature="bore", by_prefix=True).run().document()


def _days(count: int, folder: Path) -> Callable[[], object]:
    """A file of 75 touches for each day."""
    files = folder / f"days{count}"
    files.mkdir()
    for day in range(count):
        date = datetime(2024, 1, 1) + timedelta(days=day)
        day_of(files, day).rename(files / f"{date:%Y-%m-%d}.csv")
    made = folder / f"map{count}.json"
    write_map(made, qualify(SPHERE, 24.9987, tip_diameter=6.0).pretravel_map)
    return lambda: History(places=(files,), map_file=made, diameter=24.9987).run().document()


def _plate(count: int, folder: Path) -> Callable[[], object]:
    """The faces of a plate with holes, of a file that was not read before."""
    across = round(math.sqrt(count - 6))
    part = plate_with_holes(folder / f"plate{count}.step", across, (count - 6) // across)
    os.environ["XDG_CACHE_HOME"] = str(folder)
    return lambda: Faces(step=part).run().document()


_TASKS: Mapping[str, Callable[[int, Path], Callable[[], object]]] = {
    "measure": _bores,
    "history": _days,
    "faces": _plate,
}

_FIRST = {"condense": 0.3, "study": 2, "predict": 2000, "measure": 2, "history": 3, "faces": 10}
"""Sizes that load the modules."""


def _begin_memory() -> float:
    """Memory from which a peak counts from now on. [bytes]

    What the data left free is given back, else the job would use it unseen. The largest memory of
    `getrusage` contains that of the process that started this one.
    """
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None
    if trim is not None:
        trim(0)
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return _peak()
    return _peak()


def _peak() -> float:
    """Largest memory of this process. [bytes]"""
    status = Path("/proc/self/status")
    if status.is_file():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return 1024.0 * float(line.split()[1])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak if sys.platform == "darwin" else 1024 * peak)


def measured(name: str, size: float) -> dict[str, float]:
    """Exact size, time and memory of one job, in this process. [s], [bytes]"""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as first:
        job(name, _FIRST.get(name, 2000), Path(first))[1]()
        exact, wanted = job(name, size, Path(folder))
        memory, start = _begin_memory(), _processor()
        wanted()
        seconds = _processor() - start
        return {"size": exact, "seconds": seconds, "memory": max(_peak() - memory, 1.0)}


def _processor() -> float:
    """Time of the processor, with processes that have ended: the CAD kernel has its own. [s]"""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + ended.ru_utime + ended.ru_stime


def _apart(name: str, size: float) -> dict[str, float]:
    command = [sys.executable, "-m", "benchmarks.load", name, str(size)]
    # With two threads the processor's time would contain their waiting for each other.
    single = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=_ROOT, env={**os.environ, **single}
    )
    if done.returncode:
        raise RuntimeError(f"{name} of size {size}: {done.stderr[-2000:]}")
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def _growth(name: str, over: str, sizes: Sequence[float], what: str = "") -> Growth:
    found = [_apart(name, size) for size in sizes]
    size, seconds, memory = (
        tuple(one[key] for one in found) for key in ("size", "seconds", "memory")
    )
    return Growth(what or f"`{name}`", over, size, seconds, memory)


def _three(largest: int) -> tuple[int, int, int]:
    return largest // 100, largest // 10, largest


def over_touches(sizes: Sizes) -> Figures:
    names = [f"qualify {kind}" for kind in (sizes.kinds or (*kinds(), "auto"))] + ["compensate"]
    return Figures(
        growths=tuple(_growth(name, "touches", _three(sizes.growing_touches)) for name in names)
    )


def _over(
    name: str, over: str, wanted: Callable[[Sizes], Sequence[float]], what: str = ""
) -> Callable[[Sizes], Figures]:
    return lambda sizes: Figures(growths=(_growth(name, over, wanted(sizes), what),))


over_directions = _over("predict", "directions", lambda sizes: _three(sizes.growing_directions))
over_designs = _over(
    "study", "designs", lambda sizes: _three(sizes.growing_designs),
    "`study`, one worker, directions not kept",
)  # fmt: skip
over_unknowns = _over(
    "condense", "unknowns", lambda sizes: sizes.refinements,
    "condensing a finite-element model (one sixth)",
)  # fmt: skip
over_features = _over(
    "measure", "features", lambda sizes: _three(sizes.growing_features),
    "`measure`, bores of 12 touches",
)  # fmt: skip
over_days = _over(
    "history", "days", lambda sizes: _three(sizes.growing_days), "`history`, 75 touches a day"
)
over_faces = _over(
    "faces", "faces", lambda sizes: sizes.growing_faces, "`faces`, a plate with holes, first time"
)


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], float(sys.argv[2]))))
