"""What other rooms use of this one."""

from .picture import points_view as points_view
from .report import points_document as points_document
from .report import simulation_document as simulation_document
from .task import Compensate as Compensate
from .task import CompensatedTouches as CompensatedTouches
from .task import compensate_long_table as compensate_long_table
