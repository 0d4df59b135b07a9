"""What other rooms use of this one."""

from .task import CalibratedRig as CalibratedRig
from .task import Rig as Rig
