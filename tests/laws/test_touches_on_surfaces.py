"""A touch on a surface is tangent and triggered, in every representation of the surface."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles, unit
from pretravel.base.errors import PretravelError
from pretravel.base.frames import parse_placement
from pretravel.design.probing.simulation import PartSetup, simulate, simulate_some
from pretravel.design.probing.slide_one_normal import _golden_section
from pretravel.design.probing.slides import SlideSettings, slide
from pretravel.design.probing.surface_touches import SurfaceTouches, TouchStatus
from pretravel.design.probing.tip import LateralTip, MeasuredTip, PredictedTip, predicted_tip
from pretravel.design.probing.touching import touch
from pretravel.measurement.compensation import apply
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.materials import material
from pretravel.prediction.response import probe_response, response_map
from pretravel.prediction.seats import seat_statics
from pretravel.prediction.trigger import predict, predicted_map
from pretravel.six_seats.hertz import curved_part_factor
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.local_geometry import Surface
from pretravel.surface.parametric import Convex, FunctionSurface
from pretravel.surface.shapes import Ellipsoid, Plane, Reversed, Sphere
from pretravel.surface.shapes_of_revolution import Cone, Cylinder, Torus
from pretravel.touches import Touches
from pretravel.touches.targets import Targets
from tests.support.example_maps import lobes
from tests.support.examples import EXAMPLES


@cache
def _tip(name: str = "omp40-2", model: str = "analytic") -> PredictedTip:
    return predicted_tip(load_probe(name), model)


@cache
def _part() -> Part:
    return read_step_part(EXAMPLES / "part.step")


def _spread(surface: Surface, u: tuple[float, float], v: tuple[float, float], n: int) -> Targets:
    rng = np.random.default_rng(0)
    local = surface.local(np.column_stack([rng.uniform(*u, n), rng.uniform(*v, n)]))
    up = local.normal[:, 2] > 0.05
    return Targets(local.point[up], local.normal[up])


CASES: dict[str, tuple[Surface, tuple[float, float], tuple[float, float]]] = {
    "plane": (Plane([1, 2, 3], from_angles(0.7, 0.4)[0]), (-5, 5), (-5, 5)),
    "sphere": (Sphere([1, 2, 3], 12.5), (0, 6.28), (0, 1.5)),
    "small sphere": (Sphere([1, 2, 3], 2.0), (0, 6.28), (0, 1.5)),
    "cylinder": (
        Cylinder([1, 2, 3], 8.0, np.eye(3)[[1, 2, 0]]), (0, 6.28), (-5, 5)
    ),
    "cone": (Cone([0, 0, 0], 8.0, -0.5), (0, 6.28), (-5, 5)),
    "torus": (Torus([0, 0, 0], 20.0, 5.0), (0, 6.28), (0, 3.14)),
    "ellipsoid": (Ellipsoid([0, 0, 0], [10, 8, 6]), (0, 6.28), (0, 1.5)),
    "cup": (Reversed(Sphere([0, 0, 0], 12.5)), (0, 6.28), (1.7, 3.1)),
    "convex": (Convex(), (-0.8, 0.8), (-0.8, 0.8)),
    "function": (
        FunctionSurface(lambda u, v: (u, v, 0.02 * u * u - 0.03 * u * v), (-9, 9), (-9, 9)),
        (-7, 7), (-7, 7),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("model", ["shen", "analytic"])
def test_tangent_and_triggered(name: str, model: str) -> None:
    """The definition, term by term: C = P + deflection is the ball's radius, less its
    compression, above the contact; the force there is the trigger force along the normal."""
    surface, u, v = CASES[name]
    targets = _spread(surface, u, v, 80)
    tip = _tip(model=model)
    done = touch(tip, surface, targets)
    assert done.converged.all()
    assert done.residual.max() < 1e-9
    assert np.abs(done.trigger_residual).max() < 1e-9
    spindle = targets.points + 3.0 * targets.normals + done.travel[:, None] * targets.approaches
    center = spindle + done.deflection
    trigger = predict(load_probe("omp40-2"), done.normal, model)
    assert np.allclose(done.force, trigger.force, rtol=1e-12)
    assert np.abs(done.deflection - trigger.deflection).max() < 1e-10
    bends = surface.local(surface.nearest(done.first_point)).principal_curvatures
    height = 3.0 - trigger.tip_approach * curved_part_factor(3.0, bends)
    assert np.abs(center - done.point - height[:, None] * done.normal).max() < 2e-9
    # On the surface, with its normal there.
    foot = surface.local(surface.nearest(done.point))
    assert np.abs(foot.point - done.point).max() < 1e-9
    assert np.abs(foot.normal - done.normal).max() < 1e-9


@pytest.mark.parametrize("model", ["shen", "analytic"])
def test_on_a_plane_the_travel_is_the_predicted_pretravel(model: str) -> None:
    n = fibonacci_cap(40, 1.5)
    expected = predict(load_probe("omp40-2"), n, model).pretravel
    for row, normal in enumerate(n):
        done = touch(_tip(model=model), Plane([0, 0, 0], normal), Targets(0.0 * n[:1], n[[row]]))
        assert done.pretravel[0] == pytest.approx(expected[row], abs=1e-12)


def test_oblique_on_a_plane() -> None:
    """On a plane the normal is constant: the travel is pretravel / |a·n| for any approach."""
    rng = np.random.default_rng(4)
    n = from_angles(0.8, 0.3)
    a = unit(-n + 0.6 * rng.normal(size=(30, 3)))
    a = a[(a @ n[0]) < -0.3]
    targets = Targets(np.zeros_like(a), np.repeat(n, len(a), axis=0), a)
    done = touch(_tip(), Plane([0, 0, 0], n[0]), targets)
    expected = predict(load_probe("omp40-2"), n).pretravel[0]
    assert done.pretravel == pytest.approx(expected / -(a @ n[0]), rel=1e-9)


def test_sphere_against_a_separate_fixed_point_iteration() -> None:
    """|C - c| = R + r - approach with the normal along C - c, solved by a separate iteration."""
    probe, n = load_probe("omp40-2-100mm"), fibonacci_cap(60, 1.5)
    done = touch(predicted_tip(probe), Sphere([0, 0, 0], 4.0), Targets(4.0 * n, n))
    factor = (1.0 + 3.0 / 4.0) ** (1.0 / 3.0)  # Hertz, 1/R = 1/3 + 1/4 against 1/3
    travel, normal = np.zeros(len(n)), n
    for _ in range(60):
        trigger = predict(probe, normal)
        reach = 7.0 - factor * trigger.tip_approach
        # |7 n - s n + d|² = reach² for s, the smaller root.
        arm = 7.0 * n + trigger.deflection
        along = np.sum(arm * n, axis=1)
        travel = along - np.sqrt(along**2 - np.sum(arm**2, axis=1) + reach**2)
        center = arm - travel[:, None] * n
        normal = center / np.linalg.norm(center, axis=1, keepdims=True)
    assert done.pretravel == pytest.approx(travel, abs=1e-11)


class TestSameSurfaceOtherwise:
    """Analytic shape, STEP, spline and function agree to 1e-8 mm."""

    def _agree(self, first: Any, second: Any, targets: Targets) -> None:
        one, other = (touch(_tip(), surface, targets) for surface in (first, second))
        assert one.converged.all()
        assert other.converged.all()
        assert np.abs(one.travel - other.travel).max() < 1e-8
        assert np.abs(one.point - other.point).max() < 1e-8
        assert np.abs(one.normal - other.normal).max() < 1e-8

    @pytest.mark.parametrize("name", ["sphere", "cylinder", "cone", "torus"])
    def test_step(self, name: str, tmp_path: Path) -> None:
        from netgen.occ import Axes, Axis, Pnt, Vec, WorkPlane, X, Z
        from netgen.occ import Cylinder as Rod
        from netgen.occ import Sphere as Ball

        up = WorkPlane(Axes((0, 0, 0), Vec(0, -1, 0), X))  # its second axis is z
        solid, analytic, u, v = {
            "sphere": (Ball(Pnt(1, 2, 3), 12.5), Sphere([1, 2, 3], 12.5), (0, 6.28), (0.0, 1.5)),
            "cylinder": (
                Rod(Pnt(-20, 2, 3), X, 8, 40), Cylinder([0, 2, 3], 8.0, np.eye(3)[[1, 2, 0]]),
                (0, 6.28), (-9, 9),
            ),
            "cone": (
                up.MoveTo(0, 0).LineTo(20, 0).LineTo(10, 15).LineTo(0, 15).Close().Face()
                .Revolve(Axis((0, 0, 0), Z), 360),
                Cone([0, 0, 0], 20.0, -math.atan(10 / 15)), (0, 6.28), (4, 14),
            ),
            "torus": (
                up.MoveTo(20, 0).Circle(5).Face().Revolve(Axis((0, 0, 0), Z), 360),
                Torus([0, 0, 0], 20.0, 5.0), (0, 6.28), (0.1, 3.0),
            ),
        }[name]  # fmt: skip
        file = tmp_path / "made.step"
        solid.WriteStep(str(file))
        targets = _spread(analytic, u, v, 200)
        if name == "sphere":  # its pole, and its seam
            extra = np.array([[0, 0, 1.0], [1, 0, 0], [math.sqrt(0.5), 0, math.sqrt(0.5)]])
            targets = Targets(
                np.concatenate([targets.points, [1, 2, 3] + 12.5 * extra]),
                np.concatenate([targets.normals, extra]),
            )
        self._agree(analytic, read_step_part(file), targets)

    def test_function(self) -> None:
        ball = FunctionSurface(
            lambda u, v: (12.5 * np.cos(u) * np.sin(v), 12.5 * np.sin(u) * np.sin(v),
                          12.5 * np.cos(v)),
            (0.0, 2.0 * math.pi), (0.05, 1.6), outwards=-1,
        )  # fmt: skip
        targets = _spread(ball, (0.3, 6.0), (0.2, 1.4), 60)
        self._agree(Sphere([0, 0, 0], 12.5), ball, targets)

    def test_turned_parameters(self) -> None:
        """The convex surface with u and v turned by 30° and stretched."""
        c, s = math.cos(0.5), math.sin(0.5)
        plain = Convex(turn=0.0)
        turned = FunctionSurface(
            lambda u, v: (20.0 * (c * u - s * 2 * v), 20.0 * (s * u + c * 2 * v),
                          -10.0 * (u * u + 4 * v * v)),
            (-0.9, 0.9), (-0.45, 0.45),
        )  # fmt: skip
        targets = _spread(plain, (-0.5, 0.5), (-0.5, 0.5), 60)
        self._agree(plain, turned, targets)


def test_turning_part_and_probe_together_changes_nothing() -> None:
    surface, u, v = CASES["ellipsoid"]
    targets = _spread(surface, u, v, 40)
    place = parse_placement("10,-20,30,20,-15,40")
    tip = _tip()
    before = touch(tip, surface, targets)
    from pretravel.surface.swept import Placed

    there = Targets(
        place.points(targets.points),
        place.vectors(targets.normals),
        place.vectors(np.asarray(targets.approaches)),
    )
    after = touch(tip.turned(place.rotation), Placed(surface, place.rotation, place.shift), there)
    assert np.abs(before.travel - after.travel).max() < 1e-11
    assert np.abs(place.points(before.point) - after.point).max() < 1e-10


def test_a_tip_with_a_map_turns_with_the_probe() -> None:
    """Of three lobes of 1 mm: displacements of the turned tip are turned displacements."""
    three = MeasuredTip(lobes(3))
    directions = from_angles(1.2, np.linspace(0.0, 6.0, 12))
    rotation = parse_placement("0,0,0,20,-15,40").rotation
    before = three.state(directions).deflection
    after = three.turned(rotation).state(directions @ rotation.T).deflection
    assert np.ptp(np.linalg.norm(before, axis=1)) > 1.0
    assert np.abs(after - before @ rotation.T).max() < 1e-12


def test_placing_the_part_is_turning_the_probe_the_other_way() -> None:
    probe = load_probe("omp40-2")
    surface, u, v = CASES["sphere"]
    targets = _spread(surface, u, v, 20)
    turned_part = simulate_some(
        probe, surface, targets, setup=PartSetup(placement=parse_placement("0,0,0,0,0,25"))
    ).touches
    other = replace(probe, orientation=replace(probe.orientation, rotation=-math.radians(25.0)))
    turned_probe = simulate(other, surface, targets)
    assert turned_part is not None
    assert np.abs(turned_part.positions - turned_probe.positions).max() < 1e-11


class TestResponse:
    def test_with_weight_and_arm_lift(self) -> None:
        probe = load_probe("omp40-2")
        probe = replace(
            probe, criterion="arm_lift", threshold=0.1, moving=replace(probe.moving, mass=0.02)
        )
        n, down = fibonacci_cap(100), [0.0, 0.6, -0.8]
        response = probe_response(probe, gravity=down)
        expected = predict(probe, n, gravity=down)
        assert np.allclose(response.force(n)[0], expected.force, rtol=1e-12)
        assert np.abs(response.excess(n, expected.force)).max() < 1e-12
        assert np.abs(response.pretravel(n) - expected.pretravel).max() < 1e-11


class TestFriction:
    N = fibonacci_cap(50, 1.45)
    BALL = Sphere([0, 0, 0], 12.5)

    def _touch(self, friction: float, model: str = "analytic") -> SurfaceTouches:
        done = touch(
            _tip(model=model), self.BALL, Targets(12.5 * self.N, self.N), friction=friction
        )
        assert done.converged.all()
        return done

    def test_none_is_the_frictionless_touch(self) -> None:
        free, little = self._touch(0.0), self._touch(1e-9)
        assert np.abs(free.pretravel - little.pretravel).max() < 1e-9

    @pytest.mark.parametrize("friction", [0.05, 0.2, 0.6])
    def test_the_force_never_leaves_its_cone_and_opposes_the_slide(self, friction: float) -> None:
        done = self._touch(friction)
        along = np.sum(done.force_direction * done.normal, axis=1)
        pull = done.force_direction - along[:, None] * done.normal
        ratio = np.linalg.norm(pull, axis=1) / along
        assert ratio.max() <= friction * (1.0 + 1e-9)
        way = done.point + 3.0 * done.normal - (done.first_point + 3.0 * done.first_normal)
        way = way - np.sum(way * done.normal, axis=1)[:, None] * done.normal
        assert np.all(np.sum(pull * way, axis=1) <= 0.0)
        # Touches that slip, beyond the elastic shear of the contact, are at the edge of the cone.
        slipping = np.linalg.norm(way, axis=1) > friction * 1.3 * 0.0008
        assert slipping.sum() > 5
        assert ratio[slipping] == pytest.approx(friction, rel=1e-9)

    def test_on_an_inclined_plane_slip_is_the_force_turned_by_the_friction_angle(self) -> None:
        """A symmetric slide in a plane: the result is that of the model for a force at atan mu."""
        normal = from_angles(1.0, 0.0)
        done = touch(
            _tip(model="shen"),
            Plane([0, 0, 0], normal[0]),
            Targets(np.zeros((1, 3)), normal),
            friction=0.15,
        )
        turned = from_angles(1.0 - math.atan(0.15), 0.0)
        expected = predict(load_probe("omp40-2"), turned, "shen")
        assert done.force[0] == pytest.approx(expected.force[0], rel=1e-9)
        along = float(np.sum(expected.deflection * normal))
        assert done.pretravel[0] == pytest.approx(along, rel=1e-9)

    def test_a_tip_that_sticks_stays(self) -> None:
        """The tip's centre moves along the surface by no more than the contact shears: with
        Mindlin's stiffness 1.5 tan(force angle) * 1.21 * approach."""
        done = self._touch(math.inf)
        slide = np.linalg.norm(done.point - done.first_point, axis=1)
        assert slide.max() < 1e-3
        free = self._touch(0.0)
        assert np.median(slide) < 0.15 * np.median(free.slide)
        # A large coefficient gives the same, if the tip does not slip.
        assert np.abs(self._touch(200.0).pretravel - done.pretravel).max() < 1e-4

    def test_a_map_has_no_forces_for_friction(self) -> None:
        probe, n = load_probe("omp40-2"), fibonacci_cap(200)
        table = predicted_map(probe, predict(probe, n))
        with pytest.raises(PretravelError, match="a map contains no forces"):
            touch(MeasuredTip(table), self.BALL, Targets(12.5 * n, n), friction=0.1)


class TestStepByStep:
    """With smaller steps the thesis's method converges to the touch without steps, at first
    order, because the direction of the force lags by one step. The trigger is mid-step."""

    CASES = {  # noqa: RUF012
        "plane": (lambda: Plane([0, 0, 0], from_angles(0.7, 0.3)[0]), (0.0, 0.0)),
        "convex": (Convex, (0.5, 0.5)),
        "ellipsoid": (lambda: Ellipsoid([0, 0, 0], [10, 10, 6]), (0.3, math.radians(40.0))),
        "STEP part": (lambda: _part().faces[0], (7.15, 10.5)),
    }

    @pytest.mark.parametrize("kinematics", ["lateral", "full"])
    @pytest.mark.parametrize("name", CASES)
    def test_converges(self, name: str, kinematics: str) -> None:
        make, at = self.CASES[name]
        # Rigid seats, because elastic seats (N^(2/3)) accelerate the slide where one opens.
        surface, tip = make(), _tip("omp40-2-thesis-100mm")
        local = surface.local(np.array([at]))
        used = LateralTip(tip) if kinematics == "lateral" else tip
        at_once = touch(used, surface, Targets(local.point, local.normal)).pretravel[0]
        errors = []
        for count in (4, 8, 16, 32):
            step = at_once / (count - 0.5)
            settings = SlideSettings(step=step, steps=count, kinematics=kinematics)
            history = slide(tip, surface, at, settings)
            assert history.triggered.tolist() == [False] * (count - 1) + [True]
            errors.append(history.trigger_feed - at_once)
        # With 32 steps the error is a nanometre on every surface.
        assert abs(errors[-1]) < 1e-6
        if name == "plane":  # no lag: the normal never turns
            assert np.abs(errors).max() < 1e-12
        else:
            rates = np.log2(np.abs(np.array(errors[:-1]) / np.array(errors[1:])))
            assert rates == pytest.approx(1.0, abs=0.15)

    @pytest.mark.long
    def test_seats_that_give_slow_the_convergence(self) -> None:
        """Near the trigger an opening seat deforms as N^(2/3). Over the last step h the tip slides
        as h^(2/3), and the error has the same order when this slide is its largest part."""
        tip, face, at = _tip("omp40-2-100mm"), _part().faces[0], (7.15, 10.5)
        local = face.local(np.array([at]))
        at_once = touch(tip, face, Targets(local.point, local.normal)).pretravel[0]
        errors = [
            slide(
                tip, face, at, SlideSettings(step=at_once / (n - 0.5), steps=n, kinematics="full")
            ).trigger_feed - at_once
            for n in (64, 128, 256)
        ]  # fmt: skip
        assert abs(errors[-1]) < 2e-8
        rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
        assert rates == pytest.approx(2.0 / 3.0, abs=0.12)

    def test_history_fits_together(self) -> None:
        tip, steel = _tip("omp40-2-100mm"), material("steel")
        ball = load_probe("omp40-2-100mm").tip.material
        for kinematics, surface in (
            ("lateral", Ellipsoid([0, 0, 0], [10, 10, 6])),
            ("full", Sphere([0, 0, 0], 10.0)),
        ):
            h = slide(tip, surface, (0.3, 0.7), SlideSettings(2e-4, 60, kinematics=kinematics))
            before = ~h.triggered
            assert 10 < before.sum() < 60
            assert np.allclose(np.linalg.norm(h.center - h.spindle, axis=1), h.deflection)
            gap = np.linalg.norm(h.center - h.contact, axis=1)
            if kinematics == "lateral":
                assert np.abs(gap - 3.0).max() < 1e-9
            else:  # Hertz by hand: two balls of 3 and 10 mm under the force of the step
                stiff = [(1 - m.poissons_ratio**2) / m.youngs_modulus for m in (ball, steel)]
                modulus, radius = 1.0 / sum(stiff), 1.0 / (1.0 / 3.0 + 1.0 / 10.0)
                pressed = np.cbrt(9.0 * h.force[before] ** 2 / (16.0 * modulus**2 * radius))
                assert np.abs(3.0 - gap[before] - pressed).max() < 1e-9
                assert pressed.max() > 1e-4
            assert np.all(np.diff(h.force[before]) > 0.0)
            assert np.all(h.reactions[before].min(axis=1) > 0.0)
            assert np.all(np.isnan(h.force[~before]))
            # Equilibrium, with the force along the normal of the step before.
            start = surface.local(np.array([[0.3, 0.7]])).normal
            along = np.concatenate([start, h.normal[:-1]])[before]
            statics = seat_statics(load_probe("omp40-2-100mm"))
            expected = statics.reactions(along, h.force[before])
            assert np.abs(h.reactions[before] - expected).max() < 1e-12
            # The smallest reactions decrease towards the trigger.
            assert h.reactions[before][-1].min() < 0.2 * h.reactions[before][0].min()

    @pytest.mark.parametrize("search", ["steps", "golden"])
    @pytest.mark.parametrize("process", ["vertical", "inclined"])
    def test_the_thesis_processes_find_the_event(self, process: str, search: str) -> None:
        """Vertical raises the deflection, inclined the force; both end at the force of statics."""
        normal = from_angles(math.radians(90.0 if process == "vertical" else 50.0), 0.4)
        tip = _tip()
        event = LateralTip(tip).state(normal)
        goal = np.linalg.norm(event.deflection) if process == "vertical" else event.force[0]
        step = 1e-3 if process == "vertical" else 0.05
        steps = 60 if search == "steps" else 120
        h = slide(
            tip, Plane([0, 0, 0], normal[0]), (0.0, 0.0),
            SlideSettings(step, steps, process=process, search=search),
        )  # fmt: skip
        expected = float(np.sum(event.deflection * normal))
        tolerance = 1e-12 if search == "steps" else 1e-8
        assert h.trigger_feed == pytest.approx(expected, abs=tolerance)
        first = int(np.argmax(h.triggered)) if search == "steps" else None
        if first is not None:
            assert first + 1 == math.ceil(goal / step)
        else:  # every one or two trials reduce the interval to 0.618 of its length
            assert len(h) < 100

    def test_on_a_floor_only_all_that_gives_can_give(self) -> None:
        floor = Plane([0, 0, 0], [0, 0, 1])
        with pytest.raises(PretravelError, match="perpendicular to the probe axis"):
            slide(_tip(), floor, (0.0, 0.0))
        h = slide(_tip(), floor, (0.0, 0.0), SlideSettings(1e-4, 20, kinematics="full"))
        expected = predict(load_probe("omp40-2"), [[0.0, 0.0, 1.0]]).pretravel[0]
        assert h.trigger_feed == pytest.approx(expected, abs=1e-11)


class TestThereAndBack:
    """Touches are simulated, then compensated with the nominal surface."""

    @pytest.mark.parametrize("model", ["shen", "analytic"])
    def test_the_step_part_without_noise(self, model: str) -> None:
        part, probe = _part(), load_probe("omp40-2")
        targets = _spread(part.faces[0], (3, 57), (3, 37), 300)
        exact = response_map(
            probe, probe_response(probe, model), predict(probe, fibonacci_cap(400), model)
        )
        touches = simulate(probe, part, targets, model=model)
        points = apply(touches, exact, nominal=part)
        assert points.deviation is not None
        assert np.abs(points.deviation).max() < 1e-6
        on = part.faces[0]
        foot = on.local(on.nearest(points.positions)).point
        assert np.abs(foot - points.positions).max() < 1e-6
        # With the normals of the targets alone the slide is neglected: an error of nanometres.
        plain = apply(touches, exact)
        assert 1e-6 < np.abs(plain.deviation).max() < 2e-4

    @pytest.mark.parametrize("name", ["sphere", "cup", "ellipsoid", "torus", "cylinder"])
    def test_form_errors_are_found(self, name: str) -> None:
        """The real part is 20 µm larger than the nominal one everywhere: nominal + 0.02 n."""
        from pretravel.surface.swept import Offset

        surface, u, v = CASES[name]
        probe = load_probe("omp40-2-100mm")
        exact = response_map(probe, probe_response(probe), predict(probe, fibonacci_cap(400)))
        targets = _spread(surface, u, v, 80)
        touches = simulate(probe, Offset(surface, 0.02), targets)
        points = apply(touches, exact, nominal=surface)
        # 0.02 mm of radius change the compression by 1e-4 of 0.8 µm; the tolerance is 1 nm.
        assert points.deviation == pytest.approx(0.02, abs=1e-6)

    def test_a_measured_map_in_its_own_terms(self) -> None:
        """Touches are simulated from a map and compensated with it: the map is the truth."""
        part, probe = _part(), load_probe("omp40-2-100mm")
        table = predicted_map(probe, predict(probe, fibonacci_cap(300, math.radians(89))))
        targets = _spread(part.faces[0], (3, 57), (3, 37), 200)
        points = apply(simulate(table, part, targets), table, nominal=part)
        assert np.abs(points.deviation).max() < 1e-9

    def test_in_the_machines_frame(self) -> None:
        part, probe = _part(), load_probe("omp40-2-100mm")
        place = parse_placement("100,50,-20,10,0,30")
        targets = _spread(part.faces[0], (3, 57), (3, 37), 100)
        run = simulate_some(probe, part, targets, setup=PartSetup(placement=place))
        assert run.touches is not None
        exact = response_map(probe, probe_response(probe), predict(probe, fibonacci_cap(400)))
        machine = run.touches.moved(place)
        back = machine.moved(place.inverse)
        points = apply(back, exact.seen_from(place), nominal=part)
        assert np.abs(points.deviation).max() < 1e-6
        # Without the rotation of the part, the deviations are wrong.
        wrong = apply(back, exact, nominal=part)
        assert np.abs(wrong.deviation).max() > 1e-4

    def test_touches_beside_the_nominal_are_refused_by_name(self) -> None:
        part, probe = _part(), load_probe("omp40-2")
        up = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
        touches = Touches([[30.0, 20.0, 14.0], [90.0, 20.0, 14.0]], up, labels=("in", "out"))
        exact = response_map(probe, probe_response(probe), predict(probe, fibonacci_cap(400)))
        with pytest.raises(PretravelError, match=r"1 of 2 touches.*touch 2 \(out\)"):
            apply(touches, exact, nominal=part)


@pytest.mark.parametrize("radius", [1.0, 2.0, 2.9])
def test_a_ball_that_does_not_fit(radius: float) -> None:
    cup = Reversed(Sphere([0, 0, 0], radius))
    done = touch(_tip(), cup, Targets([[0, 0, -radius]], [[0, 0, 1.0]]))
    assert done.status[0] == TouchStatus.DOES_NOT_FIT


@pytest.mark.parametrize("kinematics", ["lateral", "full"])
def test_the_event_of_a_slide_does_not_depend_on_what_follows(kinematics: str) -> None:
    """The trigger is reached once: a slide that goes on has the same one, one that ends none."""
    tip, surface = predicted_tip(load_probe("omp40-2")), Sphere([0, 0, 0], 10.0)
    at, step = (0.3, 0.7), 1e-3

    def event(steps: int) -> float:
        settings = SlideSettings(step=step, steps=steps, kinematics=kinematics)
        return slide(tip, surface, at, settings).trigger_feed

    long = event(30)
    first = int(np.ceil(long / step))
    assert 2 < first < 15
    assert event(first + 1) == pytest.approx(long, rel=1e-12)
    assert np.isnan(event(first - 1))


@pytest.mark.parametrize("goal", [0.01, 0.37, 0.5, 0.7, 0.999])
def test_the_golden_section_shrinks_the_interval_to_0618_of_itself(goal: float) -> None:
    """The first two points are at 0.382 and 0.618; after n intervals the end is off by 0.618^n."""
    tried, end = _golden_section(2.0 * goal, 2.0, 200)
    assert tried[0] == pytest.approx(2.0 * 0.381966, abs=1e-6)
    if goal > 0.382:
        assert tried[1] == pytest.approx(2.0 * 0.618034, abs=1e-6)
    assert 0.0 <= end - 2.0 * goal < 2e-9 * 1.01
    # 0.618^44 is below 1e-9: at most two trials in each interval.
    assert len(tried) <= 2 * 44
    few, coarse = _golden_section(2.0 * goal, 2.0, 12)
    assert few.tolist() == tried[: len(few)].tolist()
    assert coarse >= end


def test_without_a_trigger_before_the_end_the_golden_section_keeps_the_upper_part() -> None:
    """Two trials leave 1 - 0.618 of the interval: 0.382^22 is the first power below 1e-9."""
    tried, end = _golden_section(2.0, 2.0, 200)
    assert end == 2.0
    assert len(tried) == 2 * 22
