"""Touches on a reference become an observation; touches that cannot be right are refused."""

from __future__ import annotations

import math

import numpy as np

from pretravel.base import (
    DEGREE,
    INCH,
    MICROMETRE,
    ConvergenceError,
    FloatArray,
    IntArray,
    PretravelError,
    describe,
)
from pretravel.maps import (
    LARGEST_PRETRAVEL,
    SMALLEST_PRETRAVEL,
    Observation,
    QualificationSetup,
    largest_plausible,
)
from pretravel.touches import Touches
from pretravel.uncertainty import SphereFit, fit_sphere

NORMAL_TOLERANCE = 10.0 * DEGREE
"""Largest angle between a given normal and that of the fitted sphere or ring. [rad]"""
_SAME_DIRECTION = 1e-3
_CROWD = 16  # normals within one direction from which not each is compared with each
_FEWEST = {"sphere": 5, "ring": 4}  # directions
_FEWEST_OTHERS = 7
"""Touches of a sphere, which has four unknowns, that can say of another one that it is wrong."""
_FREE_SHARE = 0.05
"""Of the error of a touch, what the sphere of all must leave to be seen."""
_FEW_FALSE = 0.1  # share of touches that can be false trips: more of them are another mistake
_WRONG_RADIUS = 0.1  # mm: two readings of a diameter closer than this are the same


def observe(touches: Touches, setup: QualificationSetup, rotation: FloatArray) -> Observation:
    """Touches about their least-squares centre, after a check that everything fits together.

    Parameters
    ----------
    touches : Touches
    setup : QualificationSetup
    rotation : (3, 3) float
        Probe to machine frame.

    Returns
    -------
    Observation

    Raises
    ------
    PretravelError
        Too few touches, all in one plane, diameters or units that do not fit, normals that do not
        fit.
    """
    source = f"{touches.source}: " if touches.source else ""
    groups = _repeats(touches.normals)
    _refuse_few(len(touches), int(groups.max()) + 1, setup.reference, source)
    _refuse_strays(touches, 0.5 * setup.diameter, source)
    if not setup.ring:
        _refuse_plane(touches, source)
    in_probe = touches.positions @ rotation
    fit = _least_squares(in_probe, setup, source)
    _refuse_false_trips(touches, in_probe, fit, setup, source)
    feed = None if touches.feeds is None else float(touches.feeds.max())
    observation = Observation(
        positions=in_probe,
        groups=groups,
        center=np.append(fit.center, in_probe[:, 2].mean()) if setup.ring else np.array(fit.center),
        reference_radius=0.5 * setup.diameter,
        tip_radius=_tip_radius(fit.radius, setup, source, largest_plausible(feed)),
        ring=setup.ring,
        tip_known=setup.tip_diameter is not None,
        u_reference_radius=0.5 * setup.u_reference_diameter,
    )
    _check_normals(touches, observation.directions @ rotation.T, setup.reference, source)
    return observation


def _refuse_few(touches: int, directions: int, reference: str, source: str) -> None:
    least = _FEWEST[reference]
    if directions < least:
        raise PretravelError(
            f"{source}{touches} touches in {directions} "
            f"direction{'s' if directions > 1 else ''} are too few: a {reference} needs touches in "
            f"at least {least} directions"
            + ("" if reference == "ring" else ", one of them far from the plane of the others")
        )


def _least_squares(in_probe: FloatArray, setup: QualificationSetup, source: str) -> SphereFit:
    try:
        return fit_sphere(in_probe[:, :2] if setup.ring else in_probe)
    except ConvergenceError as error:
        hint = "" if not setup.ring else " (is this a ring, touched inside at one height?)"
        raise PretravelError(f"{source}{error}{hint}") from None
    except PretravelError as error:
        raise PretravelError(f"{source}{error}") from None


def _refuse_false_trips(
    touches: Touches, in_probe: FloatArray, fit: SphereFit, setup: QualificationSetup, source: str
) -> None:
    """Refuse single touches that lie further from the others than any pretravel explains."""
    offset = in_probe[:, : len(fit.center)] - fit.center
    distance = np.linalg.norm(offset, axis=1)
    off = distance - float(np.median(distance))
    wrong = np.flatnonzero(np.abs(off) > LARGEST_PRETRAVEL)
    found = _single_stray(in_probe[:, : len(fit.center)], offset, fit)
    if found is not None:
        row, off[row] = found
        wrong = np.array([row])
    if found is not None or 0 < len(wrong) <= _FEW_FALSE * len(touches):
        row = int(wrong[np.argmax(np.abs(off[wrong]))])
        raise PretravelError(
            f"{source}{touches.where(row)} lies about {abs(off[row]):.2f} mm "
            f"{'outside' if off[row] > 0.0 else 'inside'} the {setup.reference} of the others: a "
            "false trip, or the touch of something else. Touch there again, or exclude "
            f"{_name_to_exclude(touches, row)}"
            + (f" ({len(wrong)} touches are like that)" if len(wrong) > 1 else ""),
            inputs=("exclude",),
        )


def _single_stray(
    in_probe: FloatArray, offset: FloatArray, fit: SphereFit
) -> tuple[int, float] | None:
    """The touch that is far from the sphere of all others, with its distance from it. [mm]

    Among few touches one that is wrong pulls the sphere of all to itself: its own residual is
    divided by what the others leave to it (the leverage of least squares), then they are fitted
    without it.
    """
    if len(offset) <= _FEWEST_OTHERS:
        return None
    distance = np.linalg.norm(offset, axis=1)
    design = np.column_stack([offset / distance[:, None], np.ones(len(offset))])
    share = 1.0 - np.sum(np.linalg.qr(design)[0] ** 2, axis=1)
    free = share > _FREE_SHARE
    without = np.where(free, (distance - fit.radius) / np.where(free, share, 1.0), 0.0)
    row = int(np.argmax(np.abs(without)))
    if abs(without[row]) <= LARGEST_PRETRAVEL:
        return None
    rest = np.delete(in_probe, row, axis=0)
    try:
        others = fit_sphere(rest)
    except PretravelError:
        return None
    left = np.linalg.norm(rest - others.center, axis=1) - others.radius
    if np.max(np.abs(left)) > LARGEST_PRETRAVEL:
        return None
    return row, float(np.linalg.norm(in_probe[row] - others.center) - others.radius)


def _name_to_exclude(touches: Touches, row: int) -> str:
    """What to state to leave a touch out: without a label its line, not its running number."""
    if touches.labels is not None and touches.labels.count(touches.labels[row]) == 1:
        return f"it by its label, {touches.labels[row]}"
    return "it" if touches.lines is None else f"it by its line, {touches.lines[row]}"


def _refuse_strays(touches: Touches, reference_radius: float, source: str) -> None:
    """Refuse single touches that lie far from the others, before they bend the fit."""
    distance = np.max(np.abs(touches.positions - np.median(touches.positions, axis=0)), axis=1)
    # Within two radii of reference and tip, for a tip as large as the reference.
    strays = np.flatnonzero(distance > 4.0 * reference_radius)
    if 0 < len(strays) <= 0.2 * len(touches):
        row = int(strays[0])
        raise PretravelError(
            f"{source}{touches.where(row)} lies {distance[row]:.6g} mm from the others, on a "
            f"reference of {2.0 * reference_radius:g} mm: its position is wrong"
            + (f" ({len(strays)} touches are like that)" if len(strays) > 1 else "")
        )


def _repeats(normals: FloatArray) -> IntArray:
    """Number the directions in order of appearance; touches of one direction share the number."""
    from scipy.spatial import cKDTree

    # The number of pairs would grow with the square of the repeats.
    places, place = _different(normals)
    pairs = cKDTree(places).query_pairs(_SAME_DIRECTION, output_type="ndarray")
    label = _joined(len(places), pairs)[place]
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.asarray(rank[inverse.ravel()], dtype=np.int64)


def _joined(count: int, pairs: IntArray) -> IntArray:
    """The lowest number that each of so many is connected with by pairs, (count,)."""
    label = np.arange(count)
    while True:
        lowest = np.min(label[pairs], axis=1)
        joined = label.copy()
        for side in (0, 1):
            np.minimum.at(joined, pairs[:, side], lowest)
            np.minimum.at(joined, label[pairs[:, side]], lowest)
        joined = joined[joined]
        if np.array_equal(joined, label):
            return label
        label = joined


def _different(normals: FloatArray) -> tuple[FloatArray, IntArray]:
    """Normals whose distances are compared, and which of them stands for each normal.

    Each for itself; where many are within `_SAME_DIRECTION`, one for each cell of a finer grid.
    """
    crowd = _numbered_cells(normals, _SAME_DIRECTION)
    crowded = np.bincount(crowd)[crowd] > _CROWD
    fine = _numbered_cells(normals, 0.25 * _SAME_DIRECTION)
    number = np.where(crowded, fine, len(normals) + np.arange(len(normals)))
    _, first, place = np.unique(number, return_index=True, return_inverse=True)
    return np.asarray(normals[first]), np.asarray(place.ravel(), dtype=np.int64)


def _numbered_cells(normals: FloatArray, size: float) -> IntArray:
    """The cell of a cubic grid in which each normal lies, as a number from zero, (n,)."""
    cell = np.floor((normals + 1.0) / size).astype(np.int64)
    along = np.int64(2.0 / size) + 2
    _, number = np.unique(
        (cell[:, 0] * along + cell[:, 1]) * along + cell[:, 2], return_inverse=True
    )
    return np.asarray(number.ravel(), dtype=np.int64)


def _refuse_plane(touches: Touches, source: str) -> None:
    centred = touches.normals - touches.normals.mean(axis=0)
    # By the triangle of a QR decomposition: its singular values are those of all normals.
    _, size, axes = np.linalg.svd(np.linalg.qr(centred, mode="r"))
    if size[-1] <= 0.02 * size[0]:
        across = axes[-1]
        raise PretravelError(
            f"{source}all touches lie in one plane (perpendicular to {_axis_name(across)}): "
            "this does not determine the centre of a sphere perpendicular to the plane. Touch the "
            "sphere also outside this plane, at least at the pole; or is the reference a ring "
            "gauge?",
            inputs=("ring",),
        )


def _axis_name(vector: FloatArray) -> str:
    index = int(np.argmax(np.abs(vector)))
    if abs(vector[index]) > 0.999:
        return "XYZ"[index]
    return "(" + ", ".join(f"{v:.3f}" for v in vector) + ")"


def _tip_radius(
    fitted_radius: float, setup: QualificationSetup, source: str, largest: float
) -> float:
    """The tip radius, after a check that fitted radius and diameters fit together. [mm]"""
    sign = -1.0 if setup.ring else 1.0
    radius = 0.5 * setup.diameter
    tip = None if setup.tip_diameter is None else 0.5 * setup.tip_diameter
    implied = sign * (fitted_radius - radius)
    if tip is None:
        _refuse_implied_tip(implied, fitted_radius, setup, source)
        return implied
    expected = radius + sign * tip
    _refuse_inches(fitted_radius, expected, setup, source)
    pretravel = sign * (expected - fitted_radius)
    if not SMALLEST_PRETRAVEL <= pretravel <= largest:
        raise PretravelError(
            f"{source}the touches lie on a {setup.reference} of diameter {2 * fitted_radius:.4f} "
            f"mm, which means a mean pretravel of {pretravel / MICROMETRE:.1f} µm; probes deflect "
            f"by 1 to 80, and {SMALLEST_PRETRAVEL / MICROMETRE:.0f} to {largest / MICROMETRE:.0f} "
            "µm is accepted (more with a column feed_mm_min, for the delay travel): "
            + _likely_mistake(fitted_radius, implied, tip, setup),
            inputs=("diameter", "tip_diameter"),
        )
    return tip


def _refuse_inches(
    fitted_radius: float, expected: float, setup: QualificationSetup, source: str
) -> None:
    other = (
        "the diameters look like inches (give them in mm), or coordinates in mm were taken as "
        "inches (state the unit mm)"
    )
    for factor, story in (
        (1.0 / INCH, "the coordinates look like inches: state the unit inch"),
        (INCH, other),
    ):
        if abs(fitted_radius / (expected * factor) - 1.0) < 0.02:
            raise PretravelError(
                f"{source}the touches lie on a {setup.reference} of diameter "
                f"{2 * fitted_radius:.4f} mm, but {2 * expected:.4f} mm was expected, {INCH:g} "
                f"times {'as much' if factor < 1.0 else 'less'}: {story}",
                inputs=("units",),
            )


def _refuse_implied_tip(
    implied: float, fitted_radius: float, setup: QualificationSetup, source: str
) -> None:
    radius = 0.5 * setup.diameter
    if 0.05 <= implied <= 0.6 * radius:
        return
    story = _implied_by_inches(fitted_radius, radius, setup)
    if story:
        raise PretravelError(
            f"{source}the touches lie on a {setup.reference} of diameter {2 * fitted_radius:.4f} "
            f"mm, but its calibrated diameter is {setup.diameter:.4f} mm: {story}",
            inputs=("units",),
        )
    raise PretravelError(
        f"{source}the touches lie on a {setup.reference} of diameter {2 * fitted_radius:.4f} mm; "
        f"with the calibrated diameter of {setup.diameter:.4f} mm that would mean a tip of "
        f"{2 * implied:.4f} mm diameter. Check the diameter of the {setup.reference} (a diameter, "
        "not a radius, in mm), and that the positions are those of the tip centre, not of the "
        "surface; or give the tip's diameter.",
        inputs=("diameter", "tip_diameter"),
    )


def _implied_by_inches(fitted_radius: float, radius: float, setup: QualificationSetup) -> str:
    """The unit with which the tip would be one that exists; empty if there is none."""
    sign = -1.0 if setup.ring else 1.0
    for factor, words in (
        (INCH, "the coordinates look like inches; state the unit inch"),
        (
            1.0 / INCH,
            "the coordinates look like mm that were taken as inches; state the unit mm",
        ),
    ):
        if 0.05 <= sign * (factor * fitted_radius - radius) <= 0.6 * radius:
            return words
    return ""


def _likely_mistake(
    fitted_radius: float, implied: float, tip: float, setup: QualificationSetup
) -> str:
    sign = -1.0 if setup.ring else 1.0
    if abs(implied) < _WRONG_RADIUS:
        return (
            "the positions look like surface points, already compensated by the tip radius; "
            "tip-centre positions are needed"
        )
    if abs(implied - 2.0 * tip) < _WRONG_RADIUS:
        return "was the tip's radius given as its diameter?"
    if abs(fitted_radius - sign * tip - setup.diameter) < _WRONG_RADIUS:
        return f"was the {setup.reference}'s radius given as its diameter?"
    return (
        f"check the diameter of the {setup.reference} ({setup.diameter:.4f}) and that of the tip "
        f"({2 * tip:.4f}): with this tip the {setup.reference} would measure "
        f"{2 * (fitted_radius - sign * tip):.4f} mm"
    )


def _check_normals(touches: Touches, contact: FloatArray, what: str, source: str) -> None:
    cosine = np.sum(touches.normals * contact, axis=1)
    if np.mean(cosine) < 0.0:
        raise PretravelError(
            f"{source}the normals point the wrong way: they must point out of the {what}'s "
            "material, towards the tip"
            + (" (in a ring: towards its axis)" if what == "ring" else "")
            + ". Directions of travel point so: state the columns of the normals with the opposite "
            "sign (nx=-I,ny=-J,nz=-K)" + ("" if what == "ring" else "; or is this a ring gauge?"),
            inputs=("columns",) if what == "ring" else ("columns", "ring"),
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
