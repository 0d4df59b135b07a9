"""What other rooms use of this one."""

from .features.conformity import ConformityVerdict as ConformityVerdict
from .features.measured_feature import measure_feature as measure_feature
from .inspection import InspectionRegion as InspectionRegion
from .tasks.measure.picture import feature_view as feature_view
from .tasks.measure.picture import features_view as features_view
from .tasks.measure.report import features_document as features_document
from .tolerances.tolerances import FeatureTolerances as FeatureTolerances
from .tolerances.tolerances import InspectedFeature as InspectedFeature
from .tolerances.tolerances import inspect_feature as inspect_feature
