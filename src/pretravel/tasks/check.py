"""Check a probe by a standard: touches on a calibrated sphere to figures, and their report."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy.typing as npt

from pretravel.base.errors import PretravelError
from pretravel.files.file_format import FileReadings
from pretravel.files.laboratory_file import with_laboratory_values
from pretravel.files.standard_figures import standard_json
from pretravel.laboratory.certificate import LaboratoryStatements
from pretravel.laboratory.standard_check import (
    ALONG_Z,
    DIAMETER_OF_REFERENCE,
    FORM_OF_REFERENCE,
    CalibratedSphere,
    StandardCheck,
)
from pretravel.laboratory.standards import CHECKS, LIMITS_OF, USES
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import apply
from pretravel.measurement.measured_sphere import MeasuredSphere, measured_sphere
from pretravel.qualification.own_touches import own_touches_warnings
from pretravel.show.document import Document
from pretravel.tasks.reports.laboratory_report import with_laboratory
from pretravel.tasks.reports.standards_report import standards_document

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
        Maximum permissible errors by figure, from `stated_limits`. [mm]

    Raises
    ------
    PretravelError
        A limit of a figure, or an uncertainty, that the standard does not use.

    >>> CheckSetup("iso230-10", CalibratedSphere(25.0), limits={"size": 0.002})
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: a limit of the size is only for iso10360-5; iso230-10 \
does not use it
    """

    standard: str
    sphere: CalibratedSphere
    tip_diameter: float | None = None
    axis: npt.ArrayLike = ALONG_Z
    limits: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for names, what, option in _LIMITS:
            if any(name in self.limits for name in names):
                having = [name for name, limits in LIMITS_OF.items() if limits.intersection(names)]
                self._refuse_unless_in(having, f"a limit of the {what}", option)
        sphere = self.sphere
        self._refuse_unused(
            name
            for name, value in (("u_diameter", sphere.u_diameter), ("sphere_form", sphere.form))
            if value is not None
        )

    def check_inputs(self, given: Collection[str]) -> None:
        """Refuse what does not go with the standard or its limits.

        It needs no touches: commands call it before they read them.

        Parameters
        ----------
        given : collection of str
            What there will be beside the setup: map (the touches are compensated with it), spindle
            (orientations of the spindle), ring (the reference is one).

        Raises
        ------
        PretravelError
        """
        self._refuse_unused(given)
        if "size" in self.limits and self.tip_diameter is None and "map" not in given:
            raise PretravelError(
                "a limit of the size needs a size error: give the diameter of the tip, or a map",
                inputs=("tip_diameter", "map"),
            )

    def _refuse_unused(self, given: Iterable[str]) -> None:
        for name in given:
            using = [standard for standard, used in USES.items() if name in used]
            self._refuse_unless_in(using, _INPUTS[name], name)

    def _refuse_unless_in(self, standards: Sequence[str], what: str, name: str) -> None:
        if self.standard not in standards:
            raise PretravelError(
                f"{what} is only for {' and '.join(standards)}; {self.standard} does not use it",
                inputs=(name,),
            )


_INPUTS = {
    "u_diameter": "the uncertainty of the diameter",
    "sphere_form": "the form error of the sphere",
    "map": "a map",
    "spindle": "an orientation of the spindle",
    "ring": "a ring",
}


def stated_limits(
    *,
    form: float | None = None,
    size: float | None = None,
    repeatability: float | None = None,
    offset: float | None = None,
) -> dict[str, float]:
    """The maximum permissible errors that are stated, by the figures that they are of.

    Parameters
    ----------
    form, size, repeatability, offset : float, optional
        None where it is not stated. [mm]

    Returns
    -------
    dict

    >>> stated_limits(form=0.002, repeatability=0.001)
    {'form': 0.002, 'form2d': 0.002, 'form3d': 0.002, 'repeatability': 0.001}
    """
    given = {"form": form, "form2d": form, "form3d": form}
    given |= {"size": size, "repeatability": repeatability, "offset": offset}
    return {name: limit for name, limit in given.items() if limit is not None}


_LIMITS = (
    (("form", "form2d", "form3d"), "form", "form_limit"),
    (("size",), "size", "size_limit"),
    (("repeatability",), "repeatability", "repeat_limit"),
    (("offset",), "tip's offset", "offset_limit"),
)
"""Names of figures, in words, and the input that states their limit."""

REFERENCE_INPUTS: Mapping[str, str] = {
    DIAMETER_OF_REFERENCE: "the standard uncertainty of the reference's diameter",
    FORM_OF_REFERENCE: "the form error of the reference",
}
"""What states each source of uncertainty of the reference, in words."""


def not_stated(
    result: StandardCheck, words: Mapping[str, str] = REFERENCE_INPUTS
) -> tuple[str, ...]:
    """A warning where figures have a limit and the reference has no uncertainty for them.

    Parameters
    ----------
    result : StandardCheck
    words : mapping of str to str
        How the caller names what states each source, by the sources of `REFERENCE_INPUTS`.

    Returns
    -------
    tuple of str
        One sentence, or none.
    """
    lacking = {f.u_source for f in result.figures if f.limit is not None and f.u_test is None}
    needed = " and ".join(word for source, word in words.items() if source in lacking)
    if not needed:
        return ()
    what = "the values are compared with their limits without an uncertainty zone"
    return (f"{what}, which needs {needed}",)


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
        Touches that are not those of the standard's pattern; a limit of the size without a size
        error.
    """
    setup.check_inputs(() if pretravel_map is None else ("map",))
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
