"""Gross errors and the machine's part of touches, with the default command's kind of map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.outliers import Outlier
from pretravel.qualification.qualify import prepare, qualify
from pretravel.touches import Touches, without
from tests.support.made_up_probes import PATTERN, made_up_response, touches_of

SETUP = QualificationSetup(25.0, tip_diameter=6.0)


def _touches(seed: int = 4, noise: float = 0.3e-3) -> Touches:
    rng = np.random.default_rng(seed)
    found = touches_of(made_up_response(rng, 0.3), PATTERN, rng, noise)
    return replace(found, labels=tuple(f"t{row}" for row in range(1, len(found) + 1)))


def _moved(touches: Touches, row: int, off: float) -> Touches:
    positions = touches.positions.copy()
    positions[row] += off * touches.normals[row]
    return replace(touches, positions=positions)


def test_one_bad_touch_does_not_change_the_default_map() -> None:
    """35 um off: the map is that without it, to 0.05 um, and the touch is named."""
    touches = _touches()
    bad = qualify(_moved(touches, 40, 0.035), 25.0, tip_diameter=6.0)
    assert [outlier.rows for outlier in bad.outliers] == [(40,)]
    assert "t41" in bad.outliers[0].message
    assert "+35" in bad.outliers[0].message or "-35" in bad.outliers[0].message
    alone = qualify(without(touches, ["t41"]), 25.0, tip_diameter=6.0)
    assert bad.pretravel_map.kind == alone.pretravel_map.kind
    apart = bad.pretravel_map.pretravel(PATTERN) - alone.pretravel_map.pretravel(PATTERN)
    assert np.abs(apart).max() < 0.05e-3
    assert bad.effect_of_outliers > 0.5e-3


def test_a_false_trip_is_refused_with_its_label() -> None:
    with pytest.raises(
        PretravelError, match=r"t13\).* (0.9|1.0)\d mm outside the sphere of the others"
    ):
        prepare(_moved(_touches(), 12, 1.0), SETUP)


@pytest.mark.parametrize("seed", range(5))
def test_a_quantised_latch_has_no_outliers(seed: int) -> None:
    """Steps of 1 um, noise 0.1 um: repeats fall on the same step or on the next."""
    touches = _touches(seed, 0.1e-3)
    ready = prepare(replace(touches, positions=np.round(touches.positions, 3)), SETUP)
    assert ready.outliers == ()
    assert ready.effects.step == pytest.approx(1e-3)
    assert ready.used.all()


def test_a_drift_is_subtracted() -> None:
    """2 um along x during three passes; its estimate scatters by 0.2 um an axis."""
    order = np.argsort(np.tile(np.arange(3), 25), kind="stable")
    touches = _touches().take(order)
    steps = np.linspace(-0.5, 0.5, len(touches))[:, None] * np.array([2e-3, 0.0, 0.0])
    ready = prepare(replace(touches, positions=touches.positions + steps), SETUP)
    assert np.allclose(ready.effects.drift, [2e-3, 0.0, 0.0], atol=0.8e-3)
    assert any("drifted" in warning for warning in ready.warnings)
    quiet = prepare(touches, SETUP)
    assert np.all(quiet.effects.drift == 0.0)


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


def test_touches_are_excluded_by_label_or_line() -> None:
    touches = replace(_touches(), lines=tuple(range(2, 77)))
    assert len(without(touches, ["t1", "5"])) == 73
    with pytest.raises(PretravelError, match="no touch with the label or on the line 'x'"):
        without(touches, ["x"])


def test_what_the_machine_adds_is_taken_off_the_touches() -> None:
    """The reference moves by 5 µm in three passes; what is left is the noise of 0.1 µm. Of 50
    degrees of freedom a standard deviation has 10 %; three of these."""
    rng = np.random.default_rng(4)
    groups = np.concatenate([rng.permutation(25) for _ in range(3)])
    n, time = sphere_pattern_25()[groups], np.linspace(0.0, 1.0, 75)
    radius = 15.49 + 1e-4 * rng.standard_normal(75)
    moved = time[:, None] * np.array([0.004, -0.003, 0.0])
    ready = prepare(Touches(n * radius[:, None] + moved, n), SETUP)
    along = np.sum(ready.touches.positions * n, axis=1)
    mean = np.bincount(groups, along) / 3.0
    assert np.sqrt(np.sum((along - mean[groups]) ** 2) / 50.0) == pytest.approx(1e-4, rel=0.3)


@pytest.mark.parametrize(("size", "many"), [(0.02, False), (0.04, True)])
def test_more_wrong_touches_than_a_fifth_are_kept_and_said_to_be(size: float, many: bool) -> None:
    """Repeats of every fourth direction scatter by 20 or 40 um: another surface, not dirt."""
    touches = _touches()
    positions = touches.positions.copy()
    groups = np.unique(touches.normals.round(6), axis=0, return_inverse=True)[1].ravel()
    rng = np.random.default_rng(2)
    for row in np.flatnonzero(groups % 4 == 0):
        positions[row] += size * rng.standard_normal() * touches.normals[row]
    found = prepare(replace(touches, positions=positions), SETUP)
    share = sum(len(outlier.rows) for outlier in found.outliers) / len(touches)
    assert (share > 0.2) == many
    assert share > 0.1
    assert found.used.mean() == pytest.approx(1.0 if many else 1.0 - share)
    assert all(outlier.left_out != many for outlier in found.outliers)


def test_what_became_of_an_outlier_is_said() -> None:
    outlier = Outlier((3,), 0.02, 0.001, "t4 lies off")
    assert outlier.outcome == "Left out: touch there again"
    kept = replace(outlier, left_out=False)
    assert kept.outcome.startswith("Kept, because too many touches look wrong")
