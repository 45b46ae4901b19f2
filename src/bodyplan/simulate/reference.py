"""The planned motion as a function of phase: what the servos are told, cycle after cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.motion import Motion
from bodyplan.spatial.rotations import canonical, conjugate, multiply, quaternion_exp, quaternion_log, rotate


@dataclass(frozen=True, eq=False)
class Reference:
    """A motion on the phase axis (s): phase 0 is its first sample.

    ``period``: s after which it repeats, moved by the displacement of the base; None where it runs once.
    ``duration``: s of one run, the period or the length of the motion.
    """

    motion: Motion
    period: float | None
    duration: float

    @classmethod
    def of(cls, motion: Motion) -> Reference:
        """Repeats with the period that the motion's ``periodic`` claim names, unless the motion is
        shorter."""
        length = float(motion.t[-1] - motion.t[0])
        for claim in motion.claims:
            if claim.kind == "periodic":
                period = float(claim.data["period"])
                if not period > 0.0:
                    raise InputError(f"periodic claim {claim.label!r}: period must be > 0, got {period!r}.")
                if period <= length * (1.0 + 1e-9):
                    period = min(period, length)
                    return cls(motion, period, period)
        return cls(motion, None, length)

    def joints(self, phase: ArrayLike) -> Array:
        """Joint coordinates (..., n) at phases (...,): the cubic Hermite interpolant of q and dq/dt.
        Outside a motion that does not repeat, its first or last sample."""
        t, q, qd = self.motion.t, self.motion.q, self.motion.qd
        time = t[0] + self._within(np.asarray(phase, dtype=np.float64))[1]
        i = np.clip(np.searchsorted(t, time, side="right") - 1, 0, len(t) - 2)
        h = (t[i + 1] - t[i])[..., None]
        s = np.clip((time - t[i])[..., None] / h, 0.0, 1.0)
        # Hermite basis
        rise = s * s * (3.0 - 2.0 * s)
        out = q[i] + rise * (q[i + 1] - q[i])
        out += h * s * (1.0 - s) * ((1.0 - s) * qd[i] - s * qd[i + 1])
        return np.asarray(out)

    def base(self, phase: float) -> Array:
        """Planned pose (7,) of the base at one phase, cycles before and after the first included."""
        return np.asarray(self.bases(np.array([float(phase)]))[0])

    def bases(self, phases: ArrayLike) -> Array:
        """Planned poses (k, 7) of the base at phases (k,), cycles before and after the first included."""
        cycle, time = self._within(np.asarray(phases, dtype=np.float64))
        poses = self._samples(time)
        if self.period is None:
            return poses
        first, last = self._samples(np.array([0.0, self.period]))
        # world motion of one cycle: last = step * first
        turn = multiply(last[3:], conjugate(first[3:]))
        step = np.concatenate([last[:3] - rotate(turn, first[:3]), turn])
        back = np.concatenate([-rotate(conjugate(turn), step[:3]), conjugate(turn)])
        for number in np.unique(cycle):
            mine = cycle == number
            poses[mine] = _compose(_power(back if number < 0 else step, abs(int(number))), poses[mine])
        poses[:, 3:] = canonical(poses[:, 3:])
        return poses

    def _within(self, phase: Array) -> tuple[Array, Array]:
        """(cycle number, s since its start)."""
        if self.period is None:
            return np.zeros_like(phase), np.clip(phase, 0.0, self.duration)
        cycle = np.floor(phase / self.period)
        return cycle, np.clip(phase - cycle * self.period, 0.0, self.period)

    def _samples(self, times: Array) -> Array:
        """Base poses (k, 7) at ``times`` (k,) s after the first sample: between samples linear, turning evenly."""
        t, base = self.motion.t, self.motion.base
        i = np.clip(np.searchsorted(t, t[0] + times, side="right") - 1, 0, len(t) - 2)
        s = np.clip((t[0] + times - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0)[:, None]
        a, b = base[i], base[i + 1]
        step = quaternion_log(multiply(conjugate(a[:, 3:]), b[:, 3:]))
        turned = multiply(a[:, 3:], quaternion_exp(s * step))
        return np.concatenate([a[:, :3] + s * (b[:, :3] - a[:, :3]), turned], axis=1)


def _compose(a: Array, b: Array) -> Array:
    """The rigid motions (..., 7) b followed by a (7,)."""
    return np.concatenate([a[:3] + rotate(a[3:], b[..., :3]), multiply(a[3:], b[..., 3:])], axis=-1)


def _power(step: Array, times: int) -> Array:
    """The rigid motion ``step`` done so many times over, by repeated squaring."""
    out = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    while times:
        if times & 1:
            out = _compose(step, out)
        step, times = _compose(step, step), times >> 1
    return out


def region(reference: Reference, cycles: int) -> tuple[Array, Array]:
    """A box (3,), (3,) m that holds the planned robot in so many cycles, with room around it."""
    motion = reference.motion
    positions = motion.poses().positions
    reach = float(np.max(np.linalg.norm(positions - motion.base[:, None, :3], axis=-1), initial=0.0))
    size = max(
        (c.radius + float(np.abs((*c.start, *c.end, *c.half)).max()) for c in motion.robot.contacts),
        default=0.0,
    )
    path = motion.base[:, :3]
    if reference.period is not None:
        phases = np.linspace(0.0, cycles * reference.period, 8 * min(cycles, 64) + 1)
        path = np.concatenate([path, reference.bases(phases)[:, :3]])
    margin = 2.0 * reach + 2.0 * size + 0.1
    return path.min(axis=0) - margin, path.max(axis=0) + margin
