"""The physical kind: its statements on the fit, and its refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.compensation.compensation import apply
from pretravel.directions import sphere_pattern_25
from pretravel.errors import PretravelError
from pretravel.formats.touches_csv import read_touches
from pretravel.identification.kind_registry import qualify
from pretravel.identification.physical import PhysicalMapFit
from pretravel.touches import Touches
from tests.support.example_maps import example_qualification
from tests.support.examples import PART as PART_TOUCHES
from tests.support.made_up_probes import PATTERN, made_up_response, touches_of

PART = read_touches(PART_TOUCHES).normals


def test_example_probe() -> None:
    """The truth of the example is unknown here. The residuals of the fit are as large as the
    scatter of the repeats, so no lack of fit is detected, and the report states this."""
    result = example_qualification("physical")
    fit = result.fit
    assert isinstance(fit, PhysicalMapFit)
    assert fit.misfit > 0.05
    assert result.residuals.std() == pytest.approx(0.30e-3, rel=0.1)
    assert result.warnings == ()
    assert result.pretravel_map.kind == "physical"


def test_another_kind_of_probe_is_noticed() -> None:
    """Lobes of 1 um that no tripod has are reported and added to u of the map."""
    rng = np.random.default_rng(2)
    response = made_up_response(rng, 0.0)
    touches = touches_of(response, PATTERN, rng)
    lobes = 1e-3 * np.cos(2.0 * np.arctan2(PATTERN[:, 1], PATTERN[:, 0])) * PATTERN[:, 2]
    wrong = replace(touches, positions=touches.positions - lobes[:, None] * PATTERN)
    result = qualify(wrong, 25.0, tip_diameter=6.0, kind="physical", search_outliers=False)
    assert isinstance(result.fit, PhysicalMapFit)
    assert result.fit.misfit < 0.01
    assert "six-seat kind" in " ".join(result.warnings)
    u = result.pretravel_map.standard_uncertainty(PART)
    assert u.min() > 0.3e-3


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
    assert np.sqrt(np.diag(result.center_covariance)) == pytest.approx(result.fit.gauge_uncertainty)
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
