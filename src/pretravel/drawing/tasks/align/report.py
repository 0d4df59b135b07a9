"""Report of an alignment: where the part lies, with U, and what is left at its faces."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pretravel.base import DEGREE, MICROMETRE
from pretravel.drawing.alignment.alignment import MOTIONS, Alignment, points_in_part
from pretravel.drawing.features.extreme_association import TANGENT
from pretravel.drawing.features.form_of_part import UNSEEN
from pretravel.show import Column, Digits, Document, KeyFigure, Picture, Table, value_text
from pretravel.tasks.compensate import points_view

_WORST = 10
_HELD = 1e-3  # part of a motion that is not determined, from which its U is not stated
_LARGE = 0.1
"""Root mean square of the residuals from which the start may be wrong. [mm]"""


_MOVES = 1e-9  # smallest change of a motion by a touch, in mm or rad for 1 mm


def alignment_document(
    alignment: Alignment,
    *,
    touches_name: str = "",
    found_from: str = "",
    datums: Sequence[str] = (),
    warnings: Sequence[str] = (),
) -> Document:
    """The report of an alignment.

    Parameters
    ----------
    alignment : Alignment
    touches_name : str
    found_from : str
        Where the search began.
    datums : sequence of str
        As they were stated.
    warnings : sequence of str
        In addition to those that follow from the alignment.
    """
    part = alignment.part
    title = f"{touches_name}, aligned on {part.name}" if touches_name else part.name
    used = int(alignment.used.sum())
    outside = alignment.association.criterion == TANGENT
    how = f"datums {', '.join(datums)}" if datums else "best fit"
    how += " from outside the material" if outside else ""
    free = alignment.undetermined.shape[1]
    residual = value_text(alignment.scatter / MICROMETRE, "µm")
    verdict = f"{used} of {len(alignment.points)} touches, {how}: residuals {residual} (rms)" + (
        f"; {free} of 6 motions {'is' if free == 1 else 'are'} not determined" if free else ""
    )
    return Document(
        title=title,
        verdict=verdict,
        figures=(
            KeyFigure("placement", alignment.placement.typed(), remark="x,y,z,a,b,c"),
            KeyFigure("start", found_from, detail=True),
        ),
        tables=(_motions_table(alignment), _faces_table(alignment), _worst_table(alignment)),
        pictures=(
            Picture(
                "The part with the deviations of its faces, before and after compensation",
                # A touch that is left out sets no scale; the table has it.
                lambda: points_view(
                    points_in_part(alignment)[~alignment.gross], title, nominal=part
                ),
            ),
        ),
        warnings=(*warnings, *_warnings(alignment)),
        notes=(_about_u(outside=outside), *((_rests_on(alignment),) if outside else ())),
    )


def _about_u(*, outside: bool) -> str:
    form = "" if outside else " and, as far as the residuals show it, the form of the part"
    return (
        f"u of a motion contains the errors of the touches{form}, not the errors of the machine's "
        "geometry, of temperature and of clamping"
    )


def _rests_on(alignment: Alignment) -> str:
    """Touches on which datums from outside the material rest."""
    own = alignment.association
    moves = np.any(np.abs(own.response[: alignment.motions.shape[1]]) > _MOVES, axis=0)
    labels = np.array(alignment.points.labels)[np.flatnonzero(alignment.used)[moves]]
    return (
        f"the datums rest on {', '.join(labels)}: the errors of these touches move the part. "
        "Noise moves a datum out of the material on average, which U contains. The form of the "
        "part does not count as an error of such a datum"
    )


def _motions_table(alignment: Alignment) -> Table:
    """Where the part's origin lies, and the uncertainty of the motions."""
    expanded = alignment.expanded_uncertainty
    factor = np.array([1.0, 1.0, 1.0, *(3 * [DEGREE])])
    turn = alignment.placement.rotation
    free = np.vstack([turn @ alignment.undetermined[:3], turn @ alignment.undetermined[3:]])
    held = np.linalg.norm(free, axis=1) < _HELD * np.repeat([1.0, 1.0 / alignment.part.size], 3)
    stated = np.where(held, expanded / factor, math.nan)
    angles = [float(word) for word in alignment.placement.typed().split(",")]
    return Table(
        (
            Column.of("motion", MOTIONS),
            Column.of("value at the part's origin", angles, digits=Digits(5)),
            Column.of("unit", ["mm"] * 3 + ["°"] * 3),
            Column.of(
                "U at the middle of the touches",
                [*(stated[:3] / MICROMETRE), *stated[3:]],
                digits=Digits(3, True),
            ),
            Column.of("unit of U", ["µm"] * 3 + ["°"] * 3),
        ),
        title="Placement of the part in the machine: values at the part's origin",
        explanation="Shifts of the part's origin along the machine's axes, and rotations about "
        "these axes. U uses k = 2, or a larger k where few touches show the form of the faces. U "
        "of a shift is that of the middle of the touches, where it is smallest; at the origin it "
        "also contains U of the rotations times the distance from there. U is empty for a machine "
        "axis along or about which the touches leave the part free to move.",
    )


def _faces_table(alignment: Alignment) -> Table:
    faces, residuals = alignment.feet.face, alignment.residuals / MICROMETRE
    rows = []
    for index in np.unique(faces):
        mine = (faces == index) & ~alignment.gross
        if not mine.any():
            continue
        face = alignment.part.faces[int(index)]
        name = f"{face.number} {face.kind}" + (f" {face.name}" if face.name else "")
        values = residuals[mine]
        used = int(np.sum(mine & alignment.used))
        rows.append((name, len(values), used, values.mean(), values.min(), values.max()))
    names, counts, used_counts, means, lows, highs = zip(*rows, strict=True)
    return Table(
        (
            Column.of("face", names),
            Column.of("touches", counts, digits=Digits(0)),
            Column.of("used", used_counts, digits=Digits(0)),
            Column.of("mean", means, "µm", digits=Digits(2, signed=True)),
            Column.of("from", lows, "µm", digits=Digits(2, signed=True)),
            Column.of("to", highs, "µm", digits=Digits(2, signed=True)),
        ),
        title="Deviations by face",
        explanation="From the nominal face along its normal, positive outside of the part.",
    )


def _worst_table(alignment: Alignment) -> Table:
    order = np.argsort(-np.abs(alignment.residuals), kind="stable")[:_WORST]
    said = np.where(alignment.gross, "left out", np.where(alignment.used, "yes", "no"))
    return Table(
        (
            Column.of("touch", [alignment.points.labels[row] for row in order]),
            Column.of(
                "face",
                [alignment.part.faces[int(alignment.feet.face[row])].number for row in order],
                digits=Digits(0),
            ),
            Column.of(
                "deviation",
                alignment.residuals[order] / MICROMETRE,
                "µm",
                digits=Digits(2, signed=True),
            ),
            Column.of("used", [str(said[row]) for row in order]),
        ),
        title="Largest deviations",
    )


def _touches_to_look_at(alignment: Alignment) -> list[str]:
    """Gross ones, those beyond an edge, and those that no other touch checks."""
    found = []
    rows = np.flatnonzero(alignment.gross)
    if len(rows):
        named = ", ".join(
            f"{alignment.points.labels[row]} ({alignment.residuals[row] / MICROMETRE:+.0f} µm)"
            for row in rows[:_WORST]
        )
        more = "…" if len(rows) > _WORST else ""
        found.append(
            f"{len(rows)} touch{'es' if len(rows) > 1 else ''} far from the others, left out: "
            f"{named}{more}"
        )
    beyond = np.flatnonzero(~alignment.feet.inside & ~alignment.gross)
    if len(beyond):
        named = ", ".join(alignment.points.labels[row] for row in beyond[:_WORST])
        found.append(f"{len(beyond)} touches lie beyond the edge of their face: {named}")
    alone = alignment.unchecked
    if len(alone) and alignment.association.dof > 0:
        named = ", ".join(
            f"{alignment.points.labels[row]} (face "
            f"{alignment.part.faces[int(alignment.feet.face[row])].number})"
            for row in alone[:_WORST]
        )
        one = len(alone) == 1
        found.append(
            f"nothing checks {named}: the other touches of the face are too few or nearly on a "
            f"line, so one motion of the part depends on {'this touch' if one else 'each of them'} "
            f"alone. If {'it has' if one else 'one has'} a gross error, or hit "
            "another face, nothing shows this. Touch again close to it"
        )
    return found


def _wrong_tip(alignment: Alignment) -> str:
    """The diameter by which the tip seems wrong, where residuals are of one sign."""
    deviation = alignment.points.deviation
    if deviation is None:
        return ""
    middle = float(np.median(deviation[alignment.used]))
    if abs(middle) < 0.5 * alignment.scatter:
        return ""
    side = "outside" if middle > 0.0 else "inside"
    return (
        f" Most points lie {side} of the faces, by {abs(middle):.2g} mm: is the tip's diameter "
        f"{'larger' if middle > 0.0 else 'smaller'}, by {2.0 * abs(middle):.2g} mm or more?"
    )


def _warnings(alignment: Alignment) -> list[str]:
    found = [
        f"datum {name} has no motion left to fix: the datums before it fix all that its faces can. "
        "Its touches are not used"
        for name in alignment.idle_datums
    ]
    words = alignment.undetermined_motions
    if words:
        found.append(
            f"the touches do not determine: {'; '.join(words)} (in the frame of the part). These "
            "motions stay as they were at the start; touch a face that fixes them"
        )
    found += _touches_to_look_at(alignment)
    if alignment.association.dof < 1:
        found.append(
            "as many touches as motions: nothing checks the placement, and u contains a usual form "
            f"of the faces, {UNSEEN / MICROMETRE:g} µm. Touch more points"
        )
    elif alignment.scatter > _LARGE:
        found.append(
            f"the residuals are {alignment.scatter:.2g} mm (rms): is it the right part, and the "
            f"right start?{_wrong_tip(alignment)}"
        )
    elif alignment.errors.excess > 0.0:
        left = alignment.errors.excess / MICROMETRE
        found.append(
            "the residuals are larger than u of the touches explains: after u is subtracted in "
            f"quadrature, {left:.2g} µm remain. Faces may be "
            "displaced, wavy or of another size, or touches may scatter more than on the "
            f"reference. u of the placement contains these {left:.2g} µm"
        )
    found += filter(None, [alignment.pretravel_left.sentence()])
    if not alignment.errors.map_is_stated:
        found.append(
            "u contains no errors of the pretravel: the map is a prediction, or there is none"
        )
    return found
