"""Robot and ground as one MuJoCo model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, IntArray, number, whole
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.ground.base import Ground, Solid
from bodyplan.robot.model import Robot
from bodyplan.simulate.friction import Friction, Scales
from bodyplan.simulate.library import mujoco
from bodyplan.simulate.skeleton import Drives, add_robot
from bodyplan.simulate.terrain import add_pairs, add_self_pairs, add_solid, geom_name, scales_of
from bodyplan.simulate.wheels import MOTOR_ARMATURE, RIM_IMPRATIO, TIPS, Wheels, soften, wheel_servos

Servo = tuple[float, float] | Mapping[str, tuple[float, float]] | None


@dataclass(frozen=True, eq=False)
class Physics:
    """A robot on a ground, compiled. ``spec`` and ``model`` are MuJoCo's; the rest maps between them and
    bodyplan.

    ``servos`` (u,) column of q of every actuator. ``gains`` (u, 2) their kp and kv. ``solids`` the ground's,
    in the order of ``solid_geoms``; ``scales`` what to update before each step, or None; ``wheels`` those of
    the robot.
    """

    robot: Robot
    spec: Any
    model: Any
    drives: Drives
    servos: IntArray
    gains: Array
    solids: tuple[Solid, ...]
    solid_geoms: IntArray
    scales: Scales | None
    qpos_at: IntArray
    dof_at: IntArray
    mean: Array
    wheels: Wheels

    def qpos(self, q: ArrayLike, base: ArrayLike) -> Array:
        """MuJoCo's configuration (nq,) of joint coordinates (n,) and a base pose (7,)."""
        out = np.zeros(self.model.nq)
        out[:7] = base
        at = np.asarray(q, dtype=np.float64)
        out[self.qpos_at] = self.drives.scale * at[self.drives.joint]
        out[self.wheels.slides] = self.wheels.slide(at)
        return out

    def q(self, qpos: Array) -> Array:
        """Joint coordinates (..., n) of configurations (..., nq); of a joint that drives several MuJoCo
        joints, the value that fits them best. 0 for contact angles: a configuration does not have them."""
        return np.asarray(qpos[..., self.qpos_at] @ self.mean)

    def coupling_error(self, qpos: Array) -> float:
        """Largest difference between MuJoCo's joints and the joint coordinates that drive them, rad or m."""
        q = self.q(qpos)
        error = qpos[..., self.qpos_at] - self.drives.scale * q[..., self.drives.joint]
        slack = qpos[..., self.wheels.slides] - self.wheels.slide(q)
        return max(float(np.max(np.abs(e), initial=0.0)) for e in (error, slack))

    def role(self, *roles: str) -> BoolArray:
        """(solids,) True where a solid has one of the roles."""
        return np.array([solid.role in roles for solid in self.solids], dtype=bool)


def build(
    robot: Robot,
    ground: Ground,
    low: ArrayLike,
    high: ArrayLike,
    *,
    friction: float | Friction | None = None,
    servo: Servo = None,
    dt: float = 1e-3,
    armature: float = 1e-3,
    arc_joints: int = 4,
    self_collision: bool = False,
    rim_tips: int = TIPS,
    ranges: Mapping[str, tuple[float, float]] | None = None,
) -> Physics:
    """Robot and the part of the ground in the box from ``low`` (3,) to ``high`` (3,) m as a MuJoCo model.

    Contacts touch the ground through explicit pairs: elliptic friction cones, impratio 10 (100 for a robot on wheels,
    whose contacts are softer: :func:`bodyplan.simulate.wheels.soften`), integrator implicitfast, time step ``dt`` s.
    ``friction`` overrides the floor's (not the walls'). Joint coordinates that have an actuator get a position servo
    (N m / rad or N / m, and per rate): ``servo`` as in
    :func:`default_servo`. ``self_collision`` lets contacts of the robot touch each other unless they
    are neighbours (:func:`bodyplan.robot.neighbours.separate_contacts`) or rims that change their radius. See
    :func:`add_robot` for ``armature``, ``arc_joints``, ``rim_tips`` and ``ranges``.

    Raises InputError: a robot without mass or contacts, a wheel-radius drive without a rim that follows it
    (:func:`bodyplan.simulate.rims.pointers_of`), inertia that no body can have, scale friction where a floor is
    no plane and no box with a level top, or a contact no capsule and no sphere.
    """
    mj = mujoco()
    spec = mj.MjSpec()
    spec.modelname = robot.name
    spec.compiler.degree = False
    option = spec.option
    option.timestep = number(dt, "dt", above=0.0)
    wheeled = any(contact.shape == "rim" for contact in robot.contacts)
    option.cone, option.impratio = mj.mjtCone.mjCONE_ELLIPTIC, RIM_IMPRATIO if wheeled else 10.0
    option.integrator = mj.mjtIntegrator.mjINT_IMPLICITFAST
    number(armature, "armature", at_least=0.0)
    whole(arc_joints, "arc_joints", at_least=1, at_most=64)
    whole(rim_tips, "rim_tips", at_least=8, at_most=360)
    drives = add_robot(spec, robot, armature=armature, arc_joints=arc_joints, rim_tips=rim_tips, ranges=ranges)
    servos, gains = _add_servos(spec, robot, drives, servo, dt)
    solids = tuple(ground.solids(low, high))
    for solid in solids:
        add_solid(spec, solid)
    add_pairs(spec, robot, solids, friction, rim_tips)
    if self_collision:
        add_self_pairs(spec, robot)
    spec.worldbody.add_light(
        name="sun", pos=[0.0, 0.0, 4.0], dir=[0.3, 0.2, -1.0], type=mj.mjtLightType.mjLIGHT_DIRECTIONAL
    )
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"robot {robot.name!r} cannot be simulated: {error}") from error
    wheels = Wheels.of(model, robot, drives.rings, rim_tips)
    soften(spec, model, wheels.shapes)
    joints = [model.joint(name) for name in drives.names]
    mean = np.zeros((len(joints), robot.n))
    mean[np.arange(len(joints)), drives.joint] = drives.scale
    mean /= np.maximum(np.square(mean).sum(axis=0), 1e-300)
    return Physics(
        robot,
        spec,
        model,
        drives,
        servos,
        gains,
        solids,
        np.array([model.geom(geom_name(solid)).id for solid in solids], dtype=np.int64),
        scales_of(model, robot, solids, friction) if isinstance(friction, Friction) else None,
        np.array([j.qposadr[0] for j in joints], dtype=np.int64),
        np.array([j.dofadr[0] for j in joints], dtype=np.int64),
        mean,
        wheels,
    )


def default_servo(robot: Robot) -> dict[str, tuple[float, float]]:
    """(kp, kv) of every actuated joint: kp = 2 m g L for an angle (N m / rad), 100 m g / L for a length (N /
    m: 1 % of L under the robot's weight), kv = kp / 50 s. m is the robot's mass, L the longest way along
    its frames from the base at q = 0. Motors of wheels: :func:`bodyplan.simulate.wheels.wheel_servos`."""
    rest = robot.forward(np.zeros(robot.n))
    way = {"base": 0.0}
    for chain in robot.chains:
        parent = chain.parent
        for i in range(len(chain.elements)):
            frame = chain.frame_name(i)
            way[frame] = way[parent] + float(np.linalg.norm(rest[frame][:3] - rest[parent][:3]))
            parent = frame
    weight, length = robot.mass * 9.81, max(way.values()) or 1.0
    stiffness = {"angle": 2.0 * weight * length, "length": 100.0 * weight / length}
    wheels = wheel_servos(robot)
    return {
        name: wheels.get(name, (stiffness[kind], stiffness[kind] / 50.0))
        for name, kind, driven in zip(robot.joints, robot.kinds, robot.actuated, strict=True)
        if driven
    }


def _gains(robot: Robot, servo: Servo) -> dict[str, tuple[float, float]]:
    gains = default_servo(robot)
    if servo is None:
        return gains
    if not isinstance(servo, Mapping):
        servo = dict.fromkeys(gains, servo)
    for name, pair in servo.items():
        if name not in gains:
            raise UnknownNameError("actuated joint", name, gains, where="servo")
        if not isinstance(pair, (tuple, list, np.ndarray)) or len(pair) != 2:
            raise InputError(f"servo: expected (kp, kv), got {pair!r}.")
        gains[name] = (number(pair[0], "servo kp", above=0.0), number(pair[1], "servo kv", at_least=0.0))
    return gains


def _add_servos(spec: Any, robot: Robot, drives: Drives, servo: Servo, dt: float) -> tuple[IntArray, Array]:
    """Position servos named as the joints. An actuator's length is q, so that its force is that of q too:
    gear 1 / scale on one MuJoCo joint; on several, a tendon with scale_i / sum of scale^2, and an equality
    that keeps them in step. Motors of wheels get at least the armature that ties and contacts need."""
    mj, gains = mujoco(), _gains(robot, servo)
    columns, motors = [], wheel_servos(robot)
    for column, joint in enumerate(robot.joint_info):
        mine = np.flatnonzero(drives.joint == column)
        names, scales = [drives.names[i] for i in mine], drives.scale[mine]
        for name, scale in zip(names[1:], scales[1:], strict=True):
            tie = spec.add_equality(name=name, type=mj.mjtEq.mjEQ_JOINT, name1=name, name2=names[0])
            tie.data[:5] = [0.0, scale / scales[0], 0.0, 0.0, 0.0]
            tie.solref, tie.solimp = [2.0 * dt, 1.0], [0.99, 0.999, 1e-3, 0.5, 2.0]
        if joint.name not in gains:
            continue
        columns.append(column)
        act = spec.add_actuator(name=joint.name, target=joint.name)
        act.trntype = mj.mjtTrn.mjTRN_JOINT
        if len(names) == 1:
            act.gear = [1.0 / scales[0], *[0.0] * 5]
        else:
            tendon = spec.add_tendon(name=joint.name)
            for name, scale in zip(names, scales, strict=True):
                tendon.wrap_joint(name, float(scale / np.square(scales).sum()))
            act.trntype = mj.mjtTrn.mjTRN_TENDON
        kp, kv = gains[joint.name]
        if joint.name in motors:
            for name in names:
                hinge = spec.joint(name)
                hinge.armature = max(float(hinge.armature), MOTOR_ARMATURE * kv * dt / float(np.square(scales).sum()))
        act.set_to_position(kp=kp, kv=kv)
        if joint.effort is not None:
            act.forcelimited, act.forcerange = mj.mjtLimited.mjLIMITED_TRUE, [-joint.effort, joint.effort]
    served = [gains[robot.joints[column]] for column in columns]
    return np.array(columns, dtype=np.int64), np.array(served, dtype=np.float64).reshape(-1, 2)
