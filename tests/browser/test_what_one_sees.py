"""What one sees of a screen: one scroll, the answer on top, whole pictures and whole tables."""

from __future__ import annotations

from typing import Any

import pytest

from tests.browser.screens import settled
from tests.browser.test_engineer import SPHERE, drop, state_diameters, step
from tests.browser.workbench_server import SIZES, RunningWorkbench, opened

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


def _seen(page: Any, size: tuple[int, int]) -> None:
    """Wait until pictures have the place of a window of this size."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.wait_for_function(
        """() => [...document.querySelectorAll('.screen-picture .plot-area')].every((one) =>
             one.layout && Math.abs(one._fullLayout.width - one.clientWidth) < 2)"""
    )


_SCROLLING = """() => [...document.querySelectorAll('main, main *')].filter((one) => {
  const style = getComputedStyle(one);
  return /auto|scroll/.test(style.overflowY) && one.scrollHeight > one.clientHeight + 1;
}).map((one) => `${one.tagName}.${one.className}`)"""

_CUT_OR_COVERED = """() => {
  const found = [];
  for (const plot of document.querySelectorAll('.screen-picture .js-plotly-plot')) {
    const frame = plot.getBoundingClientRect();
    const texts = [...plot.querySelectorAll('svg text')]
      .filter((one) => one.textContent.trim() && one.checkVisibility() && !one.closest('.modebar'))
      .map((one) => [one.textContent, one.getBoundingClientRect()]);
    for (const [words, box] of texts)
      if (box.left < frame.left - 1 || box.right > frame.right + 1
          || box.top < frame.top - 1 || box.bottom > frame.bottom + 1)
        found.push(`cut: ${words}`);
    const titles = [...plot.querySelectorAll('.gtitle, .xtitle, .ytitle, .legendtext')]
      .map((one) => [one.textContent, one.getBoundingClientRect()]);
    titles.forEach(([words, a], n) => titles.slice(n + 1).forEach(([others, b]) => {
      const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (wide > 2 && high > 2) found.push(`${words} covers ${others}`);
    }));
  }
  return found;
}"""


def test_a_screen_has_one_scroll_and_its_answer_on_top(filled: Any) -> None:
    for size in WIDTHS:
        _seen(filled, size)
        assert filled.evaluate(_SCROLLING) == [], size
        assert filled.evaluate("document.documentElement.scrollWidth") <= size[0]
        answer = filled.locator(".verdict-card").first.bounding_box()
        picture = filled.locator(".screen-picture").bounding_box()
        assert answer["y"] + answer["height"] <= picture["y"]
        assert answer["y"] < 0.6 * size[1]  # in view, below the heading and the next step


def test_pictures_stand_in_two_columns_with_whole_words(filled: Any) -> None:
    for size in WIDTHS:
        _seen(filled, size)
        assert filled.evaluate(_CUT_OR_COVERED) == [], size
        plots = [one.bounding_box() for one in filled.locator(".screen-picture .plot").all()]
        if size[0] >= 1200 and len(plots) > 1:
            assert plots[0]["y"] == pytest.approx(plots[1]["y"], abs=1.0)
            assert plots[1]["x"] > plots[0]["x"]
        elif size[0] < 1000:
            assert {round(plot["x"]) for plot in plots} == {round(plots[0]["x"])}


def test_tables_are_whole_at_1200_px(filled: Any) -> None:
    _seen(filled, (1200, 900))
    tabs = filled.get_by_role("tab")
    for tab in tabs.all():
        tab.click()
        cut = filled.eval_on_selector_all(
            ".table-frame",
            "all => all.filter((one) => one.clientWidth && one.scrollWidth > one.clientWidth + 1)"
            ".map((one) => one.innerText.slice(0, 80))",
        )
        assert cut == []


def test_a_scene_fills_its_card(page: Any, workbench: RunningWorkbench) -> None:
    """The corners of its box, seen by the camera, reach to the edges that words leave free."""
    opened(page, f"{workbench.address}designer")
    page.wait_for_selector(".screen-picture .main-svg")
    reach = """() => {
      const scene = (plot) => plot?.layout?.scene;
      const plot = [...document.querySelectorAll('.js-plotly-plot')].find(scene);
      const { eye, center } = plot.layout.scene.camera;
      const size = plot._fullLayout._size, wide = size.w * (scene(plot).domain?.x?.[1] ?? 1);
      const far = Math.hypot(eye.x, eye.y, eye.z - center.z);
      const v = [eye.x / far, eye.y / far, (eye.z - center.z) / far];
      const flat = Math.hypot(v[0], v[1]);
      const right = [-v[1] / flat, v[0] / flat, 0];
      const up = [-v[0] * v[2] / flat, -v[1] * v[2] / flat, flat];
      const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      const ratio = scene(plot).aspectratio, focus = size.h / 2 / Math.tan(Math.PI / 8);
      let across = 0, above = 0;
      for (let corner = 0; corner < 8; corner += 1) {
        const p = ['x', 'y', 'z'].map((a, bit) => (corner & (1 << bit) ? 0.5 : -0.5) * ratio[a]);
        p[2] -= center.z;
        const deep = far - dot(p, v);
        across = Math.max(across, Math.abs(dot(p, right)) * focus / deep / (wide / 2));
        above = Math.max(above, Math.abs(dot(p, up)) * focus / deep / (size.h / 2));
      }
      return [across, above];
    }"""
    for size in WIDTHS:
        _seen(page, size)
        page.wait_for_function(f"() => Math.max(...({reach})()) > 0.8")
        across, above = page.evaluate(reach)
        assert max(across, above) < 1.01, size


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
