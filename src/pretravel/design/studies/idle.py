"""Factors that change nothing: their values would be reported as if they decided something."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.design.studies.definition import Factor, Level, Study

_Places = Mapping[str, Level]
_TRIED = (0.0, 0.37, 1.0)
"""Shares of a range. No two are as far from its middle, where a law can be symmetric."""
_ELSEWHERE = (0.0, 0.5, 1.0)
"""Shares at which the other factors are while one is tried."""
_OF_BODY = ("geometry", "hub", "materials", "seats", "stylus", "tripod")
"""Tables that finite elements use, and other models in part."""


def refuse_idle(study: Study, numbers: Callable[[Study, _Places], FloatArray], what: str) -> None:
    """Refuse a factor that changes none of the numbers, wherever the other factors are.

    Parameters
    ----------
    study : Study
    numbers : callable
        What is computed of a design; raises where it cannot be.
    what : str
        The numbers, in words.

    Raises
    ------
    PretravelError
        A factor whose values all give the same, to the last digit.

    Notes
    -----
    A body of finite elements takes seconds: with them, only keys that are not of the body are
    tried, by the model analytic; stresses are not computed for this.
    """
    elements = "fem" in (study.prediction.get("model"), *_models(study))
    if elements and "stress" in study.outputs:
        return
    if elements:
        study = replace(
            study,
            factors=tuple(each for each in study.factors if each.key != "prediction.model"),
            prediction={**study.prediction, "model": "analytic"},
        )
    for factor in study.factors:
        of_body = elements and factor.key.partition(".")[0] in _OF_BODY
        if of_body or len(factor.single_values) == 1:
            continue
        if all(_same(study, factor, others, numbers) for others in _others(study, factor)):
            raise PretravelError(
                f"{factor.key} changes nothing: {what} the same at all its values. "
                "Leave it out, or choose a model or quantities that depend on it"
            )


def _models(study: Study) -> tuple[Level, ...]:
    return next((f.single_values for f in study.factors if f.key == "prediction.model"), ())


def _others(study: Study, factor: Factor) -> Iterator[_Places]:
    """Places of the other factors."""
    others = [each for each in study.factors if each.key != factor.key]
    if study.plan == "one-at-a-time" or not others:
        yield {}
        return
    for share in _ELSEWHERE:
        yield {each.key: each.at(share) for each in others}


def _same(
    study: Study,
    factor: Factor,
    others: _Places,
    numbers: Callable[[Study, _Places], FloatArray],
) -> bool:
    """Whether values of a factor give the same; no, where a design cannot be computed."""
    found: set[bytes] = set()
    for share in _TRIED:
        try:
            found.add(numbers(study, {**others, factor.key: factor.at(share)}).tobytes())
        except (PretravelError, ArithmeticError, np.linalg.LinAlgError):
            return False  # the report states the reason
        if len(found) > 1:
            return False
    return True
