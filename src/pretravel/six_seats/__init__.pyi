"""What other rooms use of this one."""

from .event import CRITERIA as CRITERIA
from .event import PIEZO_STAGE as PIEZO_STAGE
from .event import trigger_force as trigger_force
from .event import watched_loads as watched_loads
from .hertz import ball_on_flat as ball_on_flat
from .hertz import contact_area as contact_area
from .hertz import curved_part_factor as curved_part_factor
from .hertz import ellipticity as ellipticity
from .hertz import rod_on_ball_coefficient as rod_on_ball_coefficient
from .physical import PhysicalMapFit as PhysicalMapFit
from .response import ProbeResponse as ProbeResponse
from .response import ResponseBasis as ResponseBasis
from .uneven_seats import IDEAL as IDEAL
from .uneven_seats import PARAMETERS as PARAMETERS
from .uneven_seats import SEAT_NAMES as SEAT_NAMES
from .uneven_seats import SEAT_SIDES as SEAT_SIDES
from .uneven_seats import SeatFrame as SeatFrame
from .uneven_seats import seat_triads as seat_triads
from .uneven_seats import tip_wrenches as tip_wrenches
