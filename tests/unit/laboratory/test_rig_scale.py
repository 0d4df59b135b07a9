"""A scale against a reference: line, periodic part and scatter of simulated scales."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.laboratory.rig.scale import check_scale, scale_doubts
from pretravel.show.result_file import read_result
from tests.support.commands import run
from tests.support.examples import EXAMPLES

NM = 1e-6
TRACES = sorted((EXAMPLES / "rig").glob("*.csv"))
PLACES = np.tile(np.linspace(0.0, 1.0, 51), 3)
RUNS = np.repeat([1, 2, 3], 51)


def _scale(
    rng: np.random.Generator, *, amplitude: float = 0.0, slope: float = 0.0, scatter: float = 3.0
) -> np.ndarray:
    """Readings at reference places of three runs over a millimetre, each with a zero of its own."""
    wave = amplitude * np.cos(2.0 * np.pi * PLACES / 0.083 + 1.0)
    noise = scatter * rng.standard_normal(len(PLACES))
    return PLACES * (1.0 + slope) + NM * (wave + noise) + 1e-3 * RUNS


@pytest.mark.long
@pytest.mark.published(
    "Ren 2020", "Figure 9",
    what="scale against an interferometer, three runs",
    ours="6.0 nm, 83 µm and 3 µm/m come back from 100 simulated scales",
    theirs="below 20 nm; readings not printed",
    verdict="agrees as a method",
    command="pretravel rig … --scale scale.csv",
)  # fmt: skip
def test_line_and_period_come_back() -> None:
    """36 scales with 6 nm at 83 µm, 3 µm/m and 3 nm: the means within 4 standard errors, and the
    slope scatters as its u says."""
    rng = np.random.default_rng(1)
    found = [check_scale(_scale(rng, amplitude=6.0, slope=3e-6), PLACES, RUNS) for _ in range(36)]
    amplitude = np.array([check.amplitude for check in found]) / NM
    assert amplitude.mean() == pytest.approx(6.0, abs=4.0 * amplitude.std() / 6.0)
    period = np.array([check.period for check in found])
    assert period.mean() == pytest.approx(0.083, abs=4.0 * period.std() / 6.0)
    slope = np.array([check.slope for check in found])
    u = np.mean([check.u_slope for check in found])
    assert slope.mean() == pytest.approx(3e-6, abs=4.0 * u / 6.0)
    assert slope.std() == pytest.approx(u, rel=0.25)
    assert np.mean([check.scatter for check in found]) == pytest.approx(3.0 * NM, rel=0.03)


@pytest.mark.slow
def test_noise_has_no_period() -> None:
    """1 % of scales without one by design: of 200 at most 7 (0.1 % of such counts have more)."""
    rng = np.random.default_rng(2)
    found = [check_scale(_scale(rng), PLACES, RUNS) for _ in range(200)]
    assert sum(np.isfinite(check.period) for check in found) <= 7
    assert all(check.amplitude == 0.0 for check in found if not np.isfinite(check.period))


def test_lines_of_the_budget_are_errors_of_lengths() -> None:
    """Monte Carlo in numpy: lengths of 4 µm anywhere on a scale with this wave, slope and scatter.
    Half a wave is many lengths long, so that both ends share a part of it: u is an upper bound for
    short lengths, and right for lengths of many waves."""
    rng = np.random.default_rng(3)
    check = check_scale(_scale(rng, amplitude=8.0, slope=2e-6), PLACES, RUNS)
    constant, slope = check.components()
    start = rng.uniform(0.0, 0.5, 20_000)
    errors = {}
    for length in (0.004, 0.4):
        ends = start, start + length + rng.uniform(0.0, 0.083, 20_000)
        wave = [8.0 * np.cos(2.0 * np.pi * end / 0.083 + 1.0) for end in ends]
        if length == 0.004:
            wave[1] = 8.0 * np.cos(2.0 * np.pi * (start + length) / 0.083 + 1.0)
        noise = 3.0 * rng.standard_normal((2, 20_000))
        errors[length] = NM * np.std(wave[1] - wave[0] + noise[1] - noise[0])
    assert errors[0.4] == pytest.approx(constant.constant, rel=0.1)
    assert errors[0.004] < constant.constant
    assert slope.per_length == pytest.approx(2e-6, abs=4.0 * check.u_slope)
    assert (constant.per_length, slope.constant) == (0.0, 0.0)


def test_forth_and_back_in_one_run() -> None:
    """No place between the steps of 0.02 mm was read: a wave shorter than two steps, which was
    32 µm high, is not looked for. Scatter 3 nm."""
    places = np.concatenate([PLACES[:51], PLACES[50::-1]])
    noise = 3.0 * NM * np.random.default_rng(5).standard_normal(len(places))
    check = check_scale(places + noise, places)
    assert check.amplitude < 3.0 * NM
    assert not scale_doubts(check)
    twice = check_scale(np.tile(places + noise, 2), np.tile(places, 2))
    assert "102 rows from reading 103" in scale_doubts(twice)[0]


def test_runs_have_zeros_of_their_own() -> None:
    rng = np.random.default_rng(4)
    one = check_scale(_scale(rng), PLACES, RUNS)
    assert one.largest_error < 15.0 * NM
    together = check_scale(_scale(np.random.default_rng(4)), PLACES)
    assert together.largest_error > 500.0 * NM


@pytest.mark.parametrize(
    ("scale", "reference", "words"),
    [
        (PLACES[:10], PLACES[:10], "10 readings"),
        (0.0 * PLACES, PLACES, "different places"),
        (1e3 * PLACES, PLACES, "both in mm"),
        (PLACES, PLACES[:5], "three columns of one length"),
    ],
)
def test_what_is_no_check(scale: np.ndarray, reference: np.ndarray, words: str) -> None:
    with pytest.raises(PretravelError, match=words):
        check_scale(scale, reference)


def test_doubts() -> None:
    assert scale_doubts(check_scale(_scale(np.random.default_rng(5)), PLACES, RUNS)) == ()
    short = check_scale(_scale(np.random.default_rng(5), slope=-5e-5), PLACES, RUNS)
    assert -5.5e-5 < short.slope < -4.5e-5
    assert "the scale is shorter than the reference by" in scale_doubts(short)[0]
    rough = check_scale(_scale(np.random.default_rng(5), scatter=1000.0), PLACES, RUNS)
    assert "too large to measure the pretravel" in scale_doubts(rough)[-1]


@pytest.mark.long
@pytest.mark.published("Ren 2020", "Figure 9")
def test_rig_with_a_scale(tmp_path: Path) -> None:
    scale = _scale(np.random.default_rng(6), amplitude=6.0)
    lines = [f"{s:.9f},{x:.9f},{r}\n" for s, x, r in zip(scale, PLACES, RUNS, strict=True)]
    file = tmp_path / "scale.csv"
    file.write_text("scale_mm,reference_mm,run\n" + "".join(lines))
    shown = run("rig", *TRACES, "--scale", file, "--plot", tmp_path / "rig.png")
    assert "periodic part of the ruler" in shown
    run("rig", *TRACES, "--scale", file, "-o", tmp_path / "rig.json")
    written = read_result(tmp_path / "rig.json").document
    assert "periodic part of the ruler" in [figure.name for figure in written.figures]
    (budget,) = written.budgets
    names = [c.name for c in budget.components if c.name.startswith("grating scale")]
    assert names == [
        "grating scale, checked: periodic part and scatter",
        "grating scale, checked: slope",
    ]
    file.write_text("scale_mm,reference_mm,u_um\n0,0,1.5\n")
    assert "a check of a scale has no column 'u_um'" in run("rig", *TRACES, "--scale", file, code=2)
    file.write_text("scale_mm,reference_mm,run\n0,0,1.5\n")
    assert "whole number" in run("rig", *TRACES, "--scale", file, code=2)
