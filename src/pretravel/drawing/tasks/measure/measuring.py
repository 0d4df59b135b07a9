"""A drawing measured in Python, as the command measures it."""

from __future__ import annotations

from pathlib import Path

from pretravel.base import MICROMETRE
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
    task = Measure(
        points=Path("points.csv"),
        drawing=Path("drawing.toml"),
        u_machine_um=u_machine / MICROMETRE,
        probability=probability,
    )
    return task.measured(points, task.wanted_of(drawing, part=part), part)
