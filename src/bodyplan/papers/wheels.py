"""Paper *wheels*: Mardani and Ebrahimi 2016."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np

from bodyplan.gaits.carry import Carry, Forces, Formula, Pose, forces, heading, pose, pose_of, reach, yaw
from bodyplan.gaits.carry.orientation import Function, matrix
from bodyplan.ground import Plane, Surface
from bodyplan.missions import load_mission
from bodyplan.motion import Motion, times
from bodyplan.papers.drawings.wheels import DRAWINGS
from bodyplan.papers.entries import Entry, Off, Paper
from bodyplan.papers.printed_wheels import contact_by_transforms, normal_as_printed, with_the_printed_normal
from bodyplan.plan import plan
from bodyplan.robot import WheelRadius, tri_wheel
from bodyplan.robot.rims import contact_radii
from bodyplan.spatial import matrix_from_quaternion

HILLS = Surface("sin(0.5*(x+y))/15")
WHEELS = {"r": "rear", "fl": "front left", "fr": "front right"}
COS_30, LINK, RUBBER, MASS, GRAVITY = np.cos(np.pi / 6.0), 0.3, 0.02, 10.0, 9.81
#: degrees and N m of Table 2
TABLE_2 = {"r": ("115", "3.9"), "fl": ("55", "1.7"), "fr": ("160", "3.4")}


@cache
def mission_1() -> Motion:
    """Table 1: absolute height, half lengths of 0.6 m."""
    return plan(tri_wheel(), Carry(("sin(t)", "cos(t)"), height=0.15), HILLS, times(0.0, 5.0, dt=0.01))


@cache
def mission_2() -> Motion:
    mission = load_mission("carry-ramp")
    return plan(mission.robot, mission.gait, mission.ground, times(0.0, 1.0, dt=0.05))


@cache
def _poses() -> Pose:
    """Some poses of mission 1."""
    return pose_of(tri_wheel(), HILLS, mission_1().base[::50])


@cache
def held() -> Forces:
    """Forces of least norm at those poses, friction 1."""
    return forces(_poses(), 1.0, interval=False)


@cache
def _level() -> Forces:
    """On flat ground."""
    return forces(pose(tri_wheel(), Plane(), (0.0, 0.0)), 1.0, interval=False)


# --- geometry ---


def _radius() -> Off:
    """(1): the radius of a wheel of our robot, and what the paper prints."""
    robot, q = tri_wheel(), np.linspace(0.0, np.pi, 19)
    column = robot.joint_index("fl.adjust")
    joints = np.zeros((len(q), robot.n))
    joints[:, column] = q
    rim = next(k for k, contact in enumerate(robot.contacts) if contact.name.startswith("fl"))
    ours = contact_radii(robot, joints)[:, rim]
    printed = LINK * np.cos(q / 2.0) * np.cos(np.pi / 6.0) + RUBBER
    off = float(np.abs(ours - printed).max())
    return Off(off, off)


def _normal() -> Off:
    """(3): angle to the normal by differences of the height, largest over mission 1's circle."""
    t, h = np.linspace(0.0, 6.0, 61), 1e-5
    xy = np.stack([np.sin(t), np.cos(t)], axis=-1)
    slope = np.stack([(HILLS.height(xy + h * e) - HILLS.height(xy - h * e)) / (2.0 * h) for e in np.eye(2)], axis=-1)
    truth = np.concatenate([-slope, np.ones((len(t), 1))], axis=-1)
    truth /= np.linalg.norm(truth, axis=-1, keepdims=True)
    printed = normal_as_printed(HILLS.gradient(xy))
    printed /= np.linalg.norm(printed, axis=-1, keepdims=True)
    return Off(
        *(float(np.arcsin(np.linalg.norm(np.cross(n, truth), axis=-1)).max()) for n in (printed, HILLS.normal(xy)))
    )


def _orientation() -> Off:
    """(4) with the third row of T_y as printed: how far the product is from a rotation."""
    a, b, c = 0.7, 0.2, -0.3
    Ry = np.array([[np.cos(c), 0, np.sin(c)], [0, 1, 0], [np.sin(c), 0, np.cos(c)]])
    Rx = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    Rz = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    printed, ours = Ry @ Rx @ Rz, matrix(np.array(a), np.array(b), np.array(c))
    return Off(*(float(np.abs(R.T @ R - np.eye(3)).max()) for R in (printed, ours)))


def _height() -> Off:
    """(6): how far the body of mission 1 is from the height of 0.15 m that Table 1 commands."""
    t = mission_1().t[::25]
    found = pose(tri_wheel(), HILLS, np.stack([np.sin(t), np.cos(t)], axis=-1), 0.15, "normal")
    return Off(float(np.abs(found.base[:, 2] - 0.15).max()), float(np.abs(mission_1().base[:, 2] - 0.15).max()))


def _chain() -> Off:
    """(7)-(11): contacts by the product of the printed transforms, and by our forward kinematics."""
    found, worst = _poses(), [0.0, 0.0]
    at = found.robot.forward(found.joints, found.base)
    for name in WHEELS:
        wheel = found[name]
        printed = contact_by_transforms(name, found.base, wheel.angle, wheel.radius)
        worst[0] = max(worst[0], float(np.abs(printed - wheel.point).max()))
        worst[1] = max(worst[1], float(np.abs(at[name][:, :3] - wheel.point).max()))
    return Off(*worst)


def _constraints() -> Off:
    """(12)-(17): heights and tangents at our contacts, by the right normal and by that of (3)."""
    found, worst = _poses(), [0.0, 0.0]
    R = matrix_from_quaternion(found.base[:, 3:])
    for name in WHEELS:
        wheel = found[name]
        xy = wheel.point[:, :2]
        ahead = np.cos(wheel.angle)[:, None] * R[:, :, 0] + np.sin(wheel.angle)[:, None] * R[:, :, 2]
        level = np.abs(wheel.point[:, 2] - HILLS.height(xy)).max()
        right = np.concatenate([-HILLS.gradient(xy), np.ones((len(xy), 1))], axis=-1)
        for k, normal in enumerate((normal_as_printed(HILLS.gradient(xy)), right)):
            worst[k] = max(worst[k], float(level), float(np.abs(np.sum(normal * ahead, axis=-1)).max()))
    return Off(*worst)


# --- headings ---


def _path_angle() -> Off:
    """(18), (19): the angle of the position and our heading, against the direction of the motion of mission 1."""
    t, h = np.linspace(0.1, 4.9, 40), 1e-6
    truth = np.arctan2(np.cos(t + h) - np.cos(t - h), np.sin(t + h) - np.sin(t - h))
    printed = np.arctan2(np.cos(t), np.sin(t))
    ours = Formula("sin(t)", "cos(t)").at(t, Function(t, np.ones_like(t), np.zeros_like(t))).direction.value
    return Off(*(float(np.abs(np.angle(np.exp(1j * (angle - truth)))).max()) for angle in (printed, ours)))


def _drift(sign: float) -> Off:
    """(20)-(23): heading after a lap at a constant tilt of 0.2, 0.2, by integrating the yaw, and by ours."""
    tilt = 0.2
    lap = sign * 2.0 * np.pi / (np.cos(tilt) * np.cos(tilt))
    start = float(yaw(0.0, tilt, tilt))
    printed, ours = (heading(a, tilt, tilt) for a in (start + lap, float(yaw(2.0 * np.pi, tilt, tilt))))
    return Off(*(float(abs(np.angle(np.exp(1j * float(value))))) for value in (printed, ours)))


def _rate_sign() -> Off:
    """(23) without tilt: the rate of the position's angle has the other sign of (22) with (19)."""
    t = np.linspace(0.1, 4.9, 40)
    x, y, vx, vy = np.sin(t), np.cos(t), np.cos(t), -np.sin(t)
    printed = (y * vx - x * vy) / x**2 * np.cos(np.arctan2(y, x)) ** 2
    ours = Formula("sin(t)", "cos(t)").at(t, Function(t, np.ones_like(t), np.zeros_like(t))).direction.first
    return Off(float(np.abs(printed + 1.0).max()), float(np.abs(ours + 1.0).max()))


# --- statics ---


def _weight() -> Off:
    """(25): the sum of the ground's forces on the wheels along z, and of their moments about the centre of mass."""
    found, weight = held(), MASS * GRAVITY
    center = found.pose.base[:, :3]
    total = np.sum([wheel.force for wheel in found], axis=0)
    moment = np.sum([np.cross(found.pose[wheel.name].point - center, wheel.force) for wheel in found], axis=0)
    ours = max(float(np.abs(total - [0.0, 0.0, weight]).max()), float(np.abs(moment).max()))
    return Off(float(np.abs(total[:, 2] + weight).max()), ours)


def _normal_force(name: str) -> float:
    """(27), (28): P_i(2) of a wheel under load, in the printed frame, smallest over the poses."""
    found = held()
    R = matrix_from_quaternion(found.pose.base[:, 3:])
    wheel = found.pose[name]
    u = np.sin(wheel.angle)[:, None] * R[:, :, 0] - np.cos(wheel.angle)[:, None] * R[:, :, 2]
    y = u if name == "fl" else -u  # (9), (11)
    return float(np.min(found[name].load * np.sum(wheel.normal * y, axis=-1)))


def _friction() -> float:
    return float(max(wheel.ratio.max() for wheel in held()))


def _torque(name: str) -> Off:
    """(31), (32), (34): torque by F(2) in the printed frame, and ours, against the work of F on the contact."""
    found = held()
    at, R = found.pose, matrix_from_quaternion(found.pose.base[:, 3:])
    wheel, force = at[name], found[name].force
    u = np.sin(wheel.angle)[:, None] * R[:, :, 0] - np.cos(wheel.angle)[:, None] * R[:, :, 2]
    h = 1e-6
    law = WheelRadius(tri_wheel().contacts[0].drive.joint, LINK, RUBBER)  # type: ignore[union-attr]
    slope = (law.radius(wheel.q + h) - law.radius(wheel.q - h)) / (2.0 * h)
    truth = -slope * np.sum(force * u, axis=-1)
    up = np.sum(force * (u if name == "fl" else -u), axis=-1)
    printed = -0.5 * up * LINK * np.sin(wheel.q / 2.0) * COS_30
    return Off(float(np.abs(printed - truth).max()), float(np.abs(found[name].adjust - truth).max()))


def _slope_of_radius() -> Off:
    """(33) against differences of (1)."""
    q, h = np.linspace(0.1, 3.0, 30), 1e-6
    law = WheelRadius(tri_wheel().contacts[0].drive.joint, LINK, RUBBER)  # type: ignore[union-attr]
    truth = LINK * COS_30 * (np.cos((q + h) / 2.0) - np.cos((q - h) / 2.0)) / (2.0 * h)
    printed = -0.5 * LINK * np.sin(q / 2.0) * COS_30
    return Off(float(np.abs(printed - truth).max()), float(np.abs(law.slope(q) - truth).max()))


def _rear_load() -> Off:
    """(35): the load of the rear wheel on flat ground, against the lever rule."""
    found = _level()
    points = {name: found.pose[name].point[0] for name in WHEELS}
    front = 0.5 * (points["fl"] + points["fr"])
    truth = MASS * GRAVITY * front / (front - points["r"])
    return Off(float(abs(MASS * GRAVITY / 3.0 - truth)), float(abs(found["r"].load - truth)))


def _estimate(degrees: str) -> float:
    """(35) at an angle, N m."""
    law = WheelRadius(tri_wheel().contacts[0].drive.joint, LINK, RUBBER)  # type: ignore[union-attr]
    return float(abs(MASS * GRAVITY / 3.0 * law.slope(np.radians(float(degrees)))))


# --- missions ---


def _fact(name: str) -> float:
    return float(mission_1().facts[name])


def _ramp(name: str) -> float:
    return float(mission_2().facts[name])


def _headings(slope: float) -> float:
    """The share of headings at which some height keeps a level body in reach."""
    psi = np.linspace(-np.pi, np.pi, 721)[:-1]
    return float(reach(tri_wheel(), Plane(slope=(slope, 0.0)), (0.0, 0.0), heading=psi).possible.mean())


def _on_path() -> Off:
    motion = mission_1()
    off = float(np.abs(motion.base[:, :2] - np.stack([np.sin(motion.t), np.cos(motion.t)], axis=-1)).max())
    return Off(off, off)


@cache
def _misreading() -> dict[str, float]:
    return with_the_printed_normal(mission_1(), HILLS)


def _misread(what: str) -> float:
    return _misreading()[what]


_MISSION_1 = "no reading of the equations gives it"
_NEEDED = (
    LINK * COS_30 * float(np.subtract(*np.cos(np.radians([float(TABLE_2["fl"][0]), float(TABLE_2["fr"][0])]) / 2.0)))
)
_MISSION_2 = (
    f"the printed angles need a slope x width of {_NEEDED:.3f} m; section 7 and Table 1 have 0.2 x 1.2 m = 0.24 m"
)


def _table_2() -> tuple[Any, ...]:
    out = []
    for key, name in WHEELS.items():
        angle, torque = TABLE_2[key]
        out += [
            Entry("Fig. 14, Table 2", f"adjusting angle, {name}", angle, partial(_ramp, f"{key}_largest_angle"), "deg",
                  reason=_MISSION_2),
            Entry("Table 2, (35)", f"torque, {name}, at our angle", torque, partial(_ramp, f"{key}_paper_torque"),
                  "N*m", reason=_MISSION_2),
            Entry("Table 2, (35)", f"torque, {name}, at the printed angle of {angle} deg", torque, partial(_estimate,
                  angle), "N*m", reason="the table's torques do not follow from its angles by (35)"),
        ]  # fmt: skip
    return tuple(out)


ENTRIES = (
    Entry("Figs. 1-3, 16", "the wheel's mechanism", reason="drawings and photographs of the mechanism"),
    Entry("Figs. 4-7, 9", "frames, angles and forces", reason="sketches without numbers; they define what follows"),
    Entry("Fig. 8", "flow chart of the analysis", reason="a flow chart; (24) and Fig. 13 are what it leads to"),
    Entry("(1)", "radius of a wheel", "w cos(q/2) cos(pi/6) + R_ru", _radius, "mm"),
    Entry("(2), (3)", "angle to the ground's normal, largest on mission 1's circle",
          "(-grad f/|grad f|, 1), made a unit vector", _normal, "deg", "(-f_x, -f_y, 1), made a unit vector",
          "the gradient is normalised too; undefined where the ground is level"),
    Entry("(4)", "orientation: distance of R^T R from 1", "third row of T_y (sin, 0, cos)", _orientation, "",
          "(-sin, 0, cos); R = Ry Rx Rz", "a sign is lost"),
    Entry("(5), (6)", "height of the body, mission 1", "h along the normal", _height, "mm",
          "absolute, as section 7 says", "section 7 and Table 1 command an absolute height of 0.15 m"),
    Entry("(7)-(11)", "contacts by the chain of transforms, angle b = phi (front left: -phi)", "T_CG T_1 T_2 T_b T_3",
          _chain, "mm"),
    Entry("(12)-(17)", "constraints C, CC at the true contacts, by the normal of (3)", "C = CC = 0", _constraints, "",
          "with the normal (-f_x, -f_y, 1)", "follows from (3)"),
    Entry("(18), (19)", "heading on mission 1's circle", "tan(q_path) = y/x", _path_angle, "deg",
          "psi = atan2(y', x')", "y/x is the angle of the position, a right angle off on a circle"),
    Entry("(20)-(22)", "heading after a lap, tilts 0.2 and 0.2 rad", "integrate q_zd", partial(_drift, 1.0), "deg",
          "q_zd = atan2(cos ty sin psi, cos tx cos psi - sin tx sin ty sin psi)",
          "a yaw about the body's z is not the heading: it drifts"),
    Entry("(23)", "yaw rate on mission 1's circle, no tilt", "(y x' - x y')/x^2 cos^2", _rate_sign, "rad/s",
          "(x' y'' - y' x'')/(x'^2 + y'^2)", "the sign of (19) is flipped, which was that of the position's angle"),
    Entry("(24), Fig. 13", "largest residual, mission 1; the criterion of Table 1", "< 0.00001",
          lambda: float(mission_1().residual.max())),
    Entry("(24), Fig. 15", "largest residual, mission 2", "< 0.00001", lambda: float(mission_2().residual.max())),
    Entry("(25), (26)", "sums of forces and moments, mission 1", "sum F_z = -m g", _weight, "N", "+m g; moments r x F",
          "these are the forces of the ground on the wheels", tolerance=1e-8),
    Entry("(27), (28)", "P(2) of the front right wheel under load", "> 0", partial(_normal_force, "fr"), "N"),
    Entry("(27), (28)", "P(2) of the front left wheel under load", "> 0", partial(_normal_force, "fl"), "N",
          "F . n >= 0", "its frame points down by (9), (11): as printed it could never touch"),
    Entry("(29), (30)", "largest friction over load, mission 1, mu_s = 1", "< 1", _friction),
    *(Entry("(31), (32), (34)", f"torque of the {WHEELS[name]} motor, mission 1", "-0.5 F(2) w sin(q/2) cos(pi/6)",
            partial(_torque, name), "N*m", "0.5 w sin(q/2) cos(pi/6) F . u, u from centre to contact",
            "F(2) has the other sign in the frame of the front left wheel", tolerance=1e-8)
      for name in WHEELS),
    Entry("(33)", "slope of the radius", "-0.5 w sin(q/2) cos(pi/6)", _slope_of_radius, "m", tolerance=1e-8),
    Entry("(35)", "load of the rear wheel on flat ground", "m g/3", _rear_load, "N", "m g/2; m g/4 on each front wheel",
          "the centre of mass is half way from the front axle to the rear one: the rear torque is 1.5 times (35)"),
    Entry("Table 1, Fig. 10", "distance of the body from the circle, mission 1", "tracks the path", _on_path, "mm"),
    Entry("Table 1", "height of the centre of mass", "0.15", partial(_fact, "largest_body_height"), "m"),
    Entry("Fig. 10, section 1", "sideways slip at 1 m/s on mission 1's circle: sticking", "0.0",
          partial(_fact, "peak_slip_speed"), "m/s", "slip is reported", "three parallel axles cannot turn without it"),
    Entry("Fig. 11, section 7", "smallest adjusting angle, mission 1", "20", partial(_fact, "smallest_adjust_angle"),
          "deg", reason=_MISSION_1),
    Entry("Fig. 11, section 8", "smallest adjusting angle, mission 1", "40", partial(_fact, "smallest_adjust_angle"),
          "deg", reason=_MISSION_1 + " but (3) as printed, whose wheels sink into the ground"),
    Entry("Fig. 11, section 8", "smallest adjusting angle, by (3) as printed", "40", partial(_misread, "smallest"),
          "deg", reason="the nearest that any reading comes"),
    Entry("Fig. 11, section 7", "largest adjusting angle, mission 1", "170", partial(_fact, "largest_adjust_angle"),
          "deg", reason=_MISSION_1),
    Entry("Fig. 11, section 7", "largest adjusting angle, by (3) as printed", "170", partial(_misread, "largest"),
          "deg", reason=_MISSION_1),
    Entry("Fig. 11, section 7", "depth of a rim in the ground, by (3) as printed", "0", partial(_misread, "depth"),
          "mm", "the right normal", "what (3) as printed calls a contact is none"),
    Entry("Fig. 12, (35)", "smallest torque, mission 1", "1.4", partial(_fact, "smallest_paper_torque"), "N*m",
          reason=_MISSION_1 + "; (3) as printed comes near"),
    Entry("Fig. 12, (35)", "smallest torque, by (3) as printed", "1.4",
          lambda: _estimate(str(np.degrees(_misread("smallest")))), "N*m", reason="the nearest that any reading comes"),
    Entry("Fig. 12, (35)", "largest torque, mission 1", "4", partial(_fact, "largest_paper_torque"), "N*m"),
    Entry("Fig. 12, (34)", "largest torque, mission 1, statics of least norm", "4",
          lambda: float(max(np.abs(wheel.adjust).max() for wheel in held())), "N*m", "torques by statics, (25) to (34)",
          "(35) is not conservative: the rear wheel carries half of the weight"),
    Entry("Fig. 14, section 7", "headings at which a level body is in reach on slope 0.2", "100", partial(_headings,
          0.2), "%", "all headings on gentler slopes only", "the wheels' radii do not span the slope at the others"),
    *_table_2(),
)  # fmt: skip

PAPER = Paper(
    "wheels",
    "A Novel Multimode Mobile Robot with Adaptable Wheel Geometry for Maneuverability Improvement",
    "A. Mardani, S. Ebrahimi (2016)",
    "Three wheels change their radius to carry a body level over rough ground; contacts by Newton's method, torques by "
    "virtual work. Its equations can be mended; its two simulations do not come out by any reading.",
    tables=2,
    figures=16,
    equations=35,
    entries=ENTRIES,
    drawings=DRAWINGS,
)
