"""The simulator of departures against closed forms: what it shows is only as good as itself."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import features
from benchmarks.departures import machine, patterns, probes, rows, table
from benchmarks.departures.departure import Departure
from benchmarks.departures.evaluation import Job, Outcome, evaluated, scene_of
from benchmarks.departures.tripod import TIP_RADIUS, Tripod, scaled
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.machine_effects import _HYSTERESES

MICROMETRE = 1e-3
LEVER, SEAT_RADIUS, PRELOAD, SUPPORT = 50.0, 9.0, 5.0, np.radians(30.0)


def _even(**changes: object) -> Tripod:
    even = Tripod(
        rod_azimuths=np.radians([0.0, 120.0, 240.0]),
        support_angles=np.full(6, SUPPORT),
        seat_radius=SEAT_RADIUS,
        preload=PRELOAD,
        spring=np.zeros(2),
        tip=np.array([0.0, 0.0, -LEVER]),
        compliance=np.zeros((3, 3)),
        seat_approach=0.0,
        tip_approach=0.0,
    )
    return replace(even, **changes)


def _ring(degrees: np.ndarray) -> np.ndarray:
    azimuth = np.radians(degrees)
    return np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(len(azimuth))])


POLE = np.array([[0.0, 0.0, 1.0]])


def test_the_physics_is_apart_from_that_of_the_package() -> None:
    """Only the evaluation uses pretravel, and of it what a user calls."""
    folder = Path(machine.__file__).parent
    used = set()
    for path in folder.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("pretravel"):
                used.add((path.name, node.module))
    assert used == {
        ("evaluation.py", "pretravel"),
        ("evaluation.py", "pretravel.laboratory.reversal"),
        ("evaluation.py", "pretravel.measurement.points_summary"),
        ("evaluation.py", "pretravel.qualification.prior_update"),
        ("evaluation.py", "pretravel.qualification.touch_plan"),
    }


def test_seats_of_an_even_tripod_carry_the_spring_in_equal_parts() -> None:
    """Six vertical parts N sin(support angle) make the preload."""
    np.testing.assert_allclose(_even().seats_at_rest, PRELOAD / (6.0 * np.sin(SUPPORT)), rtol=1e-12)


def test_along_the_axis_an_even_tripod_lifts_at_the_preload() -> None:
    np.testing.assert_allclose(_even().force(POLE), PRELOAD, rtol=1e-12)


def test_across_the_axis_force_follows_the_statics_by_hand() -> None:
    """At a rod (azimuth 0) the moment about y is balanced by vertical seat forces alone.

    The push F along x turns the tripod by the moment -F L about y. The six seats: the vertical
    forces V of rod k change by a cos(azimuth of k) with -rho (1.5 a) = -F L, so a = F L / (1.5 rho)
    for the two seats of a rod together. The horizontal push is carried by differences of the two
    seats of a rod, D = d sin(azimuth of k) in the tangential direction -sin x + cos y, whose sum
    along x is -1.5 d = -F. The first seat opens where sin(support) (N0 + dN) becomes zero.
    """
    at = np.radians(np.array([0.0, 120.0, 240.0]))
    moment = LEVER / (1.5 * SEAT_RADIUS)
    unit = []
    for push_x, push_y in ((1.0, 0.0), (np.cos(0.7), np.sin(0.7))):
        pushed = push_x * np.cos(at) + push_y * np.sin(at)
        sideways = -push_x * np.sin(at) + push_y * np.cos(at)
        vertical = -moment * pushed / (2.0 * np.sin(SUPPORT))
        tangential = -sideways / 1.5 / (2.0 * np.cos(SUPPORT))
        unit.append(np.concatenate([vertical + tangential, vertical - tangential]).min())
    expected = -PRELOAD / (6.0 * np.sin(SUPPORT)) / np.array(unit)
    found = _even().force(_ring(np.degrees([0.0, 0.7])))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_an_even_tripod_has_three_equal_lobes_with_mirrors() -> None:
    probe = scaled(_even(), 20 * MICROMETRE, 1.5 * MICROMETRE, (0.3, 0.2))
    degrees = np.arange(0.0, 120.0, 7.0)
    found = probe.pretravel(_ring(degrees))
    np.testing.assert_allclose(probe.pretravel(_ring(degrees + 120.0)), found, rtol=1e-9)
    np.testing.assert_allclose(probe.pretravel(_ring(-degrees)), found, rtol=1e-9)
    assert np.ptp(found) > 5 * MICROMETRE


def test_pretravel_is_scaled_to_the_given_values() -> None:
    probe = scaled(_even(), 20 * MICROMETRE, 1.5 * MICROMETRE, (0.3, 0.2))
    around = probe.pretravel(_ring(np.arange(0.0, 360.0, 0.5)))
    assert probe.pretravel(POLE)[0] == pytest.approx(1.5 * MICROMETRE, rel=1e-12)
    assert around.max() == pytest.approx(20 * MICROMETRE, rel=1e-3)


def test_the_seats_turn_the_tip_by_virtual_work() -> None:
    """The work of the force on the deflection is that of the seats on their approach.

    For small approach h = k N^(2/3) the deflection along the force is the derivative of
    U(F) = sum of 3/5 k (N0 + F g)^(5/3) by F, less its value at F = 0.
    """
    probe = _even(seat_approach=0.2 * MICROMETRE)
    push = np.array([[0.6, 0.0, 0.8]])
    force = probe.force(push)[0]
    unit = -np.linalg.solve(*_balance(probe, push[0]))

    def energy(at: float) -> float:
        return float(0.6 * 0.2 * MICROMETRE * np.sum((probe.seats_at_rest + at * unit) ** (5 / 3)))

    def slope(at: float) -> float:
        step = 1e-7 * force
        return (energy(at + step) - energy(at - step)) / (2.0 * step)

    # Just before the trigger: there the opening seat's approach is (1e-6)^(2/3) = 1e-4 of itself.
    expected = slope((1.0 - 1e-6) * force) - slope(0.0)
    assert probe.pretravel(push)[0] == pytest.approx(expected, rel=1e-3)


def _balance(probe: Tripod, push: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forces and moments of unit seat forces and of the push, by the definition."""
    at = np.repeat(probe.rod_azimuths, 2)
    sign = np.tile([1.0, -1.0], 3)
    normals = np.column_stack(
        [
            -sign * np.cos(SUPPORT) * np.sin(at),
            sign * np.cos(SUPPORT) * np.cos(at),
            np.full(6, np.sin(SUPPORT)),
        ]
    )
    places = SEAT_RADIUS * np.column_stack([np.cos(at), np.sin(at), np.zeros(6)])
    seats = np.hstack([normals, np.cross(places, normals)]).T
    return seats, np.concatenate([push, np.cross([0.0, 0.0, -LEVER], push)])


def test_friction_holds_the_tip_where_it_would_hardly_slide() -> None:
    """Along the axis an even tripod does not move sideways; at 45° friction changes the touch."""
    without = scaled(_even(), 20 * MICROMETRE, 1.5 * MICROMETRE, (0.3, 0.2))
    rubbing = replace(without, friction=0.2)
    np.testing.assert_allclose(rubbing.pretravel(POLE), without.pretravel(POLE), rtol=1e-6)
    oblique = np.array([[np.sqrt(0.5), 0.0, np.sqrt(0.5)]])
    assert abs(rubbing.pretravel(oblique) - without.pretravel(oblique)) > 0.1 * MICROMETRE


def test_random_probes_are_plausible() -> None:
    """Across the axis 4 to 25 µm, along it 1 to 2 µm, and all six seats loaded."""
    for seed in range(40):
        probe = probes.six_seats(np.random.default_rng(seed))
        around = probe.pretravel(_ring(np.arange(0.0, 360.0, 3.0)) @ probe.rotation.T)
        assert 3 * MICROMETRE < around.min() < around.max() < 25.1 * MICROMETRE
        assert 1 * MICROMETRE <= probe.pretravel(probe.axis[None])[0] <= 2 * MICROMETRE
        assert probe.seats_at_rest.min() > 0.0
        np.testing.assert_allclose(probe.rotation @ probe.rotation.T, np.eye(3), atol=1e-12)


def _latched(departure: Departure, seed: int = 3) -> tuple[np.ndarray, machine.Reference, Tripod]:
    generator = np.random.default_rng(seed)
    probe = probes.six_seats(generator)
    reference = machine.reference_run(departure, probe, generator)
    noise = np.random.default_rng(seed + 1)
    return machine.latched(reference.run, probe, departure, noise), reference, probe


EXACT = Departure("exact", noise=0.0)


def test_without_departures_the_true_map_gives_the_true_sphere() -> None:
    """|P - c| = R + r - pretravel along the normal; oblique by 1 mrad it is equal to 1e-8 mm."""
    at, reference, probe = _latched(EXACT)
    distance = np.linalg.norm(at - reference.center, axis=1)
    expected = 0.5 * machine.DIAMETER + TIP_RADIUS
    pretravel = probe.pretravel(reference.run.normals, 2.0 / machine.DIAMETER)
    np.testing.assert_allclose(distance, expected - pretravel, atol=2e-7)


def test_without_departures_the_true_map_gives_the_true_part() -> None:
    generator = np.random.default_rng(5)
    probe = probes.six_seats(generator)
    run, surface = machine.part_run(
        EXACT, patterns.scattered(50, generator, level=False), generator
    )
    at = machine.latched(run, probe, EXACT, generator)
    found = at + (probe.pretravel(run.normals) - TIP_RADIUS)[:, None] * run.normals
    np.testing.assert_allclose(found, surface, atol=1e-12)


def test_in_a_ring_pretravel_goes_outwards() -> None:
    departure = replace(EXACT, ring=True, directions=patterns.RING_24)
    at, reference, probe = _latched(departure)
    distance = np.linalg.norm((at - reference.center)[:, :2], axis=1)
    expected = 0.5 * machine.RING_DIAMETER - TIP_RADIUS
    pretravel = probe.pretravel(reference.run.normals, -2.0 / machine.RING_DIAMETER)
    np.testing.assert_allclose(distance, expected + pretravel, atol=2e-7)
    assert np.all(np.sum(reference.nominal_normals * (at - reference.center), axis=1) < 0.0)


def test_quantised_values_are_multiples_and_differ_by_less_than_a_step() -> None:
    exact, _, _ = _latched(EXACT)
    found, _, _ = _latched(replace(EXACT, quantum=MICROMETRE))
    np.testing.assert_allclose(found / MICROMETRE, np.round(found / MICROMETRE), atol=1e-6)
    assert 0.3 * MICROMETRE < np.abs(found - exact).max() <= 0.501 * MICROMETRE


def test_the_memory_moves_the_tip_along_the_push_before() -> None:
    """Repeats in a row shift each touch after the first of its direction by h sin²(polar)."""
    exact, reference, probe = _latched(EXACT)
    found, _, _ = _latched(replace(EXACT, hysteresis=MICROMETRE))
    change = np.sum((found - exact) * reference.run.approaches, axis=1)
    normals = reference.run.normals
    across = 1.0 - (normals @ probe.axis) ** 2
    repeated = np.arange(len(change)) % 3 > 0
    np.testing.assert_allclose(change[repeated], MICROMETRE * across[repeated], atol=1e-8)
    # A new direction: the push before, less its part along the axis.
    along = normals @ probe.axis
    expected = np.sum(normals[:-1] * normals[1:], axis=1) - along[:-1] * along[1:]
    np.testing.assert_allclose(change[1:], MICROMETRE * expected, atol=1e-8)
    assert change[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("order", ["in a row", "rings", "passes", "shuffled passes"])
def test_the_reference_drifts_from_the_first_touch_to_the_last(order: Any) -> None:
    still, _, _ = _latched(replace(EXACT, order=order))
    found, _, _ = _latched(replace(EXACT, order=order, drift=2 * MICROMETRE))
    moved = found - still
    assert np.linalg.norm(moved[-1] - moved[0]) == pytest.approx(2 * MICROMETRE, rel=1e-3)
    np.testing.assert_allclose(moved.mean(axis=0), 0.0, atol=1e-8)
    slows, _, _ = _latched(replace(EXACT, order=order, drift=2 * MICROMETRE, drift_slows=True))
    moved = np.linalg.norm(slows - still - (slows - still)[0], axis=1)
    assert moved[-1] == pytest.approx(2 * MICROMETRE, rel=1e-3)
    third = moved[len(moved) // 3] / moved[-1]  # 1 - 1/e of an end that e³ is short of
    assert third == pytest.approx((1.0 - np.exp(-1.0)) / (1.0 - np.exp(-3.0)), abs=0.02)


def test_passes_repeat_the_directions_one_after_the_other() -> None:
    count = len(EXACT.directions)
    for order, same in (("in a row", [0, 1, 2]), ("passes", [0, count, 2 * count])):
        _, reference, _ = _latched(replace(EXACT, order=order))
        normals = reference.nominal_normals
        np.testing.assert_array_equal(normals[same], EXACT.directions[[0, 0, 0]])
    _, rings, _ = _latched(replace(EXACT, order="rings"))
    ring = np.repeat(EXACT.directions[None, 1:5], 3, axis=0).reshape(-1, 3)
    np.testing.assert_array_equal(rings.nominal_normals[3:15], ring)
    _, shuffled, _ = _latched(replace(EXACT, order="shuffled passes", second_feed=300.0))
    for part in np.split(shuffled.nominal_normals, 3):
        np.testing.assert_array_equal(np.sort(part, axis=0), np.sort(EXACT.directions, axis=0))
    feeds = [set(part) for part in np.split(shuffled.run.feeds, 3)]
    assert feeds == [{50.0}, {300.0}, {50.0}]


def test_delay_backlash_and_gross_errors_act_along_the_approach() -> None:
    exact, reference, _ = _latched(EXACT)
    approaches = reference.run.approaches
    later, _, _ = _latched(replace(EXACT, delay=2e-3, feed=300.0))
    np.testing.assert_allclose(later - exact, 0.010 * approaches, atol=1e-12)
    loose, _, _ = _latched(replace(EXACT, backlash=MICROMETRE))
    moved = np.where(np.abs(approaches) > 1e-5, np.sign(approaches), 0.0)
    np.testing.assert_allclose(loose - exact, 0.5 * MICROMETRE * moved, atol=1e-12)
    generator = np.random.default_rng(1)
    changed, wrong = machine.with_gross_errors(exact, reference.run, (0.035,), generator)
    np.testing.assert_allclose((changed - exact)[wrong], -0.035 * approaches[wrong], atol=1e-12)
    assert np.count_nonzero(np.any(changed != exact, axis=1)) == 1


def test_a_square_machine_of_right_scale_measures_right() -> None:
    """Squareness s turns the angle of two axes by s: length and angle change in first order."""
    errors = machine.machine_errors(replace(EXACT, squareness=10e-6, scale=10e-6))
    moved = np.eye(3) + errors
    assert moved[:, 0] @ moved[:, 1] == pytest.approx(10e-6, rel=1e-3)
    np.testing.assert_allclose(np.linalg.norm(moved, axis=0), 1.0 + 10e-6, atol=1e-9)
    assert not machine.machine_errors(EXACT).any()


@pytest.mark.parametrize(
    ("departure", "deviation"),
    [
        (replace(EXACT, noise=MICROMETRE), 1.0),
        (replace(EXACT, noise=MICROMETRE, heavy_tails=True), 1.0),
        (replace(EXACT, noise=MICROMETRE, noise_at_rods=3.0, directions=_ring(np.zeros(1))), None),
    ],
)
def test_noise_has_the_stated_deviation(departure: Departure, deviation: float | None) -> None:
    """Of 30 000 touches; at the direction of a rod three times that."""
    exact, reference, probe = _latched(replace(departure, noise=0.0, repeats=1))
    many = replace(departure, repeats=30_000 // len(departure.directions))
    if deviation is None:
        rod = probe.rods[0]
        many = replace(many, directions=np.array([[np.cos(rod), np.sin(rod), 0.0]]))
        deviation = 3.0
    found, run, _ = _latched(many)
    still, _, _ = _latched(replace(many, noise=0.0))
    scatter = np.sum((found - still) * run.run.approaches, axis=1)
    # 0.4 % for a normal distribution; the fourth moment of t with 3 degrees is not finite.
    tolerance = 0.1 if departure.heavy_tails else 0.015
    assert np.std(scatter) == pytest.approx(deviation * MICROMETRE, rel=tolerance)
    assert len(exact) == len(reference.nominal_normals)


def test_sets_of_one_number_share_probe_and_noise() -> None:
    """Rows are then compared in pairs."""
    plain = scene_of(Job("baseline", 4, "harmonic"))
    wrong = scene_of(Job("diameter", 4, "harmonic"))
    change = wrong.reference_touches.positions - plain.reference_touches.positions
    np.testing.assert_allclose(np.linalg.norm(change, axis=1), 0.5 * MICROMETRE, rtol=0.01)
    np.testing.assert_array_equal(wrong.part_touches.positions, plain.part_touches.positions)


def test_every_row_makes_its_touches() -> None:
    for name, departure in rows.ROWS.items():
        scene = scene_of(Job(name, 0, "mean"))
        assert len(scene.part_touches) == len(scene.surface) == 200, name
        assert len(scene.gross) == len(departure.gross_errors), name
        assert (scene.reference_touches.feeds is not None) == departure.feed_stated[0], name


def test_a_set_is_evaluated_against_the_truth() -> None:
    """A mean map on a probe with lobes: its error is the spread of pretravel, and it is not said.

    The best mean leaves the standard deviation of pretravel over the part, less what a shift of
    the centre takes.
    """
    job = Job("baseline", 1, "mean")
    scene = scene_of(job)
    outcome = evaluated(job)
    assert not outcome.refused
    spread = float(np.std(scene.probe.pretravel(scene.part_touches.normals))) / MICROMETRE
    assert 0.2 * spread < outcome.error < 1.2 * spread
    assert outcome.error <= outcome.error_here


def test_errors_count_from_the_centre_that_was_found() -> None:
    """2.5 µm along the axis, where 1 µm is assumed, moves centre and part alike by 1.5 µm."""
    outcome = evaluated(Job("axial_2.5", 0, "harmonic"))
    assert outcome.center_off > 1.2
    assert outcome.error_here < 1.2 * outcome.error


def test_an_aged_probe_differs_a_little() -> None:
    """1 % of the spring changes pretravel by 1 %, 0.3° less than that of lobes of 10 µm."""
    generator = np.random.default_rng(2)
    probe = probes.six_seats(generator)
    around = _ring(np.arange(0.0, 360.0, 5.0))
    change = probes.aged(probe, generator).pretravel(around) - probe.pretravel(around)
    assert 0.01 * MICROMETRE < np.abs(change).max() < 1.0 * MICROMETRE


def test_features_are_compared_with_the_truth(capsys: pytest.CaptureFixture[str]) -> None:
    """Every row of the three tables, of one probe; 50 rough places have a form of some 4.5 times
    their standard deviation (range of 50 normal values)."""
    one = features.one_set(0, "mean")
    assert one["bore, rough, 1 µm, 50 touches"]["true"] > 2.0 * MICROMETRE
    features.printed([one])
    assert len(capsys.readouterr().out.splitlines()) == len(one) + len(features.BORES) + 2 + 10


def test_refusals_are_counted_and_not_averaged() -> None:
    good = Outcome("baseline", 0, 1.0, error=0.3, error_here=0.4, u=0.3, chi_squared=2.0)
    good = replace(good, covered=0.9)
    bad = Outcome("baseline", 1, 1.0, refused="too few touches")
    said = replace(good, chi_squared=3.0, covered=0.8, warnings=("doubtful by 3.5 µm",))
    cells = table.summary([good, said, bad])
    assert (cells["refused"], cells["warned"], cells["chi"]) == ("33", "50", "2.50")
    assert (cells["warned_wrong"], cells["covered"]) == ("50 of 2", "85.0")
    assert cells["own_wrong"] == "50"
    always = table.routine_sentences([said, replace(said, warnings=("doubtful by 4 µm",)), good])
    assert table.summary([good, said, bad], always)["own_wrong"] == "0"
    assert table.sentences([good, said, bad]) == [
        "       1 × doubtful by # µm",
        "       1 × refused: too few touches",
    ]


def test_usual_errors_have_the_sizes_that_u_assumes() -> None:
    """Of 4000 draws: diameter 0.2 µm and 0.2 K of steel; hysteresis by its shares, within 4 u."""
    rng = np.random.default_rng(3)
    drawn = [machine.with_usual_errors(Departure("usual"), rng) for _ in range(4000)]
    setup = QualificationSetup(machine.DIAMETER)
    squares = np.array([d.diameter_error for d in drawn]) ** 2
    assert np.mean(squares) == pytest.approx(setup.u_reference_diameter**2, rel=4 * 0.022)
    assert drawn[0].form == pytest.approx(setup.sphere_form)
    share = np.mean([d.hysteresis != 0.0 for d in drawn])
    assert share == pytest.approx(sum(_HYSTERESES.values()), abs=4 * 0.0076)
    expected = sum(weight * size**2 for size, weight in _HYSTERESES.items())
    squares = np.array([d.hysteresis for d in drawn]) ** 2
    spread = np.sqrt(3.0 * sum(w * s**4 for s, w in _HYSTERESES.items()) / 4000.0)
    assert np.mean(squares) == pytest.approx(expected, abs=4 * spread)
