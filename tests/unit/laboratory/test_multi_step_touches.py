"""Touches of the reference at each setup of a multi-step test, to errors of machine and probe."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.files.csv_table import write_csv_table
from pretravel.files.touches_csv import touches_table
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation.multi_step_touches import readings_of_touches
from pretravel.laboratory.separation.separation import separate
from pretravel.touches import Touches
from tests.support.commands import rows, run

UM, COUNT, RADIUS = 1e-3, 12, 13.0
AROUND = 2.0 * np.pi * np.arange(COUNT) / COUNT
MACHINE = 0.8 * np.cos(2.0 * AROUND) - 0.5 * np.sin(4.0 * AROUND)  # µm, no mean, no first harmonic
PROBE = 2.5 * np.cos(3.0 * AROUND) + 0.4 * np.sin(5.0 * AROUND)


def _touches(
    rng: np.random.Generator,
    noise: float = 0.0,
    *,
    ring: bool = False,
    first: float = 0.0,
    setups: np.ndarray = AROUND,
) -> Touches:
    """Every setup has a centre of its own, and a radius: those of its qualification. The touches
    are shuffled. A late trigger is a smaller circle on a sphere and a larger one in a ring."""
    azimuth = np.tile(AROUND, len(setups))
    spindle = np.repeat(setups, COUNT)
    # The direction is that of the normal, which points inwards in a ring.
    i = np.mod(np.tile(np.arange(COUNT), len(setups)) + (COUNT // 2 if ring else 0), COUNT)
    j = np.mod(i - np.rint(spindle / (2.0 * np.pi / COUNT)).astype(int), COUNT)
    outwards = np.stack([np.cos(azimuth + first), np.sin(azimuth + first), 0.0 * azimuth], axis=1)
    normals = -outwards if ring else outwards
    along = UM * (MACHINE[i] - PROBE[j] + noise * rng.standard_normal(len(i)))
    place = (
        RADIUS + rng.normal(0.0, 2.0 * UM, len(setups))[np.repeat(np.arange(len(setups)), COUNT)]
    )
    center = np.array([50.0, -20.0, 7.0]) + rng.normal(0.0, 0.02, (len(setups), 3))
    positions = center[np.repeat(np.arange(len(setups)), COUNT)] + place[:, None] * outwards
    order = rng.permutation(len(i))
    return Touches((positions + along[:, None] * normals)[order], normals[order],
                   spindle=spindle[order])  # fmt: skip


@pytest.mark.parametrize("ring", [False, True])
@pytest.mark.parametrize("first", [0.0, 0.2])
def test_errors_of_machine_and_probe_come_back(ring: bool, first: float) -> None:
    """Without noise, up to the second order of the centre's place (20 µm off 13 mm: 0.02 nm)."""
    found = readings_of_touches(_touches(np.random.default_rng(2), ring=ring, first=first))
    noise = 1e-9 * np.random.default_rng(1).standard_normal(len(found.readings))
    result = separate(replace(found.readings, errors=found.readings.errors + noise))
    assert result.machine_error == pytest.approx(UM * MACHINE, abs=1e-7)
    centred = result.probe_error - result.probe_error.mean()
    assert centred == pytest.approx(UM * PROBE, abs=1e-7)
    assert result.machine_azimuth == pytest.approx(AROUND + first)
    assert result.machines.tolist() == result.probes.tolist() == list(range(1, COUNT + 1))
    assert found.readings.lost == 3 * COUNT - 5


def test_uncertainties_are_those_of_the_noise() -> None:
    """20 tests, noise 0.5 µm: the mean of the pairs' variances within 4 standard errors (dof 90
    each: 3.3 %), though the circles take 31 of 121 degrees of freedom; the errors scatter as u
    says, but for the two harmonics that the circles take (2 of 11). 180 degrees of freedom of
    them: a deviation has 5 %."""
    rng, variances, errors, u = np.random.default_rng(3), [], [], []
    for _ in range(20):
        readings = readings_of_touches(_touches(rng, 0.5)).readings
        result = separate(readings, method="least-squares", search_outliers=False)
        variances.append(result.machine_variance.mean() + result.probe_variance.mean())
        errors.append(result.machine_error - UM * MACHINE)
        u.append(result.u_machine_error)
    mean = np.mean(variances) / (0.5 * UM) ** 2
    assert mean == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 90.0 / 20.0))
    ratio = np.std(errors) / np.sqrt(np.mean(np.square(u)))
    assert ratio == pytest.approx(np.sqrt(9.0 / 11.0), rel=0.15)


def test_lost_degrees_of_freedom_widen_all_that_is_stated() -> None:
    """Of 25 readings 16 degrees are left, of which 7 are lost: variances are higher by 16 / 9, and
    scatter more by its root as well."""
    i, j = np.divmod(np.arange(25), 5)
    readings = MultiStepReadings(i, j, UM * np.cos(np.arange(25) ** 2))
    plain = separate(readings, search_outliers=False)
    found = separate(replace(readings, lost=7), search_outliers=False)
    assert (plain.dof, found.dof) == (16, 9)
    for name, power in (
        ("machine_variance", 1), ("probe_variance", 1), ("error_covariance", 1), ("movable", 1),
        ("variance_covariance", 3), ("machine_error", 0), ("residuals", 0),
    ):  # fmt: skip
        expected = (16.0 / 9.0) ** power * getattr(plain, name)
        assert getattr(found, name) / UM**6 == pytest.approx(expected / UM**6, rel=1e-12), name
    assert separate(replace(readings, lost=15), search_outliers=False).dof == 1.0
    with pytest.raises(PretravelError, match="circles took 16 degrees of freedom, leave none"):
        separate(replace(readings, lost=16), search_outliers=False)


def test_degrees_of_freedom_of_circles_by_hand() -> None:
    """The rank of machine, probe and three columns for each circle, less that of machine and
    probe, in numpy; of a full test 3 n - 5, of four setups of twelve directions fewer."""
    for setups in (AROUND, AROUND[[0, 1, 4, 6]]):
        touches = _touches(np.random.default_rng(1), setups=setups)
        found = readings_of_touches(touches).readings
        assert touches.spindle is not None
        machine = np.equal.outer(found.machine, np.arange(1, 13)).astype(float)
        probe = np.equal.outer(found.probe, np.arange(1, 13)).astype(float)
        setup = np.isclose(touches.spindle[:, None], setups).astype(float)
        angle = np.arctan2(touches.normals[:, 1], touches.normals[:, 0])[:, None]
        own = np.concatenate([machine, probe], axis=1)
        circles = np.concatenate([setup, setup * np.cos(angle), setup * np.sin(angle)], axis=1)
        both = np.linalg.matrix_rank(np.concatenate([own, circles], axis=1))
        assert found.lost == both - np.linalg.matrix_rank(own)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: replace(t, spindle=None), "column spindle_deg"),
        (lambda t: replace(t, spindle=np.zeros(len(t))), "one orientation"),
        (lambda t: replace(t, spindle=t.spindle + 0.1), "no whole step of 30°"),
        (lambda t: _tilted(t), "off the plane across"),
        (lambda t: _moved_beside(t), "beside one of 12 equal steps"),
        (lambda t: _with_directions(t, 5), "have 5 directions"),
        (lambda t: _with_directions(t, 12, of_first=5), "0° only 5 of 12"),
    ],
)  # fmt: skip
def test_touches_that_are_no_multi_step_test(change: object, words: str) -> None:
    touches = _touches(np.random.default_rng(1))
    with pytest.raises(PretravelError, match=words):
        readings_of_touches(change(touches))  # type: ignore[operator]


def _tilted(touches: Touches) -> Touches:
    normals = touches.normals.copy()
    normals[3] = [0.8, 0.0, 0.6]
    return replace(touches, normals=normals, approaches=None)


def _with_directions(touches: Touches, count: int, of_first: int = 12) -> Touches:
    """Of so many directions, and of fewer at the first orientation."""
    number = np.rint(np.arctan2(touches.normals[:, 1], touches.normals[:, 0]) / AROUND[1]) % COUNT
    few = np.where(np.asarray(touches.spindle) == 0.0, min(of_first, count), count)
    return touches.take(number < few)


def _moved_beside(touches: Touches) -> Touches:
    """Directions of one azimuth all 3° beside."""
    angle = np.arctan2(touches.normals[:, 1], touches.normals[:, 0])
    angle = np.where(np.abs(angle - AROUND[2]) < 1e-6, angle + np.radians(3.0), angle)
    normals = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    return replace(touches, normals=normals)


def test_separate_reads_touches(tmp_path: Path) -> None:
    """One file in, the errors out: `separate` with touches gives what it gives with readings."""
    touches = _touches(np.random.default_rng(4), 0.3)
    write_csv_table(tmp_path / "touches.csv", touches_table(touches))
    told = run("separate", tmp_path / "touches.csv", "-o", tmp_path / "a.csv")
    assert "first harmonic" in told
    found = readings_of_touches(touches).readings
    direct = separate(found)
    machine = [row for row in rows(tmp_path / "a.csv") if row["kind"] == "machine"]
    assert [float(row["systematic_um"]) for row in machine] == pytest.approx(
        direct.machine_error / UM, abs=1e-4
    )
    assert [float(row["azimuth_deg"]) for row in machine] == pytest.approx(np.degrees(AROUND))
    plain = tmp_path / "plain.csv"
    write_csv_table(plain, touches_table(replace(touches, spindle=None)))
    assert "machine_index" in run("separate", plain, code=2)
