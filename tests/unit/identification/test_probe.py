"""A description from a map: undetermined numbers, and probes of another kind."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import grid
from pretravel.base.errors import PretravelError
from pretravel.files.map_file import read_map
from pretravel.identification.probe_from_map import (
    FREE,
    _directions_per_independent_error,
    _misfit,
    _with_nearest_rotation,
    identify,
)
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.predict import predict, predicted_map
from tests.support.commands import run
from tests.support.example_maps import example_map


def test_what_the_map_does_not_determine(tmp_path: Path) -> None:
    run("predict", "omp40-2", "--azimuth", "0:350:10", "--polar", "0:90:10",
        "-o", tmp_path / "map.json")  # fmt: skip
    found = identify(
        read_map(tmp_path / "map.json"), load_probe("omp40-2"), ["lever", "tripod_radius"]
    )
    assert any("undone by" in sentence for sentence in found.unknown)


def test_a_probe_of_another_kind_widens_u() -> None:
    """Woźniak's lobes, which no six-seat probe has, are reported; u has the size of the misfit."""
    made = example_map("wozniak")
    assert made.touched is not None
    lobes = replace(made.touched, pretravel=made.pretravel(made.support.nodes @ made.rotation.T))
    other = replace(made, touched=lobes)
    found = identify(other, load_probe("omp40-2-100mm"), ["rotation", "stem_diameter"])
    assert any("another kind" in sentence for sentence in found.unknown)
    true = identify(
        example_map("physical"), load_probe("omp40-2-100mm"), ["rotation", "stem_diameter"]
    )
    off = np.abs(found.values - true.values)
    assert np.all(off < 4.0 * found.standard_uncertainty + 4.0 * true.standard_uncertainty)


@pytest.mark.parametrize("name", FREE)
def test_a_free_number_is_put_where_it_is_read(name: str) -> None:
    """A number that is put is the number that is read then; no other number changes."""
    number, probe = FREE[name], load_probe("omp40-2")
    before = {other: FREE[other].of(probe) for other in FREE}
    changed = number.put(probe, before[name] + 0.01)
    after = {other: FREE[other].of(changed) for other in FREE}
    assert after == pytest.approx(before | {name: before[name] + 0.01}, rel=1e-12)


class TestClosedForms:
    """Maps that are computed from a known probe: identification must return its numbers."""

    # None lies on a kink of the start, where another seat opens and the slope is not defined.
    DIRECTIONS = grid(np.radians([20.0, 45.0, 70.0, 90.0]), np.radians(np.arange(3.0, 360.0, 10)))

    def test_azimuth_of_each_rod(self) -> None:
        """Rods at 1°, 119° and 241.5° are found from a description with 0°, 120° and 240°."""
        described = load_probe("omp40-2")
        azimuths = tuple(np.radians([1.0, 119.0, 241.5]))
        true = replace(described, tripod=replace(described.tripod, rod_azimuths=azimuths))
        found = identify(
            predicted_map(true, predict(true, self.DIRECTIONS)),
            described,
            ["rod_azimuth_1", "rod_azimuth_2", "rod_azimuth_3"],
        )
        assert found.names == ("rod_azimuth_1", "rod_azimuth_2", "rod_azimuth_3")
        # The map is exact at its directions; the fit ends at a relative step of 1e-8.
        assert found.values == pytest.approx(azimuths, abs=1e-7)
        assert found.probe.tripod.rod_azimuths == pytest.approx(azimuths, abs=1e-7)
        assert np.abs(found.residuals).max() < 1e-9

    def test_shift_of_the_reference(self) -> None:
        """Seen from a centre that is shifted by s, a tip on the sphere is nearer by s·n: there
        the map has more pretravel. The map of a probe with its centre at s contains s·n."""
        probe, shift = load_probe("omp40-2"), np.array([2e-3, -3e-3, 5e-3])
        exact = predicted_map(probe, predict(probe, self.DIRECTIONS))
        nodes = exact.support.nodes
        shifted = replace(exact, coefficients=exact.coefficients + nodes @ shift)
        found = identify(shifted, replace(probe, preload=1.1 * probe.preload), ["preload"])
        assert found.shift == pytest.approx(shift, abs=1e-6)
        assert found.values[0] == pytest.approx(probe.preload, rel=1e-4)
        assert math.hypot(*found.residuals) < 1e-6


def test_a_description_with_friction_is_refused() -> None:
    """Statics alone is fitted: with friction at the seats a fit would take hours."""
    rubbing = load_probe("omp40-2")
    rubbing = replace(rubbing, seats=replace(rubbing.seats, friction=0.2))
    with pytest.raises(PretravelError, match=r"friction of \[seats\] to 0"):
        identify(example_map(), rubbing, ["preload"])


def test_directions_for_each_independent_error() -> None:
    """Independent errors: one; errors common to blocks of k directions: k; common to all: n."""
    assert _directions_per_independent_error(2.0 * np.eye(12)) == pytest.approx(1.0)
    blocks = np.kron(np.eye(3), np.ones((4, 4)))
    assert _directions_per_independent_error(blocks) == pytest.approx(4.0)
    assert _directions_per_independent_error(np.ones((12, 12))) == pytest.approx(12.0)


def test_a_misfit_is_measured_by_the_errors_of_the_map() -> None:
    """Residuals three times their standard uncertainty, whose errors are common to pairs."""
    covariance = 4e-8 * np.kron(np.eye(5), np.ones((2, 2)))
    widening, sentences = _misfit(np.full(10, 6e-4), covariance)
    assert widening == pytest.approx(3.0 * np.sqrt(2.0))
    assert "differ by 0.60 µm (rms), 3.0 times as much" in sentences[0]
    assert _misfit(np.full(10, 3.9e-4), covariance) == (1.0, [])


@pytest.mark.parametrize(("found", "near"), [(0.1, 0.1 + 2.0 * np.pi / 3.0), (3.0, 3.0)])
def test_of_three_equal_rotations_the_nearest_is_stated(found: float, near: float) -> None:
    """An even tripod looks alike after a third of a turn."""
    probe = load_probe("omp40-2")
    start = replace(probe, orientation=replace(probe.orientation, rotation=2.5))
    turned = replace(probe, orientation=replace(probe.orientation, rotation=found))
    assert _with_nearest_rotation(turned, start).orientation.rotation == pytest.approx(near)
    azimuths = (0.0, 2.0, 4.0)
    uneven = replace(turned, tripod=replace(probe.tripod, rod_azimuths=azimuths))
    whole = _with_nearest_rotation(uneven, start).orientation.rotation
    assert whole == pytest.approx(found)


def test_u_of_numbers_by_their_effect_on_pretravel() -> None:
    """Beside a shift of the reference that is free, from 0.05 um in each direction.

    The map is the description's own and states no uncertainty of its own, so that the numbers
    themselves come back; their u follows from differences of predictions.
    """
    probe, names = load_probe("omp40-2"), ("preload", "support_angle")
    nodes = grid(np.radians([20, 50, 70, 90]), np.radians(np.arange(0.0, 360.0, 15.0)))
    made = predicted_map(probe, predict(probe, nodes))
    found = identify(made, probe, names)
    numbers = [FREE[name] for name in names]
    assert found.values == pytest.approx([number.of(probe) for number in numbers], rel=1e-5)
    assert np.abs(found.residuals).max() < 1e-8
    assert found.shift == pytest.approx(np.zeros(3), abs=1e-8)
    columns = []
    for number in numbers:
        code = number.code(number.of(probe))
        more, less = (
            predict(number.put(probe, number.value(code + step)), found.directions).pretravel
            for step in (1e-4, -1e-4)
        )
        columns.append((more - less) / 2e-4)
    design = np.column_stack([*columns, found.directions])
    expected = 5e-5 * np.sqrt(np.diag(np.linalg.inv(design.T @ design))[:2])
    assert found.relative_uncertainty == pytest.approx(expected, rel=1e-2)
    scale = [number.of(probe) if number.relative else 1.0 for number in numbers]
    assert found.standard_uncertainty == pytest.approx(scale * expected, rel=1e-2)
