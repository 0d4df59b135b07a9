"""Touches made ready for a fit: what is left out, and what the machine adds and is taken off."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.maps.observation import Observation
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.machine_effects import machine_effects, without_machine
from pretravel.qualification.observe import observe
from pretravel.qualification.outliers import Outlier
from pretravel.qualification.own_touches import touch_digests
from pretravel.qualification.qualifying import prepare
from pretravel.touches import Touches
from tests.support.lobed_map import SETUP, UM, N, lobed_touches, moved
from tests.support.made_up_probes import PATTERN, made_up_response, touches_of


def test_a_touch_that_is_left_out_counts_nowhere() -> None:
    """Centre, radius, scatter and digests are those of the others alone; all touches stay beside
    the same centre."""
    given = moved(lobed_touches(), [40], 0.03)
    ready = prepare(given, SETUP)
    others = np.arange(75) != 40
    assert ready.used.tolist() == others.tolist()
    alone = observe(given.take(others), SETUP, np.eye(3))
    assert ready.observation.values == pytest.approx(alone.values, abs=1e-12)
    assert ready.observation.groups.tolist() == alone.groups.tolist()
    assert ready.whole.values[others] == pytest.approx(alone.values, abs=1e-12)
    for one in (ready.observation, ready.whole):
        assert one.center == pytest.approx(alone.center, abs=1e-12)
        assert one.tip_radius == alone.tip_radius
    assert len(ready.whole.values) == 75
    assert ready.whole.values[40] - np.mean(alone.values) < -0.025
    assert ready.observation.repeats == alone.repeats
    assert ready.digests == touch_digests(given.positions[others])
    assert [one.rows for one in ready.outliers] == [(40,)]
    assert ready.outliers[0].left_out
    assert ready.setup is SETUP
    assert ready.touches is given
    assert ready.delay is None


@pytest.mark.parametrize("wrong", [False, True])
def test_without_a_gross_error_or_a_search_all_touches_are_used(wrong: bool) -> None:
    given = moved(lobed_touches(), [40], 0.03) if wrong else lobed_touches()
    ready = prepare(given, replace(SETUP, search_outliers=not wrong))
    assert ready.used.all()
    assert ready.observation is ready.whole
    assert ready.observation.values == pytest.approx(
        observe(given, SETUP, np.eye(3)).values, abs=1e-12
    )
    assert ready.digests == touch_digests(given.positions)
    assert ready.outliers == ()
    assert (ready.detail is None) == wrong


def _many_wrong(clean: int) -> tuple[Touches, Observation]:
    """Four directions nine times, of which the first touch is 8 µm inside and the last three 8 µm
    outside; between them others twice, `clean` touches in all."""
    n = fibonacci_cap(40, 1.5)
    between = np.concatenate([np.arange(4, 26), np.arange(4, 26)])[:clean]
    order = [*[0, 1, 2, 3] * 4, *between, *[0, 1, 2, 3] * 5]
    groups = np.array(order)
    rng = np.random.default_rng(1)
    error = 1e-4 * rng.standard_normal(len(groups))
    error[:4] -= 8.0 * UM
    error[-12:] += 8.0 * UM
    positions = n[groups] * (15.49 + error)[:, None]
    compact = np.unique(groups, return_inverse=True)[1]
    return Touches(positions, n[groups]), Observation(
        positions, compact, np.zeros(3), 12.5, 3.0, ring=False
    )


@pytest.mark.parametrize(("clean", "out"), [(44, 16), (43, 0)])
def test_four_fifths_of_the_touches_remain_or_all(clean: int, out: int) -> None:
    """Errors that no movement explains: inside and outside by turns."""
    given, _ = _many_wrong(clean)
    rows = [*range(4), *range(len(given) - 12, len(given))]
    positions = given.normals * 15.49
    positions += 1e-4 * np.random.default_rng(5).standard_normal((len(given), 1)) * given.normals
    signs = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0] * 2)
    positions[rows] += (9.0 * UM * signs)[:, None] * given.normals[rows]
    found = prepare(replace(given, positions=positions), UPRIGHT)
    assert sorted(row for one in found.outliers for row in one.rows) == rows
    assert (~found.used).sum() == out
    assert [one.left_out for one in found.outliers] == [out > 0] * 16
    assert len(found.observation.values) == len(given) - out


def test_what_became_of_an_outlier_is_said() -> None:
    outlier = Outlier((3,), 0.02, 0.001, "t4 lies off")
    assert outlier.outcome == "Left out: touch there again"
    kept = replace(outlier, left_out=False)
    assert kept.outcome.startswith("Kept, because too many touches look wrong")


def test_touches_are_excluded_by_label_or_line() -> None:
    touches = replace(_touches(), lines=tuple(range(2, 77)))
    assert len(touches.without(["t1", "5"])) == 73
    with pytest.raises(PretravelError, match="no touch with the label or on the line 'x'"):
        touches.without(["x"])


# What the machine adds.


UPRIGHT = QualificationSetup(25.0, tip_diameter=6.0, sphere_form=0.0)
AXIS = (0.48, 0.6, 0.64)
TILTED = replace(UPRIGHT, axis=AXIS)


@pytest.mark.parametrize("setup", [UPRIGHT, TILTED])
def test_a_drift_is_taken_off_all_but_gross_touches(setup: QualificationSetup) -> None:
    """The reference moves by 4 µm in three passes; the touch that is 60 µm off stays where it is,
    and tells nothing of the drift: the estimate is that without it."""
    rng = np.random.default_rng(4)
    tilt = probe_rotation(setup.axis)
    groups = np.concatenate([rng.permutation(25) for _ in range(3)])
    n, time = N[groups], np.linspace(-0.5, 0.5, 75)
    drift = time[:, None] * np.array([0.004, -0.003, 0.002])
    radius = 15.49 + 1e-4 * rng.standard_normal(75)
    radius[30] += 0.06
    given = Touches((n * radius[:, None] + drift) @ tilt.T, n @ tilt.T)
    seen = observe(given, setup, tilt)
    found, effects = without_machine(given, seen, setup, tilt)
    others = np.arange(75) != 30
    alone = machine_effects(seen.take(others), given.positions[others])
    assert effects.drift == pytest.approx(alone.drift, abs=1e-12)
    assert effects.change[others] == pytest.approx(alone.change, abs=1e-12)
    assert np.linalg.norm(effects.drift) == pytest.approx(math.sqrt(29.0) * UM, rel=0.05)
    assert effects.change[30] == 0.0
    assert found.positions[30].tolist() == given.positions[30].tolist()
    along = np.sum((found.positions @ tilt) * n, axis=1)[others]
    mean = np.bincount(groups[others], along) / np.bincount(groups[others])
    left = along - mean[groups[others]]
    assert np.sqrt(np.sum(left**2) / 49.0) == pytest.approx(1e-4, rel=0.3)
    assert found.normals == pytest.approx(given.normals, abs=1e-15)


def test_beyond_a_fifth_wrong_touches_are_no_errors_but_another_state() -> None:
    """16 of 80 are left out; 16 of 79 are more than a fifth: all are used, as without a search."""
    given, seen = _many_wrong(44)
    same, effects = without_machine(given, seen, UPRIGHT, np.eye(3))
    assert same is given
    assert np.all(effects.change == 0.0)
    assert not effects.warnings
    given, seen = _many_wrong(43)
    changed, effects = without_machine(given, seen, UPRIGHT, np.eye(3))
    every = machine_effects(seen, given.positions)
    assert "from touch 68 of 79 on, the pretravel of all directions differs" in every.warnings[0]
    assert effects.warnings == every.warnings
    assert effects.change == pytest.approx(every.change, abs=1e-12)
    off = seen.directions * every.change[:, None]
    assert changed.positions == pytest.approx(given.positions + off, abs=1e-12)
    silent = replace(UPRIGHT, search_outliers=False)
    given, seen = _many_wrong(44)
    effects = without_machine(given, seen, silent, np.eye(3))[1]
    assert effects.warnings == machine_effects(seen, given.positions).warnings
    assert effects.change == pytest.approx(machine_effects(seen, given.positions).change)


def test_the_step_is_that_of_the_latched_positions() -> None:
    """They come in steps of 1 µm; taken to rest by a travel that is not a multiple, they do not."""
    rng = np.random.default_rng(2)
    n = np.repeat(N, 3, axis=0)
    latched = np.round(n * (15.49 + 2e-4 * rng.standard_normal(75))[:, None], 3)
    resting = Touches(latched + n * (0.7071 + 1e-5 * np.arange(75))[:, None] * UM, n)
    seen = observe(resting, UPRIGHT, np.eye(3))
    with_step = without_machine(resting, seen, UPRIGHT, np.eye(3), latched=latched)[1]
    assert with_step.step == pytest.approx(1e-3)
    assert without_machine(resting, seen, UPRIGHT, np.eye(3))[1].step == 0.0


def _touches(seed: int = 4, noise: float = 0.3e-3) -> Touches:
    rng = np.random.default_rng(seed)
    found = touches_of(made_up_response(rng, 0.3), PATTERN, rng, noise)
    return replace(found, labels=tuple(f"t{row}" for row in range(1, len(found) + 1)))


@pytest.mark.parametrize("seed", range(5))
def test_a_quantised_latch_has_no_outliers(seed: int) -> None:
    """Steps of 1 um, noise 0.1 um: repeats fall on the same step or on the next."""
    touches = _touches(seed, 0.1e-3)
    ready = prepare(replace(touches, positions=np.round(touches.positions, 3)), SETUP)
    assert ready.outliers == ()
    assert ready.effects.step == pytest.approx(1e-3)
    assert ready.used.all()


def test_hysteresis_is_in_the_scatter() -> None:
    """The rest position keeps 2 um of the push before; along the approach it moves the latch."""
    touches = _touches()
    before = np.vstack([np.zeros(3), touches.normals[:-1]])
    memory = 2e-3 * np.sum(before * touches.normals, axis=1)
    positions = touches.positions - memory[:, None] * touches.normals
    ready = prepare(replace(touches, positions=positions), SETUP)
    # Repeats in a row separate the lateral memory from the axial one badly; their sum they show.
    left = memory - ready.effects.change
    groups = ready.whole.groups
    within = [np.ptp(left[groups == group]) for group in np.unique(groups)]
    assert np.mean(within) < 0.6 * np.mean([np.ptp(memory[groups == g]) for g in np.unique(groups)])
    assert ready.effects.fixed_scatter > 0.3e-3
    assert any("hysteresis" in warning for warning in ready.warnings)
