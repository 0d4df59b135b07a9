"""The screen Part: from dropped files to points and features, equal to the command line's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pretravel.drawing.screen.work import example_map
from pretravel.task.example_data import example_folder
from tests.browser.screens import (
    click_in_picture,
    data_lines,
    downloaded,
    drop,
    run_shown_lines,
    same_values,
    settled,
    tab,
)
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems
from tests.support.commands import run

EXAMPLES = example_folder()


@pytest.fixture(scope="module")
def map_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    name, content = example_map(EXAMPLES)
    path = tmp_path_factory.mktemp("map") / name
    path.write_bytes(content)
    return path


def test_points_and_features_are_those_of_the_command_line_and_of_the_lines_shown(
    page: Any, workbench: RunningWorkbench, map_file: Path, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}part")
    touches, part = EXAMPLES / "part_touches.csv", EXAMPLES / "part.step"
    for purpose, path in (("touches", touches), ("map", map_file), ("part", part)):
        drop(page, "part", purpose, path)
    tab(page, "One point")
    page.wait_for_selector("text=from first contact to trigger")  # only with the part
    settled(page)
    assert serious_problems(page) == []
    tab(page, "Files")
    mine = downloaded(page, "points.csv", tmp_path)
    theirs = tmp_path / "by_command.csv"
    run("compensate", touches, "--map", map_file, "--nominal", part, "-o", theirs)
    assert same_values(mine, theirs)
    shown = tmp_path / "shown"
    shown.mkdir()
    run_shown_lines(page, shown, (touches, part, map_file))
    assert (shown / "points.csv").exists()

    tab(page, "Features")
    page.get_by_label("u of the machine [µm]").fill("2")
    page.get_by_role("button", name="Measure", exact=True).click()
    page.wait_for_selector("text=plane, 140 points: flatness")
    features = downloaded(page, "features.csv", tmp_path)
    by_command = tmp_path / "features_by_command.csv"
    run("measure", theirs, "--feature", "plane", "--u-machine", 2, "-o", by_command)
    assert same_values(features, by_command)
    page.get_by_label("u of the machine [µm]").fill("3")
    # The click ends the typing; the button stays under the pointer while a person presses it.
    page.get_by_role("button", name="Measure", exact=True).click(delay=500)
    page.wait_for_selector("text=--u-machine 3")
    a_point_shows_its_budget_in_every_tab(page, workbench)


def a_point_shows_its_budget_in_every_tab(page: Any, workbench: RunningWorkbench) -> None:
    tab(page, "One point")
    page.wait_for_selector("text=Budget of this point")
    page.get_by_label("Point", exact=True).click()
    page.get_by_role("option", name="3: 3", exact=True).click()
    other = page.context.new_page()
    opened(other, f"{workbench.address}part")
    tab(other, "One point")
    other.wait_for_selector("text=Budget of this point")
    assert other.get_by_label("Point", exact=True).input_value() == "3: 3"


def test_a_part_that_lies_anywhere_is_aligned_and_its_faces_are_measured(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}part")
    page.get_by_role("button", name="Example of a part that lies anywhere").click()
    tab(page, "Compensation")
    page.wait_for_selector("text=79 of 79 touches, best fit")
    settled(page)
    assert serious_problems(page) == []
    tab(page, "Files")
    downloaded(page, "place.json", tmp_path)
    points = downloaded(page, "points.csv", tmp_path)
    assert len(data_lines(points)) == 80
    # As a person who clicks on the wall of the bore of 12 mm, in the frame of the part.
    place = {"curveNumber": 0, "pointNumber": 1e9, "x": 18, "y": 12, "z": 10}
    click_in_picture(page, ".charts .plot-area", place)
    tab(page, "One point")
    page.wait_for_selector("text=8 points: diameter 12.00")
    page.wait_for_selector("text=--select 'bore1-*'")
    drawing = tmp_path / "drawing.toml"
    drawing.write_text(
        '[[feature]]\nkind = "cylinder"\nselect = "bore1-*"\ntolerance = "11.95..12.05"\n'
        '[[feature]]\nkind = "cylinder"\nselect = "boss-*"\ntolerance = "14.01..14.02"\n'
    )
    tab(page, "Features")
    page.get_by_label("Tolerance of the diameter", exact=True).wait_for()
    drop(page, "part", "drawing", drawing)
    # What decides is in view: with a drawing there is no other tolerance on the page.
    page.get_by_label("Tolerance of the diameter", exact=True).wait_for(state="detached")
    page.get_by_role("button", name="Measure", exact=True).click()
    page.wait_for_selector("text=1 outside the tolerance")
    assert serious_problems(page) == []
    # Features are those of the points: what changes the points makes them old.
    page.get_by_role("button", name="The touches are in the frame of the part").click()
    page.wait_for_selector("text=The settings have changed since this result.")
