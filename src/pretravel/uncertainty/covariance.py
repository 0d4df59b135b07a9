"""The covariance of several quantities, in one of three forms; rows reduced by variance.

Rows with the same variance can be turned among each other by any orthogonal matrix: what a
regression with these variances gives stays the same. A triangle of as many rows as columns then
contains all that 100,000 rows give, and a likelihood that needs a matrix of all pairs of rows needs
one of all pairs of columns.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, IntArray, PretravelError, frozen

_ROUNDING = 1e-9  # of the largest eigenvalue: what rounding may take a zero eigenvalue below zero


class Correlation(Enum):
    """How the errors of several quantities are correlated."""

    INDEPENDENT = "independent"
    """Each quantity has an error of its own."""
    FULLY_SHARED = "fully shared"
    """One error moves all quantities together, each by its own standard uncertainty."""
    FULL = "full matrix"
    """The covariance of every pair is given."""


@dataclass(frozen=True, eq=False)
class Covariance:
    """Covariance of n quantities.

    Made by `independent`, `fully_shared` and `full`: variances alone do not say whether the errors
    are independent, and the uncertainty of a sum depends on that.

    Attributes
    ----------
    correlation : Correlation
    values : (n,) or (n, n) float
        Variances where the quantities are independent or fully correlated, else the matrix.
        Square of the unit of the quantities.

    Raises
    ------
    PretravelError
        Values that are not finite, a negative variance, a matrix that is not symmetric.

    Examples
    --------
    The sum of two quantities with the standard uncertainty 1:

    >>> total = np.array([[1.0, 1.0]])
    >>> Covariance.independent([1.0, 1.0]).variance_of(total).tolist()
    [2.0]
    >>> Covariance.fully_shared([1.0, 1.0]).variance_of(total).tolist()
    [4.0]
    >>> Covariance.full([[1.0, 0.5], [0.5, 1.0]]).variance_of(total).tolist()
    [3.0]
    """

    correlation: Correlation
    values: FloatArray

    def __post_init__(self) -> None:
        values = frozen(self.values)
        object.__setattr__(self, "values", values)
        if values.ndim != (2 if self.correlation is Correlation.FULL else 1):
            raise PretravelError(
                f"a covariance of the form '{self.correlation.value}' has "
                f"{'a square matrix' if self.correlation is Correlation.FULL else 'variances (n,)'}"
                f", not an array of shape {values.shape}"
            )
        if not np.all(np.isfinite(values)):
            raise PretravelError("a covariance must be finite")
        if self.correlation is not Correlation.FULL and np.any(values < 0.0):
            row = int(np.argmin(self.variances))
            raise PretravelError(
                f"variances cannot be negative; variance {row + 1} is {self.variances[row]:g}"
            )

    @classmethod
    def independent(cls, variances: npt.ArrayLike) -> Covariance:
        """Of quantities without common errors, from their variances (n,)."""
        return cls(Correlation.INDEPENDENT, np.asarray(variances, dtype=np.float64))

    @classmethod
    def fully_shared(cls, variances: npt.ArrayLike) -> Covariance:
        """Of quantities that one common error moves, from their variances (n,).

        The standard uncertainty of a weighted mean of such quantities is the weighted mean of
        their standard uncertainties.
        """
        return cls(Correlation.FULLY_SHARED, np.asarray(variances, dtype=np.float64))

    @classmethod
    def full(cls, matrix: npt.ArrayLike) -> Covariance:
        """From the matrix (n, n) itself, which is checked for negative variances of any sum."""
        given = np.asarray(matrix, dtype=np.float64)
        if given.ndim == 2:
            _check_matrix(given)
        return cls(Correlation.FULL, given)

    @classmethod
    def none(cls, size: int) -> Covariance:
        """Of `size` quantities that state no uncertainty."""
        return cls.independent(np.zeros(size))

    def __len__(self) -> int:
        return len(self.values)

    @property
    def variances(self) -> FloatArray:
        """Variance of each quantity, (n,)."""
        if self.correlation is Correlation.FULL:
            return np.asarray(np.diagonal(self.values))
        return self.values

    @property
    def matrix(self) -> FloatArray:
        """Covariance of every pair of quantities, (n, n)."""
        if self.correlation is Correlation.INDEPENDENT:
            return np.diag(self.values)
        if self.correlation is Correlation.FULLY_SHARED:
            deviation = np.sqrt(self.values)
            return np.outer(deviation, deviation)
        return self.values

    @property
    def root(self) -> FloatArray:
        """A matrix R with R R' = the covariance matrix, (n, k): independent errors are its columns.

        >>> Covariance.fully_shared([1.0, 4.0]).root.tolist()
        [[1.0], [2.0]]
        """
        if self.correlation is Correlation.INDEPENDENT:
            return np.diag(np.sqrt(self.values))
        if self.correlation is Correlation.FULLY_SHARED:
            return np.asarray(np.sqrt(self.values)[:, None])
        eigenvalues, vectors = np.linalg.eigh(self.values)
        return np.asarray(vectors * np.sqrt(np.maximum(eigenvalues, 0.0)))

    @property
    def states_uncertainty(self) -> bool:
        """Whether any variance is above zero."""
        return bool(self.values.any())

    def variance_of(self, weights: FloatArray) -> FloatArray:
        """Variances of weighted sums of the quantities.

        Parameters
        ----------
        weights : (m, n) float
            One row for each sum.

        Returns
        -------
        (m,) float
        """
        if self.correlation is Correlation.INDEPENDENT:
            return np.asarray(weights**2 @ self.values)
        if self.correlation is Correlation.FULLY_SHARED:
            return np.asarray((weights @ np.sqrt(self.values)) ** 2)
        return np.asarray(np.einsum("ij,ij->i", weights @ self.values, weights))

    def carried(self, weights: FloatArray) -> FloatArray:
        """Covariance matrix of weighted sums of the quantities: W S W', (m, m).

        Parameters
        ----------
        weights : (m, n) float
            One row for each sum.

        References
        ----------
        JCGM 102, equation 3.
        """
        if self.correlation is Correlation.INDEPENDENT:
            return np.asarray((weights * self.values) @ weights.T)
        if self.correlation is Correlation.FULLY_SHARED:
            deviation = weights @ np.sqrt(self.values)
            return np.outer(deviation, deviation)
        return np.asarray(weights @ self.values @ weights.T)

    def errors(
        self, rng: np.random.Generator | int, trials: int, weights: FloatArray | None = None
    ) -> FloatArray:
        """Normal errors with this covariance, drawn.

        Parameters
        ----------
        rng : numpy.random.Generator or int
        trials : int
        weights : (m, n) float, optional
            Of weighted sums; the quantities themselves when not given.

        Returns
        -------
        (trials, m) float
        """
        rng = np.random.default_rng(rng)
        rows = np.eye(len(self)) if weights is None else weights
        if self.correlation is Correlation.FULLY_SHARED:
            return rng.standard_normal((trials, 1)) * (rows @ np.sqrt(self.values))
        draws = rng.standard_normal((trials, len(self)))
        if self.correlation is Correlation.INDEPENDENT:
            return np.asarray((draws * np.sqrt(self.values)) @ rows.T)
        return np.asarray((draws @ self.root.T) @ rows.T)


def _check_matrix(matrix: FloatArray) -> None:
    if matrix.shape[0] != matrix.shape[1]:
        raise PretravelError(f"a covariance matrix is square; this one has shape {matrix.shape}")
    if not len(matrix) or not np.all(np.isfinite(matrix)):
        return  # the constructor refuses what is not finite
    if _is_surely_covariance(matrix):
        return
    lowest, highest = np.linalg.eigvalsh(matrix)[[0, -1]]
    asymmetry = 1e-12 * max(highest, 0.0)
    if not np.allclose(matrix, matrix.T, atol=asymmetry) or lowest < -_ROUNDING * highest:
        raise PretravelError("this is not a covariance: symmetric, no negative variance")


_FEW = 2.0  # values for each shared error from which the narrow form is used


@dataclass(frozen=True, eq=False)
class SharedCovariance:
    """The covariance diag(own) + S S' of n values.

    Attributes
    ----------
    own : (n,) float
        Variances of the errors of single values; above zero.
    shared : (n, k) float
        S: effect of each shared error, for an error of one standard deviation.

    Raises
    ------
    PretravelError
        Shapes that differ, a variance that is not above zero.

    References
    ----------
    M. A. Woodbury 1950: the inverse of such a matrix.

    >>> covariance = SharedCovariance(np.array([1.0, 1.0]), np.array([[1.0], [1.0]]))
    >>> round(covariance.log_determinant, 6) == round(float(np.log(3.0)), 6)
    True
    >>> white = covariance.whitened(np.eye(2))
    >>> (white.T @ white).round(6).tolist()
    [[0.666667, -0.333333], [-0.333333, 0.666667]]
    """

    own: FloatArray
    shared: FloatArray

    def __post_init__(self) -> None:
        if self.own.ndim != 1 or self.shared.ndim != 2 or len(self.own) != len(self.shared):
            raise PretravelError(
                f"own variances of shape {self.own.shape} and shared errors of shape "
                f"{self.shared.shape} are not of the same values"
            )
        if not np.all(self.own > 0.0):
            raise PretravelError("variances of single values must be above zero")

    def __len__(self) -> int:
        return len(self.own)

    @cached_property
    def _narrow(self) -> bool:
        return bool(len(self.own) > _FEW * self.shared.shape[1])

    @property
    def whitening(self) -> FloatArray | None:
        """The matrix W of `whitened`, (n, n), of few values; None where it is not made."""
        return None if self._narrow else self._whitening

    @cached_property
    def _whitening(self) -> FloatArray:
        """Inverse of the Cholesky factor, (n, n), of few values."""
        total = self.shared @ self.shared.T
        total[np.diag_indices_from(total)] += self.own
        return np.asarray(np.linalg.inv(np.linalg.cholesky(total)))

    @cached_property
    def _axes(self) -> tuple[FloatArray, FloatArray]:
        """Orthonormal directions of the shared errors among values of variance one, and sizes."""
        left, size, _ = np.linalg.svd(self.shared / np.sqrt(self.own)[:, None], full_matrices=False)
        return left, size

    def whitened(self, values: FloatArray) -> FloatArray:
        """Values turned and scaled so that they are independent with variance one.

        Parameters
        ----------
        values : (n,) or (n, m) float

        Returns
        -------
        the same shape
            W values, with W' W the inverse of the covariance.
        """
        if not self._narrow:
            return np.asarray(self._whitening @ values)
        root = np.sqrt(self.own)
        scaled = values / (root if values.ndim == 1 else root[:, None])
        left, size = self._axes
        along = left.T @ scaled
        taken = 1.0 - 1.0 / np.sqrt(1.0 + size**2)
        return np.asarray(scaled - (left * taken) @ along)

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the covariance."""
        if not self._narrow:
            return -2.0 * float(np.log(np.diag(self._whitening)).sum())
        return float(np.log(self.own).sum() + np.log1p(self._axes[1] ** 2).sum())


def _is_surely_covariance(matrix: FloatArray) -> bool:
    """By a Cholesky factor, which costs a fifth of the eigenvalues.

    The largest eigenvalue is at least the largest variance.
    """
    largest = float(np.diagonal(matrix).max())
    if largest <= 0.0 or np.abs(matrix - matrix.T).max() > 1e-12 * largest:
        return False
    try:
        np.linalg.cholesky(matrix + 0.5 * _ROUNDING * largest * np.eye(len(matrix)))
    except np.linalg.LinAlgError:
        return False
    return True


MOST_CLASSES = 64
"""Different variances that are kept apart; more of them are put into classes of similar ones."""
_ROWS = 2048
"""Of a block that is reduced at once."""


@dataclass(frozen=True, eq=False)
class ReducedRows:
    """Triangles of the rows of each class, one under the other.

    Attributes
    ----------
    rows : (r, p) float
        The last column is the value that the others explain.
    classes : (r,) int
        Of the rows.
    unexplained : (c,) float
        Sum of squares of the values of each class that no column explains at all.
    dof : (c,) float
        Rows that it stands for: those of the class less those that remain.
    """

    rows: FloatArray
    classes: IntArray
    unexplained: FloatArray
    dof: FloatArray

    @property
    def together(self) -> tuple[FloatArray, float, float]:
        """All classes as one: rows (p - 1, p), unexplained sum of squares, rows it stands for."""
        triangle = _triangle(self.rows)
        explained = self.rows.shape[1] - 1
        left = float(np.sum(triangle[explained:, -1] ** 2) + self.unexplained.sum())
        dof = float(self.dof.sum() + len(self.rows) - explained)
        return triangle[:explained], left, dof


def reduced_rows(blocks: Iterable[tuple[FloatArray, IntArray]], classes: int) -> ReducedRows:
    """Reduce rows that are given in blocks.

    Parameters
    ----------
    blocks : iterable of (rows (b, p), classes (b,))
        The last column of the rows is the value that the others explain.
    classes : int
        Number of classes; rows of one class have the same variance.

    Returns
    -------
    ReducedRows
        Of a class with fewer rows than columns the rows themselves. Memory: p² numbers for each
        class, whatever the number of rows.

    >>> rows = np.random.default_rng(1).standard_normal((1000, 3))
    >>> small = reduced_rows([(rows, np.zeros(1000, dtype=int))], 1)
    >>> small.rows.shape, bool(np.allclose(small.rows.T @ small.rows, (rows.T @ rows)
    ...     - np.diag([0, 0, small.unexplained[0]])))
    ((2, 3), True)
    """
    parts: list[list[FloatArray]] = [[] for _ in range(classes)]
    waiting, seen = np.zeros(classes, dtype=np.int64), np.zeros(classes, dtype=np.int64)
    width = 0
    for rows, of_rows in blocks:
        width = rows.shape[1]
        for number in np.unique(of_rows):
            own = rows[of_rows == number]
            parts[number].append(own)
            waiting[number] += len(own)
            seen[number] += len(own)
            if waiting[number] > _ROWS + width:
                parts[number] = [_triangle(np.concatenate(parts[number]))]
                waiting[number] = len(parts[number][0])
    kept, unexplained = [], np.zeros(classes)
    for number, own_parts in enumerate(parts):
        own = np.concatenate(own_parts) if own_parts else np.zeros((0, width))
        if seen[number] > width:
            own = _triangle(own)
            # Its last row is the part that no column explains.
            unexplained[number] = float(own[-1, -1] ** 2)
            own = own[:-1]
        kept.append(own)
    remaining = np.array([len(own) for own in kept])
    return ReducedRows(
        rows=np.concatenate(kept),
        classes=np.repeat(np.arange(classes), remaining),
        unexplained=unexplained,
        dof=(seen - remaining).astype(np.float64),
    )


def _triangle(rows: FloatArray) -> FloatArray:
    """R of a QR decomposition, (min(r, p), p)."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def classes_of(counts: FloatArray) -> tuple[FloatArray, IntArray]:
    """Classes of directions by their number of touches.

    Parameters
    ----------
    counts : (g,) float

    Returns
    -------
    count : (c,) float
        Of each class: the number itself, or where there are more than `MOST_CLASSES` different
        numbers the mean of similar ones.
    classes : (g,) int

    >>> count, classes = classes_of(np.array([3.0, 2.0, 3.0]))
    >>> count.tolist(), classes.tolist()
    ([2.0, 3.0], [1, 0, 1])
    """
    count, classes = np.unique(counts, return_inverse=True)
    if len(count) <= MOST_CLASSES:
        return np.asarray(count), np.asarray(classes.ravel(), dtype=np.int64)
    # Classes lie at equal steps of the logarithm, so that each variance is near that of its class.
    steps = np.log(counts / count[0]) / np.log(count[-1] / count[0]) * (MOST_CLASSES - 1)
    _, classes = np.unique(np.round(steps), return_inverse=True)
    classes = classes.ravel()
    mean = np.bincount(classes, counts) / np.bincount(classes)
    return np.asarray(mean), np.asarray(classes, dtype=np.int64)
