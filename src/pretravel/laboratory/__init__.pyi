"""What other rooms use of this one."""

from .rig.budget import abbe_error as abbe_error
from .rig.budget import thermal_components as thermal_components
from .rig.calibration import RigCalibration as RigCalibration
from .rig.calibration import calibrate_rig as calibrate_rig
from .rig.events import rig_touch as rig_touch
from .rig.rig_csv import read_rig_trace as read_rig_trace
from .rig.trace import RigTouch as RigTouch
from .rig.trace import RigTrace as RigTrace
from .separation.multi_step_readings import MultiStepReadings as MultiStepReadings
from .separation.multi_step_readings import RepeatedPair as RepeatedPair
from .separation.separation import Separation as Separation
from .separation.separation import separate as separate
from .separation.separation_csv import read_multi_step_readings as read_multi_step_readings
from .separation.separation_csv import read_touch_scatter as read_touch_scatter
from .standards.standard_check import Standard as Standard
from .tasks.separate.report import separation_view as separation_view
