"""The result of a probing test of a standard, and the reference sphere of the test."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    REFERENCE_DIAMETER,
    UNCERTAINTY,
    FloatArray,
    PretravelError,
    check_numbers,
    checked,
)
from pretravel.laboratory.standards.tip_offset import TipOffset
from pretravel.maps import PretravelMap
from pretravel.measurement import apply
from pretravel.touches import Touches
from pretravel.uncertainty import (
    COVERAGE_FACTOR,
    Budget,
    Component,
    SphereFit,
)

ALONG_Z = (0.0, 0.0, 1.0)
"""The axis of a probe along the z axis of the machine."""

UNCHECKED, COMPARED = "unchecked", "compared"
"""The status of a definition that was not compared with the text of its standard; and of one that a
laboratory states to have compared."""
FORM_OF_REFERENCE = "form error of the reference"
DIAMETER_OF_REFERENCE = "calibration of the reference's diameter"
"""Sources of the uncertainty of test values."""
RANGE_AS_DEFINED = (
    "by definition, the probing error of form is the range of these touches, which contains their "
    "noise and differs from run to run"
)
"""A note of tests whose figure is the range of residuals."""
U_WITHOUT_NOISE = "; u of the test value does not contain this"
"""The same where u is given."""


class LimitOutcome(Enum):
    """What the comparison of a figure with its limit gives."""

    NO_LIMIT = "no limit given"
    WITHIN = "within the limit"
    EXCEEDS = "exceeds the limit"
    UNDECIDED = "undecided within U"


@dataclass(frozen=True)
class CalibratedSphere:
    """The reference sphere of a test.

    Attributes
    ----------
    diameter : float
        [mm]
    u_diameter : float or None
        Standard uncertainty of the diameter; None where it is not stated. [mm]
    form : float or None
        Form error; None where it is not stated. [mm]
    """

    diameter: float
    u_diameter: float | None = None
    form: float | None = None

    def __post_init__(self) -> None:
        checked(self.diameter, "the sphere's diameter", REFERENCE_DIAMETER, inputs=("diameter",))
        check_numbers(self, u_diameter=UNCERTAINTY, form=UNCERTAINTY)

    @property
    def u_of_form(self) -> float | None:
        """Standard uncertainty of a form error's test value (ISO/TS 23165, unchecked). [mm]"""
        return None if self.form is None else 0.5 * self.form


@dataclass(frozen=True)
class StandardFigure:
    """One quantity that a standard defines.

    Attributes
    ----------
    name : str
        The name in the standard, as far as known.
    meaning : str
    value : float
        [mm]
    u_test : float or None
        Standard uncertainty of the test value, from the reference's calibration; None where that
        is not stated. [mm]
    limit : float or None
        Maximum permissible error, where one was given. [mm]
    status : str
        ``verified``, ``unchecked`` or ``compared``, of the definition used here.
    u_source : str
        Where `u_test` comes from, in words; empty where the reference does not matter.
    components : tuple of Component
        The parts of `u_test`, where it does not come from the reference alone. [mm]
    """

    name: str
    meaning: str
    value: float
    u_test: float | None
    limit: float | None
    status: str
    u_source: str = ""
    components: tuple[Component, ...] = ()

    @property
    def coverage(self) -> float:
        """The factor k of U: 2, or more where the uncertainty has few degrees of freedom."""
        budget = self.budget if self.components else None
        return COVERAGE_FACTOR if budget is None else budget.coverage_factor()

    @property
    def outcome(self) -> LimitOutcome:
        """By the rule of ISO 14253-1: a decision needs a value outside the uncertainty zone.

        Where no uncertainty is stated, the value alone is compared with the limit.
        """
        if self.limit is None:
            return LimitOutcome.NO_LIMIT
        expanded = self.coverage * (self.u_test or 0.0)
        if abs(self.value) <= self.limit - expanded:
            return LimitOutcome.WITHIN
        if abs(self.value) > self.limit + expanded:
            return LimitOutcome.EXCEEDS
        return LimitOutcome.UNDECIDED

    @property
    def verdict(self) -> str:
        """The outcome in words, with what it lacks."""
        words = str(self.outcome.value)
        if self.outcome is LimitOutcome.UNDECIDED:
            return f"{words} (k = {self.coverage:.3g})"
        lacks_u = self.limit is not None and self.u_test is None
        return words + (", u not given" if lacks_u else "")

    @property
    def budget(self) -> Budget | None:
        """Of the test value, in mm; None where no uncertainty is stated, or none matters."""
        if self.components:
            return Budget(self.components, self.name)
        if self.u_test is None or not self.u_source:
            return None
        return Budget((Component(self.u_source, "B", self.u_test),), self.name)


@dataclass(frozen=True, eq=False)
class FittedSet:
    """Points of touches with the sphere or circle through them.

    Attributes
    ----------
    name : str
        What the set is, in a few words.
    fit : SphereFit
    places : (n, d) float
        The points as they were fitted: d = 3 for a sphere, 2 for a circle. [mm]
    limit : float or None
        Maximum permissible range of the residuals, where one was given. [mm]
    frame : {"machine", "probe"}
        Whose axes the places have.
    """

    name: str
    fit: SphereFit
    places: FloatArray
    limit: float | None = None
    frame: Literal["machine", "probe"] = "machine"


@dataclass(frozen=True, eq=False)
class StandardCheck:
    """The quantities of a standard, from touches on a reference sphere.

    Attributes
    ----------
    standard : str
    figures : tuple of StandardFigure
    sets : tuple of FittedSet
        One for each fit: runs of a pattern, of which the figures state the worst, or tests.
    notes : tuple of str
    tip_offset : TipOffset or None
        Where the test determines it.
    """

    standard: str
    figures: tuple[StandardFigure, ...]
    sets: tuple[FittedSet, ...]
    notes: tuple[str, ...]
    tip_offset: TipOffset | None = None

    @property
    def why_no_conformity(self) -> tuple[str, ...]:
        """Why this is not a statement of conformity to the standard; empty where it is one."""
        reasons = []
        if any(figure.status == UNCHECKED for figure in self.figures):
            reasons.append(
                "the definitions were written without the text of the standard and have not been "
                "checked against it"
            )
        if any(f.limit is not None and f.u_test is None for f in self.figures):
            reasons.append("the uncertainty of the reference is not given")
        return tuple(reasons)

    def compared(self) -> StandardCheck:
        """The same where a laboratory states that it compared the definitions with the text."""
        figures = (
            replace(figure, status=COMPARED) if figure.status == UNCHECKED else figure
            for figure in self.figures
        )
        return replace(self, figures=tuple(figures))

    @property
    def budgets(self) -> tuple[Budget, ...]:
        """Of the test values whose uncertainty is stated."""
        return tuple(f.budget for f in self.figures if f.budget is not None)


class StandardProcedure(Protocol):
    """The evaluation of a standard."""

    def __call__(
        self,
        touches: Touches,
        sphere: CalibratedSphere,
        *,
        tip_diameter: float | None = None,
        pretravel_map: PretravelMap | None = None,
        axis: npt.ArrayLike = ALONG_Z,
        limits: Mapping[str, float] | None = None,
    ) -> StandardCheck: ...


@dataclass(frozen=True)
class Standard:
    """A standard whose probing test can be evaluated.

    Attributes
    ----------
    procedure : StandardProcedure
        The evaluation.
    limits : frozenset of str
        Names of the maximum permissible errors that it compares.
    uses : frozenset of str
        What it uses that others do not: u_diameter, sphere_form, map, spindle, ring.
    patterns : mapping of str to callable
        Directions of the touches, (n, 3), by the name of the pattern: that of the standard, and
        others for other readings of it.
    """

    procedure: StandardProcedure
    limits: frozenset[str] = frozenset()
    uses: frozenset[str] = frozenset()
    patterns: Mapping[str, Callable[[], FloatArray]] = field(default_factory=dict)


def refuse_turned_spindle(touches: Touches) -> None:
    """Refuse touches at several orientations of the spindle, where a test needs one.

    Raises
    ------
    PretravelError
        The tip may be elsewhere at each orientation, and the probe is turned.
    """
    if touches.spindle is None:
        return
    found = sorted({round(float(angle) / DEGREE % 360.0, 3) for angle in touches.spindle})
    if len(found) > 1:
        shown = ", ".join(f"{angle:g}°" for angle in found[:8]) + (" …" if found[8:] else "")
        raise PretravelError(
            f"the touches were made at {len(found)} orientations of the spindle ({shown}); this "
            "test needs touches at one. Only the test of the stylus-tip offset uses several"
        )


_SPREAD_NORMALS = 0.5  # range of a component of the normals, which is up to 2 on a sphere
_OTHER_UNIT = (0.1, 5.0)
"""Spreads of the touches, in diameters of the sphere, beyond which the unit is another one."""


def refuse_other_unit(touches: Touches, sphere: CalibratedSphere) -> None:
    """Refuse touches whose spread does not fit the sphere: inches taken for mm, or the reverse.

    Touches on a sphere spread over about its diameter and that of the tip; an inch is 25.4 mm.
    """
    if float(np.ptp(touches.normals, axis=0).max()) < _SPREAD_NORMALS:
        return  # touches in one direction: their places do not show the sphere
    distance = np.abs(touches.positions - np.median(touches.positions, axis=0))
    spread = 2.0 * float(np.quantile(distance.max(axis=1), 0.9))  # one stray touch does not count
    least, most = _OTHER_UNIT
    if least * sphere.diameter <= spread <= most * sphere.diameter:
        return
    small = spread < sphere.diameter
    raise PretravelError(
        f"the touches spread over {spread:.4g} mm, on a sphere of {sphere.diameter:g} mm: the "
        + (
            "coordinates look like inches; give the unit inch"
            if small
            else "coordinates look like mm that were taken as inches; give the unit mm"
        ),
        inputs=("units", "diameter"),
    )


def surface_points(
    touches: Touches, tip_diameter: float | None, pretravel_map: PretravelMap | None
) -> FloatArray:
    """Tip centres moved to the surface, by one radius as a machine does, or by a map, (n, 3)."""
    if pretravel_map is not None:
        return apply(touches, pretravel_map).positions
    return np.asarray(touches.positions - 0.5 * (tip_diameter or 0.0) * touches.normals)
