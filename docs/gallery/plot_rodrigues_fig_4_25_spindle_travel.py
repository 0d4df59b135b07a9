"""Rodrigues 2021, Figure 4.25: spindle travel at the trigger over the polar angle.

The thesis probes an inclined plane and an ellipsoid (a = 10, c = 6 mm) "along the same normal".
It takes the ellipsoid's parameter v for the polar angle of its normal; the normal's true
polar angle is atan(c / a tan v), so the two curves compare two directions. Both are shown, and
the ellipsoid at the angle that its normal really has: there it falls on the plane's curve, up to
the effect of curvature over a slide of some micrometres (a thousandth of the radius).
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from published import PICTURES

from pretravel.directions import from_angles
from pretravel.plotting import save
from pretravel.probe.catalogue import load_probe
from pretravel.trigger.predict import predict

ANGLE = np.arange(10.0, 81.0, 5.0)
A, C = 10.0, 6.0  # mm, half-axes of the ellipsoid


def compute() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Travel along the normal at azimuth 0, µm: plane; ellipsoid at v; its true polar angle, °.

    Of the deflection alone: the thesis leaves out what tip and part give where they touch.
    """
    probe = load_probe("omp40-2-thesis")

    def travel(polar: np.ndarray) -> np.ndarray:
        trigger = predict(probe, from_angles(np.radians(polar), 0.0), "fem")
        return 1e3 * trigger.sensing_distance * np.sin(np.radians(polar))

    true = np.degrees(np.arctan(C / A * np.tan(np.radians(ANGLE))))
    return travel(ANGLE), travel(true), true


def draw(computed: tuple[np.ndarray, np.ndarray, np.ndarray]) -> Figure:
    """As in the thesis, and with the ellipsoid where it belongs."""
    plane, ellipsoid, true = computed
    figure = Figure(figsize=(8, 5), layout="constrained", dpi=110)
    axes = figure.subplots()
    axes.plot(ANGLE, plane, "k-o", ms=4, label="inclined plane")
    axes.plot(ANGLE, ellipsoid, "r-s", ms=4, label="ellipsoid, over the parameter v (the thesis)")
    axes.plot(true, ellipsoid, "r--x", ms=5, label="ellipsoid, over its normal's polar angle")
    axes.set_xlabel("polar angle / °")
    axes.set_ylabel("spindle travel from contact to trigger / µm")
    axes.legend(fontsize=8)
    axes.set_title("Rodrigues 2021, Figure 4.25", fontsize=11)
    return figure


if __name__ == "__main__":
    save(draw(compute()), PICTURES / "rodrigues_fig_4_25.png")
