"""Coverage of U: a user's own set-up, simulated many times, against what its U states.

The truth of each set is a probe drawn from the map and its uncertainty. It touches the reference as
the user did; the touches are qualified with his settings; then faces and a bore whose places are
known are touched, compensated and measured. The errors of all sets stand next to the U that was
stated for them.
"""

from __future__ import annotations

import logging
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import chain
from multiprocessing import get_context
from pathlib import Path
from typing import TypeAlias

import numpy as np

from pretravel.base import (
    DEVIATION_OF_FORM,
    NOISE,
    U_OF_DIAMETER,
    FloatArray,
    PretravelError,
    check_numbers,
    frozen,
)
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.maps import PretravelMap
from pretravel.measurement import TouchScatter, apply, apply_with_errors
from pretravel.qualification import Qualification, drifted_map, spread_over_support
from pretravel.touches import Touches
from pretravel.uncertainty import EXPANDED_COVERAGE, coverage_factor

_LOG = logging.getLogger(__name__)

FACES = 40
"""Directions in which faces are touched."""
_BORE_AT = np.array([40.0, -25.0, 0.0])
"""Centre of the bore, from the reference. [mm]"""
TOO_LARGE = 1.5
"""U that is so many times larger than needed costs touches, and is called too large."""
_NORMAL = 1.959964
_WORTH_PROCESSES = 6.0
"""Simulation from which other processes, which start in about a second, are worth it. [s]"""


@dataclass(frozen=True)
class ActingErrors:
    """Standard deviations of the errors that act in the simulated sets.

    Parameters
    ----------
    noise : float
        Of each touch. [mm]
    diameter : float
        Of the reference's diameter, its temperature included. [mm]
    form : float
        Of the reference: an oval of this height, from the highest to the lowest point. [mm]
    hysteresis : float
        Shift of the tip's rest by the touch before, across the axis; its size is drawn for each
        set. [mm]
    scatter : TouchScatter, optional
        Machine and probe, separated: the machine's errors and the noise of both in each
        direction, with `noise` along the axis alone. Points are then compensated with it.
    """

    noise: float
    diameter: float = 0.0
    form: float = 0.0
    hysteresis: float = 0.0
    scatter: TouchScatter | None = None

    def __post_init__(self) -> None:
        check_numbers(
            self, noise=NOISE, diameter=U_OF_DIAMETER, form=DEVIATION_OF_FORM, hysteresis=NOISE
        )


@dataclass(frozen=True, eq=False)
class Coverage:
    """How often the U of one quantity contained its error.

    Attributes
    ----------
    name : str
    errors, expanded : (s, m) float
        Of s sets; m values of the quantity in each. [mm]
    u : (s, m) float
        [mm]
    """

    name: str
    errors: FloatArray
    u: FloatArray
    expanded: FloatArray

    @property
    def share(self) -> float:
        """Of the errors within U."""
        return float(np.mean(np.abs(self.errors) <= self.expanded))

    @property
    def interval(self) -> tuple[float, float]:
        """Of the true share, for 95 %: that of Wilson, with as many independent values as the
        scatter between sets tells.

        >>> errors = np.r_[np.zeros(90), np.ones(10)][:, None]
        >>> one = Coverage("size", errors, np.full((100, 1), 0.25), np.full((100, 1), 0.5))
        >>> [round(end, 4) for end in one.interval]  # Wilson 1927: 90 of 100
        [0.8256, 0.9448]
        """
        within = np.abs(self.errors) <= self.expanded
        sets, values = within.shape
        share = float(within.mean())
        between = float(np.var(within.mean(axis=1))) / sets
        count = float(sets * values)
        if between > 0.0:
            count = min(max(share * (1.0 - share) / between, float(sets)), count)
        else:
            count = float(sets)
        z2 = _NORMAL**2 / count
        middle = (share + 0.5 * z2) / (1.0 + z2)
        half = math.sqrt(z2 * share * (1.0 - share) + 0.25 * z2**2) / (1.0 + z2)
        return middle - half, middle + half

    @property
    def chi_squared(self) -> float:
        """Mean of (error / u)²: one where u is right."""
        return float(np.mean((self.errors / self.u) ** 2))

    @property
    def needed(self) -> float:
        """Factor by which U had to be multiplied to contain 95.45 % of the errors."""
        ratio = np.abs(self.errors) / self.expanded
        return float(np.quantile(ratio, EXPANDED_COVERAGE))

    @property
    def verdict(self) -> str:
        """``right``, ``too small`` or ``too large``.

        U is so only where the interval of the share does not contain what is stated.
        """
        low, high = self.interval
        if high < EXPANDED_COVERAGE:
            return "too small"
        large = low > EXPANDED_COVERAGE and self.needed < 1.0 / TOO_LARGE
        return "too large" if large else "right"


@dataclass(frozen=True, eq=False)
class BudgetCheck:
    """What the simulated sets say of a budget.

    Attributes
    ----------
    coverages : tuple of Coverage
        Points of faces in all directions, from the centre of the reference; diameter and position
        of a bore where the map holds for upright walls. The position is from the reference too,
        or within what one map measured, as u of the map is meant.
    directions : (m, 3) float
        Normals of the faces, machine frame: of the columns of the first coverage.
    sets : int
        That were qualified.
    refused : tuple of str
        Reasons of those that were not.
    acting : ActingErrors
    """

    coverages: tuple[Coverage, ...]
    directions: FloatArray
    sets: int
    refused: tuple[str, ...]
    acting: ActingErrors

    @property
    def verdict(self) -> str:
        """The worst of the quantities."""
        found = [each.verdict for each in self.coverages]
        return next((word for word in ("too small", "too large") if word in found), "right")


def check_budget(
    touches: Touches,
    qualification: Qualification,
    requalify: Callable[[Touches], Qualification],
    acting: ActingErrors,
    *,
    sets: int = 100,
    bore: tuple[float, int] = (20.0, 8),
    rng: np.random.Generator | int | None = None,
) -> BudgetCheck:
    """Simulate a qualification and what is measured with it, many times.

    Parameters
    ----------
    touches : Touches
        Of the qualification: their directions, order and feeds are repeated.
    qualification : Qualification
        Of these touches: map and reference.
    requalify : callable
        Qualifies simulated touches with the user's settings.
    acting : ActingErrors
    sets : int
    bore : (float, int)
        Diameter [mm] and touches of the bore.
    rng : numpy.random.Generator or int, optional

    Raises
    ------
    PretravelError
        Every set is refused.

    References
    ----------
    Coverage attained by simulation, as metRology's ``GUM.validate`` states it for a measurement
    equation; here the whole chain is repeated.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.qualification.qualifying import qualify
    >>> n = np.repeat(sphere_pattern_25(), 2, axis=0)
    >>> noise = np.random.default_rng(1).normal(0.0, 3e-4, 50)
    >>> touches = Touches(n * (12.5 + 3.0 - 0.010 + noise[:, None]), n)
    >>> def again(touches):
    ...     return qualify(touches, 25.0, tip_diameter=6.0, kind="mean", u_temperature=0.0)
    >>> found = check_budget(touches, again(touches), again, ActingErrors(3e-4), sets=20, rng=1)
    >>> [each.name for each in found.coverages], found.refused
    (['points of faces', 'diameter of a bore', 'position of a bore to others of the same map'], ())
    """
    found = qualification.pretravel_map
    outward = _around(bore[1]) @ found.rotation.T
    simulated = _SimulatedSet(
        touches, found, requalify, acting, spread_over_support(found, FACES) @ found.rotation.T,
        bore[0], outward if found.supports(-outward).all() else None,
    )  # fmt: skip
    rows, refused = [], []
    for made in _all_sets(simulated, np.random.default_rng(rng).spawn(sets)):
        if isinstance(made, str):
            refused.append(made)
        else:
            rows.append(made)
    if not rows:
        raise PretravelError(
            f"none of {sets} simulated sets can be qualified. The first one: {refused[0]}"
        )
    return BudgetCheck(
        tuple(
            Coverage(
                name, *(frozen(np.array([np.atleast_1d(row[name][k]) for row in rows]))
                        for k in range(3)),
            )
            for name in rows[0]
        ),
        simulated.directions, len(rows), tuple(refused), acting,
    )  # fmt: skip


_Rows: TypeAlias = dict[str, tuple[FloatArray, FloatArray, FloatArray]]
"""Errors, u and U of a set, by the name of the quantity. [mm]"""


@dataclass(frozen=True, eq=False)
class _SimulatedSet:
    """A qualification and what is measured with it, from random numbers of its own.

    Attributes
    ----------
    outward : (n, 3) float or None
        Directions of the touches in the bore, where the map holds for them.
    """

    touches: Touches
    found: PretravelMap
    requalify: Callable[[Touches], Qualification]
    acting: ActingErrors
    directions: FloatArray
    bore: float
    outward: FloatArray | None

    def __call__(self, generator: np.random.Generator) -> _Rows | str:
        """What came out, or why it was refused."""
        found, acting = self.found, self.acting
        truth = replace(
            found, coefficients=found.coefficients + found.covariance.errors(generator, 1)[0]
        )
        try:
            made = self.requalify(_on_reference(self.touches, truth, acting, generator))
            rows = _of_faces(made, truth, self.directions, acting, generator)
            if self.outward is not None:
                rows |= _of_bore(made, truth, self.bore, self.outward, acting, generator)
        except PretravelError as error:
            return str(error)
        return {name: (off, u, k * u) for name, (off, u, k) in rows.items()}


def _all_sets(
    simulated: _SimulatedSet, generators: Sequence[np.random.Generator]
) -> Iterator[_Rows | str]:
    """All sets in their order, on all processors where the first one says that it is worth it."""
    began, count = time.perf_counter(), len(generators)
    first = simulated(generators[0])
    left = (time.perf_counter() - began) * (count - 1)
    processors = (os.cpu_count() or 1) if left >= _WORTH_PROCESSES and _is_command() else 1
    if processors == 1:
        rest: Iterable[_Rows | str] = map(simulated, generators[1:])
        yield from _counted(chain([first], rest), count)
        return
    with ProcessPoolExecutor(min(processors, count - 1), get_context("spawn")) as pool:
        try:
            yield from _counted(chain([first], pool.map(simulated, generators[1:])), count)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _is_command() -> bool:
    """Whether pretravel itself runs: other processes run a script once more, which may have no
    guard, and cannot be sent its functions.
    """
    started = Path(getattr(sys.modules["__main__"], "__file__", None) or "-")
    return "pretravel" in (started.stem, started.parent.name)


def _counted(sets: Iterable[_Rows | str], count: int) -> Iterator[_Rows | str]:
    """The same, with a line for the terminal."""
    for number, made in enumerate(sets, 1):
        _LOG.info("set %d of %d", number, count)
        yield made


_Row = tuple[FloatArray, FloatArray, float]


def _around(count: int) -> FloatArray:
    azimuth = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(count)])


def _travel(
    truth: PretravelMap, touches: Touches, acting: ActingErrors, generator: np.random.Generator
) -> FloatArray:
    """Of the spindle between first contact and latch, along each approach, (n,). [mm]"""
    from pretravel.qualification import travel_per_second

    normals, approaches = touches.normals, touches.approach_directions
    pretravel = truth.pretravel(normals, extrapolate=True)
    travel = pretravel / -np.sum(normals * approaches, axis=1)
    if truth.delay is not None and touches.feeds is not None:
        travel = travel + truth.delay * travel_per_second(touches)
    if acting.scatter is not None:
        outward = acting.scatter.drawn(normals, truth.rotation, generator, acting.noise)
        return np.asarray(travel - outward)
    return np.asarray(travel + generator.normal(0.0, acting.noise, len(travel)))


def _on_reference(
    touches: Touches, truth: PretravelMap, acting: ActingErrors, generator: np.random.Generator
) -> Touches:
    """The touches of the user's qualification, by the true probe; reference at the origin."""
    setup = truth.provenance.setup
    assert setup is not None  # a qualification states it
    normals, approaches = touches.normals, touches.approach_directions
    size = setup.diameter + acting.diameter * generator.standard_normal()
    side = -1.0 if setup.ring else 1.0
    reach = np.full(len(touches), 0.5 * size + side * truth.tip_radius)
    in_probe = normals @ truth.rotation
    turn = np.arctan2(in_probe[:, 1], in_probe[:, 0]) - generator.uniform(0.0, np.pi)
    across = np.sum(in_probe[:, :2] ** 2, axis=1)
    reach = reach + 0.5 * acting.form * across * np.cos(2.0 * turn)
    at = side * reach[:, None] * normals
    if setup.ring:  # heights stay as they are
        axis = truth.rotation[:, 2]
        at = at + (touches.positions @ axis)[:, None] * axis
    size_of_memory = acting.hysteresis * generator.standard_normal()
    before = np.vstack([np.zeros((1, 3)), in_probe[:-1]]) * [1.0, 1.0, 0.0]
    memory = size_of_memory * np.sum(before * in_probe, axis=1)
    travel = _travel(truth, touches, acting, generator) + memory
    return replace(touches, positions=at + travel[:, None] * approaches)


def _part_touches(
    surface: FloatArray, normals: FloatArray, truth: PretravelMap, feeds: FloatArray | None,
    acting: ActingErrors, generator: np.random.Generator,
) -> Touches:  # fmt: skip
    at = surface + truth.tip_radius * normals
    word = truth.provenance.orientation
    touches = Touches(at, normals, feeds=feeds, orientations=(word,) * len(at) if word else None)
    travel = _travel(truth, touches, acting, generator)
    return replace(touches, positions=at - travel[:, None] * normals)


def _feed(truth: PretravelMap, count: int) -> FloatArray | None:
    return None if truth.feed is None else np.full(count, truth.feed)


def _of_faces(
    made: Qualification, truth: PretravelMap, directions: FloatArray, acting: ActingErrors,
    generator: np.random.Generator,
) -> dict[str, _Row]:  # fmt: skip
    """Errors along the normals of single points, from the reference's centre."""
    surface = 30.0 * directions
    feeds = _feed(truth, len(directions))
    touches = _part_touches(surface, directions, truth, feeds, acting, generator)
    points, errors = apply_with_errors(
        touches, made.pretravel_map, extrapolate=True, shared=False, scatter=acting.scatter
    )
    error = np.sum((points.positions - surface - made.center) * directions, axis=1)
    # As `compensate` states U: k of the budget, which few touches have made larger than 2.
    k = errors.budget().coverage_factor()
    return {"points of faces": (error, points.standard_uncertainty, k)}


def _is_from_reference(pretravel_map: PretravelMap) -> bool:
    """Whether u of the map contains the centre of the reference.

    Where a convention separates the two, a shift is in u of the centre: positions of features
    that one map measured have it in common.
    """
    try:
        return drifted_map(pretravel_map).from_center
    except PretravelError:  # a kind with few numbers, which has no shift
        return False


def _of_bore(
    made: Qualification, truth: PretravelMap, diameter: float, outward: FloatArray,
    acting: ActingErrors, generator: np.random.Generator,
) -> dict[str, _Row]:  # fmt: skip
    """Errors of a bore's diameter and of its position."""
    surface = _BORE_AT + 0.5 * diameter * outward
    feeds = _feed(truth, len(outward))
    touches = _part_touches(surface, -outward, truth, feeds, acting, generator)
    points = apply(touches, made.pretravel_map, scatter=acting.scatter)
    found = measure_feature(points, "bore", axis=truth.rotation[:, 2])
    rows: dict[str, _Row] = {}
    size = found.quantity("diameter")
    k = coverage_factor(size.dof, whole_dof=False)
    rows["diameter of a bore"] = (np.array(size.value - diameter), np.array(size.u), k)
    places = [q for q in found.quantities if q.name in "xyz"]
    from_reference = _is_from_reference(made.pretravel_map)
    true = dict(zip("xyz", _BORE_AT + (made.center if from_reference else 0.0), strict=True))
    if places:
        among = "" if from_reference else " to others of the same map"
        rows[f"position of a bore{among}"] = (
            np.array([q.value - true[q.name] for q in places]),
            np.array([q.u for q in places]),
            coverage_factor(places[0].dof, whole_dof=False),
        )
    return rows
