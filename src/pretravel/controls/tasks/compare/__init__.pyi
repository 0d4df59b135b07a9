"""What other rooms use of this one."""

from .task import Compare as Compare
