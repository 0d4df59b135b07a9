"""predict, compare and study show the quantity of the thesis: Figures 4.7 to 4.16, 4.27 to 4.36."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import grid
from pretravel.design.studies.definition import STUDIES
from pretravel.design.studies.results_file import read_results
from pretravel.design.tasks.compare.designs import compare_designs
from pretravel.design.tasks.compare.designs_report import design_comparison_view
from pretravel.design.tasks.predict import Predict
from pretravel.design.tasks.predict.view import prediction_view
from pretravel.design.tasks.study.report import study_document
from pretravel.prediction.catalogue import description_text, load_probe, parse_probe
from pretravel.prediction.trigger import predict
from pretravel.show.chart import PlaneChart, PolarChart
from pretravel.show.chart_marks import LineMark
from tests.support.commands import run
from tests.support.pictures import coloured_share
from tests.support.statics_by_hand import direction, first_contact_force


def _lines(chart: object) -> dict[str, LineMark]:
    assert isinstance(chart, (PlaneChart, PolarChart))
    return {mark.name: mark for mark in chart.marks if isinstance(mark, LineMark)}


def test_predict_draws_force_and_sensing_distance_over_azimuth(tmp_path: Path) -> None:
    """Figures 4.7 and 4.28 with one's own probe in one command: Table 2.3 of the thesis prints
    19.36 and 33.79 µm, forces by hand with a lever of 100 mm."""
    told = run("predict", "omp40-2-100mm", "--model", "shen", "--lever", 100, "--polar", "90",
               "--azimuth", "0:350:10", "--quantity", "sensing_distance",
               "--plot", tmp_path / "p.png")  # fmt: skip
    assert "sensing distance" in told.splitlines()[0]
    assert "pretravel" not in told.splitlines()[0]
    assert coloured_share(tmp_path / "p.png") > 0.001
    made = Predict(
        probe="omp40-2-100mm", model="shen", lever=100.0, polar="90", azimuth="0:350:10"
    ).run()
    force, distance = prediction_view(made.trigger, "", "sensing_distance").charts
    (line,) = _lines(distance).values()
    assert line.y[[0, 6]] == pytest.approx([19.36, 33.79], abs=0.005)
    (forces,) = _lines(force).values()
    by_hand = [first_contact_force(direction(90.0, a), 100.0) for a in (0.0, 60.0)]
    assert forces.y[[0, 6]] == pytest.approx(by_hand, rel=1e-9)
    (alone,) = prediction_view(made.trigger, "", "trigger_force").charts
    assert alone.title == force.title == "trigger force over azimuth"


def test_figure_4_16_has_a_line_for_each_azimuth() -> None:
    made = Predict(probe="omp40-2", polar="10:80:10", azimuth="0,20,40,60").run()
    charts = prediction_view(made.trigger, "", "sensing_distance").charts
    (over,) = [c for c in charts if "sensing distance over the polar" in str(c.title)]
    lines = _lines(over)
    assert list(lines) == [f"azimuth {a}°" for a in (0, 20, 40, 60)]
    one = predict(load_probe("omp40-2"), [direction(p, 40.0) for p in range(10, 81, 10)])
    assert lines["azimuth 40°"].y == pytest.approx(1e3 * one.sensing_distance)
    assert lines["azimuth 40°"].x.tolist() == pytest.approx(list(range(10, 81, 10)))


def test_compare_draws_the_sensing_distance_of_both(tmp_path: Path) -> None:
    """Figure 4.28: 100 against 50 mm."""
    names = ("omp40-2-100mm", "omp40-2")
    both = compare_designs(*names)
    force, distance, *_ = design_comparison_view(both.triggers, names, "sensing_distance").charts
    for line, trigger in zip(_lines(distance).values(), both.triggers, strict=True):
        walls = np.abs(trigger.directions[:, 2]) < 1e-9
        assert line.y.max() == pytest.approx(1e3 * trigger.sensing_distance[walls].max())
    assert len(_lines(force)) == 2
    told = run("compare", *names, "--quantity", "sensing_distance", "-o", tmp_path / "c.html")
    assert "the sensing distance of B is" in told
    assert "quantity" in run("compare", "map.json", "--quantity", "sensing_distance", code=2)


def test_a_study_of_one_number_draws_a_curve_for_each_level(tmp_path: Path) -> None:
    """Figure 4.36, 5.91 and 4 N: without friction the forces are in proportion to the preload."""
    study = tmp_path / "s.nc"
    told = run("study", "spring-preload", "-o", study, "--quantity", "sensing_distance")
    assert "sensing distance greatest" in told
    pictures = study_document(read_results(study), "sensing_distance").pictures
    (curves,) = [p for p in pictures if p.caption == "sensing distance over the azimuth"]
    force, distance = curves.view.charts
    low, high = (mark.y for mark in _lines(force).values())
    assert low / high == pytest.approx(np.full(len(low), 4.0 / 5.91))
    assert [name.split(": ")[-1] for name in _lines(distance)] == [
        "preload 4.00 N",
        "preload 5.91 N",
    ]


def test_a_study_of_two_numbers_draws_a_line_for_each_level(tmp_path: Path) -> None:
    text = STUDIES.text("preload-and-seats").replace("levels = 7", "levels = 3")
    text = text.replace('outputs = ["force", "sensing-distance", "pretravel", "corrections"]',
                        'outputs = ["sensing-distance"]')  # fmt: skip
    (tmp_path / "two.toml").write_text(text, encoding="utf-8")
    run("study", tmp_path / "two.toml", "-o", tmp_path / "two.nc")
    document = study_document(read_results(tmp_path / "two.nc"), "sensing_distance")
    _, chart = document.pictures[0].view.charts  # the first one has contours
    lines = _lines(chart)
    assert len(lines) == 3
    for line in lines.values():
        assert line.x.tolist() == [4.0, 5.0, 5.91, 7.0, 8.0]
        assert np.all(np.diff(line.y) > 0.0)  # more preload, more bending
    # The greatest of all directions, of each design described by hand.
    text = description_text("omp40-2")
    directions = grid(
        np.radians(np.arange(10.0, 91.0, 10.0)), np.radians(np.arange(0.0, 351.0, 10.0))
    )
    for angle, line in zip((20.0, 35.0, 50.0), lines.values(), strict=True):
        own = re.sub(r"(?m)^support_angle_deg = .*$", f"support_angle_deg = {angle}", text)
        for preload, greatest in zip(line.x, line.y, strict=True):
            design = re.sub(r"(?m)^preload_N = [0-9.]+", f"preload_N = {preload}", own)
            found = predict(parse_probe(design), directions, model="analytic").sensing_distance
            assert greatest == pytest.approx(1e3 * found.max(), rel=1e-9)
    told = run("study", tmp_path / "two.nc", "--quantity", "trigger_force", code=2)
    assert "has no trigger force among its outputs" in told
