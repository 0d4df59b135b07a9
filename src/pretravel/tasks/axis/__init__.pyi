"""What other rooms use of this one."""

from .task import Axis as Axis
