"""The tolerances of a drawing as rows of a table that a person edits; nothing touches a page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

from pretravel.base import PretravelError
from pretravel.drawing.features.measured_feature import FORM_NAMES, SIZE_NAMES
from pretravel.drawing.tolerances.features_file import (
    Drawing,
    DrawnFeature,
    DrawnPattern,
    DrawnRelation,
    NotDecided,
    face_name,
)
from pretravel.drawing.tolerances.tolerance_frame import (
    POSITION,
    TOLERANCE_KINDS,
    GeometricTolerance,
)
from pretravel.surface import Part

ROW_NONE, ROW_SIZE, ROW_FORM, ROW_DISTANCE, ROW_ANGLE = "", "size", "form", "distance", "angle"
OWN_POSITION = "position in the part"
"""A position without datums, to the nominal place of the feature."""
ROW_NOT_DECIDED = "not decided"
"""A tolerance of the drawing that is not decided here: it has its line in the answer."""
CHARACTERISTICS = (
    ROW_NONE,
    ROW_SIZE,
    ROW_FORM,
    OWN_POSITION,
    *TOLERANCE_KINDS,
    ROW_DISTANCE,
    ROW_ANGLE,
    ROW_NOT_DECIDED,
)
"""What a row can state; none: a datum without a tolerance."""


@dataclass(frozen=True)
class ToleranceRow:
    """One row: a tolerance, or a feature that is a datum alone.

    Attributes
    ----------
    feature : str
        Label; labels with commas of a pattern, and of a distance or an angle.
    characteristic : str
        Of `CHARACTERISTICS`.
    limits : str
        As it is typed: ``11.95..12.05``, ``0.02``.
    datums : str
        ``A|B|C(M)``.
    material : str
    faces : tuple of int
        Of a feature that no other row states before.
    stated : mapping of str to value
        What else the drawing states of the feature: kind, select, at, axis, nominal, …; of what is
        not decided, its characteristic and the reason.
    frame : mapping of str to value
        What else it states of the tolerance: offset, between, instead_of, remark, tangent.
    """

    feature: str
    characteristic: str = ROW_NONE
    limits: str = ""
    datums: str = ""
    material: str = ""
    faces: tuple[int, ...] = ()
    stated: dict[str, Any] = field(default_factory=dict)
    frame: dict[str, Any] = field(default_factory=dict)

    def with_typed(
        self, name: Literal["characteristic", "limits", "datums"], text: str
    ) -> ToleranceRow:
        """The row after a person typed one of its words."""
        if name == "characteristic":
            return replace(self, characteristic=text)
        return replace(self, limits=text) if name == "limits" else replace(self, datums=text)

    def called(self, kind: str) -> str:
        """The characteristic as a line calls it, for a kind of feature: flatness, a diameter."""
        if self.characteristic == ROW_SIZE:
            return SIZE_NAMES.get(kind, "diameter")
        if self.characteristic == ROW_FORM:
            return FORM_NAMES.get(kind, "form")
        if self.characteristic == OWN_POSITION:
            return POSITION
        if self.characteristic in (ROW_DISTANCE, ROW_ANGLE):
            return self.characteristic
        if self.characteristic == ROW_NOT_DECIDED:
            return str(self.stated.get("characteristic", ""))
        try:
            return self.tolerance.name
        except PretravelError:  # as long as a person types
            return self.characteristic

    @property
    def datum_words(self) -> tuple[str, ...]:
        """The datums one by one."""
        return tuple(word.strip() for word in self.datums.split("|") if word.strip())

    @property
    def tolerance(self) -> GeometricTolerance:
        """The tolerance to datums that the row states.

        Raises
        ------
        PretravelError
            Limits that are not numbers, or what contradicts the characteristic.
        """
        return GeometricTolerance(
            self.characteristic, _zone(self), self.datum_words, self.material, **_typed(self.frame)
        )


_OF_FRAME = ("offset", "between", "instead_of", "remark", "tangent")
_STATED = ("kind", "select", "association", "axis", "at", "nominal", "form_association", "targets",
           "target_lines")  # fmt: skip


def rows_of(drawing: Drawing) -> list[ToleranceRow]:
    """The rows of a drawing, each tolerance in one; a datum without a tolerance has one, too."""
    rows = []
    for each in drawing.feature:
        stated = {name: getattr(each, name) for name in _STATED if getattr(each, name)}
        own = [ToleranceRow(each.name, ROW_SIZE, each.tolerance)] if each.tolerance else []
        if each.form_tolerance is not None:
            own.append(ToleranceRow(each.name, ROW_FORM, f"{each.form_tolerance:.10g}"))
        if each.position_tolerance is not None:
            own.append(ToleranceRow(each.name, OWN_POSITION, f"{each.position_tolerance:.10g}"))
        own += [
            ToleranceRow(
                each.name,
                g.kind,
                f"{g.zone:.10g}",
                "|".join(g.datums),
                g.material,
                frame=_frame_of(g),
            )
            for g in each.geometric
        ]
        first, *others = own or [ToleranceRow(each.name)]
        rows += [replace(first, faces=each.faces, stated=stated), *others]
    rows += [
        ToleranceRow(", ".join(p.features), POSITION, f"{p.position_tolerance:.10g}",
                     "|".join(p.datums), p.material, frame=_frame_of(p.tolerance))
        for p in drawing.pattern
    ]  # fmt: skip
    rows += [
        ToleranceRow(one.feature, ROW_NOT_DECIDED, one.limits,
                     stated={"characteristic": one.characteristic, "reason": one.reason})
        for one in drawing.not_decided
    ]  # fmt: skip
    rows += [
        ToleranceRow(", ".join(b.features), b.quantity, b.tolerance,
                     stated={} if b.nominal is None else {"nominal": b.nominal})
        for b in drawing.between
    ]  # fmt: skip
    return rows


def _frame_of(tolerance: GeometricTolerance) -> dict[str, Any]:
    return {name: getattr(tolerance, name) for name in _OF_FRAME if getattr(tolerance, name)}


def drawing_of(rows: Sequence[ToleranceRow]) -> Drawing:
    """The drawing that rows state.

    Raises
    ------
    PretravelError
        A row that contradicts another one, or whose limits are not numbers, with its feature.
    """
    features: dict[str, DrawnFeature] = {}
    not_decided = tuple(
        NotDecided(row.feature, row.called(""), str(row.stated.get("reason", "")), row.limits)
        for row in rows if row.characteristic == ROW_NOT_DECIDED
    )  # fmt: skip
    rows = [row for row in rows if row.characteristic != ROW_NOT_DECIDED]
    for row in rows:
        if "," not in row.feature and (row.faces or row.stated):
            features.setdefault(
                row.feature, DrawnFeature(label=row.feature, faces=row.faces, **_typed(row.stated))
            )
    patterns: list[DrawnPattern] = []
    between: list[DrawnRelation] = []
    for row in rows:
        names = tuple(name.strip() for name in row.feature.split(","))
        if row.characteristic in (ROW_DISTANCE, ROW_ANGLE):
            if len(names) != 2:
                raise PretravelError(f"{row.feature}: a {row.characteristic} needs two features")
            nominal = row.stated.get("nominal")
            between.append(
                DrawnRelation((names[0], names[1]), row.limits, row.characteristic, nominal)
            )
        elif len(names) > 1:
            label = f"pattern{len(patterns) + 1}"
            frame = {name: v for name, v in _typed(row.frame).items() if name != "offset"}
            patterns.append(
                DrawnPattern(label, names, _zone(row), row.datum_words, row.material, **frame)
            )
        elif names[0] not in features:
            raise PretravelError(f"{row.feature}: no row gives its faces")
        else:
            features[names[0]] = _with(features[names[0]], row)
    return Drawing(tuple(features.values()), tuple(patterns), tuple(between), not_decided)


def _typed(stated: dict[str, Any]) -> dict[str, Any]:
    """Values as the types have them: a stored row has lists for tuples."""

    def typed(value: Any) -> Any:
        return tuple(map(typed, value)) if isinstance(value, list) else value

    return {name: typed(value) for name, value in stated.items()}


def _zone(row: ToleranceRow) -> float:
    try:
        return float(row.limits.strip().replace(",", "."))
    except ValueError:
        raise PretravelError(
            f"{row.feature}, {row.characteristic}: the width of the zone is a number in mm, not "
            f"'{row.limits}'"
        ) from None


def _with(feature: DrawnFeature, row: ToleranceRow) -> DrawnFeature:
    if row.characteristic == ROW_NONE or not row.limits.strip():
        return feature
    taken = {
        ROW_SIZE: feature.tolerance, ROW_FORM: feature.form_tolerance,
        OWN_POSITION: feature.position_tolerance,
    }.get(row.characteristic)  # fmt: skip
    if taken is not None:
        raise PretravelError(f"{row.feature}: two rows give its {row.characteristic}")
    if row.characteristic == ROW_SIZE:
        return replace(feature, tolerance=row.limits)
    if row.characteristic == ROW_FORM:
        return replace(feature, form_tolerance=_zone(row))
    if row.characteristic == OWN_POSITION:
        return replace(feature, position_tolerance=_zone(row))
    return replace(feature, geometric=(*feature.geometric, row.tolerance))


def rows_of_faces(part: Part, touched: Sequence[int]) -> list[ToleranceRow]:
    """A row for each touched face that can be measured, to fill in.

    Parameters
    ----------
    part : Part
    touched : sequence of int
        Numbers of faces.
    """
    from pretravel.drawing.tolerances.drawing_on_part import MEASURED_FACES

    return [
        ToleranceRow(
            face_name([face.number]),
            ROW_FORM if face.kind == "plane" else ROW_SIZE,
            faces=(face.number,),
            stated={"kind": face.kind},
        )
        for face in part.faces
        if face.number in touched and face.kind in MEASURED_FACES
    ]


def stored(rows: Sequence[ToleranceRow]) -> str:
    """Rows as one text of a project."""
    names = [each.name for each in fields(ToleranceRow)]
    return json.dumps([{name: getattr(row, name) for name in names} for row in rows])


def restored(text: str) -> list[ToleranceRow]:
    """The rows of a text; none where it is not one of `stored`."""
    try:
        found = json.loads(text or "[]")
        return [ToleranceRow(**{**row, "faces": tuple(row["faces"])}) for row in found]
    except (ValueError, TypeError, KeyError, RecursionError):
        return []
