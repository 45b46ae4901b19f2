"""Paper *acm*: Yamada and Hirose 2010. Bodies are 1 m long: E_nm does not depend on the length."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.curves import BodyCurve, Serpenoid, SinusLift, Spiral
from bodyplan.fitting import GAUSS_P, Fit, fit, mechanism, rule
from bodyplan.job import compare_mission
from bodyplan.papers.drawings.acm import DRAWINGS
from bodyplan.papers.entries import Entry, Off, Paper
from bodyplan.robot import Arc, Robot, acm_l2, snake

ALPHA, LIFT, PAPER_P = 5.0 * np.pi / 12.0, 0.3, 0.789
SERPENOID, SPIRAL = Serpenoid(np.pi / 3.0), Spiral()
YAW, PITCH = 1, 0


def arcs(n: int) -> Robot:
    """n arcs that bend both ways."""
    return snake(n, 1.0 / n, "arc", axes="universal")


def links(n: int) -> Robot:
    """n straight links whose joints yaw and pitch in turns, Fig. 5."""
    return snake(n, 1.0 / n, axes="alternating")


def yaws(n: int) -> Robot:
    """n straight links whose joints all yaw: the plane part of 2 n in turns."""
    return snake(n, 1.0 / n)


def doubles(n: int) -> Robot:
    """n double joints, Fig. 2, R_s = 0.18."""
    return snake(n, 1.0 / n, "double", axes="universal", end_link=0.18)


@cache
def _error(curve: BodyCurve, kind: str, n: int, p: float | None = None) -> float:
    makers: dict[str, Callable[[int], Robot]] = {"arc": arcs, "straight": links, "double": doubles, "yaw": yaws}
    made = makers[kind](n)
    return float(fit(curve, made, p=p).error)


def _given(curve: BodyCurve, robot: Robot, q: Array, kink: Array) -> float:
    """E_nm of joint angles that no rule of ours gave."""
    shown = Fit(
        robot, (curve,), False, np.array(0.0), "paper", None, q[None, None], kink[None, None], np.ones((1, 1), bool)
    )
    return float(shown.error)


# --- (1)-(10) ---


def _frames(curve: BodyCurve) -> Off:
    """(1) integrated by DOP853, and our frames, against closed forms: a helix, or each other."""
    from scipy.integrate import solve_ivp

    def rates(s: float, y: Array) -> Array:
        tau, kp, ky = (float(x) for x in curve.shape(s))
        er, ep, ey = y[3:].reshape(3, 3)
        return np.concatenate([er, ky * ep - kp * ey, -ky * er + tau * ey, kp * er - tau * ep])

    s = np.linspace(0.0, 1.0, 21)
    start = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    exact = solve_ivp(rates, (0.0, 1.0), start, "DOP853", s, rtol=1e-13, atol=1e-14).y[:3].T
    off = float(np.abs(curve.frames(s)[0] - exact).max())
    return Off(off, off)


def _shape(curve: BodyCurve, pitch: Any, yaw: Any) -> Off:
    s = np.linspace(0.0, 1.0, 41)
    found = curve.shape(s)
    off = max(float(np.abs(found.kappa_p - pitch(s)).max()), float(np.abs(found.kappa_y - yaw(s)).max()))
    return Off(off, off)


def _literal() -> Off:
    """Yaw joints of 20 links by (3) as printed, kappa(l i), and by ours, against the integral in closed form."""
    n = 20
    robot, i = links(n), np.arange(1, n, 2)
    found = fit(SERPENOID, robot)
    columns = [k for k, name in enumerate(robot.joints) if name.startswith("yaw")]
    k = 2.0 * np.pi / n
    truth = np.pi / 3.0 * (np.cos(k * (i - 1)) - np.cos(k * (i + 1)))
    printed = 2.0 / n * np.asarray(SERPENOID.shape(i / n).kappa_y)
    ours = np.asarray(found.q, dtype=float)[columns]
    return Off(float(np.abs(printed - truth).max()), float(np.abs(ours - truth).max()))


def _without_virtual(curve: BodyCurve) -> float:
    """E_nm of 10 arcs without the virtual joint 0 over that with it."""
    found = fit(curve, arcs(10))
    return _given(curve, found.robot, np.asarray(found.q, dtype=float), np.zeros(2)) / float(found.error)


def _definition() -> Off:
    """(6) by Simpson's rule on 4001 points, against the certified quadrature."""
    from scipy.integrate import simpson

    found = fit(SERPENOID, doubles(10))
    s = np.linspace(0.0, 1.0, 4001)
    rough = float(simpson(np.linalg.norm(found.points(s) - found.curve_points(s), axis=-1), x=s))
    off = abs(rough - float(found.error))
    return Off(off, off)


def _turning(kind: str) -> Off:
    """(7)-(10): phi of curve and mechanism by their definitions, sums of joint angles included."""
    n = 10
    robot = snake(n, 1.0 / n) if kind == "straight" else snake(n, 1.0 / n, "arc")
    found = fit(SERPENOID, robot)
    s = np.linspace(0.0, 1.0, 400, endpoint=False) + 1e-4
    phi = np.pi / 3.0 * (1.0 - np.cos(2.0 * np.pi * s))
    angles = np.asarray(found.q, dtype=float)
    if kind == "straight":
        joints = mechanism(robot).places
        body = found.kink[YAW] + np.array([angles[joints <= at].sum() for at in s])
    else:
        m = np.floor(s * n).astype(int)
        body = found.kink[YAW] + np.array([angles[:k].sum() for k in m]) + (s * n - m) * angles[m]
    turning = found.turning(s)
    off = float(max(np.abs(turning.curve[:, YAW] - phi).max(), np.abs(turning.mechanism[:, YAW] - body).max()))
    return Off(off, off)


# --- (11)-(22) ---


def printed_rule(curve: BodyCurve, n: int, p: float, axis: int) -> Array:
    """(11)-(17) step by step, (n + 1,) with the virtual joint first."""

    def bend(a: float, b: float) -> float:
        return float(curve.integral(a / n, b / n)[1 + axis])

    first, second = np.zeros(n + 1), np.zeros(n + 1)
    first[1] = bend(1.0 - p, p) / (2.0 * p - 1.0)
    for i in range(2, n + 1):
        first[i] = (bend(i - 2 + p, i - 1 + p) - first[i - 1] * (1.0 - p)) / p
    first[0] = bend(0.0, 1.0 - p) - (1.0 - p) * first[1]
    second[n] = bend(n - p, n - 1 + p) / (2.0 * p - 1.0)
    for i in range(n - 1, 0, -1):
        second[i] = (bend(i - p, i + 1 - p) - second[i + 1] * (1.0 - p)) / p
    second[0] = bend(0.0, 1.0 - p) - (1.0 - p) * second[1]
    return 0.5 * (first + second)


def _rule(curve: BodyCurve) -> Off:
    found = fit(curve, arcs(10), p=PAPER_P)
    angles = np.asarray(found.q, dtype=float).reshape(10, 2)
    if found.robot.joints[0].startswith("yaw"):
        angles = angles[:, ::-1]
    off = 0.0
    for axis in (PITCH, YAW):
        expected = printed_rule(curve, 10, PAPER_P, axis)
        off = max(off, float(np.abs(angles[:, axis] - expected[1:]).max()), abs(float(found.kink[axis]) - expected[0]))
    return Off(off, off)


@cache
def _best_p(curve: BodyCurve) -> float:
    """The p of least E_nm for 10 arcs."""
    from scipy.optimize import minimize_scalar

    robot = arcs(10)
    found = minimize_scalar(lambda p: float(fit(curve, robot, p=float(p)).error), bounds=(0.75, 0.83), method="bounded",
                            options={"xatol": 1e-6})  # fmt: skip
    return float(found.x)


def _turned(theta: float, psi: float) -> Off:
    """(18)-(22): frame at the end of an arc, frame vectors as rows, against our arc and a rotation vector."""
    from scipy.spatial.transform import Rotation

    def Er(x: float) -> Array:
        return np.array([[1, 0, 0], [0, np.cos(x), np.sin(x)], [0, -np.sin(x), np.cos(x)]])

    def Ep(x: float) -> Array:
        return np.array([[np.cos(x), 0, -np.sin(x)], [0, 1, 0], [np.sin(x), 0, np.cos(x)]])

    pitch, yaw = theta * np.cos(psi), theta * np.sin(psi)
    truth = Rotation.from_rotvec([0.0, pitch, yaw]).as_matrix()
    printed = (Er(-psi) @ Ep(theta) @ Er(psi)).T
    ours = Robot.from_rows({"a": [Arc(1.0, pitch, yaw, name="end")]}).forward(np.zeros(0)).rotations[-1]
    return Off(float(np.abs(printed - truth).max()), float(np.abs(ours - truth).max()))


# --- (23)-(34) ---


def printed_tip(theta: Array, r: float) -> Array:
    """(23), (24): (..., 2)."""
    x = (1.0 - 2.0 * r) * np.cos(theta / 2.0) + r * (1.0 + np.cos(theta))
    y = (1.0 - 2.0 * r) * np.sin(theta / 2.0) + r * np.sin(theta)
    return np.stack([x, y], axis=-1)


def _tips(joint: str) -> Off:
    """Tips of one joint of length 1 by forward kinematics, and by (23)-(26)."""
    theta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20)
    options: dict[str, Any] = {"end_link": 0.18} if joint == "double" else {}
    robot = snake(1, 1.0, joint, **options)
    ours = robot.forward(theta[:, None])["link1"][:, :2]
    printed = printed_tip(theta, 0.18) if joint == "double" else printed_arc(theta)
    off = float(np.abs(ours - printed).max())
    return Off(off, off)


def printed_arc(theta: Array) -> Array:
    """(25), (26): (..., 2)."""
    return np.stack([np.sin(theta) / theta, (1.0 - np.cos(theta)) / theta], axis=-1)


def _tip_distance(r: float) -> float:
    """The largest distance of the tips for |theta| < pi/2."""
    theta = np.linspace(1e-6, 0.5 * np.pi, 2001)
    return float(np.linalg.norm(printed_tip(theta, r) - printed_arc(theta), axis=-1).max())


def _central(pitch: float, yaw: float) -> Off:
    """(27)-(32): the middle link by (27)-(29), by forward kinematics with (33), (34), and as the tangent of the arc's
    middle."""
    theta, psi = np.hypot(pitch, yaw), np.arctan2(yaw, pitch)
    truth = np.array([np.cos(theta / 2), np.sin(theta / 2) * np.sin(psi), -np.sin(theta / 2) * np.cos(psi)])
    a, b = printed_double(pitch, yaw)
    printed = np.array([np.cos(a / 2) * np.cos(b / 2), np.cos(a / 2) * np.sin(b / 2), -np.sin(a / 2)])
    robot = snake(1, 1.0, "double", axes="universal")
    q = {"yaw1": b, "pitch1": a}
    ours = robot.forward(q).rotations[robot.frames.index("middle1")][:, 0]
    return Off(float(np.abs(printed - truth).max()), float(np.abs(ours - truth).max()))


def printed_double(pitch: float, yaw: float) -> tuple[float, float]:
    """(33), (34)."""
    theta = float(np.hypot(pitch, yaw))
    a = 2.0 * np.arcsin(np.sin(theta / 2.0) * pitch / theta)
    return float(a), float(2.0 * np.arcsin(np.clip(np.sin(theta / 2.0) * yaw / theta / np.cos(a / 2.0), -1.0, 1.0)))


def _double(pitch: float, yaw: float) -> Off:
    """Angles of one double joint by (33), (34) and by our rule, against the tangent of the middle of the arc."""
    robot = snake(1, 1.0, "double", axes="universal")
    angles = rule(robot)
    q = angles.apply(np.array([pitch, yaw]) * angles.nodes[:, None]).q
    found = dict(zip(robot.joints, q, strict=True))
    theta = np.hypot(pitch, yaw)
    u = np.array([np.cos(theta / 2), np.sin(theta / 2) * yaw / theta, -np.sin(theta / 2) * pitch / theta])
    truth = np.array([-2.0 * np.arcsin(u[2]), 2.0 * np.arctan2(u[1], u[0])])
    printed = np.array(printed_double(pitch, yaw))
    ours = np.array([found["pitch1"], found["yaw1"]])
    return Off(float(np.abs(printed - truth).max()), float(np.abs(ours - truth).max()))


# --- section V ---


def _extent() -> float:
    """Length of our ACM-L2, head and tail included."""
    robot = acm_l2()
    at = robot.forward(np.zeros(robot.n))
    x = [float(at[c.frame][0]) + end[0] for c in robot.contacts for end in (c.start, c.end)]
    return max(x) - min(x)


def _lifting(s: Array) -> Array:
    """(35) with c1 of (37)."""
    c1 = -(0.043 * ALPHA**4 + 0.105 * ALPHA**2) * LIFT
    return np.asarray(2.0 * np.pi * (-LIFT * np.cos(4.0 * np.pi * s) + c1))


@cache
def _level() -> float:
    return float(SinusLift(ALPHA, LIFT).c1)


def _speed(mission: str, metric: str) -> float:
    return float(_figures(mission)[metric] or np.nan)


@cache
def _figures(mission: str) -> dict[str, float | None]:
    return dict(compare_mission(mission).figures)


_PHOTO = "photograph of a mechanism"
_SKETCH = "sketch without numbers"
_HARDWARE = "measured on artificial turf; the frequency of the wave and the friction are not printed"


def _ratio(first: tuple[Any, ...], second: tuple[Any, ...]) -> float:
    return _error(*first) / _error(*second)


ENTRIES = (
    Entry("Figs. 1, 2", "an arc-shaped joint, a double joint", reason=_PHOTO),
    Entry("Figs. 3, 8, 9, 11", "models, their angles and axes", reason=_SKETCH),
    Entry("(1), Fig. 4", "spiral: points of the dorsal reference curve", "Frenet-Serret, extended", partial(_frames,
          SPIRAL)),
    Entry("(1), Fig. 4", "sinus-lifting: points of the dorsal reference curve", "Frenet-Serret, extended",
          partial(_frames, SinusLift(ALPHA, LIFT))),
    Entry("(2), (3), Fig. 5", "yaw joints of 20 straight links on the serpenoid", "integral of kappa(l i) ds",
          _literal, "deg",
          "integral of kappa(s) ds", "the integrand is a constant as printed"),
    Entry("(4)", "shape functions of the serpenoid", "0, (2 pi alpha/L) sin(2 pi s/L)",
          partial(_shape, SERPENOID, lambda s: 0.0 * s, lambda s: 2.0 * np.pi**2 / 3.0 * np.sin(2.0 * np.pi * s)),
          "1/m"),
    Entry("(5)", "shape functions of the spiral", "-k_c sin(t_c s), k_c cos(t_c s)",
          partial(_shape, SPIRAL, lambda s: -12.0 * np.sin(3.6 * s), lambda s: 12.0 * np.cos(3.6 * s)), "1/m"),
    Entry("(6)", "E_nm by Simpson's rule and by ours", "mean distance over L_t", _definition, tolerance=1e-8),
    Entry("(7), (8), Fig. 6(c)", "turning of curve and straight links", "sum of theta_y,i up to floor(s/l)",
          partial(_turning, "straight"), "rad"),
    Entry("(7), (9), (10), Fig. 7(c)", "turning of curve and arcs", "sum, and the share of the next", partial(_turning,
          "arc"), "rad"),
    Entry("section II.B", "E_nm without the virtual joint 0 over E_nm with it, serpenoid, 10 arcs", "> 1",
          partial(_without_virtual, SERPENOID)),
    Entry("section II.B", "E_nm without the virtual joint 0 over E_nm with it, spiral, 10 arcs", "> 1",
          partial(_without_virtual, SPIRAL)),
    Entry("(11)-(17)", "angles by the three steps, serpenoid", "three steps", partial(_rule, SERPENOID), "rad"),
    Entry("(11)-(17), (21), (22), Fig. 7(b)", "angles by the three steps, spiral", "three steps", partial(_rule,
          SPIRAL), "rad"),
    Entry("section III.A", "p for any curve: the Gauss node 1/2 + 1/(2 sqrt 3), which makes the order 3", "0.789",
          lambda: GAUSS_P),
    Entry("section III.A", "p of least E_nm, serpenoid, 10 arcs", "0.789", partial(_best_p, SERPENOID), "",
          "1/2 + 1/(2 sqrt 3)", "0.789 is the Gauss node rounded, where the order is 3, and no curve's own optimum"),
    Entry("section III.A", "p of least E_nm, spiral, 10 arcs", "0.789", partial(_best_p, SPIRAL), "",
          "1/2 + 1/(2 sqrt 3)", "0.789 is the Gauss node rounded, where the order is 3, and no curve's own optimum"),
    Entry("Figs. 6(a), 7(a)", "E_nm of 5 arcs over that of 10 straight links (5 yaw), serpenoid", "1/4",
          partial(_ratio, (SERPENOID, "arc", 5, PAPER_P), (SERPENOID, "yaw", 5))),
    Entry("Figs. 6(a), 7(a)", "E_nm of 10 arcs over that of 20 straight links (10 yaw), serpenoid", "1/4",
          partial(_ratio, (SERPENOID, "arc", 10, PAPER_P), (SERPENOID, "yaw", 10)), "", "holds for 5 arcs",
          "arcs are of order 3 and links of order 2: the ratio falls with the number of joints"),
    Entry("Fig. 6(b)", "E_nm of 20 links on the spiral over that of 10", "< 1",
          partial(_ratio, (SPIRAL, "straight", 20), (SPIRAL, "straight", 10))),
    Entry("Figs. 6(b), 7(b)", "E_nm of 10 arcs over that of 20 straight links, spiral", "< 1",
          partial(_ratio, (SPIRAL, "arc", 10, PAPER_P), (SPIRAL, "straight", 20))),
    Entry("(18)-(20)", "frame at the end of an arc, rows are frame vectors", "E_r(-psi) E_p(theta) E_r(psi)",
          partial(_turned, 1.1, 0.6)),
    Entry("(23), (24), Fig. 10", "tip of a double joint, R_s = 0.18", "x_d, y_d", partial(_tips, "double"), "mm"),
    Entry("(25), (26), Fig. 10", "tip of an arc", "sin(theta)/theta, (1 - cos(theta))/theta", partial(_tips, "arc"),
          "mm"),
    Entry("Fig. 10, section IV", "distance of the tips, R_s = 0.16, as a share of the joint", "< 1",
          partial(_tip_distance, 0.16), "%"),
    Entry("Fig. 10, section IV", "distance of the tips, R_s = 0.18, as a share of the joint", "< 1",
          partial(_tip_distance, 0.18), "%"),
    Entry("Fig. 10, section IV", "distance of the tips, R_s = 1.6, as a share of the joint", "< 1",
          partial(_tip_distance, 1.6), "%", "R_s from 0.16 to 0.18",
          'printed as "1.6 ~ 1.8": end links longer than the joint'),
    Entry("(27)-(32)", "direction of the middle link", "(30)-(32) = (27)-(29)", partial(_central, 0.7, -0.9)),
    Entry("(33), (34)", "angles of a double joint, arc of 65 deg", "2 asin(...)", partial(_double, 0.7, -0.9), "deg"),
    Entry("(33), (34)", "angles of a double joint, arc of 189 deg", "2 asin(...)", partial(_double, 0.2, 3.3), "deg",
          "theta_dy = 2 atan2(u_y, u_x)", "asin folds yaws beyond 180 deg back; and (34) follows from (28), (31)"),
    *(Entry("Fig. 12", f"E_nm of 10 double joints over that of {other}, {name}", relation,
            partial(_ratio, (curve, "double", 10, PAPER_P), (curve, kind, n, PAPER_P)))
      for name, curve in (("serpenoid", SERPENOID), ("spiral", SPIRAL))
      for kind, n, other, relation in (("arc", 10, "10 arcs", "> 1"), ("straight", 20, "20 straight links", "< 1"))),
    Entry("section V.A", "R_s of joints of 78 mm with a middle link of 50 mm", "0.18",
          lambda: (0.078 - 0.050) / 2.0 / 0.078),
    Entry("Table I", "length of ACM-L2", "800", _extent, "mm"),
    Entry("Table I", "degrees of freedom of ACM-L2", "18", lambda: acm_l2().n),
    Entry("Table I", "mass of ACM-L2", "0.99", lambda: acm_l2().mass, "kg"),
    Entry("Table I", "largest torque of ACM-L2", "0.5", lambda: float(np.max(acm_l2().efforts)), "N*m"),
    Entry("Table I", "largest angle of ACM-L2", "75", lambda: float(np.max(acm_l2().limits)), "deg"),
    Entry("(35), (36)", "shape functions of sinus-lifting", "k (-c0 cos 2 k s + c1), k alpha sin k s, k = 2 pi/L_a",
          lambda: _shape(SinusLift(ALPHA, LIFT, c1="paper"), _lifting,
          lambda s: 2.0 * np.pi * ALPHA * np.sin(2.0 * np.pi * s)), "1/m"),
    Entry("(37), Fig. 13", "c1 at alpha = 5 pi/12, c0 = 0.3", "-0.092", lambda: float(SinusLift(ALPHA, LIFT,
          c1="paper").c1)),
    Entry("(37), Fig. 13", "c1 that keeps the curve level over a wavelength", "-0.092", _level, "",
          "level condition solved; -c0 J2(alpha)/J0(alpha) to first order",
          "(37) was fitted; the curve leaves the level by it"),
    Entry("Fig. 14, section V.B", "speed with sinus-lifting", "75", partial(_speed, "sinus-lifting",
          "trial.speed_m_s"), "mm/s", reason=_HARDWARE, physics=True),
    Entry("Fig. 14, section V.B", "share of the speed without slip", "71", lambda: _speed("sinus-lifting",
          "trial.speed_m_s")
          / _speed("sinus-lifting", "plan.no_slip_speed"), "%", reason=_HARDWARE, physics=True),
    Entry("section V.B", "speed of lateral undulation (c0 = 0)", "55", partial(_speed, "serpentine",
          "trial.speed_m_s"), "mm/s", reason=_HARDWARE, physics=True),
    Entry("section V.B", "gain by lifting, 75/55: faster than undulation", "> 1",
          lambda: _speed("sinus-lifting", "trial.speed_m_s") / _speed("serpentine", "trial.speed_m_s"), "",
          reason=_HARDWARE, physics=True),
)  # fmt: skip

PAPER = Paper(
    "acm",
    "Approximations to Continuous Curves of Active Cord Mechanism Made of Arc-shaped joints or Double Joints",
    "H. Yamada, S. Hirose (2010)",
    "Straight, arc-shaped and double joints are fitted to a dorsal reference curve by integrals of its curvature. "
    "Bodies are 1 m long. The errors that the figures show are pictures; ours are computed to 1e-12.",
    tables=1,
    figures=14,
    equations=37,
    entries=ENTRIES,
    drawings=DRAWINGS,
)
