"""Report and pictures of the demonstration on example data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

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
    decimals,
    series,
    value_text,
)
from pretravel.tasks.compensate import points_document, points_view
from pretravel.tasks.qualify import qualification_document, qualification_view

DEMONSTRATION_FILES = (
    "index.html",
    "part_points.csv",
    "map.json",
    "bores.png",
    "qualification.png",
    "points.png",
    "compare.png",
    "kp3_ring.png",
)
"""The files that a demonstration writes."""
_SPHERE_TEXT = (
    "All numbers are root mean squares in µm. A single touch has a repeatability of {noise} µm.",
    (
        "Fitted: errors at the single touches on the sphere that the map was made from. Left out: "
        "errors at single touches in directions that were left out of the fit, a fifth of the "
        "directions at a time. "
        "Sector table: ten radii, two for normals near X and Y and eight at angles between them, "
        "here fitted to all touches near the equator; in the section on simpler corrections it is "
        "from touches at its angles, or computed from the map. Its fit needs touches in all "
        "sectors: there are too few on the sphere to leave any out. "
        "One radius for all: the map of the kind mean, fitted to all touches on the sphere."
    ),
    (
        "On the part: difference from the physical map at the part's 140 points, without the shift "
        "of the whole part, because a shift cancels in distances. In the section on simpler "
        "corrections the differences contain this shift and are larger. u_um in part_points.csv "
        "contains the uncertainty of the physical map."
    ),
    (
        "On the sphere the centre is fitted. This removes a shift, but not a wrong radius: with "
        "the tip radius alone, the errors contain the whole difference between tip radius and "
        "effective radius. On the part most normals point upwards: the mean pretravel shifts the "
        "whole part, and this shift is left out."
    ),
)
_RING_TEXT = (
    (
        "Real data of a touch-trigger probe, the Centroid KP-3: its pretravel in 72 directions "
        "around a ring gauge. The values were read from a published picture, to ±0.5 µm."
    ),
    (
        "Each kind of map was fitted to 36 directions, every second one, and predicted the other "
        "36; then the halves changed places. Each half has touches in all sectors of a sector "
        "table. Fitted: rms error in the fitted directions. Left out: "
        "rms error in the predicted ones. Neighbouring readings scatter by about as much as the "
        "errors of the best kinds."
    ),
)
_HOW_MANY = ("none is", "one is", "both are")
"""Of two bores."""
_KIND_TEXT = (
    "The demonstration always makes a physical map. Without a kind, qualify averages the kinds "
    "with weights from cross-validation. The physical map gets practically all the weight, so the "
    "result is the same."
)
_PART_TEXT = (
    "The standard deviation after compensation is much larger than U of a point: it is that of "
    "the part, because compensation does not change the form and the place of the part."
)
_RING_TITLE = "Centroid KP-3 in a ring gauge: maps fitted to all 72 directions"


def _title(kind: str) -> str:
    """A kind of map in words; the empty name stands for the tip radius alone."""
    return KINDS[kind].title if kind else "tip radius alone"


def main_job_pictures(job: MainJob) -> dict[str, Picture]:
    """The pictures of the main job by the name of their file."""
    return {
        "bores.png": Picture(
            "Two bores, each touched at twelve places. Uncompensated: corrected by the tip radius "
            f"alone. Compensated: by the map. The band is the tolerance of {_limits()}.",
            lambda: features_view(job.bores, "Two bores of the part"),
        ),
        "qualification.png": Picture(
            "The probe on its reference sphere: the map seen from the spindle, the map and the "
            "touches over azimuth at four polar angles, the residuals, and the map in space.",
            lambda: qualification_view(job.qualification, "Reference sphere and the physical map"),
        ),
        "points.png": Picture(
            "A curved part: deviations from the nominal surface before and after compensation, "
            "pretravel, and standard uncertainty of each point. The simulated part itself deviates "
            "by −10 to +14 µm, which remains.",
            lambda: points_view(job.points, "The curved part, compensated"),
        ),
        "compare.png": Picture(
            "Errors after simpler corrections: over the azimuth on the equator, and the "
            "largest on the equator, in all directions and on the part.",
            lambda: comparison_view(job.comparison, "Errors after the corrections of controls"),
        ),
    }


def kinds_pictures(kinds: KindsCompared) -> dict[str, Picture]:
    """The pictures of the comparison of kinds by the name of their file."""
    return {
        "kp3_ring.png": Picture(
            "A Centroid KP-3 in a ring gauge, real data: the readings with each kind of map, "
            "fitted to all directions, and the errors that each map leaves.",
            lambda: _ring_view(kinds),
        ),
    }


def _limits() -> str:
    return " to ".join(f"{limit:.2f}" for limit in LIMITS) + " mm"


def demonstration_summary(job: MainJob, kinds: KindsCompared) -> Document:
    """What the demonstration found, in some lines for the terminal."""
    left = {(row.method, row.where): row.largest / MICROMETRE for row in job.comparison.rows}
    ring = {entry.kind: entry.left_out / MICROMETRE for entry in kinds.ring_errors}
    u_part = float(job.points.standard_uncertainty.max()) / MICROMETRE
    return Document(
        title="pretravel: from touches to compensated points",
        verdict=_verdict(job),
        figures=(
            KeyFigure("curved part", "largest error "
                      f"{value_text(left['mean radius', 'part'], 'µm')} with one radius (mean "
                      "around the equator), "
                      f"{value_text(left['eight sectors', 'part'], 'µm')} with a sector table (ten "
                      "radii); with the map U of a point is at most "
                      f"{value_text(2.0 * u_part, 'µm')}"),
            KeyFigure("a real probe", "Centroid KP-3, in a ring gauge: rms error in "
                      "directions that were not fitted "
                      f"{value_text(ring['mean'], 'µm')} with one radius, "
                      f"{value_text(ring[BEST], 'µm')} with the map"),
        ),
        tables=(_bores_table(job),),
    )  # fmt: skip


def _uncompensated_diameters(job: MainJob) -> list[float]:
    plain = [bore.feature.uncompensated for bore in job.bores]
    return [float(one.diameter) for one in plain if one is not None and one.diameter is not None]


def _verdict(job: MainJob) -> str:
    """How many bores are inside their tolerance, before and after."""
    outside = sum(not LIMITS[0] <= size <= LIMITS[1] for size in _uncompensated_diameters(job))
    inside = sum(bore.verdict is ConformityVerdict.CONFORMS for bore in job.bores)
    return (
        f"Two bores, tolerance {_limits()}: with the tip radius alone {_HOW_MANY[outside]} "
        f"outside, compensated with the map {_HOW_MANY[inside]} inside. This is not a statement of "
        "conformity, because the uncertainty of the machine is not given"
    )


def _bores_table(job: MainJob) -> Table:
    """The diameter of each bore before and after, with U."""
    sizes = [bore.feature.quantity("diameter") for bore in job.bores]
    return Table(
        (
            Column.of("diameter of", [bore.feature.label for bore in job.bores]),
            Column.of("tip radius alone", _uncompensated_diameters(job), "mm", decimals(4)),
            Column.of("map", [size.value for size in sizes], "mm", decimals(4)),
            Column.of("U (95 %)", [size.expanded_u / MICROMETRE for size in sizes], "µm"),
        )
    )


def demonstration_document(
    job: MainJob, kinds: KindsCompared, pictures: Iterable[Picture] = ()
) -> Document:
    """The report of a demonstration.

    Parameters
    ----------
    job : MainJob
    kinds : KindsCompared
    pictures : iterable of Picture
    """
    noise = value_text(job.qualification.repeatability / MICROMETRE)
    return Document(
        title="pretravel: from touches to compensated points",
        verdict=_verdict(job),
        tables=(_bores_table(job),),
        sections=(
            _probe_section(job),
            features_document(job.bores).as_section("Two bores"),
            _part_section(job),
            Section(
                "Errors of each kind of map",
                tuple(text.format(noise=noise) for text in _SPHERE_TEXT),
                tables=(_errors_table(kinds.sphere_errors, on_part=True),),
            ),
            comparison_document(job.comparison).as_section("Errors after simpler corrections"),
            Section(
                "A Centroid KP-3 in a ring gauge, real data",
                _RING_TEXT,
                tables=(_errors_table(kinds.ring_errors, on_part=False),),
            ),
        ),
        pictures=tuple(pictures),
    )


def _probe_section(job: MainJob) -> Section:
    section = qualification_document(job.qualification).as_section(
        "The probe, qualified on the sphere"
    )
    return replace(section, paragraphs=(*section.paragraphs, _KIND_TEXT))


def _part_section(job: MainJob) -> Section:
    section = points_document(job.points).as_section("A curved part, compensated")
    return replace(section, paragraphs=(*section.paragraphs, _PART_TEXT))


def _errors_table(errors: Sequence[KindErrors], *, on_part: bool) -> Table:
    def column(name: str, values: Sequence[float]) -> Column:
        return Column.of(name, [value / MICROMETRE for value in values], "µm")

    columns = [
        Column.of("kind of map", [_title(entry.kind) for entry in errors]),
        column("fitted", [entry.fitted for entry in errors]),
        column("left out", [entry.left_out for entry in errors]),
    ]
    if on_part:
        columns.append(column("on the part, without shift", [entry.on_part for entry in errors]))
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
            PlaneChart("errors left (legend: standard deviation)", Axis("azimuth", "°", 0.0, 360.0),
                       Axis("measured − map", "µm"), tuple(errors)),
        ),
        columns=2,
    )  # fmt: skip
