"""What comments of traces state: used, refused where the trace shows another thing, or named."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import date

from pretravel.base import DEGREE, PretravelError
from pretravel.files import days_in_text, shortened, telling_comments
from pretravel.laboratory.rig.calibration import angles_of
from pretravel.laboratory.rig.trace import OTHER_FEED, RigTouch, RigTrace

_NUMBER = r"(-?\d+(?:[.,]\d+)?)"
_RATE = re.compile(
    rf"\b(?:sampl\w*|abtast\w*|f_?s)\b[^\d\n]{{0,40}}?{_NUMBER}\s?(k?)(?:Hz|S/s)", re.I
)
_FEED = re.compile(
    rf"^\W*(?:rod |probing )?(?:feed|speed|vorschub)\b\D{{0,40}}?{_NUMBER}\s?"
    r"(mm/min|mm/s|[µμu]m/s)",
    re.I,
)
_PER_MINUTE = {"mm/min": 1.0, "mm/s": 60.0}
_AZIMUTH = re.compile(
    rf"\bazimuth\b\W*{_NUMBER}\s?(?:°|deg|$)|\b(?:direction|richtung)\b\W*{_NUMBER}\s?(?:°|deg)",
    re.I,
)
_TEMPERATURE = re.compile(rf"\btemp(?:eratur\w*|\.)?\W*{_NUMBER}\s?(?:°\s?)?C\b", re.I)
_OTHER_RATE = 0.02
_OTHER_ANGLE = 0.5 * DEGREE
_OTHER_TEMPERATURE = 1.0
"""Of a room and a ruler in it. [K]"""
_DAYS = 7
"""Between traces of one calibration."""
_QUOTED = 3
"""Comments that differ only in their numbers, of which each is quoted."""


def with_comments(
    traces: Sequence[RigTrace], touches: Sequence[RigTouch], temperature: float
) -> tuple[RigTouch, ...]:
    """The touches with notes of what the comments of their traces state and nothing reads.

    Parameters
    ----------
    traces : sequence of RigTrace
    touches : sequence of RigTouch
        In the same order.
    temperature : float
        Of the ruler, as it is used. [°C]

    Raises
    ------
    PretravelError
        A comment gives another sampling rate, feed or direction than the trace has.
    """
    stated = [
        [*_not_read(trace, touch, temperature)]
        for trace, touch in zip(traces, touches, strict=True)
    ]
    forms: dict[str, set[str]] = {}
    for text in (text for texts in stated for text in texts):
        forms.setdefault(_form(text), set()).add(text)
    days = [_day(trace) for trace in traces]
    known = sorted(day for day in days if day is not None)
    found = []
    for touch, texts, day in zip(touches, stated, days, strict=True):
        notes = [
            text
            if len(forms[_form(text)]) <= _QUOTED
            else f"{_form(text)} (the numbers differ from trace to trace)"
            for text in texts
        ]
        if day is not None and abs((day - known[len(known) // 2]).days) > _DAYS:
            usual = known[len(known) // 2]
            notes.append(f"dated {day}, most traces {usual}: is it of this calibration?")
        found.append(replace(touch, notes=(*touch.notes, *notes)))
    return tuple(found)


def _not_read(trace: RigTrace, touch: RigTouch, temperature: float) -> Iterator[str]:
    """Comments that state something, without those that say what the trace itself shows."""
    azimuth = angles_of(trace.name)[0]
    for number, line in telling_comments(trace.comments):
        not_read = f"not read: '{shortened(line)}'"
        own = f"{trace.name}, line {number}: '{shortened(line)}', and "
        if found := _RATE.search(line):
            rate = _value(found[1]) * (1e3 if found[2] else 1.0)
            if abs(rate * trace.interval - 1.0) > _OTHER_RATE:
                _refuse(f"{own}time_s has a sample every {1e3 * trace.interval:.4g} ms")
        elif found := _FEED.search(line):
            feed = abs(_value(found[1])) * _PER_MINUTE.get(found[2].lower(), 0.06)
            if abs(feed - touch.feed) > OTHER_FEED * touch.feed:
                _refuse(f"{own}the rod has {touch.feed:.3g} mm/min")
        elif (found := _AZIMUTH.search(line)) and math.isfinite(azimuth):
            apart = math.remainder(_value(found[1] or found[2]) * DEGREE - azimuth, 2.0 * math.pi)
            if abs(apart) > _OTHER_ANGLE:
                _refuse(f"{own}the name gives the azimuth {azimuth / DEGREE:g}°")
        elif found := _TEMPERATURE.search(line):
            if abs(_value(found[1]) - temperature) > _OTHER_TEMPERATURE:
                yield f"{not_read}, and the ruler is taken to be at {temperature:g} °C"
        else:
            yield not_read


def _refuse(said: str) -> None:
    raise PretravelError(f"{said}: correct the one that is wrong", inputs=("exclude",))


def _value(text: str) -> float:
    return float(text.replace(",", "."))


def _form(text: str) -> str:
    """A comment with … for its numbers."""
    return re.sub(r"\d+(?:[.,:]\d+)*", "…", text)


def _day(trace: RigTrace) -> date | None:
    """The first date in the comments of a trace; None without one."""
    return next((day for _, line in trace.comments for day in days_in_text(line)), None)
