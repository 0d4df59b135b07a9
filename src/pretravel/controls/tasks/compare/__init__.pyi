"""What other rooms use of this one."""

from .report import comparison_document as comparison_document
from .report import comparison_view as comparison_view
from .task import Compare as Compare
from .task import ComparedMap as ComparedMap
