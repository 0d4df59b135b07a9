"""The numbers of a description that can be identified, by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from pretravel.base import DEGREE, PretravelError
from pretravel.prediction import Probe, StylusSegment


@dataclass(frozen=True)
class FreeNumber:
    """One number of a description that can be identified.

    Attributes
    ----------
    table, key : str
        Its place in the TOML text.
    unit : float
        Factor from the unit of that key to the unit inside.
    of : callable
        From a probe to the number, in the unit inside.
    put : callable
        From a probe and a number to the probe with this number.
    relative : bool
        Whether the fit uses its logarithm: of lengths and forces, but not of angles.
    """

    table: str
    key: str
    unit: float
    of: Callable[[Probe], float]
    put: Callable[[Probe, float], Probe]
    relative: bool = True

    def code(self, value: float) -> float:
        """The number that the fit varies: the logarithm of the value, or the value itself."""
        return math.log(value) if self.relative else value

    def value(self, code: float) -> float:
        """The value that belongs to a number of the fit."""
        return math.exp(code) if self.relative else code


def _with_stem(probe: Probe, diameter: float) -> tuple[StylusSegment, ...]:
    stem = probe.stem
    return tuple(
        replace(segment, diameter=diameter) if segment is stem else segment
        for segment in probe.stylus
    )


def _rod(index: int) -> FreeNumber:
    def put(probe: Probe, value: float) -> Probe:
        azimuths = list(probe.tripod.rod_azimuths)
        azimuths[index] = value
        return replace(
            probe,
            tripod=replace(probe.tripod, rod_azimuths=(azimuths[0], azimuths[1], azimuths[2])),
        )

    return FreeNumber(
        "tripod",
        f"rod_azimuths_deg[{index}]",
        DEGREE,
        lambda probe: probe.tripod.rod_azimuths[index],
        put,
        relative=False,
    )


FREE: Mapping[str, FreeNumber] = {
    "preload": FreeNumber(
        "spring", "preload_N", 1.0, lambda p: p.preload, lambda p, v: replace(p, preload=v)
    ),
    "lever": FreeNumber(
        "hub",
        "offset_mm",
        1.0,
        lambda p: p.lever,
        lambda p, v: p.with_lever(v),
    ),
    "tripod_radius": FreeNumber(
        "tripod",
        "radius_mm",
        1.0,
        lambda p: p.tripod.radius,
        lambda p, v: replace(p, tripod=replace(p.tripod, radius=v)),
    ),
    "support_angle": FreeNumber(
        "seats",
        "support_angle_deg",
        DEGREE,
        lambda p: p.seats.support_angle,
        lambda p, v: replace(p, seats=replace(p.seats, support_angle=v)),
        relative=False,
    ),
    "ball_radius": FreeNumber(
        "seats",
        "ball_radius_mm",
        1.0,
        lambda p: p.seats.ball_radius,
        lambda p, v: replace(p, seats=replace(p.seats, ball_radius=v)),
    ),
    "rod_radius": FreeNumber(
        "tripod",
        "rod_radius_mm",
        1.0,
        lambda p: p.tripod.rod_radius,
        lambda p, v: replace(p, tripod=replace(p.tripod, rod_radius=v)),
    ),
    "stem_diameter": FreeNumber(
        "stylus",
        "diameter_mm",
        1.0,
        lambda p: p.stem.diameter,
        lambda p, v: replace(p, stylus=_with_stem(p, v)),
    ),
    "rotation": FreeNumber(
        "orientation",
        "rotation_deg",
        DEGREE,
        lambda p: p.orientation.rotation,
        lambda p, v: replace(p, orientation=replace(p.orientation, rotation=v)),
        relative=False,
    ),
    "friction": FreeNumber(
        "seats",
        "friction",
        1.0,
        lambda p: p.seats.friction,
        lambda p, v: p.with_friction(v),
        relative=False,
    ),
    "rod_azimuth_1": _rod(0),
    "rod_azimuth_2": _rod(1),
    "rod_azimuth_3": _rod(2),
}
"""The numbers that can be identified, by name."""


def free_numbers(names: Sequence[str]) -> list[FreeNumber]:
    """The numbers with these names.

    Raises
    ------
    PretravelError
        No name, unknown names, a name given twice.

    >>> [number.key for number in free_numbers(["preload"])]
    ['preload_N']
    """
    if not names:
        raise PretravelError(f"no number is free; there are {', '.join(FREE)}", inputs=("free",))
    for name in names:
        if name not in FREE:
            raise PretravelError(
                f"'{name}' cannot be identified; there are {', '.join(FREE)}", inputs=("free",)
            )
    if len(set(names)) < len(names):
        raise PretravelError("a free number is named twice", inputs=("free",))
    return [FREE[name] for name in names]
