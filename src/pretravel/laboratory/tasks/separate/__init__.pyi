"""What other rooms use of this one."""

from .task import PlanSeparation as PlanSeparation
from .task import Separate as Separate
