"""What other rooms use of this one."""

from .report import shares_table as shares_table
from .task import Predict as Predict
from .task import PredictedProbe as PredictedProbe
from .view import by_level as by_level
from .view import polar_axis as polar_axis
from .view import prediction_view as prediction_view
from .view import values_of as values_of
