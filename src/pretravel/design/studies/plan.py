"""The designs of a study: which values the factors have in each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.design.studies.definition import LARGEST_PLAN, Level, Study


@dataclass(frozen=True, eq=False)
class Plan:
    """The designs of a study, in an order that the study alone decides.

    >>> from pretravel.design.studies.definition import load_study
    >>> plan = Plan(load_study("preload-and-seats"))
    >>> len(plan), plan.levels(0)
    (35, {'spring.preload_N': 4.0, 'seats.support_angle_deg': 20.0})
    """

    study: Study

    def __post_init__(self) -> None:
        if len(self) > LARGEST_PLAN:
            raise PretravelError(
                f"the plan has {len(self)} designs; at most {LARGEST_PLAN} are possible. Give "
                "fewer values, or use the plan latin-hypercube"
            )

    @cached_property
    def _counts(self) -> list[int]:
        return [len(factor.single_values) for factor in self.study.factors]

    def __len__(self) -> int:
        study = self.study
        if study.plan == "full-factorial":
            return math.prod(self._counts)
        if study.plan == "one-at-a-time":
            return 1 + sum(self._counts)
        if study.plan == "sobol":
            return self.base_samples * (len(study.factors) + 2)
        return study.samples

    @property
    def base_samples(self) -> int:
        """Of a Sobol' plan: the wished number, made a power of two, as the sequence needs it."""
        return int(2 ** math.ceil(math.log2(max(self.study.samples, 2))))

    def levels(self, number: int) -> Mapping[str, Level]:
        """The values of the factors in a design.

        Parameters
        ----------
        number : int
            From 0.

        Returns
        -------
        mapping of key to value
            Of a plan with one factor at a time only this factor; none in the first design.
        """
        factors = self.study.factors
        if self.study.plan == "full-factorial":
            places = np.unravel_index(number, self._counts)
            return {
                factor.key: factor.single_values[int(place)]
                for factor, place in zip(factors, places, strict=True)
            }
        if self.study.plan == "one-at-a-time":
            return self._only_one(number)
        shares = self._shares[self._row(number)]
        return {
            factor.key: factor.at(float(shares[place]))
            for factor, place in zip(factors, self._columns(number), strict=True)
        }

    def _only_one(self, number: int) -> Mapping[str, Level]:
        left = number - 1
        for factor, count in zip(self.study.factors, self._counts, strict=True):
            if 0 <= left < count:
                return {factor.key: factor.single_values[left]}
            left -= count
        return {}

    @cached_property
    def _shares(self) -> FloatArray:
        """Shares of the ranges: of a Sobol' plan the base samples, A next to B.

        Workers get them with the plan, and need not load the statistics of scipy.
        """
        from scipy.stats import qmc

        study, count = self.study, len(self.study.factors)
        if study.plan == "sobol":
            # A and B side by side in one sequence of twice the dimensions: Saltelli 2010.
            sequence = qmc.Sobol(2 * count, scramble=True, rng=study.seed)
            return np.asarray(sequence.random(self.base_samples))
        return np.asarray(qmc.LatinHypercube(count, rng=study.seed).random(study.samples))

    def _row(self, number: int) -> int:
        """The base sample of a design; a Sobol' plan has A, B and one set for each factor."""
        return number % self.base_samples if self.study.plan == "sobol" else number

    def _columns(self, number: int) -> list[int]:
        """The column of each factor: A, B, or A with one factor from B."""
        count = len(self.study.factors)
        columns = list(range(count))
        if self.study.plan != "sobol":
            return columns
        part = number // self.base_samples
        if part == 1:
            return [column + count for column in columns]
        if part >= 2:
            columns[part - 2] += count
        return columns
