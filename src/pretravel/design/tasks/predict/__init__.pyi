"""What other rooms use of this one."""

from .task import Predict as Predict
from .view import prediction_view as prediction_view
