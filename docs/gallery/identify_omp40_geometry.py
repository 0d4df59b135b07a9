"""Identify the OMP40-2's unpublished dimensions from Rodrigues 2021, Table 4.1, polar 90°.

Seven sensing distances, printed to 0.1 µm, are fitted by seven dimensions. Each dimension
has a prior around a plausible value, within the bounds below; the result shows how far the
data move it. Run the script for elastic seats (the catalogue's omp40-2) and for rigid seats
(omp40-2-thesis):

    python docs/gallery/identify_omp40_geometry.py hertz
    python docs/gallery/identify_omp40_geometry.py rigid

The script prints the dimensions for the catalogue. It does not use Tables 4.2 to 4.9 and 2.3.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from pretravel.base.directions import grid
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.fem.condensation import condense
from pretravel.design.fem.elasticity import finite_element_model
from pretravel.design.fem.geometry import probe_solids
from pretravel.design.fem.mesh import MeshSettings, mesh_solids
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Hub, Probe
from pretravel.prediction.loading import loaded_to_trigger
from pretravel.prediction.materials import material
from pretravel.prediction.seats import seat_statics

TABLE = Path(__file__).parents[2] / "tests/validation/reference/rodrigues_trigger_50mm.csv"

# For each dimension: plausible value and half-width of its bounds, mm. The body of an OMP40-2
# is 40 mm wide; the heads of M4 styli have diameters of 5 to 8 mm.
PLAUSIBLE = {
    "hub radius": (7.0, 2.0),
    "hub height": (8.0, 3.0),
    "holder diameter": (8.0, 2.0),
    "head length": (9.0, 3.0),
    "head diameter": (6.5, 1.5),
    "rod radius": (2.0, 0.75),
    "ball radius": (2.5, 1.0),
}
ROUNDING = 0.1 / np.sqrt(12.0)  # µm: standard deviation of the rounding of the printed values


def with_dimensions(probe: Probe, values: np.ndarray) -> Probe:
    """The probe with other unpublished dimensions; the published dimensions do not change."""
    hub_radius, hub_height, holder, head_length, head_diameter, rod, ball = map(float, values)
    head, stem = probe.stylus
    length = probe.stylus_length
    return replace(
        probe,
        hub=Hub(hub_radius, hub_height, holder, material("tungsten carbide")),
        stylus=(
            replace(head, length=head_length, diameter=head_diameter),
            replace(stem, length=length - head_length),
        ),
        tripod=replace(probe.tripod, rod_radius=rod),
        seats=replace(probe.seats, ball_radius=ball),
    )


def sensing_distance(probe: Probe, directions: np.ndarray, settings: MeshSettings) -> np.ndarray:
    """Sensing distances by finite elements, µm, shape (n,); the cache is not used."""
    solids = probe_solids(probe, settings.patch_radius * probe.tripod.rod_radius)
    reduced = condense(finite_element_model(probe, solids, mesh_solids(solids, settings)))
    statics = seat_statics(probe)
    loading, _ = loaded_to_trigger(probe, statics, directions, material("steel"))
    parts = FiniteElements(reduced).displacements(loading)
    moved = sum(vector for name, vector in parts.items() if name != "tip_on_part")
    return 1e3 * np.linalg.norm(moved[:, :2], axis=1)


def main(contact: str) -> None:
    with TABLE.open(encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["polar_deg"] == "90"]
    printed = 1e3 * np.array([float(row["sensing_distance_fea_mm"]) for row in rows])
    azimuth = np.radians([float(row["azimuth_deg"]) for row in rows])
    directions = grid(np.array([np.pi / 2]), azimuth)
    probe = load_probe("omp40-2")
    probe = replace(probe, seats=replace(probe.seats, contact=contact))
    middle = np.array([value for value, _ in PLAUSIBLE.values()])
    width = np.array([half for _, half in PLAUSIBLE.values()])
    settings = MeshSettings(refinement=0.6)  # within 0.3 % of the default, a fifth of the rounding

    def residuals(shifted: np.ndarray) -> np.ndarray:
        scaled = shifted - 2.0  # shifted, because the steps of finite differences are relative
        predicted = sensing_distance(
            with_dimensions(probe, middle + width * scaled), directions, settings
        )
        print(f"  {np.round(middle + width * scaled, 3)} -> {np.round(predicted, 2)}", flush=True)
        # The standard deviation of the prior is half of the bounds' half-width.
        return np.concatenate([(predicted - printed) / ROUNDING, 2.0 * scaled])

    fit = least_squares(residuals, np.full(7, 2.0), bounds=(1.0, 3.0), diff_step=0.05, max_nfev=6)
    print(f"seats {contact}: residuals {np.round(fit.fun[:7] * ROUNDING, 2)} µm")
    for name, value in zip(PLAUSIBLE, middle + width * (fit.x - 2.0), strict=True):
        print(f"  {name:16} {value:.2f} mm")


if __name__ == "__main__":
    main(sys.argv[1])
