"""Nafi and Mayer, section VI: a separation in simulations, budgets, features and maps."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.drawing.features.feature_trials import feature_by_trials
from pretravel.drawing.features.form_of_part import NO_FORM
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.drawing.tasks.check_budget.budget_check import ActingErrors, check_budget
from pretravel.files.csv_table import write_csv_table
from pretravel.files.map_file import read_map
from pretravel.files.touch_scatter_file import read_touch_scatter
from pretravel.files.touches_csv import read_touches, touches_table
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation.probe_map import separation_map
from pretravel.laboratory.separation.ranges import ranges_of_variances
from pretravel.laboratory.separation.separation import separate
from pretravel.measurement.points import Points
from pretravel.measurement.touch_scatter import TouchScatter
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches
from tests.support.commands import both_outputs, rows, run

UM = 1e-3
COUNT = 12
AROUND = 2.0 * np.pi * np.arange(COUNT) / COUNT
MACHINE = 0.8 * np.cos(2.0 * AROUND)
PROBE = 2.5 * np.cos(3.0 * AROUND)
OUTWARD = np.stack([np.cos(AROUND), np.sin(AROUND), 0.0 * AROUND], axis=1)


def _setup(step: int, noise: np.ndarray) -> Touches:
    """Touches of a sphere of 20 mm, with a tip of 4 mm, at one orientation of the probe."""
    error = MACHINE - PROBE[(np.arange(COUNT) - step) % COUNT] + noise
    return Touches((12.0 + UM * error)[:, None] * OUTWARD, OUTWARD)


def test_each_setup_is_a_file(tmp_path: Path) -> None:
    """Twelve files in a folder, their orientations stated, are the same test as one file."""
    noise = 0.3 * np.random.default_rng(2).standard_normal((COUNT, COUNT))
    setups = [_setup(step, noise[step]) for step in range(COUNT)]
    folder = tmp_path / "setups"
    folder.mkdir()
    for step, touches in enumerate(setups):
        write_csv_table(folder / f"setup_{30 * step:03d}.csv", touches_table(touches))
    one = Touches(
        np.concatenate([t.positions for t in setups]),
        np.concatenate([t.normals for t in setups]),
        spindle=np.repeat(AROUND, COUNT),
    )
    write_csv_table(tmp_path / "one.csv", touches_table(one))
    run("separate", folder, "--spindle", "0:330:30", "-o", tmp_path / "a.csv")
    run("separate", tmp_path / "one.csv", "-o", tmp_path / "b.csv")
    assert rows(tmp_path / "a.csv") == rows(tmp_path / "b.csv")
    told = run("separate", folder, "--spindle", "0,30", code=2)
    assert "2 orientations of the spindle were given for 12 files" in told


def test_a_probe_that_lies(tmp_path: Path) -> None:
    """The axis of the probe along the machine's x: the equator is in the plane y, z."""
    turn = probe_rotation((1.0, 0.0, 0.0), 0.0)
    noise = 0.1 * np.random.default_rng(2).standard_normal((COUNT, COUNT))
    setups = [_setup(step, noise[step]) for step in range(COUNT)]
    touches = Touches(
        np.concatenate([t.positions for t in setups]) @ turn.T,
        np.concatenate([t.normals for t in setups]) @ turn.T,
        spindle=np.repeat(AROUND, COUNT),
    )
    write_csv_table(tmp_path / "t.csv", touches_table(touches))
    assert "off the plane across" in run("separate", tmp_path / "t.csv", code=2)
    run("separate", tmp_path / "t.csv", "--axis", "1,0,0", "-o", tmp_path / "s.csv",
        "--map", tmp_path / "map.json", "--tip-diameter", 4)  # fmt: skip
    probe = [float(r["systematic_um"]) for r in rows(tmp_path / "s.csv") if r["kind"] == "probe"]
    assert probe == pytest.approx(PROBE, abs=0.2)  # five standard uncertainties of the mean of 12
    found = read_map(tmp_path / "map.json").pretravel(OUTWARD @ turn.T)
    assert 1e3 * found == pytest.approx(probe - np.mean(probe), abs=1e-6)


def test_the_probes_errors_as_a_map_take_them_off() -> None:
    """Touches of the test's own sphere, compensated with the map, keep the machine's errors: the
    probe's are gone in every orientation."""
    i, j = np.divmod(np.arange(COUNT**2), COUNT)
    noise = 1e-6 * np.random.default_rng(1).standard_normal(len(i))
    result = separate(MultiStepReadings(i + 1, j + 1, UM * (MACHINE[i] - PROBE[j]) + noise))
    made = separation_map(result, 2.0)
    assert made.pretravel(OUTWARD) == pytest.approx(UM * PROBE, abs=5e-6)
    between = np.array([[np.cos(0.1), np.sin(0.1), 0.0]])
    expected = np.interp(0.1, AROUND, PROBE)
    assert made.pretravel(between)[0] == pytest.approx(UM * expected, abs=5e-6)
    assert made.repeatability == pytest.approx(1e-6, rel=0.3)
    assert not made.provenance.level_known  # a probe that is identified from it has any mean
    missed = PROBE - 0.5 * (np.roll(PROBE, 1) + np.roll(PROBE, -1))  # each from its neighbours
    assert made.fixed_scatter == pytest.approx(0.5 * UM * np.sqrt(np.mean(missed**2)), rel=1e-3)
    with pytest.raises(PretravelError, match="needs the azimuths"):
        separation_map(replace(result, probe_azimuth=np.full(COUNT, np.nan)), 2.0)


def test_the_form_of_a_plan_is_one_of_touches(tmp_path: Path) -> None:
    """It has the normal and the orientation of each touch: with x, y, z it is read as touches."""
    form = tmp_path / "form.csv"
    run("separation-plan", "--directions", COUNT, "--variance", 0.1, "--u-systematic", 0.12,
        "-o", form)  # fmt: skip
    plan = rows(form)
    azimuth = np.radians([float(row["machine_azimuth_deg"]) for row in plan])
    normals = np.array([[float(row[f"n{axis}"]) for axis in "xyz"] for row in plan])
    assert normals == pytest.approx(
        np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1), abs=1e-8
    )
    assert [row["spindle_deg"] for row in plan] == [row["orientation_deg"] for row in plan]
    machine = np.array([int(row["machine_index"]) for row in plan]) - 1
    probe = np.array([int(row["probe_index"]) for row in plan]) - 1
    noise = 0.1 * np.random.default_rng(3).standard_normal(len(plan))
    reach = 12.0 + UM * (MACHINE[machine] - PROBE[probe] + noise)
    filled = {name: [row[name] for row in plan] for name in plan[0] if name != "error_um"}
    filled |= {f"{axis}_mm": reach * normals[:, k] for k, axis in enumerate("xyz")}
    write_csv_table(tmp_path / "touches.csv", filled)
    run("separate", tmp_path / "touches.csv", "-o", tmp_path / "s.csv")
    found = [float(r["systematic_um"]) for r in rows(tmp_path / "s.csv") if r["kind"] == "probe"]
    assert found == pytest.approx(PROBE, abs=0.3)


def test_directions_around_the_equator(tmp_path: Path) -> None:
    told = run("pattern", "equator-24", "--diameter", 20, "-o", tmp_path / "p.csv")
    assert "standard" not in told
    found = np.array([[float(r[f"n{axis}"]) for axis in "xyz"] for r in rows(tmp_path / "p.csv")])
    angle = 2.0 * np.pi * np.arange(24) / 24
    assert found == pytest.approx(
        np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], 1), abs=1e-9
    )


def test_ranges_by_chance_are_those_of_a_simulation_in_numpy() -> None:
    """24 x 24 readings of equal variances: range of the sums of squared residuals of a two-way
    table, each over its own factor of variations, (n - 1)(n - 2) / n. 95 % of 2000 tests each: of
    such a quantile 1 % scatter."""
    n, rng = 24, np.random.default_rng(9)
    table = rng.standard_normal((2000, n, n))
    left = table - table.mean(1, keepdims=True) - table.mean(2, keepdims=True)
    left += table.mean((1, 2), keepdims=True)
    sums = np.sum(left**2, axis=2) * n / ((n - 1) * (n - 2))
    level = np.sum(left**2, axis=(1, 2)) / (n - 1) ** 2
    expected = float(np.quantile(np.ptp(sums, axis=1) / level, 0.95))
    i, j = np.divmod(np.arange(n * n), n)
    machine, probe = ranges_of_variances(MultiStepReadings(i, j, UM * table[0].ravel()))
    for found, own in ((machine, sums[0]), (probe, None)):
        assert found.by_chance / (level[0] * UM**2) == pytest.approx(expected, rel=0.05)
        if own is not None:
            assert found.value == pytest.approx(np.ptp(own) * UM**2, rel=1e-9)


def test_verdict_on_ranges() -> None:
    """Lobes of the probe's variance from 0.05 to 0.95 µm² are named; the even machine is not."""
    i, j = np.divmod(np.arange(24 * 24), 24)
    variance = 0.5 + 0.45 * np.cos(2.0 * np.pi * 3.0 * j / 24)
    noise = UM * np.sqrt(variance) * np.random.default_rng(4).standard_normal(len(i))
    machine, probe = ranges_of_variances(MultiStepReadings(i, j, noise))
    assert probe.differs
    assert not machine.differs


def _scatter(error: float = 0.0) -> TouchScatter:
    """Quiet at 0° and 180°, loud at 90° and 270°; the probe even."""
    angle = np.arange(4) * 0.5 * np.pi
    return TouchScatter(
        angle, np.array([0.01, 0.81, 0.01, 0.81]) * UM**2, angle, np.full(4, 0.03) * UM**2,
        machine_error=error * UM * np.array([1.0, -1.0, 1.0, -1.0]),
    )  # fmt: skip


def test_errors_are_drawn_by_direction() -> None:
    """Variances of 0.04 and 0.84 µm², and the machine's error as their mean, of 20000 touches each:
    within 5 standard errors."""
    normals = np.repeat([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 20000, axis=0)
    drawn = _scatter(0.6).drawn(normals, np.eye(3), np.random.default_rng(1)) / UM
    for part, mean, variance in ((drawn[:20000], 0.6, 0.04), (drawn[20000:], -0.6, 0.84)):
        assert part.mean() == pytest.approx(mean, abs=5.0 * np.sqrt(variance / 20000))
        assert part.var() == pytest.approx(variance, rel=5.0 * np.sqrt(2.0 / 20000))
    oblique = np.array([[0.6, 0.0, 0.8]])
    with pytest.raises(PretravelError, match="give the noise along the axis") as error:
        _scatter().drawn(oblique, np.eye(3), np.random.default_rng(1))
    assert error.value.inputs == ("noise",)
    many = _scatter(0.6).drawn(
        np.repeat(oblique, 20000, axis=0), np.eye(3), np.random.default_rng(1), 0.5 * UM
    )
    variance = 0.36 * 0.04 + 0.64 * 0.25
    assert many.var() / UM**2 == pytest.approx(variance, rel=5.0 * np.sqrt(2.0 / 20000))
    assert many.mean() / UM == pytest.approx(0.6 * 0.6, abs=5.0 * np.sqrt(variance / 20000))


@pytest.fixture
def separated(tmp_path: Path) -> Path:
    """A result of `separate` in a file: variances by direction, and the machine's errors."""
    angle = np.degrees(np.arange(4) * 0.5 * np.pi)
    table = {
        "kind": ["machine"] * 4 + ["probe"] * 4,
        "index": [1, 2, 3, 4] * 2,
        "systematic_um": [0.6, -0.6, 0.6, -0.6, 0.0, 0.0, 0.0, 0.0],
        "variance_um2": [0.01, 0.81, 0.01, 0.81, 0.03, 0.03, 0.03, 0.03],
        "azimuth_deg": np.concatenate([angle, angle]),
    }
    write_csv_table(tmp_path / "s.csv", table)
    return tmp_path / "s.csv"


def test_simulate_with_a_separation(tmp_path: Path, separated: Path) -> None:
    """Less the touches without it, the errors of 2000 touches in two directions are those of the
    separation: outward, with the variance of their pair."""
    targets = tmp_path / "targets.csv"
    normals = np.repeat([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 1000, axis=0)
    write_csv_table(targets, {f"n{axis}": normals[:, k] for k, axis in enumerate("xyz")})
    arguments = ("simulate", "omp40-2", "--surface", "sphere:radius=10", "--targets", targets)
    run(*arguments, "-o", tmp_path / "plain.csv")
    run(*arguments, "--machine", separated, "--seed", 3, "-o", tmp_path / "noisy.csv")
    plain, noisy = (read_touches(tmp_path / f"{name}.csv") for name in ("plain", "noisy"))
    off = np.sum((noisy.positions - plain.positions) * normals, axis=1) / UM
    for part, mean, variance in ((off[:1000], 0.6, 0.04), (off[1000:], -0.6, 0.84)):
        assert part.mean() == pytest.approx(mean, abs=5.0 * np.sqrt(variance / 1000))
        assert part.var() == pytest.approx(variance, rel=5.0 * np.sqrt(2.0 / 1000))
    pole = tmp_path / "pole.csv"
    write_csv_table(pole, {"nx": [0.0], "ny": [0.0], "nz": [1.0]})
    told = run(*arguments[:5], pole, "--machine", separated, "-o", tmp_path / "p.csv", code=2)
    assert "give the noise along the axis" in told
    assert "--noise" in told
    # 0 is the default, and is used where it is typed.
    run(*arguments[:5], pole, "--machine", separated, "--noise", 0, "-o", tmp_path / "p.csv")


def test_read_scatter_has_the_machines_errors(separated: Path) -> None:
    found = read_touch_scatter(separated)
    assert found.machine_error == pytest.approx(UM * np.array([0.6, -0.6, 0.6, -0.6]))
    text = separated.read_text()
    head, first, *others = text.splitlines()
    for other, reason in (
        ("\n".join([head, first, first, *others]), "machine has azimuth_deg 0 twice"),
        (text.replace("probe", "Probe"), "kind is 'Probe'"),
        (text.replace("-0.6", "", 1), "systematic_um of the machine is empty in some rows"),
        ("\n".join([f"{head},unit", *(f"{row},nm" for row in (first, *others))]), "'unit'"),
        (f"# standard deviations, 20 µm\n{text}", "line 1: '# standard deviations, 20 µm' is not"),
        (text.split("probe")[0], "^[^(]*azimuths of its probe"),
        (_with_column(text, "azimuth_deg", math.radians(1.0)), "machine lie within 4.71°"),
        (_with_column(text, "variance_um2", 1e-6), r"variance of \S+ µm² together, less than any"),
    ):
        separated.write_text(other)
        with pytest.raises(PretravelError, match=reason) as refused:
            read_touch_scatter(separated)
        assert str(refused.value).count(separated.name) == 1


def _with_column(text: str, name: str, factor: float) -> str:
    """A table with one column in another unit."""
    head, *rows = [line.split(",") for line in text.splitlines()]
    place = head.index(name)
    for row in rows:
        row[place] = str(factor * float(row[place]))
    return "\n".join(",".join(row) for row in (head, *rows)) + "\n"


@pytest.mark.long
def test_check_budget_with_a_separation() -> None:
    """A mean map knows one repeatability: in loud directions a touch scatters 4.6 times as much as
    in quiet ones. The errors of points there are those of the separation, and U follows them.
    Errors of the machine of 4 µm are in the errors of points, too."""
    n = np.repeat(np.concatenate([OUTWARD, [[0.0, 0.0, 1.0]]]), 3, axis=0)
    noise = np.random.default_rng(1).normal(0.0, 0.5 * UM, len(n))
    touches = Touches(n * (12.0 - 0.010 + noise)[:, None], n)

    def again(touched: Touches) -> Qualification:
        return qualify(touched, 20.0, tip_diameter=4.0, kind="mean", u_temperature=0.0)

    sizes = []
    for machine_error, sets in ((0.0, 20), (4.0, 8)):
        acting = ActingErrors(0.5 * UM, scatter=_scatter(machine_error))
        found = check_budget(touches, again(touches), again, acting, sets=sets, rng=1)
        points = found.coverages[0]
        sizes.append(float(np.sqrt(np.mean(points.errors**2))) / UM)
        if machine_error == 0.0:
            across = np.abs(found.directions[:, 2]) < 0.3
            loud = across & (np.abs(found.directions[:, 1]) > 0.8)
            quiet = across & (np.abs(found.directions[:, 0]) > 0.8)
            for values in (points.u, points.errors):  # 0.8 µm² apart, less between the directions
                more = np.mean(values[:, loud] ** 2) - np.mean(values[:, quiet] ** 2)
                assert 0.25 < more / UM**2 < 1.0
            assert points.verdict != "too small"
    assert sizes[1] > sizes[0] + 1.0  # 4 µm cos 2a: 2.8 µm in the middle of all walls


@pytest.mark.long
def test_trials_of_a_bore_are_the_linear_law() -> None:
    """36 points with an own u that differs by direction and one in common: u of the diameter and
    of x by trials against 2 sqrt(Σ u² / n² + common²) and 2 sqrt(Σ u² cos²) / n, 1000 trials:
    a standard deviation is known to 2.2 %, of 500 to 3.2 %.
    What the residuals say of the form is added: the trials draw it, and U, which also covers
    roughness that the residuals do not exclude, is up to a quarter larger."""
    angle = 2.0 * np.pi * np.arange(36) / 36
    outward = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    own = UM * np.where(np.abs(np.sin(angle)) > 0.7, 0.9, 0.2)
    total = own**2 + (0.8 * UM) ** 2
    points = Points(
        10.0 * outward + (own * np.random.default_rng(1).standard_normal(36))[:, None] * outward,
        -outward, np.zeros(36), total[:, None, None] * outward[:, :, None] * outward[:, None, :],
        None, tuple(map(str, range(36))), {"tip radius": np.full(36, 0.8 * UM)},
    )  # fmt: skip
    measured = measure_feature(points, "bore", axis=[0.0, 0.0, 1.0])
    plain = replace(measured.errors, form=NO_FORM)
    without = feature_by_trials(replace(measured, errors=plain), 1000)
    found = {each.quantity.name: each for each in without}
    size = 2.0 * np.sqrt(np.sum(own**2) / 36**2 + (0.8 * UM) ** 2)
    assert found["diameter"].u == pytest.approx(size, rel=0.06)
    x = 2.0 * np.sqrt(np.sum(own**2 * np.cos(angle) ** 2)) / 36
    assert found["x"].u == pytest.approx(x, rel=0.06)
    low, high = found["diameter"].interval
    assert high - low == pytest.approx(2.0 * 1.96 * size, rel=0.06)
    assert found["diameter"].quantity.u == pytest.approx(size, rel=0.02)
    # An error of the machine is that of a length: it adds in quadrature, once.
    machine = 1.5 * UM
    moved = replace(measured, errors=replace(plain, machine=machine))
    found = {each.quantity.name: each.u for each in feature_by_trials(moved, 500)}
    assert found["diameter"] == pytest.approx(np.hypot(size, machine), rel=0.08)
    assert found["x"] == pytest.approx(np.hypot(x, machine), rel=0.08)
    for each in feature_by_trials(measured, 500):
        low, high = each.interval
        assert 0.75 < 0.5 * (high - low) / each.quantity.expanded_u < 1.1


def test_measure_with_trials(tmp_path: Path, separated: Path) -> None:
    """From touches to a circle: its trials stand in the report, beside the analytic u."""
    noise = np.zeros(COUNT)
    touches = _setup(0, noise)
    write_csv_table(tmp_path / "t.csv", touches_table(touches))
    i, j = np.divmod(np.arange(COUNT**2), COUNT)
    result = separate(
        MultiStepReadings(i + 1, j + 1, UM * (MACHINE[i] - PROBE[j])
                          + 1e-4 * np.random.default_rng(1).standard_normal(len(i)))
    )  # fmt: skip
    from pretravel.files.map_file import write_map

    write_map(tmp_path / "map.json", separation_map(result, 2.0))
    run("compensate", tmp_path / "t.csv", "--map", tmp_path / "map.json", "--machine", separated,
        "-o", tmp_path / "p.csv")  # fmt: skip
    told = both_outputs("measure", tmp_path / "p.csv", "--feature", "circle", "--trials", 400)[0]
    assert "By Monte Carlo" in told
    (line,) = [line for line in told.splitlines() if "diameter / mm" in line]
    analytic, trials = (float(word) for word in line.split()[5:7])
    assert trials == pytest.approx(analytic, rel=0.3)
    assert "trials" in run("measure", tmp_path / "p.csv", "--feature", "circle", "--trials", 400,
                           "--association", "inscribed", code=2)  # fmt: skip
