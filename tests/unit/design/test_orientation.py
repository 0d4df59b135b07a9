"""Another orientation of an indexing head: the weight of the moving parts turns."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.design.identification.orientation import SHARE, in_orientation
from pretravel.design.identification.probe_from_map import identify
from pretravel.files.map_file import read_map, write_map
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.trigger import predict
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.qualifying import qualify
from tests.support.commands import run
from tests.support.example_maps import example_map
from tests.support.reference_touches import sphere_touches

PROBE = load_probe("omp40-2")
WALLS = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.radians([0, 50, 130, 200, 310])])


def test_upside_down_the_spring_carries_the_weight_twice() -> None:
    """Forces and, in a model without Hertz's contact, pretravel are as F - W to F + W."""
    old = example_map("harmonic")
    weight = PROBE.moving.mass * 9.80665
    found = in_orientation(old, PROBE, [0.0, 0.0, -1.0], model="shen")
    before = predict(PROBE, found.directions, "shen", gravity=[0.0, 0.0, -1.0]).pretravel
    expected = (PROBE.preload - weight) / (PROBE.preload + weight) - 1.0
    np.testing.assert_allclose(found.difference, expected * before, atol=1e-9)


@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (0.6, 0.0, 0.8)])
def test_the_difference_is_that_of_two_predictions(axis: tuple[float, float, float]) -> None:
    """A probe that is described in its new orientation says the same."""
    found = in_orientation(example_map("harmonic"), PROBE, axis, roll=0.3)
    turned = replace(PROBE, orientation=replace(PROBE.orientation, axis=axis, rotation=0.3))
    down = [0.0, 0.0, -1.0]
    after = predict(turned, found.directions, gravity=down).pretravel
    before = predict(PROBE, found.directions, gravity=down).pretravel
    np.testing.assert_allclose(found.difference, after - before, atol=1e-9)
    np.testing.assert_allclose(found.pretravel_map.rotation, probe_rotation(axis, 0.3), atol=1e-12)


def test_the_map_changes_by_it_and_u_contains_a_share() -> None:
    old = example_map("harmonic")
    found = in_orientation(old, PROBE, [0.0, 0.0, -1.0])
    new = found.pretravel_map
    in_probe = fibonacci_cap(50)
    machine = in_probe @ new.rotation.T
    value, u = new.pretravel_and_uncertainty(machine, extrapolate=True)
    old_value, old_u = old.pretravel_and_uncertainty(in_probe @ old.rotation.T, extrapolate=True)
    change = value - old_value
    # Upside down the change follows the lobes, which the map has: up to some hundredths.
    assert np.abs(change).max() > 0.2e-3
    assert found.missed < 0.02e-3
    np.testing.assert_allclose(np.hypot(old_u, found.share * np.abs(change)), u, rtol=1e-6)


@cache
def own_map() -> PretravelMap:
    """Of touches of the described probe, without noise."""
    n = fibonacci_cap(40)
    touches = sphere_touches(predict(PROBE, n).pretravel, n)
    return qualify(touches, 25.0, tip_diameter=6.0, kind="harmonic").pretravel_map


def rotated(degrees: float) -> Probe:
    return replace(PROBE, orientation=replace(PROBE.orientation, rotation=np.radians(degrees)))


def test_what_the_description_does_not_explain_is_in_u() -> None:
    """Lobes that are 10° beside those of the map differ from them by 2 sin(3 · 10°/2) of it."""
    own, beside = (in_orientation(own_map(), rotated(d), [0.0, 1.0, 0.0]).share for d in (0, 10))
    assert own == pytest.approx(SHARE, abs=0.02)  # the weight itself changes the lobes a little
    assert beside == pytest.approx(np.hypot(SHARE, 2.0 * np.sin(np.radians(15.0))), abs=0.15)
    # The example touches are of the longer stylus: it alone has so large lobes.
    long_map = example_map("harmonic")
    assert in_orientation(long_map, PROBE, [0.0, 1.0, 0.0]).share > 0.8


@pytest.mark.parametrize("other", [rotated(60.0), rotated(180.0), load_probe("omp40-2-100mm")])
def test_a_description_of_other_lobes_is_refused(other: Probe) -> None:
    """At half of the period of three lobes each lies where the map has none."""
    with pytest.raises(PretravelError, match="does not explain the map: without mean and shift"):
        in_orientation(own_map(), other, [0.0, 1.0, 0.0])


def test_friction_at_the_seats_is_refused_by_its_name() -> None:
    with pytest.raises(PretravelError, match=r"friction 0.2 at its seats.*\[seats\] to 0") as said:
        in_orientation(example_map("harmonic"), PROBE.with_friction(0.2), [0.0, 1.0, 0.0])
    assert said.value.inputs == ("probe",)


def test_names_of_the_old_orientation_do_not_stay() -> None:
    old = example_map("harmonic")
    named = replace(old, provenance=replace(old.provenance, tip="T1A0B0", orientation="A0B0"))
    made = in_orientation(named, PROBE, [0.0, 1.0, 0.0]).pretravel_map.provenance
    assert (made.tip, made.orientation) == ("", "")


@pytest.mark.long
def test_a_few_touches_take_it_or_refuse_it() -> None:
    old = example_map("harmonic")
    new = in_orientation(old, PROBE, [0.0, 1.0, 0.0]).pretravel_map
    n = fibonacci_cap(9) @ new.rotation.T
    truth = new.pretravel(n)
    found = update_map(sphere_touches(truth, n), new, 25.0)
    assert found.p_value > 0.99
    # Touches add information: u was 60 µm, by coefficients of millimetres that cancelled.
    before, after = (m.pretravel_and_uncertainty(n)[1] for m in (new, found.pretravel_map))
    assert np.linalg.norm(after) < np.linalg.norm(before)
    other = truth + 8e-3 * (n[:, 0] > 0.3)  # far more than weight or drift
    with pytest.raises(PretravelError, match="do not fit the old map"):
        update_map(sphere_touches(other, n), new, 25.0)


def test_refused() -> None:
    lying = replace(PROBE, orientation=replace(PROBE.orientation, axis=(0.0, 1.0, 0.0)))
    with pytest.raises(PretravelError, match="not that of the map"):
        in_orientation(example_map("harmonic"), lying, [0.0, 0.0, 1.0])
    small = replace(example_map("harmonic"), tip_radius=2.0)
    for command in (
        lambda: in_orientation(small, PROBE, [0.0, 0.0, 1.0]),
        lambda: identify(small, PROBE, ("rotation",)),
    ):
        with pytest.raises(PretravelError, match="has a diameter of 6 mm, that of the map 4 mm"):
            command()
    light = replace(PROBE, moving=replace(PROBE.moving, mass=0.0))
    with pytest.raises(PretravelError, match="no moving mass"):
        in_orientation(example_map("harmonic"), light, [0.0, 1.0, 0.0])


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_map("map.json", example_map("harmonic"))
    shown = run("orientation", "map.json", "--probe", "omp40-2", "--axis", "0,1,0", "-o",
                "turned.json", "--plot", "turned.png")  # fmt: skip
    assert "the weight changes pretravel by" in shown
    expected = in_orientation(example_map("harmonic"), PROBE, [0.0, 1.0, 0.0]).pretravel_map
    np.testing.assert_allclose(read_map("turned.json").coefficients, expected.coefficients)
    assert Path("turned.png").stat().st_size > 1000
