"""What other rooms use of this one."""

from .program import unreached_targets as unreached_targets
from .surroundings import PartObstacle as PartObstacle
from .tasks.compare.report import comparison_document as comparison_document
from .tasks.compare.report import comparison_view as comparison_view
