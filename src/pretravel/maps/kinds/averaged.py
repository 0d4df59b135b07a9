"""Kind averaged: maps of several kinds, weighted by how well each predicts left-out directions.

Its uncertainty contains that of each kind and the differences between them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.maps.basis import MapBasis, SeriesForm, SixSeatForm, StoredArray, StoredBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.uncertainty import Covariance

_COMMON = 4
"""Functions in addition to those of the parts: a constant, and the components of the direction."""


@dataclass(frozen=True, eq=False)
class AveragedBasis(MapBasis):
    """The functions of several bases side by side, with a constant and a shift.

    Parameters
    ----------
    parts : tuple of MapBasis
        The one with the largest weight first.

    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> AveragedBasis((MeanBasis(), MeanBasis())).design(np.array([[0.0, 0.0, 1.0]])).tolist()
    [[1.0, 0.0, 0.0, 1.0, 1.0, 1.0]]
    """

    parts: tuple[MapBasis, ...]
    kind: ClassVar[str] = "averaged"

    @property
    def size(self) -> int:
        return _COMMON + sum(part.size for part in self.parts)

    @property
    def constant(self) -> FloatArray:
        return np.asarray(np.eye(self.size)[0])

    def design(self, directions: FloatArray) -> FloatArray:
        parts = [part.design(directions) for part in self.parts]
        return np.hstack([np.ones((len(directions), 1)), directions, *parts])

    def value(self, directions: FloatArray, coefficients: FloatArray) -> FloatArray:
        total = coefficients[0] + directions @ coefficients[1:_COMMON]
        for part, own in zip(self.parts, self._split(coefficients), strict=True):
            total = total + part.value(directions, own)
        return np.asarray(total)

    def _split(self, coefficients: FloatArray) -> list[FloatArray]:
        ends = np.cumsum([part.size for part in self.parts])[:-1]
        return np.split(coefficients[_COMMON:], ends)

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None
    ) -> FloatArray | None:
        return self.parts[0].displacement(directions, curvatures)

    def form_on_control(self, coefficients: FloatArray) -> SixSeatForm | None:
        """In closed form where one part is a six-seat probe and the others are series."""
        seats: SixSeatForm | None = None
        series: list[SeriesForm] = []
        for part, own in zip(self.parts, self._split(coefficients), strict=True):
            form = part.form_on_control(own)
            if form is None or (isinstance(form, SixSeatForm) and seats is not None):
                return None
            if isinstance(form, SeriesForm):
                series.append(form)
            else:
                seats = form
        if seats is None:
            return None
        if seats.correction is not None:
            series.append(seats.correction)
        correction = SeriesForm(
            np.concatenate([each.terms for each in series]),
            np.concatenate([each.coefficients for each in series]),
        )
        return replace(
            seats,
            constant=seats.constant + float(coefficients[0]),
            shift=seats.shift + coefficients[1:_COMMON],
            correction=correction,
        )

    def arrays(self) -> Mapping[str, StoredArray]:
        return {
            f"part_{number}_{name}": StoredArray(
                tuple(f"part_{number}_{axis}" for axis in array.axes), array.values, array.unit
            )
            for number, part in enumerate(self.parts)
            for name, array in part.arrays().items()
        }

    def attributes(self) -> Mapping[str, str | float]:
        found: dict[str, str | float] = {"parts": ",".join(part.kind for part in self.parts)}
        for number, part in enumerate(self.parts):
            found |= {f"part_{number}_{name}": value for name, value in part.attributes().items()}
        return found

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self | None:
        """Not from here: the parts are restored by `stored_parts`, each by its own basis."""
        del stored
        return None


def stored_parts(stored: StoredBasis) -> list[tuple[str, StoredBasis]]:
    """The stored parts of an averaged basis, each with its kind.

    Returns
    -------
    list of (str, StoredBasis)
    """

    def own(values: Mapping[str, object], number: int) -> dict[str, object]:
        start = f"part_{number}_"
        return {name[len(start) :]: v for name, v in values.items() if name.startswith(start)}

    return [
        (
            kind,
            StoredBasis(
                stored.support,
                stored.tip_radius,
                own(stored.arrays, number),  # type: ignore[arg-type]  # values keep their type
                own(stored.attributes, number),  # type: ignore[arg-type]
            ),
        )
        for number, kind in enumerate(str(stored.attributes["parts"]).split(","))
    ]


def averaged_map(
    maps: Sequence[PretravelMap], centers: Sequence[FloatArray], weights: Sequence[float]
) -> tuple[AveragedBasis, FloatArray, Covariance]:
    """Average maps of one probe from the same touches, about the centre of the first.

    Parameters
    ----------
    maps : sequence of PretravelMap
    centers : sequence of (3,) float
        Of the reference, as each map found it, machine frame. [mm]
    weights : sequence of float
        They add up to one.

    Returns
    -------
    basis : AveragedBasis
    coefficients : (k,) float
        [mm]
    covariance : Covariance
        Of each map alone, weighted, and of the differences between the maps. [mm²]

    Raises
    ------
    PretravelError
        Maps of different frames.

    Notes
    -----
    A centre moved by s adds n·s to pretravel, and a larger tip radius a constant: maps are compared
    about the same centre and with the same tip. The covariance is that of the mixture: Hoeting,
    Madigan, Raftery & Volinsky 1999, equation 4.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.maps.support import DirectionSupport
    >>> maps = [PretravelMap(MeanBasis(), np.array([p]), Covariance.independent([0.0]),
    ...         DirectionSupport(sphere_pattern_25()), tip_radius=3.0) for p in (0.010, 0.012)]
    >>> basis, coefficients, covariance = averaged_map(maps, [np.zeros(3)] * 2, [0.5, 0.5])
    >>> up = basis.design(np.array([[0.0, 0.0, 1.0]]))
    >>> (up @ coefficients).round(9).tolist(), np.sqrt(covariance.variance_of(up)).round(9).tolist()
    ([0.011], [0.001])
    """
    first = maps[0]
    if any(not np.allclose(other.rotation, first.rotation) for other in maps):
        raise PretravelError("maps of different frames cannot be averaged")
    basis = AveragedBasis(tuple(each.basis for each in maps))
    own = np.zeros((len(maps), basis.size))
    covariance = np.zeros((basis.size, basis.size))
    end = _COMMON
    for row, (each, center, weight) in enumerate(zip(maps, centers, weights, strict=True)):
        part = slice(end, end + each.basis.size)
        end = part.stop
        own[row, 0] = first.tip_radius - each.tip_radius
        own[row, 1:_COMMON] = (np.asarray(centers[0]) - center) @ first.rotation
        own[row, part] = each.coefficients
        covariance[part, part] = weight * each.covariance.matrix
    mean = np.asarray(weights) @ own
    between = own - mean
    covariance += (between.T * np.asarray(weights)) @ between
    return basis, mean, Covariance.full(0.5 * (covariance + covariance.T))
