"""What other rooms use of this one."""

from .task import Fem as Fem
