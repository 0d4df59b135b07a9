"""Values of settings that differ from their defaults, made from the descriptions of tasks."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pretravel.task import values as texts
from pretravel.task.task import Setting
from pretravel.tasks.qualify.references import block_lengths, stated_reference
from pretravel.tasks.qualify.several_tips import stated_tip

SAMPLES: dict[Callable[[str], Any], str] = {
    texts.angles: "0:30:10", texts.polar_angles: "10,20.5", texts.pair: "0.5,-0.25",
    texts.indices: "1,2", texts.trace_mark: "rig_000_1:r0=1.25", texts.feeds_list: "50,200",
    texts.stated_columns: "x=X pos,nx=-I,label=2", texts.length_or_none: "1.5",
    texts.counts: "10x8", texts.vector: "1,-2.5,3", texts.unit_vector: "0,1,0",
    texts.tolerance: "20..20.021",
    block_lengths: "25.4,50.8,76.2", stated_tip: "front=4@0,1,0",
    stated_reference: "r50=ring:50.0003:0.3",
}  # fmt: skip
"""What can be typed, by the function that reads it."""


def samples(setting: Setting) -> tuple[Any, ...]:
    """Values that differ from the default, each as the field holds it; the last one is usual."""
    found = _single(setting)
    return tuple((each,) for each in found) if setting.several else found


def _single(setting: Setting) -> tuple[Any, ...]:
    if setting.field.parse is not None:
        return (setting.field.parse(SAMPLES[setting.field.parse]),)
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
