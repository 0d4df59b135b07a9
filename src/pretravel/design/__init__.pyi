"""What other rooms use of this one."""

from .friction.predict_with_friction import rubbed_trigger as rubbed_trigger
from .probing.obstacles import StylusOutline as StylusOutline
from .probing.obstacles import first_obstacle as first_obstacle
from .probing.obstacles import stylus_obstacle as stylus_obstacle
from .probing.simulation import Latch as Latch
from .probing.simulation import simulate as simulate
from .tasks.compare.designs import DesignComparison as DesignComparison
from .tasks.compare.designs import compare_designs as compare_designs
from .tasks.compare.designs_report import design_comparison_columns as design_comparison_columns
