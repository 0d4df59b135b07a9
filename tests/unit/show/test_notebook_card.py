"""Results in notebooks: short texts, cards with units, small polar pictures."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import pretravel
from pretravel.base.forms import ShownInNotebooks
from pretravel.show.chart import PolarChart
from pretravel.show.chart_marks import Dots, LineMark
from pretravel.show.document import Document, KeyFigure
from pretravel.task.notebook_card import MOST_DOTS, notebook_card, notebook_html
from pretravel.touches import Touches
from tests.support.examples import EXAMPLES


@cache
def _values() -> dict[str, ShownInNotebooks]:
    sphere = pretravel.read_touches(EXAMPLES / "sphere_touches.csv")
    found = pretravel.qualify(sphere, diameter=24.9987, tip_diameter=6.0, kind="mean")
    points = pretravel.apply(
        pretravel.read_touches(EXAMPLES / "part_touches.csv"), found.pretravel_map
    )
    readings = pretravel.read_multi_step_readings(EXAMPLES / "redundancy_24x24.csv")
    return {
        "75 touches": sphere,
        "75 touches, 0 left out": found,
        "25 directions": found.pretravel_map,
        "140 points": points,
        "2 directions": pretravel.predict(
            pretravel.load_probe("omp40-2"), [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]
        ),
        "24 machine and 24 probe directions": pretravel.separate(readings),
        "1 key figures": Document("a", "b", (KeyFigure("length", 1.0, "mm"),)),
    }


@pytest.mark.parametrize("count", [*_values()])
def test_texts_are_short_and_state_counts_and_units(count: str) -> None:
    value = _values()[count]
    text = repr(value)
    assert text.startswith(f"{type(value).__name__}(")
    assert count in text
    assert len(text) < 250
    assert "array" not in text
    if not isinstance(value, Document):
        assert "mm" in text or "µm" in text


def test_texts_of_values_without_a_card_are_short_too() -> None:
    """A bore of 20 mm by points without errors; two traces of one direction."""
    angle = np.arange(8) * np.pi / 4.0
    outward = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    one = 1e-8 * outward[:, :, None] * outward[:, None, :]
    points = pretravel.Points(10.0 * outward, -outward, np.zeros(8), one, None, tuple("12345678"))
    text = repr(pretravel.measure_feature(points, "bore", label="A"))
    assert text.startswith("MeasuredFeature(bore A; 8 points; diameter 20.00000 mm, u = 0.")
    assert len(text) < 250
    touch = pretravel.RigTouch("", 0, 4e-3, 0, 0, 1e-5, 1e-5, 1e-5, 0, 0, 3.0, ())
    touches = [replace(touch, trace=f"rig_000_{k}") for k in (1, 2)]
    text = repr(pretravel.calibrate_rig(touches))
    assert "2 touches, 1 directions; mean pretravel 4.000 µm" in text
    assert len(text) < 250


@pytest.mark.parametrize("count", [*_values()])
def test_cards_are_whole_and_load_nothing(count: str) -> None:
    html = _values()[count]._repr_html_()
    # One element, so that a reader of XML finds what is not closed.
    ET.fromstring(html)
    assert "<script" not in html
    assert re.search(r"(src|href)=(?!\"#)|url\((?!#)|@import|<style", html) is None
    assert ("<svg" in html) is (not isinstance(_values()[count], Document))
    assert "nan" not in re.sub(r"<[^>]*>", "", html)


def test_every_text_of_a_file_is_escaped() -> None:
    bad = '<img src=x onerror="alert(1)">'
    touches = Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]], source=bad)
    result = _values()["75 touches, 0 left out"]
    assert isinstance(result, pretravel.Qualification)
    document = Document(bad, bad, (KeyFigure(bad, bad, bad, remark=bad),), warnings=(bad,))
    for value in (touches, replace(result, warnings=(bad,)), document):
        html = value._repr_html_()
        assert "<img" not in html
        assert "&lt;img" in html


def test_a_card_states_the_extremes() -> None:
    """Pretravel of the mean map is one number; the residuals are what is left."""
    result = _values()["75 touches, 0 left out"]
    assert isinstance(result, pretravel.Qualification)
    low, high = (1e3 * f(result.residuals) for f in (np.min, np.max))
    assert f"{low:.2f} to {high:.2f} µm" in result._repr_html_()


def test_other_values_are_refused() -> None:
    with pytest.raises(TypeError, match="a str has no picture"):
        notebook_html("text")


def _picture(value: object) -> PolarChart:
    picture = notebook_card(value).picture
    assert picture is not None
    return picture


def test_dots_are_the_touches() -> None:
    """A normal along +Y and one along +Z: azimuth and polar angle."""
    (dots,) = _picture(Touches(np.ones((2, 3)), [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])).marks
    assert isinstance(dots, Dots)
    assert dots.x[0] == pytest.approx(math.pi / 2.0)
    assert dots.y == pytest.approx([90.0, 0.0])


def test_curves_are_those_of_the_map_and_closed() -> None:
    """The mean map has one value; the touches are dots beside it."""
    result = _values()["75 touches, 0 left out"]
    assert isinstance(result, pretravel.Qualification)
    chart = _picture(result)
    assert (chart.frame, chart.radius.text) == ("probe", "pretravel / µm")
    mean = 1e3 * result.pretravel_map.coefficients[0]
    curve, dots = chart.marks[0], chart.marks[-1]
    assert isinstance(curve, LineMark)
    assert isinstance(dots, Dots)
    assert (curve.x[0], curve.y[0]) == (curve.x[-1], curve.y[-1])
    assert curve.y == pytest.approx(np.full(len(curve.x), mean))
    assert dots.y == pytest.approx(1e3 * result.observed)
    html = result._repr_html_()
    assert all(f">{text}<" in html for text in ("polar 90°", "touches", "+X", "-Y"))


def test_the_centre_is_zero_where_no_value_is_negative() -> None:
    points = _values()["140 points"]
    assert isinstance(points, pretravel.Points)
    assert _picture(points).radius.low == 0.0
    assert _picture(replace(points, pretravel=-points.pretravel)).radius.low is None


def test_many_dots_are_thinned_out_and_the_picture_says_so() -> None:
    chart = _picture(Touches(np.ones((1000, 3)), np.tile([1.0, 0.0, 0.0], (1000, 1))))
    (dots,) = chart.marks
    assert isinstance(dots, Dots)
    assert len(dots.x) == MOST_DOTS
    assert chart.note == "400 of 1,000 dots are drawn"


def test_no_numbers_no_picture() -> None:
    points = _values()["140 points"]
    assert isinstance(points, pretravel.Points)
    nothing = replace(points, pretravel=np.full(140, math.nan))
    assert notebook_card(nothing).picture is None
    assert "<svg" not in nothing._repr_html_()
