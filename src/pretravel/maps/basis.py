"""What every kind of map has: functions of direction, a stored form, a form for controls."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Protocol, Self

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.maps.support import DirectionSupport

BLOCK = 8192
"""Directions at a time in which functions of a map are evaluated: some 20 MB."""


class CondensedProbe(Protocol):
    """Trigger force, tip deflection and pretravel in closed form, for any direction.

    Implemented by `pretravel.six_seats.response.ProbeResponse`, which states the attributes.
    """

    @property
    def reaction_change(self) -> FloatArray: ...
    @property
    def rest_reactions(self) -> FloatArray: ...
    @property
    def criterion(self) -> str: ...
    @property
    def threshold(self) -> float: ...
    @property
    def compliance(self) -> FloatArray: ...
    @property
    def seat_motion(self) -> FloatArray: ...
    @property
    def seat_coefficient(self) -> float: ...
    @property
    def tip_coefficient(self) -> float: ...
    @property
    def tip_radius(self) -> float: ...

    def force(self, directions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Trigger force (n,) and the seat that opens (n,). [N]"""
        ...

    def reactions(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        """Reactions of the six seats, (n, 6). [N]"""
        ...

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        """Distance from the trigger criterion, (n,). [N]"""
        ...

    def deflection(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        """Tip position less spindle point, (n, 3). [mm]"""
        ...

    def tip_approach(self, forces: FloatArray) -> FloatArray:
        """Approach of tip centre and part by local compression, (n,). [mm]"""
        ...

    def pretravel(self, normals: FloatArray) -> FloatArray:
        """Travel from contact to trigger along -n, (n,). [mm]"""
        ...


@dataclass(frozen=True, eq=False)
class SeriesForm:
    """A map as a series of real spherical harmonics.

    Attributes
    ----------
    terms : (k, 2) int
        Degree and order.
    coefficients : (k,) float
        [mm]
    """

    terms: IntArray
    coefficients: FloatArray


@dataclass(frozen=True, eq=False)
class SixSeatForm:
    """A map as the pretravel of a condensed probe, scaled, plus a constant, a shift and a series.

    Attributes
    ----------
    probe : CondensedProbe
    scale, constant : float
        [1], [mm]
    shift : (3,) float
        Multiplies the direction. [mm]
    correction : SeriesForm, optional
        Added.
    """

    probe: CondensedProbe
    scale: float
    constant: float
    shift: FloatArray
    correction: SeriesForm | None = None


@dataclass(frozen=True, eq=False)
class StoredArray:
    """An array of a stored map: its axes by name, and its unit."""

    axes: tuple[str, ...]
    values: FloatArray | IntArray | list[str]
    unit: str = "1"


@dataclass(frozen=True, eq=False)
class StoredBasis:
    """The content of a basis as named arrays and attributes, for files of any format.

    Attributes
    ----------
    arrays : mapping of name to StoredArray
    attributes : mapping of name to number or text
    support : DirectionSupport
    tip_radius : float
        Of the map that the basis belongs to. [mm]
    """

    support: DirectionSupport
    tip_radius: float
    arrays: Mapping[str, StoredArray] = field(default_factory=dict)
    attributes: Mapping[str, str | float] = field(default_factory=dict)


class MapBasis(ABC):
    """Functions of direction whose weighted sum is a map.

    A concrete basis has its own file and states everything that depends on the kind of map: the
    values of the functions, how a constant is added, what is stored in a file, and the form in
    which a control evaluates the map.
    """

    kind: ClassVar[str]
    """The word of the command line, such as ``harmonic``."""

    follows_probe: ClassVar[bool] = True
    """Whether the map follows a probe to its repeatability, so that a difference from it is a
    change of the probe."""

    interpolates: ClassVar[bool] = False
    """Whether the coefficients are the values of the map at the nodes of its support."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of functions."""

    @property
    @abstractmethod
    def constant(self) -> FloatArray | None:
        """Coefficients (size,) that add one to the map in every direction; None without any."""

    @abstractmethod
    def design(self, directions: FloatArray) -> FloatArray:
        """Values of the functions at (n, 3) directions in the probe frame: (n, size)."""

    def value(self, directions: FloatArray, coefficients: FloatArray) -> FloatArray:
        """``design(directions) @ coefficients``, (n,); faster where a kind overrides it. [mm]"""
        return np.asarray(self.design(directions) @ coefficients)

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None
    ) -> FloatArray | None:
        """Displacement of the tip at the trigger, compression included; None where unknown.

        Parameters
        ----------
        directions : (n, 3) float
            Probe frame.
        curvatures : (n, 2) float or None
            Principal curvatures of the part. None: a flat part. [1/mm]

        Returns
        -------
        (n, 3) float or None
            Probe frame. [mm]
        """
        del directions, curvatures
        return None

    @property
    def condensed_probe(self) -> CondensedProbe | None:
        """The probe that the map was predicted from, forces in newtons; None for other maps."""
        return None

    def form_on_control(self, coefficients: FloatArray) -> SeriesForm | SixSeatForm | None:
        """The map in closed form for a control; None where a control needs a table."""
        del coefficients
        return None

    def arrays(self) -> Mapping[str, StoredArray]:
        """What a file keeps of the basis as arrays."""
        return {}

    def attributes(self) -> Mapping[str, str | float]:
        """What a file keeps of the basis as single values."""
        return {}

    @classmethod
    @abstractmethod
    def restored(cls, stored: StoredBasis) -> Self | None:
        """The basis from a file; None where the content is that of another basis of this kind."""

    def sensitivities(self, directions: FloatArray) -> Mapping[str, FloatArray]:
        """Change of pretravel for a relative change of the probe, where the map knows it.

        Parameters
        ----------
        directions : (n, 3) float
            Probe frame.

        Returns
        -------
        mapping of str to (n,) float
            By "preload" and "stylus_length"; empty where the map has no physical form. [mm]
        """
        del directions
        return {}

    def values_in_blocks(self, directions: FloatArray, coefficients: FloatArray) -> FloatArray:
        """`MapBasis.value` in blocks of directions, so that a million of them need little memory.

        Parameters
        ----------
        directions : (n, 3) float
            Probe frame.
        coefficients : (k,) float
            [mm]

        Returns
        -------
        (n,) float
            [mm]
        """
        found = np.empty(len(directions))
        for start in range(0, len(directions), BLOCK):
            part = slice(start, start + BLOCK)
            found[part] = self.value(directions[part], coefficients)
        return found
