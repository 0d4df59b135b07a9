"""The data of a calibration certificate: statements of a laboratory and results of the rig."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from pathlib import Path

import pytest

from pretravel.files.laboratory_file import laboratory_template, read_laboratory
from pretravel.files.laboratory_statements import (
    CalibratedItem,
    LaboratoryStatements,
    MeasuringInstrument,
    ReferenceIdentity,
)
from pretravel.laboratory.certificate import calibration_certificate
from pretravel.laboratory.rig.budget import (
    REN_BUDGET,
    LengthComponent,
    calibration_budget,
    constant_and_slope,
    length_budget,
    rig_sources,
)
from pretravel.laboratory.rig.calibration import calibrate_rig
from pretravel.laboratory.rig.trace import RigTouch


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


BLANK = RigTouch("", 0.0, 3e-3, 8e-3, 4e-4, 1e-5, 1e-5, 1e-5, 0.0, 0.0, 3.0, ())
MADE = {"p_090": [4.0, 4.0, 4.3, 4.5], "p_000": [3.0, 3.2], "p_200": [-5e-4]}


def test_every_field() -> None:
    """U of each direction is that of its own number of touches, of all of the direction with the
    fewest; the length in the budget of a false start, which is negative, is its magnitude."""
    touches = [
        replace(BLANK, trace=f"{name}_{k + 1}", r1=1e-3 * value, feed=3.0)
        for name, values in MADE.items()
        for k, value in enumerate(values)
    ]
    touches[1] = replace(touches[1], feed=math.nan, notes=("noisy", "short"))
    touches[4] = replace(touches[4], feed=2.8, notes=("late",))
    calibration = calibrate_rig(touches, exclude=["p_090_1"], search_outliers=False)
    statements = LaboratoryStatements()
    found = calibration_certificate(
        calibration, REN_BUDGET, statements, budget_source="Ren", temperature=21.5
    )
    assert found.feeds == (2.8, 3.0)
    assert (found.budget_source, found.temperature) == ("Ren", 21.5)
    assert found.notes == (
        "p_090_2: noisy", "p_090_2: short", "p_000_1: late", "left out as requested: p_090_1",
    )  # fmt: skip
    own = calibration_budget(calibration)
    assert found.constant_and_slope == constant_and_slope(own)
    assert found.budget.components == length_budget(own, calibration.pretravel).components
    for one, count in zip(found.directions, (2, 3, 1), strict=True):
        assert one.performance.count == count
        budget = length_budget(
            calibration_budget(calibration, count=count), abs(one.performance.pretravel)
        )
        assert one.expanded == pytest.approx(budget.expanded())
        assert one.coverage_factor == pytest.approx(budget.coverage_factor())
        # Both ends of a hysteresis are read by the same ruler; its repeats are its own.
        rig = 2.0 * length_budget(rig_sources(REN_BUDGET), 0.0).combined
        assert one.expanded_hysteresis == pytest.approx(
            math.hypot(rig, one.performance.expanded_hysteresis), rel=1e-6
        )
    plain = calibration_certificate(calibration, REN_BUDGET, statements)
    assert (plain.budget_source, plain.temperature) == ("", 20.0)
    # One source of many that has both parts: u(L)² is no longer constant² + (slope L)².
    both = (*REN_BUDGET, LengthComponent("scale", "B", 0.02e-3, 1e-6))
    assert calibration_certificate(calibration, both, statements).constant_and_slope is None
    false = calibrate_rig([replace(touch, r1=-touch.r1 / 3.0) for touch in touches])
    assert calibration_certificate(false, REN_BUDGET, statements).budget.combined > 0.0


def test_statements_of_a_certificate_and_of_reports() -> None:
    """Tables of a certificate: 3 + 3 + 1 + 6 + 3 + 2 + 1 + 1 statements; four standards."""
    empty = LaboratoryStatements()
    assert empty.missing == len(list(empty.of_certificate())) == 20
    assert len(list(empty.statements())) == 20 + 6 + 3 + 2 + 4
    stated = LaboratoryStatements(
        item=CalibratedItem(serial_number="17"),
        instrument=MeasuringInstrument(probe="T", stylus="M"),
        reference=ReferenceIdentity(certificate="K-3"),
    )
    assert stated.missing == 19
    more = [(s.table, s.key, s.text) for s in stated.of_certificate()][20:]
    assert more == [
        ("instrument", "probe", "T"), ("instrument", "stylus", "M"),
        ("reference", "certificate", "K-3"),
    ]  # fmt: skip
    tables = list(dict.fromkeys(s.table for s in stated.of_report()))
    assert tables == [
        "laboratory", "instrument", "reference", "conditions", "measurement", "item",
    ]  # fmt: skip
    counts = [sum(s.table == table for s in stated.of_report()) for table in tables]
    assert counts == [3, 6, 3, 2, 2, 1]
    for statement in stated.statements():
        part = getattr(stated, statement.table)
        assert statement.text == getattr(part, statement.key)
        meanings = {f.name: f.metadata["meaning"] for f in fields(part)}
        assert statement.meaning == meanings[statement.key]


class TestContradictions:
    @staticmethod
    def _said(used: dict[str, object] | None = None, **texts: str) -> list[str]:
        """Statements by table__key."""
        stated = LaboratoryStatements()
        for place, text in texts.items():
            table, key = place.split("__")
            stated = replace(stated, **{table: replace(getattr(stated, table), **{key: text})})
        return [said for _, said in stated.contradictions(used or {})]

    def test_the_order_of_dates(self) -> None:
        days = {"item__received": "2026-03-01", "item__calibrated": "2.3.2026"}
        assert self._said(**days, certificate__date_of_issue="2026-03-02") == []
        (early,) = self._said(**days, certificate__date_of_issue="2026-02-02")
        assert early == "itself: it was calibrated on 2026-03-02 and issued on 2026-02-02"
        (late,) = self._said(item__received="2026-03-09", item__calibrated="2026-03-02")
        assert late == "itself: it was received on 2026-03-09 and calibrated on 2026-03-02"

    def test_a_reference_that_was_not_valid(self) -> None:
        day = "2026-03-02, 10:15"
        text = "No. 7 of 2024-03-01, valid until 2025-03-01"
        (said,) = self._said(measurement__date=day, reference__certificate=text)
        assert said == f"itself: it gives '{text}', and the measurement is of 2026-03-02"
        for valid in ("No. 7 of 2025-03-01", "valid until 2027-03-01", "valid"):
            assert self._said(measurement__date=day, reference__certificate=valid) == []

    def test_feed_and_temperature_in_other_units(self) -> None:
        """3 mm/s are 180 mm/min; 68 °F are 20 °C, 80 °F 26.7 °C."""
        assert self._said({"rod_feed": 180.0}, method__feed="3 mm/s") == []
        assert len(self._said({"rod_feed": 3.0}, method__feed="3 mm/s")) == 1
        assert self._said({"temperature": 20.0}, conditions__temperature="68 °F") == []
        assert len(self._said({"temperature": 20.0}, conditions__temperature="80 °F")) == 1
