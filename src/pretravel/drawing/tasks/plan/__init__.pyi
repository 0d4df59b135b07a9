"""What other rooms use of this one."""

from .task import PlanForDrawing as PlanForDrawing
