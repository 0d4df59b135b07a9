"""Figures of standards: their values, and when they support a verdict."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.laboratory.iso230_10 import check_iso230_10, plane_pattern_36
from pretravel.laboratory.iso10360_5 import check_iso10360_5
from pretravel.laboratory.standard_check import (
    CalibratedSphere,
    LimitOutcome,
    StandardFigure,
    refuse_other_unit,
)
from pretravel.tasks.check import Check, not_stated
from pretravel.touches import Touches

UM = 1e-3
N = sphere_pattern_25()


@pytest.mark.parametrize(
    ("value", "verdict"),
    [
        (1.5, "within the limit"),
        (-1.5, "within the limit"),
        (1.9, "undecided within U (k = 2)"),
        (2.3, "undecided within U (k = 2)"),
        (-2.5, "exceeds the limit"),
    ],
)
def test_verdict_only_outside_the_uncertainty_zone(value: float, verdict: str) -> None:
    """ISO 14253-1, quoted from memory: limit 2 um, U = 0.4 um."""
    assert (
        StandardFigure("size", "", value * UM, 0.2 * UM, 2.0 * UM, "unchecked").verdict == verdict
    )


@pytest.mark.parametrize(
    ("value", "verdict", "outcome"),
    [
        (1.9, "within the limit, u not stated", LimitOutcome.WITHIN),
        (2.1, "exceeds the limit, u not stated", LimitOutcome.EXCEEDS),
    ],
)
def test_without_an_uncertainty_a_figure_says_so(
    value: float, verdict: str, outcome: LimitOutcome
) -> None:
    figure = StandardFigure("size", "", value * UM, None, 2.0 * UM, "unchecked")
    assert (figure.verdict, figure.outcome) == (verdict, outcome)


def test_what_a_check_does_not_state() -> None:
    """Limits are compared; conformity to a standard needs u and the text of the standard."""
    touches = Touches(N * 15.5, N)

    def reasons(sphere: CalibratedSphere) -> str:
        made = check_iso10360_5(touches, sphere, tip_diameter=6.0, limits={"form": UM, "size": UM})
        return "; ".join(made.why_no_conformity)

    assert "not been checked" in reasons(CalibratedSphere(25.0, 0.1 * UM, 0.1 * UM))
    assert "not stated" not in reasons(CalibratedSphere(25.0, 0.1 * UM, 0.1 * UM))
    assert "not stated" in reasons(CalibratedSphere(25.0, 0.1 * UM))
    assert "not stated" in reasons(CalibratedSphere(25.0, form=0.1 * UM))
    # A perfect reference may be stated: that is another thing than to state nothing.
    assert "not stated" not in reasons(CalibratedSphere(25.0, 0.0, 0.0))


def test_repeatability_does_not_need_the_reference() -> None:
    """The range of repeats of one direction contains nothing of the reference's calibration."""
    n = np.tile([[0.0, 0.0, 1.0]], (10, 1))
    angle = np.radians(np.arange(0, 360, 10))
    n = np.concatenate([n, np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)])
    made = check_iso230_10(Touches(n * 15.5, n), CalibratedSphere(25.0), tip_diameter=6.0)
    stated = {figure.name: figure.u_test for figure in made.figures}
    assert stated == {"P_FTU,2D": None, "R_SPT": 0.0, "P_FTU,3D": None}


def test_form_and_size_of_known_touches() -> None:
    """One direction is 3 um too far out, its opposite neighbours are not. The least-squares sphere
    takes up a part of it; form is the range about this sphere, computed by normal equations."""
    off = np.zeros(25)
    off[20] = 3.0 * UM
    radius = 12.5 + 3.0 + 1.0 * UM
    design = np.hstack([N, np.ones((25, 1))])
    left = off - design @ np.linalg.lstsq(design, off)[0]
    shift = np.linalg.lstsq(design, off)[0]
    check = check_iso10360_5(
        Touches(N * (radius + off)[:, None], N), CalibratedSphere(25.0), tip_diameter=6.0
    )
    form, size = check.figures
    assert form.value == pytest.approx(np.ptp(left), abs=1e-3 * UM)
    assert size.value == pytest.approx(2.0 * (1.0 * UM + shift[3]), abs=1e-3 * UM)
    assert {form.status, size.status} == {"unchecked"}


def turned(directions: FloatArray, angle: float) -> FloatArray:
    """Directions turned about +z."""
    c, s = np.cos(angle), np.sin(angle)
    return directions @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("degrees", [0.0, 17.2, 22.5, 45.0, 80.0, -100.0])
@pytest.mark.parametrize(
    ("fourth_ring", "words"),
    [(0.0, "forth and back"), (45.0, "cumulatively")],
)
def test_both_readings_of_the_pattern_at_any_azimuth(
    fourth_ring: float, words: str, degrees: float
) -> None:
    """The rings are written out by their angles here: 1, 4, 8, 4, 8 at steps of 22.5°."""
    rings = [(0, 1, 0.0), (22.5, 4, 0.0), (45, 8, 22.5), (67.5, 4, fourth_ring), (90, 8, 22.5)]
    angles = [
        (np.radians(polar), np.radians(start + 360.0 / count * k))
        for polar, count, start in rings
        for k in range(count)
    ]
    polar, azimuth = np.array(angles).T
    n = turned(from_angles(polar, azimuth), np.radians(degrees))
    n = np.random.default_rng(1).permutation(n)
    check = check_iso10360_5(Touches(n * 15.5, n), CalibratedSphere(25.0), tip_diameter=6.0)
    assert check.figures[0].value == pytest.approx(0.0, abs=1e-9)
    assert words in check.notes[0]


def test_a_ring_between_the_readings_is_refused() -> None:
    """A ring of four at 67.5°, turned by 22.5° from both readings, is 20.6° from the nearest
    direction: cos = cos² 67.5° + sin² 67.5° cos 22.5°."""
    n = N.copy()
    n[13:17] = turned(n[13:17], np.radians(22.5))
    with pytest.raises(PretravelError, match=r"is 21° from .* in either reading"):
        check_iso10360_5(Touches(n * 15.5, n), CalibratedSphere(25.0))


@pytest.mark.parametrize(
    ("standard", "setting", "words"),
    [
        ("iso10360-5", {"repeat_limit_um": 1.0}, "repeatability is only for iso230-10"),
        ("iso230-10", {"size_limit_um": 1.0}, "size is only for iso10360-5"),
        ("iso230-10", {"u_diameter_um": 1.0}, "uncertainty of the diameter is only for iso10360-5"),
    ],
)
def test_what_a_standard_does_not_have_is_refused_without_touches(
    standard: str, setting: dict[str, float], words: str
) -> None:
    task = Check(standard=standard, touches=("none.csv",), diameter=25.0, **setting)
    with pytest.raises(PretravelError, match=words):
        task.run()


def test_a_size_limit_needs_a_tip_or_a_map() -> None:
    given = {"standard": "iso10360-5", "touches": "none.csv", "diameter": 25.0}
    Check(**given, size_limit_um=1.0, map_file="map.csv").refuse_unused()
    with pytest.raises(PretravelError, match="give the diameter of the tip, or a map"):
        Check(**given, size_limit_um=1.0).run()


def test_a_limit_of_repeats_alone_asks_nothing_of_the_reference() -> None:
    n = np.tile([[0.0, 0.0, 1.0]], (10, 1))
    n = np.concatenate([n, plane_pattern_36()])
    touches, sphere = Touches(n * 15.5, n), CalibratedSphere(25.0)
    made = check_iso230_10(touches, sphere, limits={"repeatability": UM})
    assert not_stated(made) == ()
    made = check_iso230_10(touches, sphere, limits={"form2d": UM, "form3d": UM})
    (warning,) = not_stated(made)
    assert "needs the form error of the reference" in warning


def test_iso230_10_figures() -> None:
    """Equator with 2 um of ovality, one direction repeated ten times over 0.7 um."""
    angle = np.radians(np.arange(0, 360, 10))
    ring = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    oval = 1.0 * UM * np.cos(2.0 * angle)
    repeats = np.linspace(-0.35, 0.35, 10) * UM
    n = np.concatenate([ring, np.tile([[0.0, 0.0, 1.0]], (10, 1))])
    distance = 15.5 + np.concatenate([oval, repeats])
    check = check_iso230_10(
        Touches(n * distance[:, None], n), CalibratedSphere(25.0), tip_diameter=6.0
    )
    figures = {figure.name: figure.value for figure in check.figures}
    assert figures["P_FTU,2D"] == pytest.approx(2.0 * UM, abs=1e-3 * UM)
    assert figures["R_SPT"] == pytest.approx(0.7 * UM, abs=1e-6 * UM)


@pytest.mark.parametrize("diameter", [1.0, 5.0, 25.0, 100.0])
def test_the_unit_shows_at_every_size_of_the_sphere(diameter: float) -> None:
    """With a small tip the touches spread over the diameter; in the wrong unit, over 1/25.4 or
    25.4 of it. The limits are shares of the diameter, so that no size is another case."""
    sphere, positions = CalibratedSphere(diameter), 0.51 * diameter * N
    refuse_other_unit(Touches(positions, N), sphere)
    with pytest.raises(PretravelError, match="look like inches"):
        refuse_other_unit(Touches(positions / 25.4, N), sphere)
    with pytest.raises(PretravelError, match="taken as inches"):
        refuse_other_unit(Touches(positions * 25.4, N), sphere)


@pytest.mark.parametrize(
    ("diameter", "noted"), [(9.9, True), (10.0, False), (50.0, False), (50.1, True)]
)
def test_a_sphere_of_another_size_than_the_standard_s_is_noted(
    diameter: float, noted: bool
) -> None:
    touches = Touches(N * (0.5 * diameter + 3.0), N)
    made = check_iso10360_5(touches, CalibratedSphere(diameter), tip_diameter=6.0)
    assert any("should have a diameter of 10 to 50 mm" in note for note in made.notes) == noted


def test_runs_are_stated_with_the_worst() -> None:
    """Two runs, the second with one touch 4 um off: the form of the worse one, in its own set."""
    off = np.zeros(50)
    off[25 + 7] = 4.0 * UM
    touches = Touches(np.tile(N, (2, 1)) * (15.5 + off)[:, None], np.tile(N, (2, 1)))
    made = check_iso10360_5(touches, CalibratedSphere(25.0), tip_diameter=6.0)
    assert any("there are 2 runs of 25 touches; the worst" in note for note in made.notes)
    forms = [some.fit.form for some in made.sets]
    assert forms[0] == pytest.approx(0.0, abs=1e-9)
    assert 3.0 * UM < forms[1] < 4.1 * UM
    assert made.figures[0].value == forms[1]
