"""The map of a described probe, straight from its name or file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pretravel.base import fibonacci_cap
from pretravel.maps import PretravelMap
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.compliance.base import compliance_model
from pretravel.prediction.trigger import predict, predicted_map
from pretravel.six_seats import probe_response, response_map


def described_map(
    probe: str | Path, model: str = "analytic", *, tip_diameter: float | None = None
) -> PretravelMap:
    """The map that a described probe is predicted to have, exact in every direction.

    Parameters
    ----------
    probe : str or Path
        Catalogue name, or path of a TOML description.
    model : str
        See `pretravel.prediction.compliance.MODELS`.
    tip_diameter : float, optional
        Instead of the description's. [mm]

    Returns
    -------
    PretravelMap
        Over the half sphere that a probe from above can touch.

    >>> described_map("omp40-2").kind
    'physical'
    """
    description = load_probe(probe)
    trigger = predict(description, fibonacci_cap(400), model)
    if compliance_model(model).condenses(description):
        found = response_map(description, probe_response(description, model), trigger)
    else:
        found = predicted_map(description, trigger)
    return found if tip_diameter is None else replace(found, tip_radius=0.5 * tip_diameter)
