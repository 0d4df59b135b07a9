"""What other rooms use of this one."""

from .axis_program import TurnedSphere as TurnedSphere
from .axis_program import plan_axis_program as plan_axis_program
from .control import ExportedFiles as ExportedFiles
from .control import ExportSettings as ExportSettings
from .exports import CONTROLS as CONTROLS
from .exports import correction_on_control as correction_on_control
from .exports import table_travel as table_travel
from .gcode import render as render
from .heidenhain import heidenhain_template as heidenhain_template
from .linuxcnc_cycles import sphere_subroutines as sphere_subroutines
from .linuxcnc_programs import linuxcnc_program as linuxcnc_program
from .linuxcnc_state import HANDLER as HANDLER
from .program import ProbingProgram as ProbingProgram
from .program import plan_program as plan_program
from .program import unreached_targets as unreached_targets
from .surroundings import PartObstacle as PartObstacle
from .surroundings import SphereObstacle as SphereObstacle
from .tasks.compare.report import comparison_document as comparison_document
from .tasks.compare.report import comparison_view as comparison_view
from .tasks.compare.task import Compare as Compare
