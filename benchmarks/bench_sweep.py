"""A sweep in worker processes against a bare loop over the same points in one process.

    python benchmarks/bench_sweep.py

Each point plans, checks and simulates a snake of eight links for a fraction of a second; what a worker does for it is
what the loop does. The pools are started and warmed up first; the rest, what a user waits for between points, is
counted: sending, receiving, writing the point to disk. Overhead is what one worker takes more than the loop.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from _bench import header
from bodyplan.missions import parse_mission
from bodyplan.search.cluster import Pool, pool
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
POINTS, ROUNDS = 24, 5
PAYLOAD = payload_of(parse_mission(MISSION, "bench", "bench", None))


def jobs(first: int) -> list[tuple[str, tuple[str, ...]]]:
    """Points that no one has seen, from number ``first`` on."""
    changes = [(f"gait.omega={1.0 + 1e-4 * n!r}",) for n in range(first, first + POINTS)]
    return [(key_of(PAYLOAD, change, {}), change) for change in changes]


def loop(first: int) -> int:
    return sum(evaluate(PAYLOAD, change).ok for _, change in jobs(first))


def pooled(workers: Pool, store: Store, first: int) -> int:
    good = 0
    for key, row in workers.rows(PAYLOAD, jobs(first), True):
        store.add(key, row, {})
        good += row.ok
    return good


def main() -> None:
    header("A sweep against a bare loop", "mujoco", "distributed")
    with (
        tempfile.TemporaryDirectory() as folder,
        store_at(Path(folder) / "points.jsonl") as store,
        pool(1) as one,
        pool(2) as two,
    ):
        cases: dict[str, Callable[[int], int]] = {
            "bare loop": loop,
            "1 worker": lambda first: pooled(one, store, first),
            "2 workers": lambda first: pooled(two, store, first),
        }
        times: dict[str, list[float]] = {name: [] for name in cases}
        first = 0
        for i in range(ROUNDS + 1):
            for name, call in cases.items():
                start = time.perf_counter()
                if call(first) != POINTS:
                    raise RuntimeError(f"{name}: not all points are ok")
                if i:  # the first round compiles and loads
                    times[name].append((time.perf_counter() - start) / POINTS)
                first += POINTS
    middle = {name: statistics.median(values) for name, values in times.items()}
    for name, values in times.items():
        print(
            f"  {name:10} {1e3 * middle[name]:8.2f} ms a point  ({1e3 * min(values):.2f} .. {1e3 * max(values):.2f})"
            f"   {1.0 / middle[name]:.3g} points a second"
        )
    print(f"  overhead of a worker {1e3 * (middle['1 worker'] - middle['bare loop']):.2f} ms a point")
    print(f"  efficiency of 2 workers {50.0 * middle['1 worker'] / middle['2 workers']:.0f} % of twice one worker")


if __name__ == "__main__":
    main()
