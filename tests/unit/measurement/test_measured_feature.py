"""Features from points: closed forms, Monte Carlo (JCGM 101), form, messages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import parse_placement
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.association import ASSOCIATIONS, associate
from pretravel.measurement.compensation import apply, embed
from pretravel.measurement.conformity import ConformityVerdict, size_conformity
from pretravel.measurement.measured_feature import measure_feature
from pretravel.measurement.points import FIXED_SCATTER, Points, placed
from pretravel.measurement.selection import points_at, points_of_features
from pretravel.uncertainty.covariance import Covariance
from tests.support.feature_points import OWN, TIP, around, feature_points, features

KINDS = tuple(ASSOCIATIONS)
Z = (0.0, 0.0, 1.0)
PLACE = parse_placement("120,-35,60,25,-40,70")


class TestCircleInClosedForm:
    """n equally spaced points: u²(D) = 4 (σ²/n + u_shared²), u²(x) = u²(y) = 2 σ²/n."""

    @pytest.mark.parametrize("kind", ["bore", "boss", "circle"])
    @pytest.mark.parametrize("count", [4, 8, 24])
    def test_diameter_and_centre(self, kind: str, count: int) -> None:
        outward, _ = around(count)
        normals = outward if kind == "boss" else -outward
        found = measure_feature(feature_points(10.0 * outward, normals), kind)
        assert found.quantity("diameter").u == pytest.approx(
            2.0 * np.sqrt(OWN**2 / count + TIP**2), rel=1e-9
        )
        for name in "xy":
            assert found.quantity(name).u == pytest.approx(np.sqrt(2.0 / count) * OWN, rel=1e-9)

    def test_errors_in_common_do_not_average_out(self) -> None:
        """With a thousand points the diameter keeps 2 u of the tip radius."""
        outward, _ = around(1000)
        found = measure_feature(feature_points(10.0 * outward, -outward), "bore")
        diameter = found.quantity("diameter")
        assert diameter.parts["tip radius"] == pytest.approx(2.0 * TIP, rel=1e-9)
        assert diameter.u == pytest.approx(2.0 * TIP, rel=0.01)

    def test_a_lobe_of_the_map_moves_the_centre(self) -> None:
        """An error cos φ of the map is a shift of the centre by its full amount, not of size."""
        outward, _ = around(16)
        shared = {"map 1": 0.5e-3 * outward[:, 0]}
        points = feature_points(10.0 * outward, -outward, own=0.0, shared=shared)
        found = measure_feature(points, "bore")
        assert found.quantity("x").u == pytest.approx(0.5e-3, rel=1e-9)
        assert found.quantity("y").u == pytest.approx(0.0, abs=1e-12)
        assert found.quantity("diameter").u == pytest.approx(0.0, abs=1e-12)

    def test_unknown_correlation_gives_the_largest_uncertainty(self) -> None:
        """Fully common errors are the worst case of a diameter: 2 u in full."""
        outward, _ = around(12)
        points = feature_points(10.0 * outward, -outward, stated=False)
        found = measure_feature(points, "bore")
        assert not found.errors.correlation_known
        assert found.quantity("diameter").u == pytest.approx(2.0 * np.hypot(OWN, TIP), rel=1e-9)

    def test_a_conical_wall(self) -> None:
        """On a wall inclined by 30° an error along the normal moves a point by cos 30° outward."""
        outward, _ = around(8)
        normals = -np.cos(np.pi / 6) * outward + np.sin(np.pi / 6) * np.array(Z)
        found = measure_feature(feature_points(10.0 * outward, normals), "circle", axis=Z)
        parts = found.quantity("diameter").parts
        assert parts["tip radius"] == pytest.approx(2.0 * TIP * np.cos(np.pi / 6), rel=1e-9)

    def test_other_causes_are_added(self) -> None:
        outward, _ = around(8)
        points = feature_points(10.0 * outward, -outward)
        plain = measure_feature(points, "bore").quantity("diameter").u
        with_machine = measure_feature(points, "bore", u_machine=0.002).quantity("diameter").u
        assert with_machine == pytest.approx(np.hypot(plain, 0.002), rel=1e-12)


@pytest.mark.parametrize("draws", [120, pytest.param(400, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS)
def test_every_feature_against_trials(kind: str, draws: int) -> None:
    """Points with drawn errors, each set fitted anew: the scatter is the stated uncertainty."""
    positions, normals = features()[kind]
    rng = np.random.default_rng(4)
    count = len(positions)
    shared = {
        "tip radius": np.full(count, TIP),
        "map 1": 0.5e-3 * rng.normal(size=count),
        "map 2": 0.5e-3 * rng.normal(size=count),
    }
    points = feature_points(positions, normals, shared=shared)
    axis = normals.mean(axis=0) if kind in ("plane", "line") else (0.0, 0.0, 1.0)
    at = (15.0, -8.0, 12.0)  # axes, planes and lines are evaluated outside their points
    stated = measure_feature(points, kind, axis=axis, at=at)
    trials = []
    factors = np.array(list(shared.values()))
    for _ in range(draws):
        errors = OWN * rng.normal(size=count) + rng.normal(size=len(factors)) @ factors
        fit = associate(kind, positions + errors[:, None] * normals, axis=axis, at=at)
        values = {stated.size_name: fit.diameter, "half angle": fit.half_angle}
        values["ring diameter"] = fit.ring_diameter
        values |= dict(zip("xyz", fit.point, strict=True))
        trials.append([values[q.name] for q in stated.quantities])
    # A deviation of n trials scatters by 1/√(2n); four of that.
    allowed = 4.0 / np.sqrt(2.0 * draws)
    assert np.std(trials, axis=0) == pytest.approx([q.u for q in stated.quantities], rel=allowed)


class TestFixedScatter:
    """What repeats of a direction do not reduce: common to points with the same normal."""

    FIXED = 0.5e-3

    def _points(self, positions: FloatArray, normals: FloatArray) -> Points:
        shared = {FIXED_SCATTER: np.full(len(positions), self.FIXED)}
        return feature_points(positions, normals, shared=shared)

    def test_a_plane_keeps_it_in_full(self) -> None:
        positions, normals = features()["plane"]
        found = measure_feature(self._points(positions, normals), "plane")
        expected = np.sqrt(OWN**2 / len(positions) + self.FIXED**2)
        assert found.quantity("z").u == pytest.approx(expected, rel=1e-9)
        # It moves all points alike, so that it is no form; d2 = 3.258 for 12, dof 9 of 12.
        assert found.form.noise == pytest.approx(3.258 * np.sqrt(9 / 12) * OWN, rel=0.05)

    def test_a_bore_averages_it_over_its_directions(self) -> None:
        outward, _ = around(8)
        twice = np.vstack([outward, outward])  # every place touched twice
        found = measure_feature(self._points(10.0 * twice, -twice), "bore")
        expected = 2.0 * np.sqrt(OWN**2 / 16 + self.FIXED**2 / 8)
        assert found.quantity("diameter").u == pytest.approx(expected, rel=1e-9)

    def test_it_is_expected_in_the_residuals(self) -> None:
        """Residuals of this size are not taken for form of the part."""
        outward, _ = around(24)
        rng = np.random.default_rng(7)
        radius = 10.0 + np.hypot(OWN, self.FIXED) * rng.normal(size=24)
        found = measure_feature(self._points(radius[:, None] * outward, -outward), "bore")
        assert found.errors.excess == 0.0


class TestBesideThePoints:
    """One common error that grows along the part, evaluated where it is largest."""

    @pytest.mark.parametrize(("kind", "coordinate"), [("plane", "z"), ("line", "y")])
    def test_a_tilt_carries_the_offset_with_it(self, kind: str, coordinate: str) -> None:
        """An error of 1 µm (1 + x/10 mm) is 3 µm at x = 20 mm."""
        positions, normals = features()[kind]
        shared = {"map 1": 1e-3 * (1.0 + positions[:, 0] / 10.0)}
        points = feature_points(positions, normals, own=0.0, shared=shared)
        found = measure_feature(points, kind, at=(20.0, 0.0, 0.0))
        assert found.quantity(coordinate).u == pytest.approx(3e-3, rel=1e-6)

    def test_the_diameter_of_a_cone_follows_its_angle(self) -> None:
        """d(r + h tan α)/dα = h / cos²α, at h = 12 mm from the middle of the points."""
        positions, normals = features()["cone"]
        angle_alone = associate("cone", positions).jacobian[:, 5]
        points = feature_points(positions, normals, own=0.0, shared={"map 1": 1e-5 * angle_alone})
        found = measure_feature(points, "cone", at=(0.0, 0.0, 12.0))
        assert found.quantity("half angle").u == pytest.approx(1e-5, rel=1e-6)
        expected = 2.0 * 12.0 / np.cos(np.radians(20.0)) ** 2 * 1e-5
        assert found.quantity("diameter").u == pytest.approx(expected, rel=1e-6)


def test_unknown_correlation_bounds_random_correlations() -> None:
    """Any correlation of the points' errors gives a covariance below the stated one."""
    rng = np.random.default_rng(2)
    positions, normals = features(9)["cylinder"]
    u = 1e-3
    worst = measure_feature(
        feature_points(positions, normals, own=u, shared={}, stated=False), "cylinder", axis=Z
    )
    for _ in range(50):
        factors = rng.normal(size=(rng.integers(1, 5), 9))
        factors *= u / np.linalg.norm(factors, axis=0)
        shared = {f"map {k + 1}": row for k, row in enumerate(factors)}
        found = measure_feature(
            feature_points(positions, normals, own=0.0, shared=shared), "cylinder", axis=Z
        )
        excess = worst.located_covariance - found.located_covariance
        assert np.linalg.eigvalsh(excess)[0] > -1e-15
        for mine, largest in zip(found.quantities, worst.quantities, strict=True):
            assert mine.u <= largest.u * (1.0 + 1e-9)


class TestForm:
    def test_noise_alone(self) -> None:
        """The mean range of n normal errors is d2 σ: 2.326 σ for 5 (tables of control charts).

        Residuals of a circle through many points are these errors nearly unchanged, hence the
        range of 24 is compared: d2 = 3.895, reduced by the fit of 3 parameters, sqrt(21/24).
        """
        outward, _ = around(24)
        found = measure_feature(feature_points(10.0 * outward, -outward), "bore")
        assert found.form.noise == pytest.approx(3.895 * np.sqrt(21 / 24) * OWN, rel=0.03)
        assert found.form.value == pytest.approx(0.0, abs=1e-12)
        # Studentized range, 5 % for 24 and a known deviation: 5.14 (interpolated in the tables).
        assert found.form.most_noise == pytest.approx(5.14 * np.sqrt(21 / 24) * OWN, rel=0.03)

    def test_errors_in_common_are_no_form(self) -> None:
        outward, _ = around(24)
        points = feature_points(10.0 * outward, -outward, own=0.0)
        assert measure_feature(points, "bore").form.noise == pytest.approx(0.0, abs=1e-10)

    def test_lobes_are_found_and_make_the_size_less_certain(self) -> None:
        """Three lobes of 5 µm amplitude; the residuals' deviation 5/√2 µm is not noise."""
        outward, _ = around(24)
        lobes = 5e-3 * np.cos(3.0 * np.arange(24) * 2.0 * np.pi / 24)
        found = measure_feature(feature_points((10.0 + lobes)[:, None] * outward, -outward), "bore")
        assert found.form.measured == pytest.approx(10e-3, rel=1e-6)
        low, high = found.form.interval
        # Two standard deviations of the difference of two points (each reduced by the fit of 3
        # parameters to 24) above; the range of the noise of all below.
        assert high == pytest.approx(10e-3 + 2.0 * np.sqrt(2.0 * 21 / 24) * OWN, rel=0.01)
        assert 10e-3 - 5.5 * OWN < low < found.form.value < 10e-3
        expected = np.sqrt((24 * 25e-6 / 2.0 - 21 * OWN**2) / 21)
        assert found.errors.excess == pytest.approx(expected, rel=1e-6)

    @pytest.mark.parametrize(
        ("shape", "only_a_bound"),
        [
            ("none", 93),  # 95 of 100, within a standard deviation of 2.2
            ("four lobes of 2 µm", 0),
            ("rough, 0.4 µm", 0),
            ("one scratch of 1 µm", 0),
        ],
    )
    def test_the_form_lies_in_its_interval(self, shape: str, only_a_bound: int) -> None:
        """Of 40 points, in 95 of 100 sets at least, whatever the shape; the measured range is
        larger by that of 40 errors, 4.3 of their deviation, where there is no form."""
        outward, _ = around(40)
        rng = np.random.default_rng(12)
        inside = bounds = 0
        for _ in range(100):
            form = {
                "none": np.zeros(40),
                "four lobes of 2 µm": 2e-3 * np.cos(4.0 * np.arange(40) * 2.0 * np.pi / 40),
                "rough, 0.4 µm": 0.4e-3 * rng.normal(size=40),
                "one scratch of 1 µm": 1e-3 * (np.arange(40) == 7),
            }[shape]
            truth = associate("bore", (10.0 + form)[:, None] * outward, axis=Z).form
            moved = (10.0 + form + OWN * rng.normal(size=40))[:, None] * outward
            found = measure_feature(feature_points(moved, -outward), "bore", axis=Z).form
            low, high = found.interval
            inside += low <= truth + 1e-9 <= high
            bounds += low == 0.0
            assert found.measured > truth + 2.0 * OWN or shape != "none"
        assert inside >= 93  # two standard deviations of 100 sets below 95.45 is 91.3
        assert bounds >= only_a_bound

    def test_without_known_correlations_the_bounds_are_wider(self) -> None:
        """Errors in common would not be seen in the residuals; opposite ones would be twice."""
        outward, _ = around(8)
        oval = 5e-3 * np.cos(2.0 * np.arange(8) * 2.0 * np.pi / 8)
        position = (10.0 + oval)[:, None] * outward
        known = measure_feature(feature_points(position, -outward), "bore").form
        unknown = measure_feature(feature_points(position, -outward, stated=False), "bore").form
        assert unknown.interval[1] > known.interval[1] + OWN

    def test_noise_is_seldom_taken_for_form(self) -> None:
        """At most 1 of 100 by the limit; of 150 sets, more than 6 have a probability of 0.1 %."""
        outward, _ = around(10)
        rng = np.random.default_rng(6)
        found = 0
        for _ in range(150):
            moved = (10.0 + OWN * rng.normal(size=10))[:, None] * outward
            points = feature_points(moved, -outward)
            found += measure_feature(points, "bore").errors.excess > 0.0
        assert found <= 6


class TestFewResiduals:
    """What few residuals do not tell of the roughness of the part is in U."""

    @pytest.mark.parametrize(("count", "factor"), [(5, 4.53), (8, 2.65), (13, 2.28)])
    def test_a_rough_bore_has_the_factor_of_student(self, count: int, factor: float) -> None:
        """GUM, Table G.2, 95.45 %: 2, 5 and 10 degrees of freedom; the residuals are as large as
        twenty times the noise, so that nothing else is in u."""
        outward, _ = around(count)
        rng = np.random.default_rng(3)
        rough = 20.0 * OWN * rng.normal(size=count)
        points = feature_points((10.0 + rough)[:, None] * outward, -outward)
        diameter = measure_feature(points, "bore", axis=Z).quantity("diameter")
        # The sizes of roughness that are tried end, and the noise below is known.
        assert diameter.expanded_u / diameter.u == pytest.approx(factor, rel=0.12)

    def test_many_points_of_a_perfect_bore_have_two(self) -> None:
        outward, _ = around(50)
        radius = 10.0 + OWN * np.random.default_rng(1).normal(size=50)
        points = feature_points(radius[:, None] * outward, -outward)
        diameter = measure_feature(points, "bore").quantity("diameter")
        assert diameter.expanded_u == pytest.approx(2.0 * diameter.u, rel=0.02)

    @pytest.mark.parametrize("count", [5, 8])
    def test_a_rough_bore_at_its_limit_is_seldom_accepted(self, count: int) -> None:
        """2.5 % of 200 decisions are 5; 13 are three and a half standard deviations of 2.2 more.
        With the normal distribution it is 16 and more."""
        outward, _ = around(count)
        rng = np.random.default_rng(8)
        accepted = 0
        for _ in range(200):
            off = np.hypot(OWN, 5.0 * OWN) * rng.normal(size=count)
            points = feature_points((10.0 + off)[:, None] * outward, -outward, shared={})
            size = measure_feature(points, "bore", axis=Z).quantity("diameter")
            found = size_conformity("d", size.value, size.u, (-np.inf, 20.0), 0.975, dof=size.dof)
            accepted += found.verdict is ConformityVerdict.CONFORMS
        assert accepted <= 13


class TestBeforeAndAfter:
    def test_a_bore_touched_with_a_known_probe(self) -> None:
        """Simulated touches of a bore of 20 mm: 12 µm of pretravel make it 24 µm too large."""
        pretravel_map = PretravelMap(
            MeanBasis(), np.array([0.012]), Covariance.independent([1e-8]),
            DirectionSupport(sphere_pattern_25()),
            tip_radius=3.0, u_tip_radius=2e-4, repeatability=3e-4,
        )  # fmt: skip
        outward, _ = around(12)
        touches = embed(10.0 * outward + [40.0, 30.0, -5.0], -outward, pretravel_map)
        points = apply(touches, pretravel_map)
        bore = measure_feature(points, "bore")
        diameter = bore.quantity("diameter")
        assert diameter.value == pytest.approx(20.0, abs=1e-9)
        # The tip of the radius alone is taken off: the bore seems larger by 2 x 12 µm.
        assert diameter.uncompensated == pytest.approx(20.024, abs=1e-9)
        # Map (0.1 µm) and tip radius (0.2 µm) in full, repeatability averaged over 12.
        assert diameter.u == pytest.approx(2.0 * np.sqrt(1e-8 + 4e-8 + 9e-8 / 12), rel=1e-6)
        assert not bore.uncompensated_is_rebuilt
        rebuilt = measure_feature(replace(points, uncompensated=None), "bore")
        assert rebuilt.uncompensated_is_rebuilt
        assert rebuilt.quantity("diameter").uncompensated == pytest.approx(20.024, abs=1e-9)


class TestMessages:
    def test_a_boss_is_no_bore(self) -> None:
        outward, _ = around(6)
        with pytest.raises(PretravelError, match="this is a boss, not a bore"):
            measure_feature(feature_points(10.0 * outward, outward), "bore")

    def test_bore_and_boss_mixed(self) -> None:
        outward, _ = around(6)
        normals = np.where(np.arange(6)[:, None] == 4, outward, -outward)
        with pytest.raises(PretravelError, match="point 5 points to the other side"):
            measure_feature(feature_points(10.0 * outward, normals), "bore")

    def test_a_circle_of_two_heights(self) -> None:
        outward, height = around(6, np.array([-3.0, 3.0]))
        points = feature_points(10.0 * outward + height[:, None] * [0.0, 0.0, 1.0], -outward)
        with pytest.raises(PretravelError, match="do not lie in one plane"):
            measure_feature(points, "bore", axis=(0, 0, 1))

    def test_a_cylinder_of_one_height(self) -> None:
        """Noise makes the ring an ellipse, which a tilted cylinder would fit."""
        outward, _ = around(15)
        radius = 10.0 + OWN * np.random.default_rng(1).normal(size=15)
        points = feature_points(radius[:, None] * outward, -outward)
        with pytest.raises(PretravelError, match=r"as a circle|in one circle"):
            measure_feature(points, "cylinder")

    def test_a_normal_along_the_surface(self) -> None:
        outward, _ = around(6)
        normals = np.tile([0.0, 0.0, 1.0], (6, 1))
        with pytest.raises(PretravelError, match="lies along the surface of the bore"):
            measure_feature(feature_points(10.0 * outward, normals), "bore")

    @pytest.mark.parametrize("u", [np.nan, np.inf, -1e-3])
    def test_an_uncertainty_that_is_none(self, u: float) -> None:
        outward, _ = around(6)
        with pytest.raises(PretravelError, match=r"uncertainty by the machine is .* negative"):
            measure_feature(feature_points(10.0 * outward, -outward), "bore", u_machine=u)

    def test_unknown_feature(self) -> None:
        outward, _ = around(6)
        with pytest.raises(PretravelError, match="'thread' is not a feature"):
            measure_feature(feature_points(outward, outward), "thread")


class TestEquivariance:
    """A feature turned and moved with its part has the same sizes, forms and uncertainties."""

    @pytest.mark.parametrize("kind", KINDS)
    def test_rotation_and_translation(self, kind: str) -> None:
        positions, normals = features()[kind]
        rng = np.random.default_rng(11)
        moved = positions + 1e-3 * rng.normal(size=(len(positions), 1)) * normals
        shared = {"map 1": 0.5e-3 * rng.normal(size=len(positions))}
        here = feature_points(moved, normals, shared=shared)
        there = placed(here, PLACE)
        at = np.array([0.2, 0.1, -0.3])
        axis = None if kind in ("plane", "line") else np.array([0.0, 0.0, 1.0])
        first = measure_feature(here, kind, at=at, axis=axis)
        second = measure_feature(
            there, kind, at=PLACE.points(at[None])[0],
            axis=None if axis is None else PLACE.vectors(axis[None])[0],
        )  # fmt: skip
        # The last steps of a search leave 1e-9 mm.
        assert second.association.point == pytest.approx(
            PLACE.points(first.association.point[None])[0], abs=1e-8
        )
        assert second.form.value == pytest.approx(first.form.value, abs=1e-8)
        assert second.position[0] == pytest.approx(first.position[0], abs=1e-8)
        assert np.linalg.eigvalsh(second.located_covariance) == pytest.approx(
            np.linalg.eigvalsh(first.located_covariance), rel=1e-5, abs=1e-14
        )
        for name in ("diameter", "half angle"):
            if name in {q.name for q in first.quantities}:
                mine, other = first.quantity(name), second.quantity(name)
                assert other.value == pytest.approx(mine.value, abs=1e-8)
                assert other.u == pytest.approx(mine.u, rel=1e-5)

    def test_order_of_the_points_does_not_matter(self) -> None:
        positions, normals = features()["cylinder"]
        points = feature_points(positions, normals)
        mixed = points_at(points, np.random.default_rng(1).permutation(len(points)))
        first, second = measure_feature(points, "cylinder"), measure_feature(mixed, "cylinder")
        for mine, other in zip(first.quantities, second.quantities, strict=True):
            assert other.u == pytest.approx(mine.u, rel=1e-6)
            assert other.value == pytest.approx(mine.value, abs=1e-9)


class TestSelection:
    def test_patterns_and_prefixes(self) -> None:
        positions, normals = features()["bore"]
        labels = tuple(f"bore{1 + i // 6}-{1 + i % 6}" for i in range(12))
        points = replace(feature_points(positions, normals), labels=labels)
        assert list(points_of_features(points)) == [""]
        assert {k: len(v) for k, v in points_of_features(points, by_prefix=True).items()} == {
            "bore1": 6, "bore2": 6,
        }  # fmt: skip
        chosen = points_of_features(points, ["bore2*", "*-1"])
        assert [p.labels[-1] for p in chosen.values()] == ["bore2-6", "bore2-1"]
        assert chosen["bore2*"].shared is not None
        assert len(chosen["bore2*"].shared["tip radius"]) == 6

    def test_what_is_refused(self) -> None:
        positions, normals = features()["bore"]
        points = feature_points(positions, normals)
        with pytest.raises(PretravelError, match="no label of the 12 points matches"):
            points_of_features(points, ["x*"])
        with pytest.raises(PretravelError, match="form no groups"):
            points_of_features(points, by_prefix=True)
