"""The table of a Heidenhain control: its rows, the deviations that it leaves, its template."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls import heidenhain
from pretravel.controls.heidenhain import heidenhain_table
from pretravel.controls.lookup import Band
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import lobes, mean_map

TEMPLATE = "{title} {residual_um:.3f} {where}\n{number} {angle_deg:g} {deviation_mm:.6f}"
# 1, y, z, x and sin³ cos 3 azimuth, of a probe that is tilted in the machine.
MADE = PretravelMap(
    HarmonicBasis(np.array([[0, 0], [1, -1], [1, 0], [1, 1], [3, 3]])),
    np.array([0.0101234567, 0.001, 0.0007, -0.0003, 0.002]),
    Covariance.none(5), mean_map(0.01).support, tip_radius=3.0,
    rotation=probe_rotation((0.6, 0.0, 0.8), 0.2),
)  # fmt: skip


def _pretravel(polar: float, azimuth: np.ndarray) -> np.ndarray:
    """The same by hand, in the frame of the probe."""
    s, c = math.sin(polar * DEGREE), math.cos(polar * DEGREE)
    plane = s * (0.001 * np.sin(azimuth) - 0.0003 * np.cos(azimuth))
    lobed = 0.002 * math.sqrt(35.0 / 8.0) * s**3 * np.cos(3.0 * azimuth)
    return np.asarray(0.0101234567 + math.sqrt(3.0) * (plane + 0.0007 * c) + lobed)


def _holds(monkeypatch: pytest.MonkeyPatch, lowest: float, highest: float) -> None:
    band = Band(lowest * DEGREE, highest * DEGREE)
    monkeypatch.setattr(heidenhain, "supported_band", lambda made: band)


@pytest.mark.parametrize("azimuth", [None, 60.0])
def test_rows_and_residuals(azimuth: float | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each row has the mean of its own circle, or the value at an azimuth; what this leaves in any
    other direction is named. The map is asked outside of its support too, where the band ends."""
    _holds(monkeypatch, 12.0, 104.0)
    at = None if azimuth is None else azimuth * DEGREE
    lines = heidenhain_table(MADE, TEMPLATE, azimuth=at, step_deg=20.0, travel=0.001).splitlines()
    around = np.arange(0.0, 360.0, 5.0) * DEGREE
    rows = np.array([20.0, 40.0, 60.0, 80.0, 100.0])
    table = np.array([
        _pretravel(polar, around).mean() if at is None else float(_pretravel(polar, np.array(at)))
        for polar in rows
    ])  # fmt: skip
    for number, (polar, value) in enumerate(zip(rows, table, strict=True)):
        assert lines[1 + number] == f"{number} {polar:g} {-value - 0.001:.6f}"
    assert len(lines) == 6
    # The control goes straight from row to row, and 20° apart this is an error of its own.
    left = 1e3 * max(
        np.abs(_pretravel(polar, around) - np.interp(polar, rows, table)).max()
        for polar in np.arange(20.0, 101.0)
    )
    where = "the mean over the azimuth" if at is None else "the probe touched at azimuth 60 degrees"
    assert lines[0] == f"pretravel {left:.3f} {where}"


@pytest.mark.parametrize(("step", "angles"), [(0.5, 21), (None, 3), (10.1, 2)])
def test_steps(step: float | None, angles: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 5 degrees where none is stated; both ends of the band belong to it."""
    _holds(monkeypatch, 0.0, 10.1)
    given = {} if step is None else {"step_deg": step}
    found = heidenhain_table(mean_map(0.01), "{angle_deg:g}", **given).split()
    assert found == [f"{(step or 5.0) * i:g}" for i in range(angles)]
    _holds(monkeypatch, 1.0, 4.0)
    with pytest.raises(PretravelError, match=r"from 1\.0° to 4\.0° .* has none there"):
        heidenhain_table(mean_map(0.01))
    for wrong in (0.0, -1.0, math.nan):
        with pytest.raises(PretravelError, match="it must be positive"):
            heidenhain_table(mean_map(0.01), step_deg=wrong)


def test_default_template_says_that_it_is_unverified() -> None:
    text = heidenhain_table(lobes(3))
    assert "UNVERIFIED" in text.splitlines()[0]
    last = text.splitlines()[-1].split()
    assert float(last[1]) == 90.0
    assert float(last[2]) == pytest.approx(-10.0, abs=1e-6)  # the mean over the azimuth


@pytest.mark.parametrize(
    ("template", "words"),
    [
        ("{title[a]} {angle_deg}", "not known"),
        ("{title.__class__.__mro__} {angle_deg}", "not known"),
        ("{angle_deg:>9999999999}", "the number format of"),
        ("{angle_deg:>{number}}", "the number format of"),
        ("{angle_deg!r}", "the number format of"),
        ("{title:.2f}\n{angle_deg}", "line 1"),
        ("{angel_deg}\n", r"line 1: .angel_deg. is not known"),
        ("hello\n", "no line with"),
        ("{\n", "line 1"),
        ("a\n{angle_deg}\n{number:d} {title:d}", "template, line 3: "),
    ],
)
def test_templates_refused(template: str, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    _holds(monkeypatch, 0.0, 90.0)
    with pytest.raises(PretravelError, match=words):
        heidenhain_table(lobes(3), template)
