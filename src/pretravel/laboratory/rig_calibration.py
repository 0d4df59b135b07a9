"""A probe's performance from its touches on the rig, direction by direction and overall."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.directions import from_angles
from pretravel.errors import PretravelError
from pretravel.laboratory.rig import RigTouch
from pretravel.maps.bases import TabulatedBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.gum import COVERAGE, Budget, Component
from pretravel.units import MICROMETRE

LARGEST, SMALLEST = 0.15, 0.002
"""Pretravel beyond these (the second negative) is an error of units or signs. [mm]"""
_NAME = re.compile(r"_(-?\d+(?:\.\d+)?)_\d+$")


@dataclass(frozen=True)
class Spread:
    """A standard deviation with its coverage interval, from repeats.

    Attributes
    ----------
    value, low, high : float
        [mm]
    dof : float
    """

    value: float
    low: float
    high: float
    dof: float


@dataclass(frozen=True)
class DirectionPerformance:
    """The touches of one direction.

    Attributes
    ----------
    name : str
    azimuth : float
        Of the direction, from the traces' names; nan where they do not tell. [rad]
    count : int
    pretravel, u_pretravel : float
        Mean, and standard uncertainty of that mean from the repeats of all directions. [mm]
    repeatability : Spread
        Of pretravel.
    pretravel_range : float
        Largest less smallest pretravel. [mm]
    trigger_range : float
        Largest less smallest r1, as the paper has it: good where all touches start at the same
        place. [mm]
    hysteresis, u_hysteresis : float
        Mean and its standard uncertainty. [mm]
    """

    name: str
    azimuth: float
    count: int
    pretravel: float
    u_pretravel: float
    repeatability: Spread
    pretravel_range: float
    trigger_range: float
    hysteresis: float
    u_hysteresis: float


@dataclass(frozen=True, eq=False)
class RigCalibration:
    """What a probe's calibration on the rig states.

    Attributes
    ----------
    touches : tuple of RigTouch
    directions : tuple of DirectionPerformance
        In order of azimuth.
    repeatability : Spread
        Unidirectional, pooled over the directions.
    pretravel, u_pretravel : float
        Mean over the directions, and its standard uncertainty. [mm]
    anisotropy : float
        Largest less smallest mean pretravel. [mm]
    anisotropy_interval : (2,) float
        Coverage interval; see the notes. [mm]
    hysteresis, largest_hysteresis : float
        Mean over all touches; the largest in size, with its sign. [mm]
    left_out : tuple of str
        Traces that tell no pretravel.
    starts_differ : bool
        Whether the touches of a direction start at different places, so that r1 alone does not
        tell repeatability.
    probability : float
        Of the intervals.
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
    starts_differ: bool
    probability: float


def spread_from(squares: float, dof: float, probability: float = COVERAGE) -> Spread:
    """From a sum of squared residuals: the standard deviation and its chi-square interval.

    >>> spread = spread_from(16.0, 16)
    >>> spread.value, round(spread.low, 3), round(spread.high, 3)
    (1.0, 0.745, 1.522)
    """
    from scipy.stats import chi2

    if dof <= 0.0:
        return Spread(math.nan, math.nan, math.nan, 0.0)
    half = 0.5 * probability
    high, low = (float(chi2.ppf(0.5 - half, dof)), float(chi2.ppf(0.5 + half, dof)))
    return Spread(
        math.sqrt(squares / dof), math.sqrt(squares / low), math.sqrt(squares / high), dof
    )


@cache
def _studentized_range(probability: float, count: int, dof: float) -> float:
    """Its quantile: slow to find, and always the same for one plan of touches."""
    from scipy.stats import studentized_range

    return float(studentized_range.ppf(probability, count, dof))


def azimuth_of(trace: str) -> float:
    """The azimuth in a trace's name, as in ``rig_030_2``; nan without one. [rad]

    >>> round(azimuth_of("rig_030_2"), 4)
    0.5236
    """
    found = _NAME.search(trace)
    return math.radians(float(found.group(1))) if found else math.nan


def _direction_name(trace: str) -> str:
    return re.sub(r"_\d+$", "", trace)


def calibrate_rig(touches: Sequence[RigTouch], *, probability: float = COVERAGE) -> RigCalibration:
    """Performance parameters of a probe.

    Parameters
    ----------
    touches : sequence of RigTouch
        Repeats of a direction differ in the last number of their traces' names.
    probability : float
        Of coverage intervals.

    Returns
    -------
    RigCalibration

    Raises
    ------
    PretravelError
        No touch that tells a pretravel.

    Notes
    -----
    Largest less smallest mean is biased upwards by scatter. The interval of the anisotropy is
    Tukey's for all differences of two means at once: it covers with at least the
    probability stated.

    References
    ----------
    Ren 2020, equations 2 to 4 and Figure 8.
    """
    told = [touch for touch in touches if math.isfinite(touch.pretravel)]
    if not told:
        raise PretravelError(
            "no trace tells a pretravel: "
            + "; ".join(f"{t.trace}: {', '.join(t.notes) or 'no events'}" for t in touches)
        )
    for touch in told:
        if not -SMALLEST < touch.pretravel < LARGEST:
            raise PretravelError(
                f"{touch.trace}: pretravel r1 - r0 is {touch.pretravel / MICROMETRE:.1f} µm; "
                "probes give by 1 to 80. Are ruler_mm and laser_mm in mm, does the ruler grow "
                "towards the probe, and are the signals high at rest?"
                + (f" ({'; '.join(touch.notes)})" if touch.notes else "")
            )
    groups: dict[str, list[RigTouch]] = {}
    for touch in told:
        groups.setdefault(_direction_name(touch.trace), []).append(touch)
    named: dict[float, str] = {}
    for name, group in groups.items():
        azimuth = azimuth_of(group[0].trace)
        if named.setdefault(azimuth, name) != name and math.isfinite(azimuth):
            raise PretravelError(
                f"{named[azimuth]} and {name} are the same azimuth under two names: give the "
                "traces of one probe at a time, named alike"
            )
    directions = [_direction(name, group, probability) for name, group in groups.items()]
    directions.sort(key=lambda d: (math.isnan(d.azimuth), d.azimuth, d.name))
    squares = math.fsum(
        (touch.pretravel - d.pretravel) ** 2 for d in directions for touch in groups[d.name]
    )
    dof = float(len(told) - len(directions))
    repeatability = spread_from(squares, dof, probability)
    if dof > 0.0:
        # Two or three repeats of one direction alone would often claim next to nothing.
        directions = [
            replace(d, u_pretravel=repeatability.value / math.sqrt(d.count)) for d in directions
        ]
    means = np.array([d.pretravel for d in directions])
    counts = np.array([d.count for d in directions], dtype=np.float64)
    interval = np.full(2, math.nan)
    u_mean = math.nan
    if dof > 0.0:
        measured = float(np.ptp(means))
        # All differences of means at once (Tukey, Kramer): the largest among them.
        half = (
            _studentized_range(probability, max(len(means), 2), dof)
            * repeatability.value
            / math.sqrt(float(counts.min()))
        )
        interval = np.array([max(measured - half, 0.0), measured + half])
        if len(means) == 1:
            interval = np.full(2, math.nan)
        u_mean = repeatability.value * math.sqrt(float(np.sum(1.0 / counts))) / len(counts)
    shifts = np.array([t.hysteresis for t in told if math.isfinite(t.hysteresis)])
    return RigCalibration(
        touches=tuple(touches),
        directions=tuple(directions),
        repeatability=repeatability,
        pretravel=float(means.mean()),
        u_pretravel=u_mean,
        anisotropy=float(np.ptp(means)),
        anisotropy_interval=frozen(interval),
        hysteresis=float(shifts.mean()) if len(shifts) else math.nan,
        largest_hysteresis=float(shifts[np.argmax(np.abs(shifts))]) if len(shifts) else math.nan,
        left_out=tuple(t.trace for t in touches if not math.isfinite(t.pretravel)),
        starts_differ=any(
            d.count > 1 and d.trigger_range > 3.0 * max(d.pretravel_range, 1e-5) for d in directions
        ),
        probability=probability,
    )


def _direction(name: str, touches: Sequence[RigTouch], probability: float) -> DirectionPerformance:
    pretravel = np.array([t.pretravel for t in touches])
    triggers = np.array([t.r1 for t in touches])
    shifts = np.array([t.hysteresis for t in touches])
    shifts = shifts[np.isfinite(shifts)]
    count = len(touches)
    spread = spread_from(float(np.sum((pretravel - pretravel.mean()) ** 2)), count - 1, probability)
    return DirectionPerformance(
        name=name,
        azimuth=azimuth_of(touches[0].trace),
        count=count,
        pretravel=float(pretravel.mean()),
        u_pretravel=math.nan,  # from all directions' repeats, where there are any
        repeatability=spread,
        pretravel_range=float(np.ptp(pretravel)),
        trigger_range=float(np.ptp(triggers)),
        hysteresis=float(shifts.mean()) if len(shifts) else math.nan,
        u_hysteresis=float(shifts.std(ddof=1)) / math.sqrt(len(shifts))
        if len(shifts) > 1
        else math.nan,
    )


@dataclass(frozen=True)
class LengthComponent:
    """A source of uncertainty with a part that grows with the length measured.

    Attributes
    ----------
    source : str
    evaluation : str
        A or B.
    constant : float
        [mm]
    per_length : float
        Without unit: mm per mm.
    dof : float
    """

    source: str
    evaluation: str
    constant: float = 0.0
    per_length: float = 0.0
    dof: float = math.inf


REN_BUDGET: tuple[LengthComponent, ...] = (
    LengthComponent("probing", "A", 0.034e-3),
    LengthComponent("calibration of probe", "B", 0.030e-3),
    LengthComponent("standard sphere", "B", 0.030e-3),
    LengthComponent("grating scale displacement", "B", 0.020e-3),
    LengthComponent("repeatability at zero position", "A", 0.055e-3),
    LengthComponent("repeatability at trigger position", "A", 0.060e-3),
    LengthComponent("temperature measurement (5 mK)", "B", 0.0, 0.058e-6),
    LengthComponent("temperature distribution (10 mK)", "A", 0.0, 0.115e-6),
    LengthComponent("thermal expansion coefficient (1.0e-6/K)", "B", 0.0, 0.010e-6),
    LengthComponent("cosine error of gauge (0.1 mm / 100 mm)", "B", 0.0, 0.001e-6),
)
"""Ren 2020, Table 2."""


def length_budget(components: Sequence[LengthComponent], length: float) -> Budget:
    """The budget of one length.

    Parameters
    ----------
    components : sequence of LengthComponent
    length : float
        [mm]

    Returns
    -------
    Budget
        In mm. Two parts of one source add up before they are squared.

    References
    ----------
    Ren 2020, Table 2 and equation 18.

    >>> budget = length_budget(REN_BUDGET, 0.0)
    >>> round(2.0 * budget.combined * 1e3, 4)  # U with k = 2, in µm
    0.1998
    """
    if length < 0.0:
        raise PretravelError(f"a length of {length:g} mm: give it as a positive number")
    return Budget(
        tuple(
            Component(c.source, c.evaluation, c.constant + c.per_length * length, dof=c.dof)
            for c in components
        )
    )


def constant_and_slope(components: Sequence[LengthComponent]) -> tuple[float, float]:
    """The two numbers of u(L)² = constant² + (slope L)².

    Returns
    -------
    constant : float
        [mm]
    slope : float
        [mm/mm]

    Raises
    ------
    PretravelError
        A source with both parts, for which this form does not hold.

    >>> [f"{1e3 * number:.3g}" for number in constant_and_slope(REN_BUDGET)]  # µm, µm/mm
    ['0.0999', '0.000129']
    """
    if any(c.constant and c.per_length for c in components):
        raise PretravelError("a source has a constant part and one per length; use length_budget")
    return (
        math.sqrt(math.fsum(c.constant**2 for c in components)),
        math.sqrt(math.fsum(c.per_length**2 for c in components)),
    )


def calibration_budget(
    calibration: RigCalibration,
    components: Sequence[LengthComponent] = REN_BUDGET,
    count: int | None = None,
) -> tuple[LengthComponent, ...]:
    """The rig's budget with this calibration's own repeatability in the place of the told one.

    Parameters
    ----------
    calibration : RigCalibration
    components : sequence of LengthComponent
        Sources called "repeatability at ..." are replaced; all others are the rig's.
    count : int, optional
        Touches of the direction; the fewest of any when not given.

    Returns
    -------
    tuple of LengthComponent
        Of the mean pretravel of one direction. Where edges lie between samples scatters from
        touch to touch, and is in the repeatability; it stands in for it where that is less.
    """
    kept = [c for c in components if not c.source.startswith("repeatability at")]
    spread = calibration.repeatability
    if not math.isfinite(spread.value):
        return tuple(components)
    touches = count or min(d.count for d in calibration.directions)
    readings = [t.u_pretravel for t in calibration.touches if math.isfinite(t.u_pretravel)]
    reading = float(np.mean(readings))
    if spread.value >= reading:
        source, kind, single, dof = "repeatability of pretravel", "A", spread.value, spread.dof
    else:
        source, kind, single, dof = "edges between samples", "B", reading, math.inf
    return (
        *kept,
        LengthComponent(f"{source}, mean of {touches}", kind, single / math.sqrt(touches), dof=dof),
    )


def rig_map(
    calibration: RigCalibration, components: Sequence[LengthComponent], tip_radius: float
) -> PretravelMap:
    """The calibration as a map of the rig's plane, to compensate with.

    Parameters
    ----------
    calibration : RigCalibration
        Azimuths are those of the rod's push on the tip: of surface normals.
    components : sequence of LengthComponent
        Of the rig.
    tip_radius : float
        [mm]

    Returns
    -------
    PretravelMap
        Linear between the directions; each one's repeats are its own error, the rest of the budget
        is common to all.

    Raises
    ------
    PretravelError
        Traces whose names tell no azimuth.
    """
    directions = calibration.directions
    azimuths = np.array([d.azimuth for d in directions])
    if np.any(np.isnan(azimuths)):
        raise PretravelError(
            "a map needs the azimuth of each direction: name the traces …_AZIMUTH_REPEAT.csv"
        )
    support = DirectionSupport(from_angles(np.full(len(azimuths), 0.5 * math.pi), azimuths))
    common = [c for c in components if not c.source.startswith("repeatability at")]
    mean = length_budget(common, abs(calibration.pretravel)).combined
    own = np.array(
        [
            sum(
                c.constant**2
                for c in calibration_budget(calibration, components, d.count)
                if "mean of" in c.source
            )
            for d in directions
        ]
    )
    spread = calibration.repeatability
    known = math.isfinite(spread.value)
    return PretravelMap(
        basis=TabulatedBasis(support),
        coefficients=np.array([d.pretravel for d in directions]),
        covariance=np.diag(own) + mean**2,
        support=support,
        tip_radius=tip_radius,
        repeatability=spread.value if known else 0.0,
        repeatability_dof=spread.dof if known else math.inf,
        feed=float(np.mean([t.feed for t in calibration.touches])),
        provenance={
            "source": "qualified on a calibration rig",
            "touches": f"{sum(d.count for d in directions)} in {len(directions)} directions",
            "gauge": "pretravel is absolute: rod against laser",
        },
    )


def compensated_diameter(
    measured: npt.ArrayLike, first_pretravel: float, second_pretravel: float, taken_off: float
) -> FloatArray:
    """An outer diameter from two opposite touches, with each direction's own pretravel.

    Parameters
    ----------
    measured : (n,) float
        As the machine gives it, with one effective radius for all directions. [mm]
    first_pretravel, second_pretravel : float
        In the two directions. [mm]
    taken_off : float
        Mean pretravel that the machine's effective radius holds already. [mm]

    Returns
    -------
    (n,) float
        [mm]

    References
    ----------
    Ren 2020, Table 1, does this with an amount that its equations do not give
    (docs/validation.md).

    >>> float(compensated_diameter(29.9852, 0.0035, 0.0032, 0.0030).round(4))
    29.9859
    """
    return np.asarray(
        np.asarray(measured, dtype=np.float64)
        + first_pretravel
        + second_pretravel
        - 2.0 * taken_off
    )
