"""A report of a result as one frozen value, independent of how it is shown.

One function for each subject makes a `Document` from a result; `terminal`, `page` and `as_json`
render it. Numbers stay numbers here: `formatting` alone turns them into text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base import ShownInNotebooks
from pretravel.uncertainty import Budget

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pretravel.show.chart import Chart, View


@dataclass(frozen=True)
class Digits:
    """How many digits of a number are shown.

    Attributes
    ----------
    count : int
        Decimals, or significant digits.
    significant : bool
        Whether `count` is the number of significant digits.
    signed : bool
        Whether a positive number has its sign.
    """

    count: int = 2
    significant: bool = False
    signed: bool = False


@dataclass(frozen=True)
class Span:
    """The range from the smallest of several values to the largest.

    >>> Span.of([3.0, 1.0, 2.0])
    Span(low=1.0, high=3.0)
    """

    low: float
    high: float

    @staticmethod
    def of(values: npt.ArrayLike) -> Span:
        """The range of an array."""
        array = np.asarray(values, dtype=np.float64)
        return Span(float(array.min()), float(array.max()))


FigureValue: TypeAlias = float | str | tuple[float, ...] | Span


@dataclass(frozen=True)
class KeyFigure:
    """A quantity of a result, with its unit and its uncertainty.

    Attributes
    ----------
    name : str
    value : float, tuple of float, Span or str
        A number, a vector, a range, or words. Not a number: it is not known.
    unit : str
        Of the value as it is given here: a length is already in mm or µm.
    digits : Digits
    u : float, tuple of float or None
        Standard uncertainty; None where there is none. [u_unit]
    u_unit : str
        Empty: the unit of the value.
    u_digits : Digits or None
        None: those of the value.
    coverage_factor : float or None
        k of the expanded uncertainty, from the degrees of freedom of u; None: `COVERAGE_FACTOR`.
    interval : Span or None
        Coverage interval of about 95 %, in the unit of the value.
    remark : str
        What follows the number.
    detail : bool
        Whether it belongs to the full report only.
    statement : str
        Of what a laboratory states: the place in its file, ``laboratory.name``.
    """

    name: str
    value: FigureValue
    unit: str = ""
    digits: Digits = field(default=Digits())
    u: float | tuple[float, ...] | None = None
    u_unit: str = ""
    u_digits: Digits | None = None
    coverage_factor: float | None = None
    interval: Span | None = None
    remark: str = ""
    detail: bool = False
    statement: str = ""


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name : str
    values : tuple of float or str
        A number that is not a number is an empty cell.
    unit : str
        Of the numbers as they are given here.
    digits : Digits
    digits_of_rows : tuple of Digits
        Of each cell, where they differ.
    """

    name: str
    values: tuple[float | str, ...]
    unit: str = ""
    digits: Digits = field(default=Digits())
    digits_of_rows: tuple[Digits, ...] = ()

    @staticmethod
    def of(
        name: str,
        values: Iterable[float | str] | npt.NDArray[np.generic],
        unit: str = "",
        digits: Digits | tuple[Digits, ...] = Digits(),
    ) -> Column:
        """A column from an array or another sequence; `digits` of all cells, or of each.

        >>> Column.of("force", np.array([1.0, 2.0]), "N").values
        (1.0, 2.0)
        """
        plain = values.tolist() if isinstance(values, np.ndarray) else values
        if isinstance(digits, Digits):
            return Column(name, tuple(plain), unit, digits)
        return Column(name, tuple(plain), unit, digits_of_rows=digits)


@dataclass(frozen=True)
class Table:
    """Columns of equal length.

    Attributes
    ----------
    columns : tuple of Column
    title : str
    explanation : str
        Of the columns; it belongs to the full report only.
    detail : bool
        Whether the table belongs to the full report only.
    certificate : bool
        Whether a printed certificate contains it, too, although it is a detail.
    levels : tuple of str
        Of each row, where it is a decision: good, caution or bad, as of `Judgement`.
    """

    columns: tuple[Column, ...]
    title: str = ""
    explanation: str = ""
    detail: bool = False
    certificate: bool = False
    levels: tuple[str, ...] = ()

    @staticmethod
    def of(columns: Mapping[str, Any], title: str = "") -> Table:
        """A table of the columns of a file, whose names contain their units.

        >>> Table.of({"trace": ["a"], "r0_mm": np.array([1.5])}).columns[1].values
        (1.5,)
        """
        return Table(tuple(_file_column(*each) for each in columns.items()), title)


def _file_column(name: str, values: Any) -> Column:
    cells = np.asarray(values, dtype=object).tolist()
    return Column(name, tuple(each if isinstance(each, str) else float(each) for each in cells))


@dataclass(frozen=True)
class Picture:
    """A picture: what it shows is computed once, when it is asked for.

    Attributes
    ----------
    caption : str
    compute : callable
        Makes the view.
    """

    caption: str
    compute: Callable[[], View]

    def __reduce__(self) -> tuple[object, ...]:
        """What another process gets: the caption, and what the picture shows."""
        return Picture.of, (self.caption, self.view)

    @staticmethod
    def of(caption: str, view: View) -> Picture:
        """A picture of a view that has been computed."""
        return Picture(caption, lambda: view)

    @cached_property
    def view(self) -> View:
        """What the picture shows."""
        return self.compute()

    @property
    def charts(self) -> tuple[Chart, ...]:
        """The charts of the view."""
        return self.view.charts

    def draw(self) -> Figure:
        """The picture by matplotlib, for files."""
        from pretravel.show.chart_files import drawn_figure

        return drawn_figure(self.view)

    @cached_property
    def pixels(self) -> npt.NDArray[np.uint8]:
        """The picture as an image (`show.style.drawn_pixels`), drawn once for a file and a page."""
        from pretravel.show.style import drawn_pixels, without_gaps

        drawn = drawn_pixels(self.draw())
        return without_gaps(drawn) if self.view.is_bare else drawn

    def save(self, path: str | Path) -> None:
        """Write the picture, whole or not at all; a PNG is drawn once for file and page.

        Parameters
        ----------
        path : str or Path
            Ending in .png, .svg or .pdf.

        Raises
        ------
        PretravelError
            Another ending.
        """
        from pretravel.base import whole_file
        from pretravel.show.style import png_content, save

        if Path(path).suffix.lower() != ".png":
            save(self.draw(), path)
            return
        with whole_file(path) as temporary:
            temporary.write_bytes(png_content(self.pixels))


@dataclass(frozen=True)
class Section:
    """A part of a document under a heading.

    Attributes
    ----------
    heading : str
    paragraphs : tuple of str
    figures : tuple of KeyFigure
    tables : tuple of Table
    detail : bool
        Whether it belongs to the full report only.
    certificate : bool
        Whether a printed certificate contains it, too, although it is a detail.
    """

    heading: str = ""
    paragraphs: tuple[str, ...] = ()
    figures: tuple[KeyFigure, ...] = ()
    tables: tuple[Table, ...] = ()
    detail: bool = False
    certificate: bool = False


@dataclass(frozen=True)
class Judgement:
    """The decision of a report as a level and a word.

    Attributes
    ----------
    level : str
        ``good``, ``caution`` or ``bad``: its colour and its sign where it is shown.
    word : str
    """

    level: Literal["good", "caution", "bad"]
    word: str


@dataclass(frozen=True)
class Document(ShownInNotebooks):
    """A report of one result.

    Attributes
    ----------
    title : str
        What the report is about.
    verdict : str
        The answer in one sentence.
    figures : tuple of KeyFigure
    tables : tuple of Table
    sections : tuple of Section
    pictures : tuple of Picture
        The first one is the main one.
    notes : tuple of str
        Remarks that belong to the result.
    warnings : tuple of str
        What limits the trust in the result.
    budgets : tuple of Budget
        Uncertainty budgets of results in mm, the main one first.
    data : tuple of Table
        Values for programs: a file of results contains them, a page and a terminal do not.
    judgement : Judgement or None
        What it decides; None where nothing is decided.
    """

    title: str
    verdict: str = ""
    figures: tuple[KeyFigure, ...] = ()
    tables: tuple[Table, ...] = ()
    sections: tuple[Section, ...] = ()
    pictures: tuple[Picture, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    budgets: tuple[Budget, ...] = ()
    data: tuple[Table, ...] = ()
    judgement: Judgement | None = None

    def __repr__(self) -> str:
        return (
            f"Document({self.title!r}; {self.verdict!r}; {len(self.figures)} key figures; "
            f"{len(self.tables)} tables; {len(self.pictures)} pictures; "
            f"{len(self.warnings)} warnings)"
        )

    def as_section(self, heading: str) -> Section:
        """The verdict, the key figures and the tables as a section of another document."""
        verdict = (self.verdict,) if self.verdict else ()
        return Section(heading, verdict, self.figures, self.tables)
