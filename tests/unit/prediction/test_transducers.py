"""What breaks the circuit: a contact that opens by a way, or a piezo stage at one force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.errors import ConvergenceError, DescriptionError, InputError, PretravelError
from pretravel.prediction.catalogue import description_text, parse_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.event import trigger_force, watched_loads
from pretravel.prediction.predict import predict
from pretravel.prediction.response import probe_response
from pretravel.prediction.seats import lifted_tip_motion
from pretravel.probing.simulation import simulate
from pretravel.probing.slide import slide
from pretravel.probing.targets import Targets
from pretravel.surface.shapes import Plane
from pretravel.tasks.predict import Predict

X = np.array([[1.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("trigger", "words"),
    [
        ('criterion = "first_contact"\nopening_um = 0.2', "make it 'arm_lift'"),
        ('criterion = "piezo_stage"\nthreshold_N = 1\nopening_um = 0.2', "make it 'arm_lift'"),
        ('criterion = "piezo_stage"', "state it as threshold_N"),
        ('criterion = "arm_lift"\nopening_um = -0.2', "opening of the contact is -0.2 µm"),
        ('criterion = "arm_lift"\nopening_um = 1001', "between 0 and 1000 µm"),
        ('criterion = "arm_lift"\nopening_mm = 0.2', "has no opening_mm"),
    ],
)
def test_transducers_that_cannot_be(trigger: str, words: str) -> None:
    text = description_text("omp40-2")
    text = text[: text.index("[trigger]")] + text[text.index("[sources]") :]
    with pytest.raises((InputError, DescriptionError), match=words) as error:
        parse_probe(f"{text}\n[trigger]\n{trigger}\n", "mine.toml")
    assert str(error.value).startswith("mine.toml")


def test_a_piezo_stage_triggers_at_the_threshold_unless_a_rod_lifts_before() -> None:
    """Rods carry 4 N. In the first row the third rod loses 2 N per newton and lifts at 2 N; in the
    second no rod loses force; a seat opens at 2/3 N, which the stage does not notice."""
    unit = np.array([[1.0, 1.0, 1.0, 1.0, 1.0, -3.0], [1.0] * 6])
    force, seat = trigger_force(np.full(6, 2.0), unit, "piezo_stage", 1.9)
    assert force.tolist() == [1.9, 1.9]
    assert seat[0] == 5
    assert trigger_force(np.full(6, 2.0), unit, "piezo_stage", 2.1)[0].tolist() == [np.inf, 2.1]
    with pytest.raises(PretravelError, match="watches the force on the tip"):
        watched_loads(unit, "piezo_stage")


def test_a_stage_that_needs_more_than_lifts_a_rod_says_so(omp40: Probe) -> None:
    stage = replace(omp40, criterion="piezo_stage", threshold=0.9)
    with pytest.raises(PretravelError, match=r"a rod lifts before the force is 0\.9 N"):
        predict(stage, X)


def test_a_stage_may_trigger_at_more_than_a_seat_carries_at_rest(omp40: Probe) -> None:
    """2.15 N of a seat at rest: the axial direction loads all of them evenly."""
    stage = replace(omp40, criterion="piezo_stage", threshold=3.0)
    assert predict(stage, [[0.0, 0.0, 1.0]]).force.tolist() == [3.0]


def test_the_response_of_a_stage(omp40: Probe) -> None:
    """The excess is the way to the trigger: what the force lacks."""
    response = probe_response(replace(omp40, criterion="piezo_stage", threshold=0.1), "wozniak")
    assert response.excess(X, np.array([0.04])) == pytest.approx([0.06])
    assert response.force(X)[0].tolist() == [0.1]


def test_the_tip_turns_about_two_rods(omp40: Probe) -> None:
    """A rod at +x and a lever of 64.4 mm: the line through the two others is at x = -8.17 mm, so
    that the third rises by 1 over 24.51 mm; the tip goes to +x by 64.4 / 24.51, and up by a third
    of 1, since the axis is at a third of the way."""
    motion = lifted_tip_motion(omp40)
    azimuths = np.array(omp40.tripod.rod_azimuths)
    sideways = 64.4 / (1.5 * omp40.tripod.radius)
    assert motion[:, 2] == pytest.approx([1.0 / 3.0] * 3)
    assert motion[:, 0] == pytest.approx(sideways * np.cos(azimuths))
    assert motion[:, 1] == pytest.approx(sideways * np.sin(azimuths))


class TestWhatDoesNotContainAnOpening:
    @pytest.fixture
    def opened(self, omp40: Probe) -> Probe:
        return replace(omp40, criterion="arm_lift", opening=0.5e-3)

    def test_slides_and_responses_say_so(self, opened: Probe) -> None:
        floor = Plane([0.0, 0.0, 0.0], [0.6, 0.0, 0.8])
        with pytest.raises(PretravelError, match="does not contain the opening"):
            slide(opened, floor, (0.0, 0.0))
        with pytest.raises(PretravelError, match=r"opens by 0\.5 µm.* Set opening_um"):
            probe_response(opened)

    def test_friction_refuses(self, opened: Probe) -> None:
        with pytest.raises(PretravelError, match="first_contact"):
            predict(opened.with_friction(0.1), X)

    def test_exact_maps_become_tables(self, opened: Probe) -> None:
        task = Predict(probe="omp40-2", model="analytic")
        assert task.predicted(opened).pretravel_map(exact=True).kind == "tabulated"
        without = replace(opened, opening=None)
        assert task.predicted(without).pretravel_map(exact=True).kind == "physical"

    def test_uneven_probes_have_no_full_model(self, opened: Probe) -> None:
        with pytest.raises(DescriptionError, match="the model wozniak needs three equal rods"):
            predict(replace(opened, spring_offset=(0.1, 0.0)), X, "wozniak")


def test_the_simple_map_of_wozniak_touches_no_surface(omp40: Probe) -> None:
    at = Targets(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
    with pytest.raises(ConvergenceError, match="It has it for descriptions with opening_um"):
        simulate(omp40, Plane([0.0] * 3, [0.0, 0.0, 1.0]), at, model="wozniak")
