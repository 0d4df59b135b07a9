"""What other rooms use of this one."""

from .task import Verify as Verify
