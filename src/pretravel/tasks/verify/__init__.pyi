"""What other rooms use of this one."""

from .screen_work import DAILY as DAILY
from .task import Verify as Verify
