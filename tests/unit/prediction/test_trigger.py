"""The event, the seats at rest, what breaks the circuit, and the quantities of a trigger."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel import design
from pretravel.base.errors import ConvergenceError, DescriptionError, InputError, PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.design.probing.simulation import simulate
from pretravel.design.probing.slides import slide
from pretravel.design.tasks.predict import Predict
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.provenance import Origin
from pretravel.prediction.catalogue import description_text, parse_probe
from pretravel.prediction.compliance.base import TIP_ON_PART
from pretravel.prediction.description import Moving, Orientation, Probe
from pretravel.prediction.materials import default_workpiece, material
from pretravel.prediction.response import probe_response
from pretravel.prediction.seats import lifted_tip_motion, seat_statics, statics_in_machine
from pretravel.prediction.slender import buckling_load, slender_doubts
from pretravel.prediction.trigger import Trigger, predict, predicted_map
from pretravel.six_seats.event import trigger_force, watched_loads
from pretravel.surface.shapes import Plane
from pretravel.touches.targets import Targets

RANDOM = np.random.default_rng(8)
REST = np.array([2.0, 3.1, 1.7, 2.6, 3.3, 2.2])
UNIT = RANDOM.normal(size=(40, 6))
N = np.array([[0.6, 0.48, 0.64], [-0.8, 0.6, 0.0], [0.28, -0.96, 0.0]])
X = np.array([[1.0, 0.0, 0.0]])


class TestEvent:
    @pytest.mark.parametrize(("criterion", "seats"), [("first_contact", 1), ("arm_lift", 2)])
    @pytest.mark.parametrize("threshold", [0.0, 0.3])
    def test_the_first_load_at_the_threshold(
        self, criterion: str, seats: int, threshold: float
    ) -> None:
        """Of a seat, or of both seats of a rod, whose weaker one is named; loop by loop."""
        force, seat = trigger_force(REST, UNIT, criterion, threshold)
        for row, unit in enumerate(UNIT):
            falls = [-sum(unit[first : first + seats]) for first in range(0, 6, seats)]
            loads = [sum(REST[first : first + seats]) - threshold for first in range(0, 6, seats)]
            reached = [
                load / fall if fall > 0 else math.inf
                for load, fall in zip(loads, falls, strict=True)
            ]
            assert force[row] == pytest.approx(min(reached))
            if math.isfinite(force[row]):
                own = unit[seats * reached.index(min(reached)) :][:seats]
                assert seat[row] == seats * reached.index(min(reached)) + int(np.argmin(own))
        assert set(seat) == set(range(6))

    def test_first_contact_without_a_threshold_is_usual(self) -> None:
        usual, stated = trigger_force(REST, UNIT), trigger_force(REST, UNIT, "first_contact", 0.0)
        assert np.array_equal(usual, stated)

    def test_of_seats_that_open_together_the_first_is_named(self) -> None:
        """Within a relative difference of 1e-9; of a rod whose seats unload alike, the left."""
        change = np.full((3, 6), 1.0)
        change[0, [2, 5]] = -1.0, -1.0 - 1e-10
        change[1, [2, 5]] = -1.0, -1.0 - 1e-8
        change[2, [3, 4]] = -1.0, -1.9
        assert trigger_force(np.full(6, 2.0), change)[1].tolist() == [2, 5, 4]
        alike = np.array([[0.5, 0.5, 1.0, 1.0, -1.0, -1.0], [0.5, 0.5, -2.0, -2.0, -1.0, 0.0]])
        force, seat = trigger_force(np.full(6, 2.0), alike, "arm_lift")
        assert force.tolist() == [2.0, 1.0]
        assert seat.tolist() == [4, 2]

    @pytest.mark.parametrize(
        ("criterion", "words"),
        [("lift", "'lift' is not known; known are"), ("piezo_stage", "the force on the tip")],
    )
    def test_criteria_that_watch_no_loads(self, criterion: str, words: str) -> None:
        with pytest.raises(PretravelError, match=words):
            watched_loads(UNIT, criterion)

    def test_a_piezo_stage_triggers_at_the_threshold_unless_a_rod_lifts_before(self) -> None:
        """Rods carry 4 N. In the first row the third rod loses 2 N per newton and lifts at 2 N; in
        the second no rod loses force; a seat opens at 2/3 N, which the stage does not notice."""
        unit = np.array([[1.0, 1.0, 1.0, 1.0, 1.0, -3.0], [1.0] * 6])
        force, seat = trigger_force(np.full(6, 2.0), unit, "piezo_stage", 1.9)
        assert force.tolist() == [1.9, 1.9]
        assert seat[0] == 5
        assert trigger_force(np.full(6, 2.0), unit, "piezo_stage", 2.1)[0].tolist() == [np.inf, 2.1]


class TestSeatsAtRest:
    def test_gravity_of_the_machine_is_turned_into_the_probe(self, omp40: Probe) -> None:
        """A probe along x: what pulls along the machine's -x pulls along the probe's -z."""
        lying = replace(
            omp40,
            orientation=replace(omp40.orientation, axis=(1.0, 0.0, 0.0)),
            moving=Moving(mass=0.03, height=7.0),
        )
        for machine, own in (([-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]), (None, None)):
            found = statics_in_machine(lying, machine).rest_reactions
            assert found == pytest.approx(seat_statics(lying, own).rest_reactions)

    @pytest.mark.parametrize("criterion", ["first_contact", "arm_lift"])
    def test_a_threshold_as_large_as_the_load_at_rest(self, omp40: Probe, criterion: str) -> None:
        """Each seat of six carries P / (6 sin angle); a rod on two of them twice as much."""
        load = omp40.preload / (6.0 * math.sin(omp40.seats.support_angle))
        load *= 2.0 if criterion == "arm_lift" else 1.0
        some = replace(omp40, criterion=criterion)
        assert seat_statics(replace(some, threshold=load - 1e-6)).rest_reactions.min() > 0.0
        with pytest.raises(DescriptionError, match="would never be seated"):
            seat_statics(replace(some, threshold=load + 1e-6))

    def test_of_unequal_loads_the_least_decides(self, omp40: Probe) -> None:
        """A lying probe: its rods carry unequal loads, and the threshold is between them; with more
        weight a seat would pull, though no rod lifts as a whole."""
        down = [0.0, 1.0, 0.0]
        lying = replace(omp40, moving=Moving(mass=0.05, height=-1.0))
        least, most = np.sort(seat_statics(lying, down).rest_reactions)[[0, -1]]
        assert 0.0 < least < most - 0.1
        with pytest.raises(DescriptionError, match="or the moving mass"):
            seat_statics(replace(lying, threshold=0.5 * float(least + most)), down)
        pulls = replace(omp40, moving=Moving(mass=0.6, height=0.0), criterion="arm_lift")
        load = np.array([0.0, 0.6 * 9.80665, -omp40.preload, 0.0, 0.0, 0.0])
        rest = np.linalg.solve(seat_statics(omp40).wrenches, -load)
        assert rest.min() < 0.0 < rest.reshape(3, 2).sum(axis=1).min()
        with pytest.raises(DescriptionError, match="would never be seated"):
            seat_statics(pulls, down)


class TestTransducers:
    """A contact that opens by a way, or a piezo stage at one force."""

    @pytest.mark.parametrize(
        ("trigger", "words"),
        [
            ('criterion = "first_contact"\nopening_um = 0.2', "make it 'arm_lift'"),
            (
                'criterion = "piezo_stage"\nthreshold_N = 1\nopening_um = 0.2',
                "make it 'arm_lift'",
            ),
            ('criterion = "piezo_stage"', "give it as threshold_N"),
            ('criterion = "arm_lift"\nopening_um = -0.2', "opening of the contact is -0.2 µm"),
            ('criterion = "arm_lift"\nopening_um = 1001', "between 0 and 1000 µm"),
            ('criterion = "arm_lift"\nopening_mm = 0.2', "has no opening_mm"),
        ],
    )
    def test_that_cannot_be(self, trigger: str, words: str) -> None:
        text = description_text("omp40-2")
        text = text[: text.index("[trigger]")] + text[text.index("[sources]") :]
        with pytest.raises((InputError, DescriptionError), match=words) as error:
            parse_probe(f"{text}\n[trigger]\n{trigger}\n", "mine.toml")
        assert str(error.value).startswith("mine.toml")

    def test_a_stage_may_need_more_than_a_seat_carries_but_not_what_lifts_a_rod(
        self, omp40: Probe
    ) -> None:
        """2.15 N of a seat at rest: the axial direction loads all of them evenly."""
        stage = replace(omp40, criterion="piezo_stage", threshold=3.0)
        assert predict(stage, [[0.0, 0.0, 1.0]]).force.tolist() == [3.0]
        with pytest.raises(PretravelError, match=r"a rod lifts before the force is 0\.9 N"):
            predict(replace(stage, threshold=0.9), X)

    def test_the_response_of_a_stage(self, omp40: Probe) -> None:
        """The excess is the way to the trigger: what the force lacks."""
        response = probe_response(replace(omp40, criterion="piezo_stage", threshold=0.1), "wozniak")
        assert response.excess(X, np.array([0.04])) == pytest.approx([0.06])
        assert response.force(X)[0].tolist() == [0.1]

    def test_the_tip_turns_about_two_rods(self, omp40: Probe) -> None:
        """A rod at +x and a lever of 64.4 mm: the line through the two others is at x = -8.17 mm,
        so that the third rises by 1 over 24.51 mm; the tip goes to +x by 64.4 / 24.51, and up by a
        third of 1, since the axis is at a third of the way."""
        motion = lifted_tip_motion(omp40)
        azimuths = np.array(omp40.tripod.rod_azimuths)
        sideways = 64.4 / (1.5 * omp40.tripod.radius)
        assert motion[:, 2] == pytest.approx([1.0 / 3.0] * 3)
        assert motion[:, 0] == pytest.approx(sideways * np.cos(azimuths))
        assert motion[:, 1] == pytest.approx(sideways * np.sin(azimuths))

    def test_what_does_not_contain_an_opening(self, omp40: Probe) -> None:
        """Slides, responses, friction, uneven probes refuse it; an exact map becomes a table."""
        opened = replace(omp40, criterion="arm_lift", opening=0.5e-3)
        floor = Plane([0.0, 0.0, 0.0], [0.6, 0.0, 0.8])
        with pytest.raises(PretravelError, match="does not contain the opening"):
            slide(opened, floor, (0.0, 0.0))
        with pytest.raises(PretravelError, match=r"opens by 0\.5 µm.* Set opening_um"):
            probe_response(opened)
        with pytest.raises(PretravelError, match="first_contact"):
            predict(opened.with_friction(0.1), X)
        with pytest.raises(DescriptionError, match="the model wozniak needs three equal rods"):
            predict(replace(opened, spring_offset=(0.1, 0.0)), X, "wozniak")
        task = Predict(probe="omp40-2", model="analytic")
        assert task.predicted(opened).pretravel_map(exact=True).kind == "tabulated"
        without = replace(opened, opening=None)
        assert task.predicted(without).pretravel_map(exact=True).kind == "physical"

    def test_the_simple_map_of_wozniak_touches_no_surface(self, omp40: Probe) -> None:
        at = Targets(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
        with pytest.raises(
            ConvergenceError, match="has this form for descriptions with opening_um"
        ):
            simulate(omp40, Plane([0.0] * 3, [0.0, 0.0, 1.0]), at, model="wozniak")


def made_up(*shares: str) -> Trigger:
    return Trigger(
        directions=N,
        force=np.array([0.7, 0.9, 1.1]),
        seat=np.array([4, 0, 3]),
        reactions=RANDOM.normal(size=(3, 6)),
        displacements={name: RANDOM.normal(size=(3, 3)) for name in shares},
        model="made up",
    )


class TestTrigger:
    def test_quantities_direction_by_direction(self) -> None:
        some = made_up("stem", "seats", TIP_ON_PART)
        parts = some.displacements
        for row, n in enumerate(N):
            bent = parts["stem"][row] + parts["seats"][row]
            assert some.deflection[row] == pytest.approx(bent)
            assert some.sensing_distance[row] == pytest.approx(math.hypot(bent[0], bent[1]))
            approach = float(parts[TIP_ON_PART][row] @ n)
            assert some.tip_approach[row] == pytest.approx(approach)
            assert some.pretravel[row] == pytest.approx(float(bent @ n) + approach)
            for name, share in some.shares.items():
                assert share[row] == pytest.approx(float(parts[name][row] @ n))
        assert set(some.shares) == set(parts)
        assert some.seat_names == ["C-left", "A-left", "B-right"]
        # Without a tip, or with it alone.
        assert made_up("stem").tip_approach.tolist() == [0.0] * 3
        assert made_up(TIP_ON_PART).deflection.tolist() == np.zeros((3, 3)).tolist()

    def test_directions_that_never_trigger_are_counted(self, omp40: Probe) -> None:
        normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        with pytest.raises(PretravelError, match="never triggers in 2 of 4 directions"):
            predict(omp40, normals)

    def test_a_stylus_too_thin_for_linear_bending(self, omp40: Probe) -> None:
        """Euler's load of a stem, π² E I / (4 L²): 0.5 mm thick and 38 mm long less than the
        preload of 5.91 N, at which a touch along the axis triggers. Across the axis it bends by
        F L³ / (3 E I), several millimetres."""
        stem = omp40.stylus[1]
        rigid = 413e3 * math.pi / 64.0
        for thick, doubted in ((0.5, True), (1.0, True), (1.5, False)):
            probe = replace(omp40, stylus=(replace(stem, diameter=thick),))
            load = math.pi**2 * rigid * thick**4 / (4.0 * 38.0**2)
            assert buckling_load(probe) == pytest.approx(load, rel=1e-9)
            assert bool(slender_doubts(probe, N[:1], np.array([1.2]))) == doubted
        thin = replace(omp40, stylus=(replace(stem, diameter=0.5),))
        with pytest.raises(DescriptionError, match=r"buckles, at 2\.17 N .* triggers at 5\.91 N"):
            predict(thin, [[0.0, 0.0, 1.0]])
        across = predict(replace(omp40, stylus=(stem,)), X).force[0] * 38.0**3 / (3.0 * rigid / 16)
        with pytest.raises(DescriptionError, match=f"tip would move by {across:.1f}"):
            predict(thin, X)

    def test_a_table_of_directions_counts_repeated_ones_once(self, omp40: Probe) -> None:
        """Within 1e-9; in the order in which they come first. The machine's normals are turned."""
        axis, rotation = (0.6, 0.0, 0.8), math.radians(17.0)
        turned = replace(omp40, orientation=Orientation(axis=axis, rotation=rotation))
        off = np.array([[4e-10, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        normals = np.vstack([N[[2, 0]], N + off, N[[1]]])
        some = predict(turned, normals / np.linalg.norm(normals, axis=1, keepdims=True))
        made = predicted_map(turned, some)
        assert isinstance(made.basis, TabulatedBasis)
        assert made.support.nodes == pytest.approx(N[[2, 0, 1]], abs=1e-9)
        assert made.coefficients == pytest.approx(predict(omp40, N[[2, 0, 1]]).pretravel)
        machine = N @ probe_rotation(axis, rotation).T
        assert made.pretravel(machine) == pytest.approx(predict(omp40, N).pretravel, abs=1e-12)
        assert np.asarray(made.covariance.matrix).tolist() == np.zeros((3, 3)).tolist()
        assert (made.tip_radius, made.u_tip_radius) == (omp40.tip.radius, omp40.tip.u_radius)
        assert made.provenance.origin is Origin.PREDICTED
        assert made.provenance.source == "predicted, model analytic"

    def test_with_friction_the_last_of_three_touches_counts(
        self, omp40: Probe, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """And of its seats the one with the smallest load; on steel where nothing is stated."""
        cycle = SimpleNamespace(
            trigger_force=RANDOM.uniform(size=(3, 3)),
            trigger_reactions=RANDOM.uniform(size=(3, 3, 6)),
        )
        asked: list[Any] = []

        def rubbed(*given: Any) -> tuple[Any, dict[str, Any]]:
            asked.append(given)
            return cycle, {"body": N}

        monkeypatch.setattr(design, "rubbed_trigger", rubbed)
        rubbing = replace(omp40, seats=replace(omp40.seats, friction=0.01))
        some = predict(rubbing, N, workpiece=material("aluminium"))
        predict(rubbing, N)
        assert some.force.tolist() == cycle.trigger_force[:, 2].tolist()
        assert some.reactions.tolist() == cycle.trigger_reactions[:, 2].tolist()
        assert some.seat.tolist() == np.argmin(some.reactions, axis=1).tolist()
        assert some.directions == pytest.approx(N)
        assert some.model == "analytic"
        assert [part for *_, part in asked] == [material("aluminium"), default_workpiece()]


def test_names_in_place_of_what_they_name() -> None:
    """A material by its name; a probe by its name is refused. Both were attribute errors."""
    probe, x = parse_probe(description_text("omp40-2")), [[1.0, 0.0, 0.0]]
    named = predict(probe, x, workpiece="aluminium").pretravel
    assert named == pytest.approx(predict(probe, x, workpiece=material("aluminium")).pretravel)
    with pytest.raises(PretravelError, match="a described probe is needed, not a str"):
        predict("omp40-2", x)  # type: ignore[arg-type]
