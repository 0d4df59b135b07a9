"""What other rooms use of this one."""

from .task import MachineFile as MachineFile
