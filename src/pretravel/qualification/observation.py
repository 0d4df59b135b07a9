"""Touches on a reference, seen about its centre; and refusals of what cannot be right."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.directions import describe, unit
from pretravel.errors import ConvergenceError, PretravelError
from pretravel.touches import Touches
from pretravel.uncertainty.fitting.sphere import fit_sphere
from pretravel.units import DEGREE, INCH, MICROMETRE, delay_travel

LARGEST_PRETRAVEL = 0.15
"""A mean pretravel above this says that a diameter is wrong. [mm]

Probes give by 1 to 80 um."""
LONGEST_DELAY = 0.03
"""Signal delay that is allowed for on top, where the touches tell their feed. [s]"""
SMALLEST_PRETRAVEL = -0.02
"""A mean pretravel below this says the same: no probe triggers before contact. [mm]"""
NORMAL_TOLERANCE = 10.0 * DEGREE
"""How far a given normal may be from that of the fitted sphere or ring. [rad]"""
_SAME_DIRECTION = 1e-3


@dataclass(frozen=True, eq=False)
class Observation:
    """Touches about a centre: what the map is fitted to. All in the probe frame."""

    positions: FloatArray
    groups: IntArray
    center: FloatArray
    reference_radius: float
    tip_radius: float
    ring: bool
    tip_known: bool = True
    """Whether the tip radius was told; else it is what the touches themselves imply."""

    @property
    def axes(self) -> int:
        """How many coordinates of the centre the reference tells: a ring not the axis's."""
        return 2 if self.ring else 3

    @cached_property
    def _offset(self) -> FloatArray:
        return np.asarray((self.positions - self.center)[:, : self.axes])

    @cached_property
    def directions(self) -> FloatArray:
        """Contact normals, (n, 3)."""
        outward = unit(self._offset)
        if self.ring:
            return np.hstack([-outward, np.zeros((len(outward), 1))])
        return outward

    @cached_property
    def values(self) -> FloatArray:
        """Observed pretravel, (n,). [mm]"""
        distance = np.linalg.norm(self._offset, axis=1)
        if self.ring:
            return np.asarray(distance - (self.reference_radius - self.tip_radius))
        return np.asarray(self.reference_radius + self.tip_radius - distance)

    def take(self, mask: BoolArray) -> Observation:
        """The touches of a mask, about the same centre."""
        groups = np.unique(self.groups[mask], return_inverse=True)[1]
        return replace(self, positions=self.positions[mask], groups=groups)

    @property
    def free_terms(self) -> IntArray:
        """Harmonics that are the mean, and what a shift of the centre looks like."""
        return np.array([(0, 0), (1, 1), (1, -1), (1, 0)][: self.axes + 1], dtype=np.int64)

    @cached_property
    def free_design(self) -> FloatArray:
        """Columns 1, n_x, n_y (and n_z), (n, axes + 1)."""
        return np.hstack([np.ones((len(self.groups), 1)), self.directions[:, : self.axes]])

    @cached_property
    def to_sphere(self) -> FloatArray:
        """What a least-squares sphere makes of any values: mean, then shift, (axes + 1, n)."""
        return np.asarray(np.linalg.pinv(self.free_design))

    @cached_property
    def group_directions(self) -> FloatArray:
        """Mean contact normal of each direction, (g, 3)."""
        total = np.zeros((int(self.groups.max()) + 1, 3))
        np.add.at(total, self.groups, self.directions)
        return unit(total)


def observe(
    touches: Touches,
    diameter: float,
    ring: bool,
    tip_diameter: float | None,
    rotation: FloatArray,
) -> Observation:
    """Touches about their least-squares centre, once everything was seen to fit together.

    Parameters
    ----------
    touches : Touches
    diameter : float
        Of the reference. [mm]
    ring : bool
    tip_diameter : float or None
        [mm]
    rotation : (3, 3) float
        Probe to machine frame.

    Returns
    -------
    Observation

    Raises
    ------
    PretravelError
        Too few touches, all in one plane, diameters or units that do not fit, normals
        that do not.
    """
    what = "ring" if ring else "sphere"
    for name, value in ((f"the {what}'s diameter", diameter), ("the tip diameter", tip_diameter)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise PretravelError(f"{name} is {value:g} mm; it must be positive")
    source = f"{touches.source}: " if touches.source else ""
    groups = _repeats(touches.normals)
    directions = int(groups.max()) + 1
    least = 4 if ring else 5
    if directions < least:
        raise PretravelError(
            f"{source}{len(touches)} touches in {directions} "
            f"direction{'s' if directions > 1 else ''} are too few: a {what} needs "
            f"touches in at least {least} directions"
            + ("" if ring else ", one of them far from the plane of the others")
        )
    _refuse_strays(touches, 0.5 * diameter, source)
    in_probe = touches.positions @ rotation
    if not ring:
        _refuse_plane(touches, source)
    try:
        fit = fit_sphere(in_probe[:, :2] if ring else in_probe)
    except ConvergenceError as error:
        hint = "" if not ring else " (is this a ring, touched inside at one height?)"
        raise PretravelError(f"{source}{error}{hint}") from None
    except PretravelError as error:
        raise PretravelError(f"{source}{error}") from None
    observation = Observation(
        positions=in_probe,
        groups=groups,
        center=np.append(fit.center, in_probe[:, 2].mean()) if ring else np.array(fit.center),
        reference_radius=0.5 * diameter,
        tip_radius=_checked_tip_radius(
            fit.radius, 0.5 * diameter, tip_diameter, ring, source, _allowed_pretravel(touches)
        ),
        ring=ring,
        tip_known=tip_diameter is not None,
    )
    _check_normals(touches, observation.directions @ rotation.T, what, source)
    return observation


def _allowed_pretravel(touches: Touches) -> float:
    feed = 0.0 if touches.feeds is None else float(touches.feeds.max())
    return LARGEST_PRETRAVEL + delay_travel(feed, LONGEST_DELAY)


def _refuse_strays(touches: Touches, reference_radius: float, source: str) -> None:
    """Single touches that lie nowhere near the others, before they bend the fit."""
    distance = np.max(np.abs(touches.positions - np.median(touches.positions, axis=0)), axis=1)
    # Within two radii of reference and tip, were the tip as big as the reference.
    strays = np.flatnonzero(distance > 4.0 * reference_radius)
    if 0 < len(strays) <= 0.2 * len(touches):
        row = int(strays[0])
        raise PretravelError(
            f"{source}{touches.where(row)} lies {distance[row]:.6g} mm from the others, on a "
            f"reference of {2.0 * reference_radius:g} mm: its position is wrong"
            + (f" ({len(strays)} touches are like that)" if len(strays) > 1 else "")
        )


def _repeats(normals: FloatArray) -> IntArray:
    """Number the directions in order of appearance; touches of one direction share it."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(normals).query_pairs(_SAME_DIRECTION, output_type="ndarray")
    count = len(normals)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.asarray(rank[inverse.ravel()], dtype=np.int64)


def _refuse_plane(touches: Touches, source: str) -> None:
    spread = np.linalg.svd(touches.normals - touches.normals.mean(axis=0), full_matrices=True)
    if spread[1][-1] <= 0.02 * spread[1][0]:
        across = spread[2][-1]
        raise PretravelError(
            f"{source}all touches lie in one plane (normal to {_axis_name(across)}): the sphere's "
            "centre cannot be found across it. Touch the sphere also away from that plane, at "
            "least at the pole; for a ring gauge say --ring"
        )


def _axis_name(vector: FloatArray) -> str:
    index = int(np.argmax(np.abs(vector)))
    if abs(vector[index]) > 0.999:
        return "XYZ"[index]
    return "(" + ", ".join(f"{v:.3f}" for v in vector) + ")"


def _checked_tip_radius(
    fitted_radius: float,
    reference_radius: float,
    tip_diameter: float | None,
    ring: bool,
    source: str,
    allowed: float,
) -> float:
    """The tip radius, once fitted radius and diameters were seen to fit together."""
    what = "ring" if ring else "sphere"
    sign = -1.0 if ring else 1.0
    tip = 0.5 * tip_diameter if tip_diameter is not None else None
    expected = reference_radius + sign * (tip if tip is not None else 0.0)
    for factor, story in (
        (1.0 / INCH, "the coordinates look like inches; convert them to mm"),
        (INCH, "the diameters look like inches; give them in mm"),
    ):
        if abs(fitted_radius / (expected * factor) - 1.0) < (0.02 if tip is not None else 0.0):
            raise PretravelError(
                f"{source}the touches lie on a {what} of diameter {2 * fitted_radius:.4f}, but "
                f"{2 * expected:.4f} mm was expected, {INCH:g} times "
                f"{'as much' if factor < 1.0 else 'less'}: {story}"
            )
    implied = sign * (fitted_radius - reference_radius)
    if tip is None:
        if not 0.05 <= implied <= 0.6 * reference_radius:
            hint = (
                " The coordinates may be inches." if fitted_radius < reference_radius / 10.0 else ""
            )
            raise PretravelError(
                f"{source}the touches lie on a {what} of diameter {2 * fitted_radius:.4f} mm; with "
                f"the calibrated diameter of {2 * reference_radius:.4f} mm that would mean a tip "
                f"of {2 * implied:.4f} mm diameter. Check --diameter (a diameter, not a radius, "
                "in mm), and that the positions are those of the tip centre, not of the surface; "
                f"or give --tip-diameter.{hint}"
            )
        return implied
    pretravel = sign * (expected - fitted_radius)
    if not SMALLEST_PRETRAVEL <= pretravel <= allowed:
        if abs(implied) < 0.1:
            advice = (
                "the positions look like surface points, already compensated by the tip radius; "
                "tip-centre positions are needed"
            )
        elif abs(implied - 2.0 * tip) < 0.1:
            advice = "was the tip's radius given as its diameter?"
        elif abs(fitted_radius - sign * tip - 2.0 * reference_radius) < 0.1:
            advice = f"was the {what}'s radius given as its diameter?"
        else:
            advice = (
                f"check --diameter ({2 * reference_radius:.4f}) and --tip-diameter "
                f"({2 * tip:.4f}): with this tip the {what} would measure "
                f"{2 * (fitted_radius - sign * tip):.4f} mm"
            )
        raise PretravelError(
            f"{source}the touches lie on a {what} of diameter {2 * fitted_radius:.4f} mm, which "
            f"means a mean pretravel of {pretravel / MICROMETRE:.1f} µm; probes give by 1 to 80, "
            f"and {SMALLEST_PRETRAVEL / MICROMETRE:.0f} to {allowed / MICROMETRE:.0f} µm is "
            f"accepted (more with a column feed_mm_min, for the delay travel): {advice}"
        )
    return tip


def _check_normals(touches: Touches, contact: FloatArray, what: str, source: str) -> None:
    cosine = np.sum(touches.normals * contact, axis=1)
    if np.mean(cosine) < 0.0:
        raise PretravelError(
            f"{source}the normals point the wrong way: they must point out of the {what}'s "
            "material, towards the tip"
            + (" (in a ring: towards its axis)" if what == "ring" else "")
            + ". Change the sign of nx, ny, nz"
            + ("" if what == "ring" else ", or say --ring if this is a ring gauge")
        )
    bad = np.flatnonzero(cosine < math.cos(NORMAL_TOLERANCE))
    if len(bad):
        row = int(bad[0])
        raise PretravelError(
            f"{source}{touches.where(row)}: its position or its normal is wrong; the normal "
            f"({describe(touches.normals[row])}) is "
            f"{math.degrees(math.acos(min(max(cosine[row], -1.0), 1.0))):.0f}° away from where the "
            f"touch lies on the fitted {what} ({describe(contact[row])}); "
            f"{len(bad)} of {len(touches)} touches are more than "
            f"{NORMAL_TOLERANCE / DEGREE:.0f}° off"
        )


def pure_error(observation: Observation) -> tuple[float, float]:
    """Pooled standard deviation among repeats, and its degrees of freedom (0: no repeats)."""
    count = np.bincount(observation.groups).astype(np.float64)
    dof = float(len(observation.values) - len(count))
    if dof == 0.0:
        return 0.0, 0.0
    mean = np.bincount(observation.groups, observation.values) / count
    scatter = float(np.sum((observation.values - mean[observation.groups]) ** 2))
    return math.sqrt(scatter / dof), dof
