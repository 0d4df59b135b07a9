"""What other rooms use of this one."""

from .task import Design as Design
from .task import Wishes as Wishes
