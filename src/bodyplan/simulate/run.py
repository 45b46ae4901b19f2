"""simulate: run a motion in MuJoCo."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from bodyplan.arrays import number, whole
from bodyplan.errors import InputError, Status
from bodyplan.motion import Motion
from bodyplan.simulate.friction import FloorFriction, Friction, as_friction
from bodyplan.simulate.library import mujoco, warnings_kept
from bodyplan.simulate.loop import Run, Timing
from bodyplan.simulate.measure import (
    cost_of_transport,
    height_of,
    lifts_of,
    planned_advance,
    progress_of,
    slips_of,
    tilt_of,
    turned_of,
    yaw_ratio_of,
)
from bodyplan.simulate.model import Physics, Servo, build
from bodyplan.simulate.reference import Reference, region
from bodyplan.simulate.start import Walls, on_the_floor
from bodyplan.simulate.terrain import CONTACT_STEPS
from bodyplan.simulate.trial import Trial
from bodyplan.simulate.wheels import TIPS, turning_remarks

#: most time steps of one run: a mistyped dt should not eat the machine
MOST_STEPS = 50_000_000
#: s within which a motion speeds up where nobody says
RAMP = 1.0
#: rad beyond the planned angles of a wheel's motor over which its radius is right
RANGE_ROOM = 0.1


def simulate(
    motion: Motion,
    *,
    cycles: int = 3,
    friction: FloorFriction = None,
    servo: Servo = None,
    dt: float = 1e-3,
    settle: float = 1.0,
    ramp: float | None = None,
    record_dt: float = 0.02,
    progress: Callable[[float], None] | bool | None = None,
    armature: float = 1e-3,
    arc_joints: int = 4,
    self_collision: bool = False,
    rim_tips: int = TIPS,
) -> Trial:
    """Execute ``motion`` in MuJoCo with a position servo on every actuated joint; deterministic.

    The robot is set on the floor in its first pose and settles for ``settle`` s, while walls and ceilings
    that the plan presses into close in (:mod:`bodyplan.simulate.start`). Then the motion speeds up from
    rest within ``ramp`` s. A motion that claims to be periodic is started half a ramp before its beginning,
    so that the first of ``cycles`` measured cycles begins in phase and at full speed; another motion runs
    once, ramp included. Default: 1 s, and none for a periodic motion that says that its cycles begin at rest
    (half a ramp earlier it would be in the middle of a step).

    ``friction`` of the floor: a coefficient, or :class:`Friction` (forward, backward, sideways) for scales;
    None: that of the ground, or else of the contact, or else 0.5. Walls keep their own. ``servo``: (kp, kv)
    of all joints, N m / rad and N m s / rad (N / m for lengths), or one such pair by joint name; default kp
    = 2 m g L with the robot's mass and length, kv = kp / 50 (:func:`bodyplan.simulate.default_servo`); torque
    is limited to the joint's effort. ``dt`` s: time step. ``record_dt`` s: between records. ``progress``:
    called with the part done in [0, 1]; True draws a bar in the terminal. ``armature``, ``arc_joints``,
    ``self_collision`` and ``rim_tips``: see :func:`bodyplan.simulate.build`.

    A wheel of adjustable radius becomes a ring of ``rim_tips`` balls on slides that follow its adjust joint by a
    polynomial, fitted over the angles that the motion uses (``settings["rim_law_error_m"]`` is how well); its spin is
    the motor. Contact angles are no joints of the physics: in ``Trial.q`` they are measured from the loads, and as
    planned where a wheel carries none.

    Returns a :class:`Trial`; physics that diverges is its status. Raises InputError for values out of range
    and for robots and grounds that cannot be simulated.
    """
    if not isinstance(motion, Motion):
        raise InputError(f"motion: expected a Motion, got {motion!r}.")
    if not motion.robot.contacts:
        raise InputError(
            f"robot {motion.robot.name!r}: has no contacts; it could only fall. Give it some: a file's meshes are none."
        )
    cycles = whole(cycles, "cycles", at_least=1, at_most=100_000)
    reference = Reference.of(motion)
    cycles = cycles if reference.period is not None else 1
    timing = Timing.of(
        reference,
        cycles,
        dt=number(dt, "dt", above=0.0),
        settle=number(settle, "settle", at_least=0.0),
        ramp=_ramp(motion) if ramp is None else number(ramp, "ramp", at_least=0.0),
        record_dt=number(record_dt, "record_dt", at_least=dt),
    )
    if timing.steps > MOST_STEPS:
        raise InputError(f"dt: {timing.steps} time steps are more than the {MOST_STEPS} allowed; got dt = {dt!r}.")
    floor = as_friction(friction)
    low, high = region(reference, cycles)
    physics = build(
        motion.robot,
        motion.ground,
        low,
        high,
        friction=floor,
        servo=servo,
        dt=dt,
        armature=armature,
        arc_joints=arc_joints,
        self_collision=self_collision,
        rim_tips=rim_tips,
        ranges=_ranges(motion),
    )
    planned = planned_advance(physics, reference, cycles)
    with warnings_kept() as remarks, _reporting(progress) as report:
        data = mujoco().MjData(physics.model)
        q = reference.joints(timing.first_phase)
        data.qpos[:] = physics.qpos(q, on_the_floor(motion.robot, q, reference.base(timing.first_phase), motion.ground))
        walls = Walls.around(physics, data)
        run = Run(physics, data, reference, timing, walls, report)
        run.go()
    records = run.records()
    start, period = timing.start_time, timing.span
    measures: dict[str, Any] = {"status": Status.DIVERGED.value, "reason": run.failure}
    if not run.failure:
        measures = progress_of(records, planned, start, period) | run.meter.per_joint(physics)
        positive, absolute = (float(w.sum()) * dt for w in (run.meter.positive, run.meter.absolute))
        weight = float(physics.model.body_mass.sum()) * float(np.linalg.norm(physics.model.opt.gravity))
        measures |= {
            "turned": turned_of(records, reference, timing.phase, start, period, cycles),
            "yaw_ratio": yaw_ratio_of(records, reference, timing.phase, start),
            "slip_angle": run.sliding.angle,
            "tilt": tilt_of(records, reference, timing.phase, start),
            **dict(zip(("height_rms", "height_max"), height_of(records, reference, timing.phase, start), strict=True)),
            "slips": slips_of(motion, records, planned, timing.time_of, period),
            "lifts": lifts_of(motion, records, reference, timing.phase, timing.time_of, period, cycles),
            "positive_work": positive,
            "absolute_work": absolute,
            "cost_of_transport": cost_of_transport(positive, weight, measures["speed"] * cycles * period),
        }
    return Trial(
        joints=motion.robot.joints,
        kinds=motion.robot.kinds,
        **{name: getattr(records, name) for name in ("t", "base", "q", "torque", "com")},
        start_time=start,
        period=period,
        cycles=cycles,
        planned_advance=planned,
        **measures,
        warnings=(
            *_remarks_on(motion),
            *run.warnings(),
            *turning_remarks(motion.robot, measures.get("yaw_ratio")),
            *(f"MuJoCo: {text}" for text in dict.fromkeys(remarks)),
        ),
        settings=_settings(physics, timing, floor, walls)
        | {
            "armature": armature,
            "arc_joints": arc_joints,
            "self_collision": self_collision,
        }
        | physics.wheels.settings(),
    )


def _ranges(motion: Motion) -> dict[str, tuple[float, float]]:
    """The angles that the motors of wheels use, with some room, by joint."""
    robot, out = motion.robot, {}
    for contact in robot.contacts:
        if contact.drive is not None:
            column = robot.joint_index(contact.drive.joint.name)
            q, (low, high) = motion.q[:, column], robot.limits[column]
            used = np.clip([q.min() - RANGE_ROOM, q.max() + RANGE_ROOM], low, high)
            out[contact.drive.joint.name] = (float(used[0]), float(used[1]))
    return out


def _ramp(motion: Motion) -> float:
    """s within which a motion speeds up where nobody says."""
    at_rest = any(claim.kind == "periodic" and claim.data.get("from_rest") for claim in motion.claims)
    return 0.0 if at_rest else RAMP


def _remarks_on(motion: Motion) -> list[str]:
    bad = int(np.sum(motion.status != Status.OK.value))
    return [f"{bad} of {len(motion.t)} samples of the plan were not solved"] if bad else []


def _settings(physics: Physics, timing: Timing, floor: float | Friction | None, walls: Walls) -> dict[str, Any]:
    robot = physics.robot
    gains = {robot.joints[c]: [float(kp), float(kv)] for c, (kp, kv) in zip(physics.servos, physics.gains, strict=True)}
    same = next(iter(gains.values()), None)
    return {
        "friction": floor.to_dict() if isinstance(floor, Friction) else floor,
        "servo": same if all(pair == same for pair in gains.values()) else gains,
        "dt": timing.dt,
        "contact_time": CONTACT_STEPS * timing.dt,
        "settle": timing.settle,
        "ramp": timing.ramp,
        "record_dt": timing.every * timing.dt,
        "walls_stood_back_m": walls.depth,
        "mujoco": mujoco().__version__,
    }


@contextmanager
def _reporting(progress: Callable[[float], None] | bool | None) -> Iterator[Callable[[float], None] | None]:
    """The function to call with the part done."""
    if not isinstance(progress, bool):
        yield progress
    elif not progress:
        yield None
    else:
        from rich.progress import Progress

        with Progress(transient=True) as bar:
            task = bar.add_task("simulating", total=1.0)
            yield lambda part: bar.update(task, completed=part)
