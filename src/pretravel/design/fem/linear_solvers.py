"""Sparse Cholesky factorisation by the library that is installed, behind one signature."""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable, Mapping
from importlib import metadata
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from pretravel.base import CapacityError, FloatArray, PretravelError

if TYPE_CHECKING:  # a model from the cache does not need it, and loads faster without
    from scipy import sparse

Solve: TypeAlias = Callable[[FloatArray], FloatArray]
"""Right-hand sides (n, k) to solutions (n, k), from one factorisation."""


def factorise(matrix: sparse.csr_matrix, solver: str = "auto") -> Solve:
    """Factorise a symmetric positive definite matrix once, to solve with it often.

    Parameters
    ----------
    matrix : sparse (n, n)
        Its upper triangle.
    solver : str
        ``pardiso`` (pypardiso), ``cholmod`` (cvxopt), ``superlu`` (SciPy), or
        ``auto``: the first of these that is installed.

    Returns
    -------
    callable
        (n, k) to (n, k).

    Raises
    ------
    PretravelError
        An unknown solver, or one that is not installed or does not load; a singular matrix.
    CapacityError
        Not enough memory for the factor.

    >>> import numpy as np
    >>> from scipy import sparse
    >>> matrix = sparse.diags([2.0, 4.0]).tocsr()
    >>> factorise(matrix, "superlu")(np.array([[2.0], [2.0]])).tolist()
    [[1.0], [0.5]]
    """
    check_solver(solver)
    if solver != "auto":
        try:
            return SOLVERS[solver](matrix)
        except (ImportError, OSError) as error:  # not installed, or its libraries do not load
            package = {"cholmod": "cvxopt", "pardiso": "pypardiso"}.get(solver, "scipy")
            line = '"pretravel[fem]"' if solver == "pardiso" else package
            raise PretravelError(
                f"solver '{solver}' needs the package {package}: pip install {line}, or take "
                f"another solver ({error})"
            ) from error
        except MemoryError as error:
            raise _too_large(matrix, solver) from error
    for name, make in SOLVERS.items():
        try:
            return make(matrix)
        except (ImportError, OSError):  # not installed, or its libraries do not load here
            continue
        except MemoryError as error:
            raise _too_large(matrix, name) from error
    raise AssertionError("SciPy is always there")  # pragma: no cover


def check_solver(solver: str) -> None:
    """Check the name of a solver."""
    if solver != "auto" and solver not in SOLVERS:
        raise PretravelError(
            f"solver '{solver}' is not known; there are auto, {', '.join(SOLVERS)}"
        )


def _too_large(matrix: sparse.csr_matrix, solver: str) -> CapacityError:
    return CapacityError(
        f"{solver} has not enough memory to factorise {matrix.shape[0]} unknowns: lower the "
        "refinement, or close other programs"
    )


_WRONG = 1e-3
"""Largest error of a solution that is known, 1 everywhere.

Models that are held have less than 1e-6; Pardiso and SuperLU also "solve" a body that nothing
holds, with errors of 1 and more, because rounding leaves a pivot of 1e-16.
"""


def _held(matrix: sparse.csr_matrix, solve: Solve) -> Solve:
    """The solver, where it finds a rigid motion of the body again from its forces."""
    known = np.ones((matrix.shape[0], 1))
    forces = matrix @ known + matrix.T @ known - matrix.diagonal()[:, None]
    if not np.abs(solve(forces) - known).max() < _WRONG:
        raise PretravelError(_NOT_HELD)
    return solve


_NOT_HELD = (
    "the body can move without a force (its stiffness is singular): a part of it is not joined to "
    "the rest. Check that its solids touch each other"
)


def _cholmod(matrix: sparse.csr_matrix) -> Solve:
    from cvxopt import cholmod, spmatrix
    from cvxopt import matrix as dense

    lower = matrix.T.tocoo()
    entries = spmatrix(lower.data, lower.row, lower.col, lower.shape)
    factor = cholmod.symbolic(entries)
    try:
        cholmod.numeric(entries, factor)
    except ArithmeticError as error:  # a pivot that is not positive
        raise PretravelError(_NOT_HELD) from error

    def solve(right: FloatArray) -> FloatArray:
        solution = dense(np.asfortranarray(right, dtype=np.float64))
        cholmod.solve(factor, solution)
        return np.array(solution).reshape(right.shape)

    return _held(matrix, solve)


_MKL = "PYPARDISO_MKL_RT"
"""Environment variable of pypardiso: where MKL is."""


def _name_mkl() -> None:
    """Tell pypardiso where MKL is: it searches the whole environment twice, for seconds."""
    if _MKL in os.environ:
        return
    try:
        installed = metadata.files("mkl") or ()
    except metadata.PackageNotFoundError:
        return
    for file in installed:
        if "mkl_rt" in file.name and (path := file.locate()).is_file():  # type: ignore[attr-defined]
            os.environ[_MKL] = str(path)
            return


def _pardiso(matrix: sparse.csr_matrix) -> Solve:
    _name_mkl()
    from pypardiso import PyPardisoSolver

    solver: Any = PyPardisoSolver(mtype=2)  # real, symmetric positive definite: upper triangle
    upper = matrix.tocsr()
    upper.sort_indices()
    try:
        solver.factorize(upper)
    except Exception as error:
        if "-2" in str(error):  # Pardiso's code for lack of memory
            raise MemoryError from error
        raise

    def solve(right: FloatArray) -> FloatArray:
        by_columns = np.asfortranarray(right, dtype=np.float64)
        return np.asarray(solver.solve(upper, by_columns)).reshape(right.shape)

    # Pardiso keeps its factor, a gigabyte, until it is freed explicitly.
    weakref.finalize(solve, solver.free_memory, everything=True)
    return _held(upper, solve)


def _superlu(matrix: sparse.csr_matrix) -> Solve:
    from scipy import sparse
    from scipy.sparse.linalg import splu

    whole = matrix + sparse.triu(matrix, 1).T
    try:
        factor = splu(
            whole.tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:  # a pivot that is exactly zero
        raise PretravelError(_NOT_HELD) from error

    def solve(right: FloatArray) -> FloatArray:
        return np.asarray(factor.solve(np.asarray(right, dtype=np.float64)))

    return _held(matrix, solve)


SOLVERS: Mapping[str, Callable[[sparse.csr_matrix], Solve]] = {
    "pardiso": _pardiso,
    "cholmod": _cholmod,
    "superlu": _superlu,
}
"""In the order of preference."""
