"""What other rooms use of this one."""

from .task import FindAxis as FindAxis
