"""What other rooms use of this one."""

from .task import Report as Report
