"""Other forms of a value: a card in notebooks, a table of pandas, a dataset of xarray; a file.

Notebooks ask a value itself for its card, and users look for `to_dataframe` at the value. The types
are in early rooms, what makes these forms is in late ones: the package states who makes which form
when it is imported (`register`), and the maker is imported with the first call. In the same way
early rooms take the path of a file in the place of the value that it contains (`from_file`).
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

_MAKERS: dict[str, str] = {}


def register(form: str, maker: str) -> None:
    """State which function makes a form of results.

    Parameters
    ----------
    form : str
        ``card``, ``dataframe`` or ``dataset``; ``touches``, ``points`` or ``map``, of a file.
    maker : str
        Module and function: ``pretravel.files.other_libraries:dataframe``.
    """
    _MAKERS[form] = maker


def _made(form: str, value: object, **stated: object) -> Any:
    module, _, function = _MAKERS[form].partition(":")
    return getattr(import_module(module), function)(value, **stated)


def from_file(form: str, path: str | Path, **stated: object) -> Any:
    """The value that a file contains.

    Parameters
    ----------
    form : str
        ``touches``, ``points`` or ``map``.
    path : str or Path
    **stated
        What the file does not contain, for the reader.

    Raises
    ------
    PretravelError
        As the reader.
    """
    return _made(form, path, **stated)


class ShownInNotebooks:
    """A value that notebooks show as a card: key figures with their units and a polar picture."""

    def _repr_html_(self) -> str:
        return str(_made("card", self))


class WithPlot:
    """A value with a picture, as the reports show it."""

    def plot(self) -> tuple[Any, ...]:
        """Draw the value, as the reports do, with matplotlib.

        Returns
        -------
        tuple of matplotlib.axes.Axes
            Of a new figure, which notebooks show; ``axes[0].figure.savefig("picture.png")``
            writes it.

        >>> from pretravel.touches import Touches
        >>> touch = Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]])
        >>> print(touch.plot()[0].get_title())
        places of the tip
        frame of the machine
        """
        return tuple(_made("plot", self))


class WithDataFrame:
    """A value that is a table, too."""

    def to_dataframe(self) -> Any:
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
        return _made("dataframe", self)


class WithDataset:
    """A value that is a labelled dataset, too."""

    def to_xarray(self) -> Any:
        """The value as a labelled dataset of xarray.

        Returns
        -------
        xarray.Dataset
            Each variable states its unit in the attribute ``units``.

        >>> from pretravel.prediction.catalogue import load_probe
        >>> from pretravel.prediction.trigger import predict
        >>> trigger = predict(load_probe("omp40-2"), [[1.0, 0.0, 0.0]])
        >>> trigger.to_xarray()["trigger_force"].attrs["units"]
        'N'
        """
        return _made("dataset", self)
