"""Is U right: closed forms of what a wrong statement costs, and the command."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.special import erf
from scipy.stats import t

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.drawing.tasks.check_budget import CheckBudget
from pretravel.drawing.tasks.check_budget.budget_check import (
    ActingErrors,
    BudgetCheck,
    Coverage,
    check_budget,
)
from pretravel.drawing.tasks.check_budget.task import coverage_view
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualify
from pretravel.show import Dots
from pretravel.touches import Touches
from tests.support.commands import run

SPHERE = "examples/data/sphere_touches.csv"
NOISE = 0.3e-3
DIRECTIONS = np.repeat(sphere_pattern_25(), 3, axis=0)


def _checked(acting: ActingErrors, *, sets: int, **options: float) -> BudgetCheck:
    """A probe with one pretravel in all directions, qualified by a mean radius."""
    noise = np.random.default_rng(3).normal(0.0, NOISE, len(DIRECTIONS))
    touches = Touches(DIRECTIONS * (12.5 + 3.0 - 0.010 + noise[:, None]), DIRECTIONS)
    settings = {"u_diameter": 0.2e-3, "u_temperature": 0.0, **options}
    again = partial(qualify, diameter=25.0, tip_diameter=6.0, kind="mean", **settings)
    return check_budget(touches, again(touches), again, acting, sets=sets, rng=5)


def _named(found: BudgetCheck, name: str) -> Coverage:
    return next(each for each in found.coverages if each.name.startswith(name))


@pytest.mark.long
def test_a_diameter_that_is_worse_than_stated() -> None:
    """The error of the sphere's diameter is that of every bore; 0.2 µm stated, 2 µm true."""
    found = _checked(ActingErrors(NOISE, diameter=2e-3), sets=20)
    size = _named(found, "diameter")
    # A standard deviation of 20 values has a relative one of 1 / sqrt(40).
    assert np.std(size.errors) == pytest.approx(2e-3, rel=3.0 / np.sqrt(40.0))
    assert found.verdict == size.verdict == "too small"
    # The 95.45 % quantile of 20 normal values has a relative standard deviation of 0.2.
    assert size.needed == pytest.approx(2e-3 / np.sqrt(np.mean(size.u**2)), rel=3.0 * 0.2)
    # The centre of a bore does not depend on the diameter of the sphere.
    assert _named(found, "position").verdict != "too small"


@pytest.mark.long
def test_what_is_stated_truly_is_right() -> None:
    found = _checked(ActingErrors(NOISE, diameter=0.2e-3, form=0.13e-3), sets=20)
    assert found.verdict != "too small"
    assert found.refused == ()
    assert found.sets == 20
    assert {each.errors.shape[0] for each in found.coverages} == {20}


@pytest.mark.slow
def test_twice_the_noise_is_seen_by_the_qualification_itself() -> None:
    """u follows the scatter of the touches: the verdict stays, u of points doubles."""
    usual, noisy = (
        _checked(ActingErrors(size, diameter=0.2e-3), sets=30) for size in (NOISE, 2.0 * NOISE)
    )
    ratio = np.mean(_named(noisy, "points").u) / np.mean(_named(usual, "points").u)
    assert 1.5 < ratio < 2.0  # the diameter's part stays
    assert noisy.verdict != "too small"


@pytest.mark.slow
def test_u_that_is_far_too_large() -> None:
    found = _checked(ActingErrors(NOISE), sets=100, u_diameter=5e-3)
    assert _named(found, "diameter").verdict == "too large"
    assert found.verdict == "too large"


def test_points_have_the_k_of_their_budget() -> None:
    """Nine directions, touched twice. With Welch and Satterthwaite from the repeatability's degrees
    of freedom, and Student's t from scipy, U is k u."""
    made: list[Qualification] = []

    def again(touches: Touches) -> Qualification:
        made.append(qualify(touches, 25.0, tip_diameter=6.0, kind="mean", u_temperature=0.0))
        return made[-1]

    nine = np.repeat(fibonacci_cap(9), 2, axis=0)
    noise = np.random.default_rng(3).normal(0.0, 3e-3, 18)
    touches = Touches(nine * (15.5 - 0.010 + noise[:, None]), nine)
    points = _named(
        check_budget(touches, again(touches), again, ActingErrors(3e-3), sets=3, rng=2), "poi"
    )
    for each, u, expanded in zip(made[1:], points.u, points.expanded, strict=True):
        found = each.pretravel_map
        assert found.repeatability_dof < 10.0
        combined = np.sqrt(np.mean(u**2))
        dof = np.floor(combined**4 * found.repeatability_dof / found.repeatability**4)
        k = t.ppf(0.5 + 0.5 * erf(np.sqrt(2.0)), dof)
        assert k > 2.01
        assert expanded == pytest.approx(k * u, rel=1e-9)


def test_words_and_intervals_agree() -> None:
    """Of 40 values that all lie within U, 91.2 % is the lower end (Wilson 1927): no word against
    95.4 %; of 100 it is 96.3 %."""
    errors, u = np.zeros((100, 1)), np.ones((100, 1))
    few = Coverage("size", errors[:40], u[:40], 2.0 * u[:40])
    many = Coverage("size", errors, u, 2.0 * u)
    assert few.interval[0] == pytest.approx(0.9124, abs=1e-4)
    assert (few.verdict, many.verdict) == ("right", "too large")


@pytest.mark.long
def test_the_same_seed_gives_the_same_sets() -> None:
    first, second = (_checked(ActingErrors(NOISE), sets=3) for _ in range(2))
    for one, other in zip(first.coverages, second.coverages, strict=True):
        np.testing.assert_array_equal(one.errors, other.errors)


def test_values_of_a_set_that_go_together_count_once() -> None:
    """Forty points of a set with one error in common say no more than one."""
    together = np.repeat((np.arange(50) < 5).astype(float)[:, None], 40, axis=1)
    many = Coverage("points", together, np.full((50, 40), 0.25), np.full((50, 40), 0.5))
    one = Coverage("size", together[:, :1], np.full((50, 1), 0.25), np.full((50, 1), 0.5))
    assert many.share == one.share == 0.9
    np.testing.assert_allclose(many.interval, one.interval, atol=1e-3)


@pytest.mark.slow
def test_the_picture_has_the_share_not_the_middle_of_its_interval() -> None:
    """Of 20 bores within U the share is 100 %, at the upper end of its interval."""
    found = _checked(ActingErrors(0.0), sets=20)
    shares = coverage_view(found).charts[0]
    dots = next(mark for mark in shares.marks if isinstance(mark, Dots))
    np.testing.assert_allclose(dots.y, [100.0 * each.share for each in found.coverages])
    assert dots.y.max() == 100.0


def test_what_is_not_simulated_is_refused() -> None:
    with pytest.raises(PretravelError, match="prior is not used by check-budget") as caught:
        CheckBudget(touches=(Path(SPHERE),), diameter=24.9987, prior=Path("old.json"))
    assert caught.value.inputs == ("prior",)
    with pytest.raises(PretravelError, match="unknown size is not used by check-budget"):
        CheckBudget(touches=(Path(SPHERE),), tip_diameter=6.0, unknown_size=True)
    narrow = CheckBudget(touches=(Path(SPHERE),), diameter=24.9987, tip_diameter=6.0, kind="mean",
                         bore=5.0)  # fmt: skip
    with pytest.raises(PretravelError, match="a bore of 5 mm is not wider than the tip of 6 mm"):
        narrow.run()


@pytest.mark.long
def test_the_command(tmp_path: Path) -> None:
    table, page = tmp_path / "budget.csv", tmp_path / "budget.html"
    words = ["check-budget", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "mean"]
    shown = run(*words, "--sets", 20, "-o", table)
    assert "errors within U" in shown
    rows = table.read_text("utf-8").splitlines()
    assert rows[0].startswith("quantity,share_within_u_percent")
    assert len(rows) == 4
    shown = run(*words, "--sets", 20, "--true-u-diameter", 20, "-o", page, code=3)
    assert "U is too small" in shown
    assert page.stat().st_size > 10_000


def test_refused_sets_are_counted() -> None:
    calls = 0

    def sometimes(touches: Touches) -> object:
        nonlocal calls
        calls += 1
        if calls % 2:
            raise PretravelError("too noisy")
        return qualify(touches, 25.0, tip_diameter=6.0, kind="mean")

    touches = Touches(DIRECTIONS * (12.5 + 3.0 - 0.010), DIRECTIONS)
    first = qualify(touches, 25.0, tip_diameter=6.0, kind="mean")
    found = check_budget(touches, first, sometimes, ActingErrors(NOISE), sets=6, rng=1)  # type: ignore[arg-type]
    assert found.sets == 3
    assert found.refused == ("too noisy",) * 3


@pytest.mark.long
def test_several_processes_find_what_one_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each set has random numbers of its own."""
    alone = _checked(ActingErrors(NOISE), sets=6)
    monkeypatch.setattr("pretravel.drawing.tasks.check_budget.budget_check._WORTH_PROCESSES", 0.0)
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    together = _checked(ActingErrors(NOISE), sets=6)
    for one, other in zip(alone.coverages, together.coverages, strict=True):
        np.testing.assert_allclose(one.errors, other.errors, rtol=0.0, atol=1e-12)
