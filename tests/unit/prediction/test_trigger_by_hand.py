"""The event, the seats at rest and the quantities of a trigger: loops over made-up numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import DescriptionError, PretravelError
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.provenance import Origin
from pretravel.prediction import predict_with_friction
from pretravel.prediction.compliance.base import TIP_ON_PART, ComplianceModel, compliance_model
from pretravel.prediction.description import Moving, Probe
from pretravel.prediction.event import trigger_force, watched_loads
from pretravel.prediction.materials import Material, default_workpiece, material
from pretravel.prediction.predict import Trigger, predict, predicted_map
from pretravel.prediction.seats import seat_statics, statics_in_machine
from pretravel.prediction.six_seat_basis import SixSeatBasis
from pretravel.prediction.six_seat_slopes import six_seat_pretravel, six_seat_slopes
from pretravel.prediction.six_seats import PARAMETERS, six_seat_response

RANDOM = np.random.default_rng(8)
REST = np.array([2.0, 3.1, 1.7, 2.6, 3.3, 2.2])
UNIT = RANDOM.normal(size=(40, 6))
N = np.array([[0.6, 0.48, 0.64], [-0.8, 0.6, 0.0], [0.28, -0.96, 0.0]])


class TestEvent:
    @pytest.mark.parametrize("threshold", [0.0, 0.3])
    def test_the_first_seat_at_the_threshold(self, threshold: float) -> None:
        force, seat = trigger_force(REST, UNIT, threshold=threshold)
        for row, unit in enumerate(UNIT):
            reached = [(REST[s] - threshold) / -unit[s] if unit[s] < 0 else math.inf
                       for s in range(6)]  # fmt: skip
            assert force[row] == pytest.approx(min(reached))
            assert seat[row] == reached.index(min(reached))
        assert set(seat) == set(range(6))
        if threshold == 0.0:
            assert np.array_equal(trigger_force(REST, UNIT)[0], force)

    @pytest.mark.parametrize("threshold", [0.0, 0.3])
    def test_the_first_rod_at_the_threshold_and_its_weaker_seat(self, threshold: float) -> None:
        force, seat = trigger_force(REST, UNIT, "arm_lift", threshold)
        for row, unit in enumerate(UNIT):
            reached = []
            for rod in range(3):
                left, right = 2 * rod, 2 * rod + 1
                falls = -(unit[left] + unit[right])
                load = REST[left] + REST[right] - threshold
                reached.append(load / falls if falls > 0 else math.inf)
            assert force[row] == pytest.approx(min(reached))
            if math.isfinite(force[row]):
                rod = reached.index(min(reached))
                assert seat[row] == 2 * rod + int(unit[2 * rod + 1] < unit[2 * rod])
        assert set(seat) == set(range(6))

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

    def test_loads_of_rods_and_unknown_criteria(self) -> None:
        assert watched_loads(UNIT, "first_contact") is UNIT
        sums = np.column_stack([UNIT[:, 2 * rod] + UNIT[:, 2 * rod + 1] for rod in range(3)])
        assert watched_loads(UNIT, "arm_lift") == pytest.approx(sums)
        with pytest.raises(PretravelError, match="'lift' is not known; known are"):
            watched_loads(UNIT, "lift")


def test_reactions_grow_with_the_force(omp40: Probe) -> None:
    """Of each seat: at rest, and as many times what a newton changes as there are newtons."""
    statics = seat_statics(omp40)
    forces = np.array([0.2, 0.5, 0.7])
    for row, found in enumerate(statics.reactions(N, forces)):
        one = statics.unit_reactions(N[[row]])[0]
        push = (statics.normals * one[:, None]).sum(axis=0)
        assert push == pytest.approx(-N[row])
        assert found == pytest.approx(statics.rest_reactions + forces[row] * one)


class TestSeatsAtRest:
    @pytest.mark.parametrize("down", [None, [0.0, 0.0, -1.0], [0.48, -0.6, 0.64], [-1.0, 0.0, 0.0]])
    def test_spring_weight_and_reactions_balance(
        self, omp40: Probe, down: list[float] | None
    ) -> None:
        """Seat by seat, about the origin: mass 30 g at 7 mm above the plane of the rods."""
        heavy = replace(omp40, moving=Moving(mass=0.03, height=7.0))
        statics = seat_statics(heavy, down)
        force, moment = np.array([0.0, 0.0, -omp40.preload]), np.zeros(3)
        if down is not None:
            weight = 0.03 * 9.80665 * np.array(down)
            force, moment = force + weight, moment + np.cross([0.0, 0.0, 7.0], weight)
        for seat in range(6):
            push = statics.rest_reactions[seat] * statics.normals[seat]
            force, moment = force + push, moment + np.cross(statics.points[seat], push)
        assert force == pytest.approx(np.zeros(3), abs=1e-12)
        assert moment == pytest.approx(np.zeros(3), abs=1e-11)
        assert statics.tip.tolist() == [0.0, 0.0, -omp40.lever]

    def test_gravity_of_the_machine_is_turned_into_the_probe(self, omp40: Probe) -> None:
        """A probe along x: what pulls along the machine's -x pulls along the probe's -z."""
        lying = replace(
            omp40,
            orientation=replace(omp40.orientation, axis=(1.0, 0.0, 0.0)),
            moving=Moving(mass=0.03, height=7.0),
        )
        along = statics_in_machine(lying, [-1.0, 0.0, 0.0]).rest_reactions
        assert along == pytest.approx(seat_statics(lying, [0.0, 0.0, -1.0]).rest_reactions)
        assert statics_in_machine(lying).rest_reactions == pytest.approx(
            seat_statics(lying).rest_reactions
        )

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
        frame = seat_statics(replace(pulls, preload=100.0), down)
        load = np.array([0.0, 0.6 * 9.80665, -omp40.preload, 0.0, 0.0, 0.0])
        rest = np.linalg.solve(frame.wrenches, -load)
        assert rest.min() < 0.0 < rest.reshape(3, 2).sum(axis=1).min()
        with pytest.raises(DescriptionError, match="would never be seated"):
            seat_statics(pulls, down)


def _made_up(shares: tuple[str, ...]) -> Trigger:
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
        some = _made_up(("stem", "seats", TIP_ON_PART))
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

    def test_without_a_tip_or_with_it_alone(self) -> None:
        stiff = _made_up(("stem",))
        assert stiff.tip_approach.tolist() == [0.0] * 3
        assert stiff.pretravel == pytest.approx(np.sum(stiff.displacements["stem"] * N, axis=1))
        alone = _made_up((TIP_ON_PART,))
        assert alone.deflection.tolist() == np.zeros((3, 3)).tolist()
        assert alone.pretravel == pytest.approx(alone.tip_approach)

    def test_directions_that_never_trigger_are_counted(self, omp40: Probe) -> None:
        normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        with pytest.raises(PretravelError, match="never triggers in 2 of 4 directions"):
            predict(omp40, normals)
        with pytest.raises(PretravelError, match="never triggers in 1 of 1 directions"):
            predict(omp40, normals[1:2])

    def test_a_softer_part_gives_way_more(self, omp40: Probe) -> None:
        """Steel where nothing is stated."""
        steel, soft = predict(omp40, N), predict(omp40, N, workpiece=material("aluminium"))
        assert np.all(soft.tip_approach > 1.1 * steel.tip_approach)
        stated = predict(omp40, N, workpiece=default_workpiece())
        assert np.array_equal(stated.pretravel, steel.pretravel)

    def test_a_table_of_directions_counts_repeated_ones_once(self, omp40: Probe) -> None:
        """Within 1e-9; in the order in which they come first."""
        off = np.array([[4e-10, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        normals = np.vstack([N[[2, 0]], N + off, N[[1]]])
        some = predict(omp40, normals / np.linalg.norm(normals, axis=1, keepdims=True))
        made = predicted_map(omp40, some)
        assert isinstance(made.basis, TabulatedBasis)
        assert made.support.nodes == pytest.approx(N[[2, 0, 1]], abs=1e-9)
        assert made.coefficients == pytest.approx(predict(omp40, N[[2, 0, 1]]).pretravel)
        assert np.asarray(made.covariance.matrix).tolist() == np.zeros((3, 3)).tolist()
        assert (made.tip_radius, made.u_tip_radius) == (omp40.tip.radius, omp40.tip.u_radius)
        assert made.provenance.origin is Origin.PREDICTED
        assert made.provenance.source == "predicted, model analytic"

    def test_with_friction_the_last_of_three_touches_counts(
        self, omp40: Probe, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        @dataclass
        class _Cycle:
            trigger_force: FloatArray
            trigger_reactions: FloatArray

        cycle = _Cycle(RANDOM.uniform(size=(3, 3)), RANDOM.uniform(size=(3, 3, 6)))
        asked: list[Any] = []

        def rubbed(
            probe: Probe, directions: FloatArray, model: ComplianceModel, part: Material
        ) -> tuple[_Cycle, dict[str, FloatArray]]:
            asked.append((probe, directions, model, part))
            return cycle, {"body": N}

        monkeypatch.setattr(predict_with_friction, "rubbed_trigger", rubbed)
        rubbing = replace(omp40, seats=replace(omp40.seats, friction=0.01))
        some = predict(rubbing, N, workpiece=material("aluminium"))
        predict(rubbing, N)
        assert some.force.tolist() == cycle.trigger_force[:, 2].tolist()
        assert some.reactions.tolist() == cycle.trigger_reactions[:, 2].tolist()
        for row in range(3):
            loads = cycle.trigger_reactions[row, 2].tolist()
            assert some.seat[row] == loads.index(min(loads))
        assert some.directions == pytest.approx(N)
        assert some.model == compliance_model("analytic").name
        assert [part for *_, part in asked] == [material("aluminium"), default_workpiece()]
        with pytest.raises(PretravelError, match="friction at the seats and gravity"):
            predict(rubbing, N, gravity=[0.0, 0.0, -1.0])


class TestSixSeats:
    VALUES = np.array([p.prior for p in PARAMETERS]) + 0.002 * np.arange(18)

    @pytest.mark.filterwarnings("error")
    def test_a_direction_that_never_triggers_has_no_pretravel_and_no_warning(self) -> None:
        found, slopes = six_seat_pretravel(
            self.VALUES, np.array([[0.0, 0.0, -1.0], [0.0, 0.6, 0.8]])
        )
        assert np.isfinite(found).tolist() == [False, True]
        assert np.all(np.isfinite(slopes[1]))

    def test_a_part_is_flat_where_nothing_is_said(self) -> None:
        """Twice the approach of the tip: half of the difference is the approach itself."""
        cap = fibonacci_cap(9)
        response = six_seat_response(self.VALUES, 2.0)
        flat, slopes = six_seat_pretravel(self.VALUES, cap)
        assert flat == pytest.approx(response.pretravel(cap), abs=1e-11)
        soft, more = six_seat_pretravel(self.VALUES, cap, 2.0)
        assert soft - flat == pytest.approx(response.tip_approach(response.force(cap)[0]))
        assert np.array_equal(six_seat_slopes(self.VALUES, cap), slopes)
        assert np.array_equal(six_seat_slopes(self.VALUES, cap, 2.0), more)
        assert response.tip_radius == 2.0

    def test_numbers_of_a_basis_are_eighteen_and_its_own(self) -> None:
        for wrong in (self.VALUES[:17], np.append(self.VALUES, 0.0), self.VALUES[:, None]):
            with pytest.raises(PretravelError, match="has 18 parameters"):
                SixSeatBasis(wrong, 2.0)
        mine = self.VALUES.copy()
        basis = SixSeatBasis(mine, 2.0)
        mine[:] = 0.0
        assert np.array_equal(basis.values, self.VALUES)
        assert not basis.values.flags.writeable
        assert (basis.size, basis.terms.shape) == (23, (0, 2))

    def test_a_probe_whose_spring_presses_a_seat_out_is_refused_at_its_limit(self) -> None:
        """Straight beside the axis, the rods carry (1 + 2 x cos azimuth) / 3."""
        ideal = np.array([p.prior for p in PARAMETERS])
        spring = [p.name for p in PARAMETERS].index("spring_x")
        for x, held in ((-0.4999, True), (-0.5001, False), (0.9999, True), (1.0001, False)):
            values = np.where(np.arange(18) == spring, x, ideal)
            if held:
                assert six_seat_response(values, 2.0).rest_reactions.min() > 0.0
            else:
                with pytest.raises(PretravelError, match="do not hold the tripod"):
                    six_seat_response(values, 2.0)
