"""Friction at the tip: pretravel over the polar angle, from full slip to stick.

Estler describes the friction that holds the tip on an inclined surface, Mayer describes the slip.
On a floor the tip does not slide, and friction has no effect. On a wall it slides little. Between
them, a slipping tip deflects the stylus sideways by less than without friction. A sticking tip
does not deflect it sideways: the force is along the axis.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.base.directions import from_angles
from pretravel.design.probing.surface_touches import SurfaceTouches
from pretravel.design.probing.tip import predicted_tip
from pretravel.design.probing.touching import touch
from pretravel.prediction.catalogue import load_probe
from pretravel.surface.shapes import Sphere
from pretravel.touches.targets import Targets

POLAR = np.concatenate([np.arange(0.0, 20.0, 1.0), np.arange(20.0, 91.0, 5.0)])
FRICTION = (0.0, 0.05, 0.1, 0.2, 0.4, np.inf)
RADIUS = 12.5


STATEMENT = Statement(
    "pretravel on a floor with a sticking tip less that with a free one / µm",
    "0: there is no slide",
    "closed form",
    -1e-6,
    1e-6,
    "rounding of the solver",
)


def compute() -> dict[float, SurfaceTouches]:
    """For each coefficient of friction: touches on a sphere of 25 mm at azimuth 20°."""
    tip = predicted_tip(load_probe("omp40-2"))
    n = from_angles(np.radians(POLAR), np.radians(20.0))
    sphere = Sphere([0.0, 0.0, 0.0], RADIUS)
    targets = Targets(RADIUS * n, n)
    return {mu: touch(tip, sphere, targets, friction=mu) for mu in FRICTION}


def stated(computed: dict[float, SurfaceTouches]) -> float:
    """The effect of friction where the tip does not slide."""
    return float(1e3 * (computed[np.inf].pretravel[0] - computed[0.0].pretravel[0]))


def draw(computed: dict[float, SurfaceTouches]) -> Figure:
    """The plot of pretravel, of its change by friction, and of the angle from normal to force."""
    figure = Figure(figsize=(14, 4.6), layout="constrained", dpi=110)
    travel, change, lean = figure.subplots(1, 3)
    free = computed[0.0].pretravel
    for mu, touches in computed.items():
        name = "sticks" if np.isinf(mu) else f"µ = {mu:g}"
        travel.plot(POLAR, 1e3 * touches.pretravel, ".-", label=name)
        change.plot(POLAR, 1e3 * (touches.pretravel - free), ".-")
        cosine = np.sum(touches.force_direction * touches.normal, axis=1)
        lean.plot(POLAR, np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), ".-")
    travel.set_ylabel("pretravel / µm")
    change.set_ylabel("change by friction / µm")
    lean.set_ylabel("angle between force and normal / °")
    for axes in (travel, change, lean):
        axes.set_xlabel("polar angle / °")
        axes.grid(alpha=0.3)
    travel.legend(fontsize=8)
    figure.suptitle("Friction at the tip, OMP40-2 with 50 mm stylus, sphere of 25 mm, azimuth 20°")
    return figure


if __name__ == "__main__":
    found = compute()
    finish(__file__, "tip_friction.png", draw(found), STATEMENT, stated(found))
