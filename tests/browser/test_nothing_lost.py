"""Files, answers, numbers: nothing is replaced without a way back, no fault is a dead end."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from pretravel.task.example_data import example_folder
from tests.browser import screens
from tests.browser.screens import settled
from tests.browser.test_engineer import SPHERE, drop, state_diameters, step
from tests.browser.workbench_server import RunningWorkbench, opened, running_workbench
from tests.support.commands import run

REFERENCE = "Diameter of the reference [mm]"


def _in_inches() -> bytes:
    """The example's touches in inches, in a table that does not say so."""
    rows = [line.split(",") for line in SPHERE.read_text().splitlines()[1:]]
    lines = [",".join([*(f"{float(v) / 25.4:.6f}" for v in row[:3]), *row[3:]]) for row in rows]
    return "\n".join(["x,y,z,i,j,k", *lines]).encode()


def _map(folder: Path) -> Path:
    made = folder / "mine.json"
    run("qualify", SPHERE, "--diameter", "24.9987", "--tip-diameter", "6", "-o", made)
    return made


def _names(page: Any) -> list[str]:
    return [str(name) for name in page.locator(".file-list .file-name").all_inner_texts()]


def test_the_touches_of_today_replace_those_of_yesterday(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    yesterday, today = tmp_path / "2026-03-01.csv", tmp_path / "2026-03-02.csv"
    for path in (yesterday, today):
        path.write_bytes(SPHERE.read_bytes())
    opened(page, f"{workbench.address}task/verify")
    screens.drop(page, "task-verify", "touches", yesterday)
    page.wait_for_selector(".file-name:has-text('2026-03-01')")
    screens.drop(page, "task-verify", "touches", today)
    page.wait_for_selector(".way-back:has-text('2026-03-02.csv replaced 2026-03-01.csv')")
    assert _names(page) == ["2026-03-02.csv"]
    # Several files of one day: asked for, by a click.
    page.get_by_role("button", name="Use all together").click()
    page.wait_for_selector(".file-name:has-text('2026-03-01')")
    assert _names(page) == ["2026-03-01.csv", "2026-03-02.csv"]


def test_an_example_does_not_take_away_what_the_user_had(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes(), "mine.csv")
    page.wait_for_selector('.file-name:has-text("mine.csv")')
    page.get_by_label(REFERENCE).fill("24.99")
    page.get_by_label(REFERENCE).blur()
    step(page, "Type the diameter of the tip")
    page.get_by_role("button", name="Try it with example data").click()
    page.wait_for_selector('.file-name:has-text("sphere_touches.csv")')
    page.get_by_role("button", name="Back to my own files and settings").click()
    page.wait_for_selector('.file-name:has-text("mine.csv")')
    assert page.get_by_label(REFERENCE).input_value() == "24.99"
    assert page.get_by_label("Diameter of the tip [mm]").input_value() == ""


def test_a_file_that_replaced_another_one_is_taken_away_again(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes(), "mine.csv")
    page.wait_for_selector('.file-name:has-text("mine.csv")')
    drop(page, b"x,y,z\n1,2,3\n", "wrong.csv")
    page.wait_for_selector('.file-name:has-text("wrong.csv")')
    page.get_by_role("button", name="Take it back").click()
    page.wait_for_selector('.file-name:has-text("mine.csv")')
    assert _names(page)[0] == "mine.csv"


def test_a_wrong_answer_about_the_unit_can_be_taken_back(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, _in_inches())
    state_diameters(page)
    # The error has the answers as buttons.
    page.wait_for_selector(".error-view:has-text('look like inches')")
    page.get_by_role("button", name="Inches").first.click()
    step(page, "Choose your control")
    # The answer is a field below the file.
    unit = page.get_by_label("Unit of the file")
    assert unit.input_value() == "Inches"
    unit.click()
    page.get_by_role("option", name="Millimetres").click()
    page.wait_for_selector(".error-view:has-text('look like inches')")
    page.get_by_label("Unit of the file").click()
    option = page.get_by_role("option", name="as the file shows it").element_handle()
    answer = page.get_by_role("button", name="Inches").first.element_handle()
    # A slow browser: the second click comes before it has drawn what the first one changed.
    page.evaluate(
        """async ([option, answer]) => {
            option.click();
            await new Promise((later) => setTimeout(later, 0));
            const start = performance.now();
            while (performance.now() < start + 1000) {}
            answer.click();
        }""",
        [option, answer],
    )
    step(page, "Choose your control")


def test_a_file_of_another_screen_is_recognised_and_taken_there(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    for path, words, place in (
        (example_folder() / "rig" / "rig_000_1.csv", "a trace of a calibration rig", "laboratory"),
        (_map(tmp_path), "the map of a probe", "part"),
        (example_folder() / "part.step", "a part (STEP)", "part"),
    ):
        opened(page, f"{workbench.address}engineer")
        screens.drop(page, "engineer", "touches", path)
        page.wait_for_selector(f".file-drop-status.problem:has-text('{path.name} is {words}')")
        page.locator("button.offer").click()
        page.wait_for_url(f"**/{place}?*")
        page.wait_for_selector(f'.file-name:has-text("{path.name}")')
    opened(page, f"{workbench.address}engineer")
    page.wait_for_selector(".next-step")
    assert _names(page) == []


def test_an_unknown_file_gets_two_lines_and_not_a_list_of_all_formats(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, b"hello\nworld\n", "letter.txt")
    page.wait_for_selector(".error-view:has-text('is not a table of touches')")
    assert len(page.locator(".error-view").first.inner_text()) < 300
    assert "PC-DMIS" not in page.inner_text("main")
    page.locator(".error-view summary").first.click()
    page.wait_for_selector("text=measurement routine of PC-DMIS")


def test_a_wrong_file_is_said_before_the_others_are_there(
    page: Any, workbench: RunningWorkbench
) -> None:
    def give(place: str, name: str, content: bytes) -> None:
        given = {"name": name, "mimeType": "text/plain", "buffer": content}
        page.set_input_files(f'.file-drop-input[data-url$="{place}"]', given)

    doubt = ".file-drop-status.problem"
    opened(page, f"{workbench.address}daily")
    give("/daily/map", "other.json", b'{"hello": 1}')
    page.wait_for_selector(f"{doubt}:has-text('other.json is not a map of a probe')")
    opened(page, f"{workbench.address}part")
    give("/part/touches", "photo.jpg", bytes(range(256)))
    page.wait_for_selector(f"{doubt}:has-text('this is not a text file')")
    give("/part/touches", "letter.txt", b"Dear Sir")
    page.wait_for_selector(f"{doubt}:has-text('is not a table of touches')")
    # With all that it needs the work says it, and nobody else.
    give("/part/map", "other.json", b'{"hello": 1}')
    page.wait_for_selector(".error-view")
    assert page.locator(doubt).count() == 0


def test_words_of_a_page_are_not_those_of_a_command(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}tasks")
    said = page.inner_text("main")
    for link in page.locator(".task-list a").all():
        assert link.inner_text() in said
    assert not re.search(r"Exit code|(?<!\w)--[a-z]", said)
    opened(page, f"{workbench.address}task/verify")
    assert not re.search(r"Exit code|(?<!\w)--[a-z]", page.inner_text("main .summary"))


def test_what_is_typed_without_a_connection_leaves_no_verdict_of_before(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    state_diameters(page)
    page.wait_for_selector(".verdict")
    settled(page)
    page.evaluate("window.socket.disconnect()")
    page.wait_for_selector(".lost:has-text('Not connected')")
    page.get_by_label(REFERENCE).fill("24.99.87")
    page.get_by_label(REFERENCE).blur()
    # After the time for which a number is taken for unfinished.
    page.wait_for_function("!document.body.classList.contains('typing')")
    style = "e => [getComputedStyle(e).pointerEvents, getComputedStyle(e).opacity]"
    for place in (".screen-answer", ".screen-picture", ".q-tab-panels", ".next-step"):
        assert page.locator(place).evaluate(style) == ["none", "0.6"], place
    page.evaluate("window.socket.connect()")
    step(page, "the value in this field is not valid")


@pytest.mark.parametrize("way", ["reload", "a step back"])
def test_what_is_typed_at_the_moment_of_leaving_is_not_lost(
    page: Any, workbench: RunningWorkbench, way: str
) -> None:
    """A field tells the server after a pause of typing, which the page does not wait for."""
    opened(page, workbench.address)
    opened(page, f"{workbench.address}engineer")
    page.get_by_label(REFERENCE).fill("25.0007")
    if way == "reload":
        page.reload()
    else:
        page.go_back()
        page.go_forward()
    page.wait_for_selector("main h1")
    page.wait_for_function(
        "() => document.querySelector('main input[aria-label^=\"Diameter of the reference\"]')"
        "?.value === '25.0007'"
    )
    page.wait_for_function("!document.body.classList.contains('typing')")
    settled(page)
    opened(page, f"{workbench.address}engineer")  # the server has it, not the browser alone
    assert page.get_by_label(REFERENCE).input_value() == "25.0007"


def test_sixty_files_come_as_one_request(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}laboratory")
    content = (example_folder() / "rig" / "rig_000_1.csv").read_bytes()
    requests: list[str] = []
    page.on("request", lambda r: requests.append(r.url) if "/upload/" in r.url else None)
    files = [
        {"name": f"rig_{azimuth:03d}_{repeat}.csv", "mimeType": "text/csv", "buffer": content}
        for azimuth in range(0, 360, 18)
        for repeat in (1, 2, 3)
    ]
    page.set_input_files('.file-drop-input[data-url$="/laboratory/traces"]', files)
    page.wait_for_selector("text=60 files, ")
    assert len(requests) == 1


def test_a_tab_of_before_a_new_start_says_what_to_do(fresh_tab: Any, tmp_path: Path) -> None:
    with running_workbench(tmp_path) as workbench:
        opened(fresh_tab, f"{workbench.address}engineer")
        port = workbench.address.rsplit(":", 1)[1].strip("/")
    fresh_tab.wait_for_selector(".lost:has-text('Start it again')")
    with running_workbench(tmp_path, "--port", port):
        fresh_tab.wait_for_selector(".lost:has-text('open the address that it printed')")
