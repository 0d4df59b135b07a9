"""Features from points: closed forms, Monte Carlo (JCGM 101), form, messages."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import parse_placement
from pretravel.drawing.features.conformity import ConformityVerdict, size_conformity
from pretravel.drawing.features.feature_uncertainty import FORM_OF_PART
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.drawing.tasks.measure import Measure
from pretravel.drawing.tolerances.tolerances import FeatureTolerances, inspect_feature
from pretravel.files.points_writing import write_points
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.association import ASSOCIATIONS, associate
from pretravel.measurement.compensation import apply, embed
from pretravel.measurement.points import FIXED_SCATTER, Points
from pretravel.measurement.selection import points_of_features
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import mean_map
from tests.support.feature_points import OWN, TIP, around, feature_points, features

KINDS = tuple(ASSOCIATIONS)
Z = (0.0, 0.0, 1.0)
PLACE = parse_placement("120,-35,60,25,-40,70")


class TestCircleInClosedForm:
    """n equally spaced points: u²(D) = 4 (σ²/n + u_shared²), u²(x) = u²(y) = 2 σ²/n."""

    @pytest.mark.parametrize("kind", ["bore", "boss", "circle"])
    @pytest.mark.parametrize("count", [4, 8, 100])
    def test_diameter_and_centre(self, kind: str, count: int) -> None:
        """No number of points averages the tip radius out; the machine's part is added."""
        outward, _ = around(count)
        points = feature_points(10.0 * outward, outward if kind == "boss" else -outward)
        found = measure_feature(points, kind)
        diameter = found.quantity("diameter")
        assert diameter.u == pytest.approx(2.0 * np.sqrt(OWN**2 / count + TIP**2), rel=1e-9)
        assert diameter.parts["tip radius"] == pytest.approx(2.0 * TIP, rel=1e-9)
        for name in "xy":
            assert found.quantity(name).u == pytest.approx(np.sqrt(2.0 / count) * OWN, rel=1e-9)
        with_machine = measure_feature(points, kind, u_machine=0.002).quantity("diameter").u
        assert with_machine == pytest.approx(np.hypot(diameter.u, 0.002), rel=1e-12)

    def test_no_form_is_stated_with_a_predicted_map(self) -> None:
        """What the prediction misses of the probe may be all of it: a range remains, without U."""
        outward, _ = around(12)
        lobed = (10.0 + 4e-3 * np.cos(3.0 * np.arange(12) * np.pi / 6.0))[:, None] * outward
        points = apply(embed(lobed, -outward, mean_map(5e-3)), mean_map(5e-3))
        bore = measure_feature(points, "bore")
        assert [each.name for each in bore.stated] == ["diameter", "x", "y", "measured range"]
        (decided,) = inspect_feature(bore, FeatureTolerances(form=0.01)).conformities
        assert decided.verdict is ConformityVerdict.UNDECIDED
        assert np.isnan(decided.u)

    def test_a_lobe_of_the_map_moves_the_centre(self) -> None:
        """An error cos φ of the map is a shift of the centre by its full amount, not of size."""
        outward, _ = around(16)
        shared = {"map 1": 0.5e-3 * outward[:, 0]}
        points = feature_points(10.0 * outward, -outward, own=0.0, shared=shared)
        found = measure_feature(points, "bore")
        assert found.quantity("x").u == pytest.approx(0.5e-3, rel=1e-9)
        assert found.quantity("y").u == pytest.approx(0.0, abs=1e-12)
        # Rounding: 5e-4 mm through a fit whose equations are solved to some 1e-9 of it.
        assert found.quantity("diameter").u == pytest.approx(0.0, abs=1e-11)

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


@pytest.mark.parametrize("half_angle", [0.0, 15.0])
def test_normals_say_which_of_several_cylinders_or_cones_was_touched(half_angle: float) -> None:
    """Three touches at each of two heights, turned by 60°: the diameter was 1 to 7 mm off."""
    slope = np.radians(half_angle)
    for height in (6.0, 8.0, 12.0):
        turn = np.pi * np.arange(6) / 3.0 + 0.2
        up = height * np.resize([1.0, -1.0], 6)
        outward = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
        z = np.array(Z)
        normals = np.cos(slope) * outward - np.sin(slope) * z
        off = np.random.default_rng(3).normal(0.0, 2e-3, 6)
        at = (10.0 + up * np.tan(slope) + off)[:, None] * outward + up[:, None] * z
        kind = "cone" if half_angle else "cylinder"
        found = measure_feature(feature_points(at, normals), kind, at=(0.0, 0.0, 0.0))
        assert found.quantity("diameter").value == pytest.approx(20.0, abs=8e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_every_feature_is_as_uncertain_as_it_moves_with_its_points(kind: str) -> None:
    """Each point moved by 1 µm along its normal, the feature found again: the changes of every
    quantity, with the errors of the points by themselves and those in common."""
    positions, normals = features()[kind]
    rng = np.random.default_rng(4)
    count = len(positions)
    shared = {
        "tip radius": np.full(count, TIP),
        "map 1": 0.5e-3 * rng.normal(size=count),
        "map 2": 0.5e-3 * rng.normal(size=count),
    }
    points = feature_points(positions, normals, shared=shared)
    axis = normals.mean(axis=0) if kind in ("plane", "line") else Z
    at = (15.0, -8.0, 12.0)  # axes, planes and lines are evaluated outside their points
    stated = measure_feature(points, kind, axis=axis, at=at)

    def values(moved: FloatArray) -> FloatArray:
        fit = associate(kind, positions + moved[:, None] * normals, axis=axis, at=at)
        found = {stated.size_name: fit.diameter, "half angle": fit.half_angle}
        found |= {"ring diameter": fit.ring_diameter, **dict(zip("xyz", fit.point, strict=True))}
        return np.array([found[q.name] for q in stated.quantities], dtype=float)

    step = 1e-3
    change = np.array([values(step * one) - values(-step * one) for one in np.eye(count)])
    weights = change.T / (2.0 * step)
    common = weights @ np.array(list(shared.values())).T
    expected = np.sqrt(OWN**2 * np.sum(weights**2, axis=1) + np.sum(common**2, axis=1))
    # The fits end within 1e-9 mm, and a step of 1e-4 of the size changes the slopes by its square.
    assert [q.u for q in stated.quantities] == pytest.approx(expected, rel=1e-4, abs=1e-9)


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


def test_unknown_correlation_bounds_random_correlations() -> None:
    """Any correlation of the points' errors gives a covariance below the stated one."""
    rng = np.random.default_rng(2)
    positions, normals = features(9)["cylinder"]
    u = 1e-3
    worst = measure_feature(
        feature_points(positions, normals, own=u, shared={}, stated=False), "cylinder", axis=Z
    )
    for _ in range(12):
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

        common = measure_feature(feature_points(10.0 * outward, -outward, own=0.0), "bore")
        assert common.form.noise == pytest.approx(0.0, abs=1e-10)

    def test_lobes_are_found_and_do_not_make_the_size_less_certain(self) -> None:
        """Three lobes of 5 µm amplitude; the residuals' deviation 5/√2 µm is not noise."""
        outward, _ = around(24)
        lobes = 5e-3 * np.cos(3.0 * np.arange(24) * 2.0 * np.pi / 24)
        found = measure_feature(feature_points((10.0 + lobes)[:, None] * outward, -outward), "bore")
        assert found.form.measured == pytest.approx(10e-3, rel=1e-6)
        low, high = found.form.interval
        # Above: at least as much as errors narrow these lobes in 2.5 % of cases. With three tops
        # and three bottoms at the ends that is less than two standard deviations of the difference
        # of two points, 2.6 of one. Below: the range of the noise of all.
        columns = np.column_stack([outward[:, :2], np.ones(24)])
        moved = lobes + OWN * np.random.default_rng(4).standard_normal((4000, 24))
        moved -= moved @ np.linalg.pinv(columns).T @ columns.T
        narrowed = 10e-3 - np.quantile(np.ptp(moved, axis=1), 0.025)
        assert 10e-3 + narrowed < high < 10e-3 + 2.0 * OWN
        assert 10e-3 - 5.5 * OWN < low < found.form.value < 10e-3
        # What 24 touches show of the lobes is all of them, but for the noise. A part may be rough.
        expected = np.sqrt((24 * 25e-6 / 2.0 - 21 * OWN**2) / 24)
        assert found.errors.excess == pytest.approx(expected, rel=0.05)
        # Three lobes move the mean of 24 equal steps not at all; independent errors of this size
        # would by 2 expected / sqrt(24).
        assert found.quantity("diameter").parts[FORM_OF_PART] < 0.3 * 2.0 * expected / np.sqrt(24)

    @pytest.mark.long
    @pytest.mark.parametrize("shape", ["none", "rough, 0.4 µm"])
    @pytest.mark.parametrize("sets", [40, pytest.param(100, marks=pytest.mark.slow)])
    def test_the_form_lies_in_its_interval(self, shape: str, sets: int) -> None:
        """Of 40 points, in 95 % of the sets at least, whatever the shape; the measured range is
        larger by that of 40 errors, 4.3 of their deviation, where there is no form. Noise is taken
        for form in 1 of 100 sets by the limit; more than 5 have a probability of 0.1 %."""
        outward, _ = around(40)
        rng = np.random.default_rng(12)
        inside = bounds = formed = 0
        for _ in range(sets):
            form = np.zeros(40) if shape == "none" else 0.4e-3 * rng.normal(size=40)
            truth = associate("bore", (10.0 + form)[:, None] * outward, axis=Z).form
            moved = (10.0 + form + OWN * rng.normal(size=40))[:, None] * outward
            measured = measure_feature(feature_points(moved, -outward), "bore", axis=Z)
            found = measured.form
            low, high = found.interval
            inside += low <= truth + 1e-9 <= high
            bounds += low == 0.0
            formed += measured.errors.excess > 0.0
            assert found.measured > truth + 2.0 * OWN or shape != "none"
        fewest = sets * 0.9545 - 2.0 * np.sqrt(sets * 0.9545 * 0.0455)
        assert inside >= fewest
        assert bounds >= fewest or shape != "none"
        assert formed <= 5 or shape != "none"

    def test_without_known_correlations_the_bounds_are_wider(self) -> None:
        """Errors in common would not be seen in the residuals; opposite ones would be twice."""
        outward, _ = around(8)
        oval = 5e-3 * np.cos(2.0 * np.arange(8) * 2.0 * np.pi / 8)
        position = (10.0 + oval)[:, None] * outward
        known = measure_feature(feature_points(position, -outward), "bore").form
        unknown = measure_feature(feature_points(position, -outward, stated=False), "bore").form
        assert unknown.interval[1] > known.interval[1] + OWN


class TestFewResiduals:
    """What few residuals do not tell of the roughness of the part is in U."""

    @pytest.mark.parametrize(
        ("count", "rough", "factor", "within"),
        [
            (5, 20.0, 4.53, 0.12),
            (8, 20.0, 2.65, 0.12),
            (13, 20.0, 2.28, 0.12),
            (50, 1.0, 2.0, 0.02),
        ],
    )
    def test_a_rough_bore_has_the_factor_of_student(
        self, count: int, rough: float, factor: float, within: float
    ) -> None:
        """GUM, Table G.2, 95.45 %: 2, 5 and 10 degrees of freedom; the residuals are as large as
        twenty times the noise, so that nothing else is in u, and far below 10 µm. Two for
        many points of a perfect bore.

        The sizes of roughness that are tried end, and the noise below is known: 12 %.
        """
        outward, _ = around(count)
        noise, tip = 0.01 * OWN, {"tip radius": np.full(count, 0.01 * TIP)}
        off = rough * noise * np.random.default_rng(3).normal(size=count)
        points = feature_points((10.0 + off)[:, None] * outward, -outward, own=noise, shared=tip)
        diameter = measure_feature(points, "bore", axis=Z).quantity("diameter")
        assert diameter.expanded_u / diameter.u == pytest.approx(factor, rel=within)

    @pytest.mark.long
    def test_a_rough_bore_at_its_limit_is_seldom_accepted(self) -> None:
        """2.5 % of 200 decisions are 5; 13 are three and a half standard deviations of 2.2 more.
        With the normal distribution it is 16 and more."""
        outward, _ = around(5)
        rng = np.random.default_rng(8)
        accepted = 0
        for _ in range(200):
            off = np.hypot(OWN, 5.0 * OWN) * rng.normal(size=5)
            points = feature_points((10.0 + off)[:, None] * outward, -outward, shared={})
            size = measure_feature(points, "bore", axis=Z).quantity("diameter")
            found = size_conformity("d", size.value, size.u, (-np.inf, 20.0), 0.975, dof=size.dof)
            accepted += found.verdict is ConformityVerdict.CONFORMS
        assert accepted <= 13


def test_a_bore_touched_with_a_known_probe() -> None:
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
    # The tip of the radius alone is subtracted: the bore seems larger by 2 x 12 µm.
    assert diameter.uncompensated == pytest.approx(20.024, abs=1e-9)
    # Map (0.1 µm) and tip radius (0.2 µm) in full, repeatability averaged over 12.
    assert diameter.u == pytest.approx(2.0 * np.sqrt(1e-8 + 4e-8 + 9e-8 / 12), rel=1e-6)
    assert not bore.uncompensated_is_rebuilt
    rebuilt = measure_feature(replace(points, uncompensated=None), "bore")
    assert rebuilt.uncompensated_is_rebuilt
    assert rebuilt.quantity("diameter").uncompensated == pytest.approx(20.024, abs=1e-9)


def _refused_points() -> dict[str, tuple[FloatArray, FloatArray, str, dict[str, object], str]]:
    """Positions, normals, feature, options and what is said, by what is wrong."""
    outward, height = around(6, np.array([-3.0, 3.0]))
    ring = 10.0 * outward
    mixed = np.where(np.arange(6)[:, None] == 4, outward, -outward)
    twisted = ring + height[:, None] * np.array(Z)
    along = np.tile(Z, (6, 1))
    # Noise makes the ring an ellipse, which a tilted cylinder would fit.
    many, _ = around(15)
    noisy = (10.0 + OWN * np.random.default_rng(1).normal(size=15))[:, None] * many
    machine = r"uncertainty by the machine is .* negative"
    return {
        "a boss is not a bore": (ring, outward, "bore", {}, "this is a boss, not a bore"),
        "bore and boss": (ring, mixed, "bore", {}, "point 5 points to the other side"),
        "two heights": (
            twisted,
            -outward,
            "bore",
            {"axis": Z},
            r"one plane.* as a cylinder, or select",
        ),
        "one height": (noisy, -many, "cylinder", {}, r"as a circle|in one circle"),
        "normals along": (ring, along, "bore", {}, "lies along the surface of the bore"),
        "unknown": (ring, outward, "thread", {}, "'thread' is not a feature"),
        "two coordinates": (ring, -outward, "bore", {"at": [0, 0]}, r"needs x, y, z; .*\(2,\)"),
        **{
            f"u of {u}": (ring, -outward, "bore", {"u_machine": u}, machine)
            for u in (np.nan, np.inf, -1e-3)
        },
    }


@pytest.mark.parametrize("wrong", _refused_points())
def test_what_is_refused(wrong: str) -> None:
    positions, normals, kind, options, words = _refused_points()[wrong]
    with pytest.raises(PretravelError, match=words):
        measure_feature(feature_points(positions, normals), kind, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", KINDS)
def test_a_feature_turns_with_its_part(kind: str) -> None:
    """A feature turned and moved with its part, its points in another order, is the same."""
    positions, normals = features()[kind]
    rng = np.random.default_rng(11)
    moved = positions + 1e-3 * rng.normal(size=(len(positions), 1)) * normals
    shared = {"map 1": 0.5e-3 * rng.normal(size=len(positions))}
    here = feature_points(moved, normals, shared=shared)
    there = here.placed(PLACE)[rng.permutation(len(here))]
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
    assert second.form.measured == pytest.approx(first.form.measured, abs=1e-8)
    # Other trials of the noise, as the points have another order.
    assert second.form.value == pytest.approx(first.form.value, rel=0.05)
    assert second.position[0] == pytest.approx(first.position[0], abs=1e-8)
    assert np.linalg.eigvalsh(second.located_covariance) == pytest.approx(
        np.linalg.eigvalsh(first.located_covariance), rel=1e-5, abs=1e-14
    )
    for name in ("diameter", "half angle"):
        if name in {q.name for q in first.quantities}:
            mine, other = first.quantity(name), second.quantity(name)
            assert other.value == pytest.approx(mine.value, abs=1e-8)
            assert other.u == pytest.approx(mine.u, rel=1e-5)


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

    def test_labels_that_differ_in_case_or_blanks_are_said(self, tmp_path: Path) -> None:
        positions, normals = features()["bore"]
        names = [f"bore1-{i}" for i in range(len(positions))]
        names[2:4] = "Bore1-2", "bore1 -3"
        points = replace(feature_points(positions, normals), labels=tuple(names))
        write_points(tmp_path / "points.csv", points)
        for pattern, said in (("bore1-*", True), ("[Bb]ore1*", False)):
            task = Measure(points=tmp_path / "points.csv", feature="bore", select=(pattern,))
            told = " ".join(task.run().document().warnings)
            assert ("are not used: Bore1-2, bore1 -3" in told) is said

    def test_what_is_refused(self) -> None:
        positions, normals = features()["bore"]
        points = feature_points(positions, normals)
        with pytest.raises(PretravelError, match="no label of the 12 points matches"):
            points_of_features(points, ["x*"])
        with pytest.raises(PretravelError, match="form no groups"):
            points_of_features(points, by_prefix=True)
