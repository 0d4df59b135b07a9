"""Reports whose every text is an attack, and a plain one with charts and a wide table."""

from __future__ import annotations

import numpy as np

from pretravel.show.chart import Axis, PlaneChart, SpaceChart, View
from pretravel.show.chart_marks import Dots, LineMark, SpacePoints
from pretravel.show.document import Column, Document, KeyFigure, Picture, Section, Table
from pretravel.show.page_content import PageContent
from pretravel.show.work_record import InputFile, StatedSetting, WorkRecord

ATTACK = "<img src=x onerror=alert(1)></script><script>alert(2)</script>"
FORMULA = '=HYPERLINK("https://example.com";"click")'


def chart_view(label: str) -> View:
    """A plane chart and one in space, with a label everywhere."""
    places = np.arange(3.0)
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 2.0], [0.0, 3.0, 1.0]])
    line = LineMark(places, places**2, label)
    dots = Dots(places, places, label, labels=(label, "b", "c"))
    return View(
        label,
        (
            PlaneChart(label, Axis(label, "s"), Axis("force", "N"), (line, dots), note=label),
            SpaceChart(label, (SpacePoints(points, label, labels=(label, "b", "c")),)),
        ),
    )


def attacked_content() -> PageContent:
    """A report in which every text is an attack."""
    table = Table(
        (
            Column.of(ATTACK, [ATTACK, FORMULA, "-1.5"]),
            Column.of("value", [2.0, 1.0 / 3.0, np.nan], "µm"),
        ),
        title=ATTACK,
        explanation=ATTACK,
    )
    figures = (KeyFigure(ATTACK, ATTACK, remark=ATTACK), KeyFigure(ATTACK, 1.0, ATTACK, u=0.5))
    return PageContent(
        Document(
            title=ATTACK,
            verdict=ATTACK,
            figures=figures,
            tables=(table,),
            sections=(Section(ATTACK, (ATTACK,), figures, (table,)),),
            pictures=(Picture(ATTACK, lambda: chart_view(ATTACK)),),
            notes=(ATTACK,),
            warnings=(ATTACK,),
        ),
        WorkRecord(
            ATTACK,
            (InputFile(ATTACK, ATTACK, 1, ATTACK),),
            (StatedSetting(ATTACK, ATTACK, given=True, meaning=ATTACK),),
            ATTACK,
            ((ATTACK, ATTACK),),
        ),
        (ATTACK,),
    )


def plain_content(columns: int = 30) -> PageContent:
    """A report with key figures, a wide table and a picture to turn."""
    numbers = np.array([3.0, np.nan, 10.0, -2.0])
    names = Column.of("label", ["P3", "P1", "P10", "P2"])
    wide = tuple(Column.of(f"column {k}", 1000.0 * k + numbers, "µm") for k in range(1, columns))
    return PageContent(
        Document(
            "The probe on its sphere",
            "The probe is good: a touch repeats to 0.32 µm",
            (
                KeyFigure("pretravel", 12.5, "µm", u=0.25, remark="mean"),
                KeyFigure("map kind", "harmonic"),
            ),
            (Table((names, Column.of("value", numbers, "µm")), title="Points"),),
            (Section("All columns", tables=(Table((names, *wide), title="Wide"),)),),
            (Picture("Force over time", lambda: chart_view("force")),),
            ("a note",),
            ("a warning",),
        ),
        WorkRecord(
            "pretravel qualify sphere.csv",
            (InputFile("TOUCHES", "sphere.csv", 5124, "ab" * 32),),
            (StatedSetting("--diameter", "25", given=True, meaning="Diameter of the sphere"),),
            "2026-01-02T03:04:05+01:00",
            (("pretravel", "0.1.0"),),
        ),
    )
