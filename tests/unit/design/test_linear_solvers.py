"""The choice of a solver, and what is said when it is missing or has too little memory."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from pretravel.base.errors import CapacityError, PretravelError
from pretravel.design.fem import linear_solvers
from pretravel.design.fem.linear_solvers import check_solver, factorise

UPPER = sparse.csr_matrix(np.array([[4.0, 1.0, 0.0], [0.0, 5.0, -2.0], [0.0, 0.0, 6.0]]))
WHOLE = UPPER.toarray() + np.triu(UPPER.toarray(), 1).T


def raising(error: BaseException) -> Callable[[Any], Any]:
    def make(_: Any) -> Any:
        raise error

    return make


def with_solvers(patch: pytest.MonkeyPatch, **solvers: Callable[[Any], Any]) -> None:
    patch.setattr(linear_solvers, "SOLVERS", solvers)


def test_the_first_solver_that_works_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of those in the order of preference, without those that are missing or do not load."""
    with_solvers(
        monkeypatch, a=raising(ImportError()), b=raising(OSError()),
        c=lambda _: "third", d=lambda _: "fourth",
    )  # fmt: skip
    assert factorise(UPPER) == "third"
    assert factorise(UPPER, "d") == "fourth"


@pytest.mark.parametrize("asked", ["auto", "b"])
def test_want_of_memory_names_the_solver_and_the_unknowns(
    monkeypatch: pytest.MonkeyPatch, asked: str
) -> None:
    with_solvers(
        monkeypatch, a=raising(ImportError()), b=raising(MemoryError()), c=lambda _: "third"
    )
    with pytest.raises(CapacityError, match="b has not enough memory to factorise 3 unknowns"):
        factorise(UPPER, asked)


@pytest.mark.parametrize(
    ("solver", "package"),
    [("pardiso", "pypardiso"), ("cholmod", "cvxopt"), ("superlu", "scipy")],
)
@pytest.mark.parametrize("error", [ImportError("no module"), OSError("no library")])
def test_a_missing_solver_names_its_package(
    monkeypatch: pytest.MonkeyPatch, solver: str, package: str, error: Exception
) -> None:
    with_solvers(monkeypatch, **{solver: raising(error)})
    with pytest.raises(PretravelError, match=f"'{solver}' needs the package {package}: .*{error}"):
        factorise(UPPER, solver)


@pytest.mark.parametrize("solver", ["auto", "pardiso", "cholmod", "superlu"])
def test_solvers_have_names(solver: str) -> None:
    check_solver(solver)
    with pytest.raises(PretravelError, match="'mumps' is not known; there are auto, pardiso, chol"):
        factorise(UPPER, "mumps")


RIGHT = np.array([[1.0, -2.0], [0.5, 3.0], [0.0, 7.0]])


@pytest.mark.parametrize("solver", ["auto", "cholmod", "superlu"])
@pytest.mark.parametrize("right", [RIGHT, RIGHT[:, :1], RIGHT.astype(int), RIGHT[:, ::-1]])
def test_solutions_are_those_of_the_whole_matrix(solver: str, right: np.ndarray) -> None:
    if solver == "cholmod":
        pytest.importorskip("cvxopt")
    found = factorise(UPPER, solver)(right)
    assert found.shape == right.shape
    assert WHOLE @ found == pytest.approx(right, abs=1e-12)


def _springs(count: int, rng: np.random.Generator) -> sparse.csr_matrix:
    """The stiffness of a chain of springs that nothing holds, its upper triangle."""
    stiffness = rng.uniform(1.0, 2.0, count - 1)
    diagonal = np.append(stiffness, 0.0) + np.append(0.0, stiffness)
    return sparse.diags([diagonal, -stiffness], [0, 1]).tocsr()


@pytest.mark.parametrize("solver", ["pardiso", "cholmod", "superlu"])
def test_a_body_that_nothing_holds_is_refused(solver: str) -> None:
    """Both libraries find a solution, of 1e14, since rounding leaves a pivot (Pardiso 2026)."""
    pytest.importorskip({"pardiso": "pypardiso", "cholmod": "cvxopt"}.get(solver, "scipy"))
    rng = np.random.default_rng(0)
    free = _springs(200, rng)
    held = free + sparse.csr_matrix(([1.0], ([0], [0])), shape=free.shape)
    factorise(held, solver)
    for loose in (free, sparse.csr_matrix(sparse.block_diag([held, free]))):
        with pytest.raises(PretravelError, match="can move without a force"):
            factorise(loose, solver)


def test_a_pivot_of_zero_is_refused() -> None:
    with pytest.raises(PretravelError, match="can move without a force"):
        factorise(sparse.csr_matrix(np.triu([[1.0, -1.0], [-1.0, 1.0]])), "superlu")


class Pardiso:
    """Stands for pypardiso's solver: reads the upper triangle, and counts what is freed."""

    error: Exception | None = None
    freed = 0

    def __init__(self, mtype: int) -> None:
        assert mtype == 2  # real, symmetric, positive definite

    def factorize(self, upper: Any) -> None:
        if self.error is not None:
            raise self.error
        assert upper.has_sorted_indices

    def solve(self, upper: Any, right: np.ndarray) -> np.ndarray:
        assert right.flags.f_contiguous
        whole = upper.toarray() + np.triu(upper.toarray(), 1).T
        return np.linalg.solve(whole, right).ravel() if right.shape[1] == 1 else np.linalg.solve(
            whole, right
        )  # fmt: skip

    def free_memory(self, everything: bool) -> None:
        assert everything
        Pardiso.freed += 1


@pytest.fixture
def pardiso(monkeypatch: pytest.MonkeyPatch) -> type[Pardiso]:
    monkeypatch.setitem(sys.modules, "pypardiso", SimpleNamespace(PyPardisoSolver=Pardiso))
    monkeypatch.setenv(linear_solvers._MKL, "stated")
    monkeypatch.setattr(Pardiso, "error", None)
    monkeypatch.setattr(Pardiso, "freed", 0)
    return Pardiso


def test_pardiso_frees_its_factor(pardiso: type[Pardiso]) -> None:
    solve = factorise(UPPER, "pardiso")
    for right in (RIGHT, RIGHT[:, :1]):
        found = solve(right)
        assert found.shape == right.shape
        assert WHOLE @ found == pytest.approx(right, abs=1e-12)
    assert pardiso.freed == 0
    del solve
    gc.collect()
    assert pardiso.freed == 1


def test_pardisos_code_of_memory_is_understood(
    pardiso: type[Pardiso], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pardiso, "error", RuntimeError("The Pardiso solver failed: code -2"))
    with pytest.raises(CapacityError, match="pardiso has not enough memory"):
        factorise(UPPER, "pardiso")
    monkeypatch.setattr(pardiso, "error", RuntimeError("code -4: zero pivot"))
    with pytest.raises(RuntimeError, match="zero pivot"):
        factorise(UPPER, "pardiso")


def test_the_library_of_mkl_is_the_installed_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The first file with its name that is there; what the user states is kept."""
    library = tmp_path / "libmkl_rt.so.2"
    library.touch()
    (tmp_path / "other.txt").touch()
    (tmp_path / "libmkl_rt.so.3").touch()
    names = ["other.txt", "gone/libmkl_rt.so.1", "libmkl_rt.so.2", "libmkl_rt.so.3"]
    files = [SimpleNamespace(name=Path(n).name, locate=lambda n=n: tmp_path / n) for n in names]
    monkeypatch.setattr(metadata, "files", lambda _: files)
    monkeypatch.delenv(linear_solvers._MKL, raising=False)
    linear_solvers._name_mkl()
    assert os.environ[linear_solvers._MKL] == str(library)
    monkeypatch.setenv(linear_solvers._MKL, "stated")
    linear_solvers._name_mkl()
    assert os.environ[linear_solvers._MKL] == "stated"


def test_without_mkl_nothing_is_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: str) -> None:
        raise metadata.PackageNotFoundError

    monkeypatch.delenv(linear_solvers._MKL, raising=False)
    for files in (missing, lambda _: None):
        monkeypatch.setattr(metadata, "files", files)
        linear_solvers._name_mkl()
        assert linear_solvers._MKL not in os.environ
