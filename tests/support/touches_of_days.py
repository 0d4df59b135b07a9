"""Touches of the example's reference on several days."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pretravel.task.example_data import example_folder

SPHERE = example_folder() / "sphere_touches.csv"


def day_of(folder: Path, day: int, *, longer: float = 0.0) -> Path:
    """The example's touches of another day; `longer` moves them outwards. [mm]"""
    head, *rows = SPHERE.read_text().splitlines()
    noise = np.random.default_rng(day).normal(scale=1e-4, size=(len(rows), 3))
    lines = [head]
    for row, shift in zip(rows, noise, strict=True):
        values = np.array(row.split(","), dtype=np.float64)
        values[:3] += shift + longer * values[3:6]
        lines.append(",".join(f"{value:.7f}" for value in values))
    path = folder / f"day{day}.csv"
    path.write_text("\n".join(lines))
    return path
