"""What other rooms use of this one."""

from .task import Faces as Faces
