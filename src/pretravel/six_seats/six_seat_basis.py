"""A map from a fitted six-seat probe, with a smooth correction and their joint uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from pretravel.base import FloatArray, IntArray, PretravelError, frozen
from pretravel.maps import (
    MapBasis,
    SeriesForm,
    SixSeatForm,
    StoredArray,
    StoredBasis,
    checked_terms,
    real_spherical_harmonics,
)
from pretravel.six_seats.response import ProbeResponse, ResponseBasis
from pretravel.six_seats.six_seat_slopes import six_seat_pretravel, six_seat_slopes
from pretravel.six_seats.uneven_seats import PARAMETERS, six_seat_response

_OWN = 5 + len(PARAMETERS)
"""Functions of the six-seat probe itself; those of the correction follow."""


_LARGEST = 50.0
"""No fitted parameter is nearly as large: logarithms, angles in rad, parts of a length."""

_DEGREE_ORDER = ("degree", "order")
_POWERS = {
    "preload": {
        "lateral_deflection": 1.0,
        "axial_deflection": 1.0,
        "seat_indentation": 2.0 / 3.0,
        "tip_approach": 2.0 / 3.0,
    },
    "stylus_length": {
        "lever_ratio": 0.85,
        "lateral_deflection": 2.4,
        "axial_deflection": 0.85,
        "tip_approach": -0.55,
    },
}
"""With which power of preload and stylus length the parameters, which are logarithms, change.

Preload: bending is linear, Hertz's contacts have the power 2/3. The probes of the catalogue have
levers of 0.8 to 0.9 of which a stylus is; their bending grows with the power 3.0 to 3.4 of its
length, the trigger force decreases with that of the lever, and compression along the axis grows
with the lever."""


@dataclass(frozen=True, eq=False)
class SixSeatBasis(MapBasis):
    """A map from a fitted six-seat probe, with its derivatives by the fitted parameters.

    Functions: the pretravel itself, a constant, the three components of the direction (a
    shift of the reference), the derivatives with respect to each of `PARAMETERS`, and spherical
    harmonics for what a six-seat probe does not represent. Maps have the coefficients
    (1, 0, 0, ...) before those of the correction; the derivatives carry the covariance.

    Parameters
    ----------
    values : (18,) float
        In the order of `PARAMETERS`.
    tip_radius : float
        [mm]
    terms : (k, 2) int, optional
        Degree and order of the harmonics of the correction; none when not given.

    >>> basis = SixSeatBasis(np.array([parameter.prior for parameter in PARAMETERS]), 3.0)
    >>> basis.design(np.array([[1.0, 0.0, 0.0]])).shape
    (1, 23)
    """

    values: FloatArray
    tip_radius: float
    terms: IntArray = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    kind: ClassVar[str] = "physical"

    @property
    def size(self) -> int:
        return _OWN + len(self.terms)

    @property
    def constant(self) -> FloatArray:
        return np.asarray(np.eye(self.size)[1])

    def __post_init__(self) -> None:
        values = frozen(self.values)
        if values.shape != (len(PARAMETERS),) or not np.all(np.abs(values) < _LARGEST):
            raise PretravelError(
                f"a six-seat probe has {len(PARAMETERS)} parameters, logarithms and angles of "
                f"usual size; got {values.shape}: {np.array2string(values, threshold=6)}"
            )
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "terms", checked_terms(self.terms))

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
        if np.any(coefficients[5:_OWN]):
            own = own + self.slopes(directions) @ coefficients[5:_OWN]
        if np.any(coefficients[_OWN:]):
            own = own + real_spherical_harmonics(directions, self.terms) @ coefficients[_OWN:]
        return np.asarray(own)

    def design(self, directions: FloatArray) -> FloatArray:
        found = np.empty((len(directions), self.size))
        found[:, 0], found[:, 5:_OWN] = six_seat_pretravel(self.values, directions)
        found[:, 1], found[:, 2:5] = 1.0, directions
        found[:, _OWN:] = real_spherical_harmonics(directions, self.terms)
        return found

    def slopes(self, directions: FloatArray) -> FloatArray:
        """Derivatives of pretravel by each parameter, (n, 18). [mm]"""
        return six_seat_slopes(self.values, directions)

    def sensitivities(self, directions: FloatArray) -> Mapping[str, FloatArray]:
        slopes = dict(zip((p.name for p in PARAMETERS), self.slopes(directions).T, strict=True))
        return {
            change: np.asarray(sum(power * slopes[name] for name, power in powers.items()))
            for change, powers in _POWERS.items()
        }

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None = None
    ) -> FloatArray:
        return ResponseBasis(self.response).displacement(directions, curvatures)

    def form_on_control(self, coefficients: FloatArray) -> SixSeatForm | None:
        if self.response.criterion != "first_contact" or np.any(coefficients[5:_OWN]):
            return None
        scale, constant, *shift = (float(c) for c in coefficients[:5])
        series = coefficients[_OWN:]
        correction = SeriesForm(self.terms, series) if np.any(series) else None
        return SixSeatForm(self.response, scale, constant, frozen(shift), correction)

    def arrays(self) -> Mapping[str, StoredArray]:
        found = {
            "six_seat_values": StoredArray(("parameter",), self.values),
            "parameter": StoredArray(("parameter",), [p.name for p in PARAMETERS]),
        }
        if len(self.terms):
            found["correction_degree"] = StoredArray(("correction",), self.terms[:, 0])
            found["correction_order"] = StoredArray(("correction",), self.terms[:, 1])
        return found

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
        if "correction_degree" not in stored.arrays:
            return cls(values, stored.tip_radius)
        terms = [np.asarray(stored.arrays[f"correction_{name}"].values) for name in _DEGREE_ORDER]
        return cls(values, stored.tip_radius, np.stack(terms, axis=1))
