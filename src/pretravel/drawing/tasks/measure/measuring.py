"""A drawing measured in Python, as the command measures it."""

from __future__ import annotations

from pathlib import Path

from pretravel.base import MICROMETRE, PretravelError
from pretravel.drawing.tasks.measure.task import Measure, MeasuredFeatures
from pretravel.drawing.tolerances.features_file import Drawing
from pretravel.measurement import Points
from pretravel.surface import Part


def measure_drawing(
    points: Points,
    drawing: Drawing,
    *,
    part: Part | None = None,
    u_machine: float = 0.0,
    probability: float = 0.95,
) -> MeasuredFeatures:
    """Measure the features of a drawing, and decide its tolerances.

    Parameters
    ----------
    points : Points
        In the frame of the part, with the faces on which they lie (`Points.face`) or labels.
    drawing : Drawing
        Of `read_drawing`, or made in Python.
    part : Part, optional
        Its faces are the kinds and the nominal places that the drawing leaves out.
    u_machine : float
        Standard uncertainty of a length by the machine's geometry, temperature and clamping. [mm]
    probability : float
        At which a decision is proven (ISO 14253-1).

    Returns
    -------
    MeasuredFeatures
        `report()` is the text of the terminal, `lines` has one line for each tolerance, and
        ``result["bore1"]["diameter"]`` is a quantity.

    Raises
    ------
    PretravelError
        A drawing that contradicts itself, or needs the part.
    """
    for given, kind, advice in (
        (points, Points, "apply makes them, and read_points reads their file"),
        (drawing, Drawing, "read_drawing makes one of a file"),
        (part, Part | None, "read_part makes one of a file"),
    ):
        if not isinstance(given, kind):
            raise PretravelError(
                f"expected {getattr(kind, '__name__', 'Part')}, not a {type(given).__name__}: "
                f"{advice}"
            )
    task = Measure(
        points=Path("points.csv"),
        drawing=Path("drawing.toml"),
        u_machine_um=u_machine / MICROMETRE,
        probability=probability,
    )
    return task.measured(points, task.wanted_of(drawing, part=part), part)
