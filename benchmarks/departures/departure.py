"""One departure from what the models know, as a value; each field is zero or usual by default."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from .patterns import USUAL_25
from .probes import MICROMETRE, MakeProbe, aged, six_seats
from .tripod import SimulatedProbe


@dataclass(frozen=True, eq=False)
class Departure:
    """A row of the table. Lengths in mm, feeds in mm/min, the delay in s."""

    title: str
    make_probe: MakeProbe = six_seats
    directions: np.ndarray = field(default_factory=lambda: USUAL_25)
    repeats: int = 3
    order: Literal["in a row", "rings", "passes", "shuffled passes"] = "in a row"
    """Of the repeats: of each direction in a row, of each ring of directions again and again, or of
    all directions."""
    ring: bool = False
    noise: float = 0.3 * MICROMETRE
    heavy_tails: bool = False
    """Student's t with 3 degrees of freedom and the same standard deviation."""
    noise_at_rods: float = 1.0
    """Times the noise elsewhere."""
    quantum: float = 0.0
    hysteresis: float = 0.0
    """Shift of the tip's rest position along the push of the touch before."""
    first_apart: tuple[float, float] = (0.0, 0.0)
    """Pretravel of a touch after one in another direction, more than of the touches after it in the
    same direction: on the reference, and of all touches of the part."""
    squareness: float = 0.0
    scale: float = 0.0
    backlash: float = 0.0
    drift: float = 0.0
    """Of the reference, from the first touch to the last."""
    drift_slows: bool = False
    """As of a machine that warms up, with a time constant of a third of the run; else steady."""
    stem_compliance: float = 0.0
    """Of the reference sphere, across its stem. [mm/N]"""
    delay: float = 0.0
    feed: float = 50.0
    part_feed: float = 50.0
    second_feed: float | None = None
    """Of every other pass on the reference."""
    feed_stated: tuple[bool, bool] = (False, False)
    """In the touches on the reference, and in those of the part."""
    diameter_error: float = 0.0
    """True less calibrated diameter."""
    form: float = 0.0
    """Of the reference: an oval, between highest and lowest point."""
    usual_errors: bool = False
    """Each set draws what u contains of a usual machine: diameter, temperature and form of the
    reference, hysteresis."""
    gross_errors: tuple[float, ...] = ()
    """Of single touches on the reference, at random places, outwards."""
    check: int | None = None
    """Number of touches that bring the map of the probe before `change` up to date."""
    check_drift: float = 0.0
    """Of the reference, from the first of these touches to the last."""
    change: Callable[[SimulatedProbe, np.random.Generator], SimulatedProbe] = aged
    spindle: tuple[float, float] = (0.0, 0.0)
    """Orientation during the touches on the reference, and during those of the part. [°]"""
    spindle_stated: tuple[bool, bool] = (False, False)
    reversal: bool = False
    """All targets twice, the second time with the spindle turned by 180°: means of both."""
    part_noise: float | None = None
    """Scatter of the touches of the part, where it is not that of the reference."""
    part_repeats: int = 1
    part_friction: float | None = None
    """Of a tripod on the part, where it is not that of the reference."""
    u_friction: float = 0.0
    """That this user gives when the part is compensated."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Keywords of `qualify` that this user gives."""
