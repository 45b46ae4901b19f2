"""A robot's kinematics as C99 without dependencies: a header and a source file."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from bodyplan.files import refuse_existing, replacing
from bodyplan.robot.model import Robot
from bodyplan.robot.source_text import comment, filled, identifier, identifiers, indices, literal
from bodyplan.robot.symbolic.code import arc_function, text, uses_arcs
from bodyplan.robot.symbolic.program import Program, compute


class CSource(NamedTuple):
    """C99 files of one robot: ``name`` begins every name in them and is that of the files, ``header`` is the text of
    NAME.h, ``source`` that of NAME.c. Compile with any C99 compiler; link with the mathematics library (-lm)."""

    name: str
    header: str
    source: str

    def write(self, folder: str | os.PathLike[str], *, force: bool = False) -> tuple[Path, Path]:
        """Write both files into an existing folder; returns (NAME.h, NAME.c). Raises InputError where one exists and
        ``force`` is not given, or where it cannot be written."""
        header, source = Path(folder) / f"{self.name}.h", Path(folder) / f"{self.name}.c"
        for path in (header, source):
            refuse_existing(path, force)
        for path, content in ((header, self.header), (source, self.source)):
            with replacing(path) as file:
                file.write(content)
        return header, source


HEADER = """\
ABOUT
#ifndef BIG_H
#define BIG_H

#define BIG_JOINTS N_JOINTS
#define BIG_FRAMES N_FRAMES
#define BIG_COLUMNS N_COLUMNS /* Jacobian columns of all frames that can be other than 0 */

#ifdef __cplusplus
extern "C" {
#endif

/* index of a joint in q */
enum {
JOINT_INDICES
};

/* index of a frame */
enum {
FRAME_INDICES
};

extern const char *const NAME_joint_names[BIG_JOINTS];
extern const char *const NAME_frame_names[BIG_FRAMES];
/* Frame c has the rows NAME_first[c] to NAME_first[c + 1] - 1 of twist; NAME_joint_of[k] is the joint of row k. */
extern const int NAME_first[BIG_FRAMES + 1];
extern const int NAME_joint_of[BIG_COLUMNS];

/* position[FRAMES][3] m and rotation[FRAMES][3][3] of the frames seen from the base, and the columns of their
   body-fixed Jacobians that can be other than 0: twist[COLUMNS][6], (v, omega) per unit joint rate. */
void NAME_ends(const double *q, double *position, double *rotation, double *twist);

/* P[6 FRAMES][6] and Q[6 FRAMES][JOINTS] of V_frames = P V_base + Q dq/dt, from the results of NAME_ends. */
void NAME_spread(const double *position, const double *rotation, const double *twist, double *P, double *Q);

/* Both in one call: P and Q at q. */
void NAME_velocity_model(const double *q, double *P, double *Q);

#ifdef __cplusplus
}
#endif

#endif /* BIG_H */
"""

SOURCE = """\
SHORT
#include "NAME.h"

#include <math.h>

const char *const NAME_joint_names[BIG_JOINTS] = {
JOINT_NAMES
};

const char *const NAME_frame_names[BIG_FRAMES] = {
FRAME_NAMES
};

const int NAME_first[BIG_FRAMES + 1] = {
FIRST
};

const int NAME_joint_of[BIG_COLUMNS] = {
JOINT_OF
};
"""

FUNCTIONS = """\
void NAME_ends(const double *q, double *position, double *rotation, double *twist)
{
BODY
}

void NAME_spread(const double *position, const double *rotation, const double *twist, double *P, double *Q)
{
    for (int c = 0; c < BIG_FRAMES; c++) {
        const double *p = position + 3 * c;
        double *block = P + 36 * c, *rows = Q + 6 * c * BIG_JOINTS;
        for (int i = 0; i < 3; i++) {
            const double *axis = rotation + 9 * c + i; /* axis i of the frame is a column */
            const double x = axis[0], y = axis[3], z = axis[6];
            double *v = block + 6 * i, *omega = block + 6 * (i + 3);
            v[0] = x;
            v[1] = y;
            v[2] = z;
            v[3] = p[1] * z - p[2] * y;
            v[4] = p[2] * x - p[0] * z;
            v[5] = p[0] * y - p[1] * x;
            omega[0] = 0.0;
            omega[1] = 0.0;
            omega[2] = 0.0;
            omega[3] = x;
            omega[4] = y;
            omega[5] = z;
        }
        for (int i = 0; i < 6 * BIG_JOINTS; i++)
            rows[i] = 0.0;
        for (int k = NAME_first[c]; k < NAME_first[c + 1]; k++)
            for (int i = 0; i < 6; i++)
                rows[i * BIG_JOINTS + NAME_joint_of[k]] = twist[6 * k + i];
    }
}

void NAME_velocity_model(const double *q, double *P, double *Q)
{
    double position[3 * BIG_FRAMES], rotation[9 * BIG_FRAMES], twist[6 * BIG_COLUMNS];
    NAME_ends(q, position, rotation, twist);
    NAME_spread(position, rotation, twist, P, Q);
}
"""

ARCS = """\
/* sin(x)/x; squares of what is below 1e-150 underflow */
static double sinc(double x)
{
    return fabs(x) > 1e-150 ? sin(x) / x : 1.0;
}

/* (x - sin x)/x^3 at z = x^2, given a = sin(x)/x */
static double arc_c(double z, double a)
{
    if (z < BELOW)
        return SERIES;
    return CLOSED;
}
"""


def c_source(robot: Robot, frames: tuple[int, ...], name: str | None) -> CSource:
    """Header and source for the frames with indices ``frames``."""
    word = identifier(robot.name if name is None else name, prefix="robot")
    program = compute(robot, frames, {joint: f"q[{i}]" for i, joint in enumerate(robot.joints)})
    targets = [robot.frames[frame] for frame in frames]
    units = ["rad" if kind == "angle" else "m" for kind in robot.kinds]
    about = [
        f"Kinematics of the robot {robot.name}: poses, body-fixed Jacobians and the velocity model of {len(frames)} "
        "frames. C99 without dependencies; written by bodyplan.",
        "",
        "Joint coordinates q:",
        *(f"{i:5d}  {joint} ({unit})" for i, (joint, unit) in enumerate(zip(robot.joints, units, strict=True))),
        "Frames:",
        *(f"{i:5d}  {target}" for i, target in enumerate(targets)),
        "",
        "Frames are seen from the base of the robot (x forward, y left, z up). Twists are (v, omega) in m/s and rad/s, "
        "body-fixed: both in the axes of their own frame, v at its origin. Matrices are stored row by row.",
    ]
    arcs = uses_arcs(line.value for line in program.lines if line.name is not None)
    words = {
        "ABOUT": comment(about),
        "SHORT": comment([f"Kinematics of the robot {robot.name}; see {word}.h. Written by bodyplan."]),
        "BODY": "\n".join(_body(program)),
        "JOINT_INDICES": indices(f"{word.upper()}_Q_", identifiers((j.upper() for j in robot.joints), "J")),
        "FRAME_INDICES": indices(f"{word.upper()}_AT_", identifiers((f.upper() for f in targets), "F")),
        "JOINT_NAMES": ",\n".join(f"    {literal(joint)}" for joint in robot.joints),
        "FRAME_NAMES": ",\n".join(f"    {literal(target)}" for target in targets),
        "FIRST": _numbers(program.first),
        "JOINT_OF": _numbers(program.joint_of),
        "N_JOINTS": str(robot.n),
        "N_FRAMES": str(len(frames)),
        "N_COLUMNS": str(len(program.joint_of)),
        "BIG": word.upper(),
        "NAME": word,
    }
    source = [
        filled(SOURCE, words),
        *([arc_function(str, ARCS, near="z", far="z")] if arcs else []),
        filled(FUNCTIONS, words),
    ]
    return CSource(word, filled(HEADER, words), "\n".join(source))


def _body(program: Program) -> list[str]:
    body: list[str] = []
    for line in program.lines:
        if line.name is None:
            body.append(comment([line.value], "    "))
        else:
            body.append(f"    const double {line.name} = {text(line.value, str)};")
    for c in range(len(program.positions)):
        axes, twists = program.rotations[c], program.twists[c].values()
        body.append("")
        body += [f"    position[{3 * c + i}] = {text(x, str)};" for i, x in enumerate(program.positions[c])]
        body += [f"    rotation[{9 * c + i}] = {text(x, str)};" for i, x in enumerate(x for axis in axes for x in axis)]
        body += [
            f"    twist[{6 * program.first[c] + i}] = {text(x, str)};"
            for i, x in enumerate(x for twist in twists for x in twist)
        ]
    return body


# --- pieces of C --------------------------------------------------------------------------------------------


def _numbers(values: Sequence[int]) -> str:
    return textwrap.indent("\n".join(textwrap.wrap(", ".join(map(str, values)), 100)), "    ")
