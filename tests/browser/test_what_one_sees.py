"""What one sees of a screen: one scroll, the answer on top, whole pictures and whole tables."""

from __future__ import annotations

from typing import Any

import pytest

from pretravel.task import example_folder
from tests.browser.screens import cut_or_covered, seen_at, settled, stays
from tests.browser.screens import drop as drop_file
from tests.browser.test_engineer import SPHERE, drop, state_diameters, step
from tests.browser.workbench_server import SIZES, RunningWorkbench, new_context, opened

SCREENS = ("engineer", "metrologist", "laboratory", "task/qualify")
"""With an answer, as soon as they are filled; all screens have the same places."""
WIDTHS = (*SIZES.values(), (1200, 900))


@pytest.fixture(params=SCREENS)
def filled(request: pytest.FixtureRequest, page: Any, workbench: RunningWorkbench) -> Any:
    """A screen with the result of an example."""
    name = request.param
    opened(page, f"{workbench.address}{name}")
    if name == "task/qualify":
        opened(page, f"{workbench.address}engineer")
        drop(page, SPHERE.read_bytes())
        state_diameters(page)
        step(page, "Choose your control")
        opened(page, f"{workbench.address}{name}")
        page.get_by_role("button", name="Take sphere.csv from this project").click()
        page.get_by_role("button", name="Run", exact=True).click()
    elif name == "engineer":
        drop(page, SPHERE.read_bytes())
        state_diameters(page)
        step(page, "Choose your control")
    else:
        page.get_by_role("button", name="Try it with example data").click()
    page.wait_for_selector(".verdict")
    page.wait_for_selector(".screen-picture .main-svg")
    settled(page)
    return page


_SCROLLING = """() => [...document.querySelectorAll('main, main *')].filter((one) => {
  const style = getComputedStyle(one);
  return /auto|scroll/.test(style.overflowY) && one.scrollHeight > one.clientHeight + 1;
}).map((one) => `${one.tagName}.${one.className}`)"""

_EMPTY_LINES = """() => [...document.querySelectorAll('.field')].filter((one) => {
  const words = one.querySelector('.q-field__bottom');
  return words?.offsetHeight && !words.textContent.trim();
}).map((one) => one.textContent)"""
"""Below a field: its gap to the next one is larger than that of others."""


def test_a_screen_has_one_scroll_and_its_answer_on_top(filled: Any) -> None:
    for size in WIDTHS:
        seen_at(filled, size)
        assert filled.evaluate(_SCROLLING) == [], size
        assert filled.evaluate(_EMPTY_LINES) == [], size
        assert filled.evaluate("document.documentElement.scrollWidth") <= size[0]
        answer = filled.locator(".verdict-card").first.bounding_box()
        picture = filled.locator(".screen-picture").bounding_box()
        assert answer["y"] + answer["height"] <= picture["y"]
        assert answer["y"] < 0.6 * size[1]  # in view, below the heading and the next step


def test_pictures_stand_in_two_columns_with_whole_words(filled: Any) -> None:
    for size in WIDTHS:
        seen_at(filled, size)
        assert cut_or_covered(filled) == [], size
        for low, high, numbers, title in filled.evaluate(_AXES_IN_SPACE):
            inner = 0.05 * (high - low)  # those of two edges would meet at a corner
            assert numbers, size
            assert low + inner < min(numbers), size
            assert max(numbers) < high - inner, size
            assert size[0] > 390 or " / " not in title  # its unit stands above
        plots = [one.bounding_box() for one in filled.locator(".screen-picture .plot").all()]
        if size[0] >= 1200 and len(plots) > 1:
            assert plots[0]["y"] == pytest.approx(plots[1]["y"], abs=1.0)
            assert plots[1]["x"] > plots[0]["x"]
        elif size[0] < 1000:
            assert {round(plot["x"]) for plot in plots} == {round(plots[0]["x"])}


_AXES_IN_SPACE = """() => [...document.querySelectorAll('.js-plotly-plot')]
  .filter((plot) => plot.layout?.scene)
  .flatMap(({ layout: { scene } }) => ['x', 'y', 'z'].map((name) => scene[`${name}axis`]))
  .filter((axis) => axis.visible !== false)
  .map((axis) => [...axis.range, axis.tickvals, axis.title.text])"""


@pytest.mark.parametrize("words", ["predict omp40-2", "slide omp40-2 plane:polar=40 0.5,0.5"])
def test_pictures_of_a_task_have_whole_words(
    page: Any, workbench: RunningWorkbench, words: str
) -> None:
    """A body with words beside it; a slider below an axis."""
    name, *typed = words.split()
    opened(page, f"{workbench.address}task/{name}")
    labels = ("Probe, as a word", "Surface, as a word", "First contact: surface parameters u,v")
    for label, value in zip(labels, typed, strict=False):
        page.get_by_label(label).fill(value)
        page.get_by_label(label).blur()
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".verdict")
    page.wait_for_selector(".screen-picture .main-svg")
    page.wait_for_selector(".picture-place", state="detached")
    for size in WIDTHS:
        seen_at(page, size)
        assert cut_or_covered(page) == [], size


def test_words_in_a_scene_stand_apart_and_none_of_a_hidden_face(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}task/faces")
    drop_file(page, "task-faces", "step", example_folder() / "bracket.step")
    page.wait_for_selector(".file-name:has-text('bracket.step')")
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".screen-picture .main-svg")
    for size in WIDTHS:
        seen_at(page, size)
        shown = _words_apart(page)
        assert {"2", "6", "13", "16"} <= shown  # in front, at the side, on top
        assert not {"1", "5"} & shown  # behind and below
    # Turned, released beside the picture, and then drawn again in another place.
    page.evaluate(_HALF_A_TURN)
    page.wait_for_selector(".js-plotly-plot.turning")
    page.evaluate("dispatchEvent(new MouseEvent('mouseup'))")
    page.wait_for_selector(".js-plotly-plot.turning", state="detached")
    turned = _words_apart(page)
    assert "1" in turned
    assert "2" not in turned
    seen_at(page, (900, 900))
    turned = _words_apart(page)
    assert "1" in turned
    assert "2" not in turned


def _words_apart(page: Any) -> set[str]:
    """The words that are seen in the scene; fails where some cover others or are cut off."""
    notes = page.evaluate(_NOTES_IN_SPACE)
    for row, one in enumerate(notes):
        assert 0 < one["x"] < one["width"], one
        assert 0 < one["y"] < one["height"], one
        for other in notes[:row]:
            wide = 3.5 * (len(one["text"]) + len(other["text"])) + 4
            apart = abs(one["x"] - other["x"]) > wide or abs(one["y"] - other["y"]) > 16
            assert apart, (one["text"], other["text"])
    return {note["text"] for note in notes}


_HALF_A_TURN = """() => {
  const plot = [...document.querySelectorAll('.js-plotly-plot')].find((one) => one.layout?.scene);
  const camera = structuredClone(plot.layout.scene.camera), { eye, center } = camera;
  for (const axis of ['x', 'y']) eye[axis] = 2 * center[axis] - eye[axis];
  plot.emit('plotly_relayouting', { 'scene.camera': camera });
}"""

_NOTES_IN_SPACE = """() => {
  const plot = [...document.querySelectorAll('.js-plotly-plot')].find((one) => one.layout?.scene);
  const { scene } = plot.layout, { eye, center } = scene.camera, size = plot._fullLayout._size;
  const width = size.w, height = size.h, axes = ['x', 'y', 'z'];
  const sight = axes.map((axis) => eye[axis] - center[axis]), far = Math.hypot(...sight);
  const v = sight.map((part) => part / far), flat = Math.hypot(v[0], v[1]);
  const right = [-v[1] / flat, v[0] / flat, 0];
  const up = [-v[0] * v[2] / flat, -v[1] * v[2] / flat, flat];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  return scene.annotations.filter((note) => note.visible).map((note) => {
    const p = axes.map((axis) => {
      const [low, high] = scene[`${axis}axis`].range;
      return ((note[axis] - (low + high) / 2) / (high - low)) * scene.aspectratio[axis]
        - center[axis];
    });
    const scale = height / 2 / Math.tan(Math.PI / 8) / (far - dot(p, v));
    const x = width / 2 + dot(p, right) * scale + note.ax;
    return { text: note.text, x, y: height / 2 - dot(p, up) * scale + note.ay, width, height };
  });
}"""


_CUT_TABLES = """() => [...document.querySelectorAll('.table-frame')]
  .filter((one) => one.clientWidth && one.scrollWidth > one.clientWidth + 1)
  .map((one) => one.innerText.slice(0, 80))"""


def test_tables_are_whole_at_1200_px(filled: Any) -> None:
    seen_at(filled, (1200, 900))
    tabs = filled.get_by_role("tab")
    for tab in tabs.all():
        tab.click()
        filled.wait_for_selector(f'.q-tab--active:has-text("{tab.inner_text()}")')
        assert stays(filled, _CUT_TABLES) == []


def test_a_scene_fills_its_card(page: Any, workbench: RunningWorkbench) -> None:
    """Its bodies, seen by the camera, reach to the edges that words leave free."""
    opened(page, f"{workbench.address}designer")
    page.wait_for_selector(".screen-picture .main-svg")
    reach = """() => {
      const scene = (plot) => plot?.layout?.scene;
      const plot = [...document.querySelectorAll('.js-plotly-plot')].find(scene);
      const { eye, center } = plot.layout.scene.camera;
      const size = plot._fullLayout._size, wide = size.w * (scene(plot).domain?.x?.[1] ?? 1);
      const sight = ['x', 'y', 'z'].map((axis) => eye[axis] - center[axis]);
      const far = Math.hypot(...sight), v = sight.map((part) => part / far);
      const flat = Math.hypot(v[0], v[1]);
      const right = [-v[1] / flat, v[0] / flat, 0];
      const up = [-v[0] * v[2] / flat, -v[1] * v[2] / flat, flat];
      const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      const focus = size.h / 2 / Math.tan(Math.PI / 8);
      let across = 0, above = 0, below = 0;
      for (const { x, y, z } of plot.data)
        for (let n = 0; n < (x?.length ?? 0); n += 1) {
          if (x[n] === null) continue;
          const p = [['x', x[n]], ['y', y[n]], ['z', z[n]]].map(([axis, value]) => {
            const [low, high] = scene(plot)[`${axis}axis`].range;
            const place = ((value - (low + high) / 2) / (high - low));
            return place * scene(plot).aspectratio[axis] - center[axis];
          });
          const deep = far - dot(p, v), height = dot(p, up) * focus / deep / (size.h / 2);
          across = Math.max(across, Math.abs(dot(p, right)) * focus / deep / (wide / 2));
          above = Math.max(above, height);
          below = Math.max(below, -height);
        }
      return [across, above, below];
    }"""
    for size in WIDTHS:
        seen_at(page, size)
        page.wait_for_function(f"() => Math.max(...({reach})()) > 0.8")
        across, above, below = page.evaluate(reach)
        assert max(across, above, below) < 1.01, size
        assert above == pytest.approx(below, abs=0.03), size  # in the middle of its card


_BUTTONS_OF_PICTURES = """() => [...document.querySelectorAll('.modebar')]
  .filter((one) => one.checkVisibility() && +getComputedStyle(one).opacity)
  .map((one) => one.closest('.js-plotly-plot').textContent)"""


def test_buttons_of_a_picture_stand_on_its_title_once_it_is_touched(
    browser: Any, workbench: RunningWorkbench
) -> None:
    """A device without a pointer, where Plotly shows them always."""
    size = {"width": 390, "height": 844}
    context = new_context(browser, viewport=size, has_touch=True, is_mobile=True)
    page = context.new_page()
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    page.wait_for_selector(".plot-area .modebar", state="attached")
    assert page.evaluate("matchMedia('(hover: none)').matches")
    assert stays(page, _BUTTONS_OF_PICTURES) == []
    page.locator(".plot-area").first.tap()
    page.wait_for_function(f"({_BUTTONS_OF_PICTURES})().length")
    context.close()


def test_home_is_read_on_a_phone(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}metrologist")
    page.get_by_role("button", name="Try it with example data").click()
    page.wait_for_selector(".verdict")
    opened(page, workbench.address)
    page.wait_for_selector(".contents li")
    page.set_viewport_size({"width": 390, "height": 844})
    narrow = page.eval_on_selector_all(
        "main :is(p, a, h2)",
        "all => all.filter((one) => one.innerText.length > 20 && one.clientWidth"
        " && one.clientWidth < 150).map((one) => one.innerText)",
    )
    assert narrow == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
