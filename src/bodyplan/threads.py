"""Large batches shared between threads, for kernels that let go of the GIL.

Threads of our own rather than Numba's prange: that would compile every kernel a second time, and its portable threading
layer aborts the process when two threads call it.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def shared(kernel: Callable[[int, int], int], size: int, *, threaded_from: int, multiple: int = 1) -> int:
    """Largest result of ``kernel(first, last)`` over ranges that cover ``size`` items.

    One range, in this thread, below ``threaded_from`` items; else one a thread (NUMBA_NUM_THREADS sets their number),
    each a ``multiple`` long but the last.
    """
    threads = min(_threads(), 2 * size // threaded_from)
    if size < threaded_from or threads < 2:
        return kernel(0, size)
    share = -(-size // threads // multiple) * multiple
    with ThreadPoolExecutor(threads) as pool:
        return max(pool.map(lambda first: kernel(first, min(first + share, size)), range(0, size, share)))


def _threads() -> int:
    from numba import config

    return int(getattr(config, "NUMBA_NUM_THREADS", 1))  # set as a module attribute when Numba starts
