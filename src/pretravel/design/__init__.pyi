"""What other rooms use of this one."""

from .fem.condensation import ReducedModel as ReducedModel
from .fem.elastic_field import field_at_trigger as field_at_trigger
from .fem.mesh import MeshSettings as MeshSettings
from .fem.reduction_cache import reduced_model as reduced_model
from .friction.predict_with_friction import rubbed_trigger as rubbed_trigger
from .friction.seat_friction import friction_cycle as friction_cycle
from .identification.probe_from_map import identify as identify
from .probing.obstacles import StylusOutline as StylusOutline
from .probing.obstacles import first_obstacle as first_obstacle
from .probing.obstacles import stylus_obstacle as stylus_obstacle
from .probing.simulation import Latch as Latch
from .probing.simulation import simulate as simulate
from .tasks.compare.designs import DesignComparison as DesignComparison
from .tasks.compare.designs import compare_designs as compare_designs
from .tasks.compare.designs_report import design_comparison_columns as design_comparison_columns
