"""Whether a qualified map is plausible and well covered: warnings for people, as sentences."""

from __future__ import annotations

import numpy as np

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    FloatArray,
    azimuth_angle,
    describe,
    from_angles,
    polar_angle,
)
from pretravel.maps import (
    IMPLAUSIBLE_PRETRAVEL,
    Observation,
    PretravelMap,
    QualificationSetup,
    Scatter,
    axis_note,
    hidden_lobes,
    some_directions,
)

_TOLD = 0.2
"""Share of lobes that an oval leaves: of the usual 25 directions 0.95, of nine with one ring of two
turned by half a step 0.67, of the same five azimuths on each ring 0.01."""
FEWEST_TO_SEE_LOBES = 8
"""Directions below which the lobes of three rods are not seen."""
_IN_A_PLANE = 0.01
"""Share of the variance of heights that touches which follow a plane may leave; two heights that
were chosen leave a fifth or more."""
LOWEST_POLAR = 60.0 * DEGREE
"""Touches that do not reach this polar angle hardly determine centre and radius. [rad]"""
_WALLS = 80.0 * DEGREE
"""Touches that do not reach this polar angle say nothing of the walls of a part. [rad]"""
_USUAL_GAP = 100.0 * DEGREE
"""Largest usual gap between azimuths: patterns have four azimuths or more. [rad]"""
_UNKNOWN_SIZE = 20.0 * MICROMETRE
"""Standard uncertainty of a constant from which a map is relative to its mean. [mm]"""
_BEFORE_CONTACT = 1.0 * MICROMETRE
"""What the diameters of a reference and a tip can be wrong by, as calibrated. [mm]"""

_THROUGH_THE_SPHERE = 150.0 * DEGREE
"""A shank that is thinner than half of the sphere does not reach beyond. [rad]"""


def repeat_warnings(repeatability: Scatter, *, repeated: bool) -> list[str]:
    """What the stated repeatability rests on.

    Parameters
    ----------
    repeatability : Scatter
    repeated : bool
        Whether any direction was touched more than once.
    """
    if repeated or repeatability.dof >= 3.0:
        return []
    return [
        (
            "no direction was repeated, and the directions are too few to determine the "
            f"repeatability: {repeatability.deviation / MICROMETRE:.2f} µm is a usual value, not "
            "a measured one. Touch each direction several times"
        )
    ]


def copy_warnings(copies: int, count: int) -> list[str]:
    """Repeats that are alike to the last digit, which say nothing of noise.

    Parameters
    ----------
    copies : int
        By `copied_readings`.
    count : int
        Of all touches.
    """
    if not copies:
        return []
    return [
        (
            f"{copies} of the {count} touches are identical to others of their direction: copies "
            f"of {count - copies} readings, not repeats. Copies do not show the noise, and u of "
            "the map is too small because they count as independent touches. Give each reading once"
        )
    ]


def map_warnings(
    pretravel_map: PretravelMap, observation: Observation, *, tip_is_fitted: bool = False
) -> list[str]:
    """What of a map is implausible or badly covered.

    Parameters
    ----------
    pretravel_map : PretravelMap
    observation : Observation
        That it was fitted to.
    tip_is_fitted : bool
        The tip was not given, and its radius was fitted together with the map.
    """
    found = []
    count = observation.direction_count
    if count < FEWEST_TO_SEE_LOBES:
        found.append(
            f"{count} directions do not show the lobes of a probe with three rods: u of the map "
            "can only contain lobes of a usual size; touch 25 directions"
        )
    elif hidden_lobes(observation) is not None:
        found.append(
            "the touched directions show the lobes of three rods as a shift of the centre (as four "
            "azimuths 90° apart do): u of the map can only contain lobes of a usual size, and the "
            "map can be wrong by more; touch eight azimuths"
        )
    elif _lobes_look_like_fewer(observation.group_directions):
        found.append(
            "touches at these azimuths cannot distinguish three lobes from two or from none. u of "
            "the map holds for a usual probe with three rods; the map of a probe of another design "
            "can be wrong by more. Touch eight equally spaced azimuths, or shift the azimuths by "
            "half a step from each polar angle to the next"
        )
    largest_polar = float(polar_angle(observation.directions).max())
    if not observation.ring:
        found += _coverage_warnings(pretravel_map, observation.directions, largest_polar)
    if not observation.ring and largest_polar > _THROUGH_THE_SPHERE:
        found.append(
            f"the touches reach to polar {largest_polar / DEGREE:.0f}°, where a stylus along the "
            "probe axis would go through the sphere: check the axis (it points from the tip to the "
            "spindle), unless this is a side stylus"
        )
    if not observation.tip_known and not tip_is_fitted:
        found.append(
            "the tip's diameter was not given: the map is relative to its mean, and the centre's "
            "height along the axis is that of the least-squares sphere, usually 5 to 15 µm off"
        )
    directions, value, u = pretravel_map.over_support()
    highest = int(np.argmax(value))
    before = before_contact(pretravel_map, observation)
    found += filter(None, [before, axis_note(pretravel_map)])
    if value[highest] > IMPLAUSIBLE_PRETRAVEL:
        found.append(
            f"pretravel rises to {value[highest] / MICROMETRE:.1f} µm at "
            f"{describe(directions[highest])}; probes deflect by 1 to 80 µm: check the diameters "
            "of reference and tip, the feed and the touches there"
        )
    touched = some_directions(observation.group_directions) @ pretravel_map.rotation.T
    at_touches = pretravel_map.standard_uncertainty(touched)
    if u.max() > 5.0 * max(at_touches.max(), pretravel_map.single_touch):
        found.append(
            f"between the touches u of the map grows to {u.max() / MICROMETRE:.1f} µm, at "
            f"{describe(directions[np.argmax(u)])}: touch the reference there too"
        )
    return found


def before_contact(pretravel_map: PretravelMap, observation: Observation) -> str:
    """A sentence if the probe would trigger before contact by this map; else empty.

    Parameters
    ----------
    pretravel_map : PretravelMap
    observation : Observation
        Where tip or reference have no known size, the map is relative to its mean.
    """
    directions, value, u = pretravel_map.over_support()
    lowest = int(np.argmin(value))
    known = observation.tip_known and observation.u_constant < _UNKNOWN_SIZE
    if not known or value[lowest] >= -_BEFORE_CONTACT - 3.0 * u[lowest]:
        return ""
    return (
        f"pretravel falls to {value[lowest] / MICROMETRE:.1f} µm at "
        f"{describe(directions[lowest])}, but no probe triggers before contact: "
        "check the diameters of reference and tip, and the touches there"
    )


def _coverage_warnings(
    pretravel_map: PretravelMap, directions: FloatArray, largest_polar: float
) -> list[str]:
    """Whether a part of the sphere was not touched, as by a program that stopped."""
    found = []
    if largest_polar < LOWEST_POLAR:
        found.append(
            f"the touches reach only to polar {largest_polar / DEGREE:.0f}°: a cap hardly "
            "determines centre and effective radius; touch the sphere down to its equator"
        )
    elif largest_polar < _WALLS:
        found.append(
            f"the touches reach only to polar {largest_polar / DEGREE:.0f}°: the map does not hold "
            "for walls (polar 90°), and touches there are refused. Touch the sphere down to its "
            "equator; did the program stop before?"
        )
    azimuths = np.sort(azimuth_angle(directions[polar_angle(directions) > _OFF_THE_POLE]))
    gaps = np.diff(azimuths, append=azimuths[:1] + 2.0 * np.pi)
    at = int(np.argmax(gaps)) if len(gaps) else 0
    if len(gaps) and gaps[at] > _USUAL_GAP:
        middle = from_angles(min(largest_polar, _WALLS), azimuths[at] + 0.5 * gaps[at])
        if pretravel_map.support.supports(np.atleast_2d(middle))[0]:
            return found
        begin, end = azimuths[at] / DEGREE, azimuths[(at + 1) % len(azimuths)] / DEGREE
        found.append(
            f"no touch is between the azimuths {begin:.0f}° and {end:.0f}°: the map does not hold "
            "there, and touches of a part there are refused. Touch all sides of the sphere; did "
            "the program stop before?"
        )
    return found


_OFF_THE_POLE = 20.0 * DEGREE
"""Directions nearer to the pole have no azimuth to speak of. [rad]"""


def _lobes_look_like_fewer(directions: FloatArray) -> bool:
    """Whether touches tell three lobes of some azimuth neither from an oval nor from none.

    At five azimuths cos 3φ is cos 2φ; at six, sin 3φ is zero.

    Parameters
    ----------
    directions : (n, 3) float
        Outward unit vectors. Probe frame.

    >>> from pretravel.base.directions import from_angles
    >>> ring = np.arange(5) * 72.0 * DEGREE
    >>> steep, level = np.full(5, 45.0 * DEGREE), np.full(5, 90.0 * DEGREE)
    >>> _lobes_look_like_fewer(from_angles(np.append(steep, level), np.append(ring, ring)))
    True
    >>> turned = np.append(ring + 36.0 * DEGREE, ring)
    >>> _lobes_look_like_fewer(from_angles(np.append(steep, level), turned))
    False
    """
    x, y, z = directions.T
    oval = [x**2 + y**2, x**2 - y**2, 2.0 * x * y]
    u, size, _ = np.linalg.svd(np.stack([np.ones_like(x), x, y, z, *oval], 1), full_matrices=False)
    fewer = u[:, size > 1e-6 * size[0]]
    lobes = np.stack([x**3 - 3.0 * x * y**2, 3.0 * x**2 * y - y**3], 1)
    left = lobes - fewer @ (fewer.T @ lobes)
    # Of lobes of any azimuth half of the squares of both; of those that are seen least the least.
    least = float(np.linalg.eigvalsh(left.T @ left)[0])
    return least < _TOLD * 0.5 * float(np.sum(lobes**2))


def inclined_ring_warnings(in_probe: FloatArray, setup: QualificationSetup) -> list[str]:
    """Whether the touches of a ring follow a plane that is inclined to the axis of the probe.

    A ring that is inclined by t has an oval section, whose mean diameter is wrong by a quarter of
    the diameter times t².

    Parameters
    ----------
    in_probe : (n, 3) float
        Tip centres, probe frame. [mm]
    setup : QualificationSetup
    """
    middle = in_probe - in_probe.mean(axis=0)
    slope = np.linalg.lstsq(middle[:, :2], middle[:, 2], rcond=None)[0]
    left = middle[:, 2] - middle[:, :2] @ slope
    error = 0.25 * setup.diameter * float(slope @ slope)
    plane = float(left @ left) < _IN_A_PLANE * float(middle[:, 2] @ middle[:, 2])
    if not (setup.ring and plane and error > setup.u_reference_diameter):
        return []
    return [
        (
            "the touches lie in a plane that is inclined by "
            f"{np.hypot(*slope) / DEGREE:.2f}°: if the ring lies so, its oval section makes the "
            f"diameter wrong by about {error / MICROMETRE:.1f} µm, which U does not contain. Align "
            "the ring, or give the probe's axis as that of the ring"
        )
    ]


def height_warnings(u_height: float, observation: Observation) -> list[str]:
    """Whether heights rest on a model of the probe, because no touch is near the pole.

    Parameters
    ----------
    u_height : float
        Standard uncertainty of the centre along the axis of the probe. [mm]
    observation : Observation
        A ring determines no height.
    """
    if observation.ring or polar_angle(observation.directions).min() <= _OFF_THE_POLE:
        return []
    return [
        (
            "no touch is near the pole: heights of the sphere's centre (u = "
            f"{u_height / MICROMETRE:.1f} µm) and of faces that are touched along the probe axis "
            "rest on a usual stiffness of probes along the axis. Touch the sphere at its pole too"
        )
    ]
