"""The six-seat probe with 18 parameters, for fitting to touches.

Touches on a sphere contain displacements only. Therefore forces are in units of the preload and
lengths in units of the tripod's radius. Seven parameters describe an ideal probe, and eleven
small ones its asymmetry (Estler).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.errors import PretravelError
from pretravel.maps.basis import MapBasis, SixSeatForm, StoredArray, StoredBasis
from pretravel.probe.seat_frame import seat_triads, tip_wrenches
from pretravel.trigger.response import ProbeResponse, ResponseBasis
from pretravel.units import DEGREE, MICROMETRE


class Parameter(NamedTuple):
    """One parameter of the six-seat probe, with its prior distribution."""

    name: str
    unit: str
    typical: float
    spread: float
    """Standard deviation; of the logarithm where `logarithmic`."""
    logarithmic: bool = False

    def physical(self, value: float) -> float:
        """The parameter's value, from the fitted number."""
        return math.exp(value) if self.logarithmic else value

    @property
    def prior(self) -> float:
        return math.log(self.typical) if self.logarithmic else self.typical


_UNKNOWN = 100.0

IDEAL: tuple[Parameter, ...] = (
    Parameter("lever_ratio", "1", 5.0, 0.7, True),
    Parameter("support_angle", "rad", 35.0 * DEGREE, 12.0 * DEGREE),
    Parameter("rod_azimuth", "rad", 0.0, _UNKNOWN),
    Parameter("lateral_deflection", "mm", 10.0 * MICROMETRE, 2.0, True),
    Parameter("seat_indentation", "mm", 0.25 * MICROMETRE, 0.7, True),
    Parameter("axial_ratio", "1", 0.03, 0.7, True),
    Parameter("tip_approach", "mm", 0.2 * MICROMETRE, 0.5, True),
)
"""Of the ideal probe: lever over tripod radius; the seats' angle from the horizontal; azimuth
of the first rod; linear deflection of the tip under a lateral force of preload / lever_ratio;
Hertz's indentation of a seat at rest; compliance along the axis over that across it; Hertz's
approach of tip and flat part under preload / lever_ratio."""

ASYMMETRIES: tuple[Parameter, ...] = (
    Parameter("spring_x", "tripod radius", 0.0, 0.02),
    Parameter("spring_y", "tripod radius", 0.0, 0.02),
    *(Parameter(f"rod_azimuth_{i}", "rad", 0.0, 0.01) for i in (1, 2)),
    *(Parameter(f"rod_radius_{i}", "tripod radius", 0.0, 0.01) for i in (1, 2)),
    *(Parameter(f"support_angle_{i}", "rad", 0.0, 0.01) for i in (1, 2, 3, 4, 5)),
)
"""Offset of the spring from the axis; deviations of the rods from 120° and from one radius;
differences between the angles of the seats. Two (five) contrasts for three rods (six seats): the
mean belongs to the ideal probe."""

PARAMETERS = IDEAL + ASYMMETRIES


def _contrasts(count: int) -> FloatArray:
    """Orthonormal contrasts of some numbers, (count - 1, count): rows add up to zero."""
    from scipy.linalg import helmert

    return np.asarray(helmert(count))


_OF_RODS, _OF_SEATS = _contrasts(3), _contrasts(6)


def six_seat_response(values: FloatArray, tip_radius: float) -> ProbeResponse:
    """The response of the probe with these numbers.

    Parameters
    ----------
    values : (18,) float
        In the order of `PARAMETERS`; logarithms of the logarithmic ones.
    tip_radius : float
        [mm]

    Returns
    -------
    ProbeResponse
        Forces in units of the preload, not in N.

    Raises
    ------
    PretravelError
        Seats that do not hold the tripod.

    Notes
    -----
    Statics as in `pretravel.trigger.seats`, with the tripod's radius as unit of length.

    >>> ideal = np.array([parameter.prior for parameter in PARAMETERS])
    >>> response = six_seat_response(ideal, 3.0)
    >>> response.force(np.array([[0.0, 0.0, 1.0]]))[0].round(9).tolist()  # lifts at the preload
    [1.0]
    """
    named = {p.name: p.physical(float(v)) for p, v in zip(PARAMETERS, values, strict=True)}
    lever = named["lever_ratio"]
    turned = _OF_RODS.T @ np.array([named["rod_azimuth_1"], named["rod_azimuth_2"]])
    azimuths = named["rod_azimuth"] + turned + np.arange(3) * 2.0 * np.pi / 3.0
    radii = 1.0 + _OF_RODS.T @ np.array([named["rod_radius_1"], named["rod_radius_2"]])
    tilted = _OF_SEATS.T @ np.array([named[f"support_angle_{i}"] for i in range(1, 6)])
    wrenches = seat_triads(azimuths, radii, named["support_angle"] + tilted).wrenches
    spring = np.array([0.0, 0.0, -1.0, -named["spring_y"], named["spring_x"], 0.0])
    at_tip = tip_wrenches(np.array([0.0, 0.0, -lever]))
    # One factorisation serves the reactions to the spring and to forces on the tip and, transposed,
    # the rigid motion that follows from the seats' indentations.
    inverse = np.linalg.inv(wrenches)
    rest = -inverse @ spring
    if rest.min() <= 0.0:
        raise PretravelError("these seats do not hold the tripod: one reaction would be a tension")
    lateral = named["lateral_deflection"] * lever
    at_rest = 1.0 / (6.0 * math.sin(named["support_angle"]))
    return ProbeResponse(
        reaction_change=-inverse @ at_tip,
        rest_reactions=rest,
        criterion="first_contact",
        threshold=0.0,
        compliance=lateral * np.diag([1.0, 1.0, named["axial_ratio"]]),
        seat_motion=-(inverse @ at_tip).T,
        seat_coefficient=named["seat_indentation"] / at_rest ** (2.0 / 3.0),
        tip_coefficient=named["tip_approach"] * lever ** (2.0 / 3.0),
        tip_radius=tip_radius,
    )


@dataclass(frozen=True, eq=False)
class SixSeatBasis(MapBasis):
    """A map from a fitted six-seat probe, with its derivatives by the fitted parameters.

    Functions: the pretravel itself, a constant, the three components of the direction (a
    shift of the reference), and the derivatives with respect to each of `PARAMETERS`. Maps
    have the coefficients (1, 0, 0, ...); the others carry the covariance.

    Parameters
    ----------
    values : (18,) float
        In the order of `PARAMETERS`.
    tip_radius : float
        [mm]

    >>> basis = SixSeatBasis(np.array([parameter.prior for parameter in PARAMETERS]), 3.0)
    >>> basis.design(np.array([[1.0, 0.0, 0.0]])).shape
    (1, 23)
    """

    values: FloatArray
    tip_radius: float
    kind: ClassVar[str] = "physical"

    @property
    def size(self) -> int:
        return 5 + len(PARAMETERS)

    @property
    def constant(self) -> FloatArray:
        return np.asarray(np.eye(self.size)[1])

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(self.values))

    @cached_property
    def response(self) -> ProbeResponse:
        return six_seat_response(self.values, self.tip_radius)

    @property
    def named(self) -> Mapping[str, float]:
        """The parameters' values, by name."""
        return {p.name: p.physical(float(v)) for p, v in zip(PARAMETERS, self.values, strict=True)}

    def value(self, directions: FloatArray, coefficients: FloatArray) -> FloatArray:
        linear = coefficients[1] + directions @ coefficients[2:5]
        own = coefficients[0] * self.response.pretravel(directions) + linear
        if np.any(coefficients[5:]):
            own = own + self.slopes(directions) @ coefficients[5:]
        return np.asarray(own)

    def design(self, directions: FloatArray) -> FloatArray:
        return np.column_stack(
            [
                self.response.pretravel(directions),
                np.ones(len(directions)),
                directions,
                self.slopes(directions),
            ]
        )

    def slopes(self, directions: FloatArray) -> FloatArray:
        """Derivatives of pretravel by each number, (n, 18), central differences. [mm]"""
        return six_seat_slopes(self.values, self.tip_radius, directions)

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None = None
    ) -> FloatArray:
        return ResponseBasis(self.response).displacement(directions, curvatures)

    def form_on_control(self, coefficients: FloatArray) -> SixSeatForm | None:
        if self.response.criterion != "first_contact" or np.any(coefficients[5:]):
            return None
        scale, constant, *shift = (float(c) for c in coefficients[:5])
        return SixSeatForm(self.response, scale, constant, frozen(shift))

    def arrays(self) -> Mapping[str, StoredArray]:
        return {
            "six_seat_values": StoredArray(("parameter",), self.values),
            "parameter": StoredArray(("parameter",), [p.name for p in PARAMETERS]),
        }

    def checksummed(self) -> list[npt.ArrayLike]:
        return [self.values]

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self | None:
        if "six_seat_values" not in stored.arrays:
            return None
        if [str(name) for name in stored.arrays["parameter"].values] != [
            p.name for p in PARAMETERS
        ]:
            raise PretravelError(
                "this physical map has other parameters than this version of pretravel uses"
            )
        values = np.asarray(stored.arrays["six_seat_values"].values, dtype=np.float64)
        return cls(values, stored.tip_radius)


_STEP = 1e-5  # of numbers of order one: rounding and curvature both below 1e-8 of the slope


def six_seat_slopes(
    values: FloatArray, tip_radius: float, directions: FloatArray, compression: float = 1.0
) -> FloatArray:
    """Derivatives of `along_normal` by each of `PARAMETERS`, (n, 18), central differences. [mm]"""
    columns = []
    for index in range(len(values)):
        step = np.zeros(len(values))
        step[index] = _STEP
        ahead, behind = (
            along_normal(
                six_seat_response(values + sign * step, tip_radius), directions, compression
            )
            for sign in (1.0, -1.0)
        )
        columns.append((ahead - behind) / (2.0 * _STEP))
    return np.stack(columns, axis=1)


def along_normal(
    response: ProbeResponse, directions: FloatArray, compression: float = 1.0
) -> FloatArray:
    """Pretravel, with the tip's approach `compression` times that on a flat part, (n,). [mm]"""
    force, _ = response.force(directions)
    along = np.sum(response.deflection(directions, force) * directions, axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(along + compression * response.tip_approach(force))
