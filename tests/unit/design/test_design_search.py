"""The search finds optima that are known in closed form, keeps limits, and writes a description."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import grid
from pretravel.base.errors import PretravelError
from pretravel.base.toml_file import parse_toml
from pretravel.design.studies import design_search
from pretravel.design.studies.conditions import case_of
from pretravel.design.studies.definition import Directions
from pretravel.design.studies.described import found_description
from pretravel.design.studies.design_search import find_design, tried_design
from pretravel.design.studies.extremes import extremes_between
from pretravel.design.studies.wish import WISHES, Wish, load_wish, wish_in
from pretravel.prediction.catalogue import parse_probe
from pretravel.prediction.trigger import predict

WALL = '[directions]\nazimuth_deg = "0:330:30"\npolar_deg = 90.0\n[prediction]\nmodel = "shen"\n'
PRELOAD = '[[free]]\nkey = "spring.preload_N"\nrange = [2.0, 12.0]\n'


def wish(text: str) -> Wish:
    return wish_in(parse_toml(text + WALL, "wish.toml"))


@pytest.mark.long
def test_the_least_preload_that_keeps_a_force() -> None:
    """Forces of frictionless seats are in proportion to the preload, and so is the bending."""
    one = wish(
        '[wish]\nleast = "pretravel_greatest"\n' + PRELOAD
        + '[[limit]]\nof = "trigger_force_least"\nat_least = 0.6\n'
    )  # fmt: skip
    found = find_design(one)
    start = found.start
    exact = 5.91 * 0.6 / start.quantities["trigger_force_least"]
    assert found.best.levels["spring.preload_N"] == pytest.approx(exact, rel=1e-4)
    assert found.best.quantities["pretravel_greatest"] == pytest.approx(
        start.quantities["pretravel_greatest"] * exact / 5.91, rel=1e-4
    )


@pytest.mark.long
def test_a_limit_holds_between_the_directions_of_the_grid() -> None:
    """On the grid of 15° the least force is 1.6 % above the least of all directions: the optimum
    had 0.394 N where at least 0.4 N was asked. The report states the least of all, too."""
    one = wish_in(
        parse_toml(
            '[wish]\nleast = "pretravel_greatest"\n' + PRELOAD
            + '[[limit]]\nof = "trigger_force_least"\nat_least = 0.4\n'
            '[directions]\nazimuth_deg = "0:345:15"\npolar_deg = "15:90:15"\n',
            "wish.toml",
        )
    )  # fmt: skip
    best = find_design(one).best
    dense = grid(np.radians(np.arange(15.0, 90.1, 0.5)), np.radians(np.arange(0.0, 360.0, 0.5)))
    least = float(predict(best.probe, dense).force.min())
    assert 0.4 * (1.0 - 1e-5) < least < 0.4 * (1.0 + 3e-4)  # kept, and nothing given away
    assert best.quantities["trigger_force_least"] == pytest.approx(least, rel=2e-4)
    assert best.quantities["trigger_force_least"] <= least


def test_extremes_lie_within_the_directions_that_are_spanned() -> None:
    """A quarter of a ring: its ends are not joined. An even circle is."""
    case = case_of(wish('[wish]\nmost = "lever"\n' + PRELOAD).study, {})
    polar = np.radians([60.0, 90.0])
    for azimuth, dense in (
        (np.radians([20.0, 50.0, 80.0]), np.arange(20.0, 80.1, 0.25)),
        (np.radians(np.arange(5.0, 360.0, 45.0)), np.arange(0.0, 360.0, 0.25)),
    ):
        found = extremes_between(Directions(tuple(azimuth), tuple(polar)), case, ("pretravel",))
        every = grid(np.radians(np.arange(60.0, 90.1, 0.25)), np.radians(dense))
        seen = predict(case.probe, every, case.prediction.model).pretravel * 1e3
        assert found["pretravel_least"] == pytest.approx(seen.min(), rel=1e-3)
        assert found["pretravel_greatest"] == pytest.approx(seen.max(), rel=1e-3)
        assert found["pretravel_range"] == pytest.approx(np.ptp(seen), rel=2e-3)
    assert extremes_between(Directions(), case, ("calibration",)) == {}


def test_the_longest_stylus_of_a_stiffness() -> None:
    """Model shen: d = F L³ / 3 E I. Reactions are linear in F and F L, so that L³ / d is in L."""
    one = wish(
        '[wish]\nmost = "lever"\n[[free]]\nkey = "hub.offset_mm"\nrange = [0.0, 120.0]\n'
        '[[limit]]\nof = "sensing_distance_greatest"\nat_most = 8.0\n'
    )
    levers = np.array([90.0, 110.0, 130.0])
    tried = [tried_design(one, {"hub.offset_mm": float(lever - 50.0)}) for lever in levers]
    ratio = levers**3 / [t.quantities["sensing_distance_greatest"] for t in tried]
    slope, constant = np.polyfit(levers[:2], ratio[:2], 1)
    assert ratio[2] == pytest.approx(slope * levers[2] + constant, rel=1e-9)
    roots = np.roots([1.0, 0.0, -8.0 * slope, -8.0 * constant])
    exact = max(root.real for root in roots if abs(root.imag) < 1e-9)
    found = find_design(one)
    assert found.best.quantities["lever"] == pytest.approx(exact, rel=1e-4)
    assert found.best.quantities["sensing_distance_greatest"] <= 8.0 * (1.0 + 1e-5)


def test_a_text_is_chosen_among_texts() -> None:
    """The stiffest of three materials, 686 GPa, bends least; force is the same."""
    one = wish(
        '[wish]\nleast = "sensing_distance_greatest"\n[[free]]\nkey = "stylus.2.material"\n'
        'values = ["ceramic", "tungsten carbide", "steel"]\n'
    )
    assert find_design(one).best.levels == {"stylus.2.material": "tungsten carbide"}


@pytest.mark.long
def test_a_front_has_no_design_that_is_worse_in_both(monkeypatch: pytest.MonkeyPatch) -> None:
    """More force or less bending: with the preload alone free, each value is on the front."""
    monkeypatch.setattr(design_search, "_FRONT", 2)  # between the ends; each one is a search
    one = wish('[wish]\nmost = "trigger_force_least"\nand_least = "pretravel_greatest"\n' + PRELOAD)
    found = find_design(one)
    forces = [d.quantities["trigger_force_least"] for d in found.front]
    bent = [d.quantities["pretravel_greatest"] for d in found.front]
    assert len(found.front) == 4
    assert (np.diff(forces) < 0.0).all()
    assert (np.diff(bent) < 0.0).all()
    preloads = [d.levels["spring.preload_N"] for d in found.front]
    assert preloads[0] == pytest.approx(12.0, rel=1e-3)
    assert preloads[-1] == pytest.approx(2.0, rel=1e-3)


def test_the_rise_of_a_rod() -> None:
    """1.5 radii rise by the tilt of the lever: 1.5 · 16.34 · 5 / 64.4 mm."""
    one = wish('[wish]\nleast = "rod_lift"\novertravel_mm = 5.0\n' + PRELOAD)
    assert tried_design(one, {}).quantities["rod_lift"] == pytest.approx(1.902950, abs=1e-6)


def test_the_rise_at_no_overtravel_is_not_stated() -> None:
    """The report said "rod lift 0" where no overtravel was asked."""
    assert "rod_lift" not in tried_design(wish('[wish]\nmost = "lever"\n' + PRELOAD), {}).quantities
    with pytest.raises(PretravelError, match="give overtravel_mm"):
        wish('[wish]\nleast = "rod_lift"\n' + PRELOAD)


def test_conditions_of_a_wish_are_those_of_studies() -> None:
    """Fewer touches leave more of the same probe."""
    text = (
        '[wish]\nleast = "left_after_calibration"\n' + PRELOAD + "[calibration]\nnoise_um = 0.0\n"
    )
    left = [
        tried_design(wish(f"{text}touches = {touches}\n"), {}).quantities["left_after_calibration"]
        for touches in (12, 60)
    ]
    assert left[0] > 2.0 * left[1]


@pytest.mark.long
def test_limits_that_no_design_keeps() -> None:
    one = wish(
        '[wish]\nleast = "pretravel_greatest"\n' + PRELOAD
        + '[[limit]]\nof = "trigger_force_least"\nat_least = 60.0\n'
    )  # fmt: skip
    with pytest.raises(
        PretravelError, match="limits in all directions: trigger_force_least at least 60"
    ):
        find_design(one)


def test_the_description_is_that_of_the_design(tmp_path: Path) -> None:
    one = wish(
        '[wish]\nname = "x"\nleast = "sensing_distance_greatest"\n[[free]]\n'
        'key = "tripod.rod_azimuths_deg.3"\nvalues = [235.0]\n[[free]]\n'
        'key = "stylus.2.material"\nvalues = ["steel"]\n'
    )
    text = found_description(find_design(one))
    probe = parse_probe(text)
    assert math.degrees(probe.tripod.rod_azimuths[2]) == pytest.approx(235.0)
    assert probe.stylus[1].material.name == "steel"
    assert "# axis to the points where the rods rest" in text
    # Not "OMP40-2 with 50 mm ceramic stylus, x": its stem is of steel.
    assert probe.name == "x, designed from omp40-2"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[wish]\n" + PRELOAD, "either least"),
        ('[wish]\nleast = "mass"\n' + PRELOAD, "line 1: there is no quantity 'mass'"),
        (
            '[wish]\nleast = "lever"\n' + PRELOAD + '[[limit]]\nof = "lever"\n',
            "at_least or at_most",
        ),
        (
            '[wish]\nleast = "lever"\n' + PRELOAD + '[[limit]]\nof = "lever"\nat_least = 9.0\n'
            '[[limit]]\nof = "lever"\nat_most = 90.0\n',
            "lever has two limits: give at_least and at_most in one",
        ),
        ('[wish]\nleast = "lever"\nand_least = "lever"\n' + PRELOAD, "is the goal lever itself"),
        ('[wish]\nleast = "rod_lift"\novertravel_mm = -5.0\n' + PRELOAD, "overtravel is -5 mm"),
        ('[wish]\nleast = "lever"\n' + PRELOAD + "levels = 3\n", "levels of spring.preload_N"),
        ('[wish]\nleast = "lever"\n[[free]]\nkey = "a.b"\nrange = [0.0, 1.0]\n', "no table 'a'"),
    ],
)
def test_a_wish_that_cannot_be_says_why(text: str, said: str) -> None:
    with pytest.raises(PretravelError, match=said.replace("[", r"\[")):
        wish(text)


def test_lobes_are_a_goal_only_where_the_directions_show_them() -> None:
    text = '[wish]\nleast = "pretravel_lobes"\n[directions]\nazimuth_deg = "0:90:10"\n' + PRELOAD
    with pytest.raises(PretravelError, match="pretravel_lobes needs azimuths of a whole circle"):
        wish_in(parse_toml(text))


@pytest.mark.parametrize("name", WISHES.names())
def test_shipped_wishes_start_from_a_probe(name: str) -> None:
    levels = {"stylus.2.length_mm": 138.0} if "150" in name else {}
    length = tried_design(load_wish(name), levels).quantities["stylus_length"]
    assert f"{length:g}mm" in name
