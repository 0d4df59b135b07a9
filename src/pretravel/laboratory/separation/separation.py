"""Separation of machine and probe: systematic errors and variances from multi-step readings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from pretravel.base import (
    MICROMETRE,
    FloatArray,
    IntArray,
    PretravelError,
    ShownInNotebooks,
    WithPlot,
    extent,
    frozen,
)
from pretravel.laboratory.separation.multi_step_readings import (
    MultiStepDesign,
    MultiStepReadings,
    RepeatedPair,
    check_connected,
    counted_the_other_way,
    direction_place,
    multi_step_design,
    weighted_residuals,
)
from pretravel.laboratory.separation.outliers import (
    ReadingOutlier,
    enough_for_outliers,
    outlying_readings,
)
from pretravel.laboratory.separation.variances import (
    equally_shared,
    least_squares_variances,
    literal_variances,
    pair_variance_of,
    restricted_likelihood_variances,
)
from pretravel.touches import coarse_warnings, kept_by_directions
from pretravel.uncertainty import COVERAGE, coverage_factor

Method = Literal["reml", "least-squares", "paper"]
METHODS: tuple[Method, ...] = ("reml", "least-squares", "paper")
_ESTIMATES = {
    "reml": restricted_likelihood_variances,
    "least-squares": least_squares_variances,
    "paper": literal_variances,
}
COARSEST_READINGS = 5e-3
"""Coarser steps are refused: the errors of machine and probe are some micrometres. [mm]"""
_NOT_SEARCHED = (
    "gross errors were not searched: the readings are too few to distinguish them from noise. "
    "Repeat readings, or add orientations"
)
_FEWEST_DOF = 4.0
_BY_CHANCE = 0.01
_CLEARLY = 2.0
"""Ratio of squared residuals of both senses that is not chance: without errors of the probe it is
near one, as far off as the root of 8 / dof."""
_SQUARE_MICROMETRE = MICROMETRE**2


@dataclass(frozen=True, eq=False)
class Separation(ShownInNotebooks, WithPlot):
    """Systematic errors and variances of machine and probe.

    Attributes
    ----------
    machines, probes : (m,), (p,) int
        Indices as in the readings.
    machine_error, probe_error : (m,), (p,) float
        The machine's add up to zero. [mm]
    error_covariance : (m + p, m + p) float
        Of the machine's, then the probe's errors. [mm²]
    machine_variance, probe_variance : (m,), (p,) float
        Their shares are half each on average, where that keeps all of them non-negative. [mm²]
    variance_covariance : (m + p, m + p) float
        [mm⁴]
    movable : (2,) float
        How much variance can move from every machine direction to every probe direction (first
        number), or back (second number), so that no variance becomes negative and all readings
        are explained equally well. [mm²]
    residuals : (n,) float
        Of the readings that were used. [mm]
    dof : float
        Degrees of freedom: number of readings less number of systematic errors.
    method : str
    repeated : RepeatedPair or None
    outliers : tuple of ReadingOutlier
        Readings with a gross error, left out; the largest error first.
    excluded : tuple of int
        Rows of the readings that the user left out.
    notes : tuple of str
        Sentences on the quantities that the readings do not determine.
    machine_azimuth, probe_azimuth : (m,), (p,) float
        Of the directions, of the probe in its own frame; nan where they are not known. [rad]
    used : MultiStepReadings or None
        The readings that were used, in the order of the residuals.
    sense_ratio : float
        Sum of squared residuals over the one with the orientations of the probe counted the other
        way; nan where that cannot be known.
    step : float
        In which the machine reports the readings; the covariance of the errors contains it. [mm]
    """

    machines: IntArray
    probes: IntArray
    machine_error: FloatArray
    probe_error: FloatArray
    error_covariance: FloatArray
    machine_variance: FloatArray
    probe_variance: FloatArray
    variance_covariance: FloatArray
    movable: FloatArray
    residuals: FloatArray
    dof: float
    method: Method
    repeated: RepeatedPair | None
    outliers: tuple[ReadingOutlier, ...]
    excluded: tuple[int, ...]
    notes: tuple[str, ...]
    machine_azimuth: FloatArray = field(default_factory=lambda: np.zeros(0))
    probe_azimuth: FloatArray = field(default_factory=lambda: np.zeros(0))
    used: MultiStepReadings | None = None
    sense_ratio: float = math.nan
    step: float = 0.0

    @property
    def warnings(self) -> tuple[str, ...]:
        """What makes the whole result doubtful."""
        coarse = tuple(coarse_warnings(self.step))
        if not self.sense_ratio > _CLEARLY:
            return coarse
        words = (
            f"the variance of the residuals is {self.sense_ratio:.2g} times that with the "
            "orientations of the probe counted the other way: they seem to be counted clockwise, "
            "seen from the spindle, which makes errors of the probe look like scatter"
        )
        return (*coarse, words)

    def __repr__(self) -> str:
        out = len(self.outliers) + len(self.excluded)
        return (
            f"Separation({len(self.machines)} machine and {len(self.probes)} probe directions; "
            f"{len(self.residuals):,} readings, {out} left out; "
            f"machine {extent(self.machine_error / MICROMETRE)} µm; "
            f"probe {extent(self.probe_error / MICROMETRE)} µm; method {self.method})"
        )

    @property
    def u_machine_error(self) -> FloatArray:
        """Standard uncertainties, (m,). [mm]"""
        return np.asarray(np.sqrt(np.diag(self.error_covariance))[: len(self.machines)])

    @property
    def u_probe_error(self) -> FloatArray:
        """Standard uncertainties, (p,). [mm]"""
        return np.asarray(np.sqrt(np.diag(self.error_covariance))[len(self.machines) :])

    @property
    def u_machine_variance(self) -> FloatArray:
        """Standard uncertainties for a fixed share of machine and probe, (m,). [mm²]"""
        return np.asarray(np.sqrt(np.diag(self.variance_covariance))[: len(self.machines)])

    @property
    def u_probe_variance(self) -> FloatArray:
        """Standard uncertainties for a fixed share of machine and probe, (p,). [mm²]"""
        return np.asarray(np.sqrt(np.diag(self.variance_covariance))[len(self.machines) :])

    def pair_variance(self, machine: int, probe: int) -> tuple[float, float]:
        """Variance of a touch with a machine direction and a probe direction.

        It does not depend on the share of machine and probe.

        Parameters
        ----------
        machine, probe : int
            Indices as in the readings.

        Returns
        -------
        variance, standard_uncertainty : float
            [mm²]

        Raises
        ------
        PretravelError
            A direction without readings.

        References
        ----------
        Nafi and Mayer 2011, equation 10.
        """
        row = direction_place(self.machines, machine, "machine")
        column = direction_place(self.probes, probe, "probe")
        pick = np.zeros(len(self.machines) + len(self.probes))
        pick[row] = pick[len(self.machines) + column] = 1.0
        variance = float(self.machine_variance[row] + self.probe_variance[column])
        return variance, math.sqrt(max(float(pick @ self.variance_covariance @ pick), 0.0))

    def pair_interval(
        self, machine: int, probe: int, probability: float = COVERAGE
    ) -> tuple[float, float]:
        """Coverage interval of `pair_variance`. [mm²]

        Its upper end is that of the chi-square distribution with the degrees of freedom that
        correspond to its uncertainty. Its lower end is that of a normal distribution, which is
        lower, since the variance of a pair is partly a difference of sums of squares. With fewer
        than four degrees of freedom both ends are those of a normal distribution. None is below
        zero.
        """
        from scipy.special import gammaincinv

        variance, u = self.pair_variance(machine, probe)
        if u == 0.0:
            return variance, variance
        dof = 2.0 * (variance / u) ** 2
        normal = coverage_factor(math.inf, probability) * u
        lowest = max(variance - normal, 0.0)
        if dof < _FEWEST_DOF:
            return lowest, variance + normal
        lower = 2.0 * float(gammaincinv(0.5 * dof, 0.5 - 0.5 * probability))
        return lowest, variance * dof / lower

    def error_interval(self, probability: float = COVERAGE) -> FloatArray:
        """Coverage intervals of the machine's, then the probe's errors, (m + p, 2). [mm]"""
        value = np.concatenate([self.machine_error, self.probe_error])
        u = np.sqrt(np.diag(self.error_covariance))
        half = coverage_factor(self.dof, probability) * u
        return np.stack([value - half, value + half], axis=1)


def separate(
    readings: MultiStepReadings,
    *,
    method: Method = "reml",
    repeated: RepeatedPair | None = None,
    exclude: Sequence[tuple[int, int]] = (),
    search_outliers: bool = True,
) -> Separation:
    """Separate machine and probe: systematic errors and variances of each.

    Parameters
    ----------
    readings : MultiStepReadings
        Complete, incomplete or repeated.
    method : str
        ``reml``: restricted likelihood; ``least-squares``: sums of squared residuals, with the
        degrees of freedom of the fit counted exactly; ``paper``: equations 3 to 10 as they are
        printed, to compare with the paper: they scatter several times as much.
    repeated : RepeatedPair, optional
        A configuration whose variance was measured by repeats.
    exclude : sequence of pairs
        Machine and probe indices of readings that are left out.
    search_outliers : bool
        Whether readings with a gross error are left out, see `outlying_readings`.

    Returns
    -------
    Separation

    Raises
    ------
    PretravelError
        Groups of readings without common directions; too few readings for variances; an excluded
        pair without readings; readings in steps above `COARSEST_READINGS`.

    Notes
    -----
    A reading is m_i - p_j + noise of variance vm_i + vp_j. A constant added to all m_i and
    all p_j changes no reading: the machine's errors are made to add up to zero. A constant
    taken from all vm_i and added to all vp_j changes no reading either, nor the repeats of a
    configuration: the variances of pairs are absolute, but their shares of machine and probe are
    not determined. The shares are half each on average, where that keeps all variances
    non-negative.

    The errors are those of ordinary least squares with both methods: weights from variances that
    scatter so much would state too small an uncertainty. Their covariance contains the variances.

    References
    ----------
    Nafi and Mayer 2011, equations 1 to 10. Equation 5 takes the total less the explained sum of
    squares of one direction for that of its residuals, which is right only over all directions
    together (`pretravel.laboratory.separation.variances.literal_variances`). It also leaves out
    the degrees of freedom of the systematic errors, so that its variances are too small:
    their mean by (n - 1)² / n², their variation by (n - 1)(n - 2) / n² in a complete n x n test.

    >>> m, p = np.divmod(np.arange(64), 8)
    >>> e = 1e-3 * (np.sin(m) - np.cos(p)) + 1e-4 * np.random.default_rng(1).normal(size=64)
    >>> found = separate(MultiStepReadings(m, p, e))
    >>> bool(np.corrcoef(found.machine_error, np.sin(np.arange(8)))[0, 1] > 0.99)
    True
    """
    if readings.step > 1.001 * COARSEST_READINGS:
        raise PretravelError(
            f"the readings are in steps of {readings.step / MICROMETRE:.4g} µm, and the errors of "
            "machine and probe differ by less over the directions: write the positions with more "
            "digits (0.001 mm or 0.0001 inch, better 0.0001 mm)"
        )
    if method not in METHODS:
        raise PretravelError(f"method '{method}' is not known; there are {', '.join(METHODS)}")
    excluded = _excluded_rows(readings, exclude)
    used = np.setdiff1d(np.arange(len(readings)), excluded)
    design = multi_step_design(rows_of_readings(readings, used))
    check_connected(design)
    _check_dof(design)
    searched = not search_outliers or enough_for_outliers(design)
    found = outlying_readings(design, readings.errors[used]) if search_outliers else []
    outliers = [replace(outlier, row=int(used[outlier.row])) for outlier in found]
    if outliers:
        used = np.setdiff1d(used, [outlier.row for outlier in outliers])
        design = multi_step_design(rows_of_readings(readings, used))
        _check_dof(design)
    result = _beyond_repeats(_separation(design, readings.errors[used], method, repeated), design)
    result = _with_step(result, readings.step)
    ratio = _sense_ratio(rows_of_readings(readings, used), float(np.sum(result.residuals**2)))
    return replace(
        result,
        notes=(*result.notes, *(() if searched else (_NOT_SEARCHED,))),
        sense_ratio=ratio,
        outliers=tuple(outliers),
        excluded=tuple(int(row) for row in excluded),
        machine_azimuth=frozen(readings.azimuths_of(result.machines)),
        probe_azimuth=frozen(readings.azimuths_of(result.probes)),
        used=rows_of_readings(readings, used),
    )


def _beyond_repeats(found: Separation, design: MultiStepDesign) -> Separation:
    """With what repeats of a pair do not reduce, where it is beyond chance (F test).

    An orientation that is off, or a drift between passes, is the same in all repeats of a pair.
    """
    from scipy.special import fdtrc

    pair = design.row * design.size + design.column
    _, place, count = np.unique(pair, return_inverse=True, return_counts=True)
    means = np.bincount(place, found.residuals) / count
    between, repeats = len(count) - design.rank, len(pair) - len(count)
    if between < 1 or repeats < 1:
        return found
    within = float(np.sum((found.residuals - means[place]) ** 2))
    of_pairs = float(np.sum(count * means**2)) / between
    if fdtrc(between, repeats, of_pairs * repeats / max(within, 1e-24)) > _BY_CHANCE:
        return found
    mean = float(np.sum(found.residuals**2)) / found.dof
    larger = of_pairs / mean * (coverage_factor(between) / coverage_factor(found.dof)) ** 2
    off = math.sqrt(of_pairs / float(np.mean(count)))
    words = (
        f"repeats of a pair scatter by {math.sqrt(within / repeats) / MICROMETRE:.2g} µm, their "
        f"means lie {off / MICROMETRE:.2g} µm (rms) from what errors of the directions explain: "
        "something differs from pair to pair that repeats do not show, such as an orientation that "
        "is off or a drift. u of the errors contains it"
    )
    return replace(
        found,
        error_covariance=frozen(larger * found.error_covariance),
        notes=(*found.notes, words),
    )


def _with_step(found: Separation, step: float) -> Separation:
    """With the part of the readings' step that more readings of a direction do not reduce."""
    touch = float(np.mean(found.machine_variance) + np.mean(found.probe_variance))
    kept = kept_by_directions(step, math.sqrt(max(touch - step**2 / 12.0, 0.0)))
    own = kept**2 * np.eye(len(found.error_covariance))
    return replace(found, step=step, error_covariance=frozen(found.error_covariance + own))


def _sense_ratio(readings: MultiStepReadings, squares: float) -> float:
    """Squared residuals over those with the orientations counted the other way."""
    if readings.turn == 0:
        return math.nan
    other = multi_step_design(counted_the_other_way(readings))
    try:
        check_connected(other)
        _check_dof(other)
    except PretravelError:
        return math.nan
    return squares / float(
        np.sum(weighted_residuals(other, readings.errors, np.ones(len(readings))) ** 2)
    )


def _excluded_rows(readings: MultiStepReadings, exclude: Sequence[tuple[int, int]]) -> IntArray:
    """Rows of the pairs that the user leaves out."""
    out = np.zeros(len(readings), dtype=bool)
    for machine, probe in exclude:
        rows = (readings.machine == machine) & (readings.probe == probe)
        if not np.any(rows):
            raise PretravelError(
                f"there is no reading of machine direction {machine} with probe direction "
                f"{probe} to exclude",
                inputs=("exclude",),
            )
        out |= rows
    return np.flatnonzero(out)


def rows_of_readings(readings: MultiStepReadings, rows: IntArray) -> MultiStepReadings:
    """Some of the readings."""
    if len(rows) == len(readings):
        return readings
    return replace(
        readings,
        machine=readings.machine[rows],
        probe=readings.probe[rows],
        errors=readings.errors[rows],
        circles=readings.circles[rows],
    )


def _check_dof(design: MultiStepDesign) -> None:
    count = len(design.row)
    if count - design.rank < 1:
        circles = " and circles of the setups" if design.with_circles else ""
        raise PretravelError(
            f"{count} readings for {design.rank} systematic errors{circles} leave no degree of "
            "freedom for a variance; repeat readings, or combine more orientations"
        )


def _separation(
    design: MultiStepDesign, errors: FloatArray, method: Method, repeated: RepeatedPair | None
) -> Separation:
    """The separation from the readings that are used."""
    pair = None if repeated is None else pair_variance_of(design, repeated)
    variances = _ESTIMATES[method](design, errors, pair)
    inverse = design.solved
    solution = inverse @ errors
    of_solution = (inverse * np.maximum(variances.of_readings, 0.0)) @ inverse.T
    found = design.basis @ solution
    shares = _shares(design, variances.values)
    at_share = _projection_to_fixed_share(design)
    return Separation(
        machines=design.machines,
        probes=design.probes,
        machine_error=frozen(found[: design.split]),
        probe_error=frozen(found[design.split :]),
        error_covariance=frozen(design.basis @ of_solution @ design.basis.T),
        machine_variance=frozen(shares.variances[: design.split]),
        probe_variance=frozen(shares.variances[design.split :]),
        variance_covariance=frozen(at_share @ variances.covariance @ at_share.T),
        movable=frozen(shares.movable),
        residuals=frozen(weighted_residuals(design, errors, np.ones(len(errors)))),
        dof=float(len(errors) - design.rank),
        method=method,
        repeated=repeated,
        outliers=(),
        excluded=(),
        notes=tuple(_notes(design, shares, variances.values, repeated, method)),
    )


@dataclass(frozen=True, eq=False)
class _Shares:
    """Variances after a decision on the shares of machine and probe.

    Attributes
    ----------
    variances : (m + p,) float
        [mm²]
    movable : (2,) float
        As in `Separation`. [mm²]
    negative : bool
        Whether a pair has a negative variance, as least squares may find it.
    equal : bool
        Whether machine and probe have the same mean variance.
    """

    variances: FloatArray
    movable: FloatArray
    negative: bool
    equal: bool


def _shares(design: MultiStepDesign, values: FloatArray) -> _Shares:
    """Half of the variance each for machine and probe, where that leaves none negative."""
    half = equally_shared(design, values)
    machine, probe = half[: design.split], half[design.split :]
    # Moving c from machine to probe is possible for -min(probe) <= c <= min(machine).
    low, high = -float(probe.min()), float(machine.min())
    negative = low > high
    moved = 0.5 * (low + high) if negative else min(max(0.0, low), high)
    shared = half - design.signs * moved
    movable = np.array([shared[: design.split].min(), shared[design.split :].min()])
    return _Shares(shared, movable, negative, moved == 0.0)


def _projection_to_fixed_share(design: MultiStepDesign) -> FloatArray:
    """Projects the combination that no reading determines out of the variances."""
    probes = design.size - design.split
    halves = design.signs / np.concatenate(
        [np.full(design.split, design.split), np.full(probes, probes)]
    )
    return np.asarray(
        np.eye(design.size) - np.outer(design.signs, halves) / float(halves @ design.signs)
    )


def _notes(
    design: MultiStepDesign,
    shares: _Shares,
    variances: FloatArray,
    repeated: RepeatedPair | None,
    method: Method,
) -> list[str]:
    """Sentences on the quantities that the readings do not determine."""
    of_errors = (
        f"{len(design.row)} readings, {len(design.machines)} machine and {len(design.probes)} "
        f"probe directions. The readings determine everything except a constant that is common to "
        f"all errors of machine and probe (rank {design.size - 1} of {design.size}). The sum of "
        "the machine's errors is therefore set to zero"
    )
    if design.with_circles:
        of_circles = design.rank - design.basis.shape[1]
        of_errors = (
            f"{len(design.row)} readings, {len(design.machines)} machine and "
            f"{len(design.probes)} probe directions, and circles of {of_circles} numbers: "
            "the circles contain the mean and the first harmonic of both errors, which are "
            "therefore given as zero; the readings determine all other errors"
        )
    of_variances = (
        "the readings determine the variance of each pair of directions, but not the shares of "
        "machine and probe in it (the matrix of the variances is rank deficient by one). "
    )
    of_errors += (
        ". The machine's errors contain the form of the reference, which does not turn with the "
        "probe; their u does not"
    )
    notes = [of_errors, of_variances + _share_words(shares, variances)]
    if shares.negative:
        notes.append(
            "least squares gives some pairs a negative variance, which is impossible; use the "
            "method reml"
            if method == "least-squares"
            else "the paper's equations give some pairs a negative variance, which is impossible; "
            "use the method reml"
        )
    if repeated is not None:
        i = design.machine_place(repeated.machine)
        j = design.probe_place(repeated.probe)
        own = float(variances[i] + variances[j])
        notes.append(
            f"the repeated pair ({repeated.machine}, {repeated.probe}) has the variance "
            f"{repeated.variance / _SQUARE_MICROMETRE:.3g} µm² from {repeated.count} repeats"
            f"{_u_of_repeats(repeated)}; with all readings together it is "
            f"{own / _SQUARE_MICROMETRE:.3g} µm²"
        )
    return notes


def _u_of_repeats(repeated: RepeatedPair) -> str:
    """The standard uncertainty of a variance, of normally distributed repeats."""
    if repeated.count < 2:
        return ""
    u = repeated.variance * math.sqrt(2.0 / (repeated.count - 1)) / _SQUARE_MICROMETRE
    return f" (u = {u:.2g} µm²)"


def _share_words(shares: _Shares, variances: FloatArray) -> str:
    """What the shares are, and how far they can differ from these."""
    if shares.negative:
        return "The reported shares are as nearly equal as possible"
    if shares.movable.max() < 1e-3 * float(np.mean(np.abs(variances))):
        return (
            "With any other split between machine and probe, a variance would be negative: the "
            "reported split is the only possible one"
        )
    to_probe, to_machine = np.maximum(shares.movable, 0.0) / _SQUARE_MICROMETRE
    what = (
        "The reported shares are equal"
        if shares.equal
        else "Equal shares would give a negative variance: the reported shares are the nearest to "
        "equal without one"
    )
    return (
        f"{what}. Up to {to_probe:.3g} µm² of each machine direction could belong to each probe "
        f"direction, or {to_machine:.3g} µm² of each probe direction to each machine direction"
    )
