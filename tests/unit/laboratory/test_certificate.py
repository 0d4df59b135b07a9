"""The data of a calibration certificate: statements of a laboratory and results of the rig."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.files.laboratory_file import laboratory_template, read_laboratory
from pretravel.files.rig_csv import read_rig_trace
from pretravel.laboratory.certificate import calibration_certificate
from pretravel.laboratory.laboratory_statements import LaboratoryStatements
from pretravel.laboratory.rig_budget import (
    REN_BUDGET,
    LengthComponent,
    calibration_budget,
    length_budget,
)
from pretravel.laboratory.rig_calibration import calibrate_rig
from pretravel.laboratory.rig_events import rig_touch
from tests.support.examples import EXAMPLES


def test_a_template_states_nothing(tmp_path: Path) -> None:
    path = tmp_path / "lab.toml"
    path.write_text(laboratory_template(), encoding="utf-8")
    assert read_laboratory(path) == LaboratoryStatements()


def test_dates_and_numbers_are_texts(tmp_path: Path) -> None:
    """TOML has types for them; a certificate prints the text of the file."""
    path = tmp_path / "lab.toml"
    path.write_text("[item]\ncalibrated = 2026-11-22\nserial_number = 17\n", encoding="utf-8")
    item = read_laboratory(path).item
    assert (item.calibrated, item.serial_number) == ("2026-11-22", "17")


def test_uncertainty_of_a_direction_follows_from_its_touches() -> None:
    """The budget is that of the direction with the fewest touches."""
    traces = sorted((EXAMPLES / "rig").glob("*.csv"))
    calibration = calibrate_rig([rig_touch(read_rig_trace(path)) for path in traces])
    certificate = calibration_certificate(calibration, REN_BUDGET, LaboratoryStatements())
    for result in certificate.directions:
        own = calibration_budget(calibration, REN_BUDGET, result.performance.count)
        expected = length_budget(own, abs(result.performance.pretravel)).expanded()
        assert result.expanded == pytest.approx(expected)
    assert certificate.constant_and_slope is not None
    assert certificate.feeds[0] <= certificate.feeds[1]


def test_a_source_with_both_parts_leaves_no_constant_and_slope() -> None:
    """One source of many that has both parts: u(L)² is no longer constant² + (slope L)²."""
    traces = sorted((EXAMPLES / "rig").glob("*.csv"))
    calibration = calibrate_rig([rig_touch(read_rig_trace(path)) for path in traces[:2]])
    budget = (*REN_BUDGET, LengthComponent("scale", "B", 0.02e-3, 1e-6))
    made = calibration_certificate(calibration, budget, LaboratoryStatements())
    assert made.constant_and_slope is None
