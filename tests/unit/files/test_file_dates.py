"""The dates of files: every usual form of a name, and names that cannot be understood."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_dates import dated_file, time_of_touches
from pretravel.files.touches_csv import read_touches


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
    ("title", "cells", "moment"),
    [
        ("time", ("2026-03-14 06:30:05", "2026-03-14 06:31:00"), datetime(2026, 3, 14, 6, 30, 5)),
        ("Datum", ("14.03.26 06:30", "14.03.26 06:31"), datetime(2026, 3, 14, 6, 30)),
        ("date", ("14-MAR-2026", "14-MAR-2026"), datetime(2026, 3, 14)),
        ("Date,Time", ("3/14/2026,6:30 PM", "3/14/2026,6:31 PM"), datetime(2026, 3, 14, 18, 30)),
        ("date", ("03/03/2026", "03/04/2026"), "'03/04/2026' is 3 April or 4 March"),
        ("date", ("03/04/2026", "03/04/2026"), "'03/04/2026' is 3 April or 4 March, and not used"),
        ("date", ("3/4/2026", "3/14/2026"), datetime(2026, 3, 4)),
        ("time", ("0.5", "0.7"), ""),
        ("# date: 14.03.2026", None, datetime(2026, 3, 14)),
        ("# calibrated 2025-01-10", None, ""),
    ],
)
def test_dates_of_rows(
    tmp_path: Path, title: str, cells: tuple[str, str] | None, moment: datetime | str
) -> None:
    first, named = (title, "") if cells is None else ("", f",{title}")
    ends = [f",{cell}" for cell in cells or ()] or [""] * 2
    rows = "".join(f"{x},0,3,0,0,1{end}\n" for x, end in enumerate(ends))
    path = tmp_path / "touches.csv"
    path.write_text(f"{first}\nx_mm,y_mm,z_mm,nx,ny,nz{named}\n{rows}".lstrip())
    found = dated_file(path)
    assert not found.from_name
    if isinstance(moment, datetime):
        assert found.moment == moment
        assert found.from_rows
        assert cells is None or f"touched {moment:%Y-%m-%d}" in read_touches(path).reading
        last = time_of_touches([path])[0]
        assert last is not None
        path = path.rename(tmp_path / "2026-07-01.csv")
        with pytest.raises(InputError, match="name has the date 2026-07-01, and its rows were t"):
            dated_file(path)
    else:
        assert moment in found.unclear
        assert not found.from_rows
        path = path.rename(tmp_path / "2026-03-14_0630.csv")
        by_name = None if moment else datetime(2026, 3, 14, 6, 30)  # a row may contradict it
        assert time_of_touches([path]) == (by_name, "")


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
