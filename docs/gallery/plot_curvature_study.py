"""Effect of curvature on pretravel, with equal normals: convex and concave, flat to 2 mm.

The thesis finds 27.7 % less spindle travel on its ellipsoid than on a plane, but it compares
normals at 26.7° and at 40° from the axis. Here the normals are equal, and only the effect of the
slide remains. The slide lowers a convex surface under the tip by slide²/(2 (R + r)). It turns the
normal, and so the force and the deflection, by slide/(R + r): some micrometres over some
millimetres, a thousandth. With all displacements of the model, a curved part is also compressed
more (Hertz).
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.base.directions import from_angles
from pretravel.design.probing.tip import LateralTip, TipBehaviour, predicted_tip
from pretravel.design.probing.touching import touch
from pretravel.prediction.catalogue import load_probe
from pretravel.surface.shapes import Plane, Reversed, Sphere
from pretravel.touches.targets import Targets

POLAR = np.array([10.0, 26.7, 40.0, 60.0, 80.0])
RADII = np.array([2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0])  # mm, convex
# A hollow must be larger than the ball, whose radius is 3 mm.
HOLLOWS = np.array([3.5, 4.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1000.0])  # mm, concave


STATEMENT = Statement(
    "more travel on a sphere of 10 mm radius than on a plane, polar 26.7° / %",
    "27.7 less, of two different normals",
    "Rodrigues 2021, section 4.5.4",
    0.016,
    0.32,
    "a tenth of slide / (R + r) to twice it: the slide is 20.5 µm, R + r is 13 mm",
)


def travel(tip: TipBehaviour, polar: float, radius: float) -> float:
    """Travel from contact to trigger, mm, on a sphere of this radius.

    A negative radius stands for a hollow, an infinite one for a plane.
    """
    n = from_angles(np.radians(polar), np.radians(20.0))
    target = Targets(np.zeros((1, 3)), n)
    if np.isinf(radius):
        surface = Plane([0, 0, 0], n[0])
    elif radius > 0.0:
        surface = Sphere(-radius * n[0], radius)
    else:
        surface = Reversed(Sphere(-radius * n[0], -radius))
    return float(touch(tip, surface, target).pretravel[0])


def compute() -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Differences from the plane, %, (polar, radius), convex and concave; travel on the plane, µm.

    They are given for the kinematics of the thesis (sideways deflection only) and for all
    displacements of the model.
    """
    full = predicted_tip(load_probe("omp40-2-thesis-100mm"))
    result = {}
    for name, tip in (("sideways only", LateralTip(full)), ("all displacements", full)):
        flat = np.array([travel(tip, polar, np.inf) for polar in POLAR])
        curved = [
            np.array([[travel(tip, p, sign * r) for r in radii] for p in POLAR])
            for sign, radii in ((1.0, RADII), (-1.0, HOLLOWS))
        ]
        result[name] = (
            100.0 * (curved[0] / flat[:, None] - 1.0),
            100.0 * (curved[1] / flat[:, None] - 1.0),
            1e3 * flat,
        )
    return result


def stated(computed: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]) -> float:
    """The change with the kinematics of the thesis."""
    convex, _, _ = computed["sideways only"]
    return float(convex[list(POLAR).index(26.7), list(RADII).index(10.0)])


def draw(computed: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]) -> Figure:
    """The plot of the difference from the plane over curvature; concave is on the left."""
    figure = Figure(figsize=(11, 4.8), layout="constrained", dpi=110)
    for axes, (name, (convex, concave, flat)) in zip(
        figure.subplots(1, 2), computed.items(), strict=True
    ):
        curvature = np.concatenate([-1.0 / HOLLOWS, 1.0 / RADII[::-1]])
        for row, polar in enumerate(POLAR):
            values = np.concatenate([concave[row], convex[row][::-1]])
            axes.plot(curvature, values, ".-", label=f"{polar:g}° ({flat[row]:.1f} µm on a plane)")
        axes.axhline(0.0, color="k", lw=0.6)
        axes.set_xlabel("curvature / (1/mm), concave negative")
        axes.set_ylabel("change of travel against a plane with the same normal / %")
        axes.set_title(name, fontsize=10)
        axes.legend(fontsize=8, title="polar angle")
    figure.suptitle("Curvature with equal normals, 100 mm stylus, ball of 6 mm")
    return figure


if __name__ == "__main__":
    results = compute()
    for label, (convex_, concave_, flat_) in results.items():
        print(label, flat_.round(2))
        print("convex", RADII, convex_.round(3), "concave", HOLLOWS, concave_.round(3), sep="\n")
    finish(__file__, "curvature_study.png", draw(results), STATEMENT, stated(results))
