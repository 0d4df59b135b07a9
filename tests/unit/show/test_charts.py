"""Charts: the same values in files and on pages, text that stays text, colours that can be seen."""

from __future__ import annotations

import io
import json
import pickle
import re

import numpy as np
import pytest

from pretravel.show.chart import (
    Axis,
    Chart,
    PlaneChart,
    PolarChart,
    Scale,
    SpaceChart,
    TopView,
    View,
)
from pretravel.show.chart_files import drawn_figure
from pretravel.show.chart_marks import (
    Area,
    Bars,
    Dots,
    LineMark,
    Note,
    Rule,
    SpaceArrow,
    SpaceLines,
    SpaceMesh,
    SpacePoints,
)
from pretravel.show.chart_plotly import (
    colour_names,
    plotly_figure,
    plotly_script_gzip,
)
from pretravel.show.colours import DARK, LIGHT, SERIES
from pretravel.show.document import Document, Picture

HOSTILE = "<img src=x onerror=alert(1)>"
AZIMUTH = np.radians(np.arange(0.0, 360.0, 30.0))
RADIUS = 8.0 + 3.0 * np.cos(3.0 * AZIMUTH)


def _plane() -> PlaneChart:
    x = np.arange(3.0)
    marks = (
        LineMark(x, x**2, HOSTILE),
        Dots(x, x, "touches", values=x, u=np.full(3, 0.1), labels=(HOSTILE, "b", "c")),
        Area(x, x - 1.0, x + 1.0, "band"),
        Rule(2.0, "limit", "limit"),
        Note(1.0, 1.0, HOSTILE),
    )
    scale = Scale.of("u", "µm", x)
    return PlaneChart(HOSTILE, Axis(HOSTILE, "s"), Axis("force", "N"), marks, scale)


def _bars() -> PlaneChart:
    marks = (Bars(np.arange(2.0), np.array([3.0, 1.0]), u=np.array([0.5, 0.2]), texts=("3", "1")),)
    return PlaneChart("bars", Axis("", categories=("none", HOSTILE)), Axis("error", "µm"), marks)


def _polar() -> PolarChart:
    marks = (
        LineMark(AZIMUTH, RADIUS, "polar 90°"),
        Area(AZIMUTH, RADIUS - 1.0, RADIUS + 1.0),
        Dots(AZIMUTH, RADIUS, "touches"),
        Rule(8.0, "mean"),
    )
    return PolarChart("pretravel", Axis("pretravel", "µm", low=0.0), marks)


def _top_view() -> TopView:
    polar, azimuth = np.arange(0.0, 91.0, 10.0), np.arange(0.0, 360.0, 10.0)
    values = polar[:, None] * np.cos(np.radians(azimuth))
    return TopView("map", polar, azimuth, values, Scale.of("pretravel", "µm", values, signed=True))


def _space() -> SpaceChart:
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    triangles = np.array([[0, 1, 2], [0, 1, 3]])
    marks = (
        SpaceMesh(corners, triangles, "part"),
        SpaceMesh(corners, triangles, "field", values=np.arange(4.0)),
        SpacePoints(corners, HOSTILE, labels=("a", "b", "c", HOSTILE)),
        SpaceLines(corners, corners * 1.5, "whiskers"),
        SpaceArrow(np.zeros(3), np.array([0.0, 0.0, 2.0]), HOSTILE),
    )
    return SpaceChart("space", marks, scale=Scale.of("stress", "MPa", np.arange(4.0)))


CHARTS = (_plane(), _bars(), _polar(), _top_view(), _space())


@pytest.mark.parametrize("chart", CHARTS, ids=lambda chart: type(chart).__name__)
def test_every_chart_is_drawn_for_files_and_pages(chart: Chart) -> None:
    drawn_figure(View("all", (chart,))).canvas.draw()
    figure = plotly_figure(chart)
    text = json.dumps(figure, allow_nan=False)  # Plotly reads no NaN
    names = set(re.findall(r'"(@[^"]*)"', text))
    assert names
    for dark in (False, True):
        assert names <= set(colour_names(dark=dark))
    assert figure["data"]


@pytest.mark.parametrize("chart", CHARTS, ids=lambda chart: type(chart).__name__)
def test_a_label_stays_text_in_plotly(chart: Chart) -> None:
    """Plotly reads some HTML in its texts; a label has none that it could read."""
    assert "<img" not in json.dumps(plotly_figure(chart))


def test_a_chart_of_plotly_has_the_values_of_its_marks() -> None:
    line, dots, area = plotly_figure(_plane())["data"][:3]
    assert line["y"] == [0.0, 1.0, 4.0]
    assert (dots["marker"]["color"], dots["error_y"]["array"]) == ([0.0, 1.0, 2.0], [0.1] * 3)
    assert dots["customdata"] == [0, 1, 2]
    assert area["y"] == [1.0, 2.0, 3.0, 1.0, 0.0, -1.0]
    around = plotly_figure(_polar())["data"][0]
    assert around["theta"] == np.arange(0.0, 360.0, 30.0).tolist()
    np.testing.assert_allclose(around["r"], RADIUS, rtol=1e-5)  # six digits


def test_a_top_view_has_the_value_of_each_direction_at_its_place() -> None:
    """x = polar angle × cos(azimuth), so the values of this chart are x itself."""
    heat = plotly_figure(_top_view())["data"][0]
    x, y = np.meshgrid(heat["x"], heat["y"])
    z = np.array(heat["z"], dtype=float)
    # Inside; linear over 10° of azimuth: the chord's error is below polar × (1 - cos 5°).
    inside = np.hypot(x, y) < 89.0
    np.testing.assert_allclose(z[inside], x[inside], atol=90.0 * (1.0 - np.cos(np.radians(5.0))))
    assert np.isnan(z[np.hypot(x, y) > 90.5]).all()


def test_marks_of_unequal_length_are_refused() -> None:
    with pytest.raises(ValueError, match="lengths"):
        Dots(np.arange(3.0), np.arange(2.0))


def test_the_values_of_a_mark_cannot_change() -> None:
    values = np.arange(3.0)
    line = LineMark(values, values)
    values[0] = 7.0
    assert line.x[0] == 0.0
    assert not line.x.flags.writeable


def _luminance(colour: str) -> float:
    """Relative luminance (WCAG 2.2, definition of terms)."""
    parts = np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("palette", [LIGHT, DARK], ids=["light", "dark"])
@pytest.mark.parametrize("name", [*SERIES, "after", "before", "limit", "zone", "reference", "ink"])
def test_colours_can_be_seen_on_their_background(palette: dict[str, str], name: str) -> None:
    """3:1 for graphics (WCAG 2.2, 1.4.11), 4.5:1 for text (1.4.3)."""
    low, high = sorted([_luminance(palette[name]), _luminance(palette["paper"])])
    least = 4.5 if name in ("ink", "limit") else 3.0
    assert (high + 0.05) / (low + 0.05) >= least


def test_the_script_of_plotly_fits_into_a_page() -> None:
    assert len(plotly_script_gzip()) * 4 / 3 < 2.2e6  # of 3 MB for a page, in base64


def test_a_document_goes_to_another_process_with_its_pictures() -> None:
    view = View("touch", (_polar(),))
    document = Document("touch", pictures=(Picture("polar", lambda: view),))
    again = pickle.loads(pickle.dumps(document))
    (chart,) = again.pictures[0].charts
    np.testing.assert_array_equal(chart.marks[0].y, RADIUS)


def test_bars_of_u_have_a_colour_that_changes_with_the_page() -> None:
    """Without one Plotly draws them black where points have a scale: not seen on dark."""
    places = np.arange(3.0)
    dots = Dots(places, places, values=places, u=np.ones(3))
    chart = PlaneChart("", Axis("x"), Axis("y"), (dots,), Scale.of("x", "", places))
    (trace,) = plotly_figure(chart)["data"]
    assert trace["error_y"]["color"] == "@reference"


@pytest.mark.parametrize(
    ("vector", "names", "place"),
    [
        ((1.0, 0.0, 0.1), ["push", ""], "top left"),
        ((-1.0, 0.0, 0.1), ["push", ""], "top right"),
        ((0.0, 0.0, -2.0), ["push", ""], "middle right"),
        ((0.5, 0.0, 2.0), ["", "push"], "middle right"),
    ],
)
def test_the_name_of_an_arrow_is_beside_it(
    vector: tuple[float, float, float], names: list[str], place: str
) -> None:
    arrow = SpaceArrow(np.zeros(3), np.array(vector), "push")
    line = plotly_figure(SpaceChart("space", (arrow,)))["data"][0]
    assert (line["text"], line["textposition"]) == (names, place)


def test_a_logarithmic_axis_has_plain_numbers() -> None:
    axis = Axis("stress", "MPa", logarithmic=True)
    chart = PlaneChart("log", Axis("place", "mm"), axis, (LineMark(np.ones(2), np.ones(2), ""),))
    assert plotly_figure(chart)["layout"]["yaxis"]["tickformat"] == "~g"


@pytest.mark.parametrize(("low", "high", "plain"), [(1.0, 50.0, True), (1e-4, 100.0, False)])
def test_numbers_of_a_logarithmic_axis_suit_its_limits(
    low: float, high: float, plain: bool
) -> None:
    """The values reach over six decades (two): the limits of the axis decide, not the values."""
    values = np.array([1e-3, 1.0, 1e3]) if plain else np.array([2.0, 5.0, 20.0])
    axis = Axis("probability", "%", low, high, logarithmic=True)
    chart = PlaneChart("tests", Axis("x"), axis, (Dots(np.arange(3.0), values),))
    axes = drawn_figure(View("", (chart,))).axes[0]
    texts = [label.get_text() for label in axes.get_yticklabels()]
    assert ("20" in texts) == plain
    assert ("10⁻³" in texts) != plain


def test_names_below_an_axis_have_the_same_room_at_its_ends() -> None:
    """Plotly shows no name that would reach beyond the picture."""
    chart = PlaneChart("", Axis("", categories=("a", "b", "c")), Axis("", ""), ())
    assert plotly_figure(chart)["layout"]["xaxis"]["range"] == [-0.5, 2.5]


def test_what_a_mask_hides_is_not_drawn() -> None:
    """Plotly draws NetCDF's fill value, 1e37, of a masked reading."""
    from pretravel.base.arrays import frozen
    from pretravel.show.plotly_parts import plain_numbers

    masked = np.ma.masked_greater([1.0, 9.96921e36, 3.0], 1e30)
    assert plain_numbers(masked) == [1.0, None, 3.0]
    assert plain_numbers(frozen(masked)) == [1.0, None, 3.0]
    assert plain_numbers(frozen(np.ma.array([1, 2], mask=[True, False]))) == [None, 2.0]


def test_lines_that_a_body_hides_are_left_out() -> None:
    """A flag at a place inside the body: matplotlib refuses to draw no line at all."""
    corners = np.array([[x, y, z] for x in (0.0, 9.0) for y in (0.0, 9.0) for z in (0.0, 9.0)])
    faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    triangles = np.array([one for a, b, c, d in faces for one in ([a, b, c], [a, c, d])])
    flag = SpaceLines(np.array([[4.0, 4.0, 4.0]]), np.array([[4.0, 4.0, 5.0]]))
    marks = (SpaceMesh(corners, triangles, "part"), flag)
    assert len(drawn_figure(View("", (SpaceChart("", marks, bare=True),))).axes) == 1


def test_a_body_alone_fills_its_image() -> None:
    """A flat part leaves half of a square figure empty: such rows are left out."""
    corners = np.array([[x, y, z] for x in (0.0, 80.0) for y in (0.0, 50.0) for z in (0.0, 2.0)])
    triangles = np.array([[0, 2, 6], [0, 6, 4], [1, 3, 7], [1, 7, 5]])
    mesh = SpaceMesh(corners, triangles, "part")
    pixels = Picture.of("part", View("", (SpaceChart("Part", (mesh,), bare=True),))).pixels
    drawn = np.any(pixels != pixels[:1, :1], axis=2)
    assert pixels.shape[1] > 1.5 * pixels.shape[0]
    assert np.diff(np.flatnonzero(drawn.any(axis=1))).max() < 30  # dots: 6 mm


def test_a_chart_of_equal_units_has_no_fixed_limits(caplog: pytest.LogCaptureFixture) -> None:
    """Matplotlib wrote 'Ignoring fixed x limits' on stderr for each of them."""
    dots = Dots(np.arange(3.0), np.arange(3.0), "")
    chart = PlaneChart("", Axis("x"), Axis("y"), (dots,), equal=True)
    drawn_figure(View("", (chart,))).savefig(io.BytesIO())
    assert not caplog.records
