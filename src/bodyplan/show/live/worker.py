"""A thread that works off the latest request: older ones that have not begun are forgotten."""

from __future__ import annotations

import threading
from collections.abc import Callable
from time import monotonic
from typing import Generic, TypeVar

T = TypeVar("T")


class Latest(Generic[T]):
    """Calls ``work(request)`` in a thread of its own for the latest request; ``work`` must not raise.

    A request may have to be ``quiet`` for some s first: a newer one within that time takes its place.
    """

    def __init__(self, work: Callable[[T], None], name: str) -> None:
        self._work = work
        self._change = threading.Condition()
        self._waiting: tuple[T, float] | None = None
        self._busy = self._stopped = False
        self._thread = threading.Thread(target=self._run, name=f"bodyplan {name}", daemon=True)
        self._thread.start()

    def ask(self, request: T, quiet: float = 0.0) -> None:
        """Take up a request, in place of one that waits."""
        with self._change:
            self._waiting = (request, monotonic() + quiet)
            self._change.notify_all()

    def forget(self) -> None:
        """Forget the request that waits."""
        with self._change:
            self._waiting = None
            self._change.notify_all()

    @property
    def waiting(self) -> bool:
        """Whether a newer request waits."""
        with self._change:
            return self._waiting is not None

    def idle(self, timeout: float) -> bool:
        """Wait until nothing is left to do; False where that takes longer than ``timeout`` s."""
        with self._change:
            return self._change.wait_for(lambda: self._waiting is None and not self._busy, timeout)

    def stop(self) -> None:
        """End the thread when the work in hand is done."""
        with self._change:
            self._stopped, self._waiting = True, None
            self._change.notify_all()

    def _run(self) -> None:
        while True:
            with self._change:
                while not self._stopped:
                    left = None if self._waiting is None else self._waiting[1] - monotonic()
                    if left is not None and left <= 0.0:
                        break
                    self._change.wait(left)
                if self._stopped or self._waiting is None:
                    return
                request, self._waiting, self._busy = self._waiting[0], None, True
            try:
                self._work(request)
            finally:
                with self._change:
                    self._busy = False
                    self._change.notify_all()
