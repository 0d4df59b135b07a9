"""Surface points with their uncertainties: the result of a compensation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    MICROMETRE,
    FloatArray,
    IntArray,
    Placement,
    ShownInNotebooks,
    WithDataFrame,
    WithDataset,
    WithPlot,
    extent,
    frozen,
)
from pretravel.measurement.scatter_on_part import ScatterOnPart
from pretravel.touches import quantisation_step

FIXED_SCATTER = "fixed scatter"
"""The cause in `Points.shared` that is common to points with the same normal, and to no others:
what repeated touches of a direction do not reduce (`PretravelMap.fixed_scatter`)."""


@dataclass(frozen=True, eq=False)
class Points(ShownInNotebooks, WithPlot, WithDataFrame, WithDataset):
    """Surface points, one for each touch, in the touches' order and frame.

    Attributes
    ----------
    positions : (n, 3) float
        Points of first contact. [mm]
    normals : (n, 3) float
        Outward unit normals that the compensation used; not numbers for points of another origin,
        which state none.
    pretravel : (n,) float
        That was subtracted, along -n. [mm]
    covariance : (n, 3, 3) float
        Of each point: repeatability along the approach, map, tip radius. [mm²]
    deviation : (n,) float or None
        Distance from the nominal along its normal, positive outside. [mm]
    labels : tuple of str
    shared : mapping of str to (n,) float, or None
        Errors that points have in common: for each independent cause, the movement of every point
        along its normal when the cause is off by one standard uncertainty. Several factors
        ("map 1", "map 2") make up the errors of a map. `FIXED_SCATTER` is common to the points of
        one direction only. None: it is not known which part of `covariance` is common. [mm]
    uncompensated : (n, 3) float or None
        Tip centres less the tip radius along the normals of the touches: what a control reports
        that subtracts the radius alone. [mm]
    face : (n,) int or None
        Numbers of the faces of the part on which the points lie, as `pretravel faces` lists them.
    scatter : ScatterOnPart or None
        What touches at repeated places show of their scatter, from the compensation.
    step : float
        In which coordinates of another origin are written; zero where none is seen, and for
        compensated points, whose covariance contains the step of their touches. [mm]
    map_used : str
        Name of the file and identity of the map that was used; empty where it is not known.
    files : str
        Of the touches, where they were several, compensated as one clamping.

    Notes
    -----
    Covariances are of single points. Errors of map, tip radius and delay are common to many points
    (`shared`): the mean of n points does not have an uncertainty smaller by the root of n.
    """

    positions: FloatArray
    normals: FloatArray
    pretravel: FloatArray
    covariance: FloatArray
    deviation: FloatArray | None
    labels: tuple[str, ...]
    shared: Mapping[str, FloatArray] | None = None
    uncompensated: FloatArray | None = None
    face: IntArray | None = None
    step: float = 0.0
    scatter: ScatterOnPart | None = None
    map_used: str = ""
    files: str = ""

    def __repr__(self) -> str:
        where = "; ".join(f"{axis} {extent(self.positions[:, i])}" for i, axis in enumerate("xyz"))
        return (
            f"Points({len(self):,} points; {where} mm; "
            f"pretravel {extent(self.pretravel / MICROMETRE)} µm; "
            f"u {extent(self.standard_uncertainty / MICROMETRE, 2)} µm)"
        )

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, rows: npt.ArrayLike) -> Points:
        """Some of the points: by numbers of rows, or by a mask.

        >>> points = Points.plain(np.eye(3), ("a", "b", "c"))
        >>> points[points.positions[:, 0] < 0.5].labels, points[[]].labels
        (('b', 'c'), ())
        """
        chosen = np.atleast_1d(np.asarray(rows))
        index = np.arange(len(self))[chosen if chosen.size else np.zeros(0, dtype=np.int64)]
        shared, plain = self.shared, self.uncompensated
        return replace(
            self,
            positions=frozen(self.positions[index]),
            normals=frozen(self.normals[index]),
            pretravel=frozen(self.pretravel[index]),
            covariance=frozen(self.covariance[index]),
            deviation=None if self.deviation is None else frozen(self.deviation[index]),
            labels=tuple(self.labels[row] for row in index.tolist()),
            shared=None if shared is None else {k: frozen(v[index]) for k, v in shared.items()},
            uncompensated=None if plain is None else frozen(plain[index]),
            face=None if self.face is None else self.face[index],
        )

    def placed(self, placement: Placement) -> Points:
        """The points, which are those of a part, in the frame of the machine.

        Parameters
        ----------
        placement : Placement
            Of the part in the machine.
        """
        turn = placement.rotation
        plain = self.uncompensated
        return replace(
            self,
            positions=frozen(placement.points(self.positions)),
            normals=frozen(placement.vectors(self.normals)),
            covariance=frozen(turn @ self.covariance @ turn.T),
            uncompensated=None if plain is None else frozen(placement.points(plain)),
        )

    @classmethod
    def plain(cls, positions: FloatArray, labels: tuple[str, ...]) -> Points:
        """Points of another origin, of which the coordinates alone are known.

        >>> Points.plain(np.eye(3), ("a", "b", "c")).state_uncertainty
        False
        """
        count = len(positions)
        nothing = frozen(np.full(count, np.nan))
        return cls(
            positions=frozen(positions),
            normals=frozen(np.full((count, 3), np.nan)),
            pretravel=nothing,
            covariance=frozen(np.zeros((count, 3, 3))),
            deviation=None,
            labels=labels,
            step=quantisation_step(positions),
        )

    @property
    def state_uncertainty(self) -> bool:
        """Whether any of the points states a normal and an uncertainty."""
        return bool(np.isfinite(self.normals).any() and np.any(self.covariance))

    @property
    def standard_uncertainty(self) -> FloatArray:
        """Standard uncertainty along the normal, (n,). [mm]"""
        variance = np.einsum("ni,nij,nj->n", self.normals, self.covariance, self.normals)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def joined_points(parts: Sequence[Points]) -> Points:
    """The points of several parts, one after the other.

    Parameters
    ----------
    parts : sequence of Points
        All state the same; shared errors are kept where all have the same causes.

    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> one = Points(up, up, np.zeros(1), np.zeros((1, 3, 3)), None, ("a",))
    >>> joined_points([one, one]).labels
    ('a', 'a')
    """
    first = parts[0]

    def together(name: str) -> FloatArray | None:
        values = [getattr(part, name) for part in parts]
        return None if any(v is None for v in values) else frozen(np.concatenate(values))

    faces = [part.face for part in parts if part.face is not None]
    scatters = [part.scatter for part in parts if part.scatter is not None]

    causes = [None if part.shared is None else tuple(part.shared) for part in parts]
    shared = None
    if first.shared is not None and len(set(causes)) == 1:
        shared = {
            cause: frozen(np.concatenate([(part.shared or {})[cause] for part in parts]))
            for cause in first.shared
        }
    return replace(
        first,
        positions=frozen(np.vstack([part.positions for part in parts])),
        normals=frozen(np.vstack([part.normals for part in parts])),
        pretravel=frozen(np.concatenate([part.pretravel for part in parts])),
        covariance=frozen(np.concatenate([part.covariance for part in parts])),
        deviation=together("deviation"),
        labels=tuple(label for part in parts for label in part.labels),
        shared=shared,
        uncompensated=together("uncompensated"),
        face=np.concatenate(faces) if len(faces) == len(parts) else None,
        scatter=reduce(ScatterOnPart.joined, scatters) if scatters else None,
    )
