"""What other rooms use of this one."""

from .task import PlanTouches as PlanTouches
