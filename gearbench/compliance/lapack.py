"""The few routines of BLAS and LAPACK that small systems are solved with, in place, as SciPy hands them out for C.

SciPy's own wrappers of them hold Python's lock, and check and copy their arguments for longer than these systems take:
here other threads go on. Arrays are of double precision, contiguous, rows first, or blocks of such. LAPACK, which has
columns first, sees them transposed.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

#: Routines by their place among the ``addresses``, for compiled code: dpotrf and so on.
POTRF, TRTRI, TRMM, GEMM, SYRK, TRSM = range(6)
#: What they are asked for, as letters and factors, which compiled code refers to by where they are.
RIGHT, UPPER, NO, TRANSPOSED = range(4)
ZERO, ONE, LESS = range(3)
LETTERS, FACTORS = np.array(list(b"RUNT"), dtype=np.uint8), np.array([0.0, 1.0, -1.0])

#: Letters of LAPACK: real or complex.
_KINDS = {np.dtype(float): "d", np.dtype(complex): "z"}


def cholesky(A: NDArray) -> NDArray:
    """L of A = L Lᴴ in place of the lower half of A; what is above the diagonal stays.

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
    """L⁻¹ B in place of B, both of the same kind."""
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
