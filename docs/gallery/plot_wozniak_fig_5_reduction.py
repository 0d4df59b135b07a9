"""Woźniak, Figure 5: pretravel of a contact probe before and after his five-point correction.

The paper describes the probe only by the figures of its program (a 0.6 N spring, seats 8 mm apart,
a 2 mm tungsten carbide stem, a 4 mm ball). Support angle, hub and contact radii are assumed here.
The paper reports that the correction reduced the errors by more than half for 30 and 50 mm.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.base.directions import five_point_pattern, from_angles
from pretravel.maps.kinds.wozniak import WozniakBasis, wozniak_constant
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe, Seats, StylusSegment, Tip, Tripod
from pretravel.prediction.materials import material
from pretravel.prediction.trigger import predict
from pretravel.show.colours import LIGHT

LENGTHS = (30.0, 50.0)
AROUND = np.radians(np.arange(0, 361, 9))
ELEVATION = np.radians(np.arange(-90, 91, 9))


STATEMENT = Statement(
    "range of pretravel across the axis before the correction over that after it, 50 mm",
    "more than 2",
    "Woźniak, Figure 5",
    2.0,
    4.0,
    "the paper gives only the lower limit; twice this limit would mean another probe",
)


def contact_probe(length: float) -> Probe:
    """A probe similar to a TP6, with the published dimensions."""
    carbide = material("tungsten carbide")
    return replace(
        load_probe("omp40-2"),
        name=f"small contact probe, {length:g} mm",
        tripod=Tripod(8.0 / np.sqrt(3.0), tuple(np.radians([0, 120, 240])), 1.0, carbide),
        seats=Seats(np.radians(30.0), 1.25, carbide),
        preload=0.6,
        hub_offset=4.0,
        hub=None,
        stylus=(StylusSegment(length, 2.0, carbide),),
        tip=Tip(2.0, material("ruby")),
    )


def compute() -> dict[float, dict[str, tuple[np.ndarray, np.ndarray]]]:
    """For each length and section: pretravel before and after the correction, µm."""
    sections = {
        "XY": from_angles(np.full(len(AROUND), np.pi / 2), AROUND),
        "XZ": from_angles(np.abs(np.pi / 2 - (ELEVATION + np.pi / 2)),
                          np.where(ELEVATION < 0, np.pi, 0.0)),
    }  # fmt: skip
    results = {}
    for length in LENGTHS:
        probe = contact_probe(length)
        five = predict(probe, five_point_pattern()).pretravel
        constant = wozniak_constant(2.0 - five.mean(), 4.0, lobe_azimuth=np.pi)
        shape = WozniakBasis(np.pi)
        results[length] = {
            name: (
                1e3 * predict(probe, n).pretravel,
                1e3 * (predict(probe, n).pretravel - constant * shape.design(n)[:, 0]),
            )
            for name, n in sections.items()
        }
    return results


def reduction(before: np.ndarray, after: np.ndarray) -> float:
    """Ratio of the range before the correction to the range after it."""
    return float(np.ptp(before) / np.ptp(after))


def stated(results: dict[float, dict[str, tuple[np.ndarray, np.ndarray]]]) -> float:
    """The reduction by the correction for the stylus of 50 mm."""
    return reduction(*results[50.0]["XY"])


def draw(results: dict[float, dict[str, tuple[np.ndarray, np.ndarray]]]) -> Figure:
    """The polar diagrams, one for each length and section."""
    figure = Figure(figsize=(10.5, 9.5), layout="constrained", dpi=110)
    for row, (length, sections) in enumerate(results.items()):
        for column, (name, (before, after)) in enumerate(sections.items()):
            axes = figure.add_subplot(2, 2, 2 * row + column + 1, projection="polar")
            times = f"{reduction(before, after):.1f} times smaller"
            axes.set_title(f"{name}, {length:g} mm: range {times}", fontsize=11, pad=14)
            angle = AROUND if name == "XY" else np.pi / 2 - ELEVATION
            offset = 0.25 * before.max()
            axes.plot(angle, before + offset, "o-", ms=3, color=LIGHT["before"], label="before")
            axes.plot(angle, after + offset, "*-", ms=4, color=LIGHT["after"], label="after")
            axes.plot(angle, 0.0 * angle + offset, ":", color="0.5", label="zero")
            axes.legend(loc="lower left", fontsize=8)
    figure.suptitle("Pretravel (µm from the dotted zero) before and after Woźniak's correction")
    return figure


if __name__ == "__main__":
    computed = compute()
    for length_, by_section in computed.items():
        for section, values in by_section.items():
            print(length_, section, f"reduced {reduction(*values):.2f} times")
    finish(__file__, "wozniak_fig_5.png", draw(computed), STATEMENT, stated(computed))
