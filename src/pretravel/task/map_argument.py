"""The argument MAP of several commands: a map from a file, or the prediction of a probe."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.base import PretravelError
from pretravel.task.model_fields import is_map

if TYPE_CHECKING:
    from pretravel.maps import PretravelMap


def map_or_prediction(
    name: str, model: str = "analytic", *, tip_diameter: float | None = None
) -> PretravelMap:
    """A map from its file, or the prediction of a probe.

    Parameters
    ----------
    name : str
        Path of a map (.json, .csv), or of a description (.toml), or a catalogue name.
    model : str
        Of the prediction.
    tip_diameter : float, optional
        Instead of the map's. [mm]

    Raises
    ------
    PretravelError
        Neither a map nor a probe.
    """
    if is_map(name):
        from pretravel.files import read_map

        return read_map(name, tip_diameter=tip_diameter)
    if Path(name).suffix.lower() not in (".toml", ""):
        raise PretravelError(
            f"{name}: neither a map (.json, .csv) nor a probe (.toml, or a name of pretravel "
            "probes)"
        )
    from pretravel.prediction import described_map

    return described_map(name, model, tip_diameter=tip_diameter)
