"""P and Q of paper *legs*, one configuration a call: bodyplan, its generated C99 and NumPy code, and Pinocchio.

    python benchmarks/bench_velocity_model.py

``V_feet = P V_body + Q dq/dt`` for SILO4 with its passive feet (24 joints) and without (12 joints). Pinocchio has the
same numbers in the Jacobians of a model with a floating base: six columns of P, then those of Q. The generated C is
called from Python through ctypes, and timed alone in a loop in C over 1000 configurations. All results are compared
before anything is timed.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import bodyplan as bp
from _bench import compare, header
from bodyplan.robot import Joint, Robot

BATCH = 1000
Model = tuple[np.ndarray, np.ndarray]

LOOP = """
#include "NAME.h"
void NAME_loop(const double *q, double *P, double *Q, int count)
{
    for (int i = 0; i < count; i++)
        NAME_velocity_model(q + i * N, P, Q);
}
void NAME_loop_ends(const double *q, double *position, double *rotation, double *twist, int count)
{
    for (int i = 0; i < count; i++)
        NAME_ends(q + i * N, position, rotation, twist);
}
"""


def with_pinocchio(robot: Robot) -> Callable[[np.ndarray], Model] | None:
    """P and Q from Pinocchio with a floating base, or None where it is not installed."""
    try:
        import pinocchio as pin
    except ImportError:
        return None
    model, feet = pin.Model(), []
    root = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")
    for chain in robot.chains:
        parent, placement = root, pin.SE3.Identity()
        for row in chain.elements:
            driven = isinstance(row.theta, Joint)
            turn = pin.SE3(pin.utils.rotate("z", row.theta.offset if driven else row.theta), np.zeros(3))
            rest = pin.SE3(pin.utils.rotate("x", row.epsilon), np.array([row.a, 0.0, row.d]))
            if driven:
                parent = model.addJoint(parent, pin.JointModelRZ(), placement * turn, row.theta.name)
                placement = rest
            else:
                placement = placement * turn * rest
        feet.append(model.addFrame(pin.Frame(chain.name, parent, placement, pin.FrameType.OP_FRAME)))
    data, m, n = model.createData(), len(feet), robot.n
    full = np.concatenate([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], np.zeros(n)])
    J = np.empty((6 * m, 6 + n))

    def task(q: np.ndarray) -> Model:
        full[7:] = q
        pin.computeJointJacobians(model, data, full)
        for c, foot in enumerate(feet):
            pin.updateFramePlacement(model, data, foot)
            J[6 * c : 6 * c + 6] = pin.getFrameJacobian(model, data, foot, pin.LOCAL)
        return J[:, :6], J[:, 6:]

    return task


class Compiled:
    """The generated C, compiled with ``flags``."""

    def __init__(self, robot: Robot, folder: Path, flags: tuple[str, ...]) -> None:
        source = robot.symbolic().c_source("legs")
        _, path = source.write(folder, force=True)
        loop, library = folder / "loop.c", folder / f"legs{''.join(flags)}.so"
        loop.write_text(LOOP.replace("NAME", source.name).replace("N)", f"{robot.n})").replace("* N", f"* {robot.n}"))
        subprocess.run(
            ["gcc", "-std=c99", *flags, "-shared", "-fPIC", path, loop, "-o", library, "-lm"], check=True, cwd=folder
        )
        self.library, m = ctypes.CDLL(str(library)), len(robot.chains)
        self.P, self.Q = np.empty((6 * m, 6)), np.empty((6 * m, robot.n))
        self.ends = tuple(np.empty(shape) for shape in ((m, 3), (m, 3, 3), (robot.n, 6)))
        self.out = [_pointer(a) for a in (self.P, self.Q)]
        self.out_ends = [_pointer(a) for a in self.ends]

    def one(self, q: np.ndarray) -> Model:
        self.library.legs_velocity_model(_pointer(q), *self.out)
        return self.P, self.Q

    def many(self, q: np.ndarray) -> None:
        self.library.legs_loop(_pointer(q), *self.out, ctypes.c_int(len(q)))

    def many_ends(self, q: np.ndarray) -> None:
        self.library.legs_loop_ends(_pointer(q), *self.out_ends, ctypes.c_int(len(q)))


def _pointer(a: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(a.ctypes.data)


def main() -> None:
    header("P and Q of SILO4, one configuration", "pin", "sympy")
    for robot in (bp.silo4(passive=True), bp.silo4()):
        q = np.random.default_rng(0).uniform(-1.0, 1.0, (BATCH, robot.n))
        one = q[0].copy()
        print(f"\n{robot!r}")
        namespace: dict[str, Callable[[np.ndarray], Model]] = {}
        exec(robot.symbolic().python(), namespace)
        rivals: dict[str, Callable[[np.ndarray], Model]] = {"generated NumPy": namespace["velocity_model"]}
        pinocchio = with_pinocchio(robot)
        if pinocchio is None:
            print("  Pinocchio is not installed (pip install pin); bodyplan is the yardstick.")
        else:
            rivals["Pinocchio"] = pinocchio
        compiled: dict[str, Compiled] = {}
        if shutil.which("gcc"):
            folder = Path(tempfile.mkdtemp())
            compiled = {f"C99 {' '.join(f)}": Compiled(robot, folder, f) for f in (("-O2",), ("-O3", "-march=native"))}
            rivals |= {name: c.one for name, c in compiled.items()}
        else:
            print("  No gcc: the generated C is not timed.")
        for name, task in rivals.items():
            worst = max(
                np.abs(a - b).max() for x in q[:20] for a, b in zip(task(x), robot.velocity_model(x), strict=True)
            )
            print(f"  {name} agrees to {worst:.1e}")

        reused, block = robot.ends_and_jacobians(one), robot.ends_and_jacobians(q)
        cases: dict[str, tuple[Callable[[], object], int]] = {
            "bodyplan, P and Q": (lambda r=robot, x=one: r.velocity_model(x), 1),
            "bodyplan, poses and Jacobians, out=": (lambda r=robot, x=one, o=reused: r.ends_and_jacobians(x, out=o), 1),
            f"bodyplan, poses and Jacobians, {BATCH} a call": (
                lambda r=robot, x=q, o=block: r.ends_and_jacobians(x, out=o),
                BATCH,
            ),
        }
        for name, task in rivals.items():
            cases[f"{name}, P and Q, from Python"] = (lambda t=task, x=one: t(x), 1)
        for name, c in compiled.items():
            cases[f"{name}, P and Q, loop in C"] = (lambda c=c, x=q: c.many(x), BATCH)
            cases[f"{name}, poses and Jacobians, loop in C"] = (lambda c=c, x=q: c.many_ends(x), BATCH)
        against = "Pinocchio, P and Q, from Python" if pinocchio else "bodyplan, P and Q"
        compare(cases, unit="configuration", against=against)


if __name__ == "__main__":
    main()
