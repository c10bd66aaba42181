"""Compilation of loops with the same bits in every process.

A function that is compiled into another one as a symbol of its own has two forms: by itself, and as a copy in the code
of its caller, optimised together with that. Sums in any order differ between them in the last digits. The process that
compiles runs the first form, one that finds compiled code on disk the second, for the first definition of a symbol that
a process meets holds. Therefore there are two kinds of compiled functions and no symbols that they share: an ``entry``
is called from Python, and by no compiled function; a ``part`` is called by compiled functions, and becomes code of
theirs. For the same reason Python calls an entry with arrays that are C-contiguous: code for others serves these as
well, but sums in another order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

#: Sums may be computed in any order, and so several terms at a time.
SUMS = frozenset({"contract", "nsz", "reassoc"})
#: A product and a sum may be rounded once.
FUSED = frozenset({"contract"})

_OPTIONS = {"cache": True, "error_model": "numpy", "nogil": True}


def entry(fastmath: frozenset[str] = frozenset()) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that Python calls; ``fastmath``: liberties of its arithmetic, as LLVM names them."""
    from numba import njit

    return njit(**_OPTIONS, fastmath=set(fastmath))


def part(fastmath: frozenset[str] = frozenset()) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that becomes code of those that call it; ``fastmath`` as for ``entry``."""
    from numba import njit

    return njit(**_OPTIONS, fastmath=set(fastmath), forceinline=True)


def bit_casts() -> tuple[Any, Any]:
    """Two functions for compiled code: the bits of a double as a whole number, and the double of such bits."""
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    @intrinsic
    def bits(_, x: Any) -> Any:
        """The bits of a double."""
        return types.uint64(types.float64), lambda context, b, of, given: b.bitcast(given[0], ir.IntType(64))

    @intrinsic
    def double(_, x: Any) -> Any:
        """The double of these bits."""
        return types.float64(types.uint64), lambda context, b, of, given: b.bitcast(given[0], ir.DoubleType())

    return bits, double


def caller() -> Any:
    """A function for compiled code: it calls the routine of C or Fortran at an address with a tuple of addresses."""
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    @intrinsic
    def call(_, address: Any, arguments: Any) -> Any:
        """Types of such a call, and the code for it."""

        def code(context: Any, builder: Any, _: Any, values: Any) -> Any:
            word = ir.IntType(64)
            given = [builder.extract_value(values[1], i) for i in range(len(arguments))]
            kind = ir.FunctionType(ir.VoidType(), [word] * len(given))
            builder.call(builder.inttoptr(values[0], kind.as_pointer()), given)
            return context.get_dummy_value()

        return types.void(address, arguments), code

    return call
