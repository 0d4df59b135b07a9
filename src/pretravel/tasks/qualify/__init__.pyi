"""What other rooms use of this one."""

from .picture import qualification_view as qualification_view
from .references import Lengths as Lengths
from .report import qualification_document as qualification_document
from .settings_of_kinds import SettingsOfKinds as SettingsOfKinds
from .several_tips import CompensatedTips as CompensatedTips
from .task import QualifiedProbe as QualifiedProbe
from .task import Qualify as Qualify
