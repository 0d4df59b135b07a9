"""The dates of files: every usual form of a name, and names that cannot be understood."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_dates import dated_file


@pytest.mark.parametrize(
    ("name", "moment"),
    [
        ("2026-03-14.csv", datetime(2026, 3, 14)),
        ("ball_20260314.csv", datetime(2026, 3, 14)),
        ("ball 2026_03_14 late.csv", datetime(2026, 3, 14)),
        ("14-03-2026.csv", datetime(2026, 3, 14)),
        ("14.03.2026_sphere.log", datetime(2026, 3, 14)),
        ("03-04-2026.csv", datetime(2026, 4, 3)),
        ("2026-03-14T06-30.csv", datetime(2026, 3, 14, 6, 30)),
        ("20260314_063015.csv", datetime(2026, 3, 14, 6, 30, 15)),
        ("20260314063015.csv", datetime(2026, 3, 14, 6, 30, 15)),
        ("probe7_2026-03-14_2200_n12.csv", datetime(2026, 3, 14, 22)),
        ("2026-03-14_shift2.csv", datetime(2026, 3, 14)),
        ("2026-03-14 2026-03-14.csv", datetime(2026, 3, 14)),
    ],
)
def test_names(name: str, moment: datetime) -> None:
    found = dated_file(Path(name))
    assert found.moment == moment
    assert found.from_name


@pytest.mark.parametrize("name", ["touches.csv", "2026-02-31.csv", "120260314999.csv", "v3-14.csv"])
def test_without_a_date_it_is_the_last_change(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.touch()
    moment = datetime(2026, 3, 14, 6, 30)
    os.utime(path, (moment.timestamp(), moment.timestamp()))
    found = dated_file(path)
    assert found.moment == moment
    assert not found.from_name


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("cal_2025-01-10_of_2026-03-14.csv", "contains two dates, 2025-01-10 00:00 and 2026-03-14"),
        ("03-14-2026.csv", "month before the day.*such as 2026-03-14"),
        ("nowhere.csv", "cannot be read: No such file"),
    ],
)
def test_names_that_cannot_be_understood(name: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        dated_file(Path(name))
