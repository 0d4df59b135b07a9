"""Equations of seats with friction, on a made-up mechanism in which no two numbers are equal.

Each equation is written out seat by seat; slopes are compared with differences of the residual.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
import scipy.linalg

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import ConvergenceError, PretravelError
from pretravel.prediction import friction_equilibrium
from pretravel.prediction.beam import stylus_compliance
from pretravel.prediction.description import Probe
from pretravel.prediction.fem.condensation import ReducedModel
from pretravel.prediction.fem.interface_loads import SEATS, SPRING_FORCE, TANGENTIAL, TIP_FORCE
from pretravel.prediction.friction_equilibrium import (
    SeatMechanism,
    SeatState,
    _Equations,
    _least_norm,
    _Residual,
    _share,
    equilibrium,
    seat_mechanism,
)
from pretravel.prediction.hertz import contact_modulus, rod_on_ball_coefficient
from pretravel.prediction.seat_frame import seat_frame
from pretravel.prediction.seats import seat_statics

COUNT = 4
PRELOAD = 5.0
FRICTION = 0.3
DEPTH = 2e-4 * np.cbrt(np.arange(1.0, 7.0) ** 2)  # by Hertz, of seats with 1 to 6 N


def made_up() -> SeatMechanism:
    """Any symmetric flexibility, any resultants: the equations are the same for all bodies."""
    random = np.random.default_rng(5)
    d = random.normal(size=(COUNT, 3))
    root = random.normal(size=(22, 22))
    rest = np.zeros(22)
    rest[SEATS], rest[SPRING_FORCE] = np.arange(1.0, 7.0), PRELOAD
    resultants = random.normal(size=(6, 22))
    resultants[3:] *= 20.0
    return SeatMechanism(
        directions=d / np.linalg.norm(d, axis=1, keepdims=True),
        flexibility=1e-6 * root @ root.T,
        resultants=resultants,
        rest=rest,
        coefficient=2e-4,
        tangential_stiffness=random.uniform(1e3, 8e3, 6),
        friction=FRICTION,
    )


def unknowns(scale: FloatArray, seed: int) -> FloatArray:
    """Forces of some newtons, with seats that pull; motions of a seat's indentation."""
    return np.asarray(np.random.default_rng(seed).normal(size=(COUNT, 25)) * scale)


def in_the_middle() -> tuple[_Equations, FloatArray]:
    """Equations of a step that starts at some state, and some attempt at their solution.

    Of the seats some stick, some slide, some are open and some pull.
    """
    mechanism = made_up()
    scale = np.ones(25)
    scale[18:21], scale[21:24] = 1e-4, 5e-6
    empty = _Equations(mechanism, mechanism.at_rest, np.zeros(COUNT))
    x = unknowns(scale, 1)
    x[:, :6] = 3.0 * x[:, :6] + 4.0
    start = unknowns(0.5 * scale, 2)
    equations = _Equations(mechanism, empty.state(start), np.linspace(1e-4, 3e-4, COUNT))
    return equations, x


def test_the_attempt_has_seats_in_every_state() -> None:
    """Open and closed, sticking and sliding, pulling: else the tests below show less."""
    equations, x = in_the_middle()
    residual = equations.residual(x)
    size = np.linalg.norm(residual.trial.reshape(COUNT, 6, 2), axis=2)
    pulls = x[:, :6] <= 0.0
    slides = (size > FRICTION * x[:, :6]) & ~pulls
    open_seat = DEPTH - residual.moved[:, SEATS] < 0.0
    for what in (pulls, slides, ~slides & ~pulls, open_seat, ~open_seat):
        assert np.count_nonzero(what) >= 2


def test_displacements_are_those_of_the_body_and_of_its_rigid_motion() -> None:
    """Reciprocity: the displacement of a load is what all changes of force do at it, and the work
    of its resultant on the rigid motion."""
    equations, x = in_the_middle()
    mechanism, state = equations.mechanism, equations.state(x)
    for row in range(COUNT):
        force = np.concatenate(
            [x[row, :6], x[row, 24] * mechanism.directions[row], [PRELOAD], x[row, 6:18]]
        )
        assert mechanism.interface(state)[row] == pytest.approx(force, rel=1e-14)
        for load in range(22):
            bent = mechanism.flexibility[load] @ (force - mechanism.rest)
            rigid = mechanism.resultants[:, load] @ x[row, 18:24]
            assert state.moved[row, load] == pytest.approx(bent + rigid, rel=1e-9)
        along = state.moved[row, TIP_FORCE] @ mechanism.directions[row]
        assert mechanism.deflection(state)[row] == pytest.approx(along, rel=1e-12)
        assert mechanism.depth(state)[row] == pytest.approx(DEPTH - state.moved[row, SEATS])


def test_before_the_first_cycle_only_the_spring_and_the_seats_act() -> None:
    mechanism = made_up()
    rest = mechanism.at_rest
    assert [getattr(rest, entry.name).shape for entry in fields(rest)] == [
        (COUNT, 6), (COUNT, 12), (COUNT, 6), (COUNT,), (COUNT, 22),
    ]  # fmt: skip
    assert mechanism.interface(rest) == pytest.approx(np.tile(mechanism.rest, (COUNT, 1)), abs=0)
    for values in (rest.tangential, rest.rigid, rest.force, rest.moved):
        assert not np.any(values)
    assert mechanism.depth(rest) == pytest.approx(np.tile(DEPTH, (COUNT, 1)), rel=1e-12)


def test_residuals_are_the_laws_of_hertz_coulomb_and_newton() -> None:
    """Each in parts of the preload, moments of the preload at the tip's lever, and the target in
    parts of the mean indentation at rest."""
    equations, x = in_the_middle()
    mechanism, state = equations.mechanism, equations.state(x)
    residual = equations.residual(x)
    lever = np.linalg.norm(np.asarray(mechanism.resultants)[3:, 6])  # of a force along x
    for row in range(COUNT):
        law = np.zeros(25)
        for seat in range(6):
            deep = max(DEPTH[seat] - state.moved[row, seat], 0.0)
            law[seat] = x[row, seat] - (deep / 2e-4) ** 1.5
            place = slice(6 + 2 * seat, 8 + 2 * seat)
            slid = (state.moved[row] - equations.before.moved[row])[TANGENTIAL][2 * seat :][:2]
            trial = (
                equations.before.tangential[row, 2 * seat :][:2]
                - mechanism.tangential_stiffness[seat] * slid
            )
            assert residual.trial[row, 2 * seat :][:2] == pytest.approx(trial, rel=1e-9)
            most = FRICTION * max(x[row, seat], 0.0)
            share = min(1.0, most / float(np.hypot(*trial)))
            law[place] = x[row, place] - share * trial
        wrench = mechanism.resultants @ mechanism.interface(state)[row]
        law[18:21], law[21:24] = wrench[:3], wrench[3:] / lever
        missed = mechanism.deflection(state)[row] - equations.target[row]
        law[24] = PRELOAD * missed / DEPTH.mean()
        assert residual.scaled[row] == pytest.approx(law / PRELOAD, rel=1e-9, abs=1e-12)
    assert residual.moved == pytest.approx(state.moved, rel=1e-14)


def test_slopes_are_those_of_the_residual() -> None:
    """Central differences by each unknown, in its scale: exact to the square of the step, and the
    slopes of the laws of Hertz and Coulomb, for all states of a seat."""
    equations, x = in_the_middle()
    # A displacement in parts of the mean indentation at rest, a turn of what it does at the tip.
    lever = float(np.linalg.norm(equations.mechanism.resultants[3:, 6]))
    scale = np.ones(25)
    scale[18:21], scale[21:24] = DEPTH.mean(), DEPTH.mean() / lever
    slopes = np.zeros((COUNT, 25, 25))
    for unknown in range(25):
        step = np.zeros(25)
        step[unknown] = 1e-6 * scale[unknown]
        ends = [equations.residual(x + sign * step).scaled for sign in (1.0, -1.0)]
        slopes[:, :, unknown] = (ends[0] - ends[1]) / 2e-6
    found = equations.jacobian(x, equations.residual(x))
    assert found == pytest.approx(slopes, rel=1e-6, abs=1e-7 * np.abs(slopes).max())
    assert equations.columns == pytest.approx(scale, rel=1e-12)


def test_a_seat_that_does_not_rub_has_slopes() -> None:
    """Without any tangential force no direction of sliding exists: the slopes stay finite, and the
    friction that a load would need is Mindlin's."""
    mechanism = made_up()
    rest = mechanism.at_rest
    equations = _Equations(mechanism, rest, np.zeros(COUNT))
    found = equations.jacobian(equations.start, equations.residual(equations.start))
    springs = np.repeat(mechanism.tangential_stiffness, 2)[:, None]
    expected = springs * mechanism.flexibility[TANGENTIAL, SEATS] / PRELOAD
    assert found[:, 6:18, :6] == pytest.approx(np.tile(expected, (COUNT, 1, 1)), rel=1e-9)
    bare = _Equations(mechanism, replace(rest, normal=np.zeros((COUNT, 6))), np.zeros(COUNT))
    assert np.all(np.isfinite(bare.jacobian(bare.start, bare.residual(bare.start))))


def test_states_of_some_directions_are_taken_and_put_back() -> None:
    equations, x = in_the_middle()
    state, other = equations.state(x), equations.state(x + 1.0)
    odd = np.array([False, True, False, True])
    mixed = state.replaced(odd, other.rows(odd))
    for entry in fields(SeatState):
        old, new, found = (getattr(s, entry.name) for s in (state, other, mixed))
        assert np.array_equal(found[odd], new[odd])
        assert np.array_equal(found[~odd], old[~odd])
        assert not np.shares_memory(found, old)
    mechanism = equations.mechanism
    assert np.array_equal(mechanism.rows(odd).directions, mechanism.directions[[1, 3]])
    assert np.array_equal(mechanism.rows(odd).flexibility, mechanism.flexibility)
    assert np.array_equal(_Equations(mechanism, state, x[:, 0]).start, x)


def test_the_mechanism_of_a_probe_is_assembled_by_hand(omp40: Probe) -> None:
    """Every column of forces and moments; a rigid body, a stylus that bends as a beam, and a mesh,
    of which the seats' contacts are softer by what the mesh does not resolve: tangentially by
    Mindlin, (2 - nu) / (2 (1 - nu)) of that across."""
    probe = replace(omp40, tripod=replace(omp40.tripod, rod_azimuths=(0.1, 2.3, 4.0)))
    statics, frame = seat_statics(probe), seat_frame(probe)
    directions = made_up().directions
    rigid = seat_mechanism(probe, statics, directions, 0.2, "rigid")
    bending = seat_mechanism(probe, statics, directions, 0.2, "analytic")
    reduced = ReducedModel(
        made_up().flexibility,
        {},
        np.zeros((6, 22)),
        3e-5,
        8e-5,
        "rods",
        {},
        lambda: None,  # type: ignore[arg-type, return-value]
    )
    meshed = seat_mechanism(probe, statics, directions, 0.2, reduced)
    contacts, tip = frame.contacts(probe.tripod.rod_radius), np.array([0.0, 0.0, -probe.lever])
    loads = [(frame.normals[seat], frame.points[seat]) for seat in range(6)]
    loads += [(axis, tip) for axis in np.eye(3)]
    loads += [(np.array([0.0, 0.0, -1.0]), np.zeros(3))]
    for seat in range(6):
        loads += [(way, contacts[seat]) for way in (frame.along[seat], frame.around[seat])]
    modulus = contact_modulus(probe.tripod.material, probe.seats.material)
    c = rod_on_ball_coefficient(probe.tripod.rod_radius, probe.seats.ball_radius, modulus)
    nu = probe.tripod.material.poissons_ratio
    normal = 1.5 * statics.rest_reactions ** (1.0 / 3.0) / c  # dN/d(indentation), by Hertz
    beam = np.zeros((22, 22))
    beam[range(6, 9), range(6, 9)] = stylus_compliance(probe.stylus)
    across = np.array([5e-5] * 6 + [0.0] * 4 + 12 * [5e-5 * (2.0 - nu) / (2.0 - 2.0 * nu)])
    mesh = reduced.flexibility + np.diag(across)
    bodies = ((rigid, np.zeros((22, 22))), (bending, beam), (meshed, mesh))
    for mechanism, body in bodies:
        for load, (way, place) in enumerate(loads):
            wrench = np.concatenate([way, np.cross(place, way)])
            assert mechanism.resultants[:, load] == pytest.approx(wrench, abs=1e-12)
        assert mechanism.flexibility == pytest.approx(body, rel=1e-12, abs=0)
        assert mechanism.coefficient == pytest.approx(c, rel=1e-12)
        assert mechanism.tangential_stiffness == pytest.approx(
            normal * 2.0 * (1.0 - nu) / (2.0 - nu), rel=1e-9
        )
        # At rest the seats carry the spring, and nothing rubs.
        assert mechanism.resultants @ mechanism.rest == pytest.approx(np.zeros(6), abs=1e-12)
        assert mechanism.rest[SEATS] == pytest.approx(statics.rest_reactions, rel=1e-14)
        assert mechanism.rest[SPRING_FORCE] == probe.preload
        assert np.count_nonzero(mechanism.rest) == 7
        assert mechanism.friction == 0.2
        assert mechanism.directions is directions
    with pytest.raises(PretravelError, match="the body of the probe is 'soft'"):
        seat_mechanism(probe, statics, directions, 0.2, "soft")


class Norms:
    """Made-up equations: only the size of the residual matters to a share of a step."""

    def __init__(self, most: FloatArray) -> None:
        self.most = most  # the largest share of a step that reduces each residual
        self.asked = 0

    def residual(self, x: FloatArray) -> _Residual:
        """x is minus the share: 0.5 as large as before up to the largest share, else 2 times."""
        self.asked += 1
        sizes = np.where(-x[:, 0] <= self.most, 0.5, 2.0)
        return _Residual(sizes[:, None] * [[0.6, 0.8]], x, x)


def test_a_step_is_halved_until_it_reduces_the_residual() -> None:
    """Each direction by itself; one that is solved takes the whole step; at most 12 halves."""
    most = np.array([1.0, 0.6, 0.1, 0.5, 2.0**-9, 0.0])
    norms = Norms(most)
    merit = np.array([1.0, 1.0, 1.0, 1e-11, 1.0, 1.0])
    share = _share(norms, np.zeros((6, 1)), np.ones((6, 1)), merit)  # type: ignore[arg-type]
    assert share == pytest.approx([1.0, 0.5, 0.0625, 1.0, 2.0**-9, 2.0**-12], rel=0, abs=0)
    assert norms.asked == 12
    # All reduce at once: one attempt. Armijo: one part in 10,000 of the whole step is enough.
    quick = Norms(np.ones(2))
    assert np.all(_share(quick, np.zeros((2, 1)), np.ones((2, 1)), np.ones(2)) == 1.0)  # type: ignore[arg-type]
    assert quick.asked == 1
    for merit, share in ((0.5 / (1.0 - 1.1e-4), 1.0), (0.5 / (1.0 - 0.9e-4), 0.5)):
        found = _share(Norms(np.ones(1)), np.zeros((1, 1)), np.ones((1, 1)), np.array([merit]))  # type: ignore[arg-type]
        assert found[0] == share


@pytest.mark.parametrize("held", [True, False])
def test_steps_are_least_solutions(held: bool) -> None:
    """Regular and singular matrices side by side, against scipy's least squares one by one."""
    random = np.random.default_rng(8)
    matrix = random.normal(size=(4, 5, 5))
    matrix[1, :, 2] = 0.0  # nothing constrains this unknown
    matrix[3, 4] = matrix[3, 3]  # two equal equations: a line of solutions
    right = np.einsum("nij,nj->ni", matrix, random.normal(size=(4, 5)))
    for some in ([0, 2], [0, 1, 2, 3], [1, 3]):
        found = _least_norm(matrix[some], right[some], held=held)
        for row, number in enumerate(some):
            least = scipy.linalg.lstsq(matrix[number], right[number])[0]
            assert found[row] == pytest.approx(least, rel=1e-9, abs=1e-12)


def test_a_plain_solution_is_used_where_it_is_sound() -> None:
    """With friction, motions that are hardly constrained, by 1e-13 of the others, are solved too,
    up to 100 times the scale; beyond, and where rounding is all that is left, they are zero.
    Directions side by side do not change each other."""
    weak = np.diag([1.0, 1.0, 1.0, 1.0, 1e-13])
    random = np.random.default_rng(4)
    left, right = (np.linalg.qr(random.normal(size=(5, 5)))[0] for _ in range(2))
    rounded = left @ weak @ right.T  # its weak motion is the last column of `right`
    matrices = np.stack([weak, weak, weak, weak, rounded])
    motions = np.array([10.0, 99.0, -101.0, -10.0, 50.0])
    asked = np.zeros((5, 5))
    asked[:4, 4], asked[3, 0] = 1e-13 * motions[:4], 1.0
    asked[4] = 1e-13 * motions[4] * left[:, 4]
    expected = np.zeros((5, 5))
    expected[[0, 1, 3], 4] = motions[[0, 1, 3]]
    expected[3, 0] = 1.0
    assert _least_norm(matrices, asked, held=True) == pytest.approx(expected, rel=1e-9, abs=1e-6)
    # Without friction the weak motion is that of a rod that nothing holds.
    expected[:, 4] = 0.0
    assert _least_norm(matrices, asked, held=False) == pytest.approx(expected, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("friction", [0.0, 0.15])
def test_plain_solutions_are_for_seats_that_rub(
    omp40: Probe, monkeypatch: pytest.MonkeyPatch, friction: float
) -> None:
    """Without friction nothing holds an unloaded rod, and only the least solution is sound."""
    asked, solve = list[bool](), _least_norm

    def counted(matrix: FloatArray, right: FloatArray, *, held: bool) -> FloatArray:
        asked.append(held)
        return solve(matrix, right, held=held)

    monkeypatch.setattr(friction_equilibrium, "_least_norm", counted)
    d = made_up().directions
    mechanism = seat_mechanism(omp40, seat_statics(omp40), d, friction, "rigid")
    equilibrium(mechanism, mechanism.at_rest, np.full(COUNT, 1e-4))
    assert set(asked) == {friction > 0.0}


def test_newtons_method_solves_each_direction_by_itself(
    omp40: Probe, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A state in which all laws hold; what is solved leaves the iteration, and near a solution
    each iteration doubles the digits: a dozen are enough from rest to open seats."""
    d = made_up().directions
    mechanism = seat_mechanism(omp40, seat_statics(omp40), d, 0.15, "analytic")
    rows, slopes = list[int](), _Equations.jacobian

    def counted(self: _Equations, x: FloatArray, residual: _Residual) -> FloatArray:
        rows.append(len(x))
        return slopes(self, x, residual)

    monkeypatch.setattr(_Equations, "jacobian", counted)
    target = np.array([0.0, 1e-5, 1e-3, 4e-3])
    state, merit = friction_equilibrium._newton(mechanism, mechanism.at_rest, target)
    assert rows[0] == COUNT - 1  # the first is at its target
    assert rows == sorted(rows, reverse=True)
    assert 1 <= rows[-1] < rows[0]
    assert len(rows) <= 12
    assert np.any(state.normal < 1e-9)
    assert mechanism.deflection(state) == pytest.approx(target, abs=1e-14)
    assert mechanism.displacements(state) == pytest.approx(state.moved, abs=1e-15)
    equations = _Equations(mechanism, mechanism.at_rest, target)
    solved = np.linalg.norm(equations.residual(_unknowns(state)).scaled, axis=1)
    assert np.all(solved < 1e-10)
    assert merit == pytest.approx(solved, abs=1e-13)
    for row in range(COUNT):
        one = np.array([row])
        alone, _ = friction_equilibrium._newton(
            mechanism.rows(one), mechanism.at_rest.rows(one), target[one]
        )
        assert alone.normal[0] == pytest.approx(state.normal[row], abs=1e-8)


def _unknowns(state: SeatState) -> FloatArray:
    parts = [state.normal, state.tangential, state.rigid, state.force[:, None]]
    return np.concatenate(parts, axis=1)


class TestHalvedSteps:
    """A made-up solver that reaches only targets near the state before, in each direction."""

    def solver(
        self, monkeypatch: pytest.MonkeyPatch, reach: float, wall: float = np.inf
    ) -> list[FloatArray]:
        calls: list[FloatArray] = []

        def newton(
            mechanism: SeatMechanism, before: SeatState, target: FloatArray
        ) -> tuple[SeatState, FloatArray]:
            step = target - mechanism.deflection(before)
            calls.append(np.stack([target - step, target], axis=1))
            moved = np.zeros((len(target), 22))
            moved[:, TIP_FORCE] = target[:, None] * mechanism.directions
            # Above the tolerance of 1e-10 it is no equilibrium, and so it is at the tolerance.
            solved = (np.abs(step) <= reach) & (target < wall)
            merit = np.where(solved, 0.99e-10, 1e-10)
            return replace(before, moved=moved, force=before.force + 1.0), merit

        monkeypatch.setattr(friction_equilibrium, "_newton", newton)
        return calls

    def test_only_where_newtons_method_fails(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """The steps of one direction follow each other; in the others one step is enough."""
        mechanism = made_up()
        calls = self.solver(monkeypatch, 0.3)
        target = np.array([0.2, 1.0, 0.3, 0.5])
        state = equilibrium(mechanism, mechanism.at_rest, target)
        assert mechanism.deflection(state) == pytest.approx(target, rel=1e-12)
        assert state.force == pytest.approx([1.0, 4.0, 1.0, 2.0])  # a step for each that counts
        steps = [step for call in calls for step in call if 0.0 < step[1] - step[0] <= 0.3]
        for step in ([0.0, 0.25], [0.25, 0.5], [0.5, 0.75], [0.75, 1.0]):
            assert any(np.allclose(step, taken, atol=1e-12) for taken in steps)

    def test_at_most_ten_times(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Ten halvings reach 1/1024 of a step; less than that is no equilibrium."""
        mechanism = made_up()
        self.solver(monkeypatch, 1.01 / 1024)
        far = np.array([1.0, 0.0, 0.0, 0.0])
        state = equilibrium(mechanism, mechanism.at_rest, far)
        assert state.force[0] == 1024.0
        calls = self.solver(monkeypatch, 0.99 / 1024)
        with pytest.raises(ConvergenceError, match=r"friction 0\.3 found no .*1\.0e-10.* 60 it"):
            equilibrium(mechanism, mechanism.at_rest, far)
        assert len(calls) == 11
        # Nor is there one behind a wall, in the second half of each step.
        calls = self.solver(monkeypatch, 1.0, wall=0.99)
        with pytest.raises(ConvergenceError):
            equilibrium(mechanism, mechanism.at_rest, far)
        assert len(calls) < 200
