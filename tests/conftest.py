"""Probes, directions and touches that the tests share."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from pretravel.directions import sphere_pattern_25
from pretravel.model.fem.condensation import ReducedModel, condense
from pretravel.model.fem.elasticity import FiniteElementModel, finite_element_model
from pretravel.model.fem.geometry import probe_solids
from pretravel.model.fem.mesh import MeshSettings, mesh_solids
from pretravel.probe.catalogue import load_probe
from pretravel.probe.description import Probe
from pretravel.touches import Touches

# Derandomised: a check that passes here passes on every machine.
settings.register_profile(
    "pretravel",
    derandomize=True,
    deadline=None,
    max_examples=40,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
settings.load_profile("pretravel")

COARSE = MeshSettings(refinement=0.4)


@cache
def coarse_model() -> FiniteElementModel:
    probe = load_probe("omp40-2")
    solids = probe_solids(probe, COARSE.patch_radius * probe.tripod.rod_radius)
    return finite_element_model(probe, solids, mesh_solids(solids, COARSE))


@cache
def coarse_reduced() -> ReducedModel:
    return condense(coarse_model())


EXAMPLES = Path(__file__).parent.parent / "examples" / "data"


@pytest.fixture
def omp40() -> Probe:
    return load_probe("omp40-2")


def turned(probe: Probe, rotation: float) -> Probe:
    """The probe turned about its axis in the machine."""
    return replace(probe, orientation=replace(probe.orientation, rotation=rotation))


def sphere_touches(
    pretravel: np.ndarray,
    normals: np.ndarray | None = None,
    center: tuple[float, float, float] = (0.0, 0.0, 0.0),
    radius: float = 12.5,
    tip_radius: float = 3.0,
) -> Touches:
    """Touches along the normals of a sphere with given pretravel."""
    n = sphere_pattern_25() if normals is None else normals
    return Touches(np.asarray(center) + n * (radius + tip_radius - pretravel)[:, None], n)
