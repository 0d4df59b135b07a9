"""What other rooms use of this one."""

from .task import ProgramAxis as ProgramAxis
from .task import ProgramMdi as ProgramMdi
from .task import ProgramPart as ProgramPart
from .task import ProgramSphere as ProgramSphere
