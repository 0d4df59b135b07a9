"""The results of a study: the factors and the numbers of all designs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray
from pretravel.design.studies.definition import Factor, Level, Study
from pretravel.design.studies.outputs import Outcome, OutputMeaning, output_names
from pretravel.design.studies.plan import Plan


@dataclass(frozen=True, eq=False)
class StudyResults:
    """What a study found.

    Attributes
    ----------
    name, probe, plan : str
    base_samples : int
        Of a Sobol' plan; else 0.
    factors : mapping of str to (n,) array
        The value of each factor in each design: numbers in the unit of the key, or texts.
    numbers : mapping of str to (n,) float
        The outputs; not a number where the design failed.
    meanings : mapping of str to OutputMeaning
        Unit and text of each output.
    reasons : n str
        Why a design failed; empty: it did not.
    """

    name: str
    probe: str
    plan: str
    base_samples: int
    factors: Mapping[str, npt.NDArray[Any]]
    numbers: Mapping[str, FloatArray]
    meanings: Mapping[str, OutputMeaning]
    reasons: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.reasons)

    @property
    def succeeded(self) -> npt.NDArray[np.bool_]:
        """Which designs did not fail, (n,)."""
        return np.array([not reason for reason in self.reasons], dtype=np.bool_)


def collected(study: Study, plan: Plan, outcomes: Iterable[tuple[int, Outcome]]) -> StudyResults:
    """The numbers of all designs, from their outcomes.

    Parameters
    ----------
    study : Study
    plan : Plan
    outcomes : iterable of number and Outcome
        By number, all of them.
    """
    meanings = output_names(study)
    numbers = {name: np.full(len(plan), np.nan) for name in meanings}
    reasons = [""] * len(plan)
    for number, outcome in outcomes:
        reasons[number] = outcome.reason
        for name, value in outcome.numbers.items():
            numbers[name][number] = value
    return StudyResults(
        name=study.name,
        probe=study.probe,
        plan=study.plan,
        base_samples=plan.base_samples if study.plan == "sobol" else 0,
        factors=_factor_values(study, plan),
        numbers=numbers,
        meanings=meanings,
        reasons=tuple(reasons),
    )


def _factor_values(study: Study, plan: Plan) -> dict[str, npt.NDArray[Any]]:
    base = {factor.key: _base_value(study, factor) for factor in study.factors}
    columns: dict[str, list[Level]] = {key: [] for key in base}
    for number in range(len(plan)):
        levels = plan.levels(number)
        for key, column in columns.items():
            column.append(levels.get(key, base[key]))
    kinds = {factor.key: object if factor.is_text else np.float64 for factor in study.factors}
    return {key: np.array(column, dtype=kinds[key]) for key, column in columns.items()}


def _base_value(study: Study, factor: Factor) -> Level:
    """The value of the description; a key that it does not state has none."""
    inside: Any = study.tables({})
    missing: Level = "" if factor.is_text else float("nan")
    for step in factor.key.split("."):
        try:
            inside = inside[int(step) - 1 if isinstance(inside, list) else step]
        except (KeyError, IndexError, TypeError, ValueError):
            return missing
    return inside if isinstance(inside, str | int | float) else missing
