"""Coarse finite-element models of the OMP40-2 and of other probes of the catalogue.

Models by name come from the cache, which the workers share.
"""

from __future__ import annotations

from functools import cache, partial

import pytest

from pretravel.design.fem import reduction_cache
from pretravel.design.fem.condensation import ReducedModel, condense
from pretravel.design.fem.elasticity import FiniteElementModel, finite_element_model
from pretravel.design.fem.geometry import probe_body, probe_solids
from pretravel.design.fem.mesh import MeshSettings, mesh_solids
from pretravel.prediction.catalogue import load_probe

COARSE = MeshSettings(refinement=0.4)
MESH_ERROR = {"coarse": 0.01, "default": 0.0}
"""By which the coarse mesh changes a sensing distance; that of the default is below 0.5 %
(``test_sensing_distance_converges``) and in what is allowed."""
MESHES = ("coarse", pytest.param("default", marks=pytest.mark.slow))


def models_by_name_are_coarse(patch: pytest.MonkeyPatch) -> None:
    """``predict(probe, directions, "fem")`` uses the coarse mesh, in a third of the time."""
    patch.setattr(
        reduction_cache, "MeshSettings", partial(MeshSettings, refinement=COARSE.refinement)
    )


@cache
def coarse_model() -> FiniteElementModel:
    probe = load_probe("omp40-2")
    solids = probe_solids(probe, COARSE.patch_radius * probe.tripod.rod_radius)
    return finite_element_model(probe, solids, mesh_solids(solids, COARSE))


@cache
def coarse_reduced() -> ReducedModel:
    """Of the whole mesh, without its symmetry: four times the work of `coarse_reduced_sixth`."""
    return condense(coarse_model())


@cache
def coarse_sixth() -> FiniteElementModel:
    """The same probe by its symmetry."""
    probe = load_probe("omp40-2")
    solids = probe_body(probe, COARSE.patch_radius * probe.tripod.rod_radius)
    return finite_element_model(probe, solids, mesh_solids(solids, COARSE))


@cache
def coarse_reduced_sixth() -> ReducedModel:
    """For all that does not depend on the mesh."""
    return condense(coarse_sixth())
