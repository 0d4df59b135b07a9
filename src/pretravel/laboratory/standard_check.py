"""The result of a probing test of a standard, and the reference sphere of the test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.compensation.compensation import apply
from pretravel.errors import PretravelError
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.quantities import REFERENCE_DIAMETER, UNCERTAINTY, check_numbers, checked
from pretravel.touches import Touches
from pretravel.uncertainty.fitting.sphere import SphereFit

ALONG_Z = (0.0, 0.0, 1.0)
"""The axis of a probe along the z axis of the machine."""

NOT_CONFORMING = "does not conform"
"""The verdict on a figure that is proven to exceed its limit."""


@dataclass(frozen=True)
class CalibratedSphere:
    """The reference sphere of a test.

    Attributes
    ----------
    diameter : float
        [mm]
    u_diameter : float
        Standard uncertainty of the diameter. [mm]
    form : float
        Form error. [mm]
    """

    diameter: float
    u_diameter: float = 0.0
    form: float = 0.0

    def __post_init__(self) -> None:
        checked(self.diameter, "the sphere's diameter", REFERENCE_DIAMETER, inputs=("diameter",))
        check_numbers(self, u_diameter=UNCERTAINTY, form=UNCERTAINTY)

    @property
    def u_of_form(self) -> float:
        """Standard uncertainty of a form error's test value (ISO/TS 23165 as recalled). [mm]"""
        return 0.5 * self.form


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
    u_test : float
        Standard uncertainty of the test value, from the reference's calibration. [mm]
    limit : float or None
        Maximum permissible error, where one was given. [mm]
    status : str
        ``verified`` or ``recalled``, of the definition used here.
    """

    name: str
    meaning: str
    value: float
    u_test: float
    limit: float | None
    status: str

    @property
    def verdict(self) -> str:
        """By the rule of ISO 14253-1: a verdict needs a value outside the uncertainty zone."""
        if self.limit is None:
            return "no limit given"
        expanded = 2.0 * self.u_test
        if abs(self.value) <= self.limit - expanded:
            return "conforms"
        if abs(self.value) > self.limit + expanded:
            return NOT_CONFORMING
        return "undecided within U (k = 2)"


@dataclass(frozen=True, eq=False)
class StandardCheck:
    """The quantities of a standard, from touches on a reference sphere.

    Attributes
    ----------
    standard : str
    figures : tuple of StandardFigure
    sets : tuple of SphereFit
        One for each run of the pattern; the figures state the worst of them.
    notes : tuple of str
    """

    standard: str
    figures: tuple[StandardFigure, ...]
    sets: tuple[SphereFit, ...]
    notes: tuple[str, ...]


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


_OTHER_UNIT = (0.1, 5.0)
"""Spreads of the touches, in diameters of the sphere, beyond which the unit is another one."""


def refuse_other_unit(touches: Touches, sphere: CalibratedSphere) -> None:
    """Refuse touches whose spread does not fit the sphere: inches taken for mm, or the reverse.

    Touches on a sphere spread over about its diameter and that of the tip; an inch is 25.4 mm.

    Parameters
    ----------
    touches : Touches
    sphere : CalibratedSphere

    Raises
    ------
    PretravelError
    """
    distance = np.abs(touches.positions - np.median(touches.positions, axis=0))
    spread = 2.0 * float(np.quantile(distance.max(axis=1), 0.9))  # one stray touch does not count
    least, most = _OTHER_UNIT
    if least * sphere.diameter <= spread <= most * sphere.diameter:
        return
    small = spread < sphere.diameter
    raise PretravelError(
        f"the touches spread over {spread:.4g} mm, on a sphere of {sphere.diameter:g} mm: the "
        + (
            "coordinates look like inches; state the unit inch"
            if small
            else "coordinates look like mm that were taken as inches; state the unit mm"
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
