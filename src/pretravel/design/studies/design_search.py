"""The search for the design that fits a specification best.

scipy's differential evolution finds the region of the best design, whatever kinks the trigger event
makes, and COBYQA its exact place.
"""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, differential_evolution, minimize

from pretravel.base import FloatArray, PretravelError
from pretravel.design.studies.conditions import case_of
from pretravel.design.studies.definition import Level
from pretravel.design.studies.extremes import extremes_between
from pretravel.design.studies.idle import refuse_idle
from pretravel.design.studies.outputs import computed
from pretravel.design.studies.wish import Wish
from pretravel.prediction import Probe

log = logging.getLogger(__name__)

_POPULATION, _GENERATIONS = 12, 60
"""Designs for each free quantity in a generation; generations at most."""
_TOLERANCE = 1e-3
"""Spread of a generation, relative, at which the region is found."""
_SLACK = 1e-6
"""Of a limit, relative: rounding of the search."""
_IMPOSSIBLE = 1e6
"""Goal of a design that cannot be: worse than any."""
_FAR = 1.0
"""Largest violation of a limit that the search sees, relative to the limit."""
_ATTEMPTS = 6
"""To keep the limits between the directions of the grid, too."""
_MARGIN = 1e-3
"""Of what a limit is narrowed by, for each attempt: the difference changes with the design."""
_FRONT = 7
"""Designs between the two ends of a front."""


@dataclass(frozen=True, eq=False)
class TriedDesign:
    """A design with its quantities.

    Attributes
    ----------
    levels : mapping of key to value
        Of the free quantities.
    probe : Probe
    quantities : mapping of str to float
        In the units of `pretravel.design.studies.wish.known_quantities`.
    """

    levels: Mapping[str, Level]
    probe: Probe
    quantities: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class FoundDesign:
    """The best design, and the one from which the search started.

    Attributes
    ----------
    wish : Wish
    best, start : TriedDesign
        `start` is the described probe.
    front : tuple of TriedDesign
        With a second goal: no other design found is better in both. By the first goal.
    tried : int
        Designs that were computed.
    """

    wish: Wish
    best: TriedDesign
    start: TriedDesign
    front: tuple[TriedDesign, ...]
    tried: int


def tried_design(wish: Wish, levels: Mapping[str, Level]) -> TriedDesign:
    """Compute the quantities of a design.

    Raises
    ------
    PretravelError
        A design that cannot be, or that never triggers in one of the directions.

    >>> from pretravel.design.studies.wish import load_wish
    >>> tried_design(load_wish("stylus-50mm"), {}).quantities["lever"]
    64.4
    """
    case = case_of(wish.study, levels)
    return TriedDesign(
        levels,
        case.probe,
        {**computed(wish.study, case).numbers, **_of_geometry(case.probe, wish.overtravel)},
    )


def _in_all_directions(wish: Wish, design: TriedDesign) -> TriedDesign:
    """The design with its least and greatest values also between the directions of the grid."""
    study = wish.study
    between = extremes_between(study.directions, case_of(study, design.levels), study.outputs)
    return replace(design, quantities={**design.quantities, **between})


def _of_geometry(probe: Probe, overtravel: float) -> dict[str, float]:
    """Lengths of the description. [mm]

    A tripod that tilts about two of its rods' ends lifts the third by the tilt times the height of
    the triangle, 1.5 radii; the tip moves by the tilt times the lever.
    """
    lengths = {"lever": probe.lever, "stylus_length": probe.stylus_length}
    if not overtravel:  # not stated: the lift is not known
        return lengths
    return {
        **lengths,
        "rod_lift": 1.5 * probe.tripod.radius * overtravel / probe.lever,
    }


def find_design(wish: Wish) -> FoundDesign:
    """Search the design that fits a specification best.

    Raises
    ------
    PretravelError
        No design was found that keeps the limits.
    """
    names = _named(wish)
    refuse_idle(
        wish.study,
        lambda study, levels: np.array(
            [tried_design(replace(wish, study=study), levels).quantities[name] for name in names]
        ),
        f"{', '.join(names)} {'is' if len(names) == 1 else 'are'}",
    )
    search = _Search(wish)
    best = search.best({})
    front: tuple[TriedDesign, ...] = ()
    if wish.second:
        front = _front(search, best)
    return FoundDesign(
        wish, best, _in_all_directions(wish, tried_design(wish, {})), front, len(search.known)
    )


def _named(wish: Wish) -> list[str]:
    """The quantities that decide the search."""
    names = [wish.goal, wish.second, *(limit.of for limit in wish.limits)]
    return list(dict.fromkeys(name for name in names if name))


class _Search:
    """Computes designs once, and searches the best of them.

    A point has one number for each free quantity: its share of the range, or the index of a text.
    """

    def __init__(self, wish: Wish) -> None:
        self.wish = wish
        self.known: dict[tuple[float, ...], TriedDesign | None] = {}
        self.reasons: Counter[str] = Counter()

    def levels(self, point: FloatArray) -> dict[str, Level]:
        factors = self.wish.study.factors
        return {
            factor.key: factor.at(
                (float(x) + 0.5) / len(factor.values) if factor.values is not None else float(x)
            )
            for factor, x in zip(factors, point, strict=True)
        }

    def design(self, point: FloatArray) -> TriedDesign | None:
        """The design at a point; None where none can be."""
        key = tuple(np.round(point, 12).tolist())
        if key not in self.known:
            try:
                found = tried_design(self.wish, self.levels(np.asarray(key)))
                self.known[key] = found if self._is_known(found) else None
            except (PretravelError, ArithmeticError) as error:
                self.reasons[str(error) or type(error).__name__] += 1
                self.known[key] = None
        return self.known[key]

    def _is_known(self, found: TriedDesign) -> bool:
        """Whether the quantities that decide have values: a material without hardness has none."""
        unknown = [n for n in _named(self.wish) if not math.isfinite(found.quantities[n])]
        self.reasons.update(f"{name} is not known" for name in unknown)
        return not unknown

    def value(self, point: FloatArray, name: str, sign: float) -> float:
        """A quantity to make small; far too large where no design can be."""
        found = self.design(point)
        return _IMPOSSIBLE if found is None else sign * found.quantities[name]

    def violations(
        self, found: TriedDesign | None, limits: Mapping[str, tuple[float, float]]
    ) -> FloatArray:
        """By how much a design breaks each limit, relative to it; 0 or less: it holds."""
        broken = []
        for name, ends in limits.items():
            for end, side in zip(ends, (1.0, -1.0), strict=True):
                if math.isfinite(end):
                    size = abs(end) or 1.0
                    value = math.inf if found is None else side * (end - found.quantities[name])
                    broken.append(min(value / size, _FAR))
        return np.array(broken)

    def best(self, more: Mapping[str, tuple[float, float]], goal: str = "") -> TriedDesign:
        """The design with the least goal that keeps the limits and some more."""
        limits = {limit.of: (limit.at_least, limit.at_most) for limit in self.wish.limits}
        for name, (low, high) in more.items():
            before = limits.get(name, (-math.inf, math.inf))
            limits[name] = (max(low, before[0]), min(high, before[1]))
        name, sign = (goal, 1.0) if goal else (self.wish.goal, self.wish.sign)

        def value(point: FloatArray) -> float:
            return self.value(point, name, sign)

        # Between the directions of the grid a design can break a limit that it keeps on it. The
        # limit on the grid is then narrowed by the difference, and the place found again.
        narrowed = dict(limits)

        def violations(point: FloatArray) -> FloatArray:
            return self.violations(self.design(point), narrowed)

        point = self._region(value, violations, len(limits))
        for attempt in range(1, _ATTEMPTS + 1):
            point = self._polished(point, value, violations, len(limits))
            found = self.design(point)
            if found is None or (limits and violations(point).max() > _SLACK):
                break
            everywhere = _in_all_directions(self.wish, found)
            if not limits or self.violations(everywhere, limits).max() <= _SLACK:
                return everywhere
            narrowed = _narrowed(limits, found, everywhere, 1.0 + _MARGIN * attempt)
        if not any(self.known.values()):
            reason, _ = self.reasons.most_common(1)[0]
            raise PretravelError(f"no design within the ranges can be computed: {reason}")
        raise PretravelError(
            "no design within the ranges keeps the limits in all directions: "
            + ", ".join(_limit_text(name, ends) for name, ends in limits.items())
            + ". Widen a range or a limit"
        )

    def _bounds(self) -> tuple[Bounds, list[bool]]:
        factors = self.wish.study.factors
        counts = [None if f.values is None else len(f.values) for f in factors]
        high = [1.0 if count is None else count - 1.0 for count in counts]
        return Bounds(np.zeros(len(factors)), np.array(high)), [c is not None for c in counts]

    def _region(
        self, value: Callable[[FloatArray], float], violations: Callable[[FloatArray], FloatArray],
        limits: int,
    ) -> FloatArray:  # fmt: skip
        bounds, whole = self._bounds()
        constraint = NonlinearConstraint(violations, -np.inf, 0.0)

        def tell(intermediate_result: object) -> None:
            del intermediate_result
            log.info("%d designs tried", len(self.known))

        found = differential_evolution(
            value, bounds, integrality=whole, constraints=constraint if limits else (),
            popsize=_POPULATION, maxiter=_GENERATIONS, tol=_TOLERANCE, init="sobol",
            polish=False, rng=self.wish.seed, callback=tell,
        )  # fmt: skip
        return np.asarray(found.x)

    def _polished(
        self, region: FloatArray, value: Callable[[FloatArray], float],
        violations: Callable[[FloatArray], FloatArray], limits: int,
    ) -> FloatArray:  # fmt: skip
        """The exact place in a region; texts stay."""
        bounds, whole = self._bounds()
        free = ~np.array(whole)
        if not free.any():
            return region

        def full(part: FloatArray) -> FloatArray:
            point = region.copy()
            point[free] = np.clip(part, bounds.lb[free], bounds.ub[free])
            return point

        size = abs(value(region)) or 1.0
        found = minimize(  # type: ignore[call-overload]  # scipy's stubs: constraints of COBYQA
            lambda part: value(full(part)) / size, region[free], method="COBYQA",
            bounds=Bounds(bounds.lb[free], bounds.ub[free]),
            constraints=(
                NonlinearConstraint(lambda part: violations(full(part)), -np.inf, 0.0)
                if limits else ()
            ),
            options={"initial_tr_radius": 0.05, "final_tr_radius": 1e-6, "maxfev": 400},
        )  # fmt: skip
        point = full(np.asarray(found.x))
        held, held_before = (
            not limits or violations(place).max() <= _SLACK for place in (point, region)
        )
        return point if held and (not held_before or value(point) <= value(region)) else region


def _narrowed(
    limits: Mapping[str, tuple[float, float]],
    on_grid: TriedDesign,
    everywhere: TriedDesign,
    share: float,
) -> dict[str, tuple[float, float]]:
    """Limits on the grid that keep the limits between its directions, near a design."""
    found = {}
    for name, (low, high) in limits.items():
        beyond = share * (everywhere.quantities[name] - on_grid.quantities[name])
        found[name] = (low - min(beyond, 0.0), high - max(beyond, 0.0))
    return found


def _limit_text(name: str, ends: tuple[float, float]) -> str:
    low, high = ends
    if math.isinf(high):
        return f"{name} at least {low:g}"
    return f"{name} at most {high:g}" if math.isinf(low) else f"{name} {low:g} to {high:g}"


def _front(search: _Search, best: TriedDesign) -> tuple[TriedDesign, ...]:
    """Best designs between the least of the first goal and the least of the second."""
    wish = search.wish
    other = search.best({}, goal=wish.second)
    ends = best.quantities[wish.second], other.quantities[wish.second]
    found = [best, other]
    for step in range(1, _FRONT + 1):
        most = ends[0] + (ends[1] - ends[0]) * step / (_FRONT + 1)
        found.append(search.best({wish.second: (-math.inf, most)}))
    return _undominated(found, wish)


def _undominated(designs: list[TriedDesign], wish: Wish) -> tuple[TriedDesign, ...]:
    def goals(design: TriedDesign) -> tuple[float, float]:
        return wish.sign * design.quantities[wish.goal], design.quantities[wish.second]

    ordered = sorted(designs, key=goals)
    kept: list[TriedDesign] = []
    for design in ordered:
        if not kept or goals(design)[1] < goals(kept[-1])[1]:
            kept.append(design)
    return tuple(kept)
