"""pretravel: predict, calibrate and compensate the pretravel of touch-trigger probes.

The names below are the public surface; each is imported when it is first used, so
that importing the package costs nothing.
"""

from __future__ import annotations

import sys

if getattr(sys, "argv", [])[:1] == ["-m"] and not sys.flags.safe_path:
    # python -m pretravel: a typing.py or shutil.py beside a part file must not be imported. A
    # program in the current folder that imports pretravel has the modules beside it.
    _started = sys.orig_argv[-len(sys.argv)].partition(".")[0]  # "pretravel" or "-mpretravel"
    if _started == "pretravel" or (_started[:1] == "-" and _started.endswith("mpretravel")):
        del sys.path[0]

from importlib import import_module
from typing import TYPE_CHECKING, Any

_PUBLIC = {
    # foundations
    "PretravelError": "errors",
    "InputError": "errors",
    "DescriptionError": "errors",
    "ExtrapolationError": "errors",
    # the two shared types
    "Touches": "touches",
    "PretravelMap": "maps.pretravel_map",
    "Placement": "frames",
    "Provenance": "maps.provenance",
    # virtual branch
    "Probe": "probe.description",
    "load_probe": "probe.catalogue",
    "material": "probe.materials",
    "MeshSettings": "model.fem.mesh",
    "ReducedModel": "model.fem.condensation",
    "reduced_model": "model.fem.reduction_cache",
    "predict": "trigger.predict",
    "predicted_map": "trigger.predict",
    "Trigger": "trigger.predict",
    "field_at_trigger": "trigger.elastic_field",
    "friction_cycle": "trigger.friction",
    "Targets": "probing.targets",
    "touch": "probing.touching",
    "SurfaceTouches": "probing.surface_touches",
    "TouchStatus": "probing.surface_touches",
    "predicted_tip": "probing.tip",
    "SlideSettings": "probing.slide",
    "slide": "probing.slide",
    "read_part": "surface.cad.part_file",
    "read_step_part": "surface.cad.step_part",
    "InspectionRegion": "probing.inspection",
    "plan_inspection": "probing.inspection",
    "FunctionSurface": "surface.parametric",
    "Latch": "probing.simulation",
    "PartSetup": "probing.simulation",
    "simulate": "probing.simulation",
    "parse_surface": "surface.specification",
    # measured branch
    "qualify": "identification.kind_registry",
    "choose": "identification.kind_registry",
    "qualify_like": "identification.kind_registry",
    "QualificationSetup": "maps.provenance",
    "KindOfMap": "maps.kind",
    "WozniakKind": "maps.kinds.wozniak",
    "Qualification": "qualification.qualification",
    "apply": "compensation.compensation",
    "embed": "compensation.compensation",
    "Points": "compensation.points",
    "measured_sphere": "compensation.measured_sphere",
    "sphere_by_trials": "compensation.measured_sphere",
    "point_sources": "compensation.point_errors",
    "measure_feature": "features.measured_feature",
    "MeasuredFeature": "features.measured_feature",
    "FeatureTolerances": "features.tolerances",
    "inspect_feature": "features.tolerances",
    "size_conformity": "features.conformity",
    "position_conformity": "features.conformity",
    "form_conformity": "features.conformity",
    "separate": "laboratory.separation",
    "MultiStepReadings": "laboratory.multi_step_readings",
    "RepeatedPair": "laboratory.multi_step_readings",
    "Separation": "laboratory.separation",
    "read_multi_step_readings": "formats.separation_csv",
    "read_rig_trace": "formats.rig_csv",
    "RigTrace": "laboratory.rig",
    "RigTouch": "laboratory.rig",
    "rig_touch": "laboratory.rig_events",
    "RigCalibration": "laboratory.rig_calibration",
    "calibrate_rig": "laboratory.rig_calibration",
    "Covariance": "uncertainty.covariance",
    "propagate": "uncertainty.gum",
    "Input": "uncertainty.monte_carlo",
    "independent": "uncertainty.monte_carlo",
    "joint_normal": "uncertainty.monte_carlo",
    "monte_carlo": "uncertainty.monte_carlo",
    "validate": "uncertainty.monte_carlo",
    "fit_sphere": "uncertainty.fitting.sphere",
    "fit_circle": "uncertainty.fitting.circle",
    "fit_plane": "uncertainty.fitting.plane",
    "fit_cylinder": "uncertainty.fitting.cylinder",
    "fit_cone": "uncertainty.fitting.cone",
    # both branches
    "identify": "identification.probe_from_map",
    "verify": "qualification.verification",
    "compare_corrections": "compensation.comparison",
    # the machine
    "Machine": "controls.machine",
    "plan_program": "controls.program",
    "PartObstacle": "controls.surroundings",
    "SphereObstacle": "controls.surroundings",
    "linuxcnc_program": "controls.linuxcnc_program",
    "read_machine": "formats.machine_file",
    "read_readings": "formats.readings",
    "write_readings": "formats.readings",
    "SourceFile": "formats.source_file",
    "FileReadings": "formats.file_format",
    "ReadingOptions": "formats.file_format",
    # files
    "read_targets": "formats.touches_csv",
    "read_plan": "formats.touches_csv",
    "read_touches": "formats.touches_csv",
    "write_touches": "formats.touches_csv",
    "read_map": "formats.map_file",
    "write_map": "formats.map_file",
    "write_points": "formats.point_files",
    "read_points": "formats.points_reading",
}

__all__ = ["__version__", *_PUBLIC]

if TYPE_CHECKING:
    __version__: str

    from pretravel.compensation.comparison import compare_corrections
    from pretravel.compensation.compensation import apply, embed
    from pretravel.compensation.measured_sphere import measured_sphere, sphere_by_trials
    from pretravel.compensation.point_errors import point_sources
    from pretravel.compensation.points import Points
    from pretravel.controls.linuxcnc_program import linuxcnc_program
    from pretravel.controls.machine import Machine
    from pretravel.controls.program import plan_program
    from pretravel.controls.surroundings import PartObstacle, SphereObstacle
    from pretravel.errors import (
        DescriptionError,
        ExtrapolationError,
        InputError,
        PretravelError,
    )
    from pretravel.features.conformity import (
        form_conformity,
        position_conformity,
        size_conformity,
    )
    from pretravel.features.measured_feature import MeasuredFeature, measure_feature
    from pretravel.features.tolerances import FeatureTolerances, inspect_feature
    from pretravel.formats.file_format import FileReadings, ReadingOptions
    from pretravel.formats.machine_file import read_machine
    from pretravel.formats.map_file import read_map, write_map
    from pretravel.formats.point_files import write_points
    from pretravel.formats.points_reading import read_points
    from pretravel.formats.readings import read_readings, write_readings
    from pretravel.formats.rig_csv import read_rig_trace
    from pretravel.formats.separation_csv import read_multi_step_readings
    from pretravel.formats.source_file import SourceFile
    from pretravel.formats.touches_csv import read_plan, read_targets, read_touches, write_touches
    from pretravel.frames import Placement
    from pretravel.identification.kind_registry import choose, qualify, qualify_like
    from pretravel.identification.probe_from_map import identify
    from pretravel.laboratory.multi_step_readings import MultiStepReadings, RepeatedPair
    from pretravel.laboratory.rig import RigTouch, RigTrace
    from pretravel.laboratory.rig_calibration import RigCalibration, calibrate_rig
    from pretravel.laboratory.rig_events import rig_touch
    from pretravel.laboratory.separation import Separation, separate
    from pretravel.maps.kind import KindOfMap
    from pretravel.maps.kinds.wozniak import WozniakKind
    from pretravel.maps.pretravel_map import PretravelMap
    from pretravel.maps.provenance import Provenance, QualificationSetup
    from pretravel.model.fem.condensation import ReducedModel
    from pretravel.model.fem.mesh import MeshSettings
    from pretravel.model.fem.reduction_cache import reduced_model
    from pretravel.probe.catalogue import load_probe
    from pretravel.probe.description import Probe
    from pretravel.probe.materials import material
    from pretravel.probing.inspection import InspectionRegion, plan_inspection
    from pretravel.probing.simulation import Latch, PartSetup, simulate
    from pretravel.probing.slide import SlideSettings, slide
    from pretravel.probing.surface_touches import SurfaceTouches, TouchStatus
    from pretravel.probing.targets import Targets
    from pretravel.probing.tip import predicted_tip
    from pretravel.probing.touching import touch
    from pretravel.qualification.qualification import Qualification
    from pretravel.qualification.verification import verify
    from pretravel.surface.cad.part_file import read_part
    from pretravel.surface.cad.step_part import read_step_part
    from pretravel.surface.parametric import FunctionSurface
    from pretravel.surface.specification import parse_surface
    from pretravel.touches import Touches
    from pretravel.trigger.elastic_field import field_at_trigger
    from pretravel.trigger.friction import friction_cycle
    from pretravel.trigger.predict import Trigger, predict, predicted_map
    from pretravel.uncertainty.covariance import Covariance
    from pretravel.uncertainty.fitting.circle import fit_circle
    from pretravel.uncertainty.fitting.cone import fit_cone
    from pretravel.uncertainty.fitting.cylinder import fit_cylinder
    from pretravel.uncertainty.fitting.plane import fit_plane
    from pretravel.uncertainty.fitting.sphere import fit_sphere
    from pretravel.uncertainty.gum import propagate
    from pretravel.uncertainty.monte_carlo import (
        Input,
        independent,
        joint_normal,
        monte_carlo,
        validate,
    )


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return _installed_version()
    if name in _PUBLIC:
        return getattr(import_module(f"pretravel.{_PUBLIC[name]}"), name)
    raise AttributeError(f"module 'pretravel' has no attribute '{name}'")


def _installed_version() -> str:
    """What the build wrote from the tags; a folder that was never installed has no version."""
    # Imported here: it takes as long as the rest of this package.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("pretravel")
    except PackageNotFoundError:
        return "0+not.installed"


def __dir__() -> list[str]:
    return sorted(__all__)
