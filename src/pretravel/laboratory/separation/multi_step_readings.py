"""Readings of a multi-step test, and the equations that they give for machine and probe."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.base import (
    COUNT,
    VARIANCE,
    FloatArray,
    IntArray,
    PretravelError,
    check_numbers,
    frozen,
)

_LARGEST = 0.5
"""Difference of two readings, or standard deviation of one. [mm]"""
_LISTED = 12  # directions that a message names


@dataclass(frozen=True, eq=False)
class MultiStepReadings:
    """Readings of a multi-step test; each has one machine direction and one probe direction.

    Parameters
    ----------
    machine, probe : (n,) int
        Indices of the directions; they may start at any number.
    errors : (n,) float
        Machine error less probe error, with noise. [mm]
    circles : (n, k) float
        Derivatives of what was fitted to the readings before, the circle of each setup: the
        readings do not show whether machine or probe contains it. No columns if nothing was fitted.
    first_azimuth : float
        Of the directions with index 1; nan where they are not known. [rad]
    directions : int
        Number of directions around the circle, at equal angles; 0 where it is not known.
    step : float
        In which the machine reports them; 0 where none is seen. [mm]

    Raises
    ------
    PretravelError
        Shapes that differ, values that are not finite, too few readings.

    >>> MultiStepReadings([1, 1, 2, 2], [1, 2, 1, 2], [0.0, 1e-3, 1e-3, 2e-3]).machines.tolist()
    [1, 2]
    """

    machine: IntArray
    probe: IntArray
    errors: FloatArray
    circles: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    first_azimuth: float = math.nan
    directions: int = 0
    step: float = 0.0

    def __post_init__(self) -> None:
        machine, probe = np.array(self.machine), np.array(self.probe)
        errors = frozen(self.errors)
        for name, index in (("machine", machine), ("probe", probe)):
            if np.any(index != np.round(index)):
                raise PretravelError(f"{name} indices must be whole numbers")
        if not (machine.shape == probe.shape == errors.shape) or errors.ndim != 1:
            raise PretravelError(
                f"{machine.shape} machine indices, {probe.shape} probe indices and "
                f"{errors.shape} errors: expected three arrays of one length"
            )
        if not np.all(np.isfinite(errors)):
            raise PretravelError("readings must be finite")
        if len(errors) and np.ptp(errors) > _LARGEST:
            raise PretravelError(
                f"the readings differ by up to {np.ptp(errors):.3g} mm: no machine and no probe "
                "has such errors. Were µm meant? 1 µm is 0.001 mm"
            )
        if len(errors) < 4:
            raise PretravelError(
                f"{len(errors)} readings are too few to separate machine and probe; at least 4 "
                "are needed"
            )
        circles = frozen(self.circles) if np.size(self.circles) else np.zeros((len(errors), 0))
        if circles.ndim != 2 or len(circles) != len(errors):
            raise PretravelError(f"{len(errors)} readings have circles of shape {circles.shape}")
        object.__setattr__(self, "circles", circles)
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
    def turn(self) -> int:
        """Directions in a full turn; 0 where they are not known.

        Where they are not stated, machine and probe have the directions 1 to n.
        """
        if self.directions:
            return self.directions
        each = np.arange(1, len(self.machines) + 1)
        same = np.array_equal(self.machines, each) and np.array_equal(self.probes, each)
        return len(each) if same and len(each) > 2 else 0

    def azimuths_of(self, indices: IntArray) -> FloatArray:
        """Azimuths of directions by their indices, as `separation-plan` numbers them. [rad]

        Where they are not stated, machine and probe must have the directions 1 to n, all around
        from +x; else nan.
        """
        count, first = self.turn, self.first_azimuth
        if not count:
            return np.full(len(indices), math.nan)
        if not self.directions:
            first = 0.0
        return np.asarray(first + (indices - 1) * (2.0 * math.pi / count))

    @property
    def probes(self) -> IntArray:
        """Probe directions that occur, in order."""
        return np.unique(self.probe)


@dataclass(frozen=True)
class RepeatedPair:
    """One configuration whose variance was measured by repeated touches.

    Parameters
    ----------
    machine, probe : int
        Indices of the directions.
    variance : float
        [mm²]
    count : int
        Number of repeats from which the variance was determined.
    """

    machine: int
    probe: int
    variance: float
    count: int = 10

    def __post_init__(self) -> None:
        check_numbers(self, variance=VARIANCE, count=COUNT)
        if self.variance > _LARGEST**2:
            raise PretravelError(
                f"the variance of the repeats is {self.variance:g} mm². Were µm² meant? 1 µm² is "
                "1e-6 mm²"
            )
        if self.variance == 0.0:
            raise PretravelError(
                f"the variance of the repeats is {self.variance * 1e6:g} µm²; it must be positive"
            )
        if self.count < 2:
            raise PretravelError(
                f"{self.count} repeat does not determine a variance; at least two are needed"
            )


@dataclass(frozen=True, eq=False)
class MultiStepDesign:
    """The linear equations of a multi-step test.

    Attributes
    ----------
    machines, probes : (m,), (p,) int
        Indices as in the readings.
    row, column : (n,) int
        Place of each reading's direction in `machines` and in `probes`.
    incidence : (n, m + p) float
        One where a direction takes part in a reading: the sums of variances.
    signs : (m + p,) float
        Plus one for the machine, minus one for the probe.
    basis : (m + p, r) float
        Orthonormal; it spans the errors whose machine part adds up to zero, or with circles those
        that no circle can take.
    columns : (n, c) float
        Readings by what is fitted to them: the errors of all directions, whose sum is not
        determined; or the coordinates of the errors in `basis`, then the circles.
    rank : int
        Of the columns.
    """

    machines: IntArray
    probes: IntArray
    row: IntArray
    column: IntArray
    incidence: FloatArray
    signs: FloatArray
    basis: FloatArray
    columns: FloatArray
    rank: int

    @property
    def with_circles(self) -> bool:
        """Whether circles were fitted to the readings."""
        return bool(self.columns.shape[1] == self.rank)

    @property
    def solved(self) -> FloatArray:
        """Errors of all directions by the readings, in `basis`: least squares, (r, n)."""
        if self.with_circles:
            return np.asarray(np.linalg.pinv(self.columns)[: self.basis.shape[1]])
        return np.asarray(np.linalg.pinv(self.columns @ self.basis))

    @property
    def split(self) -> int:
        """Number of machine directions; the probe's come after them."""
        return len(self.machines)

    @property
    def size(self) -> int:
        """Number of machine and probe directions."""
        return len(self.signs)

    def machine_place(self, index: int) -> int:
        """Place of a machine direction among all directions."""
        return direction_place(self.machines, index, "machine")

    def probe_place(self, index: int) -> int:
        """Place of a probe direction among all directions."""
        return self.split + direction_place(self.probes, index, "probe")


def multi_step_design(readings: MultiStepReadings) -> MultiStepDesign:
    """The equations of readings.

    >>> readings = MultiStepReadings([1, 1, 2, 2], [1, 2, 1, 2], [0.0, 1e-3, 1e-3, 2e-3])
    >>> multi_step_design(readings).rank
    3

    Raises
    ------
    PretravelError
        Circles that leave more undetermined than the mean and the first harmonic of both errors.
    """
    from scipy.linalg import null_space

    machines, row = np.unique(readings.machine, return_inverse=True)
    probes, column = np.unique(readings.probe, return_inverse=True)
    count, split = len(readings), len(machines)
    incidence = np.zeros((count, split + len(probes)))
    incidence[np.arange(count), row] = 1.0
    incidence[np.arange(count), split + column] = 1.0
    signs = np.concatenate([np.ones(split), -np.ones(len(probes))])
    signed = incidence * signs
    if readings.circles.shape[1]:
        basis, columns = _beside_circles(signed, readings.circles)
        rank = columns.shape[1]
    else:
        # A constant added to all errors of machine and probe changes no reading.
        machine_sum = np.concatenate([np.ones(split), np.zeros(len(probes))])
        basis, columns, rank = np.asarray(null_space(machine_sum[None, :])), signed, len(signs) - 1
    return MultiStepDesign(machines, probes, row, column, incidence, signs, basis, columns, rank)


_IN_CIRCLES = 6
"""Combinations of errors that circles take: mean and first harmonic of machine and probe."""


def _beside_circles(signed: FloatArray, circles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Errors that circles do not take, and the readings by these errors and the circles."""
    own = circles @ _split_by_rank(circles)[0]
    both = np.concatenate([signed, own], axis=1)
    hidden = _split_by_rank(both)[1][: signed.shape[1]]
    if hidden.shape[1] > _IN_CIRCLES:
        raise PretravelError(
            f"the readings leave {hidden.shape[1]} combinations of errors undetermined. The "
            f"circle fitted to each setup leaves only {_IN_CIRCLES}, the mean and the first "
            "harmonic of machine and probe: touch all directions at each orientation, or at more "
            "orientations"
        )
    basis = _split_by_rank(hidden.T)[1]
    return basis, np.concatenate([signed @ basis, own], axis=1)


def _split_by_rank(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Orthonormal coefficients of columns: those that make something, and those that make zero."""
    # Faster than singular values; all columns are of one order of magnitude.
    squares, vectors = np.linalg.eigh(matrix.T @ matrix)
    makes = squares > 1e-12 * squares[-1]
    return np.asarray(vectors[:, makes]), np.asarray(vectors[:, ~makes])


def counted_the_other_way(readings: MultiStepReadings) -> MultiStepReadings:
    """The readings as they are if the orientations of the probe were counted the other way.

    Machine direction i meets probe direction i - s in orientation s; the other way it meets
    i + s.

    Parameters
    ----------
    readings : MultiStepReadings
        Machine and probe have the same directions, numbered 1 to n around the circle.

    Raises
    ------
    PretravelError
        Directions of machine and probe that are not the same.

    >>> readings = MultiStepReadings([1, 2, 3, 1], [1, 2, 3, 3], [0.0, 1e-3, 1e-3, 2e-3])
    >>> counted_the_other_way(readings).probe.tolist()
    [1, 2, 3, 2]
    """
    count = readings.turn
    if count == 0:
        raise PretravelError(
            "the sense of the orientations can be changed only if machine and probe have the "
            "same directions, numbered 1 to n around the circle",
            inputs=("clockwise",),
        )
    turned = np.mod(2 * (readings.machine - 1) - (readings.probe - 1), count) + 1
    return replace(readings, probe=turned)


def direction_sums(design: MultiStepDesign, values: FloatArray) -> FloatArray:
    """Sums of values of readings over each direction, (m + p,)."""
    return np.concatenate(
        [
            np.bincount(design.row, values, design.split),
            np.bincount(design.column, values, design.size - design.split),
        ]
    )


def normal_matrix(design: MultiStepDesign, weights: FloatArray) -> FloatArray:
    """Normal equations of the errors of all directions, (m + p, m + p).

    The constant that no reading determines is fixed: the machine's errors add up to zero. With
    circles they are those of `MultiStepDesign.columns`, which have full rank.

    Parameters
    ----------
    design : MultiStepDesign
    weights : (n,) float
        Of the readings.
    """
    if design.with_circles:
        return np.asarray(design.columns.T @ (weights[:, None] * design.columns))
    split, probes = design.split, design.size - design.split
    cells = np.bincount(design.row * probes + design.column, weights, split * probes)
    matrix = np.diag(direction_sums(design, weights))
    matrix[:split, split:] = -cells.reshape(split, probes)
    matrix[split:, :split] = matrix[:split, split:].T
    matrix[:split, :split] += float(np.mean(weights))
    return matrix


def weighted_fit(design: MultiStepDesign, errors: FloatArray, weights: FloatArray) -> FloatArray:
    """Coefficients of `MultiStepDesign.columns` by weighted least squares, (c,). [mm]"""
    if design.with_circles:
        right = design.columns.T @ (weights * errors)
    else:
        right = design.signs * direction_sums(design, weights * errors)
    matrix = normal_matrix(design, weights)
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:  # weights that differ by more than a number has digits
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])


def residuals_from(design: MultiStepDesign, errors: FloatArray, solution: FloatArray) -> FloatArray:
    """Readings less what the columns have with these coefficients, (n,). [mm]"""
    if design.with_circles:
        return np.asarray(errors - design.columns @ solution)
    return errors - (solution[design.row] - solution[design.split + design.column])


def weighted_residuals(
    design: MultiStepDesign, errors: FloatArray, weights: FloatArray
) -> FloatArray:
    """Residuals of weighted least squares, (n,). [mm]

    >>> readings = MultiStepReadings([1, 1, 2, 2], [1, 2, 1, 2], [0.0, 1e-3, 1e-3, 2.4e-3])
    >>> residuals = weighted_residuals(multi_step_design(readings), readings.errors, np.ones(4))
    >>> [f"{1e3 * residual:.1f}" for residual in residuals]
    ['0.1', '-0.1', '-0.1', '0.1']
    """
    return residuals_from(design, errors, weighted_fit(design, errors, weights))


def direction_place(indices: IntArray, wanted: int, kind: str) -> int:
    """Place of a direction's index among those of the readings.

    Raises
    ------
    PretravelError
        A direction without readings.
    """
    found = np.flatnonzero(indices == wanted)
    if not len(found):
        listed = ", ".join(str(i) for i in indices[:_LISTED])
        more = ", …" if len(indices) > _LISTED else ""
        raise PretravelError(f"no reading has {kind} direction {wanted}; there are {listed}{more}")
    return int(found[0])


def check_connected(design: MultiStepDesign) -> None:
    """Check that common directions connect all readings.

    Raises
    ------
    PretravelError
        Groups of readings without a common direction: each has an unknown constant of its own.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    nodes = design.size
    ones = np.ones(len(design.row))
    graph = coo_array((ones, (design.row, design.split + design.column)), shape=(nodes, nodes))
    parts, label = connected_components(graph, directed=False)
    if parts == 1:
        return
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
        f"the readings form {parts} groups that share no direction "
        f"({'; '.join(groups)}{'; …' if parts > 3 else ''}): each has its own constant, "
        f"and the identification matrix is rank deficient by {parts} instead of one. Add "
        "readings that connect the groups, for example orientations turned by one step"
    )
