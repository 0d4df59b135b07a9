"""Distances and angles between features: closed forms, and trials with common errors."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.drawing.features.between_features import covariance_of_positions, relations_between
from pretravel.drawing.features.measured_feature import MeasuredFeature, Quantity, measure_feature
from pretravel.measurement.association import associate
from pretravel.measurement.points import FIXED_SCATTER
from tests.support.feature_points import OWN, TIP, around, feature_points, features

AWAY = np.array([30.0, 40.0, 0.0])
SHIFT = np.array([7.0, 25.0, 5.0])


def _turned(vectors: FloatArray, degrees: float) -> FloatArray:
    """About x."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return vectors @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def _bores(count: int = 12, **options: object) -> list[MeasuredFeature]:
    outward, _ = around(count)
    return [
        measure_feature(
            feature_points(10.0 * outward + at, -outward, **options),  # type: ignore[arg-type]
            "bore",
            label=name,
        )
        for name, at in (("A", np.zeros(3)), ("B", AWAY))
    ]


def _one(found: list[MeasuredFeature]) -> Quantity:
    (relation,) = relations_between(found)
    return relation.quantity


class TestTwoBores:
    """Centres 50 mm apart: u² of their distance is 2 · 2 σ²/n, and what is common is not in it."""

    def test_distance(self) -> None:
        apart = _one(_bores())
        assert (apart.name, apart.value) == ("distance", pytest.approx(50.0, abs=1e-9))
        assert apart.u == pytest.approx(np.sqrt(4.0 / 12) * OWN, rel=1e-9)

    def test_a_shift_of_both_leaves_it(self) -> None:
        outward, _ = around(12)
        shared = {"map 1": 5e-3 * outward[:, 0], "map 2": 5e-3 * outward[:, 1]}
        bores = _bores(own=1e-9, shared=shared)
        assert bores[0].quantity("x").u == pytest.approx(5e-3, rel=1e-6)
        assert _one(bores).u < 1e-8
        covariance = covariance_of_positions(bores)
        assert covariance[0, 3] == pytest.approx(25e-6, rel=1e-6)  # fully common
        assert covariance[0, 4] == pytest.approx(0.0, abs=1e-12)

    def test_what_repeats_leave_is_common_to_directions(self) -> None:
        """The same twelve normals in both bores: their fixed scatter moves both centres alike."""
        bores = _bores(own=1e-9, shared={FIXED_SCATTER: np.full(12, 1e-3)})
        assert bores[0].quantity("x").u == pytest.approx(np.sqrt(2.0 / 12) * 1e-3, rel=1e-6)
        assert _one(bores).u < 1e-8

    def test_unknown_correlation_adds_both(self) -> None:
        bores = _bores(stated=False)
        outward, _ = around(12)
        # Errors of points weigh 2/n cos φ, φ from the direction of the distance: Σ |w| u of both.
        weights = 2.0 / 12 * np.abs(outward @ AWAY / 50.0)
        u = np.hypot(OWN, TIP)
        assert _one(bores).u == pytest.approx(2.0 * float(np.sum(weights)) * u, rel=1e-9)

    def test_the_machine_is_in_a_distance_once(self) -> None:
        outward, _ = around(12)
        bores = [
            measure_feature(feature_points(10.0 * outward + at, -outward), "bore", u_machine=0.002)
            for at in (np.zeros(3), AWAY)
        ]
        assert _one(bores).u == pytest.approx(np.hypot(np.sqrt(4.0 / 12) * OWN, 0.002), rel=1e-9)

    def test_points_of_other_compensations_are_refused(self) -> None:
        outward, _ = around(12)
        other = {"map 1": 1e-3 * outward[:, 0]}
        mixed = [_bores()[0], _bores(shared=other)[1]]
        with pytest.raises(PretravelError, match="have different lists of shared errors"):
            relations_between(mixed)


def test_pairs_of_few_and_neighbours_of_many() -> None:
    outward, _ = around(6)
    row = [
        measure_feature(feature_points(outward + 3.0 * i * np.eye(3)[0], -outward), "bore",
                        label=str(i))
        for i in range(8)
    ]  # fmt: skip
    assert len(relations_between(row[:6])) == 15
    found = relations_between(row)
    assert [(r.first, r.second) for r in found] == [(str(i), str(i + 1)) for i in range(7)]


def test_features_that_share_touches_have_no_distance() -> None:
    """The error of a shared touch is common to both, and would be counted twice."""
    bore = _bores()[0]
    assert relations_between([bore, bore]) == ()


def test_axes_that_cross_have_an_angle_and_no_distance() -> None:
    positions, normals = features()["cylinder"]
    points = [feature_points(_turned(positions, a), _turned(normals, a)) for a in (0.0, 60.0)]
    found = [measure_feature(p, "cylinder", axis=_turned(np.array([0.0, 0.0, 1.0]), a))
             for p, a in zip(points, (0.0, 60.0), strict=True)]  # fmt: skip
    angle = _one(found)
    assert (angle.name, np.degrees(angle.value)) == ("angle", pytest.approx(60.0, abs=1e-9))


@pytest.mark.parametrize(
    ("kind", "degrees", "name"),
    [
        ("sphere", 0.0, "distance"),
        ("bore", 0.0, "distance"),
        ("cylinder", 0.0, "distance"),
        ("cylinder", 30.0, "angle"),
        ("cone", 140.0, "angle"),
        ("plane", 0.0, "distance"),
        ("plane", 120.0, "angle"),
        ("line", 0.0, "distance"),
    ],
)
def test_every_relation_is_as_uncertain_as_it_moves_with_the_points(
    kind: str, degrees: float, name: str
) -> None:
    """Each point of both features moved by 1 µm along its normal, its feature found again: the
    changes of the relation, with the points' own errors and those that both features share."""
    rng = np.random.default_rng(5)
    positions, normals = features()[kind]
    axis = normals.mean(axis=0) if kind in ("plane", "line") else np.array([0.0, 0.0, 1.0])
    places = [(positions, normals, axis)]
    places.append((_turned(positions, degrees) + SHIFT, _turned(normals, degrees),
                   _turned(axis, degrees)))  # fmt: skip
    count = len(positions)
    factors = 0.5e-3 * rng.normal(size=(2, 2 * count))
    parts = (slice(None, count), slice(count, None))
    stated = [
        measure_feature(
            feature_points(p, n, shared={f"map {k + 1}": factors[k, part] for k in range(2)}),
            kind, axis=a,
        )
        for (p, n, a), part in zip(places, parts, strict=True)
    ]  # fmt: skip
    found = next(r.quantity for r in relations_between(stated) if r.quantity.name == name)

    def fit(which: int, moved: FloatArray) -> object:
        p, n, a = places[which]
        return associate(kind, p + moved[:, None] * n, axis=a)

    step, still = 1e-3, [fit(which, np.zeros(count)) for which in (0, 1)]
    weights = []
    for which in (0, 1):
        for moved in step * np.eye(count):
            both = [[fit(which, side * moved), still[1 - which]][:: 1 - 2 * which]
                    for side in (1.0, -1.0)]  # fmt: skip
            values = [_value(kind, name, *pair) for pair in both]
            weights.append((values[0] - values[1]) / (2.0 * step))
    expected = np.sqrt(OWN**2 * np.sum(np.square(weights)) + np.sum((factors @ weights) ** 2))
    assert found.value == pytest.approx(_value(kind, name, *still), abs=1e-8)
    assert found.u == pytest.approx(expected, rel=1e-3)


def _value(kind: str, name: str, a: object, b: object) -> float:
    """By the definition, from two fits."""
    apart = b.point - a.point  # type: ignore[attr-defined]
    if name == "angle":
        cosine = float(a.direction @ b.direction)  # type: ignore[attr-defined]
        return float(np.arccos(cosine if kind == "plane" else abs(cosine)))
    if kind in ("plane", "line"):
        return abs(float(a.outward[0] @ apart))  # type: ignore[attr-defined]
    if kind == "sphere":
        return float(np.linalg.norm(apart))
    return float(np.linalg.norm(np.cross(apart, a.direction)))  # type: ignore[attr-defined]


def test_slots_have_the_distance_of_their_median_planes() -> None:
    """Two slots of 10 mm, 30 mm apart along their normal, and 7 mm along themselves."""
    positions, normals = features()["slot"]
    away = np.array([7.0, 0.0, 30.0])
    both = [
        measure_feature(feature_points(positions + shift, normals), "slot", label=name)
        for name, shift in (("one", np.zeros(3)), ("two", away))
    ]
    found = {each.quantity.name: each.quantity for each in relations_between(both)}
    assert found["distance"].value == pytest.approx(30.0, abs=1e-9)
    assert found["angle"].value == pytest.approx(0.0, abs=1e-9)
    # The tip radius is common to both planes of a slot, and leaves its middle.
    assert found["distance"].parts["tip radius"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("first", ["plane", "cylinder", "sphere"])
def test_an_axis_and_a_centre_have_a_distance_from_a_plane(first: str) -> None:
    """A plane of normal x; moved by its points and by those of the round feature."""
    other = "cylinder" if first == "plane" else first
    away = np.array([-30.0, 4.0, 1.0])
    positions, normals = features()["plane"]
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    made = {"plane": (positions @ turn.T + away, normals @ turn.T), other: features()[other]}
    order = ("plane", other) if first == "plane" else (other, "plane")
    z = np.array([0.0, 0.0, 1.0])

    def relation(kind: str = "", moved: FloatArray | None = None) -> Quantity:
        found = []
        for each in order:
            place, normal = made[each]
            by = 0.0 if moved is None or each != kind else moved[:, None] * normal
            axis = None if each == "plane" else z
            points = feature_points(place + by, normal, shared={"map 1": np.zeros(len(place))})
            found.append(measure_feature(points, each, axis=axis))
        return next(r.quantity for r in relations_between(found) if r.quantity.name == "distance")

    step = 1e-3
    weights = [
        (relation(kind, moved).value - relation(kind, -moved).value) / (2.0 * step)
        for kind in order for moved in step * np.eye(len(made[kind][0]))
    ]  # fmt: skip
    plain = relation()
    assert plain.value == pytest.approx(_from_plane(made, other), abs=1e-6)
    assert plain.u == pytest.approx(OWN * np.linalg.norm(weights), rel=1e-3)


def _from_plane(made: dict[str, tuple[FloatArray, FloatArray]], other: str) -> float:
    fit = associate(other, made[other][0], axis=None if other == "sphere" else np.eye(3)[2])
    plane = associate("plane", made["plane"][0])
    return abs(float(plane.direction @ (fit.point - plane.point)))
