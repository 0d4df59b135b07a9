"""Marks of traces that a person moved, as they are typed."""

from __future__ import annotations

import math
from typing import NamedTuple, Self

from pretravel.base import PretravelError


class MovedMark(NamedTuple):
    """Where a person sees an event of a trace: ruler position, in mm."""

    trace: str
    event: str
    position: float

    def __str__(self) -> str:
        return f"{self.trace}:{self.event}={self.position:.12g}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """An event of a trace from ``trace:event=position``, in mm.

        >>> MovedMark.parse("rig_000_1:r0=1.25")
        MovedMark(trace='rig_000_1', event='r0', position=1.25)
        """
        trace, colon, event = text.rpartition(":")
        name, equals, number = event.partition("=")
        try:
            position = float(number)
        except ValueError:
            position = math.nan
        if not (trace and colon and equals and math.isfinite(position)):
            raise PretravelError("expected a trace, an event and mm: rig_000_1:r0=1.25")
        return cls(trace, name.strip(), position)
