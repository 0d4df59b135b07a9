"""What other rooms use of this one."""

from .task import Hysteresis as Hysteresis
