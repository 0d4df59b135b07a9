"""The finite-element model of a described probe, and its state at the trigger in a direction."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.prediction.description import Probe
from pretravel.prediction.elastic_field import (
    StressByDirection,
    TriggerField,
    field_at_trigger,
    stress_by_direction,
)
from pretravel.prediction.fem.condensation import ElasticField, ReducedModel
from pretravel.prediction.fem.linear_solvers import check_solver
from pretravel.prediction.fem.mesh import MeshSettings
from pretravel.prediction.fem.reduction_cache import reduced_model
from pretravel.prediction.predict import predict
from pretravel.show.document import Document
from pretravel.tasks.reports.finite_elements_report import finite_elements_document

_AZIMUTHS = range(0, 360, 30)
"""At which the stress of the parts is compared. [deg]"""


@dataclass(frozen=True)
class TouchDirection:
    """The surface normal of a touch, in the probe's frame.

    Attributes
    ----------
    polar_deg : float
        90 is a vertical wall.
    azimuth_deg : float

    >>> TouchDirection(90.0, 0.0).normal.round(9).tolist()
    [1.0, 0.0, 0.0]
    """

    polar_deg: float = 90.0
    azimuth_deg: float = 0.0

    @property
    def normal(self) -> FloatArray:
        """Outward unit normal, (3,)."""
        angles = math.radians(self.polar_deg), math.radians(self.azimuth_deg)
        return np.asarray(from_angles(*angles)[0])


@dataclass(frozen=True, eq=False)
class FiniteElementState:
    """A probe's finite-element model with its state at the trigger.

    Attributes
    ----------
    probe : Probe
    reduced : ReducedModel
    field : TriggerField
        In one direction.
    stresses : StressByDirection
        In that direction first, then all around at its polar angle.
    """

    probe: Probe
    reduced: ReducedModel
    field: TriggerField
    stresses: StressByDirection

    def document(self) -> Document:
        """The report."""
        return finite_elements_document(
            self.reduced, self.field, self.stresses, probe_name=self.probe.name
        )


@dataclass(frozen=True, eq=False)
class _InMemory:
    """A field that needs no file; unlike a closure, it can go to another process."""

    field: ElasticField

    def __call__(self) -> ElasticField:
        return self.field


def check_touch(probe: Probe, touch: TouchDirection) -> None:
    """Refuse a direction without a trigger; it takes no time, and the model does.

    Raises
    ------
    PretravelError
        The probe never triggers in that direction.
    """
    predict(probe, touch.normal.reshape(1, 3), "shen")


def build_model(
    probe: Probe, settings: MeshSettings | None = None, solver: str = "auto"
) -> ReducedModel:
    """The reduced model of a probe, with its mesh in memory: it can be sent to another process.

    Parameters
    ----------
    probe : Probe
    settings : MeshSettings, optional
    solver : str
        auto, cholmod, pardiso or superlu.

    Returns
    -------
    ReducedModel
        From the cache, or new.

    Raises
    ------
    PretravelError
        An unknown solver; solids that cannot be meshed; not enough memory.
    """
    check_solver(solver)
    reduced = reduced_model(probe, settings, solver)
    return replace(reduced, load_field=_InMemory(reduced.load_field()))


def state_at_trigger(
    probe: Probe, reduced: ReducedModel, touch: TouchDirection
) -> FiniteElementState:
    """Displacement and stress of the whole mesh at the trigger.

    Parameters
    ----------
    probe : Probe
    reduced : ReducedModel
        Of this probe.
    touch : TouchDirection

    Returns
    -------
    FiniteElementState

    Raises
    ------
    PretravelError
        The probe never triggers in that direction.
    """
    field = field_at_trigger(probe, touch.normal, reduced)
    stresses = stress_by_direction(probe, _directions_around(probe, touch), reduced, field)
    return FiniteElementState(probe, reduced, field, stresses)


def _directions_around(probe: Probe, touch: TouchDirection) -> FloatArray:
    """The direction of a touch, then those at its polar angle in which the probe triggers."""
    found = [touch.normal]
    if math.hypot(*touch.normal[:2]) > 1e-9:  # along the axis there is one direction only
        around = (replace(touch, azimuth_deg=float(a)) for a in _AZIMUTHS)
        for other in around:
            with suppress(PretravelError):
                check_touch(probe, other)
                found.append(other.normal)
    return np.array(found)
