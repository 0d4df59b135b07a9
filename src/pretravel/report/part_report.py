"""Reports and pictures of a part: its faces, and a plan of the points to touch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.probing.inspection import InspectionPlan
from pretravel.report.document import Column, Document, Picture, Table
from pretravel.report.formatting import decimals, signed_decimals, significant, value_text
from pretravel.report.style import COLOURS, new_figure, proportions
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.local_geometry import Surface
from pretravel.units import DEGREE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_LABELS = 60
_MESH = 25
_APEX = 1e-6
"""A radius below this is the tip of a cone. [mm]"""


def faces_document(part: Part, columns: Mapping[str, npt.ArrayLike]) -> Document:
    """The report of a part: its faces.

    Parameters
    ----------
    part : Part
    columns : mapping of str to values
        Of `pretravel.formats.plan_csv.faces_table`.

    Returns
    -------
    Document
    """
    values = {name: np.asarray(column).tolist() for name, column in columns.items()}
    usable = [row for row, problem in enumerate(values["problem"]) if not problem]
    low, high = part.box
    size = " x ".join(value_text(float(length)) for length in high - low)
    return Document(
        title=part.name,
        verdict=f"{part.name}: {len(values['face'])} faces, {size} mm, from "
        f"{value_text(tuple(low.tolist()))} to {value_text(tuple(high.tolist()))}",
        tables=(
            _faces_table({k: [column[row] for row in usable] for k, column in values.items()}),
        ),
        pictures=(Picture("Faces and their numbers", lambda: plot_part(part)),),
        warnings=_size_warnings(part.size)
        + tuple(
            f"face {face} cannot be used: {problem}"
            for face, problem in zip(values["face"], values["problem"], strict=True)
            if problem
        ),
    )


_SMALL, _LARGE = 1.0, 10_000.0
"""Sizes of parts beyond which the unit of a file is doubtful. [mm]"""


def _size_warnings(size: float) -> tuple[str, ...]:
    if _SMALL <= size <= _LARGE:
        return ()
    return (f"the part is {value_text(size, 'mm')} long: does the file state its unit correctly?",)


def _faces_table(values: Mapping[str, list[Any]]) -> Table:
    angle = significant(4)
    radii = ["apex" if radius < _APEX else radius for radius in values["smallest_radius_mm"]]
    return Table(
        (
            Column.of("face", [str(face) for face in values["face"]]),
            Column.of("name", values["name"]),
            Column.of("type", values["type"]),
            *(Column.of(axis, values[f"{axis}_mm"], "mm") for axis in "xyz"),
            *(Column.of(f"n{axis}", values[f"n{axis}"], "", signed_decimals(2)) for axis in "xyz"),
            Column.of("radius", radii, "mm", significant(3)),
            *(
                Column.of(name.replace("_", " "), values[name], "", angle)
                for name in ("u_from", "u_to", "v_from", "v_to")
            ),
        ),
        explanation="x, y, z: a point in the middle of the face, far from its edges; nx, ny, nz: "
        "the normal there; radius: the smallest anywhere on the face, empty where it is flat; "
        "u, v: the range of its parameters.",
    )


def plan_document(plan: InspectionPlan, surface: Surface | Part, title: str = "") -> Document:
    """The report of a plan of points to touch.

    Parameters
    ----------
    plan : InspectionPlan
    surface : Surface or Part
    title : str
        Of the picture.

    Returns
    -------
    Document
    """
    steepest = math.acos(float(np.clip(plan.normal[:, 2].min(), -1.0, 1.0))) / DEGREE
    polar = value_text(steepest, "°", decimals(1))
    return Document(
        title=title or "Targets",
        verdict=f"{len(plan)} targets, normals up to {polar} from z",
        pictures=(Picture("Targets and normals", lambda: plot_plan(plan, surface, title)),),
        warnings=tuple(
            f"{count} points left out: {reason}" for reason, count in plan.left_out.items()
        ),
    )


def plot_plan(plan: InspectionPlan, surface: Surface | Part, title: str = "") -> Figure:
    """Targets on their surface, with their normals.

    Parameters
    ----------
    plan : InspectionPlan
    surface : Surface or Part
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(8.0, 6.5)
    axes = figure.add_subplot(1, 1, 1, projection="3d")
    size = float(np.linalg.norm(np.ptp(plan.point, axis=0))) or 1.0
    cloud = plan.point
    if isinstance(surface, Part):
        for index in surface.chosen:
            _draw_face(axes, surface.faces[index], "#9fb7c7", 0.35)
        cloud = np.concatenate([surface.box, plan.point])
    axes.scatter(*plan.point.T, s=9, color=COLOURS[3], depthshade=False)
    axes.quiver(*plan.point.T, *(0.05 * size * plan.normal).T, color=COLOURS[1], lw=0.7)
    _label(axes, cloud)
    axes.set_title(f"{title or 'Targets'}: {len(plan)} points")
    return figure


def plot_part(part: Part, title: str = "") -> Figure:
    """A part's faces in colours, with their numbers.

    Parameters
    ----------
    part : Part
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(8.5, 7.0)
    axes = figure.add_subplot(1, 1, 1, projection="3d")
    for i, face in enumerate(part.faces):
        colour = COLOURS[i % len(COLOURS)]
        points = _draw_face(axes, face, colour, 0.45)
        if len(part.faces) <= _MOST_LABELS and len(points):
            middle = points[np.argmin(np.sum((points - points.mean(axis=0)) ** 2, axis=1))]
            axes.text(*middle, str(face.number), fontsize=8, weight="bold", zorder=10)
    _label(axes, part.box)
    crowded = "" if len(part.faces) <= _MOST_LABELS else " (too many for their numbers)"
    axes.set_title(f"{title or part.name}: {len(part.faces)} faces{crowded}")
    return figure


def _draw_face(axes: Any, face: Face, colour: str, alpha: float) -> FloatArray:
    """Triangles of a face between points of its parameters; returns points inside it."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    low, high = face.box
    u, v = np.meshgrid(*(np.linspace(low[k], high[k], _MESH) for k in (0, 1)))
    uv = np.column_stack([u.ravel(), v.ravel()])
    points = face.derivatives(uv)[0]
    inside = face.inside(uv)
    index = np.arange(_MESH * _MESH).reshape(_MESH, _MESH)
    corners = np.stack(
        [index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1
    ).reshape(-1, 4)
    whole = inside[corners].all(axis=1)
    if whole.any():
        quads = Poly3DCollection(
            list(points[corners[whole]]), facecolor=colour, alpha=alpha, edgecolor="none"
        )
        axes.add_collection3d(quads)
    for ring in face.edge_lines(np.inf):
        axes.plot(*face.derivatives(ring)[0].T, color="#333333", lw=0.6)
    return np.asarray(points[inside])


def _label(axes: Any, points: FloatArray) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    for set_limits, a, b in zip(
        (axes.set_xlim, axes.set_ylim, axes.set_zlim), low, high, strict=True
    ):
        set_limits(a, b if b > a else a + 1e-6)
    axes.set_box_aspect(proportions(points))
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")
    axes.set_zlabel("z / mm")
