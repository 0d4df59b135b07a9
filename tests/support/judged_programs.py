"""Probing programs of ours with the machine that they are for, to be judged by the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise

import numpy as np

from pretravel.base.directions import ring_pattern
from pretravel.base.units import DEGREE
from pretravel.controls.linuxcnc_programs import linuxcnc_program
from pretravel.controls.linuxcnc_state import state_subroutines
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.lookup_formula import exact_lookup
from pretravel.controls.program import ProbingProgram, plan_program
from pretravel.controls.surroundings import PartObstacle, SphereObstacle
from pretravel.files.machine import Machine
from pretravel.surface.cad.step_part import read_step_part
from pretravel.touches.targets import Targets
from tests.support.example_maps import mean_map
from tests.support.examples import ROOT
from tests.support.machine_model.control import Tool
from tests.support.machine_model.coordinates import Frame, WorkOffset
from tests.support.machine_model.judgement import Plan, PlannedTouch
from tests.support.machine_model.machine import Machine as ModelMachine
from tests.support.machine_model.machine import Trace, run
from tests.support.machine_model.modes import Vector
from tests.support.machine_model.probe import Fault, Probe, constant
from tests.support.machine_model.world import Ball, Box, Stylus, Table, World

PRETRAVEL = 0.008
"""Of the probe of the model, and of the map on the control. [mm]"""
RADIUS = 12.5
TOOL_LENGTH = 55.0
MACHINE = Machine(
    measuring_feed=60.0, positioning_feed=1200.0, travel_feed=2000.0, safe_height=45.0,
    acceleration=500.0,
    stem_diameter=2.0, tool=7, tool_length=TOOL_LENGTH,
)  # fmt: skip
ERROR: Vector = (0.2, -0.15, 0.1)
"""The things on the table are so far from where the work offset says. [mm]"""


@dataclass(frozen=True)
class Judged:
    """A program, the machine on which it runs, and what it may do there.

    Attributes
    ----------
    text : str
    machine : ModelMachine
    plan : Plan
    subroutines : mapping of str to str
    corners : tuple of Vector
        For each touch a place in the middle of the way to its start, as machine coordinates of
        the ball's middle. [mm]
    """

    text: str
    machine: ModelMachine
    plan: Plan
    subroutines: Mapping[str, str] = field(default_factory=dict)
    corners: tuple[Vector, ...] = ()

    def run(self, *faults: Fault, machine: ModelMachine | None = None) -> Trace:
        probe = Probe(constant(PRETRAVEL), faults=faults)
        return run(machine or self.machine, self.text, probe=probe, subroutines=self.subroutines)

    def changed(self, **changes: object) -> ModelMachine:
        """The machine with other values."""
        return replace(self.machine, **changes)  # type: ignore[arg-type]


def _vector(row: np.ndarray) -> Vector:
    x, y, z = (float(value) for value in row)
    return (x, y, z)


def _way_of(program: ProbingProgram, row: int) -> list[Vector]:
    """All places from the start before to the start of a touch."""
    before = [program.starts[row - 1]] if row else []
    places = [*before, *program.ways[row], program.starts[row]]
    return [_vector(place) for place in places]


def judged_plan(program: ProbingProgram, offset: WorkOffset) -> Plan:
    """What a program may do, by its plan."""
    machine = program.machine
    contacts = program.points + machine.tip_radius * program.normals
    touches = tuple(
        PlannedTouch(label, _vector(start), _vector(contact), _vector(end))
        for label, start, contact, end in zip(
            program.labels, program.starts, contacts, program.ends, strict=True
        )
    )
    segments = [(t.start, t.end) for t in touches]
    for row in range(len(program)):
        places = _way_of(program, row)
        segments += pairwise(places)
    leave = [_vector(program.starts[-1]), *(_vector(place) for place in program.leave)]
    segments += pairwise(leave)
    return Plan(
        touches=touches,
        segments=tuple(segments),
        safe_height=machine.safe_height,
        offset=offset,
        overtravel=machine.overtravel + float(np.linalg.norm(ERROR)),
        stopping=machine.stopping_distance(machine.positioning_feed),
        clearance=machine.clearance,
        positioning_feed=machine.positioning_feed,
    )


def _corners(program: ProbingProgram, offset: WorkOffset) -> tuple[Vector, ...]:
    corners = []
    for row in range(len(program)):
        places = _way_of(program, row)[-2:]
        middle = np.mean(np.array(places), axis=0)
        corners.append(Frame(offset).to_machine(_vector(middle)))
    return tuple(corners)


def _on(offset: WorkOffset, program: ProbingProgram, things: World, text: str,
        subroutines: Mapping[str, str] | None = None) -> Judged:  # fmt: skip
    machine = ModelMachine(
        world=things,
        position=(0.0, 0.0, offset.origin[2] + TOOL_LENGTH + 90.0),
        offsets={program.machine.work_offset: offset},
        tools={7: Tool(TOOL_LENGTH, 6.0), 1: Tool(100.0, 10.0)},
        tool=7,
        acceleration=program.machine.acceleration,
    )
    return Judged(
        text,
        machine,
        judged_plan(program, offset),
        state_subroutines() | dict(subroutines or {}),
        _corners(program, offset),
    )


STYLUS = Stylus(stem_radius=1.0, length=TOOL_LENGTH)


def _displaced(offset: WorkOffset, place: Vector) -> Vector:
    """Where a thing at a place of the work coordinates really is."""
    x, y, z = Frame(offset).to_machine(place)
    return (x + ERROR[0], y + ERROR[1], z + ERROR[2])


@cache
def sphere_program() -> Judged:
    """Eleven touches on a sphere in G54. With a fault at each of them, the work grows with the
    square of their number; ways along a ring, between rings and from the pole all occur."""
    return touches_on_sphere(ring_pattern(np.array([0.0, 50.0, 90.0]) * DEGREE, 5), MACHINE)


def touches_on_sphere(
    normals: np.ndarray,
    machine: Machine,
    *,
    spindle: float | None = None,
    beside: Vector = (0.0, 0.0, 0.0),
) -> Judged:
    """Touches on a sphere in G54 with the numbers of a machine; its tool is that of `MACHINE`.

    At an orientation of the spindle [rad] the tip is beside its axis, as if the sphere were so far
    to the other side.
    """
    labels = tuple(f"s{i}" for i in range(len(normals)))
    program = plan_program(
        Targets(RADIUS * normals, normals, labels=labels), machine, title="sphere",
        obstacles=[SphereObstacle(np.zeros(3), RADIUS)],
    )  # fmt: skip
    offset = WorkOffset((100.0, 50.0, -130.0))
    x, y, z = (-part for part in beside)
    things = World((Ball(_displaced(offset, (x, y, z)), RADIUS), Table(-180.0)), STYLUS)
    return _on(
        offset, program, things, linuxcnc_program(program, "sphere_log.ngc", spindle=spindle)
    )


PART_TARGETS = Targets(
    np.array([[-30.0, -20, 0], [-20, 15, 0], [-40, 10, -6], [-40, -15, -6], [-25, 30, -5],
              [-10, -30, -7], [20, 0, 12]]),
    np.array([[0.0, 0, 1], [0, 0, 1], [-1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]),
    labels=("t1", "t2", "w1", "w2", "n1", "s1", "dome"),
)  # fmt: skip


def _part_things(offset: WorkOffset) -> World:
    """The solid of examples/linuxcnc/part.step: a block with a dome."""
    block = Box(_displaced(offset, (0.0, 0.0, -10.0)), (40.0, 30.0, 10.0), offset.turn_deg)
    dome = Ball(_displaced(offset, (20.0, 0.0, -4.0)), 16.0)
    return World((block, dome), STYLUS)


@cache
def part_program(*, compensated: bool = False, allow_misses: bool = False) -> Judged:
    """Touches on a part in turned work coordinates, G55; with or without a map on the control."""
    machine = replace(MACHINE, work_offset="G55", stem_diameter=2.0)
    part = read_step_part(str(ROOT / "examples" / "linuxcnc" / "part.step"))
    program = plan_program(PART_TARGETS, machine, title="part", obstacles=[PartObstacle(part)])
    offset = WorkOffset((-80.0, 20.0, -160.0), 30.0)
    texts: Mapping[str, str] = {}
    map_on_control = None
    if compensated:
        map_on_control = mean_map(PRETRAVEL)
        form = exact_lookup(map_on_control)
        assert form is not None
        texts = linuxcnc_subroutines(map_on_control, form, tool=7)
    text = linuxcnc_program(
        program, "part_log.ngc", compensated=map_on_control, allow_misses=allow_misses
    )
    return _on(offset, program, _part_things(offset), text, texts)


@cache
def called_points() -> Judged:
    """A user's own program that calls the exported subroutine for each point."""
    found = part_program(compensated=True)
    touches = found.plan.touches
    calls: list[str] = []
    for number, (point, normal) in enumerate(
        zip(PART_TARGETS.points, PART_TARGETS.normals, strict=True), start=1
    ):
        values = " ".join(f"[{value:.6f}]" for value in (*point, *normal))
        start = touches[number - 1].start
        calls += [
            f"G1 X{start[0]:.6f} Y{start[1]:.6f} F1200",
            f"o<pretravel_point> call {values} [60] [{number}] [2] [2] [1200] [1]",
            "G1 Z45 F1200",
        ]
    safe = "G21 G90 G94 G55 G61\nG43\n(LOGOPEN,points.log)\no<pretravel_head> call\n"
    text = safe + "\n".join(calls) + "\n(LOGCLOSE)\nM2\n"
    height = 45.0
    segments = [((t.start[0], t.start[1], height), t.start) for t in touches] + [
        (t.start, t.end) for t in touches
    ]
    x, y, z = Frame(found.plan.offset).to_machine((0.0, 0.0, height))
    return replace(
        found,
        text=text,
        machine=found.changed(position=(x, y, z + TOOL_LENGTH)),
        plan=replace(found.plan, segments=tuple(segments)),
    )


def moved(judged: Judged, way: Vector) -> ModelMachine:
    """The machine with all things on the table moved."""
    things = tuple(
        replace(t, center=(t.center[0] + way[0], t.center[1] + way[1], t.center[2] + way[2]))
        for t in judged.machine.world.things
        if isinstance(t, Ball | Box)
    )
    return judged.changed(world=replace(judged.machine.world, things=things))
