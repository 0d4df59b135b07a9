"""Rodrigues 2021, Figures 4.27 to 4.36: effect of length, diameter, material and preload.

The baseline of section 4.6 (Table 4.12): 100 mm stylus, carbide stem of 4.5 mm, 5.91 N, polar 90°.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.base.directions import from_angles
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import material
from pretravel.prediction.trigger import Trigger, predict

AZIMUTH = np.arange(0.0, 61.0, 5.0)


STATEMENT = Statement(
    "trigger force with a preload of 4 N over that with 5.91 N",
    "4 / 5.91 = 0.6768: proportional to the preload",
    "Rodrigues 2021, section 4.6; statics",
    4.0 / 5.91 - 5e-5,
    4.0 / 5.91 + 5e-5,
    "statics is linear; four digits are kept",
)


def variants() -> dict[str, dict[str, Probe]]:
    """For each pair of figures: the probes by their labels."""
    base = load_probe("omp40-2-100mm-carbide")
    head, stem = base.stylus

    def stemmed(**changes: object) -> Probe:
        return replace(base, stylus=(head, replace(stem, **changes)))

    return {
        "4.27, 4.28: length": {"100 mm": base, "50 mm": stemmed(length=stem.length - 50.0)},
        "4.30, 4.31: diameter": {"4.5 mm": base, "3.8 mm": stemmed(diameter=3.8)},
        "4.33, 4.34: material": {
            "tungsten carbide": base,
            "ceramic": stemmed(material=material("ceramic")),
        },
        "4.35, 4.36: preload": {"5.91 N": base, "4 N": replace(base, preload=4.0)},
    }


def compute() -> dict[str, dict[str, Trigger]]:
    """For each pair of figures: the triggers over azimuth by their labels."""
    wall = from_angles(np.pi / 2.0, np.radians(AZIMUTH))
    return {
        figure: {label: predict(probe, wall, "fem") for label, probe in pair.items()}
        for figure, pair in variants().items()
    }


def stated(computed: dict[str, dict[str, Trigger]]) -> float:
    """The ratio of the forces, as their sums over the azimuths."""
    strong, weak = computed["4.35, 4.36: preload"].values()
    return float(weak.force.sum() / strong.force.sum())


def draw(computed: dict[str, dict[str, Trigger]]) -> Figure:
    """The plot: force (top) and sensing distance (bottom)."""
    figure = Figure(figsize=(14, 6.5), layout="constrained", dpi=110)
    axes = figure.subplots(2, 4, sharex=True)
    for column, (name, pair) in enumerate(computed.items()):
        for style, (label, trigger) in zip(("k-", "r--"), pair.items(), strict=True):
            axes[0, column].plot(AZIMUTH, trigger.force, style, label=label)
            axes[1, column].plot(AZIMUTH, 1e3 * trigger.sensing_distance, style, label=label)
        axes[0, column].set_title(f"Figures {name}", fontsize=10)
        axes[0, column].legend(fontsize=8)
        axes[1, column].set_xlabel("azimuth / °")
    axes[0, 0].set_ylabel("trigger force / N")
    axes[1, 0].set_ylabel("sensing distance / µm")
    return figure


if __name__ == "__main__":
    found = compute()
    finish(__file__, "rodrigues_fig_4_27_to_4_36.png", draw(found), STATEMENT, stated(found))
