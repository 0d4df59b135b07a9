"""What other rooms use of this one."""

from .task import Check as Check
from .task import CheckedProbe as CheckedProbe
from .task import Pattern as Pattern
from .task import applies as applies
from .task import not_stated as not_stated
