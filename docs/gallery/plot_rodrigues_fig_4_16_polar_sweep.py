"""Rodrigues 2021, Figure 4.16: sensing distance over azimuth for polar angles 10 to 80°."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish, trigger_table

from pretravel.base.directions import from_angles
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict

AZIMUTH = np.arange(0.0, 351.0, 10.0)
POLAR = np.arange(80.0, 9.0, -10.0)


STATEMENT = Statement(
    "sensing distance at polar 40°, azimuth 60° / µm",
    "4.5",
    "Rodrigues 2021, Table 4.6",
    4.28,
    4.72,
    "printed to 0.1; dimensions fitted at 90° alone, 56 directions within 3.7 %",
)


def compute() -> np.ndarray:
    """Sensing distances of the thesis's probe (rigid seats), (polar, azimuth), µm."""
    probe = load_probe("omp40-2-thesis")
    return np.array(
        [
            1e3
            * predict(
                probe, from_angles(np.radians(polar), np.radians(AZIMUTH)), "fem"
            ).sensing_distance
            for polar in POLAR
        ]
    )


def stated(distances: np.ndarray) -> float:
    """The sensing distance at polar 40°, azimuth 60°."""
    return float(distances[list(POLAR).index(40.0), list(AZIMUTH).index(60.0)])


def draw(distances: np.ndarray) -> Figure:
    """The plot of computed values (lines) and printed values (dots)."""
    table = trigger_table()
    figure = Figure(figsize=(9, 6), layout="constrained", dpi=110)
    axes = figure.subplots()
    for polar, distance in zip(POLAR, distances, strict=True):
        (line,) = axes.plot(AZIMUTH, distance, lw=1.2, label=f"polar {polar:.0f}°")
        here = table["polar_deg"] == polar
        axes.plot(
            table["azimuth_deg"][here],
            1e3 * table["sensing_distance_fea_mm"][here],
            "o",
            color=line.get_color(),
            ms=4,
        )
    axes.set_xlabel("azimuth / °")
    axes.set_ylabel("sensing distance / µm")
    axes.legend(fontsize=8, ncols=2)
    axes.set_title("Rodrigues 2021, Figure 4.16: dots printed, lines predicted", fontsize=11)
    return figure


if __name__ == "__main__":
    found = compute()
    finish(__file__, "rodrigues_fig_4_16.png", draw(found), STATEMENT, stated(found))
