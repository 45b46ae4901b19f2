"""Paper *rectilinear*: Said et al. 2019. Printed lengths are in mm; two modules of 1000 mm lie between pitch joints."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, partial
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.gaits.rectilinear import Rectilinear, Transform, drive, paper_drive, pose, relative
from bodyplan.papers.drawings.rectilinear import DRAWINGS
from bodyplan.papers.entries import Entry, Off, Paper
from bodyplan.papers.stairs import ANCHORS, LINKS, SLOPES, as_printed, on_stairs

LINK = 2.0
#: figure -> anchors at the beginning (m)
CONFIGURATIONS = {
    "Fig. 8": (1.0, 2.2, 5.0),
    "Fig. 9": (1.0, 3.8, 5.0),
    "Fig. 11": (1.0, 5.0, 9.0),
}
ANCHOR = ("tail", "middle", "head")
#: what Figs. 8 and 11 print: T_WB of those anchors that can be read, drives, then lengths L1L, L1R and angles 1-4 after
#: the moves of tail, middle and head
TABLES: dict[str, tuple[dict[str, str], tuple[str, ...], tuple[tuple[str, str], ...], tuple[tuple[str, ...], ...]]] = {
    "Fig. 8": (
        {"middle": "3880.", "head": "6680."},
        ("720.", "1680.", "1680."),
        (("480.", "2800."), ("2160.", "1120."), ("2160.", "2800.")),
        (
            ("83.107897", "166.21579", "128.68089", "91.145992"),
            ("57.316361", "114.63272", "131.05616", "147.47959"),
            ("57.316361", "114.63272", "102.88936", "91.145992"),
        ),
    ),
    "Fig. 11": (
        {"tail": "2400.", "middle": "7400.", "head": "11400."},
        ("2400.", "2400.", "2400."),
        (("1600.", "4000."), ("4000.", "1600."), ("4000.", "4000.")),
        (
            ("66.421822", "132.84364", "66.421822", "0."),
            ("0.", "0.", "66.421822", "132.84364"),
            ("0.", "0.", "0.", "0."),
        ),
    ),
}


@cache
def stances(figure: str) -> tuple[Array, Array]:
    """Anchors (4, 3) m along the way, before and after each move, and drives (3,) m by the 60 % rule."""
    x = np.array(CONFIGURATIONS[figure])
    drives = paper_drive(np.diff(x))
    places = [x.copy()]
    for moved in range(3):
        x = x.copy()
        x[moved] += drives[moved]
        places.append(x)
    return np.array(places), drives


def _on_x(x: Any) -> Array:
    return np.stack([np.asarray(x, dtype=float), np.zeros(3), np.zeros(3)], axis=-1)


def _place(figure: str, anchor: int) -> float:
    return float(stances(figure)[0][-1, anchor])


def _drive(figure: str, anchor: int) -> float:
    """By the transforms (16)-(21) from where the rule puts the anchors."""
    x = stances(figure)[0]
    return float(drive(_on_x(x[0]), _on_x(x[-1])).position[anchor, 0])


def _length(figure: str, move: int, side: int) -> float:
    x = _on_x(stances(figure)[0][1 + move])
    return float(relative(x[side], x[1 + side]).L1)


def _angle(figure: str, move: int, joint: int) -> float:
    """Magnitude, as the figures have it, of one of the joints 1, 3, 5, 7."""
    found = pose([(x, 0.0) for x in stances(figure)[0][1 + move]], LINK).raise_if_failed()
    return float(abs(found.joints[joint]))


def _table(figure: str) -> Iterator[Entry]:
    places, drives, lengths, angles = TABLES[figure]
    for k, anchor in enumerate(ANCHOR):
        if anchor in places:
            yield Entry(
                figure,
                f"where the {anchor} goes, T_W{anchor[0].upper()}B",
                places[anchor],
                partial(_place, figure, k),
                "mm",
                correct="T_WTB = T_WTA + DT_WTAB = 1000 + 2400",
                why="the drive is printed a second time in place of where it leads to",
            )
    for k, anchor in enumerate(ANCHOR):
        what = f"drive of the {anchor}, DT_W{anchor[0].upper()}AB"
        yield Entry(figure, what, drives[k], partial(_drive, figure, k), "mm")
    for move, moved in enumerate(ANCHOR):
        for side, (name, between) in enumerate((("L1L", "tail to middle"), ("L1R", "middle to head"))):
            yield Entry(
                figure,
                f"{name}, {between}, {moved} moved",
                lengths[move][side],
                partial(_length, figure, move, side),
                "mm",
            )
        for joint in range(4):
            yield Entry(
                figure,
                f"angle{joint + 1} (joint {2 * joint + 1}), {moved} moved",
                angles[move][joint],
                partial(_angle, figure, move, joint),
                "deg",
            )


# --- transforms ---


@cache
def _frames() -> tuple[Array, Array]:
    """Two anchors' frames that are turned against each other."""
    out = []
    for turn, place in (((0.3, -0.4, 0.5), (1.0, 0.2, 0.3)), ((-0.2, 0.1, 0.9), (2.2, -0.1, 0.7))):
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = rotation(*turn), place
        out.append(frame)
    return out[0], out[1]


def rotation(x: float, y: float, z: float) -> Array:
    """Rz(z) Ry(y) Rx(x), which (4)-(6) take apart."""
    (cx, cy, cz), (sx, sy, sz) = np.cos([x, y, z]), np.sin([x, y, z])
    Rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    Ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    Rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(Rz @ Ry @ Rx)


def _between(make: Callable[[Any, Any], Transform]) -> Off:
    start, end = _frames()
    printed = np.linalg.inv(start) @ end
    found = make(start, end).matrix
    return Off(float(np.abs(start @ printed - end).max()), float(np.abs(start @ found - end).max()))


def _orientation(pitch: float) -> Off:
    """(4)-(6) and ours, by the rotation that they give back."""
    R = rotation(0.4, pitch, -0.7)
    if pitch == 0.5 * np.pi:  # exactly upright, as an anchor on a riser is
        R = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    (nx, ny, nz), (_, _, sz), (_, _, az) = R.T
    with np.errstate(all="ignore"):
        root = np.sqrt(1.0 - nz**2)
        printed = (np.arctan2(sz / root, az / root), np.arctan2(-nz, root), np.arctan2(ny / root, nx / root))
    frame = np.eye(4)
    frame[:3, :3] = R
    ours = Transform(frame).orientation
    return Off(float(np.abs(rotation(*printed) - R).max()), float(np.abs(rotation(*ours) - R).max()))


def _distances(which: str) -> Off:
    """L1 (horizontal) and L2 of two anchors on unequal heights."""
    start, end = np.array([1.0, 0.2, 0.3]), np.array([2.2, -0.1, 0.7])
    p = end - start
    found = relative(start, end)
    truth = {"L1": np.hypot(p[0], p[1]), "L2": np.sqrt(p @ p)}
    printed = {
        "(8)": np.sqrt(p[0] ** 2 + p[1] ** 2),
        "(9)": np.sqrt(p[0] ** 2 + p[1] ** 2 + p[2] ** 2),
        "(14)": np.sqrt(p[0] ** 2 + p[1] ** 2 + p[2] ** 2),
        "(15)": np.sqrt(p[0] ** 2 + p[2] ** 2),
    }[which]
    name = "L2" if which in ("(9)", "(14)") else "L1"
    return Off(float(abs(printed - truth[name])), float(abs(getattr(found, name) - truth[name])))


def _driven(which: str) -> Off:
    """Tail and middle after the tail of Fig. 8 has moved, and been lifted by 100 mm."""
    tail, middle = np.array([1.0, 0.0, 0.0]), np.array([2.2, 0.0, 0.0])
    moved = np.array([0.72, 0.0, 0.1])
    p = middle - (tail + moved)
    found = relative(tail, middle, moved)
    before = middle - tail
    printed, truth, ours = {
        "(27)": (before[2] + moved[2], p[2], found.position[2]),
        "(32)": (np.hypot(np.hypot(before[0], before[1]), p[2]), np.linalg.norm(p), found.L2),
        "(33)": (np.hypot(p[0], p[1]), np.hypot(p[0], p[1]), found.L1),
    }[which]
    return Off(float(abs(printed - truth)), float(abs(ours - truth)))


def _equal_drives() -> Off:
    places, drives = stances("Fig. 8")
    found = drive(_on_x(places[0]), _on_x(places[-1])).position[:, 0]
    return Off(float(np.ptp(found)), float(np.abs(found - drives).max()))


# --- claims ---


def _tail_drive(figure: str, cycle: int) -> float:
    gaps = np.diff(CONFIGURATIONS[figure])
    for _ in range(cycle - 1):
        gaps = gaps + np.diff(paper_drive(gaps))
    return float(paper_drive(gaps)[0])


def _third_cycle() -> float:
    """From tail to middle, when the drives of Fig. 8 are made a third time and the middle has moved."""
    drives = stances("Fig. 8")[1]
    tail, middle, _ = np.array(CONFIGURATIONS["Fig. 8"]) + 3.0 * drives
    return float(middle - tail)


def _share(figure: str, leg: int) -> float:
    x = _on_x(stances(figure)[0][0])
    return float(relative(x[leg], x[leg + 1]).L1) / (2.0 * LINK)


def _height(figure: str) -> float:
    """The highest elbow in the stances of a figure."""
    return float(max(pose([(x, 0.0) for x in stance], LINK).elbows[:, 1].max() for stance in stances(figure)[0][1:]))


def _support(figure: str) -> float:
    """Margin of support of one cycle by the gait, lifting by 200 mm, links of equal mass."""
    from bodyplan.ground import Plane
    from bodyplan.plan import plan
    from bodyplan.robot import snake

    robot = snake(10, 1.0, axes="alternating", first="pitch", radius=1e-3, mass=1.0)
    spacing = tuple(gap / (2.0 * LINK) for gap in np.diff(CONFIGURATIONS[figure]))
    gait = Rectilinear(anchors=3, drive="paper", spacing=spacing, lift=0.2, move_time=1.0)
    return float(plan(robot, gait, Plane(), np.linspace(0.0, 3.0, 61)).facts["support_margin"])


def _two_phase() -> float:
    from bodyplan.ground import Plane
    from bodyplan.plan import plan
    from bodyplan.robot import snake

    robot = snake(18, 1.0, axes="alternating", first="pitch", radius=1e-3, mass=1.0)
    gait = Rectilinear(anchors=5, schedule="two-phase", lift=0.2, move_time=1.0)
    return float(plan(robot, gait, Plane(), np.linspace(0.0, 2.0, 41)).facts["support_margin"])


def _angles(equation: str) -> Off:
    """A printed angle on stairs and that of ``pose``, against plane geometry."""
    printed, found, truth = as_printed(equation), pose(ANCHORS, LINKS).raise_if_failed(), on_stairs()
    places = np.insert(ANCHORS, 1, 0.0, axis=1)
    legs = relative(places[:-1], places[1:])
    ours: Array = {
        "alpha": lambda: np.arctan2(legs.position[:, 2], legs.L1),
        "beta": lambda: np.array([found.angles[0] - SLOPES[0], SLOPES[1] - found.angles[3]]),
        "phi": lambda: np.pi + np.array([found.joints[1], found.joints[3]]),
        "psi": lambda: np.array([SLOPES[0] - found.angles[1], found.angles[2] - SLOPES[1]]),
        "first": lambda: found.joints[0],
        "elbows": lambda: np.array([found.joints[1], found.joints[3]]),
        "middle": lambda: found.joints[2],
        "closing": lambda: found.closing,
        "front left": lambda: found.angles[1],
    }[printed.what]()  # type: ignore[no-untyped-call]  # lambdas have no types
    right = truth[printed.what]
    return Off(float(np.abs(printed.value - right).max()), float(np.abs(ours - right).max()))


def _equation(place: str, what: str, printed: str, correct: str = "", why: str = "") -> Entry:
    return Entry(place, what, printed, partial(_angles, place), "deg", correct, why, tolerance=1e-12)


STAIRS = "on stairs with unequal links"
SIGNED = "alpha is signed and must be subtracted where the leg is entered and added where it is left"

ENTRIES = (
    Entry("Fig. 1", "orthogonal snake", reason="photograph of the mechanism"),
    Entry("Fig. 2", "body between floor and ceiling", reason="sketch without numbers"),
    Entry("Figs. 3, 5, 6", "where T, M, H and lengths are",
          reason="sketch without numbers; the tail's move is in Fig. 7"),
    Entry(
        "section 3, before Fig. 3", "margin of support: two resting anchors suffice for stability (Fig. 8's gait)",
        "> 0", partial(_support, "Fig. 8"), "mm", "five anchors or more in two phases",
        "with three anchors moved one by one the centre of mass passes the last anchor that stands",
    ),
    Entry(
        "Fig. 4", "margin of support of five anchors in two phases, all odd ones then all even ones", "> 0",
        _two_phase, "mm"
    ),
    Entry("(1)-(3), (7), (10)-(13)", "an anchor seen from another, frames turned", "T_TA^-1 T_WM",
          partial(_between, relative), "mm"),
    Entry("(4)-(6)", "orientation, at 40 deg of pitch", "atan2 of quotients by sqrt(1 - n_z^2)",
          partial(_orientation, np.radians(40.0))),
    Entry("(4)-(6)", "orientation, at 90 deg of pitch", "atan2 of quotients by sqrt(1 - n_z^2)",
          partial(_orientation, 0.5 * np.pi), correct="theta_x after undoing theta_z",
          why="0/0 where the frame stands upright"),
    Entry("(8)", "L_1L, horizontal distance", "sqrt(P_x^2 + P_y^2)", partial(_distances, "(8)"), "mm"),
    Entry("(9)", "L_2L, distance", "sqrt(L_1L^2 + P_z^2)", partial(_distances, "(9)"), "mm"),
    Entry("(14)", "L_2R, distance", "sqrt(P_x^2 + P_y^2 + P_z^2)", partial(_distances, "(14)"), "mm"),
    Entry("(15)", "L_1R, horizontal distance", "sqrt(P_x^2 + P_z^2)", partial(_distances, "(15)"), "mm",
          "sqrt(P_x^2 + P_y^2)", "written with y up, while (8), (9) have z up"),
    Entry("(16)-(23)", "drive transforms, frames turned", "D = T_A^-1 T_B", partial(_between, drive), "mm"),
    Entry("(24)", "drives of tail, middle and head in Fig. 8", "P_TA^TB = P_MA^MB = P_HA^HB", _equal_drives, "mm",
          "every anchor has its own", "contradicts Fig. 8, which drives the tail by 720 and the others by 1680 mm"),
    Entry("(25)-(30)", "height of the middle from a tail that was lifted by 100 mm", "P_zM_H + P_dz",
          partial(_driven, "(27)"), "mm", "D_T^-1 T_TA^MA D_M; P_A + d_end - d_start for parallel frames",
          "signs and indices are copied wrongly from line to line, here twice the lift"),
    Entry("(31), (33), (34)", "L_1 after a drive", "sqrt(P_x^2 + P_y^2)", partial(_driven, "(33)"), "mm"),
    Entry("(32)", "L_2LB after the tail's drive", "sqrt(L_1L^2 + P_z^2)", partial(_driven, "(32)"), "mm",
          "sqrt(L_1LB^2 + P_z^2)", "takes the length before the drive"),
    _equation("(35)-(38)", f"slope of a leg, {STAIRS}", "atan2(P/L_1, L_1/L_2)", "atan2(P_z, L_1), signed",
              "both arguments are divided, by different lengths; and y is up"),
    _equation("(43)-(46)", f"beta, at the anchors behind and ahead, {STAIRS}", "acos((a_2^2 + L^2 - a_3^2)/(2 a_2 L))"),
    _equation("(47)-(50)", f"phi, at the elbows, {STAIRS}", "acos((a_2^2 - L^2 + a_3^2)/(2 a_2 L))",
              "acos((a_2^2 - L^2 + a_3^2)/(2 a_2 a_3))", "the denominator of the law of cosines has both links"),
    _equation("(51), (53)", f"psi_L, left at the middle, {STAIRS}", "acos((a_4^2 - a_5^2 + L_L^2)/(2 a_4 L_L))",
              "acos((a_3^2 + L_L^2 - a_2^2)/(2 a_3 L_L))", "has the links of the right side"),
    _equation("(52), (54)", f"psi_R, right at the middle, {STAIRS}", "acos((a_4^2 - a_5^2 + L_R^2)/(2 a_4 L_R))"),
    _equation("(55), (56), (62)", f"first joint, tail and head moves, {STAIRS}", "beta_L + alpha_L"),
    _equation("(63)", f"first joint, middle move, {STAIRS}", "beta_L - alpha_L", "beta_L + alpha_L", SIGNED),
    _equation("(57), (59), (64), (67)", f"elbows, with phi corrected, {STAIRS}", "180 - phi"),
    _equation("(39)-(42), (58), (61)", f"middle joint, tail and head moves, {STAIRS}",
              "psi_R + psi_L + delta_R + delta_L - 180", "psi_L + psi_R - alpha_L + alpha_R",
              SIGNED),
    _equation("(60)", f"joint at the head, {STAIRS}", "beta_R + alpha_R", "beta_R - alpha_R", SIGNED),
    _equation("(65)", f"middle joint, middle move, {STAIRS}", "psi_R + psi_L + alpha_R + alpha_L",
              "psi_L + psi_R - alpha_L + alpha_R", SIGNED),
    _equation("(66)", f"slope of the link behind the middle, {STAIRS}", "-(psi_L + alpha_L)", "alpha_L - psi_L",
          SIGNED),
    Entry("Fig. 7", "tail leg as a share of straight, of the anchors in Fig. 8", "0.3", lambda: _share("Fig. 8", 0)),
    Entry("Fig. 7", "head leg as a share of straight, of the anchors in Fig. 8", "0.7", lambda: _share("Fig. 8", 1)),
    *_table("Fig. 8"),
    Entry("Fig. 8, section 4", "displacement on entering (0.3 / 0.7), first cycle", "720", partial(_tail_drive,
          "Fig. 8", 1), "mm"),
    Entry("Fig. 8, section 4", "displacement on entering (0.3 / 0.7), tenth cycle", "720",
          partial(_tail_drive, "Fig. 8", 10), "mm", "L_TM becomes 0.4 L_TM + 0.6 L_MH",
          "the 60 % rule does not repeat where the spacings differ: entering becomes as fast as exiting was"),
    Entry("Fig. 8, section 4", "tail to middle, when the drives of Fig. 8 are made a third time", "< 4000",
          _third_cycle,
          "mm", "equal drives", "fixed unequal drives part the anchors by more than the links between them reach"),
    Entry("Fig. 9, section 4", "displacement on exiting (0.7 / 0.3), first cycle", "1680", partial(_tail_drive,
          "Fig. 9", 1), "mm"),
    Entry("Fig. 9, section 4", "displacement on exiting (0.7 / 0.3), tenth cycle", "1680",
          partial(_tail_drive, "Fig. 9", 10), "mm", "L_TM becomes 0.4 L_TM + 0.6 L_MH",
          "the 60 % rule does not repeat: exiting becomes as slow as entering was"),
    Entry("Fig. 10, section 4", "displacement of the configuration 1 / 1", "2400", partial(_tail_drive, "Fig. 11", 1),
          "mm"),
    Entry("Fig. 10, section 5", "by how much the configuration 1 / 1 is higher than 0.3 / 0.7", "> 0",
          lambda: _height("Fig. 11") - _height("Fig. 8"), "mm", "0.3 / 0.7 is the higher one",
          "the shorter of two unequal legs stands steeper"),
    *_table("Fig. 11"),
)  # fmt: skip

PAPER = Paper(
    "rectilinear",
    "Relativity Drive Transform and Segment Inverse Kinematic for Multi-configuration Rectilinear Gait",
    "S. Md Said, A. S. Ismail, T. M. A. Tuan Dir, J. Othaman, N. Ibrahim (2019)",
    "Tail, middle and head of a snake are moved one after another; transforms say by how much, inverse kinematics of "
    "two legs of two links each says what the joints do. Its two tables come out to the last digit; its formulas "
    "hold on level ground with equal links only.",
    tables=0,
    figures=11,
    equations=67,
    entries=ENTRIES,
    drawings=DRAWINGS,
)
