"""BLAS and LAPACK routines for small systems, in place, through SciPy's C interface.

SciPy's Python wrappers hold Python's lock, and check and copy arguments for longer than these systems take. Arrays are
of double precision, in row-major order, or blocks of such arrays. LAPACK sees them transposed.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

#: Positions of the routines among the ``addresses``, for compiled code.
POTRF, TRTRI, TRMM, GEMM, SYRK, TRSM = range(6)
#: Letters and factors passed to the routines, at fixed positions for compiled code.
RIGHT, UPPER, NO, TRANSPOSED = range(4)
ZERO, ONE, LESS = range(3)
LETTERS, FACTORS = np.array(list(b"RUNT"), dtype=np.uint8), np.array([0.0, 1.0, -1.0])

#: Letters of LAPACK: real or complex.
_KINDS = {np.dtype(float): "d", np.dtype(complex): "z"}


def cholesky(A: NDArray) -> NDArray:
    """Replace the lower half of A = L Lᴴ by L; entries above the diagonal stay.

    Raises
    ------
    numpy.linalg.LinAlgError
        If A is not positive definite.
    """
    n, info = ctypes.c_int(len(A)), ctypes.c_int()
    # Fortran's upper half of Aᵀ = Uᴴ U: L = Uᵀ
    _routine("cython_lapack", _kind(A) + "potrf", 5)(b"U", _at(n), A.ctypes.data, _leading(A), _at(info))
    if info.value:
        raise np.linalg.LinAlgError("a matrix is not positive definite")
    return A


def solve_lower(L: NDArray, B: NDArray) -> NDArray:
    """Replace B by L⁻¹ B; both real or both complex."""
    rows, columns, one = ctypes.c_int(len(B)), ctypes.c_int(B.shape[1]), (ctypes.c_double * 2)(1.0, 0.0)
    # Xᵀ = Bᵀ U⁻¹
    arguments = (b"R", b"U", b"N", b"N", _at(columns), _at(rows), _at(one))
    _routine("cython_blas", _kind(L) + "trsm", 11)(*arguments, L.ctypes.data, _leading(L), B.ctypes.data, _leading(B))
    return B


def _kind(A: NDArray) -> str:
    return _KINDS[A.dtype]


def _leading(A: NDArray) -> object:
    return _at(ctypes.c_int(max(A.strides[0] // A.itemsize, A.shape[1], 1)))


_at = ctypes.byref


@lru_cache(maxsize=16)
def _routine(module: str, name: str, arguments: int) -> Callable[..., None]:
    """A routine, by its address."""
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * arguments)(_address(module, name))


@lru_cache(maxsize=1)
def addresses() -> NDArray:
    """Addresses of ``POTRF`` and the other routines, for compiled code."""
    lapack = [_address("cython_lapack", name) for name in ("dpotrf", "dtrtri")]
    return np.array(lapack + [_address("cython_blas", name) for name in ("dtrmm", "dgemm", "dsyrk", "dtrsm")])


def _address(module: str, name: str) -> int:
    """Address of a routine; SciPy gives it in a capsule named after its signature."""
    from importlib import import_module

    capsule = import_module(f"scipy.linalg.{module}").__pyx_capi__[name]
    python = ctypes.pythonapi
    python.PyCapsule_GetName.restype, python.PyCapsule_GetName.argtypes = ctypes.c_char_p, [ctypes.py_object]
    python.PyCapsule_GetPointer.restype = ctypes.c_void_p
    python.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
    return python.PyCapsule_GetPointer(capsule, python.PyCapsule_GetName(capsule))
