"""The result of a qualification, the touches that it was made from, and its uncertainty budgets."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from pretravel.base import (
    MICROMETRE,
    STEEL_EXPANSION,
    BoolArray,
    FloatArray,
    IntArray,
    ShownInNotebooks,
    WithPlot,
    describe,
)
from pretravel.maps import (
    USUAL_U_DIAMETER,
    HarmonicMapFit,
    KindOfMap,
    MapFit,
    Observation,
    PretravelMap,
    QualificationSetup,
)
from pretravel.qualification.delay import SignalDelay
from pretravel.qualification.machine_effects import MachineEffects
from pretravel.qualification.map_warnings import before_contact
from pretravel.qualification.outliers import Outlier
from pretravel.touches import COARSE_STEP, Touches
from pretravel.uncertainty import Budget, Component

GOOD_PROBE = 0.5 * MICROMETRE
"""Standard deviation of a touch up to which a probe is called good: makers state 0.5 µm. [mm]"""
POOR_PROBE = 1.5 * MICROMETRE
"""Standard deviation of a touch from which a probe is called poor. [mm]"""
_USUAL_DIRECTIONS = 25
_UNEVEN = 3.0  # largest u over the mean one from which a direction is proposed
Grade: TypeAlias = Literal["good", "usable", "poor"]


@dataclass(frozen=True, eq=False)
class PreparedTouches:
    """Touches on a reference that a map can be fitted to.

    Attributes
    ----------
    touches : Touches
        All, at rest and without the machine's part.
    setup : QualificationSetup
    rotation : (3, 3) float
        Probe to machine frame.
    whole : Observation
        Of all touches.
    observation : Observation
        Of the touches that are used, about the same centre.
    used : (n,) bool
        False for touches that are left out as gross errors.
    outliers : tuple of Outlier
    detail : HarmonicMapFit or None
        From the search of outliers: harmonic fits begin there.
    effects : MachineEffects
    delay : SignalDelay or None
    warnings : tuple of str
    digests : str
        Of the touches that are used, as the machine latched them.
    """

    touches: Touches
    setup: QualificationSetup
    rotation: FloatArray
    whole: Observation
    observation: Observation
    used: BoolArray
    outliers: tuple[Outlier, ...]
    detail: HarmonicMapFit | None
    effects: MachineEffects
    delay: SignalDelay | None
    warnings: tuple[str, ...]
    digests: str


@dataclass(frozen=True, eq=False)
class KindScore:
    """How well one kind of map predicts directions that were left out of its fit.

    Attributes
    ----------
    kind : str
    rms : float
        Root mean square of the distances of left-out directions from the reference. [mm]
    u_rms : float
        Standard error of that, from the scatter over directions. [mm]
    reduced_chi_square : float
        Mean of (distance / stated uncertainty)², near one where u is right.
    logarithmic_score : float
        Mean of ln(u / µm) + (distance / u)² / 2 over directions: it rewards a small distance and
        a correct uncertainty. Smaller is better.
    weight : float
        Share of this kind in the average.
    problem : str
        Why this kind cannot be fitted, or not without some of the directions; empty where it can.
    """

    kind: str
    rms: float
    u_rms: float
    reduced_chi_square: float
    logarithmic_score: float
    weight: float = 0.0
    problem: str = field(default="")


@dataclass(frozen=True, eq=False)
class Qualification(ShownInNotebooks, WithPlot):
    """The result of touches on a reference sphere or ring.

    Attributes
    ----------
    pretravel_map : PretravelMap
    setup : QualificationSetup
        Reference and conventions of the qualification.
    kind : KindOfMap
    center : (3,) float
        Of the reference, in the convention of `qualify`; on a ring the coordinate
        along the axis is the mean of the touches. [mm]
    center_covariance : (3, 3) float
        Zero along a ring's axis, where the centre is not measured. [mm²]
    own_center_covariance : (3, 3) float
        The same by the kind of `fit` alone, without how the kinds of an average differ. [mm²]
    effective_radius : float
        Tip radius less mean pretravel, from the least-squares sphere. [mm]
    u_effective_radius : float
        [mm]
    residuals : (n,) float
        Observed pretravel less the map's, at each touch, also of those that were left out. [mm]
    degrees_of_freedom : float
        Touches less (effective) parameters.
    repeatability : float
        Standard deviation of a touch among repeats of its direction; of the residuals
        without repeats, and where a physical model leaves scatter alone. [mm]
    repeatability_dof : float
    observed : (n,) float
        Pretravel of each touch about the fitted centre. [mm]
    contact_normals : (n, 3) float
        Machine frame.
    groups : (n,) int
        Which touches repeat each other's direction.
    used : (n,) bool
        False for touches that were left out as gross errors.
    outliers : tuple of Outlier
    effect_of_outliers : float
        Largest change of the map if the touches that were left out were kept. [mm]
    effects : MachineEffects
        What the machine adds to the touches.
    delay : SignalDelay or None
        Where several feeds separated it; `observed` and the map are then those at rest.
    fit : MapFit
        What the kind of map reports about its fit.
    warnings : tuple of str
        What to know before the result is used.
    scores : tuple of KindScore
        Where kinds were compared, how each predicts left-out directions: the largest weight first.
    copies : int
        Touches that are alike with others of their direction to the last digit: no repeats.
    """

    pretravel_map: PretravelMap
    setup: QualificationSetup
    kind: KindOfMap
    center: FloatArray
    center_covariance: FloatArray
    own_center_covariance: FloatArray
    effective_radius: float
    u_effective_radius: float
    residuals: FloatArray
    degrees_of_freedom: float
    repeatability: float
    repeatability_dof: float
    observed: FloatArray
    contact_normals: FloatArray
    groups: IntArray
    used: BoolArray
    outliers: tuple[Outlier, ...]
    effect_of_outliers: float
    effects: MachineEffects
    delay: SignalDelay | None
    fit: MapFit
    warnings: tuple[str, ...]
    scores: tuple[KindScore, ...] = ()
    copies: int = 0

    @property
    def explained_share(self) -> float:
        """R²: share of the touches' variance of pretravel that the map explains.

        Negative where the map is worse than their mean; nan where all touches are alike.
        """
        observed, left = self.observed[self.used], self.residuals[self.used]
        total = float(np.sum((observed - observed.mean()) ** 2))
        return 1.0 - float(np.sum(left**2)) / total if total > 0.0 else math.nan

    @property
    def hidden_by_step(self) -> bool:
        """Whether repeats differ by less than the step of the positions, and say little."""
        step = self.effects.step
        return step >= COARSE_STEP and self.repeatability < 0.5 * step

    @property
    def before_contact(self) -> str:
        """A sentence where the map has the probe trigger before contact; else empty."""
        return before_contact(self.pretravel_map, self.fit.observation)

    @property
    def grade(self) -> Grade | None:
        """Grade of the probe by the scatter of a single touch; None where it is not known.

        Repeats do not show it, or the map is not one of a probe.

        Good is up to 0.5 µm, which makers of probes state; poor is above 1.5 µm.
        """
        repeated = self.fit.observation.repeats.dof > 0.0 and not self.copies
        if not repeated or self.hidden_by_step or self.before_contact:
            return None
        size = self.pretravel_map.single_touch
        return "good" if size <= GOOD_PROBE else "usable" if size <= POOR_PROBE else "poor"

    @property
    def next_step(self) -> str:
        """What improves the map most; empty where the map is ready for use."""
        made, observation = self.pretravel_map, self.fit.observation
        if self.outliers:
            left = all(each.left_out for each in self.outliers)
            then = ", which the map leaves out" if left else ", or exclude these touches"
            return f"touch the places of the outliers again{then}"
        if self.effects.step >= COARSE_STEP:
            return "write the positions with more digits, then touch and qualify again"
        if observation.direction_count < _USUAL_DIRECTIONS and not observation.ring:
            return f"touch {_USUAL_DIRECTIONS} directions, three times each, for a smaller u"
        if made.single_touch > POOR_PROBE and not observation.repeats.dof:
            return "touch each direction three times, which shows whether touches scatter"
        if made.single_touch > POOR_PROBE:
            return "find out why touches scatter: loose stylus, vibration, dirt, a worn probe"
        directions, _, u = made.over_support()
        if u.max() > _UNEVEN * np.sqrt(np.mean(u**2)) and u.max() > made.single_touch:
            worst = describe(directions[int(np.argmax(u))])
            return f"also touch {worst}, where u of the map is largest"
        return ""

    def __repr__(self) -> str:
        out = int((~self.used).sum())
        return (
            f"Qualification({self.pretravel_map.kind}; {len(self.used):,} touches, {out} left out; "
            f"effective radius {self.effective_radius:.4f} mm; "
            f"repeatability {self.repeatability / MICROMETRE:.2f} µm; "
            f"{len(self.warnings)} warnings)"
        )

    def part_point_budget(self) -> Budget:
        """The budget of a point on a part, in the directions of the map on average.

        Returns
        -------
        Budget
            In mm: scatter of a touch, map (root mean square over its directions), reference.
        """
        made = self.pretravel_map
        u_map = float(np.sqrt(np.mean(made.over_support()[2] ** 2)))
        return Budget(
            _stated(
                Component("repeatability", "A", made.repeatability, dof=_dof(self)),
                Component("fixed scatter", "B", made.fixed_scatter),
                Component("map", "B", u_map),
                *_of_reference(self),
            ),
            "a point on a part, rms over the map",
        )

    def radius_budget(self) -> Budget:
        """The budget of the effective radius of the tip.

        Returns
        -------
        Budget
            In mm: touches, reference and, where several feeds separated it, signal delay.
        """
        known = (Component("touches", "A", self.fit.u_mean, dof=_dof(self)), *_of_reference(self))
        rest = self.u_effective_radius**2 - math.fsum(part.contribution**2 for part in known)
        delay = 0.0 if self.delay is None else math.sqrt(max(rest, 0.0))
        return Budget(_stated(*known, Component("signal delay", "B", delay)), "effective radius")


def _of_reference(result: Qualification) -> tuple[Component, ...]:
    """Calibration and temperature of the reference; a radius has half of its diameter's error."""
    setup = result.setup
    calibrated = USUAL_U_DIAMETER if setup.u_diameter is None else setup.u_diameter
    stated = "" if setup.u_diameter is not None else " (assumed)"
    warm = STEEL_EXPANSION * setup.diameter * setup.u_temperature
    return (
        Component(f"diameter of the reference{stated}", "B", calibrated, 0.5),
        Component("temperature of the reference", "B", warm, 0.5),
    )


def _dof(result: Qualification) -> float:
    return result.repeatability_dof if result.repeatability_dof > 0.0 else math.inf


def _stated(*components: Component) -> tuple[Component, ...]:
    """The sources that are not zero."""
    return tuple(component for component in components if component.contribution > 0.0)
