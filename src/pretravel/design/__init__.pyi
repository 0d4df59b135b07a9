"""What other rooms use of this one."""

from .fem.condensation import ReducedModel as ReducedModel
from .fem.elastic_field import StressByDirection as StressByDirection
from .fem.elastic_field import field_at_trigger as field_at_trigger
from .fem.mesh import MeshSettings as MeshSettings
from .fem.reduction_cache import reduced_model as reduced_model
from .friction.predict_with_friction import rubbed_trigger as rubbed_trigger
from .friction.seat_friction import friction_cycle as friction_cycle
from .identification.probe_from_map import identify as identify
