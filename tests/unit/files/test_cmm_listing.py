"""Listings of a CMM: stated results and points of each feature, and touches of them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import FileReadings, ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.logs.cmm_listing import read_cmm_listing
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from pretravel.uncertainty.circle_fit import fit_circle
from tests.support.commands import rows, run
from tests.support.control_logs import CMM_LISTING_FILE, written

# As a spreadsheet saves it: commas, no zeros at the end, the bar and empty cells at the end.
SPREADSHEET = "\n".join(
    ",".join(re.sub(r"(\.\d*?)0+$", r"\1", cell).rstrip(".") for cell in line.split()) + ",,"
    for line in CMM_LISTING_FILE.splitlines()
)


def _file(text: str) -> SourceFile:
    return SourceFile("listing.txt", text.encode())


@pytest.mark.parametrize(
    "text",
    [
        CMM_LISTING_FILE,
        SPREADSHEET,
        CMM_LISTING_FILE.replace("\n", "\r\n"),
    ],
)
def test_each_feature_has_its_results_and_its_points(text: str) -> None:
    assert format_of(_file(text)).name == "cmm-listing"
    hole, top = read_cmm_listing(_file(text))
    assert (hole.kind, hole.name, hole.system) == ("CIRCLE", "HOLE1", "MCS")
    stated = {result.quantity: result for result in hole.results}
    assert (stated["D"].nominal, stated["D"].actual) == (20.0, 20.01)
    assert stated["D"].deviation == pytest.approx(0.01)
    assert stated["Cirlty"].actual == 0.012
    assert hole.points[1] == [10.002, 29.998, 5.0]
    assert hole.deviations == [0.006, -0.006, 0.006, -0.006]
    assert (top.numbers, top.results[-1].quantity) == ([1, 2, 3, 4], "Flat")


def test_the_features_follow_from_the_points() -> None:
    """Least squares of the points have the stated size and place, to the last printed digit."""
    hole, top = read_cmm_listing(_file(CMM_LISTING_FILE))
    fit = fit_circle(hole.points)
    assert 2.0 * fit.radius == pytest.approx(hole.actual("D")[0], abs=1e-4)
    assert np.allclose(fit.center[:2], hole.actual("X", "Y"), atol=1e-4, rtol=0.0)
    assert np.ptp(np.array(top.points)[:, 2]) == pytest.approx(top.actual("Flat")[0], abs=1e-4)


def test_touches_are_on_the_side_that_is_stated() -> None:
    for bores, radius in ((("HOLE1",), 9.011), ((), 11.011)):
        options = ReadingOptions(radius_taken_off=1.0, bores=bores)
        touches = read_readings(_file(CMM_LISTING_FILE), options).touches
        off = touches.positions[:4] - [10.002, 19.999, 5.0]
        assert np.linalg.norm(off, axis=1)[0] == pytest.approx(radius, abs=1e-9)
        side = np.sign(np.sum(off * touches.normals[:4], axis=1))
        assert set(side) == {-1.0 if bores else 1.0}
        assert touches.positions[4].tolist() == [0.0, 0.0, 9.003]
        assert touches.labels is not None
        assert touches.labels[3:5] == ("HOLE1-4", "TOP-1")
        assert touches.lines is not None
        assert touches.lines[0] == 11


def test_inches_become_millimetres_and_directions_stay() -> None:
    hole, _ = read_cmm_listing(_file(CMM_LISTING_FILE.replace(" MM ", " INCH ")))
    assert hole.actual("D", "K").tolist() == [pytest.approx(25.4 * 20.01), 1.0]
    assert hole.points[0][0] == pytest.approx(25.4 * 20.013)


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("0.0100      0.0500", "0.0200      0.0500", 8, "not its actual value 20.01 minus"),
        ("1      20.0130", "1      20.0230", 11, "0.01600 mm from HOLE1"),
        ("at Point 1", "at Point 9", 15, "no point 9"),
        ("Max error = 0.006000", "Max error = 0.016000", 15, "not the deviation 0.006 mm"),
        ("   3      -0.0090", "   2      -0.0090", 13, "the point 2 occurs twice"),
        ("   3      -0.0090", "   3   oops", 13, "'oops' is not a finite number"),
        ("   3      -0.0090 ", "   3 ", 13, "has 7 values"),
        ("Max error = 0.006000 at Point 1\n" + "_" * 40, "", 1, "HOLE1 is cut off"),
        ("PLANE TOP CART MCS", "PLANE TOP CART PCS", 17, "each has one system"),
        ("PLANE TOP CART", "PLANE TOP POL", 17, "CART is read"),
        ("PLANE TOP", "PLANE HOLE1", 17, "HOLE1 occurs twice"),
        ("D          20.0000", "E          20.0000", 1, "needs the results X, Y, Z, I, J, K, D"),
        ("K           1.0000      1.0000", "K           0.5000      0.5000", 1, "length 0.5"),
        ("0.0010      0.0500     -0.0500   ----*++++", "----*++++", 3, "is not a line of a list"),
        ("      CIRCLE HOLE1", "Part 7\n      CIRCLE HOLE1", 1, "before the first feature"),
    ],
)  # fmt: skip
def test_what_contradicts_itself_is_refused_with_its_line(
    old: str, new: str, line: int, words: str
) -> None:
    changed = CMM_LISTING_FILE.replace(old, new, 1)
    assert changed != CMM_LISTING_FILE
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        read_cmm_listing(_file(changed))
    assert f"line {line}:" in str(caught.value)


def test_a_kind_without_normals_is_named() -> None:
    other = CMM_LISTING_FILE.replace("PLANE TOP", "SLOT TOP")
    options = ReadingOptions(radius_taken_off=0.0, bores=())
    found = read_readings(_file(other), options)
    assert isinstance(found, FileReadings)
    assert len(found.touches) == 4
    assert "left out: SLOT TOP" in found.warnings[0]


def test_the_advice_leads_to_touches_and_to_features(tmp_path: Path) -> None:
    """Each message names the option that the next call has."""
    path, out = written(tmp_path, CMM_LISTING_FILE, "l.txt"), tmp_path / "t.csv"
    assert "add --features -o features.csv" in " ".join(run("convert", path).split())
    call: list[object] = ["convert", path, "-o", out]
    for asked, value in (("--radius-taken-off", 1), ("--bore", "HOLE1")):
        assert asked in run(*call, code=2)
        assert asked in run(*call[:2], *call[4:], code=2 if call[4:] else 0)
        call += [asked, value]
    run(*call)
    assert rows(out)[0]["label"] == "HOLE1-1"
    run("convert", path, "--features", "-o", tmp_path / "f.csv")
    assert rows(tmp_path / "f.csv")[6]["feature"] == "HOLE1"
    assert "none of the round features HOLE1" in run(*call[:-1], "B*", code=2)
    run(*call[:-1], "none")
    assert float(rows(out)[0]["nx"]) == 1.0
    assert "has no results" in run("convert", out, "--features", "-o", tmp_path / "g.csv", code=2)
