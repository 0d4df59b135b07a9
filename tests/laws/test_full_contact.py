"""The condensed model against full nonlinear contact: elastic rods and balls, no Hertz."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.directions import from_angles
from pretravel.model.fem.condensation import condense
from pretravel.model.fem.full_contact import contact_state, full_contact
from pretravel.model.fem.mesh import MeshSettings
from pretravel.model.fem.seat_ball import ball_correction
from pretravel.probe.catalogue import load_probe
from pretravel.probe.materials import material
from pretravel.trigger.compliance.base import TIP_ON_PART
from pretravel.trigger.compliance.fem import FiniteElements
from pretravel.trigger.event import trigger_force
from pretravel.trigger.loading import loaded
from pretravel.trigger.seats import seat_statics

DIRECTIONS = from_angles(
    np.radians([90.0, 90.0, 50.0, 90.0, 20.0]), np.radians([0.0, 60.0, 20.0, 180.0, 100.0])
)


@pytest.mark.slow
def test_condensed_and_full_contact_agree_in_five_directions() -> None:
    """0.2 % of the tip's deflection from rest to 98 % of the trigger force, 1e-4 N in reactions.

    Both use the same mesh of the moving part, so that only the treatment of contact differs. At
    the trigger itself the contact of a seat vanishes, and no mesh resolves it.
    """
    probe = load_probe("omp40-2")
    statics = seat_statics(probe)
    contact = full_contact(probe, 0.042, 0.0045, MeshSettings(refinement=0.5))
    reduced = condense(contact.model)
    reduced = replace(reduced, ball_correction=ball_correction(probe))
    model = FiniteElements(reduced)
    rest = contact_state(contact, probe.preload, np.zeros(3))
    assert rest.reactions == pytest.approx(statics.rest_reactions, abs=1e-4)
    assert rest.bearing.min() > 15  # the contacts are resolved, and lie inside their zones
    assert rest.bearing.max() < 0.9 * np.bincount(contact.seat_of).min()
    force, _ = trigger_force(statics.rest_reactions, statics.unit_reactions(DIRECTIONS))
    force = 0.98 * force
    loading = loaded(probe, statics, DIRECTIONS, force, material("steel"))
    parts = model.displacements(loading)
    ours = sum(vector for name, vector in parts.items() if name != TIP_ON_PART)
    for row, direction in enumerate(DIRECTIONS):
        state = contact_state(contact, probe.preload, force[row] * direction)
        reactions = loading.reactions[row]
        assert state.reactions == pytest.approx(reactions, abs=1e-4)
        full = state.tip - rest.tip
        assert np.linalg.norm(ours[row] - full) < 2e-3 * np.linalg.norm(full)
