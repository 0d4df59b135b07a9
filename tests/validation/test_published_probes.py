"""Measured probes of other publications (reference/published_probes.csv) against prediction.

Each row is predicted by one of the tests, or it stands in `NOT_PREDICTED` with the reason. Where
a measurement and the physics disagree, the test holds both numbers, so that a change of either
is seen. The OMP40-2 and the KP-3 have tests of their own.
"""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.units import delay_travel
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation.variances import direction_variance_uncertainty
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.seats import seat_statics
from pretravel.prediction.trigger import predict
from tests.support.examples import EXAMPLES
from tests.support.ren_probe import ren_terms
from tests.support.small_contact_probe import small_contact_probe

TABLE = Path(__file__).parent / "reference" / "published_probes.csv"
KINDS = {"measured", "reported", "stated"}  # reported: without a method; stated: by the maker

PREDICTED = {
    "ren-force",
    "ren-force-scatter-least",
    "ren-force-scatter-most",
    "ren-pretravel",
    "ren-pretravel-scatter-least",
    "ren-pretravel-scatter-most",
    "estler-tp2-before",
    "shen-springer-range",
    "wozniak-opposite-sums",
    "nafi-repeat",
    "nafi-probe-range",
    "nafi-machine-range",
    "bore-x-plus",
    "bore-x-minus",
    "bore-y-plus",
    "bore-y-minus",
    "boss-x-plus",
    "boss-x-minus",
    "boss-y-plus",
    "boss-y-minus",
    "ring-x-less-y-first",
    "ring-x-less-y-second",
    "ring-tip-diameter",
    "trip-force-least",
    "trip-force-most",
    "chengdu-least",
    "chengdu-most",
    "omp400-force",
}
IN_OTHER_TESTS = {
    "wozniak-tp6-50": "test_wozniak: Figure 5 in simulation",
    "wozniak-tp6-30": "test_wozniak: Figure 5 in simulation",
    "wozniak-tp200": "test_wozniak: Figure 5 in simulation",
    "shen-springer-left": "test_physical_qualification",
}
NOT_PREDICTED = {
    "ren-repeatability-least": "repeatability is an input, not a result, of the models",
    "ren-repeatability-most": "repeatability is an input, not a result, of the models",
    "ren-repeatability-mean": "below the least value: a misprint",
    "ren-zero-repeatability": "repeatability is an input, not a result, of the models",
    "estler-tp2-after": "what is left is noise and the errors of that probe",
    "wozniak-r-squared": "the readings are not printed",
    "mayer-factor": "the readings are not printed",
    "ring-repeat": "repeatability is an input, not a result, of the models",
    "low-cost-least": "force, stem and feed are not stated",
    "low-cost-most": "force, stem and feed are not stated",
    "chengdu-repeat-least": "repeatability is an input, not a result, of the models",
    "chengdu-repeat-most": "repeatability is an input, not a result, of the models",
    "omp60-repeat": "repeatability is an input, not a result, of the models",
    "rmp600-repeat": "repeatability is an input, not a result, of the models",
    "ts444-accuracy": "an optical sensor, not a kinematic one",
    "ts444-repeat": "an optical sensor, not a kinematic one",
}

XY = from_angles(np.full(360, np.pi / 2), np.radians(np.arange(360.0)))


def _rows() -> list[dict[str, str]]:
    with TABLE.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


VALUES = {row["row"]: float(row["value"]) for row in _rows()}


def _sums_of_opposite_sides(values: FloatArray) -> FloatArray:
    """Of values at 360 azimuths, one degree apart."""
    return values + np.roll(values, 180)


def _relative_range(values: FloatArray) -> float:
    return float(np.ptp(values) / values.mean())


def _half_sphere() -> FloatArray:
    polar, azimuth = np.meshgrid(np.arange(0.0, 91.0, 5.0), np.arange(0.0, 360.0, 10.0))
    return from_angles(np.radians(polar).ravel(), np.radians(azimuth).ravel())


def test_each_row_has_a_source_and_a_home() -> None:
    """A number that nobody predicts or excuses is a number that nobody looked at."""
    rows = _rows()
    names = [row["row"] for row in rows]
    assert len(set(names)) == len(names)
    homes = [PREDICTED, set(IN_OTHER_TESTS), set(NOT_PREDICTED)]
    assert sum(len(home) for home in homes) == len(set().union(*homes))
    assert set(names) == set().union(*homes)
    for row in rows:
        assert row["kind"] in KINDS
        assert row["source"]
        assert row["unit"]


@pytest.mark.published("Ren 2020", "Equation 12")
def test_ren_pretravel_at_the_measured_force() -> None:
    """Disagrees. Equation 12 at the mean force of 0.082 N gives 1.10 µm (the third digit of the
    force is 0.6 %), 3.17 µm were measured: 2.9 times as much. It wants 0.242 N, three times the
    force. The bending of a steel stem 1.5 mm thick would give it; the paper says 2 mm."""
    force, measured = VALUES["ren-force"], VALUES["ren-pretravel"]
    at_force = float(ren_terms(force).pretravel) * 1e3
    rounding = float(ren_terms(force + 0.0005).pretravel - ren_terms(force - 0.0005).pretravel)
    # 0.012376 F + (6.41 - 1.83)e-4 F^(2/3), by hand.
    assert at_force == pytest.approx(1.014832 + 0.458 * 0.082 ** (2 / 3), abs=1e-3)
    assert rounding * 1e3 < 0.015
    assert measured / at_force == pytest.approx(2.88, abs=0.03)
    needed = np.interp(measured, ren_terms(_FORCES).pretravel * 1e3, _FORCES)
    assert needed == pytest.approx(0.242, abs=0.001)
    thin = float(ren_terms(force).bending) * (2.0 / 1.5) ** 4 * 1e3
    assert thin == pytest.approx(measured, rel=0.02)


_FORCES = np.linspace(0.05, 0.5, 4501)


@pytest.mark.published(
    "Ren 2020", "Figure 8",
    what="repeatability, pretravel and force by direction",
    ours="`rig` states all three, around the axis and on a sphere; 0.03 and 0.07 µm for "
    "their scatter of force",
    theirs="0.24 and 0.41 µm; mean repeatability 0.02 below the least, 0.03",
    verdict="differs: the force does not cause the scatter; a misprint",
)  # fmt: skip
@pytest.mark.parametrize(("extreme", "least_factor"), [("least", 6.0), ("most", 5.0)])
def test_ren_scatter_of_pretravel_and_force(extreme: str, least_factor: float) -> None:
    """Disagrees. By equation 12 the measured scatter of the force (0.002 to 0.005 N, one digit:
    ± 0.0005 N) moves the trigger by 0.03 to 0.07 µm. The measured scatter of pretravel is six to
    nine times this: the force of the trigger does not cause it."""
    force = VALUES["ren-force"]
    largest = 0.5 * (VALUES[f"ren-force-scatter-{extreme}"] + 0.0005)
    ends = ren_terms([force - largest, force + largest]).pretravel
    assert VALUES[f"ren-pretravel-scatter-{extreme}"] > least_factor * float(np.ptp(ends)) * 1e3


def test_size_of_pretravel_of_small_probes() -> None:
    """Agrees in size. Spring and stem of the two measured probes with 50 mm styluses are not
    stated. A probe with the figures of Woźniak's program (0.6 N, seats 8 mm apart, stem 2 mm)
    varies over the half sphere by 5.1 µm (tungsten carbide), 7.5 µm (ceramic) and 14.4 µm
    (steel). 7.3 µm (TP2) lies between; 16 µm wants 0.67 N with steel: the factor of the spring
    from carbide to steel, about 3, is the width of this test."""
    ranges = {
        stem: float(np.ptp(predict(small_contact_probe(50.0, stem), _half_sphere()).pretravel))
        * 1e3
        for stem in ("tungsten carbide", "ceramic", "stainless steel")
    }
    assert ranges["tungsten carbide"] < VALUES["estler-tp2-before"] < ranges["stainless steel"]
    assert 1.0 < VALUES["shen-springer-range"] / ranges["stainless steel"] < 1.25
    # Cantilevers alone: F L³ / 3EI, stiffer in the ratio of the moduli (620 : 400 : 200 or so).
    assert 2.0 < ranges["stainless steel"] / ranges["tungsten carbide"] < 3.3


def test_dead_zone_of_trigger_probes() -> None:
    """Agrees. «Usually 1 to 3 µm», without a stylus; the same small probe with a 30 mm tungsten
    carbide stylus: 1.4 to 2.3 µm across the axis."""
    pretravel = predict(small_contact_probe(30.0), XY).pretravel * 1e3
    assert VALUES["chengdu-least"] < pretravel.min()
    assert pretravel.max() < VALUES["chengdu-most"]


@pytest.mark.published("Woźniak", "Equation 7")
def test_sums_of_opposite_sides() -> None:
    """Disagrees, unless his pretravel contains a constant travel. The sum of opposite pretravels
    should vary by «some percent»; by statics it varies by 23 % (his probe, 50 mm), in the ideal
    triangle by (3 - 4/√3) / (2 · mean of 1/cos over ±60°) = 27.5 %. At his 8 mm/s a delay of one
    millisecond adds 8 µm to each side, and leaves 8 %."""
    allowed = VALUES["wozniak-opposite-sums"]
    sums = _sums_of_opposite_sides(predict(small_contact_probe(50.0), XY).pretravel)
    assert _relative_range(sums) > 2.0 * allowed
    assert _relative_range(sums) < _ideal_triangle()
    delay = delay_travel(8.0 * 60.0, 1e-3)
    assert _relative_range(sums + 2.0 * delay) < allowed


def _ideal_triangle() -> float:
    """Range over mean of the sums of opposite sides where the force is 1 / cos of the azimuth,
    folded to ±60°: closed form."""
    mean = 3.0 / np.pi * np.log(np.tan(np.radians(75.0)))
    return float((3.0 - 4.0 / np.sqrt(3.0)) / (2.0 * mean))


def _opening_arm(probe: Probe) -> FloatArray:
    return predict(replace(probe, criterion="arm_lift"), XY, "shen").force


@pytest.mark.published("Woźniak", "Figure 1")
def test_arm_lift_is_the_ideal_triangle() -> None:
    """The moment about the line through two rods: preload R/2 over lever · cos. Exact."""
    probe = load_probe("omp40-2")
    sums = _sums_of_opposite_sides(_opening_arm(probe))
    assert _relative_range(sums) == pytest.approx(_ideal_triangle(), rel=1e-3)  # one degree apart
    assert _opening_arm(probe).min() * 64.4 == pytest.approx(0.5 * 5.91 * 16.34)


def test_largest_trip_force_over_least() -> None:
    """Agrees with a rod that lifts (2.00). «Between 50 g and over 100 g» is a ratio of 2 or more,
    reported without a method. The first seat opens at a ratio below 2: of seats between 10° and
    70° and levers from 55 to 150 mm the largest has 1.94."""
    reported = VALUES["trip-force-most"] / VALUES["trip-force-least"]
    probe = load_probe("omp40-2")
    lifted = _opening_arm(probe)
    assert lifted.max() / lifted.min() == pytest.approx(reported, rel=1e-9)
    ratios = []
    for angle in (10.0, 27.266, 45.0, 70.0):
        seats = replace(probe.seats, support_angle=np.radians(angle))
        for lever in (55.0, 64.4, 150.0):
            force = predict(replace(probe, seats=seats).with_lever(lever), XY, "shen").force
            ratios.append(force.max() / force.min())
    assert max(ratios) < reported
    assert max(ratios) == pytest.approx(1.936, abs=5e-3)


def test_strain_gauges_trigger_before_a_seat_opens() -> None:
    """Agrees. An OMP400 is stated to trigger at 0.06 N; the first seat of an OMP40-2 opens at
    0.74 N or more. At 0.06 N all six reactions of its tripod press, in every direction."""
    probe = load_probe("omp40-2")
    force = VALUES["omp400-force"]
    assert predict(probe, XY, "shen").force.min() > 10.0 * force
    assert (seat_statics(probe).reactions(XY, np.full(360, force)) > 0.0).all()


@pytest.mark.published(
    "Nafi and Mayer 2011", "Figure 5",
    what="ranges of variance",
    ours="0.55 to 1.22 µm² by chance (squared residuals), 1.9 to 4.0 as printed",
    theirs="1.19 and 1.42 µm²",
    verdict="differs: lobes of the variance are not shown",
)  # fmt: skip
def test_nafi_mayer_ranges_of_variance() -> None:
    """Squared residuals: chance explains the probe's range; the machine's is above. Were all
    variances equal (0.8 µm² a pair), their sums would give ranges over 24 directions of 0.83 µm²
    on average, 0.55 to 1.22 µm² in 95 % of tests. Measured: 1.19 (probe), 1.42 µm² (machine). Ten
    repeats tell 0.8 µm² to 0.38 ... 2.67 µm², and at 0.93 µm² 1.42 is within too."""
    pair = VALUES["nafi-repeat"]
    chance = _ranges_by_chance(pair, np.zeros((24, 24)), literal=False)[:, 0]
    low, high = np.quantile(chance, [0.025, 0.975])
    assert [chance.mean(), low, high] == pytest.approx([0.83, 0.55, 1.22], abs=0.02)
    assert low < VALUES["nafi-probe-range"] < high
    assert high < VALUES["nafi-machine-range"]
    above = np.mean(chance > VALUES["nafi-machine-range"])
    assert above == pytest.approx(0.003, abs=0.002)  # 3000 trials: the share to 0.1 %
    assert np.mean(chance > VALUES["nafi-probe-range"]) == pytest.approx(0.03, abs=0.01)
    enough = pair * VALUES["nafi-machine-range"] / high
    assert enough == pytest.approx(0.93, abs=0.02)  # the quantile to 1 %
    least, most = 9.0 * pair / chi2.ppf([0.975, 0.025], 9)
    assert least < enough < most
    # The same mean range from our standard uncertainty of a direction's variance: its range over
    # 24 normal values is 3.895 of it (d2 of control charts). Sums of squared residuals of two
    # directions differ by n (1 - 1/n) (1 - 2/n) of the difference of their variances.
    i, j = np.divmod(np.arange(24 * 24), 24)
    relative = direction_variance_uncertainty(MultiStepReadings(i, j, np.zeros(24 * 24)))
    ours = relative * 0.5 * pair * 3.895 * (23.0 / 24.0) * (22.0 / 24.0)
    assert ours == pytest.approx(chance.mean(), rel=0.03)  # normal for χ², and the trials


@pytest.mark.published("Nafi and Mayer 2011", "Figure 5")
def test_nafi_mayer_ranges_by_equation_5_as_printed() -> None:
    """Equation 5 as printed adds noise in proportion to the systematic errors. Without such errors
    0.8 % of tests exceed the machine's 1.42 µm²; with those of the example (ranges 2.9 and 5.4 µm)
    99.9 % do, and 88 % exceed the probe's 1.19 µm²: the paper's ranges are then below chance, and
    show no difference of directions in either case."""
    pair, machine = VALUES["nafi-repeat"], VALUES["nafi-machine-range"]
    alone = _ranges_by_chance(pair, np.zeros((24, 24)), literal=True)
    assert np.mean(alone[:, 0] > machine) == pytest.approx(0.008, abs=0.006)
    assert np.mean(alone[:, 1] > VALUES["nafi-probe-range"]) == pytest.approx(0.05, abs=0.015)
    assert np.quantile(alone[:, 0], [0.025, 0.975]) == pytest.approx([0.58, 1.28], abs=0.03)
    table = _example_table()
    rows, columns = table.mean(axis=1), table.mean(axis=0)
    assert [np.ptp(rows), np.ptp(columns)] == pytest.approx([2.9, 5.4], abs=0.05)
    systematic = np.add.outer(rows, columns) - table.mean()
    with_errors = _ranges_by_chance(pair, systematic, literal=True)
    assert np.mean(with_errors[:, 0] > machine) > 0.997
    assert np.mean(with_errors[:, 1] > VALUES["nafi-probe-range"]) == pytest.approx(0.88, abs=0.02)
    low, high = np.quantile(with_errors, [0.025, 0.975], axis=0)
    assert low == pytest.approx([1.92, 1.03], abs=0.06)
    assert high == pytest.approx([4.0, 2.18], abs=0.12)
    assert low[0] > machine


def _example_table() -> FloatArray:
    """The example's readings, as a matrix of machine by probe. [µm]"""
    data = np.genfromtxt(EXAMPLES / "redundancy_24x24.csv", delimiter=",", names=True)
    table = np.full((24, 24), np.nan)
    places = data["machine_index"].astype(int) - 1, data["probe_index"].astype(int) - 1
    table[places] = data["error_um"]
    return table


def _ranges_by_chance(pair_variance: float, systematic: FloatArray, *, literal: bool) -> FloatArray:
    """Ranges of the 24 variances of machine and of probe, (3000, 2), for readings of one variance.

    By equation 5 as printed, or by the squared residuals."""
    rng = np.random.default_rng(20111)
    e = systematic + np.sqrt(pair_variance) * rng.standard_normal((3000, 24, 24))
    rows, columns = e.mean(axis=2, keepdims=True), e.mean(axis=1, keepdims=True)
    fitted = rows + columns - e.mean(axis=(1, 2), keepdims=True)
    # Equation 5: of one direction, total less explained sum of squares.
    ranges = []
    for axis, mean in ((2, rows), (1, columns)):
        squares = (e - mean) ** 2 - (fitted - mean) ** 2 if literal else (e - fitted) ** 2
        # Equations 7 and 8 subtracted for two directions: 24 (u_i² - u_k²) = SSE_i - SSE_k.
        ranges.append(np.ptp(squares.sum(axis=axis), axis=1) / 24.0)
    return np.stack(ranges, axis=1)


def test_diameters_of_a_ring_along_two_axes() -> None:
    """Disagrees: not the probe. X and Y differ by 66 and 63 µm. Opposite pretravels add to 79 µm
    on average (5 mm less the effective diameter), and three lobes make sums of opposite sides
    differ by 27.5 % of it at most (a rod that lifts): 22 µm. The machine has the rest, or the
    first pair was touched 0.8 mm off the centre."""
    mean_sum = (5.0 - VALUES["ring-tip-diameter"]) * 1e3
    bound = _ideal_triangle() * mean_sum
    assert bound == pytest.approx(21.7, abs=0.1)
    first = predict(load_probe("omp40-2"), XY, "shen").force
    assert _relative_range(_sums_of_opposite_sides(first)) * mean_sum < bound
    for row in ("ring-x-less-y-first", "ring-x-less-y-second"):
        assert abs(VALUES[row]) > 2.5 * bound
    half = 0.5 * (23.075 - VALUES["ring-tip-diameter"])
    chord = 2.0 * (half - np.sqrt(half**2 - 0.77**2)) * 1e3
    assert chord == pytest.approx(abs(VALUES["ring-x-less-y-first"]), rel=0.03)


def test_bore_and_boss_with_equal_normals() -> None:
    """Disagrees by 26 µm: not the probe. Pretravel belongs to the normal, so that the side -X of
    a bore and the side +X of a boss have one effective radius. A boss off its centre changes the
    two sides of an axis by opposite amounts, a wrong diameter all four equally. What is left is
    the difference between the two axes' means: -15.5 and -41.7 µm. No pretravel makes it, unless
    the probe was turned in the spindle in between."""
    opposite = {"plus": "minus", "minus": "plus"}
    means = []
    for axis in ("x", "y"):
        differences = [
            VALUES[f"boss-{axis}-{side}"] - VALUES[f"bore-{axis}-{opposite[side]}"]
            for side in opposite
        ]
        means.append(np.mean(differences) * 1e3)
    assert means == pytest.approx([-15.5, -41.7], abs=0.05)
    assert abs(means[0] - means[1]) == pytest.approx(26.2, abs=0.1)
