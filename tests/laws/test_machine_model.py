"""The model of the machine against closed forms; against LinuxCNC: tests/machine."""

from __future__ import annotations

import pytest

from tests.support.machine_model.machine import Machine, run
from tests.support.machine_model.probe import Fault, Probe, constant
from tests.support.machine_model.world import Ball, Stylus, World


def test_a_ball_trips_at_the_pretravel_and_stops_later() -> None:
    """Pole of a sphere of radius 10, tip 3: contact at z = 13, trip 5 µm deeper."""
    world = World((Ball((0.0, 0.0, 0.0), 10.0),), Stylus())
    machine = Machine(world, position=(0.0, 0.0, 20.0), acceleration=500.0, reaction=0.0)
    trace = run(
        machine, "F600\nG38.2 Z5\n(PRINT,%.4f#5063,#5070)\nM2\n", probe=Probe(constant(0.005))
    )
    assert trace.printed == ("12.9950,1.0000",)
    # v²/2a with 10 mm/s and 500 mm/s²
    assert trace.moves[0].reached[2] == pytest.approx(12.995 - 0.1, abs=1e-6)
    assert trace.moves[0].depths.ball == pytest.approx(0.105, abs=1e-6)


def test_each_fault_of_the_probe() -> None:
    world = World((Ball((0.0, 0.0, 0.0), 10.0),), Stylus())
    touch = "F60\nG38.3 Z5\n(PRINT,#5063 #5070)\nG38.5 Z20\n(PRINT,#5063 #5070)\nG1 Z20\n"

    def printed(*faults: Fault) -> tuple[str, ...]:
        machine = Machine(world, position=(0.0, 0.0, 20.0))
        return run(machine, touch * 2 + "M2\n", probe=Probe(faults=faults)).printed

    healthy = ("12.995000 1.000000", "12.995500 1.000000")
    missed = ("5.000000 0.000000", "5.000000 1.000000")
    assert printed() == healthy * 2
    assert printed(Fault("dead", 2)) == healthy + missed
    assert printed(Fault("stuck", 1))[1] == "20.000000 0.000000"
    assert printed(Fault("tripped"))[0] == "20.000000 1.000000"
    assert printed(Fault("early", 2, 1.5))[2] == "14.495000 1.000000"
    assert printed(Fault("spike", 2, 1.5))[2] == "14.495000 1.000000"
    assert printed(Fault("late", 2, 1.5))[2] == "11.495000 1.000000"
    assert printed(Fault("bounce", 1))[:2] == healthy
