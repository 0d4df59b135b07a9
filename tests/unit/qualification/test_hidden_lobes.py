"""Directions in which three lobes look like a shift of the centre: four azimuths 90° apart."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.qualifying import qualify
from tests.support.reference_touches import sphere_touches

PROBE = load_probe("omp40-2-100mm")
HIDDEN = "show the lobes of three rods as a shift"


def directions(azimuths: int, first: float) -> np.ndarray:
    """The pole, and azimuths at polar 30°, 60° and 90°; three touches each."""
    around = first + 2.0 * np.pi * np.arange(azimuths) / azimuths
    rings = [from_angles(polar * DEGREE, around) for polar in (30.0, 60.0, 90.0)]
    return np.repeat(np.vstack([[[0.0, 0.0, 1.0]], *rings]), 3, axis=0)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["harmonic", "physical", "mean"])
def test_u_contains_lobes_that_four_azimuths_hide(kind: str) -> None:
    """Errors over u of a usual probe, turned by 0 to 90°, without the shift of all points."""
    between, ratios = fibonacci_cap(300), []
    for turn in (0.0, 30.0, 60.0, 90.0):
        n, rotation = directions(4, 0.3), probe_rotation(rotation=turn * DEGREE)
        noise = np.random.default_rng(int(turn)).normal(0.0, 3e-4, len(n))
        touches = sphere_touches(predict(PROBE, n @ rotation).pretravel + noise, n)
        found = qualify(touches, 25.0, tip_diameter=6.0, kind=kind)
        assert any(HIDDEN in warning for warning in found.warnings)
        value, u = found.pretravel_map.pretravel_and_uncertainty(between)
        error = value - predict(PROBE, between @ rotation).pretravel
        error -= between @ np.linalg.lstsq(between, error)[0]
        ratios.append(np.sqrt(np.mean((error / u) ** 2)))
    assert np.sqrt(np.mean(np.square(ratios))) < 1.5


@pytest.mark.parametrize("azimuths", [5, 6, 7, 8])
def test_other_azimuths_show_the_lobes_or_lobes_that_look_alike(azimuths: int) -> None:
    """At five azimuths cos 3φ is cos 2φ, at six sin 3φ is zero; at seven it is sin 4φ."""
    n = directions(azimuths, 0.3)
    touches = sphere_touches(predict(PROBE, n).pretravel, n)
    found = qualify(touches, 25.0, tip_diameter=6.0, kind="harmonic")
    assert not any(HIDDEN in warning for warning in found.warnings)
    alike = any("cannot distinguish three lobes from two" in warning for warning in found.warnings)
    assert alike == (azimuths < 7)


@pytest.mark.parametrize(("azimuths", "named"), [(4, True), (8, False)])
def test_an_update_names_directions_that_hide_a_turn(azimuths: int, named: bool) -> None:
    n = directions(8, 0.0)
    old = qualify(sphere_touches(predict(PROBE, n).pretravel, n), 25.0, tip_diameter=6.0,
                  kind="harmonic").pretravel_map  # fmt: skip
    few = directions(azimuths, 0.3)[::3]
    update = update_map(sphere_touches(predict(PROBE, few).pretravel, few), old, 25.0)
    assert any("turned in its holder" in warning for warning in update.warnings) == named
