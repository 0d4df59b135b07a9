"""What other rooms use of this one."""

from .task import Plan as Plan
