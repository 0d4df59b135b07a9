"""What other rooms use of this one."""

from .task import RunStudy as RunStudy
from .task import Studies as Studies
