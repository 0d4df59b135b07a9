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
    # With "as", because type checkers take such names alone as public.
    __version__: str

    from pretravel.compensation.comparison import compare_corrections as compare_corrections
    from pretravel.compensation.compensation import apply as apply
    from pretravel.compensation.compensation import embed as embed
    from pretravel.compensation.measured_sphere import (
        measured_sphere as measured_sphere,
    )
    from pretravel.compensation.measured_sphere import (
        sphere_by_trials as sphere_by_trials,
    )
    from pretravel.compensation.point_errors import point_sources as point_sources
    from pretravel.compensation.points import Points as Points
    from pretravel.controls.linuxcnc_program import linuxcnc_program as linuxcnc_program
    from pretravel.controls.machine import Machine as Machine
    from pretravel.controls.program import plan_program as plan_program
    from pretravel.controls.surroundings import (
        PartObstacle as PartObstacle,
    )
    from pretravel.controls.surroundings import (
        SphereObstacle as SphereObstacle,
    )
    from pretravel.errors import (
        DescriptionError as DescriptionError,
    )
    from pretravel.errors import (
        ExtrapolationError as ExtrapolationError,
    )
    from pretravel.errors import (
        InputError as InputError,
    )
    from pretravel.errors import (
        PretravelError as PretravelError,
    )
    from pretravel.features.conformity import (
        form_conformity as form_conformity,
    )
    from pretravel.features.conformity import (
        position_conformity as position_conformity,
    )
    from pretravel.features.conformity import (
        size_conformity as size_conformity,
    )
    from pretravel.features.measured_feature import (
        MeasuredFeature as MeasuredFeature,
    )
    from pretravel.features.measured_feature import (
        measure_feature as measure_feature,
    )
    from pretravel.features.tolerances import (
        FeatureTolerances as FeatureTolerances,
    )
    from pretravel.features.tolerances import (
        inspect_feature as inspect_feature,
    )
    from pretravel.formats.file_format import (
        FileReadings as FileReadings,
    )
    from pretravel.formats.file_format import (
        ReadingOptions as ReadingOptions,
    )
    from pretravel.formats.machine_file import read_machine as read_machine
    from pretravel.formats.map_file import read_map as read_map
    from pretravel.formats.map_file import write_map as write_map
    from pretravel.formats.point_files import write_points as write_points
    from pretravel.formats.points_reading import read_points as read_points
    from pretravel.formats.readings import (
        read_readings as read_readings,
    )
    from pretravel.formats.readings import (
        write_readings as write_readings,
    )
    from pretravel.formats.rig_csv import read_rig_trace as read_rig_trace
    from pretravel.formats.separation_csv import (
        read_multi_step_readings as read_multi_step_readings,
    )
    from pretravel.formats.source_file import SourceFile as SourceFile
    from pretravel.formats.touches_csv import (
        read_plan as read_plan,
    )
    from pretravel.formats.touches_csv import (
        read_targets as read_targets,
    )
    from pretravel.formats.touches_csv import (
        read_touches as read_touches,
    )
    from pretravel.formats.touches_csv import (
        write_touches as write_touches,
    )
    from pretravel.frames import Placement as Placement
    from pretravel.identification.kind_registry import (
        choose as choose,
    )
    from pretravel.identification.kind_registry import (
        qualify as qualify,
    )
    from pretravel.identification.kind_registry import (
        qualify_like as qualify_like,
    )
    from pretravel.identification.probe_from_map import identify as identify
    from pretravel.laboratory.multi_step_readings import (
        MultiStepReadings as MultiStepReadings,
    )
    from pretravel.laboratory.multi_step_readings import (
        RepeatedPair as RepeatedPair,
    )
    from pretravel.laboratory.rig import RigTouch as RigTouch
    from pretravel.laboratory.rig import RigTrace as RigTrace
    from pretravel.laboratory.rig_calibration import (
        RigCalibration as RigCalibration,
    )
    from pretravel.laboratory.rig_calibration import (
        calibrate_rig as calibrate_rig,
    )
    from pretravel.laboratory.rig_events import rig_touch as rig_touch
    from pretravel.laboratory.separation import Separation as Separation
    from pretravel.laboratory.separation import separate as separate
    from pretravel.maps.kind import KindOfMap as KindOfMap
    from pretravel.maps.kinds.wozniak import WozniakKind as WozniakKind
    from pretravel.maps.pretravel_map import PretravelMap as PretravelMap
    from pretravel.maps.provenance import (
        Provenance as Provenance,
    )
    from pretravel.maps.provenance import (
        QualificationSetup as QualificationSetup,
    )
    from pretravel.model.fem.condensation import ReducedModel as ReducedModel
    from pretravel.model.fem.mesh import MeshSettings as MeshSettings
    from pretravel.model.fem.reduction_cache import reduced_model as reduced_model
    from pretravel.probe.catalogue import load_probe as load_probe
    from pretravel.probe.description import Probe as Probe
    from pretravel.probe.materials import material as material
    from pretravel.probing.inspection import (
        InspectionRegion as InspectionRegion,
    )
    from pretravel.probing.inspection import (
        plan_inspection as plan_inspection,
    )
    from pretravel.probing.simulation import (
        Latch as Latch,
    )
    from pretravel.probing.simulation import (
        PartSetup as PartSetup,
    )
    from pretravel.probing.simulation import (
        simulate as simulate,
    )
    from pretravel.probing.slide import SlideSettings as SlideSettings
    from pretravel.probing.slide import slide as slide
    from pretravel.probing.surface_touches import (
        SurfaceTouches as SurfaceTouches,
    )
    from pretravel.probing.surface_touches import (
        TouchStatus as TouchStatus,
    )
    from pretravel.probing.targets import Targets as Targets
    from pretravel.probing.tip import predicted_tip as predicted_tip
    from pretravel.probing.touching import touch as touch
    from pretravel.qualification.qualification import Qualification as Qualification
    from pretravel.qualification.verification import verify as verify
    from pretravel.surface.cad.part_file import read_part as read_part
    from pretravel.surface.cad.step_part import read_step_part as read_step_part
    from pretravel.surface.parametric import FunctionSurface as FunctionSurface
    from pretravel.surface.specification import parse_surface as parse_surface
    from pretravel.touches import Touches as Touches
    from pretravel.trigger.elastic_field import field_at_trigger as field_at_trigger
    from pretravel.trigger.friction import friction_cycle as friction_cycle
    from pretravel.trigger.predict import (
        Trigger as Trigger,
    )
    from pretravel.trigger.predict import (
        predict as predict,
    )
    from pretravel.trigger.predict import (
        predicted_map as predicted_map,
    )
    from pretravel.uncertainty.covariance import Covariance as Covariance
    from pretravel.uncertainty.fitting.circle import fit_circle as fit_circle
    from pretravel.uncertainty.fitting.cone import fit_cone as fit_cone
    from pretravel.uncertainty.fitting.cylinder import fit_cylinder as fit_cylinder
    from pretravel.uncertainty.fitting.plane import fit_plane as fit_plane
    from pretravel.uncertainty.fitting.sphere import fit_sphere as fit_sphere
    from pretravel.uncertainty.gum import propagate as propagate
    from pretravel.uncertainty.monte_carlo import (
        Input as Input,
    )
    from pretravel.uncertainty.monte_carlo import (
        independent as independent,
    )
    from pretravel.uncertainty.monte_carlo import (
        joint_normal as joint_normal,
    )
    from pretravel.uncertainty.monte_carlo import (
        monte_carlo as monte_carlo,
    )
    from pretravel.uncertainty.monte_carlo import (
        validate as validate,
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
