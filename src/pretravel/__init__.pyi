"""Public names: the one list of what `pretravel` offers; each is imported when it is first used."""

# foundations
from .base.errors import DescriptionError as DescriptionError
from .base.errors import ExtrapolationError as ExtrapolationError
from .base.errors import InputError as InputError
from .base.errors import PretravelError as PretravelError
from .base.frames import Placement as Placement
from .controls.linuxcnc_programs import linuxcnc_program as linuxcnc_program
from .controls.program import plan_program as plan_program
from .controls.surroundings import PartObstacle as PartObstacle
from .controls.surroundings import SphereObstacle as SphereObstacle
from .design.fem.condensation import ReducedModel as ReducedModel
from .design.fem.elastic_field import field_at_trigger as field_at_trigger
from .design.fem.mesh import MeshSettings as MeshSettings
from .design.fem.reduction_cache import reduced_model as reduced_model
from .design.friction.seat_friction import friction_cycle as friction_cycle

# both branches
from .design.identification.probe_from_map import identify as identify
from .design.probing.simulation import Latch as Latch
from .design.probing.simulation import PartSetup as PartSetup
from .design.probing.simulation import simulate as simulate
from .design.probing.slides import SlideSettings as SlideSettings
from .design.probing.slides import slide as slide
from .design.probing.surface_touches import SurfaceTouches as SurfaceTouches
from .design.probing.surface_touches import TouchStatus as TouchStatus
from .design.probing.tip import predicted_tip as predicted_tip
from .design.probing.touching import touch as touch
from .drawing.alignment.aligning import align as align
from .drawing.alignment.alignment import Alignment as Alignment
from .drawing.alignment.alignment import Datum as Datum
from .drawing.features.between_features import FeatureRelation as FeatureRelation
from .drawing.features.between_features import covariance_of_positions as covariance_of_positions
from .drawing.features.between_features import relations_between as relations_between
from .drawing.features.conformity import form_conformity as form_conformity
from .drawing.features.conformity import position_conformity as position_conformity
from .drawing.features.conformity import size_conformity as size_conformity
from .drawing.features.measured_feature import MeasuredFeature as MeasuredFeature
from .drawing.features.measured_feature import measure_feature as measure_feature
from .drawing.inspection import InspectionRegion as InspectionRegion
from .drawing.inspection import plan_inspection as plan_inspection
from .drawing.pmi.model import read_drawing as read_drawing
from .drawing.tasks.measure.measuring import measure_drawing as measure_drawing
from .drawing.tolerances.features_file import Drawing as Drawing
from .drawing.tolerances.features_file import DrawnFeature as DrawnFeature
from .drawing.tolerances.tolerance_frame import GeometricTolerance as GeometricTolerance
from .drawing.tolerances.tolerances import FeatureTolerances as FeatureTolerances
from .drawing.tolerances.tolerances import inspect_feature as inspect_feature
from .files.file_format import FileFormat as FileFormat
from .files.file_format import FileReadings as FileReadings
from .files.file_format import ReadingOptions as ReadingOptions

# the machine
from .files.machine import Machine as Machine
from .files.machine_file import read_machine as read_machine
from .files.map_file import read_map as read_map
from .files.map_file import write_map as write_map
from .files.placement_file import read_placement as read_placement
from .files.points_reading import read_points as read_points
from .files.points_writing import write_points as write_points
from .files.readings import read_readings as read_readings
from .files.readings import write_readings as write_readings
from .files.source_file import SourceFile as SourceFile
from .files.touches_csv import read_plan as read_plan

# files
from .files.touches_csv import read_targets as read_targets
from .files.touches_csv import read_touches as read_touches
from .files.touches_csv import write_touches as write_touches
from .laboratory.measured_spheres import measured_sphere as measured_sphere
from .laboratory.rig.budget import abbe_error as abbe_error
from .laboratory.rig.budget import thermal_components as thermal_components
from .laboratory.rig.calibration import RigCalibration as RigCalibration
from .laboratory.rig.calibration import calibrate_rig as calibrate_rig
from .laboratory.rig.events import rig_touch as rig_touch
from .laboratory.rig.rig_csv import read_rig_trace as read_rig_trace
from .laboratory.rig.trace import RigTouch as RigTouch
from .laboratory.rig.trace import RigTrace as RigTrace
from .laboratory.separation.multi_step_readings import MultiStepReadings as MultiStepReadings
from .laboratory.separation.multi_step_readings import RepeatedPair as RepeatedPair
from .laboratory.separation.separation import Separation as Separation
from .laboratory.separation.separation import separate as separate
from .laboratory.separation.separation_csv import (
    read_multi_step_readings as read_multi_step_readings,
)
from .maps.basis import MapBasis as MapBasis
from .maps.kind import KindOfMap as KindOfMap
from .maps.kinds.wozniak import WozniakKind as WozniakKind
from .maps.pretravel_map import PretravelMap as PretravelMap
from .maps.provenance import Provenance as Provenance
from .maps.provenance import QualificationSetup as QualificationSetup
from .measurement.comparison import compare_corrections as compare_corrections
from .measurement.compensation import apply as apply
from .measurement.compensation import embed as embed
from .measurement.point_errors import point_sources as point_sources
from .measurement.points import Points as Points
from .prediction.catalogue import load_probe as load_probe
from .prediction.compliance.ren import RenPretravel as RenPretravel
from .prediction.compliance.ren import RenProbe as RenProbe
from .prediction.compliance.ren import RenSeats as RenSeats
from .prediction.compliance.ren import RenTerms as RenTerms
from .prediction.compliance.ren import ren_pretravel as ren_pretravel
from .prediction.compliance.ren import ren_terms_of as ren_terms_of
from .prediction.compliance.ren import ren_trigger_force as ren_trigger_force
from .prediction.compliance.wozniak import WozniakPretravel as WozniakPretravel
from .prediction.compliance.wozniak import WozniakProbe as WozniakProbe
from .prediction.compliance.wozniak import wozniak_pretravel as wozniak_pretravel

# virtual branch
from .prediction.description import Probe as Probe
from .prediction.materials import material as material
from .prediction.trigger import Trigger as Trigger
from .prediction.trigger import predict as predict
from .prediction.trigger import predicted_map as predicted_map
from .qualification.qualification import Qualification as Qualification

# measured branch
from .qualification.qualifying import qualify as qualify
from .qualification.qualifying import qualify_like as qualify_like
from .qualification.verification import verify as verify
from .surface.cad.part_file import read_part as read_part
from .surface.cad.step_part import read_step_part as read_step_part
from .surface.parametric import FunctionSurface as FunctionSurface
from .surface.specification import parse_surface as parse_surface
from .touches.targets import Targets as Targets

# the two shared types
from .touches.touches import Touches as Touches
from .uncertainty.circle_fit import fit_circle as fit_circle
from .uncertainty.cone_fit import fit_cone as fit_cone
from .uncertainty.covariance import Covariance as Covariance
from .uncertainty.cylinder_fit import fit_cylinder as fit_cylinder
from .uncertainty.plane_fit import fit_plane as fit_plane
from .uncertainty.sphere_fit import fit_sphere as fit_sphere

__version__: str
