"""What was decided of features, in words."""

from __future__ import annotations

from collections.abc import Sequence

from pretravel.base import MICROMETRE
from pretravel.drawing.features.conformity import (
    AT_TOUCHED_POINTS,
    Conformity,
    ConformityVerdict,
    conformity_words,
    verdict_words,
)
from pretravel.drawing.features.extreme_association import MINIMUM_ZONE
from pretravel.drawing.features.measured_feature import (
    MeasuredFeature,
    Quantity,
)
from pretravel.drawing.tasks.measure.lines import (
    VERDICT_LEVELS,
    ToleranceLine,
    count_words,
)
from pretravel.drawing.tolerances.tolerances import (
    InspectedFeature,
    OpenTolerance,
    Together,
    side_of_failure,
)
from pretravel.show import Judgement

_WITHOUT_MACHINE = (
    ". This is not a statement of conformity, because the uncertainty of the machine is not given"
)


def shown_name(feature: MeasuredFeature) -> str:
    """Its label, with the criterion of an extreme feature."""
    name = feature.label or feature.kind
    return f"{name} ({feature.association.criterion})" if feature.is_extreme else name


def decision_of(conformity: Conformity, u_machine: float) -> Judgement:
    """A decision in words and colour."""
    return Judgement(VERDICT_LEVELS[conformity.verdict], conformity_words(conformity, u_machine))


def judgement_of(
    features: Sequence[InspectedFeature],
    together: Sequence[Together],
    left_open: Sequence[OpenTolerance],
) -> Judgement | None:
    """The worst decision; None without a tolerance."""
    found = [(each.verdict, each.feature.errors.machine) for each in features]
    found += [(each.conformity.verdict, each.u_machine) for each in together]
    found += [(ConformityVerdict.UNDECIDED, 1.0) for _ in left_open]
    for verdict, level in VERDICT_LEVELS.items():
        machine = [u for each, u in found if each is verdict]
        if machine:
            words = verdict_words(verdict, min(machine))
            return Judgement(level, words[0].upper() + words[1:])
    return None


def verdict_of(
    features: Sequence[InspectedFeature],
    together: Sequence[Together],
    lines: Sequence[ToleranceLine],
) -> str:
    """What was found, and what it does not state."""
    lacking = any(i.verdict is not None and not i.feature.errors.machine for i in features)
    lacking = lacking or any(not each.u_machine for each in together)
    return _found(features, together, lines) + (_WITHOUT_MACHINE if lacking else "")


def _found(
    features: Sequence[InspectedFeature],
    together: Sequence[Together],
    lines: Sequence[ToleranceLine],
) -> str:
    decided = sum(len(each.conformities) for each in features)
    if len(features) == 1 and not together and len(lines) == decided:
        return _verdict_of_one(features[0])
    if not lines:
        return f"{len(features)} features"
    machines = [each.feature.errors.machine for each in features]
    machines += [each.u_machine for each in together]
    words = count_words(lines, features, min(machines, default=0.0))
    forms = any(c.of_touched_points for i in features for c in i.conformities)
    return words + ("; form is decided at the touched points only" if forms else "")


def _verdict_of_one(inspected: InspectedFeature) -> str:
    feature = inspected.feature
    count = f"{len(feature.points)} points"
    if inspected.verdict is None:
        lead = next((q for q in feature.quantities if q.name == feature.size_name), None)
        if lead is None:
            return f"{shown_name(feature)}, {count}: {_form_words(feature)}"
        return f"{shown_name(feature)}, {count}: {_value_words(lead)}"
    reasons = [
        c.name + (f": {words}" if (words := _failure_words(c, feature)) else "")
        for c in inspected.conformities
        if c.verdict is inspected.verdict
    ]
    why = "" if inspected.verdict is ConformityVerdict.CONFORMS else f" ({'; '.join(reasons)})"
    words = verdict_words(inspected.verdict, feature.errors.machine)
    value, touched = _decided_value(inspected), _touched(inspected)
    return f"{shown_name(feature)}, {count}: {words}{why}{value}{touched}"


def _value_words(quantity: Quantity) -> str:
    """A length with its U, which is 2 u or more."""
    expanded = quantity.expanded_u / MICROMETRE
    k = f"{quantity.expanded_u / quantity.u:.3g}" if quantity.u > 0.0 else "2"
    return f"{quantity.name} {quantity.value:.5f} mm, U = {expanded:.2f} µm (k = {k})"


def _form_words(feature: MeasuredFeature) -> str:
    """The form of the surface, or its bound, with the measured range."""
    if feature.association.dof < 1:
        return f"{feature.form_name} not known"
    low, high = (end / MICROMETRE for end in feature.form.interval)
    found = f"at most {high:.2f} µm" if low == 0.0 else f"{low:.2f} to {high:.2f} µm"
    zone = "minimum zone" if feature.form_by == MINIMUM_ZONE else "measured range"
    zone = f"{zone} {feature.form.measured / MICROMETRE:.2f} µm"
    if not feature.errors.map_is_stated:
        return f"{feature.form_name} not known, {zone}"
    return f"{feature.form_name}{AT_TOUCHED_POINTS} {found} (95 %), {zone}"


def _touched(inspected: InspectedFeature) -> str:
    """What a verdict on a form among others speaks of."""
    several = len(inspected.conformities) > 1
    speaks = several and any(c.of_touched_points for c in inspected.conformities)
    inside = inspected.verdict is ConformityVerdict.CONFORMS
    return f" ({inspected.feature.form_name}{AT_TOUCHED_POINTS} only)" if speaks and inside else ""


def _decided_value(inspected: InspectedFeature) -> str:
    """The one value that was compared with a tolerance, with its U; nothing for several."""
    if len(inspected.conformities) != 1:
        return ""
    conformity, feature = inspected.conformities[0], inspected.feature
    if conformity.of_touched_points:
        return f"; {_form_words(feature)}"
    found = next((q for q in inspected.stated if q.name == conformity.name), None)
    return "" if found is None else f"; {_value_words(found)}"


def _failure_words(conformity: Conformity, feature: MeasuredFeature) -> str:
    if (
        conformity.name != feature.size_name
        or conformity.verdict is not ConformityVerdict.DOES_NOT_CONFORM
    ):
        return ""
    return side_of_failure(conformity, feature.side)
