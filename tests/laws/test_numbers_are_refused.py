"""Law of the public functions: a number that no probe or machine has is refused with a reason."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pretravel
from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import PretravelError
from pretravel.files.file_format import ReadingOptions
from pretravel.files.machine import Machine
from pretravel.laboratory.rig.trace import RigTouch
from pretravel.laboratory.separation.plan import plan_separation
from pretravel.laboratory.standards.standard_check import CalibratedSphere
from pretravel.measurement.points import Points
from tests.support.example_maps import lobes
from tests.support.monte_carlo import Input
from tests.unit.qualification.test_verification import old_map, touches

BAD = (math.nan, math.inf, -math.inf, 1e308, 10**400)
"""Of all quantities: not finite, beyond what exists, an integer that is too large for a float."""
NEGATIVE = (-1.0,)

N = fibonacci_cap(20, 1.4)
POINTS = 12.5 * N
TOUCHES = pretravel.Touches(15.49 * N, N)
SURFACE = pretravel.parse_surface("sphere:radius=12.5")
MAP = lobes(3)
U = 1e-6 * np.eye(2)
RIG = [
    RigTouch(f"rig_{a:03d}_{k}", 0.0, 3e-3 + k * 1e-5, 8e-3, 4e-4, 1e-5, 2e-5, 3e-5, 0, 0, 3.0, ())
    for a in (0, 90, 180, 270)
    for k in (1, 2, 3)
]


def _map(**changes: Any) -> Any:
    given = {field.name: getattr(MAP, field.name) for field in fields(MAP)}
    return pretravel.PretravelMap(**{**given, "delay": 0.001, "feed": 50.0, **changes})


def _points(points: np.ndarray) -> Points:
    return pretravel.apply(pretravel.Touches(points, N), MAP, extrapolate=True)


CASES: dict[str, tuple[Callable[..., Any], dict[str, Any], str]] = {
    # name: function, sound numbers, those of them that may be negative
    "QualificationSetup": (
        pretravel.QualificationSetup,
        {"diameter": 25.0, "tip_diameter": 6.0, "u_diameter": 1e-3, "u_temperature": 0.2,
         "sphere_form": 1e-4, "axial_pretravel": 1e-3},
        "axial_pretravel",
    ),
    "qualify": (
        lambda **given: pretravel.qualify(TOUCHES, **given, kind="mean"),
        {"diameter": 25.0, "tip_diameter": 6.0, "u_diameter": 1e-3, "u_temperature": 0.2,
         "sphere_form": 1e-4},
        "",
    ),
    "apply": (
        lambda **given: pretravel.apply(TOUCHES, MAP, extrapolate=True, **given),
        {"u_friction": 0.1},
        "",
    ),
    "verify": (
        lambda **given: pretravel.verify(touches(1), old_map(), **given),
        {"diameter": 25.0, "false_alarm_rate": 0.01},
        "",
    ),
    "PretravelMap": (
        _map,
        {"tip_radius": 3.0, "u_tip_radius": 1e-3, "repeatability": 1e-3, "fixed_scatter": 1e-3,
         "feed": 50.0, "delay": 1e-3, "u_delay": 1e-3},
        "delay",
    ),
    "WozniakKind": (pretravel.WozniakKind, {"lobe_azimuth": 1.0}, "lobe_azimuth"),
    "Latch": (
        pretravel.Latch,
        {"feed": 50.0, "delay": 0.001, "noise": 1e-4},
        "",
    ),
    "touch": (
        lambda **given: pretravel.touch(
            pretravel.load_probe("omp40-2"), SURFACE, pretravel.Targets(POINTS, N), **given
        ),
        {"clearance": 2.0},
        "",
    ),
    "SlideSettings": (pretravel.SlideSettings, {"step": 1e-3, "steps": 20}, ""),
    "plan_inspection": (
        lambda **given: pretravel.plan_inspection(
            SURFACE,
            **{name: value for name, value in given.items() if name == "spacing"},
            region=pretravel.InspectionRegion(
                **{name: value for name, value in given.items() if name != "spacing"}
            ),
        ),
        {"spacing": 5.0, "margin": 1.0, "max_polar": 1.5},
        "",
    ),
    "MeshSettings": (
        pretravel.MeshSettings,
        {"refinement": 1.0, "body": 5.0, "interface": 1.0, "patch": 0.1, "patch_radius": 0.3,
         "grading": 0.3},
        "",
    ),
    "friction_cycle": (
        lambda **given: pretravel.friction_cycle(
            pretravel.load_probe("omp40-2"), N[:1], steps=30, cycles=1, **given
        ),
        {"friction": 0.1, "overtravel": 0.01},
        "",
    ),
    "measure_feature": (
        lambda u_machine: pretravel.measure_feature(_points(POINTS), "sphere", u_machine=u_machine),
        {"u_machine": 1e-3},
        "",
    ),
    "FeatureTolerances": (
        pretravel.FeatureTolerances,
        {"position": 0.1, "form": 0.1, "probability": 0.95},
        "",
    ),
    "size_conformity": (
        lambda **given: pretravel.size_conformity("d", **given, limits=(19.0, 21.0)),
        {"value": 20.0, "u": 1e-3, "required": 0.95},
        "value",
    ),
    "position_conformity": (
        lambda tolerance, required: pretravel.position_conformity(
            np.zeros(2), U, tolerance, required
        ),
        {"tolerance": 0.1, "required": 0.95},
        "",
    ),
    "RepeatedPair": (
        lambda **given: pretravel.RepeatedPair(1, 1, **given),
        {"variance": 1e-6, "count": 10},
        "",
    ),
    "plan_separation": (
        lambda variance, u_error: plan_separation(12, variance, u_error=u_error, u_variance=None),
        {"variance": 1e-6, "u_error": 1e-3},
        "",
    ),
    "CalibratedSphere": (
        CalibratedSphere,
        {"diameter": 25.0, "u_diameter": 1e-3, "form": 1e-4},
        "",
    ),
    "Input": (
        Input,
        {"estimate": 1.0, "standard_uncertainty": 0.1},
        "estimate",
    ),
    "Machine": (
        lambda **given: Machine(tool=1, **given),
        {"tool_length": 100.0, "tip_diameter": 6.0, "stem_diameter": 4.5, "stylus_length": 50.0,
         "body_diameter": 40.0, "measuring_feed": 50.0, "positioning_feed": 1000.0,
         "travel_feed": 1000.0, "acceleration": 500.0, "safe_height": 50.0, "start_distance": 2.0,
         "overtravel": 2.0, "clearance": 1.0, "change_height": 100.0},
        "tool_length safe_height change_height",
    ),
    "plan_program": (
        lambda feed: pretravel.plan_program(
            pretravel.Targets(np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]])),
            Machine(), title="t", feeds=[feed],
        ),
        {"feed": 50.0},
        "",
    ),
    "SphereObstacle": (
        lambda **given: pretravel.SphereObstacle(np.zeros(3), **given),
        {"radius": 12.5, "shank_diameter": 5.0},
        "",
    ),
    "ReadingOptions": (
        ReadingOptions,
        {"tip_radius": 3.0, "overtravel": 2.0, "radius_taken_off": 3.0, "rotation": 0.1,
         "reference_diameter": 25.0},
        "rotation",
    ),
    "with_feed": (lambda feed: TOUCHES.with_feed(feed), {"feed": 50.0}, ""),
    "Touches": (
        lambda x, nominal: pretravel.Touches(
            np.array([[x, 0.0, 0.0]]), N[:1], nominal_points=np.array([[nominal, 0.0, 0.0]])
        ),
        {"x": 1.0, "nominal": 1.0},
        "x nominal",
    ),
    "Touches.feeds": (
        lambda feed: pretravel.Touches(POINTS[:1], N[:1], feeds=np.array([feed])),
        {"feed": 50.0},
        "",
    ),
    "Targets": (
        lambda x: pretravel.Targets(np.array([[x, 0.0, 0.0]]), N[:1]),
        {"x": 1.0},
        "x",
    ),
    "embed": (
        lambda x: pretravel.embed(np.array([[x, 0.0, 0.0]]), N[:1], MAP),
        {"x": 1.0},
        "x",
    ),
    "predict": (
        lambda x: pretravel.predict(pretravel.load_probe("omp40-2"), np.array([[x, 0.0, 1.0]])),
        {"x": 0.0},
        "x",
    ),
    "Placement": (
        lambda x: pretravel.Placement(shift=np.array([x, 0.0, 0.0])),
        {"x": 1.0},
        "x",
    ),
    "calibrate_rig": (
        lambda probability: pretravel.calibrate_rig(RIG, probability=probability),
        {"probability": 0.95},
        "",
    ),
    **{
        f"fit_{shape}": (
            lambda x, fit=getattr(pretravel, f"fit_{shape}"): fit(
                np.concatenate([POINTS, [[x, 0.0, 12.0]]])
            ),
            {"x": 1.0},
            "x",
        )
        for shape in ("sphere", "plane")
    },
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_sound_numbers_are_accepted(name: str) -> None:
    function, sound, _ = CASES[name]
    function(**sound)


@pytest.mark.parametrize(
    ("name", "parameter", "value"),
    [
        (name, parameter, value)
        for name, (_, sound, signed) in CASES.items()
        for parameter in sound
        for value in (*BAD, *(() if parameter in signed.split() else NEGATIVE))
    ],
    ids=lambda value: str(value)[:8],
)
def test_others_are_refused(name: str, parameter: str, value: float) -> None:
    function, sound, _ = CASES[name]
    with pytest.raises(PretravelError):
        function(**{**sound, parameter: value})


@pytest.mark.parametrize("ending", ["msr", "qif"])
@pytest.mark.parametrize("radius", [*BAD, *NEGATIVE])
def test_no_file_gets_a_tip_that_none_has(tmp_path: Path, ending: str, radius: float) -> None:
    with pytest.raises(PretravelError, match="tip's radius"):
        pretravel.write_readings(tmp_path / f"t.{ending}", TOUCHES, tip_radius=radius)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("column", "value"),
    [
        (column, value)
        for column in (
            "u_um",
            "u_tip_radius_um",
            "repeatability_um",
            "feed_mm_min",
            "tip_radius_mm",
        )
        for value in ("-1", "nan", "inf", "1e308")
    ],
)
def test_a_table_of_a_map_has_numbers_of_a_probe(tmp_path: Path, column: str, value: str) -> None:
    """Negative, not finite or absurd numbers of a map as CSV."""
    path = tmp_path / "map.csv"
    pretravel.write_map(path, MAP)
    lines = path.read_text().splitlines()
    names = lines[0].split(",")
    if column not in names:
        lines = [lines[0] + f",{column}", *(f"{line},{value}" for line in lines[1:])]
    else:
        place = names.index(column)
        for row in range(1, len(lines)):
            cells = lines[row].split(",")
            lines[row] = ",".join([*cells[:place], value, *cells[place + 1 :]])
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(PretravelError):
        pretravel.read_map(path)
