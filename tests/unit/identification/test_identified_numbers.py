"""Numbers of a description: their places in a file, their limits, and the level of a map."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, grid
from pretravel.base.errors import DescriptionError, PretravelError
from pretravel.identification.evidence import evidence_of
from pretravel.identification.probe_from_map import (
    FREE,
    Identification,
    _numbers_at_limits,
    _uncertainty,
    free_numbers,
    identified_description,
    identify,
)
from pretravel.maps.provenance import Origin
from pretravel.maps.touched_means import TouchedMeans
from pretravel.prediction.catalogue import description_text, load_probe, parse_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.predict import predict, predicted_map
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import example_map

NODES = grid(np.radians([20.0, 50.0, 70.0, 90.0]), np.radians(np.arange(4.0, 360.0, 30.0)))
IN_DEGREES = {"support_angle", "rotation", "rod_azimuth_1", "rod_azimuth_2", "rod_azimuth_3"}


def _written(name: str, probe: Probe, value: float, u: float) -> str:
    none = np.zeros(0)
    found = Identification(
        probe, (name,), np.array([value]), np.array([u]), none, none, none, none, ()
    )
    return identified_description(description_text("omp40-2"), found, "a map")


@pytest.mark.parametrize("name", FREE)
def test_a_number_is_written_where_it_is_read(name: str) -> None:
    """Read again the description has this number, and the others as before; its source is told
    with u in the unit of the file."""
    probe = load_probe("omp40-2")
    before = {other: FREE[other].of(probe) for other in FREE}
    value = before[name] + 0.0123
    text = _written(name, FREE[name].put(probe, value), value, 0.0456)
    after = parse_probe(text)
    expected = before | {name: value}
    assert {other: FREE[other].of(after) for other in FREE} == pytest.approx(expected, rel=1e-7)
    u = "2.6" if name in IN_DEGREES else "0.046"
    assert f"identified from a map, u = {u}" in text
    assert FREE[name].relative == (name not in IN_DEGREES)


@pytest.mark.parametrize("name", ["preload", "support_angle"])
def test_lengths_and_forces_are_fitted_by_their_logarithm(name: str) -> None:
    number = FREE[name]
    assert number.code(2.0) == (math.log(2.0) if name == "preload" else 2.0)
    assert number.value(number.code(1.7)) == pytest.approx(1.7)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ([], "no number is free; there are preload, lever"),
        (["preload", "size"], "'size' cannot be identified"),
        (["preload", "lever", "preload"], "named twice"),
    ],
)
def test_names_that_are_refused(names: list[str], words: str) -> None:
    with pytest.raises(PretravelError, match=words) as error:
        free_numbers(names)
    assert error.value.inputs == ("free",)


def test_a_number_at_its_limit_is_told() -> None:
    """A hundredth further there is no such description, up or down."""

    def put(_: Probe, value: float) -> Probe:
        if not 0.0 < value < 1.0:
            raise DescriptionError("too far")
        return cast("Probe", None)

    number = SimpleNamespace(put=put, value=lambda code: code)
    fit = cast("Any", SimpleNamespace(numbers=(number,) * 4))
    codes = np.array([0.995, 0.985, 0.015, 0.005, 7.0])  # the last one is a shift
    found = _numbers_at_limits(fit, cast("Probe", None), codes, ["a", "b", "c", "d"])
    assert [sentence.split()[0] for sentence in found] == ["a", "d"]
    assert "reached the limit of what a description allows (too far)" in found[0]


@pytest.mark.parametrize(("relative", "size"), [(True, "50 %"), (False, "0.5 rad")])
def test_the_size_of_an_uncertainty_in_words(relative: bool, size: str) -> None:
    numbers = cast("Any", [SimpleNamespace(relative=relative)])
    u, (sentence,) = _uncertainty(np.array([[2.0, 0.0], [0.0, 4.0]]), numbers, ("a",))
    assert u.tolist() == pytest.approx([0.5])
    assert sentence == (
        f"the map hardly determines a (u = {size}); measure it, or leave it as described"
    )


def test_a_map_without_a_level_leaves_it_free() -> None:
    """A constant of 20 µm and a shift: the preload is found again beside both."""
    probe, shift = load_probe("omp40-2"), np.array([2e-3, -3e-3, 5e-3])
    exact = predicted_map(probe, predict(probe, NODES))
    moved = exact.coefficients + exact.support.nodes @ shift + 0.02
    words = replace(exact.provenance, level_known=False)
    seen = replace(exact, coefficients=moved, provenance=words)
    found = identify(seen, replace(probe, preload=1.1 * probe.preload), ["preload"])
    assert found.values[0] == pytest.approx(probe.preload, rel=1e-4)
    assert found.shift == pytest.approx(shift, abs=1e-5)
    assert np.abs(found.residuals).max() < 1e-6
    # u with four columns beside the number, from 0.05 µm in each direction.
    more, less = (
        predict(replace(probe, preload=probe.preload * math.exp(step)), NODES).pretravel
        for step in (1e-4, -1e-4)
    )
    design = np.column_stack([(more - less) / 2e-4, NODES, np.ones(len(NODES))])
    u = 5e-5 * math.sqrt(np.linalg.inv(design.T @ design)[0, 0])
    assert found.relative_uncertainty[0] == pytest.approx(u, rel=1e-2)
    assert found.standard_uncertainty[0] == pytest.approx(u * probe.preload, rel=1e-2)


@pytest.mark.parametrize("variance", [0.0, 1e-8])
def test_a_table_with_u_lacks_its_correlations(variance: float) -> None:
    """The map's u and 0.05 µm of the model add in squares."""
    probe = load_probe("omp40-2")
    made = predicted_map(probe, predict(probe, NODES))
    own = Covariance.independent(np.full(len(NODES), variance))
    found = identify(replace(made, covariance=own), probe, ["preload"])
    told = [
        sentence for sentence in found.unknown if "does not contain the correlation" in sentence
    ]
    assert len(told) == (variance > 0.0)
    none = identify(made, probe, ["preload"]).standard_uncertainty
    factor = math.sqrt(1.0 + variance / 5e-5**2)
    assert found.standard_uncertainty == pytest.approx(factor * none, rel=1e-4)


def test_a_table_of_a_qualification_is_refused() -> None:
    """A grid over a map is neither its touches nor the correlation of its errors."""
    probe = load_probe("omp40-2")
    made = predicted_map(probe, predict(probe, NODES))
    table = replace(
        made,
        covariance=Covariance.fully_shared(np.full(len(NODES), 1e-8)),
        provenance=replace(made.provenance, origin=Origin.QUALIFIED),
    )
    with pytest.raises(PretravelError, match=r"use the \.json file") as error:
        identify(table, probe, ["preload"])
    assert error.value.inputs == ("map_file",)


def test_a_coarse_map_without_its_touches_is_refused() -> None:
    """The mean of all directions tells nothing of lobes; what was touched does, of any kind."""
    probe, coarse = load_probe("omp40-2-100mm"), example_map("mean")
    with pytest.raises(PretravelError, match="a map of kind mean does not follow the lobes"):
        identify(replace(coarse, touched=None), probe, ["stem_diameter"])
    first, second = (
        identify(example_map(kind), probe, ["stem_diameter"]) for kind in ("mean", "harmonic")
    )
    near = 0.1 * float(second.standard_uncertainty[0])  # their centres differ by some µm
    assert first.values == pytest.approx(second.values, abs=near)


@pytest.mark.parametrize(("count", "step"), [(599, 1), (600, 2), (1200, 3)])
def test_directions_in_which_a_table_is_compared(count: int, step: int) -> None:
    """Its nodes, of more than 600 each second or third."""
    probe, nodes = load_probe("omp40-2"), fibonacci_cap(count, 1.5)
    table = predicted_map(probe, predict(probe, nodes))
    assert evidence_of(table).directions == pytest.approx(nodes[::step])


def test_the_best_of_all_rotations_is_found() -> None:
    """One rod 4° out: a third of a turn away another description fits best of those beside it."""
    described = load_probe("omp40-2-100mm")
    true = FREE["rotation"].put(FREE["rod_azimuth_1"].put(described, np.radians(4.0)), 4.5)
    nodes = fibonacci_cap(60, 1.5)
    seen = predicted_map(true, predict(true, nodes))
    found = identify(seen, described, ["rotation", "rod_azimuth_1"])
    rotation = (found.values[0] - 4.5 + np.pi) % (2.0 * np.pi) - np.pi
    assert (rotation, found.values[1]) == pytest.approx((0.0, np.radians(4.0)), abs=1e-6)


def test_other_descriptions_that_fit_nearly_as_well_are_named() -> None:
    """With u of 2 µm thirty directions do not tell which rod is 1° out: thirds of a turn fit."""
    described = load_probe("omp40-2-100mm")
    true = FREE["rod_azimuth_1"].put(described, np.radians(1.0))
    nodes = fibonacci_cap(30, 1.5)
    made = predicted_map(true, predict(true, nodes))
    unsure = replace(made, covariance=Covariance.full(4e-6 * np.eye(len(nodes))))
    found = identify(unsure, described, ["rotation", "rod_azimuth_1"])
    told = [sentence for sentence in found.unknown if "nearly as well" in sentence]
    assert len(told) >= 2
    assert all("rotation_deg" in sentence for sentence in told)


def test_errors_of_touches_are_independent_beside_those_of_the_reference() -> None:
    """Noise over the number of touches and 0.05 µm in each direction; 0.1 µm common to all; the
    approach of a tip of 3 mm and a ball of 12.5 mm is (1 + 3/12.5)^(1/3) of that on a flat."""
    made = example_map("harmonic")
    assert made.touched is not None
    count = len(made.support.nodes)
    touched = TouchedMeans(np.full(count, 0.010), np.arange(1.0, count + 1.0))
    setup = replace(made.provenance.setup, diameter=25.0) if made.provenance.setup else None
    seen = evidence_of(
        replace(
            made, touched=touched, repeatability=3e-4, u_tip_radius=1e-4, delay_effect=None,
            provenance=replace(made.provenance, setup=setup),
        )
    )  # fmt: skip
    expected = np.diag(9e-8 / np.arange(1, count + 1) + 2.5e-9) + 1e-8
    assert seen.covariance == pytest.approx(expected, rel=1e-12)
    assert seen.value == pytest.approx(np.full(count, 0.010))
    assert seen.tip_factor == pytest.approx((1.0 + 3.0 / 12.5) ** (1.0 / 3.0), rel=1e-6)
