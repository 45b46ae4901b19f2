"""A sweep in worker processes against the same points in bare processes, one and two of them.

    python benchmarks/bench_sweep.py

Each point plans, checks and simulates a snake of eight links for a fraction of a second. Bare processes get half or all
of the points in one call and work them out in a loop, with one thread each as workers have; pools send, receive and
write every point to disk. All processes are started and warmed up first. Rounds are interleaved and all see the same
points, so that a ratio within a round says something on a machine with other work, too: what two workers reach of two
bare processes is what the engine costs, what two bare ones reach of twice one is what the machine costs.
"""

from __future__ import annotations

import os
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from multiprocessing import get_context
from pathlib import Path

from _bench import header
from bodyplan.missions import parse_mission
from bodyplan.search.cluster import ONE_THREAD, Pool, pool
from bodyplan.search.payload import key_of, payload_of
from bodyplan.search.point import evaluate
from bodyplan.search.store import Store, store_at

MISSION = """
title = "bench"
robot = { kind = "snake", links = 8, link_length = 0.1 }
gait = { kind = "concertina", body_modules = 2, contraction = "mirror", max_joint_rate = 3.0 }
ground = { kind = "corridor", width = 0.16, friction = 0.05 }
time = { cycles = 1, dt = 0.05 }
simulate = { cycles = 1, settle = 0.2, dt = 0.002 }
"""
POINTS, ROUNDS = 16, 5
PAYLOAD = payload_of(parse_mission(MISSION, "bench", "bench", None))
Jobs = list[tuple[str, tuple[str, ...]]]


def jobs(n: int) -> Jobs:
    """The points of round ``n``; no process has seen them."""
    changes = [(f"gait.omega={1.0 + 1e-4 * (POINTS * n + i)!r}",) for i in range(POINTS)]
    return [(key_of(PAYLOAD, change, {}), change) for change in changes]


def loop(mine: Jobs) -> tuple[int, float]:
    """How many of the points are well, and the processor time they took, in a bare process."""
    start = time.process_time()
    return sum(evaluate(PAYLOAD, change).ok for _, change in mine), time.process_time() - start


def bare(processes: list[ProcessPoolExecutor], points: Jobs) -> tuple[int, float]:
    count = len(processes)
    parts = [process.submit(loop, points[i::count]) for i, process in enumerate(processes)]
    return sum(part.result()[0] for part in parts), sum(part.result()[1] for part in parts)


def pooled(workers: Pool, store: Store, points: Jobs) -> tuple[int, float]:
    def used() -> float:
        return sum(workers._client.run(time.process_time).values())

    good, start = 0, used()
    for key, row in workers.rows(PAYLOAD, points, True):
        store.add(key, row, {})
        good += row.ok
    return good, used() - start


@contextmanager
def processes(count: int) -> Iterator[list[ProcessPoolExecutor]]:
    """Bare ones, with one thread each."""
    os.environ.update(ONE_THREAD)
    with ExitStack() as stack:
        yield [stack.enter_context(ProcessPoolExecutor(1, mp_context=get_context("spawn"))) for _ in range(count)]


def main() -> None:
    header("A sweep against bare processes", "mujoco", "distributed")
    with (
        tempfile.TemporaryDirectory() as folder,
        store_at(Path(folder) / "one.jsonl") as kept_by_one,
        store_at(Path(folder) / "two.jsonl") as kept_by_two,
        processes(1) as alone,
        processes(2) as both,
        pool(1) as one,
        pool(2) as two,
    ):
        cases: dict[str, Callable[[Jobs], tuple[int, float]]] = {
            "1 bare process": lambda points: bare(alone, points),
            "1 worker": lambda points: pooled(one, kept_by_one, points),
            "2 bare processes": lambda points: bare(both, points),
            "2 workers": lambda points: pooled(two, kept_by_two, points),
        }
        wall: dict[str, list[float]] = {name: [] for name in cases}
        used: dict[str, list[float]] = {name: [] for name in cases}
        here: dict[str, list[float]] = {name: [] for name in cases}
        for n in range(ROUNDS + 1):
            for name, call in cases.items():
                points = jobs(n)
                start, mine = time.perf_counter(), time.process_time()
                good, seconds = call(points)
                if good != POINTS:
                    raise RuntimeError(f"{name}: not all points are ok")
                if n:  # the first round compiles and loads
                    wall[name].append((time.perf_counter() - start) / POINTS)
                    here[name].append((time.process_time() - mine) / POINTS)
                    used[name].append(seconds / POINTS)
    for name, values in wall.items():
        middle = statistics.median(values)
        print(
            f"  {name:17} {1e3 * middle:8.2f} ms a point  ({1e3 * min(values):.2f} .. {1e3 * max(values):.2f}),"
            f" {1.0 / middle:.3g} points a second; processor time {1e3 * min(used[name]):.2f} ms a point there,"
            f" {1e3 * min(here[name]):.2f} ms here"
        )

    def shares(first: str, second: str, factor: float = 1.0) -> str:
        values = [100.0 * factor * a / b for a, b in zip(wall[first], wall[second], strict=True)]
        return f"{statistics.median(values):.0f} % ({min(values):.0f} .. {max(values):.0f})"

    more = [1e3 * (a - b) for a, b in zip(wall["1 worker"], wall["1 bare process"], strict=True)]
    print(
        f"  overhead of a worker: {statistics.median(more):.2f} ms a point ({min(more):.2f} .. {max(more):.2f}),"
        f" {1e3 * (min(used['1 worker']) - min(used['1 bare process'])):.2f} ms of processor time there"
    )
    print(f"  speed of 2 workers, of twice 1 worker:            {shares('1 worker', '2 workers', 0.5)}")
    print(f"  speed of 2 bare processes, of twice 1 of them:    {shares('1 bare process', '2 bare processes', 0.5)}")
    print(f"  speed of 2 workers, of that of 2 bare processes:  {shares('2 bare processes', '2 workers')}")


if __name__ == "__main__":
    main()
