"""Comparison of the condensed model with CalculiX, which has its own contact and solver.

    python benchmarks/calculix/run.py            # three directions, about half an hour
    python benchmarks/calculix/run.py --coarse   # a smaller mesh, some minutes
    python benchmarks/calculix/run.py --directions 1

Both use the same bodies. If CalculiX (package calculix-ccx of Debian) is missing, the script
installs it with apt-get, provided that it runs as root. It compares the seat reactions and the
tip deflection from rest to 98 % of the trigger force. (At the trigger itself a seat is about to
open, and contact solvers do not converge there.) Then it compares the processor time of a
36 x 9 map for two uses of CalculiX: two solves for each direction, which is the fair comparison
(the solve at rest is shared, so one and a half here), and a golden-section search for the trigger.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from pretravel.base.directions import from_angles
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.fem.condensation import condense
from pretravel.design.fem.mesh import MeshSettings
from pretravel.design.fem.seat_ball import ball_correction
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.compliance.base import TIP_ON_PART
from pretravel.prediction.loading import loaded_to_trigger
from pretravel.prediction.materials import material
from pretravel.prediction.seats import seat_frame, seat_statics

# Run as a file: of the project, not of an installation.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).parent))
from deck import write_deck

from tests.support.full_contact import resolved_bodies

DIRECTIONS = ((90.0, 0.0), (90.0, 60.0), (50.0, 20.0))  # polar, azimuth, degrees
LOAD = 0.98
MAP = 36 * 9
# Trials of a golden-section search that reduces a few newtons to 1e-3 N: ln(3e-4) / ln(0.618).
GOLDEN = 17


def install() -> str:
    found = shutil.which("ccx")
    if found is None and hasattr(os, "geteuid") and os.geteuid() == 0:
        subprocess.run(["apt-get", "update", "-qq"], check=True)
        subprocess.run(["apt-get", "install", "-y", "-qq", "calculix-ccx"], check=True)
        found = shutil.which("ccx")
    if found is None:
        sys.exit("ccx is not installed: apt-get install calculix-ccx")
    return found


def processor_seconds(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def map_seconds() -> float:
    """Processor time of the command that makes our map, with an empty cache and one thread."""
    command = [
        sys.executable, "-m", "pretravel", "predict", "omp40-2", "--model", "fem",
        "--azimuth", "0:350:10", "--polar", "10:90:10",
    ]  # fmt: skip
    before = processor_seconds(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "PRETRAVEL_CACHE": folder, "OMP_NUM_THREADS": "1"}
        subprocess.run(command, env=environment, capture_output=True, check=True)
    return processor_seconds(resource.RUSAGE_CHILDREN) - before


def read(path: Path, nodes: np.ndarray, weights: np.ndarray, normals: np.ndarray):
    """Tip displacement and six seat reactions of each step, from its last increment."""
    steps: dict[float, dict[str, np.ndarray]] = {}
    lines = iter(path.read_text().splitlines())
    for line in lines:
        if "time" not in line:
            continue
        moment = float(line.split()[-1])
        entry = steps.setdefault(round(moment, 6), {"tip": np.zeros(3), "seats": np.zeros(6)})
        next(lines)
        if "displacements" in line:
            found = {}
            for row in lines:
                parts = row.split()
                if len(parts) != 4:
                    break
                found[int(parts[0])] = [float(v) for v in parts[1:]]
            values = np.array([found[int(node) + 1] for node in nodes])
            entry["tip"] = weights @ values
        elif "total force" in line:
            seat = int(line.split("HELD")[1][0])
            force = np.array([float(v) for v in next(lines).split()])
            entry["seats"][seat] = force @ normals[seat]
    ends = [max(t for t in steps if t <= limit + 1e-9) for limit in (1.0, 2.0)]
    return [(steps[t]["tip"], steps[t]["seats"]) for t in ends]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--coarse", action="store_true", help="use a smaller mesh (some minutes)")
    parser.add_argument("--directions", type=int, default=3, help="how many of the three to solve")
    parser.add_argument("--keep", type=Path, help="keep the input files and results in this folder")
    parser.add_argument("--json", type=Path, help="write the times to this file")
    options = parser.parse_args()
    ccx = install()
    probe = load_probe("omp40-2")
    statics = seat_statics(probe)
    settings = MeshSettings(refinement=0.45, interface=0.06)
    model, ball = resolved_bodies(probe, 0.052, 0.013 if options.coarse else 0.0085, settings)
    unknowns = model.mesh.unknowns + 6 * ball.unknowns
    print(f"{unknowns} unknowns, of which {6 * ball.unknowns} in the balls", flush=True)
    reduced = condense(model)
    reduced = replace(reduced, ball_correction=ball_correction(probe))
    normals = seat_frame(probe).normals
    weights = model.loads[0::3, 6]
    tip = np.flatnonzero(weights)
    folder = options.keep or Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    per_solve, apart = [], []
    for polar, azimuth in DIRECTIONS[: options.directions]:
        direction = from_angles(math.radians(polar), math.radians(azimuth))
        steel = material("steel")
        at_trigger, _ = loaded_to_trigger(probe, statics, direction, steel)
        loading = replace(at_trigger, force=LOAD * at_trigger.force)
        force = loading.force
        job = folder / f"probe_{polar:.0f}_{azimuth:.0f}"
        write_deck(job.with_suffix(".inp"), probe, model, ball, force[0] * direction[0])
        before, start = processor_seconds(resource.RUSAGE_CHILDREN), time.perf_counter()
        result = subprocess.run(
            [ccx, job.name],
            cwd=folder,
            capture_output=True,
            text=True,
            # One thread: two wait busily for each other, which would count as processor time.
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            check=False,
        )
        spent = processor_seconds(resource.RUSAGE_CHILDREN) - before
        job.with_suffix(".log").write_text(result.stdout + result.stderr)
        if result.returncode != 0 or "*ERROR" in result.stdout:
            sys.exit(f"CalculiX failed; see {job.with_suffix('.log')}")
        (rest_tip, rest), (tip_there, there) = read(
            job.with_suffix(".dat"), tip, weights[tip], normals
        )
        per_solve.append(0.5 * spent)
        parts = FiniteElements(reduced).displacements(loading)
        ours = sum(v for name, v in parts.items() if name != TIP_ON_PART)[0]
        theirs = tip_there - rest_tip
        reactions = loading.reactions[0]
        off = np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)
        apart.append(float(off))
        print(
            f"polar {polar:.0f}°, azimuth {azimuth:.0f}°: "
            f"reactions differ by {np.abs(there - reactions).max():.1e} N "
            f"(at rest {np.abs(rest - statics.rest_reactions).max():.1e}), "
            f"deflection {np.linalg.norm(theirs) * 1e3:.4f} µm against our "
            f"{np.linalg.norm(ours) * 1e3:.4f}: {100.0 * off:.3f} %, "
            f"{spent:.0f} s of processor time, {time.perf_counter() - start:.0f} s",
            flush=True,
        )
    ours_map = map_seconds()
    solve = float(np.mean(per_solve))
    print(
        f"our map of {MAP} directions, process and all, from an empty cache: "
        f"{ours_map:.1f} s of processor time"
    )
    fair, golden = MAP * 2 * solve, MAP * (1 + GOLDEN) * solve
    print(f"CalculiX, {solve:.0f} s a contact solve: two solves a direction {fair / 3600:.1f} h,")
    print(
        f"  {fair / ours_map:.0f} times ours; golden section {golden / 3600:.0f} h, "
        f"{golden / ours_map:.0f} times ours"
    )
    if options.json is not None:
        found = {"ours": ours_map, "fair": fair, "golden": golden, "apart": max(apart)}
        options.json.write_text(json.dumps(found))


if __name__ == "__main__":
    main()
