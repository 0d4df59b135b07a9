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
from pretravel.show.document import Document, KeyFigure
from pretravel.show.polar_picture import (
    MOST_DOTS,
    PICTURE_MARGIN,
    PICTURE_RADIUS,
    PolarSeries,
    polar_picture,
)
from pretravel.tasks.reports.notebook_card import notebook_html
from pretravel.touches import Touches
from tests.support.examples import EXAMPLES

MIDDLE = PICTURE_RADIUS + PICTURE_MARGIN


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
    assert re.search(r"(src|href)=|url\(|@import", html) is None
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


def _dots(values: list[float], azimuths: list[float], unit: str = "µm") -> PolarSeries:
    return PolarSeries("", np.radians(azimuths), np.array(values), "series1")


def test_places_of_dots() -> None:
    """The largest value, 10, is the outermost ring; 90° is at the top, 180° at the left."""
    picture = polar_picture("p", "µm", [_dots([10.0, 5.0, 0.0, 10.0], [0.0, 90.0, 45.0, 180.0])])
    assert picture is not None
    assert picture.series[0].dots == (
        (MIDDLE + PICTURE_RADIUS, MIDDLE),
        (MIDDLE, MIDDLE - PICTURE_RADIUS / 2),
        (MIDDLE, MIDDLE),
        (MIDDLE - PICTURE_RADIUS, MIDDLE),
    )
    assert picture.rings == ((PICTURE_RADIUS / 2, "5 µm"), (PICTURE_RADIUS, "10 µm"))


def test_negative_values_lower_the_centre() -> None:
    """-1 to 2 in steps of 1: the centre is -1, so zero is a third of the radius outside."""
    picture = polar_picture("p", "µm", [_dots([-1.0, 0.0, 2.0], [0.0, 0.0, 0.0])])
    assert picture is not None
    x = [dot[0] - MIDDLE for dot in picture.series[0].dots]
    assert x == pytest.approx(
        [0.0, PICTURE_RADIUS / 3, PICTURE_RADIUS], abs=0.06
    )  # places have one decimal
    assert [text for _, text in picture.rings] == ["0 µm", "1 µm", "2 µm"]


def test_curves_are_closed_and_have_gaps_where_nothing_is_known() -> None:
    around = np.radians([0.0, 90.0, 180.0, 270.0])
    whole = PolarSeries("", around, np.ones(4), "series1", closed=True)
    broken = PolarSeries("", around, np.array([1.0, math.nan, 1.0, 1.0]), "series1", closed=True)
    picture = polar_picture("p", "µm", [whole, broken])
    assert picture is not None
    first, second = (each.path for each in picture.series)
    assert (first.count("M"), first.count("L")) == (1, 4)
    assert (second.count("M"), second.count("L")) == (2, 1)


def test_many_dots_are_thinned_out_and_the_picture_says_so() -> None:
    picture = polar_picture("p", "µm", [_dots([1.0] * 1000, [0.0] * 1000)])
    assert picture is not None
    assert len(picture.series[0].dots) == MOST_DOTS
    assert picture.note == "400 of 1,000 dots are drawn"


def test_no_numbers_no_picture() -> None:
    assert polar_picture("p", "µm", [_dots([math.nan], [0.0])]) is None
    assert polar_picture("p", "µm", []) is None


def test_equal_values_and_zeros_have_a_ring() -> None:
    for values in ([0.0, 0.0], [3.0, 3.0], [-2.0, -2.0]):
        picture = polar_picture("p", "µm", [_dots(values, [0.0, 90.0])])
        assert picture is not None
        assert picture.rings
        assert all(0.0 < radius <= PICTURE_RADIUS + 1e-9 for radius, _ in picture.rings)
