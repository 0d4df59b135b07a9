"""Each field of a slide by hand, and its refusals from both sides of their limits."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from pretravel.base.directions import from_angles
from pretravel.base.errors import ConvergenceError, PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.design.probing.slide_history import SlideHistory
from pretravel.design.probing.slides import SlideSettings, slide
from pretravel.design.probing.tip import PredictedTip, predicted_tip
from pretravel.prediction.catalogue import load_probe
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.parametric import FunctionSurface
from pretravel.surface.shapes import Plane, Sphere
from tests.support.example_maps import mean_map

FOOT = np.array([4.0, -7.0, 2.0])


@cache
def _tip() -> PredictedTip:
    """Of a probe that is tilted by 10° and turned by 25°."""
    tilted = probe_rotation(from_angles(math.radians(10.0), 2.0)[0], rotation=math.radians(25.0))
    return predicted_tip(load_probe("omp40-2")).turned(tilted)


def _normal(process: str) -> np.ndarray:
    """Of a wall, across the axis of the tilted probe, or of a slope."""
    if process == "inclined":
        return from_angles(math.radians(50.0), 0.4)[0]
    normal = np.cross(_tip().rotation[:, 2], [0.3, -1.0, 0.2])
    return np.asarray(normal / np.linalg.norm(normal))


def _across(vector: np.ndarray) -> np.ndarray:
    axis = _tip().rotation[:, 2]
    return np.asarray(vector - (vector @ axis) * axis)


def _bent(normal: np.ndarray, force: float) -> float:
    """Deflection across the axis under a force along a normal. [mm]"""
    return float(np.linalg.norm(_across(_tip().deflection(normal[None], force)[0])))


def _trigger(process: str) -> tuple[float, float]:
    """Force and deflection across the axis at the trigger."""
    force = float(_tip().state(_normal(process)[None]).force[0])
    return force, _bent(_normal(process), force)


def _slid(process: str, step: float | None, steps: int, search: str = "steps") -> SlideHistory:
    """With each step checked: spindle on its way in, tip across the axis of it, ball on the plane,
    contact below it."""
    normal = _normal(process)
    settings = SlideSettings(step, steps, process=process, search=search)  # type: ignore[arg-type]
    h = slide(_tip(), Plane(FOOT, normal), (0.0, 0.0), settings)
    sine = np.linalg.norm(_across(normal))
    assert h.feed == pytest.approx(h.deflection * sine, rel=1e-12)
    assert h.spindle == pytest.approx(FOOT + (3.0 - h.feed[:, None]) * normal, abs=1e-12)
    moved = h.deflection[:, None] * _across(normal) / sine
    assert h.center - h.spindle == pytest.approx(moved, abs=1e-12)
    assert h.contact == pytest.approx(h.center - 3.0 * normal, abs=1e-12)
    assert (h.contact - FOOT) @ normal == pytest.approx(np.zeros(len(h)), abs=1e-12)
    assert h.normal == pytest.approx(np.repeat(normal[None], len(h), axis=0))
    assert h.start == pytest.approx(FOOT)
    assert h.step.tolist() == list(range(1, len(h) + 1))
    assert np.isnan(h.force).tolist() == h.triggered.tolist()
    below = ~h.triggered
    own = np.repeat(normal[None], int(below.sum()), axis=0) @ _tip().rotation
    assert h.reactions[below] == pytest.approx(_tip().response.reactions(own, h.force[below]))
    assert np.isnan(h.reactions[h.triggered]).all()
    assert h.search == search
    return h


def test_steps_of_force_on_a_slope() -> None:
    normal, (goal, limit) = _normal("inclined"), _trigger("inclined")
    h = _slid("inclined", goal / 3.5, 5)
    assert h.triggered.tolist() == [False, False, False, True, True]
    assert h.force[:3] == pytest.approx(goal / 3.5 * np.array([1.0, 2.0, 3.0]))
    bent = [_bent(normal, goal / 3.5 * k) for k in (1, 2, 3)]
    assert h.deflection == pytest.approx([*bent, limit, limit], rel=1e-12)
    assert h.trigger_feed == pytest.approx(limit * np.linalg.norm(_across(normal)))


def test_steps_of_deflection_on_a_wall() -> None:
    """The force of a deflection is found by itself; beyond the trigger the deflection goes on."""
    normal, (_, limit) = _normal("vertical"), _trigger("vertical")
    h = _slid("vertical", limit / 2.5, 4)
    assert h.triggered.tolist() == [False, False, True, True]
    assert h.deflection == pytest.approx(limit / 2.5 * np.arange(1, 5), rel=1e-12)
    for force, deflection in zip(h.force[:2], h.deflection[:2], strict=True):
        expected = brentq(lambda f, d=deflection: _bent(normal, f) - d, 0.0, 3.0, xtol=1e-13)
        assert force == pytest.approx(expected, rel=1e-9)
    assert h.trigger_feed == pytest.approx(limit)


@pytest.mark.parametrize(("share", "reached"), [(0.999, False), (1.001, True)])
@pytest.mark.parametrize("process", ["vertical", "inclined"])
def test_a_trigger_in_the_last_step_counts_and_one_beyond_it_does_not(
    process: str, share: float, reached: bool
) -> None:
    goal = _trigger(process)[process == "vertical"]
    h = _slid(process, share * goal / 3.0, 3)
    assert h.triggered.tolist() == [False, False, reached]
    assert math.isnan(h.trigger_feed) != reached


def test_a_force_is_searched_up_to_five_newtons() -> None:
    """The first trial is 0.382 of the range: 1.91 N; the second, of what is left, 0.73 N."""
    h = _slid("inclined", None, 3, "golden")
    second = 5.0 * (0.5 * (3.0 - math.sqrt(5.0))) ** 2
    assert h.triggered[:2].tolist() == [True, False]
    assert h.force[1] == pytest.approx(second, rel=1e-12)


def test_a_deflection_is_searched_up_to_all_steps() -> None:
    """The end of the search is the smallest value that triggered."""
    _, limit = _trigger("vertical")
    h = _slid("vertical", limit / 10.0, 20, "golden")
    assert h.deflection[0] == pytest.approx(2.0 * limit * 0.5 * (3.0 - math.sqrt(5.0)))
    assert limit <= h.trigger_feed < 2.0 * limit
    assert h.trigger_feed == pytest.approx(h.deflection[h.triggered].min())
    with pytest.raises(ConvergenceError, match="raise the step or the number of steps"):
        _slid("vertical", limit / 21.0, 20, "golden")
    _slid("vertical", limit / 19.9, 20, "golden")


@pytest.mark.parametrize(("degrees", "wall"), [(89.5, True), (89.2, False), (90.5, True)])
def test_a_wall_is_within_half_a_degree_of_the_axis(degrees: float, wall: bool) -> None:
    """The largest cosine is 0.01: 0.57°."""
    normal = from_angles(math.radians(degrees), 0.3)[0]
    plane, settings = Plane([0, 0, 0], normal), SlideSettings(process="vertical")
    if wall:
        assert len(slide("omp40-2", plane, (0.0, 0.0), settings)) == 20
    else:
        with pytest.raises(PretravelError, match=r"here the normal is 89\.2° from the probe axis"):
            slide("omp40-2", plane, (0.0, 0.0), settings)


def test_a_slide_without_settings_has_twenty_steps_of_a_micrometre() -> None:
    h = slide("omp40-2", Sphere([0, 0, 0], 10.0), (0.3, 0.7))
    assert h.feed == pytest.approx(1e-3 * np.arange(1, 21))
    assert (h.center - h.spindle)[:, 2] == pytest.approx(np.zeros(20), abs=1e-12)
    assert SlideSettings(process="vertical").step_size == 0.001
    assert SlideSettings(0.3, process="inclined").step_size == 0.3
    assert [SlideSettings(steps=steps).steps for steps in (1, 100_000)] == [1, 100_000]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"steps": 0}, "from 1 to 100000|steps"),
        ({"steps": 100_001}, "from 1 to 100000|steps"),
        ({"steps": "many"}, "steps"),
        ({"steps": math.nan}, "steps"),
        ({"step": 0.0}, "the step"),
        ({"process": "odd"}, "there are curved, inclined, vertical"),
        ({"search": "odd"}, "there are steps, golden"),
        ({"kinematics": "odd"}, "there are lateral, full"),
        ({"kinematics": "full", "process": "vertical"}, "full kinematics are for"),
        ({"kinematics": "full", "process": "inclined"}, "full kinematics are for"),
        ({"search": "golden"}, "golden section search is for vertical and inclined"),
    ],
)
def test_settings_that_cannot_be(settings: dict[str, object], words: str) -> None:
    with pytest.raises(PretravelError, match=words):
        SlideSettings(**settings)  # type: ignore[arg-type]


def test_a_slide_starts_on_a_surface_with_a_normal() -> None:
    patch = FunctionSurface(lambda u, v: (u, v, 0.1 * u), (-1.0, 1.0), (-2.0, 2.0))
    with pytest.raises(PretravelError, match=r"u, v = 1\.1, 0 is not on the surface"):
        slide("omp40-2", patch, (1.1, 0.0))
    assert len(slide("omp40-2", patch, (0.9, 0.0), SlideSettings(steps=1))) == 1
    folded = FunctionSurface(lambda u, v: (0.0 * u, v, 0.0 * u), (-1.0, 1.0), (-2.0, 2.0))
    with pytest.raises(PretravelError, match=r"no normal at u, v = 0, 0"):
        slide("omp40-2", folded, (0.0, 0.0))
    with pytest.raises(PretravelError, match="a map contains no forces"):
        slide(mean_map(0.01), patch, (0.0, 0.0))  # type: ignore[arg-type]


def test_a_tip_that_leaves_the_surface_is_told_with_its_step(tmp_path: Path) -> None:
    """On a slope of 45° a stylus that gives only sideways slides down as far as it is fed: 1 µm in
    each step, of 10.5 µm to the lower edge."""
    from netgen.occ import Axis, Box, Y

    block = Box((0, 0, 0), (20, 20, 5)).Rotate(Axis((0, 0, 0), Y), 45)
    block.WriteStep(str(tmp_path / "slope.step"))
    normal = np.array([1.0, 0.0, 1.0]) / math.sqrt(2.0)
    down = np.array([1.0, 0.0, -1.0]) / math.sqrt(2.0)
    start = 5.0 * normal + (20.0 - 0.0105) * down + [0.0, 10.0, 0.0]
    faces = read_step_part(tmp_path / "slope.step").faces
    (slope,) = (f for f in faces if f.local(f.samples(5.0)).normal[0] @ normal > 0.999)
    at = tuple(slope.nearest(start[None])[0].tolist())
    assert slope.local(np.array([at])).point[0] == pytest.approx(start)
    assert len(slide("omp40-2", slope, at, SlideSettings(1e-3, 10))) == 10
    for kinematics, number in (("lateral", "11"), ("full", r"\d+")):
        settings = SlideSettings(1e-3, 20, kinematics=kinematics)
        with pytest.raises(PretravelError, match=f"step {number}: the tip has left the surface"):
            slide("omp40-2", slope, at, settings)


@pytest.mark.parametrize("kinematics", ["lateral", "full"])
def test_a_step_beyond_the_surface_s_end_has_no_tangent_ball(kinematics: str) -> None:
    """A slope that is known up to its end alone, as far away as fifteen steps."""
    slope = FunctionSurface(lambda u, v: (u, v, -u), (-1.0, 1.0), (-1.0, 1.0))
    at, near = (1.0 - 0.0102, 0.0), SlideSettings(1e-3, 15, kinematics=kinematics)
    with pytest.raises(ConvergenceError, match="step 15: no place of the ball on its way"):
        slide("omp40-2", slope, at, near)
