"""A map in one sentence for a machinist: size of its lobes, and what corrections leave of them."""

from __future__ import annotations

import numpy as np

from pretravel.base import MICROMETRE
from pretravel.maps import PretravelMap, equator
from pretravel.measurement import Comparison
from pretravel.show import KeyFigure, decimals, value_text
from pretravel.uncertainty import COVERAGE_FACTOR


def lobe_size(pretravel_map: PretravelMap) -> float:
    """Largest less smallest pretravel around the equator. [mm]

    Parameters
    ----------
    pretravel_map : PretravelMap

    Raises
    ------
    ExtrapolationError
        The map does not hold all around the equator.
    """
    values = equator(pretravel_map, np.arange(0.0, 360.0, 1.0))
    return float(np.ptp(values))


def lobes_sentence(pretravel_map: PretravelMap, comparison: Comparison) -> str:
    """What the probe does on the equator, and what corrections leave there.

    Parameters
    ----------
    pretravel_map : PretravelMap
    comparison : Comparison
        Of this map.

    Returns
    -------
    str
        The errors are the largest ones; that of the full map is its expanded uncertainty (k = 2).
    """
    left = {row.method: row.largest for row in comparison.rows if row.where == "equator"}
    anywhere = {row.method: row.largest for row in comparison.rows if row.where == "all"}
    beyond = (
        ". In all directions the error of one radius is up to "
        f"{_micrometres(anywhere['mean radius'])}"
        if "mean radius" in anywhere
        else ""
    )
    expanded = COVERAGE_FACTOR * comparison.u_map
    return (
        f"On vertical walls the pretravel changes by {_micrometres(lobe_size(pretravel_map))} "
        "around the probe (lobes). With one radius in the control, errors are up to "
        f"{_micrometres(left['mean radius'])}, eight radii up to "
        f"{_micrometres(left['eight sectors'])}, the map {_micrometres(expanded)} "
        f"(U, k = 2){beyond}"
    )


def lobes_figures(pretravel_map: PretravelMap, comparison: Comparison) -> tuple[KeyFigure, ...]:
    """The three numbers of `lobes_sentence` that a machinist looks for, on vertical walls.

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
        "left with the map": (COVERAGE_FACTOR * comparison.u_map, "U, k = 2"),
    }
    return tuple(
        KeyFigure(name, value / MICROMETRE, "µm", decimals(1), remark=remark)
        for name, (value, remark) in values.items()
    )


def _micrometres(length: float) -> str:
    return value_text(length / MICROMETRE, "µm", decimals(1))
