"""What tests of screens share: dropping files, taking results, running the lines that are shown."""

from __future__ import annotations

import contextlib
import io
import math
import re
import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tests.support.commands import run


def drop(page: Any, screen: str, purpose: str, *paths: Path) -> None:
    """Give files to a place of a screen."""
    place = f'.file-drop-input[data-url$="/{screen}/{purpose}"]'
    page.set_input_files(place, [str(path) for path in paths])


def downloaded(page: Any, button: str, folder: Path) -> Path:
    """The file that a button gives."""
    with page.expect_download() as waiting:
        page.get_by_role("button", name=button, exact=True).click()
    path = folder / str(waiting.value.suggested_filename)
    waiting.value.save_as(path)
    return path


def tab(page: Any, name: str) -> None:
    """Show a tab below the picture."""
    page.get_by_role("tab", name=name, exact=True).click()
    page.wait_for_selector(f'.q-tab--active:has-text("{name}")')


def remember(page: Any, places: str) -> None:
    """From now on keep what places of a page say, for `was_said`: some words pass by."""
    page.evaluate(
        """(places) => {
          window.said = [];
          new MutationObserver(() => document.querySelectorAll(places)
            .forEach((one) => window.said.push(one.textContent)))
            .observe(document.body, { subtree: true, childList: true, characterData: true });
        }""",
        places,
    )


def was_said(page: Any, words: str) -> None:
    """Wait until words have stood in a place since `remember`, whether or not they still do."""
    page.wait_for_function("(words) => said.some((one) => one.includes(words))", arg=words)


def chosen_with_a_key(page: Any, key: str, files: Any) -> None:
    """Choose files in the place that has the focus.

    In some runs beside load no dialog came for a key within two minutes; why is not known. The key
    is then pressed again. The browser takes the dialog away only after it has been asked to, and
    says nothing when it has: a listener of the page asks for it long before.
    """
    choosers: list[Any] = []

    def take(chooser: Any) -> None:
        choosers.append(chooser)

    page.on("filechooser", take)
    for _ in range(6):
        assert page.evaluate("document.activeElement.className") == "file-drop-input"
        page.keyboard.press(key)
        for _ in range(200):
            if choosers:
                choosers[0].set_files(files)
                page.remove_listener("filechooser", take)
                return
            page.wait_for_timeout(100)
    raise AssertionError("the key opened no dialog of files")


def settled(page: Any) -> None:
    """Wait until results belong to the inputs that are shown, and their pictures are there."""
    page.wait_for_function("!document.querySelector('.live.stale, .running, .picture-place')")


def seen_at(page: Any, size: tuple[int, int]) -> None:
    """Wait until pictures have the place of a window of this size."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.wait_for_function(
        """() => [...document.querySelectorAll('main .plot-area')]
             .filter((one) => one.checkVisibility())
             .every((one) => one.querySelector('.main-svg')
               && Math.abs(one._fullLayout.width - one.clientWidth) < 2)"""
    )


def click_in_picture(page: Any, place: str, point: dict[str, float]) -> None:
    """As Plotly says that a point was clicked, once the page listens."""
    page.wait_for_function(
        "(place) => document.querySelector(place)?._ev?.listenerCount('plotly_click')", arg=place
    )
    page.evaluate(
        "([place, point]) => document.querySelector(place).emit('plotly_click', {points: [point]})",
        [place, point],
    )


_CUT_OR_COVERED = """() => {
  const found = [];
  for (const plot of document.querySelectorAll('main .js-plotly-plot')) {
    if (!plot.checkVisibility()) continue;
    const frame = plot.getBoundingClientRect();
    const texts = [...plot.querySelectorAll('svg text')]
      .filter((one) => one.textContent.trim() && one.checkVisibility() && !one.closest('.modebar')
        && +getComputedStyle(one).fillOpacity)
      .map((one) => [one.textContent, one.getBoundingClientRect()]);
    for (const [words, box] of texts)
      if (box.left < frame.left - 1 || box.right > frame.right + 1
          || box.top < frame.top - 1 || box.bottom > frame.bottom + 1)
        found.push(`cut: ${words}`);
    const written = texts.map(([words]) => words);
    for (const axis of [plot.layout?.xaxis, plot.layout?.yaxis])
      for (const name of axis?.ticktext ?? [])
        if (name && !written.includes(name.replaceAll('<br>', ''))) found.push(`missing: ${name}`);
    const titles = [...plot.querySelectorAll('.gtitle, .xtitle, .ytitle, .legendtext,'
        + '.xtick text, .ytick text, .angularaxistick text, .annotation-text, .slider-label')]
      .filter((one) => one.textContent.trim() && one.checkVisibility()
        && +getComputedStyle(one).fillOpacity)
      .map((one) => [one.textContent, one.getBoundingClientRect()]);
    titles.forEach(([words, a], n) => titles.slice(n + 1).forEach(([others, b]) => {
      const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (wide > 2 && high > 2) found.push(`${words} covers ${others}`);
    }));
  }
  return found;
}"""


def cut_or_covered(page: Any) -> list[str]:
    """Words of the pictures on a page that stay not whole, or lie on each other."""
    return stays(page, _CUT_OR_COVERED)


def stays(page: Any, what: str, argument: Any = None) -> list[Any]:
    """What a function of the page finds, once it finds nothing, or after half a minute.

    Pictures and tables that get another place are drawn again a moment later.
    """
    found: list[Any] = []
    for _ in range(300):
        found = page.evaluate(what, argument)
        if not found:
            break
        page.wait_for_timeout(100)
    return found


def resting_box(page: Any, part: Any) -> dict[str, float]:
    """Where a part of the page is, once it is twice at the same place, as after scrolling."""
    before: dict[str, float] = {}
    for _ in range(1000):
        box: dict[str, float] = part.bounding_box()
        if box == before:
            return box
        before = box
        page.wait_for_timeout(100)
    raise AssertionError("the page moves all the time")


def data_lines(path: Path) -> list[str]:
    """Lines without comments, which state the date."""
    return [line for line in path.read_text().splitlines() if not line.startswith("#")]


def same_values(mine: Path, theirs: Path) -> bool:
    """Whether two tables have the same words, and the same numbers but for the rounding of sums.

    Two processes may add in another order: the last of twelve digits differs then, and of a value
    near zero more of them.
    """
    words = [_WORD.split("\n".join(data_lines(path))) for path in (mine, theirs)]
    return len(words[0]) == len(words[1]) and all(
        one == other or _alike(one, other) for one, other in zip(*words, strict=True)
    )


_WORD = re.compile(r"[\s,\[\]]+")
_LAST_DIGITS = 1e-9


def _alike(one: str, other: str) -> bool:
    try:
        return math.isclose(float(one), float(other), rel_tol=_LAST_DIGITS, abs_tol=_LAST_DIGITS)
    except ValueError:
        return False


def run_shown_lines(page: Any, folder: Path, inputs: Iterable[Path], code: int = 0) -> None:
    """Run the command and the Python lines that a screen shows, in a folder with its inputs.

    Code 3 of the command is an answer to notice.
    """
    for path in inputs:
        (folder / path.name).write_bytes(path.read_bytes())
    command, python = (
        block.get_attribute("data-copy") for block in page.locator(".copy-button").all()[:2]
    )
    program, *arguments = shlex.split(command)
    assert program == "pretravel"
    with contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()):
        run(*arguments, code=code)
        exec(compile(python, "shown", "exec"), {"__name__": "shown"})
