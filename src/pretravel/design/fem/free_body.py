"""Solution of a body that nothing holds: balanced loads, no mean rigid motion."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.base import CapacityError, FloatArray
from pretravel.design.fem.linear_solvers import Solve, factorise

if TYPE_CHECKING:  # a model from the cache does not need it, and loads faster without
    from scipy import sparse

log = logging.getLogger(__name__)

_BYTES_PER_UNKNOWN = 18e3
"""Memory per unknown of assembly and factor, measured; it grows slowly with the mesh. [B]"""


def free_solve(
    stiffness: sparse.csr_matrix,
    motions: FloatArray,
    weights: FloatArray,
    solver: str = "auto",
    *,
    done: float = 0.6,
) -> Solve:
    """Factorise the stiffness of a free body once; loads (n, k) to displacements (n, k).

    Loads are balanced by a body force, displacements have no mean rigid motion.

    Parameters
    ----------
    stiffness : sparse (n, n)
        Its upper triangle; singular for the rigid motions. [N/mm]
    motions : (n, r) float
        The rigid motions that the displacements can represent.
    weights : (n,) float
        Of each displacement in the mean; positive.
    solver : str
        See `pretravel.design.fem.linear_solvers.factorise`.
    done : float
        Part of the whole work that is done before, for the display of progress.

    Raises
    ------
    CapacityError
        Not enough memory.
    """
    count = len(weights)
    _check_memory(count)
    weighted = weights[:, None] * motions
    inertia = motions.T @ weighted
    free = np.setdiff1d(np.arange(count), _held(motions))
    log.info("factorising %d unknowns", count, extra={"done": done})
    solve = factorise(stiffness[free][:, free].tocsr(), solver)

    def displacements(loads: FloatArray) -> FloatArray:
        balanced = loads - weighted @ np.linalg.solve(inertia, motions.T @ loads)
        modes = np.zeros_like(balanced)
        modes[free] = solve(balanced[free])
        return np.asarray(modes - motions @ np.linalg.solve(inertia, weighted.T @ modes))

    return displacements


def _held(motions: FloatArray) -> npt.NDArray[np.int64]:
    """As many displacements as there are rigid motions, which hold the body.

    Pivoting takes the ones that prevent the motions best: far from each other.
    """
    from scipy.linalg import qr

    scaled = motions / np.linalg.norm(motions, axis=0)
    _, _, order = qr(scaled.T, mode="economic", pivoting=True)
    return np.asarray(np.sort(order[: motions.shape[1]]), dtype=np.int64)


def _check_memory(unknowns: int) -> None:
    needed, available = _BYTES_PER_UNKNOWN * unknowns, available_memory()
    if available is not None and needed > available:
        raise CapacityError(
            f"{unknowns} unknowns need about {needed / 1e9:.1f} GB to factorise, and "
            f"{available / 1e9:.1f} GB are free: lower the refinement (half of it needs about a "
            "tenth), or close other programs"
        )


def available_memory() -> float | None:
    """Free memory in bytes; None on systems that do not report it."""
    try:
        with Path("/proc/meminfo").open(encoding="ascii") as lines:
            for line in lines:
                if line.startswith("MemAvailable:"):
                    return 1024.0 * float(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    return None
