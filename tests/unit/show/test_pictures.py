"""Pictures of comparisons, histories, verifications, identification and friction: their values."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import azimuth_angle, fibonacci_cap, polar_angle
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.controls.tasks.compare.report import comparison_view
from pretravel.design.friction.seat_friction import friction_cycle
from pretravel.design.identification.probe_from_map import Identification
from pretravel.design.tasks.hysteresis.report import friction_view
from pretravel.design.tasks.identify.report import identification_view
from pretravel.files.probe_history import add_verification, read_history
from pretravel.measurement.comparison import compare_corrections
from pretravel.prediction.catalogue import load_probe
from pretravel.show.chart import Axis, PlaneChart, PolarChart, View
from pretravel.show.chart_files import drawn_figure
from pretravel.show.chart_marks import Bars, Dots, LineMark, Rule
from pretravel.show.style import drawn_pixels
from pretravel.tasks.history.picture import history_view
from pretravel.tasks.verify.picture import verification_view
from tests.support.example_maps import example_map, lobes
from tests.unit.qualification.test_verification import check, old_map, touches


class TestComparison:
    def test_the_full_map_has_its_uncertainty_and_nothing_else_has_its_colour(self) -> None:
        result = compare_corrections(example_map(), fibonacci_cap(20, 1.0))
        curves, *places = comparison_view(result).charts
        assert len(places) == 3
        colours: dict[str, str] = {}
        for chart in places:
            assert isinstance(chart, PlaneChart)
            bars = [mark for mark in chart.marks if isinstance(mark, Bars)]
            assert chart.x.unit == "µm"
            for name, bar in zip(chart.y.categories, bars, strict=True):
                assert colours.setdefault(name, bar.colour) == bar.colour
                assert bar.values[0] > 0.0
            where = places.index(chart)
            u = [result.u["equator"], np.append(result.u["all"], result.u["equator"]),
                 result.u["part"]][where]  # fmt: skip
            assert bars[-1].values[0] == pytest.approx(2.0 * u.max() / MICROMETRE)
        assert (colours["tip radius alone"], colours["map"]) == ("before", "after")
        assert len(set(colours.values())) == len(colours)
        assert isinstance(curves, PlaneChart)
        for mark in curves.marks:
            if isinstance(mark, LineMark):
                assert mark.colour == colours[mark.name]

    def test_uncorrected_is_the_pretravel_itself(self) -> None:
        """Lobes of 1 mm on 10 mm: at most 11 mm on the equator."""
        result = compare_corrections(lobes(3))
        left = {(row.method, row.where): row.largest for row in result.rows}
        assert left["uncorrected", "equator"] == pytest.approx(11.0)

    def test_a_map_that_states_no_uncertainty(self) -> None:
        bars = comparison_view(compare_corrections(lobes(3))).charts[1]
        assert isinstance(bars, PlaneChart)
        assert "u not given" in bars.marks[-1].texts[0]  # type: ignore[union-attr]


class TestHistory:
    def test_a_test_stands_with_the_probability_that_means_a_change(self, tmp_path: Path) -> None:
        """Three tests share the false-alarm rate: the limit is a third of it."""
        path, result = tmp_path / "probe.jsonl", check(touches(1))
        start = datetime(2026, 1, 1, tzinfo=UTC)
        for day in range(9):
            add_verification(
                path, replace(result, touches_digest=f"{day}"), pretravel_map=old_map(),
                map_name="m", touches_name="t",
                decision="accepted new.json" if day == 4 else "kept",
                time=start + timedelta(days=day),
            )  # fmt: skip
        sizes, tests = history_view(read_history(path)).charts
        assert isinstance(sizes, PlaneChart)
        assert isinstance(tests, PlaneChart)
        limit, form = tests.marks[:2]
        assert isinstance(limit, LineMark)
        assert isinstance(form, Dots)
        assert limit.colour == "limit"
        assert limit.y == pytest.approx(100.0 * result.false_alarm_rate / 3.0)
        assert form.y == pytest.approx(100.0 * result.p_form)
        assert tests.y.text == "probability by chance / %"
        around = next(m for m in sizes.marks if isinstance(m, LineMark) and "± 3 u" in m.name)
        size, u = result.size.value / MICROMETRE, result.size.u / MICROMETRE
        assert around.y[:2] == pytest.approx([size - 3.0 * u, size + 3.0 * u])
        new_maps = [m.value for m in sizes.marks if isinstance(m, Rule) and m.upright]
        assert new_maps == [4.5]
        assert [name for name in sizes.x.categories if name] == [
            "2026-01-01", "2026-01-04", "2026-01-07"]  # fmt: skip


def test_verification_shows_differences_where_they_are() -> None:
    result = check(touches(1))
    by_place, over = verification_view(result).charts
    assert isinstance(by_place, PolarChart)
    dots = by_place.marks[0]
    assert isinstance(dots, Dots)
    assert dots.values == pytest.approx(result.differences / MICROMETRE)
    assert dots.y == pytest.approx(polar_angle(result.directions) / DEGREE)
    assert isinstance(over, PlaneChart)
    whiskers = over.marks[1]
    assert isinstance(whiskers, Dots)
    assert whiskers.u == pytest.approx(2.0 * result.u_differences / MICROMETRE)


def test_identification_is_drawn_in_the_frame_of_the_probe() -> None:
    """A probe that is turned by 90°: the machine's +X is the probe's -Y."""
    from dataclasses import replace

    probe = load_probe("omp40-2")
    probe = replace(probe, orientation=replace(probe.orientation, rotation=90.0 * DEGREE))
    one = np.ones(1)
    found = Identification(
        probe, ("preload",), one, one, one, np.array([0.001]), np.array([[1.0, 0.0, 0.0]]),
        np.zeros(3), (),
    )  # fmt: skip
    by_place, _ = identification_view(found).charts
    assert isinstance(by_place, PolarChart)
    dots = by_place.marks[0]
    assert isinstance(dots, Dots)
    assert dots.x / DEGREE == pytest.approx([270.0])
    assert dots.values == pytest.approx([1.0])


@pytest.mark.parametrize("count", [3, 20])
def test_friction_shows_every_direction(count: int) -> None:
    azimuth = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    directions = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(count)])
    cycle = friction_cycle(load_probe("omp40-2"), directions, 0.1, cycles=1, steps=20)
    _, each = friction_view(cycle, "friction").charts
    assert isinstance(each, PlaneChart)
    if count == 3:
        bars = each.marks[0]
        assert isinstance(bars, Bars)
        assert bars.values == pytest.approx(cycle.hysteresis[:, -1] / MICROMETRE)
        assert each.y.categories[1] == "polar 90°, azimuth 120°"
    else:
        dots = each.marks[1]
        assert isinstance(dots, Dots)
        assert np.radians(dots.x) == pytest.approx(azimuth_angle(directions) % (2.0 * np.pi))


def _line() -> View:
    line = LineMark(np.arange(3.0), np.array([0.0, 2.0, 1.0]), "force")
    return View("Touch", (PlaneChart("Force", Axis("time", "s"), Axis("force", "N"), (line,)),))


_IN_A_COMMAND = """
import hashlib
import numpy as np
from pretravel.show import Axis, LineMark, PlaneChart, View, draw_for_a_command, drawn_figure
from pretravel.show.style import drawn_pixels
draw_for_a_command()
line = LineMark(np.arange(3.0), np.array([0.0, 2.0, 1.0]), "force")
view = View("Touch", (PlaneChart("Force", Axis("time", "s"), Axis("force", "N"), (line,)),))
pixels = drawn_pixels(drawn_figure(view))
from matplotlib.artist import kwdoc
from matplotlib.lines import Line2D
assert "linewidth" in kwdoc(Line2D), "what matplotlib offers to others is as it was"
print("linewidth" in (Line2D.set.__doc__ or ""), hashlib.sha256(pixels).hexdigest())
"""


@pytest.mark.long
def test_a_command_draws_the_same_without_texts_of_help() -> None:
    told = subprocess.run(
        [sys.executable, "-c", _IN_A_COMMAND], check=True, capture_output=True, text=True
    )
    here = hashlib.sha256(drawn_pixels(drawn_figure(_line()))).hexdigest()
    assert told.stdout.split() == ["False", here]
