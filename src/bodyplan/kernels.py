"""How small kernels are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def lean(kernel: Kernel) -> Kernel:
    """``njit`` for kernels that make no arrays: they do without Numba's counts of references (as its own sorts do),
    which take longer than the arithmetic of a short kernel, and without its tests for divisions by zero, which give
    inf or nan as in NumPy. Assigning an array to a slice makes one."""
    compiled: Any = njit
    return cast(Kernel, compiled(cache=True, nogil=True, error_model="numpy", _nrt=False)(kernel))


def inlined(kernel: Kernel) -> Kernel:
    """:func:`lean` for kernels that are made part of those that call them. Calls hand over all numbers of every array,
    which of some tuples of arrays are hundreds: that takes longer than the arithmetic for one pose."""
    compiled: Any = njit
    return cast(Kernel, compiled(nogil=True, error_model="numpy", _nrt=False, forceinline=True)(kernel))
