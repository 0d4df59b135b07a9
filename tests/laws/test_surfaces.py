"""Laws of every surface: derivatives, normals, curvature, nearest points."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pretravel.base.directions import unit
from pretravel.base.errors import PretravelError
from pretravel.surface.contact import Lines, ball_center, solve_contact
from pretravel.surface.curves import Conic, Line, OffsetCurve, SplineCurve, flat_knots, polyline
from pretravel.surface.local_geometry import Surface, signed_distance, tangent_basis
from pretravel.surface.parametric import Convex, FunctionSurface
from pretravel.surface.shapes import Ellipsoid, Plane, Reversed, Sphere
from pretravel.surface.shapes_of_revolution import Cone, Cylinder, Torus
from pretravel.surface.spline import SplineSurface
from pretravel.surface.swept import Extrusion, Offset, Placed, Revolution

AXES = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
HERE = np.array([1.0, -2.0, 3.0])


def _bicubic() -> SplineSurface:
    rng = np.random.default_rng(1)
    knots = np.array([0.0, 0, 0, 0, 4, 10, 10, 10, 10])
    x, y = np.meshgrid(np.linspace(0, 10, 5), np.linspace(0, 10, 5), indexing="ij")
    poles = np.stack([x, y, rng.normal(0.0, 0.8, x.shape)], axis=-1)
    return SplineSurface(knots, knots, poles, rng.uniform(0.5, 2.0, x.shape), (3, 3))


def _wave() -> SplineCurve:
    knots = np.array([0.0, 0, 0, 0, 1, 2, 2, 2, 2])
    poles = np.array([[5.0, 0, 0], [7, 0, 2], [6, 0, 4], [8, 0, 6], [6, 0, 8]])
    return SplineCurve(knots, poles, np.array([1.0, 2, 1, 0.5, 1]), 3)


SURFACES: dict[str, tuple[Surface, tuple[float, float], tuple[float, float]]] = {
    # surface, and the range of u and v for the tests
    "plane": (Plane(HERE, [0.6, 0.0, 0.8]), (-5, 5), (-5, 5)),
    "sphere": (Sphere(HERE, 5.0, AXES), (0.1, 6.1), (0.1, 3.0)),
    "sphere, latitude": (Sphere(HERE, 5.0, AXES, latitude=True), (0.1, 6.1), (-1.4, 1.4)),
    "cylinder": (Cylinder(HERE, 5.0, AXES), (0.1, 6.1), (-3, 3)),
    "cone": (Cone(HERE, 5.0, 0.4, AXES), (0.1, 6.1), (-3, 3)),
    "torus": (Torus(HERE, 10.0, 3.0, AXES), (0.1, 6.1), (0.1, 6.1)),
    "barrel": (Torus(HERE, 3.0, 5.0, AXES, inner=True), (0.1, 6.1), (2.5, 3.8)),
    "ellipsoid": (Ellipsoid(HERE, [10.0, 8.0, 6.0], AXES), (0.1, 6.1), (0.1, 3.0)),
    "hole": (Reversed(Cylinder(HERE, 5.0, AXES)), (0.1, 6.1), (-3, 3)),
    "convex": (Convex(), (-0.9, 0.9), (-0.9, 0.9)),
    "convex, 70°": (Convex(turn=math.radians(70.0)), (-0.9, 0.9), (-0.9, 0.9)),
    "function": (
        FunctionSurface(lambda u, v: (u, v, 0.1 * u * np.sin(v)), (-3, 3), (-3, 3)),
        (-2.5, 2.5),
        (-2.5, 2.5),
    ),
    "function, other side": (
        FunctionSurface(lambda u, v: (u, v, 0.1 * u * v), (-3, 3), (-3, 3), outwards=-1),
        (-2.5, 2.5),
        (-2.5, 2.5),
    ),
    "rational spline": (_bicubic(), (0.5, 9.5), (0.5, 9.5)),
    "extrusion": (Extrusion(_wave(), np.array([0.0, 1.0, 0.2])), (0.1, 1.9), (-3, 3)),
    "revolution": (
        Revolution(_wave(), np.zeros(3), np.array([0.0, 0.0, 1.0])), (0.1, 6.1), (0.1, 1.9)
    ),
    "offset": (Offset(Ellipsoid(HERE, [10.0, 8.0, 6.0]), 1.5), (0.1, 6.1), (0.2, 2.9)),
    "offset spline": (Offset(_bicubic(), 0.2), (0.5, 9.5), (0.5, 9.5)),
    "placed": (Placed(_bicubic(), AXES * np.linalg.det(AXES), HERE), (0.5, 9.5), (0.5, 9.5)),
}  # fmt: skip

named = pytest.mark.parametrize("name", SURFACES)


def _somewhere(name: str, count: int = 40, seed: int = 0) -> tuple[Surface, np.ndarray]:
    surface, u, v = SURFACES[name]
    rng = np.random.default_rng(seed)
    return surface, np.column_stack([rng.uniform(*u, count), rng.uniform(*v, count)])


@named
def test_derivatives_normal_and_curvature_are_those_of_the_points(name: str) -> None:
    """Central differences of points give du, dv, of normals W du, W dv: error 1e-5² times the
    third derivatives, below 30 here, and rounding 1e-15 / 1e-5."""
    surface, uv = _somewhere(name)
    h = 1e-5
    _, *tangents = surface.derivatives(uv)
    local = surface.local(uv)
    assert np.allclose(np.linalg.norm(local.normal, axis=1), 1.0, atol=1e-12)
    for axis, tangent in enumerate(tangents):
        step = h * np.eye(2)[axis]
        there, back = surface.local(uv + step), surface.local(uv - step)
        assert np.allclose((there.point - back.point) / (2 * h), tangent, atol=2e-8)
        turned = np.einsum("nij,nj->ni", local.curvature, tangent)
        assert np.allclose((there.normal - back.normal) / (2 * h), turned, atol=2e-8)
        assert np.abs(np.sum(tangent * local.normal, axis=1)).max() < 1e-9
    assert np.allclose(local.curvature, np.swapaxes(local.curvature, 1, 2), atol=1e-10)


@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
def test_second_derivatives_of_a_function_in_any_unit_of_its_parameters(length: float) -> None:
    """A sine of one period and a product over parameters from zero to a length."""
    wave = FunctionSurface(
        lambda u, v: (u / length, v / length, np.sin(6.0 * u / length) + u * v / length**2),
        (0, length), (0, length),
    )  # fmt: skip
    u = np.linspace(0.1, 0.9, 9)
    *_, duu, duv, dvv = wave.second_order(length * np.column_stack([u, u[::-1]]))
    assert duu[:, 2] * length**2 == pytest.approx(-36.0 * np.sin(6.0 * u), abs=1e-7)
    assert duv[:, 2] * length**2 == pytest.approx(np.ones(9), abs=1e-7)
    assert dvv * length**2 == pytest.approx(np.zeros((9, 3)), abs=1e-7)


@named
def test_nearest_undoes_moving_off_along_the_normal(name: str) -> None:
    surface, uv = _somewhere(name)
    local = surface.local(uv)
    if name in ("extrusion",):  # no end along v: nearest points need a face's bounds
        with pytest.raises(PretravelError, match="bounded"):
            surface.nearest(local.point)
        return
    off = 0.3
    foot = surface.local(surface.nearest(local.point + off * local.normal))
    assert np.abs(foot.point - local.point).max() < 1e-9
    distance = signed_distance(surface, local.point + off * local.normal)
    assert np.allclose(distance, off, atol=1e-10)
    assert np.allclose(signed_distance(surface, local.point - 0.1 * local.normal), -0.1, atol=1e-10)


@named
def test_moved_goes_where_it_was_sent(name: str) -> None:
    """To first order: the error is the square of the displacement times the curvature."""
    surface, uv = _somewhere(name)
    local = surface.local(uv)
    way = 1e-4 * tangent_basis(local.normal)[:, 0]
    there = surface.local(surface.moved(uv, way)).point
    assert np.abs(there - local.point - way).max() < 1e-6


@named
def test_a_ball_comes_to_rest_tangent(name: str) -> None:
    surface, uv = _somewhere(name, 60)
    local = surface.local(uv)
    rng = np.random.default_rng(5)
    approach = unit(-local.normal + 0.3 * rng.normal(size=local.normal.shape))
    radius = 0.4
    start = local.point + radius * local.normal - 0.7 * approach
    contact = solve_contact(surface, uv, Lines(start, approach), ball_center(radius))
    assert contact.residual.max() < 1e-9
    assert np.allclose(contact.length, 0.7, atol=1e-9)
    assert np.abs(contact.local.point - local.point).max() < 1e-8


def test_known_curvatures() -> None:
    at = np.array([[0.3, 0.7]])

    def bends(surface: Surface, uv: np.ndarray = at) -> np.ndarray:
        return surface.local(uv).principal_curvatures[0]

    assert bends(Sphere([0, 0, 0], 4.0)) == pytest.approx([0.25, 0.25])
    assert bends(Cylinder([0, 0, 0], 4.0)) == pytest.approx([0.0, 0.25])
    inner = Torus([0, 0, 0], 10.0, 3.0).local(np.array([[0.0, math.pi]]))
    assert inner.principal_curvatures[0] == pytest.approx([-1.0 / 7.0, 1.0 / 3.0])
    assert inner.normal[0] == pytest.approx([-1.0, 0.0, 0.0], abs=1e-15)
    assert bends(Reversed(Sphere([0, 0, 0], 4.0))) == pytest.approx([-0.25, -0.25])
    # Half-axes a, a, c: at the pole both curvatures are c / a².
    pole = np.array([[0.0, 0.0]])
    assert bends(Ellipsoid([0, 0, 0], [10.0, 10.0, 6.0]), pole) == pytest.approx([0.06, 0.06])


def test_the_ellipsoid_normal_is_the_true_one() -> None:
    """At a = 10, c = 6, v = 40° it is 26.7° from the axis, atan(c tan v / a); the thesis's
    equation 4.18 would have it at 40°, which holds only for a ball."""
    local = Ellipsoid([0, 0, 0], [10, 10, 6]).local(np.array([[0.0, math.radians(40.0)]]))
    angle = math.degrees(math.acos(local.normal[0, 2]))
    assert angle == pytest.approx(math.degrees(math.atan(0.6 * math.tan(math.radians(40.0)))))


@given(st.floats(0.0, 2.0 * math.pi), st.floats(0.5, 20.0))
@settings(max_examples=30, deadline=None)
def test_poles_are_points_like_others(azimuth: float, radius: float) -> None:
    """Contact at a pole, where the parameters are singular but the contact is not."""
    for ball in (
        Sphere([0, 0, 0], radius),
        Sphere([0, 0, 0], radius, latitude=True),
        Ellipsoid([0, 0, 0], [radius, radius, radius]),
    ):
        start = np.array([[0.3 * math.cos(azimuth), 0.3 * math.sin(azimuth), radius + 3.0]])
        touch = solve_contact(
            ball,
            ball.nearest(start),
            Lines(np.array([[0.0, 0.0, radius + 5.0]]), np.array([[0.0, 0.0, -1.0]])),
            ball_center(2.0),
        )
        assert touch.length[0] == pytest.approx(3.0, abs=1e-12)
        assert touch.local.normal[0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)


def test_newton_is_quadratic() -> None:
    surface, uv = _somewhere("rational spline", 200)
    local = surface.local(uv)
    far = uv + np.random.default_rng(2).normal(0.0, 0.2, uv.shape)
    start = local.point + 0.5 * local.normal
    contact = solve_contact(surface, far, Lines(start, -local.normal), ball_center(0.5))
    assert contact.solved.all()
    assert np.median(contact.iterations) <= 4


def test_a_line_that_misses_is_not_solved() -> None:
    ball = Sphere([0, 0, 0], 5.0)
    aside = np.array([[8.5, 0.0, 10.0]])
    down = np.array([[0.0, 0.0, -1.0]])
    assert not solve_contact(
        ball, ball.nearest(aside), Lines(aside, down), ball_center(3.0)
    ).solved[0]
    grazing = np.array([[7.99, 0.0, 10.0]])
    hit = solve_contact(ball, ball.nearest(grazing), Lines(grazing, down), ball_center(3.0))
    assert hit.solved[0]
    assert 10.0 - hit.length[0] == pytest.approx(math.sqrt(64.0 - 7.99**2), abs=1e-7)


class TestCurves:
    T = np.linspace(0.1, 1.9, 6)  # no point is on a knot, where third derivatives are discontinuous

    @pytest.mark.parametrize(
        "curve",
        [
            Line(np.zeros(3), np.array([1.0, 2.0, 3.0])),
            Conic("ellipse", np.ones(3), np.eye(3)[0], np.eye(3)[1], 3.0, 2.0),
            Conic("hyperbola", np.ones(3), np.eye(3)[0], np.eye(3)[1], 3.0, 2.0),
            Conic("parabola", np.ones(3), np.eye(3)[0], np.eye(3)[1], 3.0),
            _wave(),
            OffsetCurve(_wave(), 0.5, np.array([0.0, 1.0, 0.0])),
            OffsetCurve(Conic("ellipse", np.zeros(2), np.eye(2)[0], np.eye(2)[1], 3.0, 2.0), 0.5),
        ],
        ids=lambda curve: type(curve).__name__,
    )
    def test_derivatives(self, curve: Conic) -> None:
        h = 1e-5
        for order in (1, 2):
            difference = curve.value(self.T + h, order - 1) - curve.value(self.T - h, order - 1)
            assert np.allclose(difference / (2 * h), curve.value(self.T, order), atol=1e-7)

    def test_conics_satisfy_their_equations(self) -> None:
        o, x, y = np.zeros(2), np.eye(2)[0], np.eye(2)[1]
        p = Conic("parabola", o, x, y, 3.0).value(self.T)
        assert p[:, 1] ** 2 == pytest.approx(4.0 * 3.0 * p[:, 0])
        p = Conic("hyperbola", o, x, y, 3.0, 2.0).value(self.T)
        assert (p[:, 0] / 3) ** 2 - (p[:, 1] / 2) ** 2 == pytest.approx(1.0)

    def test_a_periodic_spline_closes_smoothly(self) -> None:
        """Eight poles on a circle, simple knots: a closed curve with continuous curvature."""
        angle = np.arange(8) * math.pi / 4
        poles = np.column_stack([np.cos(angle), np.sin(angle)])
        knots = flat_knots(np.arange(9.0), np.ones(9, dtype=int), 3, True)
        wrapped = np.arange(len(knots) - 4) % 8
        curve = SplineCurve(knots, poles[wrapped], np.ones(len(wrapped)), 3, wraps=True)
        assert curve.range == (0.0, 8.0)
        for order in (0, 1, 2):
            ends = curve.value(np.array([1e-9, 8.0 - 1e-9]), order)
            assert np.allclose(ends[0], ends[1], atol=1e-7)
        # By symmetry all spans are equal.
        radius = np.linalg.norm(curve.value(np.arange(8) + 0.3), axis=1)
        assert np.ptp(radius) < 1e-12

    def test_a_polyline_stays_within_its_tolerance(self) -> None:
        circle = Conic("ellipse", np.zeros(2), np.eye(2)[0], np.eye(2)[1], 5.0, 5.0)
        points = polyline(circle, 0.0, 2.0 * math.pi, 1e-5)
        middle = 0.5 * (points[1:] + points[:-1])
        rise = (5.0 - np.linalg.norm(middle, axis=1)).max()
        # Chords rise with the square of their length: half as many would rise too much.
        assert 0.25 * 1e-5 < rise <= 1e-5

    def test_a_polyline_has_the_corners_of_its_part_of_the_curve(self) -> None:
        """Of corners at 1, 2 and 3 the middle one lies between 1.2 and 2.8."""
        corners = np.array([[0.0, 0.0], [1.0, 0.3], [2.0, -0.5], [3.0, 1.0], [4.0, 0.0]])
        knots = np.array([0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0])
        points = polyline(SplineCurve(knots, corners, np.ones(5), 1), 1.2, 2.8, 1e-6)
        assert np.all(np.diff(points[:, 0]) > 0.0)
        assert points[[0, -1], 0] == pytest.approx([1.2, 2.8], abs=1e-12)
        assert np.linalg.norm(points - corners[2], axis=1).min() < 1e-12


def test_a_function_that_is_none_is_refused() -> None:
    with pytest.raises(PretravelError, match="complex"):
        FunctionSurface(lambda u, v: (u, math.sin(v), v), (0, 1), (0, 1))
    with pytest.raises(PretravelError, match="not finite"):
        FunctionSurface(lambda u, v: (u, v, 1.0 / (u - 0.5)), (0, 1), (0, 1))
    with pytest.raises(PretravelError, match="loses its derivative"):
        FunctionSurface(lambda u, v: (u, v, -np.abs(u)), (-9, 9), (-9, 9))
    with pytest.raises(PretravelError, match="returns 2"):
        FunctionSurface(lambda u, v: (u, v), (-9, 9), (-9, 9))
    with pytest.raises(PretravelError, match="must increase"):
        FunctionSurface(lambda u, v: (u, v, u), (1, 0), (0, 1))


@pytest.mark.parametrize("shape", [Sphere, Cylinder])
def test_the_place_of_a_shape_does_not_change_with_what_it_was_given(
    shape: type[Sphere] | type[Cylinder],
) -> None:
    origin, axes = np.array([1.0, 2.0, 3.0]), np.eye(3)
    made = shape(origin, 5.0, axes)
    before = made.local(np.array([[0.3, 0.4]])).point.copy()
    origin += 7.0
    axes[0] = [0.0, 0.0, 1.0]
    assert made.local(np.array([[0.3, 0.4]])).point == pytest.approx(before)
    with pytest.raises(ValueError, match="read-only"):
        made.origin[0] = 4.0  # type: ignore[index]


def test_a_sphere_is_parametrised_by_azimuth_and_polar_angle_or_latitude() -> None:
    """v is the polar angle from the axis; as latitude, the angle above the equator."""
    ball = Sphere([0.0, 0.0, 0.0], 5.0)
    assert ball.domain.lower == (0.0, 0.0)
    assert ball.domain.upper == pytest.approx((2.0 * math.pi, math.pi))
    assert ball.local(np.array([[0.0, 0.0]])).point == pytest.approx(np.array([[0.0, 0.0, 5.0]]))
    globe = Sphere([0.0, 0.0, 0.0], 5.0, latitude=True)
    assert globe.domain.lower == pytest.approx((0.0, -0.5 * math.pi))
    assert globe.domain.upper == pytest.approx((2.0 * math.pi, 0.5 * math.pi))
    assert globe.local(np.array([[0.0, 0.0]])).point == pytest.approx(np.array([[5.0, 0.0, 0.0]]))
