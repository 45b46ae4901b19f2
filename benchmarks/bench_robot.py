"""All feet and their Jacobians of a SILO4-like robot: bodyplan against Pinocchio and MuJoCo, each from Python.

    python benchmarks/bench_robot.py

The task, for one configuration q: position and rotation of the four feet, and four body-fixed Jacobians. Two
robots: the table of paper *legs* with its passive ankles (24 joints), and the same legs cut at the ankle
(12 joints, point feet). All results are compared before anything is timed.

A batch is timed twice: "kept" leaves the results of all 100,000 configurations in memory (1 to 1.5 KB each: this
is bound by memory), "used" works in blocks that overwrite each other, as Pinocchio's and MuJoCo's own data do.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from _bench import compare, header
from bodyplan.robot import Joint, Robot

TABLE = Path(__file__).parents[1] / "examples" / "silo4_legs.csv"
BATCH, BLOCK = 100_000, 500
Results = list[tuple[np.ndarray, np.ndarray, np.ndarray]]


def point_feet(robot: Robot) -> Robot:
    """The robot without ankles, heels and soles."""
    rows = {chain.name: chain.elements[:4] for chain in robot.chains}
    return Robot.from_rows(rows, name="silo4 with point feet")


def with_pinocchio(robot: Robot) -> Callable[[np.ndarray], Results] | None:
    """The task for Pinocchio, or None where it is not installed."""
    try:
        import pinocchio as pin
    except ImportError:
        return None
    model, feet = pin.Model(), []
    for chain in robot.chains:
        parent, placement = 0, pin.SE3.Identity()
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
    if [model.idx_qs[model.getJointId(name)] for name in robot.joints] != list(range(robot.n)):
        raise RuntimeError("the joints are in another order")
    data = model.createData()

    def task(q: np.ndarray) -> Results:
        pin.computeJointJacobians(model, data, q)
        out = []
        for foot in feet:
            pin.updateFramePlacement(model, data, foot)
            pose = data.oMf[foot]
            out.append((pose.translation, pose.rotation, pin.getFrameJacobian(model, data, foot, pin.LOCAL)))
        return out

    return task


def with_mujoco(robot: Robot) -> Callable[[np.ndarray], Results]:
    """The task for MuJoCo: bodies nested as the rows are, a site for every foot."""
    import mujoco

    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    for chain in robot.chains:
        body, place = spec.worldbody, np.eye(4)
        for row in chain.elements:
            driven = isinstance(row.theta, Joint)
            turn, rest = _turn(2, row.theta.offset if driven else row.theta), _turn(0, row.epsilon)
            rest[:3, 3] = row.a, 0.0, row.d
            place = place @ turn
            if driven:
                body = body.add_body(pos=place[:3, 3], quat=_quaternion(place))
                body.add_joint(name=row.theta.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
                body.mass, body.inertia = 1.0, [1.0, 1.0, 1.0]
                body.explicitinertial = True
                place = np.eye(4)
            place = place @ rest
        body.add_site(name=chain.name, pos=place[:3, 3], quat=_quaternion(place))
    model = spec.compile()
    data = mujoco.MjData(model)
    sites = [model.site(chain.name).id for chain in robot.chains]
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))

    def task(q: np.ndarray) -> Results:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        out = []
        for site in sites:
            mujoco.mj_jacSite(model, data, linear, angular, site)
            R = data.site_xmat[site].reshape(3, 3)
            out.append((data.site_xpos[site], R, np.concatenate([R.T @ linear, R.T @ angular])))
        return out

    return task


def _turn(axis: int, angle: float) -> np.ndarray:
    T, (i, j) = np.eye(4), [(1, 2), (2, 0), (0, 1)][axis]
    T[i, i] = T[j, j] = np.cos(angle)
    T[j, i], T[i, j] = np.sin(angle), -np.sin(angle)
    return T


def _quaternion(T: np.ndarray) -> np.ndarray:
    from bodyplan.spatial import quaternion_from_matrix

    return quaternion_from_matrix(T[:3, :3])


def disagreement(robot: Robot, task: Callable[[np.ndarray], Results], q: np.ndarray) -> float:
    """Largest difference between the results of bodyplan and of ``task`` at the configurations ``q``."""
    at = robot.ends_and_jacobians(q)
    Q = at.stacked()
    worst = 0.0
    for i, qi in enumerate(q):
        for c, (position, rotation, jacobian) in enumerate(task(qi)):
            worst = max(
                worst,
                float(np.abs(position - at.positions[i, c]).max()),
                float(np.abs(rotation - at.rotations[i, c]).max()),
                float(np.abs(jacobian - Q[i, 6 * c : 6 * c + 6]).max()),
            )
    return worst


def main() -> None:
    full = Robot.from_table(TABLE)
    header("Four feet and four Jacobians of a SILO4-like robot", "pin", "mujoco")
    for robot in (full, point_feet(full)):
        q = np.random.default_rng(0).uniform(-1.0, 1.0, (BATCH, robot.n))
        one = q[0].copy()
        rivals = {"MuJoCo from Python": with_mujoco(robot), "Pinocchio from Python": with_pinocchio(robot)}
        tasks = {name: task for name, task in rivals.items() if task is not None}
        print(f"\n{robot!r}")
        for name, task in tasks.items():
            print(f"  {name} agrees to {disagreement(robot, task, q[:20]):.1e}")
        if len(tasks) < len(rivals):
            print("  Pinocchio is not installed (pip install pin); MuJoCo is the yardstick.")

        reused, kept = robot.ends_and_jacobians(one), robot.ends_and_jacobians(q)
        blocks = [robot.ends_and_jacobians(q[:BLOCK]) for _ in range(2)]

        def used(first: int, last: int, block, robot: Robot = robot, q: np.ndarray = q) -> None:
            for start in range(first, last, BLOCK):
                robot.ends_and_jacobians(q[start : start + BLOCK], out=block)

        def used_by_two(blocks=blocks, used: Callable[..., None] = used) -> None:
            half = BATCH // 2
            with ThreadPoolExecutor(2) as pool:
                list(pool.map(lambda i: used(i * half, (i + 1) * half, blocks[i]), range(2)))

        cases: dict[str, tuple[Callable[[], object], int]] = {
            "bodyplan, one call": (lambda r=robot, x=one: r.ends_and_jacobians(x), 1),
            "bodyplan, one call, out=": (lambda r=robot, x=one, o=reused: r.ends_and_jacobians(x, out=o), 1),
            f"bodyplan, {BATCH} kept": (lambda r=robot, x=q: r.ends_and_jacobians(x), BATCH),
            f"bodyplan, {BATCH} kept, out=": (lambda r=robot, x=q, o=kept: r.ends_and_jacobians(x, out=o), BATCH),
            f"bodyplan, {BATCH} used": (lambda u=used, b=blocks: u(0, BATCH, b[0]), BATCH),
            f"bodyplan, {BATCH} used, two threads": (used_by_two, BATCH),
        }
        cases |= {name: (lambda t=task, x=one: t(x), 1) for name, task in tasks.items()}
        compare(cases, unit="configuration", against=list(tasks)[-1])


if __name__ == "__main__":
    main()
