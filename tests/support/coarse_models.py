"""A coarse finite-element model of the OMP40-2, made once in each worker."""

from __future__ import annotations

from functools import cache

from pretravel.model.fem.condensation import ReducedModel, condense
from pretravel.model.fem.elasticity import FiniteElementModel, finite_element_model
from pretravel.model.fem.geometry import probe_solids
from pretravel.model.fem.mesh import MeshSettings, mesh_solids
from pretravel.probe.catalogue import load_probe

COARSE = MeshSettings(refinement=0.4)


@cache
def coarse_model() -> FiniteElementModel:
    probe = load_probe("omp40-2")
    solids = probe_solids(probe, COARSE.patch_radius * probe.tripod.rod_radius)
    return finite_element_model(probe, solids, mesh_solids(solids, COARSE))


@cache
def coarse_reduced() -> ReducedModel:
    return condense(coarse_model())
