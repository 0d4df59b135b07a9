"""What other rooms use of this one."""

from .designs import DesignComparison as DesignComparison
from .designs_report import A as A
from .designs_report import B as B
from .designs_report import elements_comparison_table as elements_comparison_table
from .designs_report import results_of as results_of
from .report import comparison_document as comparison_document
from .report import comparison_view as comparison_view
from .task import Compare as Compare
from .task import ComparedMap as ComparedMap
