"""What other rooms use of this one."""

from .picture import body_marks as body_marks
from .picture import part_view as part_view
from .report import faces_document as faces_document
from .report import plan_document as plan_document
from .task import PlanTargets as PlanTargets
