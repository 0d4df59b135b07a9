"""Pictures of a qualification: its map, its touches and their residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pretravel.base import MICROMETRE, FloatArray
from pretravel.qualification import Qualification
from pretravel.show import (
    Axis,
    Dots,
    Mark,
    PlaneChart,
    Rule,
    Scale,
    View,
    angles_deg,
    at_the_edge,
    azimuth_axis,
    chart_by_place,
    is_ring,
    labels_of,
    map_and_touches,
    map_body,
    map_top_view,
    some_rows,
)


def qualification_view(qualification: Qualification, title: str = "") -> View:
    """The map from above and as a body, over azimuth with the touches, and the residuals by place.

    Returns
    -------
    View
        Of touches on a ring: the map over azimuth, and the residuals over azimuth.
    """
    pretravel_map = qualification.pretravel_map
    title = title or f"Qualification, map kind {pretravel_map.kind}"
    directions = qualification.contact_normals @ pretravel_map.rotation
    observed, residuals = qualification.observed, qualification.residuals / MICROMETRE
    labels = labels_of(
        directions,
        [("pretravel", observed / MICROMETRE, False), ("residual", residuals, True)],
    )
    outliers = [row for outlier in qualification.outliers for row in outlier.rows]
    # A touch that the map leaves out sets no scale: it is named where the residuals stand.
    used = np.setdiff1d(np.arange(len(directions)), outliers)
    own = tuple(labels[row] for row in used)
    around = map_and_touches(pretravel_map, directions[used], observed[used], own)
    if outliers:
        around = replace(around, note=f"{around.note} Outliers are not drawn here.")
    if is_ring(directions):
        return View(title, (around, _residuals_on_ring(qualification, directions, labels)), 2)
    scale = Scale.of("residual (touch − map)", "µm", residuals[used], signed=True)
    by_place = chart_by_place(
        directions, residuals, scale, "residuals by place", labels=labels,
        groups=qualification.groups, ringed=("named as outlier", outliers),
    )  # fmt: skip
    body = map_body(pretravel_map, directions[used], observed[used], own)
    return View(title, (map_top_view(pretravel_map), around, by_place, body), 2)


def _residuals_on_ring(
    qualification: Qualification, directions: FloatArray, labels: tuple[str, ...]
) -> PlaneChart:
    """Residuals over azimuth, and before them those of the mean radius about its own centre."""
    outliers = [row for outlier in qualification.outliers for row in outlier.rows]
    used = np.setdiff1d(np.arange(len(directions)), outliers)
    rows = used[some_rows(np.arange(len(used)), 3000)]
    observed = qualification.observed / MICROMETRE
    circle = np.column_stack([np.ones(len(observed)), directions[:, :2]])
    mean = observed - circle @ np.linalg.lstsq(circle, observed, rcond=None)[0]
    azimuth = angles_deg(directions)[1][rows]
    residuals = qualification.residuals[rows] / MICROMETRE
    named = tuple(labels[row] for row in rows)
    kind = qualification.pretravel_map.kind
    marks: list[Mark] = [
        Rule(0.0),
        Dots(azimuth, mean[rows], "after the mean radius", "before", symbol="ring", labels=named),
        Dots(azimuth, residuals, f"after the map ({kind})", "after", labels=named),
    ]
    if outliers:
        at = angles_deg(directions[outliers])[1]
        beyond = qualification.residuals[outliers] / MICROMETRE
        drawn = at_the_edge(beyond, np.append(mean[rows], residuals))
        marks.append(Dots(at, drawn, "named as outlier", "limit", symbol="ring", size=11.0,
                          labels=tuple(labels[row] for row in outliers)))  # fmt: skip
    return PlaneChart("residuals by place", azimuth_axis(),
                      Axis("residual (touch − map)", "µm"), tuple(marks))  # fmt: skip
