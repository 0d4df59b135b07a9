"""A probe's description from a measured map: which numbers make the model fit it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.directions import fibonacci_cap, polar_angle
from pretravel.errors import DescriptionError, PretravelError
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.probe.description import Probe, StylusSegment
from pretravel.trigger.compliance.base import ComplianceModel
from pretravel.trigger.predict import predict
from pretravel.units import DEGREE, MICROMETRE

SMALLEST_ERROR = 0.05 * MICROMETRE
"""How well a model is trusted to have the form of a map at all. [mm]"""
_LARGEST_RELATIVE = 0.3
"""Relative (angles: in rad) standard uncertainty above which a number is called unknown."""
MISFIT = 2.0
"""Residuals this many times as large as the map's uncertainty are a misfit."""
_DIRECTIONS = 150
_MOST_NODES = 600


@dataclass(frozen=True)
class FreeNumber:
    """One number of a description that may be identified.

    Attributes
    ----------
    table, key : str
        Where it stands in the TOML text.
    unit : float
        Of that key, in ours.
    of : callable
        Probe -> the number, in our units.
    put : callable
        Probe, number -> the probe with it.
    relative : bool
        Whether it is fitted as a logarithm: lengths and forces are, angles are not.
    """

    table: str
    key: str
    unit: float
    of: Callable[[Probe], float]
    put: Callable[[Probe, float], Probe]
    relative: bool = True


def _with_stem(probe: Probe, diameter: float) -> tuple[StylusSegment, ...]:
    stem = probe.stem
    return tuple(
        replace(segment, diameter=diameter) if segment is stem else segment
        for segment in probe.stylus
    )


def _rod(index: int) -> FreeNumber:
    def put(probe: Probe, value: float) -> Probe:
        azimuths = list(probe.tripod.rod_azimuths)
        azimuths[index] = value
        return replace(
            probe,
            tripod=replace(probe.tripod, rod_azimuths=(azimuths[0], azimuths[1], azimuths[2])),
        )

    return FreeNumber(
        "tripod",
        f"rod_azimuths_deg[{index}]",
        DEGREE,
        lambda probe: probe.tripod.rod_azimuths[index],
        put,
        relative=False,
    )


FREE: Mapping[str, FreeNumber] = {
    "preload": FreeNumber(
        "spring", "preload_N", 1.0, lambda p: p.preload, lambda p, v: replace(p, preload=v)
    ),
    "lever": FreeNumber(
        "hub",
        "offset_mm",
        1.0,
        lambda p: p.lever,
        lambda p, v: p.with_lever(v),
    ),
    "tripod_radius": FreeNumber(
        "tripod",
        "radius_mm",
        1.0,
        lambda p: p.tripod.radius,
        lambda p, v: replace(p, tripod=replace(p.tripod, radius=v)),
    ),
    "support_angle": FreeNumber(
        "seats",
        "support_angle_deg",
        DEGREE,
        lambda p: p.seats.support_angle,
        lambda p, v: replace(p, seats=replace(p.seats, support_angle=v)),
        relative=False,
    ),
    "ball_radius": FreeNumber(
        "seats",
        "ball_radius_mm",
        1.0,
        lambda p: p.seats.ball_radius,
        lambda p, v: replace(p, seats=replace(p.seats, ball_radius=v)),
    ),
    "rod_radius": FreeNumber(
        "tripod",
        "rod_radius_mm",
        1.0,
        lambda p: p.tripod.rod_radius,
        lambda p, v: replace(p, tripod=replace(p.tripod, rod_radius=v)),
    ),
    "stem_diameter": FreeNumber(
        "stylus",
        "diameter_mm",
        1.0,
        lambda p: p.stem.diameter,
        lambda p, v: replace(p, stylus=_with_stem(p, v)),
    ),
    "rotation": FreeNumber(
        "orientation",
        "rotation_deg",
        DEGREE,
        lambda p: p.orientation.rotation,
        lambda p, v: replace(p, orientation=replace(p.orientation, rotation=v)),
        relative=False,
    ),
    "rod_azimuth_1": _rod(0),
    "rod_azimuth_2": _rod(1),
    "rod_azimuth_3": _rod(2),
}
"""What may be identified, by the name of the command line."""


@dataclass(frozen=True, eq=False)
class Identification:
    """A description fitted to a map.

    Attributes
    ----------
    probe : Probe
    names : tuple of str
        Of the free numbers.
    values, standard_uncertainty : (k,) float each
        In our units.
    relative_uncertainty : (k,) float
        Of lengths and forces relative, of angles in rad.
    residuals : (n,) float
        Map less model, a shift of the reference taken off. [mm]
    directions : (n, 3) float
        Machine frame.
    shift : (3,) float
        Of the reference, that map and model do not share. [mm]
    unknown : tuple of str
        Sentences on what the map does not tell.
    """

    probe: Probe
    names: tuple[str, ...]
    values: FloatArray
    standard_uncertainty: FloatArray
    relative_uncertainty: FloatArray
    residuals: FloatArray
    directions: FloatArray
    shift: FloatArray
    unknown: tuple[str, ...]


def identify(
    pretravel_map: PretravelMap,
    probe: Probe,
    free: Sequence[str],
    *,
    model: str | ComplianceModel = "analytic",
) -> Identification:
    """The numbers of a description that make a model agree with a measured map.

    Parameters
    ----------
    pretravel_map : PretravelMap
        Of any kind.
    probe : Probe
        Where to start, and what is not free.
    free : names
        Of `FREE`.
    model : str or callable
        As for `predict`.

    Returns
    -------
    Identification

    Raises
    ------
    PretravelError
        Names that are not known; a fit that leaves the range of possible probes.

    Notes
    -----
    Generalised least squares with the map's covariance (and `SMALLEST_ERROR` in each
    direction). A shift of the reference is free, since a map does not know it. A map of
    pretravel tells compliance times force: preload and stiffness together only up to
    what Hertz's seats and the lobes add, so free few numbers and see `unknown`.
    """
    from scipy.optimize import least_squares

    numbers = _named(free)
    directions = _spread(pretravel_map)
    value, _ = pretravel_map.pretravel_and_uncertainty(directions, extrapolate=True)
    covariance = pretravel_map.value_covariance(directions)
    covariance[np.diag_indices_from(covariance)] += SMALLEST_ERROR**2
    root = np.linalg.cholesky(covariance)
    start = np.array([_coded(n, n.of(probe)) for n in numbers])
    if "rotation" in free:
        start[list(free).index("rotation")] = 0.0

    def described(x: FloatArray) -> Probe:
        found = probe
        for number, code in zip(numbers, x, strict=True):
            found = number.put(found, math.exp(code) if number.relative else float(code))
        return found

    # A shift of the reference; and a level, where the map is relative to its mean.
    nuisance = np.hstack([directions, np.ones((len(directions), 1))])[
        :, : 3 if pretravel_map.provenance.level_known else 4
    ]

    k, extra = len(numbers), nuisance.shape[1]

    def whitened(x: FloatArray) -> FloatArray:
        try:
            misses = _misses(described(x[:k]), directions, value, model) + nuisance @ x[k:]
        except DescriptionError:
            return np.full(len(value), 1e6)
        return np.asarray(np.linalg.solve(root, misses))

    starts = [np.concatenate([start, np.zeros(extra)])]
    if "rotation" in free:
        # Lobes have kinks, and every wrong turn near one is a trap: look all around first.
        column = list(free).index("rotation")
        tried = []
        for turn in np.radians(np.arange(0.0, 120.0, 5.0)):
            first = starts[0].copy()
            first[column] = turn
            tried.append((float(np.sum(whitened(first) ** 2)), first))
        tried.sort(key=lambda found: found[0])
        starts = [first for _, first in tried[:3]]
    scale_of = np.concatenate([np.full(k, 0.1), np.full(extra, 1e-3)])
    best = min(
        (least_squares(whitened, first, x_scale=scale_of) for first in starts),
        key=lambda found: float(found.cost),
    )
    try:
        fitted = described(best.x[:k])
    except DescriptionError as error:
        raise PretravelError(
            f"the fit left the range of possible probes ({error}); free fewer numbers, or start "
            "from a description nearer to the probe"
        ) from None
    codes, unknown = _uncertainty(np.asarray(best.jac), numbers, tuple(free))
    residuals = _misses(fitted, directions, value, model) + nuisance @ best.x[k:]
    for number, name, code in zip(numbers, free, best.x[:k], strict=True):
        for step in (0.01, -0.01):
            try:
                moved = math.exp(code + step) if number.relative else code + step
                number.put(fitted, moved)
            except DescriptionError as error:
                unknown.append(
                    f"{name} ran into the limit of what a description allows ({error}): its value "
                    "and u mean nothing"
                )
    if pretravel_map.basis.interpolates and pretravel_map.states_uncertainty:
        unknown.append(
            "this map is a table, which does not say how its errors hang together: u is too small; "
            "use the .nc that qualify writes"
        )
    # What the model misses counts as the map's error at every few directions (Birge's ratio
    # with the map's own errors, and the model's trust, in quadrature).
    expected = np.sqrt(np.diag(covariance))
    ratio = float(np.sqrt(np.mean((residuals / expected) ** 2)))
    if ratio > MISFIT:
        codes = codes * ratio * math.sqrt(_shared(covariance))
        unknown.append(
            f"the model misses the map by {np.sqrt(np.mean(residuals**2)) / MICROMETRE:.2f} µm, "
            f"{ratio:.1f} times what the map's uncertainty explains: this is another kind of "
            "probe, or other numbers than these should be free; u has been widened for it"
        )
    if "rotation" in free:
        fitted = _nearest_turn(fitted, probe)
    values = np.array([number.of(fitted) for number in numbers])
    scale = np.where([number.relative for number in numbers], values, 1.0)
    shift = np.asarray(-best.x[k : k + 3])
    return Identification(
        probe=fitted,
        names=tuple(free),
        values=values,
        standard_uncertainty=codes * scale,
        relative_uncertainty=codes,
        residuals=residuals,
        directions=directions,
        shift=shift,
        unknown=tuple(unknown),
    )


def _nearest_turn(found: Probe, start: Probe) -> Probe:
    """Of orientations that are alike, three for an even tripod, the one nearest to the start."""
    azimuths = np.sort(np.mod(found.tripod.rod_azimuths, 2.0 * math.pi))
    third = 2.0 * math.pi / 3.0
    even = np.allclose(np.diff(azimuths), third, atol=1e-9)
    period = third if even else 2.0 * math.pi
    near = start.orientation.rotation
    turned = near + (found.orientation.rotation - near + 0.5 * period) % period - 0.5 * period
    return replace(found, orientation=replace(found.orientation, rotation=turned))


def _shared(covariance: FloatArray) -> float:
    """How many directions say the same thing: their number over how many are independent."""
    values = np.linalg.eigvalsh(covariance)
    return float(len(values) * np.sum(values**2) / np.sum(values) ** 2)


def _named(free: Sequence[str]) -> list[FreeNumber]:
    if not free:
        raise PretravelError(f"nothing is free to be identified; there are {', '.join(FREE)}")
    for name in free:
        if name not in FREE:
            raise PretravelError(f"'{name}' cannot be identified; what can is {', '.join(FREE)}")
    if len(set(free)) < len(free):
        raise PretravelError("a number is named twice as free")
    return [FREE[name] for name in free]


def _coded(number: FreeNumber, value: float) -> float:
    return math.log(value) if number.relative else value


def _spread(pretravel_map: PretravelMap) -> FloatArray:
    """Directions over all that the map supports, machine frame."""
    nodes = pretravel_map.support.nodes
    if pretravel_map.basis.interpolates:
        # Between its nodes a table cuts kinks off.
        return np.asarray(nodes[:: len(nodes) // _MOST_NODES + 1] @ pretravel_map.rotation.T)
    spread = fibonacci_cap(_DIRECTIONS, float(polar_angle(nodes).max()))
    if len(nodes) > _DIRECTIONS:
        nodes = nodes[:: len(nodes) // _DIRECTIONS + 1]
    kept = spread[pretravel_map.support.supports(spread)]
    return np.concatenate([nodes, kept]) @ pretravel_map.rotation.T


def _misses(
    probe: Probe, directions: FloatArray, value: FloatArray, model: str | ComplianceModel
) -> FloatArray:
    turn = probe.orientation.matrix
    return np.asarray(value - predict(probe, directions @ turn, model).pretravel)


def _uncertainty(
    jacobian: FloatArray, numbers: Sequence[FreeNumber], names: tuple[str, ...]
) -> tuple[FloatArray, list[str]]:
    """Standard uncertainties of the coded numbers, and what is not told, in sentences."""
    # By singular values: combinations that nothing depends on get a huge, not a broken, u.
    scaled = jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    norms = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    _, singular, rows = np.linalg.svd(scaled, full_matrices=False)
    weights = (rows.T / np.maximum(singular, 1e-9)) / norms[:, None]
    u = np.sqrt(np.sum(weights**2, axis=1))[: len(numbers)]
    sentences = []
    for index in np.flatnonzero(u > _LARGEST_RELATIVE).tolist():
        worst = np.abs(weights[: len(numbers), int(np.argmax(np.abs(weights[index])))])
        partners = [
            names[i] for i in np.argsort(-worst) if i != index and worst[i] > 0.2 * worst.max()
        ]
        size = f"{100.0 * u[index]:.0f} %" if numbers[index].relative else f"{u[index]:.1f} rad"
        sentences.append(
            f"the map hardly tells {names[index]} (u = {size})"
            + (f": a change of it is undone by {', '.join(partners)}" if partners else "")
            + "; measure it, or leave it as described"
        )
    return u, sentences
