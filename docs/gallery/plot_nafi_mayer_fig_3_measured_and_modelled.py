"""Nafi and Mayer, Figure 3: measured and modelled errors at some orientations of the probe.

The paper does not print its readings. The script uses those of the example (simulated, 24 by 24):
48 errors of machine and probe explain nearly all of 576 readings; what is left is the noise whose
variances are separated.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.laboratory.separation.separation import Separation, separate
from pretravel.laboratory.separation.separation_csv import read_multi_step_readings
from pretravel.laboratory.tasks.separate.report import model_view
from pretravel.show.chart_files import drawn_figure

READINGS = Path(__file__).parents[2] / "examples" / "data" / "redundancy_24x24.csv"


STATEMENT = Statement(
    "share of the readings' variance that machine and probe explain / %",
    "nearly all (the curves of Figure 3 lie upon each other)",
    "Nafi and Mayer 2011, Figure 3",
    90.0,
    99.0,
    "the example's noise has about 0.4 µm² a pair, its errors a variance of 5 µm²",
)


def compute() -> Separation:
    """The separation of the example."""
    return separate(read_multi_step_readings(READINGS))


def stated(result: Separation) -> float:
    """R² in percent."""
    assert result.used is not None
    about = result.used.errors - result.used.errors.mean()
    return float(100.0 * (1.0 - np.sum(result.residuals**2) / np.sum(about**2)))


def draw(result: Separation) -> Figure:
    """Four of 24 orientations."""
    return drawn_figure(model_view(result, "Measured and modelled errors"))


if __name__ == "__main__":
    found = compute()
    finish(__file__, "separation_model.png", draw(found), STATEMENT, stated(found))
