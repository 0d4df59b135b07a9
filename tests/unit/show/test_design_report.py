"""The picture of a front of designs."""

from __future__ import annotations

import numpy as np

from pretravel.base.toml_file import parse_toml
from pretravel.design.studies.design_search import FoundDesign, TriedDesign, tried_design
from pretravel.design.studies.wish import wish_in
from pretravel.design.tasks.design.report import design_document, front_chart
from pretravel.prediction.catalogue import load_probe
from pretravel.show.chart_marks import Dots, LineMark, Rule

TEXT = """
[wish]
most = "trigger_force_least"
{second}
[[free]]
key = "spring.preload_N"
range = [2.0, 12.0]
[[limit]]
of = "pretravel_greatest"
at_most = 9.0
[prediction]
model = "shen"
"""
FORCES, PRETRAVEL = (0.4, 0.8, 1.2), (3.0, 6.0, 9.0)


def _found(second: str = 'and_least = "pretravel_greatest"') -> FoundDesign:
    probe = load_probe("omp40-2")
    tried = [
        TriedDesign(
            {"spring.preload_N": 10.0 * force},
            probe,
            {"trigger_force_least": force, "pretravel_greatest": travel},
        )
        for force, travel in zip(FORCES, PRETRAVEL, strict=True)
    ]
    wish = wish_in(parse_toml(TEXT.format(second=second), "wish.toml"))
    return FoundDesign(wish, tried[2], tried[1], tuple(tried) if second else (), 30)


def test_the_front_is_the_main_picture() -> None:
    assert "two goals" in design_document(_found()).pictures[0].caption
    assert len(design_document(_found("")).pictures) == 1


def test_the_report_predicts_the_best_design_with_its_own_conditions() -> None:
    """Also where the model is free; its seats of 60° have balls that overlap."""
    text = TEXT.format(second="") + '[[free]]\nkey = "prediction.model"\nvalues = ["shen", "ren"]\n'
    text += '[[free]]\nkey = "seats.support_angle_deg"\nrange = [20.0, 70.0]\n'
    levels: dict[str, float | str] = {
        "spring.preload_N": 5.0, "prediction.model": "ren", "seats.support_angle_deg": 60.0,
    }  # fmt: skip
    wish = wish_in(parse_toml(text, "wish.toml"))
    one = tried_design(wish, levels)
    shown = design_document(FoundDesign(wish, one, one, (), 1))
    assert shown.notes[0].startswith("Predicted by model ren.")
    assert "A-left and A-right, of radius 3.5 mm, overlap" in shown.warnings[0]


def test_a_front_shows_its_designs_the_start_and_the_limits() -> None:
    chart = front_chart(_found())
    assert (chart.x.text, chart.y.text) == ("trigger force least / N", "pretravel greatest / µm")
    (line,) = (mark for mark in chart.marks if isinstance(mark, LineMark))
    assert np.array_equal(line.x, FORCES)
    assert np.array_equal(line.y, PRETRAVEL)
    best, start = (mark for mark in chart.marks if isinstance(mark, Dots))
    assert best.labels == ("spring.preload_N 4", "spring.preload_N 8",
                           "spring.preload_N 12")  # fmt: skip
    assert (start.name, start.x.tolist(), start.y.tolist()) == ("start", [0.8], [6.0])
    (rule,) = (mark for mark in chart.marks if isinstance(mark, Rule))
    assert (rule.value, rule.upright) == (9.0, False)
