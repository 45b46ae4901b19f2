"""Wheels that change their radius while they roll, in MuJoCo, and where wheels touch.

A rim whose radius follows a joint q is a ring of balls on radial slides of the hub. Each slide is tied to one hinge,
the adjust motor, by an equality slide = polynomial(q). A size that changes at run time would do as well for the shape,
but it costs its motor nothing; slides pass every load on to q, so that the motor's torque is that of virtual work.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.robot.model import Robot
from bodyplan.simulate.library import mujoco
from bodyplan.simulate.rims import Pointer, Ring, pointers_of, rims_of
from bodyplan.spatial.rotations import rotate

#: balls of a ring. Between two of them a wheel sinks by R (pi / TIPS)^2 / 2, 0.5 % of its radius
TIPS = 32
#: armature of all slides of a ring over the robot's mass: no weight, no load of the motor at rest; ties and contacts of
#: a light tip get the stiffness of a heavier one
SLIDE_ARMATURE = 0.02
#: time constant of ties in time steps, and their impedance (solimp): with MuJoCo's own a light tip sinks by centimetres
#: under the load of a wheel
TIE_STEPS, TIE = 2.0, (0.999, 0.999, 1e-3, 0.5, 2.0)
#: contacts of rims: time constant in time steps, impedance that it is meant for, and softness, that is acceleration per
#: load, over 1 / mass of the robot. See :func:`soften`
RIM_STEPS, RIM_IMPEDANCE, RIM_SOFTNESS = 2.0, 0.9, 50.0
#: how much stiffer contacts of rims are along the ground than across it: they creep down a slope of 10 % by 0.1 mm/s
RIM_IMPRATIO = 100.0
#: least armature of a wheel's motors over kv dt. A servo's damping is integrated implicitly, ties and contacts do not
#: know of it: on a lighter hinge they push more than it takes up, a ring shakes itself to pieces and a wheel that slips
#: chatters with a part of its friction
MOTOR_ARMATURE = 4.0
#: share of the planned turn below which a robot on wheels cannot turn
TURNS = 0.8
#: sine of the angle between axles that are parallel; m between axles that are on one line
PARALLEL = 1e-6
RUBBER = (0.2, 0.2, 0.22, 1.0)


def tip_names(contact: str, tips: int) -> list[str]:
    """Names of the balls of a ring, and of their bodies and slides."""
    return [f"{contact}~{k + 1}" for k in range(tips)]


def add_motor(axle: Any, joint: str, armature: float, speck: float) -> Any:
    """The adjust motor's hinge, on a body as good as massless at the wheel's axle."""
    mj = mujoco()
    body = axle.add_body(name=f"{joint}~motor")
    _ball(body, speck, speck)
    return body.add_joint(name=joint, type=mj.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0], armature=armature)


def _ball(body: Any, mass: float, moment: float) -> None:
    body.mass, body.ipos, body.explicitinertial = mass, np.zeros(3), True
    body.fullinertia = [moment, moment, moment, 0.0, 0.0, 0.0]


def add_ring(spec: Any, hub: Any, ring: Ring, tips: int, robot_mass: float) -> None:
    """The balls of a ring, their slides, and the ties to the motor's hinge."""
    mj, contact = mujoco(), ring.rim.contact
    each = ring.mass / tips
    angles = 2.0 * np.pi * np.arange(tips) / tips
    for name, angle in zip(tip_names(contact.name, tips), angles, strict=True):
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        body = hub.add_body(name=name, pos=np.array(contact.start) + ring.rest * out)
        _ball(body, each, 0.4 * each * ring.tip**2)
        body.add_joint(
            name=name,
            type=mj.mjtJoint.mjJNT_SLIDE,
            axis=out,
            armature=SLIDE_ARMATURE * robot_mass / tips,
        )
        body.add_geom(
            name=name,
            type=mj.mjtGeom.mjGEOM_SPHERE,
            size=[ring.tip, 0.0, 0.0],
            contype=0,
            conaffinity=0,
            mass=0.0,
            rgba=RUBBER,
        )
        tie = spec.add_equality(name=name, type=mj.mjtEq.mjEQ_JOINT, name1=name, name2=ring.joint)
        tie.data[:5] = ring.law
        tie.solref, tie.solimp = [TIE_STEPS * spec.option.timestep, 1.0], TIE


@dataclass(frozen=True, eq=False)
class Wheels:
    """The wheels of a compiled model.

    ``slides`` (K,) places in qpos of all slides, ``columns`` (K,) the column of q that each follows by ``laws``
    (K, 5). ``pointers`` the joints that are outcomes; ``axles`` (P,) the bodies that they turn about, and ``geoms``
    the shapes of their rims. ``rings`` what the wheels were made from, ``tips`` of each; ``shapes`` names of the shapes
    of all rims.
    """

    rings: tuple[Ring, ...]
    tips: int
    shapes: tuple[str, ...]
    slides: IntArray
    columns: IntArray
    laws: Array
    pointers: tuple[Pointer, ...]
    axles: IntArray
    geoms: tuple[IntArray, ...]

    @classmethod
    def of(cls, model: Any, robot: Robot, rings: Sequence[Ring], tips: int) -> Wheels:
        """The wheels of a model that has been built with these ``rings``."""
        made = {ring.rim.contact.name: ring for ring in rings}
        slides, columns, laws = list[int](), list[int](), list[Array]()
        shapes: dict[str, list[str]] = {rim.contact.name: [rim.contact.name] for rim in rims_of(robot)}
        for name, ring in made.items():
            shapes[name] = tip_names(name, tips)
            slides += [int(model.joint(tip).qposadr[0]) for tip in shapes[name]]
            columns += [robot.joint_index(ring.joint)] * tips
            laws += [ring.law] * tips
        pointers = pointers_of(robot)
        return cls(
            tuple(rings),
            tips,
            tuple(name for some in shapes.values() for name in some),
            np.array(slides, dtype=np.int64),
            np.array(columns, dtype=np.int64),
            np.reshape(laws, (-1, 5)),
            pointers,
            np.array([model.body(pointer.axle).id for pointer in pointers], dtype=np.int64),
            tuple(
                np.array([model.geom(shape).id for rim in pointer.rims for shape in shapes[rim]], dtype=np.int64)
                for pointer in pointers
            ),
        )

    def slide(self, q: Array) -> Array:
        """Coordinates (..., K) of all slides at joint coordinates (..., n)."""
        at = q[..., self.columns]
        out = np.zeros_like(at)
        for coefficient in self.laws.T[::-1]:
            out = out * at + coefficient
        return out

    def directions(self, data: Any) -> Array:
        """(P,) rad: where each rim touches, seen from its axle, from the axle's x about its z: against the mean normal,
        weighted by load, of all its contacts. NaN where it carries nothing. A wheel's touching ball jumps from one to
        the next, the normals of the ground do not; those of a height field are of its facets, and off by some degrees
        from record to record."""
        out = np.full(len(self.pointers), np.nan)
        count = data.ncon
        if not count or not len(out) or not data.nefc:  # shapes may just meet and not push yet
            return out
        contact = data.contact
        pairs, rows = contact.geom[:count], contact.efc_address[:count]
        load = np.where(rows >= 0, data.efc_force[np.maximum(rows, 0)], 0.0)
        normals = contact.frame[:count, :3]
        for i, (axle, geoms) in enumerate(zip(self.axles, self.geoms, strict=True)):
            # a contact's normal points from its first shape to its second
            sign = np.isin(pairs[:, 1], geoms).astype(float) - np.isin(pairs[:, 0], geoms)
            push = (sign * load) @ normals
            x, y, _ = -push @ data.xmat[axle].reshape(3, 3)
            if x or y:
                out[i] = np.arctan2(y, x)
        return out

    def angles(self, directions: Array, planned: Array) -> Array:
        """Contact angles (S, P) rad from measured ``directions`` (S, P), of the turns that are the same the one nearest
        to the planned one (S, P), which also stands in where nothing touches."""
        offset, scale = (np.array([getattr(p, name) for p in self.pointers]) for name in ("offset", "scale"))
        away = directions - (offset + scale * planned)
        away -= 2.0 * np.pi * np.round(away / (2.0 * np.pi))
        return np.asarray(np.where(np.isnan(directions), planned, planned + away / scale))

    def settings(self) -> dict[str, Any]:
        """What to say of the wheels in a trial."""
        if not self.rings:
            return {"rim_contact_steps": RIM_STEPS} if self.shapes else {}
        return {
            "rim_contact_steps": RIM_STEPS,
            "rim_tips": self.tips,
            "rim_law_error_m": max(ring.error for ring in self.rings),
            "rim_law_range": {ring.joint: [ring.low, ring.high] for ring in self.rings},
        }


def soften(spec: Any, model: Any, shapes: Sequence[str]) -> None:
    """Set the contacts of the named ``shapes`` of rims with the ground, in a compiled model and in its spec.

    A wheel that is dragged sideways must give way downwards. MuJoCo keeps a sliding contact on the boundary of its dual
    cone: at a slip v it is held up against mu b v by the softness R of the contact times its load, b = 2 / (d tc), so
    that a contact at rest sinks by 2 mu v d tc for the slip v that it bears. A stiffer one leaves the ground and meets
    it again, step by step; a wheel is light to turn, its friction stops it within one of these steps, far below mu
    times the load, and a robot with parallel axles hardly turns at all. R is set here to the same for all shapes,
    heavy or light, by their impedance; time constant and damping go with it, so that each contact has b and stiffness
    of one with impedance d = 0.9 and tc = 2 time steps: it sinks by 0.5 mm and bears about 0.1 m/s.
    """
    geoms = {model.geom(shape).id for shape in shapes}
    softness = RIM_SOFTNESS / float(model.body_mass.sum())
    time = RIM_STEPS * spec.option.timestep
    for i in range(model.npair):
        pair = int(model.pair_geom1[i]), int(model.pair_geom2[i])
        if not geoms.isdisjoint(pair):
            inverse = float(sum(model.body_invweight0[model.geom_bodyid[geom], 0] for geom in pair))
            d = inverse / (inverse + softness)
            solref, solimp = [RIM_IMPEDANCE * time / d, float(np.sqrt(d / RIM_IMPEDANCE))], [d, d, 1e-3, 0.5, 2.0]
            model.pair_solref[i], model.pair_solimp[i] = solref, solimp
            kept = spec.pair(model.pair(i).name)
            kept.solref, kept.solimp = solref, solimp


def wheel_servos(robot: Robot) -> dict[str, tuple[float, float]]:
    """(kp, kv) of the motors of wheels, by joint: of a spin 11 m g R, of an adjust joint 36 m g R (300 and 1000 N m /
    rad for 10 kg on wheels of 0.28 m), kv = kp / 50 s. R is the largest radius: an adjust servo that gives way by
    1/36 rad under the whole weight sinks by less than 1.4 % of R."""
    out: dict[str, tuple[float, float]] = {}
    for rim in rims_of(robot):
        size = robot.mass * 9.81 * rim.contact.radius
        adjust = None if rim.contact.drive is None else rim.contact.drive.joint.name
        for joint, factor in ((rim.spin, 11.0), (adjust, 36.0)):
            if joint is not None:
                kp = max(factor * size, out.get(joint, (0.0, 0.0))[0])
                out[joint] = (kp, kp / 50.0)
    return out


def turning_remarks(robot: Robot, yaw_ratio: float | None) -> list[str]:
    """What to say of a robot on wheels that made so much of its planned turn (None: it planned none)."""
    rims = rims_of(robot)
    if yaw_ratio is None or yaw_ratio >= TURNS or not rims:
        return []
    rest = robot.forward(np.zeros(robot.n))
    axes = np.array([rotate(rest[rim.axle][3:], np.array([0.0, 0.0, 1.0])) for rim in rims])
    places = np.array([rest[rim.axle][:3] for rim in rims])
    text = f"cannot turn: {100.0 * yaw_ratio:.0f} % of the planned yaw"
    parallel = np.abs(np.cross(axes, axes[0])).max() < PARALLEL
    # on one line the axles roll about any point of it
    apart = np.abs(np.cross(places - places[0], axes[0])).max() > PARALLEL
    if parallel and apart:
        text += (
            ": axles that are parallel, one behind the other, make wheels slip sideways, and their friction holds on"
        )
    return [text]
