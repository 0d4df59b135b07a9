"""What other rooms use of this one."""

from .task import Check as Check
from .task import Pattern as Pattern
from .task import not_stated as not_stated
