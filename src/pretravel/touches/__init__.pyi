"""What other rooms use of this one."""

from .copied_rows import copied_rows_warnings as copied_rows_warnings
from .targets import Targets as Targets
from .touches import GLANCING as GLANCING
from .touches import WORD_COLUMNS as WORD_COLUMNS
from .touches import Touches as Touches
from .touches import TouchesLike as TouchesLike
from .touches import as_touches as as_touches
from .touches import at_rest as at_rest
from .touches import length_of_run as length_of_run
from .touches import moved as moved
from .touches import refuse_glancing as refuse_glancing
from .touches import refuse_several as refuse_several
from .touches import refuse_several_runs as refuse_several_runs
from .touches import travel_of_delay as travel_of_delay
from .touches import with_feed as with_feed
from .touches import with_spindle as with_spindle
from .touches import without as without
from .touches import word_fields as word_fields
