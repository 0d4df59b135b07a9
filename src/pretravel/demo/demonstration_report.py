"""Report and pictures of the demonstration on example data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, azimuth_angle
from pretravel.controls import comparison_document, comparison_view
from pretravel.demo.demonstration import (
    BEST,
    LIMITS,
    KindErrors,
    KindsCompared,
    MainJob,
)
from pretravel.drawing import ConformityVerdict, features_document, features_view
from pretravel.maps import KINDS
from pretravel.show import (
    Axis,
    Column,
    Document,
    Dots,
    KeyFigure,
    LineMark,
    Picture,
    PlaneChart,
    PolarChart,
    Rule,
    Section,
    Table,
    View,
    series,
    value_text,
)
from pretravel.tasks.compensate import points_document, points_view
from pretravel.tasks.qualify import qualification_document, qualification_view

DEMONSTRATION_FILES = (
    "index.html",
    "points.csv",
    "map.json",
    "bores.png",
    "qualification.png",
    "points.png",
    "compare.png",
    "kp3_ring.png",
)
"""The files that a demonstration writes."""
_SPHERE_TEXT = (
    "All numbers are root mean squares in µm; a single touch repeats to {noise}.",
    (
        "Fitted: errors on the sphere of the touches that the map was made from. Left out: errors"
        " on the sphere in directions that were left out of the fit, a fifth of them at a time. A"
        " sector table needs all its sectors: here none of its directions can be left out."
    ),
    (
        "On the part: difference from the physical map at the part's 140 points, without a shift "
        "of the whole part. These are the errors that the other kinds would cause there; the error"
        " of the physical map itself is u_um in points.csv. The deviation of the part from its "
        'nominal surface is deviation_um. "Not compensated" subtracts the tip radius only: its '
        "16 µm contain the mean pretravel."
    ),
)
_RING_TEXT = (
    (
        "Real data: 72 directions, each read once from a published picture, to ±0.5 µm; the "
        "centre of the ring is fitted too. Fitted: every second direction, then the others. Left "
        "out: the directions that were not fitted. Readings of neighbouring directions scatter "
        "by about as much as the errors of the best kinds."
    ),
)
_RING_TITLE = "Centroid KP-3 in a ring gauge, fitted to all 72 directions, centring subtracted"


def _title(kind: str) -> str:
    """A kind of map in words; the empty name stands for touches without compensation."""
    return KINDS[kind].title if kind else "not compensated"


def main_job_pictures(job: MainJob) -> dict[str, Picture]:
    """The pictures of the main job by the name of their file."""
    return {
        "bores.png": Picture(
            "Two bores, touched in twelve places each, before and after compensation; the band is "
            f"the tolerance of {_limits()}.",
            lambda: features_view(job.bores, "Two bores of the part"),
        ),
        "qualification.png": Picture(
            "The probe on its reference sphere: pretravel seen from the spindle with the touched "
            "directions, over azimuth at four polar angles with the touches, and the residuals.",
            lambda: qualification_view(
                job.qualification, "Reference sphere, six-seat probe fitted"
            ),
        ),
        "points.png": Picture(
            "A curved part before and after compensation in space, its pretravel and uncertainty.",
            lambda: points_view(job.points, "The curved part, compensated"),
        ),
        "compare.png": Picture(
            "Errors after simpler corrections: over the azimuth on the "
            "equator, and the largest error over directions and on the part.",
            lambda: comparison_view(job.comparison, "Errors after the corrections of controls"),
        ),
    }


def kinds_pictures(kinds: KindsCompared) -> dict[str, Picture]:
    """The pictures of the comparison of kinds by the name of their file."""
    return {
        "kp3_ring.png": Picture(
            "A Centroid KP-3 in a ring gauge: pretravel over azimuth, and the errors that each "
            "kind of map has when it is fitted to all directions.",
            lambda: _ring_view(kinds),
        ),
    }


def _limits() -> str:
    return " to ".join(f"{limit:.2f}" for limit in LIMITS) + " mm"


def demonstration_summary(job: MainJob, kinds: KindsCompared) -> Document:
    """What the demonstration found, in some lines for the terminal.

    Parameters
    ----------
    job : MainJob
    kinds : KindsCompared

    Returns
    -------
    Document
    """
    left = {(row.method, row.where): row.largest / MICROMETRE for row in job.comparison.rows}
    ring = {entry.kind: entry.left_out / MICROMETRE for entry in kinds.ring_errors}
    return Document(
        title="pretravel: from touches to compensated points",
        verdict=_bores_sentence(job),
        figures=(
            KeyFigure("a touch repeats to", job.qualification.repeatability / MICROMETRE, "µm"),
            KeyFigure("U of a point, largest",
                      2.0 * float(job.points.standard_uncertainty.max()) / MICROMETRE, "µm"),
            KeyFigure("error with one radius", left["mean radius", "part"], "µm",
                      remark="largest on the curved part; "
                      f"with eight radii {value_text(left['eight sectors', 'part'], 'µm')}"),
            KeyFigure("real probe in a ring", ring[BEST], "µm",
                      remark="rms error of the map in directions that were not fitted; with one "
                      f"radius {value_text(ring['mean'], 'µm')}"),
        ),
    )  # fmt: skip


def _bores_sentence(job: MainJob) -> str:
    """The bores before and after, against their tolerance."""
    plain = [bore.feature.uncompensated for bore in job.bores]
    before = [float(one.diameter) for one in plain if one is not None and one.diameter is not None]
    sizes = [bore.feature.quantity("diameter") for bore in job.bores]
    outside = sum(not LIMITS[0] <= diameter <= LIMITS[1] for diameter in before)
    inside = sum(bore.verdict is ConformityVerdict.CONFORMS for bore in job.bores)
    ranges = max(one.form for one in plain if one is not None) / MICROMETRE
    left = max(bore.feature.association.form for bore in job.bores) / MICROMETRE
    u = max(size.expanded_u for size in sizes) / MICROMETRE
    return (
        f"Two bores, tolerance {_limits()}: corrected by the tip's radius alone they measure "
        f"{_sizes(before)} mm, {outside} outside the tolerance; corrected by the map "
        f"{_sizes([size.value for size in sizes])} mm, {inside} within the tolerance, U = "
        f"{value_text(u, 'µm')}. The range of the points about the circle falls from "
        f"{value_text(ranges)} to {value_text(left, 'µm')}. This is no statement of conformity: U "
        "contains the errors of probing alone"
    )


def _sizes(diameters: Sequence[float]) -> str:
    return " and ".join(f"{diameter:.3f}" for diameter in diameters)


def demonstration_document(
    job: MainJob, kinds: KindsCompared, pictures: Iterable[Picture] = ()
) -> Document:
    """The report of a demonstration.

    Parameters
    ----------
    job : MainJob
    kinds : KindsCompared
    pictures : iterable of Picture

    Returns
    -------
    Document
    """
    noise = value_text(job.qualification.repeatability / MICROMETRE)
    return Document(
        title="pretravel: from touches to compensated points",
        verdict=_bores_sentence(job),
        sections=(
            qualification_document(job.qualification).as_section(
                "The probe, qualified on the sphere"
            ),
            features_document(job.bores).as_section("Two bores"),
            points_document(job.points).as_section("A curved part, compensated"),
            Section(
                "Errors of each kind of map",
                tuple(text.format(noise=noise) for text in _SPHERE_TEXT),
                tables=(_errors_table(kinds.sphere_errors, on_part=True),),
            ),
            comparison_document(job.comparison).as_section("Errors after simpler corrections"),
            Section(
                "A Centroid KP-3 in a ring gauge (real)",
                _RING_TEXT,
                tables=(_errors_table(kinds.ring_errors, on_part=False),),
            ),
        ),
        pictures=tuple(pictures),
    )


def _errors_table(errors: Sequence[KindErrors], *, on_part: bool) -> Table:
    def column(name: str, values: Sequence[float]) -> Column:
        return Column.of(name, [value / MICROMETRE for value in values], "µm")

    columns = [
        Column.of("kind of map", [_title(entry.kind) for entry in errors]),
        column("fitted", [entry.fitted for entry in errors]),
        column("left out", [entry.left_out for entry in errors]),
    ]
    if on_part:
        columns.append(column("on the part", [entry.on_part for entry in errors]))
    return Table(tuple(columns))


def _ring_view(compared: KindsCompared) -> View:
    first = compared.ring_maps["mean"]
    return ring_kinds_view(
        azimuth_angle(-first.contact_normals),
        first.observed,
        {
            # About the mean's centre, as the measured values are: each kind has its own.
            _title(kind): first.observed - made.residuals
            for kind, made in compared.ring_maps.items()
        },
        _RING_TITLE,
    )


def ring_kinds_view(
    azimuth: FloatArray, observed: FloatArray, kinds: Mapping[str, FloatArray], title: str
) -> View:
    """Pretravel on a ring, and several kinds of map fitted to it.

    Parameters
    ----------
    azimuth : (n,) float
        [rad]
    observed : (n,) float
        [mm]
    kinds : mapping of str to (n,) float
        Map values. [mm]
    title : str

    Returns
    -------
    View
    """
    order = np.argsort(azimuth)
    closed = np.append(order, order[0])
    around: list[LineMark | Dots] = []
    errors: list[LineMark | Rule] = [Rule(0.0, colour="ink")]
    for index, (name, values) in enumerate(kinds.items()):
        around.append(LineMark(azimuth[closed], values[closed] / MICROMETRE, name, series(index)))
        error = (observed - values) / MICROMETRE
        label = f"{name}: {value_text(float(error.std()), 'µm')}"
        errors.append(LineMark(azimuth[order] / DEGREE, error[order], label, series(index), 1.2))
    around.append(Dots(azimuth, observed / MICROMETRE, "measured", "ink", size=3.0))
    return View(
        title,
        (
            PolarChart("pretravel", Axis("pretravel", "µm", 0.0), tuple(around)),
            PlaneChart("errors left (standard deviation)", Axis("azimuth", "°", 0.0, 360.0),
                       Axis("measured − map", "µm"), tuple(errors)),
        ),
        columns=2,
    )  # fmt: skip
