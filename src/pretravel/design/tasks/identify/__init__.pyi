"""What other rooms use of this one."""

from .task import Identify as Identify
