"""The processes that work out points: dask.distributed, on this machine or on a running cluster."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from hashlib import sha256
from time import monotonic
from typing import Any

from bodyplan import __version__
from bodyplan.errors import BodyplanError, InputError, MissingExtraError
from bodyplan.search.measures import Bound
from bodyplan.search.payload import Payload
from bodyplan.search.point import Row, evaluate

#: tasks under way for each worker: enough that none waits for the next one while a batch of them travels
AHEAD = 8
#: and at first, where nothing says yet how long a point takes
FIRST = 2
#: s of work in a task: one costs some 10 ms, whatever is in it, so that short points share one
WORK = 1.0
#: most points in a task, and how many of the latest points say how long the next ones take
MOST_POINTS, LATEST = 16, 32
#: s: how often to look whether workers have come or gone
NEWS = 1.0
#: s: how long a cluster may take to answer and to have a worker
PATIENCE = 60.0
#: most processes on one machine
MOST_WORKERS = 512
#: environment of workers on this machine: a point in each of them, not a point in all
ONE_THREAD = dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
LOST = "its process ended, also when it was the only point (stopped by the system, for want of memory perhaps)"
#: a worker has the next point beside the one that it works out, so that it never waits for a message; what dask looks
#: at all the time for its dashboard, 4 % of a core in each process, is left out or seldom
DEALING = {
    "distributed.scheduler.worker-saturation": 2.0,
    "distributed.scheduler.allowed-failures": 1,
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.worker.memory.monitor-interval": "500ms",
}
#: a point to work out: its key and what is changed in the mission
Job = tuple[str, Sequence[str]]


class VersionError(BodyplanError):
    """A worker runs another version of bodyplan than the one that sent the work."""


class Pool:
    """Workers that are there. ``rows`` gives them points and hands out what they find as it comes."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._seconds: deque[float] = deque(maxlen=LATEST)

    def rows(
        self, payload: Payload, jobs: Iterable[Job], simulate: bool, bounds: Sequence[Bound] | None = None
    ) -> Iterator[tuple[str, Row]]:
        """Key and row of each of ``jobs`` in the order in which they are finished, each exactly once; ``bounds`` as
        :func:`evaluate`.

        A worker that ends costs no point: another one takes it. A point that ends several of them is tried once more at
        the end, alone, since it may have been with the one that did; then it is "lost". Raises BodyplanError where the
        workers cannot do the work at all.
        """
        asked = {key: tuple(overrides) for key, overrides in jobs}
        lost: list[str] = []
        for key, row in self._rows(payload, asked, (simulate, bounds), ""):
            if row.status == "lost":
                lost.append(key)
            else:
                yield key, row
        for key in lost:
            yield from self._rows(payload, {key: asked[key]}, (simulate, bounds), "-alone")

    def _rows(
        self, payload: Payload, jobs: Mapping[str, tuple[str, ...]], how: tuple[Any, ...], again: str
    ) -> Iterator[tuple[str, Row]]:
        # a task of its own, so that a worker that comes late or again gets the files from the scheduler's recipe
        sent: Any = payload
        if payload.files:
            sent = self._client.submit(replace, payload, key=f"bodyplan-mission-{payload.content}")
        waiting = deque(jobs.items())
        # in the client's own loop: the default is that of the latest client, which may be another one of the user's
        done = distributed_().as_completed(loop=self._client.loop, with_results=True, raise_errors=False)
        under_way: dict[Any, list[str]] = {}

        def give(most: int, workers: int) -> None:
            """Send up to so many tasks, all in one message: a message costs more than a task in it."""
            tasks: list[list[tuple[str, tuple[str, ...]]]] = []
            while waiting and len(tasks) < most:
                tasks.append([waiting.popleft() for _ in range(self._size(len(waiting), workers))])
            if tasks:
                points = [[key for key, _ in task] for task in tasks]
                arguments = [(on_worker, __version__, sent, [changes for _, changes in task], *how) for task in tasks]
                names = [f"bodyplan-points-{sha256('-'.join(keys).encode()).hexdigest()}{again}" for keys in points]
                futures = self._client.map(in_turn, *map(list, zip(*arguments, strict=True)), key=names)
                under_way.update(zip(futures, points, strict=True))
                done.update(futures)

        try:
            workers, asked = self._workers(), monotonic()
            give((AHEAD if self._seconds else FIRST) * workers, workers)
            for batch in done.batches():
                found = [(keys := under_way.pop(future), _rows_of(future, rows, len(keys))) for future, rows in batch]
                self._seconds.extend(row.seconds for _, rows in found for row in rows if row.status != "lost")
                if monotonic() - asked > NEWS:
                    workers, asked = self._workers(), monotonic()
                if len(under_way) <= AHEAD * workers // 2:
                    give(AHEAD * workers - len(under_way), workers)
                for keys, rows in found:
                    yield from zip(keys, rows, strict=True)
        finally:
            self._client.cancel(list(under_way))

    def _size(self, left: int, workers: int) -> int:
        """Points in the next task: what makes up its work, and fewer at the end, where workers must end together."""
        mean = sum(self._seconds) / len(self._seconds) if self._seconds else WORK
        return max(1, min(int(WORK / max(mean, 1e-9)), left // (2 * workers), MOST_POINTS))

    def _workers(self) -> int:
        """Workers that there are now, at least one."""
        return max(1, len(self._client.scheduler_info(-1)["workers"]))


def _rows_of(future: Any, result: Any, count: int) -> list[Row]:
    """The rows of a task of ``count`` points."""
    if future.status == "finished":
        rows: list[Row] = result
        return rows
    if future.status != "error":
        raise BodyplanError("the cluster has gone; what is finished is kept, and the same command goes on.")
    error = result[1]
    if isinstance(error, distributed_().KilledWorker):
        return [Row("lost", LOST)] * count
    if isinstance(error, BodyplanError):
        raise error
    raise BodyplanError(
        f"the workers cannot run bodyplan ({type(error).__name__}: {error}); they need the same bodyplan and Python as "
        "this process."
    ) from error


def in_turn(
    one: Callable[..., Row], version: str, payload: Payload, changes: Sequence[Sequence[str]], *how: Any
) -> list[Row]:
    """What ``one`` makes of several points."""
    return [one(version, payload, overrides, *how) for overrides in changes]


def on_worker(
    version: str, payload: Payload, overrides: Sequence[str], simulate: bool, bounds: Sequence[Bound] | None = None
) -> Row:
    """The row of a point, in a worker process. Raises VersionError in one of another version."""
    if version != __version__:
        raise VersionError(
            f"a worker runs bodyplan {__version__}, this process {version}; install the same everywhere."
        )
    from numba import config

    config.NUMBA_NUM_THREADS = 1  # type: ignore[attr-defined]  # workers share the machine; see bodyplan.threads
    return evaluate(payload, overrides, simulate, bounds)


@contextmanager
def pool(workers: int | None = None, scheduler: str | None = None) -> Iterator[Pool]:
    """Workers: those of the cluster at ``scheduler`` ("tcp://host:8786"), or ``workers`` processes here (default: one
    a core). Raises MissingExtraError without dask.distributed, InputError where there is no cluster."""
    distributed_()
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise InputError(f"workers: must be 1 to {MOST_WORKERS}, got {workers}.")
    if workers is not None and scheduler is not None:
        raise InputError("workers: a running cluster (scheduler) has its own; give one of the two.")
    with ExitStack() as stack:
        stack.enter_context(_quiet())
        client = stack.enter_context(_running(scheduler) if scheduler is not None else _local(workers or _cores()))
        yield Pool(client)


@contextmanager
def _local(workers: int) -> Iterator[Any]:
    # a script that is not guarded is run again in each process that it starts
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise InputError(GUARD)
    import dask

    try:
        with dask.config.set(DEALING), _deaf():
            cluster = distributed_().LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
                env=ONE_THREAD,
                scheduler_kwargs={"dashboard": False},
            )
    except RuntimeError as error:
        raise InputError(f"the worker processes did not start ({error}). {GUARD}") from error
    with cluster, distributed_().Client(cluster) as client:
        yield client


@contextmanager
def _deaf() -> Iterator[None]:
    """Processes started now take no notice of ctrl-C, which a terminal sends to all: this process ends them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


GUARD = 'A script that sweeps or optimises needs if __name__ == "__main__": around what it runs.'


@contextmanager
def _running(scheduler: str) -> Iterator[Any]:
    try:
        client = distributed_().Client(scheduler, timeout=PATIENCE)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"scheduler {scheduler!r}: no cluster answers there ({error}); an address is, for example, "
            "tcp://192.168.1.5:8786."
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as error:
            raise InputError(
                f"scheduler {scheduler!r}: has no workers; start some with: dask worker {scheduler}"
            ) from error
        yield client


@contextmanager
def _quiet() -> Iterator[None]:
    """Workers that come and go are the engine's business: rows say what became of the points."""
    logger = logging.getLogger("distributed")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(level)


def distributed_() -> Any:
    """The library dask.distributed, or MissingExtraError."""
    try:
        import distributed
    except ImportError as error:
        raise MissingExtraError("dask.distributed", "cluster", "a search") from error
    return distributed


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
