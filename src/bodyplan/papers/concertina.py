"""Paper *concertina*: Akbarzadeh et al. 2011. Lengths are in units of 1/omega_n, as in the paper."""

from __future__ import annotations

from functools import cache, partial
from itertools import pairwise

import numpy as np

from bodyplan.arrays import Array
from bodyplan.curves import GAMMA_STAR, ConcertinaCurve, dynamic_curve
from bodyplan.curves.dynamic import crossing_of
from bodyplan.fitting import exact_link_length, links_on_curve
from bodyplan.gaits import Concertina
from bodyplan.gaits.stretching import StretchingBody, stretching
from bodyplan.ground import Plane
from bodyplan.job import compare_mission
from bodyplan.motion import Motion
from bodyplan.papers.drawings.concertina import DRAWINGS
from bodyplan.papers.entries import Entry, Off, Paper
from bodyplan.plan import plan
from bodyplan.rates import five_point
from bodyplan.robot import snake

GAMMAS = (0.0, 0.2, 0.4, 0.6, 0.8)
FIG_8 = (0.01, 0.25, 0.55, 0.80)
MODULES, LINKS, GAMMA_MAX = 4, 26, 0.8


def printed_curve(x: Array, gamma: float, omega: float = 1.0) -> Array:
    """Eq. (1) as printed; 0/0 at gamma = 1."""
    with np.errstate(all="ignore"):
        beta = np.sqrt(1.0 - gamma**2)
        return np.asarray(np.exp(-gamma * omega * x) / beta * np.sin(omega * beta * x + np.arccos(gamma)))


def _oscillator(x: Array, gamma: float) -> Array:
    """What (1) is: the free response of a damped oscillator, F'' + 2 gamma F' + F = 0 from F = 1, F' = 0."""
    from scipy.integrate import solve_ivp

    out = solve_ivp(
        lambda _, y: (y[1], -2.0 * gamma * y[1] - y[0]), (0.0, x[-1]), (1.0, 0.0), "DOP853", x, rtol=1e-12, atol=1e-13
    )
    return np.asarray(out.y[0])


def _dynamic(gammas: tuple[float, ...]) -> Off:
    x = np.linspace(0.0, 10.0, 101)
    off = [0.0, 0.0]
    for gamma in gammas:
        truth = _oscillator(x, gamma)
        off[0] = max(off[0], float(np.abs(printed_curve(x, gamma) - truth).max()))
        off[1] = max(off[1], float(np.abs(dynamic_curve(x, gamma) - truth).max()))
    return Off(*off) if np.isfinite(printed_curve(x, gammas[-1])).all() else Off(np.nan, off[1])


def _flattening() -> float:
    """The least by which the trough rises from one gamma to the next."""
    x = np.linspace(0.0, 10.0, 2001)
    return float(np.diff([dynamic_curve(x, gamma).min() for gamma in GAMMAS]).min())


def _jump(curve: ConcertinaCurve, at: float) -> float:
    """By how much our curve jumps there, across 1e-12."""
    return abs(float(curve(at + 1e-12)) - float(curve(at - 1e-12)))


def _tail() -> Off:
    end = 0.5 * np.pi
    return Off(abs(-np.sin(end) - float(dynamic_curve(0.0, 0.0))), _jump(ConcertinaCurve([0.0] * MODULES, 0.0), end))


def _junction(contracted: bool) -> Off:
    """Between body modules 1 and 2: (3) times the value at the junction (section IV.A), and ours."""
    gamma = 0.0 if contracted else 0.4
    value = float(dynamic_curve(np.pi, gamma))
    # module 1 ends at value; (3) starts module 2 with its own sign, times |value| or times value
    second = -1.0 if contracted else -value
    return Off(abs(second - value), _jump(ConcertinaCurve([gamma] * MODULES, 0.0), 1.5 * np.pi))


def _head_start(omega: float) -> Off:
    """Where (4) puts the head; ours is the last break but the end of its wave."""
    truth = (0.5 * np.pi + MODULES * np.pi) / omega
    breaks = ConcertinaCurve([0.0] * MODULES, 0.0, omega=omega).breaks
    return Off(abs(0.5 * np.pi + MODULES * np.pi - truth), float(np.abs(breaks - truth).min()))


def _intersection(omega: float) -> Off:
    """How far from the axis the body is at x' of (6), (7); in our curve, and x' in closed form."""
    worst = [0.0, 0.0]
    for gamma in FIG_8:
        x = (2.0 * np.pi - np.arccos(gamma)) / (omega * np.sqrt(1.0 - gamma**2))
        worst[0] = max(worst[0], abs(float(printed_curve(np.array(x), gamma, omega))))
        worst[1] = max(worst[1], abs(float(dynamic_curve(crossing_of(gamma, omega, 2), gamma, omega))))
    return Off(*worst)


def _crossings(gamma: float) -> float:
    """How often the dynamic curve crosses the axis up to x' and at it."""
    end = float(crossing_of(gamma, 1.0, 2))
    signs = np.sign(dynamic_curve(np.linspace(0.0, end * (1.0 + 1e-6), 4001), gamma))
    return float(np.count_nonzero(np.diff(signs)))


def _growth() -> float:
    """The least by which x' moves on from one gamma of Fig. 8 to the next."""
    return float(np.diff([float(crossing_of(gamma, 1.0, 2)) for gamma in FIG_8]).min())


def _lateral() -> Off:
    """How far the head is from y = 0 beyond x', over all stages of stretching."""
    body = _body()
    progress = np.linspace(0.0, body.stages.total, 41)
    curve = body.curve(progress)
    x = np.max(curve.flat_from) + np.linspace(1e-9, 3.0, 20)
    off = float(np.abs(curve(x)).max())
    return Off(off, off)


@cache
def _body() -> StretchingBody:
    stages = stretching(MODULES, GAMMA_MAX, np.ones(MODULES + 2), 0.0, "linear")
    length = float(exact_link_length(LINKS, MODULES, 1.0))
    return StretchingBody(stages, np.full(LINKS, length), 1.0)


def _straight_line() -> Off:
    """Section IV.A: where the straight line begins once a module no longer crosses the axis."""
    gamma = GAMMA_MAX
    curve = ConcertinaCurve([0.1, gamma, 0.3, 0.2], 0.5)
    start = 1.5 * np.pi
    return Off(abs(float(dynamic_curve(np.pi, gamma))), _jump(curve, start + float(crossing_of(gamma, 1.0, 1))))


def _others_fixed() -> Off:
    """The largest that a joint behind the head module moves while the head stretches (first stage)."""
    body = _body()
    found = body.at(np.linspace(0.0, 1.0, 21))
    lengths, angles = body.lengths, found.angles
    ends = np.cumsum(lengths * np.cos(angles[0]))
    behind = ends < 0.5 * np.pi + MODULES * np.pi
    off = float(np.abs(angles[:, behind] - angles[0, behind]).max())
    return Off(off, off)


def _stretched_tail() -> Off:
    """Height of the tail's end when its stage is over: a multiplier at gamma's rate for one stage, and ours."""
    body = _body()
    last = body.curve(np.array([body.stages.total]))
    return Off(1.0 - GAMMA_MAX, float(np.abs(last(np.linspace(0.0, 20.0, 200))).max()))


@cache
def _cycle(contraction: str) -> Motion:
    gait = Concertina(body_modules=MODULES, gamma_max=GAMMA_MAX, contraction=contraction)
    robot = snake(LINKS, 0.05)
    return plan(robot, gait, Plane(), np.linspace(0.0, gait.period(robot), 401))


def _flat_share(contraction: str) -> float:
    """The share of the contraction in which the whole body lies flat."""
    motion = _cycle(contraction)
    contracting = motion.t > 0.5 * motion.t[-1]
    flat = np.abs(motion.q).max(axis=1) < 1e-9
    return float(flat[contracting].mean())


def _on_curve() -> Off:
    """Links by circles on the contracted curve: how far their ends are from it, and their length from 1."""
    curve = ConcertinaCurve([0.05, 0.3, 0.6, 0.2], 0.2)
    points = links_on_curve(curve, 0.8, LINKS).points
    off = max(
        float(np.abs(points[:, 1] - curve(points[:, 0])).max()),
        float(np.abs(np.linalg.norm(np.diff(points, axis=0), axis=1) - 0.8).max()),
    )
    return Off(off, off)


def _secant(omega: float) -> Off:
    """The share of links that a bare secant, from the circle's two ends on, does not put on the nearest point of the
    curve ahead; and that of ours that is not where a fine search finds it."""
    curve, bad, ours, links = ConcertinaCurve([0.0] * MODULES, 0.0, omega=omega), 0, 0, 0
    for start in np.linspace(0.0, np.pi / omega, 21):
        points = links_on_curve(curve, 1.0, 14, start=float(start)).points
        for here, there in pairwise(points):
            links += 1
            x = np.linspace(here[0], here[0] + 1.0, 2001)
            outside = np.hypot(x - here[0], curve(x) - here[1]) - 1.0 >= 0.0
            first = int(np.argmax(outside)) if outside.any() else len(x) - 1
            ours += not x[first - 1] - 1e-9 <= there[0] <= x[first] + 1e-9
            found = _by_secant(curve, here)
            bad += not abs(found - there[0]) < 1e-6
    return Off(bad / links, ours / links)


def _by_secant(curve: ConcertinaCurve, here: Array) -> float:
    def outside(x: float) -> float:
        return float(np.hypot(x - here[0], float(curve(max(x, 0.0))) - here[1]) - 1.0)

    a, b = float(here[0]) + 0.5, float(here[0]) + 1.0
    fa, fb = outside(a), outside(b)
    for _ in range(50):
        if fa == fb or abs(b) > 1e6:
            break
        a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
        if b < 0.0:
            return np.nan
        fb = outside(b)
        if abs(b - a) < 1e-13:
            break
    return b if abs(fb) < 1e-9 else np.nan


def _five_point() -> Off:
    """The median error of the five-point formula while module 4 stretches, in rad a unit of progress: a joint that
    passes a kink of the curve has none to speak of."""
    h = 0.01
    found = _body().at(np.linspace(1.2, 1.9, 71))
    error = np.abs(five_point(found.angles, h) - found.rates[:, 0])[2:-2].max(axis=1)
    return Off(float(np.median(error)), float(np.median(error)))


def _executed(mission: str) -> float:
    """Executed over planned advance of a ready mission in MuJoCo."""
    figures = compare_mission(mission).figures
    return float(figures["trial.advance_ratio"] or np.nan)


_NO_NUMBERS = "drawing or photograph of an animal without numbers"

ENTRIES = (
    Entry("Figs. 1-3, 5, section II", "scales and stages of real snakes", reason=_NO_NUMBERS),
    Entry("section II", "resistance of scales backward over forward; cost of concertina over that of other gaits",
          "four to five; seven", reason="measured on animals by others"),
    Entry("(1), Fig. 4", "dynamic curve, gamma up to 0.99", "exp(-alpha x)/beta sin(delta x + theta)",
          partial(_dynamic, (0.0, 0.3, 0.6, 0.9, 0.99))),
    Entry("(1), Fig. 4", "dynamic curve at gamma = 1, the most stretched", "exp(-alpha x)/beta sin(delta x + theta)",
          partial(_dynamic, (1.0,)), correct="exp(-g w x) (cos(d x) + g w x sinc(d x))",
          why="gamma = [0, 1] is allowed, and 0/0 at its end"),
    Entry("Fig. 4", "least rise of the trough from one gamma to the next (the peaks flatten)", "> 0", _flattening),
    Entry("Figs. 6, 7, (2)", "tail meets body module 1, contracted", "-sin(w x)", _tail, "", "+sin(w x)",
          "ends at -1 where module 1 begins at +1"),
    Entry("(3)", "body modules 1 and 2 meet, gamma 0", "(-1)^(i+1) F", partial(_junction, True)),
    Entry("(3), section IV.A", "body modules 1 and 2 meet, gamma 0.4", "(-1)^(i+1) F, times the value at the junction",
          partial(_junction, False), "", "V_k F, V_(k+1) = V_k F(pi/w; gamma_k)",
          "the value at the junction carries the sign already"),
    Entry("(4)", "where the head begins, omega_n = 1", "pi/2 + N_B pi", partial(_head_start, 1.0)),
    Entry("(4)", "where the head begins, omega_n = 2", "pi/2 + N_B pi", partial(_head_start, 2.0), "",
          "(pi/2 + N_B pi)/w", "the division by omega_n is missing here; (3) and (5) have it"),
    Entry("(5)-(7)", "distance from the axis at x', omega_n = 1.4", "(N_C pi - theta)/(w sqrt(1 - gamma^2))",
          partial(_intersection, 1.4)),
    *(Entry("Figs. 8, 9", f"crossings of the axis up to x', gamma {gamma}", "2", partial(_crossings, gamma))
      for gamma in FIG_8),
    Entry("Fig. 10", "least growth of x' from one gamma of Fig. 8 to the next", "> 0", _growth),
    Entry("Fig. 11", "what joints behind the head turn while it stretches", "the other modules remain fixed",
          _others_fixed, "rad"),
    Entry("(5), Fig. 11", "distance of the head from y = 0 beyond x', all stages", "remains on the line y = 0",
          _lateral),
    Entry("Fig. 12, section IV.A", "jump where a module of gamma 0.8 becomes a straight line", "at the junction",
          _straight_line, "", f"at its own first zero, once gamma >= {GAMMA_STAR:.5f}",
          "the curve is not at zero at the junction"),
    Entry("section IV.A", "height left when the tail is stretched", "multiplier at the rate of gamma", _stretched_tail,
          "", "its stage lasts 1/gamma_max of a module's", "1 - gamma_max is left after the time of one module"),
    Entry("section IV.B", "share of the contraction in which the whole body lies flat",
          "contract in the order of stretching",
          lambda: Off(_flat_share("literal"), _flat_share("mirror")), "%", "stretching reflected in space and time",
          "with the tail flat every module is multiplied by zero, then all folds at once", tolerance=0.03),
    Entry("Fig. 13, section VI", "two modules active at once", reason=_NO_NUMBERS + "; the option overlap does it"),
    Entry("Fig. 14, section V", "links by circles: distance from the curve, error of length", "circles", _on_curve),
    Entry("section V", "share of links off the nearest point ahead, omega_n = 1", "secant", partial(_secant, 1.0)),
    Entry("section V", "share of links off the nearest point ahead, omega_n = 3", "secant", partial(_secant, 3.0), "%",
          "bracketed, nearest ahead", "the circle meets the curve several times; a bare secant goes astray"),
    Entry("section V", "median error of joint rates, h = 0.01", "five-point formula", _five_point, "rad",
          tolerance=1e-6),
    Entry("Fig. 15, section VII", "advance executed / planned, 26 links, contraction reflected", "> 0",
          partial(_executed, "concertina-paper"),
          reason="sizes, masses and friction of the Webots model are not printed", physics=True),
    Entry("Fig. 15, section VII", "advance executed / planned, 26 links, contraction as printed", "> 0",
          partial(_executed, "concertina-literal"),
          reason="sizes, masses and friction of the Webots model are not printed", physics=True),
)  # fmt: skip

PAPER = Paper(
    "concertina",
    "Generating Snake Robot Concertina Locomotion Using a New Dynamic Curve",
    "A. Akbarzadeh, J. Safehian, J. Safehian, H. Kalani (2011)",
    "A curve of tail, body modules and head stretches and contracts; links are laid on it by circles. The paper prints "
    "formulas and drawings, but no results in numbers: what is compared are the properties that it states.",
    tables=0,
    figures=15,
    equations=7,
    entries=ENTRIES,
    drawings=DRAWINGS,
)
