"""What other rooms use of this one."""

from .targets import Targets as Targets
from .touches import GLANCING as GLANCING
from .touches import Touches as Touches
from .touches import TouchesLike as TouchesLike
from .touches import as_touches as as_touches
from .touches import at_rest as at_rest
from .touches import moved as moved
from .touches import refuse_glancing as refuse_glancing
from .touches import travel_of_delay as travel_of_delay
from .touches import with_feed as with_feed
from .touches import with_spindle as with_spindle
from .touches import without as without
