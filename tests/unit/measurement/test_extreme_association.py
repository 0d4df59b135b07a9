"""Extreme features: answers that are known by construction, and how they move with points."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.base.frames import parse_placement
from pretravel.drawing.features.conformity import ConformityVerdict
from pretravel.drawing.features.extreme_association import KINDS_BY_CRITERION, associate_by
from pretravel.drawing.features.feature_uncertainty import FORM_OF_PART, ONE_SIDED
from pretravel.drawing.features.form_of_part import FormOfPart
from pretravel.drawing.features.measured_feature import MeasuredFeature, measure_feature
from pretravel.drawing.tolerances.tolerances import FeatureTolerances, inspect_feature
from pretravel.measurement.association import Association, associate
from pretravel.measurement.points import Points
from tests.support.feature_points import OWN, TIP, around, feature_points, features

E = 2e-3
"""Half the width of the constructed zones. [mm]"""
SLOPE = np.radians(20.0)
NEAR = 1e-9  # mm; rounding of places of 120 mm and a few equations with them
PLACE = parse_placement("120,-35,60,25,-40,70")
UP = np.asarray(PLACE.vectors(np.array([[0.0, 0.0, 1.0]]))[0])
EXTREME = [
    (criterion, kind)
    for criterion, kinds in KINDS_BY_CRITERION.items()
    for kind in kinds
    if criterion != "gaussian" and kind not in ("bore", "boss")
]
"""Bores and bosses are circles here."""
SEEDS = range(2)


def _perfect(kind: str, rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
    """Points of a perfect feature at random places and their normals, in a frame of nobody."""
    turn, height = rng.uniform(0.0, 2.0 * np.pi, count), rng.uniform(-15.0, 15.0, count)
    round_ = np.c_[np.cos(turn), np.sin(turn), np.zeros(count)]
    z = np.array([0.0, 0.0, 1.0])
    if kind == "sphere":
        outward = rng.normal(size=(count, 3))
        outward /= np.linalg.norm(outward, axis=1)[:, None]
        points = 10.0 * outward
    elif kind == "torus":
        tube = rng.uniform(0.0, 2.0 * np.pi, count)[:, None]
        outward = np.cos(tube) * round_ + np.sin(tube) * z
        points = 10.0 * round_ + 4.0 * outward
    elif kind == "cone":
        outward = np.cos(SLOPE) * round_ - np.sin(SLOPE) * z
        points = (10.0 + height * np.tan(SLOPE))[:, None] * round_ + height[:, None] * z
    elif kind == "slot":
        outward = np.where(turn[:, None] > np.pi, z, -z)
        wide = 20.0 * rng.uniform(-1.0, 1.0, count)
        points = np.c_[2.0 * height, wide, np.zeros(count)] + 10.0 * outward
    elif kind in ("plane", "line"):
        outward = np.tile(z, (count, 1))
        wide = 20.0 if kind == "plane" else 0.0
        points = np.c_[2.0 * height, rng.uniform(-1.0, 1.0, count) * wide, np.zeros(count)]
    else:
        outward = round_
        points = 10.0 * round_ + (height[:, None] * z if kind == "cylinder" else 0.0)
    return np.asarray(PLACE.points(points)), np.asarray(PLACE.vectors(outward))


def _ideal(kind: str, points: FloatArray) -> Association:
    return associate(kind, points, axis=UP)


def _zone_points(kind: str, rng: np.random.Generator) -> tuple[FloatArray, Association, int]:
    """Points with k + 1 contacts of a zone of ±E about a perfect feature; the others are inside.

    No movement of the feature reduces all contacts if a combination of their signed slopes with
    positive factors is zero (Chebyshev): the signs are those of the one that exists (Radon).
    """
    while True:
        points, outward = _perfect(kind, rng, 40)
        ideal = _ideal(kind, points)
        contacts = ideal.jacobian.shape[1] + 1
        load = np.linalg.svd(ideal.jacobian[:contacts].T)[2][-1]
        if np.abs(load).min() > 0.05:  # each contact carries; else another one may lie as near
            break
    height = E * rng.uniform(-0.8, 0.8, 40)
    height[:contacts] = E * np.sign(load)
    return points + height[:, None] * outward, ideal, contacts


def _carrying(found: Association) -> list[int]:
    return [int(i) for i in np.flatnonzero(np.abs(found.response).max(axis=0) > 1e-9)]


def _assert_same(found: Association, wanted: Association) -> None:
    away = wanted.located_along @ (found.point - wanted.point)
    assert away == pytest.approx(np.zeros(len(away)), abs=NEAR)
    if wanted.diameter is not None:
        assert found.diameter == pytest.approx(wanted.diameter, abs=NEAR)
    if wanted.direction is not None and found.direction is not None:
        tilt = np.linalg.norm(np.cross(wanted.direction, found.direction))
        assert tilt == pytest.approx(0.0, abs=NEAR / 10.0)  # the levers are longer than 10 mm


class TestKnownByConstruction:
    @pytest.mark.parametrize("seed", SEEDS)
    @pytest.mark.parametrize("kind", KINDS_BY_CRITERION["minimum-zone"])
    def test_minimum_zone(self, kind: str, seed: int) -> None:
        points, ideal, contacts = _zone_points(kind, np.random.default_rng(seed))
        at = ideal.point
        found = associate_by("minimum-zone", kind, points, axis=UP, at=at)
        assert found.form == pytest.approx(2.0 * E, abs=NEAR)
        _assert_same(found, ideal)
        assert _carrying(found) == list(range(contacts))

    @pytest.mark.parametrize("seed", SEEDS)
    @pytest.mark.parametrize("kind", KINDS_BY_CRITERION["tangent"])
    def test_tangent(self, kind: str, seed: int) -> None:
        """The free side of the zone; of planes and lines it is where the axis points."""
        points, ideal, contacts = _zone_points(kind, np.random.default_rng(seed))
        if kind not in ("plane", "line"):
            for side, word in ((1.0, "outside"), (-1.0, "inside")):
                found = associate_by("tangent", kind, points, axis=UP, at=ideal.point, side=word)
                assert (side * found.residuals).max() == pytest.approx(0.0, abs=NEAR)
                assert found.form == pytest.approx(2.0 * E, abs=NEAR)
                assert set(_carrying(found)) <= set(range(contacts))
            return
        for side in (1.0, -1.0):
            found = associate_by("tangent", kind, points, axis=side * UP, at=ideal.point)
            assert found.residuals.max() == pytest.approx(0.0, abs=NEAR)
            assert found.residuals.min() == pytest.approx(-2.0 * E, abs=NEAR)
            assert (found.point - ideal.point) @ UP == pytest.approx(side * E, abs=NEAR)
            assert found.direction is not None
            assert ideal.direction is not None
            tilt = np.linalg.norm(np.cross(found.direction, ideal.direction))
            assert tilt == pytest.approx(0.0, abs=NEAR / 10.0)
            # It may lie on enough outer contacts, so that the inner one does not move it.
            assert set(_carrying(found)) <= set(range(contacts))

    @pytest.mark.parametrize("seed", SEEDS)
    @pytest.mark.parametrize(("criterion", "side"), [("inscribed", 1.0), ("circumscribed", -1.0)])
    @pytest.mark.parametrize("kind", KINDS_BY_CRITERION["inscribed"])
    def test_size(self, kind: str, criterion: str, side: float, seed: int) -> None:
        """k contacts on opposite sides of a perfect feature, the others beyond by up to 2 E.

        Their normals (with the heights) have a combination with positive factors that is zero:
        a contact with a negative factor is moved to the opposite side.
        """
        rng = np.random.default_rng(seed)
        while True:
            points, outward = _perfect(kind, rng, 40)
            ideal = _ideal(kind, points)
            contacts = ideal.jacobian.shape[1]
            size = 4 if kind == "cone" else -1
            load = np.linalg.svd(np.delete(ideal.jacobian[:contacts], size, axis=1).T)[2][-1]
            if kind == "cone":  # no opposite place has the contrary slope by the half angle
                load *= np.sign(load[0])
                if load.min() > 0.05:
                    break
            elif np.abs(load).min() > (0.05 if kind == "torus" else 0.1):
                break
        opposite = np.flatnonzero(load < 0.0)
        points[opposite] -= (8.0 if kind == "torus" else 20.0) * outward[opposite]
        outward[opposite] *= -1.0
        beyond = 2.0 * E * rng.uniform(0.2, 1.0, 40)
        beyond[:contacts] = 0.0
        moved = points + side * beyond[:, None] * outward
        found = associate_by(criterion, kind, moved, axis=UP, at=ideal.point)
        _assert_same(found, ideal)
        assert _carrying(found) == list(range(contacts))

    @pytest.mark.parametrize("kind", ["circle", "sphere", "cylinder"])
    def test_circumscribed_on_fewer_points(self, kind: str) -> None:
        """On a diameter, of a cylinder one at each end: the curvature determines the rest."""
        outward, _ = around(24)
        lower = E * np.random.default_rng(7).uniform(0.5, 1.0, 24)
        lower[[3, 15]] = 0.0
        points = (10.0 - lower)[:, None] * outward
        if kind == "cylinder":
            ends = np.array([-12.0, 12.0])
            points = np.vstack([points + np.array([0.0, 0.0, z]) for z in ends])
        elif kind == "sphere":
            points = np.vstack([points, [[0.0, 0.0, 9.99], [0.0, 0.0, -9.99]]])
        found = associate_by("circumscribed", kind, points, axis=(0.0, 0.0, 1.0))
        assert found.diameter == pytest.approx(20.0, abs=NEAR)
        assert found.point == pytest.approx(np.zeros(3), abs=1e-8)


def _noisy(kind: str, seed: int, count: int = 9) -> FloatArray:
    """Points with a form of some E, which surround a round feature."""
    rng = np.random.default_rng(seed)
    while True:
        points, outward = _perfect(kind, rng, count)
        slopes = _ideal(kind, points).jacobian if kind in ("circle", "sphere") else np.ones((1, 1))
        singular = np.linalg.svd(slopes / np.linalg.norm(slopes, axis=0))[1]
        around_ = np.linalg.norm(outward.mean(axis=0)) < 0.3
        free = ("plane", "line", "cylinder", "cone", "torus", "slot")
        if kind in free or (around_ and singular[-1] > 0.4):
            return points + E * rng.normal(size=(count, 1)) * outward


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("criterion", "kind"),
    [pytest.param(*each, marks=pytest.mark.slow if each[1] == "torus" else ()) for each in EXTREME],
)
def test_response_is_that_of_moved_points(criterion: str, kind: str, seed: int) -> None:
    """Each point moved by 20 pm along the normal, the feature found again: the stated change.

    The features are found to some fm; the contacts do not change by so small a movement. The
    points that carry, and two others.
    """
    points = _noisy(kind, seed, 40 if kind in ("cone", "torus") else 14)
    at = points.mean(axis=0)
    here = associate_by(criterion, kind, points, axis=UP, at=at, side="outside")
    step = 2e-8

    def values(found: Association) -> FloatArray:
        direction = np.zeros(3) if found.direction is None else 10.0 * found.direction
        place = here.located_along @ found.point
        return np.concatenate([place, [found.diameter or 0.0], direction])

    k = here.jacobian.shape[1]
    rows = [here.located_along @ here.point_rows]
    rows.append(np.zeros((1, k)) if here.diameter_row is None else here.diameter_row[None])
    rows.append(np.zeros((3, k)) if here.direction_rows is None else 10.0 * here.direction_rows)
    stated = np.vstack(rows) @ here.response
    axis = here.direction if kind == "circle" else UP  # the plane of a circle is no result of it
    carrying = _carrying(here)
    others = [i for i in range(len(points)) if i not in carrying]
    for index in [*carrying, *others[:2]]:
        found = []
        for side in (1.0, -1.0):
            moved = points.copy()
            moved[index] += side * step * here.outward[index]
            again = associate_by(criterion, kind, moved, axis=axis, at=at, side="outside")
            found.append(values(again))
        change = (found[0] - found[1]) / (2.0 * step)
        assert change == pytest.approx(stated[:, index], abs=2e-3, rel=1e-3)


@pytest.mark.parametrize("form", ["perfect", "one point out"])
@pytest.mark.parametrize(("criterion", "kind"), EXTREME)
def test_more_contacts_than_are_needed(criterion: str, kind: str, form: str) -> None:
    """Points that all touch: one set of them carries, and errors in common stay in common.

    A common movement outward is a change of the size alone, or of the place of a plane; errors of
    the single points move the feature in all directions that it has.
    """
    points, normals = features(12)["bore" if kind == "circle" else kind]
    outward = normals if kind in ("sphere", "plane", "line", "torus") else -normals
    out = (np.arange(len(points)) == 4)[:, None]
    points = points - (0.0 if form == "perfect" else E) * outward * out
    axis = normals.mean(axis=0) if kind in ("plane", "line") else (0.0, 0.0, 1.0)
    if kind == "sphere":  # the lower half too
        points, axis = np.vstack([points, -points]), None
    found = associate_by(criterion, kind, points, axis=axis, side="outside")
    common = found.response.sum(axis=1)
    wanted = np.zeros(len(common))
    size = {"plane": 0, "line": 0, "cone": 4}.get(kind, -1)
    wanted[size] = -1.0 / found.jacobian[0, size]
    if kind == "slot":
        wanted[size] = 1.0
    assert common == pytest.approx(wanted, abs=1e-6)
    own = found.response @ found.response.T
    if criterion != "circumscribed":  # which may rest on two opposite points
        assert np.linalg.eigvalsh(own)[0] > 1e-6


@pytest.mark.parametrize("kind", ["circle", "sphere", "plane"])
def test_a_zone_without_width(kind: str) -> None:
    """As many points as parameters: the feature through them, as of least squares."""
    ball = np.array([[3.0, 0, 0], [0, 4.0, 0], [-5.0, 0, 0], [0, 0, 6.0]])
    points = ball if kind == "sphere" else ball[:3] if kind == "circle" else np.eye(3)
    found = associate_by("minimum-zone", kind, points)
    gaussian = associate(kind, points)
    assert found.form == pytest.approx(0.0, abs=NEAR)
    # Changes of the feature in space: parameters count along sides that rounding may exchange.
    moved = gaussian.point_rows @ gaussian.response
    assert found.point_rows @ found.response == pytest.approx(moved, abs=1e-6)
    if gaussian.direction_rows is not None and found.direction_rows is not None:
        turned = gaussian.direction_rows @ gaussian.response
        assert found.direction_rows @ found.response == pytest.approx(turned, abs=1e-6)


class TestMeasured:
    """As a feature with its uncertainty."""

    def _bore(self, association: str, *, stated: bool = True) -> MeasuredFeature:
        """Twelve places of a bore; three at equal angles stand 5 µm inside the others."""
        outward, _ = around(12)
        radius = np.full(12, 10.0)
        radius[[0, 4, 8]] -= 5e-3
        points = feature_points(radius[:, None] * outward, -outward)
        if not stated:
            points = Points.plain(points.positions, points.labels)
        return measure_feature(points, "bore", association=association, at=(0.0, 0.0, 0.0))

    def test_uncertainty_in_closed_form(self) -> None:
        """Three contacts at equal angles: the diameter is twice their mean radius. It lies 3.75 µm
        inside that of least squares, of which noise can be a share.
        """
        found = self._bore("inscribed")
        gaussian = self._bore("gaussian")
        noise = gaussian.errors.form.share_of_noise(OWN) * 3.75e-3
        diameter = found.quantity("diameter")
        assert diameter.value == pytest.approx(19.99, abs=NEAR)
        expected = 2.0 * np.sqrt(OWN**2 / 3 + TIP**2 + noise**2)
        assert diameter.u == pytest.approx(expected, rel=1e-9)
        assert found.quantity("x").u == pytest.approx(np.sqrt(2.0 / 3.0) * OWN, rel=1e-9)
        assert found.carrying == ("1", "5", "9")
        # The form of the part is a reason for scatter of least squares, not of the contacts.
        assert FORM_OF_PART in gaussian.quantity("diameter").parts
        assert FORM_OF_PART not in diameter.parts
        assert diameter.expanded_u == pytest.approx(2.0 * diameter.u, rel=1e-12)

    def test_the_form_of_a_minimum_zone_is_its_width(self) -> None:
        """Points at 10 ± 0.0025 mm: a zone of 5 µm, beside the range about least squares."""
        gaussian, zone = self._bore("gaussian"), self._bore("minimum-zone")
        stated = {q.name: q for q in zone.stated}
        assert stated["measured range"].value == gaussian.form.measured
        assert stated["measured range, minimum-zone"].value == pytest.approx(5e-3, abs=NEAR)
        assert math.isnan(stated["measured range, minimum-zone"].u)
        assert zone.form.measured == pytest.approx(5e-3, abs=NEAR)
        low, high = zone.form.interval
        assert low < 5e-3 < high
        # As a drawing asks by default, of a feature of least squares.
        assert gaussian.with_form_by("minimum-zone").form.interval == pytest.approx(
            zone.form.interval, abs=1e-9
        )
        assert gaussian.with_form_by("gaussian") is gaussian

    def test_a_form_is_decided_by_the_minimum_zone(self) -> None:
        """A ridge of 6 µm beside one edge: least squares see more than the zone does."""
        x = np.array([-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0])
        at = np.array([[a, b, 6e-3 * (a == 20.0)] for a in x for b in (-10.0, 0.0, 10.0)])
        normals = np.tile([0.0, 0.0, 1.0], (len(at), 1))
        points = feature_points(at, normals, own=1e-5, shared={"map 1": np.full(len(at), 1e-5)})
        plane = measure_feature(points, "plane")
        zone = plane.with_form_by("minimum-zone").form
        assert zone.interval[1] < plane.form.interval[0]
        limit = 0.5 * (zone.interval[1] + plane.form.interval[0])
        by_zone = inspect_feature(plane, FeatureTolerances(form=limit))
        by_squares = inspect_feature(plane, FeatureTolerances(form=limit, form_by="gaussian"))
        assert by_zone.verdict is ConformityVerdict.CONFORMS
        assert by_squares.verdict is ConformityVerdict.DOES_NOT_CONFORM
        assert by_zone.feature.form_by == "minimum-zone"

    def test_points_without_uncertainty(self) -> None:
        """Their scatter stands for it: of three contacts the form from touch to touch is averaged,
        and one that is common to the face is not."""
        found = self._bore("inscribed", stated=False)
        diameter = found.quantity("diameter")
        scatter = found.errors.excess
        assert scatter > 1e-3
        own = np.sqrt(diameter.u**2 - diameter.parts[ONE_SIDED] ** 2)
        assert 2.0 * found.errors.form.rough / np.sqrt(3.0) <= own <= 2.0 * scatter
        # Any share of 3.75 µm of the radius can be noise: a rectangle from none to all.
        assert diameter.parts[ONE_SIDED] == pytest.approx(2.0 * 3.75e-3 / np.sqrt(3.0), rel=1e-6)

    def test_the_share_of_noise_in_closed_form(self) -> None:
        """Of a spread of 5 is 3 noise, and 4 form: without the noise it is 4/5 of itself."""
        form = FormOfPart(weights=np.array([0.75, 0.25]), rough_variances=np.array([16.0, 0.0]),
                          smooth_variances=np.zeros(2), family=np.zeros(2, dtype=int))  # fmt: skip
        assert form.share_of_noise(3.0) == pytest.approx(np.sqrt(0.75 * 0.2**2 + 0.25 * 1.0**2))

    @pytest.mark.long
    def test_u_contains_what_noise_does_to_a_perfect_bore(self) -> None:
        """By simulation: without the part by noise U covers 70 %; 100 sets scatter by 3 %."""
        outward, _ = around(12)
        rng, covered = np.random.default_rng(4), []
        for _ in range(100):
            noisy = (10.0 + OWN * rng.normal(size=(12, 1))) * outward
            points = feature_points(noisy, -outward, shared={"tip radius": np.zeros(12)})
            found = measure_feature(points, "bore", association="inscribed").quantity("diameter")
            covered.append(abs(found.value - 20.0) <= found.expanded_u)
        assert np.mean(covered) >= 0.92

    def test_a_tangent_plane_is_outside_the_material(self) -> None:
        """Also where the axis of the plane was given into the material."""
        rng = np.random.default_rng(8)
        flat = np.c_[rng.uniform(-30.0, 30.0, (20, 2)), E * rng.normal(size=20)]
        normals = np.tile([0.0, 0.0, -1.0], (20, 1))
        for axis in (None, (0.0, 0.0, 1.0)):
            found = measure_feature(
                feature_points(flat, normals), "plane", axis=axis, association="tangent"
            )
            height = (flat - found.association.point) @ normals[0]
            assert found.association.residuals.max() == pytest.approx(0.0, abs=NEAR)
            assert height.mean() < -0.5 * E

    @pytest.mark.slow
    def test_noise_moves_extreme_features_to_one_side(self) -> None:
        """The numbers of docs/how-to/measure-a-bore.md; means of 300 scatter by 0.05 σ."""
        outward, _ = around(12)
        rng, axis, sigma = np.random.default_rng(9), (0.0, 0.0, 1.0), 1e-3
        found, stated = [], []
        for _ in range(300):
            points = (10.0 + sigma * rng.normal(size=(12, 1))) * outward
            one = [associate_by(c, "circle", points, axis=axis)
                   for c in ("inscribed", "circumscribed", "minimum-zone", "gaussian")]  # fmt: skip
            assert one[0].diameter is not None
            assert one[0].diameter_row is not None
            assert one[1].diameter is not None
            stated.append(sigma * np.linalg.norm(one[0].diameter_row @ one[0].response))
            found.append([20.0 - one[0].diameter, one[1].diameter - 20.0, one[2].form, one[3].form])
        assert np.std(found, axis=0)[0] / sigma == pytest.approx(0.8, abs=0.1)
        assert np.mean(stated) / sigma == pytest.approx(1.3, abs=0.05)
        assert np.mean(found, axis=0) / sigma == pytest.approx([2.2, 2.2, 2.6, 2.9], abs=0.15)


@pytest.mark.parametrize(
    ("criterion", "kind", "words"),
    [
        ("inscribed", "circle", "do not surround the inscribed"),
        ("circumscribed", "circle", "do not surround the circumscribed"),
        ("inscribed", "plane", "a plane has no association 'inscribed'"),
        ("least", "plane", "'least' is not an association: gaussian, min"),
        ("tangent", "plane", "no normals that say on which side"),
        ("tangent", "circle", "no normals that say on which side"),
    ],
)
def test_what_is_refused(criterion: str, kind: str, words: str) -> None:
    """The points are an arc of 90°, which has no inscribed and no circumscribed circle."""
    turn = np.radians(np.arange(0.0, 100.0, 10.0))
    arc = np.c_[10.0 * np.cos(turn), 10.0 * np.sin(turn), np.zeros(10)]
    arc[::2] *= 1.0001
    with pytest.raises(PretravelError, match=words):
        associate_by(criterion, kind, arc)


@pytest.mark.parametrize("criterion", ["minimum-zone", "tangent"])
def test_the_search_ends_on_short_arcs(criterion: str) -> None:
    """On 10° the slopes of all contacts are nearly dependent: each one counts once."""
    rng = np.random.default_rng(57)
    for count in range(4, 20):
        turn = np.radians(rng.uniform(0.0, 10.0, count))
        radius = 10.0 + rng.normal(0.0, E, count)
        arc = np.c_[radius * np.cos(turn), radius * np.sin(turn), np.zeros(count)]
        axis = np.array([0.0, 0.0, 1.0])
        found = associate_by(criterion, "bore", arc, axis=axis)
        assert found.form <= associate("bore", arc, axis=axis).form * (1.0 + 1e-9)
        # A feature that grows with all points by the same amount, as any circle does.
        assert found.diameter_row is not None
        assert float(found.diameter_row @ found.response @ np.ones(count)) == pytest.approx(2.0)
