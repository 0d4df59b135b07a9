"""Preview of a file of touches: what was understood of it, and what it lacks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from pretravel.base import INCH, FloatArray, IntArray, PretravelError
from pretravel.files import (
    FeatureResult,
    FilePositions,
    FileReadings,
    missed_sentence,
)
from pretravel.show import Column, Document, KeyFigure, Span, Table, decimals, value_text
from pretravel.uncertainty import SphereFit, fit_plane, fit_sphere

_ROWS = 5
"""First rows that are shown."""
_ROUND = 0.01
"""Largest share of its radius by which points of a sphere deviate from it."""
_FEWEST = 9
_RESULTS = 12
"""First results of features that are shown."""
_BETTER = 3.0
"""A sphere fits this many times better than a plane, in root mean square, where it is one: by
chance in 0.2 % of flat files with nine points (F test with 1 and 5 degrees of freedom), and less
with more."""
_ALONG = 0.996
"""Cosine from which a normal lies along the radius of a sphere: 5°, a centre that the targets have
1.3 mm away from that of a ball of 25 mm with its tip. Those in a bore are not along it."""


def preview_document(
    name: str, found: FileReadings | FilePositions, *, unit_known: bool = True
) -> Document:
    """The preview of a file.

    Parameters
    ----------
    name : str
        Of the file.
    found : FileReadings or FilePositions
    unit_known : bool
        False: the lengths are as in the file.
    """
    touches = found.touches if isinstance(found, FileReadings) else None
    positions = found.positions if isinstance(found, FilePositions) else found.touches.positions
    reading = found.understood if isinstance(found, FilePositions) else found.touches.reading
    unit = "mm" if unit_known else ""
    kind = "positions without normals" if touches is None else "touches"
    feeds = found.feeds if isinstance(found, FilePositions) else found.touches.feeds
    missed = found.misses() if isinstance(found, FilePositions) else ()
    contact = found.contact if isinstance(found, FilePositions) else None
    rows = np.flatnonzero(contact) if contact is not None and any(contact) else None
    touched = positions if rows is None else positions[rows]
    lacks = found.lacks if isinstance(found, FilePositions) else ()
    sphere = _sphere_figures(touched, None if touches is None else touches.normals, unit)
    return Document(
        title=name,
        verdict=f"{name}: {len(positions) - len(missed)} {kind}"
        + (f", and {len(missed)} without contact" if missed else ""),
        figures=(
            *((KeyFigure("read", reading),) if reading else ()),
            *(KeyFigure(axis, Span.of(touched[:, i]), unit) for i, axis in enumerate("xyz")),
            *(() if feeds is None else (KeyFigure("feed", Span.of(feeds), "mm/min"),)),
            *sphere,
            *_words_figures(found),
            *(
                KeyFigure("missing", words)
                for words in (*_missing(unit_known, touches is None, bool(sphere)), *lacks)
            ),
        ),
        tables=(_first_rows(found, touched, unit, rows),),
        warnings=tuple(found.notes())
        if isinstance(found, FileReadings)
        else (*found.warnings, *missed_sentence(missed)),
    )


def _words_figures(found: FileReadings | FilePositions) -> tuple[KeyFigure, ...]:
    """Tips, parts, passes and orientations, each with its touches."""
    words = found.words if isinstance(found, FilePositions) else found.touches.words
    figures = []
    for name, each in words.items():
        counts = list(Counter(each).items())
        shown = ", ".join(f"{word or 'not stated'} ({count})" for word, count in counts[:_RESULTS])
        figures.append(KeyFigure(name, shown + ("…" if len(counts) > _RESULTS else "")))
    return tuple(figures)


def results_document(name: str, results: Sequence[FeatureResult], lacking: str = "") -> Document:
    """The preview of a file that contains results of features.

    Parameters
    ----------
    name : str
        Of the file.
    results : sequence of FeatureResult
    lacking : str
        What is missing to make touches of it; empty where it contains none.
    """
    shown = results[:_RESULTS]
    table = Table(
        (
            Column("feature", tuple(str(result.feature) for result in shown)),
            Column("quantity", tuple(result.quantity for result in shown)),
            *(
                Column.of(word, [getattr(r, word) for r in shown], "", decimals(4))
                for word in ("nominal", "actual", "deviation")
            ),
        ),
        title="first results (mm, degrees)",
    )
    plural = "s" if len(results) > 1 else ""
    touches = KeyFigure("to get touches", lacking)
    return Document(
        title=name,
        verdict=f"{name}: {len(results)} result{plural} of features"
        + ("" if lacking else ", no touches to compensate"),
        figures=(touches,) if lacking else (),
        tables=(table,),
    )


def _missing(unit_known: bool, without_normals: bool, on_sphere: bool) -> list[str]:
    missing = []
    if not unit_known:
        advice = "; qualify assumes mm and compares the diameters" if on_sphere else ""
        missing.append(f"the unit of length: give mm or inch{advice}")
    if without_normals:
        missing.append(
            "normals; qualify needs none on a sphere"
            if on_sphere
            else "normals: give columns of normals, the plan that was run, or one normal for all "
            "touches (0,0,1 for heights). A bore, a boss or a sphere needs none if you name the "
            "feature, nor does a part that is aligned to its STEP file"
        )
    return missing


def _sphere_figures(
    positions: FloatArray, normals: FloatArray | None, unit: str
) -> tuple[KeyFigure, ...]:
    """The sphere on which the positions lie, if it is one."""
    fit = _sphere_of(positions)
    if fit is None:
        return ()
    deviation = float(np.max(np.abs(fit.residuals)))
    diameter = 2.0 * fit.radius
    text = f"{diameter:.4f} {unit}".rstrip()
    if not unit:
        text += f" (as inches: {INCH * diameter:.4f} mm)"
    remark = (
        f"diameter {text} through the tip centres (reference plus tip, less twice the pretravel); "
        f"all tip centres lie within {deviation:.4f}{' ' + unit if unit else ''} of it; centre "
        f"{value_text(tuple(np.round(fit.center, 4).tolist()))}"
    )
    figures = [KeyFigure("sphere", remark)]
    if normals is not None:
        along = np.sum((positions - fit.center) * normals, axis=1) / fit.radius
        if np.median(np.abs(along)) < _ALONG:
            return ()
        outward = np.mean(along > 0.0) > 0.5
        words = (
            "out of the sphere" if outward else "INTO the sphere: are they directions of travel?"
        )
        figures.append(KeyFigure("normals", f"they point {words}"))
    return tuple(figures)


def _sphere_of(positions: FloatArray) -> SphereFit | None:
    """The sphere that positions determine; None where they are as flat as they are round."""
    if len(positions) < _FEWEST:
        return None
    try:
        flat, fit = fit_plane(positions), fit_sphere(positions)
    except PretravelError:
        return None
    scatter, across = (np.linalg.norm(each.residuals) for each in (fit, flat))
    if np.max(np.abs(fit.residuals)) > _ROUND * fit.radius or across < _BETTER * scatter:
        return None
    return fit


def _first_rows(
    found: FileReadings | FilePositions,
    positions: FloatArray,
    unit: str,
    rows: IntArray | None = None,
) -> Table:
    """The first positions, of these rows of the file."""
    of = found if isinstance(found, FilePositions) else found.touches
    shown = (np.arange(len(positions)) if rows is None else rows)[:_ROWS].tolist()
    named, names = ("line", of.lines) if of.labels is None else ("touch", of.labels)
    columns = [Column(named, tuple(str(i + 1 if names is None else names[i]) for i in shown))]
    for i, axis in enumerate("xyz"):
        columns.append(Column.of(axis, positions[:_ROWS, i], unit, decimals(4)))
    if isinstance(found, FileReadings):
        for i, axis in enumerate("xyz"):
            columns.append(Column.of(f"n{axis}", found.touches.normals[:_ROWS, i], "", decimals(4)))
    return Table(tuple(columns), title="first rows")
