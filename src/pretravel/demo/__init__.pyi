"""What other rooms use of this one."""

from .task import Demo as Demo
