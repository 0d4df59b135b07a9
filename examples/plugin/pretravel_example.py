"""A file format and a kind of map that are not in pretravel; pyproject.toml lists both.

The format is a log of three columns below a header that states the unit. The kind has one radius
for each of three belts around the axis of the probe.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from pretravel import KindOfMap
from pretravel.base.arrays import FloatArray
from pretravel.base.directions import polar_angle
from pretravel.base.units import DEGREE
from pretravel.files.file_format import FileFormat, FilePositions, ReadingOptions
from pretravel.files.source_file import SourceFile
from pretravel.maps.basis import MapBasis, StoredArray, StoredBasis
from pretravel.maps.kind import MapFit
from pretravel.maps.kinds.mean import averaged
from pretravel.maps.observation import Observation, Scatter

_HEADER = "TOUCHLOG"


def read_touchlog(file: SourceFile, options: ReadingOptions) -> FilePositions:
    r"""Read the positions of a log: the header ``TOUCHLOG mm``, then x y z in each line.

    Parameters
    ----------
    file : SourceFile
    options : ReadingOptions
        None is used: the file states its unit, and positions are joined with the plan later.

    Returns
    -------
    FilePositions

    Raises
    ------
    InputError
        Another header, a line without three numbers, no line of numbers.

    >>> log = SourceFile("day.log", b"TOUCHLOG inch\n1 2 3\n")
    >>> read_touchlog(log, ReadingOptions()).positions.round(6).tolist()
    [[25.4, 50.8, 76.2]]
    """
    del options
    lines = [
        (number, line.split())
        for number, line in enumerate(file.lines("a touch log"), start=1)
        if line.strip()
    ]
    (first, header), rows = lines[0], lines[1:]
    if header[0] != _HEADER or len(header) != 2:
        raise file.error(f"a touch log begins with {_HEADER} and its unit", first)
    scale = file.scale(header[1], "the header of a touch log states its unit")
    for number, cells in rows:
        if len(cells) != 3:
            raise file.error(f"{len(cells)} values where a touch log has x, y and z", number)
    if not rows:
        raise file.error("the touch log contains no positions")
    positions = np.array([file.numbers(cells, number) for number, cells in rows])
    return FilePositions(file.path, scale * positions, tuple(number for number, _ in rows))


TOUCHLOG = FileFormat(
    name="touchlog",
    what="log of the example package: TOUCHLOG mm, then x y z",
    reads="positions",
    needs="plan",
    verified="files written by hand",
    endings=(".touchlog",),
    recognises=lambda lines: lines[0].split()[0] == _HEADER,
    parse=read_touchlog,
)


@dataclass(frozen=True)
class BeltBasis(MapBasis):
    """One number for each belt of polar angles.

    Attributes
    ----------
    limits : tuple of float
        Polar angles between the belts, ascending. [rad]

    >>> BeltBasis().design(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])).tolist()
    [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """

    kind: ClassVar[str] = "belt"
    follows_probe: ClassVar[bool] = False

    limits: tuple[float, ...] = (35.0 * DEGREE, 65.0 * DEGREE)

    @property
    def size(self) -> int:
        return len(self.limits) + 1

    @property
    def constant(self) -> FloatArray:
        return np.ones(self.size)

    def design(self, directions: FloatArray) -> FloatArray:
        return np.eye(self.size)[np.searchsorted(self.limits, polar_angle(directions))]

    def arrays(self) -> Mapping[str, StoredArray]:
        return {"belt_limits": StoredArray(("limit",), np.array(self.limits), "rad")}

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        return cls(tuple(float(limit) for limit in stored.arrays["belt_limits"].values))


@dataclass(frozen=True)
class BeltKind(KindOfMap):
    """The mean over the touches of each belt, about the least-squares centre.

    A belt without touches, as those of a ring beside its own, has the mean of all; a map is only
    used near the directions that were touched.
    """

    name: ClassVar[str] = "belt"
    title: ClassVar[str] = "polar belts"
    bases: ClassVar[tuple[type[MapBasis], ...]] = (BeltBasis,)

    def fit(self, observation: Observation, repeats: Scatter) -> MapFit:
        del repeats
        basis = BeltBasis()
        share = basis.design(observation.directions)
        count = share.sum(axis=0)

        def belts(pretravel: FloatArray, mean: float) -> FloatArray:
            return np.where(count > 0, share.T @ pretravel / np.maximum(count, 1.0), mean)

        return averaged(observation, basis, belts)

    def refit(self, fit: MapFit, observation: Observation) -> MapFit:
        del fit
        return self.fit(observation, Scatter(0.0, 0.0))
