"""Words at places in space, in files: none covers another one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from pretravel.base import FloatArray

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

NoteInSpace: TypeAlias = tuple[FloatArray, str, str]
"""Place, words, colour."""

_LETTER, _ROW = 5.8, 14.0
"""Size of a letter of a note with its frame. [pt]"""
_SHIFTS = [
    (0.0, 0.0),
    *(
        (reach * math.cos(turn), reach * math.sin(turn))
        for reach in (16.0, 24.0, 34.0, 46.0, 60.0)
        for turn in np.radians([90.0, 45.0, 135.0, 0.0, 180.0, 315.0, 225.0, 270.0])
    ),
]
"""Where a note may stand from its place, the best first. [pt]"""


def draw_notes(notes: Sequence[NoteInSpace], axes: Axes3D) -> None:
    """Draw notes on a light ground, next to each other where their places are close, with a line.

    Parameters
    ----------
    notes : sequence of NoteInSpace
        Those that are seen.
    axes : Axes3D
        With its limits and its view.
    """
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    if not notes:
        return
    axes.apply_aspect()
    across, up, _ = proj_transform(*np.array([place for place, *_ in notes]).T, axes.get_proj())
    figure = axes.get_figure()
    assert figure is not None
    there = axes.transData.transform(np.column_stack([across, up])) * 72.0 / figure.dpi
    placed: list[tuple[FloatArray, FloatArray]] = []
    for row in np.argsort(-there[:, 1]):
        _, text, colour = notes[row]
        half = np.array([0.5 * _LETTER * (len(text) + 1), 0.5 * _ROW])
        free = [
            shift for shift in _SHIFTS
            if all(np.any(np.abs(there[row] + shift - at) > half + size) for at, size in placed)
        ]  # fmt: skip
        # The nearest free place, away from the others.
        near = min(
            (at for at, _ in placed), key=lambda at: math.dist(at, there[row]), default=there[row]
        )
        away = there[row] - near
        shift = min(free or _SHIFTS[:1], key=lambda s: (round(math.hypot(*s)), -float(away @ s)))
        placed.append((there[row] + shift, half))
        axes.annotate(
            text, (across[row], up[row]), shift, textcoords="offset points", ha="center",
            va="center", fontsize=9, color=colour, zorder=10, annotation_clip=False,
            bbox={"boxstyle": "round,pad=0.12", "fc": "w", "ec": colour, "lw": 0.4, "alpha": 0.85},
            arrowprops={"arrowstyle": "-", "lw": 0.6, "color": colour} if any(shift) else None,
        )  # fmt: skip
