"""How a map was made: typed, so that no decision depends on the words of a sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from enum import Enum
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEVIATION_OF_FORM,
    LARGEST_PRETRAVEL,
    MICROMETRE,
    REFERENCE_DIAMETER,
    STEEL_EXPANSION,
    TEMPERATURE_DIFFERENCE,
    TIP_BALL,
    U_OF_DIAMETER,
    FloatArray,
    PretravelError,
    QuantityRange,
    check_numbers,
    checked,
)
from pretravel.uncertainty import Covariance

AXIAL_PRETRAVEL = 1.0 * MICROMETRE
"""Pretravel along the probe axis that a harmonic map is given where nothing better is known. [mm]

Along its axis a probe is stiff: the seats, the stylus and the tip contact of an OMP40-2 deflect by
1.2 um."""


USUAL_U_DIAMETER = 0.2 * MICROMETRE
"""Standard uncertainty of a calibrated diameter where none is given: U = 0.4 µm, k = 2. [mm]"""
USUAL_U_TEMPERATURE = 0.2
"""Standard uncertainty of a reference's temperature near 20 °C, in a usual workshop. [K]"""
USUAL_SPHERE_FORM = 0.13 * MICROMETRE
"""Deviation from spherical form of a grade 5 ball (ISO 3290-1). [mm]"""


_AXIAL = QuantityRange(-LARGEST_PRETRAVEL, LARGEST_PRETRAVEL, "mm")
U_AXIAL_PRETRAVEL = 0.7 * MICROMETRE
"""Standard uncertainty of that assumption: probes have 0.3 to 2.5 µm along the axis. [mm]"""


class Origin(Enum):
    """Where a map comes from."""

    QUALIFIED = "qualified"
    """Touches on a reference sphere or ring."""
    PREDICTED = "predicted"
    """The description of a probe."""
    CALIBRATED = "calibrated"
    """Traces of a calibration rig."""
    MADE = "made"
    """A program of the user's own."""


class SetupOptions(TypedDict, total=False):
    """Fields of `QualificationSetup` in addition to the diameter, as keywords of `qualify`."""

    tip_diameter: float | None
    ring: bool
    u_diameter: float | None
    u_temperature: float
    sphere_form: float
    axial_pretravel: float | None
    axis: npt.ArrayLike
    search_outliers: bool


@dataclass(frozen=True)
class QualificationSetup:
    """The reference of a qualification, and the conventions that it was made with.

    Parameters
    ----------
    diameter : float
        Calibrated diameter of the sphere or ring. [mm]
    tip_diameter : float, optional
        Not given: only differences of pretravel are determined; the mean of the map is zero and
        its tip radius the effective one. Points come out the same, except for the height:
        without an absolute pretravel the centre along the axis is that of the least-squares
        sphere. [mm]
    ring : bool
        The reference is a ring gauge, touched inside; its axis is that of the probe.
    u_diameter : float, optional
        Standard uncertainty of the calibrated diameter; `USUAL_U_DIAMETER` when not given. [mm]
    u_temperature : float
        Standard uncertainty of the difference between the reference's temperature and the one that
        the diameter holds at; the reference expands as steel. [K]
    sphere_form : float
        Deviation of the reference from its form, between highest and lowest point. [mm]
    axial_pretravel : float or None
        Of harmonic maps at the pole, where the sphere was touched there and the tip diameter is
        given. None: the centre along the axis is that of the least-squares sphere. [mm]
    axis : (3,) float
        The probe's +z (tip to spindle) in the machine frame.
    search_outliers : bool
        Compare each direction with the others. For the kinds mean and sectors this takes one
        harmonic fit more, which also separates noise from lobing where nothing is repeated.

    Raises
    ------
    PretravelError
        A diameter that is not positive and finite.

    >>> QualificationSetup(25.0, tip_diameter=6.0).ring
    False
    """

    diameter: float
    tip_diameter: float | None = None
    ring: bool = False
    u_diameter: float | None = None
    u_temperature: float = USUAL_U_TEMPERATURE
    sphere_form: float = USUAL_SPHERE_FORM
    axial_pretravel: float | None = AXIAL_PRETRAVEL
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    search_outliers: bool = True

    def __post_init__(self) -> None:
        x, y, z = np.asarray(self.axis, dtype=np.float64).reshape(3)
        object.__setattr__(self, "axis", (float(x), float(y), float(z)))
        what = f"the {self.reference}'s diameter"
        diameter = checked(self.diameter, what, REFERENCE_DIAMETER, inputs=("diameter",))
        object.__setattr__(self, "diameter", diameter)
        if self.tip_diameter is not None:
            what = "the tip's diameter"
            tip = checked(self.tip_diameter, what, TIP_BALL, inputs=("tip_diameter",))
            object.__setattr__(self, "tip_diameter", tip)
            if not self.ring and tip > diameter:
                raise PretravelError(
                    f"the tip ({tip:g} mm) is larger than the sphere ({diameter:g} mm): are the "
                    "diameters exchanged?",
                    inputs=("diameter", "tip_diameter"),
                )
        check_numbers(
            self,
            u_diameter=U_OF_DIAMETER,
            u_temperature=TEMPERATURE_DIFFERENCE,
            sphere_form=DEVIATION_OF_FORM,
            axial_pretravel=_AXIAL,
        )

    @property
    def u_reference_diameter(self) -> float:
        """Standard uncertainty of the diameter as it is touched: calibration, temperature. [mm]"""
        calibrated = USUAL_U_DIAMETER if self.u_diameter is None else self.u_diameter
        return math.hypot(calibrated, STEEL_EXPANSION * self.diameter * self.u_temperature)

    @property
    def reference(self) -> str:
        """``sphere`` or ``ring``."""
        return "ring" if self.ring else "sphere"


@dataclass(frozen=True)
class Provenance:
    """How a map was made.

    Attributes
    ----------
    origin : Origin
    source : str
        In words.
    touches : str
        Number of touches and directions, in words.
    touches_file : str
        Name of the file that the touches came from.
    gauge : str
        What pretravel is relative to, in words.
    level_known : bool
        Whether the level of pretravel was determined. It was not where the tip's diameter was not
        given: differences between directions alone are then meaningful.
    probe : str
        Name of the described probe, for a prediction.
    setup : QualificationSetup, optional
        Of a qualification; with it a map can be made again in the same way.
    kind_settings : mapping of str to number or text
        Of the kind of map, where it has any.
    reading : str
        How the file of touches was understood, where it was not in the form that this package
        writes.
    touch_digests : str
        Digests of the touches (`pretravel.qualification.own_touches`).
    spindle_deg : float or None
        Orientation of the spindle at which the reference was touched, where that is stated. [°]
    tip, orientation : str
        Names of the tip and of the orientation of the head, where the touches state them.
    center_covariance : (3, 3) float, optional
        Of the centre of the reference, probe frame: a place that is found through the map has
        it, beyond what points have. None where the map separates no centre, or does not say. [mm²]
    center : (3,) float, optional
        Of the reference at the qualification, in the machine's axes. [mm]
    """

    origin: Origin = Origin.MADE
    source: str = ""
    touches: str = ""
    touches_file: str = ""
    gauge: str = ""
    level_known: bool = True
    probe: str = ""
    setup: QualificationSetup | None = None
    kind_settings: Mapping[str, Any] = field(default_factory=dict)
    reading: str = ""
    touch_digests: str = ""
    spindle_deg: float | None = None
    tip: str = ""
    orientation: str = ""
    center_covariance: tuple[tuple[float, ...], ...] | None = None
    center: tuple[float, ...] | None = None

    def as_dict(self) -> dict[str, Any]:
        """Plain values for a file; what is empty is left out.

        >>> Provenance(Origin.PREDICTED, "predicted, model analytic").as_dict()
        {'origin': 'predicted', 'source': 'predicted, model analytic'}
        """
        found: dict[str, Any] = {"origin": self.origin.value}
        for name in _TEXTS:
            if getattr(self, name):
                found[name] = getattr(self, name)
        if not self.level_known:
            found["level_known"] = False
        if self.spindle_deg is not None:
            found["spindle_deg"] = self.spindle_deg
        if self.center_covariance is not None:
            found["center_covariance"] = [list(row) for row in self.center_covariance]
        if self.center is not None:
            found["center"] = list(self.center)
        if self.setup is not None:
            found["setup"] = asdict(self.setup)
        if self.kind_settings:
            found["kind_settings"] = dict(self.kind_settings)
        return found

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Provenance:
        """What `as_dict` gave.

        Raises
        ------
        KeyError
            There is no origin.

        >>> Provenance.from_dict({"origin": "predicted"}).origin
        <Origin.PREDICTED: 'predicted'>
        """
        known = {entry.name for entry in fields(cls)}
        given = {name: value for name, value in values.items() if name in known}
        setup = given.pop("setup", None)
        spread, center = given.pop("center_covariance", None), given.pop("center", None)
        return cls(
            **{**given, "origin": Origin(values["origin"])},
            setup=None if setup is None else QualificationSetup(**setup),
            center_covariance=None if spread is None else _matrix(spread),
            center=None if center is None else _place(center),
        )

    def with_center_covariance(self, covariance: FloatArray) -> Provenance:
        """The same with a covariance of the centre, (3, 3), probe frame. [mm²]

        Raises
        ------
        PretravelError
            It is not a matrix (3, 3), not finite, or a variance of it is negative.

        >>> Provenance().with_center_covariance(np.eye(3)).center_covariance[0]
        (1.0, 0.0, 0.0)
        """
        return replace(self, center_covariance=_matrix(covariance))


_TEXTS = (
    "source", "touches", "touches_file", "reading", "gauge", "probe", "touch_digests", "tip",
    "orientation",
)  # fmt: skip


def _place(values: npt.ArrayLike) -> tuple[float, ...]:
    found = np.asarray(values, dtype=np.float64)
    if found.shape != (3,) or not np.isfinite(found).all():
        raise PretravelError("the centre of the reference must be three numbers, in mm")
    return tuple(found.tolist())


def _matrix(values: npt.ArrayLike) -> tuple[tuple[float, ...], ...]:
    given = np.asarray(values, dtype=np.float64)
    if given.shape != (3, 3):
        raise PretravelError(f"a covariance of a centre is a matrix (3, 3), not {given.shape}")
    return tuple(tuple(row) for row in Covariance.full(given).matrix.tolist())
