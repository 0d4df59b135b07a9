"""What other rooms use of this one."""

from .task import MapInOrientation as MapInOrientation
