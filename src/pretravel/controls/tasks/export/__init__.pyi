"""What other rooms use of this one."""

from .task import Export as Export
from .task import control_names as control_names
from .task import steps_at_control as steps_at_control
