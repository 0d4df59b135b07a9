"""A log in which each row stands several times: copies are no repeats, whatever reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base import InputError
from pretravel.files import ReadingOptions, points_and_notes, read_series
from pretravel.files.readings import write_readings
from pretravel.touches.copied_rows import EACH_ROW, certain_copies, rows_in_a_row
from tests.support.examples import EXAMPLES

ROWS = (EXAMPLES / "sphere_touches.csv").read_text("utf-8").splitlines()


@pytest.mark.parametrize(
    ("digits", "often", "found"),
    [(7, 3, 3), (7, 1, 1), (4, 3, 3), (3, 3, 3), (3, 2, 1), (2, 3, 1)],
)
def test_rows_alike_to_the_last_digit(digits: int, often: int, found: int) -> None:
    """Of 25 touches. In steps of 1 µm it needs 41 copies to exclude chance, of 10 µm 410."""
    log = np.round(np.random.default_rng(4).uniform(0.0, 30.0, (25, 3)), digits)
    assert rows_in_a_row(np.repeat(log, often, axis=0)) == found


def test_repeats_that_are_alike_here_and_there_are_no_copies() -> None:
    """A quiet probe in steps of 0.1 µm: some of three repeats are alike."""
    rng = np.random.default_rng(5)
    log = np.repeat(rng.uniform(0.0, 30.0, (25, 3)), 3, axis=0) + rng.normal(0.0, 5e-5, (75, 3))
    assert rows_in_a_row(np.round(log, 4)) == 1


@pytest.mark.parametrize("noise", [5e-5, 3e-4])
@pytest.mark.parametrize("step", [0.0, 1e-5, 1e-4, 1e-3, 2.54e-3])
def test_copies_in_another_order_are_certain_and_real_repeats_are_not(
    step: float, noise: float
) -> None:
    """Three passes over 25 places; in steps of 2.5 µm repeats of 0.05 µm are all alike."""
    rng = np.random.default_rng(6)
    places = rng.uniform(0.0, 30.0, (25, 3))
    real = np.vstack([places + rng.normal(0.0, noise, (25, 3)) for _ in range(3)])
    real = np.round(real / step) * step if step else real
    assert not certain_copies(real).any()
    order = rng.permutation(75)
    hidden = step > noise * 5.0
    assert certain_copies(np.vstack([real, real[order]])).sum() == (0 if hidden else 75)
    if not step:
        assert certain_copies(np.vstack([real, real[order[:20]]])).sum() == 20
        assert certain_copies(np.vstack([real, real[order].round(4)])).sum() == 75


@pytest.mark.parametrize("often", [1, 3])
def test_a_log_of_copies_is_said(often: int, tmp_path: Path) -> None:
    """By what every task reads touches with, and by `measure` for coordinates."""
    log = [ROWS[0], *(row for row in ROWS[1:] for _ in range(often))]
    (tmp_path / "log.csv").write_text("\n".join(log), "utf-8")
    coordinates = [",".join(row.split(",")[:3]) for row in log]
    (tmp_path / "points.csv").write_text("\n".join(coordinates), "utf-8")
    touches = " ".join(read_series([tmp_path / "log.csv"]).warnings)
    points = " ".join(points_and_notes(tmp_path / "points.csv", ReadingOptions())[1])
    assert (EACH_ROW in touches) == (EACH_ROW in points) == (often > 1)


@pytest.mark.parametrize(("title", "here", "there"), [("wcs", "G54", "G55"), ("A", "0", "90")])
@pytest.mark.parametrize("normals", [True, False])
def test_files_in_other_coordinates_are_no_series(
    title: str, here: str, there: str, *, normals: bool, tmp_path: Path
) -> None:
    cells = [row if normals else ",".join(row.split(",")[:3]) for row in ROWS]
    paths = tmp_path / "a.csv", tmp_path / "b.csv"
    options = ReadingOptions(reference_diameter=24.9987)

    def read(*words: str) -> int:
        for path, word, rows in zip(paths, words, (cells[1:40], cells[40:]), strict=True):
            lines = [f"{cells[0]},{title}", *(f"{row},{word}" for row in rows)]
            path.write_text("\n".join(lines), "utf-8")
        return len(read_series(paths, options).touches)

    assert read(here, here) == 75
    with pytest.raises(InputError, match=f"b.csv: gives the coordinates as {title} {there}, and"):
        read(here, there)


def test_files_of_two_tips_are_no_series(tmp_path: Path) -> None:
    touches, paths = read_series([EXAMPLES / "sphere_touches.csv"]).touches, []
    for radius in (2.5, 1.5):
        paths.append(tmp_path / f"{radius}.qif")
        write_readings(paths[-1], touches, radius)
    with pytest.raises(InputError, match=r"1\.5.qif: gives the tip.s diameter as 3 mm, and 2"):
        read_series(paths)
