"""Report and picture of a tip that slides on a surface while it is deflected."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pretravel.base import MICROMETRE, BoolArray, FloatArray, PretravelError
from pretravel.design.probing.slide_history import SlideHistory
from pretravel.show import (
    Axis,
    Bars,
    Chart,
    Colour,
    Document,
    Dots,
    KeyFigure,
    LineMark,
    Moment,
    Picture,
    PlaneChart,
    Rule,
    SpaceArrow,
    SpaceChart,
    SpaceLines,
    SpaceMark,
    SpaceMesh,
    SpacePoints,
    Span,
    View,
    decimals,
    value_text,
)
from pretravel.six_seats import SEAT_NAMES
from pretravel.surface import Surface, tangent_basis

_MOST_MOMENTS = 200
"""Of a slider on a page; of more steps every second, third … is shown."""


def slide_document(
    history: SlideHistory,
    surface: Surface,
    *,
    title: str,
    lateral_pretravel: float = math.nan,
    pretravel: float = math.nan,
) -> Document:
    """The report of one touch, step by step.

    Parameters
    ----------
    history : SlideHistory
    surface : Surface
        That the tip slid on.
    title : str
        The probe, the surface and the place.
    lateral_pretravel, pretravel : float
        Of the same touch solved without steps: with the lateral deflection alone, and with
        every elastic part; not a number where there is no solution. [mm]
    """
    last = int(np.argmax(history.feed))
    triggers = bool(history.triggered.any())
    shown = int(np.argmin(np.where(history.triggered, history.feed, np.inf))) if triggers else last
    where = "at the first step beyond the trigger" if triggers else "at the last step"
    figures = [
        KeyFigure("deflection", history.deflection[shown] / MICROMETRE, "µm", decimals(3),
                  remark=where),
        KeyFigure(
            "slide",
            float(np.linalg.norm(history.contact[shown] - history.start)) / MICROMETRE,
            "µm",
            decimals(3),
            remark=f"of the contact from its first point, {where}",
        ),
        KeyFigure("followed to", history.feed[last] / MICROMETRE, "µm", decimals(3),
                  remark="travel of the spindle after first contact"),
    ]  # fmt: skip
    if triggers:
        travel = KeyFigure("pretravel", history.trigger_feed / MICROMETRE, "µm", decimals(3),
                           remark="travel from first contact to trigger, step by step")  # fmt: skip
        figures.insert(0, travel)
    for name, value, parts in (
        ("without steps, lateral", lateral_pretravel,
         "pretravel if the tip deflects across the probe axis only"),
        ("without steps, full", pretravel,
         "pretravel with every elastic part, as pretravel predict computes it"),
    ):  # fmt: skip
        if not math.isnan(value):
            figures.append(KeyFigure(name, value / MICROMETRE, "µm", decimals(3), remark=parts))
    return Document(
        title=title,
        verdict=f"{title}: {_outcome(history)}",
        figures=tuple(figures),
        pictures=(Picture("The contact slides", lambda: slide_view(history, surface, title)),),
        notes=_notes(history),
    )


def _outcome(history: SlideHistory) -> str:
    if history.search == "golden":
        found = "triggers" if history.triggered.any() else "no trigger"
        return f"{len(history)} trials of a golden section, {found}"
    if not history.triggered.any():
        return f"{len(history)} steps, no trigger"
    first = int(np.argmax(history.triggered))
    return f"{len(history)} steps, triggers in step {history.step[first]}"


def _notes(history: SlideHistory) -> tuple[str, ...]:
    if not history.triggered.any():
        return ("there is no trigger within these steps; take more or larger ones",)
    if history.search != "golden" and history.triggered[0]:
        return ("the first step goes beyond the trigger; smaller steps show the way to it",)
    return ()


def slide_view(history: SlideHistory, surface: Surface, title: str = "") -> View:
    """A tip that slides: its contact on the surface in space, deflection and force over feed.

    Parameters
    ----------
    history : SlideHistory
    surface : Surface
        That it slid on.
    title : str
    """
    charts: tuple[Chart, ...] = (
        slide_chart(history, surface),
        *([_seats_by_step(history), _seats_over_feed(history)] if _any_known(history) else []),
        *_curves(history),
    )
    return View(title or "A tip slides", charts)


def slide_step_view(history: SlideHistory, surface: Surface, tip_radius: float, step: int) -> View:
    """One step of a slide: the state in space, and its place on the curves over the feed.

    Parameters
    ----------
    history : SlideHistory
    surface : Surface
        That it slid on.
    tip_radius : float
        [mm]
    step : int
        From 1.

    Returns
    -------
    View
        In space, in µm from first contact: the contact with its normal, and how far spindle and
        tip centre have moved; the line between these two is the deflection (C - P).

    Raises
    ------
    PretravelError
        A step that the slide does not have.
    """
    row = _row(history, step)
    chart = slide_chart(history, surface, f"step {step} of {len(history)}")
    normal = surface.local(surface.nearest(history.start[None])).normal[0]
    rest = history.start + tip_radius * normal
    here, spindle, center = (
        (place[row] - origin) / MICROMETRE
        for place, origin in (
            (history.contact, history.start),
            (history.spindle, rest),
            (history.center, rest),
        )
    )
    arrow = next(mark for mark in chart.marks if isinstance(mark, SpaceArrow))
    length = float(np.linalg.norm(arrow.vector))
    origin = np.zeros(3)

    def line(start: FloatArray, end: FloatArray, name: str, colour: Colour) -> SpaceLines:
        return SpaceLines(start[None], end[None], name, colour, 2.5)

    state: tuple[SpaceMark, ...] = (
        SpacePoints(here[None], "contact now", "ink", None, "ring", 9.0),
        SpaceArrow(here, length * history.normal[row], "normal", "series2"),
        line(origin, spindle, "movement of the spindle", "series2"),
        line(origin, center, "movement of the tip centre", "series3"),
        line(spindle, center, "deflection", "limit"),
    )
    kept = tuple(mark for mark in chart.marks if not isinstance(mark, SpaceArrow))
    here_now = replace(chart, marks=kept + state)
    return View(chart.title, (here_now, _seats_now(history, row), *_curves(history, row)))


def _seats_by_step(history: SlideHistory) -> PlaneChart:
    """The seats at the first step; a page has a slider for the others."""
    rows = np.arange(len(history))
    shown = rows[:: math.ceil(len(rows) / _MOST_MOMENTS)]
    charts = [_seats_now(history, int(row)) for row in shown]
    moments = tuple(
        Moment(f"step {history.step[row]}, feed {history.feed[row] / MICROMETRE:.2f} µm", own.marks)
        for row, own in zip(shown, charts, strict=True)
    )
    return replace(charts[0], moments=moments)


def _seats_now(history: SlideHistory, row: int) -> PlaneChart:
    """Status and penetration of the six seats at one step (Rodrigues 2021, Figure 2.8)."""
    known = ~bool(history.triggered[row])
    penetration = history.penetration[row] / MICROMETRE if known else np.zeros(6)
    texts = tuple(_status(history, row, seat) for seat in range(6))
    bars = Bars(np.arange(6.0), penetration, "penetration", texts=texts)
    highest = 1.2 * float(np.nanmax(history.penetration / MICROMETRE)) if _any_known(history) else 0
    seats = Axis("seat", categories=SEAT_NAMES)
    return PlaneChart("status and penetration of the seats", seats,
                      Axis("penetration", "µm", 0.0, highest or 1.0), (bars,))  # fmt: skip


def _status(history: SlideHistory, row: int, seat: int) -> str:
    if not history.triggered[row]:
        return "closed"
    return "open" if history.open_seat[row] == seat else "not known"


def _any_known(history: SlideHistory) -> bool:
    return bool(np.isfinite(history.penetration).any())


_RODS: tuple[Colour, ...] = ("series1", "series2", "series3")


def _seats_over_feed(history: SlideHistory) -> PlaneChart:
    """Penetration of the six seats until the trigger."""
    order = np.argsort(history.feed)
    known = order[np.isfinite(history.force[order])]
    feed = history.feed[known] / MICROMETRE
    lines = tuple(
        LineMark(feed, history.penetration[known, seat] / MICROMETRE, name, _RODS[seat // 2],
                 dashed=bool(seat % 2), marked=True)
        for seat, name in enumerate(SEAT_NAMES)
    )  # fmt: skip
    axis = Axis("feed since first contact", "µm", 0.0)
    return PlaneChart("penetration of the seats", axis, Axis("penetration", "µm", 0.0), lines)


def slide_step_figures(history: SlideHistory, step: int) -> tuple[KeyFigure, ...]:
    """The state of one step in numbers.

    Parameters
    ----------
    history : SlideHistory
    step : int
        From 1.

    Raises
    ------
    PretravelError
        A step that the slide does not have.
    """
    row = _row(history, step)
    after = bool(history.triggered[row])
    force = KeyFigure("force", float(history.force[row]), "N", decimals(4))
    return (
        KeyFigure("step", f"{step} of {len(history)}",
                  remark="after the trigger" if after else "before the trigger"),
        KeyFigure("feed", history.feed[row] / MICROMETRE, "µm", decimals(3)),
        KeyFigure("deflection", history.deflection[row] / MICROMETRE, "µm", decimals(3)),
        KeyFigure("force", "a seat is open") if after else force,
        *_seat_figures(history, row),
        *(
            KeyFigure(name, tuple(place[row].tolist()), "mm", decimals(5))
            for name, place in (
                ("contact point (T)", history.contact),
                ("tip centre (C)", history.center),
                ("spindle (P)", history.spindle),
            )
        ),
        KeyFigure("normal", tuple(history.normal[row].tolist()), "", decimals(6)),
    )  # fmt: skip


def _seat_figures(history: SlideHistory, row: int) -> tuple[KeyFigure, ...]:
    if history.triggered[row]:
        return (KeyFigure("open seat", SEAT_NAMES[int(history.open_seat[row])]),)
    pressed = history.penetration[row] / MICROMETRE
    return (
        KeyFigure("seats", "all closed"),
        KeyFigure("penetration", Span(float(pressed.min()), float(pressed.max())), "µm",
                  remark="of the seats, by Hertz's law"),
    )  # fmt: skip


def _row(history: SlideHistory, step: int) -> int:
    rows = np.flatnonzero(history.step == step)
    if not len(rows):
        raise PretravelError(
            f"the slide has no step {step}: its steps are 1 to {len(history)}", inputs=("step",)
        )
    return int(rows[0])


def _curves(history: SlideHistory, row: int | None = None) -> list[PlaneChart]:
    """Deflection and force over the feed, with a ring at one step."""
    order = np.argsort(history.feed)  # a golden section search goes to and fro
    feed = _from_zero(history.feed[order] / MICROMETRE)
    axis = Axis("feed since first contact", "µm", 0.0)
    trigger: tuple[Rule, ...] = ()
    if np.isfinite(history.trigger_feed):
        at = history.trigger_feed / MICROMETRE
        trigger = (Rule(at, f"trigger, {value_text(at, 'µm')}", "limit", upright=True),)
    deflection = LineMark(feed, _from_zero(history.deflection[order] / MICROMETRE), "deflection",
                          marked=True)  # fmt: skip
    itself = LineMark(feed, feed, "feed itself", "reference", dashed=True)
    bent: list[LineMark | Rule | Dots] = [itself, deflection, *trigger]
    bent += _ring(history, row, history.deflection / MICROMETRE)
    charts = [
        PlaneChart("deflection of the stylus", axis, Axis("deflection", "µm", 0.0), tuple(bent))
    ]
    known = order[np.isfinite(history.force[order])]
    if len(known):
        fed = _from_zero(history.feed[known] / MICROMETRE)
        force = LineMark(fed, _from_zero(history.force[known]), "force", "series2", marked=True)
        marks: list[LineMark | Rule | Dots] = [force, *trigger, *_ring(history, row, history.force)]
        charts.append(PlaneChart("contact force", axis, Axis("force", "N", 0.0), tuple(marks)))
    return charts


def _ring(history: SlideHistory, row: int | None, values: FloatArray) -> tuple[Dots, ...]:
    if row is None or not np.isfinite(values[row]):
        return ()
    at = history.feed[row : row + 1] / MICROMETRE
    return (Dots(at, values[row : row + 1], "this step", "ink", symbol="ring", size=10.0),)


def _from_zero(values: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], values])


def slide_chart(history: SlideHistory, surface: Surface, title: str = "") -> SpaceChart:
    """The path of the contact on a patch of the surface, in µm from its first point."""
    way = (history.contact - history.start) / MICROMETRE
    reach = 0.8 * max(float(np.linalg.norm(way, axis=1).max()), 2.0)
    patch = _patch(history, surface, way, reach)
    rows = np.arange(patch.shape[0] * patch.shape[1]).reshape(patch.shape[:2])
    first, second = rows[:-1, :-1].ravel(), rows[:-1, 1:].ravel()
    third, fourth = rows[1:, 1:].ravel(), rows[1:, :-1].ravel()
    triangles = np.concatenate(
        [np.stack([first, second, third], axis=1), np.stack([first, third, fourth], axis=1)]
    )
    path = np.concatenate([np.zeros((1, 3)), way])
    late = history.triggered
    labels = tuple(
        f"step {step}: feed {feed / MICROMETRE:.2f} µm"
        for step, feed in zip(history.step.tolist(), history.feed.tolist(), strict=True)
    )
    marks: list[SpaceMark] = [
        SpaceMesh(patch.reshape(-1, 3), triangles, "surface", opacity=0.6),
        SpaceLines(path[:-1], path[1:], "path of the contact", "reference", 1.2),
        SpacePoints(np.zeros((1, 3)), "first contact", "ink", None, "cross", 7.0),
    ]
    stages: tuple[tuple[BoolArray, Colour, str], ...]
    stages = ((~late, "series1", "until the trigger"), (late, "limit", "after the trigger"))
    for which, colour, name in stages:
        if which.any():
            own = tuple(label for label, shown in zip(labels, which, strict=True) if shown)
            marks.append(SpacePoints(way[which], name, colour, None, "dot", 4.0, own))
    marks.append(SpaceArrow(way[0], 0.5 * reach * history.normal[0], "normal", "series2"))
    heading = title or "contact on the surface, from its first point"
    return SpaceChart(heading, tuple(marks), "part", "µm")


def _patch(history: SlideHistory, surface: Surface, way: FloatArray, reach: float) -> FloatArray:
    """Points of the surface around the path of the contact, in µm from its first point."""
    furthest = way[np.argmax(np.linalg.norm(way, axis=1))]
    middle = history.start + 0.5 * furthest * MICROMETRE
    tangents = tangent_basis(history.normal[:1])[0]
    side = np.linspace(-reach, reach, 13) * MICROMETRE
    p, q = np.meshgrid(side, side)
    flat = middle + p.ravel()[:, None] * tangents[0] + q.ravel()[:, None] * tangents[1]
    found = surface.local(surface.nearest(flat)).point
    return np.asarray((found - history.start) / MICROMETRE).reshape(*p.shape, 3)
