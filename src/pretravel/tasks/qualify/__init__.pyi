"""What other rooms use of this one."""

from .references import Lengths as Lengths
from .references import block_lengths as block_lengths
from .report import qualification_document as qualification_document
from .report import qualification_view as qualification_view
from .screen.next import next_sentence as next_sentence
from .screen.work import EXPORT as EXPORT
from .screen.work import FIT as FIT
from .several_tips import CompensatedTips as CompensatedTips
from .task import Qualify as Qualify
