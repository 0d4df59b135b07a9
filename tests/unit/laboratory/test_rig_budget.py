"""Budgets of a rig: sums by hand, the repeatability of a calibration, and the file of a budget."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.laboratory.rig.budget import (
    REN_BUDGET,
    LengthComponent,
    budget_doubts,
    calibration_budget,
    constant_and_slope,
    length_budget,
    own_repeatability,
    rig_sources,
    thermal_components,
)
from pretravel.laboratory.rig.calibration import RigCalibration, calibrate_rig
from pretravel.laboratory.rig.rig_csv import read_budget
from pretravel.laboratory.rig.trace import RigTouch
from pretravel.show.result_file import read_result
from tests.support.commands import run
from tests.support.examples import EXAMPLES

UM = 1e-3
BLANK = RigTouch("", 0.0, 3e-3, 8e-3, 4e-4, 1e-5, 2e-5, 3e-5, 0.0, 0.0, 3.0, ())
MADE = {"p_090": [4.0, 4.0, 4.3, 4.5], "p_000": [3.0, 3.2], "p_200": [5.0]}
S = math.sqrt((0.18 + 0.02) / 4.0) * UM
"""Of `MADE`: squares about the means over 3 + 1 + 0 degrees of freedom."""
SINGLE = {"p_000": [3.0], "p_090": [4.0]}


def _calibration(made: dict[str, list[float]] = MADE, u: float = 1e-5) -> RigCalibration:
    touches = [
        replace(BLANK, trace=f"{name}_{k + 1}", r1=value * UM, u_r0=u, u_r1=u)
        for name, values in made.items()
        for k, value in enumerate(values)
    ]
    return calibrate_rig(touches, search_outliers=False)


class TestRepeatability:
    def test_of_a_mean(self) -> None:
        """0.224 µm of the repeats, with k = 2.87 of four degrees of freedom 0.64 µm; edges of
        √2 · 0.01 µm, of √2 · 0.2 µm, with k = 2 0.57 µm, or of √2 · 0.25 µm, 0.71 µm."""
        own = own_repeatability(_calibration(), 4)
        assert own is not None
        assert (own.source, own.evaluation) == ("repeatability of pretravel, mean of 4", "A")
        assert own.constant == pytest.approx(S / 2.0, rel=1e-9)
        assert (own.per_length, own.dof, own.repeatability) == (0.0, 4.0, True)
        less = own_repeatability(_calibration(u=0.2 * UM), 4)
        assert less == own
        rough = own_repeatability(_calibration(u=0.25 * UM), 9)
        assert rough is not None
        assert (rough.source, rough.evaluation) == ("edges between samples, mean of 9", "B")
        assert rough.constant == pytest.approx(0.25 * UM * math.sqrt(2.0) / 3.0, rel=1e-9)
        assert (rough.dof, rough.repeatability) == (math.inf, True)
        assert own_repeatability(_calibration(SINGLE), 2) is None

    def test_touches_without_u_do_not_count(self) -> None:
        touches = list(_calibration(u=0.25 * UM).touches)
        touches[0] = replace(touches[0], u_r1=math.nan)
        own = own_repeatability(calibrate_rig(touches, search_outliers=False), 1)
        assert own is not None
        assert own.constant == pytest.approx(0.25 * UM * math.sqrt(2.0), rel=1e-9)

    def test_takes_the_place_of_that_of_the_rig(self) -> None:
        """The fewest touches of a direction, one, where no number is given. Ren 2020, Table 2: the
        rig without its two repeatabilities has √(0.034² + 2 · 0.030² + 0.020²) µm."""
        for count, divisor in ((None, 1.0), (4, 2.0)):
            found = calibration_budget(_calibration(), count=count)
            assert found[:-1] == rig_sources(REN_BUDGET)
            assert found[-1].constant == pytest.approx(S / divisor, rel=1e-9)
        assert calibration_budget(_calibration(SINGLE)) == REN_BUDGET
        alone = length_budget(rig_sources(REN_BUDGET), 0.0).combined
        squares = 0.034**2 + 2.0 * 0.030**2 + 0.020**2
        assert alone == pytest.approx(math.sqrt(squares) * UM, rel=1e-9)


class TestSums:
    def test_parts_of_one_source_are_added(self) -> None:
        parts = (LengthComponent("a", "B", 3e-5, 2e-6), LengthComponent("b", "A", 4e-5, dof=5.0))
        budget = length_budget(parts, 20.0)
        assert [c.standard_uncertainty for c in budget.components] == pytest.approx([7e-5, 4e-5])
        assert [(c.name, c.evaluation, c.dof) for c in budget.components] == [
            ("a", "B", math.inf), ("b", "A", 5.0),
        ]  # fmt: skip
        assert constant_and_slope(
            [LengthComponent("a", "B", 3e-5), LengthComponent("b", "B", 4e-5),
             LengthComponent("c", "B", 0.0, 5e-6), LengthComponent("d", "B", 0.0, 12e-6)]
        ) == pytest.approx((5e-5, 13e-6))  # fmt: skip

    def test_a_source_has_no_part_that_was_not_given(self) -> None:
        part = LengthComponent("scale", "B")
        assert (part.constant, part.per_length, part.dof) == (0.0, 0.0, math.inf)
        assert not part.repeatability

    def test_doubts(self) -> None:
        """One nanometre is less than any rig, such as µm in a column of mm; a part per length is
        stated; a source without a number is named."""
        (small,) = budget_doubts([LengthComponent("a", "B", 0.9e-6)])
        assert "0.0009 µm together" in small
        assert budget_doubts([LengthComponent("a", "B", 1.1e-6)]) == ()
        both = [LengthComponent("a", "B", 1e-5), LengthComponent("b", "B", 0.0, 1e-6)]
        repeats = LengthComponent("c", "A", repeatability=True)
        assert budget_doubts([*both, repeats]) == ()
        (only,) = budget_doubts([*both, LengthComponent("d", "B")])
        assert only == "the budget has no uncertainty for 'd': 0 or empty"


HEAD = "source,type,uncertainty_um,per_metre_um"


class TestFile:
    def test_is_read(self, tmp_path: Path) -> None:
        path = tmp_path / "budget.csv"
        path.write_text(f"{HEAD},dof,remark\nscale,B,0.02,,4,five runs\nheat,A,,0.1,,\n")
        scale, heat = read_budget(path)
        assert (scale.constant, scale.per_length) == (pytest.approx(0.02 * UM), 0.0)
        assert (heat.constant, heat.per_length) == (0.0, pytest.approx(0.1e-6))
        assert (scale.evaluation, heat.evaluation) == ("B", "A")
        assert (scale.dof, heat.dof) == (4.0, math.inf)
        path.write_text(f"{HEAD}\nscale,B,0.02,\nRepeatability at r0,A,0.05,\n")
        assert read_budget(path)[0].dof == math.inf
        assert read_budget(path)[1].repeatability

    @pytest.mark.parametrize(
        ("wrong", "words"),
        [
            ({"expansion": 8.0}, "Was 1e-6/K meant"),
            ({"u_expansion": 1.0}, "Was 1e-6/K meant"),
            ({"deviation": 293.15}, "was the temperature itself meant"),
        ],
    )
    def test_temperatures_in_another_unit(self, wrong: dict[str, float], words: str) -> None:
        given = {"expansion": 8e-6, "deviation": 1.0, "u_expansion": 1e-6, "u_temperature": 0.1}
        with pytest.raises(PretravelError, match=words):
            thermal_components(**(given | wrong))

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("\nscale,C,0.02,\n", "line 2: type is 'C'"),
            (",dof\nscale,A,0.02,,0\n", "line 2: dof is '0'"),
            (",k\nscale,B,0.02,,2\n", "a budget has no column 'k'"),
            (",divisor\nscale,B,0.02,,2\n", "a budget has no column 'divisor'"),
            (
                "\nscale,B,0.02,\nheat,A,,0.1\nScale,A,0.02,\n",
                "line 4: the source 'Scale' is given",
            ),
            (",dof_eff\nscale,B,0.02,,2\n", "a budget has no column 'dof_eff'"),
        ],
    )
    def test_what_it_cannot_have_is_refused(self, tmp_path: Path, text: str, words: str) -> None:
        path = tmp_path / "budget.csv"
        path.write_text(HEAD + text)
        with pytest.raises(PretravelError, match=words):
            read_budget(path)


def test_lines_that_are_stated_beside_the_file(tmp_path: Path) -> None:
    """Abbé: 10 mm times 20 µrad is 0.2 µm. Equation 17: at 22 °C, 8e-6/K, u 0.5 K and 1e-6/K 4 and
    2.06 µm/m, which take the place of the paper's 0.058 and 0.010; over 4 µm they are pm."""
    traces = sorted((EXAMPLES / "rig").glob("*.csv"))

    def sources(*options: str) -> dict[str, float]:
        run("rig", *traces, "-o", tmp_path / "rig.json", *options)
        (budget,) = read_result(tmp_path / "rig.json").document.budgets
        return {c.name: 1e3 * c.standard_uncertainty for c in budget.components}

    plain = sources()
    assert any(name.startswith("temperature measurement") for name in plain)
    found = sources("--abbe", "10,20", "--temperature", "22", "--u-temperature", "0.5",
                    "--u-expansion", "1")  # fmt: skip
    assert found["Abbé error (10 mm, 20 µrad)"] == pytest.approx(0.2, rel=1e-6)
    assert not any(name.startswith(("temperature measurement", "thermal expansion coeff"))
                   for name in found)  # fmt: skip
    warm = found["temperature of the scale (u 0.5 K)"]
    grown = found["thermal expansion of the scale (u 1e-6/K)"]
    # 2 K at 1e-6/K, and the product with u of the temperature, 0.5 K.
    assert warm == pytest.approx(4.0 / np.hypot(2.0, 0.5) * grown, rel=1e-6)
    own = tmp_path / "own.csv"
    own.write_text(f"{HEAD}\nAbbe error,B,0.2,\n")
    twice = ("--abbe", "10,20", "--budget", own)
    told = run("rig", *traces, "-o", tmp_path / "rig.json", *twice, code=2)
    assert "already has the source 'Abbe error'" in told
    told = run("rig", *traces, "-o", tmp_path / "rig.json", "--u-temperature", "0.5", code=2)
    assert "--u-expansion" in told
