"""Figures, limits and notes of the standards: both sides of each limit, and every field."""

from __future__ import annotations

import math
import re
from typing import ClassVar

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.laboratory.iso230_10 import check_iso230_10, plane_pattern_36
from pretravel.laboratory.iso230_10_tip_offset import check_tip_offset
from pretravel.laboratory.iso10360_5 import check_iso10360_5
from pretravel.laboratory.standard_check import (
    RANGE_AS_DEFINED,
    CalibratedSphere,
    LimitOutcome,
    StandardCheck,
    StandardFigure,
    refuse_other_unit,
    refuse_turned_spindle,
    surface_points,
)
from pretravel.touches import Touches
from pretravel.uncertainty.gum import Component

UM = 1e-3
N = sphere_pattern_25()
RING = plane_pattern_36()
SPHERE = CalibratedSphere(25.0, 0.2 * UM, 0.5 * UM)
HALF = np.vstack([N, RING[:11]])


def _touches(normals: FloatArray, off: FloatArray | float = 0.0) -> Touches:
    """On a sphere of 25 mm with a tip of 6 mm, so many mm too far out, around (1, 2, 3)."""
    return Touches(
        normals * (15.5 + np.broadcast_to(off, len(normals)))[:, None] + [1, 2, 3], normals
    )


def _names(check: StandardCheck) -> list[str]:
    return [figure.name for figure in check.figures]


class TestMachineTools:
    LIMITS: ClassVar = {"form2d": 1 * UM, "form3d": 2 * UM, "repeatability": 3 * UM}

    def test_every_field_of_every_figure(self) -> None:
        """Form by the residuals of linear least squares: off = shift · n + radius, which is exact
        for touches that are off by so little."""
        normals = np.vstack([HALF, HALF[[0]]])
        off = 2.0 * UM * np.cos(np.arange(len(normals)) ** 2)
        check = check_iso230_10(
            _touches(normals, off), SPHERE, tip_diameter=6.0, limits=self.LIMITS
        )
        plane, space, single = check.figures
        beside = np.abs(normals[:, 2]) < math.sin(math.radians(5.0))
        for figure, kept, across in ((plane, beside, 2), (space, beside | True, 3)):
            design = np.column_stack([normals[kept][:, :across], np.ones(kept.sum())])
            left = off[kept] - design @ np.linalg.lstsq(design, off[kept], rcond=None)[0]
            assert figure.value == pytest.approx(np.ptp(left), rel=1e-3)
            assert figure.u_test == 0.25 * UM
            assert figure.u_source == "form error of the reference"
            assert f"{kept.sum()} touches" in figure.meaning
        assert single.value == pytest.approx(abs(off[-1] - off[0]), rel=1e-9)
        assert (single.u_test, single.u_source) == (0.0, "")
        assert single.meaning.endswith("up to 2 touches")
        assert _names(check) == ["P_FTU,2D", "P_FTU,3D", "R_SPT"]
        assert [figure.limit for figure in check.figures] == [1 * UM, 2 * UM, 3 * UM]
        assert {figure.status for figure in check.figures} == {"unchecked"}
        circle, sphere = check.sets
        assert (circle.name, circle.limit, circle.frame) == ("circle of P_FTU,2D", UM, "probe")
        assert (sphere.name, sphere.limit, sphere.frame) == ("sphere of P_FTU,3D", 2 * UM, "probe")
        surface = normals * (12.5 + off)[:, None] + [1, 2, 3]
        assert sphere.places == pytest.approx(surface, abs=1e-12)
        assert circle.places == pytest.approx(surface[beside, :2], abs=1e-12)
        assert [budget.combined for budget in check.budgets] == [0.25 * UM, 0.25 * UM]
        assert [budget.result for budget in check.budgets] == ["P_FTU,2D", "P_FTU,3D"]
        assert check.standard == "ISO 230-10, probing"
        assert check.tip_offset is None

    def test_along_another_axis(self) -> None:
        """A probe along x: its equator is the plane of y and z."""
        turn = probe_rotation((1.0, 0.0, 0.0)).T
        check = check_iso230_10(_touches(RING @ turn), SPHERE, axis=(1.0, 0.0, 0.0))
        assert _names(check) == ["P_FTU,2D"]
        center = check.sets[0].fit.center
        # The probe's x is -z of the machine, its y that of the machine.
        assert center == pytest.approx([-3.0, 2.0], abs=1e-9)

    @pytest.mark.parametrize(("polar", "counts"), [(85.1, 36), (94.9, 36), (84.9, 18), (95.1, 18)])
    def test_the_equator_is_five_degrees_wide(self, polar: float, counts: int) -> None:
        azimuth = np.radians(np.arange(0.0, 360.0, 10.0))
        angles = np.radians(np.where(np.arange(36) % 2, 90.0, polar))
        check = check_iso230_10(_touches(from_angles(angles, azimuth)), SPHERE)
        assert len(check.sets[0].places) == counts

    @pytest.mark.parametrize(
        ("count", "note"),
        [(36, ""), (35, "P_FTU,2D has 36 touches; these are 35"), (40, "")],
    )
    def test_36_touches_on_the_equator(self, count: int, note: str) -> None:
        azimuth = 2.0 * math.pi * np.arange(count) / count
        notes = check_iso230_10(_touches(from_angles(np.full(count, math.pi / 2), azimuth)), SPHERE)
        assert [n for n in notes.notes if "2D" in n] == ([note] if note else [])

    def test_eight_touches_on_the_equator_are_needed(self) -> None:
        steep = np.vstack([N[:4], RING[::5][:8]])
        assert _names(check_iso230_10(_touches(steep), SPHERE)) == ["P_FTU,2D", "P_FTU,3D"]
        check = check_iso230_10(_touches(np.vstack([N[:5], RING[::6], RING[[1]]])), SPHERE)
        assert _names(check) == ["P_FTU,3D"]
        assert "P_FTU,2D needs touches on the equator; there are 7" in check.notes

    def test_nine_touches_over_45_degrees_are_a_hemisphere(self) -> None:
        azimuth = np.radians(np.arange(9) * 40.0)
        for apart, count, known in ((45.5, 9, True), (44.5, 9, False), (60.0, 8, False)):
            polar = np.radians(90.0 - np.where(np.arange(9) % 2, apart, 0.0))
            normals = from_angles(polar, azimuth)[:count]
            try:
                found = _names(check_iso230_10(_touches(normals), SPHERE))
            except PretravelError:
                found = []
            assert ("P_FTU,3D" in found) == known

    @pytest.mark.parametrize(("count", "told"), [(24, True), (25, False), (26, True)])
    def test_25_touches_on_the_hemisphere(self, count: int, told: bool) -> None:
        normals = np.vstack([N, from_angles([0.3], [0.2])])[:count]
        notes = check_iso230_10(_touches(normals), SPHERE).notes
        expected = [f"P_FTU,3D has 25 touches; these are {count}"] if told else []
        assert [note for note in notes if "3D" in note] == expected

    @pytest.mark.parametrize(("repeats", "told"), [(9, True), (10, False), (11, True)])
    def test_ten_repeats(self, repeats: int, told: bool) -> None:
        """Directions with three and with so many touches: the number is that of the latter."""
        normals = np.vstack([np.tile(N[[3]], (repeats, 1)), np.tile(N[[7]], (3, 1))])
        off = np.concatenate([np.linspace(0.0, 0.5, repeats), [0.0, -1.5, 0.4]]) * UM
        check = check_iso230_10(_touches(normals, off), SPHERE)
        assert _names(check) == ["R_SPT"]
        assert check.figures[0].value == pytest.approx(1.9 * UM, rel=1e-6)
        assert check.figures[0].meaning.endswith(f"up to {repeats} touches")
        expected = [f"R_SPT has 10 repeats; these are up to {repeats}"] if told else []
        assert [note for note in check.notes if "R_SPT" in note] == expected

    @pytest.mark.parametrize(("apart", "same"), [(0.09, True), (0.11, False)])
    def test_a_direction_is_a_tenth_of_a_degree_wide(self, apart: float, same: bool) -> None:
        azimuth = np.append(np.arange(0.0, 360.0, 10.0), apart)
        normals = from_angles(np.full(37, math.pi / 2), np.radians(azimuth))
        check = check_iso230_10(_touches(normals), SPHERE)
        assert ("R_SPT" in _names(check)) == same
        assert any("no direction was repeated" in note for note in check.notes) != same

    def test_a_range_is_along_the_mean_direction(self) -> None:
        """Touches along directions 0.08° apart: along the middle both are cos 0.04° of 15.5."""
        normals = from_angles(np.full(2, math.pi / 2), np.radians([0.0, 0.08]))
        positions = normals * np.array([[15.5], [15.6]])
        check = check_iso230_10(Touches(positions, normals), SPHERE)
        expected = 0.1 * math.cos(math.radians(0.04))
        assert check.figures[0].value == pytest.approx(expected, rel=1e-9)

    def test_none_of_the_tests(self) -> None:
        with pytest.raises(
            PretravelError, match=r"none of the tests: P_FTU,2D needs .* are 2; no d"
        ):
            check_iso230_10(_touches(RING[:2]), SPHERE)

    @pytest.mark.parametrize(("off", "refused"), [(0.99, 0), (1.01, 1), (-0.99, 0), (-1.01, 1)])
    def test_the_diameter_is_known_within_a_millimetre(self, off: float, refused: int) -> None:
        """Of the last set, the sphere."""
        touches = _touches(N, 0.5 * off)
        if not refused:
            assert check_iso230_10(touches, SPHERE, tip_diameter=6.0).figures
            return
        with pytest.raises(PretravelError, match=rf"diameter of {25.0 + off:.4f} mm, not of 25 mm"):
            check_iso230_10(touches, SPHERE, tip_diameter=6.0)
        assert check_iso230_10(touches, SPHERE).figures

    def test_the_diameter_of_a_circle_alone(self) -> None:
        assert len(check_iso230_10(_touches(RING), SPHERE, tip_diameter=6.0).sets) == 1
        with pytest.raises(PretravelError, match=r"diameter of 27\.0000 mm"):
            check_iso230_10(_touches(RING), SPHERE, tip_diameter=4.0)


class TestMeasuringMachines:
    def test_every_field(self) -> None:
        off = 2.0 * UM * np.cos(np.arange(25) ** 2) + 1.0 * UM
        limits = {"form": 3 * UM, "size": 4 * UM}
        check = check_iso10360_5(_touches(N, off), SPHERE, tip_diameter=6.0, limits=limits)
        design = np.column_stack([N, np.ones(25)])
        found = np.linalg.lstsq(design, off, rcond=None)[0]
        form, size = check.figures
        assert form.value == pytest.approx(np.ptp(off - design @ found), rel=1e-3)
        assert size.value == pytest.approx(2.0 * found[3], rel=1e-3)
        assert (form.limit, size.limit) == (3 * UM, 4 * UM)
        assert (form.u_test, size.u_test) == (0.25 * UM, 0.2 * UM)
        assert form.u_source == "form error of the reference"
        assert size.u_source == "calibration of the reference's diameter"
        (only,) = check.sets
        assert (only.name, only.limit, only.frame) == ("run 1", 3 * UM, "machine")
        # In the order of the pattern, which is that of the touches.
        assert only.places == pytest.approx(N * (12.5 + off)[:, None] + [1, 2, 3], abs=1e-12)
        # How the pattern was read, and that its noise belongs to the figure.
        assert len(check.notes) == 2
        assert check.notes[1] == RANGE_AS_DEFINED

    def test_without_a_tip_there_is_no_size(self) -> None:
        check = check_iso10360_5(_touches(N), SPHERE)
        assert len(check.figures) == 1
        assert check.notes[1] == "a size error needs the tip's diameter, or a map"
        assert check.sets[0].fit.radius == pytest.approx(15.5, rel=1e-12)

    def test_runs_are_in_the_order_of_the_touches(self) -> None:
        off = np.repeat([0.5, -0.3, 0.2, 0.1, -0.9], 25) * UM
        check = check_iso10360_5(_touches(np.tile(N, (5, 1)), off), SPHERE, tip_diameter=6.0)
        radii = [some.fit.radius - 12.5 for some in check.sets]
        assert radii == pytest.approx(np.array([0.5, -0.3, 0.2, 0.1, -0.9]) * UM, rel=1e-6)
        assert "there are 5 runs of 25 touches; the worst of them is stated" in check.notes

    def test_the_size_error_of_largest_magnitude_is_stated(self) -> None:
        """Three runs, -4, +3 and +1 µm in diameter, in turn for each direction of the pattern."""
        off = np.tile([-2.0, 1.5, 0.5], 25) * UM
        normals = np.repeat(N, 3, axis=0)
        check = check_iso10360_5(_touches(normals, off), SPHERE, tip_diameter=6.0)
        assert check.figures[1].value == pytest.approx(-4.0 * UM, rel=1e-6)
        assert [some.name for some in check.sets] == ["run 1", "run 2", "run 3"]
        radii = [some.fit.radius - 12.5 for some in check.sets]
        assert radii == pytest.approx(np.array([-2.0, 1.5, 0.5]) * UM, rel=1e-6)

    @pytest.mark.parametrize(("off", "refused"), [(0.49, 0), (0.51, 1), (-0.49, 0), (-0.51, 1)])
    def test_a_size_error_of_half_a_millimetre_is_none(self, off: float, refused: int) -> None:
        touches = _touches(N, 0.5 * off)
        if not refused:
            size = check_iso10360_5(touches, SPHERE, tip_diameter=6.0).figures[1]
            assert size.value == pytest.approx(off, rel=1e-9)
            return
        with pytest.raises(
            PretravelError, match=re.escape(f"differs by {off:+.4f} mm from the calibrated 25")
        ):
            check_iso10360_5(touches, SPHERE, tip_diameter=6.0)

    @pytest.mark.parametrize(("off", "refused"), [(9.9, False), (10.1, True)])
    def test_a_touch_is_within_ten_degrees_of_its_direction(
        self, off: float, refused: bool
    ) -> None:
        """The touch at the pole, which does not tell where the pattern begins."""
        normals = np.vstack([from_angles([math.radians(off)], [0.4]), N[1:]])
        if not refused:
            assert check_iso10360_5(_touches(normals), SPHERE).figures
            return
        with pytest.raises(PretravelError, match=r"touch 1\b.* is 10° from the nearest"):
            check_iso10360_5(_touches(normals), SPHERE)

    def test_each_direction_equally_often(self) -> None:
        with pytest.raises(PretravelError, match="were touched 1 to 2 times"):
            check_iso10360_5(_touches(np.vstack([N, N[[4]]])), SPHERE)
        with pytest.raises(PretravelError, match="were touched 0 to 1 times"):
            check_iso10360_5(_touches(N[:24]), SPHERE)
        with pytest.raises(PretravelError, match="were touched 0 to 1 times"):
            check_iso10360_5(_touches(np.vstack([N[:1], N[5:]])), SPHERE)

    @pytest.mark.parametrize("degrees", [-40.0, 0.0, 33.0])
    def test_an_axis_of_its_own_and_a_turn_about_it(self, degrees: float) -> None:
        axis = np.array([2.0, -3.0, 6.0]) / 7.0
        normals = N @ probe_rotation(axis, math.radians(degrees)).T
        check = check_iso10360_5(_touches(normals), SPHERE, axis=axis)
        assert check.figures[0].value == pytest.approx(0.0, abs=1e-9)
        assert "forth and back" in check.notes[0]
        with pytest.raises(PretravelError, match="nearest direction of the pattern"):
            check_iso10360_5(_touches(normals), SPHERE)


class TestFigures:
    def test_on_a_limit(self) -> None:
        """In quarters of a micrometre, which are exact: 2 less and 2 more than U = 0.5."""
        for value, outcome in (
            (1.5, LimitOutcome.WITHIN), (2.5, LimitOutcome.UNDECIDED), (-1.5, LimitOutcome.WITHIN),
            (1.50001, LimitOutcome.UNDECIDED), (2.50001, LimitOutcome.EXCEEDS),
            (-2.50001, LimitOutcome.EXCEEDS), (-2.5, LimitOutcome.UNDECIDED),
        ):  # fmt: skip
            figure = StandardFigure("form", "", value, 0.25, 2.0, "unchecked")
            assert figure.outcome is outcome
            assert figure.coverage == 2.0

    def test_without_a_limit(self) -> None:
        figure = StandardFigure("form", "", 1.0, None, None, "unchecked")
        assert figure.outcome is LimitOutcome.NO_LIMIT
        assert figure.verdict == "no limit given"
        stated = StandardFigure("form", "", 1.0, 0.1, 3.0, "unchecked")
        assert stated.verdict == "within the limit"

    def test_few_degrees_of_freedom(self) -> None:
        """k of four degrees is 2.87 (GUM, Table G.2): U = 0.574 beside a limit of 2."""
        parts = (Component("repeats", "A", 0.2, dof=4.0),)
        figures = [
            StandardFigure("form", "", value, 0.2, 2.0, "unchecked", "the touches", parts)
            for value in (1.41, 1.44, 2.56, 2.59)
        ]
        assert figures[0].coverage == pytest.approx(2.87, abs=0.005)
        assert [figure.outcome.name for figure in figures] == [
            "WITHIN", "UNDECIDED", "UNDECIDED", "EXCEEDS",
        ]  # fmt: skip
        assert figures[1].verdict == "undecided within U (k = 2.87)"
        budget = figures[0].budget
        assert budget is not None
        assert (budget.components, budget.result) == (parts, "form")

    def test_a_budget_of_the_reference_alone(self) -> None:
        figure = StandardFigure("size", "", 1.0, 0.2, 2.0, "unchecked", "the diameter")
        budget = figure.budget
        assert budget is not None
        (part,) = budget.components
        assert (part.name, part.evaluation, part.standard_uncertainty) == ("the diameter", "B", 0.2)
        assert StandardFigure("size", "", 1.0, 0.2, 2.0, "unchecked").budget is None
        assert StandardFigure("size", "", 1.0, None, 2.0, "unchecked", "form").budget is None

    def test_why_no_conformity(self) -> None:
        def reasons(limit: float | None, u: float | None, status: str) -> list[str]:
            figure = StandardFigure("size", "", 1.0, u, limit, status)
            return [r.split()[0] for r in StandardCheck("x", (figure,), (), ()).why_no_conformity]

        assert reasons(2.0, 0.1, "verified") == []
        assert reasons(2.0, None, "verified") == ["the"]
        assert reasons(None, None, "verified") == []
        assert reasons(None, None, "unchecked") == ["its"]
        assert reasons(2.0, None, "unchecked") == ["its", "the"]


class TestRefusals:
    def test_a_turned_spindle(self) -> None:
        """Angles are the same within a thousandth of a degree, and after whole turns."""
        for degrees, refused in (
            ([0.0, 360.0], ""), ([10.0, 10.0004], ""), ([-90.0, 270.0], ""), ([10.0, 10.001], "2 "),
            (np.arange(8.0), "8 orientations of the spindle (0°, 1°, 2°, 3°, 4°, 5°, 6°, 7°);"),
            (np.arange(9.0), "9 orientations of the spindle (0°, 1°, 2°, 3°, 4°, 5°, 6°, 7° …);"),
        ):  # fmt: skip
            count = len(degrees)
            touches = Touches(15.5 * RING[:count], RING[:count], spindle=np.radians(degrees))
            if not refused:
                refuse_turned_spindle(touches)
                continue
            with pytest.raises(PretravelError) as caught:
                refuse_turned_spindle(touches)
            assert f"made at {refused}" in str(caught.value)

    @pytest.mark.parametrize(("share", "refused"), [(0.104, 0), (0.096, 1), (4.9, 0), (5.1, 1)])
    def test_a_spread_of_a_tenth_to_five_diameters(self, share: float, refused: int) -> None:
        """36 touches on a circle: 0.9 of them are within cos 5° of its radius."""
        radius = 0.5 * share * 25.0 / math.cos(math.radians(5.0))
        touches = Touches(radius * RING + [700.0, -900.0, 40.0], RING)
        if not refused:
            refuse_other_unit(touches, SPHERE)
            return
        words = "look like inches" if share < 1.0 else "taken as inches"
        with pytest.raises(PretravelError, match=words):
            refuse_other_unit(touches, SPHERE)

    def test_every_test_refuses_another_unit(self) -> None:
        for check in (check_iso230_10, check_iso10360_5, check_tip_offset):
            with pytest.raises(PretravelError, match="look like inches"):
                check(Touches(N / 25.4, N, spindle=np.zeros(25)), SPHERE)

    def test_a_reference_that_is_none(self) -> None:
        for diameter, u, form in (
            (0.0, None, None), (-25.0, None, None), (25.0, -1e-4, None), (25.0, None, -1e-4),
            (25.0, math.nan, None), (25.0, None, math.inf),
        ):  # fmt: skip
            with pytest.raises(PretravelError):
                CalibratedSphere(diameter, u, form)
        assert CalibratedSphere(25.0).u_of_form is None

    def test_stray_touches_do_not_count(self) -> None:
        """Up to one of ten."""
        positions = 15.5 * RING
        positions[:3] += 5000.0
        refuse_other_unit(Touches(positions, RING), SPHERE)
        positions[:6] += 5000.0
        with pytest.raises(PretravelError, match="taken as inches"):
            refuse_other_unit(Touches(positions, RING), SPHERE)

    def test_touches_in_one_direction_do_not_show_the_sphere(self) -> None:
        """Components of the normals within a half: sin of 14.4° and 14.6° on either side."""
        for tilt, shown in ((14.4, False), (14.6, True)):
            normals = from_angles(np.radians([tilt, tilt, 0.0]), [0.0, math.pi, 0.0])
            touches = Touches(0.01 * normals, normals)
            if shown:
                with pytest.raises(PretravelError, match="look like inches"):
                    refuse_other_unit(touches, SPHERE)
            else:
                refuse_other_unit(touches, SPHERE)

    def test_the_surface_is_half_a_tip_away(self) -> None:
        touches = _touches(N)
        assert surface_points(touches, 6.0, None) == pytest.approx(12.5 * N + [1, 2, 3])
        assert surface_points(touches, None, None) == pytest.approx(15.5 * N + [1, 2, 3])
