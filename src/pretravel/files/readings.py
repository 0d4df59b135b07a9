"""Touches from a file of any format, and into one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pretravel.base import TIP_RADIUS, BoolArray, FloatArray, InputError, PretravelError, checked
from pretravel.files.file_format import (
    ALL,
    FileFormat,
    FilePositions,
    FileReadings,
    ReadingOptions,
)
from pretravel.files.format_registry import FORMATS, format_named, format_of
from pretravel.files.logs.double_touches import with_passes, without_passes, without_searches
from pretravel.files.misses import named_misses
from pretravel.files.source_file import Source, SourceFile, opened
from pretravel.files.stated_conditions import refuse_other_tip, refuse_tips_by_name
from pretravel.files.stated_normals import (
    one_normal,
    with_ring_normals,
    with_sphere_normals,
    with_surface_normals,
)
from pretravel.files.table_formats import CSV, PARQUET
from pretravel.files.touch_columns import own_lines
from pretravel.files.touches_csv import read_normals
from pretravel.touches import Touches, word_fields


def read_readings(
    source: Source, options: ReadingOptions | None = None, *, file_format: str | None = None
) -> FileReadings:
    r"""Read touches from a file of any format, and what else the file states.

    Parameters
    ----------
    source : str, Path or SourceFile
    options : ReadingOptions, optional
        What the file does not contain. Where nothing is stated, the format must be one whose
        files contain everything: CSV, Parquet, QIF, a log of a program that pretravel wrote.
        Columns that are stated are those of a table, whatever the text looks like.
    file_format : str, optional
        Name of a `FileFormat`; detected from the file when not given.

    Returns
    -------
    FileReadings

    Raises
    ------
    InputError
        The file cannot be read (see the reader of its format); something that it does not contain
        was not given; it contains features, not touches.
    PretravelError
        The format is not known.

    >>> file = SourceFile("a.csv", b"x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n")
    >>> read_readings(file).touches.positions.tolist()
    [[0.0, 0.0, 3.0]]
    """
    file = opened(source)
    if file_format is None and options is not None and options.columns:
        known = PARQUET if file.ending == ".parquet" else CSV
    else:
        known = format_of(file) if file_format is None else format_named(file_format)
    if known.parse is None:
        raise without_touches(file, known)
    if known in (CSV, PARQUET) and (known is PARQUET) != (file.ending == PARQUET.endings[0]):
        raise file.error(
            f"the file is not of format {known.name}, as its ending says; leave the format out",
            inputs=("file_format",),
        )
    if not known.self_contained and options is None:
        raise file.error(
            f"a file of format {known.name} does not contain all that is needed ({known.needs}); "
            "pretravel convert makes touches of it and asks for what is missing"
        )
    options = options or ReadingOptions()
    known.refuse_unused(file, options)
    found = known.parse(file, options)
    asks = options.double_touches is None and not options.series
    named = named_misses(found, unmarked=known.marks_no_misses)
    found = chosen(with_passes(named, asks=asks), options)
    if options.double_touches == "last":
        found = without_passes(without_searches(found))
    if options.radius_taken_off:
        _refuse_one_radius_of_several_tips(found, file)
    readings = found if isinstance(found, FileReadings) else _with_targets(found, options)
    if readings.tip_radius is not None and options.tip_radius is not None:
        refuse_other_tip(file, 2.0 * readings.tip_radius, 2.0 * options.tip_radius)
    if options.tip_radius is not None:
        refuse_tips_by_name(file, readings.touches.tips or (), 2.0 * options.tip_radius)
    if readings is found and (options.plan or options.normal):
        which = " and the ".join(one for one in ("plan", "normal") if getattr(options, one))
        verb = "were" if " and the " in which else "was"
        unused = f"the file itself gives the normal at each touch: the {which} {verb} not used"
        readings = replace(readings, warnings=(*readings.warnings, unused))
    readings = replace(readings, frame=found.frame)
    if known in (CSV, PARQUET):  # their rows are excluded before they are read
        return readings
    names = [n if n in (readings.touches.labels or ()) else _line(n, file) for n in options.exclude]
    return replace(readings, touches=readings.touches.without(names))


def touches_meant(
    source: object, reference_diameter: float | None = None, *, ring: bool = False
) -> Touches:
    r"""The touches of a file that is given in the place of touches, in machine axes.

    Parameters
    ----------
    source : str, Path or SourceFile
        Of a format that contains everything; others are read by `read_readings` with options.
    reference_diameter : float, optional
        Diameter of the reference that was touched: positions on a sphere then need no normals, and
        a table that states no unit is taken in mm. [mm]
    ring : bool
        The reference is a ring.

    Raises
    ------
    InputError
        As `read_readings`.

    >>> file = SourceFile("a.csv", b"x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n")
    >>> len(touches_meant(file))
    1
    """
    options = ReadingOptions(reference_diameter=reference_diameter, ring=ring)
    if not isinstance(source, str | Path | SourceFile):
        return _touches_of_frame(source, options)
    return read_readings(source, options).in_machine_axes().touches


def _touches_of_frame(frame: object, options: ReadingOptions) -> Touches:
    """Touches of a data frame; what has columns and is none is refused by its type."""
    from pretravel.files.data_frames import is_frame, source_of_frame

    if not is_frame(frame):
        raise PretravelError(
            f"expected touches, not a {type(frame).__name__}: read_touches makes them of a file, "
            "Touches(positions, normals) of arrays, and data frames of pandas, polars and Arrow "
            "are read by the names of their columns"
        )
    source = source_of_frame(frame)
    if (known := format_of(source)).refusal:
        raise source.error(known.refusal)
    found = read_readings(source, options, file_format="csv").touches
    return replace(found, source=None, lines=None)


def read_directions(source: Source) -> FloatArray:
    r"""Read outward normals from a file of touches or a table of normals, (n, 3).

    Parameters
    ----------
    source : str, Path or SourceFile
        As `read_readings` without options, in machine axes; or a CSV or Parquet file with the
        columns nx, ny, nz alone.

    Raises
    ------
    InputError
        As `read_readings`.

    >>> read_directions(SourceFile("normals.csv", b"nx,ny,nz\n0,0,1\n")).tolist()
    [[0.0, 0.0, 1.0]]
    """
    file = opened(source)
    known = format_of(file)
    if known in (CSV, PARQUET):
        return read_normals(file)
    return read_readings(file, file_format=known.name).in_machine_axes().touches.normals


def _refuse_one_radius_of_several_tips(
    found: FileReadings | FilePositions, file: SourceFile
) -> None:
    words = found.words if isinstance(found, FilePositions) else found.touches.words
    tips = list(dict.fromkeys(words.get("tip", ())))
    if len(tips) > 1:
        raise file.error(
            f"the points are of {len(tips)} tips ({', '.join(tips)}), and one radius was given as "
            "subtracted from them: choose one tip, and give its radius",
            inputs=("tip", "radius_taken_off"),
        )


def chosen(
    found: FileReadings | FilePositions, options: ReadingOptions
) -> FileReadings | FilePositions:
    """The readings of the tip and the series that are chosen.

    Raises
    ------
    InputError
        A name that the file does not state.

    >>> two = FilePositions("a.log", np.eye(3)[:2], (1, 2), words={"tip": ("T1", "T2")})
    >>> chosen(two, ReadingOptions(tip="T2")).lines
    (2,)
    """
    rows = found if isinstance(found, FilePositions) else found.touches
    words = dict(rows.words)
    path = found.path if isinstance(found, FilePositions) else (found.touches.source or "")
    if options.tip is None and not options.series:
        return found
    keep = np.ones(len(rows.positions), dtype=bool)
    if options.tip is not None:
        keep &= _rows_of(words, ("tip",), options.tip, path, "tip")
    for name in options.series:
        if name == ALL:
            words.pop("part", None)
            words.pop("pass", None)
        else:
            keep &= _rows_of(words, SERIES_COLUMNS, name, path, "series")
    if not keep.any():
        raise InputError(
            "no touch is of the tip and the series that are chosen",
            path=path,
            inputs=("tip", "series"),
        )
    if isinstance(found, FilePositions):
        return replace(found, words=words).take(keep)
    plain = replace(found.touches, parts=None, passes=None)
    return replace(found, touches=replace(plain, **word_fields(words)).take(keep))


SERIES_COLUMNS = ("part", "pass", "orientation")
"""Columns whose words are chosen as the series."""


def _rows_of(
    words: Mapping[str, tuple[str, ...]], columns: Sequence[str], name: str, path: str, what: str
) -> BoolArray:
    """Rows in which one of the columns has the name."""
    for column in columns:
        if name in words.get(column, ()):
            return np.array([word == name for word in words[column]])
    there = [word for column in columns for word in dict.fromkeys(words.get(column, ())) if word]
    shown = f"there are {', '.join(there)}" if there else f"the file gives no {what}"
    raise InputError(f"no touch is of the {what} '{name}'; {shown}", path=path, inputs=(what,))


def _line(name: str, file: SourceFile) -> str:
    """An excluded touch without the name of its file: "a.log:17" is line 17."""
    lines = own_lines([name], file)
    return lines.pop() if lines else name


def _with_targets(found: FilePositions, options: ReadingOptions) -> FileReadings:
    """Touches of positions: of the plan, of a surface, or of the sphere that is fitted to them."""
    if options.normal is not None:
        return _with_one_normal(found, options)
    if options.plan is None and options.normals_from is not None:
        return with_surface_normals(found, options.normals_from)
    if options.plan is None and options.ring:
        return with_ring_normals(found, pin=options.pin)
    if options.plan is not None or options.reference_diameter is None:
        return _joined(found, options)
    return with_sphere_normals(found, options.reference_diameter)


def without_touches(file: SourceFile, known: FileFormat) -> InputError:
    """The error about a file without readings: what it is, and what to do instead.

    Parameters
    ----------
    file : SourceFile
    known : FileFormat
        One that has no `parse`.

    >>> from pretravel.files.format_registry import FORMATS
    >>> print(without_touches(SourceFile("a.nc", b""), FORMATS["netcdf"]))
    a.nc: netcdf files contain no readings
    """
    if known.refusal:
        return file.error(known.refusal)
    if known.parse_features is not None:
        return file.error(
            "a print-out contains sizes and positions of features, with the tip's radius "
            "subtracted: it contains no touches to compensate. pretravel convert makes "
            "a table of it"
        )
    return file.error(f"{known.name} files contain no readings")


def _with_one_normal(found: FilePositions, options: ReadingOptions) -> FileReadings:
    """Give all positions one normal; the touches went along it."""
    if options.plan is not None:
        raise InputError(
            "the plan gives the normal of each touch; give the plan, or one normal for all "
            "touches, not both",
            path=found.path,
            inputs=("plan", "normal"),
        )
    readings = with_surface_normals(found, one_normal(options.normal or ()))
    return _turned(replace(readings, normals_taken=False), options)


def _joined(found: FilePositions, options: ReadingOptions) -> FileReadings:
    """Join positions with the plan that was run."""
    from pretravel.files.logs.joining import join

    if options.plan is None:
        raise InputError(
            "the file contains positions, but no normals: give the plan that was run and the tip's "
            "diameter, or one normal for all touches (0,0,1 for heights)",
            path=found.path,
            inputs=("plan", "tip_diameter", "normal"),
        )
    if options.tip_radius is None:
        raise InputError(
            "the tip's diameter is needed to join the file's positions with the plan",
            path=found.path,
            inputs=("tip_diameter",),
        )
    joined = join(
        found,
        options.plan,
        options.tip_radius,
        overtravel=options.overtravel,
        by=options.join,
        both=options.double_touches == "all",
    )
    joined = replace(joined, touches=replace(joined.touches, reading=found.understood))
    at = {line: row for row, line in enumerate(found.lines)}
    own = found.take([at[line] for line in joined.touches.lines or ()])
    touches = replace(
        joined.touches, feeds=own.feeds, spindle=own.spindle, **word_fields(own.words)
    )
    warnings = (*found.warnings, *joined.warnings)
    return _turned(replace(joined, touches=touches, warnings=warnings), options)


def _turned(readings: FileReadings, options: ReadingOptions) -> FileReadings:
    """The readings with the turn of their work coordinates, which the file does not state."""
    if options.rotation is not None:
        return replace(readings, rotation=options.rotation)
    warning = (
        "the file does not say how the work coordinates were rotated in the machine (G10 L2 R): "
        "no rotation is assumed; a machine file with [work] gives it"
    )
    return replace(readings, warnings=(*readings.warnings, warning))


def write_readings(path: str | Path, touches: Touches, tip_radius: float | None = None) -> None:
    """Write touches in the format of the path's ending: CSV, Parquet, QIF or Fusion results.

    Parameters
    ----------
    path : str or Path
    touches : Touches
    tip_radius : float, optional
        For formats that state it. [mm]

    Raises
    ------
    PretravelError
        No format of touches has this ending; the format needs what is not known; it states one
        radius, and the touches are of several tips.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "touches.qif"
    >>> write_readings(path, Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]]), tip_radius=3.0)
    >>> read_readings(path).tip_radius
    3.0
    """
    if tip_radius is not None:
        checked(tip_radius, "the tip's radius", TIP_RADIUS, inputs=("tip_radius",))
    known = written_format(path)
    tips = sorted({*(touches.tips or ())})
    if len(tips) > 1 and not known.keeps_approaches_and_feeds:
        raise PretravelError(
            f"{Path(path).suffix} states the radius of one tip, and the touches are of "
            f"{len(tips)} tips ({', '.join(tips[:4])}): choose one, or write a table",
            inputs=("tip", "output"),
        )
    assert known.write_touches is not None
    known.write_touches(Path(path), touches, tip_radius)


def written_format(path: str | Path) -> FileFormat:
    """Return the format in which touches are written to a path, by its ending.

    Raises
    ------
    PretravelError
        No format of touches has this ending.

    >>> written_format("touches.msr").name
    'fusion'
    """
    ending = Path(path).suffix.lower()
    for known in FORMATS.values():
        if known.write_touches is not None and ending in known.endings:
            return known
    raise PretravelError(
        f"touches cannot be written to '{path}': the ending must be {', '.join(touch_endings())}"
    )


def touch_endings() -> tuple[str, ...]:
    """Return the endings of the files to which touches can be written."""
    return tuple(e for known in FORMATS.values() if known.write_touches for e in known.endings)
