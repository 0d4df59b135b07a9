"""The printed tables of the thesis as arrays, for the scripts in this folder."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "docs" / "pictures"


def trigger_table() -> dict[str, np.ndarray]:
    """Rodrigues 2021, Tables 4.1 to 4.9: 63 directions, polar 90 to 10°, azimuth 0 to 60°."""
    path = ROOT / "tests/validation/reference/rodrigues_trigger_50mm.csv"
    with path.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


def sliding_tables() -> dict[str, np.ndarray]:
    """Rodrigues 2021, Tables 4.10 and 4.11: deflection in twenty steps of 1 µm."""
    columns: dict[str, np.ndarray] = {}
    for name in ("rodrigues_convex_sliding", "rodrigues_ellipsoid_inclined_sliding"):
        path = ROOT / f"tests/validation/reference/{name}.csv"
        with path.open(encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
        columns |= {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}
    return columns
