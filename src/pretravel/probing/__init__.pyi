"""What other rooms use of this one."""

from . import simulation as simulation
from .inspection import InspectionPlan as InspectionPlan
from .inspection import InspectionRegion as InspectionRegion
from .inspection import plan_inspection as plan_inspection
from .obstacles import StylusOutline as StylusOutline
from .obstacles import first_obstacle as first_obstacle
from .obstacles import stylus_obstacle as stylus_obstacle
from .simulation import Latch as Latch
from .simulation import PartSetup as PartSetup
from .simulation import SimulationResult as SimulationResult
from .simulation import simulate as simulate
from .simulation import target_warnings as target_warnings
from .simulation import travel_since_contact as travel_since_contact
from .slide_history import SlideHistory as SlideHistory
from .slides import SlideSettings as SlideSettings
from .slides import slide as slide
from .surface_touches import SurfaceTouches as SurfaceTouches
from .surface_touches import TouchStatus as TouchStatus
from .surface_touches import describe_failures as describe_failures
from .tip import LateralTip as LateralTip
from .tip import PredictedTip as PredictedTip
from .tip import TipBehaviour as TipBehaviour
from .tip import mapped_tip as mapped_tip
from .tip import predicted_tip as predicted_tip
from .touching import touch as touch
