"""What other rooms use of this one."""

from .task import Probes as Probes
