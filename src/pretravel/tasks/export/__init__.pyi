"""What other rooms use of this one."""

from .task import ControlForm as ControlForm
from .task import Export as Export
from .task import ExportedMap as ExportedMap
from .task import applies as applies
from .task import control_names as control_names
from .task import makes_folder as makes_folder
