"""Calibrate a probe on a rig: traces to pretravel and hysteresis, their report and certificate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy.typing as npt

from pretravel.base.errors import PretravelError
from pretravel.files.laboratory_file import with_laboratory_values
from pretravel.files.rig_csv import read_rig_trace, rig_json, rig_table
from pretravel.laboratory.certificate import LaboratoryStatements, calibration_certificate
from pretravel.laboratory.rig import RigTouch, RigTrace, at_reference_temperature
from pretravel.laboratory.rig_budget import (
    REN_BUDGET,
    LengthComponent,
    budget_doubts,
    calibration_budget,
    length_budget,
)
from pretravel.laboratory.rig_calibration import RigCalibration, calibrate_rig
from pretravel.laboratory.rig_events import rig_touch
from pretravel.laboratory.rig_marks import with_marks
from pretravel.show.document import Document
from pretravel.tasks.reports.certificate_report import certificate_document
from pretravel.tasks.reports.laboratory_report import with_laboratory
from pretravel.tasks.reports.rig_report import rig_document
from pretravel.uncertainty.gum import Budget

REN_SOURCE = "Ren 2020, Table 2: the paper's rig, NOT this laboratory's"


@dataclass(frozen=True)
class RigSetup:
    """What a calibration knows beside the traces.

    Attributes
    ----------
    components : sequence of LengthComponent
        Uncertainty budget of the rig.
    budget_source : str
    temperature : float
        Of the ruler. [°C]
    expansion : float
        Thermal expansion coefficient of the ruler. [1e-6/K]
    exclude : tuple of str
        Traces that are left out.
    marks : mapping of str to mapping of str to float
        By trace, events where a person sees them; see `with_marks`. [mm]
    """

    components: Sequence[LengthComponent] = REN_BUDGET
    budget_source: str = REN_SOURCE
    temperature: float = 20.0
    expansion: float = 8.0
    exclude: tuple[str, ...] = ()
    marks: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class CalibratedRig:
    """A calibration with the traces that it comes from.

    Attributes
    ----------
    traces : tuple of RigTrace
    touches : tuple of RigTouch
    calibration : RigCalibration
    setup : RigSetup
    """

    traces: tuple[RigTrace, ...]
    touches: tuple[RigTouch, ...]
    calibration: RigCalibration
    setup: RigSetup

    @property
    def budget(self) -> Budget:
        """Of the mean pretravel. [mm]"""
        found = self.calibration
        return length_budget(calibration_budget(found, self.setup.components), abs(found.pretravel))

    @property
    def notes(self) -> list[str]:
        """Irregularities of the traces, and doubts about the budget."""
        return [
            *(f"{touch.trace}: {note}" for touch in self.touches for note in touch.notes),
            *budget_doubts(self.setup.components),
        ]

    def document(
        self, *, warnings: Sequence[str] = (), statements: LaboratoryStatements | None = None
    ) -> Document:
        """The report, with what the laboratory states."""
        report = rig_document(
            self.calibration, self.budget, self.traces, warnings=[*self.notes, *warnings]
        )
        return with_laboratory(report, statements)

    def certificate(
        self, statements: LaboratoryStatements | None = None, *, warnings: Sequence[str] = ()
    ) -> Document:
        """The calibration certificate; see `TEMPLATE` of `certificate_report`."""
        made = calibration_certificate(
            self.calibration,
            self.setup.components,
            statements or LaboratoryStatements(),
            budget_source=self.setup.budget_source,
            temperature=self.setup.temperature,
        )
        return certificate_document(made, self.traces, warnings=[*self.notes, *warnings])

    def values(self, statements: LaboratoryStatements | None = None) -> dict[str, Any]:
        """The calibration for JSON, with what the laboratory states."""
        return with_laboratory_values(rig_json(self.calibration, self.budget), statements)

    def table(self) -> dict[str, npt.ArrayLike]:
        """The single touches."""
        return rig_table(self.touches, self.calibration.not_used)


def read_touches_of_rig(
    paths: Sequence[Path], setup: RigSetup
) -> tuple[tuple[RigTrace, ...], tuple[RigTouch, ...]]:
    """Traces, with the ruler at its reference temperature, and their events.

    Parameters
    ----------
    paths : sequence of Path
    setup : RigSetup

    Raises
    ------
    PretravelError
        A trace that is given twice or cannot be evaluated; marks of a trace that is not there.
    """
    names = [path.stem for path in paths]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise PretravelError(f"trace {repeated[0]} is given twice; each file is one touch")
    unknown = sorted(set(setup.marks) - set(names))
    if unknown:
        raise PretravelError(
            f"there is no trace {unknown[0]} to mark; there are {', '.join(names[:8])}",
            inputs=("mark",),
        )
    traces = tuple(
        at_reference_temperature(read_rig_trace(path), setup.temperature, setup.expansion * 1e-6)
        for path in paths
    )
    touches = tuple(
        with_marks(rig_touch(trace), setup.marks.get(trace.name, {})) for trace in traces
    )
    return traces, touches


def calibrate_traces(paths: Sequence[Path], setup: RigSetup = RigSetup()) -> CalibratedRig:
    """Calibrate a probe from the traces of a rig.

    Parameters
    ----------
    paths : sequence of Path
        Traces ``rig_AZIMUTH_REPEAT.csv``.
    setup : RigSetup

    Returns
    -------
    CalibratedRig

    Raises
    ------
    PretravelError
        As `read_touches_of_rig` and `calibrate_rig`.
    """
    return calibrate_touches(*read_touches_of_rig(paths, setup), setup)


def calibrate_touches(
    traces: tuple[RigTrace, ...], touches: tuple[RigTouch, ...], setup: RigSetup
) -> CalibratedRig:
    """Calibrate a probe from what `read_touches_of_rig` has read.

    Raises
    ------
    PretravelError
        As `calibrate_rig`.
    """
    return CalibratedRig(traces, touches, calibrate_rig(touches, exclude=setup.exclude), setup)
