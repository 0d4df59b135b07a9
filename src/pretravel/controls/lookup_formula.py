"""Maps whose own formula a control evaluates: a series, or six seats in closed form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from pretravel.base import FloatArray, azimuth_angle, frozen
from pretravel.controls.lookup import FEW, Band, MapSamples, supported_band
from pretravel.maps import CondensedProbe, PretravelMap, SeriesForm, SixSeatForm


@dataclass(frozen=True, eq=False)
class LookupSeries:
    """Real spherical harmonics, summed by order.

    Attributes
    ----------
    cosines, sines : (d + 1, d + 1) float
        Coefficients by degree and order, of functions with mean square one over the sphere. [mm]
    band : Band
    largest_error : float
        Largest difference from the map within the band. [mm]
    """

    template: ClassVar[str] = "linuxcnc/series.ngc"
    needs_table: ClassVar[bool] = False

    cosines: FloatArray
    sines: FloatArray
    band: Band
    largest_error: float = 0.0

    @property
    def orders(self) -> list[int]:
        """Orders with coefficients other than zero."""
        used = np.any((self.cosines != 0.0) | (self.sines != 0.0), axis=0)
        return [int(order) for order in np.flatnonzero(used)]

    def highest_degree(self, order: int) -> int:
        """Highest degree of an order with a coefficient other than zero."""
        used = (self.cosines[:, order] != 0.0) | (self.sines[:, order] != 0.0)
        return int(np.flatnonzero(used)[-1])

    @property
    def description(self) -> str:
        """See `Lookup`."""
        terms = int(np.sum(self.cosines != 0.0) + np.sum(self.sines != 0.0))
        return f"harmonic series of {terms} terms"

    def template_values(self) -> Mapping[str, object]:
        """See `Lookup`."""
        return {"sectoral_factor": sectoral_factor, "recurrence": recurrence}

    def value(self, directions: FloatArray) -> FloatArray:
        """See `Lookup`; in the steps of the control."""
        z = directions[:, 2]
        across = np.hypot(directions[:, 0], directions[:, 1])
        azimuth = azimuth_angle(directions)
        total = np.zeros(len(directions))
        for order in self.orders:
            before = np.zeros(len(directions))
            now = sectoral_factor(order) * across**order
            for degree in range(order, self.highest_degree(order) + 1):
                if degree > order:
                    a, b = recurrence(degree, order)
                    before, now = now, a * z * now - b * before
                total += now * (
                    self.cosines[degree, order] * np.cos(order * azimuth)
                    + self.sines[degree, order] * np.sin(order * azimuth)
                )
        return total


def sectoral_factor(order: int) -> float:
    """The factor of sin(polar)^order in the function of equal degree and order.

    >>> round(sectoral_factor(1), 6)
    1.732051
    """
    index = np.arange(2, order + 1)
    first = 1.0 if order == 0 else math.sqrt(3.0)
    return float(first * np.prod(np.sqrt((2 * index + 1) / (2 * index))))


def recurrence(degree: int, order: int) -> tuple[float, float]:
    """Factors a, b of P(l, m) = a z P(l-1, m) - b P(l-2, m), for functions of mean square one.

    >>> recurrence(1, 0)
    (1.7320508075688772, 0.0)
    """
    both = (degree - order) * (degree + order)
    a = math.sqrt((2 * degree - 1) * (2 * degree + 1) / both)
    if degree == order + 1:
        return a, 0.0
    b = math.sqrt(
        (2 * degree + 1) * (degree + order - 1) * (degree - order - 1) / (both * (2 * degree - 3))
    )
    return a, b


@dataclass(frozen=True, eq=False)
class LookupSeats:
    """Six seats: the trigger force in closed form, and the deformation at this force.

    Attributes
    ----------
    response : CondensedProbe
        With the criterion first_contact.
    scale, constant : float
        Factor of the probe's pretravel, and the constant added to it. [1], [mm]
    shift : (3,) float
        Multiplies the direction; the product is added. [mm]
    series : LookupSeries or None
        Added: what six seats do not represent.
    band : Band
    largest_error : float
        Largest difference from the map within the band. [mm]
    """

    template: ClassVar[str] = "linuxcnc/seats.ngc"
    needs_table: ClassVar[bool] = False

    response: CondensedProbe
    scale: float
    constant: float
    shift: FloatArray
    series: LookupSeries | None
    band: Band
    largest_error: float = 0.0

    @property
    def description(self) -> str:
        """See `Lookup`."""
        added = "" if self.series is None else f" and {self.series.description}"
        return f"six-seat formula{added}"

    def template_values(self) -> Mapping[str, object]:
        """See `Lookup`."""
        rest = self.response.rest_reactions
        return {
            "response": self.response,
            "sunk_at_rest": [np.cbrt(reaction**2) for reaction in rest],
            "sectoral_factor": sectoral_factor,
            "recurrence": recurrence,
        }

    def value(self, directions: FloatArray) -> FloatArray:
        """See `Lookup`."""
        own = self.response.pretravel(directions)
        total = self.scale * own + self.constant + directions @ self.shift
        return np.asarray(total if self.series is None else total + self.series.value(directions))


def exact_lookup(pretravel_map: PretravelMap) -> LookupSeries | LookupSeats | None:
    """The map's own formula for a control; None where the control needs a table.

    Raises
    ------
    PretravelError
        The map does not hold all around the axis at any polar angle.
    """
    form = pretravel_map.basis.form_on_control(pretravel_map.coefficients)
    if form is None:
        return None
    band = supported_band(pretravel_map)
    lookup = _series(form, band) if isinstance(form, SeriesForm) else _seats(form, band)
    return replace(lookup, largest_error=MapSamples(pretravel_map, band, FEW).largest_error(lookup))


def _seats(form: SixSeatForm, band: Band) -> LookupSeats:
    series = None if form.correction is None else _series(form.correction, band)
    return LookupSeats(form.probe, form.scale, form.constant, form.shift, series, band)


def _series(form: SeriesForm, band: Band) -> LookupSeries:
    size = int(form.terms[:, 0].max()) + 1
    cosines, sines = np.zeros((size, size)), np.zeros((size, size))
    for (degree, order), value in zip(form.terms, form.coefficients, strict=True):
        (sines if order < 0 else cosines)[degree, abs(order)] += value
    return LookupSeries(frozen(cosines), frozen(sines), band)
