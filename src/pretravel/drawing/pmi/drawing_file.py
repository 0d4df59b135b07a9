"""Read a drawing: from a file of features, or from the STEP file that carries it."""

from __future__ import annotations

from pathlib import Path

from pretravel.base import InputError
from pretravel.drawing.pmi.model import read_model_drawing
from pretravel.drawing.tolerances import features_file
from pretravel.drawing.tolerances.features_file import Drawing

_STEP = (".step", ".stp", ".p21")


def read_drawing(path: str | Path) -> Drawing:
    """Read the features of a drawing with their tolerances.

    Parameters
    ----------
    path : str or Path
        A file of features (.toml), or a STEP file (AP242) with semantic PMI.

    Returns
    -------
    Drawing

    Raises
    ------
    InputError
        No such file, a key that is not known or a value of another type, with its line; a STEP
        file without semantic PMI.
    PretravelError
        No feature, two of one name, or the name of a feature that there is not.
    """
    if Path(path).suffix.lower() not in _STEP:
        return features_file.read_drawing(path)
    model = read_model_drawing(path)
    if not model.has_pmi:
        raise InputError(
            "states no tolerances: it has no semantic PMI (AP242). `pretravel drawing` writes its "
            "features to fill in: give that file",
            path=path,
        )
    return model.drawn.drawing
