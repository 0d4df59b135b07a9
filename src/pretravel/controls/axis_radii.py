"""Radii of the axis directions, for probing screens that add or subtract one radius."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from pretravel.base import (
    DEGREE,
    INCH,
    MICROMETRE,
    SECONDS_PER_MINUTE,
    ExtrapolationError,
    FloatArray,
    PretravelError,
)
from pretravel.controls.control import Control, ExportedFiles, ExportSettings
from pretravel.controls.control_table import check_across_z
from pretravel.controls.steps import same_steps
from pretravel.maps import PretravelMap
from pretravel.uncertainty import COVERAGE_FACTOR

TRAVELS: Mapping[str, tuple[float, float, float]] = {
    "x+": (1.0, 0.0, 0.0),
    "x-": (-1.0, 0.0, 0.0),
    "y+": (0.0, 1.0, 0.0),
    "y-": (0.0, -1.0, 0.0),
    "z-": (0.0, 0.0, -1.0),
}
"""Directions in which the tip travels, as probing screens name them."""
_PLANE_STEP = 15.0
"""Between two directions in the plane; 45° and the axes are among them. [degrees]"""


def axis_radii(pretravel_map: PretravelMap, travel: float = 0.0) -> dict[str, Any]:
    """Tip radius less pretravel along the axes and around them, in mm and inch.

    Parameters
    ----------
    pretravel_map : PretravelMap
    travel : float
        Travel of the machine during the signal delay, where the map is that of the probe at rest.
        [mm]

    Returns
    -------
    dict
        Plain values for a JSON file: what they mean, the feed, the radii of each direction of
        travel, the diameters of both axes, what to type. A direction that the map does not hold
        is null.

    Raises
    ------
    PretravelError
        The map does not hold in all directions across Z.
    """
    check_across_z(pretravel_map)
    radii = {name: _radius(pretravel_map, np.array(to), travel) for name, to in TRAVELS.items()}
    across = {name: entry for name, entry in radii.items() if name != "z-"}
    missing = [name for name, entry in across.items() if entry is None]
    if missing:
        raise PretravelError(
            f"the map does not hold for travel along {', '.join(missing)}: touch the equator of "
            "the reference too"
        )
    values = {name: entry["radius_mm"] for name, entry in across.items() if entry is not None}
    lengths = list(values.values())
    mean = float(np.mean(lengths))
    off = float(np.max(np.abs(np.array(lengths) - mean)))
    tip_radius = pretravel_map.tip_radius
    of_radii = [entry["u_mm"] for entry in across.values() if entry is not None]
    u = max(of_radii) if pretravel_map.states_uncertainty else None
    return {
        "format": "pretravel radii",
        "version": 1,
        "meaning": "Add the radius to the latched position of the tip's centre in the direction "
        "of travel: this is the surface. Directions are those in which the tip travels, in axes "
        "of the machine. The radii hold while the work coordinates are not rotated, and for "
        "surfaces perpendicular to the travel.",
        "map": pretravel_map.provenance.source,
        "feed_mm_min": _feed(pretravel_map, travel),
        "tip_radius_mm": _rounded(tip_radius),
        "travel": radii,
        "plane": _plane(pretravel_map, travel),
        "diameter": {
            "x": _lengths("diameter", values["x+"] + values["x-"]),
            "y": _lengths("diameter", values["y+"] + values["y-"]),
            "mean": _lengths("diameter", 2.0 * mean)
            | {"largest_error_of_a_side_um": round(off / MICROMETRE, 3)},
        },
        "calibration_offset": _lengths("offset", tip_radius - mean),
        "what_to_type": _sentences(pretravel_map, travel, mean, off=off, u=u),
    }


def axis_radii_text(pretravel_map: PretravelMap, travel: float = 0.0) -> str:
    """`axis_radii` as the text of a JSON file."""
    return json.dumps(axis_radii(pretravel_map, travel), indent=2, ensure_ascii=False) + "\n"


def _radius(pretravel_map: PretravelMap, to: FloatArray, travel: float) -> dict[str, Any] | None:
    """Radius of one direction of travel (3,), or None where the map does not hold."""
    normal = -to[None, :]
    try:
        pretravel, u = pretravel_map.pretravel_and_uncertainty(normal)
    except ExtrapolationError:
        return None
    speed = travel / pretravel_map.delay if pretravel_map.delay else 0.0
    # An error of the delay is also in the map: both come from the same touches.
    by_delay = float(pretravel_map.change_by_delay(normal)[0])
    delay_part = by_delay + speed * pretravel_map.u_delay
    # What repeats do not reduce is in each touch that the radius corrects.
    u_radius = np.sqrt(
        max(float(u[0]) ** 2 - by_delay**2, 0.0)
        + delay_part**2
        + pretravel_map.u_tip_radius**2
        + pretravel_map.fixed_scatter**2
    )
    found: dict[str, Any] = {"normal": [round(value, 9) + 0.0 for value in normal[0].tolist()]}
    radius = pretravel_map.tip_radius - float(pretravel[0]) - travel
    found |= _lengths("radius", radius) | _lengths("diameter", 2.0 * radius)
    states = pretravel_map.states_uncertainty
    found |= _lengths("u", float(u_radius)) if states else {"u_mm": None, "u_inch": None}
    return found


def _plane(pretravel_map: PretravelMap, travel: float) -> list[dict[str, Any]]:
    found = []
    for azimuth in np.arange(0.0, 360.0, _PLANE_STEP):
        angle = azimuth * DEGREE
        to = np.array([np.cos(angle), np.sin(angle), 0.0])
        entry = _radius(pretravel_map, to, travel)
        found.append({"travel_azimuth_deg": float(azimuth)} | (entry or {"radius_mm": None}))
    return found


def _lengths(name: str, length: float) -> dict[str, Any]:
    """A length in both units."""
    return {f"{name}_mm": _rounded(length), f"{name}_inch": _rounded(length / INCH)}


def _rounded(value: float) -> float:
    return round(value, 8)


def _feed(pretravel_map: PretravelMap, travel: float) -> float | None:
    """The feed that the radii hold for; None where neither map nor user states it. [mm/min]"""
    if pretravel_map.delay:
        return round(travel / pretravel_map.delay * SECONDS_PER_MINUTE, 6)
    return pretravel_map.feed or None


def _sentences(
    pretravel_map: PretravelMap, travel: float, mean: float, *, off: float, u: float | None
) -> dict[str, str]:
    """What to type into which field of which screen; u of a radius where the map states it."""
    feed = _feed(pretravel_map, travel)
    at = (
        ""
        if feed is None
        else f" Set the probing feed to {feed:g} mm/min ({feed / INCH:.4g} in/min)."
    )
    own = "no U" if u is None else f"U = {COVERAGE_FACTOR * u / MICROMETRE:.2f} µm"
    sides = (
        f" By the map ({own}) a face square to X or Y is then wrong by up to "
        f"{off / MICROMETRE:.2f} µm."
    )
    diameter = f"{2.0 * mean:.5f} mm ({2.0 * mean / INCH:.6f} in), the mean of ±X and ±Y"
    offset = pretravel_map.tip_radius - mean
    return {
        "QtDragon, QtVCP": f"Probe diameter: {diameter}.{at}{sides}",
        "PSNG, Verser": f"Probe diameter: {diameter}.{at}{sides}",
        "Probe Basic": f"Diameter of the probe in the tool table: "
        f"{2.0 * pretravel_map.tip_radius:.5f} mm, calibration offset: {offset:.5f} mm "
        f"({offset / INCH:.6f} in).{at}{sides}",
        "NativeCAM": f"Tip diameter: {diameter}.{at}{sides}",
    }


def _radii(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    sentences = axis_radii(pretravel_map, settings.travel)["what_to_type"]
    return ExportedFiles(
        {"": axis_radii_text(pretravel_map, settings.travel)},
        remarks=(
            "What to type into screens of LinuxCNC:",
            *(f"{screen}: {sentence}" for screen, sentence in sentences.items()),
        ),
    )


TO_RADII = Control(
    _radii,
    "Probing screens (radii to type)",
    same_steps("Type the radii into the fields of your probing screen."),
    ending=".json",
)
