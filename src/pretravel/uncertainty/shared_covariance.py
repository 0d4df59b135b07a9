"""Covariance of many values with errors of their own and a few errors that they share.

Touches in g directions have a noise of their own, and share what a few dozen coefficients are in
error. Their covariance, a matrix (g, g), is a diagonal and a product of two narrow matrices: it is
never made, and what is asked of it costs as much as the narrow ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pretravel.base import FloatArray, PretravelError

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
