"""Maps and descriptions of probes in a project: they name no file of the computer that opens it."""

from __future__ import annotations

from pathlib import Path

from pretravel.base import own_files_alone
from pretravel.files import FORMER_MAP_ENDINGS, MAP_ENDINGS
from pretravel.maps import PretravelMap
from pretravel.prediction import Probe, load_probe
from pretravel.task import map_or_prediction


def own_description(path: Path) -> Probe:
    """Read the description of a probe that is a file of a project.

    Raises
    ------
    PretravelError
        It is not a description, or it takes its solids from another file. A project can come from a
        stranger, and a path in it would be one on this computer.
    """
    with own_files_alone():
        return load_probe(path)


def own_map(
    path: Path, model: str = "analytic", *, tip_diameter: float | None = None
) -> PretravelMap:
    """Read the map of a probe, or predict that of a description, from a file of a project.

    Parameters
    ----------
    path : Path
        A map has one of its endings; every other file is a description.
    model : str
        Of the prediction of a description.
    tip_diameter : float or None
        Where a map does not state it. [mm]

    Raises
    ------
    PretravelError
        As `map_or_prediction` and `own_description`.
    """
    if path.suffix.lower() in (*MAP_ENDINGS, *FORMER_MAP_ENDINGS):
        return map_or_prediction(str(path), model, tip_diameter=tip_diameter)
    # Whatever its name: an ending that no map has is that of a description.
    with own_files_alone():
        load_probe(path)
        return map_or_prediction(str(path), model, tip_diameter=tip_diameter)
