"""The folder of example data."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples" / "data"
SPHERE, PART = EXAMPLES / "sphere_touches.csv", EXAMPLES / "part_touches.csv"
