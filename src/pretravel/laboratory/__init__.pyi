"""What other rooms use of this one."""

from .tasks.separate.report import separation_card as separation_card
from .tasks.separate.report import separation_view as separation_view
