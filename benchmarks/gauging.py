"""A simulated shop: 50 bores, a tool that wears, semi-finish, measure, correct, finish.

Each bore is measured by the exported cycle on the model of a LinuxCNC machine, with a probe whose
pretravel has lobes, and corrected as `pretravel_correct` does it: by the compensated diameter (the
map), or by that with the radius of the tip alone. `python -m benchmarks.gauging` prints how many
parts conform to 40 ± 0.010 mm, and draws the picture of the guide.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.lookup_formula import exact_lookup
from tests.support.machine_model.machine import Machine, run
from tests.support.machine_model.probe import Probe
from tests.support.machine_model.world import Ring, World
from tests.support.simulated_probe import simulated_map, simulated_pretravel

TOLERANCE = 0.010
"""Of the finished diameter, both ways. [mm]"""
NOMINAL, SEMI_FINISHED = 40.0, 39.8
U = 0.002
"""Of a measured diameter; a deviation below it is not corrected. [mm]"""
PICTURE = Path(__file__).parent.parent / "docs" / "pictures" / "gauging.png"


@dataclass(frozen=True)
class Shop:
    """Deviations of the finished diameters from nominal, by what corrected the tool. [mm]"""

    map_: FloatArray
    tip_radius: FloatArray
    not_corrected: FloatArray

    def conforming(self) -> dict[str, int]:
        """Parts within the tolerance."""
        ways = {"map": self.map_, "tip radius": self.tip_radius, "nothing": self.not_corrected}
        return {name: int(np.sum(np.abs(way) <= TOLERANCE)) for name, way in ways.items()}


def _measured(diameter: float, subroutines: dict[str, str]) -> tuple[float, float]:
    """Of a bore: the diameter with the map, and that with the radius of the tip alone. [mm]"""
    bore = Ring((0.02, -0.03, 0.0), 0.5 * diameter + 5.0, 5.0)
    machine = Machine(World((bore,)), position=(0.0, 0.0, 0.0), acceleration=2000.0)
    probe = Probe(lambda normal: float(simulated_pretravel(np.array([normal]))[0]))
    call = f"G21 G90 G94 G54\no<pretravel_bore> call [{SEMI_FINISHED}] [100]\nM2\n"
    trace = run(machine, call, probe=probe, subroutines=subroutines)
    if trace.error:
        raise RuntimeError(trace.error)
    found = trace.parameters
    return found["_pretravel_diameter"], found["_pretravel_raw_diameter"]


def shop(parts: int = 50, seed: int = 53) -> Shop:
    """Cut the parts; the tool loses 0.6 µm of its radius with each, and 0.5 µm at random."""
    pretravel_map = simulated_map()
    form = exact_lookup(pretravel_map)
    if form is None:
        raise RuntimeError("the map of the simulated probe has no formula")
    subroutines = linuxcnc_subroutines(pretravel_map, form)
    random = np.random.default_rng(seed)
    wear = np.cumsum(6e-4 + random.normal(0.0, 5e-4, parts))
    cut = random.normal(0.0, 1e-3, (2, parts))  # deflection and so on, of each diameter
    ways = {}
    for number, way in enumerate(("map", "tip radius", "nothing")):
        table, deviations = 0.0, []  # radius of the tool in the table less that of a new tool
        for k in range(parts):
            error = 2.0 * (-wear[k] - table)
            if number < 2:
                found = _measured(SEMI_FINISHED + error + cut[0, k], subroutines)[number]
                if abs(found - SEMI_FINISHED) > U:
                    table += 0.5 * (found - SEMI_FINISHED)
            deviations.append(2.0 * (-wear[k] - table) + cut[1, k])
        ways[way] = np.array(deviations)
    return Shop(ways["map"], ways["tip radius"], ways["nothing"])


def draw(found: Shop, path: Path) -> None:
    """Deviations of the parts, and the tolerance."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.4), layout="constrained")
    axes = figure.add_subplot()
    part = np.arange(1, len(found.map_) + 1)
    for values, label, mark in (
        (found.map_, "corrected with the map", "o"),
        (found.tip_radius, "corrected with the radius of the tip", "s"),
        (found.not_corrected, "not corrected", "^"),
    ):
        axes.plot(part, 1e3 * values, mark, ms=3.5, label=label)
    axes.axhspan(-1e3 * TOLERANCE, 1e3 * TOLERANCE, alpha=0.15, color="#007d5c")
    axes.set_xlabel("part")
    axes.set_ylabel("diameter off 40 mm / µm")
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Print what conforms, and draw the picture."""
    found = shop()
    for name, count in found.conforming().items():
        print(f"{name}: {count} of {len(found.map_)} parts conform")
    draw(found, PICTURE)


if __name__ == "__main__":
    main()
