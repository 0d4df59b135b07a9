"""Decisions about tolerances: the limits of the rule, and its promise, by simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.drawing.features.conformity import (
    ConformityVerdict,
    form_conformity,
    position_conformity,
    size_conformity,
)
from pretravel.drawing.features.feature_form import FormResult
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.drawing.tasks.measure.tables_of_features import conformity_table
from tests.support.feature_points import OWN, around, feature_points

CONFORMS, FAILS, UNDECIDED = ConformityVerdict


class TestSize:
    # 1.6449 u at 95 %, the quantile of the normal distribution (JCGM 106, table 1).
    @pytest.mark.parametrize(
        ("value", "verdict"),
        [
            (20.0016, UNDECIDED),
            (20.0017, CONFORMS),
            (20.0193, CONFORMS),
            (20.0194, UNDECIDED),
            (20.0226, UNDECIDED),
            (20.0227, FAILS),
            (19.9983, FAILS),
        ],
    )
    def test_guard_band_at_both_limits(self, value: float, verdict: ConformityVerdict) -> None:
        found = size_conformity("diameter", value, 0.001, (20.0, 20.021), 0.95)
        assert found.verdict is verdict
        assert found.guard_band == pytest.approx(1.6449e-3, rel=1e-4)
        assert found.rejection_band == pytest.approx(1.6449e-3, rel=1e-4)

    def test_one_limit(self) -> None:
        found = size_conformity("diameter", 5.0, 0.001, (-math.inf, 5.002), 0.95)
        assert found.verdict is CONFORMS
        assert found.probability == pytest.approx(0.97725, abs=1e-5)  # Φ(2)

    def test_few_degrees_of_freedom(self) -> None:
        """Student's t with 2: P(T < t) = 1/2 + t / (2 √(2 + t²)); its 95 % lie at 2.920."""
        found = size_conformity("diameter", 5.0, 0.001, (-math.inf, 5.002), 0.95, dof=2.0)
        assert found.probability == pytest.approx(0.5 + 1.0 / math.sqrt(6.0), abs=1e-9)
        assert found.guard_band == pytest.approx(2.920e-3, rel=1e-4)
        assert found.coverage == pytest.approx(2.920, rel=1e-4)

    def test_a_tolerance_that_is_too_narrow(self) -> None:
        """±1.9 u has at most 94.3 %: in its middle conformity cannot be proven."""
        found = size_conformity("diameter", 0.0, 0.001, (-0.0019, 0.0019), 0.95)
        assert math.isnan(found.guard_band)
        assert found.verdict is UNDECIDED

    @pytest.mark.parametrize(("value", "verdict"), [(0.0, UNDECIDED), (0.4, FAILS)])
    def test_a_value_inside_a_far_too_narrow_tolerance_does_not_fail(
        self, value: float, verdict: ConformityVerdict
    ) -> None:
        """±0.05 u has 4 % in its middle, which says nothing of the value; 1.645 u outside does."""
        found = size_conformity("diameter", value, 0.2, (-0.01, 0.01), 0.95)
        assert found.probability < 0.05
        assert found.verdict is verdict

    def test_without_uncertainty_nothing_is_decided(self) -> None:
        assert size_conformity("d", 1.0, 0.0, (0.9, 1.1), 0.95).verdict is UNDECIDED

    def test_empty_tolerance(self) -> None:
        with pytest.raises(PretravelError, match="is empty"):
            size_conformity("d", 1.0, 0.1, (1.1, 0.9), 0.95)


class TestPosition:
    def test_on_the_nominal_position(self) -> None:
        """P(|e| <= t/2) of two equal normal errors is 1 - exp(-t²/8u²) (Rayleigh)."""
        found = position_conformity(np.zeros(2), 1e-6 * np.eye(2), 0.004, 0.95)
        assert found.probability == pytest.approx(1.0 - math.exp(-2.0), abs=0.004)  # 40,000 trials
        assert found.verdict is UNDECIDED
        assert math.isnan(found.guard_band)

    def test_few_degrees_of_freedom(self) -> None:
        """Two errors with one scale: P(|e| <= R) is 1 - (1 + R²/ν u²)^(-ν/2), ν = 2, R = 2 u."""
        found = position_conformity(np.zeros(2), 1e-6 * np.eye(2), 0.004, 0.95, dof=2.0)
        assert found.probability == pytest.approx(1.0 - 1.0 / 3.0, abs=0.007)  # 40,000 trials

    def test_far_from_it_the_band_is_that_of_one_limit(self) -> None:
        found = position_conformity(np.array([0.03, 0.04]), 1e-6 * np.eye(2), 0.2, 0.95)
        assert found.value == pytest.approx(0.1)
        assert found.u == pytest.approx(0.002)
        # The error across the distance adds u²/t = 10 nm; trials scatter by 1 %.
        assert found.guard_band == pytest.approx(2.0 * 1.6449e-3, rel=0.02)
        assert found.rejection_band == pytest.approx(2.0 * 1.6449e-3, rel=0.02)

    def test_the_bands_near_zero_are_those_at_the_limit(self) -> None:
        """What errors add to a small value changes the value, not where a limit is proven."""
        near = position_conformity(np.array([0.0006, 0.0008]), 1e-6 * np.eye(2), 0.2, 0.95)
        found = near.with_value(0.0011, 0.0015)
        assert found.guard_band == pytest.approx(2.0 * 1.6449e-3, rel=0.02)
        assert found.rejection_band == pytest.approx(2.0 * 1.6449e-3, rel=0.02)

    def test_a_zone_that_is_narrow_against_u_proves_nothing(self) -> None:
        """P of the zone is 0.1 %, on its centre too; the value is inside, so it has not failed."""
        found = position_conformity(np.zeros(2), 1e-6 * np.eye(2), 1e-4, 0.95)
        assert found.probability < 0.05
        assert found.verdict is UNDECIDED

    def test_an_error_across_the_distance_does_not_hide_that_a_place_is_outside(self) -> None:
        """20 u beyond the zone along x; along y, u is 100 times larger."""
        found = position_conformity(np.array([0.03, 0.0]), np.diag([1e-6, 1e-2]), 0.02, 0.95)
        assert found.u == pytest.approx(0.002)
        assert found.verdict is FAILS


class TestTableOfDecisions:
    def test_a_corrected_value_is_explained_where_there_is_one(self) -> None:
        position = position_conformity(np.array([0.001, 0.0]), 1e-6 * np.eye(2), 0.05, 0.95)
        size = size_conformity("diameter", 20.01, 0.001, (20.0, 20.021), 0.95)
        told = "the decision uses the uncorrected one"
        for decided, explained in (
            (position.with_value(0.0005, 0.002), True),
            (position.with_value(position.value, 0.002), False),
            (size, False),
        ):
            assert decided.corrected == explained
            table = conformity_table([("bore1", 0.001, size), ("bore1", 0.001, decided)])
            assert (told in table.explanation) == explained

    def test_the_rule_is_in_the_words_of_the_verdicts(self) -> None:
        size = size_conformity("diameter", 20.01, 0.001, (20.0, 20.021), 0.95)
        known, unknown = ("bore1", 0.001, size), ("bore2", 0.0, size)
        for decided, words in (
            ([known], "guard band: 'conforms'. Outside"),
            ([unknown], "guard band: 'within the tolerance'. Outside"),
            ([known, unknown], "guard band: 'conforms' or 'within the tolerance'. Outside"),
        ):
            explanation = conformity_table(decided).explanation
            assert words in explanation
            assert "Otherwise: 'cannot be decided'." in explanation
            assert "Value 0" not in explanation

    def test_a_value_of_zero_is_explained(self) -> None:
        """All of the form may be noise: the other table has a bound alone."""
        form = FormResult(0.0006, 0.0, np.linspace(0.0, 0.0012, 201), 0.0009, 0.0015)
        found = form_conformity("roundness", form, 0.005, 0.95)
        assert "Value 0: the errors" in conformity_table([("bore1", 0.001, found)]).explanation


class TestPromise:
    """A part at the limit is accepted, or rejected, in at most 5 of 100 measurements."""

    @pytest.mark.long
    @pytest.mark.parametrize("sets", [60, pytest.param(200, marks=pytest.mark.slow)])
    def test_form(self, sets: int) -> None:
        """Lobes whose range is the tolerance, and smaller and larger ones: false decisions."""
        outward, _ = around(16)
        rng = np.random.default_rng(9)
        wave = np.cos(4.0 * np.arange(16) * 2.0 * np.pi / 16)  # range 2, no size and no shift
        wrong = 0
        for _ in range(sets):
            radius = 10.0 + 1e-3 * wave + OWN * rng.normal(size=16)
            points = feature_points(radius[:, None] * outward, -outward)
            form = measure_feature(points, "bore").form
            below = form_conformity("roundness", form, 1.999e-3, 0.95)
            above = form_conformity("roundness", form, 2.001e-3, 0.95)
            wrong += below.verdict is CONFORMS
            wrong += above.verdict is FAILS
        # 5 % of the sets for each, and three standard deviations more.
        assert wrong <= 0.1 * sets + 3.0 * np.sqrt(0.1 * sets)

    def test_a_range_of_noise_is_not_rejected(self) -> None:
        """A perfect bore with a tolerance of half the noise's range."""
        outward, _ = around(16)
        rng = np.random.default_rng(10)
        rejected = 0
        for _ in range(40):
            moved = (10.0 + OWN * rng.normal(size=16))[:, None] * outward
            form = measure_feature(feature_points(moved, -outward), "bore").form
            found = form_conformity("roundness", form, 0.5 * form.noise, 0.95)
            rejected += found.verdict is FAILS
        assert rejected == 0
