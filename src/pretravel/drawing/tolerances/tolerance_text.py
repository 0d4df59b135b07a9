"""Tolerances as they are typed: limits, or deviations from a nominal size."""

from __future__ import annotations

import math
import re
from typing import NamedTuple, Self

from pretravel.base import PretravelError
from pretravel.drawing.tolerances.iso286 import limits_of_fit

_NUMBER = r"[+-]?\d*\.?\d+(?:[eE][+-]?\d+)?"


class ToleranceText(NamedTuple):
    """Limits, or deviations from a nominal size, in mm; None: there is no such limit.

    `fit` is the class of ISO 286 that the limits were typed as, such as H7.
    """

    low: float | None
    high: float | None
    are_limits: bool
    fit: str = ""

    def __str__(self) -> str:
        """As it can be typed."""
        if self.are_limits:
            ends = ("" if end is None else f"{end:.12g}" for end in (self.low, self.high))
            return "..".join(ends)
        return f"{self.high:+.12g}/{self.low:+.12g}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """Limits ``20.000..20.021`` or ``20..``, or deviations ``+0.021/0`` or ``±0.01``.

        A nominal size with a class of ISO 286, ``20H7``, is its limits.

        Raises
        ------
        PretravelError
            None of these, an empty tolerance, or a class that `limits_of_fit` does not know.

        >>> ToleranceText.parse("20..20.021")
        ToleranceText(low=20.0, high=20.021, are_limits=True, fit='')
        >>> ToleranceText.parse("+0.021/0")
        ToleranceText(low=0.0, high=0.021, are_limits=False, fit='')
        >>> str(ToleranceText.parse("+0.021/0")), str(ToleranceText.parse("20..20.021"))
        ('+0.021/+0', '20..20.021')
        >>> str(ToleranceText.parse("0..")), str(ToleranceText.parse("..20.021"))
        ('0..', '..20.021')
        >>> ToleranceText.parse("±0.01")
        ToleranceText(low=-0.01, high=0.01, are_limits=False, fit='')
        >>> str(ToleranceText.parse("19,99..20,02"))  # a decimal comma means nothing else here
        '19.99..20.02'
        >>> str(ToleranceText.parse("20 H7")), str(ToleranceText.parse("Ø25k6"))
        ('20..20.021', '25.002..25.015')
        """
        tight = re.sub(r"(?<=\d),(?=\d)", ".", text.replace(" ", "").replace("−", "-"))
        if both := re.fullmatch(rf"(?:±|\+-|\+/-)({_NUMBER})", tight):
            half = abs(float(both[1]))
            return cls._nonempty(-half, half, False)
        if limits := re.fullmatch(rf"({_NUMBER})?\.\.({_NUMBER})?", tight):
            low, high = (None if limit is None else float(limit) for limit in limits.groups())
            if low is not None and high is not None:
                return cls._nonempty(low, high, True)
            only = high if low is None else low
            if only is not None and math.isfinite(only):
                return cls(low, high, True)
        if parts := re.fullmatch(rf"({_NUMBER})/({_NUMBER})", tight):
            return cls._nonempty(float(parts[2]), float(parts[1]), False)
        if fit := re.fullmatch(r"[Øø]?(\d*\.?\d+)([A-Za-z]{1,2}\d{1,2})", tight):
            ends = limits_of_fit(float(fit[1]), fit[2])
            if ends is not None:
                return cls._nonempty(*ends, True)._replace(fit=fit[2])
            raise PretravelError(
                f"{fit[2]} at {fit[1]} mm is not in the tables here (ISO 286: D to H, JS, K to 8, "
                "M, N, P, R, S, and d to s, IT4 to IT14, up to 500 mm): give the limits, as "
                "20.000..20.021"
            )
        raise PretravelError(
            "expected limits as 20.000..20.021, one limit as 20.. or ..20.021, the nominal size "
            "and its class as 20H7, or only the deviations, +0.021/0 or ±0.01, and the "
            "nominal size as a setting of its own, in mm"
        )

    def refuse_other_side(self, kind: str | None) -> None:
        """Refuse the class of a shaft for a bore or a slot, and of a hole for a boss.

        Raises
        ------
        PretravelError
        """
        of_hole = {"bore": True, "slot": True, "boss": False}.get(kind or "")
        if not self.fit or of_hole is None or self.fit[0].isupper() == of_hole:
            return
        other = self.fit.upper() if of_hole else self.fit.lower()
        whose = ("small letters are classes of shafts", "capital letters are classes of holes")
        raise PretravelError(
            f"{self.fit} is given for a {kind}, and {whose[not of_hole]}: is {other} meant?",
            inputs=("size_tolerance",),
        )

    @classmethod
    def _nonempty(cls, low: float, high: float, are_limits: bool) -> Self:
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            first = "the lower limit" if are_limits else "the upper deviation"
            raise PretravelError(f"this tolerance is empty; {first} comes first")
        return cls(low, high, are_limits)
