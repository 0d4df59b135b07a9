"""Identification of a probe description from a measured map, measured forces, or both."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, DescriptionError, FloatArray, PretravelError
from pretravel.design.identification.evidence import Evidence, evidence_of, refuse_other_probe
from pretravel.design.identification.free_numbers import FREE, FreeNumber, free_numbers
from pretravel.design.identification.measured_forces import MeasuredForces
from pretravel.maps import MapLike, as_map
from pretravel.prediction import ComplianceModel, Probe, predict, rewritten

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

LARGEST_RELATIVE_U = 0.3
"""Relative (for angles in rad) standard uncertainty above which a number is undetermined."""
MISFIT = 2.0
"""Ratio of the residuals to the map's uncertainty above which they are a misfit."""
_CODE_SCALE, _SHIFT_SCALE = 0.1, 1e-3
_LIMIT_STEP = 0.01
_FIRST_STEP = 0.5 * DEGREE  # of rotations: lobes that fit by chance are 2° wide
_FIRST_DIFFERENCE = 1e-3
_ROD_OFFSETS = np.array([-3.0, 0.0, 3.0]) * DEGREE
_WIDEST_STEP = 0.3  # of a code, in one linear step
_FOLLOWED = 8
_HOPELESS = 3.0  # times the chi-squared of the best start: not followed
_DIFFERENCE = 1e-5  # of a code, for slopes
_SAME_SCATTER = 0.05  # probability of the F test
_SURELY_WORSE = 9.2  # chi-squared beyond the best one: a probability of 1 % against it
_AS_GOOD = 2.0  # chi-squared beyond the best one, below which nothing speaks for either
_SAME_MAXIMUM = 1.0  # in standard uncertainties
_RARE_MISFIT = 0.01
_MOST_FRICTION = 0.35
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
        Relative for lengths and forces, in rad for angles; not a number at the limit of what a
        description allows.
    residuals : (n,) float
        Touches, or the map where it has none, less model, after the shift of the reference. [mm]
    directions : (n, 3) float
        In the machine frame.
    shift : (3,) float
        Of the reference of the map from that of the model. [mm]
    unknown : tuple of str
        Sentences on numbers that the map does not determine, and on other descriptions that explain
        it nearly as well.
    forces : MeasuredForces or None
        That were fitted, too.
    force_residuals : (m,) float
        Measured minus predicted. [N]
    described : (k,) float
        Values of the description at the start, in the units of `values`.
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
    forces: MeasuredForces | None = None
    force_residuals: FloatArray = field(default_factory=lambda: np.zeros(0))
    described: FloatArray = field(default_factory=lambda: np.zeros(0))


def identify(
    pretravel_map: MapLike | None,
    probe: Probe,
    free: Sequence[str],
    *,
    model: str | ComplianceModel = "analytic",
    forces: MeasuredForces | None = None,
) -> Identification:
    """Identify numbers of a description from a measured map, from measured forces, or both.

    Parameters
    ----------
    pretravel_map : PretravelMap, Qualification, str, Path or None
        Of any kind, with what was touched; else predicted, harmonic, physical or averaged. None:
        forces alone.
    probe : Probe
        The start, and the numbers that are not free.
    free : names
        Of `FREE`.
    model : str or callable
        As for `predict`.
    forces : MeasuredForces, optional
        They determine the preload and the lever, which a map does not. Without a map, friction at
        the seats can be free, too.

    Returns
    -------
    Identification

    Raises
    ------
    PretravelError
        Neither map nor forces; unknown names; a fit that leaves the range of possible probes; a
        description with friction; a map without the touches that the fit needs
        (`pretravel.design.identification.evidence`).

    Notes
    -----
    Generalised least squares in the touched directions: a map is smooth where a probe has kinks, so
    that between its touches the two differ by more than the map's u. The weights are the scatter of
    the touches, which repeats and residuals estimate together, and the u of the reference. A shift
    of the reference is free, since a map does not contain it. The fit begins at the best of all
    rotations. If several fit equally well, the result has the rotation nearest to the start, and
    `unknown` names the others. A map of pretravel determines the product of compliance and force;
    it distinguishes preload and stiffness only by the nonlinearity of the seats and by the lobes.
    Therefore free few numbers, and read `unknown`.
    """
    numbers = free_numbers(free)
    if pretravel_map is None:
        return _from_forces(forces, probe, tuple(free), model)
    pretravel_map = as_map(pretravel_map)
    _refuse_friction(probe, free)
    refuse_other_probe(pretravel_map, probe)
    evidence = evidence_of(pretravel_map)
    fit = _MapFit(evidence, probe, tuple(numbers), model, forces)
    fit.residuals(probe, fit.start())  # what the model cannot do with the description itself
    try:
        maxima = _maxima(fit, free)
        parameters, jacobian = maxima[0].parameters, maxima[0].jacobian
        fitted = fit.described(parameters)
    except PretravelError as error:
        raise PretravelError(
            f"the fit left the range of possible probes ({error}); free fewer numbers, or start "
            "from a description nearer to the probe",
            inputs=("free", "probe"),
        ) from None
    codes, unknown = _uncertainty(jacobian, numbers, tuple(free))
    at_limits = _numbers_at_limits(fit, fitted, parameters, free)
    unknown += at_limits
    residuals = fit.residuals(fitted, parameters)
    if evidence.noise_dof is None:
        widening, misfit = _misfit(residuals, evidence.covariance)
    else:
        widening, misfit = _misfit_of_touches(maxima[0], evidence, residuals)
    unknown += misfit
    unknown += _others_nearly_as_good(fit, maxima, codes, widening)
    unknown += evidence.warnings
    if forces is not None:
        by_forces, misfit = _misfit_of_forces(forces, fitted, model, len(numbers))
        widening, unknown = max(widening, by_forces), unknown + misfit
    if "rotation" in free:
        fitted = _with_nearest_rotation(fitted, probe)
    values = np.array([number.of(fitted) for number in numbers])
    limited = [any(said.startswith(f"{name} ") for said in at_limits) for name in free]
    relative_uncertainty = np.where(limited, math.nan, codes * widening)
    scale = np.where([number.relative for number in numbers], values, 1.0)
    return Identification(
        probe=fitted,
        names=tuple(free),
        values=values,
        standard_uncertainty=relative_uncertainty * scale,
        relative_uncertainty=relative_uncertainty,
        residuals=residuals,
        directions=evidence.directions,
        shift=np.asarray(-parameters[len(numbers) : len(numbers) + 3]),
        unknown=tuple(unknown),
        forces=forces,
        force_residuals=np.zeros(0) if forces is None else forces.residuals(fitted, model),
        described=np.array([number.of(probe) for number in numbers]),
    )


def _refuse_friction(probe: Probe, free: Sequence[str]) -> None:
    """Refuse friction, free or described, where numbers are identified from a map."""
    if "friction" in free:
        raise PretravelError(
            "a map hardly shows friction: it is identified from measured forces alone",
            inputs=("free", "map_file"),
        )
    probe.refuse_tip_friction("identification from a map")
    if probe.seats.friction > 0.0:
        raise PretravelError(
            f"{probe.name} has friction {probe.seats.friction:g} at its seats; numbers are "
            "identified with statics, since a map hardly shows friction: set friction of [seats] "
            "to 0",
            inputs=("probe",),
        )


def _starts_of_forces(
    whitened: Callable[[FloatArray], FloatArray],
    numbers: Sequence[FreeNumber],
    probe: Probe,
    free: tuple[str, ...],
) -> list[FloatArray]:
    """Codes from which the fit to forces begins; of a free rotation, the best three of a turn."""
    start = np.array([number.code(number.of(probe)) for number in numbers])
    starts = [start]
    if "rotation" in free:
        turns = np.arange(0.0, 2.0 * math.pi, 2.0 * _FIRST_STEP * 5.0)
        starts = [start + (np.arange(len(start)) == free.index("rotation")) * t for t in turns]
        starts = sorted(starts, key=lambda each: float(np.sum(whitened(each) ** 2)))[:3]
    return starts


def _fit_of_forces(
    whitened: Callable[[FloatArray], FloatArray],
    starts: Sequence[FloatArray],
    free: tuple[str, ...],
) -> OptimizeResult:
    """The best of the fits from several starts."""
    from scipy.optimize import least_squares

    # Friction moves forces in steps of its solution: slopes over a step that is larger than those.
    wide = "friction" in free
    slope = 1e-2 if wide else 1e-4
    high = np.array([_MOST_FRICTION if name == "friction" else np.inf for name in free])
    low = np.array([0.0 if name == "friction" else -np.inf for name in free])
    return min(
        (
            least_squares(
                whitened,
                np.clip(each, low, high),
                bounds=(low, high),
                x_scale=_CODE_SCALE,
                diff_step=np.full(len(each), slope),
                xtol=1e-3 if wide else 1e-10,
                ftol=1e-6 if wide else 1e-12,
            )
            for each in starts
        ),
        key=lambda each: float(each.cost),
    )  # fmt: skip


def _from_forces(
    forces: MeasuredForces | None,
    probe: Probe,
    free: tuple[str, ...],
    model: str | ComplianceModel,
) -> Identification:
    """Numbers of a description from measured forces alone."""
    if forces is None:
        raise PretravelError(
            "a description is identified from a map, from measured forces, or both: give one",
            inputs=("map_file", "forces"),
        )
    numbers = free_numbers(free)
    measured = forces
    if len(numbers) > len(measured):
        raise PretravelError(
            f"{len(measured)} forces do not determine {len(numbers)} numbers: free fewer",
            inputs=("free", "forces"),
        )

    def described(codes: FloatArray) -> Probe:
        found = probe
        for number, code in zip(numbers, codes, strict=True):
            found = number.put(found, number.value(float(code)))
        return found

    def whitened(codes: FloatArray) -> FloatArray:
        try:
            return measured.white(described(codes), model)
        except DescriptionError:
            return np.full(len(measured), _OUTSIDE)

    starts = _starts_of_forces(whitened, numbers, probe, free)
    found = _fit_of_forces(whitened, starts, free)
    fitted = described(found.x)
    codes, unknown = _uncertainty(np.asarray(found.jac), numbers, free)
    unknown = [sentence.replace("the map", "the forces", 1) for sentence in unknown]
    widening, misfit = _misfit_of_forces(measured, fitted, model, len(numbers))
    codes, unknown = codes * widening, unknown + misfit
    if "rotation" in free:
        fitted = _with_nearest_rotation(fitted, probe)
    values = np.array([number.of(fitted) for number in numbers])
    scale = np.where([number.relative for number in numbers], values, 1.0)
    return Identification(
        probe=fitted,
        names=free,
        values=values,
        standard_uncertainty=codes * scale,
        relative_uncertainty=codes,
        residuals=np.zeros(0),
        directions=np.zeros((0, 3)),
        shift=np.zeros(3),
        unknown=tuple(unknown),
        forces=measured,
        force_residuals=measured.residuals(fitted, model),
        described=np.array([number.of(probe) for number in numbers]),
    )


def _misfit_of_forces(
    forces: MeasuredForces, probe: Probe, model: str | ComplianceModel, free: int
) -> tuple[float, list[str]]:
    """Factor by which forces that differ from the model by more than their u widen uncertainties
    (Birge's ratio), and sentences on it and on copies.
    """
    from scipy.special import chdtrc

    white = forces.white(probe, model)
    dof = max(len(white) - free, 1)
    squares = float(np.sum(white**2))
    copies = _copies(forces)
    if chdtrc(dof, squares) > _RARE_MISFIT:
        return 1.0, copies
    most = float(np.abs(white).max())
    words = (
        f"the measured forces differ from the model by {most:.1f} times their u. The probe is "
        "of another kind, or other quantities should be free. u was enlarged for this"
    )
    return math.sqrt(squares / dof), [words, *copies]


def _copies(forces: MeasuredForces) -> list[str]:
    """A sentence on forces that are there twice."""
    rows = np.column_stack([forces.directions, forces.force, forces.u])
    alike = np.all(np.abs(rows[:, None] - rows) < 1e-9, axis=2)
    first = np.argmax(alike, axis=1)
    again = np.flatnonzero(first < np.arange(len(rows)))
    if not len(again):
        return []
    row = int(again[0])
    words = (
        f"measured forces {first[row] + 1} and {row + 1} are equal in direction, force and u: a "
        "copy counts as a measurement of its own, and makes u too small. Leave copies out"
    )
    return [words]


@dataclass(frozen=True, eq=False)
class _MapFit:
    """Residuals between what was observed and the model of a description.

    The parameters are the codes of the free numbers, then the shift of the reference, and a level
    where the map contains pretravel only relative to its mean.
    """

    evidence: Evidence
    probe: Probe
    numbers: tuple[FreeNumber, ...]
    model: str | ComplianceModel
    forces: MeasuredForces | None = None

    @cached_property
    def root(self) -> FloatArray:
        """Cholesky factor of the covariance, (n, n)."""
        return np.asarray(np.linalg.cholesky(self.evidence.covariance), dtype=np.float64)

    @cached_property
    def reference(self) -> FloatArray:
        """Change of the residuals by the shift (and the level) of the reference, (n, 3 or 4)."""
        columns = 3 if self.evidence.level_known else 4
        directions = self.evidence.directions
        return np.hstack([directions, np.ones((len(directions), 1))])[:, :columns]

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

    def modelled(self, probe: Probe, directions: FloatArray) -> FloatArray:
        """Pretravel on the reference in directions of the probe frame, (m,). [mm]"""
        trigger = predict(probe, directions, self.model)
        return np.asarray(
            trigger.pretravel + (self.evidence.tip_factor - 1.0) * trigger.tip_approach
        )

    def residuals(self, probe: Probe, parameters: FloatArray) -> FloatArray:
        """Observed less modelled, after the shift of the reference, (n,). [mm]"""
        own = self.modelled(probe, self.evidence.directions @ probe.orientation.matrix)
        of_reference = self.reference @ parameters[len(self.numbers) :]
        return np.asarray(self.evidence.value - own + of_reference)

    def turned(self, parameters: FloatArray, column: int, angles: FloatArray) -> FloatArray:
        """Residuals of the probe at several angles of rotation, without a shift, (angles, n). [mm]

        A turn moves the directions alone: the model is evaluated once.
        """
        probe = self.described(parameters)
        own = self.evidence.directions @ probe.orientation.matrix
        back = angles[:, None] - parameters[column]
        x = np.cos(back) * own[:, 0] + np.sin(back) * own[:, 1]
        y = np.cos(back) * own[:, 1] - np.sin(back) * own[:, 0]
        turned = np.stack([x, y, np.broadcast_to(own[:, 2], x.shape)], axis=-1)
        return self.evidence.value - self.modelled(probe, turned.reshape(-1, 3)).reshape(x.shape)

    def whitened(self, parameters: FloatArray) -> FloatArray:
        """Residuals of unit variance of the map, then of the forces, (n,)."""
        count = 0 if self.forces is None else len(self.forces)
        try:
            probe = self.described(parameters)
            of_map = self.white(self.residuals(probe, parameters))
        except PretravelError:
            return np.full(len(self.evidence.value) + count, _OUTSIDE)
        if self.forces is None:
            return of_map
        return np.concatenate([of_map, self.forces.white(probe, self.model)])

    def white(self, columns: FloatArray) -> FloatArray:
        """Values of each direction in units of their errors."""
        from scipy.linalg import solve_triangular

        return np.asarray(solve_triangular(self.root, columns, lower=True))

    def slopes(self, parameters: FloatArray) -> FloatArray:
        """Derivatives of the whitened residuals by the parameters, (n, p)."""
        codes = len(self.numbers)
        columns = []
        for index in range(codes):
            step = np.zeros(len(parameters))
            step[index] = _DIFFERENCE
            more, less = self.whitened(parameters + step), self.whitened(parameters - step)
            columns.append((more - less) / (2.0 * _DIFFERENCE))
        reference = self.white(self.reference)
        if self.forces is not None:
            reference = np.vstack([reference, np.zeros((len(self.forces), reference.shape[1]))])
        return np.column_stack([*columns, reference])


class _Maximum(NamedTuple):
    """A description that fits better than those next to it."""

    parameters: FloatArray
    jacobian: FloatArray
    whitened: FloatArray

    @property
    def chi_squared(self) -> float:
        return float(self.whitened @ self.whitened)


def _maxima(fit: _MapFit, free: Sequence[str]) -> list[_Maximum]:
    """The descriptions that fit best, from starts all around; the best one first.

    Of several that fit as well, the rotation nearest to that of the start comes first.
    """
    from scipy.optimize import least_squares

    codes = len(fit.numbers)
    scale = np.concatenate(
        [np.full(codes, _CODE_SCALE), np.full(fit.reference.shape[1], _SHIFT_SCALE)]
    )
    found = [
        least_squares(
            fit.whitened, start, fit.slopes, x_scale=scale, xtol=1e-12, ftol=1e-12, gtol=1e-12
        )
        for start in _starts(fit, free)
    ]
    maxima = [_Maximum(each.x, np.asarray(each.jac), each.fun) for each in found]
    maxima.sort(key=lambda each: each.chi_squared)
    if "rotation" in free:
        maxima.sort(key=_worse_or_further(maxima[0], fit, list(free).index("rotation")))
    return maxima


def _worse_or_further(
    best: _Maximum, fit: _MapFit, column: int
) -> Callable[[_Maximum], tuple[float, float]]:
    """Order of maxima: of those that touches do not distinguish, the rotation next to the start.

    A tripod with a rod out by less than its u looks alike in three rotations.
    """
    at_start = fit.start()[column]
    dof = max(len(best.whitened) - len(best.parameters), 1)
    alike = best.chi_squared + _AS_GOOD * max(best.chi_squared / dof, 1.0)

    def order(each: _Maximum) -> tuple[float, float]:
        if each.chi_squared > alike:
            return each.chi_squared, 0.0
        period = 2.0 * math.pi / (3.0 if _even(fit.described(each.parameters)) else 1.0)
        apart = (each.parameters[column] - at_start + 0.5 * period) % period - 0.5 * period
        return 0.0, abs(float(apart))

    return order


def _starts(fit: _MapFit, free: Sequence[str]) -> list[FloatArray]:
    """Parameters to start from: with a free rotation, the best of angles all around.

    Lobes have kinks, and an angle next to one can be a local minimum: they are compared in small
    steps, and each free rod is tried in several places.
    """
    start = fit.start()
    rods = [index for index, name in enumerate(free) if name.startswith("rod_azimuth")]
    found: list[tuple[float, FloatArray]] = []
    for offsets in itertools.product(_ROD_OFFSETS, repeat=len(rods)):
        moved = start.copy()
        moved[rods] += offsets
        if "rotation" in free:
            found += _around(fit, moved, list(free).index("rotation"), even=not rods)
        else:
            found.append((float(np.sum(fit.whitened(moved) ** 2)), moved))
    found.sort(key=lambda each: each[0])
    worst = _HOPELESS * (found[0][0] + len(fit.evidence.value))
    return [x for square, x in found[:_FOLLOWED] if square <= worst]


def _around(
    fit: _MapFit, start: FloatArray, column: int, *, even: bool
) -> list[tuple[float, FloatArray]]:
    """Angles that are better than those next to them, with χ² and one step of the other numbers."""
    even = even and _even(fit.probe)
    angles = np.arange(0.0, 2.0 * math.pi / (3.0 if even else 1.0), _FIRST_STEP)
    others = [index for index in range(len(fit.numbers)) if index != column]
    orthogonal, size, _ = np.linalg.svd(fit.white(fit.reference), full_matrices=False)
    orthogonal = orthogonal[:, size > 1e-9 * size[0]]

    def left(x: FloatArray) -> FloatArray:
        """Whitened residuals at each angle after the best shift, (angles, n)."""
        own = fit.white(fit.turned(x, column, angles).T)
        return np.asarray((own - orthogonal @ (orthogonal.T @ own)).T)

    at_start = left(start)
    slopes = np.empty((len(angles), at_start.shape[1], len(others)))
    for place, index in enumerate(others):
        step = np.zeros(len(start))
        step[index] = _FIRST_DIFFERENCE
        slopes[:, :, place] = (left(start + step) - at_start) / _FIRST_DIFFERENCE
    gradient = np.einsum("ani,an->ai", slopes, at_start)
    curvature = np.einsum("ani,anj->aij", slopes, slopes) + np.eye(len(others)) / _WIDEST_STEP**2
    steps = -np.linalg.solve(curvature, gradient[:, :, None])[:, :, 0]
    square = np.sum(at_start**2, axis=1) + np.sum(gradient * steps, axis=1)
    lowest = np.flatnonzero((square <= np.roll(square, 1)) & (square <= np.roll(square, -1)))
    found = []
    for number in lowest.tolist():
        x = start.copy()
        x[column], x[others] = angles[number], x[others] + steps[number]
        found.append((float(square[number]), x))
    return found


def _uncertainty(
    jacobian: FloatArray, numbers: Sequence[FreeNumber], names: tuple[str, ...]
) -> tuple[FloatArray, list[str]]:
    """Standard uncertainties of the codes, and sentences on undetermined numbers."""
    # By singular values: a combination that changes nothing gets a very large u.
    norms = np.linalg.norm(jacobian, axis=0)
    norms = np.where(norms > 0.0, norms, 1.0)  # in a ring a shift along its axis changes nothing
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
                    "and u are not valid, and the other quantities hold for this value alone"
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
    widening = ratio * math.sqrt(_directions_per_independent_error(covariance))
    return widening, [_another_kind(rms, ratio, "the map's uncertainty")]


def _another_kind(rms: float, ratio: float, error: str) -> str:
    return (
        f"map and model differ by {rms:.2f} µm (rms), {ratio:.1f} times as much as {error} "
        "explains. The probe is of another kind, or other quantities should be free. u was "
        "enlarged for this"
    )


def _misfit_of_touches(
    best: _Maximum, evidence: Evidence, residuals: FloatArray
) -> tuple[float, list[str]]:
    """Factor on the uncertainties by the residuals of touches, and a sentence on a misfit.

    Repeats and residuals each estimate the scatter of a touch. Where they agree (F test), both
    together are the estimate; else the residuals contain more than noise, and are it alone.
    """
    from scipy.special import fdtrc

    dof = len(best.whitened) - len(best.parameters)
    if dof < 1 or evidence.noise_dof is None:
        return 1.0, []
    square = best.chi_squared / dof
    known = evidence.noise_dof
    if math.isinf(known):
        widening = math.sqrt(max(square, 1.0))
    elif known > 0.0 and fdtrc(dof, known, square) > _SAME_SCATTER:
        widening = math.sqrt((known + best.chi_squared) / (known + dof))
    else:
        widening = math.sqrt(square)
    if square <= MISFIT**2:
        return widening, []
    rms = np.sqrt(np.mean(residuals**2)) / MICROMETRE
    return widening, [_another_kind(rms, math.sqrt(square), "the scatter of its touches")]


def _others_nearly_as_good(
    fit: _MapFit, maxima: Sequence[_Maximum], u: FloatArray, widening: float
) -> list[str]:
    """A sentence for each other description that the touches hardly exclude."""
    best, codes = maxima[0], len(fit.numbers)
    told, sentences = [best.parameters[:codes]], []
    for other in maxima[1:]:
        if other.chi_squared - best.chi_squared > _SURELY_WORSE * widening**2:
            break
        apart = [np.abs(other.parameters[:codes] - each) / (widening * u) for each in told]
        if min(float(each.max()) for each in apart) < _SAME_MAXIMUM:
            continue
        told.append(other.parameters[:codes])
        probe = fit.described(other.parameters)
        words = ", ".join(
            f"{number.key} {number.of(probe) / number.unit:.4g}" for number in fit.numbers
        )
        sentences.append(
            f"another description explains the map nearly as well: {words}. u is that of "
            "the reported description alone. Measure one of these numbers, or touch more directions"
        )
    return sentences


def _directions_per_independent_error(covariance: FloatArray) -> float:
    """The number of directions over the number of independent errors among them."""
    values = np.linalg.eigvalsh(covariance)
    return float(len(values) * np.sum(values**2) / np.sum(values) ** 2)


def _even(probe: Probe) -> bool:
    """Whether a third of a turn gives the same probe."""
    azimuths = np.sort(np.mod(probe.tripod.rod_azimuths, 2.0 * math.pi))
    return bool(np.allclose(np.diff(azimuths), 2.0 * math.pi / 3.0, atol=1e-9))


def _with_nearest_rotation(found: Probe, start: Probe) -> Probe:
    """The orientation nearest to the start, of the three equal ones of an even tripod."""
    period = 2.0 * math.pi / (3.0 if _even(found) else 1.0)
    near = start.orientation.rotation
    rotation = near + (found.orientation.rotation - near + 0.5 * period) % period - 0.5 * period
    return replace(found, orientation=replace(found.orientation, rotation=rotation))


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
            f"identified from {source}, "
            + (f"u = {u / number.unit:.2g}" if math.isfinite(u) else "at its limit: not valid"),
        )
    return rewritten(text, changes)
