"""Points of a table with coordinates alone, which another program wrote."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pretravel.files.file_format import (
    FilePositions,
    ReadingOptions,
    labels_or_numbers,
    missed_sentence,
)
from pretravel.files.format_registry import format_of
from pretravel.files.logs.double_touches import with_passes
from pretravel.files.misses import named_misses
from pretravel.files.readings import chosen
from pretravel.files.source_file import SourceFile
from pretravel.files.stated_normals import contacts, one_normal
from pretravel.files.touches_csv import read_table_of_touches
from pretravel.measurement import Points

_SMALLEST_RADIUS = 0.15
"""Of a tip; deviations of parts are smaller. [mm]"""
_ALIKE, _MOST = 0.2, 0.8
"""Share of the median within which most distances lie, of a radius that was not subtracted."""
_TIPS_NAMED = 5


def plain_points(file: SourceFile, options: ReadingOptions) -> tuple[Points, tuple[str, ...], bool]:
    """Read the points of a table with coordinates alone.

    Returns
    -------
    Points
    tuple of str
        What is to be said of them.
    bool
        Whether the table has series, of which one was chosen.

    Raises
    ------
    InputError
        As `read_points`.
    """
    options = replace(options, normals_from=one_normal([0.0, 0.0, 1.0]))
    known = format_of(file) if file.ending != ".parquet" else None
    if known is not None and known.refusal:
        raise file.error(known.refusal)
    of_surface = replace(options, of_surface=options.tip_radius is None)
    read = read_table_of_touches(file, of_surface)
    # Points far from their feature are named where the feature is known.
    found = replace(named_misses(read), warnings=read.warnings)
    found = with_passes(found, asks=not options.series)
    told = found.warnings
    missed = missed_sentence(found.misses() if isinstance(found, FilePositions) else ())
    if not isinstance(found, FilePositions):
        raise file.error(
            "these are positions with normals, without uncertainties (no column u_um): touches, "
            "perhaps. Compensate them with a map first; points that are compensated already need "
            "no normals: leave these columns out"
        )
    _, unread, columns = found.understood.partition("not read: ")
    told += (unread + columns,) if unread else ()
    stated = bool({"part", "pass", "orientation"} & set(found.words))
    found = chosen(found, options if stated else replace(options, series=()))
    assert isinstance(found, FilePositions)
    found = contacts(found)
    if options.tip_radius is None and len(tips := sorted(set(found.words.get("tip", ())))) > 1:
        together = (
            f"the points are of {len(tips)} tips ({', '.join(tips[:_TIPS_NAMED])}), and taken "
            "together, as points of the surface"
        )
        told = (*told, together)
        found = replace(found, words={k: v for k, v in found.words.items() if k != "tip"})
    found.touches(np.tile([0.0, 0.0, 1.0], (len(found.positions), 1))).refuse_several()
    _refuse_tip_centres(file, found, options)
    count = len(found.positions)
    points = Points.plain(found.positions, labels_or_numbers(found.labels, count))
    return points, (*missed, *told), stated


def _refuse_tip_centres(file: SourceFile, found: FilePositions, options: ReadingOptions) -> None:
    """Refuse positions that are all about as far from their nominal points as a tip is large."""
    if found.nominal_points is None or options.tip_radius is not None:
        return
    away = np.linalg.norm(found.positions - found.nominal_points, axis=1)
    middle = float(np.median(away))
    alike = np.mean(np.abs(away - middle) < _ALIKE * middle) >= _MOST
    if middle > _SMALLEST_RADIUS and alike:
        raise file.error(
            f"the points are about {middle:.3f} mm from their nominal points: they are tip centres "
            f"of a tip of about {2.0 * middle:.3g} mm. Give its diameter",
            found.lines[0],
            inputs=("tip_diameter",),
        )
