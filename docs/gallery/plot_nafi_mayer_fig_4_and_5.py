"""Nafi and Mayer, Figures 4 and 5: errors and variances of machine and probe from one test.

The paper does not print its readings. The script uses the readings of the example (simulated),
24 by 24, with one repeated configuration.
"""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure
from published import PICTURES

from pretravel.formats.separation_csv import read_multi_step_readings
from pretravel.laboratory.multi_step_readings import RepeatedPair
from pretravel.laboratory.separation import Separation, separate
from pretravel.report.chart_files import drawn_figure
from pretravel.report.separation_report import separation_view
from pretravel.report.style import save

READINGS = Path(__file__).parents[2] / "examples" / "data" / "redundancy_24x24.csv"


def compute() -> Separation:
    """The separation with the repeated configuration (1, 1): 0.74 µm² from 200 repeats."""
    return separate(read_multi_step_readings(READINGS), repeated=RepeatedPair(1, 1, 0.74e-6, 200))


def draw(result: Separation) -> Figure:
    """The plot of errors and variances over the directions."""
    title = "Separation of machine and probe (bars: two standard uncertainties)"
    return drawn_figure(separation_view(result, title))


if __name__ == "__main__":
    save(draw(compute()), PICTURES / "separation.png")
