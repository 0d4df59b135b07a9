"""What screens are made of, driven in a browser."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pretravel.app.project_file import read_project
from pretravel.base.whole_files import is_unfinished
from tests.browser.screens import chosen_with_a_key, remember, was_said
from tests.browser.workbench_server import (
    RunningWorkbench,
    opened,
    running_workbench,
    serious_problems,
)

PROGRAM = str(Path(__file__).with_name("components_screen.py"))
HOSTILE = '<img src=x onerror="window.hacked=1">'


@pytest.fixture(scope="module")
def workbench(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningWorkbench]:
    with running_workbench(tmp_path_factory.mktemp("data"), program=(PROGRAM,)) as started:
        yield started


@pytest.fixture
def screen(page: Any, workbench: RunningWorkbench) -> Any:
    """The screen without files; the tests of this file share a server."""
    opened(page, f"{workbench.address}components")
    remove = page.locator("button[aria-label^='Remove']")
    for left in range(remove.count(), 0, -1):
        remove.first.click()
        page.wait_for_function(f"document.querySelectorAll('.file-list li').length < {left}")
    return page


def drop(page: Any, name: str, content: bytes) -> None:
    give(page, "texts", name, content)


def give(page: Any, purpose: str, name: str, content: bytes) -> None:
    place = f'.file-drop-input[data-url$="/components/{purpose}"]'
    page.set_input_files(place, {"name": name, "mimeType": "text/plain", "buffer": content})


def test_two_tabs_and_a_reload_show_the_same(screen: Any, workbench: RunningWorkbench) -> None:
    other = screen.context.new_page()
    opened(other, f"{workbench.address}components")
    drop(screen, "a.txt", b"1\n2\n3\n")
    for tab in (screen, other):
        tab.wait_for_selector("text=3 lines, times 2 are 6")
    screen.get_by_label("Factor [mm]").fill("4")
    for tab in (screen, other):
        tab.wait_for_selector("text=3 lines, times 4 are 12")
    assert other.get_by_label("Factor [mm]").input_value() == "4"
    other.reload()
    other.wait_for_selector("text=3 lines, times 4 are 12")
    other.get_by_role("button", name="Remove a.txt").click()
    screen.wait_for_selector("text=Drop texts on the left.")


def test_the_page_with_a_result_is_accessible(screen: Any) -> None:
    drop(screen, "a.txt", b"1\n2\n3\n")
    screen.wait_for_selector("text=3 lines, times")
    screen.get_by_text("The same on the command line").click()
    for dark in ("false", "true"):
        screen.evaluate(f"Quasar.Dark.set({dark})")
        assert serious_problems(screen) == []


def test_faults_are_said_as_the_library_says_them(screen: Any) -> None:
    drop(screen, "a.txt", b"1\nbad\n")
    screen.wait_for_selector("text=a.txt, line 2: 'bad' is not a number")
    assert "/tmp" not in screen.inner_text("main")
    drop(screen, "a.txt", b"flaw\n")
    screen.wait_for_selector("text=this is an internal error of pretravel")
    assert "Traceback" not in screen.inner_text("main")


def test_warnings_of_the_library_are_shown_each_time(screen: Any) -> None:
    drop(screen, "a.txt", b"1\n")
    for _ in range(2):
        screen.get_by_label("Factor [mm]").fill("13")
        screen.wait_for_selector("text=13 is an unusual factor")
        screen.get_by_label("Factor [mm]").fill("2")
        screen.wait_for_selector("text=1 lines, times 2 are 2")
        assert "unusual" not in screen.inner_text("main")
    screen.get_by_role("button", name="Count files").click()
    screen.wait_for_selector("text=from another process")


def test_long_work_shows_its_stage_and_is_cancelled(screen: Any) -> None:
    screen.get_by_role("button", name="Wait").click()
    screen.wait_for_selector(".running-stage:has-text('stage')")
    assert screen.locator(".live.stale").count() == 0  # there is no old result
    screen.get_by_role("button", name="Cancel").click()
    screen.wait_for_selector("text=Cancelled after")


def test_cancel_brings_back_the_file_of_before(screen: Any) -> None:
    """Of work that begins by itself, in a process that would not end."""
    for name, says in (("first.txt", "1 line of first.txt"), ("next.txt", "1 line of next.txt")):
        give(screen, "held", name, b"1\n")
        screen.wait_for_selector(f"text={says}")
        give(screen, "held", "waits.txt", b"1\n")
        screen.wait_for_selector(".file-name:has-text('waits.txt')")
        screen.wait_for_selector(f".live.stale:has-text('{says}')")
        screen.get_by_role("button", name="Cancel").click()
        screen.wait_for_selector("text=Files and settings are as before")
        screen.wait_for_selector(f".live:not(.stale) >> text={says}")
        # The next one does not wait for what was cancelled.
        assert screen.locator(".file-name").all_inner_texts() == [name]


def test_what_is_no_number_is_said_and_not_stored(screen: Any) -> None:
    field = screen.get_by_label("Factor [mm]")
    for given, answer in (
        ("1,024.5", "'1,024.5' is not a number"),
        ("many", "'many' is not a number"),
        ("101", "101 mm is not between 0 and 100"),
    ):
        field.fill(given)
        screen.wait_for_selector(f"text={answer}")
    screen.reload()
    screen.wait_for_selector("main h1")
    assert field.input_value() == "2"


def test_a_decimal_comma_is_understood_and_shown(screen: Any) -> None:
    """German keyboards have a comma beside their digits."""
    field = screen.get_by_label("Factor [mm]")
    field.fill("2,5")
    screen.wait_for_selector("text=understood as 2.5 mm")
    screen.reload()
    screen.wait_for_selector("main h1")
    assert field.input_value() == "2.5"
    field.fill("2")
    screen.wait_for_selector("text=understood", state="hidden")


def test_texts_of_files_stay_texts(screen: Any) -> None:
    field = screen.get_by_label("Label")
    field.fill(HOSTILE)
    field.blur()  # it tells the server at once, else after a pause
    drop(screen, "a.txt", f"{HOSTILE}\nbad\n".encode())
    screen.wait_for_selector("text=is not a number")
    screen.reload()
    screen.wait_for_selector("text=is not a number")
    assert screen.get_by_label("Label").input_value() == HOSTILE
    assert screen.evaluate("window.hacked") is None
    assert screen.locator("img[src=x]").count() == 0


def test_a_script_that_comes_into_the_page_does_not_run(screen: Any) -> None:
    """The policy of the page (CSP), should a text ever be read as HTML."""
    refused = """(html) => new Promise((found) => {
      document.addEventListener("securitypolicyviolation", (e) => found(e.effectiveDirective));
      document.querySelector("main").insertAdjacentHTML("beforeend", html);
      setTimeout(() => found("nothing was refused"), 10000);
    })"""
    assert screen.evaluate(refused, HOSTILE) == "script-src-attr"
    assert screen.evaluate("window.hacked") is None


def test_uploads_are_limited_by_the_server(screen: Any) -> None:
    send = """async ([name, size, headers]) => {
      const place = document.querySelector('[data-url$="/components/texts"]').dataset.url;
      const answer = await fetch(`${place}?name=${encodeURIComponent(name)}`,
        {method: "POST", body: "1".repeat(size), headers});
      return [answer.status, (await answer.text())];
    }"""
    ours = {"X-Pretravel": "upload"}
    status, said = screen.evaluate(send, ["large.txt", 100_001, ours])
    assert status == 422
    assert "large.txt is larger than 0.1 MB" in said
    status, said = screen.evaluate(send, ["../../a.txt", 10, ours])
    assert status == 422
    assert "without folders" in said
    status, said = screen.evaluate(send, ["a.exe", 10, ours])
    assert status == 422
    assert "the ending must be .txt" in said
    status, said = screen.evaluate(send, ["a.txt", 10, {}])
    assert status == 403
    assert "large.txt" not in screen.inner_text("main")


def test_files_are_chosen_and_tables_sorted_with_the_keyboard(
    fresh_tab: Any, workbench: RunningWorkbench
) -> None:
    screen = fresh_tab
    screen.on("filechooser", lambda _: None)  # long before the key
    opened(screen, f"{workbench.address}components")
    drop(screen, "b.txt", b"1\n2\n")
    drop(screen, "c.txt", b"1\n" * 10)
    screen.wait_for_selector("td >> text=c.txt")
    given = {"name": "d.txt", "mimeType": "text/plain", "buffer": b"1\n1\n1\n"}
    screen.locator(".skip").focus()
    for _ in range(30):
        screen.keyboard.press("Tab")
        if screen.evaluate("document.activeElement.className") == "file-drop-input":
            break
    chosen_with_a_key(screen, "Enter", given)
    screen.wait_for_selector("td >> text=d.txt")
    heading = screen.get_by_role("button", name="lines", exact=True)
    for order in ("ascending", "descending"):
        heading.press("Enter")
        numbers = [float(t) for t in screen.locator(".document td:nth-child(2)").all_inner_texts()]
        assert screen.locator(".document th[aria-sort]").get_attribute("aria-sort") == order
        assert numbers == sorted(numbers, reverse=order == "descending")


def test_a_long_table_is_shown_in_parts_and_sorted_as_a_whole(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}components")
    table = page.locator(".data-table", has=page.get_by_role("region", name="Long table"))
    cells = table.locator("td:nth-child(1)")
    assert cells.count() == 25
    assert table.locator("[role=status]").inner_text() == "Rows 1 to 25 of 1050"
    table.get_by_role("button", name="row").click()
    table.get_by_role("button", name="row").click()
    assert cells.first.inner_text() == "1049"
    for _ in range(41):
        table.get_by_role("button", name="Later").click()
    assert cells.count() == 25
    assert cells.last.inner_text() == "0"
    table.get_by_role("button", name="value").click()
    assert table.locator("td:nth-child(2)").first.inner_text() == "-524.00"


def test_a_file_that_takes_seconds_says_that_it_is_being_made(screen: Any) -> None:
    drop(screen, "a.txt", b"1\n")
    with screen.expect_download() as download:
        screen.get_by_role("button", name="Slow").click()
        screen.wait_for_selector("text=Making slow.txt")
        screen.get_by_role("button", name="Go on").click()
    assert Path(download.value.path()).read_text() == "True"
    screen.wait_for_selector("text=Making slow.txt", state="detached")


def test_a_result_is_downloaded_and_its_command_copied(screen: Any) -> None:
    drop(screen, "a.txt", b"1\n")
    screen.wait_for_selector("text=lines, times")
    with screen.expect_download() as download:
        screen.get_by_role("button", name="Report").click()
    assert download.value.suggested_filename == "lines.txt"
    assert "lines, times" in Path(download.value.path()).read_text()
    screen.get_by_role("button", name="Refused").click()
    screen.wait_for_selector("[role=alert] >> text=no.txt: nothing to write")
    screen.get_by_role("button", name="Flawed").click()
    screen.wait_for_selector("[role=alert] >> text=this is an internal error of pretravel")
    screen.context.grant_permissions(["clipboard-read", "clipboard-write"])
    screen.get_by_text("The same on the command line").click()
    remember(screen, ".q-notification")
    screen.get_by_role("button", name="Copy: Command line").click()
    was_said(screen, "Copied")
    assert screen.evaluate("navigator.clipboard.readText()") == (
        "pretravel qualify 'a b.csv' --diameter 25"
    )


def test_a_picture_is_changed_in_place(screen: Any) -> None:
    """It is drawn once; a bar is the factor, with one line."""
    drop(screen, "a.txt", b"1\n")
    shown = "document.querySelector('.plot[aria-label=Product] .plot-area')"
    for factor in (3.0, 4.0, 5.0):
        screen.get_by_label("Factor [mm]").fill(f"{factor:g}")
        screen.wait_for_function(f"{shown}.data?.[0]?.y[0] === {factor}")
        if factor == 3.0:
            screen.evaluate(f"{shown}.drawn = 'first'")
        assert re.fullmatch(r"#\w+", screen.evaluate(f"{shown}.data[0].marker.color"))
    assert screen.evaluate(f"{shown}.drawn") == "first"


# What the server sends stays away from the page until it is let through, as on a slow computer.
BEHIND = """() => {
  window.held = [];
  const take = window.socket.onevent.bind(window.socket);
  window.socket.onevent = (packet) => window.held.push(packet);
  window.letThrough = () => { window.socket.onevent = take; window.held.forEach(take); };
}"""


def test_a_click_on_a_result_that_was_just_replaced_gives_the_new_one(screen: Any) -> None:
    drop(screen, "a.txt", b"1\n")
    screen.wait_for_selector("text=lines, times")
    screen.evaluate(BEHIND)
    screen.get_by_label("Factor [mm]").fill("7")
    screen.wait_for_function("JSON.stringify(held.map((p) => p.data)).includes('times 7 are 7')")
    assert "times 7" not in screen.inner_text("main")
    with screen.expect_download() as download:
        screen.get_by_role("button", name="Report").click()
        screen.evaluate("letThrough()")
    assert "times 7 are 7" in Path(download.value.path()).read_text()


@pytest.mark.slow
def test_a_click_that_ends_the_typing_gives_the_result_of_what_was_typed(screen: Any) -> None:
    drop(screen, "a.txt", b"1\n")
    screen.wait_for_selector("text=lines, times")
    for factor in ("8", "9"):
        screen.get_by_label("Factor [mm]").fill(factor)
        with screen.expect_download() as download:
            screen.get_by_role("button", name="Report").click()
        assert f"times {factor} are {factor}" in Path(download.value.path()).read_text()


def test_a_page_loads_nothing_from_elsewhere(page: Any, workbench: RunningWorkbench) -> None:
    """In a tab of its own: the scripts of the page are not in its memory yet."""
    page = page.context.new_page()
    asked: set[str] = set()
    page.on("request", lambda request: asked.add(request.url))
    page.on("websocket", lambda socket: asked.add(socket.url))
    for name in ("", "components"):
        opened(page, workbench.address + name)
        page.wait_for_load_state("networkidle")
    hosts = {
        re.sub(r"^\w+://([^/]*)/.*", r"\1", a) for a in asked if a[:5] not in ("data:", "blob:")
    }
    assert len(asked) > 10
    assert hosts == {workbench.address.removeprefix("http://").rstrip("/")}


def test_what_was_typed_is_in_the_file_of_the_project(
    screen: Any, workbench: RunningWorkbench
) -> None:
    screen.get_by_label("Label").fill("kept")
    drop(screen, "kept.txt", b"1\n")
    screen.wait_for_selector("td >> text=kept.txt")
    folder = workbench.data / "pretravel" / "projects"
    for _ in range(600):
        (path,) = (p for p in folder.glob("*.pretravel") if not is_unfinished(p))
        state = read_project(path).screen("components")
        names = [file.name for file in state.files["texts"]]
        if state.settings.get("label") == "kept" and "kept.txt" in names:
            break
        time.sleep(0.1)
    else:
        raise AssertionError("not saved within a minute")


def _presses(screen: Any) -> int:
    """How often the button was pressed, with the factor 2."""
    screen.get_by_label("Factor [mm]").fill("2")
    said = screen.wait_for_selector("text=/pressed [0-9]+ times with 2/").inner_text()
    return int(said.split()[1])


def test_a_click_on_a_button_that_was_just_replaced_is_none_that_is_lost(screen: Any) -> None:
    """A slow browser: it has not drawn yet what a typed number has changed."""
    before = _presses(screen)
    screen.evaluate(
        """async ([field, button]) => {
            field.value = '7';
            field.dispatchEvent(new Event('input', { bubbles: true }));
            field.dispatchEvent(new Event('blur'));
            await new Promise((later) => setTimeout(later, 0));
            const start = performance.now();
            while (performance.now() < start + 1000) {}
            button.click();
        }""",
        [
            screen.get_by_label("Factor [mm]").element_handle(),
            screen.get_by_role("button", name="Press").element_handle(),
        ],
    )
    screen.wait_for_selector(f"text=pressed {before + 1} times with 7")


def test_a_button_that_is_replaced_while_it_is_pressed_is_clicked(
    screen: Any, workbench: RunningWorkbench
) -> None:
    other = screen.context.new_page()
    opened(other, f"{workbench.address}components")
    before = _presses(screen)
    button = screen.get_by_role("button", name="Press")
    old = button.element_handle()
    button.hover()
    screen.mouse.down()
    other.get_by_label("Factor [mm]").fill("3")
    screen.wait_for_selector(f"text=pressed {before} times with 3")
    screen.wait_for_function("(old) => !old.isConnected", arg=old)
    screen.mouse.up()
    screen.wait_for_selector(f"text=pressed {before + 1} times with 3")
    # The keyboard has its place again too.
    button.focus()
    old = button.element_handle()
    other.get_by_label("Factor [mm]").fill("4")
    screen.wait_for_function("(old) => !old.isConnected", arg=old)
    screen.keyboard.press("Enter")
    screen.wait_for_selector(f"text=pressed {before + 2} times with 4")
    # Once is once.
    button.click()
    screen.wait_for_selector(f"text=pressed {before + 3} times with 4")
