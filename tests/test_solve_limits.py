"""Resolved rates within limits, against another solver, and what is said where there are none."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import null_space
from scipy.optimize import linprog, nnls

import bodyplan as bp
from bodyplan.errors import InputError, MissingExtraError, SolveError, UnknownNameError
from bodyplan.robot.masses import center_of_mass
from bodyplan.solve.limits import inequalities
from bodyplan.solve.quadratic import nearest
from bodyplan.solve.stability import tip_margins
from solve_cases import LEGS, crouching

Limits, Metric, resolve = bp.solve.Limits, bp.solve.Metric, bp.solve.resolve
KNOWN = [*(f"{leg}.foot.v" for leg in LEGS), "body.x", "body.y", "body.yaw"]
STILL: dict[str, Any] = {f"{leg}.foot.v": 0.0 for leg in LEGS} | {"body.y": 0.0, "body.yaw": 0.0}
NO_LIMITS = Limits(joints=False, rates=False)


def walking(seed: int = 0, known: list[str] = KNOWN, **options: Any) -> Any:
    robot = bp.silo4(**options)
    rng = np.random.default_rng(seed)
    base = bp.solve.pose_from_coordinates([0.0, 0.0, 0.2, 0.05, -0.04, 0.1])
    return bp.solve.partition(robot, crouching(robot, rng), base, known=known, axes="world")


def least_distance(A: np.ndarray, h: np.ndarray) -> np.ndarray:
    """argmin |z| with A z <= h, by non-negative least squares (Lawson and Hanson 1974, chapter 23)."""
    E, f = np.vstack([-A.T, -h]), np.eye(A.shape[1] + 1)[-1]
    u, _ = nnls(E, f, maxiter=1000)
    r = E @ u - f
    return np.asarray(-r[:-1] / r[-1])


# --- the quadratic program ----------------------------------------------------------------------------------


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 20))
def test_nearest_point_within_half_spaces(seed: int, k: int, rows: int) -> None:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(rows, k)) * np.exp(rng.normal(size=(rows, 1)))
    h = A @ rng.normal(size=k) + rng.uniform(0.0, 0.5, rows) * np.linalg.norm(A, axis=1)
    got = nearest(A, h)
    assert got.feasible
    want = least_distance(A, h) if np.any(h < 0.0) else np.zeros(k)
    assert np.abs(got.z - want).max() < 1e-8
    assert np.all((A @ got.z - h) / np.linalg.norm(A, axis=1) < 1e-9)
    # rows that push are met, and push outwards only
    push = got.pushing
    assert np.abs((A @ got.z - h)[push]).max(initial=0.0) < 1e-8
    if push.any():
        assert nnls(-A[push].T, got.z)[1] < 1e-7


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_half_spaces_without_a_point(seed: int, k: int) -> None:
    """Rows of which a positive combination says 0 <= -0.2, among others that do not matter."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(k + 1, k))
    y = null_space(A.T)[:, 0]
    share = np.abs(y) * np.linalg.norm(A, axis=1)
    assume(share.min() > 1e-3 * share.max())  # of one that hardly takes part it cannot be told
    A = A / np.linalg.norm(A, axis=1, keepdims=True) * np.sign(y)[:, None]  # share > 0 combines the rows to nothing
    point = rng.normal(size=k)
    h = A @ point - 0.2
    loose = rng.normal(size=(5, k))
    rows, bounds = np.vstack([A, loose]), np.concatenate([h, loose @ point + 50.0 * np.linalg.norm(loose, axis=1)])
    got = nearest(rows, bounds)
    assert not got.feasible
    assert got.solved
    # all of the first rows that matter, and none of the others
    assert got.pushing.tolist() == [True] * (k + 1) + [False] * 5
    # the least sum of excesses, by linear programming
    L, unit = len(rows), np.linalg.norm(rows, axis=1)
    lp = linprog(
        np.concatenate([np.zeros(k), np.ones(L)]),
        A_ub=np.hstack([rows / unit[:, None], -np.eye(L)]),
        b_ub=bounds / unit,
        bounds=[(None, None)] * k + [(0, None)] * L,
    )
    assert np.maximum((rows @ got.z - bounds) / unit, 0.0).sum() == pytest.approx(lp.fun, abs=1e-5)


# --- resolved rates -----------------------------------------------------------------------------------------


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_rates_within_limits_against_another_solver(seed: int) -> None:
    rng = np.random.default_rng(seed)
    part = walking(seed, passive=bool(rng.integers(2)))
    Y = part.values(STILL | {"body.x": 0.03})
    metric = np.exp(rng.normal(size=len(part.unknown)))
    free = resolve(part, Y, metric=metric)
    # some components held below what they would be
    names = list(rng.choice([n for n in part.unknown if ".foot." not in n], 3, replace=False))
    caps = {name: float(abs(free[name]) * rng.uniform(0.6, 1.2) + 1e-4) for name in names}
    limits = Limits(joints=False, rates=False, components=caps)
    got = resolve(part, Y, method="qp", metric=metric, limits=limits)
    N = null_space(part.G, rcond=1e-12) if part.G.shape[0] < part.G.shape[1] else np.zeros((part.G.shape[1], 0))
    root = np.sqrt(metric)
    columns = [part.column(name) for name in names]
    C = np.vstack([np.eye(len(metric))[columns], -np.eye(len(metric))[columns]])
    h = np.concatenate([list(caps.values())] * 2) - C @ free.X
    R = np.linalg.qr(root[:, None] * N, mode="r")
    B = N @ np.linalg.inv(R)
    feasible = linprog(np.zeros(B.shape[1]), A_ub=C @ B, b_ub=h, bounds=(None, None)).status == 0
    assert (got.status == "ok") == feasible
    assert got.residual < 1e-11
    if feasible:
        want = free.X + B @ least_distance(C @ B, h) if np.any(h < 0) else free.X
        assert np.abs(got.X - want).max() < 1e-6 * (1.0 + np.abs(want).max())
        assert np.all(np.abs([float(got[name]) for name in names]) < np.array(list(caps.values())) + 1e-9)
        assert got.excess.max() == 0.0
    else:
        assert got.excess.max() > 0.0
        assert "no rates keep within all of" in got.reason


def test_limits_that_are_not_reached_change_nothing() -> None:
    part = walking()
    Y, rho = STILL | {"body.x": 0.01}, {"body.z": 0.01}
    weighted, qp = resolve(part, Y, method="weighted", rho=rho), resolve(part, Y, method="qp", rho=rho)
    assert np.array_equal(weighted.X, qp.X)
    what = [f"{side} {kind}" for kind in ("limit", "rate") for side in ("lower", "upper")]
    assert qp.limits == tuple(f"{kind} of {joint}" for kind in what for joint in part.model.robot.joints)
    assert qp.excess.shape == qp.pushing.shape == (len(qp.limits),)
    assert not qp.pushing.any()


def test_joint_limits_are_approached_and_never_crossed() -> None:
    """Steps as long as the horizon towards the limit end on it."""
    robot = bp.silo4()
    q = crouching(robot)
    k = robot.joint_index("fl.hip")
    at, base = bp.solve.model(robot, q), [0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0]
    part = bp.solve.partition(at.at(q, base), known=["body"], feet=None)
    limits = Limits(horizon=0.2, rates=False)
    high = robot.limits[k, 1]
    gaps = []
    for _ in range(12):
        part = part.at(q, base)
        rates = resolve(part, {"body": 0.0}, method="qp", rho={"fl.hip": 3.0}, limits=limits)
        q = q + 0.1 * rates.qd
        gaps.append(high - q[k])
    assert np.all(np.array(gaps) > 0.0)
    # half of a horizon a step: the gap halves
    assert np.abs(np.divide(gaps[-5:], gaps[-6:-1]) - 0.5).max() < 1e-6
    q[k] = high - 0.05
    rates = resolve(part.at(q, base), {"body": 0.0}, method="qp", rho={"fl.hip": 3.0}, limits=limits)
    assert q[k] + 0.2 * rates.qd[k] == pytest.approx(high, abs=1e-12)
    assert dict(zip(rates.limits, rates.pushing, strict=True))["upper limit of fl.hip"]
    # beyond the limit it has to come back
    q[k] = high + 0.01
    rates = resolve(part.at(q, base), {"body": 0.0}, limits=limits)
    assert rates["fl.hip"] == pytest.approx(-0.05, abs=1e-12)


def test_joint_rates_are_kept() -> None:
    part = walking(1)
    robot = part.model.robot
    Y = STILL | {"body.x": 0.3}
    free = resolve(part, Y, method="weighted")
    most = float(np.abs(free.qd).max())
    slow = bp.silo4(rate=0.9 * most)
    held = resolve(bp.solve.partition(slow, part.model.q, part.model.base, known=KNOWN, axes="world"), Y, method="qp")
    assert held.status == "ok"
    assert np.abs(held.qd).max() == pytest.approx(0.9 * most, abs=1e-12)
    assert held.residual < 1e-14
    pushed = [name for name, pushes in zip(held.limits, held.pushing, strict=True) if pushes]
    assert pushed
    assert all(name.split(" ")[1] == "rate" for name in pushed)
    assert robot.rates[0] == np.pi / 2


def test_height_of_the_body_is_held() -> None:
    part = walking(2)
    z = float(part.model.base[2])
    Y = STILL | {"body.x": 0.02}
    for low, high, rho in ((z - 0.3, z + 0.004, 9.0), (z - 0.003, z + 0.3, -9.0)):
        limits = Limits(joints=False, rates=False, height=(low, high), horizon=0.1)
        rates = resolve(part, Y, method="qp", rho={"body.z": rho}, limits=limits)
        rise = float(rates["body.z"])
        assert rise == pytest.approx(0.04 if rho > 0 else -0.03, abs=1e-12)
        assert rates.status == "ok"
    # the body as a twist: the same height, through its axes
    known = [*KNOWN[:4], "body.w"]
    twist = bp.solve.partition(part.model, known=known, axes="world")
    still = dict.fromkeys(known, 0.0)
    limits = Limits(joints=False, rates=False, height=(0.0, z + 0.004))
    rates = resolve(twist, still, method="qp", rho={"body.vz": 9.0}, limits=limits)
    up = bp.spatial.matrix_from_quaternion(part.model.base[3:])[2]
    assert up @ rates.twist[:3] == pytest.approx(0.04, abs=1e-12)


def test_reach_and_its_gradient() -> None:
    rng = np.random.default_rng(3)
    robot = bp.silo4(passive=True)
    q = crouching(robot, rng)
    part = bp.solve.partition(robot, q, known=["fl.foot.v"])
    limits = Limits(joints=False, rates=False, reach=(0.05, 0.6), horizon=0.5)
    rows = inequalities(part, limits)
    assert rows.labels[:2] == ("lower reach of fl.foot", "upper reach of fl.foot")

    def distance(q: np.ndarray, leg: str) -> float:
        poses = robot.forward(q)
        return float(np.linalg.norm(poses[f"{leg}.foot"][:3] - poses[f"{leg}.shoulder"][:3]))

    for i, leg in enumerate(LEGS):
        assert rows.h[2 * i] == pytest.approx((distance(q, leg) - 0.05) / 0.5, abs=1e-14)
        assert rows.h[2 * i + 1] == pytest.approx((0.6 - distance(q, leg)) / 0.5, abs=1e-14)
        for k, name in enumerate(robot.joints):
            e = 1e-6 * np.eye(robot.n)[k]
            slope = (distance(q + e, leg) - distance(q - e, leg)) / 2e-6
            assert rows.C[2 * i + 1, part.column(name)] == pytest.approx(slope, abs=1e-9)
            assert rows.C[2 * i, part.column(name)] == -rows.C[2 * i + 1, part.column(name)]


def test_reach_stops_a_body_before_its_legs_are_stretched() -> None:
    part = walking(4)
    model = part.model
    shoulders = model.robot.forward(model.q, model.base)
    r = [float(np.linalg.norm(model.positions[i] - shoulders[f"{leg}.shoulder"][:3])) for i, leg in enumerate(LEGS)]
    limits = Limits(joints=False, rates=False, reach={"fl": (0.1, r[0] + 0.002)}, horizon=0.1)
    rates = resolve(part, STILL | {"body.x": 0.0}, method="qp", rho={"body.z": 9.0}, limits=limits)
    assert rates.status == "ok"
    assert rates.pushing.tolist() == [False, True]
    h = 1e-6
    moved = []
    for s in (-h, h):
        poses = model.robot.forward(model.q + s * rates.qd)
        moved.append(np.linalg.norm(poses["fl"][:3] - poses["fl.shoulder"][:3]))
    assert (moved[1] - moved[0]) / (2 * h) == pytest.approx(0.02, abs=1e-9)


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["mass", "base", (0.03, -0.02, 0.05)]))
def test_rates_of_the_margins_are_differences(seed: int, com: Any) -> None:
    """Robots that slide, swing a leg and turn, by small steps of their own motion."""
    rng = np.random.default_rng(seed)
    part = walking(seed % 100, known=["fl.foot.v", "fr.foot", "hl.foot.v", "hr.knee"])
    model, gravity = part.model, (0.2, -0.1, -1.0)
    stance = [list(LEGS), ["hr", "fl", "hl"]][seed % 2]
    X = resolve(part, rng.normal(size=len(part.known)), rho=rng.normal(size=len(part.unknown)))
    limits = Limits(joints=False, rates=False, margin=0.01, stance=stance, com=com, gravity=gravity, horizon=0.5)
    rows = inequalities(part, limits)
    assert rows.labels[0].startswith("lower margin over ")

    def distances(step: float) -> dict[tuple[str, str], float]:
        twist = step * X.twist
        turned = bp.spatial.multiply(model.base[3:], bp.spatial.quaternion_exp(twist[3:]))
        base = np.concatenate([model.base[:3] + bp.spatial.rotate(model.base[3:], twist[:3]), turned])
        moved = model.at(model.q + step * X.qd, base)
        feet = moved.positions[[model.feet.index(f"{leg}.foot") for leg in stance]]
        center = center_of_mass(model.robot, moved.q) if com == "mass" else np.zeros(3) if com == "base" else com
        place = base[:3] + bp.spatial.rotate(base[3:], np.array(center))
        got = tip_margins(feet, gravity, place)
        return {(stance[i], stance[j]): got.distance[k] for k, (i, j) in enumerate(got.edges[: got.count])}

    now, before, after = distances(0.0), distances(-1e-6), distances(1e-6)
    rate = rows.C @ X.X + rows.D @ X.Y
    assert len(now) == len(rows.labels)
    for label, C, h in zip(rows.labels, rate, rows.h, strict=True):
        edge = next(e for e in now if label == f"lower margin over {e[0]}.foot-{e[1]}.foot")
        assert h == pytest.approx((now[edge] - 0.01) / 0.5, abs=1e-12)
        assert (before[edge] - after[edge]) / 2e-6 == pytest.approx(C, abs=1e-6 * (1.0 + abs(C)))


def test_the_centre_of_mass_is_held_inside_of_its_feet() -> None:
    """Pushed towards an edge, steps of half a horizon halve the way that is left to the bound."""
    robot = bp.silo4()
    q, base = crouching(robot), np.array([0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0])
    stance = ["fl", "fr", "hl"]
    known = [*(f"{leg}.foot.v" for leg in LEGS), "body.z", "body.roll", "body.pitch", "body.yaw"]
    part = bp.solve.partition(robot, q, base, known=known, axes="world")
    limits = Limits(joints=False, rates=False, margin=0.02, stance=stance, com="base", horizon=0.1)
    feet = part.model.positions[[part.model.feet.index(f"{leg}.foot") for leg in stance]]
    gaps = [float(tip_margins(feet, com=base[:3]).min_distance) - 0.02]
    assert gaps[0] < 0.0  # on the diagonal: it has to come back first
    for _ in range(4):
        rates = resolve(part, dict.fromkeys(known, 0.0), rho={"body.x": -2.0, "body.y": -2.0}, limits=limits)
        assert rates.status == "ok" and rates.residual < 1e-11
        assert [n for n, pushes in zip(rates.limits, rates.pushing, strict=True) if pushes]
        q = q + 0.05 * rates.qd
        base[:3] += 0.05 * rates.twist[:3]
        part = part.at(q, base)
        gaps.append(float(tip_margins(feet, com=base[:3]).min_distance) - 0.02)
    assert gaps[1] == pytest.approx(0.5 * gaps[0], abs=1e-15)
    assert np.abs(np.divide(gaps[2:], gaps[1:-1]) - 0.5).max() < 1e-3  # joints that step so far move feet a little
    # within the bound and not pushed: as without it
    free = Limits(joints=False, rates=False, margin=-1.0, stance=stance, com="base")
    plain = resolve(part, dict.fromkeys(known, 0.0), rho={"body.x": 0.01}, method="weighted")
    assert np.array_equal(resolve(part, dict.fromkeys(known, 0.0), rho={"body.x": 0.01}, limits=free).X, plain.X)


def test_a_margin_that_cannot_be_kept_is_named() -> None:
    part = walking(3, known=[*KNOWN, "body.z", "body.roll", "body.pitch"])
    Y = dict.fromkeys(part.known, 0.0) | {"body.x": 3.0}
    rates = resolve(part, Y, limits=Limits(joints=False, rates=False, margin=0.1, com="base"))
    assert rates.status == "infeasible" and "lower margin over f" in rates.reason
    # as many rows as pairs of feet that are an edge in any of a batch
    q = np.stack([part.model.q] * 3)
    tilted = bp.solve.pose_from_coordinates([[0.0, 0.0, 0.2, r, 0.0, 0.0] for r in (0.0, 0.5, 2.5)])
    many = part.at(q, tilted)
    rows = inequalities(many, Limits(joints=False, rates=False, margin=0.05))
    for k in range(3):
        one = inequalities(part.at(q[k], tilted[k]), Limits(joints=False, rates=False, margin=0.05))
        told = dict(zip(one.labels, one.h, strict=True))
        for i, label in enumerate(rows.labels):
            assert rows.h[k, i] == pytest.approx(told.get(label, 1.0), abs=1e-12)
            assert label in told or not (rows.C[k, i].any() or rows.D[k, i].any())


# --- what cannot be done ------------------------------------------------------------------------------------


def test_infeasible_names_the_limits_in_conflict() -> None:
    part = walking(5, known=[*KNOWN, "body.z"])
    z = float(part.model.base[2])
    Y = STILL | {"body.x": 0.0, "body.z": 0.1}
    rates = resolve(part, Y, limits=Limits(height=(0.0, z + 0.004)))
    assert rates.status == "infeasible"
    assert rates.reason == (
        "no rates keep within all of: upper height; those that exceed them by the least exceed upper height by 0.06"
    )
    assert rates["body.z"] == 0.1
    assert rates.residual < 1e-12
    with pytest.raises(SolveError, match="infeasible: no rates keep within all of: upper height"):
        rates.raise_if_failed()


def test_limits_that_contradict_each_other_through_the_robot() -> None:
    """All feet planted, the body must rise for one limit, and for another may not."""
    part = walking(6)
    z = float(part.model.base[2])
    limits = Limits(horizon=0.1, height=(z + 0.01, z + 1.0), components={"body.z": 0.02}, joints=False, rates=False)
    rates = resolve(part, STILL | {"body.x": 0.0}, limits=limits)
    assert rates.status == "infeasible"
    names = [name for name, part_of in zip(rates.limits, rates.pushing, strict=True) if part_of]
    assert names == ["lower height", "upper rate of body.z"]
    # 0.1 m/s are wanted and 0.02 m/s allowed: together they are exceeded by the difference
    assert rates.excess.sum() == pytest.approx(0.08, abs=1e-6)
    assert rates.residual < 1e-12
    assert 0.02 - 1e-6 < rates["body.z"] < 0.1 + 1e-6


def test_one_of_many_is_infeasible() -> None:
    part = walking(7)
    limits = Limits(components={"fl.knee": 0.2, "fl.hip": 0.2, "fl.shoulder": 0.2, "body.z": 1e-6}, horizon=0.05)
    rates = resolve(part, STILL | {"body.x": np.array([0.0, 2.0, 0.001])}, limits=limits)
    assert rates.status.tolist() == ["ok", "infeasible", "ok"]
    assert rates.reason[0] == rates.reason[2] == ""
    assert "rate of fl." in rates.reason[1]
    with pytest.raises(SolveError, match="infeasible at index 1"):
        rates.raise_if_failed()


def test_equations_in_conflict_are_told_before_limits() -> None:
    part = walking(8, known=[*KNOWN[:4], "body", "fl.knee"])
    still = dict.fromkeys(part.known, 0.0) | {"fl.knee": 0.3}
    rates = resolve(part, still, method="qp")
    assert rates.status == "conflict"
    assert "fl.knee" in rates.reason


def test_without_clarabel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "clarabel", None)
    part = walking(9)
    assert resolve(part, STILL | {"body.x": 0.01}, method="qp").status == "ok"  # no limit reached: not needed
    with pytest.raises(MissingExtraError, match=r"pip install 'bodyplan\[solve\]'"):
        resolve(part, STILL | {"body.x": 0.01}, limits=Limits(components={"body.z": 1e-7, "body.roll": 1e-7}))


def test_nothing_heavy_is_loaded_before_it_is_used() -> None:
    code = (
        "import sys, bodyplan, bodyplan.solve\n"
        "print([m for m in ('clarabel', 'scipy.optimize', 'scipy.sparse', 'mujoco', 'sympy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_refusals() -> None:
    for options, text in (
        ({"horizon": 0.0}, "Limits.horizon"),
        ({"joints": 1}, "Limits.joints: must be True or False"),
        ({"height": (0.2, 0.1)}, r"Limits.height: must be \(low, high\) with low < high"),
        ({"height": 0.2}, "Limits.height"),
        ({"reach": {"fl": (0.2,)}}, r"Limits.reach\['fl'\]"),
        ({"reach": (0.3, 0.3)}, "Limits.reach"),
        ({"components": {"body.z": -1.0}}, r"Limits.components\['body.z'\]"),
        ({"components": {"body.z": (1.0, -1.0)}}, r"Limits.components\['body.z'\]"),
        ({"components": 3}, "Limits.components: expected a mapping"),
        ({"margin": np.nan}, "Limits.margin"),
        ({"stance": ["fl", "fr", "hl"]}, "Limits.margin: stance, com and gravity say of what"),
        ({"margin": 0.0, "stance": ["fl", "fr"]}, "Limits.stance: a margin needs three feet or more, got 'fl, fr'"),
        ({"margin": 0.0, "gravity": (0.0, 1.0)}, "Limits.gravity"),
        ({"margin": 0.0, "com": (0.0, 1.0)}, "Limits.com"),
    ):
        with pytest.raises(InputError, match=text):
            Limits(**options)
    part = walking()
    Y = STILL | {"body.x": 0.0}
    with pytest.raises(UnknownNameError, match=r"Limits.components.*body.height"):
        resolve(part, Y, limits=Limits(components={"body.height": 1.0}))
    with pytest.raises(UnknownNameError, match=r"Limits.reach"):
        resolve(part, Y, limits=Limits(reach={"fl.knee": (0.1, 0.2)}))
    rigid = bp.Robot.from_rows({"a": [bp.Row(a=0.1)], "b": [bp.Row(theta=bp.Joint("b"), a=0.1)]})
    fixed = bp.solve.partition(rigid, [0.1], known=["a.v"])
    with pytest.raises(InputError, match=r"no joint of its chain moves 'a.1'"):
        resolve(fixed, np.zeros(3), limits=Limits(reach=(0.0, 1.0)))


def test_infinite_bounds_make_no_rows() -> None:
    part = walking()
    rows = inequalities(part, Limits(joints=False, rates=False, height=(0.1, np.inf), reach=(-np.inf, 0.5)))
    assert rows.labels == ("lower height", *(f"upper reach of {leg}.foot" for leg in LEGS))
    assert inequalities(part, NO_LIMITS).labels == ()
    rates = resolve(part, STILL | {"body.x": 0.01}, limits=NO_LIMITS)
    assert rates.status == "ok"
    assert rates.reason == ""
