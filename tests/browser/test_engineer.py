"""The screen Engineer: from dropped touches to values for the control, as the commands give."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.files.map_file import read_map
from pretravel.task.example_data import example_folder
from tests.browser.screens import click_in_picture, downloaded, same_values, tab
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems
from tests.support.commands import run

SPHERE = example_folder() / "sphere_touches.csv"
DIAMETERS = ("--diameter", "24.9987", "--tip-diameter", "6")


def drop(page: Any, content: bytes, name: str = "sphere.csv") -> None:
    page.set_input_files(
        '.file-drop-input[data-url$="/engineer/touches"]',
        {"name": name, "mimeType": "text/csv", "buffer": content},
    )


def state_diameters(page: Any) -> None:
    page.get_by_label("Diameter of the reference [mm]").fill("24.9987")
    page.get_by_label("Diameter of the tip [mm]").fill("6")


def choose_control(page: Any, name: str) -> None:
    page.get_by_label("Your control").click()
    page.get_by_role("option", name=name, exact=True).click()


def step(page: Any, words: str) -> None:
    page.wait_for_selector(f'.next-step:has-text("{words}")')


def test_a_newcomer_goes_from_the_file_to_the_values_of_the_control(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    """The page names each next step; map and files of the control are those of the commands."""
    opened(page, f"{workbench.address}engineer")
    step(page, "Drop the file")
    drop(page, SPHERE.read_bytes())
    page.wait_for_selector(".plot-area canvas")
    step(page, "Type the diameter of the reference")
    page.get_by_label("Diameter of the reference [mm]").fill("24.9987")
    step(page, "Type the diameter of the tip")
    page.get_by_label("Diameter of the tip [mm]").fill("6")
    step(page, "Choose your control")
    page.wait_for_selector("text=a sector table in the control leaves up to 7.3 µm")
    choose_control(page, "Fanuc (macro programs)")
    step(page, "Download the values")
    archive = downloaded(page, "Download fanuc.zip", tmp_path)
    page.get_by_text("Map and report", exact=True).click()
    mine = downloaded(page, "Map for pretravel (.json)", tmp_path)
    assert serious_problems(page) == []

    touches, theirs = tmp_path / "sphere.csv", tmp_path / "theirs.json"
    touches.write_bytes(SPHERE.read_bytes())
    run("qualify", touches, *DIAMETERS, "-o", theirs)
    assert np.array_equal(read_map(mine).coefficients, read_map(theirs).coefficients)
    assert np.array_equal(read_map(mine).covariance.matrix, read_map(theirs).covariance.matrix)
    run("export", theirs, "--to", "fanuc", "-o", tmp_path / "fanuc")
    with zipfile.ZipFile(archive) as files:
        content = {name: files.read(name) for name in files.namelist()}
    # The steps are those of these files, in their own words.
    steps, head = page.inner_text(".steps"), b"".join(content.values()).decode()
    assert "NEEDS NO TABLE OF VARIABLES" in head
    assert not re.search("both programs|table is filled", steps)
    assert all(call in head for call in re.findall(r"G65 P\d+", steps))
    assert content == {path.name: path.read_bytes() for path in (tmp_path / "fanuc").iterdir()}
    compensate_a_part(page, mine, tmp_path)


def compensate_a_part(page: Any, map_file: Path, folder: Path) -> None:
    """A second file gets points with the map of the screen, as the command makes them."""
    part = example_folder() / "part_touches.csv"
    tab(page, "Files")
    page.get_by_text("Try the map on a part", exact=True).click()
    page.set_input_files('.file-drop-input[data-url$="/engineer/part"]', str(part))
    mine, theirs = downloaded(page, "Surface points", folder), folder / "theirs.csv"
    run("compensate", part, "--map", map_file, "-o", theirs)
    assert same_values(mine, theirs)


def test_an_unticked_touch_is_left_out_in_every_tab_and_as_the_command_does(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    """Touch 10 is on line 10; a gross error of 50 µm there is named, and left out by a click."""
    lines = SPHERE.read_text().splitlines()
    cells = lines[9].split(",")
    cells[2] = f"{float(cells[2]) + 0.05:.6f}"
    lines[9] = ",".join(cells)
    text = "\n".join(lines) + "\n"
    opened(page, f"{workbench.address}engineer")
    state_diameters(page)
    drop(page, text.encode())
    tab(page, "Touches")
    bad = page.get_by_role("row").filter(has=page.get_by_label("Use touch line 10", exact=True))
    page.wait_for_selector('tr:has-text("outlier")')
    assert "outlier" in bad.inner_text()
    page.get_by_label("Use touch line 10", exact=True).click()
    page.wait_for_selector("text=You left out 1 of 75 touches")
    marked = "document.querySelector('.plot-area').data.find((t) => t.name === 'left out by you')"
    page.wait_for_function(f"{marked}?.x.length === 1")  # in the picture that is changed in place
    other = page.context.new_page()
    opened(other, f"{workbench.address}engineer")
    tab(other, "Touches")
    other.wait_for_selector("text=You left out 1 of 75 touches")
    assert not other.get_by_label("Use touch line 10", exact=True).is_checked()
    touches, theirs = tmp_path / "sphere.csv", tmp_path / "theirs.json"
    touches.write_text(text)
    run("qualify", touches, *DIAMETERS, "--exclude", "sphere.csv:10", "-o", theirs)
    mine = read_map(downloaded_map(other, tmp_path))
    assert np.array_equal(mine.coefficients, read_map(theirs).coefficients)
    other.get_by_role("button", name="Use all touches again").click()
    page.wait_for_selector("text=Untick it below")
    assert page.get_by_label("Use touch line 10", exact=True).is_checked()


def downloaded_map(page: Any, folder: Path) -> Path:
    page.get_by_text("Map and report", exact=True).click()
    (folder / "mine").mkdir()
    return downloaded(page, "Map for pretravel (.json)", folder / "mine")


@pytest.mark.parametrize("label", ["<img src=x onerror=alert(1)>"])
def test_what_a_file_does_not_state_is_asked_and_its_labels_stay_text(
    page: Any, workbench: RunningWorkbench, label: str
) -> None:
    rows = [line.split(",") for line in SPHERE.read_text().splitlines()[1:]]
    names = [label, *(f"p{i}" for i in range(1, len(rows)))]
    text = "Point;X;Y;Z;I;J;K\n" + "\n".join(
        ";".join([name, *(cell.replace(".", ",") for cell in row)])
        for name, row in zip(names, rows, strict=True)
    )
    opened(page, f"{workbench.address}engineer")
    drop(page, text.encode(), "shop.csv")
    page.wait_for_selector("text=In which unit are the lengths")
    # Another file, which cannot be read: the question was that of the file before.
    drop(page, b"\xff\xd8\xff\xe0" + bytes(range(256)), "photo.jpg")
    page.wait_for_selector(".error-view:has-text('this is not a text file')")
    page.get_by_role("button", name="Millimetres", exact=True).wait_for(state="hidden")
    state_diameters(page)
    page.wait_for_selector("text=When the probe is qualified, a bad touch can be unticked.")
    drop(page, text.encode(), "shop.csv")
    page.get_by_role("button", name="Millimetres", exact=True).click()
    page.wait_for_selector("text=mm (given)")
    state_diameters(page)
    page.wait_for_selector("text=a sector table in the control leaves up to")
    tab(page, "Touches")
    page.get_by_role("button", name="Show 75 touches", exact=True).click()
    page.get_by_label(f"Use touch {label}", exact=True).wait_for()
    page.wait_for_selector(".plot-area canvas")
    click_in_picture(page, ".plot-area", {"curveNumber": 2, "pointNumber": 3})
    page.wait_for_selector("text=You left out 1 of 75 touches")
    assert not page.get_by_label("Use touch p3", exact=True).is_checked()
    assert page.locator("main img").count() == page.locator("main .picture img").count()
