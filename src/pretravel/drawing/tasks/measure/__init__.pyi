"""What other rooms use of this one."""

from .task import BY_LABEL as BY_LABEL
from .task import Criterion as Criterion
from .task import Measure as Measure
from .task import MeasuredFeatures as MeasuredFeatures
