"""Residuals that follow the pretravel that was subtracted: the map is not that of these touches."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, FloatArray

_MATTERS = 0.3
"""Share of the pretravel that is left, which a turn by 15° of a probe with three rods leaves."""
_TIMES_MAP = 4.0
"""Share over its standard deviation by the map, whose errors are in U."""
_IMPOSSIBLE = 4.0
"""A turn leaves twice the lobes at most, a stylus that yields four times as much leaves three."""
_TIMES = 6.0
"""Share over its standard deviation by the other residuals."""
_LEAST = 1.0 * MICROMETRE
"""Root mean square of the residuals by it that a report speaks of. [mm]"""
_FEWEST = 4
"""Degrees of freedom of the other residuals."""
_NO_LOBES = 0.5 * MICROMETRE
"""Root mean square of what a feature leaves of the pretravel, below which it shows no map. [mm]"""


@dataclass(frozen=True)
class PretravelLeft:
    """How far residuals of features follow the pretravel that was subtracted.

    Attributes
    ----------
    products, pretravel, residuals : float
        Sums over the points of residual times pretravel, and of the squares of both, after the
        features took what they can of the pretravel. [mm²]
    by_map : float
        Standard deviation of `products` by the errors of the map; features share them. [mm²]
    dof : int
        Points less parameters of the features.
    """

    products: float = 0.0
    pretravel: float = 0.0
    residuals: float = 0.0
    by_map: float = 0.0
    dof: int = 0

    @staticmethod
    def of(
        residuals: FloatArray,
        pretravel: FloatArray,
        jacobian: FloatArray,
        of_map: FloatArray | None = None,
    ) -> PretravelLeft:
        """Of one feature.

        Parameters
        ----------
        residuals, pretravel : (n,) float
            Along the outward normals of the feature. [mm]
        jacobian : (n, k) float
            Derivatives of the residuals by the parameters.
        of_map : (m, n) float, optional
            Factors of the errors of the map. [mm]

        >>> azimuth = np.arange(12) * np.pi / 6
        >>> circle = np.column_stack([np.ones(12), np.cos(azimuth), np.sin(azimuth)])
        >>> lobes = 0.010 + 0.003 * np.cos(3.0 * azimuth)
        >>> round(PretravelLeft.of(2.0 * lobes, lobes, circle).share, 9)
        2.0
        """
        if not (np.isfinite(pretravel).all() and len(pretravel)):
            return PretravelLeft()
        basis, size, _ = np.linalg.svd(jacobian, full_matrices=False)
        basis = basis[:, size > 1e-9 * size.max(initial=0.0)]
        left, lobes = (each - basis @ (basis.T @ each) for each in (residuals, pretravel))
        dof, squares = len(residuals) - basis.shape[1], float(lobes @ lobes)
        if squares <= dof * _NO_LOBES**2:
            return PretravelLeft()
        by_map = 0.0 if of_map is None else float(np.linalg.norm(of_map @ lobes))
        return PretravelLeft(float(left @ lobes), squares, float(left @ left), by_map, dof)

    def joined(self, other: PretravelLeft) -> PretravelLeft:
        """Of the features of both."""
        return PretravelLeft(
            self.products + other.products,
            self.pretravel + other.pretravel,
            self.residuals + other.residuals,
            self.by_map + other.by_map,
            self.dof + other.dof,
        )

    @property
    def share(self) -> float:
        """Residuals over pretravel: 0 with the right map, 1 where the touches contain no lobes."""
        return self.products / self.pretravel if self.pretravel > 0.0 else 0.0

    def sentence(self) -> str:
        """That the map is not that of these touches, if the residuals show this; else empty."""
        if self.dof <= _FEWEST or not _MATTERS < abs(self.share) < _IMPOSSIBLE:
            return ""
        if abs(self.products) < _TIMES_MAP * self.by_map:
            return ""
        explained = self.share**2 * self.pretravel
        others = max(self.residuals - explained, 0.0) / (self.dof - 1)
        by_pretravel = math.sqrt(explained / self.dof)
        if by_pretravel < _LEAST or explained < _TIMES**2 * others:
            return ""
        return (
            f"the residuals follow the pretravel of the map ({self.share:+.2f} times, "
            f"{by_pretravel / MICROMETRE:.1f} µm root mean square), as if this were not the map of "
            f"these touches: {self._cause()}? Sizes and positions can then be wrong by more than "
            "U. A part with as many lobes as the probe has rods looks alike"
        )

    def _cause(self) -> str:
        """What leaves such a share of the pretravel."""
        if self.share < 0.0:
            return "was the stylus longer, the spring stronger, or is it another probe"
        return (
            "was the spindle or the part turned, was the stylus shorter, is it another probe, or "
            "had the control compensated the touches"
        )
