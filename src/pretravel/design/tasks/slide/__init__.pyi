"""What other rooms use of this one."""

from .report import slide_step_figures as slide_step_figures
from .report import slide_step_view as slide_step_view
from .task import FollowedSlide as FollowedSlide
from .task import Slide as Slide
