"""What other rooms use of this one."""

from .task import FollowedSlide as FollowedSlide
from .task import Slide as Slide
