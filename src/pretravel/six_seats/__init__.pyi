"""What other rooms use of this one."""

from .event import trigger_force as trigger_force
from .event import watched_loads as watched_loads
from .physical import PhysicalMapFit as PhysicalMapFit
from .response import probe_response as probe_response
from .response import response_map as response_map
from .seat_frames import SEAT_NAMES as SEAT_NAMES
from .seat_frames import SeatFrame as SeatFrame
from .seat_frames import seat_frame as seat_frame
from .seat_frames import seat_triads as seat_triads
from .seat_frames import tip_wrenches as tip_wrenches
from .uneven_seats import IDEAL as IDEAL
from .uneven_seats import PARAMETERS as PARAMETERS
