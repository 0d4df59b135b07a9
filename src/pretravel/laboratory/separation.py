"""Machine and probe told apart: systematic errors and variances from multi-step readings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pretravel.arrays import FloatArray, IntArray, frozen
from pretravel.errors import PretravelError
from pretravel.uncertainty.gum import COVERAGE, coverage_factor

Method = Literal["reml", "least-squares"]
METHODS: tuple[Method, ...] = ("reml", "least-squares")
_ROUNDS = 4
"""Of weights and variances in turn; they settle in two or three."""
_FEWEST_DOF = 4.0
_LEAST_WEIGHED = 0.1
"""Of the mean variance: no pair is weighed as more exact than this."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Multi-step readings: one machine direction with one probe direction each.

    Parameters
    ----------
    machine, probe : (n,) int
        Indices as people number them, from any start.
    errors : (n,) float
        Machine error less probe error, with noise. [mm]

    Raises
    ------
    PretravelError
        Shapes that do not fit, values that are not finite, too few readings.

    >>> Readings([1, 1, 2, 2], [1, 2, 1, 2], [0.0, 1e-3, 1e-3, 2e-3]).machines.tolist()
    [1, 2]
    """

    machine: IntArray
    probe: IntArray
    errors: FloatArray

    def __post_init__(self) -> None:
        machine, probe = np.array(self.machine), np.array(self.probe)
        errors = frozen(self.errors)
        for name, index in (("machine", machine), ("probe", probe)):
            if np.any(index != np.round(index)):
                raise PretravelError(f"{name} indices must be whole numbers")
        if not (machine.shape == probe.shape == errors.shape) or errors.ndim != 1:
            raise PretravelError(
                f"{machine.shape} machine indices, {probe.shape} probe indices and "
                f"{errors.shape} errors do not go together"
            )
        if not np.all(np.isfinite(errors)):
            raise PretravelError("readings must be finite")
        if len(errors) < 4:
            raise PretravelError(f"{len(errors)} readings are too few to tell anything apart")
        object.__setattr__(self, "machine", machine.astype(np.int64))
        object.__setattr__(self, "probe", probe.astype(np.int64))
        object.__setattr__(self, "errors", errors)

    def __len__(self) -> int:
        return len(self.errors)

    @property
    def machines(self) -> IntArray:
        """Machine directions that occur, in order."""
        return np.unique(self.machine)

    @property
    def probes(self) -> IntArray:
        """Probe directions that occur, in order."""
        return np.unique(self.probe)


@dataclass(frozen=True)
class RepeatedPair:
    """One configuration, touched again and again.

    Parameters
    ----------
    machine, probe : int
    variance : float
        [mm²]
    count : int
        Repeats behind that variance.
    """

    machine: int
    probe: int
    variance: float
    count: int = 10

    def __post_init__(self) -> None:
        if not 0.0 < self.variance < math.inf:
            raise PretravelError(f"a repeat variance is positive, got {self.variance * 1e6:g} µm²")
        if self.count < 2:
            raise PretravelError(f"{self.count} repeat has no variance; at least two are needed")


@dataclass(frozen=True, eq=False)
class Separation:
    """Systematic errors and variances of machine and probe.

    Attributes
    ----------
    machines, probes : (m,), (p,) int
        Indices as in the readings.
    machine_error, probe_error : (m,), (p,) float
        The machine's add up to zero. [mm]
    error_covariance : (m + p, m + p) float
        Of both. [mm²]
    machine_variance, probe_variance : (m,), (p,) float
        Shared out as `split` says. [mm²]
    variance_covariance : (m + p, m + p) float
        [mm⁴]
    movable : (2,) float
        What could be taken from every machine variance and given to every probe variance
        (first number, or the other way for the second) with all readings explained as well and
        no variance negative. [mm²]
    residuals : (n,) float
        [mm]
    dof : float
        Readings less systematic errors.
    method : str
    repeated : RepeatedPair or None
    notes : tuple of str
        What can and cannot be told, as sentences.
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
    notes: tuple[str, ...]

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
        """Standard uncertainties, the share between machine and probe held, (m,). [mm²]"""
        return np.asarray(np.sqrt(np.diag(self.variance_covariance))[: len(self.machines)])

    @property
    def u_probe_variance(self) -> FloatArray:
        """Standard uncertainties, the share between machine and probe held, (p,). [mm²]"""
        return np.asarray(np.sqrt(np.diag(self.variance_covariance))[len(self.machines) :])

    def pair_variance(self, machine: int, probe: int) -> tuple[float, float]:
        """Variance of a touch with that machine and that probe direction.

        It does not depend on how variances are shared out.

        Parameters
        ----------
        machine, probe : int
            As in the readings.

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
        row = _place(self.machines, machine, "machine")
        column = _place(self.probes, probe, "probe")
        pick = np.zeros(len(self.machines) + len(self.probes))
        pick[row] = pick[len(self.machines) + column] = 1.0
        variance = float(self.machine_variance[row] + self.probe_variance[column])
        return variance, math.sqrt(max(float(pick @ self.variance_covariance @ pick), 0.0))

    def pair_interval(
        self, machine: int, probe: int, probability: float = COVERAGE
    ) -> tuple[float, float]:
        """Coverage interval of `pair_variance`. [mm²]

        From chi-square with as many degrees of freedom as its uncertainty is worth; where
        that is fewer than four, symmetric, cut at zero.
        """
        from scipy.stats import chi2, norm

        variance, u = self.pair_variance(machine, probe)
        if u == 0.0:
            return variance, variance
        dof = 2.0 * (variance / u) ** 2
        if dof < _FEWEST_DOF:
            half = float(norm.ppf(0.5 + 0.5 * probability)) * u
            return max(variance - half, 0.0), variance + half
        half = 0.5 * probability
        low, high = float(chi2.ppf(0.5 - half, dof)), float(chi2.ppf(0.5 + half, dof))
        return variance * dof / high, variance * dof / low

    def error_interval(self, probability: float = COVERAGE) -> FloatArray:
        """Coverage intervals of machine, then probe errors, (m + p, 2). [mm]"""
        value = np.concatenate([self.machine_error, self.probe_error])
        u = np.sqrt(np.diag(self.error_covariance))
        half = coverage_factor(self.dof, probability) * u
        return np.stack([value - half, value + half], axis=1)


def _place(indices: IntArray, wanted: int, what: str) -> int:
    found = np.flatnonzero(indices == wanted)
    if not len(found):
        listed = ", ".join(str(i) for i in indices[:12]) + (", …" if len(indices) > 12 else "")
        raise PretravelError(f"no reading has {what} direction {wanted}; there are {listed}")
    return int(found[0])


class _Design:
    """Which reading has which machine and probe direction, as matrices."""

    def __init__(self, readings: Readings) -> None:
        self.machines, row = np.unique(readings.machine, return_inverse=True)
        self.probes, column = np.unique(readings.probe, return_inverse=True)
        count, split = len(readings), len(self.machines)
        self.row, self.column = row, column
        self.incidence = np.zeros((count, split + len(self.probes)))
        self.incidence[np.arange(count), row] = 1.0
        self.incidence[np.arange(count), split + column] = 1.0
        self.signs = np.concatenate([np.ones(split), -np.ones(len(self.probes))])
        # Along this nothing changes in any reading: a constant for machine and probe alike.
        self.gauge = np.ones(split + len(self.probes))
        self.split = split
        # Orthonormal basis of all errors whose machine part adds up to zero.
        constraint = np.concatenate([np.ones(split), np.zeros(len(self.probes))])
        self.basis = _orthogonal_to(constraint)
        self.design = (self.incidence * self.signs) @ self.basis

    @property
    def size(self) -> int:
        return self.incidence.shape[1]


def _orthogonal_to(vector: FloatArray) -> FloatArray:
    from scipy.linalg import null_space

    return np.asarray(null_space(vector[None, :]))


def separate(
    readings: Readings,
    *,
    method: Method = "reml",
    repeated: RepeatedPair | None = None,
) -> Separation:
    """Tell machine from probe, errors and variances.

    Parameters
    ----------
    readings : Readings
        Complete, incomplete or repeated.
    method : str
        ``reml``: restricted likelihood; ``least-squares``: the paper's equations with the
        degrees of freedom of the fit counted exactly.
    repeated : RepeatedPair, optional
        A configuration whose variance was measured by repeats.

    Returns
    -------
    Separation

    Raises
    ------
    PretravelError
        Readings that fall apart into groups without common directions; too few for
        variances.

    Notes
    -----
    A reading is m_i - p_j + noise of variance vm_i + vp_j. A constant added to all m_i and
    all p_j changes nothing: the machine's errors are made to add up to zero. A constant
    taken from all vm_i and given to all vp_j changes nothing either, repeats of a
    configuration included: variances of pairs are absolute, but how they are shared is not
    told. They are shared half and half on average, as far as that keeps all of them
    non-negative.

    References
    ----------
    Nafi and Mayer 2011, equations 1 to 10. Equation 5 leaves out the degrees of freedom
    of the systematic errors, so that its variances are too small by (n - 1)² / n² in a
    complete n x n test.

    >>> m, p = np.divmod(np.arange(64), 8)
    >>> e = 1e-3 * (np.sin(m) - np.cos(p)) + 1e-4 * np.random.default_rng(1).normal(size=64)
    >>> found = separate(Readings(m, p, e))
    >>> bool(np.corrcoef(found.machine_error, np.sin(np.arange(8)))[0, 1] > 0.99)
    True
    """
    if method not in METHODS:
        raise PretravelError(f"method '{method}' is not known; there are {', '.join(METHODS)}")
    design = _Design(readings)
    _refuse_falling_apart(design, readings)
    again = None
    if repeated is not None:
        again = (
            _place(design.machines, repeated.machine, "machine"),
            design.split + _place(design.probes, repeated.probe, "probe"),
            repeated.variance,
            float(repeated.count - 1),
        )
    dof = float(len(readings) - design.size + 1)
    if dof < 1.0:
        raise PretravelError(
            f"{len(readings)} readings for {design.size - 1} systematic errors leave nothing to "
            "tell a variance from; repeat readings, or combine more orientations"
        )
    start, start_covariance = _squares(design, readings.errors)
    if method == "least-squares" and again is not None:
        start, start_covariance = _with_repeats(start, start_covariance, again)
    if method == "reml":
        variances, covariance, shrunk = _restricted_likelihood(
            design, readings.errors, start, again
        )
        # Half-way: shrunk ones alone are too low where the variance is highest.
        total = design.incidence @ (0.5 * (variances + shrunk))
    else:
        variances, covariance = start, start_covariance
        total = design.incidence @ variances
    # Ordinary least squares for the errors whatever the method: weights from variances as
    # scattered as these would claim more than they know. Their covariance has the variances.
    inverse = np.linalg.pinv(design.design)
    solution = inverse @ readings.errors
    of_solution = (inverse * np.maximum(total, 0.0)) @ inverse.T
    errors = design.basis @ solution
    shared, movable, negative = _shared_out(design, variances)
    # Uncertainties at that share: the direction along which nothing changes is projected out.
    halves = design.signs / np.concatenate(
        [np.full(design.split, design.split), np.full(len(design.probes), len(design.probes))]
    )
    move = np.eye(design.size) - np.outer(design.signs, halves) / float(halves @ design.signs)
    notes = _explained(design, readings, movable, negative, repeated, variances)
    return Separation(
        machines=design.machines,
        probes=design.probes,
        machine_error=frozen(errors[: design.split]),
        probe_error=frozen(errors[design.split :]),
        error_covariance=frozen(design.basis @ of_solution @ design.basis.T),
        machine_variance=frozen(shared[: design.split]),
        probe_variance=frozen(shared[design.split :]),
        variance_covariance=frozen(move @ covariance @ move.T),
        movable=frozen(movable),
        residuals=frozen(readings.errors - design.design @ solution),
        dof=dof,
        method=method,
        repeated=repeated,
        notes=tuple(notes),
    )


def _refuse_falling_apart(design: _Design, readings: Readings) -> None:
    """Groups of readings without a common direction have a constant each."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    nodes = design.size
    graph = coo_array(
        (np.ones(len(readings)), (design.row, design.split + design.column)), shape=(nodes, nodes)
    )
    parts, label = connected_components(graph, directed=False)
    if parts > 1:
        groups = []
        for part in range(min(int(parts), 3)):
            members = np.flatnonzero(label == part)
            machines = design.machines[members[members < design.split]]
            probes = design.probes[members[members >= design.split] - design.split]
            groups.append(
                f"machine {', '.join(map(str, machines[:6]))}{'…' if len(machines) > 6 else ''} "
                f"with probe {', '.join(map(str, probes[:6]))}{'…' if len(probes) > 6 else ''}"
            )
        raise PretravelError(
            f"the readings fall apart into {parts} groups that share no direction "
            f"({'; '.join(groups)}{'; …' if parts > 3 else ''}): each has a constant of its own, "
            f"and the identification matrix lacks {parts} ranks instead of one. Add readings that "
            "join the groups, for example orientations turned by one step"
        )


def _squares(design: _Design, errors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The paper's equations 7 and 8, with what the fit takes out of each residual counted.

    E[r²] = (M ∘ M) (vm_i + vp_j) with M = 1 - H, so sums of squared residuals over a machine
    (or probe) direction are linear in the variances, for any design.
    """
    project = np.eye(len(errors)) - design.design @ np.linalg.pinv(design.design)
    residuals = project @ errors
    squared = project**2
    matrix = design.incidence.T @ squared @ design.incidence
    rank = int(np.linalg.matrix_rank(matrix, tol=1e-9 * float(np.linalg.norm(matrix, 2))))
    if rank < design.size - 1:
        few = [
            f"machine {i}"
            for i, n in zip(design.machines, design.incidence.sum(0), strict=False)
            if n < 3
        ] + [
            f"probe {j}"
            for j, n in zip(design.probes, design.incidence.sum(0)[design.split :], strict=True)
            if n < 3
        ]
        raise PretravelError(
            f"the variances' identification matrix lacks {design.size - rank} ranks; one is always "
            "lacking (what machine and probe share), more means directions without enough readings"
            + (f": {', '.join(few[:8])}" if few else "")
            + ". Each direction needs several readings, with several partners"
        )
    inverse = np.linalg.pinv(matrix, rcond=1e-9)
    variances = inverse @ (design.incidence.T @ residuals**2)
    total = np.maximum(design.incidence @ variances, 0.05 * float(np.mean(residuals**2)))
    # Cov(r_a², r_b²) = 2 (M V M)_ab² for normal noise.
    scatter = 2.0 * ((project * total) @ project) ** 2
    middle = design.incidence.T @ scatter @ design.incidence
    return np.asarray(variances), np.asarray(inverse @ middle @ inverse)


def _with_repeats(
    x: FloatArray, covariance: FloatArray, again: tuple[int, int, float, float]
) -> tuple[FloatArray, FloatArray]:
    """Variances and a repeated pair's, weighed by what each is worth (a linear update)."""
    i, j, variance, dof = again
    pick = np.zeros(len(x))
    pick[[i, j]] = 1.0
    shared = covariance @ pick
    # What the repeats' variance scatters by, were the truth what both say.
    own = float(pick @ shared)
    level = (variance * dof + max(float(pick @ x), 0.0)) / (dof + 1.0)
    gain = shared / (own + 2.0 * level**2 / dof)
    return x + gain * (variance - float(pick @ x)), covariance - np.outer(gain, shared)


def _restricted_likelihood(
    design: _Design,
    errors: FloatArray,
    start: FloatArray,
    again: tuple[int, int, float, float] | None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Variances from the restricted likelihood's equations, none negative; covariance; and shrunk.

    Its weights, 1 / variance², are taken from variances shrunk towards their means. With
    the estimates' own scatter in the weights the equations sink single pairs to zero, and
    state uncertainties half as large as they are.
    """
    from scipy.optimize import nnls

    level = float(np.mean(design.incidence @ start))
    if level <= 0.0:
        raise PretravelError("the readings have no scatter to speak of: there is no variance")
    x = start
    covariance: FloatArray = np.zeros((design.size, design.size))
    shrunk = np.full(design.size, 0.5 * level)
    for _ in range(_ROUNDS):
        matrix, right = _equations(design, errors, shrunk, again)
        covariance = np.asarray(
            np.linalg.pinv(matrix, rcond=1e-9, hermitian=True), dtype=np.float64
        )
        x = covariance @ right
        shrunk = _shrunk(design, x, covariance, level)
    # Nearest admissible variances, in the likelihood's own measure; where nothing is negative
    # they are the same, up to what machine and probe share.
    values, vectors = np.linalg.eigh(matrix)
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    free = nnls(root, root @ x)[0]
    return np.asarray(free), np.asarray(covariance), shrunk


def _equations(
    design: _Design,
    errors: FloatArray,
    shrunk: FloatArray,
    again: tuple[int, int, float, float] | None,
) -> tuple[FloatArray, FloatArray]:
    """Fisher's information at these variances, and the score's observed part.

    With P = V^-1 - V^-1 X (X' V^-1 X)^-1 X' V^-1 the score vanishes where
    Z'(P e)² = Z'(P ∘ P) Z x, which is unbiased for any V.
    """
    total = design.incidence @ shrunk
    weighted = design.design / total[:, None]
    inner = np.linalg.solve(design.design.T @ weighted, weighted.T)
    project = np.diag(1.0 / total) - weighted @ inner
    matrix = 0.5 * design.incidence.T @ (project**2) @ design.incidence
    right = 0.5 * design.incidence.T @ (project @ errors) ** 2
    if again is not None:
        i, j, variance, dof = again
        weight = 0.5 * dof / (shrunk[i] + shrunk[j]) ** 2
        matrix[np.ix_([i, j], [i, j])] += weight
        right[[i, j]] += weight * variance
    return np.asarray(matrix), np.asarray(right)


def _shrunk(design: _Design, x: FloatArray, covariance: FloatArray, level: float) -> FloatArray:
    """Variances drawn to the means of machine and probe as far as they are scatter."""
    result = np.empty_like(x)
    machine = slice(0, design.split)
    for part in (machine, slice(design.split, None)):
        own, mean = x[part], float(x[part].mean())
        centred = np.eye(len(own)) - 1.0 / len(own)
        scatter = float(np.trace(centred @ covariance[part, part])) / max(len(own) - 1, 1)
        seen = float(own.var(ddof=1)) if len(own) > 1 else 0.0
        share = max(1.0 - scatter / seen, 0.0) if seen > 0.0 else 0.0
        result[part] = mean + share * (own - mean)
    # A pair's weight is never that of a variance far below the mean's.
    lowest = float(np.min(design.incidence @ result))
    if lowest < _LEAST_WEIGHED * level:
        draw = (level - _LEAST_WEIGHED * level) / (level - lowest)
        half = 0.5 * level
        shared = result - design.signs * _middle(design, result)
        result = half + draw * (shared - half)
    return result


def _middle(design: _Design, x: FloatArray) -> float:
    """What moves variances to equal shares of machine and probe."""
    return 0.5 * float(x[: design.split].mean() - x[design.split :].mean())


def _shared_out(design: _Design, x: FloatArray) -> tuple[FloatArray, FloatArray, bool]:
    """Variances shared half and half, as far as none becomes negative; and what could move."""
    half = x - design.signs * _middle(design, x)
    machine, probe = half[: design.split], half[design.split :]
    # Moving c from machine to probe is allowed for -min(probe) <= c <= min(machine).
    low, high = -float(probe.min()), float(machine.min())
    negative = low > high  # a pair with a negative variance: least squares may give one
    moved = 0.5 * (low + high) if negative else min(max(0.0, low), high)
    shared = half - design.signs * moved
    machine, probe = shared[: design.split], shared[design.split :]
    return shared, np.array([machine.min(), probe.min()]), negative


def _explained(
    design: _Design,
    readings: Readings,
    movable: FloatArray,
    negative: bool,
    repeated: RepeatedPair | None,
    variances: FloatArray,
) -> list[str]:
    um2 = 1e6
    errors = (
        f"{len(readings)} readings, {len(design.machines)} machine and {len(design.probes)} probe "
        f"directions: the identification matrix has rank {design.size - 1} of {design.size}, so a "
        "constant common to all errors of machine and probe is not told; the machine's are made "
        "to add up to zero"
    )
    notes = [
        errors,
        "the variances' matrix lacks one rank too: variances of pairs are absolute, but how much "
        "of them is the machine's and how much the probe's is not told by any reading, repeats "
        "included. They are shared half and half on average"
        + (
            ""
            if negative
            else "; none can be moved without a negative variance"
            if movable.max() < 1e-3 * float(np.mean(np.abs(variances)))
            else f"; up to {max(movable[0], 0.0) * um2:.3g} µm² could be moved from every machine "
            f"direction to every probe direction, or {max(movable[1], 0.0) * um2:.3g} back"
        ),
    ]
    if negative:
        notes.append(
            "least squares gives some pairs a negative variance, which cannot be; use --method reml"
        )
    if repeated is not None:
        i = _place(design.machines, repeated.machine, "machine")
        j = design.split + _place(design.probes, repeated.probe, "probe")
        own = float(variances[i] + variances[j])
        notes.append(
            f"the repeated configuration ({repeated.machine}, {repeated.probe}) has "
            f"{repeated.variance * um2:.3g} µm² from {repeated.count} repeats; with it the "
            f"separation gives {own * um2:.3g} µm² there"
        )
    return notes


def direction_variance_uncertainty(readings: Readings, repeats: int = 1) -> float:
    """Relative standard uncertainty of one direction's variance, when all are alike.

    Parameters
    ----------
    readings : Readings
        Their errors do not matter.
    repeats : int
        Of every one of them.

    Returns
    -------
    float
        Largest over the directions, the share between machine and probe held; infinite where
        the readings do not tell.

    >>> i, j = np.divmod(np.arange(144), 12)
    >>> 0.85 < direction_variance_uncertainty(Readings(i, j, np.zeros(144))) < 1.2
    True
    """
    design = _Design(readings)
    matrix, _ = _equations(design, readings.errors, np.full(design.size, 0.5), None)
    # Means of repeats tell as much as single readings; what repeats scatter comes on top.
    matrix = matrix + 0.5 * (repeats - 1) * design.incidence.T @ design.incidence
    values, vectors = np.linalg.eigh(matrix)
    # One direction, the share between machine and probe, is never told.
    if values[1] < 1e-9 * values[-1]:
        return math.inf
    covariance = (vectors[:, 1:] / values[1:]) @ vectors[:, 1:].T
    return float(np.sqrt(np.max(np.diag(covariance)))) / 0.5


def separation_by_trials(
    readings: Readings, result: Separation, *, trials: int = 2000, seed: int | None = 1
) -> tuple[FloatArray, FloatArray]:
    """Trials of a separation's errors and variances, were its own numbers the truth.

    Parameters
    ----------
    readings : Readings
    result : Separation
        Of these readings.
    trials : int
    seed : int or None

    Returns
    -------
    errors : (trials, m + p) float
        Machine, then probe. [mm]
    variances : (trials, m + p) float
        By least squares, shared out half and half (negative ones as they come). [mm²]

    Notes
    -----
    All trials at once: errors are linear in the readings, variances in squared residuals.
    """
    generator = np.random.default_rng(seed)
    design = _Design(readings)
    variances = np.concatenate([result.machine_variance, result.probe_variance])
    scatter = np.sqrt(np.maximum(design.incidence @ variances, 0.0))
    inverse = np.linalg.pinv(design.design)
    noise = scatter[:, None] * generator.standard_normal((len(readings), trials))
    truth = np.concatenate([result.machine_error, result.probe_error])
    errors = truth + (design.basis @ (inverse @ noise)).T
    project = np.eye(len(readings)) - design.design @ inverse
    matrix = design.incidence.T @ project**2 @ design.incidence
    found = np.linalg.pinv(matrix, rcond=1e-9) @ (design.incidence.T @ (project @ noise) ** 2)
    middle = found[: design.split].mean(axis=0) - found[design.split :].mean(axis=0)
    return errors, np.asarray((found - 0.5 * design.signs[:, None] * middle).T)
