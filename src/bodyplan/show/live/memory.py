"""Memory while a viewer runs: what is there before it starts is not searched for garbage again."""

from __future__ import annotations

import gc
import threading

_held, _lock = 0, threading.Lock()


def hold() -> None:
    """Leave what is in memory now out of the collector's rounds, until as many :func:`release`: of two hundred thousand
    objects, most of them of imported libraries, one round takes as long as a re-plan and would come in the middle of
    it."""
    global _held
    with _lock:
        gc.collect()
        gc.freeze()
        _held += 1


def release() -> None:
    """Undo a :func:`hold`."""
    global _held
    with _lock:
        _held -= 1
        if not _held:
            gc.unfreeze()
