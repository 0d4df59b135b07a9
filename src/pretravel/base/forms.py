"""Other forms of a value: a card in notebooks, a table of pandas, a dataset of xarray; a file.

Notebooks ask a value itself for its card, and users look for `to_dataframe` at the value. The types
are in early rooms, what makes these forms is in late ones: the package states who makes which form
when it is imported (`register`), and the maker is imported with the first call. In the same way
early rooms take the path of a file in the place of the value that it contains (`from_file`).
"""

from __future__ import annotations

import inspect
from typing import Any, TypeVar

from pretravel.base.plugins import object_at

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
    return object_at(_MAKERS[form])(value, **stated)


def from_file(form: str, path: object, **stated: object) -> Any:
    """The value that a file contains.

    Parameters
    ----------
    form : str
        ``touches``, ``points`` or ``map``.
    path : str or Path
        Or, for touches, a data frame.
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


Shown = TypeVar("Shown")
_DIGITS = 12


class _Words(str):
    """An annotation that is shown as it was written."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


class _Number(float):
    """A default that is shown without its rounding to binary digits; a float everywhere else."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"{float(self):.{_DIGITS}g}"


def plainly_shown(value: Shown) -> Shown:
    """A function, or a class with its methods, whose signature `help` shows as it was written.

    >>> def area(width: float, height: float = 0.13 * 1e-3) -> float: ...
    >>> inspect.signature(plainly_shown(area))
    <Signature (width: float, height: float = 0.00013) -> float>
    """
    if inspect.isfunction(value):
        _show(value)
    elif inspect.isclass(value):
        for member in vars(value).values():
            if inspect.isfunction(member):
                _show(member)
    return value


def _show(function: Any) -> None:
    try:
        found = inspect.signature(function)
    except (TypeError, ValueError):  # none that Python can tell
        return
    function.__signature__ = found.replace(
        parameters=[
            one.replace(annotation=_words(one.annotation), default=_number(one.default))
            for one in found.parameters.values()
        ],
        return_annotation=_words(found.return_annotation),
    )


def _words(annotation: Any) -> Any:
    return _Words(annotation) if isinstance(annotation, str) else annotation


def _number(default: Any) -> Any:
    return _Number(default) if type(default) is float else default
