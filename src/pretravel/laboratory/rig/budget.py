"""Uncertainty budgets of a calibration rig."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, PretravelError
from pretravel.laboratory.rig.calibration import DirectionPerformance, RigCalibration
from pretravel.uncertainty import COVERAGE_FACTOR, Budget, Component, coverage_factor


@dataclass(frozen=True)
class LengthComponent:
    """A source of uncertainty with a constant part and a part proportional to the length.

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
        Degrees of freedom.
    repeatability : bool
        Whether the repeats of a calibration replace this source.
    thermal : bool
        Whether `thermal_components` replace this source.
    remark : str
        For people.
    """

    source: str
    evaluation: str
    constant: float = 0.0
    per_length: float = 0.0
    dof: float = math.inf
    repeatability: bool = False
    thermal: bool = False
    remark: str = ""


_SMALLEST_OF_A_RIG = 1e-6
_LARGEST_OF_A_RIG = 1e-3
"""Standard uncertainty of a whole rig; Ren's has 0.058 µm without its repeatability. [mm]"""
_EXPANDED = re.compile(
    r"\bk\s?=\s?(?!1(?:[.,]0*)?(?![.,\d]))\d|\b(?:expanded|erweitert\w*|rectang\w*|triang\w*|u-shaped|"
    r"half.?widths?|divisor|sensitiv\w*|correlat\w*|nm)\b|±|\d\s?%",
    re.IGNORECASE,
)
_CONVERTED = re.compile(
    r"divid|÷|/\s?(?:√|sqrt|[23k]\b)|geteilt|convert|standard (?:uncert|deviat)", re.IGNORECASE
)
"""Words of a source that has to be converted to a standard uncertainty, and of a converted one."""
_OF_TEMPERATURE = re.compile(r"temperatur|thermal|expansion|thermisch|ausdehnung", re.IGNORECASE)
REN_BUDGET: tuple[LengthComponent, ...] = (
    LengthComponent("probing", "A", 0.034e-3),
    LengthComponent("calibration of probe", "B", 0.030e-3),
    LengthComponent("standard sphere", "B", 0.030e-3),
    LengthComponent("grating scale displacement", "B", 0.020e-3),
    LengthComponent("repeatability at zero position", "A", 0.055e-3, repeatability=True),
    LengthComponent("repeatability at trigger position", "A", 0.060e-3, repeatability=True),
    LengthComponent("temperature measurement (5 mK)", "B", 0.0, 0.058e-6, thermal=True),
    LengthComponent("temperature distribution (10 mK)", "A", 0.0, 0.115e-6),
    LengthComponent("thermal expansion coefficient (1.0e-6/K)", "B", 0.0, 0.010e-6, thermal=True),
    LengthComponent("cosine error of gauge (0.1 mm / 100 mm)", "B", 0.0, 0.001e-6),
)
"""Ren 2020, Table 2."""


def abbe_error(offset: float, tilt: float) -> float:
    """Compute the Abbe error of a length: the scale is not in line with it.

    Parameters
    ----------
    offset : float
        Abbé offset: distance of the scale from the line of measurement. [mm]
    tilt : float
        Turn of the guide between both ends of the length. [rad]

    Returns
    -------
    float
        Length at the scale less the measured length. [mm]

    References
    ----------
    Ren 2020, equation 1 and Figure 1, which give the difference but not its size.

    >>> round(abbe_error(10.0, 2e-6) * 1e6, 3)  # nm
    20.0
    """
    return offset * math.tan(tilt)


def abbe_component(offset: float, u_tilt: float) -> LengthComponent:
    """The line of a budget for the Abbé error.

    Parameters
    ----------
    offset : float
        [mm]
    u_tilt : float
        Standard uncertainty of the turn of the guide over the travel. [rad]

    Raises
    ------
    PretravelError
        A tilt that is negative or smaller than any guide's.

    >>> abbe_component(10.0, 2e-6).source
    'Abbé error (10 mm, 2 µrad)'
    """
    if u_tilt < 0.0 or 0.0 < u_tilt < _SMALLEST_TILT:
        raise PretravelError(
            f"the standard uncertainty of the guide's tilt is {u_tilt * 1e6:g} µrad: it is not "
            "negative, and that of a good guide is about 1 µrad. 1 arc second is 4.85 µrad",
            inputs=("abbe",),
        )
    return LengthComponent(
        f"Abbé error ({offset:g} mm, {u_tilt * 1e6:g} µrad)", "B", abs(abbe_error(offset, u_tilt))
    )


_SMALLEST_TILT = 1e-8
"""[rad]"""
_EXPANSION = 1e-3
"""More than that of any solid. [1/K]"""
_FROM_20 = 100.0
"""Of a laboratory. [K]"""


def thermal_components(
    *, expansion: float, deviation: float, u_expansion: float, u_temperature: float
) -> tuple[LengthComponent, LengthComponent]:
    """Make the lines of a budget for temperature and thermal expansion of the scale.

    Parameters
    ----------
    expansion, u_expansion : float
        Coefficient of the scale and its standard uncertainty. [1/K]
    deviation, u_temperature : float
        Temperature of the scale less 20 °C, and its standard uncertainty. [K]

    Returns
    -------
    two LengthComponent

    Raises
    ------
    PretravelError
        Numbers of another unit.

    References
    ----------
    Ren 2020, equation 17: u(α)² (ΔT L0)² + u(ΔT)² (α L0)²; and u(α)² u(ΔT)² L0², the rest of the
    variance of the product α ΔT. At 20 °C it is all that the expansion contributes.

    >>> lines = thermal_components(expansion=11.5e-6, deviation=0.01, u_expansion=1e-6,
    ...                            u_temperature=0.005)
    >>> [f"{line.per_length * 1e6:.3f}" for line in lines]  # µm/m
    ['0.057', '0.011']
    """
    for name, value in (("expansion", expansion), ("its uncertainty", u_expansion)):
        if not abs(value) <= _EXPANSION:
            raise PretravelError(
                f"thermal expansion of the scale: {name} is {value:g} 1/K. Was 1e-6/K meant? Steel "
                "has 11.5e-6"
            )
    if not abs(deviation) <= _FROM_20:
        raise PretravelError(
            f"the scale is {deviation:g} K from 20 °C: was the temperature itself meant?"
        )
    return (
        LengthComponent(
            f"temperature of the scale (u {u_temperature:g} K)", "B", 0.0,
            abs(expansion) * u_temperature, thermal=True,
        ),
        LengthComponent(
            f"thermal expansion of the scale (u {u_expansion * 1e6:g}e-6/K)", "B", 0.0,
            math.hypot(deviation, u_temperature) * u_expansion, thermal=True,
        ),
    )  # fmt: skip


def length_budget(components: Sequence[LengthComponent], length: float) -> Budget:
    """The budget of one measured length.

    Parameters
    ----------
    components : sequence of LengthComponent
    length : float
        [mm]

    Returns
    -------
    Budget
        In mm. The two parts of one source are added before they are squared.

    References
    ----------
    Ren 2020, Table 2 and equation 18.

    >>> budget = length_budget(REN_BUDGET, 0.0)
    >>> round(2.0 * budget.combined * 1e3, 4)  # U with k = 2, in µm
    0.1998
    """
    if length < 0.0:
        raise PretravelError(f"the length is {length:g} mm; it must not be negative")
    return Budget(
        tuple(
            Component(c.source, c.evaluation, c.constant + c.per_length * length, dof=c.dof)
            for c in components
        )
    )


def constant_and_slope(components: Sequence[LengthComponent]) -> tuple[float, float]:
    """Constant and slope of u(L)² = constant² + (slope L)².

    Returns
    -------
    constant : float
        [mm]
    slope : float
        [mm/mm]

    Raises
    ------
    PretravelError
        A source with both parts; this form does not hold for it.

    >>> [f"{1e3 * number:.3g}" for number in constant_and_slope(REN_BUDGET)]  # µm, µm/mm
    ['0.0999', '0.000129']
    """
    if any(c.constant and c.per_length for c in components):
        raise PretravelError(
            "a source has both a constant part and a part per length, which cannot be combined "
            "into one constant and one slope: give each part as a source"
        )
    return (
        math.sqrt(math.fsum(c.constant**2 for c in components)),
        math.sqrt(math.fsum(c.per_length**2 for c in components)),
    )


def calibration_budget(
    calibration: RigCalibration,
    components: Sequence[LengthComponent] = REN_BUDGET,
    count: int | None = None,
    *,
    direction: DirectionPerformance | None = None,
) -> tuple[LengthComponent, ...]:
    """The budget of a rig with the repeatability that a calibration determined.

    Parameters
    ----------
    calibration : RigCalibration
    components : sequence of LengthComponent
        Sources that are a `repeatability` are replaced; all others are the rig's.
    count : int, optional
        Number of touches of the direction; the fewest of any direction when not given.
    direction : DirectionPerformance, optional
        Whose number of touches, and own scatter where it is larger, count.

    Returns
    -------
    tuple of LengthComponent
        Of the mean pretravel of one direction.
    """
    count = count or min(d.count for d in calibration.directions)
    own = own_repeatability(calibration, count if direction is None else direction)
    stated = (*components, *shared_by_directions(calibration))
    return stated if own is None else (*rig_sources(stated), own)


def shared_by_directions(calibration: RigCalibration) -> tuple[LengthComponent, ...]:
    """The lines of what repeats and directions can have in common: coarse step, passes."""
    found = []
    if calibration.u_step:
        name = f"step of the ruler ({calibration.step / MICROMETRE:.4g} µm)"
        found.append(LengthComponent(name, "B", calibration.u_step))
    if calibration.passes is not None:
        name = f"differences of {len(calibration.passes.numbers)} passes"
        found.append(LengthComponent(name, "A", calibration.passes.u))
    return tuple(found)


def rig_sources(components: Sequence[LengthComponent]) -> tuple[LengthComponent, ...]:
    """The sources of the rig alone, without repeatability."""
    return tuple(c for c in components if not c.repeatability)


def budget_doubts(components: Sequence[LengthComponent]) -> tuple[str, ...]:
    """What in the budget of a rig states hardly any uncertainty, as sentences.

    >>> budget_doubts((LengthComponent("laser", "B", 0.05e-6), LengthComponent("ruler", "B")))[0]
    "the budget has no uncertainty for 'ruler': 0 or empty"
    >>> budget_doubts(REN_BUDGET)
    ()
    """
    rig = rig_sources(components)
    found = []
    if empty := [f"'{c.source}'" for c in rig if not c.constant and not c.per_length]:
        found.append(f"the budget has no uncertainty for {', '.join(empty)}: 0 or empty")
    combined = length_budget(rig, 0.0).combined
    size = f"u = {combined / MICROMETRE:.2g} µm together"
    if combined < _SMALLEST_OF_A_RIG:
        found.append(
            f"the sources of the rig in the budget have {size}, less than any rig: are they "
            "standard uncertainties, and in µm?"
        )
    if combined > _LARGEST_OF_A_RIG:
        found.append(
            f"the sources of the rig in the budget have {size}, too much to measure the pretravel "
            "of a probe: are they in µm?"
        )
    if again := [f"'{c.source}'" for c in rig if "repeatab" in c.source.casefold()]:
        found.append(
            f"{', '.join(again)} of the budget counts in addition to the repeatability of the "
            "traces: a name that begins with 'repeatability at' is replaced"
        )
    if other := [f"'{words}'" for c in components if _is_expanded(words := _words(c))]:
        found.append(
            f"the budget says {', '.join(other)}: its numbers are taken as standard uncertainties "
            "of the length in µm (k = 1), independent of each other. Convert them, or write "
            "'converted' in the remark"
        )
    return tuple(found)


def counted_twice(components: Sequence[LengthComponent]) -> tuple[str, ...]:
    """Sources of a budget that can be those of `thermal_components`, as a sentence.

    Parameters
    ----------
    components : sequence of LengthComponent
        With the lines of `thermal_components`.

    >>> counted_twice((LengthComponent("ruler temperature", "B", 0.0, 6e-8),))[0][:44]
    "'ruler temperature' of the budget counts in "
    """
    more = [f"'{c.source}'" for c in components if not c.thermal and _is_thermal(c.source)]
    if not more:
        return ()
    said = f"{', '.join(more)} of the budget counts in addition to the uncertainties of "
    return (f"{said}temperature and expansion that are given: leave out what is there twice",)


def _is_thermal(source: str) -> bool:
    """Whether a source is of the temperature of the scale, not of its differences in space."""
    return bool(_OF_TEMPERATURE.search(source)) and not re.search("distrib|gradient", source)


def _is_expanded(words: str) -> bool:
    return bool(_EXPANDED.search(words)) and not _CONVERTED.search(words)


def _words(component: LengthComponent) -> str:
    """Source and remark of a line."""
    return f"{component.source}, {component.remark}" if component.remark else component.source


def own_repeatability(
    calibration: RigCalibration, of: int | DirectionPerformance
) -> LengthComponent | None:
    """The repeatability of the mean of some touches, or of a direction; None where nothing shows
    it.

    The position of edges between samples scatters from touch to touch and is part of the
    repeatability. Where the expanded uncertainty from few repeats is below that of this part, this
    part is the source.
    """
    count, spread = (of if isinstance(of, int) else of.count), calibration.repeatability
    if not isinstance(of, int) and of.scatters_more:
        spread = of.repeatability
    if not math.isfinite(spread.value):
        return None
    edges = float(
        np.mean([t.u_pretravel for t in calibration.touches if math.isfinite(t.u_pretravel)])
    )
    if coverage_factor(spread.dof) * spread.measured >= COVERAGE_FACTOR * edges:
        source = "scatter about three equal lobes" if spread.of_lobes else "repeatability"
        source, kind, single, dof = f"{source} of pretravel", "A", spread.measured, spread.dof
    else:
        source, kind, single, dof = "edges between samples", "B", edges, math.inf
    return LengthComponent(
        f"{source}, mean of {count}", kind, single / math.sqrt(count), dof=dof, repeatability=True
    )


def repeatability_doubts(
    calibration: RigCalibration, components: Sequence[LengthComponent]
) -> tuple[str, ...]:
    """What the calibration does not show of the repeatability of its touches, as sentences.

    Parameters
    ----------
    calibration : RigCalibration
    components : sequence of LengthComponent
        Budget of the rig.
    """
    spread = calibration.repeatability
    found = [] if calibration.passes is None else [calibration.passes.sentence]
    if rough := [d.name for d in calibration.directions if d.scatters_more]:
        found.append(
            f"touches of {', '.join(rough)} scatter more than those of other directions: u there "
            "is from their own repeats. Is a seat worn or dirty?"
        )
    if spread.of_lobes:
        shown = (
            "no direction was touched twice: the repeatability, "
            f"{spread.value / MICROMETRE:.2g} µm, follows from the residuals of three equal lobes, "
            "and is too large if the lobes differ. Repeat some directions"
        )
        return (shown,)
    if math.isfinite(spread.value):
        return tuple(found)
    stated = length_budget([c for c in components if c.repeatability], 0.0).combined
    unknown = (
        "nothing was repeated, and the directions do not show the scatter of a touch: the "
        f"repeatability is that of the budget, {stated / MICROMETRE:.2g} µm, not of this probe. "
        "Repeat some directions"
    )
    return (unknown,)
