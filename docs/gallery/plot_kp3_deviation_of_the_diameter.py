"""A KP-3 in a ring: what a table of diameters by angle leaves of its lobes, and what a map leaves.

An open firmware corrects a bore or a boss with the deviation of the diameter by angle, measured in
a ring: two touches on opposite walls give one number. Lobes of odd order, three above all, have
opposite signs on these walls and cancel in the diameter. Each correction is made from half of the
72 directions and tested on the other half, and the reverse; the centring is subtracted. The
readings are from a published picture.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from published import ROOT, Statement, finish

from pretravel.measurement.compensation import apply
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches

TABLE: Path = ROOT / "examples" / "data" / "kp3_ring.csv"
RING, TIP = 50.0, 6.0
"""Not published, and without influence on the errors."""

STATEMENT = Statement(
    "errors that the deviation of the diameter by angle leaves in a ring / µm",
    "6.28; with one radius, that of all directions, 6.82",
    "computed apart from this script, from the same readings",
    6.27,
    6.29,
    "readings to 0.5 µm, the same in both",
)


def _readings() -> tuple[np.ndarray, np.ndarray]:
    """Azimuth [rad] and pretravel without the centring [µm]."""
    azimuth, travel = np.genfromtxt(TABLE, delimiter=",", skip_header=3).T
    azimuth = np.radians(azimuth)
    columns = np.stack([np.ones(len(azimuth)), np.cos(azimuth), np.sin(azimuth)], axis=1)
    shift = np.linalg.lstsq(columns, travel, rcond=None)[0]
    return azimuth, travel - columns[:, 1:] @ shift[1:]


def _by_diameters(azimuth: np.ndarray, travel: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Half of the diameter's deviation at wanted azimuths, between those that were measured."""
    half = 0.5 * (travel + np.roll(travel, len(travel) // 2))
    around = np.concatenate([azimuth - 2.0 * np.pi, azimuth, azimuth + 2.0 * np.pi])
    return np.asarray(np.interp(wanted, around, np.tile(half, 3)))


def _by_map(azimuth: np.ndarray, travel: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The physical map of the same touches."""

    def outward(angle: np.ndarray) -> np.ndarray:
        return np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)

    free = 0.5 * (RING - TIP)
    touches = Touches(outward(azimuth) * (free + 1e-3 * travel)[:, None], -outward(azimuth))
    found = qualify(
        touches, RING, tip_diameter=TIP, ring=True, kind="physical", search_outliers=False
    )
    # Touches without pretravel: the map moves them by its value, about its own centre.
    nominal = Touches(outward(wanted) * free, -outward(wanted))
    points = apply(nominal, found.pretravel_map, extrapolate=True).positions - found.center
    distance = np.linalg.norm(points[:, :2], axis=1)
    return np.asarray(1e3 * (0.5 * RING - distance))


def _by_one_radius(azimuth: np.ndarray, travel: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The mean pretravel, everywhere."""
    del azimuth
    return np.full(len(wanted), travel.mean())


CORRECTIONS = {
    "one radius": _by_one_radius,
    "diameter by angle": _by_diameters,
    "map, kind physical": _by_map,
}


def compute() -> dict[str, np.ndarray]:
    """Errors at every direction, corrected from the other half of the directions. µm"""
    azimuth, travel = _readings()
    odd = np.arange(len(azimuth)) % 2 == 1
    found = {"azimuth": azimuth, "travel": travel}
    for name, correct in CORRECTIONS.items():
        error = np.zeros(len(azimuth))
        for rows in (odd, ~odd):
            error[~rows] = travel[~rows] - correct(azimuth[rows], travel[rows], azimuth[~rows])
        found[name] = error
    return found


def left(errors: np.ndarray) -> float:
    """Root mean square of the errors, mean of both halves. µm"""
    return float(np.mean([np.sqrt(np.mean(errors[k::2] ** 2)) for k in (0, 1)]))


def stated(computed: dict[str, np.ndarray]) -> float:
    """What the deviation of the diameter leaves."""
    return left(computed["diameter by angle"])


def draw(computed: dict[str, np.ndarray]) -> Figure:
    """Pretravel over the azimuth, and the errors that each correction leaves."""
    figure = Figure(figsize=(12, 4.4), layout="constrained", dpi=110)
    travel, error = figure.subplots(1, 2)
    degrees = np.degrees(computed["azimuth"])
    travel.plot(degrees, computed["travel"], ".", label="read from the picture, centred")
    seen = _by_diameters(computed["azimuth"], computed["travel"], computed["azimuth"])
    travel.plot(degrees, seen, label="half of the diameter's deviation")
    travel.set_ylabel("pretravel / µm")
    for name in CORRECTIONS:
        error.plot(degrees, computed[name], ".-", label=f"{name}: {left(computed[name]):.2f} µm")
    error.set_ylabel("error of the other half / µm")
    for axes in (travel, error):
        axes.set_xlabel("azimuth / °")
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    figure.suptitle("A Centroid KP-3 in a ring: the diameter does not see three lobes")
    return figure


if __name__ == "__main__":
    found = compute()
    finish(__file__, "kp3_deviation_of_the_diameter.png", draw(found), STATEMENT, stated(found))
