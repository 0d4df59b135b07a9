"""Touches on a reference that cannot be right: too few, typing mistakes, false trips.

Each check is made once, where touches come in, and once more for those that are left.
"""

from __future__ import annotations

import math

import numpy as np

from pretravel.base import (
    DEGREE,
    INCH,
    LARGEST_PRETRAVEL,
    MICROMETRE,
    FloatArray,
    PretravelError,
    describe,
)
from pretravel.maps import (
    SMALLEST_PRETRAVEL,
    SOUTH_LIMIT,
    Observation,
    QualificationSetup,
    largest_plausible,
)
from pretravel.touches import Touches
from pretravel.uncertainty import SphereFit, fit_sphere

NORMAL_TOLERANCE = 10.0 * DEGREE
"""Largest angle between a given normal and that of the fitted sphere or ring. [rad]"""
_FEWEST = {"sphere": 5, "ring": 4}  # directions
_FEWEST_OTHERS = 7
"""Touches of a sphere, which has four unknowns, that can say of another one that it is wrong."""
_FREE_SHARE = 0.05
"""Of the error of a touch, what the sphere of all must leave to be seen."""
_FEW_FALSE = 0.1  # share of touches that can be false trips: more of them are another mistake
_WRONG_RADIUS = 0.1  # mm: two readings of a diameter closer than this are the same


def refuse_too_little(touches: Touches, directions: int, setup: QualificationSetup) -> None:
    """Refuse touches that determine no centre, before they are fitted.

    Parameters
    ----------
    touches : Touches
    directions : int
        In which they were made.
    setup : QualificationSetup

    Raises
    ------
    PretravelError
        Too few touches, one far from all others, all in one plane.
    """
    source = f"{touches.source}: " if touches.source else ""
    _refuse_few(len(touches), directions, setup.reference, source)
    _refuse_strays(touches, 0.5 * setup.diameter, source)
    if not setup.ring:
        _refuse_plane(touches, source)


_SHOWN = 0.1
"""Share of six lobes, in the phase that shows them least, beyond those of order two and four: 1 of
nine azimuths, 0 of eight, and of twelve, where one phase is zero at all of them."""


def refuse_hidden_lobes(observation: Observation) -> None:
    """Refuse means at two orientations of the spindle in directions that hide their largest lobes.

    Three rods make lobes of order three, six, nine; of these the means have six. Eight azimuths at
    equal steps show six lobes as two, and twelve show one phase of them not at all: a map between
    them would be wrong by their size.
    """
    if not observation.of_means:
        return
    n = observation.group_directions
    height, across = n[:, 2:] ** 2, n[:, 0] + 1j * n[:, 1]
    lower = [across[:, None] ** 2 * height ** np.arange(3), across[:, None] ** 4 * height ** [0, 1]]
    waves = np.hstack(lower)
    columns = np.hstack([np.ones((len(n), 1)), n, height, waves.real, waves.imag])
    six = np.stack([(across**6).real, (across**6).imag], axis=1)
    left = six - columns @ np.linalg.lstsq(columns, six, rcond=1e-9)[0]
    if np.linalg.eigvalsh(left.T @ left)[0] < 0.5 * _SHOWN * np.sum(six**2):
        raise PretravelError(
            "means at two orientations of the spindle in these directions show six lobes, which "
            "three rods make, as fewer lobes or in one phase only: between the directions the map "
            "would be wrong by their size. Touch 9, 11, or 13 and more azimuths at equal steps",
            inputs=("touches",),
        )


def refuse_contradictions(
    touches: Touches, in_probe: FloatArray, fit: SphereFit, setup: QualificationSetup
) -> None:
    """Refuse touches that no probe makes on this reference.

    Parameters
    ----------
    touches : Touches
    in_probe : (n, 3) float
        Their positions, probe frame. [mm]
    fit : SphereFit
        The sphere or circle through them.
    setup : QualificationSetup

    Raises
    ------
    PretravelError
        Single false trips, diameters or units that do not fit.
    """
    source = f"{touches.source}: " if touches.source else ""
    _refuse_false_trips(touches, in_probe, fit, setup, source)
    feed = None if touches.feeds is None else float(touches.feeds.max())
    _refuse_diameters(fit.radius, setup, source, largest_plausible(feed))
    if not setup.ring:
        _refuse_axis(touches, in_probe, fit, setup, source)


def _refuse_axis(
    touches: Touches, in_probe: FloatArray, fit: SphereFit, setup: QualificationSetup, source: str
) -> None:
    """Refuse touches from behind: the stylus would go through the sphere."""
    offset = in_probe - fit.center
    across = np.linalg.norm(offset[:, :2], axis=1)
    behind = (offset[:, 2] < 0.0) & (across < 0.5 * setup.diameter)
    if np.mean(behind) > _MOST_BEHIND:
        ahead = (offset[:, 2] > 0.0) & (across < 0.5 * setup.diameter)
        turned = "" if np.mean(ahead) > _MOST_BEHIND else " The opposite axis fits."
        raise PretravelError(
            f"{source}{np.sum(behind)} of {len(behind)} touches are on the side of the sphere from "
            "which the probe axis points away: the stylus would go through the sphere. The axis "
            f"points from the tip to the spindle.{turned}",
            inputs=("axis",),
        )
    down = offset[:, 2] / np.linalg.norm(offset, axis=1)
    if down.min() < SOUTH_LIMIT:
        axis = ",".join(f"{part:g}" for part in setup.axis)
        raise PretravelError(
            f"{source}{touches.where(int(np.argmin(down)))} is "
            f"{np.arccos(down.min()) / DEGREE:.0f}° from the probe axis ({axis}), which points "
            "from the tip to the spindle: the stylus would go through the sphere. Give the axis, "
            "such as 1,0,0 or 0,1,0 of a horizontal spindle",
            inputs=("axis",),
        )


_MOST_BEHIND = 1.0 / 3.0
"""Share of the touches: patterns over a whole sphere, of simulations, have less."""


def refuse_wrong_normals(touches: Touches, contact: FloatArray, what: str) -> None:
    """Refuse normals that are not those of the fitted reference.

    Parameters
    ----------
    touches : Touches
    contact : (n, 3) float
        Normals of the fitted reference, machine frame.
    what : str
        sphere or ring.

    Raises
    ------
    PretravelError
        Normals into the material; a normal that is off by more than `NORMAL_TOLERANCE`.
    """
    source = f"{touches.source}: " if touches.source else ""
    cosine = np.sum(touches.normals * contact, axis=1)
    if np.mean(cosine) < 0.0:
        raise PretravelError(
            f"{source}the normals point the wrong way: they must point out of the {what}'s "
            "material, towards the tip"
            + (" (towards the axis of a ring)" if what == "ring" else "")
            + ". Directions of travel point so: give the columns of the normals with the opposite "
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


def _refuse_few(touches: int, directions: int, reference: str, source: str) -> None:
    least = _FEWEST[reference]
    if directions < least:
        raise PretravelError(
            f"{source}{touches} touches in {directions} "
            f"direction{'s' if directions > 1 else ''} are too few: a {reference} needs touches in "
            f"at least {least} directions"
            + ("" if reference == "ring" else ", one of them far from the plane of the others")
        )


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
    if len(wrong):
        raise PretravelError(
            f"{source}the touches do not lie on one {setup.reference}: {len(wrong)} of "
            f"{len(touches)} are up to {np.abs(off).max():.4g} mm off the fitted one. Are touches "
            "of two references, tips or coordinate systems in one log, are its axes in different "
            "units, or is X a diameter (as on a lathe)?"
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


def _refuse_diameters(
    fitted_radius: float, setup: QualificationSetup, source: str, largest: float
) -> None:
    sign = -1.0 if setup.ring else 1.0
    radius = 0.5 * setup.diameter
    tip = None if setup.tip_diameter is None else 0.5 * setup.tip_diameter
    implied = sign * (fitted_radius - radius)
    if tip is None:
        _refuse_implied_tip(implied, fitted_radius, setup, source)
        return
    expected = radius + sign * tip
    _refuse_other_unit(fitted_radius, expected, setup, source)
    pretravel = sign * (expected - fitted_radius)
    if not SMALLEST_PRETRAVEL <= pretravel <= largest:
        raise PretravelError(
            f"{source}the touches lie on a {setup.reference} of diameter {2 * fitted_radius:.4f} "
            f"mm, which means a mean pretravel of {pretravel / MICROMETRE:.1f} µm. But "
            f"probes deflect by 1 to 80 µm; {SMALLEST_PRETRAVEL / MICROMETRE:.0f} to "
            f"{largest / MICROMETRE:.0f} µm is accepted (more with a column feed_mm_min, for the "
            "delay travel). " + _likely_mistake(fitted_radius, implied, tip, setup),
            inputs=("diameter", "tip_diameter"),
        )


def _refuse_other_unit(
    fitted_radius: float, expected: float, setup: QualificationSetup, source: str
) -> None:
    other = (
        "the diameters look like inches (give them in mm), or coordinates in mm were taken as "
        "inches (give the unit mm)"
    )
    named = "name the unit in the titles of their columns"
    for factor, story in (
        (1.0 / INCH, "the coordinates look like inches: give the unit inch"),
        (INCH, other),
        (1e3, f"the coordinates look like µm: {named} (X [µm])"),
        (1e-3, f"the coordinates look like metres: {named} (X [m])"),
    ):
        if abs(fitted_radius / (expected * factor) - 1.0) < 0.02:
            raise PretravelError(
                f"{source}the touches lie on a {setup.reference} of diameter "
                f"{2 * fitted_radius:.4f} mm, but {2 * expected:.4f} mm was expected, "
                f"{max(factor, 1.0 / factor):g} times {'as much' if factor < 1.0 else 'less'}: "
                f"{story}",
                inputs=("units",) if "inch" in story else ("columns",),
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
        (INCH, "the coordinates look like inches; give the unit inch"),
        (
            1.0 / INCH,
            "the coordinates look like mm that were taken as inches; give the unit mm",
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
            "The positions look like surface points, already compensated by the tip radius; "
            "tip-centre positions are needed"
        )
    if setup.ring and abs(implied + tip) < _WRONG_RADIUS:
        return (
            "The touches lie around a pin of this diameter, not in a ring. A qualification, also "
            "with an old map, takes a pin; a verification takes spheres and rings"
        )
    if abs(implied + tip) < _WRONG_RADIUS:
        return (
            "The tip's radius was subtracted twice from these positions, perhaps; tip-centre "
            "positions are needed"
        )
    if abs(implied - 2.0 * tip) < _WRONG_RADIUS:
        return (
            "Was the tip's radius given as its diameter, or added to the positions? Tip-centre "
            "positions are needed"
        )
    if abs(implied - 0.5 * tip) < _WRONG_RADIUS:
        return f"Is {2 * tip:g} mm twice the tip's diameter? With {tip:g} mm it fits"
    if abs(implied - 3.0 * tip) < _WRONG_RADIUS:
        return "The tip's radius was added twice to these positions, perhaps"
    if abs(fitted_radius - sign * tip - setup.diameter) < _WRONG_RADIUS:
        return f"Was the {setup.reference}'s radius given as its diameter?"
    if abs(fitted_radius - sign * tip - 0.25 * setup.diameter) < _WRONG_RADIUS:
        return (
            f"Is {setup.diameter:g} mm twice the diameter of the {setup.reference}? With "
            f"{0.5 * setup.diameter:g} mm it fits"
        )
    rest = 2 * (fitted_radius - sign * tip)
    measured = f". With this tip the {setup.reference} would measure {rest:.4f} mm"
    return (
        f"Check the diameter of the {setup.reference} ({setup.diameter:.4f} mm) and that of the "
        f"tip ({2 * tip:.4f} mm){measured if rest > 0.0 else ''}"
    )
