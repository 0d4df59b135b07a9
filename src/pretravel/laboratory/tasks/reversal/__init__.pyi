"""What other rooms use of this one."""

from .task import Reversal as Reversal
