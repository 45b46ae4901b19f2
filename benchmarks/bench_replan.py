"""How long the live viewer takes to re-plan a ready mission while a slider is dragged, warm.

Every slider of a mission is moved by one of its steps, twice: the first plan warms caches and kernels, and both plans
that the viewer may make are timed (all times; few times, which is what it shows while the hand moves). Options
really change between plans, so that no plan is taken from a cache.

    python benchmarks/bench_replan.py [MISSION ...]

With ``--values N`` every slider goes over its whole range in N values instead, and the few times of all of them are
told: searches may take much longer for some values than for those next to the present one.

    python benchmarks/bench_replan.py inching-stairs --values 12

These are absolute times, of no other use than to see which missions follow the hand: noise of the machine included.
"""

from __future__ import annotations

import argparse
import statistics
from time import perf_counter

from bodyplan.errors import BodyplanError
from bodyplan.missions import load_mission, ready_missions
from bodyplan.show.live import memory
from bodyplan.show.live.parameters import Parameter, Scale, changed, parameters_of
from bodyplan.show.live.session import Source
from bodyplan.viewing import mission_source

#: what the viewer promises, s
AIM = 0.1


def moves(parameter: Parameter) -> list[float | int]:
    """Values of a slider next to the present one, in SI: one to warm up with, one to time."""
    values = [parameter.value + k * parameter.step for k in (-1, 1, -2, 2, -3, 3)]
    inside = [v for v in values if parameter.low <= v <= parameter.high]
    return [parameter.si(v) for v in inside[:2]]


def opened(name: str) -> Source:
    """A mission, planned and held in memory as the viewer does when it starts."""
    source = mission_source(load_mission(name))
    memory.hold()
    return source


def one(source: Source, preview: bool) -> dict[str, float]:
    """Seconds of a re-plan by slider; sliders whose neighbouring values are refused are left out."""
    gait, plan = source.gait, source.plan
    assert gait is not None and plan is not None
    out = {}
    for parameter in parameters_of(gait, Scale.of(source.motion)):
        for value in moves(parameter):
            try:
                wanted = changed(gait, {parameter.key: value})
                begin = perf_counter()
                plan(wanted, preview)
                out[parameter.label] = perf_counter() - begin
            except BodyplanError:
                continue
    return out


def spread(source: Source, values: int) -> dict[tuple[str, float], float]:
    """Seconds of a re-plan by slider and value over the whole ranges; what is refused is left out."""
    gait, plan = source.gait, source.plan
    assert gait is not None and plan is not None
    out = {}
    for parameter in parameters_of(gait, Scale.of(source.motion)):
        steps = round((parameter.high - parameter.low) / parameter.step)
        for k in sorted({round(steps * share / (values - 1)) for share in range(values)}):
            value = min(parameter.low + k * parameter.step, parameter.high)
            try:
                wanted = changed(gait, {parameter.key: parameter.si(value)})
                begin = perf_counter()
                plan(wanted, True)
                out[parameter.label, value] = perf_counter() - begin
            except BodyplanError:
                continue
    return out


def tell(name: str, found: dict[tuple[str, float], float]) -> None:
    """Print how long all of them took, and which took longer than the aim."""
    times = [1e3 * seconds for seconds in found.values()]
    shares = statistics.quantiles(times, n=20)
    above = [f"{label} {value:g}: {1e3 * s:.0f} ms" for (label, value), s in found.items() if s > AIM]
    row = f"{name:22} {len(times):5} {statistics.median(times):9.0f} ms {shares[17]:6.0f} ms {shares[18]:6.0f} ms"
    print(f"{row} {max(times):6.0f} ms  {'; '.join(above)}", flush=True)


def main() -> None:
    """Print a line a mission."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("missions", nargs="*", default=None)
    parser.add_argument("--values", type=int, default=None, help="so many values over the range of every slider")
    asked = parser.parse_args()
    if asked.values is not None:
        print(f"{'mission':22} {'plans':>5} {'few: median':>12} {'90 %':>9} {'95 %':>9} {'worst':>9}  above the aim")
        for name in asked.missions or ready_missions():
            source = opened(name)
            one(source, True)
            tell(name, spread(source, max(asked.values, 2)))
        return
    print(f"{'mission':22} {'few: median':>12} {'worst':>8}  {'all: median':>12}  slowest slider")
    for name in asked.missions or ready_missions():
        source = opened(name)
        few, every = one(source, True), one(source, False)
        slowest = max(few, key=lambda k: few[k])
        middle, worst = statistics.median(few.values()), few[slowest]
        mark = "" if worst <= AIM else "  above the aim"
        whole = statistics.median(every.values())
        row = f"{name:22} {middle * 1e3:9.0f} ms {worst * 1e3:5.0f} ms  {whole * 1e3:9.0f} ms"
        print(f"{row}  {slowest}{mark}", flush=True)


if __name__ == "__main__":
    main()
