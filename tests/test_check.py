"""The judge: passes honest motions, and catches every kind of spoiling."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.motion import Claim
from bodyplan.spatial.segments import segment_distance


@pytest.fixture(scope="module")
def motion():
    robot = bp.snake(26, 0.05, limits=(-1.6, 1.6), rate=8.0)
    gait = bp.Concertina(contraction="mirror")
    return bp.plan(robot, gait, bp.Corridor(0.135), np.arange(0, 501) * (gait.period(robot) / 500))


def failed_kinds(motion):
    return {line.kind for line in bp.check(motion).failures}


def test_honest_motion_passes_every_line(motion):
    report = bp.check(motion)
    assert report and report.ok and not report.failures and report.raise_if_failed() is report
    kinds = {line.kind for line in report}
    assert {
        "solved",
        "residual",
        "lengths",
        "on_curve",
        "at_rest",
        "periodic",
        "rates",
        "limits",
        "self",
        "ground",
        "presses",
    } <= kinds
    assert "checks passed" in str(report) and report.to_dict()["ok"] is True
    assert report["joint limits"].value > 0.0
    with pytest.raises(KeyError, match="there are"):
        report["nonsense"]


def spoil(array, change):
    out = np.array(array)
    change(out)
    return out


def shifted(base):
    base[200:, 1] += 0.004


def stretched(q):
    q[:, 7] *= 1.05


def one_sample(q):
    q[123, 3] += 0.02


SPOILED = {
    "base slides": ({"base": shifted}, {"at_rest", "on_curve"}),
    "one joint too large": ({"q": stretched}, {"on_curve", "at_rest"}),
    "one sample off": ({"q": one_sample}, {"on_curve"}),
    "rates of another motion": ({"qd": lambda qd: np.multiply(qd, 1.3, out=qd)}, {"rates"}),
    "rates a twentieth too large": ({"qd": lambda qd: np.multiply(qd, 1.05, out=qd)}, {"rates"}),
    "rates with the wrong sign": ({"qd": lambda qd: np.negative(qd, out=qd)}, {"rates"}),
    "noise on the rates": ({"qd": lambda qd: np.add(qd, 20.0 * (-1.0) ** np.arange(501)[:, None], out=qd)}, {"rates"}),
    "no rates": ({"qd": lambda qd: qd.fill(0.0), "qdd": lambda qdd: qdd.fill(1e6)}, {"rates"}),
    "one joint without rates": ({"qd": lambda qd: qd[:, 3].fill(0.0)}, {"rates"}),
    "one sample wild": ({"qd": lambda qd: qd.__setitem__(100, 1000.0 * qd[100])}, {"rates"}),
    "accelerations backwards": ({"qdd": lambda qdd: np.negative(qdd, out=qdd)}, {"rates"}),
    "no accelerations": ({"qdd": lambda qdd: qdd.fill(0.0)}, {"rates"}),
    "floating": ({"base": lambda b: b.__setitem__((slice(None), 2), 1.0)}, {"on_floor"}),
    "turned after a cycle": (
        {"base": lambda b: b.__setitem__((-1, slice(3, 7)), [np.sqrt(0.5), 0, 0, np.sqrt(0.5)])},
        {"periodic"},
    ),
    "too fast": ({"qd": lambda qd: qd.__setitem__((300, 4), 9.0)}, {"limits"}),
    "beyond a joint limit": ({"q": lambda q: q.__setitem__((10, 4), 2.0)}, {"limits"}),
    "sunk into the floor": ({"base": lambda b: b.__setitem__((slice(None), 2), 0.010)}, {"ground"}),
    "deeper into the wall": ({"base": lambda b: b.__setitem__((slice(None), 1), 0.003)}, {"presses"}),
    "planner's own residual": ({"residual": lambda r: r.__setitem__(5, 1e-3)}, {"residual"}),
    "not closed": ({"q": lambda q: q.__setitem__((-1, 20), q[-1, 20] + 1e-6)}, {"periodic"}),
    "unsolved sample": ({"status": lambda s: s.__setitem__(7, "too_tight")}, {"solved"}),
    "folded through itself": ({"q": lambda q: q.__setitem__((slice(100, 120), slice(5, 11)), 0.9)}, {"self"}),
}


@pytest.mark.parametrize("name", list(SPOILED))
def test_spoiled_motion_is_caught(motion, name):
    changes, expected = SPOILED[name]
    spoiled = motion.replace(**{field: spoil(getattr(motion, field), change) for field, change in changes.items()})
    assert expected <= failed_kinds(spoiled)


def test_spoiled_claims_are_caught(motion):
    def with_claim(kind, **data):
        claims = [Claim(c.kind, c.label, {**c.data, **data}) if c.kind == kind else c for c in motion.claims]
        return motion.replace(claims=claims)

    assert "periodic" in failed_kinds(with_claim("periodic", advance=[0.2, 0.0, 0.0]))
    assert "on_curve" in failed_kinds(with_claim("on_curve", unit=0.058))
    assert "presses" in failed_kinds(with_claim("presses", depth=0.001))
    assert "at_rest" in failed_kinds(with_claim("at_rest", frames=["link26", "base"]))
    with pytest.raises(bp.UnknownNameError, match="at_rest"):
        bp.check(motion.replace(claims=[Claim("at_res", "x")]))


def test_what_cannot_be_tested_says_so(motion):
    short = motion.replace(
        **{f: getattr(motion, f)[:50] for f in ("t", "base", "q", "qd", "qdd", "residual", "status")},
        claims=[c for c in motion.claims if c.kind == "periodic"],
    )
    line = bp.check(short)["the cycle closes"]
    assert line.passed is None and "shorter" in line.detail and "not tested" in str(line)


@settings(max_examples=60, deadline=None)
@given(
    data=st.lists(st.floats(-1.0, 1.0), min_size=12, max_size=12),
    degenerate=st.sampled_from(["no", "point", "parallel"]),
)
def test_segment_distance_against_a_grid(data, degenerate):
    p, q = np.array(data).reshape(2, 2, 3)
    if degenerate == "point":
        p[1] = p[0]
    if degenerate == "parallel":
        q[1] = q[0] + 0.7 * (p[1] - p[0])
    exact = float(segment_distance(p, q))
    s = np.linspace(0, 1, 161)
    a, b = p[0] + s[:, None] * (p[1] - p[0]), q[0] + s[:, None] * (q[1] - q[0])
    grid = np.linalg.norm(a[:, None] - b[None], axis=-1).min()
    assert exact <= grid + 1e-12
    assert grid - exact < 0.03
    assert exact == pytest.approx(float(segment_distance(q, p)), abs=1e-12)


def test_crossing_segments_touch():
    p, q = np.array([[-1.0, 0, 0], [1, 0, 0]]), np.array([[0.3, -1, 0.25], [0.3, 1, 0.25]])
    assert float(segment_distance(p, q)) == pytest.approx(0.25, abs=1e-15)


def test_coarse_sampling_is_not_a_fault():
    robot, gait = bp.snake(26, 0.05), bp.Concertina(contraction="mirror")
    coarse = bp.plan(robot, gait, bp.Plane(), np.linspace(0, gait.period(robot), 31))
    assert bp.check(coarse).ok, str(bp.check(coarse))
