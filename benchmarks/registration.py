"""A part placed from nothing, against Open3D: features of points (FPFH), RANSAC and ICP.

Both know the part, 1,000 tip centres on it in any placement, and nothing else. Open3D sees the part
as points on the surface of the tip's centres, 1.5 mm apart. The environment variable
OPEN3D_PYTHON names a Python that has it, where this one has not.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from benchmarks.results import Figures, Row
from benchmarks.sizes import Sizes
from pretravel.base.directions import sphere_pattern_25
from pretravel.drawing.alignment.alignment_search import found_placements
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches
from tests.support.touched_bracket import bracket, random_placement, random_targets, tip_centres

_TIP_RADIUS = 3.0
_SPACING = 1.5
_RIGHT = 0.5
"""Largest error of a corner of the part that is placed. [mm]"""
_OPEN3D = """
import json, sys, time
import numpy as np
import open3d as o3d
folder, spacing = sys.argv[1], float(sys.argv[2])
register = o3d.pipelines.registration

def seen(points, radius):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2.0 * radius, 30))
    near = o3d.geometry.KDTreeSearchParamHybrid(5.0 * radius, 100)
    return cloud, register.compute_fpfh_feature(cloud, near)

given = np.load(folder + "/given.npz")
step = 4.0 * spacing  # about the distance of the touches
part = seen(given["part"], step)
found = []
for touches in given["touches"]:
    start = time.process_time()
    own = seen(touches, step)
    rough = register.registration_ransac_based_on_feature_matching(
        own[0], part[0], own[1], part[1], True, 1.5 * step,
        register.TransformationEstimationPointToPoint(False), 3,
        [register.CorrespondenceCheckerBasedOnEdgeLength(0.9),
         register.CorrespondenceCheckerBasedOnDistance(1.5 * step)],
        register.RANSACConvergenceCriteria(100000, 0.999))
    fine = register.registration_icp(
        own[0], part[0], spacing, rough.transformation,
        register.TransformationEstimationPointToPlane())
    found.append([time.process_time() - start, fine.transformation.tolist()])
print(json.dumps(found))
"""


def registration(sizes: Sizes) -> Figures:
    """The bracket of the tests, 1,000 touches, in some placements."""
    n = np.repeat(sphere_pattern_25(), 3, axis=0)
    distance = 15.5 - predict(load_probe("omp40-2-100mm"), n).pretravel
    touched = Touches(n * distance[:, None], n)
    # A mean has values on all sides of the part; a tripod does not trigger when it is pulled.
    made = qualify(touched, 25.0, tip_diameter=6.0, kind="mean").pretravel_map
    part, generator, count = bracket(), np.random.default_rng(0), 2 * sizes.repeats
    placements = [random_placement(generator) for _ in range(count)]
    tips = []
    for placement in placements:
        points, normals, _ = random_targets(part, sizes.placed, generator, _TIP_RADIUS)
        points = points + generator.normal(0.0, 1e-3, len(points))[:, None] * normals
        tips.append(tip_centres(placement, points, normals, made))
    corners = np.stack(np.meshgrid(*part.box.T), axis=-1).reshape(-1, 3)
    times, right = [], 0
    for placement, tip in zip(placements, tips, strict=True):
        start = time.process_time()
        found = found_placements(tip, part, made, extrapolate=True)
        times.append(time.process_time() - start)
        away = [np.abs(e.placement.points(corners) - placement.points(corners)) for e in found]
        right += len(found) == 1 and bool(away[0].max() < _RIGHT)
    what, other = "a part placed from nothing", "Open3D, FPFH, RANSAC and ICP"
    python = sys.executable if find_spec("open3d") else os.environ.get("OPEN3D_PYTHON", "")
    share = f"right in {right} of {count} placements"
    ours, touches = statistics.median(times), f"{sizes.placed:,} touches,"
    if not python:
        note = f"{share}; Open3D is not installed here"
        return Figures((Row(what, touches, ours, other, None, note),))
    theirs, theirs_right = _open3d(python, [tip.positions for tip in tips], placements, corners)
    note = f"{share}, Open3D in {theirs_right}"
    return Figures((Row(what, touches, ours, other, theirs, note),))


def _open3d(
    python: str, tips: list[np.ndarray], placements: list[object], corners: np.ndarray
) -> tuple[float, int]:
    """The median time of the processor, and how many placements are right."""
    part = bracket()
    uv = [face.samples(_SPACING) for face in part.faces]
    local = [face.local(own) for face, own in zip(part.faces, uv, strict=True)]
    surface = np.vstack([each.point + _TIP_RADIUS * each.normal for each in local])
    with tempfile.TemporaryDirectory() as folder:
        touches = np.stack(tips)
        np.savez(Path(folder) / "given.npz", part=surface, touches=touches)
        said = subprocess.run(
            [python, "-c", _OPEN3D, folder, str(_SPACING)],
            env={**os.environ, "OMP_NUM_THREADS": "1"}, capture_output=True, text=True, check=True,
        )  # fmt: skip
    found = json.loads(said.stdout.splitlines()[-1])
    right = 0
    for (_, matrix), placement in zip(found, placements, strict=True):
        turn, shift = np.array(matrix)[:3, :3], np.array(matrix)[:3, 3]
        back = (placement.points(corners) @ turn.T) + shift  # type: ignore[attr-defined]
        right += bool(np.abs(back - corners).max() < _RIGHT)
    return statistics.median(seconds for seconds, _ in found), right
