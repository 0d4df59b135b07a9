"""Uncertainty budgets of a qualification: of a point that the map serves for, and of the radius."""

from __future__ import annotations

import math

import numpy as np

from pretravel.maps.provenance import STEEL_EXPANSION, USUAL_U_DIAMETER
from pretravel.qualification.map_warnings import over_support
from pretravel.qualification.qualification import Qualification
from pretravel.uncertainty.gum import Budget, Component


def part_point_budget(result: Qualification) -> Budget:
    """The budget of a point on a part, in the directions of the map on average.

    Parameters
    ----------
    result : Qualification

    Returns
    -------
    Budget
        In mm: scatter of a touch, map (root mean square over its directions), reference.
    """
    made = result.pretravel_map
    u_map = float(np.sqrt(np.mean(over_support(made)[2] ** 2)))
    return Budget(
        _stated(
            Component("repeatability", "A", made.repeatability, dof=_dof(result)),
            Component("fixed scatter", "B", made.fixed_scatter),
            Component("map", "B", u_map),
            *_of_reference(result),
        ),
        "a point on a part, rms over the map",
    )


def radius_budget(result: Qualification) -> Budget:
    """The budget of the effective radius of the tip.

    Parameters
    ----------
    result : Qualification

    Returns
    -------
    Budget
        In mm: touches, reference and, where several feeds separated it, signal delay.
    """
    known = (Component("touches", "A", result.fit.u_mean, dof=_dof(result)), *_of_reference(result))
    rest = result.u_effective_radius**2 - math.fsum(part.contribution**2 for part in known)
    delay = 0.0 if result.delay is None else math.sqrt(max(rest, 0.0))
    return Budget(_stated(*known, Component("signal delay", "B", delay)), "effective radius")


def _of_reference(result: Qualification) -> tuple[Component, ...]:
    """Calibration and temperature of the reference; a radius has half of its diameter's error."""
    setup = result.setup
    calibrated = USUAL_U_DIAMETER if setup.u_diameter is None else setup.u_diameter
    stated = "" if setup.u_diameter is not None else " (assumed)"
    warm = STEEL_EXPANSION * setup.diameter * setup.u_temperature
    return (
        Component(f"diameter of the reference{stated}", "B", calibrated, 0.5),
        Component("temperature of the reference", "B", warm, 0.5),
    )


def _dof(result: Qualification) -> float:
    return result.repeatability_dof if result.repeatability_dof > 0.0 else math.inf


def _stated(*components: Component) -> tuple[Component, ...]:
    """The sources that are not zero."""
    return tuple(component for component in components if component.contribution > 0.0)
