"""What the measurement of a feature needs of the settings of its task."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias

if TYPE_CHECKING:
    from pretravel.drawing.tolerances.tolerances import FeatureTolerances

BY_LABEL = "by-label"
"""Instead of a feature: that which the label of the points begins with, as in bore1-1, plane2-1."""

Criterion: TypeAlias = Literal["gaussian", "minimum-zone", "inscribed", "circumscribed", "tangent"]
FormCriterion: TypeAlias = Literal["minimum-zone", "gaussian"]


class StatedSettings(Protocol):
    """What a drawing needs of the settings of a feature, or of the whole run."""

    @property
    def feature(self) -> str | None: ...
    @property
    def nominal(self) -> float | None: ...
    @property
    def association(self) -> Criterion: ...
    @property
    def tip_diameter(self) -> float | None: ...
    @property
    def drawing(self) -> Path | None: ...
    @property
    def probability(self) -> float: ...
    @property
    def u_machine_um(self) -> float: ...
    @property
    def at(self) -> tuple[float, float, float] | None: ...
    @property
    def axis(self) -> tuple[float, float, float] | None: ...
    def tolerances(self) -> FeatureTolerances:
        """Of the feature."""

    def limits_of(self, text: str, nominal: float | None) -> tuple[float, float]:
        """The limits that a tolerance states."""
