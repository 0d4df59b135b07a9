"""What other rooms use of this one."""

from .task import Laboratory as Laboratory
