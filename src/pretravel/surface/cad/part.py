"""A part: its faces, and points all over it by which nearby faces are found."""

from __future__ import annotations

import logging
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from pretravel.base import FloatArray, IntArray, PretravelError
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.face_boxes import FaceBoxes
from pretravel.surface.cad.face_numbers import FaceNumbers
from pretravel.surface.cad.part_cache import keep_points, kept_points
from pretravel.surface.cad.triangles import face_triangles

_logger = logging.getLogger("pretravel")

_MOST_POINTS = 2_000_000
"""Approximate largest number of points on all faces."""
_FEW = 3
"""Faces for each point that are taken by their boxes alone."""
_TOGETHER = 2_000
"""Points whose nearby samples are looked for together."""
_NEAR_EDGE = 1.5
"""Distance of a point near an edge from the samples, as a multiple of their distance: one step to
the edge, and half a step along it."""

_INSTANCE = re.compile(r" \(\d+\)(?=/|$)")
"""What `whole_shape` adds to the second and later ones of parts with one name."""
_MOST_DIGITS = 18
"""A longer number is that of no face; Python reads none of more than 4300."""


@dataclass(frozen=True, eq=False)
class Part:
    """The faces of a part.

    Attributes
    ----------
    name : str
        Of the file.
    faces : tuple of Face
    chosen : tuple of int
        Indices of the faces to touch; all other faces are obstacles.
    unreadable : mapping of int to str
        Numbers of the faces that cannot be used, and the reasons.
    key : str
        Name of the entry in the cache in which the points on its faces are kept; empty: in none.
    """

    name: str
    faces: tuple[Face, ...]
    chosen: tuple[int, ...]
    unreadable: dict[int, str] = field(default_factory=dict)
    key: str = ""

    def select(self, word: str) -> Part:
        """The part with only some faces to touch.

        Parameters
        ----------
        word : str
            The number of a face; the name of faces; the name of a part or of an assembly in the
            file, or a piece of its path (``pump/lid``), which chooses each part of this name.

        Raises
        ------
        PretravelError
            No such face, or one that cannot be used.
        """
        numbers = [face.number for face in self.faces]
        if word.isdecimal():
            number = int(word[:_MOST_DIGITS])
            if number in self.unreadable:
                raise PretravelError(
                    f"{self.name}: face {number} cannot be used: {self.unreadable[number]}"
                )
            if number not in numbers:
                raise PretravelError(
                    f"{self.name} has no face {number}; it has {len(numbers)}, counted from 1 "
                    f"(pretravel faces {self.name} lists them)"
                )
            return replace(self, chosen=(numbers.index(number),))
        found = [i for i, face in enumerate(self.faces) if face.name and face.name == word]
        if not found and word:
            found = [i for i, face in enumerate(self.faces) if _is_in(word, face.part)]
        if not found:
            several = any(face.part for face in self.faces)
            raise PretravelError(
                f"{self.name} has no face{' or part' if several else ''} named '{word}' "
                f"(pretravel faces {self.name} lists them)"
            )
        return replace(self, chosen=tuple(found))

    @cached_property
    def numbers(self) -> FaceNumbers:
        """What lists of its faces say of each."""
        found = self._kept_numbers or FaceNumbers.of(self.faces, self.key)
        for face, middle in zip(self.faces, found.middle, strict=True):
            face.__dict__.setdefault("middle", middle)  # it takes the longest
        return found

    @cached_property
    def _kept_numbers(self) -> FaceNumbers | None:
        return FaceNumbers.kept(self.key, len(self.faces))

    @cached_property
    def box(self) -> FloatArray:
        """Smallest and largest coordinates, (2, 3). [mm]"""
        if self._kept_numbers is not None:
            points = self._kept_numbers.box.reshape(-1, 3)
        else:
            points = np.concatenate([face.coarse.points for face in self.faces])
        return np.stack([np.nanmin(points, axis=0), np.nanmax(points, axis=0)])

    @cached_property
    def size(self) -> float:
        """Diagonal of its bounding box. [mm]"""
        return float(np.linalg.norm(self.box[1] - self.box[0]))

    @cached_property
    def cloud(self) -> Cloud:
        """Sample points on all faces, from which nearby faces are determined."""
        return self.cloud_of_spacing(math.inf)

    def cloud_of_spacing(self, spacing: float) -> Cloud:
        """Points on all faces with a given spacing.

        Parameters
        ----------
        spacing : float
            Wanted distance between neighbours. It is reduced to 1/150 of the size of the part, and
            increased where there would be too many points. [mm]
        """
        a, b, c = np.maximum(self.box[1] - self.box[0], 1e-6)
        finest = math.sqrt(2.0 * (a * b + b * c + c * a) / _MOST_POINTS)
        wanted = max(min(spacing, self.size / 150.0), finest, 1e-3)
        # Rounded to steps, so that tips of nearly the same size share one cloud.
        wanted = float(2.0 ** (math.floor(2.0 * math.log2(wanted)) / 2.0))
        key = f"_cloud_{wanted:.6g}"
        if key not in self.__dict__:
            self.__dict__[key] = Cloud.of(self.faces, wanted, self.key)
        cloud: Cloud = self.__dict__[key]
        return cloud

    @cached_property
    def triangles(self) -> FloatArray:
        """Corners of triangles that show all faces, (t, 3, 3). [mm]"""
        shown = [face_triangles(face, faces=len(self.faces)) for face in self.faces]
        return np.concatenate([each.points[each.corners] for each in shown])

    @cached_property
    def boxes(self) -> FaceBoxes:
        """Boxes around all faces."""
        return FaceBoxes.around(self.faces, range(len(self.faces)))

    @cached_property
    def boxes_of_chosen(self) -> FaceBoxes:
        """Boxes around the faces to touch."""
        return FaceBoxes.around(self.faces, self.chosen)

    def near(
        self, points: FloatArray, reach: FloatArray, cloud: Cloud, boxes: FaceBoxes
    ) -> tuple[IntArray, IntArray]:
        """Pairs of a point and a face that can be as near as its reach: rows and indices of faces.

        Parameters
        ----------
        points : (n, 3) float
            [mm]
        reach : (n,) float
            [mm]
        cloud, boxes : Cloud and FaceBoxes
            Of the faces that count.

        Returns
        -------
        rows, faces : (m,) int
            Ordered by rows.
        """
        rows, faces = boxes.within(points, reach)
        if len(rows) <= _FEW * len(points):
            return rows, faces
        count = len(self.faces)
        row, face = cloud.within(points, reach)
        both = np.intersect1d(rows * count + faces, row * count + face, assume_unique=True)
        return both // count, both % count

    @cached_property
    def cloud_of_chosen(self) -> Cloud:
        """Points on the faces to touch."""
        if len(self.chosen) == len(self.faces):
            return self.cloud
        return self.cloud.on(self.chosen)


def _is_in(word: str, path: str) -> bool:
    """Whether a word is a piece of the path of a part, with or without the numbers of instances.

    >>> _is_in("pin", "pump/pin (2)"), _is_in("pump/pin (2)", "pump/pin (2)"), _is_in("p", "p1")
    (True, True, False)
    """
    return any(f"/{word}/" in f"/{p}/" for p in (path, _INSTANCE.sub("", path)))


@dataclass(frozen=True, eq=False)
class Cloud:
    """Sample points on several faces, from which the face nearest to a point is determined.

    Attributes
    ----------
    points : (m, 3) float
        [mm]
    face : (m,) int
        Index of the face of each point.
    uv : (m, 2) float
    gaps : (k,) float
        Distance between neighbours on each face. [mm]
    bends : (k,) float
        Largest convex curvature of each face. [1/mm]
    tree : KD-tree of the points
    """

    points: FloatArray
    face: IntArray
    uv: FloatArray
    gaps: FloatArray
    bends: FloatArray
    tree: Any

    def on(self, faces: Sequence[int]) -> Cloud:
        """The points of some faces."""
        from scipy.spatial import cKDTree

        mine = np.isin(self.face, faces)
        points = self.points[mine]
        bends = self.bends
        return Cloud(points, self.face[mine], self.uv[mine], self.gaps, bends, cKDTree(points))

    def slacks(self, reach: float) -> FloatArray:
        """How far the samples of each face miss it, for points up to reach away from it, (k,).

        A point at the distance d from a face has a sample of it within the root of d² plus the
        square of this. [mm]
        """
        return np.asarray(
            self.gaps * np.sqrt(1.0 + reach * np.minimum(self.bends, 4.0 / max(reach, 1e-9)))
        )

    def within(self, points: FloatArray, reach: FloatArray) -> tuple[IntArray, IntArray]:
        """Pairs of a point and a face that can be as near as its reach.

        Boxes around faces tell little where faces are long and curved; samples do.

        Parameters
        ----------
        points : (n, 3) float
            [mm]
        reach : (n,) float
            [mm]

        Returns
        -------
        rows, faces : (m,) int
            Ordered by rows.
        """
        count = len(self.gaps)
        found = [np.empty(0, dtype=np.int64)]
        for begin in range(0, len(points), _TOGETHER):
            some, far = points[begin : begin + _TOGETHER], reach[begin : begin + _TOGETHER]
            # Near an edge the neighbours of a point can lie off the face.
            slacks = _NEAR_EDGE * self.slacks(float(far.max()))
            widest = np.sqrt(far**2 + slacks.max() ** 2)
            near = self.tree.query_ball_point(some, widest, workers=-1)
            owner = np.repeat(np.arange(len(some)), [len(one) for one in near])
            samples = np.concatenate([np.asarray(one, dtype=np.int64) for one in near])
            face = self.face[samples]
            squared = np.sum((self.points[samples] - some[owner]) ** 2, axis=1)
            close = squared <= far[owner] ** 2 + slacks[face] ** 2
            found.append(np.unique((begin + owner[close]) * count + face[close]))
        pairs = np.concatenate(found)
        return pairs // count, pairs % count

    @classmethod
    def of(cls, faces: Sequence[Face], spacing: float, key: str = "") -> Cloud:
        """Sample faces with a largest distance between neighbours [mm], or take kept samples."""
        from scipy.spatial import cKDTree

        kept = kept_points(key, spacing) if key else None
        if kept is not None and len(kept["gaps"]) == len(faces):
            return cls(**kept, tree=cKDTree(kept["points"]))
        _logger.info("sampling %d faces", len(faces))
        sampled = [face.sampled(spacing) for face in faces]
        uv = [own for own, _ in sampled]
        points = [face.derivatives(own)[0] for face, own in zip(faces, uv, strict=True)]
        index = np.repeat(np.arange(len(faces)), [len(own) for own in uv])
        cloud, parameters = np.concatenate(points), np.concatenate(uv)
        usable = np.isfinite(cloud).all(axis=1)
        cloud, index, parameters = cloud[usable], index[usable], parameters[usable]
        gaps = np.array([max(gap, spacing) for _, gap in sampled])
        bends = np.array([face.largest_convex_curvature for face in faces])
        if key:
            keep_points(
                key, spacing, points=cloud, face=index, uv=parameters, gaps=gaps, bends=bends
            )
        return cls(cloud, index, parameters, gaps, bends, cKDTree(cloud))
