"""What other rooms use of this one."""

from .drift_report import drift_verdict as drift_verdict
from .entries import decision_words as decision_words
from .picture import control_charts as control_charts
from .report import history_document as history_document
from .task import History as History
