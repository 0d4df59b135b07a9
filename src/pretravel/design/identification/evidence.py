"""What a description is compared with: the touches that a map holds, or else the map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, PretravelError
from pretravel.maps import Origin, PretravelMap, TouchedMeans, is_reversal, same_tip
from pretravel.prediction import Probe
from pretravel.six_seats import curved_part_factor

SMALLEST_ERROR = 0.05 * MICROMETRE
"""Smallest assumed standard uncertainty of a model in each direction. [mm]"""
_MOST_NODES = 600
_DETAILED = ("harmonic", "physical", "averaged")


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a description is compared with.

    Attributes
    ----------
    directions : (n, 3) float
        Machine frame.
    value : (n,) float
        Pretravel. [mm]
    covariance : (n, n) float
        Of the values and of the model. [mm²]
    level_known : bool
        Else pretravel is relative to its mean.
    tip_factor : float
        Approach of tip and reference over that of tip and flat part.
    noise_dof : float, optional
        Degrees of freedom of the scatter of the touches; None for a map without touches.
    warnings : tuple of str
    """

    directions: FloatArray
    value: FloatArray
    covariance: FloatArray
    level_known: bool
    tip_factor: float = 1.0
    noise_dof: float | None = None
    warnings: tuple[str, ...] = ()


def refuse_other_probe(pretravel_map: PretravelMap, probe: Probe) -> None:
    """Refuse a description of another axis or another tip than those of the map.

    Raises
    ------
    PretravelError
        Also of a map from means at two orientations of the spindle, which no probe has.
    """
    if is_reversal(pretravel_map.provenance.orientation):
        raise PretravelError(
            "the map is from means at two orientations of the spindle (pretravel reversal): it has "
            "no odd lobes, and no description explains it. Use a map from touches at one",
            inputs=("map_file",),
        )
    if probe.orientation.matrix[:, 2] @ pretravel_map.rotation[:, 2] < 1.0 - 1e-6:
        raise PretravelError(
            "the axis of the description is not that of the map: give the description "
            "the orientation in which the map was made",
            inputs=("probe",),
        )
    if not same_tip(2.0 * probe.tip.radius, 2.0 * pretravel_map.tip_radius):
        raise PretravelError(
            f"the tip of the description has a diameter of {2.0 * probe.tip.radius:.6g} mm, that "
            f"of the map {2.0 * pretravel_map.tip_radius:.6g} mm: one of them is of another probe",
            inputs=("probe", "map_file"),
        )


def evidence_of(pretravel_map: PretravelMap) -> Evidence:
    """The touches that a map was fitted to; without them the map itself.

    Raises
    ------
    PretravelError
        A map that holds neither its touches nor what they said of each direction.
    """
    if pretravel_map.touched is not None:
        return _of_touches(pretravel_map, pretravel_map.touched)
    return _of_map(pretravel_map)


def _of_touches(pretravel_map: PretravelMap, touched: TouchedMeans) -> Evidence:
    """Independent errors of the touches; errors of the reference and of the delay are common."""
    nodes = pretravel_map.support.nodes
    part = slice(None, None, len(nodes) // _MOST_NODES + 1)
    directions = nodes[part] @ pretravel_map.rotation.T
    own = pretravel_map.repeatability**2 / touched.counts[part] + SMALLEST_ERROR**2
    by_delay = pretravel_map.change_by_delay(directions)
    covariance = np.diag(own) + pretravel_map.u_tip_radius**2 + np.outer(by_delay, by_delay)
    factor, setup = 1.0, pretravel_map.provenance.setup
    if setup is not None:
        bend = 2.0 / setup.diameter
        bends = np.array([[-bend, 0.0] if setup.ring else [bend, bend]])
        factor = float(curved_part_factor(pretravel_map.tip_radius, bends)[0])
    return Evidence(
        directions=directions,
        value=touched.pretravel[part],
        covariance=covariance,
        level_known=pretravel_map.provenance.level_known,
        tip_factor=factor if math.isfinite(factor) else 1.0,
        noise_dof=pretravel_map.repeatability_dof,
    )


def _of_map(pretravel_map: PretravelMap) -> Evidence:
    """The map in its nodes, with its covariance: the touched directions, or those of a table."""
    basis, warnings = pretravel_map.basis, []
    if basis.interpolates and pretravel_map.states_uncertainty:
        if pretravel_map.provenance.origin is Origin.QUALIFIED:
            raise PretravelError(
                "this map is a table (.csv) with uncertainties: it holds neither the touched "
                "directions nor the correlation of its errors, and what is identified from it can "
                "be wrong by many times its u; use the .json file of the qualification",
                inputs=("map_file",),
            )
        if pretravel_map.provenance.origin is not Origin.CALIBRATED:  # rig, separation: they do
            warnings.append(
                "this map is a table, which does not contain the correlation of its errors: u is "
                "too small; use the .json file of the qualification"
            )
    if not basis.interpolates and basis.kind not in _DETAILED:
        raise PretravelError(
            f"a map of kind {basis.kind} does not follow the lobes of a probe, and this one "
            "contains no touches (it is of an earlier version, or was updated). Qualify again, "
            "or with kind auto",
            inputs=("map_file",),
        )
    nodes = pretravel_map.support.nodes
    directions = nodes[:: len(nodes) // _MOST_NODES + 1] @ pretravel_map.rotation.T
    covariance = pretravel_map.value_covariance(directions)
    if pretravel_map.provenance.origin is Origin.QUALIFIED:
        covariance += pretravel_map.u_tip_radius**2  # of the reference, in all directions alike
    covariance[np.diag_indices_from(covariance)] += SMALLEST_ERROR**2
    return Evidence(
        directions=directions,
        value=pretravel_map.pretravel(directions, extrapolate=True),
        covariance=covariance,
        level_known=pretravel_map.provenance.level_known,
        warnings=tuple(warnings),
    )
