"""Motion as a C99 header for a microcontroller: the sampled joints, and a function that interpolates them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.export.sampled import Sampled, sampled
from bodyplan.files import replacing
from bodyplan.motion import Motion
from bodyplan.robot.source_text import comment, filled, identifier, identifiers, indices, literal

DTYPES = ("float", "double")
INTERPOLATIONS = ("cubic", "linear")

HEADER = """\
ABOUT
#ifndef BIG_H
#define BIG_H

typedef DTYPE NAME_real;

#define BIG_JOINTS N_JOINTS
#define BIG_SAMPLES N_SAMPLES
#define BIG_DURATION DURATION_S /* s */
STEP

/* column of a joint */
enum {
JOINT_INDICES
};

static const char *const NAME_joint_names[BIG_JOINTS] = {
JOINT_NAMES
};

TIMES/* positions: rad, or m of joints that slide */
static const NAME_real NAME_q[BIG_SAMPLES][BIG_JOINTS] = {
VALUES
};

RATES/* Positions q[JOINTS], and rates qd[JOINTS] per s unless it is null, at time t in s. Before the start and after
   the end the joints rest where they start and end. Returns -1 before the start, 1 after the end, 0 in between. */
static inline int NAME_at(NAME_real t, NAME_real *q, NAME_real *qd)
{
    if (!(t >= 0) || t > BIG_DURATION) {
        const NAME_real *rest = NAME_q[t > BIG_DURATION ? BIG_SAMPLES - 1 : 0];
        for (int j = 0; j < BIG_JOINTS; j++) {
            q[j] = rest[j];
            if (qd)
                qd[j] = 0;
        }
        return t > BIG_DURATION ? 1 : -1;
    }
INTERVAL
    for (int j = 0; j < BIG_JOINTS; j++) {
        const NAME_real d = NAME_q[i + 1][j] - NAME_q[i][j];
INTERPOLATE
    }
    return 0;
}

#endif /* BIG_H */
"""

TIMES = """\
/* times, s */
static const NAME_real NAME_t[BIG_SAMPLES] = {
TIME_VALUES
};

"""

RATES = """\
/* rates, per s */
static const NAME_real NAME_qd[BIG_SAMPLES][BIG_JOINTS] = {
RATE_VALUES
};

"""

EVEN = """\
    long i = (long)(t / BIG_DT);
    if (i > BIG_SAMPLES - 2)
        i = BIG_SAMPLES - 2;
    const NAME_real h = BIG_DT, u = t / BIG_DT - (NAME_real)i;"""

UNEVEN = """\
    long i = 0, end = BIG_SAMPLES - 1;
    while (end - i > 1) {
        const long middle = i + (end - i) / 2;
        if (NAME_t[middle] <= t)
            i = middle;
        else
            end = middle;
    }
    const NAME_real h = NAME_t[i + 1] - NAME_t[i], u = (t - NAME_t[i]) / h;"""

CUBIC = """\
        const NAME_real a = h * NAME_qd[i][j] - d, b = d - h * NAME_qd[i + 1][j];
        const NAME_real c = (1 - u) * a + u * b;
        q[j] = NAME_q[i][j] + u * (d + (1 - u) * c);
        if (qd)
            qd[j] = (d + (1 - 2 * u) * c + u * (1 - u) * (b - a)) / h;"""

LINEAR = """\
        q[j] = NAME_q[i][j] + u * d;
        if (qd)
            qd[j] = d / h;"""


def write(
    motion: Motion,
    path: str | os.PathLike[str],
    *,
    dtype: str = "float",
    rate: float | None = None,
    interpolation: str = "cubic",
    joints: str = "actuated",
) -> None:
    """Write the header to ``path``; its stem begins every name in it.

    ``dtype``: "float" or "double". ``rate``: samples a second, the motion's own where None. ``interpolation``:
    "cubic" (Hermite, meets positions and rates of the samples) or "linear" (half the memory). ``joints``: "actuated"
    or "all". Raises InputError, also where ``path`` is the header of a kinematics source.
    """
    from bodyplan.export.c_model import is_model_header

    if is_model_header(Path(path)):
        raise InputError(f"{path}: belongs to the C source of a robot beside it; choose another name.")
    with replacing(path) as file:
        file.write(text(sampled(motion, rate, joints), Path(path).stem, motion.robot.name, dtype, interpolation))


def text(track: Sampled, name: str, robot: str, dtype: str = "float", interpolation: str = "cubic") -> str:
    """The header that :func:`write` writes; ``name`` begins every name in it, made a valid one."""
    for field, value, allowed in (("dtype", dtype, DTYPES), ("interpolation", interpolation, INTERPOLATIONS)):
        if value not in allowed:
            raise InputError(f"{field}: must be {' or '.join(allowed)}, got {value!r}.")
    word = identifier(name, prefix="trajectory")
    kind = np.float32 if dtype == "float" else np.float64
    number = _Numbers(kind)
    even, cubic = track.step is not None, interpolation == "cubic"
    if not even and np.any(np.diff(track.t.astype(kind)) <= 0.0):
        raise InputError(f"dtype: times are too close to each other for {dtype}; use double, or a rate.")
    arrays = (2 if cubic else 1) * track.q.size + (0 if even else len(track.t))
    about = [
        f"Trajectory of the robot {robot}: {len(track.names)} joints, {len(track.t)} samples, "
        f"{float(track.t[-1]):.6g} s, {arrays * np.dtype(kind).itemsize} bytes. C99 without dependencies; written by "
        f"bodyplan. Call {word}_at(t, q, qd) in the control loop.",
        "",
        "Joints:",
        *(f"{i:5d}  {joint} ({unit})" for i, (joint, unit) in enumerate(zip(track.names, track.units, strict=True))),
    ]
    template = filled(
        HEADER,
        {
            "STEP": "#define BIG_DT STEP_S /* s between samples */" if even else "/* samples are unevenly spaced */",
            "TIMES": "" if even else TIMES,
            "RATES": RATES if cubic else "",
            "INTERVAL": EVEN if even else UNEVEN,
            "INTERPOLATE": CUBIC if cubic else LINEAR,
        },
    )
    words = {
        "ABOUT": comment(about),
        "DTYPE": dtype,
        "N_JOINTS": str(len(track.names)),
        "N_SAMPLES": str(len(track.t)),
        "DURATION_S": number.one(track.t[-1]),
        "STEP_S": number.one(track.step or 0.0),
        "JOINT_INDICES": indices(f"{word.upper()}_Q_", identifiers((n.upper() for n in track.names), "J")),
        "JOINT_NAMES": ",\n".join(f"    {literal(joint)}" for joint in track.names),
        "TIME_VALUES": number.row(track.t),
        "VALUES": number.table(track.q),
        "RATE_VALUES": number.table(track.qd),
        "BIG": word.upper(),
        "NAME": word,
    }
    return filled(template, words)


class _Numbers:
    """Numbers as literals of C that read back equal in single or double precision."""

    def __init__(self, kind: type[np.floating]) -> None:
        self.kind, self.suffix = kind, "f" if kind is np.float32 else ""

    def one(self, value: float) -> str:
        out = str(self.kind(value))
        return (out if "." in out or "e" in out else out + ".0") + self.suffix

    def row(self, values: Array) -> str:
        return "    " + ", ".join(map(self.one, values))

    def table(self, values: Array) -> str:
        return ",\n".join(f"    {{{', '.join(map(self.one, row))}}}" for row in values)
