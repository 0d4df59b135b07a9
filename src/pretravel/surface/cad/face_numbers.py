"""What lists of faces say of each face, computed once for a file."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pretravel.base import FloatArray
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part_cache import keep_numbers, kept_numbers

_EVERY = {"cylinder": 100, "sphere": 100, "cone": 5, "torus": 5}
"""Of these kinds a few samples, at least some in each row along v, have all curvatures."""
_PROGRESS = 50
"""Number of faces after which progress is reported."""
_logger = logging.getLogger("pretravel")


class FaceNumbers(NamedTuple):
    """Numbers of each of n faces."""

    middle: FloatArray
    """Parameters of the point far from its edges, (n, 2)."""
    point: FloatArray
    """This point, (n, 3). [mm]"""
    normal: FloatArray
    """There, (n, 3)."""
    box: FloatArray
    """Smallest and largest coordinates, (n, 2, 3). [mm]"""
    mean: FloatArray
    """Of points spread over it, (n, 3). [mm]"""
    bend: FloatArray
    """Largest curvature, zero where it is flat, (n,). [1/mm]"""

    @classmethod
    def kept(cls, key: str, count: int) -> FaceNumbers | None:
        """Of a part that was listed before."""
        shapes = {"middle": (2,), "point": (3,), "normal": (3,), "box": (2, 3), "mean": (3,)}
        found = kept_numbers(key, {**shapes, "bend": ()}, count) if key else None
        return None if found is None else cls(**found)

    @classmethod
    def of(cls, faces: Sequence[Face], key: str = "") -> FaceNumbers:
        """Computed, and kept where the part has a key."""
        found = cls(*(np.array(each) for each in zip(*_each(faces), strict=True)))
        if key:
            keep_numbers(key, **found._asdict())
        return found


def _each(faces: Sequence[Face]) -> list[tuple[FloatArray, ...]]:
    found: list[tuple[FloatArray, ...]] = []
    for count, face in enumerate(faces, start=1):
        if count % _PROGRESS == 0:
            _logger.info("describing face %d of %d", count, len(faces))
        # The first row is the point in the middle; the others show the curvature.
        flat, coarse = face.kind == "plane", face.coarse
        others = coarse.uv[: 0 if flat else coarse.inner : _EVERY.get(face.kind, 1)]
        local = face.local(np.concatenate([face.middle[None], others]))
        box = np.stack([np.nanmin(coarse.points, axis=0), np.nanmax(coarse.points, axis=0)])
        mean = np.nanmean(coarse.points, axis=0)
        bend = np.zeros(()) if flat else np.nanmax(np.abs(local.principal_curvatures))
        found.append((face.middle, local.point[0], local.normal[0], box, mean, bend))
    return found
