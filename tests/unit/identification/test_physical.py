"""The physical kind: its statements on the fit, and its refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.files.touches_csv import read_touches
from pretravel.identification.physical import PhysicalMapFit
from pretravel.measurement.compensation import apply
from pretravel.qualification.qualify import qualify
from pretravel.touches import Touches
from tests.support.example_maps import example_qualification
from tests.support.examples import PART as PART_TOUCHES
from tests.support.examples import SPHERE as SPHERE_TOUCHES
from tests.support.made_up_probes import NOISE, PATTERN, made_up_response, touches_of

PART = read_touches(PART_TOUCHES).normals


def test_example_probe() -> None:
    """The truth of the example is unknown here. The residuals of the fit are as large as the
    scatter of the repeats, so no lack of fit is detected, and the report states this."""
    result = example_qualification("physical")
    fit = result.fit
    assert isinstance(fit, PhysicalMapFit)
    assert fit.misfit > 0.05
    assert result.residuals.std() == pytest.approx(0.30e-3, rel=0.1)
    assert list(result.warnings) == []
    assert result.pretravel_map.kind == "physical"


@pytest.mark.parametrize("error", [0.0, 2e-3, -4e-3])
def test_a_wrong_diameter_within_its_uncertainty_is_a_level(error: float) -> None:
    """At 4 µm with u = 2 µm the report said "not quite of the six-seat kind" (probability 4e-31):
    the error is common to all touches. The probability stays as large as that of the right
    diameter, 0.46; 4 µm are two u, and curve the model a little."""
    result = qualify(
        read_touches(SPHERE_TOUCHES), 24.9987 + error, tip_diameter=6.0, u_diameter=2e-3,
        kind="physical",
    )  # fmt: skip
    assert isinstance(result.fit, PhysicalMapFit)
    assert result.fit.misfit > 0.2
    assert list(result.warnings) == []


def _departing_touches(seed: int) -> tuple[Touches, np.ndarray]:
    """Touches of a probe with lobes of 1 um that no tripod has, and its pretravel on the part."""
    rng = np.random.default_rng(seed)
    response = made_up_response(rng, 0.0)

    def lobes(n: np.ndarray) -> np.ndarray:
        return np.asarray(1e-3 * np.cos(2.0 * np.arctan2(n[:, 1], n[:, 0])) * n[:, 2])

    touches = touches_of(response, PATTERN, rng)
    positions = touches.positions - lobes(PATTERN)[:, None] * PATTERN
    return replace(touches, positions=positions), response.pretravel(PART) + lobes(PART)


def test_another_kind_of_probe_is_noticed() -> None:
    touches, _ = _departing_touches(2)
    result = qualify(touches, 25.0, tip_diameter=6.0, kind="physical", search_outliers=False)
    assert isinstance(result.fit, PhysicalMapFit)
    assert result.fit.misfit < 0.01
    assert "six-seat kind" in " ".join(result.warnings)


@pytest.mark.slow
def test_u_contains_what_the_model_misses() -> None:
    """Errors on the part, from the centre that was found, over their u: the mean square of 12 sets
    is near one. A set alone scatters by 0.5, because its points share a map: twelve by 0.15. Of the
    usual map, which weighs another kind too where the six seats miss something."""
    squares = []
    for seed in range(12):
        touches, truth = _departing_touches(seed)
        result = qualify(touches, 25.0, tip_diameter=6.0, search_outliers=False)
        shift = result.center - np.array([120.0, -40.0, 7.0])
        error = result.pretravel_map.pretravel(PART) - truth - PART @ shift
        u = np.hypot(
            result.pretravel_map.standard_uncertainty(PART), result.pretravel_map.fixed_scatter
        )
        squares.append(float(np.mean((error / u) ** 2)))
    assert 0.5 < np.mean(squares) < 1.6


def test_gauge_is_stated() -> None:
    """Centre against first harmonic: along the axis the priors determine it, to a quarter of a
    micrometre.
    """
    rng = np.random.default_rng(3)
    result = qualify(
        touches_of(made_up_response(rng, 0.0), PATTERN, rng),
        25.0,
        tip_diameter=6.0,
        kind="physical",
        search_outliers=False,
    )
    assert isinstance(result.fit, PhysicalMapFit)
    across, along = result.fit.gauge_uncertainty[:2].max(), result.fit.gauge_uncertainty[2]
    assert across < along
    # No knowledge is better than the exact map: then only noise is left, 0.3 µm over 75 touches.
    # Along the axis a constant of the map and the height are told apart by the noise at least.
    known = NOISE * np.sqrt(np.diag(np.linalg.inv(PATTERN.T @ PATTERN)))
    with_level = np.column_stack([PATTERN, np.ones(len(PATTERN))])
    apart = NOISE * np.sqrt(np.linalg.inv(with_level.T @ with_level)[2, 2])
    # The noise itself is determined to 10 % by 50 degrees of freedom; three of these.
    u = np.sqrt(np.diag(result.center_covariance))
    assert np.all(u[:2] > 0.7 * known[:2])
    assert u[2] > 0.7 * apart
    assert along < 0.35e-3
    assert np.all(np.abs(result.center - [120.0, -40.0, 7.0]) < 3.0 * u)
    assert "first harmonic" in result.pretravel_map.provenance.gauge


def test_without_the_tip_diameter_points_are_the_same() -> None:
    rng = np.random.default_rng(4)
    touches = touches_of(made_up_response(rng, 0.0), PATTERN, rng)
    told, open_ = (
        qualify(touches, 25.0, tip_diameter=d, kind="physical", search_outliers=False)
        for d in (6.0, None)
    )
    part = Touches(PART * 30.0, PART)
    first, second = (apply(part, r.pretravel_map, extrapolate=True) for r in (told, open_))
    off = np.sum((first.positions - second.positions) * PART, axis=1)
    off -= PART @ np.linalg.lstsq(PART, off)[0]
    assert off.std() < 0.1e-3


def test_too_few_directions() -> None:
    n = sphere_pattern_25()[:7]
    with pytest.raises(PretravelError, match="touch at least 8"):
        qualify(Touches(n * 15.49, n), 25.0, tip_diameter=6.0, kind="physical")
