"""The closed form of the Abbé paper (Ren 2020): for a described probe, and for the paper's rig."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, as_numbers, checked_unit
from pretravel.prediction.beam import cantilever_compliance
from pretravel.prediction.compliance.base import TIP_ON_PART, ComplianceModel
from pretravel.prediction.description import Probe
from pretravel.prediction.loading import Loading
from pretravel.prediction.materials import Material
from pretravel.prediction.seats import seat_coefficient
from pretravel.six_seats import ball_on_flat, seat_triads, tip_wrenches

Sensed = Literal["paper", "rod", "tip"]
"""What a pretravel is measured of: L_c + L_p - L_k, + L_k, or without L_k."""
_OF_COMPRESSION: dict[Sensed, float] = {"paper": -1.0, "rod": 1.0, "tip": 0.0}

LEVER_TO_SEATS = 1.5
"""The height of the seats' triangle over its circumradius: from a rod to the line of the others."""


@dataclass(frozen=True)
class Ren(ComplianceModel):
    """A tilt from the recovery of one seat, bending of the stem, contact of tip and part.

    Shares: ``seat_tilt``, ``stylus_bending``, ``tip_on_part``.

    Notes
    -----
    L_c is Hertz's indentation of one seat under the whole trigger force, magnified by lever
    over the height of the seats' triangle; L_p is the stem as one cantilever of the stylus's
    length; both act across the axis, where the paper has its forces. L_k adds to the spindle's
    travel; the paper subtracts it, since its laser measures the tip (`ren_pretravel` is the
    paper's own sum).

    References
    ----------
    Ren 2020, equations 5 to 12.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.trigger import predict
    >>> sorted(predict(load_probe("omp40-2"), [[1.0, 0.0, 0.0]], "ren").shares)
    ['seat_tilt', 'stylus_bending', 'tip_on_part']
    """

    name = "ren"

    def displacements(self, loading: Loading) -> Mapping[str, FloatArray]:
        probe, stem = loading.probe, loading.probe.stem
        lateral = loading.directions * np.array([1.0, 1.0, 0.0])
        across = np.linalg.norm(lateral, axis=1)
        toward = lateral / np.maximum(across, 1e-300)[:, None]
        force = loading.force * across
        ratio = probe.lever / (LEVER_TO_SEATS * probe.tripod.radius)
        rigid = probe.seats.contact == "rigid"
        recovery = 0.0 if rigid else seat_coefficient(probe) * np.cbrt(force**2)
        bending = cantilever_compliance(
            probe.stylus_length, stem.diameter, stem.material.youngs_modulus
        )
        return {
            "seat_tilt": (ratio * recovery * np.ones_like(force))[:, None] * toward,
            "stylus_bending": (bending * force)[:, None] * toward,
            TIP_ON_PART: loading.tip_approach,
        }


MODEL = Ren()


@dataclass(frozen=True, kw_only=True)
class RenProbe:
    """The probe of the paper, with the paper's quantities.

    Parameters
    ----------
    lever, lever_ratio : float
        L [mm] and L / L_a.
    stylus_diameter, stylus_modulus : float
        d [mm] and E of the stylus [MPa].
    contact_coefficient : float
        n_delta.
    seat_radii, seat_moduli : two floats each
        R1, R2 [mm] and E1, E2 [MPa] of ball and rod.
    tip_radius, tip_modulus, part_modulus : float
        r [mm], E3 and E4 [MPa]. The paper calls r the ball's diameter and uses 4 mm; Hertz's
        formula has the radius there.
    poissons_ratios : four floats
        mu1 to mu4: ball, rod, tip, part.
    """

    lever: float
    lever_ratio: float
    stylus_diameter: float
    stylus_modulus: float
    contact_coefficient: float
    seat_radii: tuple[float, float]
    seat_moduli: tuple[float, float]
    tip_radius: float
    tip_modulus: float
    part_modulus: float
    poissons_ratios: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class RenPretravel:
    """The three terms of Ren 2020, equation 12. [mm]

    Attributes
    ----------
    rigid : (n,) float
        L_c: rigid rotation of the stylus from one seat's elastic recovery.
    bending : (n,) float
        L_p: bending of the stylus.
    compression : (n,) float
        L_k: tip on part; the laser on the tip does not see it, so it is subtracted.
    """

    rigid: FloatArray
    bending: FloatArray
    compression: FloatArray

    @property
    def pretravel(self) -> FloatArray:
        """L_c + L_p - L_k, equation 5. [mm]"""
        return self.rigid + self.bending - self.compression


def ren_pretravel(force: npt.ArrayLike, probe: RenProbe) -> RenPretravel:
    """Compute the pretravel that the Abbé rig measures, in closed form.

    Parameters
    ----------
    force : (n,) float
        Trigger force. [N]
    probe : RenProbe

    Returns
    -------
    RenPretravel

    References
    ----------
    Ren 2020, equations 6 to 12. Equation 13 prints the two Hertz terms ten times
    too small; the bending term is right.

    >>> probe = RenProbe(lever=18.0, lever_ratio=1.5, stylus_diameter=2.0,
    ...     stylus_modulus=200e3, contact_coefficient=0.9744, seat_radii=(1.0, 1.0),
    ...     seat_moduli=(200e3, 200e3), tip_radius=4.0, tip_modulus=620e3,
    ...     part_modulus=200e3)
    >>> terms = ren_pretravel(1.0, probe)
    >>> [f"{float(term):.3g}" for term in (terms.rigid, terms.bending, terms.compression)]
    ['0.000641', '0.0124', '0.000183']
    """
    f = np.asarray(force, dtype=np.float64)
    compliances = [
        (1.0 - nu**2) / modulus
        for nu, modulus in zip(
            probe.poissons_ratios,
            (*probe.seat_moduli, probe.tip_modulus, probe.part_modulus),
            strict=True,
        )
    ]
    first, second = probe.seat_radii
    seat = (compliances[0] + compliances[1]) ** 2 * (2.0 * second + first) / (second * first)
    recovery = 0.655 * probe.contact_coefficient * np.cbrt(seat * f**2)
    tip = (compliances[2] + compliances[3]) ** 2 / probe.tip_radius
    bending = cantilever_compliance(probe.lever, probe.stylus_diameter, probe.stylus_modulus)
    return RenPretravel(
        rigid=np.asarray(probe.lever_ratio * recovery),
        bending=np.asarray(bending * f),
        compression=np.asarray(0.8255 * np.cbrt(tip * f**2)),
    )


@dataclass(frozen=True)
class RenTerms:
    """Equation 12 by its three coefficients, as the paper's equation 13.

    Parameters
    ----------
    rigid, compression : float
        Of force^(2/3). [mm/N^(2/3)]
    bending : float
        Of the force. [mm/N]

    >>> RenTerms(0.0, 0.01, 0.0).force(0.001)
    array(0.1)
    """

    rigid: float
    bending: float
    compression: float

    def force(self, pretravel: npt.ArrayLike, *, sensed: Sensed = "paper") -> FloatArray:
        """Trigger force from pretravel (equation 14).

        Parameters
        ----------
        pretravel : (n,) float
            [mm]
        sensed : str
            ``paper``: L_c + L_p - L_k; ``rod``: of a push rod or spindle, L_c + L_p + L_k;
            ``tip``: of the tip's centre, as a laser sees it, L_c + L_p.

        Returns
        -------
        (n,) float
            Not a number for a negative pretravel. [N]

        Raises
        ------
        PretravelError
            A compression that exceeds the rotation: then no single force belongs to a pretravel.

        Notes
        -----
        With x = force^(1/3) it is the only positive root of bending x³ + c x² = pretravel.
        """
        curved = self.rigid + _OF_COMPRESSION[sensed] * self.compression
        if curved < 0.0 or not self.bending > 0.0:
            raise PretravelError(
                f"the coefficient of force^(2/3) is {curved:g} mm and that of the force "
                f"{self.bending:g} mm: pretravel must rise with the force to determine it"
            )
        travel = np.asarray(pretravel, dtype=np.float64)
        target = np.where(travel >= 0.0, travel, np.nan)
        # From above: the curve is convex there, so that Newton's steps only decrease.
        x = np.cbrt(target / self.bending)
        for _ in range(60):
            slope = 3.0 * self.bending * x**2 + 2.0 * curved * x
            value = self.bending * x**3 + curved * x**2 - target
            x = x - np.where(slope > 0.0, value, 0.0) / np.where(slope > 0.0, slope, 1.0)
        return np.asarray(x**3)

    def crossover(self) -> float:
        """Force from which the bending exceeds the rotation (Figure 6). [N]

        >>> round(RenTerms(6.4e-4, 0.0124, 1.8e-4).crossover(), 6)
        0.000137
        """
        return (self.rigid / self.bending) ** 3


def ren_terms_of(probe: RenProbe | Probe, part: Material | None = None) -> RenTerms:
    """Compute the coefficients of equation 12.

    Parameters
    ----------
    probe : RenProbe or Probe
        A described probe, as in the model ``ren``, across its axis.
    part : Material, optional
        Of what touches the tip of a described probe; as stiff as steel when not given.

    Returns
    -------
    RenTerms

    References
    ----------
    Ren 2020, equation 13.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> terms = ren_terms_of(load_probe("omp40-2"))
    >>> terms.bending > 0.0
    True
    """
    if isinstance(probe, RenProbe):
        one = ren_pretravel(1.0, probe)
        return RenTerms(float(one.rigid), float(one.bending), float(one.compression))
    if part is None:
        from pretravel.prediction.materials import material

        part = material("steel")
    rigid = probe.lever / (LEVER_TO_SEATS * probe.tripod.radius) * seat_coefficient(probe)
    stem = probe.stem
    return RenTerms(
        0.0 if probe.seats.contact == "rigid" else rigid,
        float(
            cantilever_compliance(probe.stylus_length, stem.diameter, stem.material.youngs_modulus)
        ),
        float(ball_on_flat(1.0, probe.tip.radius, probe.tip.material.contact_modulus(part))),
    )


@dataclass(frozen=True, kw_only=True)
class RenSeats:
    """The seats of Figure 5a: three pins that may differ, and an eccentric spring.

    Parameters
    ----------
    distances : three floats
        m, g, s: from the probe's centre to the pins A (on +x), B and C, 120° apart. [mm]
    left_angle, right_angle : float
        alpha, beta: of the force of the left and the right ball from the line of their centres,
        which is horizontal. [rad]
    preload : float
        K: spring and weight. [N]
    eccentricity, eccentric_azimuth : float
        t and delta_1: distance and direction of the preload from the centre. [mm], [rad]
    lever : float
        L: from the plane of the pins to the centre of the tip. [mm]
    """

    distances: tuple[float, float, float]
    left_angle: float
    right_angle: float
    preload: float
    lever: float
    eccentricity: float = 0.0
    eccentric_azimuth: float = 0.0


def ren_trigger_force(directions: npt.ArrayLike, seats: RenSeats) -> FloatArray:
    """Compute the force at which the first of the six balls of Figure 5a carries no load.

    Parameters
    ----------
    directions : (n, 3) float
        Unit directions of the force on the tip: (sin δ cos θ, sin δ sin θ, cos δ).
    seats : RenSeats

    Returns
    -------
    (n,) float
        Infinite where the force loads every ball. [N]

    Raises
    ------
    PretravelError
        Lengths that are not positive; seats that do not hold the pins at rest.

    References
    ----------
    Ren 2020, section 3.1: six equations of equilibrium, which the paper names but does not print.

    >>> even = RenSeats(distances=(5.0, 5.0, 5.0), left_angle=0.8, right_angle=0.8, preload=0.5,
    ...                 lever=18.0)
    >>> ren_trigger_force([[0.0, 0.0, 1.0]], even).round(9).tolist()
    [0.5]
    """
    d = checked_unit(as_numbers(directions, "directions"), "directions")
    for name, value in (("lever", seats.lever), ("preload", seats.preload)):
        if not (math.isfinite(value) and value > 0.0):
            raise PretravelError(f"the {name} is {value:g}; it must be positive")
    azimuths = np.arange(3) * 2.0 * np.pi / 3.0
    angles = np.array([seats.left_angle, seats.right_angle] * 3)
    frame = seat_triads(azimuths, seats.distances, angles)
    x, y = (seats.eccentricity * turn(seats.eccentric_azimuth) for turn in (math.cos, math.sin))
    spring = seats.preload * np.array([0.0, 0.0, -1.0, -y, x, 0.0])
    try:
        rest = -np.linalg.solve(frame.wrenches, spring)
        tip = tip_wrenches(np.array([0.0, 0.0, -seats.lever]))
        change = -np.linalg.solve(frame.wrenches, tip @ d.T).T
    except np.linalg.LinAlgError:
        raise PretravelError(
            "these seats do not determine the place of the pins: distances must be positive and "
            "angles between 0 and 90°"
        ) from None
    if not rest.min() > 0.0:
        raise PretravelError(
            f"at rest one ball would pull with {-rest.min():.3g} N: the preload acts "
            f"{seats.eccentricity:g} mm from the centre, outside of what the pins can carry"
        )
    with np.errstate(divide="ignore", invalid="ignore"):
        forces = np.where(change < 0.0, -rest / change, np.inf)
    return np.asarray(forces.min(axis=1))
