"""Woźniak, Figures 2 and 3a: pretravel of a contact probe in all directions of a half sphere.

The probe has the numbers of Woźniak's program (0.6 N, seats 8 mm apart, stem 40 mm long and 2 mm
thick, ball of 4 mm); support angle, hub and contact radii are assumed. Figure 3b, a probe with a
piezoelectric transducer, is a round body: it triggers at one force in all directions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.base.directions import from_angles
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Seats, StylusSegment, Tip, Tripod
from pretravel.prediction.materials import material
from pretravel.prediction.trigger import predict

AZIMUTH, POLAR = np.radians(np.arange(0, 361, 3)), np.radians(np.arange(0, 91, 3))


STATEMENT = Statement(
    "lobes of the pretravel across the axis (largest harmonic)",
    "3 (a triangle)",
    "Woźniak, Figure 2 and Figure 3a: the shape in the XY plane is that of the three arms",
    3.0,
    3.0,
    "a count",
)


def compute() -> np.ndarray:
    """Pretravel over polar angle and azimuth, µm."""
    carbide = material("tungsten carbide")
    probe = replace(
        load_probe("omp40-2"),
        name="small contact probe, 40 mm",
        tripod=Tripod(8.0 / np.sqrt(3.0), tuple(np.radians([0, 120, 240])), 1.0, carbide),
        seats=Seats(np.radians(30.0), 1.25, carbide),
        preload=0.6,
        hub_offset=4.0,
        hub=None,
        stylus=(StylusSegment(40.0, 2.0, carbide),),
        tip=Tip(2.0, material("ruby")),
    )
    polar, azimuth = np.meshgrid(POLAR, AZIMUTH, indexing="ij")
    found = predict(probe, from_angles(polar.ravel(), azimuth.ravel())).pretravel
    return np.asarray(1e3 * found.reshape(polar.shape))


def stated(pretravel: np.ndarray) -> float:
    """The order of the largest harmonic across the axis."""
    around = pretravel[-1, :-1]
    return float(np.argmax(np.abs(np.fft.rfft(around - around.mean()))))


def draw(pretravel: np.ndarray) -> Figure:
    """The body whose radius is the pretravel."""
    figure = Figure(figsize=(6, 5), layout="constrained", dpi=110)
    axes = figure.add_subplot(projection="3d")
    polar, azimuth = np.meshgrid(POLAR, AZIMUTH, indexing="ij")
    x = pretravel * np.sin(polar) * np.cos(azimuth)
    y = pretravel * np.sin(polar) * np.sin(azimuth)
    axes.plot_surface(x, y, pretravel * np.cos(polar), cmap="viridis", linewidth=0.0,
                      rstride=1, cstride=1)  # fmt: skip
    axes.set(xlabel="x / µm", ylabel="y / µm", zlabel="z / µm")
    axes.set_box_aspect((1, 1, 0.5))
    axes.set_title("pretravel of a contact probe, 40 mm", fontsize=11)
    return figure


if __name__ == "__main__":
    found = compute()
    finish(__file__, "wozniak_fig_2_and_3.png", draw(found), STATEMENT, stated(found))
