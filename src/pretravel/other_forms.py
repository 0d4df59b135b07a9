"""Other forms of a result: a picture in notebooks, a table of pandas, a dataset of xarray.

Notebooks ask a value itself for its picture, and users look for `to_dataframe` at the value. The
types are in early rooms, what makes these forms is in late ones. This module is the one place where
an early room calls a late one; the import contracts name it. What is called is imported with the
call.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class ShownInNotebooks:
    """A value that notebooks show as a card: key figures with their units and a polar picture."""

    def _repr_html_(self) -> str:
        from pretravel.report.notebook_card import notebook_html

        return notebook_html(self)


class WithDataFrame:
    """A value that is a table, too."""

    def to_dataframe(self) -> pd.DataFrame:
        """The value as a table of pandas, a row for each touch, point or direction.

        Returns
        -------
        pandas.DataFrame
            The columns of the CSV file, units in their names (`docs/formats.md`).

        >>> from pretravel.touches import Touches
        >>> touch = Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]], feeds=[50.0])
        >>> touch.to_dataframe()[["z_mm", "feed_mm_min"]].to_dict("list")
        {'z_mm': [3.0], 'feed_mm_min': [50.0]}
        """
        from pretravel.formats.other_libraries import dataframe

        return dataframe(self)


class WithDataset:
    """A value that is a labelled dataset, too."""

    def to_xarray(self) -> xr.Dataset:
        """The value as a labelled dataset of xarray.

        Returns
        -------
        xarray.Dataset
            Each variable states its unit in the attribute ``units``.

        >>> from pretravel.probe.catalogue import load_probe
        >>> from pretravel.trigger.predict import predict
        >>> trigger = predict(load_probe("omp40-2"), [[1.0, 0.0, 0.0]])
        >>> trigger.to_xarray()["trigger_force"].attrs["units"]
        'N'
        """
        from pretravel.formats.other_libraries import dataset

        return dataset(self)


def extent(values: npt.ArrayLike, decimals: int = 1) -> str:
    """The smallest and the largest of several numbers, in words.

    Parameters
    ----------
    values : (n,) float
        Those that are not numbers are left out.
    decimals : int

    >>> extent([2.0, 0.5, float("nan")]), extent([2.0]), extent([])
    ('0.5 to 2.0', '2.0', 'none')
    """
    numbers = np.asarray(values, dtype=np.float64)
    numbers = numbers[np.isfinite(numbers)]
    if not numbers.size:
        return "none"
    # Rounded first, so that no value is shown as -0.0.
    low, high = (
        f"{round(float(v), decimals) + 0.0:.{decimals}f}" for v in (numbers.min(), numbers.max())
    )
    return low if low == high else f"{low} to {high}"
