"""Report and picture of a plan of the points to touch."""

from __future__ import annotations

import math

import numpy as np

from pretravel.base import DEGREE
from pretravel.drawing.inspection import InspectionPlan
from pretravel.show import (
    Document,
    Picture,
    SpaceChart,
    SpaceLines,
    SpacePoints,
    View,
    body_marks,
    decimals,
    value_text,
)
from pretravel.surface import Part, Surface


def plan_document(plan: InspectionPlan, surface: Surface | Part, title: str = "") -> Document:
    """The report of a plan of points to touch.

    Parameters
    ----------
    plan : InspectionPlan
    surface : Surface or Part
    title : str
        Of the picture.
    """
    steepest = math.acos(float(np.clip(plan.normal[:, 2].min(), -1.0, 1.0))) / DEGREE
    polar = value_text(steepest, "°", decimals(1))
    return Document(
        title=title or "Targets",
        verdict=f"{len(plan)} targets, normals up to {polar} from z",
        pictures=(Picture("Targets and normals", lambda: plan_view(plan, surface, title)),),
        warnings=tuple(
            f"{count} points left out: {reason}" for reason, count in plan.left_out.items()
        ),
    )


def plan_view(plan: InspectionPlan, surface: Surface | Part, title: str = "") -> View:
    """Targets on their surface, with their normals."""
    body = body_marks(surface)
    cloud = np.concatenate([plan.point, surface.box]) if isinstance(surface, Part) else plan.point
    length = 0.06 * (float(np.linalg.norm(np.ptp(cloud, axis=0))) or 1.0)
    marks = (
        *body,
        SpaceLines(plan.point, plan.point + length * plan.normal, "normals", "series2", 1.2),
        SpacePoints(plan.point, "targets", "series1", size=4.0, labels=plan.labels),
    )
    chart = SpaceChart("Targets and normals", marks, "part")
    return View(f"{title or 'Targets'}: {len(plan)} points", (chart,))
