"""What other rooms use of this one."""

from .main import run as run
