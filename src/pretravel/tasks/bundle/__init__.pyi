"""What other rooms use of this one."""

from .task import Bundle as Bundle
