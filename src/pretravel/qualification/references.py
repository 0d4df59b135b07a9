"""What touches are made on: blocks, rings, pins and spheres."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    REFERENCE_DIAMETER,
    STEEL_EXPANSION,
    U_OF_DIAMETER,
    IntArray,
    PretravelError,
    checked,
)
from pretravel.touches import Touches

SHAPES = ("block", "ring", "pin", "sphere")


@dataclass(frozen=True)
class Reference:
    """What is touched.

    Parameters
    ----------
    name : str
        As the touches call it; an ``@`` and the turn in degrees follow there for blocks.
    shape : str
        One of `SHAPES`: a ring is any bore, a pin any boss, upright.
    sizes : tuple of float
        Diameter; of a block the one length between opposite faces that is known, or those along
        its x, y and z at a turn of zero. Empty: not known. [mm]
    u_size : float
        Standard uncertainty of each, without the temperature's. [mm]
    u_temperature : float
        [K]
    form : float
        Deviation of opposite faces of a block from parallel ones, over the face. [mm]

    Raises
    ------
    PretravelError
        A shape or a number of sizes that there is not; a size outside its range.

    >>> round(Reference("block", "block", (50.8,)).u_of(50.8), 6)
    0.000232
    """

    name: str
    shape: str
    sizes: tuple[float, ...] = ()
    u_size: float = 0.2 * MICROMETRE
    u_temperature: float = 0.2
    form: float = 1.0 * MICROMETRE

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise PretravelError(
                f"a reference is a {', a '.join(SHAPES)}, not a {self.shape!r}",
                inputs=("reference",),
            )
        counts = (0, 1, 3) if self.shape == "block" else (0, 1)
        if len(self.sizes) not in counts:
            raise PretravelError(
                f"{self.name} has {len(self.sizes)} sizes; a {self.shape} has "
                + ("one, or three along x, y and z" if self.shape == "block" else "one diameter"),
                inputs=("block", "reference"),
            )
        for size in self.sizes:
            checked(size, f"the size of {self.name}", REFERENCE_DIAMETER, inputs=("block",))
        checked(self.u_size, f"the uncertainty of {self.name}", U_OF_DIAMETER)

    def u_of(self, size: float) -> float:
        """Standard uncertainty of one size, with the temperature's. [mm]"""
        return math.hypot(self.u_size, STEEL_EXPANSION * size * self.u_temperature)


def turn_of(word: str) -> tuple[str, float | None]:
    """Name and turn of a reference as touches call it. [rad]

    >>> turn_of("block@90")[0], round(turn_of("block@90")[1], 4), turn_of("ring")
    ('block', 1.5708, ('ring', None))
    """
    name, mark, angle = word.partition("@")
    if not mark:
        return word, None
    if not re.fullmatch(r"[-+]?\d{1,4}(\.\d+)?", angle):
        raise PretravelError(
            f"the reference {word!r} of a touch has {angle!r} after the @; a turn in degrees is "
            "needed, such as block@90"
        )
    return name, float(angle) * DEGREE


def names_of_references(touches: Touches, references: Sequence[Reference]) -> list[str]:
    """What each touch was made on: by its column, its label, or the only reference."""
    if touches.references is not None:
        return list(touches.references)
    known = {one.name for one in references} | {"plate"}
    if touches.labels is not None:
        starts = [label.partition("/")[0] for label in touches.labels]
        if all(start.partition("@")[0] in known for start in starts):
            return starts
    if len(references) == 1:
        return [references[0].name] * len(touches)
    raise PretravelError(
        "several references, but the touches do not say on which of them each was made: a column "
        "reference is needed, or labels that begin with its name, such as ring/1"
    )


def touches_on(touches: Touches, references: Sequence[Reference], name: str) -> IntArray:
    """The rows of the touches on one of the references.

    >>> ring, block = Reference("ring", "ring", (50.0,)), Reference("block", "block", (50.8,))
    >>> touches = Touches(np.zeros((2, 3)), [[1.0, 0.0, 0.0]] * 2, labels=("block/1", "ring/1"))
    >>> touches_on(touches, [ring, block], "ring").tolist()
    [1]
    """
    names = [turn_of(word)[0] for word in names_of_references(touches, references)]
    return np.flatnonzero([each == name for each in names])
