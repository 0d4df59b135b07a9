"""Subroutines of LinuxCNC on the model of the machine: they evaluate the map of which they were
made, and log the touch that was asked for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.logs.pretravel_log import read_own_log
from pretravel.controls.lookup import Band, Lookup
from pretravel.controls.lookup_formula import LookupSeats, LookupSeries, exact_lookup
from pretravel.controls.lookup_table import lookup_table
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.described_maps import described_map
from pretravel.prediction.response import probe_response
from tests.support.example_maps import mean_map
from tests.support.machine_model.coordinates import WorkOffset
from tests.support.machine_model.machine import Machine, run
from tests.support.machine_model.probe import Probe
from tests.support.machine_model.world import Ball, World
from tests.support.simulated_probe import simulated_map, simulated_pretravel

TURN = 20.0


@cache
def form_of(name: str) -> tuple[PretravelMap, Lookup]:
    if name == "six seats":
        seats = described_map("omp40-2", "analytic")
        form = exact_lookup(seats)
        assert isinstance(form, LookupSeats)
        return seats, form
    series = simulated_map()
    form = exact_lookup(series)
    assert isinstance(form, LookupSeries)
    return series, form if name == "series" else lookup_table(
        series, tolerance=2e-5, most_values=1900
    )


@pytest.mark.parametrize("name", ["six seats", "series", "table"])
def test_the_lookup_gives_the_pretravel_of_the_map(name: str) -> None:
    """Text that the control evaluates against the map itself, in turned work coordinates: a
    formula to the nine printed decimals, a table to the error that it promises."""
    pretravel_map, form = form_of(name)
    normals = fibonacci_cap(25, 88.0 * DEGREE)
    calls = "\n".join(
        f"o<pretravel_lookup> call {' '.join(f'[{value:.15f}]' for value in n)}\n"
        "(PRINT,%.9f#<_value>)"
        for n in normals
    )
    trace = run(
        Machine(offsets={"G54": WorkOffset((1.0, 2.0, 3.0), TURN)}),
        f"G21 G54\n{calls}\nM2\n",
        subroutines=linuxcnc_subroutines(pretravel_map, form),
    )
    assert trace.error == ""
    c, s = np.cos(TURN * DEGREE), np.sin(TURN * DEGREE)
    machine = normals @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    truth = pretravel_map.pretravel(machine)
    assert np.ptp(truth) > 1e-3
    found = np.array([float(value) for value in trace.printed])
    assert found == pytest.approx(truth, abs=form.largest_error + 1e-9)


def test_six_seats_with_all_that_can_be_added_are_evaluated_as_stated() -> None:
    """A scale, a constant, a shift and a series: text on the control against the same in Python,
    to the nine printed decimals, for a tilted probe."""
    cosines, sines = np.zeros((4, 4)), np.zeros((4, 4))
    cosines[0, 0], cosines[2, 0], cosines[3, 3], sines[3, 1] = 1e-3, 4e-4, -5e-4, 3e-4
    band = Band(0.0, 100.0 * DEGREE)
    form = LookupSeats(
        probe_response(load_probe("omp40-2")), 0.8, 0.003, np.array([0.004, -0.005, 0.006]),
        LookupSeries(cosines, sines, band), band,
    )  # fmt: skip
    tilted = replace(mean_map(0.01), rotation=probe_rotation((0.28, 0.0, 0.96), 0.2))
    normals = fibonacci_cap(7, 75.0 * DEGREE)
    calls = "\n".join(
        f"o<pretravel_lookup> call {' '.join(f'[{value:.15f}]' for value in n)}\n"
        "(PRINT,%.9f#<_value>)"
        for n in normals
    )
    subroutines = linuxcnc_subroutines(tilted, form)
    trace = run(Machine(), f"G21 G54\n{calls}\nM2\n", subroutines=subroutines)
    assert trace.error == ""
    found = np.array([float(value) for value in trace.printed])
    assert found == pytest.approx(form.value(normals @ tilted.rotation), abs=1e-9)


def test_the_log_of_a_point_is_the_touch_that_was_asked_for(tmp_path: Path) -> None:
    """An oblique normal whose components all differ, on a ball, with a nominal point of its own:
    the lines of the log name them, and the touch lies where ball and tip say."""
    pretravel_map, form = form_of("series")
    normal = from_angles(50.0 * DEGREE, 200.0 * DEGREE)[0]
    nominal = 12.5 * normal + [1.0, -2.0, 3.0]
    values = " ".join(f"[{value:.15f}]" for value in (*nominal, *normal))
    text = (
        "G21 G90 G94 G54\n(LOGOPEN,points.log)\no<pretravel_head> call\n"
        f"o<pretravel_point> call {values} [100] [7] [2] [2] [1200] [1]\n(LOGCLOSE)\nM2\n"
    )
    place = nominal + 8.0 * normal
    trace = run(
        Machine(
            World((Ball((1.0, -2.0, 3.0), 12.5),)),
            position=(float(place[0]), float(place[1]), float(place[2])),
            acceleration=2000.0,
        ),
        text,
        probe=Probe(lambda n: float(simulated_pretravel(np.array([n]))[0])),
        subroutines=linuxcnc_subroutines(pretravel_map, form),
    )
    assert trace.error == ""
    log = tmp_path / "points.log"
    log.write_text("\n".join(trace.logs["points.log"]) + "\n")
    readings = read_own_log(log)
    touches = readings.touches
    assert touches.labels == ("p7",)
    # Parameters are printed with four decimals: directions in millionths, lengths in micrometres.
    assert touches.normals[0] == pytest.approx(normal, abs=1e-9)
    assert touches.approach_directions[0] == pytest.approx(-normal, abs=1e-9)
    assert touches.nominal_points is not None
    assert touches.nominal_points[0] == pytest.approx(nominal, abs=1e-6)
    assert touches.feeds is not None
    assert touches.feeds[0] == pytest.approx(100.0, rel=1e-6)
    travel = float(simulated_pretravel(normal[None])[0])
    assert touches.positions[0] == pytest.approx(nominal + (3.0 - travel) * normal, abs=1e-6)
    assert readings.compensated["p7"] == pytest.approx(nominal, abs=1e-6)
