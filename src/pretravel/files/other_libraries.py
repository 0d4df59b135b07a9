"""Results as tables of pandas and as datasets of xarray."""

from __future__ import annotations

from functools import singledispatch
from typing import TYPE_CHECKING

import numpy.typing as npt

from pretravel.base import needed
from pretravel.files.map_datasets import map_dataset
from pretravel.files.points_writing import points_dataset, points_table
from pretravel.files.prediction_table import trigger_dataset, trigger_table
from pretravel.files.touches_csv import touches_table
from pretravel.maps import PretravelMap
from pretravel.measurement import Points
from pretravel.prediction import Trigger
from pretravel.touches import Touches

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def dataframe(value: object) -> pd.DataFrame:
    """Touches, points or a prediction as a table, with the columns of the CSV file.

    Parameters
    ----------
    value : Touches, Points or Trigger

    Returns
    -------
    pandas.DataFrame

    Raises
    ------
    TypeError
        The value is none of these.
    """
    needed("pandas", "tables")
    import pandas as pd

    return pd.DataFrame(_columns(value))


@singledispatch
def _columns(value: object) -> dict[str, npt.ArrayLike]:
    raise TypeError(f"a {type(value).__name__} is not a table")


_columns.register(Touches)(touches_table)
_columns.register(Points)(points_table)
_columns.register(Trigger)(trigger_table)


@singledispatch
def dataset(value: object) -> xr.Dataset:
    """A map, a prediction or points as a labelled dataset.

    Parameters
    ----------
    value : PretravelMap, Trigger or Points

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    TypeError
        The value is none of these.
    """
    raise TypeError(f"a {type(value).__name__} is not a dataset")


dataset.register(PretravelMap)(map_dataset)
dataset.register(Trigger)(trigger_dataset)
dataset.register(Points)(points_dataset)
