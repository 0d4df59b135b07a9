"""Finite elements of a design: computed on demand, and the stress in a chosen direction."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nicegui import ui

from pretravel.app.components.document_view import key_figures, plot
from pretravel.app.components.fields import slider_field
from pretravel.app.components.layout import here, note, text
from pretravel.app.components.outcome import outcome
from pretravel.app.project import ScreenState
from pretravel.app.screens.designer_work import FINITE_ELEMENTS, FiniteElementDesign
from pretravel.base.errors import PretravelError

if TYPE_CHECKING:
    from pretravel.show.document import KeyFigure

_AZIMUTH, _POLAR = "stress_azimuth", "stress_polar"


def elements_view(state: ScreenState) -> None:
    """The button, the progress and the result of finite elements.

    Parameters
    ----------
    state : ScreenState
    """
    note(
        "The pictures above are of the model analytic: the stylus as a beam, the seats as elastic "
        "contacts. Finite elements also bend the hub and the rods, and give the stress. They take "
        "about half a minute for a new shape."
    )
    outcome(
        state,
        FINITE_ELEMENTS,
        lambda result: _show(state, result),
        button="Compute with finite elements",
    )


def _show(state: ScreenState, result: FiniteElementDesign) -> None:
    key_figures(result.predicted.document().figures)
    note("Rings in the pictures of force and pretravel above are these values.")
    text("h3", "Stress at the trigger")
    with ui.element("div").classes("field-row"):
        slider_field(state, _AZIMUTH, "Azimuth of the push on the tip (0° = to +X)", unit="°",
                     limits=(0.0, 355.0), step=5.0, default=0.0)  # fmt: skip
        slider_field(state, _POLAR, "Polar angle of the push (90° = from a wall)", unit="°",
                     limits=(0.0, 90.0), step=5.0, default=90.0)  # fmt: skip
    figures = ui.element("div").classes("live")
    picture = plot({"data": [], "layout": {}}, "Stress of the bent probe at the trigger")
    remark = text("p", "", "note")
    picture.parent_slot.parent.classes("tall")  # type: ignore[union-attr]
    shown: list[Any] = []

    def direction() -> list[float]:
        return [float(state.settings.get(_POLAR, 90.0)), float(state.settings.get(_AZIMUTH, 0.0))]

    async def draw() -> None:
        polar, azimuth = shown[:] = direction()
        try:
            found = await asyncio.to_thread(stress_figures, result, polar, azimuth)
        except PretravelError as error:
            remark.set_text(str(error))
            return
        if picture.is_deleted:
            return
        figure, listed = found
        picture.update_figure(figure)
        remark.set_text("")
        figures.clear()
        with figures:
            key_figures(listed)

    request = one_at_a_time(draw)
    request()
    here([state.listen], lambda: request() if shown != direction() else None)


def one_at_a_time(work: Callable[[], Any]) -> Callable[[], None]:
    """Work that is asked for while it runs is done once more after it.

    Parameters
    ----------
    work : callable
        A coroutine function.

    Returns
    -------
    callable
        Asks for the work; to call in the event loop.
    """
    running: list[asyncio.Task[None]] = []
    again: list[bool] = []

    async def run() -> None:
        try:
            again[:] = [True]
            while again:
                again.clear()
                await work()
        finally:
            running.clear()

    def request() -> None:
        if running:
            again[:] = [True]
        else:
            running[:] = [asyncio.get_running_loop().create_task(run())]

    return request


def stress_figures(
    result: FiniteElementDesign, polar_deg: float, azimuth_deg: float
) -> tuple[dict[str, Any], tuple[KeyFigure, ...]]:
    """The stress at the trigger in a direction: Plotly's figure, key figures.

    Parameters
    ----------
    result : FiniteElementDesign
    polar_deg, azimuth_deg : float

    Raises
    ------
    PretravelError
        The probe never triggers in that direction.
    """
    import math

    from pretravel.base.directions import from_angles
    from pretravel.base.units import MICROMETRE
    from pretravel.prediction.elastic_field import field_at_trigger
    from pretravel.show.chart_plotly import plotly_figure
    from pretravel.show.document import KeyFigure
    from pretravel.show.formatting import decimals
    from pretravel.tasks.reports.finite_elements_picture import trigger_field_view

    normal = from_angles(math.radians(polar_deg), math.radians(azimuth_deg))[0]
    field = field_at_trigger(result.predicted.probe, normal, result.reduced)
    bent = trigger_field_view(field).charts[0]
    trigger = field.trigger
    listed = (
        KeyFigure("trigger force", float(trigger.force[0]), "N", decimals(3)),
        KeyFigure("pretravel", float(trigger.pretravel[0]) / MICROMETRE, "µm"),
        KeyFigure("opened seat", " and ".join(field.opened)),
        KeyFigure("highest stress", float(field.stress.max()), "MPa", decimals(1), remark="at rest "
                  f"{field.rest_stress.max():.1f} MPa"),
    )  # fmt: skip
    return plotly_figure(bent), listed
