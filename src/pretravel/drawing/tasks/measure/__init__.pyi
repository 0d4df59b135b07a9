"""What other rooms use of this one."""

from .settings_of_features import Criterion as Criterion
from .task import Measure as Measure
