"""Convergence of the sensing distance with the mesh: five refinements, observed rate, limit.

The description contains no fillets. The re-entrant edges limit the rate to between a half and one.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.base.directions import from_angles
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.fem.condensation import condense
from pretravel.design.fem.elasticity import finite_element_model
from pretravel.design.fem.mesh import MeshSettings, mesh_probe
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict

REFINEMENTS = (0.5, 0.7071, 1.0, 1.4142, 2.0)
DIRECTIONS = from_angles(np.radians([90.0, 90.0, 40.0]), np.radians([0.0, 60.0, 20.0]))


STATEMENT = Statement(
    "observed rate of convergence at polar 90°, azimuth 0°",
    "between 0.5 and 1",
    "theory: stresses at re-entrant edges are singular",
    0.5,
    1.0,
    "the re-entrant edges limit the rate",
)


def compute(name: str = "omp40-2") -> tuple[np.ndarray, np.ndarray]:
    """Number of unknowns (k,) and sensing distances (k, 3), µm, for each refinement."""
    probe, unknowns, distances = load_probe(name), [], []
    for refinement in REFINEMENTS:
        settings = MeshSettings(refinement=refinement)
        reduced = condense(finite_element_model(probe, *mesh_probe(probe, settings)))
        model = FiniteElements(reduced)
        unknowns.append(int(reduced.summary["unknowns"]))  # of the whole body
        distances.append(1e3 * predict(probe, DIRECTIONS, model).sensing_distance)
    return np.array(unknowns), np.array(distances)


def extrapolated(distances: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Observed rate and limit from the refinements 0.5, 1 and 2 (Richardson)."""
    coarse, middle, fine = distances[0], distances[2], distances[4]
    rate = np.log2((middle - coarse) / (fine - middle))
    return rate, fine + (fine - middle) / (2.0**rate - 1.0)


def stated(computed: tuple[np.ndarray, np.ndarray]) -> float:
    """The rate of the first direction."""
    return float(extrapolated(computed[1])[0][0])


def draw(unknowns: np.ndarray, distances: np.ndarray) -> Figure:
    """The plot of the error against the limit over the refinement."""
    rate, limit = extrapolated(distances)
    figure = Figure(figsize=(7, 5), layout="constrained", dpi=110)
    axes = figure.subplots()
    for column, label in enumerate(("90°, 0°", "90°, 60°", "40°, 20°")):
        error = 100.0 * (1.0 - distances[:, column] / limit[column])
        axes.loglog(
            REFINEMENTS, error, "-o", label=f"polar, azimuth {label}: rate {rate[column]:.2f}"
        )
    axes.axhline(0.5, color="k", ls=":", lw=0.8)
    axes.set_xticks(
        REFINEMENTS, [f"{r:.2g}\n{u // 1000}k" for r, u in zip(REFINEMENTS, unknowns, strict=True)]
    )
    axes.set_xlabel("refinement, unknowns")
    axes.set_ylabel("sensing distance below the limit / %")
    axes.minorticks_off()
    axes.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    found = compute()
    rates, limits = extrapolated(found[1])
    for unknown, distance in zip(*found, strict=True):
        print(
            f"{unknown:8d}  {np.round(distance, 4)}  {np.round(100 * (1 - distance / limits), 3)} %"
        )
    print(f"rate {np.round(rates, 2)}, limit {np.round(limits, 4)}")
    finish(__file__, "convergence.png", draw(*found), STATEMENT, stated(found))
