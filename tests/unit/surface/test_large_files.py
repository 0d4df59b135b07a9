"""Files of many faces and megabytes: read whole, planned, touched and compensated."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from pretravel.design.probing.simulation import simulate
from pretravel.drawing.inspection import plan_inspection
from pretravel.measurement.compensation import apply
from pretravel.prediction.catalogue import load_probe
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.part_file import read_part
from pretravel.task.map_argument import map_or_prediction
from pretravel.touches.targets import Targets
from tests.support.large_parts import blades_around, plate_with_holes


def _read(path: Path) -> Part:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # no face is missing
        part = read_part(path)
    assert not part.unreadable
    return part


def _there_and_back(part: Part, grid: tuple[int, int]) -> int:
    """Number of targets, all of which are touched and found again within 1e-6 mm."""
    plan = plan_inspection(part, grid=grid)
    targets = Targets(plan.point, plan.normal, labels=plan.labels)
    touches = simulate(load_probe("omp40-2"), part, targets)
    found = map_or_prediction("omp40-2", "analytic", tip_diameter=None)
    points = apply(touches, found, nominal=part, shared=False)
    assert points.deviation is not None
    assert np.abs(points.deviation).max() < 1e-6
    return len(plan)


def _check_plate(part: Part, columns: int, rows: int) -> None:
    holes = [face for face in part.faces if face.kind == "cylinder"]
    assert len(holes) == columns * rows
    assert len(part.faces) == columns * rows + 6
    centers = np.array([face.local(face.middle[None]).point[0] for face in holes])
    normals = np.array([face.local(face.middle[None]).normal[0] for face in holes])
    axes = centers + 4.0 * normals  # the outside of a hole points to its axis
    at = np.unique(np.round(axes[:, :2], 6), axis=0)
    assert len(at) == columns * rows
    assert np.allclose(np.diff(np.unique(at[:, 0])), 10.0)


@pytest.mark.long
def test_a_plate_with_holes(tmp_path: Path) -> None:
    part = _read(plate_with_holes(tmp_path / "plate.step", 6, 5))
    _check_plate(part, 6, 5)
    assert _there_and_back(part, (4, 3)) > 6 * 5 * 4


@pytest.mark.slow
def test_a_plate_with_two_thousand_holes(tmp_path: Path) -> None:
    """8 MB; 20 s for the kernel, the plan, 8,000 touches and their compensation."""
    path = plate_with_holes(tmp_path / "plate.step", 50, 40)
    assert path.stat().st_size > 4e6
    part = _read(path)
    _check_plate(part, 50, 40)
    assert _there_and_back(part, (4, 3)) > 2000 * 4


@pytest.mark.slow
def test_many_blades_of_splines(tmp_path: Path) -> None:
    """30 MB, 2,100 faces: read whole, and every face can be evaluated at its middle."""
    path = blades_around(tmp_path / "blades.step", 525)
    assert path.stat().st_size > 2e7
    part = _read(path)
    assert len(part.faces) == 4 * 525
    assert {face.kind for face in part.faces} == {"B-spline", "plane"}
    normals = np.array([face.local(face.middle[None]).normal[0] for face in part.faces])
    assert np.abs(np.linalg.norm(normals, axis=1) - 1.0).max() < 1e-9
