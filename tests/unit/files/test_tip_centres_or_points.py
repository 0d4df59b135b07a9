"""Coordinates for measure: points of the surface, or tip centres, as the file itself says."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base import InputError
from pretravel.files import ReadingOptions, SourceFile
from pretravel.files.points_reading import points_and_notes

_ANGLES = np.arange(8) * np.pi / 4


def _file(radius: float, title: str = "", header: str = "X,Y,Z", behind: str = "") -> SourceFile:
    rows = [f"{radius * np.cos(a):.4f},{radius * np.sin(a):.4f},-5.0{behind}\n" for a in _ANGLES]
    return SourceFile("a.csv", (title + header + "\n" + "".join(rows)).encode())


@pytest.mark.parametrize(
    "file",
    [
        _file(17.0, "# tip centres, not compensated\n"),
        _file(17.0, "Radius compensation: off\n"),
        _file(17.0, header="Tip X,Tip Y,Tip Z"),
        _file(17.0, header="Ball centre X,Ball centre Y,Ball centre Z"),
        _file(17.0, header="X,Y,Z,Compensated", behind=",no"),
    ],
)
def test_tip_centres_need_the_tip(file: SourceFile) -> None:
    with pytest.raises(InputError, match="these are tip centres, not points of the surface"):
        points_and_notes(file, ReadingOptions(units="mm"))


@pytest.mark.parametrize(
    "file",
    [
        _file(20.0, "# compensated points\n"),
        _file(20.0, header="X,Y,Z,Compensated", behind=",yes"),
    ],
)
def test_points_that_the_file_calls_compensated_are_read_as_they_are(file: SourceFile) -> None:
    points, _ = points_and_notes(file, ReadingOptions(units="mm"))
    assert np.allclose(np.hypot(*points.positions[:, :2].T), 20.0, rtol=0.0, atol=1e-3)
    with pytest.raises(InputError, match="compensated"):
        points_and_notes(file, ReadingOptions(units="mm", tip_radius=3.0))
