"""Normals of touches on bores, bosses and spheres, which follow from the fitted feature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pretravel.base import FloatArray, IntArray, PretravelError
from pretravel.measurement.association import Association, associate
from pretravel.measurement.missed_points import missed_points
from pretravel.touches import label_prefix

SIDES = {"bore": -1.0, "boss": 1.0, "sphere": 1.0}
"""Features whose name says on which side the part is: 1 where its normals point outward."""


def normals_of_feature(kind: str, points: FloatArray, labels: Sequence[str] | None) -> FloatArray:
    """Normals of touches on bores, bosses or spheres: those of the fitted features.

    The tip centres on a bore lie on a circle nearly, whose centre is that of the bore: a lobe of
    20 µm moves it by less than that, and the normals of a bore of 20 mm by 2 mrad.

    Parameters
    ----------
    kind : str
        Of `SIDES`.
    points : (n, 3) float
        Tip centres. [mm]
    labels : n strings or None
        Touches whose labels differ only in the number at the end lie on one feature; without
        labels all do.

    Returns
    -------
    (n, 3) float

    Raises
    ------
    PretravelError
        Another kind; touches that do not determine their feature, or do not lie on one.

    >>> ring = 7.0 * np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    >>> (normals_of_feature("bore", ring, None)[0].round(9) + 0.0).tolist()
    [-1.0, 0.0, 0.0]
    """
    if kind not in SIDES:
        raise PretravelError(
            f"the normals of a {kind} do not follow from tip centres: the side of the part is not "
            f"known. They do for {', '.join(SIDES)}",
            inputs=("feature",),
        )
    names = [label_prefix(label) for label in labels] if labels else [""] * len(points)
    if labels and set(names) == set(labels):
        names = [""] * len(points)  # plain numbers
    normals = np.empty_like(points)
    for name in dict.fromkeys(names):
        mine = np.array([own == name for own in names])
        try:
            fit = associate(kind, points[mine])
            _refuse_other_feature(kind, fit)
            normals[mine] = SIDES[kind] * fit.outward
        except PretravelError as error:
            told = _far_touches(kind, points[mine], np.flatnonzero(mine), labels)
            raise PretravelError(
                f"{name or kind}: {error}. {told}{_WHAT_TO_DO}",
                inputs=error.inputs or ("feature",),
            ) from None
    return normals


def _refuse_other_feature(kind: str, fit: Association) -> None:
    """Refuse touches whose normals are not those of the fitted feature."""
    radius = 0.5 * float(fit.diameter or 0.0)
    reach = min(radius, float(np.ptp(fit.points, axis=0).max()))
    off = float(np.abs(fit.residuals).max())
    limit = max(_LARGEST_FORM, _FORM_OF_RADIUS * reach)
    if off > limit:
        raise PretravelError(
            f"the touches do not lie on a {kind}: they are up to {off:.3g} mm off the fitted one "
            f"(radius of the tip centres {radius:.4g} mm), and scatter, pretravel and form explain "
            f"{limit:.2g} mm; its normals are not those of the surface"
        )
    scatter = max(float(np.sqrt(np.mean(fit.residuals**2))), _USUAL_VARIATION)
    assert fit.diameter_row is not None  # of a circle and a sphere
    u_radius = 0.5 * scatter * float(np.linalg.norm(fit.diameter_row @ fit.response))
    if u_radius > _MOST_OF_RADIUS * radius:
        raise PretravelError(
            f"the touches do not show the radius of the {kind}: {radius:.4g} mm with a standard "
            f"uncertainty of {u_radius:.2g} mm, so that neither its side nor its normals follow. "
            "Touch more of its circumference"
        )


_WHAT_TO_DO = (
    "Use normals in the file instead, or the nominal surface; touches of several features need "
    "labels such as bore1-1, bore1-2, bore2-1; leave a gross touch out"
)
_LARGEST_FORM, _FORM_OF_RADIUS = 0.05, 0.02
"""Distance of a touch from its fitted feature that pretravel and form explain, in mm, and in parts
of the radius: an oval of this size turns normals by 2.3°, which moves a point by 0.08 % of the
radius of the tip."""
_USUAL_VARIATION = 0.01
"""Scatter of few touches, whose residuals do not show it: pretravel over the directions. [mm]"""
_MOST_OF_RADIUS = 0.1
"""Largest standard uncertainty of the radius, in parts of it."""


def _far_touches(
    kind: str, points: FloatArray, rows: IntArray, labels: Sequence[str] | None
) -> str:
    """A sentence that names single touches without which the others lie on the feature."""
    found = missed_points(kind, points)
    if not found.rows:
        return ""
    named = ", ".join(
        f"{labels[rows[row]] if labels else rows[row] + 1} ({off:+.3f} mm)"
        for row, off in zip(found.rows, found.off, strict=True)
    )
    what = "a miss or a gross touch" if len(found.rows) == 1 else "misses or gross touches"
    return f"The others lie on a {kind} without touch {named}, {what}. "
