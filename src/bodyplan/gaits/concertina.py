"""Concertina: the body folds against the ground or walls, an extension runs through it, and it moves on.

Paper *concertina*, sections III-VI, with the corrections of its note; and the travelling extension wave, which never
stretches the whole body at once and so keeps folds gripping at both ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, ClassVar

import numpy as np

from bodyplan.arrays import Array, finite, number, whole
from bodyplan.errors import InputError, Status, UnknownNameError
from bodyplan.fitting.exact_length import exact_link_length
from bodyplan.fitting.links import links_on_curve
from bodyplan.gaits.base import Gait, from_zero
from bodyplan.gaits.concertina_claims import claims_of, notes_of
from bodyplan.gaits.cycle import ExtensionCycle
from bodyplan.gaits.planar import PlanarSnake, level_floor, planar_snake, resting_radius
from bodyplan.gaits.stretching import BLENDS, StretchingBody, stretching
from bodyplan.gaits.sweep import ExtensionSweep, LiteralSweep, Sweep
from bodyplan.ground import Corridor, Ground
from bodyplan.motion import Motion
from bodyplan.robot.model import Robot

CONTRACTIONS = ("travelling", "mirror", "literal")


class Concertina(Gait):
    """Concertina gait of a snake with yaw joints on a level floor, between walls or with scales.

    ``body_modules`` N_B >= 1 half waves between tail and head; ``gamma_max`` in (0, 1) of a stretched module;
    ``omega`` > 0 of the dynamic curve. ``contraction``:

    * ``"travelling"`` (default): an extension of constant length, ``extension`` in (0, 1] of the full gain, runs from
      head to tail; ``waves`` of them follow each other, the next launched when the one before is 1/waves through.
      N_B must be even (for odd N_B the cycle does not close).
    * ``"mirror"``: stretch the whole body (IV.A), then contract it by the point reflection of the time-reversed
      stretching (correction 6; for odd N_B by the line reflection, which is what closes it).
    * ``"literal"``: stretch, then contract as IV.B prints it: flat for most of the time, then all at once.

    ``stretch_time`` s for one stretching; a whole sweep takes twice as long unless ``max_joint_rate`` (rad/s) sets the
    time. ``warp``: a time warp that keeps the largest joint rate constant; default: for "travelling", and wherever
    ``max_joint_rate`` is given.
    ``overlap`` in [0, 1): a stage begins while that share of the one before is still to come (section VI).
    ``rates``: N_B + 2 relative speeds of tail, modules and head. ``blend``: gamma changes evenly ("linear") or by a C2
    quintic ("smooth": accelerations stay finite). ``length_unit``: metres per curve unit; default: the one with which
    the links cover the contracted curve exactly.

    Raises InputError for values outside these ranges.
    """

    kind: ClassVar[str] = "concertina"
    UNITS: ClassVar[Mapping[str, str]] = {
        "stretch_time": "time",
        "max_joint_rate": "angular_rate",
        "length_unit": "length",
    }

    def __init__(
        self,
        body_modules: int = 4,
        gamma_max: float = 0.8,
        omega: float = 1.0,
        *,
        stretch_time: float = 5.0,
        contraction: str = "travelling",
        extension: float = 0.7,
        waves: int = 1,
        blend: str = "linear",
        overlap: float = 0.0,
        rates: Sequence[float] | None = None,
        max_joint_rate: float | None = None,
        warp: bool | None = None,
        length_unit: float | None = None,
        crossing: int = 2,
    ) -> None:
        self.body_modules = whole(body_modules, "body_modules", at_least=1, at_most=200)
        self.crossing = whole(crossing, "crossing", at_least=1, at_most=100)
        self.gamma_max = number(gamma_max, "gamma_max", above=0.0, below=1.0)
        self.omega = number(omega, "omega", above=0.0)
        self.stretch_time = number(stretch_time, "stretch_time", above=0.0)
        if contraction not in CONTRACTIONS:
            raise UnknownNameError("contraction", contraction, CONTRACTIONS)
        self.contraction = contraction
        if contraction == "travelling" and (self.body_modules + self.crossing) % 2:
            raise InputError(
                f"body_modules: must be even for contraction='travelling', got {body_modules}: with an odd number the "
                "contracted body is not its own reversal and the cycle does not close (odd where crossing is odd)."
            )
        self.extension = number(extension, "extension", above=0.0, at_most=1.0)
        self.waves = whole(waves, "waves", at_least=1, at_most=20)
        if contraction != "travelling" and self.waves != 1:
            raise InputError(f"waves: several waves need contraction='travelling', got {waves} with {contraction!r}.")
        if blend not in BLENDS:
            raise UnknownNameError("blend", blend, BLENDS)
        self.blend = blend
        self.overlap = number(overlap, "overlap", at_least=0.0, below=1.0)
        self.rates: tuple[float, ...] | None = None
        if rates is not None:
            values = finite(rates, "rates", (self.body_modules + 2,))
            if np.any(values <= 0.0):
                raise InputError(f"rates: every rate must be > 0, got {values.min()}.")
            self.rates = tuple(float(v) for v in values)
        self.max_joint_rate = None if max_joint_rate is None else number(max_joint_rate, "max_joint_rate", above=0.0)
        if warp is not None and not isinstance(warp, bool):
            raise InputError(f"warp: must be true or false, got {warp!r}.")
        self.warp = warp
        self.length_unit = None if length_unit is None else number(length_unit, "length_unit", above=0.0)

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        names = (
            "body_modules",
            "gamma_max",
            "omega",
            "stretch_time",
            "contraction",
            "extension",
            "waves",
            "blend",
            "overlap",
            "rates",
            "max_joint_rate",
            "warp",
            "length_unit",
            "crossing",
        )
        options = {name: getattr(self, name) for name in names}
        if self.rates is not None:
            options["rates"] = list(self.rates)
        return {"kind": self.kind, **options}

    @property
    def reversal_sign(self) -> float:
        """+1 where the contracted curve, N_B + crossing half waves, is its own point reflection; -1 where it is its own
        mirror image (x -> -x)."""
        return 1.0 if (self.body_modules + self.crossing) % 2 == 0 else -1.0

    def body(self, robot: Robot) -> ConcertinaBody:
        """The gait fitted to one robot: unit, contracted pose, sweep and cycle. Raises InputError or SolveError."""
        return _fitted(self, robot)

    def period(self, robot: Robot, ground: Ground | None = None) -> float:
        """Time of one cycle, s: a sweep, or its share between two waves."""
        return self.body(robot).cycle.period

    def variants(self) -> dict[str, Gait]:
        """The same gait with both blends: how gamma changes decides the accelerations."""
        options = {name: value for name, value in self.to_dict().items() if name != "kind"}
        return {f"{blend} blend": Concertina(**{**options, "blend": blend}) for blend in BLENDS}

    def plan(self, robot: Robot, ground: Ground, t: Array) -> Motion:
        """The motion at times t (T,) s, from t = 0 on: the tail end starts at the world's origin, heading x."""
        from_zero(t)
        body = self.body(robot)
        state = body.cycle.state(t)
        snake, unit = body.snake, body.unit
        q, qd, qdd = (snake.joints(a, robot.n) for a in (state.angles, state.rates, state.accelerations))
        steps = snake.lengths[:, None] * np.stack([np.cos(state.angles), np.sin(state.angles)], axis=-1)
        tail = state.tail * unit
        points = np.concatenate([tail[:, None, :], tail[:, None, :] + np.cumsum(steps, axis=1)], axis=1)
        walls = _wall_overlap(robot, ground, points)
        floor = level_floor(ground, points, "Concertina")
        base = np.zeros((len(t), 7))
        base[:, :2], base[:, 2] = tail, floor + resting_radius(robot)
        base[:, 3], base[:, 6] = np.cos(0.5 * state.angles[:, 0]), np.sin(0.5 * state.angles[:, 0])
        frames = [robot.frame_index(name) for name in snake.frames]
        made = robot.forward(q, base).positions[:, frames, :2]
        residual = np.linalg.norm(made - points, axis=-1).max(axis=1)
        if residual.max() > 1e-6 * snake.length:
            raise InputError(
                f"Concertina: needs straight links between yaw joints; {robot.name!r} bends otherwise "
                f"(its joints miss the planned places by {residual.max():.3g} m)."
            )
        status = np.full(len(t), Status.OK.value if body.tight < 0 else Status.TOO_TIGHT.value, dtype="U24")
        facts = body.facts(q)
        if walls is not None:
            facts["squeeze"] = 2.0 * walls
        return Motion(
            robot=robot,
            ground=ground,
            gait=self.to_dict(),
            t=t,
            base=base,
            q=q,
            qd=qd,
            qdd=qdd,
            residual=residual,
            status=status,
            claims=claims_of(body, state, t, tail, made, walls),
            facts=facts,
            stages=tuple(
                (w.name + (f" (wave {k + 1})" if self.waves > 1 else ""), a, b) for w, k, a, b in body.cycle.windows()
            ),
            notes=notes_of(self, body, walls),
        )


@dataclass(frozen=True)
class ConcertinaBody:
    """A :class:`Concertina` fitted to a robot. ``unit`` m per curve unit; ``lead`` (curve units) of straight body
    beyond the contracted curve; ``contracted`` (n + 1, 2) joints of the contracted body, curve units; ``tight`` the
    first link too long for its fold, or -1."""

    gait: Concertina
    snake: PlanarSnake
    unit: float
    lead: float
    contracted: Array
    tight: int
    width: float
    sweep: Sweep
    cycle: ExtensionCycle

    @classmethod
    def of(cls, gait: Concertina, robot: Robot) -> ConcertinaBody:
        """Fit the gait to the robot. Raises InputError when the links are too short for ``length_unit``, SolveError
        when no unit makes them cover the curve exactly."""
        snake = planar_snake(robot, "Concertina")
        ratios = snake.lengths / snake.lengths.mean()
        exact = exact_link_length(ratios, gait.body_modules, gait.omega, crossing=gait.crossing)
        if gait.length_unit is None:
            if exact.status == Status.NO_EXACT_LENGTH.value:
                exact.raise_if_failed()
            unit = float(snake.lengths.mean() / exact)
        else:
            unit = gait.length_unit
        lengths = snake.lengths / unit
        rates = np.ones(gait.body_modules + 2) if gait.rates is None else np.array(gait.rates)
        plain = gait.body_modules, gait.gamma_max, rates, gait.overlap, gait.blend
        stages = stretching(*plain)
        front = StretchingBody(stages, lengths, gait.omega, gait.crossing)
        curve = front.curve(np.array([0.0]))
        fit = links_on_curve(curve, lengths)
        end = float(curve.flat_from[0])
        lead = float(fit.points[0, -1, 0]) - end
        if lead < -1e-9 * end:
            hint = "" if np.isnan(exact) else f" {float(snake.lengths.mean() / exact):.9g} m fits exactly;"
            raise InputError(
                f"length_unit: at {unit:.6g} m the links are too short for the contracted curve and the head would "
                f"stay off the axis, so that the body drifts sideways;{hint} choose that or less."
            )
        lead = 0.0 if lead < 1e-9 * end else lead
        back = StretchingBody(stages, lengths[::-1].copy(), gait.omega, gait.crossing, lead)
        sweep: Sweep
        if gait.contraction == "literal":
            contraction = StretchingBody(
                stretching(*plain, literal_contraction=True), lengths, gait.omega, gait.crossing
            )
            sweep = LiteralSweep(front, contraction)
        else:
            extension = gait.extension if gait.contraction == "travelling" else 1.0
            sweep = ExtensionSweep(front, back, extension, sign=gait.reversal_sign)
        constant_rate = gait.contraction == "travelling" or gait.max_joint_rate is not None
        warp = constant_rate if gait.warp is None else gait.warp
        cycle = ExtensionCycle(
            sweep, lengths, gait.waves, 2.0 * gait.stretch_time, gait.max_joint_rate, warp, gait.blend
        )
        contracted = fit.points[0]
        radius = _radius(robot)
        width = float(np.ptp(contracted[:, 1])) * unit + 2.0 * radius
        grid = np.linspace(0.0, stages.total, 65)
        chains = [front, sweep.contraction if isinstance(sweep, LiteralSweep) else back]
        tight = max(int(chain.at(grid).tight.max()) for chain in chains)
        if not isinstance(sweep, LiteralSweep):
            # near-tight links may lie differently read from the head: the cycle would tear
            tail_first, head_first = (chain.at(grid[:1]).angles[0] for chain in (front, back))
            apart = np.abs(tail_first - gait.reversal_sign * head_first[::-1])
            if apart.max() > 1e-9:
                tight = max(tight, int(apart.argmax()))
        return cls(gait, snake, unit, lead, contracted, tight, width, sweep, cycle)

    def facts(self, q: Array) -> dict[str, float]:
        """Numbers of the plan, SI."""
        length = self.snake.length
        advance = float(self.cycle.advance[0]) * self.unit
        out = {
            "period": self.cycle.period,
            "advance_per_cycle": advance,
            "sideways_per_cycle": float(self.cycle.advance[1]) * self.unit,
            "advance_per_body_length": advance / length,
            "speed": advance / self.cycle.period,
            "length_unit": self.unit,
            "full_gain": self.sweep.gain * self.unit,
            "contracted_width": self.width,
            "contracted_length": float(self.contracted[-1, 0]) * self.unit,
            "body_length": length,
            "largest_joint_angle": float(np.abs(q).max(initial=0.0)),
            **self.peaks,
        }
        if self.gait.contraction == "travelling":
            out["extension_in_flight"] = self.gait.extension * self.sweep.gain * self.unit
        return out

    @cached_property
    def peaks(self) -> dict[str, float]:
        """Largest joint rate of a cycle, on a grid of its own (samples may miss it) or as its limit has found it; and,
        for the smooth blend, the largest acceleration: with the linear blend rates jump and it has none."""
        found = self.cycle.peak_rate
        if found is not None and self.gait.blend == "linear" and np.ptp(self.snake.scale) == 0.0:
            return {"peak_joint_rate": found / float(np.abs(self.snake.scale[0]))}
        state = self.cycle.state(np.linspace(0.0, self.cycle.period, 4001)[:-1])
        scale = np.abs(self.snake.scale)
        out = {"peak_joint_rate": float((np.abs(np.diff(state.rates, axis=1)) / scale).max())}
        if self.gait.blend == "smooth":
            out["peak_joint_acceleration"] = float((np.abs(np.diff(state.accelerations, axis=1)) / scale).max())
        return out


@lru_cache(maxsize=8)
def _fitted(gait: Concertina, robot: Robot) -> ConcertinaBody:
    return ConcertinaBody.of(gait, robot)


def _radius(robot: Robot) -> float:
    return max((c.radius for c in robot.contacts), default=0.0)


def _wall_overlap(robot: Robot, ground: Ground, joints: Array) -> float | None:
    """Deepest planned overlap of the body with the walls of a corridor, m a side; None without walls.

    InputError where even the middle of the body would be inside a wall.
    """
    if not isinstance(ground, Corridor):
        return None
    radius = _radius(robot)
    reach = float(np.abs(joints[..., 1]).max())
    if reach >= 0.5 * ground.width:
        raise InputError(
            f"Concertina: the contracted body needs {2.0 * (reach + radius):.4g} m between the walls, the corridor has "
            f"{ground.width:.4g} m; use more body_modules, a smaller omega or shorter links."
        )
    return reach + radius - 0.5 * ground.width
