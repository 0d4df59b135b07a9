"""A kinematic touch-trigger probe, described: tripod, seats, spring, stylus, tip."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from pretravel.base import DEGREE, DescriptionError, FloatArray, probe_rotation
from pretravel.prediction.materials import Material, default_workpiece, material
from pretravel.six_seats import CRITERIA, PIEZO_STAGE

CONTACTS = ("hertz", "rigid")
LARGEST_FRICTION = 0.5
"""Largest friction coefficient of seats. From the tangent of the support angle on, rods jam
between their balls and the equations have no unique solution."""

LARGEST_TIP_FRICTION = 1.0
"""Largest friction coefficient of tip and part."""

LONGEST = 1000.0
"""Largest length of a probe. [mm]"""
STRONGEST = 100.0
"""Largest preload of a probe. [N]"""
HEAVIEST = 2.0
"""Largest moving mass of a probe. [kg]"""
WIDEST = 1.0
"""Largest opening of a contact. [mm]"""
LARGEST_U_RADIUS = 0.05
"""Largest standard uncertainty of a tip's radius. [mm]"""
_LIGHTEST = 0.01
"""Moving mass in that of stylus and tip, a part of it, below which it is of another unit."""


def _positive(value: float, what: str, unit: str = "mm", largest: float = LONGEST) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise DescriptionError(f"{what} is {value:g} {unit}; it must be positive")
    if value > largest:
        raise DescriptionError(
            f"{what} is {value:g} {unit}; the largest value of a probe is {largest:g} {unit}. "
            "Check the unit in the name of the key"
        )


@dataclass(frozen=True)
class Tripod:
    """Three radial rods that rest on the seats.

    Parameters
    ----------
    radius : float
        From the probe axis to the points where the rods rest. [mm]
    rod_azimuths : three floats
        Probe frame. [rad]
    rod_radius : float
        [mm]
    material : Material
        Of rods and seat balls.
    radius_deviations : three floats
        Of the rods from the radius: Ren's m, g, s less their common value. [mm]
    """

    radius: float
    rod_azimuths: tuple[float, float, float]
    rod_radius: float
    material: Material
    radius_deviations: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _positive(self.radius, "the tripod radius")
        _positive(self.rod_radius, "the rod radius")
        if len(self.rod_azimuths) != 3:
            raise DescriptionError(
                f"a kinematic probe has three rods, got {len(self.rod_azimuths)} rod azimuths"
            )
        if not all(math.isfinite(azimuth) for azimuth in self.rod_azimuths):
            raise DescriptionError("the rod azimuths must be finite numbers")
        if len(self.radius_deviations) != 3:
            raise DescriptionError(
                f"three rods have three deviations of the radius, got {len(self.radius_deviations)}"
            )
        largest = max(abs(deviation) for deviation in self.radius_deviations)
        if not largest <= 0.5 * self.radius:
            raise DescriptionError(
                f"a rod's radius deviates by {largest:g} mm from {self.radius:g} mm; at most half "
                "of it is possible"
            )
        if self.rod_radius >= 0.5 * self.radius:
            raise DescriptionError(
                f"rods of radius {self.rod_radius:g} mm do not fit at a tripod radius of "
                f"{self.radius:g} mm"
            )


@dataclass(frozen=True)
class Seats:
    """Six balls, two under each rod.

    Parameters
    ----------
    support_angle : float
        Of each seat normal, from the horizontal, in the rod's tangential-axial
        plane (27.266° for the thesis's probe). [rad]
    ball_radius : float
        [mm]
    material : Material
    contact : str
        ``hertz``: rod and ball deform at the contact; ``rigid``: they do not, as in models
        with coarse contact elements or none.
    friction : float
        Coulomb's coefficient between rods and balls; 0 for statics without history.
    right_less_left : float
        Support angle of the right seats less that of the left: Ren's beta less alpha. [rad]
    """

    support_angle: float
    ball_radius: float
    material: Material
    contact: str = "hertz"
    friction: float = 0.0
    right_less_left: float = 0.0

    def __post_init__(self) -> None:
        _positive(self.ball_radius, "the seat ball radius")
        half = abs(self.right_less_left) / DEGREE / 2.0
        degrees = self.support_angle / DEGREE
        if 1.0 <= degrees <= 89.0 and not half <= min(degrees - 1.0, 89.0 - degrees):
            raise DescriptionError(
                f"the support angles of left and right seats differ by {2.0 * half:g}°: with a "
                f"mean of {degrees:g}° one is not between 1° and 89°"
            )
        if not 1.0 <= degrees <= 89.0:
            raise DescriptionError(
                f"the support angle is {degrees:g}°; seats hold a rod only with an angle "
                "between 1° (walls, which carry no preload) and 89° (floors, which do not "
                "centre the rod). It is measured from the horizontal, not from the probe axis."
            )
        if self.contact not in CONTACTS:
            raise DescriptionError(
                f"the seats' contact is '{self.contact}'; known are {', '.join(CONTACTS)}"
            )
        if not 0.0 <= self.friction <= LARGEST_FRICTION:
            raise DescriptionError(
                f"the friction coefficient of the seats is {self.friction:g}; it must lie between "
                f"0 and {LARGEST_FRICTION:g}"
            )


@dataclass(frozen=True)
class Hub:
    """The solid that joins rods and stylus: a disc around the rod axes, a holder below.

    Parameters
    ----------
    radius, height : float
        Of the disc, whose middle is the plane of the rod axes. [mm]
    holder_diameter : float
        Of the cylinder from the disc down to the stylus's root. [mm]
    material : Material
    """

    radius: float
    height: float
    holder_diameter: float
    material: Material

    def __post_init__(self) -> None:
        _positive(self.radius, "the hub's radius")
        _positive(self.height, "the hub's height")
        _positive(self.holder_diameter, "the holder's diameter")


@dataclass(frozen=True)
class StepGeometry:
    """Solids of a STEP file that replace the described ones.

    Parameters
    ----------
    path : Path
        The file; its frame is the probe's (origin on the axis, in the plane of the
        rod axes, z from tip to spindle).
    tripod, stylus, tip : names of solids
        Each a solid's name, or ``#3`` for the third solid of the file.
    materials : mapping
        Material by name of the solid, where it differs from the part's.
    """

    path: Path
    tripod: tuple[str, ...]
    stylus: tuple[str, ...]
    tip: tuple[str, ...]
    materials: Mapping[str, Material] = field(default_factory=dict)


@dataclass(frozen=True)
class StylusSegment:
    """One cylindrical piece of the stylus.

    Parameters
    ----------
    length, diameter : float
        [mm]
    material : Material
    """

    length: float
    diameter: float
    material: Material

    def __post_init__(self) -> None:
        _positive(self.length, "the segment's length")
        _positive(self.diameter, "the segment's diameter", largest=100.0)
        if self.diameter < 0.05:
            raise DescriptionError(
                f"the segment's diameter is {self.diameter:g} mm; it must be at least 0.05 mm"
            )


@dataclass(frozen=True)
class Tip:
    """The ball that touches the part.

    Parameters
    ----------
    radius : float
        [mm]
    material : Material
    u_radius : float
        Standard uncertainty of the radius. [mm]
    friction : float
        Coulomb's coefficient of ball and part: Woźniak's µ.
    """

    radius: float
    material: Material
    u_radius: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        _positive(self.radius, "the tip radius")
        if not 0.0 <= self.u_radius <= LARGEST_U_RADIUS:
            raise DescriptionError(
                f"the tip radius's uncertainty is {1e3 * self.u_radius:g} µm; it must lie between "
                f"0 and {1e3 * LARGEST_U_RADIUS:g} µm"
            )
        if not 0.0 <= self.friction <= LARGEST_TIP_FRICTION:
            raise DescriptionError(
                f"the friction coefficient of the tip is {self.friction:g}; it must lie between "
                f"0 and {LARGEST_TIP_FRICTION:g}"
            )


@dataclass(frozen=True)
class Moving:
    """The mass on which gravity acts: tripod, hub, stylus and tip together.

    Parameters
    ----------
    mass : float
        Zero for a probe without weight. [kg]
    height : float
        Centre of mass on the probe axis, above the plane of the rod axes. [mm]
    """

    mass: float = 0.0
    height: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mass) and self.mass >= 0.0):
            raise DescriptionError(f"the moving mass is {self.mass:g} kg; it cannot be negative")
        if self.mass > HEAVIEST:
            raise DescriptionError(
                f"the moving mass is {self.mass:g} kg; the largest one of a probe is {HEAVIEST:g} "
                "kg. Check the unit in the name of the key"
            )
        if not abs(self.height) <= LONGEST:
            raise DescriptionError(
                f"the moving mass's height is {self.height:g} mm; it must lie between "
                f"-{LONGEST:g} and {LONGEST:g}"
            )


@dataclass(frozen=True)
class Orientation:
    """The orientation of the probe in the machine.

    Parameters
    ----------
    axis : (3,) floats
        The probe's +z (tip to spindle) in the machine frame, unit vector.
    rotation : float
        Turn of the probe about its own axis. [rad]
    """

    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    rotation: float = 0.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.rotation):
            raise DescriptionError(f"the probe's rotation is {self.rotation:g}; it must be finite")
        length = math.hypot(*self.axis)
        if not abs(length - 1.0) <= 1e-3:
            raise DescriptionError(
                f"the probe axis {self.axis} has length {length:g}; give a unit vector"
            )

    @property
    def matrix(self) -> FloatArray:
        """Rotation from the probe's frame to the machine's, (3, 3)."""
        return probe_rotation(self.axis, self.rotation)


@dataclass(frozen=True)
class Probe:
    """A described probe: all quantities that a prediction depends on.

    Parameters
    ----------
    name : str
    tripod, seats : Tripod, Seats
    preload : float
        Spring force along the probe axis, pressing the tripod into its seats. [N]
    hub_offset : float
        From the plane of the rod axes to the stylus's root; the rigid part of the
        lever. [mm]
    stylus : StylusSegments
        From the hub to the tip centre.
    tip : Tip
    hub, step : Hub, StepGeometry, optional
        The solid between rods and stylus, for finite elements: one or the other.
    moving, orientation : Moving, Orientation, optional
    criterion : str
        Of an electric contact first_contact or arm_lift; piezo_stage of a piezo element.
    threshold : float
        Seat reaction (first_contact), or sum of a rod's two (arm_lift), at
        which the circuit opens; force on the tip at which a piezo stage triggers. [N]
    spring_offset : two floats
        x and y of the line of the spring's force: Ren's t cos δ₁ and t sin δ₁. [mm]
    opening : float, optional
        Woźniak's a: how far the contact of a rod that lifts opens before the circuit is broken.
        [mm]
    materials : tuple of Material, optional
        Those that the description states itself; a part may be of one, see `part_material`.

    Raises
    ------
    DescriptionError
        A probe with impossible dimensions, or one that its seats cannot hold.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> load_probe("omp40-2").lever
    64.4
    """

    name: str
    tripod: Tripod
    seats: Seats
    preload: float
    hub_offset: float
    stylus: tuple[StylusSegment, ...]
    tip: Tip
    hub: Hub | None = None
    step: StepGeometry | None = None
    moving: Moving = field(default_factory=Moving)
    orientation: Orientation = field(default_factory=Orientation)
    criterion: str = "first_contact"
    threshold: float = 0.0
    spring_offset: tuple[float, float] = (0.0, 0.0)
    opening: float | None = None
    materials: tuple[Material, ...] = ()

    def __post_init__(self) -> None:
        _positive(self.preload, "the spring preload", "N", STRONGEST)
        if not 0.0 <= self.hub_offset <= LONGEST:
            raise DescriptionError(
                f"the hub offset is {self.hub_offset:g} mm; it must lie between 0 and {LONGEST:g}"
            )
        if self.seats.ball_radius >= self.tripod.radius:
            raise DescriptionError(
                f"seat balls of radius {self.seats.ball_radius:g} mm do not fit at a tripod radius "
                f"of {self.tripod.radius:g} mm"
            )
        if not self.stylus:
            raise DescriptionError("the stylus has no segment")
        carrier = self.stylus[-1]
        if self.tip.radius < 0.5 * carrier.diameter:
            raise DescriptionError(
                f"a tip of {2.0 * self.tip.radius:g} mm diameter is smaller than the stem of "
                f"{carrier.diameter:g} mm diameter that carries it: the stem would touch first"
            )
        if self.stylus_length <= self.tip.radius:
            raise DescriptionError(
                f"the stylus ({self.stylus_length:g} mm to the tip centre) is shorter than the "
                f"tip's radius ({self.tip.radius:g} mm)"
            )
        if self.criterion not in CRITERIA:
            raise DescriptionError(
                f"the trigger criterion is '{self.criterion}'; known are {', '.join(CRITERIA)}"
            )
        if not (math.isfinite(self.threshold) and self.threshold >= 0.0):
            raise DescriptionError(
                f"the trigger threshold is {self.threshold:g} N; it cannot be negative"
            )
        self._check_transducer()
        if not all(abs(value) <= LONGEST for value in self.spring_offset):
            raise DescriptionError(
                f"the spring's offset {self.spring_offset} is not two lengths below {LONGEST:g} mm"
            )
        self._check_moving()
        self._check_seating()

    def _check_moving(self) -> None:
        lowest = -self.lever - self.tip.radius
        if self.moving.mass > 0.0 and self.moving.height < lowest:
            raise DescriptionError(
                f"the centre of the moving mass lies {-self.moving.height:g} mm below the plane of "
                f"the rods, and the tip ends at {-lowest:g} mm: correct height_mm of [moving]"
            )
        known = sum(
            0.25 * math.pi * part.diameter**2 * part.length * part.material.density
            for part in self.stylus
        )
        known += 4.0 / 3.0 * math.pi * self.tip.radius**3 * self.tip.material.density
        if 0.0 < self.moving.mass < _LIGHTEST * known:
            raise DescriptionError(
                f"the moving mass is {1e3 * self.moving.mass:g} g, and stylus and tip alone, which "
                f"are a part of it, are {1e3 * known:.2g} g: was it meant in kg? mass_g is in g"
            )

    def _check_transducer(self) -> None:
        if self.criterion == PIEZO_STAGE and not self.threshold > 0.0:
            raise DescriptionError(
                f"a piezo stage triggers at a force on the tip: give it as threshold_N of "
                f"[trigger], which is {self.threshold:g} N"
            )
        if self.opening is None:
            return
        if not 0.0 <= self.opening <= WIDEST:
            raise DescriptionError(
                f"the opening of the contact is {1e3 * self.opening:g} µm; it must lie between 0 "
                f"and {1e3 * WIDEST:g} µm"
            )
        if self.criterion != "arm_lift":
            raise DescriptionError(
                f"the opening of a contact is that of a rod that lifts; the criterion "
                f"'{self.criterion}' has none: make it 'arm_lift', or leave opening_um out"
            )

    def part_material(self, name: Material | str | None = None) -> Material:
        """The material of a part by its name: of the description, or of the package.

        Parameters
        ----------
        name : Material or its name, optional
            Steel when not given; a material is returned as it is.

        Raises
        ------
        DescriptionError
            No such material.
        """
        if isinstance(name, Material):
            return name
        try:
            return material(
                name or default_workpiece().name, {own.name: own for own in self.materials}
            )
        except DescriptionError as error:
            raise DescriptionError(str(error), inputs=("workpiece",)) from None

    @property
    def uneven(self) -> bool:
        """Whether rods or seats differ from each other, or the spring acts off the axis."""
        return any(
            (*self.tripod.radius_deviations, self.seats.right_less_left, *self.spring_offset)
        )

    def refuse_uneven(self, what: str) -> None:
        """Refuse an uneven probe for what is made for even ones.

        Raises
        ------
        DescriptionError
        """
        if self.uneven:
            raise DescriptionError(
                f"{what} needs three equal rods, equal seats and a spring on the axis: leave "
                "radius_deviations_mm, right_less_left_deg and the spring's offset_mm out, or use "
                "the model analytic"
            )

    def refuse_tip_friction(self, what: str) -> None:
        """Refuse a friction of the tip for what does not contain it.

        Raises
        ------
        DescriptionError
        """
        if self.tip.friction > 0.0:
            raise DescriptionError(
                f"{what}: the friction {self.tip.friction:g} of [tip] is not contained. Predict "
                "with the model wozniak and opening_um or a piezo stage in [trigger], or set it to "
                "0 (simulate has an option for friction)"
            )

    def _check_seating(self) -> None:
        azimuths = np.sort(np.mod(self.tripod.rod_azimuths, 2.0 * math.pi))
        gaps = np.diff(np.append(azimuths, azimuths[0] + 2.0 * math.pi))
        if gaps.max() >= math.pi - 1e-6:
            degrees = ", ".join(f"{a / DEGREE:g}°" for a in self.tripod.rod_azimuths)
            raise DescriptionError(
                f"rods at {degrees} leave a gap of {gaps.max() / DEGREE:.0f}°: with half of the "
                "circle empty, the spring tilts the tripod off its seats; spread the rods "
                "(usually 0°, 120°, 240°)"
            )
        if gaps.min() <= 5.0 * DEGREE:
            raise DescriptionError(
                f"two rods are only {gaps.min() / DEGREE:.1f}° apart: they cannot hold the tripod"
            )

    @property
    def stylus_length(self) -> float:
        """Root of the stylus to tip centre. [mm]"""
        return float(sum(segment.length for segment in self.stylus))

    @property
    def lever(self) -> float:
        """Tip centre to the plane of the rod axes. [mm]"""
        return self.stylus_length + self.hub_offset

    @property
    def stem(self) -> StylusSegment:
        """The longest segment of the stylus."""
        return max(self.stylus, key=lambda segment: segment.length)

    def with_friction(self, friction: float) -> Probe:
        """The same probe with another friction at its seats.

        Parameters
        ----------
        friction : float
            Coulomb's coefficient.

        Raises
        ------
        DescriptionError
            A coefficient that is out of range.

        >>> from pretravel.prediction.catalogue import load_probe
        >>> load_probe("omp40-2").with_friction(0.2).seats.friction
        0.2
        """
        return replace(self, seats=replace(self.seats, friction=friction))

    def with_lever(self, lever: float, *, shorten: bool = False) -> Probe:
        """The same probe with another lever: the hub offset changes, the stylus does not.

        Parameters
        ----------
        lever : float
            Tip centre to the plane of the rod axes. [mm]
        shorten : bool
            For models that use the lever only: a lever shorter than the stylus
            makes the stylus a single piece of that length, with the stem's section.

        Raises
        ------
        DescriptionError
            A lever shorter than the stylus, unless it may be shortened.

        >>> from pretravel.prediction.catalogue import load_probe
        >>> load_probe("omp40-2").with_lever(50.0).hub_offset
        0.0
        """
        _positive(lever, "the lever")
        if lever < self.stylus_length - 1e-9 and shorten:
            return replace(self, hub_offset=0.0, stylus=(replace(self.stem, length=lever),))
        if lever < self.stylus_length - 1e-9:
            raise DescriptionError(
                f"a lever of {lever:g} mm is shorter than the stylus of {self.stylus_length:g} mm; "
                "describe a shorter stylus instead (pretravel probes NAME > mine.toml)"
            )
        return replace(self, hub_offset=max(lever - self.stylus_length, 0.0))
