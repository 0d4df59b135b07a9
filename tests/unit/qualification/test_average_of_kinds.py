"""An average of kinds of map: every field by hand, and where two kinds are said to disagree."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from pretravel.base.directions import sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.maps.kind import KindOfMap
from pretravel.maps.kinds import kind_named, kinds
from pretravel.maps.kinds.mean import MeanBasis, MeanKind
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.kinds.wozniak import WozniakKind
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.qualification import qualifying
from pretravel.qualification.kind_weights import _disagreement, averaged
from pretravel.qualification.qualification import KindScore, PreparedTouches, Qualification
from pretravel.qualification.qualifying import qualified, qualify, qualify_like
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance

UM = 1e-3
N = sphere_pattern_25()
TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@cache
def _results() -> tuple[Qualification, ...]:
    """A mean and a harmonic map of the same touches, with two micrometres of lobes."""
    lobes = 0.010 + 0.002 * N[:, 0] * N[:, 1] + 1e-4 * np.cos(np.arange(25.0))
    touches = Touches(N * (15.5 - lobes)[:, None] + [3.0, 4.0, 5.0], N)
    return tuple(
        qualify(touches, 25.0, tip_diameter=6.0, kind=kind, search_outliers=False)
        for kind in ("mean", "harmonic")
    )


def _parts(*weights: float) -> list[KindScore]:
    return [
        KindScore(name, 1.0, 0.1, 1.0, 0.0, weight)
        for name, weight in zip(("mean", "harmonic", "sectors"), weights, strict=False)
    ]


def _changed(
    result: Qualification, scatter: float, effect: float | None, outliers: float
) -> Qualification:
    made = result.pretravel_map
    vector = None if effect is None else effect * (1.0 + np.arange(made.basis.size))
    made = replace(
        made, fixed_scatter=scatter, delay_effect=vector, delay=1e-3, u_delay=1e-4, feed=0.0
    )
    return replace(result, pretravel_map=made, effect_of_outliers=outliers)


def test_the_average_has_the_weighted_fields_of_its_parts() -> None:
    """About the centre of the first: a centre moved by s adds n·s. Scatters add in squares, and
    the effects of the delay as the coefficients; the weights are made to add up to one."""
    mean, harmonic = _results()
    first, second = _changed(mean, 0.1 * UM, 2e-4, 0.5), _changed(harmonic, 0.3 * UM, 3e-4, 0.7)
    found = averaged([first, second], _parts(0.3, 0.1))
    made = found.pretravel_map
    values = [each.pretravel_map.pretravel(N) for each in (first, second)]
    values[1] = values[1] + N @ (first.center - second.center)
    expected = 0.75 * values[0] + 0.25 * values[1]
    assert made.pretravel(N) == pytest.approx(expected, abs=1e-12)
    assert found.residuals == pytest.approx(
        first.observed - made.pretravel(first.contact_normals), abs=1e-15
    )
    apart = second.center - first.center
    assert np.abs(apart).max() > 1e-4
    spread = 0.75 * first.center_covariance
    spread = spread + 0.25 * (second.center_covariance + np.outer(apart, apart))
    assert found.center_covariance == pytest.approx(spread, rel=1e-9)
    assert np.array_equal(found.own_center_covariance, first.center_covariance)
    assert made.fixed_scatter == pytest.approx(math.sqrt(0.75 * 0.01 + 0.25 * 0.09) * UM)
    assert found.effect_of_outliers == 0.7
    assert made.provenance.kind_settings == {"mean": 0.75, "harmonic": 0.25}
    assert made.kind == "averaged"
    effects = [each.pretravel_map.delay_effect for each in (first, second)]
    expected = np.concatenate([np.zeros(4), 0.75 * effects[0], 0.25 * effects[1]])
    assert made.delay_effect == pytest.approx(expected)
    assert made.coefficients.shape == made.delay_effect.shape
    assert found.warnings[: len(first.warnings)] == first.warnings


def test_parts_without_a_delay_add_nothing_to_its_effect() -> None:
    mean, harmonic = _results()
    second = _changed(harmonic, 0.0, None, 0.0)
    found = averaged([_changed(mean, 0.0, 2e-4, 0.0), second], _parts(0.6, 0.3)).pretravel_map
    expected = np.zeros(found.basis.size)
    expected[4] = 2e-4 * 2.0 / 3.0
    assert found.delay_effect == pytest.approx(expected)
    assert found.provenance.kind_settings == {"mean": 0.667, "harmonic": 0.333}
    assert averaged([mean, harmonic], _parts(0.6, 0.3)).pretravel_map.delay_effect is None


def test_two_kinds_of_three_are_compared() -> None:
    """A third one far from both is no matter of the sentence; that of the second is added."""
    mean, harmonic = _results()
    far = replace(mean.pretravel_map, coefficients=mean.pretravel_map.coefficients + 0.01)
    other = replace(mean, pretravel_map=far)
    same = averaged([mean, mean, other], _parts(0.4, 0.3, 0.3))
    assert same.warnings == mean.warnings
    apart = averaged([mean, other, harmonic], _parts(0.4, 0.3, 0.3))
    (added,) = apart.warnings[len(mean.warnings) :]
    assert "the kinds mean and harmonic disagree by 10.0 µm" in added


def _level(value: float, tip: float = 3.0, scatter: float = 0.0, center: object = None) -> object:
    """A constant map whose u is 0.1 µm, in a turned frame."""
    made = PretravelMap(
        MeanBasis(), np.array([value]), Covariance.independent([1e-8]), DirectionSupport(N),
        tip_radius=tip, fixed_scatter=scatter, rotation=TURN,
    )  # fmt: skip
    return SimpleNamespace(pretravel_map=made, center=np.zeros(3) if center is None else center)


@pytest.mark.parametrize(
    ("off", "scatter", "weight", "said"),
    [
        # Three times the root of 0.1² + 0.1² + 1² µm², 3.030 µm.
        (3.06, 1.0, 0.4, True), (3.00, 1.0, 0.4, False),
        (-3.06, 1.0, 0.4, True), (-3.00, 1.0, 0.4, False),
        # Half a micrometre at least, which is more than three times 0.141 µm.
        (0.51, 0.0, 0.4, True), (0.49, 0.0, 0.4, False), (-0.51, 0.0, 0.4, True),
        # The second kind has a quarter of the weight at least.
        (0.9, 0.0, 0.26, True), (0.9, 0.0, 0.24, False),
    ],
)  # fmt: skip
def test_disagreement_begins_at_three_uncertainties(
    off: float, scatter: float, weight: float, said: bool
) -> None:
    found = _disagreement(
        [_level(0.01, scatter=scatter * UM), _level(0.01 + off * UM)],  # type: ignore[list-item]
        _parts(1.0 - weight, weight),
    )
    assert len(found) == said
    assert not said or f"disagree by {abs(off):.1f} µm at" in found[0]


def test_kinds_are_compared_about_one_centre_and_with_one_tip() -> None:
    """A larger tip has more pretravel, and a centre at s has s·n more: these say the same. In the
    machine's frame along x, which is the axis of this probe, 3 µm are apart."""
    parts, first = _parts(0.6, 0.4), _level(0.01)
    assert _disagreement([first, _level(0.013, tip=3.003)], parts) == []  # type: ignore[list-item]
    (said,) = _disagreement([first, _level(0.01, tip=3.003)], parts)  # type: ignore[list-item]
    assert "disagree by 3.0 µm" in said
    moved = _level(0.01, center=np.array([-3.0 * UM, 0.0, 0.0]))
    (said,) = _disagreement([first, moved], parts)  # type: ignore[list-item]
    assert "disagree by 3.0 µm at polar 0" in said


def test_kinds_that_disagree_are_named_where_they_do_most() -> None:
    """In a table along the axis and four ways of the equator, towards +y."""
    nodes = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=float)
    support = DirectionSupport(nodes)
    first, second = (
        SimpleNamespace(
            pretravel_map=PretravelMap(
                TabulatedBasis(support), np.array([0.01, 0.01, value, 0.01, 0.01]),
                Covariance.independent([1e-8] * 5), support, tip_radius=3.0,
            ),
            center=np.zeros(3),
        )
        for value in (0.01, 0.013)
    )  # fmt: skip
    (said,) = _disagreement([first, second], _parts(0.6, 0.4))  # type: ignore[list-item]
    assert "the kinds mean and harmonic disagree by 3.0 µm at polar 90" in said
    assert "azimuth 90" in said


def test_one_kind_is_no_average() -> None:
    touches = Touches(N * 15.49, N)
    setup = QualificationSetup(25.0, tip_diameter=6.0)
    found = qualified(touches, setup, [MeanKind()])
    assert (found.kind, found.pretravel_map.kind) == (MeanKind(), "mean")
    assert [(score.kind, score.weight) for score in found.scores] == [("mean", 1.0)]
    few = Touches(N[:7] * 15.49, N[:7])
    with pytest.raises(PretravelError, match="no kind of map fits these touches: 7 directions"):
        qualified(few, setup, [kind_named("physical")])


@pytest.mark.long
def test_auto_compares_all_kinds_and_several_those(monkeypatch: pytest.MonkeyPatch) -> None:
    """In one thread for matrices."""
    given: list[list[KindOfMap]] = []
    result = _results()[0]
    threads: set[int] = set()

    def average(_: PreparedTouches, made: list[tuple[KindOfMap, Qualification]]) -> Qualification:
        given.append([kind for kind, _ in made])
        blas = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
        threads.update(pool["num_threads"] for pool in blas)
        return result

    monkeypatch.setattr(qualifying, "_on_average", average)
    touches, setup, own = Touches(N * 15.49, N), QualificationSetup(25.0, 6.0), WozniakKind(0.3)
    assert qualified(touches, setup, [own, MeanKind()]) is result
    assert qualified(touches, setup) is result
    assert given == [[own, MeanKind()], [*kinds().values()]]
    assert threads == {1}
    chosen = qualified(touches, setup, MeanKind())
    assert (chosen.pretravel_map.kind, chosen.scores) == ("mean", ())


def test_an_averaged_map_is_made_again_as_an_average(monkeypatch: pytest.MonkeyPatch) -> None:
    """With its setup, but for the reference, which is the new one."""
    mean, harmonic = _results()
    earlier = averaged([mean, harmonic], _parts(0.6, 0.4)).pretravel_map
    seen: list[tuple[object, ...]] = []

    def chosen(*given: object) -> object:
        seen.append(given)
        return "again"

    monkeypatch.setattr(qualifying, "qualified", chosen)
    touches = Touches(N * 15.49, N)
    assert qualify_like(touches, earlier, 30.0, ring=True) == "again"
    assert qualify_like(touches, earlier, 25.0) == "again"
    setup = earlier.provenance.setup
    assert setup is not None
    assert seen[0] == (touches, replace(setup, diameter=30.0, ring=True))
    assert seen[1] == (touches, setup)


def test_a_map_without_its_setup_states_what_it_contains(monkeypatch: pytest.MonkeyPatch) -> None:
    made = _level(0.01).pretravel_map  # type: ignore[attr-defined]
    seen: list[QualificationSetup] = []
    monkeypatch.setattr(qualifying, "qualified", lambda _, setup, kind: seen.append(setup))
    qualify_like(Touches(N * 15.49, N), replace(made, u_tip_radius=2e-4), 25.0)
    expected = QualificationSetup(
        25.0, tip_diameter=6.0, u_diameter=4e-4, u_temperature=0.0, sphere_form=0.0,
        axis=(1.0, 0.0, 0.0),
    )  # fmt: skip
    assert seen == [expected]


def test_what_is_not_averaged_is_that_of_the_first() -> None:
    mean, harmonic = _results()
    first, second = _changed(mean, 0.0, 2e-4, 0.0), _changed(harmonic, 0.0, 3e-4, 0.0)
    other = replace(
        second.pretravel_map,
        repeatability=7e-4, repeatability_dof=3.0, u_delay=5e-4, delay=2e-3, feed=80.0,
        u_tip_radius=9e-4, provenance=replace(second.pretravel_map.provenance, source="other"),
    )  # fmt: skip
    found = averaged([first, replace(second, pretravel_map=other)], _parts(0.3, 0.1))
    names = ("tip_radius", "u_tip_radius", "repeatability", "repeatability_dof", "delay", "feed")
    for name in (*names, "u_delay"):
        assert getattr(found.pretravel_map, name) == getattr(first.pretravel_map, name), name
    # The centre is that of the average, and the map states its covariance in the probe's frame.
    stated, rotation = (
        found.pretravel_map.provenance.center_covariance,
        found.pretravel_map.rotation,
    )
    assert rotation @ np.array(stated) @ rotation.T == pytest.approx(found.center_covariance)
    own = replace(found.pretravel_map.provenance, kind_settings={}, center_covariance=None)
    assert own == replace(first.pretravel_map.provenance, kind_settings={}, center_covariance=None)
    assert own != replace(other.provenance, kind_settings={}, center_covariance=None)
