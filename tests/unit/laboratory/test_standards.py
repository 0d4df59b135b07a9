"""Figures, limits and notes of the standards: both sides of each limit, and every field."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import ClassVar

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.laboratory.standards.iso230_10 import check_iso230_10, plane_pattern_36
from pretravel.laboratory.standards.iso230_10_tip_offset import check_tip_offset
from pretravel.laboratory.standards.iso10360_5 import check_iso10360_5
from pretravel.laboratory.standards.standard_check import (
    RANGE_AS_DEFINED,
    U_WITHOUT_NOISE,
    CalibratedSphere,
    StandardCheck,
    StandardFigure,
    refuse_other_unit,
    refuse_turned_spindle,
    surface_points,
)
from pretravel.laboratory.tasks.check import Check, not_stated
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
        assert single.meaning.endswith("up to 2 touches in one direction")
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
        assert check.notes[-1] == RANGE_AS_DEFINED + U_WITHOUT_NOISE
        assert check.tip_offset is None

    def test_along_another_axis(self) -> None:
        """A probe along x: its equator is the plane of y and z."""
        turn = probe_rotation((1.0, 0.0, 0.0)).T
        check = check_iso230_10(_touches(RING @ turn), SPHERE, axis=(1.0, 0.0, 0.0))
        assert _names(check) == ["P_FTU,2D"]
        # The probe's x is -z of the machine, its y that of the machine.
        assert check.sets[0].fit.center == pytest.approx([-3.0, 2.0], abs=1e-9)

    @pytest.mark.parametrize(("polar", "counts"), [(85.1, 36), (94.9, 36), (84.9, 18), (95.1, 18)])
    def test_the_equator_is_five_degrees_wide(self, polar: float, counts: int) -> None:
        azimuth = np.radians(np.arange(0.0, 360.0, 10.0))
        angles = np.radians(np.where(np.arange(36) % 2, 90.0, polar))
        check = check_iso230_10(_touches(from_angles(angles, azimuth)), SPHERE)
        assert len(check.sets[0].places) == counts

    def test_what_each_test_needs(self) -> None:
        """Eight touches on the equator; nine of which two are more than 45° apart."""
        steep = np.vstack([N[:4], RING[::5][:8]])
        assert _names(check_iso230_10(_touches(steep), SPHERE)) == ["P_FTU,2D", "P_FTU,3D"]
        check = check_iso230_10(_touches(np.vstack([N[:5], RING[::6], RING[[1]]])), SPHERE)
        assert _names(check) == ["P_FTU,3D"]
        assert "P_FTU,2D needs touches on the equator; there are 7" in check.notes
        azimuth = np.radians(np.arange(9) * 40.0)
        for apart, count in ((44.5, 9), (60.0, 8)):
            polar = np.radians(90.0 - np.where(np.arange(9) % 2, apart, 0.0))
            with pytest.raises(PretravelError, match=r"none of the tests: P_FTU,2D needs .*; no d"):
                check_iso230_10(_touches(from_angles(polar, azimuth)[:count]), SPHERE)
        polar = np.radians(90.0 - np.where(np.arange(9) % 2, 45.5, 0.0))
        assert _names(check_iso230_10(_touches(from_angles(polar, azimuth)), SPHERE)) == [
            "P_FTU,3D"
        ]

    @pytest.mark.parametrize(
        ("normals", "name", "note"),
        [
            (RING, "2D", ""),
            (RING[:35], "2D", "P_FTU,2D needs 36 touches; there are 35"),
            (np.vstack([RING, RING[:4]]), "2D", ""),
            (N[:24], "3D", "P_FTU,3D needs 25 touches; there are 24"),
            (N, "3D", ""),
            (np.vstack([N, RING[:1]]), "3D", "P_FTU,3D needs 25 touches; there are 26"),
        ],
    )
    def test_another_number_of_touches_is_told(
        self, normals: FloatArray, name: str, note: str
    ) -> None:
        notes = check_iso230_10(_touches(normals), SPHERE).notes
        assert [told for told in notes if name in told] == ([note] if note else [])

    @pytest.mark.parametrize(("repeats", "told"), [(9, True), (10, False), (11, True)])
    def test_ten_repeats(self, repeats: int, told: bool) -> None:
        """Directions with three and with so many touches: the number is that of the latter."""
        normals = np.vstack([np.tile(N[[3]], (repeats, 1)), np.tile(N[[7]], (3, 1))])
        off = np.concatenate([np.linspace(0.0, 0.5, repeats), [0.0, -1.5, 0.4]]) * UM
        check = check_iso230_10(_touches(normals, off), SPHERE)
        assert _names(check) == ["R_SPT"]
        assert check.figures[0].value == pytest.approx(1.9 * UM, rel=1e-6)
        assert check.figures[0].meaning.endswith(f"up to {repeats} touches in one direction")
        words = "R_SPT (single-point repeatability) is defined for 10 repeats; there are at most"
        expected = [f"{words} {repeats}"] if told else []
        assert [note for note in check.notes if "needs" not in note] == expected

    @pytest.mark.parametrize(("apart", "same"), [(0.09, True), (0.11, False)])
    def test_a_direction_is_a_tenth_of_a_degree_wide(self, apart: float, same: bool) -> None:
        """A range is along the mean direction: with both the cosine of half of what is between."""
        azimuth = np.append(np.arange(0.0, 360.0, 10.0), apart)
        normals = from_angles(np.full(37, math.pi / 2), np.radians(azimuth))
        check = check_iso230_10(_touches(normals, 0.1 * (azimuth == apart)), SPHERE)
        assert ("R_SPT" in _names(check)) == same
        assert any("no direction was repeated" in note for note in check.notes) != same
        if same:
            expected = 0.1 * math.cos(math.radians(0.5 * apart))
            assert check.figures[-1].value == pytest.approx(expected, rel=1e-9)

    @pytest.mark.parametrize(("off", "refused"), [(0.99, 0), (1.01, 1), (-0.99, 0), (-1.01, 1)])
    @pytest.mark.parametrize("normals", [N, RING], ids=["sphere", "circle"])
    def test_the_diameter_is_known_within_a_millimetre(
        self, normals: FloatArray, off: float, refused: int
    ) -> None:
        touches = _touches(normals, 0.5 * off)
        assert check_iso230_10(touches, SPHERE).figures
        if not refused:
            assert check_iso230_10(touches, SPHERE, tip_diameter=6.0).figures
            return
        with pytest.raises(PretravelError, match=rf"diameter of {25.0 + off:.4f} mm, not of 25 mm"):
            check_iso230_10(touches, SPHERE, tip_diameter=6.0)


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
        assert {form.status, size.status} == {"unchecked"}
        (only,) = check.sets
        assert (only.name, only.limit, only.frame) == ("run 1", 3 * UM, "machine")
        # In the order of the pattern, which is that of the touches.
        assert only.places == pytest.approx(N * (12.5 + off)[:, None] + [1, 2, 3], abs=1e-12)
        # How the pattern was read, and that its noise belongs to the figure.
        assert len(check.notes) == 2
        assert check.notes[1] == RANGE_AS_DEFINED + U_WITHOUT_NOISE

    def test_without_a_tip_there_is_no_size(self) -> None:
        check = check_iso10360_5(_touches(N), SPHERE)
        assert len(check.figures) == 1
        bare = check_iso10360_5(_touches(N), CalibratedSphere(25.0))
        assert bare.notes[-1] == RANGE_AS_DEFINED  # no u is given that could contain the noise
        assert check.notes[1] == "a size error needs the tip's diameter, or a map"
        assert check.sets[0].fit.radius == pytest.approx(15.5, rel=1e-12)

    @pytest.mark.parametrize("in_turn", [True, False])
    def test_the_worst_of_the_runs_is_stated(self, in_turn: bool) -> None:
        """Three runs, -4, +3 and +1 µm in diameter, the third with one touch 2 µm off; in turn for
        each direction of the pattern, or one after the other."""
        off = np.repeat([[-2.0, 1.5, 0.5]], 25, axis=0)
        off[7, 2] += 2.0
        order = "C" if in_turn else "F"
        normals = np.repeat(N, 3, axis=0) if in_turn else np.tile(N, (3, 1))
        check = check_iso10360_5(
            _touches(normals, off.ravel(order=order) * UM), SPHERE, tip_diameter=6.0
        )
        assert [some.name for some in check.sets] == ["run 1", "run 2", "run 3"]
        radii = [some.fit.radius - 12.5 for some in check.sets]
        assert radii[:2] == pytest.approx(np.array([-2.0, 1.5]) * UM, rel=1e-6)
        forms = [some.fit.form for some in check.sets]
        assert forms[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
        assert check.figures[0].value == forms[2] > 1.5 * UM
        assert check.figures[1].value == pytest.approx(-4.0 * UM, rel=1e-6)
        assert (
            "there are 3 runs of 25 touches: the largest of each test value is reported"
            in check.notes
        )

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

    @pytest.mark.parametrize(
        ("diameter", "noted"), [(9.9, True), (10.0, False), (50.0, False), (50.1, True)]
    )
    def test_a_sphere_of_another_size_than_the_standard_s_is_noted(
        self, diameter: float, noted: bool
    ) -> None:
        touches = Touches(N * (0.5 * diameter + 3.0), N)
        notes = check_iso10360_5(touches, CalibratedSphere(diameter), tip_diameter=6.0).notes
        assert any("10 to 50 mm" in note for note in notes) == noted


class TestPattern:
    """The 25 directions, which are touched in any order and at any azimuth."""

    @pytest.mark.parametrize("degrees", [0.0, 22.5, 45.0, 80.0, -100.0])
    @pytest.mark.parametrize(
        ("fourth_ring", "words"), [(0.0, "every second ring"), (45.0, "cumulatively")]
    )
    def test_both_readings_at_any_azimuth_about_any_axis(
        self, fourth_ring: float, words: str, degrees: float
    ) -> None:
        """The rings are written out by their angles here: 1, 4, 8, 4, 8 at steps of 22.5°."""
        rings = [
            (0, 1, 0.0), (22.5, 4, 0.0), (45, 8, 22.5), (67.5, 4, fourth_ring), (90, 8, 22.5),
        ]  # fmt: skip
        polar, azimuth = np.radians(
            [(p, start + 360.0 / count * k) for p, count, start in rings for k in range(count)]
        ).T
        axis = np.array([2.0, -3.0, 6.0]) / 7.0
        n = from_angles(polar, azimuth) @ probe_rotation(axis, math.radians(degrees)).T
        touches = _touches(np.random.default_rng(1).permutation(n))
        check = check_iso10360_5(touches, SPHERE, axis=axis)
        assert check.figures[0].value == pytest.approx(0.0, abs=1e-9)
        assert words in check.notes[0]
        with pytest.raises(PretravelError, match="nearest direction of the pattern"):
            check_iso10360_5(touches, SPHERE)

    def test_a_ring_between_the_readings_is_refused(self) -> None:
        """A ring of four at 67.5°, turned by 22.5° from both readings, is 20.6° from the nearest
        direction: cos = cos² 67.5° + sin² 67.5° cos 22.5°."""
        n = N.copy()
        n[13:17] = n[13:17] @ probe_rotation((0.0, 0.0, 1.0), math.radians(22.5)).T
        with pytest.raises(PretravelError, match=r"is 21° from .* in both of its forms"):
            check_iso10360_5(_touches(n), SPHERE)

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
        for normals, times in (
            (np.vstack([N, N[[4]]]), "1 to 2"), (N[:24], "0 to 1"),
            (np.vstack([N[:1], N[5:]]), "0 to 1"),
        ):  # fmt: skip
            with pytest.raises(PretravelError, match=f"were touched {times} times"):
                check_iso10360_5(_touches(normals), SPHERE)


class TestFigures:
    @pytest.mark.parametrize(
        ("value", "u", "limit", "outcome", "words"),
        [
            # On a limit: in quarters of a micrometre, which are exact; U is 0.5 (ISO 14253-1).
            (1.5, 0.25, 2.0, "WITHIN", "within the limit"),
            (-1.5, 0.25, 2.0, "WITHIN", "within the limit"),
            (1.50001, 0.25, 2.0, "UNDECIDED", "undecided within U (k = 2)"),
            (2.5, 0.25, 2.0, "UNDECIDED", "undecided within U (k = 2)"),
            (-2.5, 0.25, 2.0, "UNDECIDED", "undecided within U (k = 2)"),
            (2.50001, 0.25, 2.0, "EXCEEDS", "exceeds the limit"),
            (-2.50001, 0.25, 2.0, "EXCEEDS", "exceeds the limit"),
            (1.9, None, 2.0, "WITHIN", "within the limit, u not given"),
            (2.1, None, 2.0, "EXCEEDS", "exceeds the limit, u not given"),
            (1.0, None, None, "NO_LIMIT", "no limit given"),
        ],
    )
    def test_a_decision_is_outside_the_uncertainty_zone(
        self, value: float, u: float | None, limit: float | None, outcome: str, words: str
    ) -> None:
        figure = StandardFigure("form", "", value, u, limit, "unchecked")
        assert (figure.outcome.name, figure.verdict, figure.coverage) == (outcome, words, 2.0)

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
        budget = StandardFigure("size", "", 1.0, 0.2, 2.0, "unchecked", "the diameter").budget
        assert budget is not None
        (part,) = budget.components
        assert (part.name, part.evaluation, part.standard_uncertainty) == ("the diameter", "B", 0.2)
        assert StandardFigure("size", "", 1.0, 0.2, 2.0, "unchecked").budget is None
        assert StandardFigure("size", "", 1.0, None, 2.0, "unchecked", "form").budget is None

    def test_why_no_conformity(self) -> None:
        """Conformity to a standard needs u and the text of the standard; a perfect reference, u of
        zero, is another thing than one of which nothing is stated."""

        def reasons(limit: float | None, u: float | None, status: str) -> list[str]:
            figure = StandardFigure("size", "", 1.0, u, limit, status)
            return [r.split()[1] for r in StandardCheck("x", (figure,), (), ()).why_no_conformity]

        assert reasons(2.0, 0.0, "verified") == []
        assert reasons(2.0, None, "verified") == ["uncertainty"]
        assert reasons(None, None, "verified") == []
        assert reasons(None, None, "unchecked") == ["definitions"]
        assert reasons(2.0, None, "unchecked") == ["definitions", "uncertainty"]

    def test_a_limit_of_repeats_alone_asks_nothing_of_the_reference(self) -> None:
        touches = _touches(np.vstack([np.tile(N[[0]], (10, 1)), RING]))
        made = check_iso230_10(touches, CalibratedSphere(25.0), limits={"repeatability": UM})
        assert [figure.u_test for figure in made.figures] == [None, None, 0.0]
        assert not_stated(made) == ()
        made = check_iso230_10(touches, CalibratedSphere(25.0), limits={"form2d": UM, "form3d": UM})
        (warning,) = not_stated(made)
        assert "needs the form error of the reference" in warning


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

    @pytest.mark.parametrize("check", [check_iso230_10, check_iso10360_5])
    def test_other_tests_than_that_of_the_tip_refuse_it(
        self, check: Callable[..., StandardCheck]
    ) -> None:
        with pytest.raises(PretravelError, match="2 orientations of the spindle"):
            check(Touches(15.5 * N, N, spindle=np.arange(25) % 2 * math.pi), SPHERE)
        assert check(Touches(15.5 * N, N, spindle=np.full(25, math.pi)), SPHERE).figures

    @pytest.mark.parametrize("diameter", [1.0, 25.0, 100.0])
    @pytest.mark.parametrize(("share", "refused"), [(0.104, 0), (0.096, 1), (4.9, 0), (5.1, 1)])
    def test_a_spread_of_a_tenth_to_five_diameters(
        self, diameter: float, share: float, refused: int
    ) -> None:
        """36 touches on a circle: 0.9 of them are within cos 5° of its radius. Inches for mm are
        25.4 times as much."""
        radius = 0.5 * share * diameter / math.cos(math.radians(5.0))
        touches = Touches(radius * RING + [700.0, -900.0, 40.0], RING)
        if not refused:
            refuse_other_unit(touches, CalibratedSphere(diameter))
            return
        words = "look like inches" if share < 1.0 else "taken as inches"
        with pytest.raises(PretravelError, match=words):
            refuse_other_unit(touches, CalibratedSphere(diameter))

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

    @pytest.mark.parametrize(
        ("standard", "setting", "words"),
        [
            ("iso10360-5", {"repeat_limit_um": 1.0}, "repeat limit is only for iso230-10"),
            ("iso230-10", {"size_limit_um": 1.0}, "size limit is only for iso10360-5"),
            ("iso230-10", {"u_diameter_um": 1.0}, "u diameter is only for iso10360-5"),
            ("iso10360-5", {"size_limit_um": 1.0}, "the diameter of the tip, or a map"),
        ],
    )
    def test_what_a_standard_does_not_have_is_refused_without_touches(
        self, standard: str, setting: dict[str, float], words: str
    ) -> None:
        given = {"standard": standard, "touches": "none.csv", "diameter": 25.0, **setting}
        with pytest.raises(PretravelError, match=words):
            Check(**given).run()  # type: ignore[arg-type]
        if "map" in words:
            Check(**given, map_file="map.csv")  # type: ignore[arg-type]  # is not refused
