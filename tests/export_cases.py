"""Small motions of every family, and of a robot that has everything: what every format must be able to write."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

import bodyplan as bp
from bodyplan.robot import Arc, Body, Contact, Joint, Row, WheelRadius
from bodyplan.spatial.rotations import quaternion_exp
from robot_cases import frame_matrices

CASES = ("concertina", "serpentine arcs", "double joints", "inching", "crawl", "wheels", "everything")


@cache
def small(case: str) -> bp.Motion:
    """A motion of few samples."""
    if case == "everything":
        return everything()
    robot, gait, ground, t = {
        "concertina": lambda: (
            bp.snake(12, 0.05),
            bp.Concertina(body_modules=2, contraction="mirror"),
            bp.Corridor(0.3),
            bp.times(0.0, 4.0, dt=0.25),
        ),
        "serpentine arcs": lambda: (
            bp.snake(6, 0.1, joint="arc", radius=0.02),
            bp.Serpentine(bp.Serpenoid(alpha=0.6, length=0.6), speed=0.1),
            bp.Plane(),
            bp.times(0.0, 2.0, dt=0.2),
        ),
        "double joints": lambda: (
            bp.snake(6, 0.1, joint="double", axes="universal", radius=0.02),
            bp.Rolling(curvature=2.0, rate=1.0),
            bp.Plane(),
            bp.times(0.0, 2.0, dt=0.2),
        ),
        "inching": lambda: (
            bp.snake(10, 0.1, axes="alternating", first="pitch", radius=0.005, mass=0.25),
            bp.Rectilinear(anchors=3),
            bp.Profile(floor=[(0.0, 0.0), (1.0, 0.0)]),
            bp.times(0.0, 2.0, dt=0.25),
        ),
        "crawl": lambda: (
            bp.silo4(),
            bp.Crawl(velocity=(0.03, 0.0, 0.0)),
            bp.Surface("0.02*sin(6*x)*cos(5*y)"),
            bp.times(0.0, 2.0, dt=0.25),
        ),
        "wheels": lambda: (
            bp.tri_wheel(),
            bp.Carry("line", height=0.15),
            bp.Surface("sin(0.5*(x+y))/15"),
            bp.times(0.0, 2.0, dt=0.25),
        ),
    }[case]()
    return bp.plan(robot, gait, ground, t)


def everything() -> bp.Motion:
    """Three chains, one on another: shared, scaled and passive joints, slides, an arc, a wheel that changes its radius,
    every shape of contact; samples at uneven times, a base that turns over, torques."""
    t = np.array([0.5, 0.75, 1.0, 1.1, 1.5])
    bend = Joint("bend", offset=0.2, limits=(-2.0, 2.0))
    law = WheelRadius(Joint("adjust"), link=0.3, rubber=0.02)
    arm = [
        Row(theta=bend.share(0.5), a=1.0 / 3.0, epsilon=0.3, name="one", body=Body(mass=1.1)),
        Row(theta=bend.share(0.5), d=Joint("slide", scale=-2.0), a=0.3, name="two", body=Body(mass=0.3)),
        Row(theta=Joint("free", actuated=False), epsilon=-0.7, a=0.1, name="three", body=Body(mass=0.5)),
    ]
    tail = [
        Arc(0.3, Joint("nod"), Joint("wag", scale=0.5), body=Body(mass=0.4)),
        Arc(0.2, pitch=0.4, yaw=Joint("nod"), body=Body(mass=0.4)),
    ]
    wheel = [
        Row(epsilon=-0.5 * np.pi, a=0.2, name="axle", body=Body(mass=0.2)),
        Row(theta=Joint("spin"), name="hub", body=Body(mass=0.6)),
    ]
    touch = [Row(theta=Joint("touch", actuated=False), a=law, name="touching")]
    contacts = [
        Contact("trunk", "base", "box", half=(0.1, 0.07, 0.04), start=(0.01, 0.0, 0.0)),
        Contact("keel", "base", "capsule", 0.02, start=(0.0, 0.0, -0.1), end=(0.1, 0.02, -0.13)),
        Contact("fixed rim", "one", "rim", 0.1),
        Contact("foot", "three", "sphere", 0.03, start=(0.1, 0.0, -0.05)),
        Contact("tyre", "hub", "rim", drive=law, start=(0.0, 0.0, 0.01)),
    ]
    robot = bp.Robot.from_rows(
        {"arm": arm, "tail": tail, "wheel": wheel, "touch": touch},
        parents={"tail": "two", "touch": "axle"},
        contacts=contacts,
        base_body=Body(mass=2.0),
        name='the "whole" */ thing',
    )
    phase = np.arange(robot.n)
    q = 0.9 * np.sin(2.0 * t[:, None] + phase)
    q[:, robot.joint_index("adjust")] = 0.5 + t
    q[:, robot.joint_index("touch")] *= 3.0
    qd, qdd = 1.8 * np.cos(2.0 * t[:, None] + phase), -3.6 * np.sin(2.0 * t[:, None] + phase)
    qd[:, robot.joint_index("adjust")], qdd[:, robot.joint_index("adjust")] = 1.0, 0.0
    # more than a whole turn: canonical quaternions jump from w = 0 to w = 0 with the other sign
    base = np.column_stack([t, 0.1 * t, 0.5 + 0.0 * t, quaternion_exp(np.outer(6.0 * t, [0.6, 0.0, 0.8]))])
    torques = np.cos(t[:, None] * (1.0 + phase))
    ground = bp.Corridor(3.0, height=1.5)
    return bp.Motion(robot, ground, {}, t, base, q, qd, qdd, np.zeros(len(t)), np.full(len(t), "ok"), torques=torques)


def world_matrices(motion: bp.Motion, sample: int) -> dict[str, np.ndarray]:
    """T (4, 4) of every frame in the world, from products of elementary matrices (:mod:`robot_cases`)."""
    base = np.eye(4)
    base[:3, 3] = motion.base[sample, :3]
    base[:3, :3] = Rotation.from_quat(motion.base[sample, 3:], scalar_first=True).as_matrix()
    return {name: base @ T.real for name, T in frame_matrices(motion.robot, motion.q[sample]).items()}
