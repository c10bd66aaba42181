"""Sparse direct solution of symmetric positive definite systems with the fastest available solver."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

_LOCK = threading.Lock()


@dataclass(frozen=True)
class Solution:
    """Solution of K x = f.

    Parameters
    ----------
    x
        (unknown, right-hand side).
    solver
        "pardiso" (MKL, through pypardiso) or "splu" (SciPy's SuperLU).
    seconds
        Time of factorisation and solution.
    """

    x: NDArray
    solver: str
    seconds: float


class SingularSystemError(RuntimeError):
    """The factorisation failed: the body is not held, or elements are degenerate."""


def available_solver() -> str:
    """Name of the solver that ``solve`` uses by default."""
    return "pardiso" if _pardiso() is not None else "splu"


def solve(upper: sp.csr_matrix, rhs: NDArray, solver: str | None = None) -> Solution:
    """Solve for all right-hand sides (unknown, k) at once; ``upper`` is the upper triangle of K, indices sorted.

    Raises
    ------
    SingularSystemError
        If K is not positive definite.
    """
    solver = solver or available_solver()
    start = time.perf_counter()
    x = {"pardiso": _solve_pardiso, "splu": _solve_splu}[solver](upper, rhs)
    return Solution(x, solver, time.perf_counter() - start)


@cache
def _pardiso() -> Any | None:
    try:
        with _known_mkl():
            import pypardiso
    except (ImportError, OSError):  # not installed, or installed without a usable MKL
        return None
    return pypardiso


@contextmanager
def _known_mkl() -> Iterator[None]:
    """Tell pypardiso where MKL is; otherwise it searches the whole environment, half a second each time."""
    key = "PYPARDISO_MKL_RT"
    try:
        found = [str(file.locate()) for file in files("mkl") or [] if file.name.startswith("libmkl_rt.so")]
    except PackageNotFoundError:
        found = []
    if key in os.environ or not found:
        yield
        return
    os.environ[key] = found[0]
    try:
        yield
    finally:
        del os.environ[key]


@cache
def _library() -> Any:
    """One solver object, because every new one searches the disk for MKL."""
    module = _pardiso()
    assert module is not None
    with _known_mkl():
        library = module.PyPardisoSolver(mtype=2)
    # unlike MKL's defaults: parallel nested dissection, two-level parallel factorisation, no iterative
    # refinement (definite matrices do not need it, and it triples the time of many right-hand sides)
    library.iparm[0] = 1
    for number, value in {2: 3, 10: 8, 24: 1, 25: 1}.items():
        library.iparm[number - 1] = value
    return library


def _solve_pardiso(upper: sp.csr_matrix, rhs: NDArray) -> NDArray:
    module = _pardiso()
    if module is None:
        raise ImportError("pypardiso is not installed, or its MKL library cannot be loaded")
    with _LOCK:
        library = _library()
        library.set_phase(13)
        try:
            x = library._call_pardiso(upper, np.asfortranarray(rhs))
        except module.pardiso_wrapper.PyPardisoError as error:
            raise SingularSystemError(f"MKL Pardiso: {error}") from None
        finally:
            library.set_phase(-1)
            library._call_pardiso(sp.csr_matrix(np.eye(1)), np.zeros((1, 1), order="F"))
    if not np.all(np.isfinite(x)):
        raise SingularSystemError("MKL Pardiso: the stiffness matrix is singular")
    return x


def _solve_splu(upper: sp.csr_matrix, rhs: NDArray) -> NDArray:
    from scipy.sparse.linalg import splu

    full = (upper + sp.triu(upper, 1, format="csr").T).tocsc()
    options = {"SymmetricMode": True}
    try:
        factor = splu(full, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError as error:
        raise SingularSystemError(f"SuperLU: {error}") from None
    if np.any(factor.U.diagonal() <= 0):
        raise SingularSystemError("SuperLU: the stiffness matrix is not positive definite")
    return factor.solve(rhs)


def schur_complement(upper: sp.csr_matrix, load: sp.csr_matrix, kept: NDArray, solver: str | None = None) -> NDArray:
    """Condense [[K, F], [Fᵀ, 0]] to the unknowns ``kept`` and the columns of F: (kept + loads, kept + loads), dense.

    ``upper`` is the upper triangle of K, indices sorted; ``kept`` in any order, that of the result.

    Raises
    ------
    SingularSystemError
        If K without the unknowns kept is not positive definite.
    """
    n, m = len(upper.indptr) - 1, load.get_shape()[1]
    chosen = np.concatenate([kept, np.arange(n, n + m)])
    # Pardiso needs all entries of the diagonal
    corner = sp.diags_array(np.full(m, np.finfo(float).tiny))
    whole = sp.csr_matrix(sp.block_array([[upper, load], [None, corner]], format="csr"))
    whole.sort_indices()
    if (solver or available_solver()) == "pardiso":
        S = _schur_pardiso(whole, chosen)
        number = np.searchsorted(np.sort(chosen), chosen)
        return S[np.ix_(number, number)]
    inner = np.setdiff1d(np.arange(n), kept)
    full = sp.csr_matrix(whole + sp.triu(whole, 1).T)
    coupling = full[inner][:, chosen].toarray()
    inside = sp.csr_matrix(sp.triu(full[inner][:, inner], format="csr"))
    return full[chosen][:, chosen].toarray() - coupling.T @ solve(inside, coupling, "splu").x


def _schur_pardiso(whole: sp.csr_matrix, chosen: NDArray) -> NDArray:
    """Schur complement of the unknowns ``chosen``, in ascending order, without right-hand sides."""
    module = _pardiso()
    if module is None:
        raise ImportError("pypardiso is not installed, or its MKL library cannot be loaded")
    with _LOCK:
        library = _library()
        before, library.perm = library.perm, np.zeros(len(whole.indptr) - 1, dtype=np.int32)
        library.perm[chosen] = 1
        library.iparm[35] = 1
        library.set_phase(12)
        try:
            S = library._call_pardiso(whole, np.zeros((len(chosen), len(chosen)), order="F"))
        except module.pardiso_wrapper.PyPardisoError as error:
            raise SingularSystemError(f"MKL Pardiso: {error}") from None
        finally:
            library.iparm[35] = 0
            library.set_phase(-1)
            library._call_pardiso(sp.csr_matrix(np.eye(1)), np.zeros((1, 1), order="F"))
            library.perm = before
    if not np.all(np.isfinite(S)):
        raise SingularSystemError("MKL Pardiso: the stiffness matrix is singular")
    return S
