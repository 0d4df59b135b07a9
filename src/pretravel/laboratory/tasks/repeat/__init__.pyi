"""What other rooms use of this one."""

from .task import Repeat as Repeat
