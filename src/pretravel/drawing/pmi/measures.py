"""Measures of a STEP file in mm and degrees: each states its unit."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pretravel.drawing.pmi.part21 import Instance, Part21, TextRecord, Word

_PREFIXES = {
    "KILO": 1e3, "HECTO": 1e2, "DECA": 1e1, "DECI": 1e-1, "CENTI": 1e-2, "MILLI": 1e-3,
    "MICRO": 1e-6, "NANO": 1e-9, "PICO": 1e-12,
}  # fmt: skip
_DIGITS = 9
"""Decimals: a unit that is converted and converted back leaves noise beyond them."""
LENGTH_UNIT, ANGLE_UNIT = "mm", "°"


class StatedMeasure(NamedTuple):
    """A value with its unit.

    Attributes
    ----------
    value : float
        [mm or degrees]
    unit : str
        ``mm`` or ``°``.
    name : str
        Of the item: ``nominal value``, ``upper limit``, ``target width``.
    end : str
        maximum or minimum, where it is said to be one.
    """

    value: float
    unit: str
    name: str = ""
    end: str = ""


def unit_factor(part21: Part21, unit: Any, depth: int = 0) -> tuple[float, str] | None:
    """What one of a unit is in mm or degrees; None: it is neither a length nor an angle.

    Parameters
    ----------
    part21 : Part21
    unit : TextReference
    """
    instance = part21[unit]
    for name, words in ((r.name, r.values) for r in instance.records):
        if name == "SI_UNIT":
            prefix, base = words[-2:]
            factor = 1.0 if prefix is None else _PREFIXES.get(prefix.name)
            if factor is None or not isinstance(base, Word):
                return None
            if base.name == "METRE":
                return 1e3 * factor, LENGTH_UNIT
            return (math.degrees(factor), ANGLE_UNIT) if base.name == "RADIAN" else None
        if name == "CONVERSION_BASED_UNIT" and depth < 9:
            inner = part21[words[-1]].values("MEASURE_WITH_UNIT")
            found = unit_factor(part21, inner[1], depth + 1) if len(inner) > 1 else None
            return None if found is None else (_number(inner[0]) * found[0], found[1])
    return None


def measure_of(part21: Part21, instance: Instance) -> StatedMeasure | None:
    """The measure that an instance states; None: it states none of a length or an angle."""
    own = {record.name: record.values for record in instance.records}
    name = ""
    if len(own) == 1:
        kind, values = next(iter(own.items()))
        if kind == "MEASURE_REPRESENTATION_ITEM" and len(values) > 2:
            name, values = str(values[0] or ""), values[1:]
        elif not kind.endswith("MEASURE_WITH_UNIT"):
            return None
    else:
        values = own.get("MEASURE_WITH_UNIT") or own.get("MEASURE_REPRESENTATION_ITEM", ())
        name = str((*own.get("REPRESENTATION_ITEM", ()), "")[0] or "")
    if len(values) < 2 or values[1] is None:
        return None
    found = unit_factor(part21, values[1])
    if found is None:
        return None
    return StatedMeasure(round(_number(values[0]) * found[0], _DIGITS), found[1], name)


def measure_in_context(part21: Part21, instance: Instance, context: Any) -> StatedMeasure | None:
    """The same; a value without a unit has that of the context of its representation.

    Parameters
    ----------
    part21 : Part21
    instance : Instance
    context : TextReference
    """
    if instance.names != {"VALUE_REPRESENTATION_ITEM"}:
        return measure_of(part21, instance)
    name, value = instance.values()[:2]
    kind = value.name if isinstance(value, TextRecord) else ""
    wanted = ANGLE_UNIT if "ANGLE" in kind else LENGTH_UNIT if "LENGTH" in kind else ""
    for record in part21[context].records:
        if record.name == "GLOBAL_UNIT_ASSIGNED_CONTEXT":
            for unit in record.values[0]:
                factor = unit_factor(part21, unit)
                if factor is not None and factor[1] == wanted:
                    number = round(_number(value) * factor[0], _DIGITS)
                    return StatedMeasure(number, wanted, str(name or ""))
    return None


def _number(value: Any) -> float:
    """A number, or one with its type: ``LENGTH_MEASURE(1.)``."""
    while isinstance(value, TextRecord) and value.values:
        value = value.values[0]
    return float(value) if isinstance(value, float) else math.nan
