"""What other rooms use of this one."""

from .task import FOREIGN_BUDGET as FOREIGN_BUDGET
from .task import CalibratedRig as CalibratedRig
from .task import Rig as Rig
