"""A touch of a design step by step: what the screen computes, and what it shows of each step."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from pretravel.app.project import Inputs
from pretravel.app.task_form import with_file_names
from pretravel.base.errors import PretravelError
from pretravel.design.probing.slides import SlideSettings, slide
from pretravel.design.probing.tip import predicted_tip
from pretravel.design.screen.slide import shown_step
from pretravel.design.screen.work import (
    DESIGN_FILE,
    SLIDE,
    SURFACES,
    digest_of,
    follow_slide,
    start_text,
)
from pretravel.design.tasks.slide.report import slide_step_figures, slide_step_view
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.materials import material
from pretravel.show.chart import PlaneChart, SpaceChart
from pretravel.show.chart_marks import Bars, Dots, SpaceArrow, SpaceLines, SpacePoints
from pretravel.six_seats import SEAT_NAMES
from pretravel.surface.specification import face_of


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("kinematics", ["lateral", "full"])
def test_each_offered_surface_has_steps_before_and_after_the_trigger(
    surface: str, kinematics: str
) -> None:
    settings = {"slide_surface": surface, "slide_kinematics": kinematics}
    history = follow_slide(Inputs(settings, {})).made.history
    assert not history.triggered[0]
    assert history.triggered[-1]


def test_the_screen_follows_the_design_as_the_library_does() -> None:
    """The design's preload is that of the form, and the settings are those of the task."""
    settings = {
        "form_of": digest_of(start_text("omp40-2", None)),
        "design.spring.preload_N": 4.0,
        "slide_surface": "plane:polar=40",
        "slide_at": "1,2",
        "slide_step": 0.0005,
        "slide_steps": 4,
        "slide_kinematics": "full",
    }
    found = follow_slide(Inputs(settings, {}))
    probe = replace(load_probe("omp40-2"), preload=4.0)
    expected = slide(
        predicted_tip(probe),
        face_of("plane:polar=40"),
        (1.0, 2.0),
        SlideSettings(step=0.0005, steps=4, kinematics="full"),
    )
    assert found.made.history.center.tolist() == expected.center.tolist()
    words = shlex.split(with_file_names(found.made.task, output=Path("slide.csv")).command_line())
    assert words[:3] == ["pretravel", "slide", DESIGN_FILE]
    assert words[words.index("--surface") + 1] == "plane:polar=40"
    assert set(settings) - {"form_of"} <= set(SLIDE.settings)


@pytest.mark.parametrize("surface", ["evil.py", "part.step#1", "plane:polar=41"])
def test_a_surface_that_is_not_offered_is_refused(surface: str, tmp_path: Path) -> None:
    """A project that was sent can state a script."""
    with pytest.raises(PretravelError, match="of the list"):
        follow_slide(Inputs({"slide_surface": surface}, {}))


@pytest.mark.published(
    "Rodrigues 2021", "Figure 2.8",
    what="contact status and penetration of the six seats",
    ours="all closed until the trigger, pressed in by 0.09 to 0.28 µm by Hertz's law (convex"
    " surface, first two µm); by step in the table of `pretravel slide` and, to step "
    "through, in the designer; 0 with rigid seats",
    theirs="closed; 2e-11 µm, the gap of their solver",
    verdict="agrees (status); differs: theirs is numerical, before any load",
)  # fmt: skip
def test_numbers_and_picture_of_a_step_are_those_of_the_history() -> None:
    made = follow_slide(Inputs({"slide_surface": "sphere:radius=12.5"}, {})).made
    history, radius = made.history, made.tip.radius
    last = int(np.argmax(history.triggered))
    for step in (1, last):
        row = step - 1
        listed = {figure.name: figure.value for figure in slide_step_figures(history, step)}
        assert listed["step"] == f"{step} of 20"
        assert listed["contact point (T)"] == tuple(history.contact[row])
        assert listed["tip centre (C)"] == tuple(history.center[row])
        assert listed["spindle (P)"] == tuple(history.spindle[row])
        assert listed["force"] == history.force[row]
        space, seats, *curves = slide_step_view(history, made.shape, radius, step).charts
        assert isinstance(seats, PlaneChart)
        (bars,) = seats.marks
        assert isinstance(bars, Bars)
        assert bars.values == pytest.approx(_pressed(history.reactions[row]), rel=1e-9)
        assert bars.texts == ("closed",) * 6
        assert isinstance(space, SpaceChart)
        assert [type(curve) for curve in curves] == [PlaneChart, PlaneChart]
        lines = {mark.name: mark for mark in space.marks if isinstance(mark, SpaceLines)}
        moved = (
            lines["movement of the spindle"].ends[0] - lines["movement of the spindle"].starts[0]
        )
        # Along the approach, as far as the feed: 1e-6 µm is rounding of 12.5 mm in µm.
        assert np.linalg.norm(moved) == pytest.approx(1e3 * history.feed[row], abs=1e-6)
        bent = lines["deflection"].ends[0] - lines["deflection"].starts[0]
        assert bent == pytest.approx(1e3 * (history.center - history.spindle)[row], abs=1e-6)
        (arrow,) = (mark for mark in space.marks if isinstance(mark, SpaceArrow))
        (now,) = (m for m in space.marks if isinstance(m, SpacePoints) and m.name == "contact now")
        assert arrow.start == pytest.approx(now.positions[0])
        assert now.positions[0] == pytest.approx(1e3 * (history.contact[row] - history.start))
        for curve, values in zip(curves, (1e3 * history.deflection, history.force), strict=True):
            (ring,) = (mark for mark in curve.marks if isinstance(mark, Dots))
            assert [ring.x[0], ring.y[0]] == pytest.approx([1e3 * history.feed[row], values[row]])


def _pressed(reactions: np.ndarray) -> np.ndarray:
    """Johnson, equations 4.24 to 4.26, in µm: a ball of 3.5 mm and a rod of 2.75 mm radius of one
    tungsten carbide touch in an ellipse of half-axes a and b; K and E of scipy."""
    carbide = material("tungsten carbide")
    modulus = 0.5 * carbide.youngs_modulus / (1.0 - carbide.poissons_ratio**2)
    along, around = 1.0 / 3.5, 1.0 / 3.5 + 1.0 / 2.75

    def error(ratio: float) -> float:
        m = 1.0 - ratio**2
        return (ellipe(m) / ratio**2 - ellipk(m)) / (ellipk(m) - ellipe(m)) - around / along

    m = 1.0 - brentq(error, 0.05, 0.999, xtol=1e-14) ** 2
    a = np.cbrt(3.0 * reactions * (ellipk(m) - ellipe(m)) / (np.pi * modulus * m * along))
    return np.asarray(1e3 * 1.5 * reactions * ellipk(m) / (np.pi * a * modulus))


@pytest.mark.published("Rodrigues 2021", "Figure 2.8")
def test_after_the_trigger_a_seat_is_open() -> None:
    """It is the seat that carries least in the last step before; nothing is known of the others."""
    made = follow_slide(Inputs({}, {})).made
    history = made.history
    last = int(np.argmax(history.triggered))
    opened = SEAT_NAMES[int(np.argmin(history.reactions[last - 1]))]
    seats = slide_step_view(history, made.shape, made.tip.radius, last + 1).charts[1]
    assert isinstance(seats, PlaneChart)
    (bars,) = seats.marks
    assert isinstance(bars, Bars)
    assert bars.texts == tuple("open" if n == opened else "not known" for n in SEAT_NAMES)
    figures = {figure.name: figure.value for figure in slide_step_figures(history, last + 1)}
    assert figures["open seat"] == opened


def test_after_the_trigger_no_force_is_stated() -> None:
    made = follow_slide(Inputs({}, {})).made
    figures = {figure.name: figure for figure in slide_step_figures(made.history, 20)}
    assert figures["force"].value == "a seat is open"
    assert figures["step"].remark == "after the trigger"
    force = slide_step_view(made.history, made.shape, made.tip.radius, 20).charts[-1]
    assert isinstance(force, PlaneChart)
    assert not [mark for mark in force.marks if isinstance(mark, Dots)]


@pytest.mark.parametrize("step", [0, 21])
def test_a_step_that_is_not_there_is_refused(step: int) -> None:
    history = follow_slide(Inputs({}, {})).made.history
    with pytest.raises(PretravelError, match=f"no step {step}: its steps are 1 to 20"):
        slide_step_figures(history, step)


def test_a_stored_step_stays_within_the_slide() -> None:
    assert [shown_step(stored, 5) for stored in (None, 0.0, 3.0, 9.0)] == [1, 1, 3, 5]
