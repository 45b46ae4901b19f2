"""Resolved rates in a control loop: one step of SILO4's crawl, and its share of a millisecond.

    python benchmarks/bench_resolve.py

A step takes joint coordinates and the pose of the body and gives all joint rates: four feet commanded in the world, the
body's x, y and yaw, the rest left to the method. Residuals are checked before anything is timed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import bodyplan as bp
from _bench import compare, header

LEGS = ("fl", "fr", "hl", "hr")
BATCH = 1000
STANCE = LEGS[:3]


def cases(robot: bp.Robot) -> tuple[bp.solve.Partition, dict[str, Callable[[], bp.solve.Rates]]]:
    knees = {"knee": np.radians(-120.0)}
    q = np.array([knees.get(name.split(".")[-1], 0.1) for name in robot.joints])
    base = np.array([0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0])
    known = [*(f"{leg}.foot.v" for leg in LEGS), "body.x", "body.y", "body.yaw"]
    part = bp.solve.partition(robot, q, base, known=known, axes="world")
    Y = part.values(
        {f"{leg}.foot.v": 0.0 for leg in STANCE}
        | {"hr.foot.v": [0.06, 0.0, 0.04], "body.x": 0.02, "body.y": 0.0, "body.yaw": 0.0}
    )
    many = np.tile(q, (BATCH, 1))
    objective = bp.solve.stability.Objective("barrier")
    free = bp.solve.resolve(part, Y, method="weighted")
    slow = {name: 0.9 * abs(float(free[name])) for name in ("body.z", "body.roll")}
    idle, tight = bp.solve.Limits(horizon=0.05), bp.solve.Limits(horizon=0.05, components=slow)

    def climb() -> bp.solve.Rates:
        now = part.at(q, base)
        psi = objective.at(now.model, STANCE)
        return bp.solve.resolve(now, Y, method="weighted", gradient=psi.rho(now), d=0.01)

    return part, {
        "min_norm": lambda: bp.solve.resolve(part.at(q, base), Y),
        "weighted": lambda: bp.solve.resolve(part.at(q, base), Y, method="weighted"),
        "weighted, barrier": climb,
        "qp, no limit reached": lambda: bp.solve.resolve(part.at(q, base), Y, limits=idle),
        "qp, two limits hold": lambda: bp.solve.resolve(part.at(q, base), Y, limits=tight),
        f"weighted, {BATCH} at once": lambda: bp.solve.resolve(part.at(many, base), Y, method="weighted"),
    }


def main() -> None:
    header("resolved rates, one configuration a call", "clarabel")
    for passive in (False, True):
        robot = bp.silo4(passive=passive)
        part, calls = cases(robot)
        for name, call in calls.items():
            rates = call()
            if not rates.ok or np.max(rates.residual) > 1e-12:
                raise SystemExit(f"{name}: not solved")
        print(f"{robot.n} joints, {len(part.rows)} rows, {len(part.unknown)} unknown, {len(part.known)} known:")
        timed = {name: (call, BATCH if "at once" in name else 1) for name, call in calls.items()}
        for name, seconds in compare(timed, unit="step", against="min_norm").items():
            print(f"  {name}: {seconds / 1e-3:.0%} of a millisecond")


if __name__ == "__main__":
    main()
