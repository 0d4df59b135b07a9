"""What other rooms use of this one."""

from .next import next_sentence as next_sentence
from .work import EXPORT as EXPORT
from .work import FIT as FIT
