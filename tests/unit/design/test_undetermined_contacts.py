"""Apexes of drilled holes, hollows with the radius of the tip: no contact is determined there."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.design.probing.simulation import SimulationResult, simulate_some
from pretravel.design.probing.surface_touches import TouchStatus
from pretravel.drawing.inspection import InspectionRegion, plan_inspection
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import apply
from pretravel.prediction.catalogue import load_probe
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.part_file import read_part
from pretravel.surface.shapes import Sphere
from pretravel.surface.shapes_of_revolution import Cone
from pretravel.surface.undetermined import LEAST_PLAY, apexes
from pretravel.task.map_argument import map_or_prediction
from pretravel.touches import Touches
from pretravel.touches.targets import Targets

PROBE = load_probe("omp40-2")
RADIUS = 3.0
POINT_ANGLE = math.radians(118.0)


@cache
def _part(fillet: float) -> Part:
    """A block with two drilled holes (16 and 20 mm) and two pockets, one with rounded corners and
    one with a rounded floor."""
    from netgen.occ import Axis, Box, Face, Pnt, Segment, Wire, Z

    def drill(x: float, y: float, diameter: float) -> object:
        half, bottom = 0.5 * diameter, 25.0
        tip = bottom - half / math.tan(0.5 * POINT_ANGLE)
        corners = [
            Pnt(x, y, tip), Pnt(x + half, y, bottom), Pnt(x + half, y, 41), Pnt(x, y, 41)
        ]  # fmt: skip
        wire = Wire([Segment(corners[i], corners[(i + 1) % 4]) for i in range(4)])
        return Face(wire).Revolve(Axis(Pnt(x, y, 0), Z), 360)

    corners = Box((40, 5, 25), (65, 30, 41))
    floor = Box((72, 5, 25), (95, 30, 41))
    upright = [edge for edge in corners.edges if 26 < edge.center.z < 40]
    low = [edge for edge in floor.edges if abs(edge.center.z - 25) < 1e-6]
    block = Box((0, 0, 0), (100, 60, 40)) - drill(20, 20, 16) - drill(75, 45, 20)
    block = block - corners.MakeFillet(upright, fillet) - floor.MakeFillet(low, fillet)
    with TemporaryDirectory() as folder:
        block.WriteStep(f"{folder}/block.step")
        return read_part(Path(folder) / "block.step")


@cache
def _map() -> PretravelMap:
    return map_or_prediction("omp40-2", "analytic", tip_diameter=None)


def _touched(part: Part, **way: object) -> tuple[Targets, SimulationResult]:
    plan = plan_inspection(part, **way)  # type: ignore[arg-type]
    targets = Targets(plan.point, plan.normal, labels=plan.labels)
    return targets, simulate_some(PROBE, part, targets)


def _fillets(part: Part, radius: float) -> list[int]:
    """Indices of the cylindrical faces with this hollow radius."""
    bends = [face.local(face.middle[None]).principal_curvatures[0, 0] for face in part.faces]
    return [
        index
        for index, (face, bend) in enumerate(zip(part.faces, bends, strict=True))
        if face.kind == "cylinder" and abs(bend + 1.0 / radius) < 1e-9
    ]


@pytest.mark.long
@pytest.mark.parametrize(
    ("fillet", "way"),
    [
        *((fillet, {"grid": (3, 3)}) for fillet in (2.0, 3.0, 3.04)),
        *((fillet, {"spacing": 4.0}) for fillet in (3.0, 3.04, 3.2, 5.0)),
    ],
)
def test_what_simulate_accepts_compensate_accepts(fillet: float, way: dict[str, object]) -> None:
    """Within 1e-6 mm of the nominal, and every contact at its target: those of a pretravel of
    6 µm slide by less than 0.05 mm where the ball has at least 0.06 mm of play."""
    part = _part(fillet)
    targets, simulated = _touched(part, **way)
    accepted = simulated.outcomes.converged
    assert simulated.touches is not None
    points = apply(simulated.touches, _map(), nominal=part, shared=False)
    assert points.deviation is not None
    assert np.abs(points.deviation).max() < 1e-6
    off = np.linalg.norm(simulated.outcomes.first_point - targets.points, axis=1)[accepted]
    turned = np.sum(simulated.outcomes.first_normal * targets.normals, axis=1)[accepted]
    assert off.max() < 0.05
    assert turned.min() > math.cos(math.radians(1.0))


@pytest.mark.parametrize(
    ("fillet", "status"),
    [
        (2.0, TouchStatus.DOES_NOT_FIT),
        (3.0, TouchStatus.NOT_DETERMINED),
        (3.0 + 0.5 * LEAST_PLAY, TouchStatus.NOT_DETERMINED),
        (3.2, TouchStatus.CONVERGED),
    ],
)
def test_hollows_of_about_the_radius_of_the_tip(fillet: float, status: TouchStatus) -> None:
    part = _part(fillet)
    own = _fillets(part, fillet)
    assert len(own) >= 4
    _, simulated = _touched(replace(part, chosen=tuple(own)), grid=(3, 3))
    counts = np.bincount(simulated.outcomes.status, minlength=11)
    assert counts[status] > 0.7 * counts.sum()
    for other in (TouchStatus.CONVERGED, TouchStatus.DOES_NOT_FIT, TouchStatus.NOT_DETERMINED):
        assert other == status or counts[other] == 0


class TestApexes:
    def test_where_they_are(self) -> None:
        """Of the drilled holes; a cone without its tip and a sphere have none."""
        tips = np.concatenate([face.apexes for face in _part(5.0).faces])
        depth = {20: 8.0, 75: 10.0}
        assert len(tips) == 2
        for x, _, z in tips:
            half = depth[round(x)]
            assert z == pytest.approx(25.0 - half / math.tan(0.5 * POINT_ANGLE))
        ball = Sphere([0, 0, 0], 5.0)
        assert (
            len(apexes(ball, *(np.array(x) for x in (ball.domain.lower, ball.domain.upper)))) == 0
        )
        cone = Cone([0, 0, 0], 5.0, 0.5)
        assert len(apexes(cone, np.array([0.0, 0.0]), np.array([6.3, 9.0]))) == 0

    @pytest.mark.parametrize("way", [{"grid": (3, 3)}, {"spacing": 0.7}, {"chord": 0.01}])
    def test_no_target_nearer_than_the_margin(self, way: dict[str, object]) -> None:
        part = _part(5.0)
        cones = tuple(i for i, face in enumerate(part.faces) if len(face.apexes))
        tips = np.concatenate([part.faces[i].apexes for i in cones])
        for margin in (1.0,) if "chord" in way else (0.0, 1.0):
            region = InspectionRegion(margin)
            chosen = replace(part, chosen=cones)
            plan = plan_inspection(chosen, region=region, **way)  # type: ignore[arg-type]
            apart = np.linalg.norm(plan.point[:, None] - tips, axis=2).min(axis=1)
            assert apart.min() >= max(margin, 1e-3) - 1e-9
            between = np.linalg.norm(plan.point[:, None] - plan.point, axis=2)
            assert (between + np.eye(len(plan))).min() > 1e-6

    def test_targets_within_the_radius_of_the_tip_are_refused(self) -> None:
        """At 1, 2.9 and 3.1 mm from the tip of a blunt pin, and at its tip."""
        pin = Cone([0.0, 0.0, 0.0], 20.0, -math.radians(60.0))
        tip = 20.0 / math.sin(math.radians(60.0))
        uv = np.array([[0.3, tip - far] for far in (1e-6, 1.0, 2.9, 3.1)])
        local = pin.local(uv)
        outcomes = simulate_some(PROBE, pin, Targets(local.point, local.normal)).outcomes
        assert outcomes.status.tolist() == [TouchStatus.APEX] * 3 + [TouchStatus.CONVERGED]


def test_compensation_refuses_what_is_not_determined() -> None:
    """A touch in the fillet, and one at the tip of a drilled hole; the messages name them."""
    part = _part(3.0)
    face = part.faces[_fillets(part, 3.0)[0]]
    local = face.local(face.middle[None])
    touches = Touches(local.point + 2.995 * local.normal, local.normal)
    with pytest.raises(PretravelError, match="1 of 1 touches lie in a hollow with the radius"):
        apply(touches, _map(), nominal=part, shared=False)
    pin = Cone([0.0, 0.0, 0.0], 20.0, -math.radians(60.0))
    local = pin.local(np.array([[0.3, 20.0 / math.sin(math.radians(60.0)) - 0.5]]))
    touches = Touches(local.point + 2.995 * local.normal, local.normal)
    with pytest.raises(PretravelError, match="1 of 1 touches lie at the tip of a cone"):
        apply(touches, _map(), nominal=pin, shared=False)
