"""Predict a described probe over directions: a description to a map, a table and a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray, frozen
from pretravel.base.directions import grid
from pretravel.files.map_dataset import map_dataset
from pretravel.files.map_file import write_map
from pretravel.files.prediction_table import trigger_table
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.prediction.compliance.base import compliance_model
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import Material, default_workpiece
from pretravel.prediction.predict import Trigger, predict, predicted_map
from pretravel.prediction.response import probe_response, response_map
from pretravel.show.document import Document
from pretravel.tasks.reports.prediction_report import prediction_document


@dataclass(frozen=True, eq=False)
class PredictionWish:
    """What is predicted: model, directions, part.

    Attributes
    ----------
    model : str
        Of the compliance: a name of `MODELS`.
    polar_deg, azimuth_deg : (p,), (a,) float
        Every polar angle is predicted at every azimuth, in the probe's frame.
    workpiece : Material
    gravity : (3,) float or None
        Unit direction of gravity in the machine's frame; None neglects weight.

    >>> len(PredictionWish().polar_deg), len(PredictionWish().azimuth_deg)
    (19, 72)
    """

    model: str = "analytic"
    polar_deg: npt.ArrayLike = field(default_factory=lambda: np.arange(0.0, 90.5, 5.0))
    azimuth_deg: npt.ArrayLike = field(default_factory=lambda: np.arange(0.0, 355.5, 5.0))
    workpiece: Material = field(default_factory=default_workpiece)
    gravity: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        for name in ("polar_deg", "azimuth_deg"):
            object.__setattr__(self, name, frozen(np.atleast_1d(getattr(self, name))))

    @property
    def directions(self) -> FloatArray:
        """Outward surface normals, azimuth after azimuth for each polar angle, (p a, 3)."""
        return grid(np.radians(self.polar_deg), np.radians(self.azimuth_deg))


@dataclass(frozen=True, eq=False)
class PredictedProbe:
    """A probe with its prediction.

    Attributes
    ----------
    probe : Probe
    wish : PredictionWish
    trigger : Trigger
        In the directions of the wish.
    """

    probe: Probe
    wish: PredictionWish
    trigger: Trigger

    def document(self) -> Document:
        """The report."""
        return prediction_document(self.trigger, self.probe)

    def table(self) -> Mapping[str, npt.ArrayLike]:
        """The columns of a file, one row for each direction; angles as they were wished."""
        polar, azimuth = np.asarray(self.wish.polar_deg), np.asarray(self.wish.azimuth_deg)
        # A direction at the pole no longer contains its azimuth.
        return dict(trigger_table(self.trigger)) | {
            "polar_deg": np.repeat(polar, len(azimuth)),
            "azimuth_deg": np.tile(azimuth, len(polar)),
        }

    def pretravel_map(self, *, exact: bool = False) -> PretravelMap:
        """The pretravel as a map.

        Parameters
        ----------
        exact : bool
            Whether the map computes its values between the directions, instead of linear
            interpolation. Models without elastic contacts, and probes with friction at their
            seats, have a table in either case.
        """
        of_statics = self.probe.seats.friction == 0.0
        if exact and of_statics and compliance_model(self.wish.model).has_response:
            response = probe_response(
                self.probe,
                self.wish.model,
                workpiece=self.wish.workpiece,
                gravity=self.wish.gravity,
            )
            return response_map(self.probe, response, self.trigger)
        return predicted_map(self.probe, self.trigger)


def predict_probe(probe: Probe, wish: PredictionWish | None = None) -> PredictedProbe:
    """Predict force, sensing distance and pretravel of a probe over directions.

    Parameters
    ----------
    probe : Probe
    wish : PredictionWish, optional

    Returns
    -------
    PredictedProbe

    Raises
    ------
    PretravelError
        An unknown model; a direction in which the probe never triggers; a probe that cannot be
        predicted.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> predicted = predict_probe(load_probe("omp40-2"), PredictionWish(polar_deg=90.0))
    >>> float(predicted.trigger.force[0].round(3))
    0.75
    """
    wish = PredictionWish() if wish is None else wish
    trigger = predict(
        probe, wish.directions, wish.model, workpiece=wish.workpiece, gravity=wish.gravity
    )
    return PredictedProbe(probe, wish, trigger)


def with_lever(probe: Probe, lever: float | None, model: str = "analytic") -> Probe:
    """The probe with another lever, as the model understands it; None leaves it as it is.

    Parameters
    ----------
    probe : Probe
    lever : float or None
        Tip centre to the plane of the rod axes. [mm]
    model : str

    Raises
    ------
    DescriptionError
        See `Probe.with_lever`.
    """
    if lever is None:
        return probe
    return probe.with_lever(lever, shorten=compliance_model(model).uses_lever_only)


def with_friction(probe: Probe, friction: float | None) -> Probe:
    """The probe with another friction at its seats; None leaves it as described.

    Parameters
    ----------
    probe : Probe
    friction : float or None
        Coulomb's coefficient.

    Raises
    ------
    DescriptionError
        A coefficient that is out of range.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> with_friction(load_probe("omp40-2"), 0.2).seats.friction
    0.2
    """
    if friction is None:
        return probe
    return replace(probe, seats=replace(probe.seats, friction=friction))


def write_prediction(path: Path, predicted: PredictedProbe) -> None:
    """Write a prediction: a map (.json), exact where the model is, or a table (.csv, .nc).

    Parameters
    ----------
    path : Path
    predicted : PredictedProbe

    Raises
    ------
    PretravelError
        Another ending.
    """
    ending = path.suffix.lower()
    made = predicted.pretravel_map(exact=ending != ".csv")
    if ending == ".nc":
        from pretravel.files.netcdf import write_dataset

        write_dataset(path, map_dataset(made, predicted.table()))
        return
    write_map(path, made, table=predicted.table())
