"""What other rooms use of this one."""

from .task import CheckBudget as CheckBudget
