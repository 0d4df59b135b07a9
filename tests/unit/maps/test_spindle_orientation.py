"""The orientation of the spindle, stated by touches and maps, from both sides of each condition."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.departures.evaluation import Job, scene_of
from benchmarks.departures.machine import latched, reference_run
from benchmarks.departures.patterns import USUAL_25
from pretravel.base.errors import PretravelError
from pretravel.files.map_file import read_map, write_map
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Origin, Provenance
from pretravel.maps.spindle_orientation import orientation_note, orientation_of, turned_to
from pretravel.measurement.compensation import apply
from pretravel.measurement.points_summary import TouchSummary
from pretravel.measurement.scatter_on_part import ScatterOnPart, ScatterSums
from pretravel.qualification.change_causes import Cause
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.qualifying import qualify
from pretravel.qualification.verification import verify
from pretravel.touches import Touches
from tests.support.example_maps import mean_map


@cache
def _qualified(at: float | None) -> PretravelMap:
    touches = _reference()
    stated = touches if at is None else touches.with_spindle(np.radians(at))
    return qualify(stated, 25.0, tip_diameter=6.0, kind="harmonic").pretravel_map


@cache
def _reference() -> Touches:
    return scene_of(Job("baseline", 4, "harmonic")).reference_touches


@pytest.mark.long
def test_a_map_states_the_orientation_of_its_touches(tmp_path: Path) -> None:
    assert _qualified(None).provenance.spindle_deg is None
    made = _qualified(180.0)
    assert made.provenance.spindle_deg == 180.0
    write_map(tmp_path / "map.json", made)
    assert read_map(tmp_path / "map.json").provenance.spindle_deg == 180.0
    for wrong in ("180", True, [180.0]):
        stated = replace(made.provenance, spindle_deg=wrong)  # type: ignore[arg-type]
        write_map(tmp_path / "wrong.json", replace(made, provenance=stated))
        with pytest.raises(PretravelError, match="spindle_deg must be"):
            read_map(tmp_path / "wrong.json")


def test_touches_at_several_orientations_are_not_one_map() -> None:
    """M19 stops within less than a degree; 359.5° and 0.2° are one orientation."""
    touches = _reference()
    near = np.radians(np.where(np.arange(len(touches)) % 2, 359.5, 0.2))
    assert orientation_of(replace(touches, spindle=near)) == pytest.approx(0.2)
    several = replace(touches, spindle=np.radians(np.where(np.arange(len(touches)) < 40, 0.0, 180)))
    with pytest.raises(PretravelError, match=r"touch 41 was made at spindle 180°.*turn with the"):
        qualify(several, 25.0, tip_diameter=6.0)


@pytest.mark.parametrize("command", [
    lambda touches, made: apply(touches, made),
    lambda touches, made: verify(touches, made, 25.0),
    lambda touches, made: update_map(touches, made, 25.0),
])  # fmt: skip
def test_another_orientation_is_refused(command) -> None:  # type: ignore[no-untyped-def]
    made, touches = _qualified(0.0), scene_of(Job("baseline", 4, "harmonic")).later_touches
    command(touches.with_spindle(np.radians(-0.9)), made)
    command(touches, made)
    with pytest.raises(
        PretravelError, match=r"spindle turned to 180° \(75 such touches\), the map"
    ):
        command(touches.with_spindle(np.pi), made)


def test_touches_at_several_orientations_are_not_of_a_map_that_states_none() -> None:
    made, touches = _qualified(None), scene_of(Job("baseline", 4, "harmonic")).later_touches
    turns = np.radians(np.where(np.arange(len(touches)) < 40, 0.0, 180.0))
    apply(touches.with_spindle(np.pi), made)
    with pytest.raises(PretravelError, match=r"turns between the touches \(to 180° at"):
        apply(replace(touches, spindle=turns), made)


@pytest.mark.parametrize(
    ("of_map", "of_touches"),
    [
        ({"orientation": "A0B0"}, {"orientations": "A90B0"}),
        ({"orientation": "0 0"}, {"orientations": "90 0"}),
        ({"orientation": "down"}, {"orientations": "front"}),
        ({"tip": "T1A0B0"}, {"tips": "T2A90B-45"}),
        ({"tip": "T1A0B0"}, {"orientations": "A90 B0"}),
        ({}, {"tips": "T1A0B0", "orientations": "A90 B0"}),
    ],
)
def test_a_turned_head_is_refused(of_map: dict[str, str], of_touches: dict[str, str]) -> None:
    made, touches = _qualified(None), scene_of(Job("baseline", 4, "harmonic")).later_touches
    stated = replace(made, provenance=replace(made.provenance, **of_map))
    words = {name: (word,) * len(touches) for name, word in of_touches.items()}
    alone = len(words) == 1  # else the touches contradict themselves
    refused = "are of the orientation .*the head has turned" if alone else "head other angles"
    for command in (apply, lambda t, m: verify(t, m, 25.0), lambda t, m: update_map(t, m, 25.0)):
        if alone:
            command(replace(touches, **words), made)
        with pytest.raises(PretravelError, match=refused):
            command(replace(touches, **words), stated)
    if not alone:
        with pytest.raises(PretravelError, match=refused):
            qualify(replace(_reference(), **{n: (w[0],) * 75 for n, w in words.items()}), 25.0)


@pytest.mark.parametrize(
    ("mine", "other", "refused"),
    [
        ("T1", "T2", True),
        ("T1", "t1", False),
        ("T1", "T1A0B0", False),
        ("T05", "tool 5", False),
        ("T50", "5", True),
        ("", "T2", False),
        ("T1", "", False),
    ],
)
def test_a_tip_of_another_name_is_refused(mine: str, other: str, refused: bool) -> None:
    touches = scene_of(Job("baseline", 4, "harmonic")).later_touches
    stated = replace(touches, tips=(mine,) * len(touches)) if mine else touches
    made = replace(_qualified(None), provenance=Provenance(Origin.QUALIFIED, tip=other))
    for command in (apply, lambda t, m: verify(t, m, 25.0), lambda t, m: update_map(t, m, 25.0)):
        if refused:
            with pytest.raises(PretravelError, match=f"of tip {mine}, the map is of tip {other}"):
                command(stated, made)
        else:
            command(stated, made)


@pytest.mark.parametrize(
    ("of_map", "of_touches", "told"),
    [
        ({"orientation": "A0B0"}, {}, "the map is of the orientation A0B0, the touches state none"),
        ({}, {"tips": "T2A90B0"}, "are of the orientation T2A90B0, the map states none"),
        ({"orientation": "A0B0"}, {"orientations": "A0 B0"}, ""),
        ({"tip": "T1"}, {}, ""),
        ({"spindle_deg": 90.0}, {}, "the map is of spindle 90°, the touches have no orientation"),
    ],
)
def test_a_head_that_one_side_states_is_named(
    of_map: dict[str, str | float], of_touches: dict[str, str], told: str
) -> None:
    touches = scene_of(Job("baseline", 4, "harmonic")).later_touches
    words = {name: (word,) * len(touches) for name, word in of_touches.items()}
    made, stated = _qualified(None), replace(touches, **words)
    made = replace(made, provenance=replace(made.provenance, **of_map))
    summary = TouchSummary.of(stated, apply(stated, made), made)
    for said in (
        [*summary.warnings(made), *summary.notes(made)],
        update_map(stated, made, 25.0).warnings,
    ):
        heads = [
            each
            for each in said
            if re.search("if the head was turned|the map is of spindle", each, re.I)
        ]
        assert len(heads) == bool(told)
        assert all(told.lower() in each.lower() for each in heads)


def test_a_map_states_the_tip_and_the_head_of_its_touches() -> None:
    touches = _reference()
    words = {"tips": ("T1",) * len(touches), "orientations": ("A0B0",) * len(touches)}
    made = qualify(replace(touches, **words), 25.0, tip_diameter=6.0, kind="mean")
    tilted = qualify(
        replace(touches, tips=("T1A90B0",) * len(touches)), 25.0, tip_diameter=6.0, kind="mean"
    )
    for found, expected in ((made, False), (tilted, True)):
        assert any("the head was tilted by 90°" in said for said in found.warnings) is expected
    assert (made.pretravel_map.provenance.tip, made.pretravel_map.provenance.orientation) == (
        "T1", "A0B0",
    )  # fmt: skip


def test_a_turned_map_is_that_of_the_turned_probe() -> None:
    """By a quarter of a turn, x becomes y."""
    made = _qualified(30.0)
    turned = turned_to(made, 120.0)
    normals = np.array([[0.6, 0.0, 0.8], [0.0, 0.8, 0.6]])
    after = normals[:, [1, 0, 2]] * [-1.0, 1.0, 1.0]
    assert turned.pretravel(after) == pytest.approx(made.pretravel(normals), rel=1e-9)
    assert np.abs(turned.pretravel(normals) - made.pretravel(normals)).max() > 1e-3
    assert turned.provenance.spindle_deg == 120.0
    with pytest.raises(PretravelError, match="how far to turn it is not known"):
        turned_to(_qualified(None), 120.0)


def test_what_is_not_stated_is_said_once() -> None:
    """Where lobes are larger than U: the largest change of the map by half a turn is stated."""
    none, made = _qualified(None), _qualified(180.0)
    assert orientation_note(made, stated=True) == ""
    assert orientation_note(none, stated=False).startswith("no column spindle_deg")
    assert orientation_note(made, stated=False).startswith(
        "the map is of spindle 180°, the touches"
    )
    note = orientation_note(none, stated=True)
    assert note.startswith("the touches give the orientation of the spindle, the map does not")
    azimuth = np.radians(np.arange(0.0, 360.0, 5.0))
    ring = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
    half = none.pretravel(ring, extrapolate=True) - none.pretravel(-ring, extrapolate=True)
    said = float(note.split("up to ")[1].split(" µm")[0])
    assert said == pytest.approx(1e3 * np.abs(half).max(), rel=0.3)
    round_map = replace(mean_map(0.01), provenance=Provenance(origin=Origin.QUALIFIED))
    assert orientation_note(round_map, stated=False) == ""
    twice = ScatterOnPart(repeats=ScatterSums(1e-7, 1e-7, 1.0))
    quiet = TouchSummary(10, 1.0, (60.0, 60.0), 0.0, 0, scatter=twice)
    assert len(quiet.notes(none)) == 1
    assert replace(quiet, states_spindle=True).notes(made) == []


def test_verify_names_a_turned_spindle() -> None:
    """The same probe turned by 180°, where nothing is stated. A tripod that is nearly
    even looks alike after each third of a turn."""
    scene = scene_of(Job("turned", 4, "harmonic"))
    run = replace(scene.departure, directions=USUAL_25)
    again = reference_run(run, scene.probe, np.random.default_rng(3))
    at = latched(again.run, scene.probe, run, np.random.default_rng(4))
    found = verify(Touches(at, again.nominal_normals), _qualified(None), 25.0)
    assert found.changed
    assert found.causes[0].name == Cause.TURNED
    third = 2.0 * np.pi / 3.0
    off = np.mod(found.causes[0].value - np.pi + 0.5 * third, third) - 0.5 * third
    assert abs(off) < np.radians(5.0)
