"""Compilation of loops (numba) with bit-identical results in every process.

If one compiled function calls another as a separate symbol, the callee exists in two versions: by itself, and as a copy
in the code of its caller, optimised together with it. With reordered sums, both differ in the last digits. The process
that compiles uses the first version, a process that loads compiled code from disk the second, because the first
definition of a symbol wins. Compiled functions are therefore of two kinds that share no symbols: an ``entry`` is called
from Python only, and a ``part`` is called from compiled functions only and inlined there. For the same reason, Python
must call an entry with C-contiguous arrays: code for other arrays accepts these too, but sums in another order.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

#: LLVM flags: sums may be reordered, so that several terms are added at a time.
SUMS = frozenset({"contract", "nsz", "reassoc"})
#: LLVM flags: a product and a sum may be rounded together (fused multiply-add).
FUSED = frozenset({"contract"})

#: Files whose code or constants kernels hold.
_SOURCES = ("_*kernels.py", "law.py", "lapack.py")
# C does not call kernels: a wrapper for it would only be compiled
_OPTIONS = {"cache": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}


@lru_cache
def _sources(folder: Path) -> str:
    """Digest of the files with kernels in a folder, and of ``_SOURCES`` in gearbench."""
    of_gearbench = (path for name in _SOURCES for path in Path(__file__).parent.glob(f"*/{name}"))
    digest = sha256()
    for path in sorted({Path(__file__), *of_gearbench, *folder.glob("_*kernels.py")}):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _of_these_sources(kernel: Any) -> Any:
    """Load stored code only if no kernel has changed.

    Numba compares the time of one file. It would keep code that holds an older part of another file, and fails on code
    with types that are gone.
    """
    file = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
    if file is not None:
        file._version = f"{file._version} {_sources(Path(kernel.py_func.__code__.co_filename).parent)}"
    return kernel


def _compiled(fastmath: frozenset[str], **options: Any) -> Callable[[Callable[..., Any]], Any]:
    from numba import njit

    return lambda function: _of_these_sources(njit(**_OPTIONS, fastmath=set(fastmath), **options)(function))


def entry(fastmath: frozenset[str] = frozenset()) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that Python calls; ``fastmath`` holds LLVM's names of permitted changes of arithmetic."""
    return _compiled(fastmath)


def part(fastmath: frozenset[str] = frozenset()) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that is inlined in its callers, and that Python cannot call; ``fastmath`` as for ``entry``."""
    return _compiled(fastmath, forceinline=True, no_cpython_wrapper=True)


def bit_casts() -> tuple[Any, Any]:
    """Make two functions for compiled code: bits of a double as an integer, and double from such bits."""
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    @intrinsic
    def bits(_, x: Any) -> Any:
        """Bits of a double, as an integer."""
        return types.uint64(types.float64), lambda context, b, of, given: b.bitcast(given[0], ir.IntType(64))

    @intrinsic
    def double(_, x: Any) -> Any:
        """Double with these bits."""
        return types.float64(types.uint64), lambda context, b, of, given: b.bitcast(given[0], ir.DoubleType())

    return bits, double


def caller() -> Any:
    """Make a function for compiled code that calls a C or Fortran routine by address, with a tuple of addresses."""
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    @intrinsic
    def call(_, address: Any, arguments: Any) -> Any:
        """Types and code of the call."""

        def code(context: Any, builder: Any, _: Any, values: Any) -> Any:
            word = ir.IntType(64)
            given = [builder.extract_value(values[1], i) for i in range(len(arguments))]
            kind = ir.FunctionType(ir.VoidType(), [word] * len(given))
            builder.call(builder.inttoptr(values[0], kind.as_pointer()), given)
            return context.get_dummy_value()

        return types.void(address, arguments), code

    return call
