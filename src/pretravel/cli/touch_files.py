"""The arguments and options of commands that read touches, and the reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import typer

from pretravel.base.quantities import FEED, limits
from pretravel.cli.arguments import StatedColumns, stated_columns
from pretravel.cli.options import Units

if TYPE_CHECKING:
    from pretravel.files.file_format import FileReadings, ReadingOptions
    from pretravel.files.long_table import LongTable
    from pretravel.probing.targets import Targets
    from pretravel.show.document import Document

TouchFiles: TypeAlias = Annotated[
    list[Path],
    typer.Argument(
        metavar="TOUCHES",
        help="Table of any usual form (X;Y;Z;I;J;K, x_mm,y_mm,z_mm,nx,ny,nz …) or a file of "
        "pretravel formats; several files, a folder or a name with * are read as one series.",
    ),
]
FileUnits: TypeAlias = Annotated[
    Units | None, typer.Option("--units", help="Unit of length of a file that does not state it.")
]
TableColumns: TypeAlias = Annotated[
    StatedColumns | None,
    typer.Option(
        parser=stated_columns,
        metavar="x=X,nx=I,…",
        help="Columns of a table by name or number, for x,y,z,nx,ny,nz,ax,ay,az,feed,spindle,"
        "label,nominal_x…; nx=-I changes the sign; label=none leaves that column out. Other "
        "columns are found by their names.",
    ),
]
DecimalSign: TypeAlias = Annotated[
    Literal["comma", "point"] | None,
    typer.Option("--decimal", help="Decimal sign of a table whose numbers do not show it."),
]
Exclude: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        help="Label or line of a touch to leave out, or FILE:LINE of one of several files; may be "
        "repeated."
    ),
]
FeedOfTouches: TypeAlias = Annotated[
    float | None,
    typer.Option(
        "--feed",
        **limits(FEED),
        help="Feed of the touches, in mm/min, without a column feed_mm_min.",
    ),
]
RunPlan: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--plan", help="The targets that were touched, for files that contain positions only."
    ),
]


def reading_options(
    *,
    columns: StatedColumns | None = None,
    units: str | None = None,
    decimal: str | None = None,
    exclude: list[str] | None = None,
    plan: Path | None = None,
    tip_diameter: float | None = None,
    reference_diameter: float | None = None,
    ring: bool = False,
) -> ReadingOptions:
    """What the options of a command state about its files of touches."""
    from pretravel.files.file_format import ReadingOptions

    return ReadingOptions(
        plan=None if plan is None else run_plan(plan, units),
        units=units,
        tip_radius=None if tip_diameter is None else 0.5 * tip_diameter,
        columns=columns,
        decimal=decimal,
        exclude=tuple(exclude or ()),
        reference_diameter=reference_diameter,
        ring=ring,
    )


def run_plan(path: Path, units: str | None) -> Targets:
    """The plan that was run; the unit of the touches is also its unit, if it states none."""
    from pretravel.base.errors import InputError
    from pretravel.files.file_format import ReadingOptions
    from pretravel.files.touches_csv import read_plan

    try:
        return read_plan(path)
    except InputError as error:
        if units is None or "units" not in error.inputs:
            raise
        return read_plan(path, ReadingOptions(units=units))


def files_of_touches(places: list[Path]) -> tuple[list[Path], str]:
    """The files that the argument means, and their name in titles."""
    from pretravel.files.several_files import files_of

    files = files_of(places)
    return files, files[0].name if len(files) == 1 else f"{files[0].name} … {files[-1].name}"


def table_in_parts(files: list[Path], options: ReadingOptions, output: Path) -> LongTable | None:
    """The one long table that the files are, where the output can be written part by part too."""
    from pretravel.files.long_table import WRITTEN_IN_PARTS, long_table

    if len(files) > 1 or output.suffix.lower() not in WRITTEN_IN_PARTS:
        return None
    return long_table(files[0], options)


def read_and_show(
    files: list[Path],
    options: ReadingOptions,
    *,
    file_format: str | None = None,
    spindle: Sequence[float] | None = None,
    feed: float | None = None,
) -> FileReadings:
    """Read touches, and print how the files were understood where that is not plain.

    A feed is that of all touches; files that state feeds themselves are refused with it.
    """
    from pretravel.files.several_files import read_series
    from pretravel.touches import with_feed

    readings = read_series(files, options, file_format=file_format, spindle=spindle)
    if readings.touches.reading:
        typer.echo(f"read: {readings.touches.reading}")
    return replace(readings, touches=with_feed(readings.touches, feed))


def with_reading(document: Document, readings: FileReadings) -> Document:
    """The document of a page, with how the files were understood."""
    from pretravel.tasks.reports.preview_report import with_reading_note

    return with_reading_note(document, readings)
