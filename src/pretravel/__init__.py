"""pretravel: predict, calibrate and compensate the pretravel of touch-trigger probes.

The names below are the public surface; each is imported when it is first used, so
that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_PUBLIC = {
    # foundations
    "PretravelError": "errors",
    "InputError": "errors",
    "DescriptionError": "errors",
    "ExtrapolationError": "errors",
    # the two shared types
    "Touches": "touches",
    "PretravelMap": "pretravel_map",
    # virtual branch
    "Probe": "probe.description",
    "load_probe": "probe.catalogue",
    "material": "probe.materials",
    "MeshSettings": "model.mesh",
    "ReducedModel": "model.condensation",
    "reduced_model": "model.reduction_cache",
    "predict": "trigger.predict",
    "predicted_map": "trigger.predict",
    "Trigger": "trigger.predict",
    "field_at_trigger": "trigger.elastic_field",
    "friction_cycle": "trigger.friction",
    "Targets": "probing.targets",
    "touch": "probing.touching",
    "SurfaceTouches": "probing.touching",
    "TouchStatus": "probing.touching",
    "predicted_tip": "probing.tip",
    "slide": "probing.slide",
    "read_step_part": "surface.cad",
    "plan_inspection": "surface.inspection",
    "FunctionSurface": "surface.parametric",
    "simulate": "probing.simulation",
    "parse_surface": "surface.specification",
    # measured branch
    "qualify": "identification.qualification",
    "Qualification": "metrology.qualification",
    "apply": "metrology.compensation",
    "embed": "metrology.compensation",
    "Points": "metrology.compensation",
    "measured_sphere": "metrology.result_uncertainty",
    "sphere_by_trials": "metrology.result_uncertainty",
    "point_sources": "metrology.compensation",
    "separate": "metrology.separation",
    "Readings": "metrology.separation",
    "rig_touch": "metrology.rig",
    "calibrate_rig": "metrology.rig_calibration",
    "propagate": "metrology.uncertainty",
    "monte_carlo": "metrology.monte_carlo",
    "fit_sphere": "metrology.fitting",
    "fit_circle": "metrology.fitting",
    "fit_plane": "metrology.fitting",
    "fit_cylinder": "metrology.fitting",
    # both branches
    "identify": "identification.probe",
    "verify": "metrology.drift",
    "compare_corrections": "metrology.comparison",
    # the machine
    "Machine": "controls.machine",
    "plan_program": "controls.program",
    "read_machine": "formats.machine_file",
    "read_readings": "formats.catalogue",
    # files
    "read_touches": "formats.touches_csv",
    "write_touches": "formats.touches_csv",
    "read_map": "formats.map_file",
    "write_map": "formats.map_file",
    "write_points": "formats.points",
}

__all__ = ["__version__", *_PUBLIC]

if TYPE_CHECKING:
    from pretravel.controls.machine import Machine
    from pretravel.controls.program import plan_program
    from pretravel.errors import (
        DescriptionError,
        ExtrapolationError,
        InputError,
        PretravelError,
    )
    from pretravel.formats.catalogue import read_readings
    from pretravel.formats.machine_file import read_machine
    from pretravel.formats.map_file import read_map, write_map
    from pretravel.formats.points import write_points
    from pretravel.formats.touches_csv import read_touches, write_touches
    from pretravel.identification.probe import identify
    from pretravel.identification.qualification import qualify
    from pretravel.metrology.comparison import compare_corrections
    from pretravel.metrology.compensation import Points, apply, embed, point_sources
    from pretravel.metrology.drift import verify
    from pretravel.metrology.fitting import fit_circle, fit_cylinder, fit_plane, fit_sphere
    from pretravel.metrology.monte_carlo import monte_carlo
    from pretravel.metrology.qualification import Qualification
    from pretravel.metrology.result_uncertainty import measured_sphere, sphere_by_trials
    from pretravel.metrology.rig import rig_touch
    from pretravel.metrology.rig_calibration import calibrate_rig
    from pretravel.metrology.separation import Readings, separate
    from pretravel.metrology.uncertainty import propagate
    from pretravel.model.condensation import ReducedModel
    from pretravel.model.mesh import MeshSettings
    from pretravel.model.reduction_cache import reduced_model
    from pretravel.pretravel_map import PretravelMap
    from pretravel.probe.catalogue import load_probe
    from pretravel.probe.description import Probe
    from pretravel.probe.materials import material
    from pretravel.probing.simulation import simulate
    from pretravel.probing.slide import slide
    from pretravel.probing.targets import Targets
    from pretravel.probing.tip import predicted_tip
    from pretravel.probing.touching import SurfaceTouches, TouchStatus, touch
    from pretravel.surface.cad import read_step_part
    from pretravel.surface.inspection import plan_inspection
    from pretravel.surface.parametric import FunctionSurface
    from pretravel.surface.specification import parse_surface
    from pretravel.touches import Touches
    from pretravel.trigger.elastic_field import field_at_trigger
    from pretravel.trigger.friction import friction_cycle
    from pretravel.trigger.predict import Trigger, predict, predicted_map


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(f"pretravel.{_PUBLIC[name]}"), name)
    raise AttributeError(f"module 'pretravel' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
