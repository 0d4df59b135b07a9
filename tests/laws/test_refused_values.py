"""Law of value types and functions: what cannot be is refused, and the message says why."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import PretravelError
from pretravel.controls.control_table import TableSettings
from pretravel.controls.exports import table_travel
from pretravel.controls.heidenhain import heidenhain_table
from pretravel.controls.renishaw import renishaw_variables
from pretravel.design.fem.linear_solvers import factorise
from pretravel.design.identification.free_numbers import free_numbers
from pretravel.design.probing.slide_one_normal import _golden_section
from pretravel.design.probing.slides import SlideSettings, slide
from pretravel.laboratory.rig.budget import LengthComponent, constant_and_slope, length_budget
from pretravel.laboratory.rig.trace import RigTrace
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings, RepeatedPair
from pretravel.laboratory.separation.plan import plan_separation
from pretravel.laboratory.separation.separation import separate
from pretravel.maps.kinds.averaged import averaged_map
from pretravel.maps.kinds.wozniak import wozniak_constant
from pretravel.maps.sector_tables import resampled_sectors
from pretravel.maps.support import DirectionSupport
from pretravel.prediction.compliance.base import compliance_model
from pretravel.qualification.probe_drift import ProbeDrift
from pretravel.qualification.touch_plan import plan_touches
from pretravel.six_seats.event import watched_loads
from pretravel.six_seats.hertz import approach_coefficient, ball_on_flat, ellipticity
from pretravel.six_seats.six_seat_basis import SixSeatBasis
from pretravel.six_seats.uneven_seats import PARAMETERS
from pretravel.surface.parametric import Convex
from pretravel.surface.shapes import Sphere
from pretravel.surface.shapes_of_revolution import Cone
from pretravel.surface.specification import surface_of
from pretravel.surface.spline import SplineSurface
from pretravel.touches.targets import Targets
from pretravel.uncertainty.covariance import Covariance
from tests.support.errors_by_trials import map_by_trials
from tests.support.example_maps import lobes

MAP = lobes(3)
UNCERTAIN = replace(MAP, covariance=Covariance.independent([1e-8] * 3), repeatability=3e-4)
N = fibonacci_cap(12, 1.2)
TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
TIME = np.arange(200) * 1e-3
LOW = np.zeros(200, dtype=bool)
PAIRS = np.divmod(np.arange(16), 4)
ONE_LARGE = np.where(np.arange(len(PARAMETERS)) == 2, 51.0, 0.0)


def _trace(time: np.ndarray = TIME, ruler: np.ndarray = TIME, laser: np.ndarray = TIME) -> RigTrace:
    return RigTrace(time, ruler, laser, LOW[: len(time)], LOW[: len(time)], "a_0_1")


def _some_nan(values: np.ndarray) -> np.ndarray:
    """All but one value are sound: a check of "any" would let it pass."""
    changed = np.array(values, dtype=np.float64)
    changed.flat[1] = math.nan
    return changed


def _spline(weight: float) -> SplineSurface:
    knots, poles = np.array([0.0, 0.0, 1.0, 1.0]), np.zeros((2, 2, 3))
    return SplineSurface(knots, knots, poles, np.array([[1.0, 1.0], [1.0, weight]]), (1, 1))


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "one parameter of a six-seat probe": (lambda: SixSeatBasis(ONE_LARGE, 3.0), "of usual size"),
    "parameters of a six-seat probe": (lambda: SixSeatBasis(np.zeros(3), 3.0), "parameters, log"),
    "compliance model": (lambda: compliance_model("steel"), "model 'steel' is not known; there"),
    "trigger criterion": (lambda: watched_loads(np.ones((1, 6)), "last"), "criterion 'last' is"),
    "force of a ball": (lambda: ball_on_flat([1.0, -1.0], 1.0, 2e5), "carries no tension"),
    "curvatures below one": (lambda: ellipticity([1.0, 0.5]), "a ratio between 1 and a million"),
    "curvatures far apart": (lambda: ellipticity([1.0, 1e6]), "a ratio between 1 and a mil"),
    "order of radii": (lambda: approach_coefficient([2.0, 1.0], [1.0, 2.0], 2e5), "larger one f"),
    "a negative radius": (lambda: approach_coefficient([2.0, 2.0], [1.0, 0.0], 2e5), "be positive"),
    "sparse solver": (lambda: factorise(np.eye(2), "cramer"), "solver 'cramer'"),
    "process of a slide": (lambda: SlideSettings(process="round"), "process 'round' is unknown"),
    "search of a slide": (lambda: SlideSettings(search="silver"), "search 'silver' is unknown"),
    "kinematics of a slide": (lambda: SlideSettings(kinematics="half"), "kinematics 'half' is"),
    "no steps of a slide": (lambda: SlideSettings(steps=0), "0 steps; the number must be from 1"),
    "many steps of a slide": (lambda: SlideSettings(steps=100_001), "100001 steps; the number"),
    "slide with a map": (lambda: slide(MAP, Sphere([0, 0, 0], 5.0), (0, 0)), "needs a described"),
    "golden section that ends early": (lambda: _golden_section(2.0, 1.0, 5), "the search ends at"),
    "shapes of targets": (lambda: Targets(np.zeros((3, 3)), N[:2]), r"shape \(3, 3\) and normals"),
    "size of a convex surface": (lambda: Convex(a=0.0), "a = 0 mm must be positive"),
    "infinite convex surface": (lambda: Convex(a=math.inf), "a = inf mm must be positive"),
    "offset of a convex surface": (lambda: Convex(b=math.inf), "b finite"),
    "axes of a shape": (
        lambda: Cone([0, 0, 0], 1.0, 0.5, np.diag([1.0, 1.0, 0.9])), "three perpendicular"
    ),
    "number of axes": (lambda: Cone([0, 0, 0], 1.0, 0.5, np.eye(3)[:2]), "three perpend"),
    "radius of a cone": (lambda: Cone([0, 0, 0], -1.0, 0.5), "cannot be negative, got -1 mm"),
    "infinite cone": (lambda: Cone([0, 0, 0], math.inf, 0.5), "cannot be negative, got inf"),
    "angle of a cone": (lambda: Cone([0, 0, 0], 1.0, 0.5 * math.pi), "between 0 and 90 degrees"),
    "surface": (lambda: surface_of(3.0), "a surface is needed, not a float"),  # type: ignore[arg-type]
    "weight of a spline": (lambda: _spline(0.0), "weights of a rational surface must be positive"),
    "infinite weight": (lambda: _spline(math.inf), "weights of a rational surface must be"),
    "averaged frames": (
        lambda: averaged_map([MAP, replace(MAP, rotation=TURNED)], [np.zeros(3)] * 2, [0.5, 0.5]),
        "different frames",
    ),
    "transducer": (lambda: wozniak_constant(1.9, 4.0, transducer="disc"), "'disc' is not known"),
    "calibrated radius": (lambda: wozniak_constant(2.1, 4.0), "larger than that of the tip, 2 mm"),
    "criterion of sectors": (lambda: resampled_sectors(MAP, "median"), "'median' is not known"),
    "no support": (lambda: DirectionSupport(np.empty((0, 3))), "at least one direction"),
    "support from below": (
        lambda: DirectionSupport([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]), "above 170° cannot be mapped"
    ),
    "coefficients of a map": (
        lambda: replace(MAP, coefficients=MAP.coefficients[:-1]), "coefficients, got"
    ),
    "covariance of a map": (
        lambda: replace(MAP, covariance=Covariance.none(MAP.basis.size + 1)),
        f"of {MAP.basis.size + 1} coefficients; the map has {MAP.basis.size}",
    ),
    "effect of a delay": (
        lambda: replace(MAP, delay_effect=_some_nan(np.zeros(MAP.basis.size))), "finite numbers"
    ),
    "effects of a delay": (lambda: replace(MAP, delay_effect=np.zeros(1)), "finite numbers, got"),
    "drift": (lambda: ProbeDrift(turn=-0.1), "the drift of turn is -0.1; it cannot be negative"),
    "endless drift": (lambda: ProbeDrift(form=math.inf), "the drift of form is inf; it cannot"),
    "few planned touches": (lambda: plan_touches(UNCERTAIN, 4), "4 touches are too few"),
    "many planned touches": (lambda: plan_touches(UNCERTAIN, 300), "more than a choice of"),
    "trials": (lambda: map_by_trials(MAP, N, trials=1), "1 trials do not make a distribution"),
    "samples of a rig": (lambda: _trace(TIME[:99], TIME[:99], TIME[:99]), "99 samples are too few"),
    "ruler of a rig": (lambda: _trace(ruler=_some_nan(TIME)), "ruler is not finite in every row"),
    "clock of a rig": (lambda: _trace(np.r_[TIME[:150], TIME[:50]]), "forward at sample 151"),
    "rod of a rig": (lambda: _trace(ruler=0.0 * TIME), "rod"),
    "length of a budget": (lambda: length_budget([], -1.0), "the length is -1 mm; it must not"),
    "both parts of a source": (
        lambda: constant_and_slope([LengthComponent("a", "B", 1e-3, 1e-6)]), "a constant part and"
    ),
    "half an index": (lambda: MultiStepReadings([0.5, 1], [0, 1], [0, 0]), "machine indices must"),
    "shapes of readings": (lambda: MultiStepReadings([0, 1], [0, 1], [0.0]), "three arrays of"),
    "number of errors": (lambda: MultiStepReadings([0], [0, 1], [0.0]), "three arrays of"),
    "a reading": (lambda: MultiStepReadings(*PAIRS, _some_nan(np.zeros(16))), "must be finite"),
    "few readings": (lambda: MultiStepReadings([0, 0, 1], [0, 1, 0], [0, 0, 0]), "3 readings are"),
    "variance of repeats": (lambda: RepeatedPair(0, 0, 0.0), "0 µm²; it must be positive"),
    "number of repeats": (lambda: RepeatedPair(0, 0, 1e-6, 1), "1 repeat does not determine"),
    "method of separation": (
        lambda: separate(MultiStepReadings(*PAIRS, np.zeros(16)), method="best"),  # type: ignore[arg-type]
        "method 'best' is not known; there are",
    ),
    "readings to leave out": (
        lambda: separate(MultiStepReadings(*PAIRS, 1e-3 * np.arange(16.0)), exclude=[(9, 9)]),
        "no reading of machine direction 9 with probe direction 9 to exclude",
    ),
    "readings without scatter": (
        lambda: separate(MultiStepReadings(*PAIRS, np.zeros(16))), "no scatter"
    ),
    "two directions": (lambda: plan_separation(2, 1e-6, u_error=1e-3), "directions is 2; it must"),
    "many directions": (lambda: plan_separation(73, 1e-6, u_error=1e-3), "directions is 73; it"),
    "expected variance": (lambda: plan_separation(12, 0.0, u_error=1e-3), "it must be positive"),
    "no requirement": (lambda: plan_separation(12, 1e-6), "no uncertainty is required"),
    "required errors": (lambda: plan_separation(12, 1e-6, u_error=0.0), "of the errors is 0; it"),
    "required variances": (
        lambda: plan_separation(12, 1e-6, u_variance=0.0), "of the variances is 0; it must"
    ),
    "requirement out of reach": (
        lambda: plan_separation(4, 1e-6, u_error=1e-6), "no test with up to 4 orientations and 50"
    ),
    "no free number": (lambda: free_numbers([]), "no number is free; there are"),
    "unknown free number": (lambda: free_numbers(["colour"]), "'colour' cannot be identified"),
    "free number twice": (lambda: free_numbers(["preload", "preload"]), "is named twice"),
    "units of a table": (lambda: TableSettings(units="foot"), "units 'foot': a table is in mm or"),
    "travel of a table": (lambda: TableSettings(travel=math.inf), "inf mm: it must be finite"),
    "feed without a delay": (lambda: table_travel(MAP, 100.0), "this map contains none"),
    "delay without a feed": (
        lambda: table_travel(replace(MAP, delay=1e-3), None),
        "1.000 ms, which a table contains for one feed",
    ),
    "step of a table": (lambda: heidenhain_table(MAP, step_deg=0.0), "a step of 0° of the polar"),
    "angles of a setter": (lambda: renishaw_variables(MAP, angles="both"), "angles 'both': they"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_with_the_reason(case: str) -> None:
    function, reason = REFUSED[case]
    with pytest.raises(PretravelError, match=reason):
        function()
