"""Measured trigger forces by direction, and numbers of a description from them alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import (
    DescriptionError,
    FloatArray,
    PretravelError,
    as_numbers,
    checked_unit,
    frozen,
)
from pretravel.prediction import ComplianceModel, Probe, predict

_LARGEST = 100.0
"""That of the spring in a description. [N]"""


@dataclass(frozen=True, eq=False)
class MeasuredForces:
    """Trigger forces of a probe, as a load cell measures them.

    Parameters
    ----------
    directions : (n, 3) float
        In which the force acts on the tip: outward normals, machine frame.
    force, u : (n,) float
        And standard uncertainty. [N]

    Raises
    ------
    PretravelError
        No forces; values that are not positive.

    >>> len(MeasuredForces([[1.0, 0.0, 0.0]], [0.75], [0.01]))
    1
    """

    directions: FloatArray
    force: FloatArray
    u: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "directions", checked_unit(self.directions, "directions"))
        for name in ("force", "u"):
            values = as_numbers(getattr(self, name), f"the {name} of forces")
            if values.shape != (len(self.directions),) or not np.all(values > 0.0):
                raise PretravelError(
                    "measured forces need a direction, a force and its u each, both in N and "
                    "positive",
                    inputs=("forces",),
                )
            if np.any(values > _LARGEST):
                raise PretravelError(
                    f"a force or its u is {values.max():g} N; touch-trigger probes have at most "
                    f"{_LARGEST:g} N. Were mN meant? 1000 mN are 1 N",
                    inputs=("forces",),
                )
            object.__setattr__(self, name, frozen(values))
        if not len(self.directions):
            raise PretravelError("there are no measured forces", inputs=("forces",))

    def __len__(self) -> int:
        return len(self.force)

    def residuals(self, probe: Probe, model: str | ComplianceModel) -> FloatArray:
        """Measured minus predicted, (n,). [N]"""
        own = self.directions @ probe.orientation.matrix
        return np.asarray(self.force - predict(probe, own, model).force)

    def white(self, probe: Probe, model: str | ComplianceModel) -> FloatArray:
        """Residuals in units of u, (n,); very large where the probe cannot be."""
        try:
            return self.residuals(probe, model) / self.u
        except DescriptionError:
            return np.full(len(self), 1e6)
