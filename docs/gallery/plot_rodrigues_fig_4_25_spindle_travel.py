"""Rodrigues 2021, Figure 4.25: spindle travel at the trigger over the polar angle.

The thesis probes an inclined plane and an ellipsoid (a = 10, c = 6 mm) "along the same normal".
It takes the parameter v of the ellipsoid as the polar angle of the normal. The true polar angle of
the normal is atan(c / a tan v), so the two curves of the thesis compare two directions. The script
shows both curves, and the travel on the ellipsoid over the true angle of its normal. This third
curve, which includes the slide, agrees with the curve of the plane except for the effect of
curvature (plot_curvature_study.py).
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.base.directions import from_angles
from pretravel.design.probing.tip import LateralTip, predicted_tip
from pretravel.design.probing.touching import touch
from pretravel.prediction.catalogue import load_probe
from pretravel.surface.shapes import Ellipsoid
from pretravel.touches.targets import Targets

ANGLE = np.arange(10.0, 81.0, 5.0)
A, C = 10.0, 6.0  # mm, half-axes of the ellipsoid


STATEMENT = Statement(
    "more travel on the ellipsoid than on a plane with the same normal, v = 40° / %",
    "27.7 less, of two different normals",
    "Rodrigues 2021, section 4.5.4",
    0.0,
    0.1,
    "of the order of slide over radius, 2.5 µm over 13 mm; a convex surface recedes",
)


def compute() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Travel along the normal at azimuth 0, µm, and the true polar angles of the ellipsoid, °.

    The travels are those on the plane, on the ellipsoid at v, and on planes with the normals of
    the ellipsoid. They contain the deflection alone, because the thesis neglects the local
    compression of tip and part.
    """
    tip = LateralTip(predicted_tip(load_probe("omp40-2-thesis"), "fem"))

    def on_plane(polar: np.ndarray) -> np.ndarray:
        # On a plane the normal does not turn while the tip slides: equation 3.2.
        n = from_angles(np.radians(polar), 0.0)
        return 1e3 * np.sum(tip.state(n).deflection * n, axis=1)

    ellipsoid = Ellipsoid([0.0, 0.0, 0.0], [A, A, C])
    local = ellipsoid.local(np.column_stack([0.0 * ANGLE, np.radians(ANGLE)]))
    touched = touch(tip, ellipsoid, Targets(local.point, local.normal))
    true = np.degrees(np.arctan(C / A * np.tan(np.radians(ANGLE))))
    return on_plane(ANGLE), 1e3 * touched.pretravel, on_plane(true), true


def stated(computed: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]) -> float:
    """The effect of curvature alone."""
    _, ellipsoid, plane_there, _ = computed
    row = list(ANGLE).index(40.0)
    return float(100.0 * (ellipsoid[row] / plane_there[row] - 1.0))


def draw(computed: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]) -> Figure:
    """The plot of the thesis, and the ellipsoid over the true polar angle."""
    plane, ellipsoid, _, true = computed
    figure = Figure(figsize=(8, 5), layout="constrained", dpi=110)
    axes = figure.subplots()
    axes.plot(ANGLE, plane, "k-o", ms=4, label="inclined plane")
    axes.plot(ANGLE, ellipsoid, "r-s", ms=4, label="ellipsoid, over the parameter v (the thesis)")
    axes.plot(true, ellipsoid, "r--x", ms=5, label="ellipsoid, over the true polar angle")
    axes.set_xlabel("polar angle / °")
    axes.set_ylabel("spindle travel from contact to trigger / µm")
    axes.legend(fontsize=8)
    axes.set_title("Rodrigues 2021, Figure 4.25", fontsize=11)
    return figure


if __name__ == "__main__":
    found = compute()
    finish(__file__, "rodrigues_fig_4_25.png", draw(found), STATEMENT, stated(found))
