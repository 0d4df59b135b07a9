"""Touches at 0° and 180° of the spindle: run-out and odd lobes drop out of the means."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.departures.probes import six_seats
from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.controls.map_identity import check_map_of_program
from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.laboratory.reversal import reversed_touches
from pretravel.measurement.compensation import apply
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches
from tests.support.commands import both_outputs, run
from tests.support.example_maps import lobes

PHI = np.radians(np.arange(0.0, 360.0, 10.0))
NORMALS = np.stack([np.cos(PHI), np.sin(PHI), np.zeros(len(PHI))], axis=1)
RUNOUT = np.array([0.012, -0.005, 0.0])
NOISE = 0.3e-3


def _travel(azimuth: FloatArray) -> FloatArray:
    odd = 0.006 * np.cos(3.0 * azimuth - 0.7) + 0.001 * np.cos(5.0 * azimuth)
    return np.asarray(0.012 + odd + 0.002 * np.cos(2.0 * azimuth - 0.3))


def _even(azimuth: FloatArray) -> FloatArray:
    return np.asarray(0.012 + 0.002 * np.cos(2.0 * azimuth - 0.3))


def _pin(turn: float, rng: np.random.Generator) -> Touches:
    """A pin of 25 mm: the tip is beside the axis and its lobes are turned with the spindle."""
    c, s = np.cos(turn), np.sin(turn)
    beside = np.array([c * RUNOUT[0] - s * RUNOUT[1], s * RUNOUT[0] + c * RUNOUT[1], 0.0])
    reach = 12.5 + 3.0 - _travel(PHI - turn) + rng.normal(0.0, NOISE, len(PHI))
    return Touches(NORMALS * reach[:, None] - beside, NORMALS, spindle=np.full(len(PHI), turn))


def _both(seed: int = 0) -> Touches:
    rng = np.random.default_rng(seed)
    one, other = _pin(0.0, rng), _pin(np.pi, rng)
    return Touches(
        np.vstack([one.positions, other.positions[::-1]]),
        np.vstack([NORMALS, NORMALS[::-1]]),
        spindle=np.repeat([0.0, np.pi], len(PHI)),
    )


def test_means_have_even_lobes_only() -> None:
    found = reversed_touches(_both())
    read = 15.5 - np.sum(found.means.positions * NORMALS, axis=1)
    assert np.std(read - _even(PHI)) == pytest.approx(NOISE / np.sqrt(2.0), rel=0.4)
    assert found.means.spindle is None


def test_means_are_used_with_maps_of_means_alone() -> None:
    """A map with three lobes has odd ones, which means have not."""
    means, single = reversed_touches(_both()).means, _pin(0.0, np.random.default_rng(0))
    plain = lobes(3)
    of_means = replace(plain, provenance=replace(plain.provenance, orientation="A0 reversal"))
    apply(single, plain, extrapolate=True)
    apply(means, of_means, extrapolate=True)
    with pytest.raises(PretravelError, match="the touches are from means at two orientations"):
        apply(means, plain, extrapolate=True)
    with pytest.raises(PretravelError, match="the map is from means at two orientations"):
        apply(single, of_means, extrapolate=True)
    with pytest.raises(PretravelError, match="without odd lobes"):
        check_map_of_program(of_means, 30.0, np.array([50.0]))


def test_what_is_taken_out() -> None:
    """Run-out and lobes within U of 95 %: of 20 x 4 values at least 70."""
    within = []
    for seed in range(20):
        found = reversed_touches(_both(seed))
        reach = found.factor * found.u
        within += (np.abs(found.runout - RUNOUT[:2]) < reach[0]).tolist()
        within += (np.abs(found.amplitudes[1:] - [0.006, 0.001]) < reach[1:]).tolist()
        # Ten degrees of freedom at least, beside 26 numbers: 22 %, and two of these.
        assert found.noise == pytest.approx(NOISE, rel=0.45)
    assert np.sum(within) >= 70


@pytest.mark.parametrize(
    ("touches", "reason"),
    [
        (replace(_both(), spindle=None), "do not give the orientation"),
        (replace(_both(), spindle=np.repeat([0.0, 1.5], 36)), "180° apart"),
        (replace(_both(), feeds=np.repeat([50.0, 200.0], 36)), "at 200 mm/min"),
        (_both().take(np.arange(71)), "touch 1 has no touch at the other orientation"),
        (_both().take(np.arange(1, 72)), "touch 71 has no touch at the first"),
    ],
)
def test_refused(touches: Touches, reason: str) -> None:
    with pytest.raises(PretravelError) as caught:
        reversed_touches(touches)
    assert reason in str(caught.value)


def test_a_spindle_that_was_not_turned_is_said(tmp_path: Path) -> None:
    """Both files at 0°: the differences are noise alone, and the means keep offset and lobes."""
    rng, paths = np.random.default_rng(3), [tmp_path / "at_0.csv", tmp_path / "at_180.csv"]
    for turned, said in ((0.0, True), (np.pi, False)):
        for path, turn in zip(paths, (0.0, turned), strict=True):
            write_touches(path, replace(_pin(turn, rng), spindle=None))
        warned = both_outputs("reversal", *paths, "--spindle", "0,180")[1]
        assert ("Was the spindle turned by 180°" in warned) is said


def test_few_directions_have_means_but_no_lobes() -> None:
    touches = _both().take([0, 9, 18, 27, 71, 62, 53, 44])
    found = reversed_touches(touches)
    assert len(found.means) == 4
    assert np.isnan(found.noise)


@pytest.mark.parametrize(
    ("count", "together"), [(8, (5, 11, 13)), (12, (9, 15, 21)), (13, (23, 29)), (24, (21, 27))]
)
def test_lobes_that_directions_do_not_tell_apart(count: int, together: tuple[int, ...]) -> None:
    """Probes of `benchmarks.departures`: the lobe of three is in U; χ² is that of 40 sets, which
    scatters by 0.22. n equal steps show m and n - m, 2 n - m alike, of the odd
    orders that a reversal has. Before, the lobe of nine was in that of three of twelve directions
    (22 % in U), u of eight was 19 m, and the noise of 16 was three times too large."""
    azimuth, fine = np.arange(count) * 2.0 * np.pi / count, np.arange(720) * np.pi / 360.0
    normals, all_around = (
        np.stack([np.cos(a), np.sin(a), np.zeros(len(a))], axis=1) for a in (azimuth, fine)
    )
    squares, noises = [], []
    for seed in range(40):
        rng = np.random.default_rng([5, seed])
        probe = six_seats(rng)
        reach = [
            15.5 - probe.pretravel(side * normals) + rng.normal(0.0, NOISE, count)
            for side in (1.0, -1.0)
        ]
        both = Touches(
            np.vstack([normals * each[:, None] for each in reach]),
            np.vstack([normals, normals]),
            spindle=np.repeat([0.0, np.pi], count),
        )
        found = reversed_touches(both)
        true = 2.0 * np.abs(np.fft.rfft(probe.pretravel(all_around)))[3] / 720.0
        squares.append(((found.amplitudes[1] - true) / found.u[1]) ** 2)
        noises.append(found.noise)
        assert found.together[1][: len(together)] == together
        assert np.isnan(found.amplitudes[2]) == (5 in together)
    assert 0.2 < np.mean(squares) < 1.6
    assert NOISE < np.sqrt(np.mean(np.square(noises))) < 1.5 * NOISE


def test_command(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    for name, turn in (("a.csv", 0.0), ("b.csv", np.pi)):
        write_touches(tmp_path / name, replace(_pin(turn, rng), spindle=None))
    files, means = (tmp_path / "a.csv", tmp_path / "b.csv"), tmp_path / "means.csv"
    out = run("reversal", *files, "--spindle", "0,180", "-o", means, "--plot", tmp_path / "a.png")
    assert "36 means of two orientations: without run-out and odd lobes" in out
    assert "lobes of order 3" in out
    assert len(read_touches(means)) == 36
    out = run("qualify", means, "--pin", "--diameter", 25, "--tip-diameter", 6, "--kind", "mean")
    assert "effective radius" in out
    assert "do not give the orientation" in run("reversal", *files, code=2)


def _six_lobes(azimuths: int, seed: int = 1) -> Touches:
    """Means of a three-rod probe in a ring of 25 mm: a mean, six lobes, noise."""
    angle = 2.0 * np.pi * np.arange(3 * azimuths) / azimuths
    n = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=1)
    noise = np.random.default_rng(seed).normal(0.0, NOISE / np.sqrt(2.0), len(angle))
    reach = 9.5 + 0.018 + 0.002 * np.cos(6.0 * angle) + noise
    return Touches(-n * reach[:, None], n, orientations=("reversal",) * len(angle))


def test_a_map_of_means_has_even_orders_between_its_directions() -> None:
    """Nine azimuths show six lobes as three, which means cannot have; the models of single touches
    took them for three, and were 6 µm off between the directions. Eight show them as two."""
    found = qualify(_six_lobes(9), 25.0, tip_diameter=6.0, ring=True, kind="harmonic")
    # Means have no lobe of order one, which single touches do not distinguish from a shift.
    assert np.sqrt(np.diag(found.center_covariance)[:2]).max() < 0.1e-3
    made = found.pretravel_map
    between = from_angles(0.5 * np.pi, PHI)
    value, u = made.pretravel_and_uncertainty(between)
    error = value - 0.018 - 0.002 * np.cos(6.0 * PHI)
    assert np.sqrt(np.mean(error**2)) < 0.5e-3
    assert np.mean(np.abs(error) < 2.0 * u) > 0.9
    for azimuths in (8, 12):
        with pytest.raises(PretravelError, match="show six lobes, which three rods make, as fewer"):
            qualify(_six_lobes(azimuths), 25.0, tip_diameter=6.0, ring=True)
    with pytest.raises(PretravelError, match="physical is a model of single touches"):
        qualify(_six_lobes(9), 25.0, tip_diameter=6.0, ring=True, kind="physical")


def test_the_offset_is_that_at_0_whatever_comes_first() -> None:
    touches = _both()
    other = touches.take(np.argsort(-np.asarray(touches.spindle), kind="stable"))
    runout = reversed_touches(other).runout
    assert runout == pytest.approx(reversed_touches(touches).runout, abs=1e-9)
    assert runout == pytest.approx(RUNOUT[:2], abs=1e-3)  # noise, and the lobe of order one


def test_repeats_are_paired_in_their_order() -> None:
    """The nearest of three repeats gave the first touch the best partner, and a drift."""
    rng = np.random.default_rng(2)
    one, other = (replace(_pin(turn, rng)) for turn in (0.0, np.pi))
    again = [replace(each, positions=each.positions + 1e-3 * each.normals) for each in (one, other)]
    joined = Touches(
        np.vstack([one.positions, again[0].positions, other.positions, again[1].positions]),
        np.vstack([NORMALS] * 4), spindle=np.repeat([0.0, np.pi], 2 * len(PHI)),
    )  # fmt: skip
    means = reversed_touches(joined).means.positions.reshape(2, -1, 3)
    assert means[1] - means[0] == pytest.approx(1e-3 * NORMALS, abs=1e-12)
