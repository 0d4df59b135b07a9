"""Nafi and Mayer, Figures 4 and 5: errors and variances of machine and probe from one test.

The paper does not print its readings. The script uses the readings of the example (simulated),
24 by 24, with one repeated configuration.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish

from pretravel.laboratory.separation.multi_step_readings import RepeatedPair
from pretravel.laboratory.separation.separation import Separation, separate
from pretravel.laboratory.separation.separation_csv import read_multi_step_readings
from pretravel.laboratory.tasks.separate.report import separation_view
from pretravel.show.chart_files import drawn_figure

READINGS = Path(__file__).parents[2] / "examples" / "data" / "redundancy_24x24.csv"


STATEMENT = Statement(
    "lobes of the systematic error of the probe (largest harmonic)",
    "3",
    "Nafi and Mayer 2011, Figure 4: a probe with three lobes",
    3.0,
    3.0,
    "a count",
)


def compute() -> Separation:
    """The separation with the repeated configuration (1, 1): 0.74 µm² from 200 repeats."""
    return separate(read_multi_step_readings(READINGS), repeated=RepeatedPair(1, 1, 0.74e-6, 200))


def stated(result: Separation) -> float:
    """The order of the largest harmonic of the probe's error."""
    spectrum = np.abs(np.fft.rfft(result.probe_error - result.probe_error.mean()))
    return float(np.argmax(spectrum))


def draw(result: Separation) -> Figure:
    """The plot of errors and variances over the directions."""
    title = "Separation of machine and probe (bars are two standard uncertainties)"
    return drawn_figure(separation_view(result, title))


if __name__ == "__main__":
    found = compute()
    finish(__file__, "separation.png", draw(found), STATEMENT, stated(found))
