"""What other rooms use of this one."""

from .task import Simulate as Simulate
