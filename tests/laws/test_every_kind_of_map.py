"""Laws of all kinds of map: a new kind is tested once it is among the entry points.

Kinds that are fitted are made here from simulated touches; a basis that no fit makes needs a map
in `_not_fitted`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pretravel.base.directions import (
    azimuth_angle,
    fibonacci_cap,
    from_angles,
    grid,
    polar_angle,
    sphere_pattern_25,
    unit,
)
from pretravel.base.errors import ExtrapolationError
from pretravel.base.frames import probe_rotation
from pretravel.controls.lookup_formula import exact_lookup
from pretravel.controls.lookup_table import lookup_table
from pretravel.files.map_file import read_map, write_map
from pretravel.files.map_json import json_of_map
from pretravel.maps.kinds import kinds
from pretravel.maps.kinds.averaged import averaged_map
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.spherical_harmonics import real_spherical_harmonics
from pretravel.measurement.compensation import apply, embed
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.response import probe_response, response_map
from pretravel.prediction.trigger import predict, predicted_map
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance

AXIS = (0.48, 0.64, 0.6)
PROBE = load_probe("omp40-2-100mm-carbide")
TURNED = replace(PROBE, orientation=replace(PROBE.orientation, axis=AXIS, rotation=0.3))
SMOOTH = ("mean", "harmonic")
CAP = fibonacci_cap(300, np.radians(88.0))


@cache
def _touches() -> Touches:
    """25 directions twice, with noise, of a probe whose axis is tilted in the machine."""
    n = np.tile(sphere_pattern_25(), (2, 1))
    noise = np.random.default_rng(1).normal(0.0, 3e-4, len(n))
    distance = 15.5 - predict(PROBE, n).pretravel + noise
    normals = n @ probe_rotation(AXIS).T
    positions = normals * distance[:, None] + [10.0, 20.0, 30.0]
    return Touches(positions, normals, feeds=np.full(len(n), 50.0))


def _tabulated() -> PretravelMap:
    nodes = grid(np.radians(np.arange(0, 91, 10)), np.radians(np.arange(0, 360, 15)))
    return predicted_map(TURNED, predict(TURNED, nodes))


def _predicted() -> PretravelMap:
    return response_map(TURNED, probe_response(TURNED), predict(TURNED, sphere_pattern_25()))


_not_fitted: Mapping[str, Callable[[], PretravelMap]] = {
    "tabulated": _tabulated,
    "predicted": _predicted,
}


@cache
def _map(name: str) -> PretravelMap:
    if name in _not_fitted:
        return _not_fitted[name]()
    return qualify(
        _touches(), 25.0, tip_diameter=6.0, u_diameter=2.5e-4, axis=AXIS, kind=name,
        search_outliers=False,
    ).pretravel_map  # fmt: skip


def _varied(name: str, seed: int) -> PretravelMap:
    """The map with other coefficients and a full covariance."""
    rng = np.random.default_rng(seed)
    made = _map(name)
    size = made.basis.size
    half = rng.normal(0.0, 1e-4, (size, size))
    return replace(
        made,
        coefficients=made.coefficients * rng.uniform(0.8, 1.2, size),
        covariance=Covariance.full(half @ half.T),
    )


def _normals(made: PretravelMap) -> np.ndarray:
    return CAP @ made.rotation.T


every_kind = pytest.mark.parametrize("name", [*kinds(), *_not_fitted])
seeds = st.integers(0, 10_000)


def test_every_basis_has_a_map_here() -> None:
    every = {basis for kind in kinds().values() for basis in kind.bases} | {TabulatedBasis}
    assert {type(_map(name).basis) for name in (*kinds(), *_not_fitted)} == every
    assert all(_map(name).kind == name for name in kinds())


@pytest.mark.long
@every_kind
@settings(max_examples=10)
@given(seeds)
def test_apply_undoes_embed(name: str, seed: int) -> None:
    made = _varied(name, seed)
    rng = np.random.default_rng(seed)
    normals = _normals(made)
    points = rng.uniform(-500.0, 500.0, normals.shape)
    approaches = unit(-normals + rng.uniform(-0.5, 0.5, normals.shape))
    moving = replace(made, feed=0.0, delay=0.01, u_delay=1e-4)
    feeds = rng.uniform(30.0, 900.0, len(normals))
    for way in (None, approaches):
        late = embed(points, normals, moving, approaches=way, feeds=feeds)
        # 0.15 mm of travel, and 1 µm where the approach is known by its direction alone.
        assert np.abs(apply(late, moving).positions - points).max() < 1e-12
        touches = embed(points, normals, made, approaches=way)
        # Coordinates of 500 mm have a rounding of 1e-13 mm.
        assert np.abs(apply(touches, made).positions - points).max() < 1e-12


@every_kind
def test_embedding_adds_up_along_the_approach(name: str) -> None:
    """P = T + r n + s a, with s = pretravel / |a·n|: computed here by hand, row by row."""
    made = _map(name)
    normals = _normals(made)[:20]
    tilt = unit(-normals + 0.2)
    touches = embed(np.zeros((20, 3)), normals, made, approaches=tilt)
    for n, a, p in zip(normals, tilt, touches.positions, strict=True):
        s = float(made.pretravel(n[None])[0]) / abs(float(a @ n))
        assert np.allclose(p, made.tip_radius * n + s * a, atol=1e-14)


@pytest.mark.long
@every_kind
def test_saving_changes_nothing(name: str, tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    for made in (_map(name), _varied(name, 7)):
        write_map(path, made)
        back = read_map(path)
        assert type(back.basis) is type(made.basis)
        assert back.covariance.correlation == made.covariance.correlation
        normals = _normals(made)
        for found, expected in (
            (back.coefficients, made.coefficients),
            (back.covariance.values, made.covariance.values),
            (back.support.nodes, made.support.nodes),
            (back.rotation, made.rotation),
            *(
                (array.values, made.basis.arrays()[key].values)
                for key, array in back.basis.arrays().items()
            ),
            (back.pretravel(normals), made.pretravel(normals)),
            (back.standard_uncertainty(normals), made.standard_uncertainty(normals)),
        ):
            assert np.array_equal(found, expected)
        assert back.basis.attributes() == made.basis.attributes()
        assert json_of_map(back) == json_of_map(made)
        for field in (
            "kind", "fixed_scatter", "tip_radius", "u_tip_radius", "repeatability",
            "repeatability_dof", "feed", "delay", "u_delay", "provenance",
        ):  # fmt: skip
            assert getattr(back, field) == getattr(made, field)


def _spread_in_cell(made: PretravelMap, step: float = np.radians(2.5)) -> np.ndarray:
    """Spread of the map over each direction and the corners of its cell of a table: (300,)."""
    polar, azimuth = polar_angle(CAP), azimuth_angle(CAP)
    values = [made.pretravel(_normals(made))]
    for row in (np.floor(polar / step), np.ceil(polar / step)):
        for column in (np.floor(azimuth / step), np.ceil(azimuth / step)):
            corner = from_angles(row * step, column * step)
            values.append(made.pretravel(corner @ made.rotation.T))
    return np.ptp(values, axis=0)


@every_kind
def test_a_table_is_the_map_to_its_interpolation(name: str, tmp_path: Path) -> None:
    made = _map(name)
    write_map(tmp_path / "map.csv", made)
    back = read_map(tmp_path / "map.csv")
    # In the directions of the table, the map agrees to its twelve digits.
    nodes = grid(np.radians(np.arange(2.5, 88, 7.5)), np.radians(np.arange(0, 360, 22.5)))
    normals = nodes @ made.rotation.T
    assert np.allclose(back.pretravel(normals), made.pretravel(normals), atol=1e-9)
    error = np.abs(back.pretravel(_normals(made)) - made.pretravel(_normals(made)))
    assert np.all(error <= _spread_in_cell(made) + 1e-9)
    if name in SMOOTH:
        assert error.max() < 1e-4
    assert (back.tip_radius, back.feed, back.delay) == (made.tip_radius, made.feed, made.delay)
    assert back.u_tip_radius == pytest.approx(made.u_tip_radius)
    assert back.repeatability == pytest.approx(made.repeatability)
    assert np.allclose(back.rotation, made.rotation, atol=1e-9)


@every_kind
def test_directions_outside_the_support_are_refused(name: str) -> None:
    made = _map(name)
    below = -made.rotation[:, 2][None]
    assert not made.supports(below).any()
    assert made.supports(_normals(made)).all()
    with pytest.raises(ExtrapolationError):
        made.pretravel(below)
    for call in (made.pretravel_and_uncertainty, made.tip_displacement):
        with pytest.raises(ExtrapolationError):
            call(np.vstack([_normals(made), below]))
    beyond = from_angles(np.radians(102.0), np.radians(np.arange(0, 360, 30)))
    assert not made.supports(beyond @ made.rotation.T).any()
    for call in (made.pretravel, made.pretravel_and_uncertainty, made.tip_displacement):
        assert np.isfinite(call(beyond @ made.rotation.T, extrapolate=True)).all()


@every_kind
@settings(max_examples=5)
@given(seeds)
def test_uncertainty_is_the_covariance_s_diagonal(name: str, seed: int) -> None:
    for made in (_map(name), _varied(name, seed)):
        normals = _normals(made)[:60]
        covariance = made.value_covariance(normals)
        u = made.standard_uncertainty(normals)
        largest = float(np.diag(covariance).max())
        assert np.allclose(np.sqrt(np.diag(covariance)), u, rtol=1e-9, atol=1e-9 * u.max())
        assert np.array_equal(covariance, covariance.T) or np.allclose(
            covariance, covariance.T, rtol=0.0, atol=1e-12 * largest
        )
        # Rounding of 60 sums.
        assert np.linalg.eigvalsh(covariance).min() >= -1e-12 * 60 * largest
        value, also_u = made.pretravel_and_uncertainty(normals)
        assert np.allclose(value, made.pretravel(normals), rtol=1e-12, atol=1e-15)
        assert np.array_equal(also_u, u)


@every_kind
@given(st.floats(-0.1, 0.1))
def test_the_constant_raises_all_directions_alike(name: str, height: float) -> None:
    made = _map(name)
    constant = made.basis.constant
    if constant is None:
        pytest.skip("this kind of map has no constant")
    raised = replace(made, coefficients=made.coefficients + height * constant)
    difference = raised.pretravel(_normals(made)) - made.pretravel(_normals(made))
    assert np.allclose(difference, height, atol=1e-13)


@pytest.mark.long
@every_kind
def test_the_form_on_a_control_evaluates_to_the_map(name: str) -> None:
    made = _map(name)
    exact = exact_lookup(made)
    form = exact or lookup_table(made, tolerance=5e-4, most_values=1900)
    error = np.abs(form.value(CAP) - made.pretravel(_normals(made)))
    # The largest error of a table was searched in many directions; it may be larger at kinks.
    assert error.max() < (1e-12 if exact else 1.1 * form.largest_error + 1e-9)


def _two_maps(kinds: tuple[str, str]) -> list[PretravelMap]:
    return [_map(kind) for kind in kinds]


@pytest.mark.parametrize("kinds", [("physical", "harmonic"), ("harmonic", "physical")])
def test_an_average_evaluates_on_a_control_as_its_parts_do(kinds: tuple[str, str]) -> None:
    """One closed form: the weighted parts, the shift between their centres, and the tips' radii."""
    maps = _two_maps(kinds)
    maps[1] = replace(maps[1], tip_radius=maps[1].tip_radius + 2e-3)
    shift = np.array([1e-3, -2e-3, 3e-3])
    basis, coefficients, _ = averaged_map(maps, [np.zeros(3), shift], [0.6, 0.4])
    form = basis.form_on_control(coefficients)
    assert form is not None
    n = maps[0].support.nodes
    first, second = (each.basis.value(n, each.coefficients) for each in maps)
    second = second - n @ (shift @ maps[0].rotation) + maps[0].tip_radius - maps[1].tip_radius
    expected = 0.6 * first + 0.4 * second
    assert basis.value(n, coefficients) == pytest.approx(expected, abs=1e-12)
    assert basis.design(n) @ coefficients == pytest.approx(expected, abs=1e-6)
    own = form.constant + n @ form.shift + form.scale * form.probe.pretravel(n)
    correction = form.correction
    own = own + real_spherical_harmonics(n, correction.terms) @ correction.coefficients
    assert own == pytest.approx(expected, abs=1e-9)
    moved, own_moved = (each.displacement(n, None) for each in (basis, maps[0].basis))
    assert np.array_equal(moved, own_moved)  # the largest weight's; of series there is none


@pytest.mark.parametrize(
    "kinds",
    [("physical", "physical"), ("harmonic", "harmonic"), ("physical", "wozniak"),
     ("wozniak", "physical")],
)  # fmt: skip
def test_an_average_without_one_probe_has_no_closed_form(kinds: tuple[str, str]) -> None:
    """Woźniak's model is neither a probe nor a series."""
    maps = _two_maps(kinds)
    basis, coefficients, _ = averaged_map(maps, [np.zeros(3)] * 2, [0.5, 0.5])
    assert basis.form_on_control(coefficients) is None


def test_kinds_that_follow_a_probe_to_its_repeatability() -> None:
    """Mean, sectors and Woźniak's shape leave errors of the map; the others do not."""
    found = {name: _map(name).basis.follows_probe for name in (*kinds(), *_not_fitted)}
    coarse = {name for name, follows in found.items() if not follows}
    assert coarse == {"mean", "sectors", "wozniak"}
