"""Rodrigues 2021, Figures 4.7 to 4.15: force and sensing distance over azimuth, polar 90 to 10°.

The printed values (Tables 4.1 to 4.9) are compared with three models: finite elements with rigid
seats, whose dimensions were identified at 90° alone; finite elements with elastic seats; and the
"existing method" with its lever of 50 mm.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish, trigger_table

from pretravel.base.directions import from_angles
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import Trigger, predict

AZIMUTH = np.arange(0.0, 351.0, 10.0)
POLAR = np.arange(90.0, 9.0, -10.0)


STATEMENT = Statement(
    "sensing distance at polar 90°, azimuth 60° / µm",
    "5.6",
    "Rodrigues 2021, Table 4.1",
    5.46,
    5.74,
    "printed to 0.1; the fit of seven dimensions is within 1.5 %",
)


def compute() -> dict[str, list[Trigger]]:
    """For each model: the triggers over azimuth, one entry for each polar angle."""
    walls = [from_angles(np.radians(polar), np.radians(AZIMUTH)) for polar in POLAR]
    models = {
        "finite elements, rigid seats": (load_probe("omp40-2-thesis"), "fem"),
        "finite elements, Hertz seats": (load_probe("omp40-2"), "fem"),
        "existing method": (load_probe("omp40-2").with_lever(50.0), "shen"),
    }
    return {
        name: [predict(probe, wall, model) for wall in walls]
        for name, (probe, model) in models.items()
    }


def stated(computed: dict[str, list[Trigger]]) -> float:
    """The sensing distance with rigid seats, opposite a rod."""
    return float(1e3 * computed["finite elements, rigid seats"][0].sensing_distance[6])


def draw(computed: dict[str, list[Trigger]]) -> Figure:
    """The plot: force and distance for nine polar angles, in three rows of six panels."""
    table = trigger_table()
    figure = Figure(figsize=(15, 10), layout="constrained", dpi=110)
    axes = figure.subplots(3, 6)
    for row, polar in enumerate(POLAR):
        force, distance = axes[row // 3, 2 * (row % 3)], axes[row // 3, 2 * (row % 3) + 1]
        for colour, (name, triggers) in zip("krb", computed.items(), strict=True):
            force.plot(AZIMUTH, triggers[row].force, color=colour, lw=1.0)
            distance.plot(
                AZIMUTH, 1e3 * triggers[row].sensing_distance, color=colour, lw=1.0, label=name
            )
        here = table["polar_deg"] == polar
        for key, mark in (("fea", "ko"), ("existing", "b+")):
            azimuth = table["azimuth_deg"][here]
            force.plot(azimuth, table[f"trigger_force_{key}_N"][here], mark, ms=4)
            distance.plot(
                azimuth,
                1e3 * table[f"sensing_distance_{key}_mm"][here],
                mark,
                ms=4,
                label=f"printed, {'finite elements' if key == 'fea' else 'existing method'}",
            )
        force.set_title(f"polar {polar:.0f}°: trigger force / N", fontsize=9)
        distance.set_title(f"polar {polar:.0f}°: sensing distance / µm", fontsize=9)
        for panel in (force, distance):
            panel.tick_params(labelsize=7)
            panel.set_xticks([0, 120, 240, 360])
    handles, labels = axes[0, 1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=9)
    figure.suptitle("Rodrigues 2021, Figures 4.7 to 4.15: printed and computed values")
    return figure


if __name__ == "__main__":
    found = compute()
    finish(__file__, "rodrigues_fig_4_07_to_4_15.png", draw(found), STATEMENT, stated(found))
