"""What other rooms use of this one."""

from .exports import CONTROLS as CONTROLS
from .exports import ExportedFiles as ExportedFiles
from .exports import ExportSettings as ExportSettings
from .exports import correction_on_control as correction_on_control
from .exports import table_travel as table_travel
from .gcode import render as render
from .heidenhain import heidenhain_template as heidenhain_template
from .linuxcnc_cycles import sphere_subroutines as sphere_subroutines
from .linuxcnc_programs import linuxcnc_program as linuxcnc_program
from .linuxcnc_state import HANDLER as HANDLER
from .machine import WORK_OFFSETS as WORK_OFFSETS
from .machine import Machine as Machine
from .machine import work_placement as work_placement
from .machine import work_turn as work_turn
from .program import ProbingProgram as ProbingProgram
from .program import plan_program as plan_program
from .program_log import FAULTS as FAULTS
from .program_log import LOG_ENDING as LOG_ENDING
from .program_log import LOG_HEAD as LOG_HEAD
from .program_log import SUBROUTINE_LINE as SUBROUTINE_LINE
from .program_log import SUBROUTINE_TOUCH_COLUMNS as SUBROUTINE_TOUCH_COLUMNS
from .program_log import SURFACE_POINT_COLUMNS as SURFACE_POINT_COLUMNS
from .program_log import TOUCH_COLUMNS as TOUCH_COLUMNS
from .surroundings import PartObstacle as PartObstacle
from .surroundings import SphereObstacle as SphereObstacle
