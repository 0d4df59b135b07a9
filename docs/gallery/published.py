"""The printed tables of the thesis, and the number that each script of this folder asserts."""

from __future__ import annotations

import csv
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pretravel.show.style import save

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "docs" / "pictures"
NUMBERS = Path(__file__).parent / "numbers.toml"
"""The number of each script when it was run last; the site shows it next to the published one."""


@dataclass(frozen=True)
class Statement:
    """The number that a script asserts.

    Attributes
    ----------
    quantity : str
        What it is, with its unit.
    published : str
        The number of the publication, or what theory says.
    source : str
    low, high : float
        The number must lie between them.
    reason : str
        Why these limits.
    """

    quantity: str
    published: str
    source: str
    low: float
    high: float
    reason: str

    def check(self, value: float) -> None:
        """Raise an `AssertionError` where a value is outside the limits."""
        assert self.low <= value <= self.high, (
            f"{self.quantity}: {value:.6g} is not within {self.low:.6g} to {self.high:.6g} "
            f"({self.source}: {self.published})"
        )


def finish(script: str, picture: str, figure: Figure, statement: Statement, value: float) -> None:
    """Assert the number of a script, keep it for the site, and write the picture.

    Parameters
    ----------
    script : str
        The file of the script.
    picture : str
        Name of the file of the picture.
    figure : Figure
    statement : Statement
    value : float
    """
    statement.check(value)
    numbers = tomllib.loads(NUMBERS.read_text(encoding="utf-8")) if NUMBERS.exists() else {}
    numbers[Path(script).stem] = float(f"{value:.4g}")
    lines = [f"{name} = {number!r}\n" for name, number in sorted(numbers.items())]
    head = "# Written by the scripts of this folder (make docs-gallery).\n"
    NUMBERS.write_text(head + "".join(lines), encoding="utf-8")
    save(figure, PICTURES / picture)
    print(f"{statement.quantity}: {value:.4g} (published: {statement.published})")


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
