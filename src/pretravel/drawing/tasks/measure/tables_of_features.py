"""Tables of measured features, for people and for programs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray
from pretravel.drawing.features.between_features import FeatureRelation, covariance_of_positions
from pretravel.drawing.features.conformity import (
    Conformity,
    ConformityVerdict,
    conformity_words,
    verdict_words,
)
from pretravel.drawing.features.extreme_association import MINIMUM_ZONE
from pretravel.drawing.features.feature_results import features_table, residuals_table
from pretravel.drawing.features.feature_trials import QuantityByTrials
from pretravel.drawing.features.feature_uncertainty import PLACES_ON_DATUMS
from pretravel.drawing.features.measured_feature import (
    MEASURED_RANGE,
    MeasuredFeature,
    Quantity,
)
from pretravel.drawing.tasks.measure.lines import is_one_sided
from pretravel.drawing.tasks.measure.verdict_of_features import shown_name
from pretravel.drawing.tolerances.tolerances import (
    InspectedFeature,
    Together,
)
from pretravel.show import (
    Column,
    KeyFigure,
    Section,
    Table,
    by_uncertainty,
    decimals,
    number_text,
)
from pretravel.uncertainty import COVERAGE_FACTOR

_MOST_COVARIANCES = 50  # features
_UNKNOWN_U = 1e-3  # mm; of points whose u is not stated
_BETWEEN = "Between features"
_COMMON = (
    "Distances are those of centres (across parallel axes) or of parallel planes and lines; angles "
    "those of normals, axes or lines. u contains the errors that both features have in common, as "
    "far as these change the distance."
)
_CORRECTED = (
    "A distance near zero (position, coaxiality, orientation of an axis) is corrected for noise. "
    "The table shows the corrected value, and the decision uses the uncorrected one; the guard and "
    "rejection bands are those of a value exactly at the limit. "
)
_EXPLAINED = (
    "Value 0: the errors of the points alone can explain the measured value; 'at most' in the "
    "table of quantities is the upper bound of the true value. "
)
_SCALED = (
    "u of a distance near zero is half of the difference between its value and the farther bound "
    "of the interval. "
    "Its sources are multiplied by one factor, so that together they give this u. "
)
_TILTED = (
    "Places of the touches on tilted datums: a datum face is fitted at its nominal angle to the "
    "datums before it; if its real angle differs, the datum depends on where the face is touched. "
    "Touch such a face around its middle. "
)
BOUNDS = ("at least (95 %)", "at most (95 %)")
TRIALS = "By Monte Carlo"
"""Title of the table of trials."""


def lengths_table(
    rows: Sequence[tuple[str, Quantity]], explanation: str, title: str = "", *, given: bool = False
) -> Table:
    """Quantities with their uncertainties, before and after compensation."""
    plain = [math.nan if q.uncompensated is None else q.uncompensated for _, q in rows]
    # A form below the errors of the points has a bound alone.
    bound = np.array([math.nan if _is_bound(q) else 1.0 for _, q in rows])
    values = bound * [q.value for _, q in rows]
    change = (values - plain) / MICROMETRE
    u = bound * [q.u / MICROMETRE for _, q in rows]
    # The bounds of a value without a lower one are not the value plus and minus U.
    expanded = np.array(
        [math.nan if is_one_sided(q) else q.expanded_u / MICROMETRE for _, q in rows]
    )
    by_u = _by_uncertainties(rows)
    in_mm = tuple(by_uncertainty(each) for each in by_u)
    of_change = tuple(by_uncertainty(each / MICROMETRE, signed=True) for each in by_u)
    of_u, of_expanded = (tuple(map(by_uncertainty, values)) for values in (u, expanded))
    return Table(
        (
            Column.of("feature", [name for name, _ in rows]),
            Column.of("quantity", [quantity.name for _, quantity in rows]),
            *(
                (Column.of("of the given points", values, "mm", in_mm),)
                if given
                else (
                    Column.of("uncompensated", plain, "mm", in_mm),
                    Column.of("compensated", values, "mm", in_mm),
                    Column.of("change", change, "µm", of_change),
                )
            ),
            Column.of("u", u, "µm", of_u),
            Column.of("U (95 %)", expanded, "µm", of_expanded),
            *(
                Column.of(name, [_end(q, index) for _, q in rows], "mm", in_mm)
                for index, name in enumerate(BOUNDS)
                if any(q.ends and (index or q.ends[0] > 0.0) for _, q in rows)
            ),
        ),
        title=title,
        explanation=explanation,
    )


def _by_uncertainties(rows: Sequence[tuple[str, Quantity]]) -> list[float]:
    """By which u each row is rounded: its own, or a tenth of the least of its feature.

    The latter of what was read off, as a range: one digit more.
    """
    own = [q.u if q.u > 0.0 or q.ends is None else q.ends[1] / COVERAGE_FACTOR for _, q in rows]
    least: dict[str, float] = {}
    for (name, _), u in zip(rows, own, strict=True):
        if u > 0.0:
            least[name] = min(u, least.get(name, u))
    return [
        u if u > 0.0 else 0.1 * least.get(name, _UNKNOWN_U)
        for (name, _), u in zip(rows, own, strict=True)
    ]


def _is_bound(quantity: Quantity) -> bool:
    """Whether the points do not show the form, so that only its upper bound is known."""
    return quantity.ends is not None and quantity.ends[0] <= 0.0 and quantity.value <= 0.0


def _is_near_zero(quantity: Quantity) -> bool:
    """Whether u is that of bounds that are not equally far from the value."""
    if quantity.ends is None:
        return False
    low, high = quantity.ends
    return not math.isclose(quantity.value - low, high - quantity.value, rel_tol=1e-6)


def _end(quantity: Quantity, index: int) -> float:
    """Of the interval of a form, which is not the value plus and minus U."""
    none = quantity.ends is None or (index == 0 and is_one_sided(quantity))
    return math.nan if none or quantity.ends is None else quantity.ends[index]


def results_table(features: Sequence[InspectedFeature], together: Sequence[Together]) -> Table:
    """All lengths of features, and of several together."""
    rows = [(shown_name(i.feature), quantity)
            for i in features for quantity in i.stated if not quantity.angle]  # fmt: skip
    known = ("distance", "angle")  # in the table between features
    rows += [(each.name, each.quantity) for each in together if each.quantity.name not in known]
    return lengths_table(
        rows,
        explanation="Uncompensated: with the tip radius alone. u: standard uncertainty of the "
        "compensated value. U = k u, with k = 2, or larger if u has few degrees of freedom (few "
        "residuals). A form (at the touched points), and a deviation that is never negative, such "
        "as position or coaxiality, have 95 % bounds, 'at least' and 'at most'; U is the "
        "difference between the value and the farther bound. "
        "The measured range, from the lowest to the highest point, contains the errors of the "
        "points. If these errors alone can explain the form or deviation, 'at least' and "
        "U are not given. The bound 'at most' can be larger than the measured range, because the "
        "errors may hide a part of the form.",
        given=not any(each.feature.points.state_uncertainty for each in features),
    )


def relations_table(relations: Sequence[FeatureRelation]) -> Table:
    """Distances and angles, in the unit of each."""
    found = [(f"{r.first}, {r.second}", r.quantity) for r in relations]
    if not any(q.angle for _, q in found):
        return lengths_table(found, _COMMON, _BETWEEN)
    scale = [DEGREE if q.angle else 1.0 for _, q in found]
    plain = [math.nan if q.uncompensated is None else q.uncompensated for _, q in found]
    return Table(
        (
            Column.of("features", [name for name, _ in found]),
            Column.of("quantity", [q.name for _, q in found]),
            Column.of("unit", ["°" if q.angle else "mm" for _, q in found]),
            Column.of("uncompensated", [p / s for p, s in zip(plain, scale, strict=True)], "",
                      decimals(5)),
            Column.of("compensated", [q.value / s for (_, q), s in zip(found, scale, strict=True)],
                      "", decimals(5)),
            Column.of("u", [q.u / s for (_, q), s in zip(found, scale, strict=True)], "",
                      decimals(5)),
            Column.of("U (95 %)",
                      [q.expanded_u / s for (_, q), s in zip(found, scale, strict=True)], "",
                      decimals(5)),
        ),
        title=_BETWEEN,
        explanation=_COMMON,
    )  # fmt: skip


def angles_table(features: Sequence[MeasuredFeature]) -> Table | None:
    """Half angles, and directions with their uncertainties; None where there are none."""
    rows: list[tuple[str, str, FloatArray, tuple[float, float], float]] = []
    nothing = np.full(3, math.nan)
    for feature in features:
        for quantity in (q for q in feature.quantities if q.angle):
            before = math.nan if quantity.uncompensated is None else quantity.uncompensated
            rows.append(
                (shown_name(feature), quantity.name, nothing, (before, quantity.value), quantity.u)
            )
        direction, u = feature.association.direction, feature.u_direction
        if direction is not None and u is not None:
            what = "normal" if feature.kind in ("plane", "slot") else "axis"
            what = "direction" if feature.kind == "line" else what
            rows.append((shown_name(feature), what, direction, (math.nan, math.nan), u))
    if not rows:
        return None
    angles = [
        Column.of(name, [row[3][k] / DEGREE for row in rows], "°", decimals(5))
        for k, name in enumerate(("uncompensated", "compensated"))
        if not all(math.isnan(row[3][k]) for row in rows)
    ]
    components = [
        Column.of(name, [row[2][i] for row in rows], "", decimals(7))
        for i, name in enumerate("xyz")
    ]
    return Table(
        (
            Column.of("feature", [row[0] for row in rows]),
            Column.of("direction" if not angles else "angle", [row[1] for row in rows]),
            *components,
            *angles,
            Column.of("u", [row[4] / DEGREE for row in rows], "°", decimals(5)),
        ),
        explanation="x, y, z: unit vector of the compensated points. u: of the direction, where it "
        "is largest.",
    )


def _outcome(verdict: ConformityVerdict, decided: Sequence[tuple[str, float, Conformity]]) -> str:
    """In the words that the table has for it."""
    words = dict.fromkeys(verdict_words(verdict, u_machine) for _, u_machine, _ in decided)
    return " or ".join(f"'{each}'" for each in words)


def conformity_table(decided: Sequence[tuple[str, float, Conformity]]) -> Table:
    """Of names, standard uncertainties by the machine, and decisions."""
    conformities = [conformity for *_, conformity in decided]
    lower = [c.lower if math.isfinite(c.lower) else math.nan for c in conformities]
    upper = [c.upper if math.isfinite(c.upper) else math.nan for c in conformities]
    guard = [
        "too narrow" if math.isnan(c.guard_band) else number_text(c.guard_band / MICROMETRE)
        for c in conformities
    ]
    reject = [number_text(c.rejection_band / MICROMETRE) for c in conformities]
    corrected = _CORRECTED if any(c.corrected for c in conformities) else ""
    explained = _EXPLAINED if any(c.value == 0.0 for c in conformities) else ""
    return Table(
        (
            Column.of("feature", [name for name, *_ in decided]),
            Column.of("quantity", [c.name for c in conformities]),
            Column.of("value", [c.value for c in conformities], "mm", decimals(5)),
            Column.of("from", lower, "mm", decimals(4)),
            Column.of("to", upper, "mm", decimals(4)),
            Column.of("guard band", guard, "µm"),
            Column.of("rejection", reject, "µm"),
            Column.of("P", [100.0 * c.probability for c in conformities], "%", decimals(1)),
            Column.of(
                "verdict",
                [conformity_words(c, u_machine) for _, u_machine, c in decided],
            ),
        ),
        title="Decisions",
        explanation="Inside the tolerance by at least the guard band: "
        f"{_outcome(ConformityVerdict.CONFORMS, decided)}. Outside it by at least the rejection "
        f"band: {_outcome(ConformityVerdict.DOES_NOT_CONFORM, decided)}. Otherwise: "
        f"{_outcome(ConformityVerdict.UNDECIDED, decided)}. {explained}{corrected}P: probability "
        "that the true value is inside the tolerance.",
    )


def budget_section(inspected: InspectedFeature) -> Section:
    """The contributions to each uncertainty, source by source."""
    feature = inspected.feature
    lengths = [q for q in feature.quantities if not q.angle]
    lengths += [each.quantity for each in inspected.geometric if each.quantity.parts]
    names = dict.fromkeys(cause for q in lengths for cause in q.parts)
    table = Table(
        (
            Column.of("source", [*names, "u"]),
            *(
                Column.of(
                    f"u({q.name})",
                    [
                        *(q.parts.get(cause, 0.0) / MICROMETRE for cause in names),
                        q.u / MICROMETRE,
                    ],
                    "µm",
                    decimals(3),
                )
                for q in lengths
            ),
        ),
        explanation=(_SCALED if any(map(_is_near_zero, lengths)) else "")
        + (_TILTED if PLACES_ON_DATUMS in names else ""),
    )
    form = feature.form
    measured = f"{MEASURED_RANGE}{', minimum-zone' if feature.form_by == MINIMUM_ZONE else ''}"
    return Section(
        f"{shown_name(feature)}: sources of uncertainty",
        figures=(
            KeyFigure("range expected from errors", form.noise / MICROMETRE, "µm",
                      remark="mean range of points on a perfect surface"),
            KeyFigure("noise subtracted", (form.measured - form.value) / MICROMETRE, "µm",
                      remark=f"from the {measured}, for the errors of the points" if form.value
                      else f"all of the {measured}: the errors of the points alone can explain it"),
        ),
        tables=(table,),
        detail=True,
        certificate=True,
    )  # fmt: skip


def trials_table(found: Mapping[str, Sequence[QuantityByTrials]], trials: int) -> Table:
    """Quantities by Monte Carlo and their analytic uncertainty.

    Parameters
    ----------
    found : mapping of str to sequence of QuantityByTrials
        By the name of the feature.
    trials : int
    """
    rows = [(name, one) for name, each in found.items() for one in each]
    scale = [1.0 / DEGREE if one.quantity.angle else 1.0 for _, one in rows]
    fine = [(60.0 / DEGREE if one.quantity.angle else 1.0 / MICROMETRE) for _, one in rows]
    ends = [one.interval for _, one in rows]
    return Table(
        (
            Column.of("feature", [name for name, _ in rows]),
            Column.of("quantity", [
                f"{one.quantity.name} / {'°' if one.quantity.angle else 'mm'}" for _, one in rows
            ]),
            Column.of("value", [
                one.quantity.value * s for (_, one), s in zip(rows, scale, strict=True)
            ], "", decimals(5)),
            Column.of("u, analytic", [
                one.quantity.u * f for (_, one), f in zip(rows, fine, strict=True)
            ], "", decimals(3)),
            Column.of("u, by trials", [
                one.u * f for (_, one), f in zip(rows, fine, strict=True)
            ], "", decimals(3)),
            Column.of("95 % from", [
                low * s for (low, _), s in zip(ends, scale, strict=True)
            ], "", decimals(5)),
            Column.of("to", [
                high * s for (_, high), s in zip(ends, scale, strict=True)
            ], "", decimals(5)),
        ),
        title=TRIALS,
        explanation=f"Each of {trials} trials draws the own and the common errors of the points "
        "and the form of the part, and fits the feature again. u in µm; of angles in minutes.",
    )  # fmt: skip


def data_of_features(
    features: Sequence[InspectedFeature],
    relations: Sequence[FeatureRelation],
    together: Sequence[Together],
) -> tuple[Table, ...]:
    """All values, for programs: quantities with their sources, covariances, residuals."""
    measured = [inspected.feature for inspected in features]
    if not measured:
        return ()
    nothing = np.full(3, math.nan)
    directions = [f.association.direction for f in measured]
    axes = np.array([nothing if d is None else d for d in directions])
    places = np.array([f.association.point for f in measured])
    turns = [math.nan if f.u_direction is None else f.u_direction / DEGREE for f in measured]
    each = {
        "feature": [f.label for f in measured],
        "kind": [f.kind for f in measured],
        "side": [f.side or "" for f in measured],
        "association": [f.association.criterion for f in measured],
        "carrying_points": [" ".join(f.carrying) if f.is_extreme else "" for f in measured],
        "coverage_factor": [_largest_factor(f) for f in measured],
        "u_machine_mm": [f.errors.machine for f in measured],
        "correlation_of_points_stated": [f.errors.correlation_known for f in measured],
        **{f"direction_{name}": axes[:, i] for i, name in enumerate("xyz")},
        "u_direction_deg": turns,
        **{f"{name}_mm": places[:, i] for i, name in enumerate("xyz")},
        "form_at_least_mm": [f.form.interval[0] for f in measured],
        "form_at_most_mm": [f.form.interval[1] for f in measured],
        "measured_range_mm": [f.form.measured for f in measured],
        "range_by_errors_alone_mm": [f.form.noise for f in measured],
    }
    named = [(f.label, q) for f in measured for q in f.quantities]
    named += [(i.feature.label, each.quantity) for i in features for each in i.geometric]
    named += [(each.name, each.quantity) for each in together if len(each.labels) > 2]
    named += [(f"{r.first}, {r.second}", r.quantity) for r in relations]
    sources = [
        (label, q.name, cause, u / (DEGREE if q.angle else 1.0), "deg" if q.angle else "mm")
        for label, q in named
        for cause, u in q.parts.items()
    ]
    axis_pairs = [
        (f.label, *f.association.located_along[i], *f.association.located_along[k], covariance)
        for f in measured
        for (i, k), covariance in np.ndenumerate(f.located_covariance)
    ]
    residuals = residuals_table(measured)
    residuals["residual_mm"] = MICROMETRE * np.asarray(residuals.pop("residual_um"))
    return (
        Table.of(features_table(features, relations, together), "Quantities"),
        Table.of(each, "Features"),
        _rows_data(("feature", "quantity", "source", "u", "unit"), sources, "Sources"),
        _rows_data(
            ("feature", *(f"{end}_{name}" for end in ("first", "second") for name in "xyz"),
             "covariance_mm2"),
            axis_pairs, "Covariances of positions",
        ),
        _rows_data(
            ("first", "first_coordinate", "second", "second_coordinate", "covariance_mm2"),
            _covariances_between(measured), "Covariances between features",
        ),
        Table.of(residuals, "Residuals"),
    )  # fmt: skip


def _largest_factor(feature: MeasuredFeature) -> float:
    """The largest U / u of its quantities."""
    known = [q.expanded_u / q.u for q in feature.quantities if q.u > 0.0]
    return max(known, default=COVERAGE_FACTOR)


def _covariances_between(
    features: Sequence[MeasuredFeature],
) -> list[tuple[str, str, str, str, float]]:
    """Of the coordinates of two features each, by errors that their points have in common."""
    if len(features) > _MOST_COVARIANCES:
        return []
    covariance = covariance_of_positions(features)
    return [
        (first.label, "xyz"[i], second.label, "xyz"[k], float(covariance[3 * a + i, 3 * b + k]))
        for a, first in enumerate(features)
        for b, second in enumerate(features[:a])
        for i in range(3)
        for k in range(3)
    ]


def _rows_data(names: Sequence[str], rows: Sequence[tuple[Any, ...]], title: str) -> Table:
    return Table.of({name: [row[k] for row in rows] for k, name in enumerate(names)}, title)
