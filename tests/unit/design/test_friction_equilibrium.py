"""Equations of seats with friction, on a made-up mechanism in which no two numbers are equal.

Each equation is written out seat by seat; slopes are compared with differences of the residual.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.linalg

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import ConvergenceError, PretravelError
from pretravel.design.fem.condensation import ReducedModel
from pretravel.design.fem.interface_loads import SEATS, SPRING_FORCE, TANGENTIAL, TIP_FORCE
from pretravel.design.friction import friction_equilibrium
from pretravel.design.friction.friction_equilibrium import (
    SeatMechanism,
    SeatState,
    _Equations,
    _least_norm,
    _share,
    equilibrium,
    seat_mechanism,
)
from pretravel.prediction.beam import stylus_compliance
from pretravel.prediction.description import Probe
from pretravel.prediction.seats import seat_frame, seat_statics
from pretravel.six_seats.hertz import rod_on_ball_coefficient

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


@pytest.fixture
def step() -> tuple[_Equations, FloatArray]:
    """Equations of a step that starts at some state, and some attempt at their solution.

    Forces of some newtons, motions of a seat's indentation. Of the seats some stick, some slide,
    some are open and some pull: else the tests show less.
    """
    mechanism = made_up()
    scale = np.ones(25)
    scale[18:21], scale[21:24] = 1e-4, 5e-6
    first, second = (np.random.default_rng(seed).normal(size=(COUNT, 25)) for seed in (1, 2))
    x, start = first * scale, second * 0.5 * scale
    x[:, :6] = 3.0 * x[:, :6] + 4.0
    empty = _Equations(mechanism, mechanism.at_rest, np.zeros(COUNT))
    equations = _Equations(mechanism, empty.state(start), np.linspace(1e-4, 3e-4, COUNT))
    residual = equations.residual(x)
    pulls = x[:, :6] <= 0.0
    trial = np.linalg.norm(residual.trial.reshape(COUNT, 6, 2), axis=2)
    slides = (trial > FRICTION * x[:, :6]) & ~pulls
    open_seat = DEPTH - residual.moved[:, SEATS] < 0.0
    for what in (pulls, slides, ~slides & ~pulls, open_seat, ~open_seat):
        assert np.count_nonzero(what) >= 2
    return equations, x


def test_displacements_are_those_of_the_body_and_of_its_rigid_motion(
    step: tuple[_Equations, FloatArray],
) -> None:
    """Reciprocity: the displacement of a load is what all changes of force do at it, and the work
    of its resultant on the rigid motion."""
    equations, x = step
    mechanism, state = equations.mechanism, equations.state(x)
    spring, tip = np.full((COUNT, 1), PRELOAD), x[:, 24:] * mechanism.directions
    force = np.concatenate([x[:, :6], tip, spring, x[:, 6:18]], axis=1)
    assert mechanism.interface(state) == pytest.approx(force, rel=1e-14)
    bent = (force - mechanism.rest) @ mechanism.flexibility
    assert state.moved == pytest.approx(bent + x[:, 18:24] @ mechanism.resultants, rel=1e-9)
    along = np.sum(state.moved[:, TIP_FORCE] * mechanism.directions, axis=1)
    assert mechanism.deflection(state) == pytest.approx(along, rel=1e-12)
    assert mechanism.depth(state) == pytest.approx(DEPTH - state.moved[:, SEATS])


def test_residuals_are_the_laws_of_hertz_coulomb_and_newton(
    step: tuple[_Equations, FloatArray],
) -> None:
    """Each in parts of the preload, moments of the preload at the tip's lever, and the target in
    parts of the mean indentation at rest."""
    equations, x = step
    mechanism, state, before = equations.mechanism, equations.state(x), equations.before
    residual = equations.residual(x)
    lever = np.linalg.norm(np.asarray(mechanism.resultants)[3:, 6])  # of a force along x
    for row in range(COUNT):
        law = np.zeros(25)
        for seat in range(6):
            deep = max(DEPTH[seat] - state.moved[row, seat], 0.0)
            law[seat] = x[row, seat] - (deep / 2e-4) ** 1.5
            pair, place = slice(2 * seat, 2 * seat + 2), slice(6 + 2 * seat, 8 + 2 * seat)
            slid = (state.moved[row] - before.moved[row])[TANGENTIAL][pair]
            trial = before.tangential[row, pair] - mechanism.tangential_stiffness[seat] * slid
            assert residual.trial[row, pair] == pytest.approx(trial, rel=1e-9)
            most = FRICTION * max(x[row, seat], 0.0)
            law[place] = x[row, place] - min(1.0, most / float(np.hypot(*trial))) * trial
        wrench = mechanism.resultants @ mechanism.interface(state)[row]
        law[18:21], law[21:24] = wrench[:3], wrench[3:] / lever
        missed = mechanism.deflection(state)[row] - equations.target[row]
        law[24] = PRELOAD * missed / DEPTH.mean()
        assert residual.scaled[row] == pytest.approx(law / PRELOAD, rel=1e-9, abs=1e-12)


def test_slopes_are_those_of_the_residual(step: tuple[_Equations, FloatArray]) -> None:
    """Central differences by each unknown, in its scale: exact to the square of the step, and the
    slopes of the laws of Hertz and Coulomb, for all states of a seat."""
    equations, x = step
    # A displacement in parts of the mean indentation at rest, a turn of what it does at the tip.
    lever = float(np.linalg.norm(equations.mechanism.resultants[3:, 6]))
    scale = np.ones(25)
    scale[18:21], scale[21:24] = DEPTH.mean(), DEPTH.mean() / lever
    slopes = np.zeros((COUNT, 25, 25))
    for unknown, unit in enumerate(np.diag(1e-6 * scale)):
        ends = [equations.residual(x + sign * unit).scaled for sign in (1.0, -1.0)]
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


def test_the_mechanism_of_a_probe_is_assembled_by_hand(omp40: Probe) -> None:
    """Every column of forces and moments; a rigid body, a stylus that bends as a beam, and a mesh,
    of which the seats' contacts are softer by what the mesh does not resolve: tangentially by
    Mindlin, (2 - nu) / (2 (1 - nu)) of that across."""
    probe = replace(omp40, tripod=replace(omp40.tripod, rod_azimuths=(0.1, 2.3, 4.0)))
    statics, frame, d = seat_statics(probe), seat_frame(probe), made_up().directions
    reduced = ReducedModel(
        made_up().flexibility, {}, np.zeros((6, 22)), 3e-5, 8e-5, "rods", {},
        lambda: None,  # type: ignore[arg-type, return-value]
    )  # fmt: skip
    contacts, tip = frame.contacts(probe.tripod.rod_radius), np.array([0.0, 0.0, -probe.lever])
    loads = list(zip(frame.normals, frame.points, strict=True))
    loads += [(axis, tip) for axis in np.eye(3)] + [(np.array([0.0, 0.0, -1.0]), np.zeros(3))]
    for along, around, contact in zip(frame.along, frame.around, contacts, strict=True):
        loads += [(along, contact), (around, contact)]
    wrenches = np.array([np.concatenate([way, np.cross(place, way)]) for way, place in loads])
    modulus = probe.tripod.material.contact_modulus(probe.seats.material)
    c = rod_on_ball_coefficient(probe.tripod.rod_radius, probe.seats.ball_radius, modulus)
    nu = probe.tripod.material.poissons_ratio
    normal = 1.5 * statics.rest_reactions ** (1.0 / 3.0) / c  # dN/d(indentation), by Hertz
    beam = np.zeros((22, 22))
    beam[range(6, 9), range(6, 9)] = stylus_compliance(probe.stylus)
    across = np.array([5e-5] * 6 + [0.0] * 4 + 12 * [5e-5 * (2.0 - nu) / (2.0 - 2.0 * nu)])
    mesh = reduced.flexibility + np.diag(across)
    for body, flexibility in (("rigid", 0.0 * beam), ("analytic", beam), (reduced, mesh)):
        mechanism = seat_mechanism(probe, statics, d, 0.2, body)
        assert pytest.approx(wrenches, abs=1e-12) == mechanism.resultants.T
        assert mechanism.flexibility == pytest.approx(flexibility, rel=1e-12, abs=0)
        assert mechanism.coefficient == pytest.approx(c, rel=1e-12)
        assert mechanism.tangential_stiffness == pytest.approx(
            normal * 2.0 * (1.0 - nu) / (2.0 - nu), rel=1e-9
        )
        # At rest the seats carry the spring, and nothing rubs.
        assert mechanism.rest[SEATS] == pytest.approx(statics.rest_reactions, rel=1e-14)
        assert mechanism.rest[SPRING_FORCE] == probe.preload
        assert np.count_nonzero(mechanism.rest) == 7
        assert mechanism.friction == 0.2
        assert mechanism.directions is d
    with pytest.raises(PretravelError, match="the body of the probe is 'soft'"):
        seat_mechanism(probe, statics, d, 0.2, "soft")


def test_a_step_is_halved_until_it_reduces_the_residual() -> None:
    """Each direction by itself, up to the largest share that does; one that is solved takes the
    whole step; at most 12 halves. One part in 10,000 of the whole step is enough (Armijo)."""

    def share(most: list[float], merit: list[float]) -> list[float]:
        def residual(x: FloatArray) -> SimpleNamespace:
            """Half as large as before up to a share of minus x, else twice."""
            size = np.where(-x[:, 0] <= most, 0.5, 2.0)
            return SimpleNamespace(scaled=size[:, None] * [[0.6, 0.8]])

        step, equations = np.ones((len(most), 1)), SimpleNamespace(residual=residual)
        return _share(equations, 0.0 * step, step, np.array(merit)).tolist()  # type: ignore[arg-type]

    most, merit = [1.0, 0.6, 0.1, 0.5, 2.0**-9, 0.0], [1.0, 1.0, 1.0, 1e-11, 1.0, 1.0]
    assert share(most, merit) == [1.0, 0.5, 0.0625, 1.0, 2.0**-9, 2.0**-12]
    assert share([1.0, 1.0], [0.5 / (1.0 - 1.1e-4), 0.5 / (1.0 - 0.9e-4)]) == [1.0, 0.5]


@pytest.mark.parametrize("held", [True, False])
def test_steps_are_least_solutions(held: bool) -> None:
    """Regular and singular matrices side by side, against scipy's least squares one by one. With
    friction, motions that are hardly constrained, by 1e-13 of the others, are solved too, up to 100
    times the scale; beyond, and without friction, they are zero."""
    random = np.random.default_rng(8)
    matrix = random.normal(size=(6, 5, 5))
    matrix[1, :, 2] = 0.0  # nothing constrains this unknown
    matrix[3, 4] = matrix[3, 3]  # two equal equations: a line of solutions
    right = np.einsum("nij,nj->ni", matrix, random.normal(size=(6, 5)))
    expected = [scipy.linalg.lstsq(m, r)[0] for m, r in zip(matrix, right, strict=True)]
    matrix[4:], right[4:] = np.diag([1.0, 1.0, 1.0, 1.0, 1e-13]), 0.0
    right[4:, 4] = 1e-13 * np.array([-99.0, -101.0])
    expected[4:] = np.array([0.0, 0.0, 0.0, 0.0, -99.0 * held]), np.zeros(5)
    for some in ([0, 2], [0, 1, 2, 3], [1, 3], [4, 5]):
        found = _least_norm(matrix[some], right[some], held=held)
        for row, number in enumerate(some):
            assert found[row] == pytest.approx(expected[number], rel=1e-9, abs=1e-12)


def test_newtons_method_solves_each_direction_by_itself(
    omp40: Probe, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A state in which all laws hold; what is solved leaves the iteration, and near a solution
    each iteration doubles the digits: a dozen are enough from rest to open seats."""
    d = made_up().directions
    mechanism = seat_mechanism(omp40, seat_statics(omp40), d, 0.15, "analytic")
    rows, slopes = list[int](), _Equations.jacobian

    def counted(self: _Equations, x: FloatArray, residual: object) -> FloatArray:
        rows.append(len(x))
        return slopes(self, x, residual)  # type: ignore[arg-type]

    monkeypatch.setattr(_Equations, "jacobian", counted)
    target = np.array([0.0, 1e-5, 1e-3, 4e-3])
    state = equilibrium(mechanism, mechanism.at_rest, target)
    assert rows[0] == COUNT - 1  # the first is at its target
    assert rows == sorted(rows, reverse=True)
    assert 1 <= rows[-1] < rows[0]
    assert len(rows) <= 12
    assert np.any(state.normal < 1e-9)
    assert mechanism.deflection(state) == pytest.approx(target, abs=1e-14)
    assert mechanism.displacements(state) == pytest.approx(state.moved, abs=1e-15)
    equations = _Equations(mechanism, mechanism.at_rest, target)
    solved = equations.residual(_Equations(mechanism, state, target).start).scaled
    assert np.all(np.linalg.norm(solved, axis=1) < 1e-10)
    for row in range(COUNT):
        one = np.array([row])
        alone = equilibrium(mechanism.rows(one), mechanism.at_rest.rows(one), target[one])
        assert alone.normal[0] == pytest.approx(state.normal[row], abs=1e-8)


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
        assert equilibrium(mechanism, mechanism.at_rest, far).force[0] == 1024.0
        # Nor is there one behind a wall, in the second half of each step.
        for reach, wall, most in ((0.99 / 1024, np.inf, 11), (1.0, 0.99, 200)):
            calls = self.solver(monkeypatch, reach, wall)
            with pytest.raises(ConvergenceError, match=r"friction 0\.3 .*1\.0e-10.* 60 it"):
                equilibrium(mechanism, mechanism.at_rest, far)
            assert len(calls) <= most
