"""The same limit holds for glancing approaches at every entry."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import InputError, PretravelError
from pretravel.files.touches_csv import read_targets
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import embed
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict, predicted_map
from pretravel.surface.shapes import Plane
from pretravel.touches import GLANCING, Touches
from pretravel.touches.targets import Targets

UP = np.array([[0.0, 0.0, 1.0]])


def _approach(cosine: float) -> np.ndarray:
    return np.array([[math.sqrt(1.0 - cosine**2), 0.0, -cosine]])


def _map() -> PretravelMap:
    probe = load_probe("omp40-2")
    return predicted_map(probe, predict(probe, fibonacci_cap(50)))


def test_an_approach_just_within_the_limit_is_accepted() -> None:
    steep = _approach(GLANCING + 1e-6)
    Touches(UP, UP, steep)
    Targets(UP, UP, steep)
    embed(UP, UP, _map(), approaches=steep, extrapolate=True)


@pytest.mark.parametrize("cosine", [GLANCING - 1e-6, 0.0, -0.5])
def test_a_glancing_approach_is_refused_everywhere(cosine: float, tmp_path: Path) -> None:
    approach = _approach(cosine)
    with pytest.raises(PretravelError, match="touch 1: the approach moves away"):
        Touches(UP, UP, approach)
    with pytest.raises(PretravelError, match="target 1: the approach moves away"):
        Targets(UP, UP, approach)
    with pytest.raises(PretravelError, match="point 1: the approach moves away"):
        embed(UP, UP, _map(), approaches=approach)
    file = tmp_path / "targets.csv"
    x, _, z = approach[0]
    file.write_text(f"x_mm,y_mm,z_mm,nx,ny,nz,ax,ay,az\n0,0,0,0,0,1,{x},0,{z}\n", "ascii")
    with pytest.raises(InputError, match="line 2: the approach moves away"):
        read_targets(file, Plane([0, 0, 0], [0, 0, 1]), approach="file")
