"""The tolerances of a drawing that several features decide: to datums, of patterns, between."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, PretravelError
from pretravel.drawing.features.between_features import relations_between
from pretravel.drawing.features.conformity import size_conformity
from pretravel.drawing.features.measured_feature import FORM_NAMES, SIZE_NAMES, Quantity
from pretravel.drawing.tasks.measure.settings_of_features import StatedSettings
from pretravel.drawing.tolerances.features_file import Drawing, DrawnFeature, DrawnRelation
from pretravel.drawing.tolerances.geometric_tolerances import inspect_geometry, nominal_of_part
from pretravel.drawing.tolerances.tolerance_frame import (
    GeometricResult,
    GeometricTolerance,
    PlacedFeature,
)
from pretravel.drawing.tolerances.tolerances import (
    InspectedFeature,
    OpenTolerance,
    Together,
    decided_if_known,
    is_far_from_nominal,
    refuse_other_nominal,
    refuse_other_unit,
)
from pretravel.surface import Part

_SAME_PLACE = 1.0  # mm


@dataclass
class DrawnFeatures:
    """The measured features of a drawing, and what of it is still open.

    Attributes
    ----------
    task : StatedSettings
        With the settings of the whole drawing.
    drawing : Drawing
    tasks : mapping of str to StatedSettings
        Of each feature by its name.
    found : dict of str to InspectedFeature
        By name; a feature that could not be measured is not in it.
    reasons : dict of str to str
        Why a feature could not be measured.
    part : Part or None
        Whose faces are the nominal places that the drawing leaves out.
    """

    task: StatedSettings
    drawing: Drawing
    tasks: Mapping[str, StatedSettings]
    found: dict[str, InspectedFeature]
    reasons: dict[str, str]
    part: Part | None = None
    open: list[OpenTolerance] = field(default_factory=list)

    def decide(self) -> tuple[tuple[InspectedFeature, ...], tuple[Together, ...]]:
        """The features with their tolerances to datums, and the decisions about several features.

        What cannot be decided is in `open` afterwards.
        """
        try:
            _refuse_same_touches(self.found, self.tasks)
        except PretravelError as error:
            raise PretravelError(f"{self.task.drawing}: {error}") from None
        placed = {
            row.name: _placed(self.found[row.name], self.tasks[row.name], row.nominal, self.part)
            for row in self.drawing.feature
            if row.name in self.found
        }
        inspected = []
        for row in self.drawing.feature:
            if row.name not in self.found:
                self._leave_open(row)
                continue
            results = [self._to_datums(row, one, placed) for one in row.geometric]
            decided = [result for result in results if result is not None]
            own = self.found[row.name]
            inspected.append(own.with_geometric(decided) if decided else own)
        together = [self._pattern(index, placed) for index in range(len(self.drawing.pattern))]
        together += [self._between(row, placed) for row in self.drawing.between]
        self.open += [
            OpenTolerance((one.feature,), one.characteristic, one.ends, one.reason, False)
            for one in self.drawing.not_decided
        ]
        return tuple(inspected), tuple(each for each in together if each is not None)

    def _to_datums(
        self, row: DrawnFeature, one: GeometricTolerance, placed: Mapping[str, PlacedFeature]
    ) -> GeometricResult | None:
        reason = self._lacking(_letters(one.datums))
        if not reason:
            try:
                return inspect_geometry([placed[row.name]], one, placed, self.task.probability)
            except PretravelError as error:
                if not row.faces:
                    raise PretravelError(f"{self.task.drawing}: {row.name}: {error}") from None
                reason = str(error)
        self.open.append(OpenTolerance((row.name,), one.name, (0.0, one.zone), reason))
        return None

    def _leave_open(self, row: DrawnFeature) -> None:
        """All tolerances of a feature that could not be measured."""
        reason = self.reasons[row.name]
        rows: list[tuple[str, tuple[float, float]]] = []
        limits = self.tasks[row.name].tolerances().size
        if limits is not None:
            rows.append((SIZE_NAMES.get(row.kind, "diameter"), limits))
        if row.position_tolerance is not None:
            rows.append(("position", (0.0, row.position_tolerance)))
        if row.form_tolerance is not None:
            rows.append((FORM_NAMES.get(row.kind, "form"), (0.0, row.form_tolerance)))
        rows += [(one.name, (0.0, one.zone)) for one in row.geometric]
        self.open += [OpenTolerance((row.name,), name, ends, reason) for name, ends in rows]

    def _by_face(self, names: Iterable[str]) -> bool:
        """Whether the touches of these features are chosen by faces."""
        rows = {row.name: row for row in self.drawing.feature}
        return all(rows[name].faces for name in names)

    def _lacking(self, names: Iterable[str]) -> str:
        """Why features that a tolerance needs are not there; empty where all are."""
        lost = [name for name in names if name in self.reasons]
        return f"{lost[0]}: {self.reasons[lost[0]]}" if lost else ""

    def _pattern(self, index: int, placed: Mapping[str, PlacedFeature]) -> Together | None:
        pattern = self.drawing.pattern[index]
        reason = self._lacking([*pattern.features, *_letters(pattern.datums)])
        if reason:
            ends = (0.0, pattern.position_tolerance)
            self.open.append(OpenTolerance(pattern.features, pattern.tolerance.name, ends, reason))
            return None
        members = [placed[name] for name in pattern.features]
        try:
            result = inspect_geometry(members, pattern.tolerance, placed, self.task.probability)
        except PretravelError as error:
            if not self._by_face(pattern.features):
                raise PretravelError(f"{self.task.drawing}: {pattern.label}: {error}") from None
            ends = (0.0, pattern.position_tolerance)
            self.open.append(
                OpenTolerance(pattern.features, pattern.tolerance.name, ends, str(error))
            )
            return None
        decided = decided_if_known(result.conformity, members[0].feature)
        fitted = f"{result.free} motions that the datums leave free were fitted"
        remarks = (*result.remarks, *((fitted,) if result.free else ()))
        return Together(
            tuple(pattern.features),
            result.quantity,
            decided,
            self.task.u_machine_um * MICROMETRE,
            remarks,
            pattern.tolerance.name,
        )

    def _between(self, row: DrawnRelation, placed: Mapping[str, PlacedFeature]) -> Together | None:
        limits = _limits_between(self.task, row)
        reason = self._lacking(row.features)
        if reason:
            self.open.append(OpenTolerance(row.features, row.quantity, limits, reason))
            return None
        both = [placed[name].feature for name in row.features]
        found = [
            each.quantity for each in relations_between(both) if each.quantity.name == row.quantity
        ]
        if not found:
            reason = (
                f"{' and '.join(row.features)} have no {row.quantity} (features that are not "
                "parallel have no distance, and centres no angle)"
            )
            if not self._by_face(row.features):
                raise PretravelError(f"{self.task.drawing}: {reason}")
            self.open.append(OpenTolerance(row.features, row.quantity, limits, reason))
            return None
        quantity, scale = found[0], DEGREE if row.quantity == "angle" else 1.0
        if row.quantity == "angle":
            quantity = _as_drawn(quantity, row, limits)
        else:
            names = " and ".join(row.features)
            refuse_other_unit(f"{names}: {quantity.name}", quantity.value, limits)
        decided = size_conformity(
            quantity.name,
            quantity.value,
            quantity.u,
            (limits[0] * scale, limits[1] * scale),
            self.task.probability,
            dof=quantity.dof,
        )
        return Together(
            row.features,
            quantity,
            decided_if_known(decided, both[0]),
            self.task.u_machine_um * MICROMETRE,
            _far_from_limits(quantity, limits, scale),
        )


def _far_from_limits(
    quantity: Quantity, limits: tuple[float, float], scale: float
) -> tuple[str, ...]:
    """That a distance or an angle cannot be the one that is meant."""
    value = quantity.value / scale
    nearest = max(limits[0], min(limits[1], value))
    if not math.isfinite(nearest) or not is_far_from_nominal(nearest, value):
        return ()
    unit = "°" if quantity.angle else "mm"
    said = f"the {quantity.name} is {abs(value - nearest):.3f} {unit} outside its limits"
    return (f"{said}: are these its features, and was the tip radius subtracted once?",)


def _refuse_same_touches(
    found: Mapping[str, InspectedFeature], tasks: Mapping[str, StatedSettings]
) -> None:
    """Refuse features at different places that have the same touches: one selection is wrong."""
    known: dict[bytes, str] = {}
    for name, own in found.items():
        at = tasks[name].at
        if at is None:
            continue
        other = known.setdefault(own.feature.points.positions.tobytes(), name)
        apart = np.subtract(at, tasks[other].at or at)
        away = float(np.linalg.norm(own.feature.association.located_along @ apart))
        if away > _SAME_PLACE:
            raise PretravelError(
                f"{other} and {name} have the same touches, and their places (at_mm) are "
                f"{away:.4g} mm apart: correct select or faces of one of them"
            )


def _as_drawn(quantity: Quantity, row: DrawnRelation, limits: tuple[float, float]) -> Quantity:
    """The angle, or what it lacks of 180°: the one that is nearer to the drawing's.

    That of the outward normals of two planes is 120° where the material has 60°.
    """
    known = [each for each in limits if math.isfinite(each)]
    drawn = DEGREE * (sum(known) / len(known) if row.nominal is None else row.nominal)
    other = math.pi - quantity.value
    if abs(other - drawn) >= abs(quantity.value - drawn):
        return quantity
    before = quantity.uncompensated
    return replace(
        quantity, value=other, uncompensated=None if before is None else math.pi - before
    )


def _letters(words: Sequence[str]) -> list[str]:
    """The features of datums: of ``A``, ``B-C`` and ``D(M)``."""
    return [name for word in words for name in word.replace("(M)", "").replace(" ", "").split("-")]


def _limits_between(task: StatedSettings, row: DrawnRelation) -> tuple[float, float]:
    """The limits of a distance or an angle. [mm or degrees]"""
    try:
        limits = task.limits_of(row.tolerance, row.nominal)
        refuse_other_nominal(row.nominal, limits, "°" if row.quantity == "angle" else " mm")
        return limits
    except PretravelError as error:
        names = " and ".join(row.features)
        raise PretravelError(f"{task.drawing}: {names}: {error}") from None


def _placed(
    inspected: InspectedFeature, task: StatedSettings, size: float | None, part: Part | None
) -> PlacedFeature:
    """A feature with its nominal place: stated, or that of the faces beneath its points."""
    limits = task.tolerances().size
    if size is None and limits is not None and math.isfinite(limits[0] + limits[1]):
        size = 0.5 * (limits[0] + limits[1])
    at, axis = (None if each is None else np.array(each) for each in (task.at, task.axis))
    stated = PlacedFeature(inspected.feature, at, axis, size, limits, part)
    return stated if part is None else nominal_of_part(stated, part)
