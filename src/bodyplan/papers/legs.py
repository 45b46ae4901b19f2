"""Paper *legs*: Tarokh and Lee 2009. It prints no numbers but those of its Table 1: what is compared are equations."""

from __future__ import annotations

from functools import cache, partial

import numpy as np

from bodyplan import solve
from bodyplan.arrays import Array
from bodyplan.papers.drawings.legs import DRAWINGS
from bodyplan.papers.entries import Entry, Off, Paper
from bodyplan.papers.printed_legs import EQUATIONS, adjoint, row, row_truth, shoulder_to_contact
from bodyplan.robot import Robot, Row, silo4
from bodyplan.robot.rows import row_matrices
from bodyplan.solve.stability import Objective, tip_margins
from bodyplan.spatial import matrix_from_quaternion, rotation_exp

LEGS = ("fl", "fr", "hl", "hr")
DOWN = np.array([0.0, 0.0, -1.0])
#: theta, d, a, epsilon of a row with nothing special
ROW = (0.4, 0.07, 0.24, 0.9)
#: theta_0 and the six joints of Table 1
ANGLES = (0.2, 0.3, 0.4, -1.5, 0.5, -0.3, 0.7)


# --- one row, one leg ---


def _row() -> Off:
    """(1)-(5): D and E of a row as printed and ours, against derivatives of its transform."""
    D, E = row_truth(*ROW)
    printed, ours = row(*ROW), row_matrices(*ROW)
    return Off(*(max(float(np.abs(m[0] - D).max()), float(np.abs(m[1] - E).max())) for m in (printed, ours)))


def _rpy_rates() -> Off:
    """(1) with phi-dot the rates of roll, pitch, yaw, as the text says, and the angular velocity, for which it is
    right: relative error of the rates of the next frame."""
    at = np.array([0.0, 0.0, 0.0, 0.5, -0.4, 0.3])
    rates = np.array([0.0, 0.0, 0.0, 0.4, -0.3, 0.5])
    J = solve.coordinate_jacobian(at)
    D, _ = row_matrices(*ROW)
    turned = (
        matrix_from_quaternion(solve.pose_from_coordinates(at)[3:])
        @ Robot.from_rows({"a": [Row(*ROW)]}).forward(np.zeros(0)).rotations[-1]
    )
    pitch, roll = -np.arcsin(turned[2, 0]), np.arctan2(turned[2, 1], turned[2, 2])
    there = solve.coordinate_jacobian(np.array([0.0, 0.0, 0.0, roll, pitch, np.arctan2(turned[1, 0], turned[0, 0])]))
    truth = np.linalg.solve(there[3:, 3:], (D @ J @ rates)[3:])
    printed = (D @ rates)[3:]
    right = D[3:, 3:] @ J[3:, 3:] @ rates[3:]
    ours = right - there[3:, 3:] @ truth
    return Off(float(np.linalg.norm(printed - truth) / np.linalg.norm(truth)), float(np.abs(ours).max()))


@cache
def _leg() -> tuple[Robot, Array]:
    """One leg of Table 1 and its joints, theta_0 aside."""
    return shoulder_to_contact(ANGLES[0]), np.array(ANGLES[1:])


def _equation(number: int) -> Off:
    """(10)-(13): the printed 6 x 6 matrix and column of the rate, and ours, against the motion of the frames."""
    robot, q = _leg()
    frame = robot.frames[1 + number - 10]
    at = robot.forward(q)
    k = robot.frames.index(frame)
    before, after = at.rotations[k - 1], at.rotations[k]
    R = before.T @ after
    D = adjoint(R, before.T @ (at.positions[k] - at.positions[k - 1]))
    ours, E = robot.element_matrices(q, frame)
    printed, rate = EQUATIONS[number](ANGLES)
    off = [float(np.abs(printed - D).max()), float(np.abs(ours - D).max())]
    if rate is not None:
        column = adjoint(R, before.T @ (at.positions[k] - at.positions[k - 1])) @ np.array([0, 0, 0, 0, 0, 1.0])
        # the frame turns about z of the one before it
        off[0], off[1] = (
            max(off[0], float(np.abs(rate - column).max())),
            max(off[1], float(np.abs(E[:, 0] - column).max())),
        )
    return Off(*off)


def _entries_wrong(number: int) -> float:
    """How many entries of a printed matrix and its rate differ from those of Table 1, where (11) has theta_0 = 0."""
    robot, q = shoulder_to_contact(0.0), np.array(ANGLES[1:])
    D, E = robot.element_matrices(q, robot.frames[1 + number - 10])
    printed, rate = EQUATIONS[number]((0.0, *ANGLES[1:]))
    count = np.count_nonzero(np.abs(printed - D) > 1e-12)
    return float(count + (0 if rate is None else np.count_nonzero(np.abs(rate - E[:, 0]) > 1e-12)))


def _product() -> Off:
    """P of a leg in the printed order of its factors and in ours, against the pose of the contact."""
    robot, q = _leg()
    at = robot.forward(q)
    truth = adjoint(at.rotations[-1], at.positions[-1])
    factors = [robot.element_matrices(q, frame)[0] for frame in robot.frames[1:]]
    P, _ = robot.velocity_model(q)
    printed = np.linalg.multi_dot(factors)
    return Off(float(np.abs(printed - truth).max()), float(np.abs(P - truth).max()))


def _sole() -> float:
    """Table 1 at theta_4 = theta_5 = 0: the component of the sole's z down the shank."""
    robot = shoulder_to_contact(0.0)
    at = robot.forward(np.array([0.1, 0.2, -1.3, 0.0, 0.0, 0.0]))
    ankle, sole = (at.rotations[robot.frames.index(name)] for name in ("AE", "SE"))
    return float(sole[:, 2] @ ankle[:, 0])


# --- the whole robot ---


@cache
def _walker(passive: bool) -> tuple[Robot, Array]:
    robot = silo4(passive=passive)
    q = np.random.default_rng(1).uniform(-0.4, 0.4, robot.n)
    knees = [i for i, name in enumerate(robot.joints) if name.endswith("knee")]
    q[knees] -= 1.5
    return robot, q


def _size(matrix: str, axis: int) -> float:
    robot, q = _walker(True)
    return float(getattr(solve.model(robot, q), matrix).shape[axis])


def _composite() -> Off:
    """(8), (9): velocities of the feet by P and Q, against differences of forward kinematics of a moving robot."""
    robot, q = _walker(True)
    rng = np.random.default_rng(2)
    V, rates, h = rng.normal(size=6), rng.normal(size=robot.n), 1e-5
    model = solve.model(robot, q)
    found = (model.P @ V + model.Q @ rates).reshape(-1, 6)[:, :3]

    def feet(t: float) -> Array:
        # a constant twist of the base carries it along a screw; to second order its middle point
        at = robot.forward(q + rates * t)
        R = rotation_exp(V[3:] * t)
        shift = V[:3] * t + 0.5 * np.cross(V[3:], V[:3]) * t * t
        return np.array([R @ at[f"{leg}.foot"][:3] + shift for leg in LEGS])

    moved = (feet(h) - feet(-h)) / (2.0 * h)
    rest = robot.forward(q)
    own = np.array([rest.rotations[robot.frame_index(f"{leg}.foot")].T @ v for leg, v in zip(LEGS, moved, strict=True)])
    off = float(np.abs(own - found).max())
    return Off(off, off)


def _rank(which: str) -> float:
    """Ranks of SILO4 without foot joints, feet following a body at rest; or of Q with them."""
    passive = which == "Q passive"
    robot, q = _walker(passive)
    model = solve.model(robot, q)
    if passive:
        return float(np.linalg.matrix_rank(model.Q))
    if which == "printed":
        return float(np.linalg.matrix_rank(np.hstack([model.Q, np.eye(24), -model.P])))
    b = model.Q @ np.linspace(-1.0, 1.0, robot.n)
    return float(np.linalg.matrix_rank(np.hstack([model.Q, b[:, None]])))


@cache
def _split() -> solve.Partition:
    robot, q = _walker(False)
    known = [*(f"{leg}.foot.v" for leg in LEGS), "body.vx", "body.vy", "body.wz"]
    return solve.partition(solve.model(robot, q, [0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0]), known=known)


def _blocks() -> Off:
    """(15)-(17): residual of the rows of known feet for a motion that is possible. As printed they have no part in the
    unknown motion of the body."""
    split = _split()
    robot, _ = _walker(False)
    rng = np.random.default_rng(3)
    rates, V = rng.normal(size=robot.n), rng.normal(size=6)
    P, Q = split.PQ
    feet = P @ V + Q @ rates
    known_rows = [i for i, name in enumerate(split.rows) if name in split.known]
    known_body = [k for k, name in enumerate(("vx", "vy", "vz", "wx", "wy", "wz")) if f"body.{name}" in split.known]
    printed = P[np.ix_(known_rows, known_body)] @ V[known_body] + Q[known_rows] @ rates - feet[known_rows]
    values = dict(zip(robot.joints, rates, strict=True)) | dict(zip(split.rows, feet, strict=True))
    values |= {f"body.{name}": v for name, v in zip(("vx", "vy", "vz", "wx", "wy", "wz"), V, strict=True)}
    X, Y = (np.array([values[name] for name in side]) for side in (split.unknown, split.known))
    return Off(float(np.abs(printed).max()), float(np.abs(split.G @ X - split.H @ Y).max()))


def _solution() -> Off:
    """(18): residual of G X = H Y; as printed G# (x by 24) cannot be multiplied by Y (15)."""
    split = _split()
    Y = {f"{leg}.foot.v": 0.0 for leg in LEGS} | {"body.vx": 0.02, "body.vy": 0.0, "body.wz": 0.1}
    rates = solve.resolve(split, Y, damping=0.0)
    G = np.linalg.pinv(split.G)
    try:
        printed = float(np.abs(split.G @ (G @ rates.Y) - split.H @ rates.Y).max())
    except ValueError:
        printed = np.nan
    return Off(printed, float(np.abs(split.G @ rates.X - split.H @ rates.Y).max()))


def _null_space() -> float:
    """What d (I - G# G) rho adds to the rate of psi, (22) as the text has it: SILO4 at work, tilted by 5 deg."""
    robot = silo4()
    q = np.array([{"knee": -2.0}.get(name.split(".")[-1], 0.0) for name in robot.joints])
    base = solve.pose_from_coordinates([0.0, 0.0, 0.2, 0.06, -0.08, 0.2])
    at = solve.model(robot, q + 0.1 * np.sin(np.arange(robot.n)), base)
    known = [*(f"{leg}.foot.v" for leg in LEGS), "body.x", "body.y", "body.yaw"]
    split = solve.partition(at, known=known, axes="world")
    Y = {f"{leg}.foot.v": 0.0 for leg in LEGS} | {"body.x": 0.02, "body.y": 0.0, "body.yaw": 0.0}
    psi = Objective("text").at(at, ["fl", "fr", "hl"])
    off = solve.resolve(split, Y, method="weighted")
    on = solve.resolve(split, Y, method="weighted", gradient=psi.rho(split), d=0.05)
    return float(psi.rate(on) - psi.rate(off))


# --- stability ---

#: clockwise seen from above
STANCE = np.array([[0.30, 0.28, 0.0], [0.28, -0.31, 0.01], [-0.30, -0.29, 0.0], [-0.28, 0.30, -0.01]])
COM = np.array([-0.03, 0.05, 0.207])
#: within the first three feet
AHEAD = np.array([0.09, -0.01, 0.207])


def printed_mu(feet: Array, planes: int, com: Array = COM) -> Array:
    """(19), (21) for ``planes`` consecutive pairs of feet, the last one closing."""
    w = feet[:planes] - com
    s = np.cross(w, np.roll(w, -1, axis=0))
    return np.asarray(s @ DOWN / np.linalg.norm(s, axis=1))


def _mu(case: str) -> Off:
    """The least mu of (19), (21), and ours, against the edges of the feet in order."""
    feet = {"three": STANCE[:3], "counter-clockwise": STANCE[2::-1], "four": STANCE}[case]
    com = AHEAD if case != "four" else COM
    truth = printed_mu(STANCE if case == "four" else STANCE[:3], 4 if case == "four" else 3, com).min()
    return Off(
        float(abs(printed_mu(feet, 3, com).min() - truth)), float(abs(tip_margins(feet, DOWN, com).min_mu - truth))
    )


def _gravity() -> Off:
    """(20): unit gravity in the body's axes, by roll and pitch."""
    a, b = 0.3, -0.5
    pose = solve.pose_from_coordinates([0.0, 0.0, 0.0, a, b, 0.7])
    printed = np.array([np.sin(b), -np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b)])
    off = float(np.abs(printed - matrix_from_quaternion(pose[3:]).T @ DOWN).max())
    return Off(off, off)


def _positive_products() -> float:
    """The share of unstable stances on three feet (at random around the centre of mass) whose product of mu is
    positive."""
    rng = np.random.default_rng(6)
    feet = np.concatenate([rng.normal(size=(40_000, 3, 2)), -np.ones((40_000, 3, 1))], axis=-1)
    mu = tip_margins(feet, DOWN, np.zeros(3)).mu
    unstable = np.any(mu < 0.0, axis=-1)
    return float((np.prod(mu[unstable], axis=-1) > 0.0).mean())


def _crouch() -> float:
    """Height of the centre of mass where raising (22), x and y commanded, ends: steps of 2 mm along its gradient."""
    climb = Objective("printed", k2=0.0, k3=0.0)
    height = float(COM[2])
    for _ in range(400):
        slope = float(climb(STANCE[:3], [0.05, -0.06, height]).com[2])
        if height < 0.0 or slope == 0.0:
            break
        height += float(np.copysign(0.002, slope))
    return height


def _bracket() -> Off:
    """(22) at 6 deg of roll and pitch, k = 1: the printed bracket, and what the text describes, by ours."""
    com, tilt = AHEAD, (0.1, 0.1)
    mu = printed_mu(STANCE[:3], 3, com)
    truth = float(np.prod(mu) - tilt[0] ** 2 - tilt[1] ** 2)
    printed = float(np.prod(mu - tilt[0] ** 2 - tilt[1] ** 2))
    ours = float(Objective("text")(STANCE[:3], com, tilt).value)
    return Off(abs(printed - truth), abs(ours - truth))


def _wrong(number: int, what: str, correct: str, why: str) -> tuple[Entry, Entry]:
    place = f"({number})"
    return (
        Entry(place, what, "6 x 6 matrix and column of the rate", partial(_equation, number), "", correct, why),
        Entry(place, "entries that do not follow from Table 1", "0", partial(_entries_wrong, number), "", correct, why),
    )


ENTRIES = (
    Entry("(1)-(5)", "D, E of a row; phi-dot is the angular velocity in the frame's own axes",
          "R_i, R_i S_i, A_i, B_i", _row),
    Entry("(1)", "rates of roll, pitch and yaw of the next frame, relative error", "phi-dot = roll, pitch, yaw rates",
          _rpy_rates, "%", "phi-dot = omega, body-fixed", "the equations hold for angular velocities only"),
    Entry("(6), (7)", "P of a leg", "D_0 D_1 ... D_(n-1)", _product, "",
          "D_(n-1) ... D_1 D_0; Q = [D_(n-1) ... D_1 E_0 | ... | E_(n-1)]",
          "twists pass from the body to the foot: the last row comes first"),
    Entry("(8), (9)", "velocities of four feet of a moving SILO4", "V_SE = P V_BY + Q Gamma'", _composite, "m/s",
          tolerance=1e-8),
    Entry("(8), (9)", "rows of P, 6 m", "24", partial(_size, "P", 0)),
    Entry("(8), (9)", "columns of Q, m r", "24", partial(_size, "Q", 1)),
    Entry("Fig. 1", "SILO4", reason="photograph; its dimensions are not printed, ours are from the literature"),
    Entry("Table 1, section 3", "actuated joints", "12", lambda: float(silo4(passive=True).actuated.sum())),
    Entry("Table 1, section 3", "unactuated joints", "12", lambda: float((~silo4(passive=True).actuated).sum())),
    Entry("Table 1", "frames of a leg", "7", lambda: float(len(shoulder_to_contact(0.0).frames) - 1)),
    Entry("Table 1", "component of the sole's z down the shank, theta_4 = theta_5 = 0: d_6 a distance down", "> 0",
          _sole, "", "d_6 < 0", "z of the sole points back up the shank"),
    Entry("(10)", "body to shoulder", "6 x 6 matrix", partial(_equation, 10)),
    *_wrong(11, "shoulder to hip", "row (theta_1, 0, a_1, 90 deg)",
            "drops a_1 and the turn by 90 deg of Table 1; and theta_1 - theta_0 undoes the turn of (10)"),
    *_wrong(12, "hip to knee", "row (theta_2, 0, a_2, 0)",
          "is the row (theta_2 - 90 deg, d_2, a_2, 0); its rate is right"),
    *_wrong(13, "knee to ankle", "row 3: [a_3 s_3, -a_3 c_3, 0]",
          'sine and cosine exchanged; the text says "hip to knee"'),
    Entry("(14)", "least joints a leg for a unique solution: rank Q of SILO4 with r = 6, of m r = 24", "24",
          partial(_rank, "Q passive")),
    Entry("(14)", "joints a leg with which Q is square and of full rank", "> 6",
          lambda: _rank("Q passive") / 4.0, "", "r = 6", "with r = 6 the solution is unique, with r > 6 it never is"),
    Entry("(14)", "rank (Q : I : -P) for feet that 12 joints can move so, to be rank Q = m r", "12", partial(_rank,
          "printed"), "", "rank [Q | b] = rank Q = m r", "I alone has rank 6 m: the test refuses what can be solved"),
    Entry("(14)", "rank [Q | b] for the same feet, to be rank Q = m r", "12", partial(_rank, "ours")),
    Entry("(15)-(17)", "residual for a possible motion, feet, x, y, yaw known", "diag(P_1, P_2), diag(Q_1, Q_2)",
          _blocks, "m/s",
          "G = [Q_u, -I_u, P_u], H = [I_k, -P_k, -Q_k]",
          "rows and columns are to be selected: known feet move with the whole body"),
    Entry("(18)", "residual of G X = H Y", "X = G# Y + d (I - G# G) rho", _solution, "m/s",
          "X = G# H Y + d (I - G# G) rho", "H is missing: G# Y is not even defined"),
    Entry("(18)", "what the null space adds to d psi/dt, rho the slope by the coordinates that X moves", "> 0",
          _null_space),
    Entry("(19), (21)", "least mu, three feet, clockwise from above", "g . s_j", partial(_mu, "three")),
    Entry("(19), (21)", "least mu, three feet, counter-clockwise", "g . s_j", partial(_mu, "counter-clockwise"), "",
          "edges of the hull, clockwise", "the sign depends on the order of the feet"),
    Entry("(19), (21)", "least mu, all four feet on the ground", "j = 1 ... m - 1", partial(_mu, "four"), "",
          "all edges of the hull of the feet that stand", "leaves out a foot unless one swings"),
    Entry("(20)", "gravity in the body's axes", "(s b, -s a c b, -c a c b)", _gravity),
    Entry("(22)", "unstable stances of three feet with a positive product", "0", _positive_products, "%",
          "min mu, or a barrier on the hull", "two negative mu make a positive product: it is no test of stability"),
    Entry("(22)", "psi at 6 deg of roll and pitch", "k_1 prod(mu - k_2 a^2 - k_3 b^2)", _bracket, "",
          "k_1 prod(mu) - k_2 a^2 - k_3 b^2", "the bracket is not what the text describes"),
    Entry("(22)", "height of the body where raising psi ends, x and y commanded", "> 0", _crouch, "mm",
          "a height in psi or among the commands",
          "mu grows as the body sinks: it crouches from 207 mm down to the ground"),
)  # fmt: skip

PAPER = Paper(
    "legs",
    "Systematic Method for Kinematics Modeling of Legged Robots on Uneven Terrain",
    "M. Tarokh, M. Lee (2009)",
    "Velocities pass along an extended D-H table from the body to the feet; what is commanded is split from what is "
    "free, and the freedom left keeps the robot stable. The general equations are right when read well, the worked "
    "example is not.",
    tables=1,
    figures=1,
    equations=22,
    entries=ENTRIES,
    drawings=DRAWINGS,
)
