"""What other rooms use of this one."""

from .task import CONTROL_FORM as CONTROL_FORM
from .task import Export as Export
from .task import ExportedMap as ExportedMap
from .task import FormOnControl as FormOnControl
from .task import control_names as control_names
from .task import makes_folder as makes_folder
from .task import steps_at_control as steps_at_control
