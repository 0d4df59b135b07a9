"""What other rooms use of this one."""

from .picture import body_marks as body_marks
from .report import faces_document as faces_document
from .task import PlanTargets as PlanTargets
