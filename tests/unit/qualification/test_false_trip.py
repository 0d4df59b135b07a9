"""One false trip among few touches: it is named, and the diameters are not blamed for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import ring_pattern
from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE
from pretravel.files.touches_csv import write_touches
from pretravel.qualification.qualify import qualify
from pretravel.tasks.qualify import Qualify
from pretravel.touches import Touches
from tests.support.simulated_probe import simulated_pretravel


def sphere(count: int, row: int | None, distance: float, *, repeats: int = 1) -> Touches:
    """Touches on a sphere of 25 mm, with a tip of 6 mm; one trips early or late."""
    normals = np.repeat(ring_pattern(np.array([0.0, 45.0, 90.0]) * DEGREE, count), repeats, axis=0)
    noise = np.random.default_rng(1).normal(0.0, 2e-4, len(normals))
    reach = 15.5 - simulated_pretravel(normals) + noise
    if row is not None:
        reach[row] += distance
    labels = tuple(f"s{i + 1}" for i in range(len(normals)))
    return Touches(reach[:, None] * normals, normals, labels=labels)


@pytest.mark.parametrize("distance", [0.6, -0.6, 3.0])
@pytest.mark.parametrize("count", [4, 6, 12, 48])
def test_it_is_named_with_its_distance(count: int, distance: float) -> None:
    """With 15 touches the last one pulled the sphere to itself: "check the diameter"."""
    touches = len(ring_pattern(np.array([0.0, 45.0, 90.0]) * DEGREE, count))
    for row in {0, touches // 2, touches - 1}:
        side = "outside" if distance > 0.0 else "inside"
        told = rf"\(s{row + 1}\) lies about {abs(distance):.2f} mm {side} the sphere of the others"
        with pytest.raises(PretravelError, match=told):
            qualify(sphere(count, row, distance), 25.0, tip_diameter=6.0)


def test_wrong_diameters_are_still_blamed() -> None:
    with pytest.raises(PretravelError, match="check the diameter"):
        qualify(sphere(6, None, 0.0), 24.0, tip_diameter=6.0)


@pytest.mark.parametrize(("repeats", "words"), [(1, "is not known"), (3, "The probe is good")])
def test_without_repeats_a_probe_is_not_called_good(
    tmp_path: Path, repeats: int, words: str
) -> None:

    path = tmp_path / "sphere.csv"
    write_touches(path, sphere(12, None, 0.0, repeats=repeats))
    made = Qualify(touches=path, diameter=25.0, tip_diameter=6.0).run()
    assert words in made.document().verdict
