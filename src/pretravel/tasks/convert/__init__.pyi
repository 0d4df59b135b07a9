"""What other rooms use of this one."""

from .task import Convert as Convert
from .task import Formats as Formats
