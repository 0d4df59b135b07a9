"""What one day's touches say beside a map: known changes come back, common errors do not count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.units import DEGREE
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.day_terms import DayTerms, day_quantities, day_terms, radius_beside
from pretravel.qualification.qualify import qualify
from pretravel.touches import Touches
from tests.unit.qualification.test_verification import old_map, touches

SPHERE = QualificationSetup(25.0, tip_diameter=6.0)


def terms(new: Touches, setup: QualificationSetup = SPHERE) -> DayTerms:
    return day_terms(new, old_map(), setup)


def test_changes_come_back() -> None:
    """Less those of the unchanged probe with the same noise, in which the error of the map is."""
    unchanged = terms(touches(7))
    larger = terms(touches(7, size=0.002)).level - unchanged.level
    assert larger == pytest.approx(0.002, abs=2e-5)  # normals about a centre that moves by 2 µm
    # The fitted map has 90 to 110 % of the variation of the probe; noise moves a turn by 0.3°.
    wider = terms(touches(7, scale=1.2)).scale - unchanged.scale
    assert wider == pytest.approx(0.2, rel=0.1)
    turned = terms(touches(7, rotation_deg=3.0)).turn - unchanged.turn
    assert turned == pytest.approx(3.0 * DEGREE, abs=0.6 * DEGREE)


def test_uncertainties_are_the_scatter_between_days() -> None:
    """Of 16 days: a standard deviation is known to 18 %; 50 % are nearly three times that."""
    found = [terms(touches(seed)) for seed in range(20, 36)]
    for name in ("level", "scale", "turn"):
        scatter = np.std([getattr(one, name) for one in found], ddof=1)
        stated = np.mean([getattr(one, f"u_{name}") for one in found])
        assert scatter == pytest.approx(stated, rel=0.5)


def test_what_a_map_leaves_of_single_directions_is_common_to_all_days() -> None:
    """The fixed scatter of a map is the same every day on the same directions."""
    new = touches(7)
    rough = day_terms(new, replace(old_map(), fixed_scatter=0.001), SPHERE)
    smooth = day_terms(new, replace(old_map(), fixed_scatter=0.0), SPHERE)
    for name in ("u_level", "u_scale", "u_turn"):
        assert getattr(rough, name) == pytest.approx(getattr(smooth, name), rel=1e-9)


def test_another_calibrated_diameter_moves_the_level_of_all_days_alike() -> None:
    """Two days differ by the same, and are as uncertain, whatever the diameter is."""
    other = replace(SPHERE, diameter=25.001)
    days = [touches(8), touches(9, size=0.001)]
    first = [terms(day) for day in days]
    second = [terms(day, other) for day in days]
    assert second[0].level - first[0].level == pytest.approx(0.0005, abs=1e-6)
    assert second[1].level - second[0].level == pytest.approx(
        first[1].level - first[0].level, abs=1e-6
    )
    assert second[0].u_level == pytest.approx(first[0].u_level, rel=1e-3)


def test_a_change_of_one_direction_is_form() -> None:
    new = touches(7)
    moved = new.positions.copy()
    moved[:3] -= 0.004 * new.normals[:3]  # the pole, which three touches repeat
    found = terms(replace(new, positions=moved))
    # 4 µm in one of 25 directions: 0.8 µm root mean square, less what the centre takes.
    assert found.form == pytest.approx(0.0007, abs=0.00015)
    assert found.form > 5.0 * found.u_form
    assert abs(terms(new).form) < 3.0 * terms(new).u_form


def two_feeds(seed: int, delay: float) -> Touches:
    """Each direction at 60 and at 240 mm/min; a machine travels on during the delay."""
    rest, rng = touches(seed), np.random.default_rng(1000 + seed)
    parts = []
    for feed in (60.0, 240.0):
        noise = 2e-4 * rng.standard_normal((len(rest), 1)) * rest.normals
        parts.append(rest.positions + noise + rest.approach_directions * feed / 60.0 * delay)
    feeds = np.repeat([60.0, 240.0], len(rest))
    return Touches(np.concatenate(parts), np.tile(rest.normals, (2, 1)), feeds=feeds)


def test_a_longer_delay_is_no_change_of_level() -> None:
    made = qualify(two_feeds(1, 0.004), 25.0, tip_diameter=6.0, kind="harmonic").pretravel_map
    found = day_terms(two_feeds(2, 0.006), made, SPHERE)
    assert found.delay == pytest.approx(0.006, abs=4.0 * found.u_delay)
    assert found.u_delay < 1e-4
    # A delay longer by 2 ms is 5 µm of travel at the mean feed; both days have u of the level.
    assert abs(found.level) < 6.0 * found.u_level < 0.0015
    quantities = {one.name: one for one in day_quantities([found], made)}
    delay = quantities["signal delay"]
    assert delay.values[0] == pytest.approx(2.0, abs=8e3 * found.u_delay)
    assert delay.share == pytest.approx(240.0 / 60.0 * 1e-3)  # mm in a millisecond


def test_of_a_day_without_several_feeds_there_is_no_delay() -> None:
    assert np.isnan(terms(touches(7)).delay)


def test_quantities_state_what_they_change_in_the_map() -> None:
    """A scale of 1 % changes a map by a hundredth of its largest deviation from the mean."""
    made = old_map()
    level, scale, turn, form = day_quantities([terms(touches(7))], made)
    assert [one.unit for one in (level, scale, turn, form)] == ["µm", "%", "°", "µm"]
    assert level.share == 1e-3
    value = made.basis.value(made.support.nodes, made.coefficients)
    largest = np.abs(value - value.mean()).max()
    # Over the nodes alone, which are spread less densely than the directions of the share.
    assert scale.share == pytest.approx(0.01 * largest, rel=0.3)


def test_the_radius_of_a_map_is_that_of_its_qualification() -> None:
    made = qualify(touches(1), 25.0, tip_diameter=6.0, kind="harmonic")
    assert isinstance(made.pretravel_map, PretravelMap)
    # The least-squares sphere through the map, not through its touches: noise of 0.3 µm.
    assert radius_beside(made.pretravel_map) == pytest.approx(made.effective_radius, abs=2e-4)
