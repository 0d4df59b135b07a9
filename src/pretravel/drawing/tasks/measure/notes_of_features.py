"""Notes and warnings on measured features: what values contain, and what they do not."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import reduce
from typing import TYPE_CHECKING

from pretravel.base import DEGREE, MICROMETRE
from pretravel.drawing.features.conformity import (
    Conformity,
)
from pretravel.drawing.features.feature_uncertainty import FORM_OF_PART
from pretravel.drawing.features.measured_feature import (
    BARE_SURFACE,
    NORMALS_OFF,
    MeasuredFeature,
    normals_off,
)
from pretravel.drawing.tasks.measure.verdict_of_features import shown_name
from pretravel.drawing.tolerances.tolerances import (
    InspectedFeature,
    Together,
)
from pretravel.files import comparison_sentence
from pretravel.measurement import PretravelLeft
from pretravel.show import (
    Span,
    number_text,
    value_text,
)
from pretravel.touches import COARSE_STEP

if TYPE_CHECKING:
    from pretravel.files import LaboratoryStatements

_ASSOCIATION = (
    "fitted by least squares (Gaussian association), not as the largest inscribed "
    "or smallest circumscribed ones. The form (roundness, flatness, …) is the form of the surface "
    "at the touched points, and its bounds hold for any shape; the surface between the points is "
    "not measured. The measured range also contains the noise"
)
_FORM_BESIDE = (
    "the form (roundness, flatness, …) is the form of the surface at the touched points (its "
    "bounds hold for any shape), by the minimum zone if it is given, else from the residuals of "
    "least squares. The measured range also contains the noise. Inscribed, circumscribed and "
    "tangent features are searched near the least-squares feature; others may exist if the form "
    "is large"
)
RULE = "decisions by the default rule of"


def notes_of(
    features: Sequence[MeasuredFeature],
    conformities: Sequence[Conformity],
    statements: LaboratoryStatements | None,
) -> list[str]:
    """What the features are, what of them is form, and by which rule they were decided."""
    extreme = [f for f in features if f.is_extreme]
    fitted = [shown_name(f) for f in features if not f.is_extreme]
    which = f"{', '.join(fitted)}:" if extreme else "the features are"
    notes = [f"{which} {_ASSOCIATION}"] if fitted else []
    notes += _extreme_notes(extreme)
    lost = [f for f in features if f.association.dof > 0 and f.form.measured <= f.form.most_noise]
    if lost:
        alone = Span.of([feature.form.noise / MICROMETRE for feature in lost])
        notes.append(
            f"{', '.join(map(shown_name, lost))}: the points do not prove a form. Their errors "
            f"alone produce a range of {_range_text(alone)} on average"
        )
    rough = [feature for feature in features if feature.errors.excess > 0.0]
    if rough:
        excess = Span.of([feature.errors.excess / MICROMETRE for feature in rough])
        notes.append(
            f"{', '.join(map(shown_name, rough))}: the residuals are larger than the errors of the "
            f"points can explain. A further {_range_text(excess)} (standard deviation) is "
            f"{FORM_OF_PART}, or touches scatter more than those on the reference. u contains "
            "its effect on size and position; neighbouring points are correlated as far as the "
            "residuals show it"
        )
    notes += _of_features(features, lambda f: {f.hidden_form} - {"", *f.warnings})
    if conformities:
        first = min(conformities, key=lambda each: each.of_touched_points)
        one_limit = replace(first, dof=math.inf).coverage
        notes.append(
            f"{RULE} ISO 14253-1:2017, with a probability of {100 * first.required:g} %. The "
            f"guard band of a size is {one_limit:.3f} u if its tolerance is wide and k is 2; it is "
            "larger for narrow tolerances and larger k. Positions and forms have guard bands of "
            "their own (table of decisions). " + comparison_sentence("ISO 14253-1", statements)
        )
    return notes


def _extreme_notes(features: Sequence[MeasuredFeature]) -> list[str]:
    """On what extreme features rest, and what their u does not contain."""
    if not features:
        return []
    resting = [f"{shown_name(f)}: rests on {', '.join(f.carrying)}" for f in features]
    noise = _noise_text(features)
    amount = f"of {noise} on average" if noise else "that is not known here"
    on_points = (
        f"{'; '.join(resting)}. The other points do not move it: u of size and place is that of "
        "these points, and does not contain the form of this feature, neither at nor between the "
        "points"
    )
    one_sided = (
        "the noise of the points moves an inscribed, circumscribed or tangent feature to one side. "
        f"On a perfect surface the noise makes a range {amount}. A zone is too wide by about this "
        "range, an inscribed diameter too small and a circumscribed diameter too large by up to "
        "this range, a tangent plane or line too far outside by up to half of it. The result "
        "is not corrected for this. u contains it, less where the residuals show a form that is "
        "larger than the noise"
    )
    return [on_points, one_sided, _FORM_BESIDE]


def _noise_text(features: Sequence[MeasuredFeature]) -> str:
    """The range that noise makes on perfect surfaces; empty where it is not known."""
    if not all(feature.points.state_uncertainty for feature in features):
        return ""
    return _range_text(Span.of([feature.form.noise / MICROMETRE for feature in features]))


def notes_on_datums(
    features: Sequence[InspectedFeature], together: Sequence[Together]
) -> list[str]:
    """What the datums left free, and what a material condition added."""
    found = [each for i in features for each in i.geometric]
    if not found and not any(each.remarks for each in together):
        return []
    notes = []
    for each in found:
        name = f"{', '.join(each.labels)}, {each.tolerance.name}"
        if each.bonus > 0.0:
            notes.append(f"{name}: the size adds {each.bonus / MICROMETRE:.1f} µm to the tolerance")
        notes += [f"{name}: {remark}" for remark in each.remarks]
    notes += [f"{each.name}: {remark}" for each in together for remark in each.remarks]
    notes.append(
        "tolerances to datums: each datum feature is fitted as its line of the drawing says, and "
        "fixes the motions that earlier datums left free (ISO 5459). Motions that remain free are "
        "fitted so that the largest distance is as small as possible. U contains the errors of "
        "the datums. The zone of a surface must contain its touched points, and the zone of an "
        "axis both ends of the axis over the touched length"
    )
    return notes


def _range_text(span: Span) -> str:
    """A range in µm; one number where both ends are shown alike."""
    alike = number_text(span.low) == number_text(span.high)
    return value_text(span.low if alike else span, "µm")


def _coarse(features: Sequence[MeasuredFeature]) -> list[str]:
    """What to know of coordinates in coarse steps."""
    step = max(0.0 if each.errors.rounded is None else each.points.step for each in features)
    if step < COARSE_STEP:
        return []
    return [
        (
            f"the coordinates are in steps of {step / MICROMETRE:.4g} µm, which U contains: points "
            "can be rounded alike. Write the coordinates with more digits"
        )
    ]


_OTHER_NORMALS = 20.0 * DEGREE
"""No centre is expected so wrongly: in a bore of 20 mm it would be 3 mm off. [rad]"""
_OTHER_CENTRE = (
    "as happens with a wrong expected centre: the tip touched next to these points. Compensate "
    "again with the normals of fitted features, or with touches without normals"
)
_OTHER_FEATURE = (
    "too much for a wrong expected centre: were these touches made on another feature, such as the "
    "walls of a slot?"
)


def warnings_of(features: Sequence[MeasuredFeature]) -> list[str]:
    """What is missing in the uncertainties, normals off their feature, features without a form."""
    warnings = []
    if not all(feature.points.state_uncertainty for feature in features):
        warnings.append(
            "the points have no uncertainty: u follows from their scatter about the feature "
            "alone. u does not contain their common errors: those of the probe (pretravel, tip) "
            "and of the machine. Form and noise are not distinguished. No tolerance is decided"
        )
        warnings += _coarse(features)
    elif not all(feature.errors.correlation_known for feature in features):
        warnings.append(
            "the points do not say which errors they have in common (columns shared_…_um, which "
            "files of older versions lack): u is the largest that any correlation allows"
        )
    elif not all(feature.errors.map_is_stated for feature in features):
        warnings.append(
            "the map of these points has no uncertainty (a prediction): the "
            "difference between the described probe and yours is not in u, and no tolerance is "
            "decided. Qualify the probe"
        )
    if any(
        feature.uncompensated is None
        and feature.points.state_uncertainty
        and feature.kind != BARE_SURFACE
        for feature in features
    ):
        warnings.append("the file contains neither uncompensated points nor their pretravel")
    elif any(feature.uncompensated_is_rebuilt for feature in features):
        warnings.append(
            "the file contains no uncompensated points: they are the compensated ones moved back "
            "by their pretravel along the normal, without delay travel or oblique approach"
        )
    warnings.extend(
        f"{shown_name(feature)}: the normals of the points are "
        f"{normals_off(feature) / DEGREE:.1f}° off those of the feature (root mean square), "
        + (_OTHER_FEATURE if normals_off(feature) > _OTHER_NORMALS else _OTHER_CENTRE)
        for feature in features
        if normals_off(feature) > NORMALS_OFF
    )
    warnings.extend(
        f"{shown_name(feature)}: {len(feature.points)} points determine it exactly, so its form is "
        "not known, and a gross error would not be seen"
        for feature in features
        if feature.association.dof < 1
    )
    warnings.extend(_of_features(features, lambda feature: feature.warnings))
    return warnings + _of_another_map(features)


def _of_another_map(features: Sequence[MeasuredFeature]) -> list[str]:
    """Residuals that follow the pretravel, of all features together or else of single ones."""
    left = {shown_name(feature): feature.pretravel_left for feature in features}
    left = {name: own for name, own in left.items() if own.dof}
    said = reduce(PretravelLeft.joined, left.values(), PretravelLeft()).sentence()
    if said:
        return [f"{', '.join(left)}: {said}"]
    return [f"{name}: {said}" for name, own in left.items() if (said := own.sentence())]


def _of_features(
    features: Sequence[MeasuredFeature], texts: Callable[[MeasuredFeature], Iterable[str]]
) -> list[str]:
    """The texts on features; one that several features have is one line with their names."""
    alike: dict[str, list[str]] = {}
    for feature in features:
        for text in texts(feature):
            alike.setdefault(text, []).append(shown_name(feature))
    each = (", ".join(names) + (", each" if len(names) > 1 else "") for names in alike.values())
    return [f"{named}: {text}" for named, text in zip(each, alike, strict=True)]
