"""Timing that can be trusted a little: warmed up, interleaved in one process, medians, hardware named."""

from __future__ import annotations

import gc
import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

SAMPLE = 0.02  # s that one sample of a fast case should take


def header(title: str, *libraries: str) -> None:
    """Print what is measured, on what, with what (``libraries`` besides Python, NumPy, Numba and SciPy)."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    found = [f"Python {platform.python_version()}"]
    for name in ("bodyplan", "numpy", "numba", "scipy", *libraries):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} (not installed)")
    print(f"{title}\n{_processor()}, {cores} cores\n{', '.join(found)}")


def compare(
    cases: Mapping[str, tuple[Callable[[], object], int]], *, unit: str, against: str, rounds: int = 15
) -> dict[str, float]:
    """Time ``cases`` (name -> call, number of ``unit`` it does) in turns; print and return the medians in s a unit.

    The last column says how many times faster than the case ``against`` each is. Quartiles show the unrest of
    the machine: on a busy one compare ratios of one run, not numbers of two.
    """
    loops: dict[str, int] = {}
    for name, (call, _) in cases.items():
        call()
        start = time.perf_counter()
        call()
        loops[name] = max(1, int(SAMPLE / max(time.perf_counter() - start, 1e-7)))
    samples: dict[str, list[float]] = {name: [] for name in cases}
    gc.collect()
    gc.disable()
    try:
        for _ in range(rounds):
            for name, (call, count) in cases.items():
                start = time.perf_counter()
                for _ in range(loops[name]):
                    call()
                samples[name].append((time.perf_counter() - start) / loops[name] / count)
    finally:
        gc.enable()
    medians = {name: statistics.median(values) for name, values in samples.items()}
    width = max(map(len, cases))
    for name, values in samples.items():
        low, _, high = statistics.quantiles(values, n=4)
        ratio = medians[against] / medians[name]
        print(f"  {name:{width}}  {_time(medians[name]):>10} a {unit}  ({_time(low)} .. {_time(high)})   x {ratio:.3g}")
    return medians


def _time(seconds: float) -> str:
    for size, name in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")):
        if seconds >= size:
            return f"{seconds / size:.3g} {name}"
    return f"{seconds * 1e9:.3g} ns"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())
