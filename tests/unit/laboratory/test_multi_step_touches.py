"""Touches of the reference at each setup of a multi-step test, to errors of machine and probe."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.files.csv_table import write_csv_table
from pretravel.files.touches_csv import touches_table
from pretravel.laboratory.separation.multi_step_readings import (
    MultiStepReadings,
    counted_the_other_way,
)
from pretravel.laboratory.separation.multi_step_touches import readings_of_touches
from pretravel.laboratory.separation.separation import separate
from pretravel.touches import Touches
from tests.support.commands import both_outputs, rows, run

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


@pytest.mark.published(
    "Nafi and Mayer 2011", "Equation 1",
    what="reading is machine less probe",
    ours="the same; from touches of each setup",
    theirs="the same",
    verdict="agrees; mean and first harmonic are in the circles",
    command="pretravel separate touches.csv",
)  # fmt: skip
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
    assert result.dof == COUNT**2 - (2 * COUNT - 1) - (3 * COUNT - 5)


@pytest.mark.long
def test_uncertainties_are_those_of_the_noise() -> None:
    """20 tests, noise 0.5 µm: the mean of the pairs' variances within 4 standard errors (dof 90
    each: 3.3 %), though the circles take 31 of 121 degrees of freedom; the errors scatter as u
    says: of 180 degrees of freedom a deviation has 5 %."""
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
    assert ratio == pytest.approx(1.0, rel=0.15)


@pytest.mark.long
@pytest.mark.parametrize(
    "setups", [pytest.param(AROUND, marks=pytest.mark.slow), AROUND[[0, 1, 4, 6, 7]]]
)
def test_variances_of_every_direction_have_the_expectation_of_the_truth(setups: np.ndarray) -> None:
    """Exact, by enumeration: variances are quadratic in the noise, so that their expectation is
    the sum of the results for each column of a square root of its covariance. The circles take
    degrees of freedom from each direction, in proportion more from quiet ones: where only their
    number in total counted, pairs had 0.93 to 1.35 of the truth."""
    machine = 0.10 + 0.09 * np.cos(AROUND)
    probe = 0.25 + 0.24 * np.cos(3.0 * AROUND)
    quiet = _touches(np.random.default_rng(6), setups=setups)
    readings = readings_of_touches(quiet).readings
    deviation = np.sqrt(machine[readings.machine - 1] + probe[readings.probe - 1])
    turned = np.linalg.qr(np.random.default_rng(1).standard_normal((len(quiet), len(quiet))))[0]
    expected = np.zeros((COUNT, COUNT))
    for column in turned.T:
        noise = 0.1 * UM * (deviation * column)[:, None] * quiet.normals
        moved = readings_of_touches(replace(quiet, positions=quiet.positions + noise)).readings
        one = replace(moved, errors=moved.errors - readings.errors)
        found = separate(one, method="least-squares", search_outliers=False)
        expected += np.add.outer(found.machine_variance, found.probe_variance) / (0.1 * UM) ** 2
    # The circles are not quite linear: 20 µm beside the middle, of 13 mm.
    assert expected == pytest.approx(np.add.outer(machine, probe), rel=0.005, abs=1e-3)


@pytest.mark.parametrize("setups", [AROUND, AROUND[[0, 1, 4, 6, 7]]])
def test_errors_have_the_covariance_of_least_squares_with_circles(setups: np.ndarray) -> None:
    """In numpy: errors without mean and first harmonic, and three numbers for each circle."""
    touches = _touches(np.random.default_rng(5), 0.4, setups=setups)
    readings = readings_of_touches(touches).readings
    assert touches.spindle is not None
    result = separate(readings, method="least-squares", search_outliers=False)
    setup = np.isclose(touches.spindle[:, None], setups).astype(float)
    around = np.stack([np.ones(COUNT), np.cos(AROUND), np.sin(AROUND)], axis=1)
    free = np.linalg.svd(around)[0][:, 3:]
    own = around[readings.machine - 1]
    columns = [free[readings.machine - 1], -free[readings.probe - 1]]
    columns += [setup * own[:, [k]] for k in range(3)]
    full = np.concatenate(columns, axis=1)
    assert np.linalg.matrix_rank(full) == full.shape[1]
    found = np.linalg.pinv(full)
    spread = np.add.outer(result.machine_variance, result.probe_variance)
    total = np.maximum(spread[readings.machine - 1, readings.probe - 1], 0.0)
    covariance = (found * total) @ found.T
    size = free.shape[1]
    assert result.dof == len(readings) - full.shape[1]
    assert result.machine_error == pytest.approx(free @ found[:size] @ readings.errors, abs=1e-12)
    expected = np.sqrt(np.diag(free @ covariance[:size, :size] @ free.T))
    assert result.u_machine_error == pytest.approx(expected, rel=1e-6)


def test_orientation_counted_the_other_way_is_said_and_taken() -> None:
    """The probe's errors are smeared over the residuals, and its range is small: the separation
    says so, and with the other sense it is what it is with the right angles. Where nothing is
    wrong it says nothing."""
    touches = _touches(np.random.default_rng(8), 0.3)
    assert touches.spindle is not None
    right = readings_of_touches(touches).readings
    wrong = readings_of_touches(replace(touches, spindle=-touches.spindle)).readings
    found = separate(wrong)
    assert np.ptp(found.probe_error) < 0.3 * np.ptp(PROBE) * UM
    own, other = (
        float(np.sum(separate(each, search_outliers=False).residuals ** 2))
        for each in (wrong, right)
    )
    assert found.sense_ratio == pytest.approx(own / other, rel=1e-6)
    (warning,) = found.warnings
    assert "counted the other way" in warning
    assert f"{own / other:.2g} times" in warning
    again, straight = separate(counted_the_other_way(wrong)), separate(right)
    assert again.machine_error == pytest.approx(straight.machine_error, abs=1e-9)
    assert again.probe_error == pytest.approx(straight.probe_error, abs=1e-9)
    assert again.machine_variance == pytest.approx(straight.machine_variance, rel=1e-6)
    assert not straight.warnings
    assert straight.sense_ratio < 0.2


def test_orientation_of_readings_with_indices_too(tmp_path: Path) -> None:
    """`separate` finds it in a table of indices as well, and `--clockwise` takes it so."""
    readings = readings_of_touches(_touches(np.random.default_rng(8), 0.3)).readings
    wrong = np.mod(2 * (readings.machine - 1) - (readings.probe - 1), COUNT) + 1
    table = {
        "machine_index": readings.machine,
        "probe_index": wrong,
        "error_um": readings.errors / UM,
    }
    write_csv_table(tmp_path / "wrong.csv", table)
    assert "--clockwise" in both_outputs("separate", tmp_path / "wrong.csv")[1]
    arguments = ("separate", tmp_path / "wrong.csv", "--clockwise", "-o", tmp_path / "b.csv")
    assert "the other way" not in both_outputs(*arguments)[1]
    probe = [
        float(row["systematic_um"]) for row in rows(tmp_path / "b.csv") if row["kind"] == "probe"
    ]
    assert np.ptp(probe) == pytest.approx(np.ptp(PROBE), abs=0.6)


def test_even_noise_has_no_sense() -> None:
    """Without errors of the probe both senses fit alike: of 20 tests none has a warning (the
    limit is exceeded by chance in less than one of 1000)."""
    rng = np.random.default_rng(4)
    i, j = np.divmod(np.arange(COUNT * COUNT), COUNT)
    for _ in range(20):
        readings = MultiStepReadings(i + 1, j + 1, UM * rng.standard_normal(len(i)))
        assert not separate(readings, method="least-squares", search_outliers=False).warnings


def test_degrees_of_freedom_of_circles_by_hand() -> None:
    """The rank of machine, probe and three columns for each circle, less that of machine and
    probe, in numpy; of a full test 3 n - 5, of four setups of twelve directions fewer."""
    for setups in (AROUND, AROUND[[0, 1, 4, 6]]):
        touches = _touches(np.random.default_rng(1), 0.3, setups=setups)
        found = readings_of_touches(touches).readings
        assert touches.spindle is not None
        machine = np.equal.outer(found.machine, np.arange(1, 13)).astype(float)
        probe = np.equal.outer(found.probe, np.arange(1, 13)).astype(float)
        setup = np.isclose(touches.spindle[:, None], setups).astype(float)
        angle = np.arctan2(touches.normals[:, 1], touches.normals[:, 0])[:, None]
        own = np.concatenate([machine, probe], axis=1)
        circles = np.concatenate([setup, setup * np.cos(angle), setup * np.sin(angle)], axis=1)
        both = np.linalg.matrix_rank(np.concatenate([own, circles], axis=1))
        assert separate(found, search_outliers=False).dof == len(found) - both


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: replace(t, spindle=None), "column spindle_deg"),
        (lambda t: replace(t, spindle=np.zeros(len(t))), "one orientation"),
        (lambda t: replace(t, spindle=t.spindle + 0.1), "is not a whole step of 30°"),
        (lambda t: _tilted(t), "off the plane across"),
        (lambda t: _moved_beside(t), "off one of 12 equal steps"),
        (lambda t: _with_directions(t, 5), "have 5 directions"),
        (lambda t: _with_directions(t, 12, of_first=5), "0° only 5 of 12"),
        (lambda t: replace(t, feeds=np.resize([50.0, 500.0], len(t))), "0° the touches are at 50"),
        (lambda t: replace(t, tips=("a", *["b"] * (len(t) - 1))), "of 2 tips"),
        (lambda t: replace(t, positions=1e-3 * t.positions), "are the positions in mm"),
        (lambda t: replace(t, positions=t.positions + 0.3 * t.normals * np.c_[t.spindle == 0]),
         "one reference and one tip"),
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
    head, *lines = (tmp_path / "touches.csv").read_text().splitlines()
    (tmp_path / "twice.csv").write_text("\n".join([head, *lines, *lines[:12]]) + "\n")
    told = both_outputs("separate", tmp_path / "twice.csv")[1]
    assert "12 rows from" in told


def _in_steps(touches: Touches, step: float) -> MultiStepReadings:
    rounded = replace(touches, positions=step * np.round(touches.positions / step))
    return readings_of_touches(rounded).readings


def test_readings_in_coarse_steps_are_refused() -> None:
    """In steps of 10 µm the errors were covered in 67 to 76 % of the sets, or had u = 0."""
    with pytest.raises(PretravelError, match="in steps of 10 µm"):
        separate(_in_steps(_touches(np.random.default_rng(1), 0.3), 0.01))


@pytest.mark.long
def test_the_step_of_readings_is_in_u() -> None:
    """In steps of 5 µm, the reference in one place: 73 % of the machine's errors were in 2 u."""
    i, j = np.divmod(np.arange(COUNT**2), COUNT)
    normals = np.stack([np.cos(AROUND), np.sin(AROUND), 0.0 * AROUND], axis=1)[i]
    spindle, inside = AROUND[np.mod(i - j, COUNT)], []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        along = RADIUS + UM * (MACHINE[i] - PROBE[j] + 0.3 * rng.standard_normal(len(i)))
        touches = Touches(rng.uniform(-300.0, 300.0, 3) + along[:, None] * normals, normals,
                          spindle=spindle)  # fmt: skip
        found = separate(_in_steps(touches, 0.005))
        assert any("in steps of 5 µm" in each for each in found.warnings)
        for error, u, true in ((found.machine_error, found.u_machine_error, MACHINE),
                               (found.probe_error, found.u_probe_error, PROBE)):  # fmt: skip
            inside.append(np.abs(error - UM * true) <= 2.0 * u)
    assert np.mean(inside) >= 0.93


def test_the_step_of_readings_by_index_is_found(tmp_path: Path) -> None:
    i, j = np.divmod(np.arange(COUNT**2), COUNT)
    errors = 10.0 * np.round(MACHINE[i] - PROBE[j])
    write_csv_table(
        tmp_path / "readings.csv",
        {"machine_index": i + 1, "probe_index": j + 1, "error_um": errors},
    )
    assert "in steps of" in run("separate", tmp_path / "readings.csv", code=2)


def _by_index(path: Path, **columns: np.ndarray) -> Path:
    i, j = np.divmod(np.arange(COUNT**2), COUNT)
    errors = MACHINE[i] - PROBE[j] + np.random.default_rng(1).normal(0.0, 0.3, COUNT**2)
    table = {"machine_index": i + 1, "probe_index": j + 1, "error_um": errors, **columns}
    write_csv_table(path, table)
    return path


def test_what_differs_over_readings_by_index_is_named(tmp_path: Path) -> None:
    """But not the orientation, which follows from the indices of a plan."""
    i, j = np.divmod(np.arange(COUNT**2), COUNT)
    turned = {"spindle_deg": 30 * (i - j) - 360, "machine_azimuth_deg": 30 * i}
    readings = _by_index(tmp_path / "r.csv", feed_mm_min=i % 2, **turned)
    told = both_outputs("separate", readings)[1]
    assert "not read, although it differs over the readings: feed_mm_min\n" in told
    assert "copies" not in told.lower()
    head, *lines = readings.read_text().splitlines()
    for copies in ([*lines, *lines], [line for line in lines for _ in range(2)]):
        readings.write_text("\n".join([head, *copies]))
        assert "make scatter and u too small" in " ".join(
            both_outputs("separate", readings)[1].split()
        )


@pytest.mark.parametrize(
    ("name", "step", "first"),
    [("spindle_deg", -30, 0), ("orientation_deg", 15, 0), ("machine_azimuth_deg", 30, 90)],
)
def test_angles_that_contradict_the_indices_are_refused(
    tmp_path: Path, name: str, step: int, first: int
) -> None:
    i, j = np.divmod(np.arange(COUNT**2), COUNT)
    angles = step * (i if name.startswith("machine") else i - j) + first
    found = run("separate", _by_index(tmp_path / "r.csv", **{name: angles}), code=2)
    assert f": {name} is" in found
