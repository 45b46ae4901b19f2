"""A robot's kinematics as the source text of a Python module that needs NumPy only."""

from __future__ import annotations

import textwrap
from pprint import pformat

from bodyplan.robot.model import Robot
from bodyplan.robot.source_text import filled, identifiers
from bodyplan.robot.symbolic.code import arc_function, text, uses_arcs
from bodyplan.robot.symbolic.program import Program, compute

HEAD = '''\
"""Kinematics of the robot ROBOT: poses, body-fixed Jacobians and the velocity model of COUNT frames.

Frames are seen from the base (x forward, y left, z up). Twists are (v, omega) in m/s and rad/s, body-fixed: both in the
axes of their own frame, v at its origin. Joint coordinates q (..., JOINT_COUNT), rad or m, in the order of JOINTS; any
leading shape. Needs NumPy only; written by bodyplan.
"""

import numpy as np
'''

MODEL = '''

def velocity_model(q):
    """(P (..., ROWS, 6), Q (..., ROWS, JOINT_COUNT)) of V_frames = P V_base + Q dq/dt."""
    position, rotation, twist = ends(q)
    P = np.zeros((*position.shape[:-2], ROWS, 6))
    Q = np.zeros((*position.shape[:-2], ROWS, JOINT_COUNT))
    for c in range(COUNT):
        for i in range(3):
            axis = rotation[..., c, :, i]
            P[..., 6 * c + i, :3] = P[..., 6 * c + 3 + i, 3:] = axis
            P[..., 6 * c + i, 3:] = np.cross(position[..., c, :], axis)
        for k in range(FIRST[c], FIRST[c + 1]):
            Q[..., 6 * c : 6 * c + 6, JOINT_OF[k]] = twist[..., k, :]
    return P, Q
'''

ARCS = '''

def sinc(x):
    """sin(x)/x."""
    return np.sinc(x / np.pi)


def arc_c(z, a):
    """(x - sin x)/x^3 at z = x^2, given a = sin(x)/x."""
    near, far = np.minimum(z, BELOW), np.maximum(z, BELOW)
    return np.where(z < BELOW, SERIES, CLOSED)
'''


ENDS = '''

def ends(q):
    """(position (..., COUNT, 3) m, rotation (..., COUNT, 3, 3), twist (..., COLUMNS, 6) per unit joint rate).

    The Jacobian of frame c has the columns twist[FIRST[c]:FIRST[c + 1]] for the joints JOINT_OF[FIRST[c]:FIRST[c + 1]],
    and 0 for all others.
    """
    q = np.asarray(q, dtype=float)
BODY
    return position, rotation, twist
'''


def python_source(robot: Robot, frames: tuple[int, ...]) -> str:
    """Module with ``ends(q)`` and ``velocity_model(q)`` for the frames with indices ``frames``."""
    inputs = [f"q_{name}" for name in identifiers(robot.joints, "joint")]
    program = compute(robot, frames, dict(zip(robot.joints, inputs, strict=True)))
    words = {
        "BODY": textwrap.indent("\n".join(_body(program, inputs)), "    "),
        "ROBOT": " ".join(robot.name.split()).replace('"', "'").replace("\\", "/"),
        "ROWS": str(6 * len(frames)),
        "COLUMNS": str(len(program.joint_of)),
        "JOINT_COUNT": str(robot.n),
        "COUNT": str(len(frames)),
    }
    tables = {
        "JOINTS": robot.joints,
        "FRAMES": tuple(robot.frames[frame] for frame in frames),
        "FIRST": tuple(program.first),
        "JOINT_OF": tuple(program.joint_of),
    }
    lists = [f"{name} = {pformat(value, width=100, compact=True)}" for name, value in tables.items()]
    arcs = uses_arcs(line.value for line in program.lines if line.name is not None)
    functions = [
        *([arc_function(_function, ARCS, near="near", far="far")] if arcs else []),
        filled(ENDS, words),
        filled(MODEL, words),
    ]
    return "\n".join([filled(HEAD, words), *lists]) + "\n" + "".join(functions)


def _body(program: Program, inputs: list[str]) -> list[str]:
    count = len(program.positions)
    body = [f"{word} = q[..., {i}]" for i, word in enumerate(inputs) if i in program.joint_of]
    body += [
        f"position = np.empty((*q.shape[:-1], {count}, 3))",
        f"rotation = np.empty((*q.shape[:-1], {count}, 3, 3))",
        f"twist = np.empty((*q.shape[:-1], {len(program.joint_of)}, 6))",
    ]
    for line in program.lines:
        body.append(f"# {line.value}" if line.name is None else f"{line.name} = {text(line.value, _function)}")
    for c in range(count):
        body += [f"position[..., {c}, {i}] = {text(x, _function)}" for i, x in enumerate(program.positions[c])]
        body += [
            f"rotation[..., {c}, {i}, {j}] = {text(x, _function)}"
            for i, axis in enumerate(program.rotations[c])
            for j, x in enumerate(axis)
        ]
        body += [
            f"twist[..., {k}, {i}] = {text(x, _function)}"
            for k, twist in enumerate(program.twists[c].values(), start=program.first[c])
            for i, x in enumerate(twist)
        ]
    return body


def _function(name: str) -> str:
    return f"np.{name}" if name in ("sin", "cos", "sqrt") else name
