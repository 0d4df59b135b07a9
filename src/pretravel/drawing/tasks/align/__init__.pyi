"""What other rooms use of this one."""

from .task import Align as Align
