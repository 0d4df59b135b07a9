"""What other rooms use of this one."""

from .task import ReadDrawing as ReadDrawing
