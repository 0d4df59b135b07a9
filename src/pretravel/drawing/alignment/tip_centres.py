"""Touches of a part whose faces are not known yet."""

from __future__ import annotations

from dataclasses import dataclass

from pretravel.base import (
    COORDINATE,
    FloatArray,
    IntArray,
    checked_values,
)
from pretravel.touches import Touches, refuse_several_runs


@dataclass(frozen=True, eq=False)
class TipCentres:
    """Tip centres at the trigger on a part, as a machine reports them; a row is a touch.

    Attributes
    ----------
    positions : (n, 3) float
        [mm]
    approaches : (n, 3) float or None
        Unit directions of travel; against the normals of the part where they are not stated.
    feeds : (n,) float or None
        [mm/min]
    labels : tuple of str or None
    nominal_points : (n, 3) float or None
        The targets on the part, in the part's frame, where a plan states them. [mm]
    faces : (n,) int or None
        Index of the face of each touch, where it is known; else it is the nearest.
    """

    positions: FloatArray
    approaches: FloatArray | None = None
    feeds: FloatArray | None = None
    labels: tuple[str, ...] | None = None
    nominal_points: FloatArray | None = None
    faces: IntArray | None = None

    def __post_init__(self) -> None:
        checked_values(self.positions, "the positions of the touches", COORDINATE)

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, rows: IntArray) -> TipCentres:
        """Those of some touches."""
        labels = self.labels
        return TipCentres(
            self.positions[rows],
            labels=None if labels is None else tuple(labels[row] for row in rows),
            **{
                name: None if (values := getattr(self, name)) is None else values[rows]
                for name in ("approaches", "feeds", "nominal_points", "faces")
            },
        )

    @classmethod
    def of(cls, touches: Touches, *, stated_approaches: bool = True) -> TipCentres:
        """Those of touches; their normals serve as directions of travel alone."""
        touches.refuse_several()
        refuse_several_runs(touches.labels, touches.positions)
        return cls(
            touches.positions,
            touches.approach_directions if stated_approaches else None,
            touches.feeds,
            touches.labels,
            touches.nominal_points,
        )

    def touches(self, normals: FloatArray, nominal_points: FloatArray | None = None) -> Touches:
        """Touches with the normals of the part."""
        return Touches(
            self.positions,
            normals,
            self.approaches,
            self.feeds,
            self.labels,
            self.nominal_points if nominal_points is None else nominal_points,
        )
