"""A Plotly figure in the colours of the page, which its reader changes between light and dark."""

from __future__ import annotations

from typing import Any

from nicegui import ui
from nicegui.element import Element

from pretravel.show import DARK, LIGHT, scale_colours

# plot.js alone draws again for a new size: Plotly would first stretch the old words and camera.
_CONFIG = {"config": {"displaylogo": False, "responsive": False, "scrollZoom": False}}


class ColouredPlot(ui.plotly, component="plot.js"):
    """A figure as `report.chart_plotly` makes it: its colours are names.

    ``element.update_figure(figure)`` replaces it; a view that the reader has turned is kept.
    A handler of ``plotly_click`` gets ``points``, each with ``curveNumber`` and ``pointNumber``.
    """

    def __init__(self, figure: dict[str, Any]) -> None:
        super().__init__(_CONFIG | figure)
        self._props["colours"] = {
            "light": dict(LIGHT) | scale_colours(),
            "dark": dict(DARK) | scale_colours(dark=True),
        }

    def update(self) -> None:
        """Send the figure; it is replaced as a whole, never changed in place.

        NiceGUI would wrap every list of numbers in it, to notice changes.
        """
        dict.__setitem__(self._props, "options", self.figure)
        Element.update(self)

    def update_figure(self, figure: dict[str, Any]) -> None:
        """Replace the figure."""
        super().update_figure(_CONFIG | figure)


def plot(figure: dict[str, Any], description: str) -> ColouredPlot:
    """A Plotly figure given as a plain dict (``data``, ``layout``), in the colours of the page.

    Parameters
    ----------
    figure : dict
        As `report.chart_plotly.plotly_figure` makes it.
    description : str
        What it shows, for people who do not see it.
    """
    with ui.element("figure").classes("plot") as frame:
        frame.props["aria-label"] = description
        return ColouredPlot(figure).classes("plot-area")


def load_plots_ahead() -> None:
    """Let the browser load the script of pictures before the first picture is there."""
    ColouredPlot({}).classes("hidden-loader").props('aria-hidden="true"')
