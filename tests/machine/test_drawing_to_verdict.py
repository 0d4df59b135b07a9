"""From the drawing in a model to the verdict, through a program that a machine really runs.

The machine is the model of `tests/support/machine_model`; on its table lies the bracket with its
bore of 12 mm bored 12.030 mm (asked: 12 H7, to 12.018), 0.2 mm beside the work offset and turned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pretravel.base import FloatArray
from pretravel.base.frames import Placement, parse_placement
from pretravel.controls.linuxcnc_state import state_subroutines
from pretravel.files import write_map
from pretravel.surface import Part, face_triangles, feet_on_faces, read_part
from pretravel.uncertainty import Covariance
from tests.support.commands import run
from tests.support.example_maps import mean_map
from tests.support.examples import EXAMPLES
from tests.support.machine_model.coordinates import WorkOffset
from tests.support.machine_model.machine import Machine, Trace
from tests.support.machine_model.machine import run as run_on_machine
from tests.support.machine_model.modes import Vector
from tests.support.machine_model.probe import Probe, constant
from tests.support.machine_model.world import Stylus, World

MODEL = EXAMPLES / "bracket_pmi.step"
ORIGIN: Vector = (100.0, 50.0, -130.0)
PRETRAVEL = 0.008
U_PRETRAVEL = 0.1e-3
BORED = 0.015
"""By which the radius of face 12 is larger than in the model. [mm]"""
_NEAR = 4.0
"""Nearer than this the exact distance is computed. [mm]"""
_SAMPLES = 1.0
"""Distance between points of the surface that stand for it further away. [mm]"""
_COARSE = 5.0
"""The same of those that stand for these further away."""


@dataclass(frozen=True)
class StepPart:
    """A part of a STEP file on the table, with one bore that is too large."""

    part: Part
    placement: Placement

    @cached_property
    def samples(self) -> tuple[cKDTree, np.ndarray]:
        """Points of the surface, and the index of the face of each."""
        shown = [face_triangles(face, faces=len(self.part.faces)) for face in self.part.faces]
        dense = [_dense(each.points[each.corners]) for each in shown]
        return cKDTree(np.concatenate(dense)), np.repeat(np.arange(len(dense)), [*map(len, dense)])

    @cached_property
    def few(self) -> tuple[FloatArray, float]:
        """Some of the samples, and how far another one can be from the next of them."""
        points = self.samples[0].data
        _, rows = np.unique(np.round(points / _COARSE), axis=0, return_index=True)
        return points[rows], math.sqrt(3.0) * _COARSE

    def _local(self, place: Vector) -> FloatArray:
        return self.placement.inverse.points(np.array([place]))

    def distance(self, place: Vector) -> tuple[float, Vector]:
        here = self._local(place)
        tree, faces = self.samples
        far, row = tree.query(here[0])
        if far > _NEAR:
            return float(far) - _SAMPLES, (0.0, 0.0, 1.0)
        feet = feet_on_faces(self.part, here, faces[[row]])
        gap = float(feet.distance[0])
        if not feet.inside[0]:  # beside the face, whose edge is nearest
            return float(far), (0.0, 0.0, 1.0)
        if self.part.faces[int(feet.face[0])].number == 12:
            gap += BORED
        x, y, z = self.placement.vectors(feet.local.normal)[0]
        return gap, (float(x), float(y), float(z))

    def cylinder_distance(self, foot: Vector, radius: float, height: float) -> float:
        """From the sampled surface: no larger than the distance."""
        here = self._local(foot)[0]
        some, beside = self.few
        away = _from_cylinder(some, here, radius, height) - beside
        return away if away > _NEAR else _from_cylinder(
            self.samples[0].data, here, radius, height
        )  # fmt: skip


def _from_cylinder(points: FloatArray, foot: FloatArray, radius: float, height: float) -> float:
    """The smallest distance of points from an upright cylinder. [mm]"""
    across = np.hypot(*(points[:, :2] - foot[:2]).T) - radius
    above = np.maximum(foot[2] - points[:, 2], points[:, 2] - foot[2] - height)
    both = np.where((across > 0) & (above > 0), np.hypot(across, above), np.maximum(across, above))
    return float(both.min())


def _dense(corners: FloatArray) -> FloatArray:
    """Points of triangles, (t, 3, 3), at most `_SAMPLES` apart."""
    found = []
    for triangle in corners:
        a, b, c = triangle
        count = max(1, math.ceil(max(np.linalg.norm(b - a), np.linalg.norm(c - a)) / _SAMPLES))
        s, t = np.meshgrid(*(2 * [np.linspace(0.0, 1.0, count + 1)]))
        inside = s + t <= 1.0 + 1e-9
        found.append(a + s[inside][:, None] * (b - a) + t[inside][:, None] * (c - a))
    return np.concatenate(found)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The drawing, the plan and the program of the part."""
    place = tmp_path_factory.mktemp("drawing_to_verdict")
    text = run("machine")
    for old, new in (("tip_diameter_mm = 6", "tip_diameter_mm = 3"),
                     ("stem_diameter_mm = 4.5", "stem_diameter_mm = 2")):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    (place / "mill.toml").write_text(text)
    run("drawing", MODEL, "-o", place / "drawing.toml")
    run("plan", MODEL, "--drawing", place / "drawing.toml", "--machine", place / "mill.toml",
        "-o", place / "plan.csv")  # fmt: skip
    run("program", "part", place / "mill.toml", place / "plan.csv", "--surface", MODEL,
        "-o", place / "part.ngc")  # fmt: skip
    return place


@pytest.fixture(scope="module")
def trace(folder: Path) -> Trace:
    placement = parse_placement("100.15,50.1,-129.9,0,0,0.2")
    world = World((StepPart(read_part(MODEL), placement),), Stylus(1.5, 1.0))
    x, y, z = ORIGIN
    machine = Machine(
        world=world, position=(x, y, z + 90.0), offsets={"G54": WorkOffset(ORIGIN)},
        acceleration=500.0,
    )  # fmt: skip
    return run_on_machine(
        machine, (folder / "part.ngc").read_text(), probe=Probe(constant(PRETRAVEL)),
        subroutines=state_subroutines(),
    )  # fmt: skip


def test_the_machine_touches_every_target_and_nothing_else(folder: Path, trace: Trace) -> None:
    assert trace.ended == "end", trace.error
    assert trace.contacts == len((folder / "plan.csv").read_text().splitlines()) - 1
    assert max(move.depths.stem for move in trace.moves) < 0.0
    assert max(move.depths.body for move in trace.moves) < 0.0


def test_the_bore_that_is_too_large_stands_first(folder: Path, trace: Trace) -> None:
    """12.030 mm of 12 to 12.018, and 14.000 of 13.983 to 13.994: the model itself has 14 mm."""
    log = folder / "part_log.ngc"
    log.write_text("\n".join(trace.logs["part_log.ngc"]) + "\n")
    known = Covariance.independent([U_PRETRAVEL**2])
    made = replace(mean_map(PRETRAVEL, tip_radius=1.5), covariance=known, feed=50.0)
    write_map(folder / "map.json", made)
    run("align", log, "--part", MODEL, "--map", folder / "map.json",
        "--points", folder / "points.csv")  # fmt: skip
    told = run("measure", folder / "points.csv", "--drawing", folder / "drawing.toml",
               "--part", MODEL, "--u-machine", 0.5, code=3)  # fmt: skip
    rows = told.splitlines()
    assert rows[0].startswith("2 do not conform (cylinder12: diameter; cylinder13: diameter)")
    table = rows[rows.index("Tolerances") + 2 :]
    assert table[0].split()[:3] == ["cylinder12", "⌀", "diameter"]
    value = float(table[0].split("12 to 12.018 mm")[1].split()[0])
    assert value == pytest.approx(12.0 + 2.0 * BORED, abs=0.5e-3)
    assert sum("✔ conforms" in row for row in rows) == 6
