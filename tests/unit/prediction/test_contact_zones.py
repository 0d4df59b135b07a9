"""Sizes of the meshes that resolve the contacts, and the limits of Hertz's ellipse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.fem.mesh import MeshSettings
from pretravel.prediction.hertz import ellipticity
from tests.support import full_contact


@pytest.mark.parametrize("refinement", [1.0, 2.5])
def test_contact_zones_have_the_stated_elements(
    monkeypatch: pytest.MonkeyPatch, refinement: float
) -> None:
    """On rods: size = patch setting * patch radius / refinement; the balls' zone is 10 % wider."""
    asked: dict[str, Any] = {}
    monkeypatch.setattr(full_contact, "probe_solids", lambda _, zone: zone)
    monkeypatch.setattr(full_contact, "finite_element_model", lambda *given: given)
    monkeypatch.setattr(full_contact, "mesh_solids", lambda solids, fine: (solids, fine))
    monkeypatch.setattr(full_contact, "ball_mesh", lambda *given: asked.setdefault("ball", given))
    probe, base = load_probe("omp40-2"), MeshSettings(refinement=refinement, body=0.7)
    model, _ = full_contact.resolved_bodies(probe, 0.05, 0.004, base)
    solids, (_, fine) = model[1], model[2]
    assert solids == 0.05
    assert fine.patch_radius * probe.tripod.rod_radius == pytest.approx(0.05)
    assert fine.patch * 0.05 / fine.refinement == pytest.approx(0.004)
    assert (fine.body, fine.refinement) == (0.7, refinement)
    assert asked["ball"] == pytest.approx((probe.seats.ball_radius, 0.055, 0.004))


@pytest.mark.parametrize("ratio", [0.999, 1e6, 2e6, np.nan])
def test_ratios_that_no_ellipse_has_are_refused(ratio: float) -> None:
    assert np.all(np.isfinite(ellipticity([1.0, 0.999e6])))
    with pytest.raises(PretravelError, match="between 1 and a million"):
        ellipticity([2.0, ratio])
