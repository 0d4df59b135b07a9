"""Values of settings that differ from their defaults, made from the descriptions of tasks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from pretravel.controls.tasks.program.task import Feeds
from pretravel.drawing.tasks.plan.targets import Counts
from pretravel.drawing.tolerances.tolerance_text import ToleranceText
from pretravel.laboratory.rig.moved_marks import MovedMark
from pretravel.laboratory.tasks.separate.task import Indices
from pretravel.task.task import Setting
from pretravel.task.values import (
    Angles,
    Length,
    Pair,
    PolarAngles,
    StatedColumns,
    UnitVector,
    Vector,
)
from pretravel.tasks.qualify.references import Lengths, StatedReference
from pretravel.tasks.qualify.several_tips import StatedTip

SAMPLES: dict[type, str] = {
    Angles: "0:30:10", PolarAngles: "10,20.5", Pair: "0.5,-0.25", Indices: "1,2",
    MovedMark: "rig_000_1:r0=1.25", Feeds: "50,200", StatedColumns: "x=X pos,nx=-I,label=2",
    Length: "1.5", Counts: "10x8", Vector: "1,-2.5,3", UnitVector: "0,1,0",
    ToleranceText: "20..20.021", Lengths: "25.4,50.8,76.2", StatedTip: "front=4@0,1,0",
    StatedReference: "r50=ring:50.0003:0.3",
}  # fmt: skip
"""What can be typed, by the type that reads it."""


def samples(setting: Setting) -> tuple[Any, ...]:
    """Values that differ from the default, each as the field holds it; the last one is usual."""
    found = _single(setting)
    return tuple((each,) for each in found) if setting.several else found


def _single(setting: Setting) -> tuple[Any, ...]:
    if setting.parse is not None:
        return (setting.parse(SAMPLES[setting.kind]),)
    if setting.choices:
        return tuple(choice for choice in setting.choices if choice != setting.default)
    if setting.kind is bool:
        return (not setting.default,)
    if setting.kind is Path:
        return (Path("a b" + (setting.field.writes or (".csv",))[0]),)
    if setting.kind in (float, int):
        low, high = (max(-1e6, min(1e6, end)) for end in setting.limits)
        between = low + 0.2371 * (high - low)
        return (math.ceil(between) if setting.kind is int else between,)
    return ("a 'quoted' text",)
