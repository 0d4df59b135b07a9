"""Finite elements of a design: computed on demand, and the stress in a chosen direction."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import ui

from pretravel.app import (
    WORKS,
    ScreenState,
    Work,
    choice_field,
    here,
    key_figures,
    live,
    note,
    outcome,
    plot,
    rebuild,
    slider_field,
    table_view,
    text,
    verdict_card,
)
from pretravel.base import PretravelError
from pretravel.design.screen.description import is_saved, same_of_design
from pretravel.design.screen.work import (
    DESIGNS,
    FINITE_ELEMENTS,
    ComparedDesigns,
    FiniteElementDesign,
    FiniteElementDesigns,
)
from pretravel.task import Task, task_named

if TYPE_CHECKING:
    from pretravel.show import KeyFigure

_AZIMUTH, _POLAR, _OF = "stress_azimuth", "stress_polar", "stress_of"
_OTHER, _DESIGN = "A", "B"


def elements_view(state: ScreenState) -> None:
    """The button, the progress and the result of finite elements."""
    note(
        "The pictures of force and pretravel come from the analytic model: the stylus as a beam, "
        "the seats as elastic contacts. Finite elements also bend the hub and the rods, and give "
        "the stress. Both designs are computed; a new shape takes up to half a minute."
    )
    designs = WORKS.of(state, DESIGNS)
    work = outcome(
        state,
        FINITE_ELEMENTS,
        lambda result: _show(state, result),
        button="Compute with finite elements",
    )
    live(
        [designs.listen, work.listen],
        lambda: _expected(designs, work),
        lambda: (id(designs.result), work.result is None),
    )


def _expected(designs: Work[ComparedDesigns], work: Work[FiniteElementDesigns]) -> None:
    """What will be there, before the first result."""
    from pretravel.design.tasks.compare.designs_report import elements_comparison_table

    compared: ComparedDesigns | None = designs.result
    if work.result is not None or compared is None:
        return
    note(
        "The empty columns of this table get the values of finite elements, with the highest "
        "stress; the pictures of force and pretravel get their rings. The bent probe with its "
        "stress at the trigger then appears here, in the direction that you choose."
    )
    table_view(elements_comparison_table((compared.other.trigger, compared.design.trigger)))


def _show(state: ScreenState, result: FiniteElementDesigns) -> None:
    document = result.document()
    verdict_card(document.verdict)
    for table in document.tables:
        table_view(table)
    for remark in document.notes:
        note(remark)
    note("Rings in the pictures of force and pretravel are the values of finite elements.")
    live([state.listen], lambda: _same(state, result.compared), lambda: _has_file(state, result))
    _stress(state, result)


def _has_file(state: ScreenState, result: FiniteElementDesigns) -> bool:
    return is_saved(state, result.compared.digest())


def _same(state: ScreenState, compared: ComparedDesigns) -> None:
    compare: Callable[..., Task] = task_named("compare")
    task = compare(
        map_file=compared.other_name,
        other=compared.source,
        model="fem",
        output=Path("design-elements.html"),
    )
    same_of_design(state, compared.source, compared.digest(), task)


def _stress(state: ScreenState, result: FiniteElementDesigns) -> None:
    """The stress of one of the designs in a direction that the user chooses."""
    text("h3", "Stress at the trigger")
    with ui.element("div").classes("field-row"):
        choice_field(state, _OF, "Design", {_OTHER: "A", _DESIGN: "B"}, default=_DESIGN)
        slider_field(state, _AZIMUTH, "Azimuth of the push on the tip (0° = to +X)", unit="°",
                     limits=(0.0, 355.0), step=5.0, default=0.0)  # fmt: skip
        slider_field(state, _POLAR, "Polar angle of the push (90° = from a wall)", unit="°",
                     limits=(0.0, 90.0), step=5.0, default=90.0)  # fmt: skip
    figures = ui.element("div").classes("live")
    picture = plot({"data": [], "layout": {}}, "Stress of the bent probe at the trigger")
    remark = text("p", "", "note")
    picture.parent_slot.parent.classes("tall")  # type: ignore[union-attr]
    shown: list[Any] = []

    def wanted() -> list[Any]:
        angles = (float(state.settings.get(*each)) for each in ((_POLAR, 90.0), (_AZIMUTH, 0.0)))
        return [state.settings.get(_OF, _DESIGN), *angles]

    async def draw() -> None:
        of, polar, azimuth = shown[:] = wanted()
        design = result.other if of == _OTHER else result.design
        try:
            found = await asyncio.to_thread(stress_figures, design, polar, azimuth)
        except PretravelError as error:
            remark.set_text(str(error))
            return
        if picture.is_deleted:
            return
        figure, listed = found
        picture.update_figure(figure)
        remark.set_text("")
        rebuild(figures, lambda: key_figures(listed))

    request = one_at_a_time(draw)
    request()
    here([state.listen], lambda: request() if shown != wanted() else None)


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

    Raises
    ------
    PretravelError
        The probe never triggers in that direction.
    """
    import math

    from pretravel.base import MICROMETRE, from_angles
    from pretravel.design.fem.elastic_field import field_at_trigger
    from pretravel.design.tasks.fem.picture import trigger_field_view
    from pretravel.design.tasks.fem.report import contact_figures
    from pretravel.show import KeyFigure, decimals, plotly_figure

    normal = from_angles(math.radians(polar_deg), math.radians(azimuth_deg))[0]
    field = field_at_trigger(result.predicted.probe, normal, result.reduced)
    bent = trigger_field_view(field).charts[0]
    trigger = field.trigger
    listed = (
        KeyFigure("trigger force", float(trigger.force[0]), "N", decimals(3)),
        KeyFigure("pretravel", float(trigger.pretravel[0]) / MICROMETRE, "µm"),
        KeyFigure("opened seat", " and ".join(field.opened)),
        KeyFigure("highest stress of the bodies", float(field.stress.max()), "MPa", decimals(1),
                  remark=f"at rest {field.rest_stress.max():.1f} MPa"),
        *contact_figures(field),
    )  # fmt: skip
    return plotly_figure(bent), listed
