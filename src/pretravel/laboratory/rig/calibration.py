"""Performance parameters of a probe from its touches on the rig."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from pretravel.base import (
    LARGEST_PRETRAVEL,
    MICROMETRE,
    PROBABILITY,
    FloatArray,
    PretravelError,
    checked,
    frozen,
)
from pretravel.laboratory.rig.lobes import scatter_about_lobes
from pretravel.laboratory.rig.outliers import TraceOutlier, outlier_messages, outlying_rows
from pretravel.laboratory.rig.passes import PassDifferences, pass_differences, scatters_more
from pretravel.laboratory.rig.trace import RigTouch
from pretravel.maps import BEFORE_CONTACT
from pretravel.touches import kept_by_repeats, refuse_coarse
from pretravel.uncertainty import COVERAGE, COVERAGE_FACTOR, coverage_factor

_NAME = re.compile(r"_(-?\d+(?:\.\d+)?)(?:p(\d+(?:\.\d+)?))?_\d+$")
_ACROSS = math.radians(0.01)
_AXIS = re.compile(r"_([+-]?)([XYZ])_\d+$", re.IGNORECASE)
_QUARTERS = {"X": 0.0, "Y": 90.0, "-X": 180.0, "-Y": 270.0}


@dataclass(frozen=True)
class Spread:
    """A standard deviation of single touches, with its coverage interval.

    Attributes
    ----------
    value, low, high : float
        Value and upper end are not below what the sampling of the traces alone produces. [mm]
    dof : float
        Degrees of freedom.
    of_lobes : bool
        Nothing was repeated: it is what three equal lobes leave of the touches. Where the lobes
        differ from each other it is too large.
    measured : float
        Standard deviation of the touches themselves: repeats that fall between the same samples
        make it smaller than the sampling, down to zero. [mm]
    """

    value: float
    low: float
    high: float
    dof: float
    of_lobes: bool = False
    measured: float = math.nan

    @property
    def of_sampling(self) -> bool:
        """Whether the value is that of the sampling, above what the touches show."""
        return self.value > self.measured

    def not_below(self, sampling: float) -> Spread:
        """The spread, not below that of edges between samples."""
        if not self.value < sampling:
            return self
        return replace(self, value=sampling, high=max(self.high, sampling))


@dataclass(frozen=True)
class DirectionPerformance:
    """Performance of a probe in one direction.

    Attributes
    ----------
    name : str
    azimuth : float
        From the names of the traces; nan where they contain none. [rad]
    count : int
    pretravel, u_pretravel : float
        Mean, and its standard uncertainty from the repeats of all directions. [mm]
    expanded_pretravel : float
        Expanded uncertainty of the mean, from the repeats alone, with k by Student's t: more than
        2 where they are few. [mm]
    repeatability : Spread
        Of pretravel.
    pretravel_range : float
        Largest less smallest pretravel. [mm]
    trigger_range : float
        Largest less smallest r1, as in the paper; it is a repeatability only where all touches
        start at the same place. [mm]
    hysteresis, u_hysteresis : float
        Mean, and its standard uncertainty from the repeats of all directions, not below that of
        edges between samples; nan without repeats. [mm]
    expanded_hysteresis : float
        Expanded uncertainty, as that of the pretravel. [mm]
    polar : float
        Between the direction and the probe's axis, to the spindle; nan as the azimuth. [rad]
    scatters_more : bool
        Whether its touches scatter more than those of the others, beyond chance: its u is then from
        its own repeats.
    """

    name: str
    azimuth: float
    count: int
    pretravel: float
    u_pretravel: float
    expanded_pretravel: float
    repeatability: Spread
    pretravel_range: float
    trigger_range: float
    hysteresis: float
    u_hysteresis: float
    expanded_hysteresis: float
    polar: float = 0.5 * math.pi
    scatters_more: bool = False

    @property
    def across(self) -> bool:
        """Whether it lies across the probe's axis, where the lobes are."""
        return math.isfinite(self.azimuth) and abs(self.polar - 0.5 * math.pi) < _ACROSS


@dataclass(frozen=True, eq=False)
class RigCalibration:
    """The calibration of a probe on the rig.

    Attributes
    ----------
    touches : tuple of RigTouch
    directions : tuple of DirectionPerformance
        In order of azimuth.
    repeatability : Spread
        Unidirectional, pooled over the directions; of touches without any repeat, what the lobes
        leave.
    pretravel, u_pretravel : float
        Mean over the directions, and its standard uncertainty. [mm]
    anisotropy : float
        Largest less smallest mean pretravel; nan of one direction. [mm]
    anisotropy_interval : (2,) float
        Coverage interval, see `calibrate_rig`. [mm]
    hysteresis, largest_hysteresis : float
        Mean over all touches; the one of largest magnitude, with its sign. [mm]
    left_out : tuple of str
        Traces without a pretravel.
    excluded : tuple of str
        Traces that the user left out.
    outliers : tuple of TraceOutlier
        Traces with a gross error, left out.
    with_outliers : RigCalibration or None
        The calibration with the outliers, to compare; None without outliers.
    starts_differ : bool
        Whether the touches of a direction start at different places, so that the range of r1 is
        not the repeatability.
    probability : float
        Of the intervals.
    step, u_step : float
        Of the ruler, where it is coarser than the sampling, and the standard uncertainty of a
        pretravel by the step, which repeats do not reduce; otherwise zero. [mm]
    passes : PassDifferences or None
        Passes that differ in all directions alike.
    """

    touches: tuple[RigTouch, ...]
    directions: tuple[DirectionPerformance, ...]
    repeatability: Spread
    pretravel: float
    u_pretravel: float
    anisotropy: float
    anisotropy_interval: FloatArray
    hysteresis: float
    largest_hysteresis: float
    left_out: tuple[str, ...]
    excluded: tuple[str, ...]
    outliers: tuple[TraceOutlier, ...]
    with_outliers: RigCalibration | None
    starts_differ: bool
    probability: float
    step: float = 0.0
    u_step: float = 0.0
    passes: PassDifferences | None = None

    def __repr__(self) -> str:
        return (
            f"RigCalibration({len(self.touches):,} touches, {len(self.directions)} directions; "
            f"mean pretravel {self.pretravel / MICROMETRE:.3f} µm; "
            f"anisotropy {_known(self.anisotropy)}; "
            f"repeatability {_known(self.repeatability.value)})"
        )

    @property
    def hysteresis_anisotropy(self) -> float:
        """Largest less smallest mean hysteresis of a direction (Ren 2020, section 2.2). [mm]

        nan of one direction.
        """
        return _range_of([d.hysteresis for d in self.directions])

    @property
    def repeatability_anisotropy(self) -> float:
        """Largest less smallest repeatability of a direction. [mm]

        nan without repeats in two directions.
        """
        return _range_of([d.repeatability.value for d in self.directions])

    @property
    def not_used(self) -> dict[str, str]:
        """Reason for each trace that is not in the results: no pretravel, outlier, excluded."""
        reasons = dict.fromkeys(self.left_out, "no pretravel")
        reasons |= {outlier.trace: "outlier" for outlier in self.outliers}
        return reasons | dict.fromkeys(self.excluded, "excluded")


def _known(length: float) -> str:
    return f"{length / MICROMETRE:.3f} µm" if math.isfinite(length) else "unknown"


def _range_of(values: Sequence[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return max(known) - min(known) if len(known) > 1 else math.nan


def spread_from(squares: float, dof: float, probability: float = COVERAGE) -> Spread:
    """Standard deviation and its chi-square interval from a sum of squared residuals.

    >>> spread = spread_from(16.0, 16)
    >>> spread.value, round(spread.low, 3), round(spread.high, 3)
    (1.0, 0.745, 1.522)
    """
    from scipy.special import gammaincinv

    if dof <= 0.0:
        return Spread(math.nan, math.nan, math.nan, 0.0)
    half = 0.5 * probability
    high, low = (2.0 * float(gammaincinv(0.5 * dof, 0.5 + side)) for side in (-half, half))
    value = math.sqrt(squares / dof)
    return Spread(value, math.sqrt(squares / low), math.sqrt(squares / high), dof, measured=value)


@cache
def _studentized_range(probability: float, count: int, dof: float) -> float:
    """Quantile of the studentized range; kept, since it is slow to compute."""
    from scipy.stats import studentized_range

    return float(studentized_range.ppf(probability, count, dof))


def angles_of(trace: str) -> tuple[float, float]:
    """Azimuth and polar angle in a trace's name; nan without them. [rad]

    ``rig_030_2``: azimuth 30° across the probe's axis; ``rig_030p45_2``: polar angle 45°;
    ``rig_+Z_1``, ``rig_-X_1``, ``rig_Y_3``: along an axis. The last number is that of the repeat.

    >>> [round(math.degrees(angle), 6) for angle in angles_of("rig_030p45_2")]
    [30.0, 45.0]
    >>> [round(math.degrees(angle), 6) for angle in angles_of("rig_-X_1")]
    [180.0, 90.0]
    """
    if found := _NAME.search(trace):
        polar = 90.0 if found.group(2) is None else float(found.group(2))
        return math.radians(float(found.group(1))), math.radians(polar)
    if found := _AXIS.search(trace):
        sign, axis = found.group(1).replace("+", ""), found.group(2).upper()
        if axis == "Z":
            return 0.0, math.pi if sign else 0.0
        return math.radians(_QUARTERS[sign + axis]), 0.5 * math.pi
    return math.nan, math.nan


def _azimuth_around(trace: str) -> float:
    """The azimuth of a direction across the probe's axis, where lobes are; nan for others."""
    azimuth, polar = angles_of(trace)
    return azimuth if abs(polar - 0.5 * math.pi) < _ACROSS else math.nan


def direction_name(trace: str) -> str:
    """The direction of a trace: its name without the number of the repeat.

    >>> direction_name("rig_030_2")
    'rig_030'
    """
    return re.sub(r"_\d+$", "", trace)


_NUMBER_ALONE = re.compile(r"_\d{3}$")


def doubts_of_names(traces: Sequence[str]) -> tuple[str, ...]:
    """Sentences on names of traces that say another thing than was meant, perhaps.

    >>> doubts_of_names(["rig_000_1", "old_030_1"])[0][:45]
    "the names of the traces begin with 'old' and "
    >>> doubts_of_names(["rig_030"])[0][:42]
    'rig_030: read as touch 30 in the direction'
    """
    begin = sorted({trace[: at.start()] for trace in traces if (at := _NAME.search(trace))})
    found = []
    if len(begin) > 1:
        named = " and ".join(f"'{each}'" for each in begin[:3]) + (" …" if begin[3:] else "")
        found.append(
            f"the names of the traces begin with {named}: are they of one probe and stylus?"
        )
    if alone := [t for t in traces if not _NAME.search(t) and _NUMBER_ALONE.search(t)]:
        number = int(alone[0][-3:])
        found.append(
            f"{alone[0]}: read as touch {number} in the direction '{direction_name(alone[0])}', "
            "without angles. Is its last number an azimuth? A name ends with direction and repeat, "
            "such as rig_030_1"
        )
    return tuple(found)


def calibrate_rig(
    touches: Sequence[RigTouch],
    *,
    exclude: Sequence[str] = (),
    search_outliers: bool = True,
    probability: float = COVERAGE,
) -> RigCalibration:
    """Determine the performance parameters of a probe from touches on the rig.

    Parameters
    ----------
    touches : sequence of RigTouch
        The names of the traces of repeats differ in the last number.
    exclude : sequence of str
        Traces that are left out, by name or file.
    search_outliers : bool
        Whether touches with a gross error are left out, see `outlying_rows`.
    probability : float
        Of coverage intervals.

    Returns
    -------
    RigCalibration

    Raises
    ------
    PretravelError
        No touch with a pretravel, an implausible pretravel, one azimuth under two names, a trace
        that is given twice, an excluded one that is not there.

    Notes
    -----
    Standard uncertainties from few repeats are those of the GUM (4.2.3); the coverage factor of
    their degrees of freedom is in the expanded ones (G.3).

    The largest less the smallest mean is biased upwards by scatter. The interval of the anisotropy
    is Tukey's for all differences of two means at once: its coverage probability is at least the
    one stated.

    References
    ----------
    Ren 2020, equations 2 to 4 and Figure 8.
    """
    checked(probability, "the probability", PROBABILITY, inputs=("probability",))
    if not 0.0 < probability < 1.0:
        raise PretravelError(
            f"the probability is {probability:g}; it must lie between 0 and 1",
            inputs=("probability",),
        )
    names = [touch.trace for touch in touches]
    double = [name for name in names if names.count(name) > 1]
    if double:
        raise PretravelError(
            f"the trace {double[0]} is given twice: each trace is one touch, and has its own name"
        )
    excluded = _excluded_traces(touches, exclude)
    evaluated = _plausible_touches([t for t in touches if t.trace not in excluded])
    refuse_coarse(max(touch.step for touch in evaluated), "the traces")
    with_all = _calibration(touches, evaluated, excluded, probability)
    outliers = _trace_outliers(evaluated) if search_outliers else []
    if not outliers:
        return with_all
    wrong = {outlier.trace for outlier in outliers}
    without = [touch for touch in evaluated if touch.trace not in wrong]
    return replace(
        _calibration(touches, without, excluded, probability),
        outliers=tuple(outliers),
        with_outliers=with_all,
    )


def _excluded_traces(touches: Sequence[RigTouch], exclude: Sequence[str]) -> tuple[str, ...]:
    """Names of the traces that the user leaves out, in the order of the touches."""
    names = [touch.trace for touch in touches]
    wanted = {label if label in names else label.removesuffix(".csv") for label in exclude}
    unknown = sorted(wanted.difference(names))
    if unknown:
        raise PretravelError(
            f"no trace '{unknown[0]}' to leave out; there are {', '.join(names[:12])}"
            + (", …" if len(names) > 12 else ""),
            inputs=("exclude",),
        )
    if wanted.issuperset(names):
        raise PretravelError("no trace is left: all are excluded", inputs=("exclude",))
    return tuple(name for name in names if name in wanted)


def _trace_outliers(evaluated: Sequence[RigTouch]) -> list[TraceOutlier]:
    """Touches with a gross error, against repeats and against the map of all directions."""
    names = [touch.trace for touch in evaluated]
    _, groups, count = np.unique(
        [direction_name(name) for name in names], return_inverse=True, return_counts=True
    )
    found = outlying_rows(
        np.array([touch.pretravel for touch in evaluated]),
        groups,
        np.array([_azimuth_around(name) for name in names]),
        floor=float(np.mean([touch.u_pretravel for touch in evaluated])),
    )
    return [
        outlier
        for rows in found
        for outlier in outlier_messages(rows, names, int(count[groups[rows.rows[0]]]) - 1)
    ]


def _calibration(
    touches: Sequence[RigTouch],
    evaluated: Sequence[RigTouch],
    excluded: tuple[str, ...],
    probability: float,
) -> RigCalibration:
    """The calibration from the touches that are evaluated."""
    groups = _touches_by_direction(evaluated)
    directions = [_performance(name, group, probability) for name, group in groups.items()]
    directions.sort(
        key=lambda d: (math.isnan(d.azimuth), abs(d.polar - 0.5 * math.pi), d.azimuth, d.name)
    )
    repeatability = _pooled_repeatability(directions, groups, probability)
    step = max(touch.step for touch in evaluated)
    # Both ends of a pretravel are read in steps.
    u_step = math.sqrt(2.0) * kept_by_repeats(
        step, repeatability.measured / math.sqrt(2.0) if repeatability.dof > 0.0 else 0.0
    )
    passes = pass_differences(groups)
    shared = math.hypot(u_step, 0.0 if passes is None else passes.u)
    directions = _with_pooled_scatter(directions, groups, repeatability, (u_step, shared))
    means = np.array([d.pretravel for d in directions])
    shifts = _shifts(evaluated)
    without = [t.trace for t in touches if not math.isfinite(t.pretravel)]
    return RigCalibration(
        touches=tuple(touches),
        directions=tuple(directions),
        repeatability=repeatability,
        pretravel=float(means.mean()),
        u_pretravel=math.hypot(_u_of_overall_mean(directions, repeatability), shared),
        anisotropy=_range_of(means.tolist()),
        anisotropy_interval=frozen(
            _anisotropy_interval(directions, repeatability, probability, u_step)
        ),
        hysteresis=float(shifts.mean()) if len(shifts) else math.nan,
        largest_hysteresis=float(shifts[np.argmax(np.abs(shifts))]) if len(shifts) else math.nan,
        left_out=tuple(name for name in without if name not in excluded),
        excluded=excluded,
        outliers=(),
        with_outliers=None,
        starts_differ=any(
            d.count > 1 and d.trigger_range > 3.0 * max(d.pretravel_range, 1e-5) for d in directions
        ),
        probability=probability,
        step=step,
        u_step=u_step,
        passes=passes,
    )


def _plausible_touches(touches: Sequence[RigTouch]) -> list[RigTouch]:
    """The touches that have a pretravel, all of a plausible size."""
    evaluated = [touch for touch in touches if math.isfinite(touch.pretravel)]
    if not evaluated:
        raise PretravelError(
            "no trace has a pretravel: "
            + "; ".join(f"{t.trace}: {', '.join(t.notes) or 'no events'}" for t in touches)
        )
    for touch in evaluated:
        if not -BEFORE_CONTACT < touch.pretravel < LARGEST_PRETRAVEL:
            raise PretravelError(
                f"{touch.trace}: pretravel r1 - r0 is {touch.pretravel / MICROMETRE:.1f} µm; usual "
                "values are 1 to 80 µm. Are ruler_mm and laser_mm in mm, does the ruler reading "
                "grow towards the probe, and are the signals high at rest?"
                + (f" ({'; '.join(touch.notes)})" if touch.notes else "")
                + " A false trigger can be left out",
                inputs=("exclude",),
            )
    return evaluated


def _touches_by_direction(touches: Sequence[RigTouch]) -> dict[str, list[RigTouch]]:
    """Touches grouped by the name of their direction; each azimuth has one name."""
    groups: dict[str, list[RigTouch]] = {}
    for touch in touches:
        groups.setdefault(direction_name(touch.trace), []).append(touch)
    name_of: dict[tuple[float, float], str] = {}
    for name, group in groups.items():
        azimuth, polar = angles_of(group[0].trace)
        if polar > math.pi:
            raise PretravelError(
                f"{name}: the polar angle is {math.degrees(polar):g}°; it must lie between 0 (the "
                "rod pushes the tip along the probe's axis, to the spindle) and 180°"
            )
        if abs(azimuth) > 2.0 * math.pi:
            raise PretravelError(
                f"{name}: the azimuth is {math.degrees(azimuth):g}°; it is at most 360°. A name "
                "ends with direction and repeat, such as rig_030_1"
            )
        at_pole = math.sin(polar) < 1e-9  # all azimuths are one direction there
        around = 0.0 if at_pole else round(math.degrees(azimuth) % 360.0, 6) % 360.0
        place = (around, round(polar, 9))
        if name_of.setdefault(place, name) != name and math.isfinite(azimuth):
            raise PretravelError(
                f"{name_of[place]} and {name} are the same direction under two names: give the "
                "traces of one probe at a time, with names of one form"
            )
    return groups


def _performance(
    name: str, touches: Sequence[RigTouch], probability: float
) -> DirectionPerformance:
    """The performance in one direction, from its own touches."""
    pretravel = np.array([t.pretravel for t in touches])
    triggers = np.array([t.r1 for t in touches])
    shifts = _shifts(touches)
    count = len(touches)
    spread = spread_from(float(np.sum((pretravel - pretravel.mean()) ** 2)), count - 1, probability)
    return DirectionPerformance(
        name=name,
        azimuth=angles_of(touches[0].trace)[0],
        count=count,
        pretravel=float(pretravel.mean()),
        u_pretravel=math.nan,  # needs the repeats of all directions
        expanded_pretravel=math.nan,
        repeatability=spread.not_below(_of_sampling(touches)),
        pretravel_range=float(np.ptp(pretravel)),
        trigger_range=float(np.ptp(triggers)),
        hysteresis=float(shifts.mean()) if len(shifts) else math.nan,
        u_hysteresis=math.nan,  # as above
        expanded_hysteresis=math.nan,
        polar=angles_of(touches[0].trace)[1],
    )


def _of_sampling(touches: Sequence[RigTouch]) -> float:
    """Standard deviation of a pretravel that edges between samples alone produce. [mm]"""
    known = [touch.u_pretravel for touch in touches if math.isfinite(touch.u_pretravel)]
    return float(np.mean(known or [0.0]))


def _alike_in_repeats(groups: Sequence[Sequence[RigTouch]]) -> float:
    """Standard deviation of a pretravel by edges between samples that repeats do not reduce. [mm]

    Traces that start alike and scatter by less than a sample have an edge at one place of it. In a
    direction where that place is by chance at a sample, repeats scatter more: the median counts.
    """
    repeated = [group for group in groups if len(group) > 1]
    if not repeated:
        return 0.0
    kept = [
        kept_by_repeats(
            math.sqrt(12.0) * float(np.mean([getattr(t, u) for g in repeated for t in g])),
            float(np.median([np.std([getattr(t, at) for t in g], ddof=1) for g in repeated])),
        )
        for at, u in (("r0", "u_r0"), ("r1", "u_r1"))
    ]
    return math.hypot(*kept)


def _shifts(touches: Sequence[RigTouch]) -> FloatArray:
    """Hysteresis of the touches that show one. [mm]"""
    return np.array([t.hysteresis for t in touches if math.isfinite(t.hysteresis)])


def _with_pooled_scatter(
    directions: Sequence[DirectionPerformance],
    groups: Mapping[str, Sequence[RigTouch]],
    repeatability: Spread,
    common: tuple[float, float],
) -> list[DirectionPerformance]:
    """The directions with the uncertainties that the repeats of all of them and the step give.

    Two or three repeats of one direction alone would often state too small an uncertainty. In
    common are the uncertainties by the step, and by step and passes.
    """
    u_step, shared = common
    squares = math.fsum(_squares(d) for d in directions)
    total = sum(d.count - 1 for d in directions)
    u_hysteresis, expanded_hysteresis = _hysteresis_scatter(groups)
    sampling = _of_sampling([t for group in groups.values() for t in group])
    edges = COVERAGE_FACTOR * sampling
    alike = _alike_in_repeats(list(groups.values()))
    found = []
    for d in directions:
        shown = math.sqrt(max(len(_shifts(groups[d.name])), 1))
        more = scatters_more(_squares(d), d.count - 1, squares, total, len(directions), sampling)
        spread = d.repeatability if more else repeatability
        factor = coverage_factor(spread.dof) if spread.dof > 0.0 else math.nan
        u = math.hypot(spread.value / math.sqrt(d.count), shared)
        # Few repeats may be alike by chance; edges between samples are not.
        expanded = max(factor * spread.measured, edges) / math.sqrt(d.count)
        # Repeats that meet the samples at one phase have the error of their edges in common.
        u, expanded = max(u, alike), max(expanded, COVERAGE_FACTOR * alike)
        found.append(
            replace(
                d,
                u_pretravel=u,
                expanded_pretravel=math.hypot(expanded, COVERAGE_FACTOR * shared),
                scatters_more=more,
                u_hysteresis=math.hypot(u_hysteresis / shown, u_step),
                expanded_hysteresis=math.hypot(
                    expanded_hysteresis / shown, COVERAGE_FACTOR * u_step
                ),
            )
        )
    return found


def _squares(direction: DirectionPerformance) -> float:
    """Sum of squared residuals of the repeats of a direction. [mm²]"""
    spread = direction.repeatability
    return spread.measured**2 * spread.dof if spread.dof > 0.0 else 0.0


def _hysteresis_scatter(groups: Mapping[str, Sequence[RigTouch]]) -> tuple[float, float]:
    """Standard deviation of the hysteresis of one touch, pooled, and expanded. [mm]

    Not below what edges between samples alone produce, which few repeats may hide; nan where
    nothing was repeated.
    """
    repeated = [shifts for group in groups.values() if len(shifts := _shifts(group)) > 1]
    if not repeated:
        return math.nan, math.nan
    dof = sum(len(shifts) - 1 for shifts in repeated)
    squares = math.fsum(float(np.sum((shifts - shifts.mean()) ** 2)) for shifts in repeated)
    single = math.sqrt(squares / dof)
    edges = float(
        np.mean(
            [
                math.hypot(touch.u_r0, touch.u_r3)
                for group in groups.values()
                for touch in group
                if math.isfinite(touch.hysteresis)
            ]
        )
    )
    return max(single, edges), max(coverage_factor(dof) * single, COVERAGE_FACTOR * edges)


def _pooled_repeatability(
    directions: Sequence[DirectionPerformance],
    groups: Mapping[str, Sequence[RigTouch]],
    probability: float,
) -> Spread:
    """The repeatability of single touches, pooled over the directions."""
    sampling = _of_sampling([touch for group in groups.values() for touch in group])
    dof = sum(d.count - 1 for d in directions)
    if dof == 0:
        named = [d for d in directions if d.across or math.isnan(d.azimuth)]
        means = np.array([d.pretravel for d in named])
        azimuths = np.array([d.azimuth for d in named])
        squares, dof = scatter_about_lobes(means, azimuths)
        spread = replace(spread_from(squares, dof, probability), of_lobes=dof > 0)
        return spread.not_below(sampling)
    squares = math.fsum(
        (touch.pretravel - d.pretravel) ** 2 for d in directions for touch in groups[d.name]
    )
    return spread_from(squares, dof, probability).not_below(sampling)


def _u_of_overall_mean(directions: Sequence[DirectionPerformance], repeatability: Spread) -> float:
    """Standard uncertainty of the mean over the directions; nan without repeats. [mm]"""
    counts = np.array([d.count for d in directions], dtype=np.float64)
    return repeatability.value * math.sqrt(float(np.sum(1.0 / counts))) / len(counts)


def _anisotropy_interval(
    directions: Sequence[DirectionPerformance],
    repeatability: Spread,
    probability: float,
    u_step: float,
) -> FloatArray:
    """Coverage interval of the largest difference of two means (Tukey, Kramer), (2,). [mm]"""
    if repeatability.dof <= 0.0 or len(directions) == 1:
        return np.full(2, math.nan)
    measured = float(np.ptp([d.pretravel for d in directions]))
    fewest = float(min(d.count for d in directions))
    half = max(
        _studentized_range(probability, len(directions), dof) * scatter / math.sqrt(fewest)
        for dof, scatter in (
            (repeatability.dof, repeatability.measured),
            # That of the sampling is known, not estimated from few repeats.
            *(((math.inf, repeatability.value),) if repeatability.of_sampling else ()),
        )
    )
    half = math.hypot(half, COVERAGE_FACTOR * math.sqrt(2.0) * u_step)
    return np.array([max(measured - half, 0.0), measured + half])
