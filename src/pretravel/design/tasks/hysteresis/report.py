"""Report and picture of touches with friction at the seats: hysteresis and drift."""

from __future__ import annotations

import numpy as np

from pretravel.base import MICROMETRE, FloatArray
from pretravel.design.friction.seat_friction import FrictionCycle
from pretravel.show import (
    Axis,
    Bars,
    Colour,
    Column,
    Document,
    Dots,
    KeyFigure,
    LineMark,
    Mark,
    Picture,
    PlaneChart,
    Rule,
    Span,
    Table,
    View,
    angles_deg,
    azimuth_axis,
    decimals,
    direction_words,
    series,
    significant,
    value_text,
)

_MEANT = {
    "drift": "of the rest position, since the start",
    "reseat": "rest position after this touch from that before it",
}


def friction_document(cycle: FrictionCycle, probe_name: str, *, assumed: bool = False) -> Document:
    """The report of repeated touches with friction at the seats.

    Parameters
    ----------
    cycle : FrictionCycle
    probe_name : str
    assumed : bool
        Whether the friction is neither stated nor in the description.
    """
    touches = cycle.trigger_force.shape[1]
    title = f"{probe_name}, friction {cycle.friction:g}"
    quantities = _quantities(cycle)
    return Document(
        title=title,
        verdict=f"{probe_name}, seats with friction {cycle.friction:g}"
        f"{' (assumed: the description has none)' if assumed else ''}: hysteresis up to "
        f"{_largest(cycle.hysteresis)}, drift of zero up to {_largest(cycle.zero_drift)} "
        f"({touches} {'touch' if touches == 1 else 'touches'} in {len(cycle.directions)} "
        f"{'direction' if len(cycle.directions) == 1 else 'directions'})",
        figures=tuple(
            KeyFigure(
                f"{name}, touch {touch}",
                Span.of(values),
                unit,
                decimals(3),
                remark=_MEANT.get(name, ""),
            )
            for name, touch, values, unit in quantities
        ),
        tables=(_direction_table(cycle, quantities),),
        pictures=(
            Picture("Touch and return, hysteresis and drift", lambda: friction_view(cycle, title)),
        ),
    )


def _largest(lengths: FloatArray) -> str:
    """The largest of the last touch, without its sign."""
    return value_text(float(np.abs(lengths[:, -1]).max()) / MICROMETRE, "µm", decimals(3))


def _quantities(cycle: FrictionCycle) -> list[tuple[str, int, FloatArray, str]]:
    """Name, touch, values over the directions and unit, for the first touch and the last."""
    last = cycle.trigger_force.shape[1]
    quantities = [
        ("force", 1, cycle.trigger_force[:, 0], "N"),
        ("force", last, cycle.trigger_force[:, last - 1], "N"),
        ("closing force", last, cycle.reseat_force[:, last - 1], "N"),
        ("hysteresis", last, cycle.hysteresis[:, last - 1] / MICROMETRE, "µm"),
        ("drift", 1, cycle.zero_drift[:, 0] / MICROMETRE, "µm"),
        ("drift", last, cycle.zero_drift[:, last - 1] / MICROMETRE, "µm"),
        ("reseat", last, cycle.reseat_error[:, last - 1] / MICROMETRE, "µm"),
    ]
    return list({each[:2]: each for each in quantities}.values())  # the first can be the last


def _direction_table(
    cycle: FrictionCycle, quantities: list[tuple[str, int, FloatArray, str]]
) -> Table:
    polar, azimuth = angles_deg(cycle.directions)
    shown = sorted({touch for _, touch, *_ in quantities})
    return Table(
        (
            Column.of("polar", polar, "°", significant(6)),
            Column.of("azimuth", azimuth, "°", significant(6)),
            *(
                Column.of(f"{name} {touch}", values, unit, decimals(3))
                for name, touch, values, unit in quantities
            ),
        ),
        title=f"{' and '.join(f'touch {n}' for n in shown).capitalize()} in each direction",
        explanation="force: on the tip when the first seat opens; closing force: when the last "
        "seat closes on the return; hysteresis: deflection at opening minus that at reseating; "
        "drift: shift of the tip's rest position along the normal since the start; reseat: "
        "distance from the rest position before this touch.",
        detail=True,
    )


def friction_view(cycle: FrictionCycle, title: str = "") -> View:
    """Force over deflection, and hysteresis and drift in each direction."""
    return View(title, (_loops_chart(cycle), _directions_chart(cycle)), 2)


def _loops_chart(cycle: FrictionCycle) -> PlaneChart:
    """Force over deflection in up to four directions that symmetry does not make alike."""
    polar, azimuth = angles_deg(cycle.directions)
    _, different = np.unique(np.round(cycle.trigger_force[:, -1], 4), return_index=True)
    shown = different[np.unique(np.linspace(0, len(different) - 1, 4).astype(int))]
    marks: list[Mark] = []
    for index, row in enumerate(shown):
        name = f"polar {polar[row]:.0f}°, azimuth {azimuth[row]:.0f}°"
        marks.append(LineMark(cycle.deflection[row] / MICROMETRE, cycle.force[row], name,
                              series(index), 1.2))  # fmt: skip
        labels = tuple(f"{name}: touch {touch}, a seat opens"
                       for touch in range(1, cycle.trigger_force.shape[1] + 1))  # fmt: skip
        marks.append(Dots(cycle.trigger_deflection[row] / MICROMETRE, cycle.trigger_force[row], "",
                          series(index), labels=labels))  # fmt: skip
    return PlaneChart("touch and return", Axis("deflection along the normal", "µm"),
                      Axis("force on the tip", "N", low=0.0), tuple(marks),
                      note="Dots: a seat opens.")  # fmt: skip


def _directions_chart(cycle: FrictionCycle) -> PlaneChart:
    """Hysteresis and drift in each direction."""
    words = direction_words(cycle.directions)
    rows, last = np.arange(len(words), dtype=np.float64), cycle.trigger_force.shape[1] - 1
    groups: tuple[tuple[str, FloatArray, Colour], ...] = (
        (f"trigger hysteresis, touch {last + 1}", cycle.hysteresis[:, last], "series1"),
        *((("zero drift after touch 1", cycle.zero_drift[:, 0], "series5"),) if last else ()),
        (f"zero drift after touch {last + 1}", cycle.zero_drift[:, last], "series4"),
    )
    if len(words) <= _MOST_BARS:
        bars = tuple(
            Bars(rows + 0.27 * (place - 1), values / MICROMETRE, name, colour, 0.25,
                 horizontal=True)
            for place, (name, values, colour) in enumerate(groups)
        )  # fmt: skip
        names = Axis("", categories=tuple(_short(word) for word in words))
        return PlaneChart("hysteresis and drift", Axis("length", "µm"), names, bars)
    azimuth = angles_deg(cycle.directions)[1]
    dots = tuple(
        Dots(azimuth, values / MICROMETRE, name, colour, labels=tuple(words))
        for name, values, colour in groups
    )
    return PlaneChart("hysteresis and drift", azimuth_axis(), Axis("length", "µm"),
                      (Rule(0.0), *dots))  # fmt: skip


def _short(words: str) -> str:
    """A direction with whole degrees where it has them.

    >>> _short("polar 90.0°, azimuth 22.5°")
    'polar 90°, azimuth 22.5°'
    """
    return words.replace(".0°", "°")


_MOST_BARS = 16
