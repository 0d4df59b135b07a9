"""The symmetry of an ideal tripod: rotations by 120° and mirrors, and its representations.

A body with this symmetry is known from one sixth of it, between two mirror planes. Its
displacements under any load are a sum of parts that belong to the irreducible representations
of the group (C3v), and each part is an elasticity problem of the sixth alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import BoolArray, FloatArray, frozen
from pretravel.design.fem.interface_loads import INTERFACE, SPRING_FORCE, TIP_FORCE
from pretravel.prediction import Probe
from pretravel.six_seats import SeatFrame, seat_frame

COPIES = 6
"""Number of motions of the group, and of sixths of which the body consists."""
_SAME = 1e-6
"""Largest distance of a node from a mirror plane on which it lies. [mm]"""
_EVEN = 1e-9
"""Largest difference of seats that count as images of each other, relative to the radius."""


@dataclass(frozen=True, eq=False)
class ThreefoldSymmetry:
    """The motions that leave a tripod unchanged, and what they do to forces on it.

    Attributes
    ----------
    motions : (6, 3, 3) float
        The identity, two rotations by 120° about z, and three mirrors.
    interface : (6, 22, 22) float
        Forces on the entries of `INTERFACE` after each motion, from those before.
    """

    motions: FloatArray
    interface: FloatArray

    @property
    def rigid(self) -> FloatArray:
        """Three translations and three rotations after each motion, from before, (6, 6, 6)."""
        made = np.zeros((COPIES, 6, 6))
        made[:, :3, :3] = self.motions
        made[:, 3:, 3:] = np.linalg.det(self.motions)[:, None, None] * self.motions
        return made

    @property
    def representations(self) -> tuple[FloatArray, ...]:
        """The three irreducible representations, (6, d, d) each, with d of 1, 1 and 2."""
        sense = np.linalg.det(self.motions)[:, None, None]
        return np.ones((COPIES, 1, 1)), sense, self.motions[:, :2, :2]

    def fixing(self, points: FloatArray) -> BoolArray:
        """Motions that leave each point where it is, (6, n)."""
        moved = np.einsum("gij,nj->gni", self.motions, points)
        return np.asarray(np.linalg.norm(moved - points, axis=2) < _SAME)


def threefold_symmetry(probe: Probe) -> ThreefoldSymmetry | None:
    """The symmetry of a described probe; None for solids of a STEP file and uneven rods.

    >>> from dataclasses import replace
    >>> from pretravel.prediction.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> threefold_symmetry(probe).motions.shape
    (6, 3, 3)
    >>> uneven = replace(probe.tripod, rod_azimuths=(0.0, 2.0, 4.0))
    >>> threefold_symmetry(replace(probe, tripod=uneven)) is None
    True
    """
    if probe.step is not None:
        return None
    motions = _motions(probe.tripod.rod_azimuths[0])
    frame = seat_frame(probe)
    interface = np.zeros((COPIES, len(INTERFACE), len(INTERFACE)))
    for motion, action in zip(motions, interface, strict=True):
        images = _images(motion, frame)
        if images is None:
            return None
        for seat, image in enumerate(images):
            action[image, seat] = 1.0
            action[10 + 2 * image, 10 + 2 * seat] = 1.0
            action[11 + 2 * image, 11 + 2 * seat] = np.linalg.det(motion)
        action[TIP_FORCE, TIP_FORCE] = motion
        action[SPRING_FORCE, SPRING_FORCE] = 1.0
    return ThreefoldSymmetry(frozen(motions), frozen(interface))


def _motions(azimuth: float) -> FloatArray:
    """Three rotations, and each after the mirror whose plane contains z and the azimuth."""
    half = 0.5 * math.sqrt(3.0)
    turn = np.array([[-0.5, -half, 0.0], [half, -0.5, 0.0], [0.0, 0.0, 1.0]])
    cosine, sine = math.cos(2.0 * azimuth), math.sin(2.0 * azimuth)
    mirror = np.array([[cosine, sine, 0.0], [sine, -cosine, 0.0], [0.0, 0.0, 1.0]])
    rotations = [np.eye(3), turn, turn.T]
    return np.array([*rotations, *(rotation @ mirror for rotation in rotations)])


def _images(motion: FloatArray, frame: SeatFrame) -> list[int] | None:
    """The seat that each seat becomes."""
    found = []
    for point, normal in zip(frame.points @ motion.T, frame.normals @ motion.T, strict=True):
        away = np.linalg.norm(frame.points - point, axis=1) / np.linalg.norm(point)
        away += np.linalg.norm(frame.normals - normal, axis=1)
        if away.min() > _EVEN:
            return None
        found.append(int(np.argmin(away)))
    return found


def adapted(action: FloatArray, representation: FloatArray) -> FloatArray:
    """Tuples of vectors that a group's action transforms as a representation does.

    Parameters
    ----------
    action : (6, n, n) float
        Orthogonal matrices.
    representation : (6, d, d) float
        Irreducible, orthogonal.

    Returns
    -------
    (n, d, m) float
        m tuples of d vectors; orthonormal, also to those of other representations.

    References
    ----------
    The projection operators of group theory, from any textbook of it.

    >>> symmetry = ThreefoldSymmetry(_motions(0.0), np.zeros((6, 22, 22)))
    >>> [adapted(symmetry.motions, matrices).shape[2] for matrices in symmetry.representations]
    [1, 0, 1]
    """
    share = representation.shape[1] / COPIES
    projector = share * np.einsum("g,gab->ab", representation[:, 0, 0], action)
    left, sizes, _ = np.linalg.svd(projector)
    first = left[:, sizes > 0.5]
    return np.asarray(share * np.einsum("gj,gab,bm->ajm", representation[:, :, 0], action, first))
