"""What other rooms use of this one."""

from .report import probe_picture as probe_picture
from .task import Probes as Probes
from .view import space_chart as space_chart
