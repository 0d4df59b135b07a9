"""Check a probe by a standard: touches on a calibrated sphere to figures, and their report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy.typing as npt

from pretravel.compensation.compensation import apply
from pretravel.compensation.measured_sphere import MeasuredSphere, measured_sphere
from pretravel.errors import PretravelError
from pretravel.formats.file_format import FileReadings
from pretravel.formats.laboratory_file import with_laboratory_values
from pretravel.formats.standard_figures import standard_json
from pretravel.laboratory.certificate import LaboratoryStatements
from pretravel.laboratory.standard_check import ALONG_Z, CalibratedSphere, StandardCheck
from pretravel.laboratory.standards import CHECKS
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.qualification.own_touches import own_touches_warnings
from pretravel.report.document import Document
from pretravel.report.laboratory_report import with_laboratory
from pretravel.report.standards_report import standards_document

_ON_ITS_OWN_TOUCHES = (
    "on its own touches a map looks better than it is, because it follows a part of their "
    "scatter. Check it on new touches"
)


@dataclass(frozen=True)
class CheckSetup:
    """What a check knows beside the touches.

    Attributes
    ----------
    standard : str
        A name of `CHECKS`.
    sphere : CalibratedSphere
    tip_diameter : float or None
        Effective diameter of the tip, for the size error. [mm]
    axis : (3,) float
        Of the probe.
    limits : mapping of str to float
        Maximum permissible errors by figure: form, size, repeatability, … [mm]
    """

    standard: str
    sphere: CalibratedSphere
    tip_diameter: float | None = None
    axis: npt.ArrayLike = ALONG_Z
    limits: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class CheckedProbe:
    """The figures of a standard with the touches that they come from.

    Attributes
    ----------
    readings : FileReadings
    result : StandardCheck
    sphere : MeasuredSphere or None
        Through all touches, compensated; None without a map.
    warnings : tuple of str
        Of readings and map.
    """

    readings: FileReadings
    result: StandardCheck
    sphere: MeasuredSphere | None
    warnings: tuple[str, ...] = ()

    def document(
        self,
        touches_name: str = "",
        *,
        warnings: Sequence[str] = (),
        statements: LaboratoryStatements | None = None,
    ) -> Document:
        """The report, with what the laboratory states."""
        report = standards_document(
            self.result,
            touches_name=touches_name,
            sphere=self.sphere,
            warnings=[*self.warnings, *warnings],
        )
        return with_laboratory(report, statements)

    def values(
        self, *, warnings: Sequence[str] = (), statements: LaboratoryStatements | None = None
    ) -> dict[str, Any]:
        """The figures for JSON, with what the laboratory states."""
        found = standard_json(self.result, self.sphere, [*self.warnings, *warnings])
        return with_laboratory_values(found, statements)


def check_probe(
    readings: FileReadings, setup: CheckSetup, pretravel_map: PretravelMap | None = None
) -> CheckedProbe:
    """Determine the figures of a standard.

    Parameters
    ----------
    readings : FileReadings
        From `read_series`, in the axes of the machine.
    setup : CheckSetup
    pretravel_map : PretravelMap, optional
        The touches are compensated with it.

    Returns
    -------
    CheckedProbe

    Raises
    ------
    PretravelError
        Touches that are not those of the standard's pattern; a limit of a figure that the standard
        or these inputs do not give.
    """
    _refuse_limits(setup, pretravel_map)
    measured = readings.touches
    result = CHECKS[setup.standard](
        measured,
        setup.sphere,
        tip_diameter=setup.tip_diameter,
        pretravel_map=pretravel_map,
        axis=setup.axis,
        limits=setup.limits,
    )
    warnings, sphere = list(readings.notes()), None
    if pretravel_map is not None:
        sphere = measured_sphere(measured, apply(measured, pretravel_map), pretravel_map)
        warnings += own_touches_warnings(measured, pretravel_map, _ON_ITS_OWN_TOUCHES)
    return CheckedProbe(readings, result, sphere, tuple(warnings))


def _refuse_limits(setup: CheckSetup, pretravel_map: PretravelMap | None) -> None:
    if setup.standard == "iso10360-5" and "repeatability" in setup.limits:
        raise PretravelError(
            "a limit of the repeatability is only for iso230-10; iso10360-5 has no repeats",
            inputs=("repeat_limit",),
        )
    if setup.standard == "iso230-10" and (
        "size" in setup.limits or setup.sphere.u_diameter is not None
    ):
        raise PretravelError(
            "a limit of the size and the uncertainty of the diameter are only for iso10360-5",
            inputs=("size_limit", "u_diameter"),
        )
    if "size" in setup.limits and setup.tip_diameter is None and pretravel_map is None:
        raise PretravelError(
            "a limit of the size needs a size error: give the diameter of the tip, or a map",
            inputs=("tip_diameter", "map"),
        )
