"""A map in three numbers for a machinist: size of its lobes, and what corrections leave of them."""

from __future__ import annotations

import numpy as np

from pretravel.base import MICROMETRE
from pretravel.maps import PretravelMap, equator
from pretravel.measurement import Comparison
from pretravel.show import KeyFigure, decimals, value_text
from pretravel.uncertainty import COVERAGE_FACTOR


def lobe_size(pretravel_map: PretravelMap) -> float:
    """Largest less smallest pretravel around the equator. [mm]

    Raises
    ------
    ExtrapolationError
        The map does not hold all around the equator.
    """
    values = equator(pretravel_map, np.arange(0.0, 360.0, 1.0))
    return float(np.ptp(values))


def lobes_sentence(comparison: Comparison) -> str:
    """What the figures of `lobes_figures` hold for, and what stands in none of them."""
    left = {row.method: row.largest for row in comparison.rows if row.where == "equator"}
    anywhere = {row.method: row.largest for row in comparison.rows if row.where == "all"}
    beyond = (
        f". In all directions one radius leaves up to {_micrometres(anywhere['mean radius'])}"
        if "mean radius" in anywhere
        else ""
    )
    return (
        "These figures are for vertical walls. There a sector table in the control leaves up to "
        f"{_micrometres(left['eight sectors'])}{beyond}"
    )


def lobes_figures(pretravel_map: PretravelMap, comparison: Comparison) -> tuple[KeyFigure, ...]:
    """The three numbers that a machinist looks for, on vertical walls.

    Parameters
    ----------
    pretravel_map : PretravelMap
    comparison : Comparison
        Of this map.
    """
    left = {row.method: row.largest for row in comparison.rows if row.where == "equator"}
    values = {
        "lobes": (lobe_size(pretravel_map), "largest minus smallest pretravel"),
        "left with one radius": (left["mean radius"], "largest error"),
        "left with the map": (
            COVERAGE_FACTOR * comparison.largest_u("equator"),
            "largest U, k = 2",
        ),
    }
    return tuple(
        KeyFigure(name, value / MICROMETRE, "µm", decimals(1), remark=remark)
        for name, (value, remark) in values.items()
    )


def _micrometres(length: float) -> str:
    return value_text(length / MICROMETRE, "µm", decimals(1))
