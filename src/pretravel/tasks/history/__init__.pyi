"""What other rooms use of this one."""

from .report import control_charts as control_charts
from .task import History as History
