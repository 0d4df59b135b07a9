"""Predict a described probe over directions: a description to a map, a table and a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import FRICTION, STEP
from pretravel.design.tasks.described_probe import Azimuths, Gravity, Polars, ProbeName, Workpiece
from pretravel.prediction import MODELS
from pretravel.task import (
    MAPS,
    PAGES,
    SILENT,
    Angles,
    Field,
    PolarAngles,
    Progress,
    Reported,
    Result,
    ShownQuantity,
    models,
    output,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from pretravel.base import FloatArray
    from pretravel.maps import PretravelMap
    from pretravel.prediction import Probe, Trigger
    from pretravel.show import Document


_MODEL_HELP = (
    "Model of the probe's compliance, one of "
    + ", ".join(f"{name} ({meaning.partition(',')[0] if name == 'wozniak' else meaning})"
                for name, meaning in MODELS.items())
    + f". wozniak: {MODELS['wozniak']}."
)  # fmt: skip


class Predict(Reported):
    """Predict trigger force, sensing distance and pretravel over directions.

    The sensing distance is the deflection of the tip across the probe axis at the trigger.
    """

    name = "predict"
    example = "pretravel predict omp40-2 --azimuth 0:350:10 --polar 90 -o map.csv --plot map.png"

    probe: ProbeName
    model: Annotated[
        str,
        Field(
            help=_MODEL_HELP,
            names=models,
            metavar="MODEL",
        ),
    ] = "analytic"
    azimuth: Azimuths = Angles("0:355:5")
    polar: Polars = PolarAngles("0:90:5")
    lever: Annotated[
        float | None,
        Field(
            help="Distance from the tip centre to the plane of the rods, in mm, in place of the "
            "distance in the description.",
            range=STEP,
        ),
    ] = None
    friction: Annotated[
        float | None,
        Field(
            help="Coefficient of friction at the seats (Coulomb); measurements of the OMP40-2 "
            "require 0.25 to 0.27 (forces) and 0.1 (distances). The prediction is that of the "
            "third of three equal touches, when friction has settled. For the models analytic, fem "
            "and, in closed form, wozniak; default: that of the description, 0 in the catalogue.",
            range=FRICTION,
        ),
    ] = None
    workpiece: Workpiece = "steel"
    gravity: Gravity = None
    quantity: ShownQuantity = "pretravel"
    output: Annotated[
        Path | None,
        output(
            "Map: .json, or .csv, a table with the forces; arrays: .nc; or a page, .html or .pdf.",
            *MAPS,
            ".nc",
            *PAGES,
        ),
    ] = None

    @property
    def directions(self) -> FloatArray:
        """Outward surface normals, azimuth after azimuth for each polar angle, (p a, 3)."""
        import numpy as np

        from pretravel.base import grid

        return grid(np.radians(self.polar.degrees), np.radians(self.azimuth.degrees))

    def run(self, progress: Progress = SILENT) -> PredictedProbe:
        """Read the description and predict.

        >>> round(float(Predict(probe="omp40-2", polar="90").run().trigger.force[0]), 3)
        0.75
        """
        from pretravel.prediction import compliance_model, load_probe

        probe = load_probe(self.probe)
        if self.lever is not None:
            shorten = compliance_model(self.model).uses_lever_only
            probe = probe.with_lever(self.lever, shorten=shorten)
        if self.friction is not None:
            probe = probe.with_friction(self.friction)
        with progress.working(f"predicting {len(self.directions)} directions"):
            return self.predicted(probe)

    def predicted(self, probe: Probe) -> PredictedProbe:
        """Predict a probe that has been read, in the directions of the task.

        Raises
        ------
        PretravelError
            An unknown model; a direction in which the probe never triggers; a probe that cannot be
            predicted.
        """
        from pretravel.prediction import predict

        trigger = predict(
            probe,
            self.directions,
            self.model,
            workpiece=probe.part_material(self.workpiece),
            gravity=self.gravity,
        )
        return PredictedProbe(self, probe, trigger)


@dataclass(frozen=True, eq=False)
class PredictedProbe(Result):
    """A probe with its prediction.

    Attributes
    ----------
    task : Predict
    probe : Probe
    trigger : Trigger
        In the directions of the task.
    """

    task: Predict
    probe: Probe
    trigger: Trigger

    def document(self) -> Document:
        """The report."""
        from pretravel.design.tasks.predict.report import prediction_document

        return prediction_document(self.trigger, self.probe, self.task.quantity)

    def table(self) -> Mapping[str, npt.ArrayLike]:
        """The columns of a file, one row for each direction; angles as they were typed."""
        import numpy as np

        from pretravel.files import trigger_table

        polar, azimuth = self.task.polar.degrees, self.task.azimuth.degrees
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
            seats or a contact that opens, have a table in either case.
        """
        from pretravel.prediction import (
            compliance_model,
            predicted_map,
            probe_response,
            response_map,
        )

        task = self.task
        of_statics = self.probe.seats.friction == 0.0
        if exact and of_statics and compliance_model(task.model).condenses(self.probe):
            workpiece = self.probe.part_material(task.workpiece)
            response = probe_response(
                self.probe, task.model, workpiece=workpiece, gravity=task.gravity
            )
            return response_map(self.probe, response, self.trigger)
        return predicted_map(self.probe, self.trigger)

    def write(self, output: str, path: Path) -> None:
        """Write the map (.json), exact where the model is; or a table (.csv, .nc)."""
        del output
        from pretravel.files import map_dataset, write_dataset, write_map

        ending = path.suffix.lower()
        made = self.pretravel_map(exact=ending != ".csv")
        if ending == ".nc":
            write_dataset(path, map_dataset(made, self.table()))
        else:
            write_map(path, made, table=self.table())
