"""The answer to a drawing: one line for each tolerance, what fails first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pretravel.base import DEGREE, MICROMETRE
from pretravel.drawing.features.conformity import (
    Conformity,
    ConformityVerdict,
    conformity_words,
    verdict_words,
)
from pretravel.drawing.features.measured_feature import MeasuredFeature, Quantity
from pretravel.drawing.tolerances.tolerances import (
    InspectedFeature,
    OpenTolerance,
    Together,
    side_of_failure,
)
from pretravel.show import Column, Table, decimals, number_text, significant

CHARACTERISTIC_SYMBOLS = {
    "position": "⊕", "flatness": "▱", "roundness": "○", "cylindricity": "/○/", "straightness": "―",
    "profile": "◠", "perpendicularity": "⊥", "parallelism": "∥", "angularity": "∠",
    "run-out": "↗", "total run-out": "↗↗", "coaxiality": "◎", "concentricity": "◎",
    "symmetry": "≡", "diameter": "⌀", "angle": "∠", "width": "↔", "distance": "↔",
}  # fmt: skip
"""Of characteristics, like those of ISO 1101, as signs that usual fonts have."""
VerdictLevel = Literal["bad", "caution", "good"]
VERDICT_LEVELS: dict[ConformityVerdict, VerdictLevel] = {
    ConformityVerdict.DOES_NOT_CONFORM: "bad",
    ConformityVerdict.UNDECIDED: "caution",
    ConformityVerdict.CONFORMS: "good",
}
"""The worst first."""
VERDICT_SIGNS = {"bad": "✖", "caution": "?", "good": "✔"}
NOT_MEASURED, NOT_DECIDED = "not measured", "not decided"
_ANGLES = ("angle", "angular size", "half angle")
_SHOWN = 4  # names in a sentence


@dataclass(frozen=True)
class ToleranceLine:
    """One tolerance with its decision.

    Attributes
    ----------
    feature, characteristic : str
        ``bore1``; ``position to A|B|C``.
    lower, upper : float
        Limits; infinite where there is none, and zero at the lower end of a zone. [mm or degrees]
    unit : str
        mm or °.
    value, expanded_u, k : float
        Not numbers where nothing was measured. [mm or degrees]
    at_most : float or None
        The upper bound of a form or of a distance near zero that has no lower one. It is shown in
        the place of U and k, which would be of its difference from the value. [mm]
    bonus : float
        Part of the upper limit that is the growth of the zone by a size at M or L. [mm]
    verdict : ConformityVerdict
    words : str
        The verdict in words, with its reason.
    """

    feature: str
    characteristic: str
    lower: float
    upper: float
    unit: str
    value: float
    expanded_u: float
    k: float
    verdict: ConformityVerdict
    words: str
    at_most: float | None = None
    bonus: float = 0.0

    @property
    def level(self) -> VerdictLevel:
        """Colour and sign of the verdict."""
        return VERDICT_LEVELS[self.verdict]

    @property
    def named(self) -> str:
        """The characteristic with its symbol: ``⌀ diameter``."""
        name = _bare_name(self.characteristic)
        symbol = CHARACTERISTIC_SYMBOLS.get(name, "")
        return f"{symbol} {self.characteristic}".strip()

    @property
    def limits(self) -> str:
        """``11.95 to 12.05 mm``; ``0.1 mm`` of a zone; ``0.1 + 0.0116 (M) mm`` with its growth."""
        low, high = (f"{end:.7g}" for end in (self.lower, self.upper - self.bonus))
        if self.bonus > 0.0:
            sign = "(L)" if "(L)" in self.characteristic.partition(" to ")[0] else "(M)"
            high += f" + {number_text(self.bonus, decimals(4))} {sign}"
        if math.isnan(self.upper):
            return ""
        if math.isinf(self.upper):
            return _with_unit(f"from {low}", self.unit)
        if self.lower == 0.0 or math.isinf(self.lower):
            return _with_unit(f"{'up to ' if math.isinf(self.lower) else ''}{high}", self.unit)
        return _with_unit(f"{low} to {high}", self.unit)

    @property
    def value_text(self) -> str:
        """With the digits that U carries; a form below the noise as its bound."""
        if self.at_most is not None:
            bound = f"at most {_digits_of(self.at_most, self.expanded_u)}"
            if self.value > 0.0:
                bound = f"{_digits_of(self.value, self.expanded_u)}, {bound}"
            return _with_unit(bound, self.unit)
        if not math.isfinite(self.value):
            return ""
        return _with_unit(_digits_of(self.value, self.expanded_u), self.unit)

    @property
    def u_text(self) -> str:
        """U with two digits: in µm, or in degrees; none of a bound."""
        if self.at_most is not None or not math.isfinite(self.expanded_u):
            return ""
        if self.unit == "°":
            return f"{number_text(self.expanded_u, significant(2))}°"
        return f"{number_text(self.expanded_u / MICROMETRE, significant(2))} µm"

    @property
    def k_text(self) -> str:
        bare = self.at_most is not None or not math.isfinite(self.k)
        return "" if bare else number_text(self.k, significant(3))


def _bare_name(characteristic: str) -> str:
    """``position`` of ``position (M) to A|B``."""
    return characteristic.partition(" to ")[0].partition(" (")[0].partition(",")[0]


def _with_unit(text: str, unit: str) -> str:
    return f"{text}{unit}" if unit == "°" else f"{text} {unit}"


def _digits_of(value: float, expanded_u: float) -> str:
    """A value with the digits that its U carries: down to the second digit of U.

    >>> _digits_of(12.00212, 0.0041), _digits_of(12.00212, 0.31)
    ('12.0021', '12.00')
    """
    known = math.isfinite(expanded_u) and expanded_u > 0.0
    count = 1 - math.floor(math.log10(expanded_u)) if known else 4
    return f"{value:.{min(max(count, 0), 9)}f}"


def tolerance_lines(
    features: Sequence[InspectedFeature],
    together: Sequence[Together] = (),
    left_open: Sequence[OpenTolerance] = (),
) -> list[ToleranceLine]:
    """A line for each tolerance: what fails, what cannot be decided, the others.

    Parameters
    ----------
    features : sequence of InspectedFeature
    together : sequence of Together
    left_open : sequence of OpenTolerance
        What was not measured.

    Returns
    -------
    list of ToleranceLine
        Of one verdict in the order of the drawing.
    """
    found = []
    for each in features:
        feature = each.feature
        quantities = {q.name: q for q in each.stated}
        found += [
            _line(
                feature.label or feature.kind,
                decided.name,
                quantities.get(decided.name),
                decided,
                feature.errors.machine,
                _reason(decided, feature),
            )
            for decided in each.conformities
        ]
    found += [
        _line(one.name, one.tolerance or one.quantity.name, one.quantity, one.conformity,
              one.u_machine, _stricter(one.conformity))
        for one in together
    ]  # fmt: skip
    found += [
        ToleranceLine(
            one.name,
            one.characteristic,
            *one.limits,
            "°" if one.characteristic in _ANGLES else "mm",
            *(3 * (math.nan,)),
            ConformityVerdict.UNDECIDED,
            f"{NOT_MEASURED if one.is_measured else NOT_DECIDED}: {one.reason}",
        )
        for one in left_open
    ]
    order = list(VERDICT_LEVELS)
    return sorted(found, key=lambda line: order.index(line.verdict))


def _line(
    name: str,
    characteristic: str,
    quantity: Quantity | None,
    decided: Conformity,
    u_machine: float,
    reason: str = "",
) -> ToleranceLine:
    angle = quantity is not None and quantity.angle
    scale = DEGREE if angle else 1.0
    value = decided.value if quantity is None else quantity.value
    u = decided.u if quantity is None else quantity.u
    expanded = 2.0 * u if quantity is None else quantity.expanded_u
    ends = None if quantity is None else quantity.ends
    one_sided = quantity is not None and is_one_sided(quantity)
    words = conformity_words(decided, u_machine)
    return ToleranceLine(
        name,
        characteristic,
        decided.lower / scale if math.isfinite(decided.lower) else _lower(decided),
        decided.upper / scale,
        "°" if angle else "mm",
        value / scale,
        expanded / scale,
        expanded / u if u > 0.0 else math.nan,
        decided.verdict,
        f"{words}: {reason}" if reason else words,
        ends[1] / scale if ends is not None and one_sided else None,
        decided.bonus,
    )


def is_one_sided(quantity: Quantity) -> bool:
    """Whether the errors of the points alone can explain a value, so that it has no lower bound."""
    return quantity.ends is not None and quantity.ends[0] <= 0.0


def _lower(decided: Conformity) -> float:
    """The lower end of a zone is zero; a size without a lower limit has none."""
    name = _bare_name(decided.name)
    sized = name in ("diameter", "width", "tube diameter", "distance", "angle")
    return decided.lower if sized else 0.0


STRICTER_FAILS = "decided by a stricter tolerance, which is not met"
"""Of a tolerance that was decided by a stricter one: the drawing's may still be kept."""


def _stricter(decided: Conformity) -> str:
    undecided = decided.verdict is ConformityVerdict.UNDECIDED
    fails = undecided and ", for " in decided.name and decided.value > decided.upper
    return STRICTER_FAILS if fails else ""


def _reason(decided: Conformity, feature: MeasuredFeature) -> str:
    fails = decided.verdict is ConformityVerdict.DOES_NOT_CONFORM
    return (
        side_of_failure(decided, feature.side)
        if fails and decided.name == feature.size_name
        else _stricter(decided)
    )


TITLE_OF_LINES = "Tolerances"
"""Title of the table of tolerances."""


def lines_table(lines: Sequence[ToleranceLine]) -> Table:
    """The lines as a table of words; a verdict has its sign."""
    return Table(
        (
            Column.of("feature", [line.feature for line in lines]),
            Column.of("characteristic", [line.named for line in lines]),
            Column.of("limits", [line.limits for line in lines]),
            Column.of("value", [line.value_text for line in lines]),
            Column.of("U", [line.u_text for line in lines]),
            Column.of("k", [line.k_text for line in lines]),
            Column.of("verdict", [f"{VERDICT_SIGNS[line.level]} {line.words}" for line in lines]),
        ),
        title=TITLE_OF_LINES,
        levels=tuple(line.level for line in lines),
    )


def lines_data(lines: Sequence[ToleranceLine]) -> Table:
    """The lines in numbers, for programs. [mm or degrees]"""
    return Table.of(
        {
            "feature": [line.feature for line in lines],
            "characteristic": [line.characteristic for line in lines],
            "unit": ["deg" if line.unit == "°" else "mm" for line in lines],
            **{
                name: np.array([getattr(line, name) for line in lines])
                for name in ("lower", "upper", "value", "expanded_u", "k")
            },
            "verdict": [line.words for line in lines],
        },
        TITLE_OF_LINES,
    )


def count_words(
    lines: Sequence[ToleranceLine], features: Sequence[InspectedFeature], u_machine: float
) -> str:
    """What the lines say together: ``7 of 9 conform; 2 features without a tolerance``.

    Parameters
    ----------
    lines : sequence of ToleranceLine
    features : sequence of InspectedFeature
    u_machine : float
        Without it nothing is called conforming. [mm]
    """
    parts = []
    for verdict in VERDICT_LEVELS:
        mine = [line for line in lines if line.verdict is verdict]
        if verdict is not ConformityVerdict.CONFORMS and mine:
            words = verdict_words(verdict, u_machine)
            words = (
                {"does not conform": "do not conform"}.get(words, words) if len(mine) > 1 else words
            )
            names = "; ".join(f"{each.feature}: {each.characteristic}" for each in mine[:_SHOWN])
            more = "; …" if len(mine) > _SHOWN else ""
            parts.append(f"{len(mine)} {words} ({names}{more})")
    good = sum(line.verdict is ConformityVerdict.CONFORMS for line in lines)
    words = verdict_words(ConformityVerdict.CONFORMS, u_machine)
    of = f"{good} of {len(lines)}"
    if words == "conforms":
        parts.append(f"{of} {words if good == 1 else 'conform'}")
    else:
        parts.append(f"{of} {words}")
    labels = {name for line in lines for name in line.feature.split(", ")}
    bare = sum((each.feature.label or each.feature.kind) not in labels for each in features)
    without = f"; {bare} feature{'s' * (bare > 1)} without a tolerance" if bare else ""
    return ", ".join(parts) + without
