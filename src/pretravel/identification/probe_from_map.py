"""Identification of a probe description from a measured map."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, polar_angle
from pretravel.base.errors import DescriptionError, PretravelError
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.prediction.catalogue import rewritten
from pretravel.prediction.compliance.base import ComplianceModel
from pretravel.prediction.description import Probe, StylusSegment
from pretravel.prediction.predict import predict

SMALLEST_ERROR = 0.05 * MICROMETRE
"""Smallest assumed standard uncertainty of a model in each direction. [mm]"""
LARGEST_RELATIVE_U = 0.3
"""Relative (angles: in rad) standard uncertainty above which a number is undetermined."""
MISFIT = 2.0
"""Ratio of the residuals to the map's uncertainty above which they are a misfit."""
_DIRECTIONS = 150
_MOST_NODES = 600
_CODE_SCALE, _SHIFT_SCALE = 0.1, 1e-3
_LIMIT_STEP = 0.01
_FIRST_ANGLES = np.radians(np.arange(0.0, 120.0, 5.0))
_FOLLOWED = 3
_OUTSIDE = 1e6  # whitened residual of a description that cannot exist


@dataclass(frozen=True, eq=False)
class Identification:
    """A description fitted to a map.

    Attributes
    ----------
    probe : Probe
    names : tuple of str
        Of the free numbers.
    values, standard_uncertainty : (k,) float each
        In mm, N or rad.
    relative_uncertainty : (k,) float
        Relative for lengths and forces, in rad for angles.
    residuals : (n,) float
        Map less model, after the shift of the reference. [mm]
    directions : (n, 3) float
        In the machine frame.
    shift : (3,) float
        Of the reference of the map from that of the model. [mm]
    unknown : tuple of str
        Sentences on numbers that the map does not determine.
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
    """Identify numbers of a description from a measured map.

    Parameters
    ----------
    pretravel_map : PretravelMap
        Of any kind.
    probe : Probe
        The start, and the numbers that are not free.
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
        Unknown names; a fit that leaves the range of possible probes; a description with friction.

    Notes
    -----
    Generalised least squares with the map's covariance (and `SMALLEST_ERROR` in each
    direction). A shift of the reference is free, since a map does not contain it. A map of
    pretravel determines the product of compliance and force; it distinguishes preload and
    stiffness only by the nonlinearity of the seats and by the lobes. So free few numbers, and
    read `unknown`.
    """
    numbers = free_numbers(free)
    if probe.seats.friction > 0.0:
        raise PretravelError(
            f"{probe.name} has friction {probe.seats.friction:g} at its seats; numbers are "
            "identified with statics, since a map hardly shows friction: set friction of [seats] "
            "to 0",
            inputs=("probe",),
        )
    fit = _MapFit(pretravel_map, probe, tuple(numbers), model)
    parameters, jacobian = _fitted(fit, _starts(fit, free))
    try:
        fitted = fit.described(parameters)
    except DescriptionError as error:
        raise PretravelError(
            f"the fit left the range of possible probes ({error}); free fewer numbers, or start "
            "from a description nearer to the probe",
            inputs=("free", "probe"),
        ) from None
    codes, unknown = _uncertainty(jacobian, numbers, tuple(free))
    unknown += _numbers_at_limits(fit, fitted, parameters, free)
    if pretravel_map.basis.interpolates and pretravel_map.states_uncertainty:
        unknown.append(
            "this map is a table, which does not contain the correlation of its errors: u is too "
            "small; use the .json file of the qualification"
        )
    residuals = fit.residuals(fitted, parameters)
    widening, misfit = _misfit(residuals, fit.covariance)
    unknown += misfit
    if "rotation" in free:
        fitted = _with_nearest_rotation(fitted, probe)
    values = np.array([number.of(fitted) for number in numbers])
    relative_uncertainty = codes * widening
    scale = np.where([number.relative for number in numbers], values, 1.0)
    return Identification(
        probe=fitted,
        names=tuple(free),
        values=values,
        standard_uncertainty=relative_uncertainty * scale,
        relative_uncertainty=relative_uncertainty,
        residuals=residuals,
        directions=fit.directions,
        shift=np.asarray(-parameters[len(numbers) : len(numbers) + 3]),
        unknown=tuple(unknown),
    )


@dataclass(frozen=True, eq=False)
class _MapFit:
    """Residuals between a map and the model of a description.

    The parameters are the codes of the free numbers, then the shift of the reference, and a level
    where the map contains pretravel only relative to its mean.
    """

    pretravel_map: PretravelMap
    probe: Probe
    numbers: tuple[FreeNumber, ...]
    model: str | ComplianceModel

    @cached_property
    def directions(self) -> FloatArray:
        """Directions over the support of the map, machine frame, (n, 3)."""
        return _directions_of_support(self.pretravel_map)

    @cached_property
    def value(self) -> FloatArray:
        """Pretravel of the map, (n,). [mm]"""
        return self.pretravel_map.pretravel_and_uncertainty(self.directions, extrapolate=True)[0]

    @cached_property
    def covariance(self) -> FloatArray:
        """Of map and model together, (n, n). [mm²]"""
        covariance = self.pretravel_map.value_covariance(self.directions)
        covariance[np.diag_indices_from(covariance)] += SMALLEST_ERROR**2
        return covariance

    @cached_property
    def root(self) -> FloatArray:
        """Cholesky factor of the covariance, (n, n)."""
        return np.asarray(np.linalg.cholesky(self.covariance), dtype=np.float64)

    @cached_property
    def reference(self) -> FloatArray:
        """Change of the residuals by the shift (and the level) of the reference, (n, 3 or 4)."""
        columns = 3 if self.pretravel_map.provenance.level_known else 4
        level = np.ones((len(self.directions), 1))
        return np.hstack([self.directions, level])[:, :columns]

    def start(self) -> FloatArray:
        """The parameters of the description at the start."""
        codes = [number.code(number.of(self.probe)) for number in self.numbers]
        return np.concatenate([codes, np.zeros(self.reference.shape[1])])

    def described(self, parameters: FloatArray) -> Probe:
        """The description with the free numbers of the parameters."""
        found = self.probe
        for number, code in zip(self.numbers, parameters, strict=False):
            found = number.put(found, number.value(float(code)))
        return found

    def residuals(self, probe: Probe, parameters: FloatArray) -> FloatArray:
        """Map less model, after the shift of the reference, (n,). [mm]"""
        in_probe_frame = self.directions @ probe.orientation.matrix
        predicted = predict(probe, in_probe_frame, self.model).pretravel
        of_reference = self.reference @ parameters[len(self.numbers) :]
        return np.asarray(self.value - predicted + of_reference)

    def whitened(self, parameters: FloatArray) -> FloatArray:
        """Residuals of unit variance, (n,)."""
        try:
            residuals = self.residuals(self.described(parameters), parameters)
        except DescriptionError:
            return np.full(len(self.value), _OUTSIDE)
        return np.asarray(np.linalg.solve(self.root, residuals))


def _starts(fit: _MapFit, free: Sequence[str]) -> list[FloatArray]:
    """Parameters to start from: with a free rotation, the best of angles all around.

    Lobes have kinks, and each angle near a kink can be a local minimum.
    """
    start = fit.start()
    if "rotation" not in free:
        return [start]
    column = list(free).index("rotation")
    starts = []
    for angle in _FIRST_ANGLES:
        rotated = start.copy()
        rotated[column] = angle
        starts.append(rotated)
    return sorted(starts, key=lambda x: float(np.sum(fit.whitened(x) ** 2)))[:_FOLLOWED]


def _fitted(fit: _MapFit, starts: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """The best parameters from all starts, and the Jacobian there."""
    from scipy.optimize import least_squares

    codes = len(fit.numbers)
    scale = np.concatenate(
        [np.full(codes, _CODE_SCALE), np.full(fit.reference.shape[1], _SHIFT_SCALE)]
    )
    best = min(
        (least_squares(fit.whitened, start, x_scale=scale) for start in starts),
        key=lambda found: float(found.cost),
    )
    return np.asarray(best.x), np.asarray(best.jac)


def _uncertainty(
    jacobian: FloatArray, numbers: Sequence[FreeNumber], names: tuple[str, ...]
) -> tuple[FloatArray, list[str]]:
    """Standard uncertainties of the codes, and sentences on undetermined numbers."""
    # By singular values: a combination that changes nothing gets a very large u.
    norms = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    _, singular, rows = np.linalg.svd(jacobian / norms, full_matrices=False)
    weights = (rows.T / np.maximum(singular, 1e-9)) / norms[:, None]
    u = np.sqrt(np.sum(weights**2, axis=1))[: len(numbers)]
    sentences = []
    for index in np.flatnonzero(u > LARGEST_RELATIVE_U).tolist():
        worst = np.abs(weights[: len(numbers), int(np.argmax(np.abs(weights[index])))])
        partners = [
            names[i] for i in np.argsort(-worst) if i != index and worst[i] > 0.2 * worst.max()
        ]
        size = f"{100.0 * u[index]:.0f} %" if numbers[index].relative else f"{u[index]:.1f} rad"
        sentences.append(
            f"the map hardly determines {names[index]} (u = {size})"
            + (f": a change of it is undone by {', '.join(partners)}" if partners else "")
            + "; measure it, or leave it as described"
        )
    return u, sentences


def _numbers_at_limits(
    fit: _MapFit, fitted: Probe, parameters: FloatArray, free: Sequence[str]
) -> list[str]:
    """Sentences on numbers that cannot change further in a possible description."""
    sentences = []
    for number, name, code in zip(fit.numbers, free, parameters, strict=False):
        for step in (_LIMIT_STEP, -_LIMIT_STEP):
            try:
                number.put(fitted, number.value(float(code) + step))
            except DescriptionError as error:
                sentences.append(
                    f"{name} reached the limit of what a description allows ({error}): its value "
                    "and u are not valid"
                )
    return sentences


def _misfit(residuals: FloatArray, covariance: FloatArray) -> tuple[float, list[str]]:
    """Factor by which a misfit widens the uncertainties, and a sentence on it.

    The part of the map that the model does not represent counts as an error of the map that is
    common to several directions (Birge's ratio, with the errors of map and model in quadrature).
    """
    ratio = float(np.sqrt(np.mean((residuals / np.sqrt(np.diag(covariance))) ** 2)))
    if ratio <= MISFIT:
        return 1.0, []
    rms = np.sqrt(np.mean(residuals**2)) / MICROMETRE
    sentence = (
        f"map and model differ by {rms:.2f} µm (rms), {ratio:.1f} times as much as the map's "
        "uncertainty explains: this is another kind of probe, or other numbers than these should "
        "be free; u is wider for it"
    )
    return ratio * math.sqrt(_directions_per_independent_error(covariance)), [sentence]


def _directions_per_independent_error(covariance: FloatArray) -> float:
    """The number of directions over the number of independent errors among them."""
    values = np.linalg.eigvalsh(covariance)
    return float(len(values) * np.sum(values**2) / np.sum(values) ** 2)


def _with_nearest_rotation(found: Probe, start: Probe) -> Probe:
    """The orientation nearest to the start, of the three equal ones of an even tripod."""
    azimuths = np.sort(np.mod(found.tripod.rod_azimuths, 2.0 * math.pi))
    third = 2.0 * math.pi / 3.0
    even = np.allclose(np.diff(azimuths), third, atol=1e-9)
    period = third if even else 2.0 * math.pi
    near = start.orientation.rotation
    rotation = near + (found.orientation.rotation - near + 0.5 * period) % period - 0.5 * period
    return replace(found, orientation=replace(found.orientation, rotation=rotation))


def _directions_of_support(pretravel_map: PretravelMap) -> FloatArray:
    """Directions over the support of a map, machine frame, (n, 3)."""
    nodes = pretravel_map.support.nodes
    if pretravel_map.basis.interpolates:
        # Between its nodes a table does not contain kinks.
        return np.asarray(nodes[:: len(nodes) // _MOST_NODES + 1] @ pretravel_map.rotation.T)
    spread = fibonacci_cap(_DIRECTIONS, float(polar_angle(nodes).max()))
    if len(nodes) > _DIRECTIONS:
        nodes = nodes[:: len(nodes) // _DIRECTIONS + 1]
    kept = spread[pretravel_map.support.supports(spread)]
    return np.concatenate([nodes, kept]) @ pretravel_map.rotation.T


@dataclass(frozen=True)
class FreeNumber:
    """One number of a description that can be identified.

    Attributes
    ----------
    table, key : str
        Its place in the TOML text.
    unit : float
        Factor from the unit of that key to the unit inside.
    of : callable
        From a probe to the number, in the unit inside.
    put : callable
        From a probe and a number to the probe with this number.
    relative : bool
        Whether the fit uses its logarithm: of lengths and forces, but not of angles.
    """

    table: str
    key: str
    unit: float
    of: Callable[[Probe], float]
    put: Callable[[Probe, float], Probe]
    relative: bool = True

    def code(self, value: float) -> float:
        """The number that the fit varies: the logarithm of the value, or the value itself."""
        return math.log(value) if self.relative else value

    def value(self, code: float) -> float:
        """The value that belongs to a number of the fit."""
        return math.exp(code) if self.relative else code


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
"""The numbers that can be identified, by name."""


def free_numbers(names: Sequence[str]) -> list[FreeNumber]:
    """The numbers with these names.

    Raises
    ------
    PretravelError
        No name, unknown names, a name given twice.

    >>> [number.key for number in free_numbers(["preload"])]
    ['preload_N']
    """
    if not names:
        raise PretravelError(f"no number is free; there are {', '.join(FREE)}", inputs=("free",))
    for name in names:
        if name not in FREE:
            raise PretravelError(
                f"'{name}' cannot be identified; there are {', '.join(FREE)}", inputs=("free",)
            )
    if len(set(names)) < len(names):
        raise PretravelError("a free number is named twice", inputs=("free",))
    return [FREE[name] for name in names]


def identified_description(text: str, found: Identification, source: str) -> str:
    """A description with the identified quantities and their uncertainties.

    Parameters
    ----------
    text : str
        TOML of the description from which the identification started.
    found : Identification
    source : str
        Name of the map, for the sources of the numbers.

    Returns
    -------
    str
        TOML; comments and other quantities stay as they are.
    """
    changes = {}
    for name, value, u in zip(found.names, found.values, found.standard_uncertainty, strict=True):
        number = FREE[name]
        # A description states the hub offset: lever = stylus length + hub offset.
        written = value - found.probe.stylus_length if name == "lever" else value
        changes[f"{number.table}.{number.key}"] = (
            float(f"{written / number.unit:.9g}"),
            f"identified from {source}, u = {u / number.unit:.2g}",
        )
    return rewritten(text, changes)
