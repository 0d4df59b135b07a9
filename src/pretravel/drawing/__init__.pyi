"""What other rooms use of this one."""

from .features.between_features import FeatureRelation as FeatureRelation
from .features.between_features import covariance_of_positions as covariance_of_positions
from .features.between_features import relations_between as relations_between
from .features.conformity import ConformityVerdict as ConformityVerdict
from .features.conformity import form_conformity as form_conformity
from .features.conformity import position_conformity as position_conformity
from .features.conformity import size_conformity as size_conformity
from .features.measured_feature import MeasuredFeature as MeasuredFeature
from .features.measured_feature import Quantity as Quantity
from .features.measured_feature import measure_feature as measure_feature
from .inspection import InspectionPlan as InspectionPlan
from .inspection import InspectionRegion as InspectionRegion
from .tasks.measure.picture import feature_view as feature_view
from .tasks.measure.picture import features_view as features_view
from .tasks.measure.report import features_document as features_document
from .tolerances.tolerances import FeatureTolerances as FeatureTolerances
from .tolerances.tolerances import InspectedFeature as InspectedFeature
from .tolerances.tolerances import inspect_feature as inspect_feature
