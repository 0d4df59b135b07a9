"""The model of a machine (tests/support/machine_model) beside the real LinuxCNC."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.machine.conftest import run_program
from tests.support.machine_model.control import Tool
from tests.support.machine_model.machine import Machine, run
from tests.support.machine_model.modes import Vector
from tests.support.machine_model.probe import Probe
from tests.support.machine_model.world import Ball, Stylus, World

# Modes, units, offsets with a turn, lengths, probe moves that find what they look for or not,
# and what M72 gives back. The last line stops the control.
PROGRAM = """
G21 F100
(LOGOPEN,told.log)
(LOG,%.4f#5400,#5403,#<_tool_offset>,#<_feed_hold>,#<_adaptive_feed>,#<_feed_override>,#5422,#<_abs_z>)
G20
(LOG,%.4f#<_feed>,#5422)
G21 T1 M6
(LOG,%.4f#5400,#5403,#5410)
G43.1 Z10
(LOG,%.4f#5422,#<_abs_z>,#<_tool_offset>)
G20
M70
G49 G21
(LOG,%.4f#5422,#<_abs_z>,#<_tool_offset>)
M72
(LOG,%.4f#5422,#<_abs_z>,#<_tool_offset>,#<_metric>)
G21 G49
G10 L2 P1 X100 Y50 Z-30 R0
G10 L2 P2 X90 Y40 Z-30 R30
G54 G61 F200.04
G0 X0 Y0 Z40
M70
G91 G20 G55 F3.21 G64 P0.01
M50 P0
M52 P1
M72
(LOG,%.4f#<_absolute>,#<_metric>,#5220,#<_feed>,#<_feed_override>,#<_adaptive_feed>)
M52 P0
G55 G1 X[10*COS[30]+10*SIN[30]] Y[10*COS[30]-10*SIN[30]] Z16.5 F6000
(LOG,%.4f#<_abs_x>,#<_abs_y>,#<_abs_z>,#5420,#5421)
G38.3 Z12 F60
(LOG,%.4f#5061,#5062,#5063,#5070)
G38.3 Z11 F60
(LOG,%.4f#5070)
G38.5 Z16.5 F60
(LOG,%.4f#5070)
G38.5 Z16.5 F60
(LOG,%.4f#5070)
G38.3 Z16.5 F60
G38.3 Z16.5 F60
(LOG,%.4f#5063,#5070,#5422)
G54 G0 Z40
G0 X16.5
G0 Z0
G38.3 X14 F60
(LOG,%.4f#5061,#5062,#5063,#5070)
G38.2 X14
"""
# The cycle of the servo at 1 mm/s, and the place where the real probe opens.
CLOSE = 0.004


def pretravel(normal: Vector) -> float:
    """Of the simulated probe, by its component and examples/linuxcnc/probe.hal. [mm]"""
    across = normal[0] ** 2 + normal[1] ** 2
    azimuth = math.degrees(math.atan2(normal[1], normal[0]))
    return (
        0.0013
        + 0.008 * across
        + 0.003 * across**1.5 * math.cos(math.radians(3 * (azimuth - 20)))
        + 0.0005 * across**3 * math.cos(math.radians(6 * (azimuth - 20)))
        + 0.0008 * across * math.cos(math.radians(2 * (azimuth - 55)))
    )


def test_the_model_says_what_the_control_does(tmp_path: Path) -> None:
    program = tmp_path / "told.ngc"
    program.write_text(PROGRAM.strip() + "\nM2\n")
    said = run_program(program, code=1)
    sphere = Ball((100.032, 50.041, -29.974), 12.49935)
    machine = Machine(
        World((sphere,), Stylus()),
        position=(0.0, 0.0, 150.0),
        tools={1: Tool(0.0, 6.0)},
        acceleration=20000.0,
    )
    trace = run(machine, program.read_text(), probe=Probe(pretravel))
    assert trace.ended == "error"
    assert trace.error in said
    told = (tmp_path / "told.log").read_text().split()
    for here, there in zip(trace.logs["told.log"], told, strict=True):
        values = [float(value) for value in here.split(",")]
        assert values == pytest.approx([float(v) for v in there.split(",")], abs=CLOSE), here
